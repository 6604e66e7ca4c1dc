!> All measurements beside what an input computes, by the analysis that each belongs to.
module nocdyn_fit_comparisons
  use nocdyn_comparisons, only: comparison_t
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_measured_runs, only: find_delays, new_run_samples, run_samples_t, sample_run
  use nocdyn_measurements, only: measured_series, measurement_t
  use nocdyn_text, only: string_t
  use nocdyn_transient, only: build_formulation
  implicit none (type, external)
  private

  public :: compare_measurements, fix_delays

  real(wp), parameter :: fine = 1.0e-10_wp   ! tolerance of runs whose differences are differentiated

contains

  !> Compares all measurements.
  subroutine compare_measurements(input, measurements, comparisons, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(comparison_t), allocatable, intent(out) :: comparisons(:)   !! [measurements]
    type(error_t), allocatable, intent(out) :: error
    type(comparison_t), allocatable :: some(:)
    integer :: i
    integer, allocatable :: chosen(:)

    allocate (comparisons(size(measurements)))
    allocate (chosen, source=pack([(i, i=1, size(measurements))], measurements%kind == measured_series))
    if (size(chosen) > 0) then
      call compare_runs(input, measurements(chosen), some, error)
      if (allocated(error)) return
      do i = 1, size(chosen)
        comparisons(chosen(i)) = some(i)
      end do
    end if
  end subroutine compare_measurements

  !> A run with the values at the measured times.
  subroutine compare_runs(input, measurements, comparisons, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(comparison_t), allocatable, intent(out) :: comparisons(:)
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable, target :: formulation
    type(integration_settings_t) :: settings
    type(run_samples_t), target :: samples
    real(wp) :: span(2)

    call prepare_run(input, formulation, settings, span, error)
    if (allocated(error)) return
    samples = new_run_samples(measurements, span)
    span(2) = max(span(1), min(span(2), maxval(samples%times)))
    call sample_run(formulation, settings, span, samples, error)
    if (.not. allocated(error)) call samples%compare(comparisons)
  end subroutine compare_runs

  !> Finds the delays that are to be found once, for the input as it is.
  subroutine fix_delays(input, measurements, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(inout) :: measurements(:)
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable, target :: formulation
    type(integration_settings_t) :: settings
    real(wp) :: correlations(size(measurements)), span(2)
    integer :: i
    integer, allocatable :: chosen(:)
    type(measurement_t), allocatable :: some(:)

    allocate (chosen, source=pack([(i, i=1, size(measurements))], measurements%kind == measured_series .and. &
                                  measurements%finds_delay))
    if (size(chosen) == 0) return
    call prepare_run(input, formulation, settings, span, error)
    if (allocated(error)) return
    allocate (some, source=measurements(chosen))
    call find_delays(formulation, settings, span, some, correlations(:size(some)), error)
    if (allocated(error)) return
    do i = 1, size(chosen)
      measurements(chosen(i))%delay = some(i)%delay
      measurements(chosen(i))%finds_delay = .false.
    end do
  end subroutine fix_delays

  subroutine prepare_run(input, formulation, settings, span, error)
    type(input_t), intent(in) :: input
    class(formulation_t), allocatable, intent(out) :: formulation
    type(integration_settings_t), intent(out) :: settings
    real(wp), intent(out) :: span(2)   !! start and end [s]
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: notes(:)

    call build_formulation(input, formulation, settings, notes, error)
    if (allocated(error)) return
    settings%rtol = min(settings%rtol, fine)
    settings%atol = min(settings%atol, 0.01_wp * fine)
    associate (run => input%groups(input%position('run')))
      span = [run%number('t_start'), run%number('t_end')]
    end associate
  end subroutine prepare_run

end module nocdyn_fit_comparisons
