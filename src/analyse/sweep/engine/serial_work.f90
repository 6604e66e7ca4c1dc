!> The work of the threads of a sweep that makes texts, done by one thread at a time.
!>
!> gfortran 12 keeps the lengths of texts that functions return in static memory, which all threads share, with `-frecursive` as
!> without it. Threads therefore make texts in the procedures of this module alone: they assemble machines, check values,
!> explain failures, and write to the journal and the terminal. All of it stands in the critical section `texts`.
module nocdyn_serial_work
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_integration_settings, only: check_settings, integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_methods, only: select_method
  use nocdyn_recorded_quantities, only: restrict_statistics
  use nocdyn_run_settings, only: choose_settings
  use nocdyn_scheduler, only: sweep_counts_t, sweep_progress_t
  use nocdyn_solver_status, only: failure_message, solver_status_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_sweep_chunk, only: chunk_t
  use nocdyn_sweep_journal, only: sweep_journal_t
  use nocdyn_targets, only: set_targets, target_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: check_values, assemble_variant, has_reduced_form, new_own_formulation, prepare_integration, explain_failure
  public :: explain_not_finite
  public :: append_chunk, update_progress

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

  !> Sets the values of the targets in an input and assembles its machine with all the checks of a single run.
  subroutine assemble_variant(input, targets, values, machine, message, lanes)
    type(input_t), intent(inout) :: input
    type(target_t), intent(in) :: targets(:)
    real(wp), intent(in) :: values(:)                         !! [targets]
    type(machine_t), intent(inout) :: machine                 !! of no use if `message` is not ''
    character(len=:), allocatable, intent(out) :: message     !! '', or why there is no such machine
    integer, intent(in), optional :: lanes                    !! 1 if absent
    type(error_t), allocatable :: error

    !$omp critical (texts)
    call set_targets(input, targets, values, message)
    if (message == '') call assemble_machine(input, machine, error, lanes)
    if (allocated(error)) call move_alloc(error%message, message)
    !$omp end critical (texts)
  end subroutine assemble_variant

  !> Whether an input asks for the reduced formulation.
  logical function has_reduced_form(input)
    type(input_t), intent(in) :: input

    !$omp critical (texts)
    has_reduced_form = input%groups(input%position('run'))%text('formulation') == 'reduced'
    !$omp end critical (texts)
  end function has_reduced_form

  !> The formulation that an input asks for.
  subroutine new_own_formulation(input, machine, with_energy_balance, formulation)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: with_energy_balance   !! whether the work integrals are among the states
    class(formulation_t), allocatable, intent(out) :: formulation

    !$omp critical (texts)
    call new_formulation(input%groups(input%position('run'))%text('formulation'), machine, formulation, with_energy_balance)
    !$omp end critical (texts)
  end subroutine new_own_formulation

  !> Settings, stepper and observer of the variants that a formulation is integrated for. Statistics that begin outside of the
  !> times are refused, and columns that the machine does not have.
  subroutine prepare_integration(input, formulation, statistics, settings, times, stepper, observer, message)
    type(input_t), intent(in) :: input
    class(formulation_t), target, intent(inout) :: formulation   !! stays where it is, as the observer does
    type(statistic_t), intent(in) :: statistics(:)               !! of the plan
    type(integration_settings_t), intent(out) :: settings
    real(wp), intent(out) :: times(2)                            !! start and end [s]
    class(stepper_t), allocatable, intent(out) :: stepper
    type(statistics_observer_t), intent(out) :: observer
    character(len=:), allocatable, intent(out) :: message        !! '', or why none of these variants can be integrated
    type(string_t), allocatable :: notes(:)
    type(statistic_t), allocatable :: restricted(:)
    type(error_t), allocatable :: error

    !$omp critical (texts)
    associate (run => input%groups(input%position('run')))
      times = [run%number('t_start'), run%number('t_end')]
    end associate
    call choose_settings(input, formulation, settings, notes, error)
    if (.not. allocated(error)) call check_settings(settings, error)
    if (.not. allocated(error)) call select_method(settings, stepper, error)
    if (allocated(error)) then
      call move_alloc(error%message, message)
    else
      call restrict_statistics(statistics, times(1), times(2), restricted, message)
      observer = new_statistics_observer(formulation, restricted, times(1), times(2))
      if (message == '' .and. observer%missing /= '') then
        message = observer%missing // ' is recorded, but this machine has no such column'
      end if
    end if
    !$omp end critical (texts)
  end subroutine prepare_integration

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

  !> Says of which result there is no finite number.
  subroutine explain_not_finite(label, message)
    character(len=*), intent(in) :: label   !! of the result
    character(len=:), allocatable, intent(out) :: message

    !$omp critical (texts)
    message = 'the result ' // label // ' is not a finite number'
    !$omp end critical (texts)
  end subroutine explain_not_finite

  !> Appends a chunk to the journal.
  subroutine append_chunk(journal, chunk, error)
    type(sweep_journal_t), intent(inout) :: journal
    type(chunk_t), intent(in) :: chunk
    type(error_t), allocatable, intent(out) :: error   !! the journal cannot be written

    !$omp critical (texts)
    call journal%append(chunk, error)
    !$omp end critical (texts)
  end subroutine append_chunk

  !> Shows how far a sweep has come.
  subroutine update_progress(progress, counts)
    class(sweep_progress_t), intent(inout) :: progress
    type(sweep_counts_t), intent(in) :: counts

    !$omp critical (texts)
    call progress%update(counts)
    !$omp end critical (texts)
  end subroutine update_progress

end module nocdyn_serial_work
