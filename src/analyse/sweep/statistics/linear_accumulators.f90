!> What is kept of linear functions x of the state along the variants in the lanes of a block.
module nocdyn_linear_accumulators
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: strip_of, width
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_min, statistic_t, &
    statistic_time_of_max
  implicit none (type, external)
  private

  public :: new_accumulators, start_range

  !> What is kept of one x from a time on; [width, strips] of the lanes.
  type, public :: accumulator_t
    integer :: column = 0                    !! among the linear ones
    real(wp) :: from = 0.0_wp                !! [s]
    logical :: has_range = .false.           !! whether extremes are wanted:
    logical :: has_max = .false., has_min = .false., has_size = .false.   !! largest, smallest, largest absolute value
    logical :: has_time = .false.            !! of the largest
    logical :: has_sums = .false.
    real(wp), allocatable :: highest(:, :), lowest(:, :), highest_time(:, :)   !! of x
    real(wp), allocatable :: bound(:, :)                                        !! huge before `from`, -huge after it
    real(wp), allocatable :: integral(:, :), square(:, :)                      !! of the column over time
  end type accumulator_t

contains

  !> One track for each column and `from`, in the order of the columns.
  pure subroutine new_accumulators(statistics, column, lanes, accumulators, acc)
    type(statistic_t), intent(in) :: statistics(:)
    integer, intent(in) :: column(:)                         !! of each statistic
    integer, intent(in) :: lanes
    type(accumulator_t), allocatable, intent(out) :: accumulators(:)
    integer, allocatable, intent(out) :: acc(:)            !! of each statistic, 0 for those of the end
    integer :: c, i, k

    allocate (accumulators(0))
    allocate (acc(size(statistics)), source=0)
    do c = 1, maxval(column)
      do i = 1, size(statistics)
        if (column(i) /= c .or. statistics(i)%kind == statistic_final) cycle
        do k = 1, size(accumulators)
          if (accumulators(k)%column == c .and. abs(accumulators(k)%from - statistics(i)%from) <= 0) exit
        end do
        if (k > size(accumulators)) accumulators = [accumulators, accumulator_t(column=c, from=statistics(i)%from)]
        acc(i) = k
        call add_kind(accumulators(k), statistics(i)%kind)
      end do
    end do
    do k = 1, size(accumulators)
      accumulators(k)%has_range = accumulators(k)%has_max .or. accumulators(k)%has_min .or. accumulators(k)%has_size
      call allocate_accumulator(accumulators(k), strip_of(lanes))
    end do
  end subroutine new_accumulators

  pure subroutine add_kind(acc, kind)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: kind   !! of a statistic

    select case (kind)
    case (statistic_max, statistic_time_of_max)
      acc%has_max = .true.
      acc%has_time = acc%has_time .or. kind == statistic_time_of_max
    case (statistic_min)
      acc%has_min = .true.
    case (statistic_max_abs)
      acc%has_size = .true.
    case default
      acc%has_sums = .true.
    end select
  end subroutine add_kind

  pure subroutine allocate_accumulator(acc, strips)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: strips

    allocate (acc%highest(width, strips), source=0.0_wp)
    allocate (acc%lowest, acc%highest_time, acc%integral, acc%square, source=acc%highest)
    allocate (acc%bound, source=acc%highest - huge(0.0_wp))
  end subroutine allocate_accumulator

  !> The range of a lane begins with a value.
  pure subroutine start_range(acc, at, strip, x, t)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: at, strip
    real(wp), intent(in) :: x, t

    acc%bound(at, strip) = -huge(0.0_wp)
    acc%highest(at, strip) = x
    acc%lowest(at, strip) = x
    acc%highest_time(at, strip) = t
  end subroutine start_range

end module nocdyn_linear_accumulators
