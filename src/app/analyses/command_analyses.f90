!> The analyses of commands, before their solutions.
module nocdyn_command_analyses
  use nocdyn_analyses, only: analysis_t
  use nocdyn_check_results, only: check_results_t
  use nocdyn_fit_results, only: fit_results_t
  use nocdyn_matrices_results, only: matrices_results_t
  use nocdyn_named_analyses, only: new_analysis
  use nocdyn_sensitivity_results, only: sensitivity_results_t
  use nocdyn_transit_results, only: transit_results_t
  implicit none (type, external)
  private

  public :: new_command_analysis

contains

  !> The analysis of a command.
  subroutine new_command_analysis(command, analysis)
    character(len=*), intent(in) :: command
    class(analysis_t), allocatable, intent(out) :: analysis

    select case (command)
    case ('check')
      allocate (analysis, source=check_results_t(is_steady=.false., locks_joints=.false., takes_joints=.true.))
    case ('matrices')
      allocate (analysis, source=matrices_results_t(is_steady=.false., locks_joints=.false., has_report=.false.))
    case ('transit')
      allocate (analysis, source=transit_results_t(is_steady=.false., locks_joints=.false., takes_joints=.true., &
                                                   always_writes=.true.))
    case ('sensitivity')
      allocate (analysis, source=sensitivity_results_t(locks_joints=.false.))
    case ('fit')
      allocate (analysis, source=fit_results_t(is_steady=.false., locks_joints=.false., takes_joints=.true., &
                                               always_writes=.true.))
    case default
      call new_analysis(command, analysis)
    end select
  end subroutine new_command_analysis

end module nocdyn_command_analyses
