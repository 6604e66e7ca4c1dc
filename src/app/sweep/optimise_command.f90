!> nocdyn optimise: the best choice of numbers and sizes. It computes machines as a sweep does.
module nocdyn_optimise_command
  use nocdyn_analysis_command, only: analyse
  use nocdyn_arguments, only: arguments_t
  use nocdyn_optimise_results, only: optimise_results_t
  implicit none (type, external)
  private

  public :: optimise_command

contains

  !> Optimises the machines of all files.
  subroutine optimise_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call analyse(arguments, code, &
                 kind=optimise_results_t(is_steady=.false., locks_joints=.false., takes_joints=.true., always_writes=.true.))
  end subroutine optimise_command

end module nocdyn_optimise_command
