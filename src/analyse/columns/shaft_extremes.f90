!> The extremes of the largest moment and stress along shafts.
!>
!> The value of largest magnitude jumps from one section to another, often between a positive and a negative one, and so is no
!> polynomial in a step. The moments at the points of the shaft are: their extremes are found, then the largest is taken.
module nocdyn_shaft_extremes
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_observer, only: ranges_t
  use nocdyn_shafts, only: shafts_t
  use nocdyn_signals, only: signal_element, signal_source_t
  implicit none (type, external)
  private

  public :: new_shaft_extremes, is_largest_along

  !> One column and the points of its shaft.
  type :: along_t
    integer :: column = 0
    integer :: bank = 0, shaft = 0
    integer :: first = 1, last = 0             !! functions of the points, which both columns of a shaft share
    logical :: is_stress = .false.
  end type along_t

  type, public :: shaft_extremes_t
    integer :: points = 0                      !! of all shafts with such columns
    type(along_t), allocatable, private :: items(:)
  contains
    procedure :: evaluate, correct_ranges
  end type shaft_extremes_t

contains

  !> Whether a column is the largest moment or stress along a shaft with inertia.
  logical function is_largest_along(machine, column, shaft, is_stress)
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: column
    integer, intent(out) :: shaft        !! its number in the bank
    logical, intent(out) :: is_stress

    is_largest_along = .false.
    shaft = 0
    is_stress = .false.
    if (column%kind /= signal_element) return
    select type (bank => machine%banks(column%bank)%bank)
    type is (shafts_t)
      is_stress = bank%is_stress(column%quantity)
      shaft = findloc(bank%shafts%first, column%index, dim=1)
      is_largest_along = (is_stress .or. bank%is_largest_moment(column%quantity)) .and. size(bank%shafts(shaft)%elements) > 0
    class default
      return
    end select
  end function is_largest_along

  !> Finds the columns of a table.
  function new_shaft_extremes(machine, columns) result(self)
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: columns(:)
    type(shaft_extremes_t) :: self
    type(along_t) :: item
    integer :: c, k

    allocate (self%items(0))
    do c = 1, size(columns)
      if (.not. is_largest_along(machine, columns(c), item%shaft, item%is_stress)) cycle
      item%column = c
      item%bank = columns(c)%bank
      item%first = 0
      do k = 1, size(self%items)
        if (self%items(k)%bank /= item%bank .or. self%items(k)%shaft /= item%shaft) cycle
        item%first = self%items(k)%first
        item%last = self%items(k)%last
      end do
      if (item%first == 0) then
        item%first = self%points + 1
        select type (bank => machine%banks(item%bank)%bank)
        type is (shafts_t)
          item%last = self%points + size(bank%shafts(item%shaft)%moments, 2)
        class default
          error stop 'nocdyn_shaft_extremes: the bank of a shaft is one of shafts'
        end select
        self%points = item%last
      end if
      self%items = [self%items, item]
    end do
  end function new_shaft_extremes

  !> The moments at all points [N m], after the machine of one lane has been evaluated.
  subroutine evaluate(self, machine, moments)
    class(shaft_extremes_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(inout) :: moments(:)   !! [points]
    integer :: i, p

    do i = 1, size(self%items)
      associate (item => self%items(i))
        if (any(self%items(:i - 1)%first == item%first)) cycle
        select type (bank => machine%banks(item%bank)%bank)
        type is (shafts_t)
          do p = 1, item%last - item%first + 1
            moments(item%first + p - 1) = bank%moment_at(machine%elements, item%shaft, p, 1)
          end do
        class default
          error stop 'nocdyn_shaft_extremes: the bank of a shaft is one of shafts'
        end select
      end associate
    end do
  end subroutine evaluate

  !> Sets the ranges of the columns from those of the moments at the points. Where all moments have one sign, the smaller end of a
  !> column's range is not among these: it is that of the column itself, which does not jump then.
  subroutine correct_ranges(self, machine, first, ranges)
    class(shaft_extremes_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: first               !! function of the first point
    type(ranges_t), intent(inout) :: ranges    !! of the columns, and of the points
    real(wp), allocatable :: moduli(:)
    integer :: i, p

    do i = 1, size(self%items)
      associate (item => self%items(i), c => self%items(i)%column, before => first - 1)
        allocate (moduli(item%last - item%first + 1), source=1.0_wp)
        select type (bank => machine%banks(item%bank)%bank)
        type is (shafts_t)
          if (item%is_stress) moduli = bank%section_moduli(item%shaft, 1)
        class default
          error stop 'nocdyn_shaft_extremes: the bank of a shaft is one of shafts'
        end select
        associate (high => ranges%highest(before + item%first:before + item%last) / moduli, &
                   low => ranges%lowest(before + item%first:before + item%last) / moduli)
          p = maxloc(high, dim=1)
          if (high(p) > 0 .or. ranges%highest(c) > high(p)) then
            ranges%highest(c) = high(p)
            ranges%highest_time(c) = ranges%highest_time(before + item%first - 1 + p)
          end if
          p = minloc(low, dim=1)
          if (low(p) < 0 .or. ranges%lowest(c) < low(p)) then
            ranges%lowest(c) = low(p)
            ranges%lowest_time(c) = ranges%lowest_time(before + item%first - 1 + p)
          end if
        end associate
      end associate
      deallocate (moduli)
    end do
  end subroutine correct_ranges

end module nocdyn_shaft_extremes
