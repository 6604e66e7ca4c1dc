!> The modes at all speeds of a response, and the critical speeds, at which its lines meet them.
module nocdyn_followed_modes
  use nocdyn_critical_speeds, only: crossing_t, find_crossings
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: sort_ascending
  use nocdyn_mode_branches, only: new_speed_modes, speed_modes_t
  implicit none (type, external)
  private

  public :: follow_modes, frequencies_of

contains

  !> Finds the modes at all speeds and the crossings. Where modes move with the speed, the crossings become speeds of their own,
  !> until they stay.
  subroutine follow_modes(response, orders, modes, crossings, error, failed_speed)
    type(forced_response_t), intent(inout) :: response
    real(wp), intent(in) :: orders(:)          !! that are sought; none: the lines of the response
    type(speed_modes_t), intent(out) :: modes
    type(crossing_t), allocatable, intent(out) :: crossings(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(inout) :: failed_speed    !! as in `add_points`
    integer, parameter :: rounds = 3
    real(wp), allocatable :: more(:), speed(:)
    integer :: round

    do round = 1, rounds
      call new_speed_modes(response, modes, error)
      if (allocated(error)) return
      speed = response%speeds()
      call find_crossings(speed, frequencies_of(response, orders), modes, crossings)
      if (modes%is_constant .or. round == rounds .or. size(crossings) == 0) return
      more = crossings%speed
      call sort_ascending(more)
      if (speed(1) < 0) more = more(size(more):1:-1)
      call response%add_points(more, .false., error, failed_speed, only_states=.true.)
      if (allocated(error)) return
    end do
  end subroutine follow_modes

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
