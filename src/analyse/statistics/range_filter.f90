!> Finds the linear functions x of the state of a single lane that may leave their ranges inside a step.
!>
!> Bounds of the components of the state, in vector loops over the components, bound each x by the sizes of its entries. They are
!> wider than the bounds by its own coefficients (`nocdyn_step_strips`), but take a few operations, and most x pass them.
module nocdyn_range_filter
  use nocdyn_column_statistics, only: accumulator_t, width
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: linear_columns_t
  use nocdyn_observer, only: step_block_t
  implicit none (type, external)
  private

  public :: new_range_filter

  real(wp), parameter :: wider = 1.0_wp + 1.0e-10_wp   ! for the rounding of the sums

  !> Each accumulator has an x. Places, in strips, hold the x that are not the same as an earlier one; empty places have none.
  type, public :: range_filter_t
    integer, allocatable :: candidates(:)                    !! numbers of the x that pass, the first `found` of them
    integer :: found = 0
    integer, private :: strips = 0                           !! that are in use
    integer, allocatable, private :: number(:)               !! of the x in each place, 0: none
    integer, allocatable, private :: place(:)                !! of each x
    integer, allocatable, private :: twin(:)                 !! a later x that is always the same: its number, 0: none
    real(wp), allocatable, private :: offset(:, :)           !! of x at both ends of a step, then 0 twice; [4, places]
    real(wp), allocatable, dimension(:), private :: highest, lowest   !! of the places; huge before the range begins
    logical, allocatable, private :: has_begun(:)            !! whether the range has begun; of the places
    integer, allocatable, private :: first(:), last(:)       !! entries of the places
    integer, allocatable, private :: component(:)            !! of the state, [entries]
    real(wp), allocatable, private :: factor(:, :)           !! of what follows: three times, then its size; [4, entries]
    ! of the components in the last step, [4, padded components]:
    real(wp), allocatable, private :: ends(:, :)     !! values at its start and end, and two numbers that bound it between them
    real(wp), allocatable, private :: slopes(:, :)   !! its slopes in the same way
    integer, allocatable, private :: latest(:)       !! x whose first entry is of the component; work space
  contains
    procedure :: refresh, copy_range, find_candidates
  end type range_filter_t

