!> Statistics of columns that are functions of a linear function x of the state, directly from the polynomials of the steps.
!>
!> The elastic moment of a stiffening coupling increases with its twist, so that it has its extremes where the twist has them.
!> Bounds on x, computed from its coefficients in vector loops over the lanes, tell in which steps x may exceed the extremes so
!> far; only these steps are searched.
module nocdyn_linear_statistics
  use nocdyn_bernstein, only: make_bernstein_matrix, max_degree, raise_to_maximum
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: linear_columns_t, new_linear_columns, lane_in_strip, strip_of, width
  use nocdyn_linear_accumulators, only: new_accumulators, start_range, accumulator_t
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_mean, statistic_min, statistic_rms, &
    statistic_t, statistic_time_of_max
  use nocdyn_step_strips, only: add_integrals, expand, exclude_monotonic, fill_chord_gaps, strip_t, cut_step
  use nocdyn_observer, only: step_block_t
  use nocdyn_trajectory_columns, only: column_t
  implicit none (type, external)
  private

  public :: new_linear_statistics

  type, public :: linear_statistics_t
    type(linear_columns_t) :: columns
    real(wp), private :: t_end = 0.0_wp
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)                !! among the linear ones, [statistics]
    integer, allocatable, private :: acc(:)                   !! number of the accumulator, 0 for values at the end; [statistics]
    type(accumulator_t), allocatable, private :: accumulators(:)          !! in the order of the columns
    real(wp), allocatable, private :: nodes(:), weights(:)    !! of Gauss, 0 to 1
    real(wp), allocatable, private :: chord_gap(:)   !! largest value of s - s^p for s from 0 to 1, p = 1 to degree
    real(wp), allocatable, private :: to_bernstein(:, :)
    real(wp), private :: t_start = 0.0_wp
    real(wp), allocatable, private :: x_end(:, :)             !! [lanes, columns]
    real(wp), allocatable, private :: y_last(:, :), y_new_last(:, :), c_last(:, :, :)   !! of an incomplete last strip, padded
    type(strip_t), private :: strip, cut
  contains
    procedure :: start_lane, is_increasing, add_steps, finish_lane, value
  end type linear_statistics_t

