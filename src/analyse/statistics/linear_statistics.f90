!> Statistics of columns that are functions of a linear function x of the state, directly from the polynomials of the steps.
!>
!> Bounds on x, computed from its coefficients in vector loops over the lanes, tell in which steps x may exceed the extremes so
!> far; only in these steps it is evaluated at the nodes of the interpolation.
module nocdyn_linear_statistics
  use nocdyn_chebyshev, only: max_degree, new_interpolation
  use nocdyn_column_statistics, only: accumulator_t, column_statistics_t, start_range, widen_range, width
  use nocdyn_damage_sums, only: damage_sum_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: linear_columns_t, new_linear_columns, strip_of
  use nocdyn_range_filter, only: new_range_filter, range_filter_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_step_strips, only: add_integrals, bound_excursions, exclude_by_hull, exclude_monotonic, expand, &
    expand_single, fill_chord_gaps, fill_hull, find_part, strip_t, values_at
  use nocdyn_observer, only: step_block_t
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_signals, only: signal_source_t
  implicit none (type, external)
  private

  public :: new_linear_statistics

  type, extends(column_statistics_t), public :: linear_statistics_t
    type(linear_columns_t) :: columns
    real(wp), allocatable, private :: gauss(:), weights(:)   !! nodes, -1 to 1: exact for x and for its square
    real(wp), allocatable, private :: hull(:, :)     !! as in `fill_hull`
    real(wp), allocatable, private :: chord_gap(:)   !! largest value of s - s^p for s from 0 to 1, p = 1 to degree
    real(wp), allocatable, private :: y_last(:, :), y_new_last(:, :), c_last(:, :, :)   !! of an incomplete last strip, padded
    type(strip_t), private :: strip
    type(range_filter_t), private :: filter                  !! of the accumulators of a single lane
    logical, private :: is_filter_current = .false.          !! whether it has their ranges and the factors of the columns
  contains
    procedure :: start_lane, copy_lane, add_steps, add_state, finish_lane, read_components
  end type linear_statistics_t

