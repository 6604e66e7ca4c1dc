!> All measurements beside what an input computes, by the analysis that each belongs to.
module nocdyn_fit_comparisons
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_comparisons, only: comparison_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_modes, only: find_machine_modes
  use nocdyn_measured_modes, only: compare_modes
  use nocdyn_measured_responses, only: compare_responses
  use nocdyn_measured_runs, only: find_delays, new_run_samples, run_samples_t, sample_run
  use nocdyn_measurements, only: measured_frequency, measured_order, measured_peak, measured_series, measurement_t
  use nocdyn_modes, only: list_oscillations, mode_t
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_response_settings, only: read_response_settings, response_settings_t
  use nocdyn_text, only: string_t
  use nocdyn_transient, only: build_formulation
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  public :: compare_measurements, fix_delays, refuse_unfitted

  real(wp), parameter :: fine = 1.0e-10_wp   ! tolerance of runs whose differences are differentiated

contains

  !> Refuses measurements that a fit does not take.
  subroutine refuse_unfitted(input, measurements, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    do i = 1, size(measurements)
      if (measurements(i)%kind /= measured_peak .or. abs(measurements(i)%speed) > 0) cycle
      call raise(error, exit_input, input%location(measurements(i)%group) // ': the peak of a run is not fitted, which ' // &
                 'jumps from one time to another; allowed: a speed, for the peak of a response there, or another kind')
      return
    end do
  end subroutine refuse_unfitted

  !> Compares all measurements, by kinds.
  subroutine compare_measurements(input, measurements, comparisons, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(comparison_t), allocatable, intent(out) :: comparisons(:)   !! [measurements]
    type(error_t), allocatable, intent(out) :: error

    allocate (comparisons(size(measurements)))
    if (any(measurements%kind == measured_series)) call compare_runs(input, measurements, comparisons, error)
    if (allocated(error)) return
    if (any(measurements%kind == measured_frequency)) call compare_frequencies(input, measurements, comparisons, error)
    if (allocated(error)) return
    if (any(measurements%kind == measured_order .or. measurements%kind == measured_peak)) then
      call compare_orders(input, measurements, comparisons, error)
    end if
  end subroutine compare_measurements

  !> A run with the values at the measured times.
  subroutine compare_runs(input, measurements, comparisons, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(comparison_t), intent(inout) :: comparisons(:)
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable, target :: formulation
    type(comparison_t), allocatable :: some(:)
    type(integration_settings_t) :: settings
    type(run_samples_t), target :: samples
    integer, allocatable :: chosen(:)
    integer :: i
    real(wp) :: span(2)

    call prepare_run(input, formulation, settings, span, error)
    if (allocated(error)) return
    allocate (chosen, source=pack([(i, i=1, size(measurements))], measurements%kind == measured_series))
    samples = new_run_samples(measurements(chosen), span)
    span(2) = max(span(1), min(span(2), maxval(samples%times)))
    call sample_run(formulation, settings, span, samples, error)
    if (allocated(error)) return
    call samples%compare(some)
    call put_back(measurements%kind == measured_series, some, comparisons)
  end subroutine compare_runs

  !> Puts the comparisons of some measurements to their places.
  subroutine put_back(is_of, some, comparisons)
    logical, intent(in) :: is_of(:)             !! [measurements]
    type(comparison_t), intent(in) :: some(:)   !! of these, in their order
    type(comparison_t), intent(inout) :: comparisons(:)
    integer :: i, n

    n = 0
    do i = 1, size(is_of)
      if (.not. is_of(i)) cycle
      n = n + 1
      comparisons(i) = some(n)
    end do
  end subroutine put_back

  !> The modes about the steady state.
  subroutine compare_frequencies(input, measurements, comparisons, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(comparison_t), intent(inout) :: comparisons(:)
    type(error_t), allocatable, intent(out) :: error
    type(comparison_t), allocatable :: some(:)
    type(linearisation_t) :: linear
    type(machine_t) :: machine
    type(mode_t), allocatable :: modes(:)
    type(operating_point_t) :: point
    integer, allocatable :: numbers(:)
    integer :: none(0)
    real(wp), allocatable :: dampings(:), frequencies(:)

    call assemble_steady_machine(input, .false., machine, error)
    if (.not. allocated(error)) call find_operating_point(input, machine, 'equilibrium', point, error)
    if (.not. allocated(error)) call find_machine_modes(point, modes_choice_t(), none, linear, modes, error)
    if (allocated(error)) return
    call list_oscillations(modes, numbers, frequencies, dampings)
    call compare_modes(input, numbers, frequencies, dampings, some, error)
    if (.not. allocated(error)) call put_back(measurements%kind == measured_frequency, some, comparisons)
  end subroutine compare_frequencies

  !> The response at the measured speeds.
  subroutine compare_orders(input, measurements, comparisons, error)
    type(input_t), intent(in) :: input
    type(measurement_t), intent(in) :: measurements(:)
    type(comparison_t), intent(inout) :: comparisons(:)
    type(error_t), allocatable, intent(out) :: error
    type(comparison_t), allocatable :: some(:)
    type(machine_t) :: machine
    type(response_settings_t) :: settings

    call assemble_steady_machine(input, .true., machine, error, sets_speed=.true.)
    if (.not. allocated(error)) call read_response_settings(input, machine, settings, error)
    if (.not. allocated(error)) call compare_responses(input, machine, settings%body, some, error)
    if (.not. allocated(error)) call put_back(measurements%kind == measured_order .or. measurements%kind == measured_peak, some, &
                                              comparisons)
  end subroutine compare_orders

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
