!> A list of the cycles that rainflow counting finds.
module nocdyn_cycle_lists
  use nocdyn_kinds, only: wp
  use nocdyn_rainflow, only: rainflow_t
  implicit none (type, external)
  private

  integer, parameter :: longest = 1000000

  type, extends(rainflow_t), public :: cycle_list_t
    integer :: count = 0
    real(wp) :: cycles = 0.0_wp   !! number of all of them, with those beyond the list
    real(wp), allocatable :: range(:), mean(:), weight(:)
  contains
    procedure :: count_cycle
    procedure :: count_all
  end type cycle_list_t

contains

  pure subroutine count_cycle(self, range, mean, weight)
    class(cycle_list_t), intent(inout) :: self
    real(wp), intent(in) :: range, mean, weight

    self%cycles = self%cycles + weight
    if (self%count == longest) return
    self%count = self%count + 1
    self%range(self%count) = range
    self%mean(self%count) = mean
    self%weight(self%count) = weight
  end subroutine count_cycle

  !> The cycles of a signal of turning points.
  subroutine count_all(self, points)
    class(cycle_list_t), intent(inout) :: self
    real(wp), intent(in) :: points(:)
    integer :: i

    self%count = 0
    self%cycles = 0.0_wp
    if (.not. allocated(self%range)) allocate (self%range(longest), self%mean(longest), self%weight(longest))
    call self%start_count()
    do i = 1, size(points)
      call self%add_point(points(i))
    end do
    call self%finish_count()
  end subroutine count_all

end module nocdyn_cycle_lists
