!> Finds the linear functions x of the state of a single lane that may leave their ranges inside a step.
!>
!> Bounds of the components of the state, in vector loops over the components, bound each x by the sizes of its entries. They are
!> wider than the bounds by its own coefficients (`nocdyn_step_strips`), but take a few operations, and most x pass them.
module nocdyn_range_filter
  use nocdyn_column_statistics, only: accumulator_t
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: linear_columns_t
  use nocdyn_observer, only: step_block_t
  implicit none (type, external)
  private

  public :: new_range_filter

  real(wp), parameter :: wider = 1.0_wp + 1.0e-10_wp   ! for the rounding of the sums

  !> Each accumulator has an x.
  type, public :: range_filter_t
    integer, allocatable :: candidates(:)                    !! numbers of the x that pass, the first `found` of them
    integer :: found = 0
    integer, allocatable, private :: column(:)               !! of each x
    integer, allocatable, private :: first(:)                !! entry of each column, [columns + 1]
    integer, allocatable, private :: component(:)            !! of the state, [entries]
    real(wp), allocatable, private :: factor(:, :)           !! of what follows: three times, then its size; [4, entries]
    real(wp), allocatable, dimension(:), private :: offset   !! of each x
    real(wp), allocatable, dimension(:), private :: bound, highest, lowest   !! of each x, as in `accumulator_t`
    integer, allocatable, private :: twin(:)                 !! another x that is always the same: its number, 0: none
    logical, allocatable, private :: is_twin(:)              !! whether it is one, which follows the other
    ! of the components in the last step, [4, padded components]:
    real(wp), allocatable, private :: ends(:, :)     !! values at its start and end, and two numbers that bound it between them
    real(wp), allocatable, private :: slopes(:, :)   !! its slopes in the same way
    real(wp), allocatable, private :: sums(:, :)     !! work space, [padded components, 5]
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

    allocate (self%column(size(accumulators)), source=accumulators%column)
    allocate (self%offset(size(accumulators)), self%bound(size(accumulators)), self%highest(size(accumulators)), &
              self%lowest(size(accumulators)), source=0.0_wp)
    allocate (self%first(columns%count + 1), source=columns%first)
    allocate (self%component(size(columns%component)), source=columns%component)
    allocate (self%factor(4, size(columns%component)), source=0.0_wp)
    allocate (self%ends(4, components), self%slopes(4, components), self%sums(components, 5), source=0.0_wp)
    allocate (self%latest(components), self%twin(size(accumulators)), self%candidates(size(accumulators)), source=0)
    allocate (self%is_twin(size(accumulators)), source=.false.)
  end function new_range_filter

  !> Copies the factors of the columns and the ranges of the accumulators.
  pure subroutine refresh(self, columns, accumulators)
    class(range_filter_t), intent(inout) :: self
    type(linear_columns_t), intent(in) :: columns
    type(accumulator_t), intent(inout) :: accumulators(:)
    integer :: i, k

    do k = 1, size(self%component)
      self%factor(:3, k) = columns%factor(1, k, 1)
      self%factor(4, k) = abs(columns%factor(1, k, 1))
    end do
    do i = 1, size(accumulators)
      self%offset(i) = columns%offset(1, self%column(i), 1)
    end do
    call find_twins(self, accumulators)
    do i = 1, size(accumulators)
      call self%copy_range(i, accumulators)
    end do
  end subroutine refresh

  !> Finds x that are the same, such as the twist and the elastic moment of a coupling.
  pure subroutine find_twins(self, accumulators)
    type(range_filter_t), intent(inout) :: self
    type(accumulator_t), intent(in) :: accumulators(:)
    integer :: i, other

    self%twin(:) = 0
    self%is_twin(:) = .false.
    self%latest(:) = 0
    do i = 1, size(accumulators)
      associate (begin => self%first(self%column(i)), next => self%first(self%column(i) + 1))
        other = self%latest(self%component(begin))
        self%latest(self%component(begin)) = i
        if (other == 0) cycle
        associate (first => self%first(self%column(other)), last => self%first(self%column(other) + 1) - 1)
          if (last - first /= next - 1 - begin .or. abs(self%offset(i) - self%offset(other)) > 0) cycle
          if (any(self%component(begin:next - 1) /= self%component(first:last))) cycle
          if (any(abs(self%factor(1, begin:next - 1) - self%factor(1, first:last)) > 0)) cycle
        end associate
        if (.not. have_same_range(accumulators(i), accumulators(other))) cycle
        self%twin(other) = i
        self%is_twin(i) = .true.
      end associate
    end do
  end subroutine find_twins

  !> Whether two ranges of the same x are the same and remain so.
  pure logical function have_same_range(x, y)
    type(accumulator_t), intent(in) :: x, y

    have_same_range = (x%has_max .eqv. y%has_max) .and. (x%has_min .eqv. y%has_min) .and. &
                      (x%has_max_abs .eqv. y%has_max_abs) .and. &
                      all(abs([x%from - y%from, x%bound(1) - y%bound(1), x%highest(1) - y%highest(1), x%lowest(1) - y%lowest(1), &
                               x%no_highest(1) - y%no_highest(1), x%no_lowest(1) - y%no_lowest(1)]) <= 0)
  end function have_same_range

  !> Copies the range of an accumulator, also to the one with the same x.
  pure recursive subroutine copy_range(self, number, accumulators)
    class(range_filter_t), intent(inout) :: self
    integer, intent(in) :: number
    type(accumulator_t), intent(inout) :: accumulators(:)

    associate (acc => accumulators(number), twin => self%twin(number))
      self%bound(number) = acc%bound(1)
      self%highest(number) = acc%highest(1)
      self%lowest(number) = acc%lowest(1)
      if (twin == 0) return
      accumulators(twin)%bound(1) = acc%bound(1)
      accumulators(twin)%first(1) = acc%first(1)
      accumulators(twin)%highest(1) = acc%highest(1)
      accumulators(twin)%lowest(1) = acc%lowest(1)
      accumulators(twin)%highest_time(1) = acc%highest_time(1)
      accumulators(twin)%lowest_time(1) = acc%lowest_time(1)
      call self%copy_range(twin, accumulators)
    end associate
  end subroutine copy_range

  !> Widens the ranges by the ends of a step, and lists the x that may leave them inside it.
  subroutine find_candidates(self, accumulators, steps, chord_gap, y, y_new, c)
    class(range_filter_t), intent(inout) :: self
    type(accumulator_t), intent(inout) :: accumulators(:)   !! ranges that change are copied to them
    type(step_block_t), intent(in) :: steps
    real(wp), intent(in) :: chord_gap(:)                    !! as by `fill_chord_gaps`
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)   !! as in `on_steps` of an observer
    real(wp) :: fall, least, most, rise, x(4)
    integer :: i
    logical :: is_cut

    self%found = 0
    is_cut = steps%theta_end(1) < 1   ! the bounds are not valid
    call bound_components(size(c, 2), size(c, 3), chord_gap, steps%scale(1), y, y_new, c, self%sums, self%ends, self%slopes)
    do i = 1, size(self%column)
      if (self%is_twin(i)) cycle
      if (self%bound(i) > 0) then   ! it has not begun
        if (steps%t_new(1) <= accumulators(i)%from) cycle
        call add(i)
        cycle
      end if
      associate (first => self%first(self%column(i)))
        associate (entries => self%first(self%column(i) + 1) - first)
          ! x at the ends in the bits of `expand_single`
          x = [self%offset(i), self%offset(i), 0.0_wp, 0.0_wp]
          call add_entries(size(c, 2), entries, self%component(first), self%factor(1, first), self%ends, x)
          if (x(2) > self%highest(i) .or. x(2) < self%lowest(i)) then
            if (x(2) > self%highest(i)) accumulators(i)%highest_time(1) = steps%t_new(1)
            if (x(2) < self%lowest(i)) accumulators(i)%lowest_time(1) = steps%t_new(1)
            accumulators(i)%highest(1) = max(self%highest(i), x(2))
            accumulators(i)%lowest(1) = min(self%lowest(i), x(2))
            call self%copy_range(i, accumulators)
          end if
          rise = max(x(1), x(2)) + 0.5_wp * (x(4) - x(3)) - self%highest(i)
          fall = self%lowest(i) - min(x(1), x(2)) + 0.5_wp * (x(4) + x(3))
          if (max(rise, fall) <= 0 .and. .not. is_cut) cycle
          x = 0.0_wp   ! of the slope, which must change its sign
          call add_entries(size(c, 2), entries, self%component(first), self%factor(1, first), self%slopes, x)
          least = min(x(1), x(2)) - 0.5_wp * (x(4) + x(3))
          most = max(x(1), x(2)) + 0.5_wp * (x(4) - x(3))
          if (least * most > 0 .and. .not. is_cut) cycle
        end associate
      end associate
      call add(i)
    end do

  contains

    subroutine add(number)
      integer, intent(in) :: number

      self%found = self%found + 1
      self%candidates(self%found) = number
    end subroutine add

  end subroutine find_candidates

  !> Bounds of the components y(s) = y(0) + sum of c_p (scale s)^p, s from 0 to 1, as in `bound_excursions` and
  !> `exclude_monotonic`: what is linear in y, and what is a sum of sizes.
  pure subroutine bound_components(n, degree, chord_gap, scale, y, y_new, c, sums, ends, slopes)
    integer, intent(in) :: n, degree
    real(wp), intent(in) :: chord_gap(degree), scale, y(n), y_new(n), c(n, degree)
    real(wp), intent(inout) :: sums(n, 5)   !! work space
    real(wp), intent(inout) :: ends(4, n), slopes(4, n)
    real(wp) :: term
    integer :: i, p

    sums = 0.0_wp
    do p = degree, 2, -1
      do i = 1, n
        term = chord_gap(p) * c(i, p)
        sums(i, 1) = term + scale * sums(i, 1)
        sums(i, 2) = abs(term) + scale * sums(i, 2)
        term = p * c(i, p)
        sums(i, 3) = (term + sums(i, 3)) * scale
        sums(i, 4) = (chord_gap(p - 1) * term + sums(i, 4)) * scale
        sums(i, 5) = (chord_gap(p - 1) * abs(term) + sums(i, 5)) * scale
      end do
    end do
    do i = 1, n
      ends(1, i) = y(i)
      ends(2, i) = y_new(i)
      ends(3, i) = scale * scale * sums(i, 1)
      ends(4, i) = wider * scale * scale * sums(i, 2)
      slopes(1, i) = c(i, 1)
      slopes(2, i) = c(i, 1) + sums(i, 3)
      slopes(3, i) = sums(i, 4)
      slopes(4, i) = wider * sums(i, 5)
    end do
  end subroutine bound_components

  !> Adds the entries of an x, four numbers at once.
  pure subroutine add_entries(n, entries, component, factor, of, x)
    integer, intent(in) :: n, entries
    integer, intent(in) :: component(entries)
    real(wp), intent(in) :: factor(4, entries), of(4, n)
    real(wp), intent(inout) :: x(4)
    integer :: k

    do k = 1, entries
      x = x + factor(:, k) * of(:, component(k))
    end do
  end subroutine add_entries

end module nocdyn_range_filter
