!> The modes of a large machine that are wanted, by band matrices: from its lowest undamped modes, or from the ones in a range of
!> frequencies, whose number is counted.
!>
!> More undamped modes are taken than are wanted: damping couples neighbours, and lowers frequencies.
module nocdyn_wanted_modes
  use nocdyn_band_pencil, only: band_pencil_t
  use nocdyn_damped_bands, only: damped_modes_t, find_damped
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_pairs, only: mode_pairs_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: to_text
  use nocdyn_undamped_bands, only: band_modes
  use nocdyn_units, only: in_si, unit_hz
  implicit none (type, external)
  private

  public :: choose_numbers, find_covering, find_obstacle, keep_numbers

  integer, parameter :: most_by_default = 1000   ! coordinates of a machine all of whose modes are found
  integer, parameter, public :: default_modes = 100   !! of a machine with more
  integer, parameter :: most_numbers = 5000000   ! coordinates times modes
  integer, parameter :: least_margin = 12        ! undamped modes beside the ones that are wanted
  real(wp), parameter, public :: negligible = 1.0e-200_wp   !! eigenvalue that is zero [1/s]

  type, public :: modes_choice_t
    integer :: count = 0                              !! the lowest so many; 0: not given
    logical :: has_range = .false.
    real(wp) :: range_hz(2) = [0.0_wp, 0.0_wp]        !! frequencies from and to, if there is a range [Hz]
  end type modes_choice_t

  !> The damped modes, and the undamped ones that they go on from.
  type, public :: wanted_modes_t
    type(linearisation_t) :: linear              !! of the undamped modes, more than are wanted
    integer :: first = 0                         !! number of the first of these
    type(damped_modes_t) :: damped
    integer, allocatable :: chosen(:)            !! modes of `damped`
  end type wanted_modes_t

contains

  !> Finds the numbers of the undamped modes that are wanted, the first and the last.
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
    type(wanted_modes_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_rounds = 4
    integer :: last, margin, round
    logical :: is_covered

    margin = max(least_margin, (wanted(2) - wanted(1)) / 8)
    do round = 1, most_rounds
      self%first = max(1, wanted(1) - margin)
      last = min(pencil%modes, wanted(2) + margin)
      call band_modes(pencil, self%first, last, held, self%linear, error)
      if (.not. allocated(error)) call find_damped(machine, pencil, slopes, self%linear, self%damped, error)
      if (allocated(error)) return
      call choose_modes(choice, self%linear, wanted - self%first + 1, [self%first == 1, last == pencil%modes], self%damped, &
                        self%chosen, is_covered)
      if (is_covered) exit
      margin = 3 * margin
    end do
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

  !> Keeps the undamped modes from one number to another.
  subroutine keep_numbers(first, last, linear)
    integer, intent(in) :: first, last
    type(linearisation_t), intent(inout) :: linear

    if (first == 1 .and. last == size(linear%natural)) return
    linear%shapes = linear%shapes(:, first:last)
    linear%twists = linear%twists(:, first:last)
    linear%natural = linear%natural(first:last)
    linear%below = linear%below + count(linear%flexible < first)
    linear%flexible = pack(linear%flexible, linear%flexible >= first .and. linear%flexible <= last) - first + 1
  end subroutine keep_numbers

end module nocdyn_wanted_modes
