!> The ranges of linear statistics in the plain steps of a block (`nocdyn_plain_steps`), as `nocdyn_linear_statistics` finds them.
module nocdyn_plain_ranges
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_funloc, c_int, c_loc, c_long, c_ptr
  use nocdyn_chebyshev, only: interpolation_t, max_degree, new_interpolation
  use nocdyn_column_statistics, only: accumulator_t, widen_range
  use nocdyn_kinds, only: wp
  use nocdyn_linear_statistics, only: linear_statistics_t
  use nocdyn_plain_steps, only: plain_range_t, plain_steps_t
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_step_strips, only: fill_chord_gaps, strip_t, values_at
  implicit none (type, external)
  private

  type, public :: plain_ranges_t
    type(accumulator_t), pointer, private :: accumulators(:) => null()
    type(plain_range_t), allocatable, private :: ranges(:)   !! of the accumulators
    real(wp), allocatable, private :: chord_gap(:), node(:), weight(:)   !! as in `linear_statistics_t`
    type(interpolation_t), private :: rule                   !! of the degree of the steps
    type(strip_t), private :: strip                          !! its first place is used
  contains
    procedure :: list
  end type plain_ranges_t

contains

  !> Lists the ranges, if they are all that there is to accumulate. Neither this nor the statistics may be moved afterwards.
  subroutine list(self, statistics, degree, steps, are_all)
    class(plain_ranges_t), target, intent(inout) :: self
    type(linear_statistics_t), target, intent(inout) :: statistics
    integer, intent(in) :: degree                 !! of the steps
    type(plain_steps_t), intent(inout) :: steps
    logical, intent(out) :: are_all
    integer :: i

    are_all = size(statistics%damages) == 0
    do i = 1, size(statistics%accumulators)
      associate (acc => statistics%accumulators(i))
        are_all = are_all .and. .not. (acc%has_history .or. acc%from > statistics%t_start)
      end associate
    end do
    if (.not. are_all) return
    if (allocated(self%ranges)) deallocate (self%ranges, self%chord_gap, self%node, self%weight)
    self%accumulators => statistics%accumulators
    allocate (self%ranges(size(statistics%accumulators)), self%chord_gap(degree))
    call fill_chord_gaps(self%chord_gap)
    allocate (self%node(degree + 1), self%weight(degree + 1))
    call gauss_legendre_rule(degree + 1, self%node, self%weight)
    self%node(:) = 2 * self%node - 1
    self%rule = new_interpolation(degree)
    do i = 1, size(self%ranges)
      call describe(self%accumulators(i), i)
    end do
    steps%ranges = size(self%ranges)
    steps%range = c_loc(self%ranges)
    steps%chord_gap = c_loc(self%chord_gap)
    steps%node = c_loc(self%node)
    steps%weight = c_loc(self%weight)
    select type (self)
    type is (plain_ranges_t)
      steps%observer = c_loc(self)
    end select
    steps%look = c_funloc(look_inside)

  contains

    subroutine describe(acc, number)
      type(accumulator_t), target, intent(in) :: acc
      integer, intent(in) :: number

      associate (range => self%ranges(number), columns => statistics%columns, first => statistics%columns%first(acc%column))
        range%number = number
        range%entries = columns%first(acc%column + 1) - first
        range%has_range = merge(1, 0, acc%has_range())
        range%has_sums = merge(1, 0, acc%has_sums)
        range%has_time = merge(1, 0, acc%has_time)
        range%has_max_abs = merge(1, 0, acc%has_max_abs)
        range%component = c_loc(columns%component(first))
        range%factor = c_loc(columns%factor(1, first, 1))
        range%factor_step = size(columns%factor, 1, c_long) * size(columns%factor, 2, c_long)
        range%offset = c_loc(columns%offset(1, acc%column, 1))
        range%offset_step = size(columns%offset, 1, c_long) * size(columns%offset, 2, c_long)
        range%highest = c_loc(acc%highest)
        range%lowest = c_loc(acc%lowest)
        range%highest_time = c_loc(acc%highest_time)
        range%lowest_time = c_loc(acc%lowest_time)
        range%no_highest = c_loc(acc%no_highest)
        range%no_lowest = c_loc(acc%no_lowest)
        if (acc%has_sums) range%integral = c_loc(acc%integral)
        if (acc%has_sums) range%square = c_loc(acc%square)
        range%linear = c_loc(statistics%linear(1, acc%column))
        range%cubic = c_loc(statistics%cubic(1, acc%column))
      end associate
    end subroutine describe

  end subroutine list

  !> Widens a range by the extremes inside a step.
  subroutine look_inside(ranges, number, lane, sides, times, ends, c) bind(c)
    type(c_ptr), value, intent(in) :: ranges
    integer(c_int), intent(in) :: number, lane     !! of the range; lane
    integer(c_int), intent(in) :: sides(2)         !! whether x, or -x, may exceed the extremes so far
    real(c_double), intent(in) :: times(3)         !! start of the step [s], largest argument of the polynomial, end [s]
    real(c_double), intent(in) :: ends(2)          !! x at its ends
    real(c_double), intent(in) :: c(*)             !! x = ends(1) + sum of c(p) s^p, s from 0 to times(2)
    type(plain_ranges_t), pointer :: self
    real(wp) :: values(max_degree + 1)

    call c_f_pointer(ranges, self)
    associate (degree => self%rule%degree)
      self%strip%x_start(1) = ends(1)
      self%strip%c(1, :degree) = c(:degree)
      call values_at(self%strip, 1, degree, self%rule%nodes, 0.0_wp, times(2), values)
      values(degree + 1) = ends(2)
      call widen_range(self%accumulators(number), self%rule, lane, values, times(1), times(3), sides(1) > 0, sides(2) > 0)
    end associate
  end subroutine look_inside

end module nocdyn_plain_ranges
