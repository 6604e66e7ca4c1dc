!> Failures that are the input's or the numbers' fault: an exit code and a sentence for the person at the keyboard.
module nocdyn_errors
  implicit none (type, external)
  private

  public :: raise

  integer, parameter, public :: exit_done = 0     !! all asked for was done
  integer, parameter, public :: exit_failed = 1   !! the computation failed
  integer, parameter, public :: exit_input = 2    !! wrong usage or wrong input
  integer, parameter, public :: exit_file = 3     !! a file cannot be read or written

  !> Passed as an allocatable last argument: allocated means failed.
  type, public :: error_t
    integer :: code = exit_failed              !! the exit code of the program if nobody handles this
    character(len=:), allocatable :: message   !! what, where, what is allowed; several mistakes on several lines
  end type error_t

contains

  !> Allocates `error`; an error already there is replaced.
  subroutine raise(error, code, message)
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in) :: code
    character(len=*), intent(in) :: message

    allocate (error)
    error%code = code
    error%message = message
  end subroutine raise

end module nocdyn_errors
