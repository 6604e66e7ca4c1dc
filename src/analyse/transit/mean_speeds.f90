!> The mean speed of a body over whole turns, and the visits of a range of speeds that it makes.
!>
!> A window is a whole number of turns of the body. Oscillations of whole orders have done whole periods in one turn, those of
!> half orders in two: they leave the mean speed as it is, so that a vibration about it enters no range. The mean belongs to the
!> middle of the window in time, which is exact for a constant acceleration.
module nocdyn_mean_speeds
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: find_windows, find_visits, speed_at

  real(wp), parameter :: full_turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: bisections = 60                      ! to the last bit of the time in an interval

  !> Whole turns that end at a row.
  type, public :: turn_window_t
    integer :: row = 0                            !! at its end
    real(wp) :: begin = 0.0_wp, end = 0.0_wp      !! [s]
    real(wp) :: time = 0.0_wp                     !! of its middle [s]
    real(wp) :: speed = 0.0_wp                    !! mean over it [rad/s]
  end type turn_window_t

  !> A stay of the mean speed in a range.
  type, public :: visit_t
    integer :: from = 0, to = 0                   !! sides of entry and exit: -1 below, 1 above; 0: the run begins or ends
    real(wp) :: enters = 0.0_wp, leaves = 0.0_wp  !! [s]
    real(wp) :: begin = 0.0_wp, end = 0.0_wp      !! of all turns whose mean speed is in the range [s]
  contains
    procedure :: passes, duration
  end type visit_t