contains

  !> Statistics of the variants that pass through the lanes of a block.
  type(linear_statistics_t) function new_linear_statistics(block, columns, statistics, t_start, t_end) result(self)
    class(formulation_t), intent(in) :: block
    type(column_t), intent(in) :: columns(:)         !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)   !! each of a column that `is_linear`
    real(wp), intent(in) :: t_start, t_end           !! of every variant [s]
    integer, allocatable :: wanted(:)
    integer :: i

    self%t_start = t_start
    self%t_end = t_end
    allocate (self%statistics, source=statistics)
    allocate (wanted, source=pack([(i, i=1, size(columns))], [(any(statistics%column == i), i=1, size(columns))]))
    allocate (self%column, source=[(findloc(wanted, statistics(i)%column, dim=1), i=1, size(statistics))])
    self%columns = new_linear_columns(block, columns(wanted))
    allocate (self%x_end(block%lanes, size(wanted)), source=0.0_wp)
    call new_accumulators(statistics, self%column, block%lanes, self%accumulators, self%acc)
  end function new_linear_statistics

  !> Starts a variant in a lane of the block.
  subroutine start_lane(self, block, lane, y)
    class(linear_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    call self%columns%copy_lane(block, lane)
    do i = 1, size(self%accumulators)
      associate (acc => self%accumulators(i), at => lane_in_strip(lane), strip => strip_of(lane))
        acc%highest(at, strip) = -huge(0.0_wp)
        acc%lowest(at, strip) = huge(0.0_wp)
        acc%bound(at, strip) = huge(0.0_wp)
        acc%integral(at, strip) = 0.0_wp
        acc%square(at, strip) = 0.0_wp
        if (acc%from > self%t_start) cycle
        call start_range(acc, at, strip, self%columns%argument(acc%column, lane, y), self%t_start)
      end associate
    end do
  end subroutine start_lane

  !> Whether the column of a statistic increases with x in a lane.
  pure logical function is_increasing(self, number, lane)
    class(linear_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    is_increasing = self%columns%is_increasing(self%column(number), lane)
  end function is_increasing

  !> Takes the end of a variant.
  subroutine finish_lane(self, lane, y)
    class(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    do i = 1, self%columns%count
      self%x_end(lane, i) = self%columns%argument(i, lane, y)
    end do
  end subroutine finish_lane

  !> Adds the last steps of the lanes.
  subroutine add_steps(self, steps, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :)   !! starts and ends of the steps, [lanes, padded components]
    real(wp), contiguous, intent(in) :: c(:, :, :)             !! coefficients of the steps, [lanes, padded components, degree]
    integer :: column, i, number

    if (size(self%accumulators) == 0) return
    if (.not. allocated(self%nodes)) call allocate_work(self, size(c, 2), size(c, 3))
    do number = 1, size(self%accumulators(1)%bound, 2)
      call load_strip(self, number, steps, y, y_new, c)
      column = 0
      do i = 1, size(self%accumulators)
        associate (acc => self%accumulators(i))
          if (acc%column /= column) call expand_strip(self, acc%column, number, y, y_new, c)
          column = acc%column
          if (acc%has_range) call widen_strip(self, acc, number, steps, size(c, 3))
          if (acc%has_sums) call integrate_strip(self, acc, number, steps, size(c, 3))
        end associate
      end do
    end do
  end subroutine add_steps

  !> Nodes and work space for a degree of the solution inside the steps.
  subroutine allocate_work(self, columns, degree)
    type(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: columns   !! padded components of the state
    integer, intent(in) :: degree

    if (degree > max_degree) error stop 'nocdyn_linear_statistics: the solution inside the step has too many coefficients'
    allocate (self%nodes(degree + 1), self%weights(degree + 1))
    call gauss_legendre_rule(degree + 1, self%nodes, self%weights)
    allocate (self%chord_gap(degree))
    call fill_chord_gaps(self%chord_gap)
    allocate (self%to_bernstein(0:max_degree, 0:degree))
    call make_bernstein_matrix(degree, self%to_bernstein)
    allocate (self%y_last(width, columns), self%y_new_last(width, columns), self%c_last(width, columns, degree), source=0.0_wp)
  end subroutine allocate_work

  !> Loads the steps of the lanes of a strip. Those of an incomplete last strip are copied to padded arrays.
  subroutine load_strip(self, number, steps, y, y_new, c)
    type(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: number
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)
    integer :: i

    associate (strip => self%strip)
      strip%before = width * (number - 1)
      strip%lanes = min(width, size(c, 1) - strip%before)
      strip%is_complete = strip%lanes == width .and. steps%are_all_taken
      if (strip%is_complete) then
        strip%t_end = steps%t_new(strip%before + 1:strip%before + width)
        strip%scale = steps%scale(strip%before + 1:strip%before + width)
        return
      end if
      do i = 1, strip%lanes
        strip%t_end(i) = steps%t_new(strip%before + i)
        strip%scale(i) = merge(steps%scale(strip%before + i), 0.0_wp, steps%taken(strip%before + i))
      end do
      if (strip%lanes == width) return
      self%y_last(:strip%lanes, :) = y(strip%before + 1:, :)
      self%y_new_last(:strip%lanes, :) = y_new(strip%before + 1:, :)
      self%c_last(:strip%lanes, :, :) = c(strip%before + 1:, :, :)
    end associate
  end subroutine load_strip

  !> Computes x of a column in the steps of the strip.
  subroutine expand_strip(self, column, number, y, y_new, c)
    type(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: column, number
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)
    integer :: i

    associate (columns => self%columns, first => self%columns%first(column))
      associate (entries => columns%first(column + 1) - first)
        if (self%strip%lanes < width) then
          call expand(width, size(c, 2), size(c, 3), 1, self%chord_gap, entries, columns%component(first), &
                      columns%factor(1, first, number), &
                      columns%offset(1, column, number), self%y_last, self%y_new_last, self%c_last, self%strip)
        else
          call expand(size(c, 1), size(c, 2), size(c, 3), self%strip%before + 1, self%chord_gap, entries, &
                      columns%component(first), &
                      columns%factor(1, first, number), columns%offset(1, column, number), y, y_new, c, self%strip)
        end if
      end associate
    end associate
    if (self%strip%is_complete) return
    do i = 1, width
      if (abs(self%strip%scale(i)) <= 0) self%strip%x_end(i) = self%strip%x_start(i)
    end do
  end subroutine expand_strip

  !> Widens the range of x by the steps of the strip.
  subroutine widen_strip(self, acc, number, steps, degree)
    type(linear_statistics_t), intent(in) :: self
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: number
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    real(wp) :: rise(width), fall(width)   ! bounds: how far x and -x exceed the extremes so far
    integer :: i

    associate (strip => self%strip)
      call widen_by_ends(acc%has_time, strip%t_end, strip%x_end, acc%bound(1, number), acc%highest(1, number), &
                         acc%lowest(1, number), acc%highest_time(1, number))
      call bound_excess(acc, strip%x_start, strip%x_end, strip%above, strip%below, acc%bound(1, number), &
                        acc%highest(1, number), acc%lowest(1, number), rise, fall)
      if (any_positive(rise, fall)) call exclude_monotonic(degree, self%chord_gap, strip%scale, strip%c, rise, fall)
      if (.not. (steps%may_be_cut .or. acc%from > self%t_start)) then
        if (.not. any_positive(rise, fall)) return
      end if
      do i = 1, strip%lanes
        associate (lane => strip%before + i)
          if (steps%theta_end(lane) < 1 .or. acc%bound(i, number) > 0) then   ! the bounds are not valid
            rise(i) = 1.0_wp
            fall(i) = 1.0_wp
          end if
          if (max(rise(i), fall(i)) <= 0) cycle
          if (.not. steps%taken(lane) .or. strip%t_end(i) <= acc%from) cycle
          call look_inside(self, acc, i, number, steps%t(lane), steps%h(lane), steps%theta_end(lane), degree, rise(i), fall(i))
        end associate
      end do
    end associate
  end subroutine widen_strip

  !> Widens the range of x by its values at the ends of the steps, in the lanes that have passed `from`.
  pure subroutine widen_by_ends(has_time, t_end, x_end, bound, highest, lowest, highest_time)
    logical, intent(in) :: has_time
    real(wp), intent(in) :: t_end(width), x_end(width), bound(width)
    real(wp), intent(inout) :: highest(width), lowest(width), highest_time(width)
    integer :: i

    if (has_time) then
      do i = 1, width
        highest_time(i) = merge(t_end(i), highest_time(i), min(x_end(i), -bound(i)) > highest(i))
      end do
    end if
    do i = 1, width
      highest(i) = max(highest(i), min(x_end(i), -bound(i)))
    end do
    do i = 1, width
      lowest(i) = min(lowest(i), max(x_end(i), bound(i)))
    end do
  end subroutine widen_by_ends

  !> Bounds on how far x and -x exceed the extremes so far.
  pure subroutine bound_excess(acc, x_start, x_end, above, below, bound, highest, lowest, rise, fall)
    type(accumulator_t), intent(in) :: acc
    real(wp), intent(in), dimension(width) :: x_start, x_end, above, below, bound, highest, lowest
    real(wp), intent(out) :: rise(width), fall(width)
    integer :: i

    rise = huge(0.0_wp)
    fall = huge(0.0_wp)
    if (acc%has_max_abs) then
      do i = 1, width
        rise(i) = max(highest(i), -lowest(i))
      end do
      fall = rise
    end if
    if (acc%has_max) rise = highest
    if (acc%has_min) fall = -lowest
    do i = 1, width
      rise(i) = (max(x_start(i), x_end(i)) + above(i)) - max(rise(i), bound(i))
    end do
    do i = 1, width
      fall(i) = (below(i) - min(x_start(i), x_end(i))) - max(fall(i), bound(i))
    end do
  end subroutine bound_excess

  pure logical function any_positive(x, y)
    real(wp), intent(in) :: x(width), y(width)
    integer :: i, positive

    positive = 0
    do i = 1, width
      positive = positive + merge(1, 0, max(x(i), y(i)) > 0)
    end do
    any_positive = positive > 0
  end function any_positive

  !> Widens the range of x by its extremes in the part of a step after `from` and before its end.
  pure subroutine look_inside(self, acc, i, number, t, h, theta_end, degree, rise, fall)
    type(linear_statistics_t), intent(in) :: self
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: i, number
    real(wp), intent(in) :: t, h, theta_end   !! start [s], size [s], end relative to the size
    integer, intent(in) :: degree
    real(wp), intent(in) :: rise, fall        !! positive if x, or -x, may exceed the extremes so far
    real(wp) :: level, c(0:max_degree), position, t_start
    logical :: found

    associate (highest => acc%highest(i, number), lowest => acc%lowest(i, number), time => acc%highest_time(i, number), &
               x_end => self%strip%x_end(i), t_end => self%strip%t_end(i))
      call cut_step(self%strip, i, acc%from, t, h, theta_end, degree, c, t_start)
      if (acc%bound(i, number) > 0) then
        call start_range(acc, i, number, c(0), t_start)
        if (x_end > highest) time = t_end
        highest = max(highest, x_end)
        lowest = min(lowest, x_end)
      end if
      if (rise > 0 .and. (acc%has_max .or. acc%has_max_abs)) then
        level = highest
        if (.not. acc%has_max) level = max(highest, -lowest)
        call raise_to_maximum(degree, self%to_bernstein, c, level, position, found)
        if (found) highest = level
        if (found) time = t_start + position * (t_end - t_start)
      end if
      if (fall > 0 .and. (acc%has_min .or. acc%has_max_abs)) then
        level = -lowest
        if (.not. acc%has_min) level = max(highest, -lowest)
        c(:degree) = -c(:degree)
        call raise_to_maximum(degree, self%to_bernstein, c, level, position, found)
        if (found) lowest = -level
      end if
    end associate
  end subroutine look_inside

  !> Adds the integrals of a column and of its square over the parts of the steps after `from`.
  subroutine integrate_strip(self, acc, number, steps, degree)
    type(linear_statistics_t), intent(inout) :: self
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: number
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    real(wp) :: c(0:max_degree), duration(width), t_start
    integer :: i

    duration = 0.0_wp
    if (steps%may_be_cut .or. acc%from > self%t_start) then
      self%cut = self%strip
      do i = 1, self%strip%lanes
        associate (lane => self%strip%before + i)
          if (.not. steps%taken(lane) .or. steps%t_new(lane) <= acc%from) cycle
          call cut_step(self%strip, i, acc%from, steps%t(lane), steps%h(lane), steps%theta_end(lane), degree, c(:degree), t_start)
          duration(i) = steps%t_new(lane) - t_start
        end associate
        self%cut%x_start(i) = c(0)
        self%cut%c(i, :degree) = c(1:degree)
        self%cut%scale(i) = 1.0_wp
      end do
      call add_integrals(self%cut, degree, self%nodes, self%weights, duration, self%columns%linear(1, acc%column, number), &
                         self%columns%cubic(1, acc%column, number), acc%integral(1, number), acc%square(1, number))
    else
      do i = 1, self%strip%lanes
        associate (lane => self%strip%before + i)
          if (steps%taken(lane)) duration(i) = steps%t_new(lane) - steps%t(lane)
        end associate
      end do
      call add_integrals(self%strip, degree, self%nodes, self%weights, duration, self%columns%linear(1, acc%column, number), &
                         self%columns%cubic(1, acc%column, number), acc%integral(1, number), acc%square(1, number))
    end if
  end subroutine integrate_strip

  !> The value of a statistic in a lane that has reached its end. Extremes are valid if the column increases with x.
  real(wp) function value(self, number, lane)
    class(linear_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    associate (columns => self%columns, column => self%column(number))
      if (self%statistics(number)%kind == statistic_final) then
        value = columns%law(column, lane, self%x_end(lane, column))
        return
      end if
      associate (acc => self%accumulators(self%acc(number)), at => lane_in_strip(lane), strip => strip_of(lane))
        select case (self%statistics(number)%kind)
        case (statistic_max)
          value = columns%law(column, lane, acc%highest(at, strip))
        case (statistic_min)
          value = columns%law(column, lane, acc%lowest(at, strip))
        case (statistic_max_abs)
          value = columns%law(column, lane, max(acc%highest(at, strip), -acc%lowest(at, strip)))
        case (statistic_time_of_max)
          value = acc%highest_time(at, strip)
        case (statistic_mean)
          value = acc%integral(at, strip) / (self%t_end - acc%from)
        case (statistic_rms)
          value = sqrt(acc%square(at, strip) / (self%t_end - acc%from))
        case default
          error stop 'nocdyn_linear_statistics: there is no such statistic'
        end select
      end associate
    end associate
  end function value

end module nocdyn_linear_statistics
