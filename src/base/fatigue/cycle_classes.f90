!> Classes of cycles by their range and mean. The classes of a signal are made wider, by merging two, when a cycle exceeds them.
module nocdyn_cycle_classes
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  integer, parameter :: classes = 64   !! of ranges; as many of means, half of them negative

  integer, parameter, public :: class_range = 1, class_mean = 2, class_count = 3, class_damage = 4   !! see `list`

  type, public :: cycle_classes_t
    real(wp), private :: range_width = 0.0_wp, mean_width = 0.0_wp   !! 0 before the first cycle
    real(wp), private :: sums(4, classes, -classes / 2:classes / 2 - 1) = 0.0_wp   !! of class_..., over the cycles of a class
  contains
    procedure :: add, list
  end type cycle_classes_t

contains

  !> Adds cycles.
  pure subroutine add(self, range, mean, count, damage)
    class(cycle_classes_t), intent(inout) :: self
    real(wp), intent(in) :: range, mean
    real(wp), intent(in) :: count    !! of the cycles
    real(wp), intent(in) :: damage   !! of all of them
    integer :: i, k

    if (.not. self%range_width > 0) self%range_width = max(range, tiny(range)) / classes
    do while (range > classes * self%range_width)
      call merge_ranges(self)
    end do
    if (.not. self%mean_width > 0) self%mean_width = max(2 * abs(mean), range, tiny(range)) / classes
    do while (.not. abs(mean) < (classes / 2) * self%mean_width)
      call merge_means(self)
    end do
    i = max(1, min(classes, ceiling(range / self%range_width)))
    k = max(-classes / 2, min(classes / 2 - 1, floor(mean / self%mean_width)))
    self%sums(:, i, k) = self%sums(:, i, k) + [count * range, count * mean, count, damage]
  end subroutine add

  !> Doubles the width of the classes of ranges.
  pure subroutine merge_ranges(self)
    type(cycle_classes_t), intent(inout) :: self
    integer :: i

    do i = 1, classes / 2
      self%sums(:, i, :) = self%sums(:, 2 * i - 1, :) + self%sums(:, 2 * i, :)
    end do
    self%sums(:, classes / 2 + 1:, :) = 0.0_wp
    self%range_width = 2 * self%range_width
  end subroutine merge_ranges

  !> Doubles the width of the classes of means.
  pure subroutine merge_means(self)
    type(cycle_classes_t), intent(inout) :: self
    real(wp) :: merged(4, classes, -classes / 2:classes / 2 - 1)
    integer :: k

    merged = 0.0_wp
    do k = -classes / 4, classes / 4 - 1
      merged(:, :, k) = self%sums(:, :, 2 * k) + self%sums(:, :, 2 * k + 1)
    end do
    self%sums = merged
    self%mean_width = 2 * self%mean_width
  end subroutine merge_means

  !> The classes that have cycles, the largest ranges first: mean values of range and mean, number of cycles, damage.
  pure function list(self) result(rows)
    class(cycle_classes_t), intent(in) :: self
    real(wp), allocatable :: rows(:, :)   !! [4, classes]: `class_range` ... `class_damage`
    integer :: i, k, n

    allocate (rows(4, count(self%sums(class_count, :, :) > 0)))
    n = 0
    do i = classes, 1, -1
      do k = -classes / 2, classes / 2 - 1
        associate (sums => self%sums(:, i, k))
          if (.not. sums(class_count) > 0) cycle
          n = n + 1
          rows(:, n) = [sums(class_range:class_mean) / sums(class_count), sums(class_count:class_damage)]
        end associate
      end do
    end do
  end function list

end module nocdyn_cycle_classes
