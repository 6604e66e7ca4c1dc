!> The work of the threads of a sweep that one thread at a time does: checking the values of a variant, writing a
!> report, explaining a failure, writing a program.
!>
!> gfortran 12 keeps the length of an allocatable text that a function returns in static memory of the caller, which all threads
!> share, with `-frecursive` as without it. What threads run at the same time therefore calls no such functions. What does call
!> them stands in the critical section `texts`, or has the lock of the scheduler, as the journal and the progress have.
module nocdyn_serial_work
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_code_text, only: code_text_t
  use nocdyn_analysis_results, only: analysis_result_t, of_path, of_verdict
  use nocdyn_errors, only: error_t, exit_failed, raise
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
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: check_values, explain_failure, find_reported, write_code

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

  !> The numbers that results ask for of one analysis of the machine of an input.
  subroutine find_reported(word, input, wanted, response, values, error)
    character(len=*), intent(in) :: word                    !! of `analysis_words`
    type(input_t), intent(in) :: input
    type(analysis_result_t), intent(in) :: wanted(:)        !! those of other analyses are left out
    class(analysis_t), allocatable, intent(inout) :: response   !! if it is solved; taken if the numbers are its
    real(wp), intent(inout) :: values(:)                    !! [results]
    type(error_t), allocatable, intent(out) :: error
    class(analysis_t), allocatable :: analysis
    type(machine_t) :: machine
    logical :: is_solved

    is_solved = word == 'response' .and. allocated(response)
    if (is_solved) then
      call move_alloc(response, analysis)
    else
      call new_analysis(word, analysis)
      call assemble_analysed(word, analysis, input, machine, error)
      if (.not. allocated(error) .and. analysis%is_for_threads) then
        call analysis%solve(input, machine, analysis_options_t(at='', compares=.false.), error)
        is_solved = .true.
      end if
    end if
    !$omp critical (texts)
    if (.not. (allocated(error) .or. is_solved)) then
      call analysis%solve(input, machine, analysis_options_t(at='', compares=.false.), error)
    end if
    if (.not. allocated(error)) then
      call analysis%judge(input)
      call take_numbers(word, input, analysis, wanted, values, error)
    end if
    !$omp end critical (texts)
  end subroutine find_reported

  !> The numbers of a solved analysis: of its report by their paths, and others by words.
  subroutine take_numbers(word, input, analysis, wanted, values, error)
    character(len=*), intent(in) :: word
    type(input_t), intent(in) :: input
    class(analysis_t), intent(in) :: analysis
    type(analysis_result_t), intent(in) :: wanted(:)
    real(wp), intent(inout) :: values(:)
    type(error_t), allocatable, intent(inout) :: error
    character(len=:), allocatable :: obstacle
    type(json_t) :: report
    integer :: found, i

    report%keeps_numbers = .true.
    if (any(wanted%mode == of_path)) call analysis%put_report(input, report)
    do i = 1, size(wanted)
      if (.not. wanted(i)%is_reported_by(word)) cycle
      obstacle = ''
      if (wanted(i)%mode == of_path) then
        found = report%find(wanted(i)%path)
        if (found > 0) values(i) = report%numbers(found)
        if (found == 0) obstacle = word // '.json of this variant has no number ' // wanted(i)%path
      else if (wanted(i)%mode == of_verdict) then
        values(i) = analysis%verdict%worst_ratio(wanted(i)%quantity, wanted(i)%word)
      else
        call analysis%find_recorded(wanted(i)%quantity, wanted(i)%word, wanted(i)%number, values(i), obstacle)
        values(i) = from_si(values(i), wanted(i)%in_unit)
      end if
      if (obstacle == '') cycle
      call raise(error, exit_failed, obstacle)
      return
    end do
  end subroutine take_numbers

end module nocdyn_serial_work
