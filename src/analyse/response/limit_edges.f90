!> The speeds at which a half range reaches its limit, found between the speeds of a response.
module nocdyn_limit_edges
  use nocdyn_critical_speeds, only: keep_new
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_response_limits, only: response_limit_t
  implicit none (type, external)
  private

  public :: refine_edges

  real(wp), parameter :: accuracy = 1.0e-6_wp   ! relative, of the speeds
  real(wp), parameter :: beyond = 50.0_wp       ! logarithm of a ratio that is no more than a limit without bounds

contains

  !> Adds speeds where a half range crosses a limit: by the secant of the logarithm of their ratio, and by bisection in every
  !> other round.
  subroutine refine_edges(response, limits, error, failed_speed)
    type(forced_response_t), intent(inout) :: response
    type(response_limit_t), intent(in) :: limits(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(out) :: failed_speed   !! as in `add_points`
    integer, parameter :: most_rounds = 16
    real(wp), allocatable :: speeds(:)
    integer :: k, round

    failed_speed = 0.0_wp
    do round = 1, most_rounds
      allocate (speeds(0))
      do k = 1, size(limits)
        call add_edges(response, limits(k), modulo(round, 2) == 0, speeds)
      end do
      call keep_new(response, speeds)
      if (size(speeds) == 0) return
      call response%add_points(speeds, .false., error, failed_speed)
      if (allocated(error)) return
      deallocate (speeds)
    end do
  end subroutine refine_edges

  subroutine add_edges(response, limit, bisects, speeds)
    type(forced_response_t), intent(in) :: response
    type(response_limit_t), intent(in) :: limit
    logical, intent(in) :: bisects
    real(wp), allocatable, intent(inout) :: speeds(:)
    real(wp) :: excess(size(response%points)), share, speed(size(response%points))
    integer :: i

    speed = response%speeds()
    do i = 1, size(speed)
      excess(i) = log(max(response%points(i)%half_range(limit%quantity), tiny(1.0_wp)) / limit%continuous_limit(speed(i)))
    end do
    excess = max(-beyond, min(beyond, excess))
    do i = 1, size(speed) - 1
      if (excess(i) > 0 .eqv. excess(i + 1) > 0) cycle
      if (abs(speed(i + 1) - speed(i)) <= accuracy * abs(speed(i))) cycle
      share = 0.5_wp
      if (.not. bisects) share = excess(i) / (excess(i) - excess(i + 1))
      share = max(0.02_wp, min(0.98_wp, share))
      speeds = [speeds, speed(i) + share * (speed(i + 1) - speed(i))]
    end do
  end subroutine add_edges

end module nocdyn_limit_edges
