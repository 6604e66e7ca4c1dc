!> The work of the threads of a sweep that one thread at a time does: checking the values of a variant, writing a
!> report, explaining a failure, writing a program.
!>
!> gfortran 12 keeps the length of an allocatable text that a function returns in static memory of the caller, which all threads
!> share, with `-frecursive` as without it. What threads run at the same time therefore calls no such functions. What does call
!> them stands in the critical section `texts`, or has the lock of the scheduler, as the journal and the progress have.
module nocdyn_serial_work
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_code_text, only: code_text_t
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_named_analyses, only: assemble_analysed, new_analysis
  use nocdyn_reduced, only: reduced_t
  use nocdyn_solver_status, only: failure_message, solver_status_t
  use nocdyn_targets, only: set_targets, target_t
  implicit none (type, external)
  private

  public :: analyse_for_report, check_values, explain_failure, write_code

contains

  !> Sets the values of the targets in an input and says whether they are allowed.
  subroutine check_values(input, targets, values, message)
    type(input_t), intent(inout) :: input
    type(target_t), intent(in) :: targets(:)
    real(wp), intent(in) :: values(:)                         !! [targets]
    character(len=:), allocatable, intent(out) :: message     !! '' if all are allowed, else why one is not

    !$omp critical (texts)
    call set_targets(input, targets, values, message)
    !$omp end critical (texts)
  end subroutine check_values

  !> Why the integration of a lane failed.
  subroutine explain_failure(solver_status, lane, formulation, settings, message)
    type(solver_status_t), intent(in) :: solver_status
    integer, intent(in) :: lane
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(in) :: settings
    character(len=:), allocatable, intent(out) :: message

    !$omp critical (texts)
    message = failure_message(solver_status, lane, formulation, settings%rtol, settings%atol)
    !$omp end critical (texts)
  end subroutine explain_failure

  !> Writes the program of a block for its series.
  subroutine write_code(block, text, obstacle)
    class(reduced_t), intent(in) :: block
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable, intent(out) :: obstacle   !! why there is none, ''
    type(code_text_t) :: code

    !$omp critical (texts)
    call block%write_code(code, obstacle)
    text = code%text()
    !$omp end critical (texts)
  end subroutine write_code

  !> The report of an analysis of the machine of an input, with its numbers.
  subroutine analyse_for_report(word, input, report, error)
    character(len=*), intent(in) :: word   !! of `analysis_words`
    type(input_t), intent(in) :: input
    type(json_t), intent(out) :: report
    type(error_t), allocatable, intent(out) :: error
    class(analysis_t), allocatable :: analysis
    type(machine_t) :: machine

    report%keeps_numbers = .true.
    call new_analysis(word, analysis)
    call assemble_analysed(word, analysis, input, machine, error)
    if (.not. allocated(error) .and. analysis%is_for_threads) then
      call analysis%solve(input, machine, analysis_options_t(at=''), error)
    end if
    !$omp critical (texts)
    if (.not. (allocated(error) .or. analysis%is_for_threads)) then
      call analysis%solve(input, machine, analysis_options_t(at=''), error)
    end if
    if (.not. allocated(error)) then
      call analysis%judge(input)
      call analysis%put_report(input, report)
    end if
    !$omp end critical (texts)
  end subroutine analyse_for_report

end module nocdyn_serial_work
