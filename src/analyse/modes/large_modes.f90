!> The modes of a large machine at its operating point, by band matrices.
module nocdyn_large_modes
  use nocdyn_band_pencil, only: band_pencil_t, new_band_pencil
  use nocdyn_internal_modes, only: most_internal
  use nocdyn_element_coordinates, only: new_element_coordinates
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: find_slopes, has_turning_losses, held_elements, linearisation_t
  use nocdyn_mode_choice, only: note_choice
  use nocdyn_modes, only: fill_bodies, fill_mode, mode_oscillating, mode_t, sort_modes
  use nocdyn_operating_point, only: operating_point_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: append, counted, string_t, to_text
  use nocdyn_units, only: from_si, unit_hz
  use nocdyn_wanted_modes, only: choose_numbers, find_covering, find_obstacle, keep_numbers, modes_choice_t, negligible, &
    wanted_modes_t
  implicit none (type, external)
  private

  public :: find_large_modes

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
    type(wanted_modes_t) :: found
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
      call keep_numbers(wanted(1) - found%first + 1, wanted(2) - found%first + 1, linear)
      linear%below = max(0, wanted(1) - 1 - pencil%rigid)
      where (modes%number > 0) modes%number = modes%number + linear%below
      associate (flexible => pencil%modes - pencil%rigid)
        call note_choice(choice, flexible, linear%below, count(modes%kind == mode_oscillating), &
                         point%notes)
      end associate
      if (machine%elements%internal%count > most_internal) then
        call append(point%notes, 'the modes of its ' // to_text(machine%elements%internal%count) // ' internal states that ' // &
                                 'do not oscillate are left out; at most ' // to_text(most_internal) // &
                                 ' have modes of their own')
      end if
    end associate
  end subroutine find_large_modes

  !> Adds a note on modes that do not oscillate and would need dense matrices.
  subroutine note_approximate(slopes, found, notes)
    type(slopes_t), intent(in) :: slopes
    type(wanted_modes_t), intent(in) :: found
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

  !> Makes the list of the modes.
  subroutine put_modes(point, slopes, elastic, found, modes)
    type(operating_point_t), intent(in) :: point
    type(slopes_t), intent(in) :: slopes
    integer, intent(in) :: elastic(:)
    type(wanted_modes_t), intent(in) :: found
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
        modes(i)%undamped = from_si(found%linear%natural(found%damped%undamped(m)), unit_hz)
        call fill_mode(slopes%stiffness(elastic), value, found%damped%rigid_part(m), pairs%twist(elastic, m), modes(i))
        call fill_bodies(point%formulation, pairs%x(:, m), modes(i))
      end associate
    end do
    call sort_modes(modes)
  end subroutine put_modes

end module nocdyn_large_modes
