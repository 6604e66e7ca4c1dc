!> The modes of a large machine that are wanted, by band matrices.
!>
!> They go on from its lowest undamped modes, or from the ones in a range of frequencies, whose number is counted.
!> More undamped modes are taken than are wanted: damping couples neighbours, and lowers frequencies.
module nocdyn_large_modes
  use nocdyn_band_pencil, only: band_pencil_t, new_band_pencil
  use nocdyn_damped_bands, only: damped_modes_t, find_damped, most_internal
  use nocdyn_element_coordinates, only: new_element_coordinates
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_linearisation, only: find_slopes, has_turning_losses, held_elements, linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_choice, only: keep_numbers, modes_choice_t, note_choice
  use nocdyn_mode_pairs, only: mode_pairs_t
  use nocdyn_modes, only: fill_bodies, fill_mode, mode_oscillating, mode_t, order_of
  use nocdyn_operating_point, only: operating_point_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: append, counted, string_t, to_text
  use nocdyn_undamped_bands, only: band_modes
  use nocdyn_units, only: from_si, in_si, unit_hz
  implicit none (type, external)
  private

  public :: find_large_modes

  integer, parameter :: most_by_default = 1000   ! coordinates of a machine all of whose modes are found
  integer, parameter :: default_modes = 100      ! of a machine with more
  integer, parameter :: most_numbers = 5000000   ! coordinates times modes
  integer, parameter :: least_margin = 12        ! undamped modes beside the ones that are wanted
  real(wp), parameter :: negligible = 1.0e-200_wp   ! eigenvalue that is zero [1/s]

  !> The damped modes, and the undamped ones that they go on from.
  type :: found_t
    type(linearisation_t) :: linear              ! of the undamped modes that are wanted
    real(wp), allocatable :: natural(:)          ! of the undamped modes, by the numbers of `damped` [rad/s]
    type(damped_modes_t) :: damped
    integer, allocatable :: chosen(:)            ! modes of `damped`
  end type found_t

