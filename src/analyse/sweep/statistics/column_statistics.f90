!> Statistics of columns in the lanes of a block, from their polynomials in the steps; an extension finds these.
!>
!> Each column is a function (linear + cubic x^2) x of an x, whose range is accumulated. As x is continuous, the largest value of
!> the column is that of the function between the smallest and the largest x.
module nocdyn_column_statistics
  use nocdyn_chebyshev, only: interpolation_t, max_degree, new_interpolation, raise_to_maximum, time_at
  use nocdyn_damage_sums, only: damage_sum_t
  use nocdyn_kinds, only: wp
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_settling_time, only: settling_history_t
  use nocdyn_statistics, only: is_of_fatigue, is_time_of_extreme, statistic_damage, statistic_final, statistic_max, &
    statistic_max_abs, statistic_mean, statistic_min, statistic_rms, statistic_settling_time, statistic_t, &
    statistic_time_of_max, statistic_time_of_max_abs, statistic_time_of_min
  implicit none (type, external)
  private

  public :: start_range, widen_range

  integer, parameter, public :: width = 8   !! lanes of a strip, which are evaluated together

  !> The extremes, integrals and history of one x from a time on. The shape of all arrays is [whole strips of lanes].
  type, public :: accumulator_t
    integer :: column = 0                    !! number among the columns
    real(wp) :: from = 0.0_wp                !! [s]
    logical :: has_max = .false., has_min = .false., has_max_abs = .false., has_time = .false.   !! extremes that are needed
    logical :: has_sums = .false.            !! whether integrals are needed
    logical :: has_history = .false.         !! whether the settling time is needed
    real(wp), allocatable :: highest(:), lowest(:), highest_time(:), lowest_time(:)   !! of x; times [s]
    real(wp), allocatable :: no_highest(:), no_lowest(:)   !! huge where it is not needed, or for `max_abs` only; else -huge
    real(wp), allocatable :: bound(:)                      !! huge before `from`: x is not of interest; -huge after it
    real(wp), allocatable :: integral(:), square(:)        !! of the column and of its square over time
    type(settling_history_t), allocatable :: history(:)    !! of x
  contains
    procedure :: has_range
  end type accumulator_t

  type, abstract, public :: column_statistics_t
    type(accumulator_t), allocatable :: accumulators(:)       !! in the order of the columns
    type(damage_sum_t), allocatable :: damages(:)             !! the same
    type(interpolation_t) :: rule                             !! of the solution inside the steps
    real(wp), allocatable :: gauss(:), weights(:)             !! nodes, -1 to 1: exact for that and for its square
    real(wp), allocatable :: linear(:, :), cubic(:, :)        !! of the functions of x, [whole strips of lanes, columns]
    real(wp), allocatable :: x_end(:, :)                      !! [lanes, columns]
    real(wp) :: t_start = 0.0_wp, t_end = 0.0_wp              !! of every variant [s]
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)                !! [statistics]
    integer, allocatable, private :: acc(:)                   !! number of the accumulator, or of the damage; 0 for values at the
                                                              !! end; [statistics]
  contains
    procedure :: set_statistics, prepare, start_accumulators, finish_damages, value, severity
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
    type(statistic_t), intent(in) :: statistics(:)     !! each of a column
    integer, intent(in) :: lanes
    real(wp), intent(in) :: t_start, t_end             !! [s]
    integer, allocatable, intent(out) :: wanted(:)     !! the columns that have statistics, ascending
    integer :: i

    self%t_start = t_start
    self%t_end = t_end
    allocate (self%statistics, source=statistics)
    allocate (wanted(0))
    if (size(statistics) > 0) then
      wanted = pack([(i, i=1, maxval(statistics%column))], [(any(statistics%column == i), i=1, maxval(statistics%column))])
    end if
    allocate (self%column, source=[(findloc(wanted, statistics(i)%column, dim=1), i=1, size(statistics))])
    allocate (self%x_end(lanes, size(wanted)), source=0.0_wp)
    associate (padded => width * ((lanes + width - 1) / width))
      allocate (self%linear(padded, size(wanted)), source=1.0_wp)
      allocate (self%cubic(padded, size(wanted)), source=0.0_wp)
      call add_accumulators(self, size(wanted))
      do i = 1, size(self%accumulators)
        call allocate_accumulator(self%accumulators(i), padded)
      end do
    end associate
    call add_damages(self, size(wanted), lanes)
  end subroutine set_statistics

  !> One accumulator for each column and `from`.
  subroutine add_accumulators(self, columns)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: columns
    integer :: c, i, k

    allocate (self%accumulators(0))
    allocate (self%acc(size(self%statistics)), source=0)
    do c = 1, columns
      do i = 1, size(self%statistics)
        associate (statistic => self%statistics(i))
          if (self%column(i) /= c .or. statistic%kind == statistic_final .or. is_of_fatigue(statistic%kind)) cycle
          do k = 1, size(self%accumulators)
            if (self%accumulators(k)%column == c .and. abs(self%accumulators(k)%from - statistic%from) <= 0) exit
          end do
          if (k > size(self%accumulators)) then
            self%accumulators = [self%accumulators, accumulator_t(column=c, from=statistic%from)]
          end if
          self%acc(i) = k
          call add_need(self%accumulators(k), statistic%kind)
        end associate
      end do
    end do
  end subroutine add_accumulators

  !> One damage for each column and &fatigue.
  subroutine add_damages(self, columns, lanes)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: columns, lanes
    type(damage_sum_t), allocatable :: longer(:)
    integer :: c, i, k

    allocate (self%damages(0))
    do c = 1, columns
      do i = 1, size(self%statistics)
        associate (statistic => self%statistics(i))
          if (self%column(i) /= c .or. .not. is_of_fatigue(statistic%kind)) cycle
          do k = 1, size(self%damages)
            if (self%damages(k)%column == c .and. self%damages(k)%fatigue == statistic%fatigue) exit
          end do
          self%acc(i) = k
          if (k <= size(self%damages)) cycle
          allocate (longer(k))
          longer(:k - 1) = self%damages
          longer(k)%column = c
          longer(k)%fatigue = statistic%fatigue
          longer(k)%from = statistic%from
          call longer(k)%allocate_lanes(lanes, statistic%curve)
          call move_alloc(longer, self%damages)
        end associate
      end do
    end do
  end subroutine add_damages

  pure subroutine add_need(acc, kind)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: kind   !! statistic_...

    acc%has_max = acc%has_max .or. kind == statistic_max .or. kind == statistic_time_of_max
    acc%has_min = acc%has_min .or. kind == statistic_min .or. kind == statistic_time_of_min
    acc%has_max_abs = acc%has_max_abs .or. kind == statistic_max_abs .or. kind == statistic_time_of_max_abs
    acc%has_time = acc%has_time .or. is_time_of_extreme(kind)
    acc%has_sums = acc%has_sums .or. kind == statistic_mean .or. kind == statistic_rms
    acc%has_history = acc%has_history .or. kind == statistic_settling_time
  end subroutine add_need

  pure subroutine allocate_accumulator(acc, lanes)
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: lanes

    allocate (acc%highest(lanes), source=0.0_wp)
    allocate (acc%lowest, acc%highest_time, acc%lowest_time, acc%integral, acc%square, source=acc%highest)
    allocate (acc%bound(lanes), source=-huge(0.0_wp))
    allocate (acc%no_highest, acc%no_lowest, source=acc%bound)
    allocate (acc%history(lanes))
  end subroutine allocate_accumulator

  !> Sets the nodes for a degree of the solution inside the steps.
  subroutine prepare(self, degree)
    class(column_statistics_t), intent(inout) :: self
    integer, intent(in) :: degree

    if (self%rule%degree == degree) return
    if (self%rule%degree > 0) error stop 'nocdyn_column_statistics: the method must remain the same'
    self%rule = new_interpolation(degree)
    allocate (self%gauss(degree + 1), self%weights(degree + 1))
    call gauss_legendre_rule(degree + 1, self%gauss, self%weights)
    self%gauss(:) = 2 * self%gauss - 1
  end subroutine prepare

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
        acc%integral(lane) = 0.0_wp
        acc%square(lane) = 0.0_wp
        call acc%history(lane)%clear()
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

    associate (statistic => self%statistics(number), x_end => self%x_end(lane, self%column(number)), &
               linear => self%linear(lane, self%column(number)), cubic => self%cubic(lane, self%column(number)))
      if (statistic%kind == statistic_final) then
        value = column_at(linear, cubic, x_end)
        return
      else if (is_of_fatigue(statistic%kind)) then
        associate (counter => self%damages(self%acc(number))%counters(lane))
          value = merge(counter%damage, counter%cycles, statistic%kind == statistic_damage)
        end associate
        return
      end if
      associate (acc => self%accumulators(self%acc(number)), duration => self%t_end - statistic%from)
        select case (statistic%kind)
        case (statistic_max)
          value = largest(linear, cubic, acc%lowest(lane), acc%highest(lane))
        case (statistic_min)
          value = -largest(linear, cubic, -acc%highest(lane), -acc%lowest(lane))
        case (statistic_max_abs)
          value = max(largest(linear, cubic, acc%lowest(lane), acc%highest(lane)), &
                      largest(linear, cubic, -acc%highest(lane), -acc%lowest(lane)))
        case (statistic_time_of_max)
          value = acc%highest_time(lane)
        case (statistic_time_of_min)
          value = acc%lowest_time(lane)
        case (statistic_time_of_max_abs)
          value = merge(acc%highest_time(lane), acc%lowest_time(lane), acc%highest(lane) >= -acc%lowest(lane))
          if (.not. abs(acc%highest(lane) + acc%lowest(lane)) > 0) value = min(value, acc%lowest_time(lane))
        case (statistic_mean)
          value = acc%integral(lane) / duration
        case (statistic_rms)
          value = sqrt(acc%square(lane) / duration)
        case (statistic_settling_time)
          value = acc%history(lane)%last_exit(self%rule, x_end, statistic%band) - statistic%from
        case default
          error stop 'nocdyn_column_statistics: there is no such statistic'
        end select
      end associate
    end associate
  end function value

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
