!> Extremes and integrals of linear functions x of the state, accumulated over the steps of the variants in a block.
module nocdyn_linear_accumulators
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: strip_of, width
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_mean, statistic_min, statistic_rms, &
    statistic_t, statistic_time_of_max
  implicit none (type, external)
  private

  public :: new_accumulators, start_range

  !> The extremes and integrals of one x from a time on. The shape of all arrays is [width, strips].
  type, public :: accumulator_t
    integer :: column = 0                    !! number among the linear columns
    real(wp) :: from = 0.0_wp                !! [s]
    logical :: has_range = .false.           !! whether extremes are needed:
    logical :: has_max = .false., has_min = .false., has_max_abs = .false.
    logical :: has_time = .false.            !! whether the time of the largest value is needed
    logical :: has_sums = .false.            !! whether integrals are needed
    real(wp), allocatable :: highest(:, :), lowest(:, :), highest_time(:, :)   !! of x; time [s]
    real(wp), allocatable :: bound(:, :)                    !! huge before `from`: x is not of interest; -huge after it
    real(wp), allocatable :: integral(:, :), square(:, :)   !! of the column and of its square over time
  end type accumulator_t

contains

  !> One accumulator for each column and `from`, in the order of the columns.
  pure subroutine new_accumulators(statistics, column, lanes, accumulators, acc)
    type(statistic_t), intent(in) :: statistics(:)
    integer, intent(in) :: column(:)                         !! linear column of each statistic
    integer, intent(in) :: lanes
    type(accumulator_t), allocatable, intent(out) :: accumulators(:)
    integer, allocatable, intent(out) :: acc(:)                 !! number in `accumulators`, 0 for values at the end; [statistics]
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
        associate (self => accumulators(k), kind => statistics(i)%kind)
          self%has_max = self%has_max .or. kind == statistic_max .or. kind == statistic_time_of_max
          self%has_time = self%has_time .or. kind == statistic_time_of_max
          self%has_min = self%has_min .or. kind == statistic_min
          self%has_max_abs = self%has_max_abs .or. kind == statistic_max_abs
          self%has_sums = self%has_sums .or. kind == statistic_mean .or. kind == statistic_rms
        end associate
      end do
    end do
    do k = 1, size(accumulators)
      accumulators(k)%has_range = accumulators(k)%has_max .or. accumulators(k)%has_min .or. accumulators(k)%has_max_abs
      call allocate_accumulator(accumulators(k), strip_of(lanes))
    end do
  end subroutine new_accumulators

  pure subroutine allocate_accumulator(acc, strips)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: strips

    allocate (acc%highest(width, strips), source=0.0_wp)
    allocate (acc%lowest, acc%highest_time, acc%integral, acc%square, source=acc%highest)
    allocate (acc%bound, source=acc%highest - huge(0.0_wp))
  end subroutine allocate_accumulator

  !> Starts the range of a lane with a value at a time [s].
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
