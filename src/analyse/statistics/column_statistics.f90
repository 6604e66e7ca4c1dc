!> Statistics of columns in the lanes of a block, from their polynomials in the steps; an extension finds these.
!>
!> Each column is a function (linear + cubic x^2) x of an x, whose range is accumulated. As x is continuous, the largest value of
!> the column is the one of the function between the smallest and the largest x.
module nocdyn_column_statistics
  use nocdyn_chebyshev, only: interpolation_t, max_degree, raise_to_maximum, time_at
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_damage_sums, only: damage_sum_t
  use nocdyn_kinds, only: wp
  use nocdyn_settling_time, only: settling_history_t
  use nocdyn_statistics, only: is_of_fatigue, is_time_of_extreme, statistic_damage, statistic_final, statistic_max, &
    statistic_max_abs, statistic_mean, statistic_min, statistic_rms, statistic_settling_time, statistic_t, &
    statistic_time_of_max, statistic_time_of_max_abs, statistic_time_of_min
  implicit none (type, external)
  private

  public :: start_range, widen_range

  integer, parameter, public :: width = 8   !! lanes of a strip, which are evaluated together

  !> An extreme counts if it exceeds the value at the start of the range by more than this share of the largest value. A smaller
  !> excess is rounding: a machine that starts at rest has its smallest energy at the start.
  real(wp), parameter :: rounding_limit = 16 * epsilon(1.0_wp)

  !> The extremes, integrals and history of one x from a time on. The shape of all arrays is [whole strips of lanes].
  type, public :: accumulator_t
    integer :: column = 0                    !! number among the columns
    real(wp) :: from = 0.0_wp                !! [s]
    logical :: has_max = .false., has_min = .false., has_max_abs = .false., has_time = .false.   !! extremes that are needed
    logical :: has_sums = .false.            !! whether integrals are needed
    logical :: has_history = .false.         !! whether the settling time is needed
    real(wp), allocatable :: first(:)        !! x where its range begins
    real(wp), allocatable :: highest(:), lowest(:), highest_time(:), lowest_time(:)   !! of x; times [s]
    real(wp), allocatable :: no_highest(:), no_lowest(:)   !! huge where it is not needed, or for `max_abs` only; else -huge
    real(wp), allocatable :: bound(:)                      !! huge before `from`: x is not of interest; -huge after it
    real(wp), allocatable :: integral(:), square(:)        !! of the column and of its square over time, if `has_sums`
    type(settling_history_t), allocatable :: history(:)    !! of x, if `has_history`
  contains
    procedure :: has_range
  end type accumulator_t

  type, abstract, public :: column_statistics_t
    type(accumulator_t), allocatable :: accumulators(:)       !! in the order of the columns
    type(damage_sum_t), allocatable :: damages(:)             !! in the order of the columns
    type(interpolation_t) :: rules(max_degree)                !! of the degrees of the steps that there have been
    real(wp), allocatable :: linear(:, :), cubic(:, :)        !! of the functions of x, [whole strips of lanes, columns]
    real(wp), allocatable :: x_end(:, :)                      !! [lanes, columns]
    real(wp) :: t_start = 0.0_wp, t_end = 0.0_wp              !! of every variant [s]
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)                !! [statistics]
    integer, allocatable, private :: acc(:)                   !! number of the accumulator, or of the damage; 0 for values at the
                                                              !! end; [statistics]
  contains
    procedure :: set_statistics, start_accumulators, finish_damages, value, severity, counter
  end type column_statistics_t

