!> The assertions of the tests, under the names, argument names and argument orders of pFUnit 4.
module funit
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: wp => real64
  use funit_failures, only: anyExceptions, SourceLocation, throw
  use funit_numbers, only: numbers, require, require_relatively_equal
  implicit none (type, external)
  private

  public :: SourceLocation, anyExceptions
  public :: assertTrue, assertFalse, assertEqual, assertNotEqual, assertRelativelyEqual, assertIsFinite
  public :: assertLessThan, assertLessThanOrEqual, assertGreaterThan, assertGreaterThanOrEqual

  !> A scalar `expected` is compared with every element of `actual`. Texts are equal if they differ in surrounding
  !> blanks only, pFUnit's default.
  interface assertEqual
    module procedure equal_integers
    module procedure equal_reals
    module procedure equal_integer_and_reals
    module procedure equal_texts
    module procedure equal_logicals
  end interface assertEqual

  interface assertNotEqual
    module procedure not_equal_integers
    module procedure not_equal_reals
  end interface assertNotEqual

  interface assertLessThan
    module procedure less_integers
    module procedure less_reals
  end interface assertLessThan

  interface assertLessThanOrEqual
    module procedure less_or_equal_integers
    module procedure less_or_equal_reals
  end interface assertLessThanOrEqual

  interface assertGreaterThan
    module procedure greater_integers
    module procedure greater_reals
  end interface assertGreaterThan

  interface assertGreaterThanOrEqual
    module procedure greater_or_equal_integers
    module procedure greater_or_equal_reals
  end interface assertGreaterThanOrEqual

  interface assertTrue
    module procedure true_scalar
    module procedure true_array
  end interface assertTrue

  interface assertFalse
    module procedure false_scalar
    module procedure false_array
  end interface assertFalse

contains

  subroutine equal_integers(expected, actual, message, location)
    integer, intent(in) :: expected(..)
    integer, intent(in) :: actual(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(expected), '==', numbers(actual), message=message, location=location)
  end subroutine equal_integers

  subroutine equal_reals(expected, actual, tolerance, message, location)
    real(wp), intent(in) :: expected(..)
    real(wp), intent(in) :: actual(..)
    real(wp), intent(in), optional :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(expected), '==', numbers(actual), tolerance, message, location)
  end subroutine equal_reals

  subroutine equal_integer_and_reals(expected, actual, tolerance, message, location)
    integer, intent(in) :: expected(..)
    real(wp), intent(in) :: actual(..)
    real(wp), intent(in), optional :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(expected), '==', numbers(actual), tolerance, message, location)
  end subroutine equal_integer_and_reals

  subroutine equal_texts(expected, found, message, location)
    character(len=*), intent(in) :: expected
    character(len=*), intent(in) :: found
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (trimmed(expected) == trimmed(found)) return
    call throw("expected '" // expected // "', found '" // found // "'", message, location)
  end subroutine equal_texts

  !> Without blanks and tabs at either end.
  pure function trimmed(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: trimmed
    character(len=*), parameter :: white = ' ' // achar(9)

    trimmed = text(max(1, verify(text, white)):verify(text, white, back=.true.))
  end function trimmed

  subroutine equal_logicals(expected, actual, message, location)
    logical, intent(in) :: expected
    logical, intent(in) :: actual
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (expected .eqv. actual) return
    call throw(merge('expected .true., found .false.', 'expected .false., found .true.', expected), message, location)
  end subroutine equal_logicals

  subroutine not_equal_integers(expected, actual, message, location)
    integer, intent(in) :: expected(..)
    integer, intent(in) :: actual(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(expected), '/=', numbers(actual), message=message, location=location)
  end subroutine not_equal_integers

  subroutine not_equal_reals(expected, actual, tolerance, message, location)
    real(wp), intent(in) :: expected(..)
    real(wp), intent(in) :: actual(..)
    real(wp), intent(in), optional :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(expected), '/=', numbers(actual), tolerance, message, location)
  end subroutine not_equal_reals

  subroutine assertRelativelyEqual(expected, actual, tolerance, message, location)
    real(wp), intent(in) :: expected(..)
    real(wp), intent(in) :: actual(..)
    real(wp), intent(in) :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require_relatively_equal(numbers(expected), numbers(actual), tolerance, message, location)
  end subroutine assertRelativelyEqual

  subroutine less_integers(lhs, rhs, message, location)
    integer, intent(in) :: lhs(..)
    integer, intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '<', numbers(rhs), message=message, location=location)
  end subroutine less_integers

  subroutine less_reals(lhs, rhs, message, location)
    real(wp), intent(in) :: lhs(..)
    real(wp), intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '<', numbers(rhs), message=message, location=location)
  end subroutine less_reals

  subroutine less_or_equal_integers(lhs, rhs, message, location)
    integer, intent(in) :: lhs(..)
    integer, intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '<=', numbers(rhs), message=message, location=location)
  end subroutine less_or_equal_integers

  subroutine less_or_equal_reals(lhs, rhs, message, location)
    real(wp), intent(in) :: lhs(..)
    real(wp), intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '<=', numbers(rhs), message=message, location=location)
  end subroutine less_or_equal_reals

  subroutine greater_integers(lhs, rhs, message, location)
    integer, intent(in) :: lhs(..)
    integer, intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '>', numbers(rhs), message=message, location=location)
  end subroutine greater_integers

  subroutine greater_reals(lhs, rhs, message, location)
    real(wp), intent(in) :: lhs(..)
    real(wp), intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '>', numbers(rhs), message=message, location=location)
  end subroutine greater_reals

  subroutine greater_or_equal_integers(lhs, rhs, message, location)
    integer, intent(in) :: lhs(..)
    integer, intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '>=', numbers(rhs), message=message, location=location)
  end subroutine greater_or_equal_integers

  subroutine greater_or_equal_reals(lhs, rhs, message, location)
    real(wp), intent(in) :: lhs(..)
    real(wp), intent(in) :: rhs(..)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call require(numbers(lhs), '>=', numbers(rhs), message=message, location=location)
  end subroutine greater_or_equal_reals

  subroutine assertIsFinite(x, message, location)
    real(wp), intent(in) :: x
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. ieee_is_finite(x)) call throw('expected a finite number, found an infinity or NaN', message, location)
  end subroutine assertIsFinite

  subroutine true_scalar(condition, message, location)
    logical, intent(in) :: condition
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. condition) call throw('expected .true., found .false.', message, location)
  end subroutine true_scalar

  subroutine true_array(condition, message, location)
    logical, intent(in) :: condition(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. all(condition)) call throw('expected all .true., found .false.', message, location)
  end subroutine true_array

  subroutine false_scalar(condition, message, location)
    logical, intent(in) :: condition
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (condition) call throw('expected .false., found .true.', message, location)
  end subroutine false_scalar

  subroutine false_array(condition, message, location)
    logical, intent(in) :: condition(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (any(condition)) call throw('expected all .false., found .true.', message, location)
  end subroutine false_array

end module funit
