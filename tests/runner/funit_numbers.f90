!> Comparison of numbers and of arrays of numbers of any rank; the first element that breaks a relation is reported.
module funit_numbers
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  use, intrinsic :: iso_fortran_env, only: wp => real64
  use funit_failures, only: SourceLocation, throw
  implicit none (type, external)
  private

  public :: numbers, numbers_t, require, require_relatively_equal

  !> A scalar or an array. Default integers are kept as reals, which is exact.
  type :: numbers_t
    real(wp), allocatable :: values(:)   !! in array element order
    integer, allocatable :: shape(:)     !! empty for a scalar
    logical :: whole = .false.           !! to be written as integers
  end type numbers_t

  interface numbers
    module procedure integer_numbers
    module procedure real_numbers
  end interface numbers

contains

  function integer_numbers(array) result(numbers)
    integer, intent(in) :: array(..)
    type(numbers_t) :: numbers

    allocate (numbers%shape, source=max(shape(array), 0))
    allocate (numbers%values(max(size(array), 0)))
    numbers%whole = .true.
    select rank (array)
      rank (0)
        numbers%values(:) = real([array], wp)
      rank (1)
        numbers%values(:) = real(array, wp)
      rank (2)
        numbers%values(:) = real(reshape(array, [size(array)]), wp)
      rank (3)
        numbers%values(:) = real(reshape(array, [size(array)]), wp)
      rank (*)   ! what gfortran takes an expression without elements for
      rank default
        error stop 'funit_numbers: assertions take arrays up to rank 3'
    end select
  end function integer_numbers

  function real_numbers(array) result(numbers)
    real(wp), intent(in) :: array(..)
    type(numbers_t) :: numbers

    allocate (numbers%shape, source=max(shape(array), 0))
    allocate (numbers%values(max(size(array), 0)))
    select rank (array)
      rank (0)
        numbers%values(:) = [array]
      rank (1)
        numbers%values(:) = array
      rank (2)
        numbers%values(:) = reshape(array, [size(array)])
      rank (3)
        numbers%values(:) = reshape(array, [size(array)])
      rank (*)   ! what gfortran takes an expression without elements for
      rank default
        error stop 'funit_numbers: assertions take arrays up to rank 3'
    end select
  end function real_numbers

  !> Fails the test unless `left relation right` holds for every element; a NaN never passes.
  subroutine require(left, relation, right, tolerance, message, location)
    type(numbers_t), intent(in) :: left                   !! a scalar is compared with every element of `right`
    character(len=*), intent(in) :: relation              !! '==', '/=', '<', '<=', '>' or '>='
    type(numbers_t), intent(in) :: right
    real(wp), intent(in), optional :: tolerance           !! on the absolute difference, for '==' and '/='
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    real(wp), allocatable :: l(:)
    real(wp) :: allowed
    logical, allocatable :: holds(:)
    logical :: halting(size(ieee_usual))

    if (.not. conformable(left, right, message, location)) return
    allocate (l, source=expanded(left, size(right%values)))
    allocate (holds(size(l)), source=.false.)
    allowed = 0
    if (present(tolerance)) allowed = tolerance
    call suspend_halting(halting)
    associate (r => right%values)
      select case (relation)
        case ('==')
          holds(:) = (l <= r .and. l >= r) .or. abs(r - l) <= allowed   ! equal infinities have no difference
        case ('/=')
          holds(:) = abs(r - l) > allowed
        case ('<')
          holds(:) = l < r
        case ('<=')
          holds(:) = l <= r
        case ('>')
          holds(:) = l > r
        case ('>=')
          holds(:) = l >= r
        case default
          error stop 'funit_numbers: unknown relation'
      end select
    end associate
    call resume_halting(halting)
    call report_first(holds, l, relation, right, tolerance, message, location)
  end subroutine require

  !> Fails the test unless |actual - expected| <= tolerance |expected| for every element, none expected to be zero.
  subroutine require_relatively_equal(expected, actual, tolerance, message, location)
    type(numbers_t), intent(in) :: expected
    type(numbers_t), intent(in) :: actual
    real(wp), intent(in) :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    real(wp), allocatable :: e(:)
    logical, allocatable :: holds(:)
    logical :: halting(size(ieee_usual))

    if (.not. conformable(expected, actual, message, location)) return
    allocate (e, source=expanded(expected, size(actual%values)))
    allocate (holds(size(e)), source=.false.)
    call suspend_halting(halting)
    holds(:) = abs(actual%values - e) <= tolerance * abs(e) .and. abs(e) > 0
    call resume_halting(halting)
    call report_first(holds, e, '== relatively', actual, tolerance, message, location)
  end subroutine require_relatively_equal

  !> Comparing with NaN and subtracting infinities are what is asked here, in programs that trap them elsewhere.
  subroutine suspend_halting(halting)
    logical, intent(out) :: halting(:)   !! the modes before

    call ieee_get_halting_mode(ieee_usual, halting)
    call ieee_set_halting_mode(ieee_usual, .false.)
  end subroutine suspend_halting

  subroutine resume_halting(halting)
    logical, intent(in) :: halting(:)

    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, halting)
  end subroutine resume_halting

  subroutine report_first(holds, left, relation, right, tolerance, message, location)
    logical, intent(in) :: holds(:)
    real(wp), intent(in) :: left(:)
    character(len=*), intent(in) :: relation
    type(numbers_t), intent(in) :: right
    real(wp), intent(in), optional :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    character(len=:), allocatable :: reason, l, r
    integer :: i

    i = findloc(holds, .false., dim=1)
    if (i == 0) return
    l = number_text(left(i), right%whole)
    r = number_text(right%values(i), right%whole)
    select case (relation)
      case ('==', '== relatively')
        reason = 'expected ' // l // ', found ' // r
        if (present(tolerance)) reason = reason // ', difference ' // number_text(right%values(i) - left(i), .false.)
      case default
        reason = l // ' is not ' // relation // ' ' // r
    end select
    if (present(tolerance)) reason = reason // ', tolerance ' // number_text(tolerance, .false.)
    if (relation == '== relatively') reason = reason // ' of the expected value, which may not be 0'
    if (size(right%shape) > 0) reason = reason // ', element ' // list(subscripts(i, right%shape))
    call throw(reason, message, location)
  end subroutine report_first

  function conformable(left, right, message, location)
    type(numbers_t), intent(in) :: left
    type(numbers_t), intent(in) :: right
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    logical :: conformable

    conformable = size(left%shape) == 0
    if (size(left%shape) == size(right%shape)) conformable = all(left%shape == right%shape)
    if (.not. conformable) then
      call throw('expected the shape ' // list(left%shape) // ', found ' // list(right%shape), message, location)
    end if
  end function conformable

  !> The values, or a scalar repeated.
  pure function expanded(numbers, count) result(values)
    type(numbers_t), intent(in) :: numbers
    integer, intent(in) :: count
    real(wp) :: values(count)

    if (size(numbers%shape) == 0) then
      values = numbers%values(1)
    else
      values = numbers%values
    end if
  end function expanded

  pure function subscripts(position, extents)
    integer, intent(in) :: position     !! in array element order
    integer, intent(in) :: extents(:)
    integer :: subscripts(size(extents))
    integer :: d, rest

    rest = position - 1
    do d = 1, size(extents)
      subscripts(d) = modulo(rest, extents(d)) + 1
      rest = rest / extents(d)
    end do
  end function subscripts

  function number_text(value, whole) result(text)
    real(wp), intent(in) :: value
    logical, intent(in) :: whole
    character(len=:), allocatable :: text
    character(len=40) :: buffer

    if (whole) then
      write (buffer, '(i0)') nint(value)
    else
      write (buffer, '(g0)') value
    end if
    text = trim(buffer)
  end function number_text

  function list(integers)
    integer, intent(in) :: integers(:)
    character(len=:), allocatable :: list
    character(len=80) :: buffer

    write (buffer, '("[", *(i0, :, ", "))') integers
    list = trim(buffer) // ']'
  end function list

end module funit_numbers
