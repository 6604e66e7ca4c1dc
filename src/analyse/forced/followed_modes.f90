!> The modes at all speeds of a response, and the critical speeds, at which its lines meet them.
module nocdyn_followed_modes
  use nocdyn_critical_speeds, only: crossing_t, find_crossings, keep_new
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_branches, only: new_speed_modes, speed_modes_t
  use nocdyn_steady_start, only: find_steady_speed
  implicit none (type, external)
  private

  public :: follow_modes, frequencies_of

contains

  !> Finds the modes at all speeds and the crossings. Where modes move with the speed, the crossings become speeds of their own,
  !> until they stay. Where modes change their order over the speeds, they have the numbers that they have in the steady state,
  !> as `nocdyn modes` numbers them; without one those of the first speed.
  subroutine follow_modes(machine, response, orders, modes, crossings, error, failed_speed)
    type(machine_t), intent(in) :: machine     !! of the response, at no held speed
    type(forced_response_t), intent(inout) :: response
    real(wp), intent(in) :: orders(:)          !! that are sought; none: the lines of the response
    type(speed_modes_t), intent(out) :: modes
    type(crossing_t), allocatable, intent(out) :: crossings(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(inout) :: failed_speed    !! as in `add_points`
    integer, parameter :: rounds = 3
    real(wp), allocatable :: more(:), speed(:)
    integer :: round
    logical :: has_state
    real(wp) :: steady_speed

    call new_speed_modes(response, 1, modes, error)
    if (allocated(error)) return
    has_state = .false.
    if (modes%change_places) call add_steady_speed(machine, response, has_state, steady_speed)
    do round = 1, rounds
      if (has_state .or. round > 1) call new_speed_modes(response, nearest_point(response), modes, error)
      if (allocated(error)) return
      speed = response%speeds()
      call find_crossings(speed, frequencies_of(response, orders), modes, crossings)
      if (modes%is_constant .or. round == rounds .or. size(crossings) == 0) return
      more = crossings%speed
      call keep_new(response, more)
      if (size(more) == 0) return
      call response%add_points(more, .false., error, failed_speed, only_states=.true.)
      if (allocated(error)) return
    end do

  contains

    !> The point nearest to the steady state, or the first one.
    integer function nearest_point(response)
      type(forced_response_t), intent(in) :: response

      nearest_point = 1
      if (has_state) nearest_point = minloc(abs(response%speeds() - steady_speed), dim=1)
    end function nearest_point

  end subroutine follow_modes

  !> Makes the speed in the steady state of the machine a point, if it is among the speeds.
  subroutine add_steady_speed(machine, response, has_state, steady_speed)
    type(machine_t), intent(in) :: machine
    type(forced_response_t), intent(inout) :: response
    logical, intent(out) :: has_state       !! whether there is one
    real(wp), intent(out) :: steady_speed   !! [rad/s]
    type(error_t), allocatable :: error
    real(wp) :: failed_speed
    real(wp), allocatable :: speed(:)

    call find_steady_speed(machine, response%held%reference, has_state, steady_speed)
    if (.not. has_state) return
    speed = response%speeds()
    if (steady_speed < minval(speed) .or. steady_speed > maxval(speed)) return
    speed = [steady_speed]
    call keep_new(response, speed)
    if (size(speed) > 0) call response%add_points(speed, .false., error, failed_speed, only_states=.true.)
  end subroutine add_steady_speed

  !> The frequencies of orders, or of the lines of a response, at its speeds [rad/s], [lines, points].
  function frequencies_of(response, orders) result(frequency)
    type(forced_response_t), intent(in) :: response
    real(wp), intent(in) :: orders(:)   !! as in `follow_modes`
    real(wp), allocatable :: frequency(:, :)
    real(wp), allocatable :: speed(:)
    integer :: l

    if (size(orders) == 0) then
      frequency = response%frequencies()
      return
    end if
    speed = response%speeds()
    allocate (frequency(size(orders), size(speed)))
    do l = 1, size(orders)
      frequency(l, :) = orders(l) * abs(speed)
    end do
  end function frequencies_of

end module nocdyn_followed_modes
