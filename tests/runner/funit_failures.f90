!> The test that is running and its failed assertions, each printed as it happens so that a crash loses none.
module funit_failures
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)
  private

  public :: SourceLocation, anyExceptions, begin_test, throw

  !> Where an assertion stands. This name and `anyExceptions` are pFUnit's: a test module may not redefine them.
  type :: SourceLocation
    character(len=:), allocatable :: file
    integer :: line = 0
  end type SourceLocation

  character(len=:), allocatable :: test   !! name of the test that is running
  logical :: failed = .false.             !! it has a failed assertion

contains

  subroutine begin_test(name)
    character(len=*), intent(in) :: name

    test = name
    failed = .false.
  end subroutine begin_test

  !> True if an assertion of the running test has failed.
  function anyExceptions()
    logical :: anyExceptions

    anyExceptions = failed
  end function anyExceptions

  !> Marks the running test as failed and prints one line: file:line: test: message: reason.
  subroutine throw(reason, message, location)
    character(len=*), intent(in) :: reason
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    failed = .true.
    if (present(location)) write (output_unit, '(a, ":", i0, ": ")', advance='no') location%file, location%line
    write (output_unit, '(a, ": ")', advance='no') test
    if (present(message)) write (output_unit, '(a, ": ")', advance='no') trim(message)
    write (output_unit, '(a)') reason
    flush (output_unit)
  end subroutine throw

end module funit_failures