contains

  !> Whether it leaves the range on the other side.
  elemental logical function passes(self)
    class(visit_t), intent(in) :: self

    passes = self%from * self%to == -1
  end function passes

  !> The time in the range [s].
  elemental real(wp) function duration(self)
    class(visit_t), intent(in) :: self

    duration = self%leaves - self%enters
  end function duration

  !> The windows that end at the rows of a motion, without the rows before the first whole one.
  subroutine find_windows(t, phi, omega, turns, windows)
    real(wp), intent(in) :: t(:)                 !! of the rows, ascending [s]
    real(wp), intent(in) :: phi(:), omega(:)     !! angle and speed of the body, forwards [rad], [rad/s]
    integer, intent(in) :: turns                 !! of a window
    type(turn_window_t), allocatable, intent(out) :: windows(:)
    type(turn_window_t), allocatable :: all(:)
    real(wp) :: wanted
    integer :: count, i, k

    allocate (all(size(t)))
    count = 0
    k = 1
    do i = 2, size(t)
      wanted = phi(i) - turns * full_turn
      do while (k > 1)
        if (phi(k) <= wanted) exit
        k = k - 1
      end do
      if (phi(k) > wanted) cycle
      do while (k + 1 < i)
        if (phi(k + 1) > wanted) exit
        k = k + 1
      end do
      count = count + 1
      associate (window => all(count))
        window%row = i
        window%end = t(i)
        window%begin = time_of_angle(t(k:k + 1), phi(k:k + 1), omega(k:k + 1), wanted)
        window%time = 0.5_wp * (window%begin + window%end)
        window%speed = turns * full_turn / (window%end - window%begin)
      end associate
    end do
    allocate (windows(count))
    windows(:) = all(:count)
  end subroutine find_windows

  !> When the cubic through two angles and speeds has an angle between these [s].
  pure real(wp) function time_of_angle(t, phi, omega, wanted) result(time)
    real(wp), intent(in) :: t(2), phi(2), omega(2)
    real(wp), intent(in) :: wanted   !! between the angles [rad]
    real(wp) :: high, h, low, x
    integer :: i

    h = t(2) - t(1)
    low = 0.0_wp
    high = 1.0_wp
    do i = 1, bisections
      x = 0.5_wp * (low + high)
      if (phi(1) + x * (h * omega(1) + x * (3 * (phi(2) - phi(1)) - h * (2 * omega(1) + omega(2)) &
                                            + x * (h * (omega(1) + omega(2)) - 2 * (phi(2) - phi(1))))) > wanted) then
        high = x
      else
        low = x
      end if
    end do
    time = t(1) + low * h
  end function time_of_angle

  !> The mean speed at a time, straight between windows; beyond them that of the first or the last one.
  pure real(wp) function speed_at(windows, time) result(speed)
    type(turn_window_t), intent(in) :: windows(:)   !! at least one
    real(wp), intent(in) :: time               !! [s]
    integer :: first, last, middle

    first = 1
    last = size(windows)
    do while (last - first > 1)
      middle = (first + last) / 2
      if (windows(middle)%time > time) last = middle
      if (windows(middle)%time <= time) first = middle
    end do
    speed = windows(first)%speed
    associate (a => windows(first), b => windows(last))
      if (b%time > a%time) speed = a%speed + (b%speed - a%speed) * min(max((time - a%time) / (b%time - a%time), 0.0_wp), 1.0_wp)
    end associate
  end function speed_at

  !> The visits of a range, in the order of the time. Absences that are shorter than the turns of a window belong to a visit: free
  !> vibrations, which are no order, leave a rest in the mean speed.
  subroutine find_visits(windows, low, high, visits)
    type(turn_window_t), intent(in) :: windows(:)
    real(wp), intent(in) :: low, high   !! of the range [rad/s]
    type(visit_t), allocatable, intent(out) :: visits(:)
    type(visit_t) :: visit
    integer :: after, before, k

    allocate (visits(0))
    if (size(windows) == 0) return
    before = side_of(windows(1)%speed, low, high)
    if (before == 0) visit = visit_t(enters=windows(1)%time, begin=windows(1)%begin)
    do k = 2, size(windows)
      after = side_of(windows(k)%speed, low, high)
      if (after /= before) then
        if (before /= 0) call enter(windows(k - 1:k), before, merge(low, high, before < 0), visits, visit)
        if (after /= 0) then
          visit%to = after
          visit%leaves = crossing(windows(k - 1:k), merge(low, high, after < 0))
          visit%end = windows(merge(k - 1, k, before == 0))%end
          visits = [visits, visit]
        end if
      end if
      before = after
    end do
    if (before /= 0) return
    associate (last => windows(size(windows)))
      visit%leaves = last%time
      visit%end = last%end
    end associate
    visits = [visits, visit]
  end subroutine find_visits

  !> Begins a visit, or goes on with the last one after a short absence.
  pure subroutine enter(windows, side, edge, visits, visit)
    type(turn_window_t), intent(in) :: windows(2)   !! before and after the entry
    integer, intent(in) :: side                     !! on which it enters
    real(wp), intent(in) :: edge                    !! of the range there [rad/s]
    type(visit_t), allocatable, intent(inout) :: visits(:)   !! that have ended
    type(visit_t), intent(out) :: visit

    visit = visit_t(from=side, begin=windows(2)%begin)
    visit%enters = crossing(windows, edge)
    if (size(visits) == 0) return
    associate (last => visits(size(visits)))
      if (visit%enters - last%leaves > windows(2)%end - windows(2)%begin) return
      visit = last
    end associate
    visit%to = 0
    visits = visits(:size(visits) - 1)
  end subroutine enter

  !> -1 below a range, 0 in it, 1 above it.
  pure integer function side_of(speed, low, high) result(side)
    real(wp), intent(in) :: speed, low, high

    side = 0
    if (speed < low) side = -1
    if (speed > high) side = 1
  end function side_of

  !> When the mean speed has a value between two windows [s].
  pure real(wp) function crossing(windows, speed) result(time)
    type(turn_window_t), intent(in) :: windows(2)
    real(wp), intent(in) :: speed   !! [rad/s]

    time = windows(1)%time + (windows(2)%time - windows(1)%time) * (speed - windows(1)%speed) &
           / (windows(2)%speed - windows(1)%speed)
  end function crossing

end module nocdyn_mean_speeds
