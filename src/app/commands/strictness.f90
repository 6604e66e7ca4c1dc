!> The option --strict: a limit that is exceeded is a failure.
module nocdyn_strictness
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: report_error
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_text, only: counted
  use nocdyn_verdicts, only: is_exceeded, verdict_t
  implicit none (type, external)
  private

  public :: be_strict

contains

  !> With --strict, reports limits that are exceeded as an error.
  subroutine be_strict(arguments, place, verdict, code)
    type(arguments_t), intent(in) :: arguments
    character(len=*), intent(in) :: place   !! the input
    type(verdict_t), intent(in) :: verdict
    integer, intent(inout) :: code          !! exit code so far
    type(error_t), allocatable :: error

    if (.not. arguments%is_given('--strict') .or. verdict%count_found(is_exceeded) == 0) return
    call raise(error, exit_failed, place // ': ' // counted(verdict%count_found(is_exceeded), 'line of the verdict is', &
                                                           'lines of the verdict are') // ' exceeded, with --strict a failure')
    call report_error(error, code)
  end subroutine be_strict

end module nocdyn_strictness
