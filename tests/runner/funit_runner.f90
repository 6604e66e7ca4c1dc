!> The main loop of a test program: start_tests, one run_test per test, finish_tests.
module funit_runner
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use funit_failures, only: anyExceptions, begin_test
  implicit none (type, external)
  private

  public :: finish_tests, run_test, start_tests

  integer, parameter :: exit_failed = 1   !! a test failed
  integer, parameter :: exit_usage = 2    !! the command line is wrong or selects no test

  abstract interface
    subroutine procedure_interface()
    end subroutine procedure_interface
  end interface

  character(len=:), allocatable :: filter   !! tests whose name contains this are run
  logical :: verbose = .false.              !! name every test before it runs
  integer :: run_count = 0
  integer :: failed_count = 0

contains

  !> Reads the options [-f TEXT | --filter TEXT] [-v | --verbose].
  subroutine start_tests()
    character(len=:), allocatable :: option
    integer :: i

    filter = ''
    i = 1
    do while (i <= command_argument_count())
      option = argument(i)
      select case (option)
        case ('-v', '--verbose')
          verbose = .true.
        case ('-f', '--filter')
          i = i + 1
          filter = argument(i)
        case default
          write (error_unit, '(a)') "unknown option '" // option // "': known are -f TEXT (--filter), -v (--verbose)"
          stop exit_usage, quiet=.true.
      end select
      i = i + 1
    end do
  end subroutine start_tests

  !> Runs one test: `before`, the test unless `before` failed, then `after`.
  subroutine run_test(name, test, before, after)
    character(len=*), intent(in) :: name
    procedure(procedure_interface) :: test
    procedure(procedure_interface), optional :: before
    procedure(procedure_interface), optional :: after

    if (index(name, filter) == 0) return
    if (verbose) then
      write (output_unit, '(a)') name
      flush (output_unit)
    end if
    run_count = run_count + 1
    call begin_test(name)
    if (present(before)) call before()
    if (.not. anyExceptions()) then
      call test()
      if (present(after)) call after()
    end if
    if (anyExceptions()) failed_count = failed_count + 1
  end subroutine run_test

  !> Prints the summary and ends the program: exit code 0 if all tests passed.
  subroutine finish_tests()
    if (run_count == 0) then
      write (error_unit, '(a)') "no test has a name with '" // filter // "' in it"
      stop exit_usage, quiet=.true.
    end if
    write (output_unit, '(i0, " tests, ", i0, " failed")') run_count, failed_count
    if (failed_count > 0) stop exit_failed, quiet=.true.
  end subroutine finish_tests

  !> Command line argument `position`, '' beyond the last.
  function argument(position)
    integer, intent(in) :: position
    character(len=:), allocatable :: argument
    integer :: length

    call get_command_argument(position, length=length)
    allocate (character(len=length) :: argument)
    call get_command_argument(position, argument)
  end function argument

end module funit_runner
