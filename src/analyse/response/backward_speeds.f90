!> Refuses speeds of &response at which the machine would turn against its drive.
module nocdyn_backward_speeds
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, t_infinity
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t, new_held_speeds
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_response_settings, only: response_settings_t
  use nocdyn_text, only: quoted, string_t
  use nocdyn_written_values, only: speed_text, unit_of, written_key, written_number
  implicit none (type, external)
  private

  public :: refuse_backward_speeds

contains

  !> Refuses a range of speeds at none of which the motors or engines drive, where they do at the same speeds in the other
  !> direction and the body has no steady speed in this one.
  subroutine refuse_backward_speeds(input, settings, machine, response, error)
    type(input_t), intent(in) :: input
    type(response_settings_t), intent(in) :: settings
    type(machine_t), intent(in) :: machine               !! one lane
    type(forced_response_t), intent(in) :: response      !! at the speeds of the grid
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: speeds, steady
    real(wp) :: speed
    integer :: i
    type(held_speeds_t) :: held
    type(held_state_t) :: state
    type(error_t), allocatable :: failure
    logical :: drives_backward

    if (.not. response%held%has_drive()) return
    if (any([(response%points(i)%state%is_driven(), i=1, size(response%points))])) return
    ! whether motors or engines drive at the first or the last speed with the other sign
    drives_backward = .false.
    call new_held_speeds(machine, settings%body, held, failure)
    do i = 1, size(settings%speeds), max(1, size(settings%speeds) - 1)
      if (allocated(failure)) deallocate (failure)
      call held%hold(-settings%speeds(i), state, failure)
      drives_backward = drives_backward .or. .not. allocated(failure) .and. state%is_driven()
    end do
    if (.not. drives_backward) return
    speed = steady_speed(machine, settings)
    if (speed * settings%speeds(1) > 0) return
    associate (group => input%groups(settings%group), range => input%groups(settings%group)%numbers('speed'))
      speeds = written_key(group, 'speed') // ' = ' // written_number(group, 'speed', -range(1))
      if (size(range) > 1) speeds = speeds // ', ' // written_number(group, 'speed', -range(2))
      steady = ''
      if (abs(speed) > 0) steady = ', and its steady speed is ' // speed_text(speed, unit_of(group, 'speed'), 6)
      call raise(error, exit_input, input%location(settings%group, 'speed') // ': ' // written_key(group, 'speed') // &
                 ': the motors or engines turn ' // quoted(machine%names(settings%body)%text) // &
                 ' in the other direction' // steady // '; allowed: speeds of the other sign, e.g. ' // speeds)
    end associate
  end subroutine refuse_backward_speeds

  !> The fastest steady speed of the body, in the direction of the range if there is one; 0 if none is known [rad/s].
  real(wp) function steady_speed(machine, settings) result(speed)
    type(machine_t), intent(in) :: machine
    type(response_settings_t), intent(in) :: settings
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(string_t), allocatable :: notes(:)
    type(error_t), allocatable :: failure
    real(wp) :: forward
    integer :: i

    speed = 0.0_wp
    call find_equilibria(machine, t_infinity, formulation, equilibria, notes, failure)
    if (allocated(failure)) return
    do i = 1, size(equilibria)
      call formulation%set_state(equilibria(i)%y)
      forward = formulation%omega(1, settings%body) * sign(1.0_wp, settings%speeds(1))
      if (forward > 0 .or. (speed <= 0 .and. forward < speed)) speed = forward
    end do
    speed = speed * sign(1.0_wp, settings%speeds(1))
  end function steady_speed

end module nocdyn_backward_speeds
