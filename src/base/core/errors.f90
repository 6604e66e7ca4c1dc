!> Errors caused by the input or by the computation: an exit code and a message to the user.
module nocdyn_errors
  implicit none (type, external)
  private

  public :: add_error, raise

  integer, parameter, public :: exit_done = 0     !! success
  integer, parameter, public :: exit_failed = 1   !! the computation failed
  integer, parameter, public :: exit_input = 2    !! wrong usage or wrong input
  integer, parameter, public :: exit_file = 3     !! a file cannot be read or written

  !> The last argument of procedures that can fail; allocated means failed.
  type, public :: error_t
    integer :: code = exit_failed              !! exit code of the program, unless the error is handled
    character(len=:), allocatable :: message   !! what, where, what is allowed; one line for each error
  end type error_t

contains

  !> Allocates `error`; replaces an error that is already allocated.
  subroutine raise(error, code, message)
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in) :: code   !! exit_...
    character(len=*), intent(in) :: message

    allocate (error)
    error%code = code
    error%message = message
  end subroutine raise

  !> Adds the lines of another error, if there is one, to an error or to none; the worst exit code stays.
  subroutine add_error(error, another)
    type(error_t), allocatable, intent(inout) :: error, another   !! `another` is not allocated afterwards

    if (.not. allocated(another)) return
    if (.not. allocated(error)) then
      call move_alloc(another, error)
      return
    end if
    error%message = error%message // new_line('a') // another%message
    error%code = max(error%code, another%code)
    deallocate (another)
  end subroutine add_error

end module nocdyn_errors
