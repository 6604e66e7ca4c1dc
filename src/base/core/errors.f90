!> Errors caused by the input or by the computation: an exit code and a message to the user.
module nocdyn_errors
  implicit none (type, external)
  private

  public :: raise

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

end module nocdyn_errors
