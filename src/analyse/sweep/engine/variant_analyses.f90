!> Modes, forced responses and other analyses of the variants of a sweep.
module nocdyn_variant_analyses
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  use nocdyn_analyses, only: analysis_t
  use nocdyn_analysis_results, only: analysis_result_t
  use nocdyn_errors, only: error_t, exit_failed
  use nocdyn_finite, only: is_finite
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_named_analyses, only: analysis_words
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_serial_work, only: find_reported
  use nocdyn_sweep_chunk, only: chunk_t, status_done, status_failed, status_refused
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_variant_analysis, only: analyse_variant
  use nocdyn_variant_machines, only: variant_machines_t
  use omp_lib, only: omp_test_lock, omp_unset_lock
  implicit none (type, external)
  private

  public :: analyse_chunk

contains

  !> Analyses the variants of a chunk that are done so far.
  subroutine analyse_chunk(plan, machines, scheduler, chunk, is_complete)
    type(sweep_plan_t), intent(in) :: plan
    type(variant_machines_t), intent(inout) :: machines
    class(scheduler_t), intent(inout) :: scheduler
    type(chunk_t), intent(inout) :: chunk
    logical, intent(out) :: is_complete   !! false if it was interrupted
    integer :: i

    is_complete = .false.
    do i = 1, chunk%count
      if (omp_test_lock(scheduler%lock)) then
        call scheduler%poll()
        call omp_unset_lock(scheduler%lock)
      end if
      if (scheduler%is_cancelled()) return
      if (chunk%status(i) == status_done) call analyse_one(plan, machines, chunk, i)
    end do
    is_complete = .true.
  end subroutine analyse_chunk

  !> Analyses one variant. A result that is not finite is a failure; a curve may have gaps.
  subroutine analyse_one(plan, machines, chunk, index)
    type(sweep_plan_t), intent(in) :: plan
    type(variant_machines_t), intent(inout) :: machines
    type(chunk_t), intent(inout) :: chunk
    integer, intent(in) :: index   !! in the chunk
    class(analysis_t), allocatable :: response
    type(error_t), allocatable :: error
    real(wp) :: results(size(plan%analyses)), values(size(plan%numbers%targets))
    integer :: i

    call plan%numbers%target_values(chunk%parameters(:, index), values)
    call machines%set_input(values, chunk%reasons(index)%text)
    if (chunk%reasons(index)%text /= '') then
      chunk%status(index) = status_refused
      return
    end if
    call analyse_variant(machines%input, plan%analyses, results, error, response)
    if (.not. allocated(error)) call find_numbers(machines%input, plan%analyses, response, results, error)
    if (allocated(error)) then
      chunk%status(index) = merge(status_failed, status_refused, error%code == exit_failed)
      call move_alloc(error%message, chunk%reasons(index)%text)
    else
      i = findloc(is_finite(results) .or. (plan%analyses%is_curve() .and. ieee_is_nan(results)), .false., dim=1)
      chunk%results(plan%analyses%result, index) = results
      if (i == 0) return
      chunk%status(index) = status_failed
      chunk%reasons(index)%text = 'the result ' // plan%analyses(i)%label // ' is not a finite number'
    end if
    chunk%results(:, index) = ieee_value(0.0_wp, ieee_quiet_nan)
  end subroutine analyse_one

  !> The numbers that are taken from the reports of analyses.
  subroutine find_numbers(input, wanted, response, values, error)
    type(input_t), intent(in) :: input
    type(analysis_result_t), intent(in) :: wanted(:)
    class(analysis_t), allocatable, intent(inout) :: response   !! if it is solved
    real(wp), intent(inout) :: values(:)   !! [results]
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    do k = 1, size(analysis_words)
      if (.not. any(wanted%is_reported_by(trim(analysis_words(k))))) cycle
      call find_reported(trim(analysis_words(k)), input, wanted, response, values, error)
      if (allocated(error)) return
    end do
  end subroutine find_numbers

end module nocdyn_variant_analyses
