!> Rainflow counting of the cycles of a signal, by ASTM E1049-85, 5.4.4: three-point counting, with the residue as half cycles.
!>
!> The turning points come one after the other. Only those are kept whose cycles are not closed: the ranges between them shrink.
!> If they are too many, ranges that differ by less than a small part of the largest one count as equal, which closes cycles.
module nocdyn_rainflow
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  integer, parameter, public :: most_points = 4096   !! that are kept

  type, abstract, public :: rainflow_t
    real(wp), private :: points(most_points) = 0.0_wp   !! turning points, the first `depth` are in use
    integer, private :: depth = 0
    real(wp), private :: tolerance = 0.0_wp             !! ranges count as equal that differ by less
  contains
    procedure(count_interface), deferred :: count_cycle
    procedure :: start_count, add_point, finish_count
  end type rainflow_t

  abstract interface

    !> Takes note of a cycle.
    pure subroutine count_interface(self, range, mean, weight)
      import :: rainflow_t, wp
      class(rainflow_t), intent(inout) :: self
      real(wp), intent(in) :: range    !! from the lower to the upper turning point
      real(wp), intent(in) :: mean     !! of both
      real(wp), intent(in) :: weight   !! 1, or 0.5 for a half cycle
    end subroutine count_interface

  end interface

contains

  !> Forgets all points.
  pure subroutine start_count(self)
    class(rainflow_t), intent(inout) :: self

    self%depth = 0
    self%tolerance = 0.0_wp
  end subroutine start_count

  !> Adds the next turning point; the start of the signal is the first one.
  pure subroutine add_point(self, value)
    class(rainflow_t), intent(inout) :: self
    real(wp), intent(in) :: value
    real(wp) :: kept
    integer :: i

    if (self%depth == most_points) then   ! raises the tolerance, so that at most half of the points stay
      self%tolerance = max(2 * self%tolerance, 2 * abs(self%points(2) - self%points(1)) / most_points)
      self%depth = 0
      do i = 1, most_points
        kept = self%points(i)
        call push(self, kept)
      end do
    end if
    call push(self, value)
  end subroutine add_point

  !> Puts a point on the stack and counts the cycles that it closes.
  pure subroutine push(self, value)
    class(rainflow_t), intent(inout) :: self
    real(wp), intent(in) :: value
    real(wp) :: before, last

    self%depth = self%depth + 1
    self%points(self%depth) = value
    do while (self%depth >= 3)
      associate (n => self%depth, p => self%points)
        last = abs(p(n) - p(n - 1))
        before = abs(p(n - 1) - p(n - 2))
        if (last < before - merge(self%tolerance, 0.0_wp, n > 3)) return
        if (n == 3) then   ! the range contains the start
          call count_between(self, p(1), p(2), 0.5_wp)
          p(1:2) = p(2:3)
        else
          call count_between(self, p(n - 2), p(n - 1), 1.0_wp)
          if (last >= before) p(n - 2) = p(n)
        end if
      end associate
      self%depth = self%depth - merge(1, 2, self%depth == 3)
    end do
  end subroutine push

  !> Counts the residue as half cycles; the end of the signal was the last point.
  pure subroutine finish_count(self)
    class(rainflow_t), intent(inout) :: self
    integer :: i

    do i = 2, self%depth
      call count_between(self, self%points(i - 1), self%points(i), 0.5_wp)
    end do
    self%depth = 0
  end subroutine finish_count

  !> Counts the cycle between two turning points.
  pure subroutine count_between(self, a, b, weight)
    class(rainflow_t), intent(inout) :: self
    real(wp), intent(in) :: a, b, weight

    call self%count_cycle(abs(b - a), 0.5_wp * (a + b), weight)
  end subroutine count_between

end module nocdyn_rainflow
