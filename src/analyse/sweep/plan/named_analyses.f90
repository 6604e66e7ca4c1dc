!> The analyses by the names of their commands that sweeps can record: each of the machine that it looks at.
module nocdyn_named_analyses
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_assembly, only: assemble_machine, assemble_steady_machine
  use nocdyn_campbell_results, only: campbell_results_t
  use nocdyn_equilibrium_results, only: equilibrium_results_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_joint_simplifications, only: refuse_joints
  use nocdyn_machine, only: machine_t
  use nocdyn_modes_results, only: modes_results_t
  use nocdyn_orbit_results, only: orbit_results_t
  use nocdyn_response_results, only: response_results_t
  use nocdyn_response_settings, only: sets_response_speed
  implicit none (type, external)
  private

  public :: assemble_analysed, new_analysis, solve_named

  character(len=*), parameter, public :: analysis_words(5) = [character(len=11) :: 'equilibrium', 'modes', 'campbell', &
    'response', 'orbit']

contains

  !> An analysis before its solution.
  subroutine new_analysis(word, analysis)
    character(len=*), intent(in) :: word   !! of `analysis_words`
    class(analysis_t), allocatable, intent(out) :: analysis

    select case (word)
    case ('equilibrium')
      allocate (analysis, source=equilibrium_results_t(locks_joints=.false.))
    case ('modes')
      allocate (analysis, source=modes_results_t(locks_joints=.false.))
    case ('campbell')
      allocate (analysis, source=campbell_results_t(sets_speed=.true., always_writes=.true., is_for_threads=.true.))
    case ('response')
      allocate (analysis, source=response_results_t(sets_speed=.true., always_writes=.true., is_for_threads=.true.))
    case ('orbit')
      allocate (analysis, source=orbit_results_t(is_steady=.false., locks_joints=.false., takes_joints=.true., &
                                                 always_writes=.true., keeps_journal=.true.))
    case default
      error stop 'nocdyn_named_analyses: there is no analysis of this name'
    end select
  end subroutine new_analysis

  !> Builds the machine as an analysis looks at it.
  subroutine assemble_analysed(word, analysis, input, machine, error)
    character(len=*), intent(in) :: word   !! the command
    class(analysis_t), intent(in) :: analysis
    type(input_t), intent(in) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    logical :: sets_speed

    sets_speed = analysis%sets_speed .and. sets_response_speed(input)
    if (.not. analysis%takes_joints) call refuse_joints(input, analysis%is_steady, 'nocdyn ' // word, error, &
                                                        sets_speed=sets_speed)
    if (allocated(error)) return
    if (analysis%is_steady) then
      call assemble_steady_machine(input, analysis%locks_joints, machine, error, sets_speed=sets_speed)
    else
      call assemble_machine(input, machine, error)
    end if
  end subroutine assemble_analysed

  !> Analyses the machine of an input.
  subroutine solve_named(word, input, analysis, error)
    character(len=*), intent(in) :: word   !! of `analysis_words`
    type(input_t), intent(in) :: input
    class(analysis_t), allocatable, intent(out) :: analysis
    type(error_t), allocatable, intent(out) :: error
    type(analysis_options_t) :: options
    type(machine_t) :: machine

    call new_analysis(word, analysis)
    call assemble_analysed(word, analysis, input, machine, error)
    if (allocated(error)) return
    options%at = ''
    call analysis%solve(input, machine, options, error)
    if (.not. allocated(error) .and. allocated(analysis%refusal)) error = analysis%refusal
  end subroutine solve_named

end module nocdyn_named_analyses