contains

  !> Finds the modes that are wanted, in the order of `order_of`, and the undamped modes that they go on from. An obstacle says
  !> why these are not certain.
  subroutine find_large_modes(point, choice, elastic, has_fallback, linear, modes, obstacle, error)
    type(operating_point_t), intent(inout) :: point   !! gets notes on modes that are left out
    type(modes_choice_t), intent(in) :: choice
    integer, intent(in) :: elastic(:)                 !! elements whose shares in the potential energy are wanted
    logical, intent(in) :: has_fallback               !! whether dense matrices are affordable: else a small error of what does
                                                      !! not oscillate is no obstacle
    type(linearisation_t), intent(out) :: linear      !! without `matrix`
    type(mode_t), allocatable, intent(out) :: modes(:)
    character(len=:), allocatable, intent(out) :: obstacle   !! '': none
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: held(:)
    integer :: wanted(2)
    type(band_pencil_t) :: pencil
    type(found_t) :: found
    type(slopes_t) :: slopes

    obstacle = ''
    call find_slopes(point%formulation, point%t, point%y, slopes, error)
    if (allocated(error)) return
    if (has_turning_losses(point%formulation)) obstacle = 'its teeth have losses'
    if (has_fallback .and. any(abs(slopes%mean_damping) > 0)) obstacle = 'torques of it follow the mean speed of a cycle'
    if (obstacle /= '') return
    allocate (held, source=held_elements(point%formulation))
    associate (machine => point%formulation%machine)
      call new_band_pencil(machine, new_element_coordinates(machine%elements, machine%coordinates), slopes%stiffness, held, &
                           pencil, error)
      if (allocated(error)) return
      if (pencil%rigid == pencil%modes) then
        obstacle = 'nothing of it is elastic'
        return
      end if
      call choose_numbers(pencil, choice, wanted, error)
      if (.not. allocated(error)) call find_covering(machine, pencil, slopes, held, choice, wanted, found, error)
      if (allocated(error)) return
      call find_obstacle(machine, found%damped, found%chosen, has_fallback, obstacle)
      if (obstacle /= '') return
      call put_modes(point, slopes, elastic, found, modes)
      if (.not. has_fallback) call note_approximate(slopes, found, point%notes)
      linear = found%linear
      associate (flexible => pencil%modes - pencil%rigid)
        call note_choice(choice, flexible, max(0, wanted(1) - 1 - pencil%rigid), count(modes%kind == mode_oscillating), &
                         point%notes)
      end associate
      if (machine%elements%internal%count > most_internal) then
        call append(point%notes, 'the modes of its ' // to_text(machine%elements%internal%count) // ' internal states that ' // &
                                 'do not oscillate are left out; at most ' // to_text(most_internal) // &
                                 ' have modes of their own')
      end if
    end associate
  end subroutine find_large_modes

  !> The numbers of the undamped modes that are wanted, the first and the last.
  subroutine choose_numbers(pencil, choice, wanted, error)
    type(band_pencil_t), intent(inout) :: pencil
    type(modes_choice_t), intent(in) :: choice
    integer, intent(out) :: wanted(2)
    type(error_t), allocatable, intent(out) :: error   !! they are too many
    real(wp), parameter :: beside = 1.0e-9_wp
    character(len=:), allocatable :: option
    integer :: most

    wanted = [1, pencil%modes]
    most = max(1, most_numbers / pencil%coordinates)
    if (choice%has_range) then
      option = '--range_hz ' // to_text(choice%range_hz(1)) // ',' // to_text(choice%range_hz(2))
      call pencil%count_below((in_si(choice%range_hz(1), unit_hz) * (1.0_wp - beside))**2, wanted(1))
      call pencil%count_below((in_si(choice%range_hz(2), unit_hz) * (1.0_wp + beside))**2, wanted(2))
      wanted(1) = wanted(1) + 1
    else if (choice%count > 0) then
      option = '--modes ' // to_text(choice%count)
      wanted(2) = min(pencil%modes, pencil%rigid + choice%count)
    else
      option = ''
      if (pencil%coordinates > most_by_default) wanted(2) = min(pencil%modes, pencil%rigid + default_modes)
    end if
    if (wanted(2) - wanted(1) < most .or. option == '') return
    call raise(error, exit_input, option // ': these are ' // to_text(wanted(2) - wanted(1) + 1) // ' undamped modes; ' // &
               'at most ' // to_text(most) // ' are allowed for this machine of ' // to_text(pencil%coordinates) // &
               ' degrees of freedom')
  end subroutine choose_numbers

  !> Finds the modes from so many undamped ones that others would have other frequencies.
  subroutine find_covering(machine, pencil, slopes, held, choice, wanted, self, error)
    type(machine_t), intent(in) :: machine
    type(band_pencil_t), intent(inout) :: pencil
    type(slopes_t), intent(in) :: slopes
    integer, intent(in) :: held(:)
    type(modes_choice_t), intent(in) :: choice
    integer, intent(in) :: wanted(2)
    type(found_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_rounds = 4
    integer :: first, last, margin, round
    logical :: is_covered

    margin = max(least_margin, (wanted(2) - wanted(1)) / 8)
    do round = 1, most_rounds
      first = max(1, wanted(1) - margin)
      last = min(pencil%modes, wanted(2) + margin)
      call band_modes(pencil, first, last, held, self%linear, error)
      if (.not. allocated(error)) call find_damped(machine, pencil, slopes, self%linear, self%damped, error)
      if (allocated(error)) return
      call choose_modes(choice, self%linear, wanted - first + 1, [first == 1, last == pencil%modes], self%damped, self%chosen, &
                        is_covered)
      if (is_covered) exit
      margin = 3 * margin
    end do
    self%natural = self%linear%natural
    call keep_numbers(wanted(1) - first + 1, wanted(2) - first + 1, self%linear)
  end subroutine find_covering

  !> Chooses the modes that are wanted: the oscillating ones of the lowest frequencies or in the range; without a range also the
  !> others that go on from the undamped modes that are wanted, and of internal states.
  subroutine choose_modes(choice, linear, wanted, is_end, damped, chosen, is_covered)
    type(modes_choice_t), intent(in) :: choice
    type(linearisation_t), intent(in) :: linear
    integer, intent(in) :: wanted(2)      !! numbers of the undamped modes in `linear`
    logical, intent(in) :: is_end(2)      !! whether there are no undamped modes below and above the ones of `linear`
    type(damped_modes_t), intent(in) :: damped
    integer, allocatable, intent(out) :: chosen(:)
    logical, intent(out) :: is_covered    !! whether the frequencies of others are beyond, if damping changes none more than these
    integer, allocatable :: oscillating(:), others(:)
    integer :: i, n
    real(wp) :: ends(2), ratio

    associate (value => damped%pairs%value, modes => size(damped%pairs%value))
      oscillating = pack([(i, i=1, modes)], aimag(value) > 0)
      oscillating = oscillating(ascending_order(aimag(value(oscillating))))
      ends = [0.0_wp, huge(1.0_wp)]
      is_covered = .true.
      if (choice%has_range) then
        ends = in_si(choice%range_hz, unit_hz)
        chosen = pack(oscillating, aimag(value(oscillating)) >= ends(1) .and. aimag(value(oscillating)) <= ends(2))
      else
        n = size(oscillating)
        if (.not. (is_end(2) .and. wanted(2) == size(linear%natural))) n = count(linear%flexible <= wanted(2))
        is_covered = is_end(2) .or. n <= size(oscillating)
        n = min(n, size(oscillating))
        if (n > 0) ends(2) = aimag(value(oscillating(n)))
        others = pack([(i, i=1, modes)], .not. aimag(value) > 0 .and. (damped%undamped <= wanted(2) .or. &
                                                                       damped%pairs%internal > 0))
        chosen = [oscillating(:n), others]
      end if
      do i = 1, size(oscillating)
        if (damped%pairs%internal(oscillating(i)) > 0) cycle
        ratio = linear%natural(damped%undamped(oscillating(i))) / aimag(value(oscillating(i)))
        if (.not. is_end(1)) is_covered = is_covered .and. linear%natural(1) <= ratio * ends(1)
        if (.not. is_end(2)) is_covered = is_covered .and. linear%natural(size(linear%natural)) >= ratio * ends(2)
      end do
    end associate
  end subroutine choose_modes

  !> Why modes are not certain, '' if they are.
  subroutine find_obstacle(machine, damped, chosen, has_fallback, obstacle)
    type(machine_t), intent(in) :: machine
    type(damped_modes_t), intent(in) :: damped
    integer, intent(in) :: chosen(:)       !! modes of `damped`
    logical, intent(in) :: has_fallback
    character(len=:), allocatable, intent(out) :: obstacle
    integer :: i, k
    logical :: has_loss

    obstacle = ''
    if (.not. damped%is_complete) obstacle = 'damping couples more of its modes than are looked at together'
    associate (pairs => damped%pairs)
      has_loss = any(abs(pairs%slopes%loss) > 0)
      do i = 1, size(chosen)
        associate (m => chosen(i), value => pairs%value(chosen(i)))
          if (obstacle /= '') return
          if (.not. damped%is_exact(m) .and. abs(value) > negligible) then
            ! relative damping has no frequency where nothing oscillates, and hardly matters to rigid motions
            if (aimag(value) > 0 .or. .not. has_loss) then
              obstacle = 'damping changes some of its modes too much'
            else if (has_fallback .and. (pairs%internal(m) > 0 .or. damped%rigid_part(m) < 0.5_wp)) then
              obstacle = 'it has relative damping and modes that do not oscillate'
            end if
          end if
          do k = 1, size(pairs%value)
            if (k == m .or. .not. are_same(machine, pairs, m, k)) cycle
            obstacle = 'damping makes some of its modes too similar'
          end do
        end associate
      end do
    end associate
  end subroutine find_obstacle

  !> Adds a note on modes that do not oscillate and would need dense matrices.
  subroutine note_approximate(slopes, found, notes)
    type(slopes_t), intent(in) :: slopes
    type(found_t), intent(in) :: found
    type(string_t), allocatable, intent(inout) :: notes(:)
    logical :: follows_mean
    integer :: approximate

    follows_mean = any(abs(slopes%mean_damping) > 0)
    associate (damped => found%damped, chosen => found%chosen)
      associate (value => damped%pairs%value(chosen))
        approximate = count(.not. aimag(value) > 0 .and. abs(value) > negligible .and. &
                            (follows_mean .or. .not. damped%is_exact(chosen)))
      end associate
    end associate
    if (approximate == 0) return
    call append(notes, counted(approximate, 'mode that does not oscillate has an approximate decay', &
                               'modes that do not oscillate have approximate decays') // ': ' // &
                       trim(merge('torques that follow the mean speed of a cycle are left out of them', &
                                  'relative damping has no frequency there                           ', follows_mean)))
  end subroutine note_approximate

  !> Whether two modes are one.
  pure logical function are_same(machine, pairs, m, k)
    type(machine_t), intent(in) :: machine
    type(mode_pairs_t), intent(in) :: pairs
    integer, intent(in) :: m, k
    real(wp), parameter :: near = 1.0e-9_wp, alike = 0.999_wp

    are_same = .false.
    associate (difference => pairs%value(m) - pairs%value(k))
      if (abs(real(difference, wp)) + abs(aimag(difference)) > near * abs(pairs%value(m))) return
    end associate
    associate (inertia => machine%inertia(1, :), a => pairs%angle(:, m), b => pairs%angle(:, k))
      are_same = abs(sum(inertia * conjg(a) * b))**2 > alike * sum(inertia * abs(a)**2) * sum(inertia * abs(b)**2)
    end associate
  end function are_same

  !> Makes the list of the modes.
  subroutine put_modes(point, slopes, elastic, found, modes)
    type(operating_point_t), intent(in) :: point
    type(slopes_t), intent(in) :: slopes
    integer, intent(in) :: elastic(:)
    type(found_t), intent(in) :: found
    type(mode_t), allocatable, intent(out) :: modes(:)
    real(wp), parameter :: rounding = 1.0e-13_wp
    complex(wp) :: value
    integer :: i

    allocate (modes(size(found%chosen)))
    do i = 1, size(modes)
      associate (m => found%chosen(i), pairs => found%damped%pairs)
        value = pairs%value(m)
        if (abs(value) <= negligible) value = (0.0_wp, 0.0_wp)
        if (abs(real(value, wp)) <= rounding * aimag(value)) value = cmplx(0.0_wp, aimag(value), wp)
        modes(i)%internal = pairs%internal(m)
        modes(i)%undamped = from_si(found%natural(found%damped%undamped(m)), unit_hz)
        call fill_mode(slopes%stiffness(elastic), value, found%damped%rigid_part(m), pairs%twist(elastic, m), modes(i))
        call fill_bodies(point%formulation, pairs%x(:, m), modes(i))
      end associate
    end do
    modes = modes(order_of(modes))
  end subroutine put_modes

end module nocdyn_large_modes