contains

  !> Statistics of the variants that pass through the lanes of a block.
  type(linear_statistics_t) function new_linear_statistics(block, columns, statistics, t_start, t_end) result(self)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: columns(:)         !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)   !! each of a column that `is_linear`; a moment has no time of extremes
    real(wp), intent(in) :: t_start, t_end           !! of every variant [s]
    integer, allocatable :: wanted(:)   ! columns that have statistics

    call self%set_statistics(statistics, block%lanes, t_start, t_end, wanted)
    self%columns = new_linear_columns(block, columns(wanted))
  end function new_linear_statistics

  !> The range of the components of the state that are read inside the steps; it remains as it is if there are none.
  pure subroutine read_components(self, first, last)
    class(linear_statistics_t), intent(in) :: self
    integer, intent(inout) :: first, last
    integer :: i

    if (size(self%accumulators) + size(self%damages) == 0) return
    first = huge(first)
    last = 0
    do i = 1, self%columns%count
      if (.not. (any(self%accumulators%column == i) .or. any(self%damages%column == i))) cycle
      associate (columns => self%columns)
        first = min(first, minval(columns%component(columns%first(i):columns%first(i + 1) - 1)))
        last = max(last, maxval(columns%component(columns%first(i):columns%first(i + 1) - 1)))
      end associate
    end do
  end subroutine read_components

  !> Starts a variant in a lane of the block.
  subroutine start_lane(self, block, lane, y)
    class(linear_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    call self%copy_lane(block, lane)
    call self%columns%find_laws(block%machine, lane, self%linear, self%cubic)
    call self%start_accumulators(lane)
    do i = 1, size(self%accumulators)
      associate (acc => self%accumulators(i))
        if (acc%from <= self%t_start) call start_range(acc, lane, self%columns%argument(acc%column, lane, y), self%t_start)
      end associate
    end do
    do i = 1, size(self%damages)
      associate (sum => self%damages(i))
        if (sum%from <= self%t_start) call sum%add_value(lane, self%linear(lane, sum%column) * &
                                                             self%columns%argument(sum%column, lane, y))
      end associate
    end do
  end subroutine start_lane

  !> Copies the parameters of a lane of the block.
  subroutine copy_lane(self, block, lane)
    class(linear_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: lane

    call self%columns%copy_lane(block, lane)
    self%is_filter_current = .false.
  end subroutine copy_lane

  !> Takes the end of a variant.
  subroutine finish_lane(self, block, lane, y)
    class(linear_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    do i = 1, self%columns%count
      self%x_end(lane, i) = self%columns%value_at_end(block, i, lane, y)
    end do
  end subroutine finish_lane

  !> Widens the ranges of a lane by a state to which it has jumped: steps widen them by their ends and what is between.
  subroutine add_state(self, lane, t, y)
    class(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    integer :: i
    real(wp) :: x

    self%is_filter_current = .false.
    do i = 1, size(self%accumulators)
      associate (acc => self%accumulators(i))
        if (acc%bound(lane) > 0) cycle   ! it has not begun
        x = self%columns%argument(acc%column, lane, y)
        if (x > acc%highest(lane)) acc%highest_time(lane) = t
        if (x < acc%lowest(lane)) acc%lowest_time(lane) = t
        acc%highest(lane) = max(acc%highest(lane), x)
        acc%lowest(lane) = min(acc%lowest(lane), x)
      end associate
    end do
  end subroutine add_state

  !> Adds the last steps of the lanes.
  subroutine add_steps(self, steps, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :)   !! starts and ends of the steps, [lanes, padded components]
    real(wp), contiguous, intent(in) :: c(:, :, :)             !! coefficients of the steps, [lanes, padded components, degree]
    integer :: column, i, number

    if (size(self%accumulators) + size(self%damages) == 0) return
    if (.not. allocated(self%chord_gap)) call allocate_work(self, size(c, 2), size(c, 3))
    if (size(c, 1) == 1) then
      call add_single_step(self, steps, y, y_new, c)
      return
    end if
    do number = 1, strip_of(size(c, 1))
      call load_strip(self, number, steps, y, y_new, c)
      column = 0
      do i = 1, size(self%accumulators)
        associate (acc => self%accumulators(i))
          if (acc%column /= column) call expand_strip(self, acc%column, number, y, y_new, c)
          column = acc%column
          if (acc%has_range()) call widen_strip(self, acc, steps, size(c, 3))
          if (acc%has_sums) call integrate_strip(self, acc, steps, size(c, 3))
        end associate
      end do
      column = 0
      do i = 1, size(self%damages)
        associate (sum => self%damages(i))
          if (sum%column /= column) call expand_strip(self, sum%column, number, y, y_new, c)
          column = sum%column
          call count_strip(self, sum, steps, size(c, 3))
        end associate
      end do
    end do
  end subroutine add_steps

  !> Adds the last step of a block of one lane: its columns are put side by side in strips, instead of lanes.
  subroutine add_single_step(self, steps, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)
    integer :: before, i, place

    self%strip%before = 0
    self%strip%t_end(:) = steps%t_new(1)
    self%strip%scale(:) = steps%scale(1) * steps%theta_end(1)
    if (.not. self%is_filter_current) then
      call self%filter%refresh(self%columns, self%accumulators)
      self%is_filter_current = .true.
    end if
    call self%filter%find_candidates(self%accumulators, steps, self%chord_gap, y, y_new, c)
    do before = 0, self%filter%found - 1, width
      associate (chosen => self%filter%candidates(before + 1:min(before + width, self%filter%found)))
        do place = 1, size(chosen)
          call place_column(self, self%accumulators(chosen(place))%column, place, y, y_new, c)
        end do
        call widen_side_by_side(self, chosen, steps, size(c, 3))
      end associate
    end do
    self%strip%lanes = 1
    do i = 1, size(self%accumulators)
      if (.not. self%accumulators(i)%has_sums) cycle
      call place_column(self, self%accumulators(i)%column, 1, y, y_new, c)
      call integrate_strip(self, self%accumulators(i), steps, size(c, 3))
    end do
    do i = 1, size(self%damages)
      call place_column(self, self%damages(i)%column, 1, y, y_new, c)
      call count_strip(self, self%damages(i), steps, size(c, 3))
    end do
  end subroutine add_single_step

  !> Computes x of a column of a single lane in its last step, in a place of the strip.
  subroutine place_column(self, column, place, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: column, place
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)

    associate (columns => self%columns, first => self%columns%first(column))
      call expand_single(size(c, 2), size(c, 3), columns%first(column + 1) - first, columns%component(first), &
                         columns%factor(1, first, 1), columns%offset(1, column, 1), y, y_new, c, place, self%strip)
    end associate
  end subroutine place_column

  !> Widens the ranges of some accumulators of a single lane, whose columns are in the strip, by what is inside the step.
  subroutine widen_side_by_side(self, chosen, steps, degree)
    class(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: chosen(:)   !! their numbers
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    real(wp), dimension(width) :: bound, highest, lowest, no_highest, no_lowest, rise, fall
    integer :: i

    call bound_excursions(degree, self%chord_gap, self%strip%scale, self%strip%c, self%strip%above, self%strip%below)
    bound = huge(0.0_wp)   ! in places without a column
    highest = 0.0_wp
    lowest = 0.0_wp
    no_highest = huge(0.0_wp)
    no_lowest = huge(0.0_wp)
    do i = 1, size(chosen)
      associate (acc => self%accumulators(chosen(i)))
        bound(i) = acc%bound(1)
        highest(i) = acc%highest(1)
        lowest(i) = acc%lowest(1)
        if (.not. acc%has_range()) cycle
        no_highest(i) = min(acc%no_highest(1), merge(-lowest(i), huge(0.0_wp), acc%has_max_abs))
        no_lowest(i) = min(acc%no_lowest(1), merge(highest(i), huge(0.0_wp), acc%has_max_abs))
      end associate
    end do
    call bound_excess(.false., self%strip, bound, highest, lowest, no_highest, no_lowest, rise, fall)
    if (any_positive(rise, fall)) call exclude_monotonic(degree, self%chord_gap, self%strip%scale, self%strip%c, rise, fall)
    if (any_positive(rise, fall)) then
      call exclude_by_hull(degree, self%hull, self%strip%scale, self%strip%x_start, self%strip%c, highest, lowest, rise, fall)
    end if
    do i = 1, size(chosen)
      associate (acc => self%accumulators(chosen(i)))
        if (acc%bound(1) > 0) then   ! it has not begun: the bounds are not valid
          rise(i) = 1.0_wp
          fall(i) = 1.0_wp
        end if
        if (max(rise(i), fall(i)) <= 0 .or. self%strip%t_end(i) <= acc%from .or. .not. acc%has_range()) cycle
        call look_inside(self, acc, i, 1, steps, degree, rise(i) > 0, fall(i) > 0)
        call self%filter%copy_range(chosen(i), self%accumulators)
      end associate
    end do
  end subroutine widen_side_by_side

  !> Work space for a degree of the solution inside the steps.
  subroutine allocate_work(self, columns, degree)
    class(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: columns   !! padded components of the state
    integer, intent(in) :: degree

    self%rules(degree) = new_interpolation(degree)
    allocate (self%gauss(degree + 1), self%weights(degree + 1))
    call gauss_legendre_rule(degree + 1, self%gauss, self%weights)
    self%gauss(:) = 2 * self%gauss - 1
    self%filter = new_range_filter(self%columns, self%accumulators, columns)
    allocate (self%chord_gap(degree))
    call fill_chord_gaps(self%chord_gap)
    allocate (self%hull(degree, degree))
    call fill_hull(self%hull)
    allocate (self%y_last(width, columns), self%y_new_last(width, columns), self%c_last(width, columns, degree), source=0.0_wp)
  end subroutine allocate_work

  !> Loads the steps of the lanes of a strip. The ones of an incomplete last strip are copied to padded arrays.
  subroutine load_strip(self, number, steps, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
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
        strip%scale = steps%scale(strip%before + 1:strip%before + width) &
                      * steps%theta_end(strip%before + 1:strip%before + width)
        return
      end if
      do i = 1, strip%lanes
        strip%t_end(i) = steps%t_new(strip%before + i)
        strip%scale(i) = merge(steps%scale(strip%before + i) * steps%theta_end(strip%before + i), 0.0_wp, &
                               steps%taken(strip%before + i))
      end do
      if (strip%lanes == width) return
      self%y_last(:strip%lanes, :) = y(strip%before + 1:, :)
      self%y_new_last(:strip%lanes, :) = y_new(strip%before + 1:, :)
      self%c_last(:strip%lanes, :, :) = c(strip%before + 1:, :, :)
    end associate
  end subroutine load_strip

  !> Computes x of a column in the steps of the strip.
  subroutine expand_strip(self, column, number, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
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
  subroutine widen_strip(self, acc, steps, degree)
    class(linear_statistics_t), intent(in) :: self
    type(accumulator_t), intent(inout) :: acc
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    real(wp) :: rise(width), fall(width)   ! bounds: how far x and -x exceed the extremes so far
    integer :: i

    associate (strip => self%strip, at => self%strip%before + 1)
      call widen_by_ends(acc%has_time, strip%t_end, strip%x_end, acc%bound(at), acc%highest(at), acc%lowest(at), &
                         acc%highest_time(at), acc%lowest_time(at))
      call bound_excess(acc%has_max_abs, strip, acc%bound(at), acc%highest(at), acc%lowest(at), acc%no_highest(at), &
                        acc%no_lowest(at), rise, fall)
      if (any_positive(rise, fall)) call exclude_monotonic(degree, self%chord_gap, strip%scale, strip%c, rise, fall)
      if (.not. acc%from > self%t_start) then
        if (.not. any_positive(rise, fall)) return
      end if
      do i = 1, strip%lanes
        associate (lane => strip%before + i)
          if (acc%bound(lane) > 0) then   ! it has not begun: the bounds are not valid
            rise(i) = 1.0_wp
            fall(i) = 1.0_wp
          end if
          if (max(rise(i), fall(i)) <= 0) cycle
          if (.not. steps%taken(lane) .or. strip%t_end(i) <= acc%from) cycle
          call look_inside(self, acc, i, lane, steps, degree, rise(i) > 0, fall(i) > 0)
        end associate
      end do
    end associate
  end subroutine widen_strip

  !> Widens the range of x by its values at the ends of the steps, in the lanes that have passed `from`.
  pure subroutine widen_by_ends(has_time, t_end, x_end, bound, highest, lowest, highest_time, lowest_time)
    logical, intent(in) :: has_time
    real(wp), intent(in) :: t_end(width), x_end(width), bound(width)
    real(wp), intent(inout), dimension(width) :: highest, lowest, highest_time, lowest_time
    integer :: i

    if (has_time) then
      do i = 1, width
        highest_time(i) = merge(t_end(i), highest_time(i), min(x_end(i), -bound(i)) > highest(i))
        lowest_time(i) = merge(t_end(i), lowest_time(i), max(x_end(i), bound(i)) < lowest(i))
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
  pure subroutine bound_excess(has_max_abs, strip, bound, highest, lowest, no_highest, no_lowest, rise, fall)
    logical, intent(in) :: has_max_abs
    type(strip_t), intent(in) :: strip
    real(wp), intent(in), dimension(width) :: bound, highest, lowest, no_highest, no_lowest   ! of the accumulator
    real(wp), intent(out) :: rise(width), fall(width)
    integer :: i

    rise = no_highest
    fall = no_lowest
    if (has_max_abs) then
      do i = 1, width
        rise(i) = min(rise(i), -lowest(i))
        fall(i) = min(fall(i), highest(i))
      end do
    end if
    do i = 1, width
      rise(i) = (max(strip%x_start(i), strip%x_end(i)) + strip%above(i)) - max(rise(i), highest(i), bound(i))
      fall(i) = (strip%below(i) - min(strip%x_start(i), strip%x_end(i))) - max(fall(i), -lowest(i), bound(i))
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
  subroutine look_inside(self, acc, i, lane, steps, degree, rises, falls)
    class(linear_statistics_t), intent(in) :: self
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: i, lane   !! place in the strip, lane in the block
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    logical, intent(in) :: rises, falls   !! whether x, or -x, may exceed the extremes so far
    real(wp) :: begin, end, t_start, values(max_degree + 1)

    call find_part(lane, acc%from, steps, begin, end, t_start)
    call values_at(self%strip, i, degree, self%rules(degree)%nodes, begin, end, values)
    values(degree + 1) = self%strip%x_end(i)   ! to the last bit: it is the start of the next step
    if (acc%bound(lane) > 0) call start_range(acc, lane, values(1), t_start)
    call widen_range(acc, self%rules(degree), lane, values, t_start, steps%t_new(lane), rises, falls)
  end subroutine look_inside

  !> Counts the cycles of a column, a multiple of x, in the steps of the strip. Where x is monotonic, only its ends count.
  subroutine count_strip(self, sum, steps, degree)
    class(linear_statistics_t), intent(in) :: self
    type(damage_sum_t), intent(inout) :: sum
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    real(wp) :: turns(width), unused(width)   ! 1 where x may turn, else -1
    real(wp) :: begin, end, t_start, values(max_degree + 1)
    integer :: i

    turns = 1.0_wp
    unused = 1.0_wp
    call exclude_monotonic(degree, self%chord_gap, self%strip%scale, self%strip%c, turns, unused)
    do i = 1, self%strip%lanes
      associate (lane => self%strip%before + i, linear => self%linear(self%strip%before + i, sum%column))
        if (.not. steps%taken(lane) .or. self%strip%t_end(i) <= sum%from) cycle
        if (turns(i) > 0 .or. .not. sum%counters(lane)%has_begun) then
          call find_part(lane, sum%from, steps, begin, end, t_start)
          call values_at(self%strip, i, degree, self%rules(degree)%nodes, begin, end, values)
          values(degree + 1) = self%strip%x_end(i)
          values(:degree + 1) = linear * values(:degree + 1)
          call sum%add_polynomial(self%rules(degree), lane, values)
        else
          call sum%add_value(lane, linear * self%strip%x_start(i))
          call sum%add_value(lane, linear * self%strip%x_end(i))
        end if
      end associate
    end do
  end subroutine count_strip

  !> Adds the integrals of a column and of its square over the parts of the steps after `from`.
  subroutine integrate_strip(self, acc, steps, degree)
    class(linear_statistics_t), intent(inout) :: self
    type(accumulator_t), intent(inout) :: acc
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: degree
    real(wp), dimension(width) :: begin, end, duration
    real(wp) :: t_start
    integer :: i

    begin = 0.0_wp
    end = 0.0_wp
    duration = 0.0_wp
    associate (strip => self%strip, at => self%strip%before + 1)
      do i = 1, strip%lanes
        associate (lane => strip%before + i)
          if (.not. steps%taken(lane) .or. steps%t_new(lane) <= acc%from) cycle
          call find_part(lane, acc%from, steps, begin(i), end(i), t_start)
          duration(i) = steps%t_new(lane) - t_start
        end associate
      end do
      call add_integrals(strip, degree, self%gauss, self%weights, begin, end, duration, self%linear(at, acc%column), &
                         self%cubic(at, acc%column), acc%integral(at), acc%square(at))
    end associate
  end subroutine integrate_strip

end module nocdyn_linear_statistics