contains

  !> A filter of the x of some accumulators, before `refresh`.
  type(range_filter_t) function new_range_filter(columns, accumulators, components) result(self)
    type(linear_columns_t), intent(in) :: columns
    type(accumulator_t), intent(in) :: accumulators(:)
    integer, intent(in) :: components   !! of the state, padded
    integer :: places

    places = width * ((size(accumulators) + width - 1) / width)
    allocate (self%place(size(accumulators)), self%twin(size(accumulators)), self%candidates(size(accumulators)), source=0)
    allocate (self%number(places), self%first(places), self%last(places), source=0)
    allocate (self%offset(4, places), self%highest(places), self%lowest(places), source=0.0_wp)
    allocate (self%has_begun(places), source=.true.)
    allocate (self%component(size(columns%component)), source=columns%component)
    allocate (self%factor(4, size(columns%component)), source=0.0_wp)
    allocate (self%ends(4, components), self%slopes(4, components), source=0.0_wp)
    allocate (self%latest(components), source=0)
  end function new_range_filter

  !> Copies the factors of the columns and the ranges of the accumulators.
  pure subroutine refresh(self, columns, accumulators)
    class(range_filter_t), intent(inout) :: self
    type(linear_columns_t), intent(in) :: columns
    type(accumulator_t), intent(inout) :: accumulators(:)
    integer :: i, k, place

    do k = 1, size(self%component)
      self%factor(:3, k) = columns%factor(1, k, 1)
      self%factor(4, k) = abs(columns%factor(1, k, 1))
    end do
    call find_twins(self, columns, accumulators)
    self%number(:) = 0
    self%first(:) = 1
    self%last(:) = 0
    self%offset(:, :) = 0.0_wp
    self%highest(:) = huge(0.0_wp)
    self%lowest(:) = -huge(0.0_wp)
    self%has_begun(:) = .true.
    place = 0
    do i = 1, size(accumulators)
      if (self%place(i) == 0) cycle   ! a twin
      place = place + 1
      self%place(i) = place
      self%number(place) = i
      self%first(place) = columns%first(accumulators(i)%column)
      self%last(place) = columns%first(accumulators(i)%column + 1) - 1
      self%offset(:2, place) = columns%offset(1, accumulators(i)%column, 1)
      call self%copy_range(i, accumulators)
    end do
    self%strips = (place + width - 1) / width
  end subroutine refresh

  !> Finds x that are the same, such as the twist and the elastic moment of a coupling.
  pure subroutine find_twins(self, columns, accumulators)
    type(range_filter_t), intent(inout) :: self
    type(linear_columns_t), intent(in) :: columns
    type(accumulator_t), intent(in) :: accumulators(:)
    integer :: i, other

    self%twin(:) = 0
    self%place(:) = 1
    self%latest(:) = 0
    do i = 1, size(accumulators)
      associate (begin => columns%first(accumulators(i)%column), next => columns%first(accumulators(i)%column + 1))
        other = self%latest(columns%component(begin))
        self%latest(columns%component(begin)) = i
        if (other == 0) cycle
        associate (first => columns%first(accumulators(other)%column), last => columns%first(accumulators(other)%column + 1) - 1)
          if (last - first /= next - 1 - begin) cycle
          if (any(columns%component(begin:next - 1) /= columns%component(first:last))) cycle
          if (any(abs(self%factor(1, begin:next - 1) - self%factor(1, first:last)) > 0)) cycle
        end associate
        associate (difference => columns%offset(1, accumulators(i)%column, 1) - columns%offset(1, accumulators(other)%column, 1))
          if (abs(difference) > 0 .or. .not. have_same_range(accumulators(i), accumulators(other))) cycle
        end associate
        self%twin(other) = i
        self%place(i) = 0
      end associate
    end do
  end subroutine find_twins

  !> Whether two ranges of the same x are the same and remain so.
  pure logical function have_same_range(x, y)
    type(accumulator_t), intent(in) :: x, y

    have_same_range = (x%has_max .eqv. y%has_max) .and. (x%has_min .eqv. y%has_min) .and. &
                      (x%has_max_abs .eqv. y%has_max_abs) .and. &
                      all(are_equal([x%from, x%bound(1), x%highest(1), x%lowest(1), x%no_highest(1), x%no_lowest(1)], &
                                    [y%from, y%bound(1), y%highest(1), y%lowest(1), y%no_highest(1), y%no_lowest(1)]))
  end function have_same_range

  !> Whether two numbers are equal, without their difference, which may overflow.
  elemental logical function are_equal(x, y)
    real(wp), intent(in) :: x, y

    are_equal = x <= y .and. x >= y
  end function are_equal

  !> Copies the range of an accumulator, also to the one with the same x.
  pure subroutine copy_range(self, number, accumulators)
    class(range_filter_t), intent(inout) :: self
    integer, intent(in) :: number   !! of an x that has a place
    type(accumulator_t), intent(inout) :: accumulators(:)
    integer :: next

    associate (acc => accumulators(number), place => self%place(number))
      self%has_begun(place) = acc%bound(1) <= 0
      if (self%has_begun(place)) then
        self%highest(place) = acc%highest(1)
        self%lowest(place) = acc%lowest(1)
      end if
      next = self%twin(number)
      do while (next > 0)
        accumulators(next)%bound(1) = acc%bound(1)
        accumulators(next)%first(1) = acc%first(1)
        accumulators(next)%highest(1) = acc%highest(1)
        accumulators(next)%lowest(1) = acc%lowest(1)
        accumulators(next)%highest_time(1) = acc%highest_time(1)
        accumulators(next)%lowest_time(1) = acc%lowest_time(1)
        next = self%twin(next)
      end do
    end associate
  end subroutine copy_range

  !> Widens the ranges by the ends of a step, and lists the x that may leave them inside it.
  subroutine find_candidates(self, accumulators, steps, chord_gap, y, y_new, c)
    class(range_filter_t), intent(inout) :: self
    type(accumulator_t), intent(inout) :: accumulators(:)   !! ranges that change are copied to them
    type(step_block_t), intent(in) :: steps
    real(wp), intent(in) :: chord_gap(:)                    !! as by `fill_chord_gaps`
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)   !! as in `on_steps` of an observer
    real(wp), dimension(width) :: fall, outside, rise
    real(wp) :: x(4, width)
    integer :: before, i, strip

    self%found = 0
    call bound_components(size(c, 2), size(c, 3), chord_gap, steps%scale(1) * steps%theta_end(1), y, y_new, c, self%ends, &
                          self%slopes)
    do strip = 1, self%strips
      before = width * (strip - 1)
      do i = 1, width
        associate (first => self%first(before + i), last => self%last(before + i))
          ! x at the ends in the bits of `expand_single`
          x(:, i) = self%offset(:, before + i)
          call add_entries(last - first + 1, size(c, 2), self%component(first), self%factor(1, first), self%ends, x(:, i))
        end associate
      end do
      call compare_ends(x, self%highest(before + 1), self%lowest(before + 1), outside)
      if (any_positive(outside)) then
        do i = 1, width
          if (outside(i) > 0) call widen(self, before + i, x(2, i), steps%t_new(1), accumulators)
        end do
      end if
      call bound_rises(x, self%highest(before + 1), self%lowest(before + 1), rise, fall)
      if (.not. (any_positive(rise) .or. any_positive(fall) .or. &
                 .not. all(self%has_begun(before + 1:before + width)))) cycle
      do i = 1, width
        associate (number => self%number(before + i))
          if (number == 0) cycle
          if (self%has_begun(before + i)) then
            if (.not. max(rise(i), fall(i)) > 0) cycle
            if (is_monotonic(self, before + i, size(c, 2))) cycle
          else if (steps%t_new(1) <= accumulators(number)%from) then
            cycle
          end if
          self%found = self%found + 1
          self%candidates(self%found) = number
        end associate
      end do
    end do
  end subroutine find_candidates

  !> Widens the range of a place, which has begun, by a value at a time [s].
  pure subroutine widen(self, place, x, t, accumulators)
    type(range_filter_t), intent(inout) :: self
    integer, intent(in) :: place
    real(wp), intent(in) :: x, t
    type(accumulator_t), intent(inout) :: accumulators(:)

    associate (acc => accumulators(self%number(place)))
      if (x > acc%highest(1)) acc%highest_time(1) = t
      if (x < acc%lowest(1)) acc%lowest_time(1) = t
      acc%highest(1) = max(acc%highest(1), x)
      acc%lowest(1) = min(acc%lowest(1), x)
    end associate
    call self%copy_range(self%number(place), accumulators)
  end subroutine widen

  !> By how much the ends of the steps are outside the ranges.
  pure subroutine compare_ends(x, highest, lowest, outside)
    real(wp), intent(in) :: x(4, width), highest(width), lowest(width)
    real(wp), intent(out) :: outside(width)
    integer :: i

    do i = 1, width
      outside(i) = max(x(2, i) - highest(i), lowest(i) - x(2, i))
    end do
  end subroutine compare_ends

  !> Bounds on how far x and -x exceed their largest values.
  pure subroutine bound_rises(x, highest, lowest, rise, fall)
    real(wp), intent(in) :: x(4, width), highest(width), lowest(width)
    real(wp), intent(out) :: rise(width), fall(width)
    integer :: i

    do i = 1, width
      rise(i) = max(x(1, i), x(2, i)) + 0.5_wp * (x(4, i) - x(3, i)) - highest(i)
      fall(i) = lowest(i) - min(x(1, i), x(2, i)) + 0.5_wp * (x(4, i) + x(3, i))
    end do
  end subroutine bound_rises

  pure logical function any_positive(x)
    real(wp), intent(in) :: x(width)
    integer :: i, positive

    positive = 0
    do i = 1, width
      positive = positive + merge(1, 0, x(i) > 0)
    end do
    any_positive = positive > 0
  end function any_positive

  !> Whether the slope of the x of a place has one sign.
  pure logical function is_monotonic(self, place, components)
    type(range_filter_t), intent(in) :: self
    integer, intent(in) :: place, components
    real(wp) :: least, most, x(4)

    x = 0.0_wp
    associate (first => self%first(place), last => self%last(place))
      call add_entries(last - first + 1, components, self%component(first), self%factor(1, first), self%slopes, x)
    end associate
    least = min(x(1), x(2)) - 0.5_wp * (x(4) + x(3))
    most = max(x(1), x(2)) + 0.5_wp * (x(4) - x(3))
    is_monotonic = least * most > 0
  end function is_monotonic

  !> Bounds of the components y(s) = y(0) + sum of c_p (scale s)^p, s from 0 to 1, as in `bound_excursions` and
  !> `exclude_monotonic`: what is linear in y, and what is a sum of sizes.
  pure subroutine bound_components(n, degree, chord_gap, scale, y, y_new, c, ends, slopes)
    integer, intent(in) :: n, degree
    real(wp), intent(in) :: chord_gap(degree), scale, y(n), y_new(n), c(n, degree)
    real(wp), intent(inout) :: ends(4, n), slopes(4, n)
    real(wp), dimension(width) :: bend, bend_size, end_slope, term, turn, turn_size
    integer :: before, first, i, p, taken

    taken = min(n, width)
    term = 0.0_wp
    do first = 1, n, width
      before = min(first, n - taken + 1) - 1   ! the last group may overlap the one before
      bend = 0.0_wp
      bend_size = 0.0_wp
      end_slope = 0.0_wp
      turn = 0.0_wp
      turn_size = 0.0_wp
      do p = degree, 2, -1
        if (taken == width) then
          term = c(before + 1:before + width, p)
        else
          term(:taken) = c(:, p)
        end if
        bend = chord_gap(p) * term + scale * bend
        bend_size = chord_gap(p) * abs(term) + scale * bend_size
        term = p * term
        end_slope = (term + end_slope) * scale
        turn = (chord_gap(p - 1) * term + turn) * scale
        turn_size = (chord_gap(p - 1) * abs(term) + turn_size) * scale
      end do
      bend = scale * scale * bend
      bend_size = wider * scale * scale * bend_size
      turn_size = wider * turn_size
      do i = 1, taken
        ends(:, before + i) = [y(before + i), y_new(before + i), bend(i), bend_size(i)]
        slopes(:, before + i) = [c(before + i, 1), c(before + i, 1) + end_slope(i), turn(i), turn_size(i)]
      end do
    end do
  end subroutine bound_components

  !> Adds the entries of an x, four numbers at once.
  pure subroutine add_entries(entries, n, component, factor, of, x)
    integer, intent(in) :: entries, n
    integer, intent(in) :: component(entries)
    real(wp), intent(in) :: factor(4, entries), of(4, n)
    real(wp), intent(inout) :: x(4)
    integer :: k

    do k = 1, entries
      x = x + factor(:, k) * of(:, component(k))
    end do
  end subroutine add_entries

end module nocdyn_range_filter