contains

  !> Whether an extreme is needed.
  pure logical function has_range(self)
    class(accumulator_t), intent(in) :: self

    has_range = self%has_max .or. self%has_min .or. self%has_max_abs
  end function has_range

  !> Sets what is to be accumulated. x is the column itself, unless an extension sets `linear` and `cubic`.
  subroutine set_statistics(self, statistics, lanes, t_start, t_end, wanted)
    class(column_statistics_t), intent(inout) :: self
    type(statistic_t), intent(in) :: statistics(:)       !! each of a column
    integer, intent(in) :: lanes
    real(wp), intent(in) :: t_start, t_end               !! [s]
    integer, allocatable, intent(out) :: wanted(:)       !! columns that have statistics, ascending
    integer, allocatable :: number(:)   ! of each column among them, 0: none
    integer :: i

    self%t_start = t_start
    self%t_end = t_end
    allocate (self%statistics, source=statistics)
    allocate (number(maxval([0, statistics%column])), source=0)
    do i = 1, size(statistics)
      number(statistics(i)%column) = 1
    end do
    wanted = pack([(i, i=1, size(number))], number > 0)
    number(:) = 0
    do i = 1, size(wanted)
      number(wanted(i)) = i
    end do
    allocate (self%column(size(statistics)))
    self%column(:) = number(statistics%column)
    allocate (self%x_end(lanes, size(wanted)), source=0.0_wp)
    associate (padded => width * ((lanes + width - 1) / width))
      allocate (self%linear(padded, size(wanted)), source=1.0_wp)
      allocate (self%cubic(padded, size(wanted)), source=0.0_wp)
      call add_accumulators(self, size(wanted))
      do i = 1, size(self%accumulators)
        allocate (self%accumulators(i)%highest(padded), source=0.0_wp)
        allocate (self%accumulators(i)%first, self%accumulators(i)%lowest, self%accumulators(i)%highest_time, &
          self%accumulators(i)%lowest_time, source=self%accumulators(i)%highest)
        allocate (self%accumulators(i)%bound(padded), source=-huge(0.0_wp))
        allocate (self%accumulators(i)%no_highest, self%accumulators(i)%no_lowest, source=self%accumulators(i)%bound)
        if (self%accumulators(i)%has_sums) allocate (self%accumulators(i)%integral, self%accumulators(i)%square, &
                                                     source=self%accumulators(i)%highest)
        if (self%accumulators(i)%has_history) allocate (self%accumulators(i)%history(padded))
      end do
    end associate
    call add_damages(self, lanes)
  end subroutine set_statistics

  !> One accumulator for each column and `from`.
  subroutine add_accumulators(self, columns)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: columns
    integer :: leader(size(self%statistics))   ! the first statistic of each accumulator
    integer :: next(size(self%statistics)), first(columns)   ! statistics of each column
    integer :: c, count, i, k, of_column

    first = 0
    do i = size(self%statistics), 1, -1
      next(i) = first(self%column(i))
      first(self%column(i)) = i
    end do
    allocate (self%acc(size(self%statistics)), source=0)
    count = 0
    do c = 1, columns
      of_column = count
      i = first(c)
      do while (i > 0)
        associate (statistic => self%statistics(i))
          if (statistic%kind /= statistic_final .and. .not. is_of_fatigue(statistic%kind)) then
            do k = of_column + 1, count
              if (abs(self%statistics(leader(k))%from - statistic%from) <= 0) exit
            end do
            if (k > count) leader(k) = i
            count = max(count, k)
            self%acc(i) = k
          end if
        end associate
        i = next(i)
      end do
    end do
    allocate (self%accumulators(count))
    do i = 1, size(self%statistics)
      if (self%acc(i) > 0) call add_need(self%statistics(i), self%column(i), self%accumulators(self%acc(i)))
    end do
  end subroutine add_accumulators

  !> Lets an accumulator have what a statistic of its column needs.
  pure subroutine add_need(statistic, column, acc)
    type(statistic_t), intent(in) :: statistic
    integer, intent(in) :: column
    type(accumulator_t), intent(inout) :: acc

    acc%column = column
    acc%from = statistic%from
    acc%has_max = acc%has_max .or. statistic%kind == statistic_max .or. statistic%kind == statistic_time_of_max
    acc%has_min = acc%has_min .or. statistic%kind == statistic_min .or. statistic%kind == statistic_time_of_min
    acc%has_max_abs = acc%has_max_abs .or. statistic%kind == statistic_max_abs .or. statistic%kind == statistic_time_of_max_abs
    acc%has_time = acc%has_time .or. is_time_of_extreme(statistic%kind)
    acc%has_sums = acc%has_sums .or. statistic%kind == statistic_mean .or. statistic%kind == statistic_rms
    acc%has_history = acc%has_history .or. statistic%kind == statistic_settling_time
  end subroutine add_need

  !> One damage for each column and &fatigue.
  subroutine add_damages(self, lanes)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: lanes
    integer :: first(size(self%statistics))   ! statistics, of different columns or of different &fatigue
    integer :: count, i, k

    count = 0
    do i = 1, size(self%statistics)
      associate (statistic => self%statistics(i))
        if (.not. is_of_fatigue(statistic%kind)) cycle
        do k = 1, count
          if (self%column(first(k)) == self%column(i) .and. self%statistics(first(k))%fatigue == statistic%fatigue) exit
        end do
        self%acc(i) = k
        if (k > count) first(k) = i
        count = max(count, k)
      end associate
    end do
    allocate (self%damages(count))
    do k = 1, count
      associate (statistic => self%statistics(first(k)), damage => self%damages(k))
        damage%column = self%column(first(k))
        damage%fatigue = statistic%fatigue
        damage%from = statistic%from
        call damage%allocate_lanes(lanes, statistic%curve, statistic%keeps_classes)
      end associate
    end do
  end subroutine add_damages

  !> Starts a variant in a lane, of which `linear` and `cubic` have been set.
  pure subroutine start_accumulators(self, lane)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: i
    logical :: is_increasing

    do i = 1, size(self%accumulators)
      associate (acc => self%accumulators(i), linear => self%linear(lane, self%accumulators(i)%column), &
                 cubic => self%cubic(lane, self%accumulators(i)%column))
        is_increasing = min(linear, cubic) >= 0
        acc%no_highest(lane) = merge(huge(0.0_wp), -huge(0.0_wp), is_increasing .and. .not. acc%has_max)
        acc%no_lowest(lane) = merge(huge(0.0_wp), -huge(0.0_wp), is_increasing .and. .not. acc%has_min)
        acc%highest(lane) = -huge(0.0_wp)
        acc%lowest(lane) = huge(0.0_wp)
        acc%bound(lane) = huge(0.0_wp)
        if (acc%has_sums) acc%integral(lane) = 0.0_wp
        if (acc%has_sums) acc%square(lane) = 0.0_wp
        if (acc%has_history) call acc%history(lane)%clear()
      end associate
    end do
    do i = 1, size(self%damages)
      call self%damages(i)%start(lane)
    end do
  end subroutine start_accumulators

  !> Counts what is left of the cycles of a lane after its last step.
  pure subroutine finish_damages(self, lane)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: i

    do i = 1, size(self%damages)
      call self%damages(i)%finish(lane)
    end do
  end subroutine finish_damages

  !> Starts the range of a lane with a value at a time [s].
  pure subroutine start_range(acc, lane, x, t)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: lane
    real(wp), intent(in) :: x, t

    acc%bound(lane) = -huge(0.0_wp)
    acc%first(lane) = x
    acc%highest(lane) = x
    acc%lowest(lane) = x
    acc%highest_time(lane) = t
    acc%lowest_time(lane) = t
  end subroutine start_range

  !> Widens the range of a lane by the extremes of a polynomial over the times from t_start to t_end, where they are of interest.
  pure subroutine widen_range(acc, rule, lane, values, t_start, t_end, rises, falls)
    type(accumulator_t), intent(inout) :: acc
    type(interpolation_t), intent(in) :: rule
    integer, intent(in) :: lane
    real(wp), intent(in) :: values(0:rule%degree)   !! at the nodes
    real(wp), intent(in) :: t_start, t_end          !! [s]
    logical, intent(in) :: rises, falls             !! whether it may exceed the largest value so far, or fall below the smallest
    real(wp) :: level, negated(0:max_degree), position
    logical :: found

    associate (highest => acc%highest(lane), lowest => acc%lowest(lane))
      if (rises) then
        level = max(highest, min(acc%no_highest(lane), merge(-lowest, huge(0.0_wp), acc%has_max_abs)))
        call raise_to_maximum(rule, values, level, position, found)
        if (found) highest = level
        if (found) acc%highest_time(lane) = time_at(position, t_start, t_end)
      end if
      if (falls) then
        level = max(-lowest, min(acc%no_lowest(lane), merge(highest, huge(0.0_wp), acc%has_max_abs)))
        negated(:rule%degree) = -values
        call raise_to_maximum(rule, negated, level, position, found)
        if (found) lowest = -level
        if (found) acc%lowest_time(lane) = time_at(position, t_start, t_end)
      end if
    end associate
  end subroutine widen_range

  !> The value of a statistic in a lane that has reached its end.
  pure real(wp) function value(self, number, lane)
    class(column_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    associate (statistic => self%statistics(number), x_end => self%x_end(lane, self%column(number)))
      if (statistic%kind == statistic_final) then
        value = column_at(self%linear(lane, self%column(number)), self%cubic(lane, self%column(number)), x_end)
        return
      else if (is_of_fatigue(statistic%kind)) then
        associate (counter => self%damages(self%acc(number))%counters(lane))
          value = merge(counter%damage, counter%cycles, statistic%kind == statistic_damage)
        end associate
        return
      end if
      associate (acc => self%accumulators(self%acc(number)), duration => self%t_end - statistic%from)
        select case (statistic%kind)
        case (statistic_mean)
          value = acc%integral(lane) / duration
        case (statistic_rms)
          value = sqrt(acc%square(lane) / duration)
        case (statistic_settling_time)
          value = acc%history(lane)%last_exit(self%rules, x_end, statistic%band) - statistic%from
        case default
          value = extreme(acc, statistic, lane, self%linear(lane, acc%column), self%cubic(lane, acc%column))
        end select
      end associate
    end associate
  end function value

  !> An extreme, or its time, in a lane.
  pure real(wp) function extreme(acc, statistic, lane, linear, cubic) result(value)
    type(accumulator_t), intent(in) :: acc
    type(statistic_t), intent(in) :: statistic
    integer, intent(in) :: lane
    real(wp), intent(in) :: linear, cubic   !! of the column
    real(wp) :: high, high_time, low, low_time, rounding

    high = acc%highest(lane)
    low = acc%lowest(lane)
    high_time = acc%highest_time(lane)
    low_time = acc%lowest_time(lane)
    rounding = rounding_limit * max(abs(low), abs(high))
    if (high <= acc%first(lane) + rounding .or. abs(linear) + abs(cubic) <= 0) then
      high = acc%first(lane)
      high_time = statistic%from
    end if
    if (low >= acc%first(lane) - rounding .or. abs(linear) + abs(cubic) <= 0) then
      low = acc%first(lane)
      low_time = statistic%from
    end if
    select case (statistic%kind)
    case (statistic_max)
      value = largest(linear, cubic, low, high)
    case (statistic_min)
      value = -largest(linear, cubic, -high, -low)
    case (statistic_max_abs)
      value = max(largest(linear, cubic, low, high), largest(linear, cubic, -high, -low))
    case (statistic_time_of_max)
      value = high_time
    case (statistic_time_of_min)
      value = low_time
    case (statistic_time_of_max_abs)
      value = merge(high_time, low_time, high >= -low)
      if (.not. abs(high + low) > 0) value = min(value, low_time)
    case default
      error stop 'nocdyn_column_statistics: there is no such statistic'
    end select
  end function extreme

  !> The counter of a statistic of a &fatigue in a lane.
  type(damage_counter_t) function counter(self, number, lane)
    class(column_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    counter = self%damages(self%acc(number))%counters(lane)
  end function counter

  !> By what the worst of several statistics of a &fatigue is found: the damage, and the largest range.
  pure function severity(self, number, lane)
    class(column_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of a statistic of a &fatigue
    integer, intent(in) :: lane
    real(wp) :: severity(2)

    associate (counter => self%damages(self%acc(number))%counters(lane))
      severity = [counter%damage, counter%largest_range]
    end associate
  end function severity

  !> The column at x.
  pure real(wp) function column_at(linear, cubic, x)
    real(wp), intent(in) :: linear, cubic, x

    column_at = (linear + cubic * x * x) * x
  end function column_at

  !> The largest value of a column between two values of x.
  pure real(wp) function largest(linear, cubic, low, high)
    real(wp), intent(in) :: linear, cubic, low, high
    real(wp) :: turn

    largest = max(column_at(linear, cubic, low), column_at(linear, cubic, high))
    if (min(linear, cubic) >= 0 .or. max(linear, cubic) <= 0) return   ! monotonic
    turn = sqrt(-linear / (3 * cubic))
    if (cubic > 0) turn = -turn   ! where the maximum is
    if (turn > low .and. turn < high) largest = max(largest, column_at(linear, cubic, turn))
  end function largest

end module nocdyn_column_statistics
