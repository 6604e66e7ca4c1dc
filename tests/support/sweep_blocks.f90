!> Statistics of machines: computed by a block of lanes, and from the rows of a dense trajectory.
module nocdyn_test_sweep_blocks
  use nocdyn_assembly, only: new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_integration, only: integrate, integrate_ensemble
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_solver_status, only: solver_status_t
  use nocdyn_ensemble, only: ensemble_t
  use nocdyn_recorder, only: recorder, recorder_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_statistics, only: new_statistic, statistic_final, statistic_max, statistic_max_abs, statistic_mean, statistic_min, &
    statistic_rms, statistic_settling_time, statistic_t, statistic_time_of_max, statistic_time_of_max_abs, &
    statistic_time_of_min
  use nocdyn_statistics_observer, only: new_statistics_observer, statistics_observer_t
  use nocdyn_system, only: system_t
  use nocdyn_test_lane_copies, only: copy_lane, have_same_structure
  use nocdyn_signals, only: list_signals, signal_t
  use nocdyn_test_states, only: reduced_form
  use nocdyn_trajectory_table, only: new_trajectory_table, trajectory_table_t
  implicit none (type, external)
  private

  public :: all_statistics, run_block, run_copied_variants, run_densely, sampled_statistic, column_named

  !> Copies the lanes of a source into lanes that are free and stores their statistics.
  type, extends(ensemble_t) :: measured_copies_t
    class(reduced_t), pointer :: source => null()
    type(statistics_observer_t), pointer :: observer => null()
    real(wp), allocatable :: y(:, :)        !! starts, [variants, components]
    real(wp), allocatable :: values(:, :)   !! [statistics, variants]
    integer, allocatable :: variant(:)      !! in each lane
    integer :: begun = 0
  contains
    procedure :: next
    procedure :: finish
  end type measured_copies_t

contains

  !> The statistics of the lanes of one machine, copied one after the other into the lanes of another.
  subroutine run_copied_variants(variants, lanes, method, tolerance, t_end, statistics, values)
    type(machine_t), intent(in) :: variants, lanes
    character(len=*), intent(in) :: method
    real(wp), intent(in) :: tolerance, t_end
    type(statistic_t), intent(in) :: statistics(:)
    real(wp), allocatable, intent(out) :: values(:, :)   !! [statistics, variants]; not allocated if the structures differ
    class(reduced_t), allocatable, target :: block, source
    type(statistics_observer_t), target :: observer
    type(statistic_t), allocatable :: own(:)
    type(measured_copies_t) :: ensemble
    type(solver_status_t) :: solver_status
    type(error_t), allocatable :: error

    source = reduced_form(variants, .true., as_block=.true.)
    block = reduced_form(lanes, .true., as_block=.true.)
    if (.not. have_same_structure(source, block)) return
    ensemble%source => source
    allocate (own, source=statistics)
    observer = new_statistics_observer(block, own, 0.0_wp, t_end, may_bend=.true.)
    ensemble%observer => observer
    allocate (ensemble%y, source=source%start())
    allocate (ensemble%values(size(statistics), variants%lanes), source=0.0_wp)
    allocate (ensemble%variant(lanes%lanes), source=0)
    call integrate_ensemble(block, settings_of(method, tolerance), [0.0_wp, t_end], ensemble, observer, solver_status, error)
    if (allocated(error)) error stop 'nocdyn_test_sweep_blocks: a setting was refused'
    call move_alloc(ensemble%values, values)
  end subroutine run_copied_variants

  subroutine next(self, system, lane, t, y, found)
    class(measured_copies_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    integer, intent(in) :: lane
    real(wp), intent(inout) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: found

    found = self%begun < size(self%y, 1)
    if (.not. found) return
    self%begun = self%begun + 1
    self%variant(lane) = self%begun
    select type (system)
    class is (reduced_t)
      call copy_lane(self%source, self%begun, system, lane)
    end select
    y(:) = self%y(self%begun, :)
  end subroutine next

  subroutine finish(self, lane, y, solver_status)
    class(measured_copies_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    type(solver_status_t), intent(in) :: solver_status

    call self%observer%results(lane, self%values(:, self%variant(lane)))
  end subroutine finish

  !> Every statistic of every column but the time, from the start and from a later time.
  function all_statistics(machine, from, band) result(statistics)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: from   !! [s]
    real(wp), intent(in) :: band
    type(statistic_t), allocatable :: statistics(:)
    type(signal_t), allocatable :: signals(:)
    integer :: column, kind, next

    call list_signals(machine, signals)
    allocate (statistics(2 * (size(signals) - 1) * statistic_settling_time))
    next = 0
    do column = 2, size(signals)
      do kind = 1, statistic_settling_time
        statistics(next + 1) = new_statistic(signals, column, kind, 0.0_wp, band=band)
        statistics(next + 2) = new_statistic(signals, column, kind, 0.0_wp, from, band)
        next = next + 2
      end do
    end do
  end function all_statistics

  !> The number of the column with a name, 0 if there is none.
  integer function column_named(machine, name)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: name
    type(signal_t), allocatable :: signals(:)

    call list_signals(machine, signals)
    do column_named = size(signals), 1, -1
      if (signals(column_named)%name == name) return
    end do
  end function column_named

  pure type(integration_settings_t) function settings_of(method, tolerance) result(settings)
    character(len=*), intent(in) :: method
    real(wp), intent(in) :: tolerance

    settings%method = method
    settings%rtol = tolerance
    settings%atol = 0.01_wp * tolerance
  end function settings_of

  !> The statistics of all lanes of a machine, each of which is one variant, from 0 to `t_end`.
  subroutine run_block(machine, method, tolerance, t_end, statistics, values, solver_status, is_run)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: method
    real(wp), intent(in) :: tolerance, t_end
    type(statistic_t), intent(in) :: statistics(:)
    real(wp), allocatable, intent(out) :: values(:, :)   !! [statistics, lanes]
    type(solver_status_t), intent(out) :: solver_status
    logical, intent(in), optional :: is_run   !! as in `new_statistics_observer`
    class(formulation_t), allocatable, target :: formulation
    type(statistics_observer_t), target :: observer
    type(statistic_t), allocatable :: own(:)
    type(error_t), allocatable :: error
    real(wp), allocatable :: y(:, :)
    integer :: lane

    call new_formulation('reduced', machine, formulation)
    allocate (own, source=statistics)
    observer = new_statistics_observer(formulation, own, 0.0_wp, t_end, may_bend=.true., is_run=is_run)
    y = formulation%start()
    call integrate(formulation, settings_of(method, tolerance), [0.0_wp, t_end], y, observer, solver_status, error)
    if (allocated(error)) error stop 'nocdyn_test_sweep_blocks: ' // error%message
    allocate (values(size(statistics), machine%lanes))
    do lane = 1, machine%lanes
      call observer%results(lane, values(:, lane))
    end do
  end subroutine run_block

  !> The rows of the trajectory at many times, of a machine of one lane.
  subroutine run_densely(machine, method, tolerance, times, rows)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: method
    real(wp), intent(in) :: tolerance
    real(wp), contiguous, intent(in) :: times(:)
    real(wp), allocatable, intent(out) :: rows(:, :)   !! [columns, times]
    class(formulation_t), allocatable, target :: formulation
    type(trajectory_table_t) :: table
    type(recorder_t) :: records
    type(solver_status_t) :: solver_status
    type(error_t), allocatable :: error
    real(wp), allocatable :: y(:, :), state(:)
    integer :: i

    call new_formulation('reduced', machine, formulation)
    table = new_trajectory_table(formulation, times(1), [integer ::])
    records = recorder(formulation, size(times))
    y = formulation%start()
    call integrate(formulation, settings_of(method, tolerance), times, y, records, solver_status, error)
    if (allocated(error)) error stop 'nocdyn_test_sweep_blocks: ' // error%message
    allocate (rows(size(table%labels), size(times)))
    do i = 1, size(times)
      state = records%y(1, i, :)
      call table%fill(times(i), state, rows(:, i))
    end do
  end subroutine run_densely

  !> A statistic of equidistant samples: extremes among them, integrals by the trapezoidal rule, the last one outside the band.
  pure real(wp) function sampled_statistic(statistic, times, x) result(value)
    type(statistic_t), intent(in) :: statistic
    real(wp), intent(in) :: times(:), x(:)
    integer :: first, i, last

    first = count(times < statistic%from - 1.0e-9_wp) + 1
    last = size(times)
    select case (statistic%kind)
    case (statistic_final)
      value = x(last)
    case (statistic_max)
      value = maxval(x(first:))
    case (statistic_min)
      value = minval(x(first:))
    case (statistic_max_abs)
      value = maxval(abs(x(first:)))
    case (statistic_mean)
      value = (sum(x(first:)) - 0.5_wp * (x(first) + x(last))) / (last - first)
    case (statistic_rms)
      value = sqrt((sum(x(first:)**2) - 0.5_wp * (x(first)**2 + x(last)**2)) / (last - first))
    case (statistic_time_of_max)
      value = times(first - 1 + maxloc(x(first:), dim=1))
    case (statistic_time_of_min)
      value = times(first - 1 + minloc(x(first:), dim=1))
    case (statistic_time_of_max_abs)
      value = times(first - 1 + maxloc(abs(x(first:)), dim=1))
    case (statistic_settling_time)
      value = 0.0_wp
      do i = last, first, -1
        if (abs(x(i) - x(last)) <= statistic%band * abs(x(first) - x(last))) cycle
        value = times(i) - times(first)
        exit
      end do
    case default
      error stop 'nocdyn_test_sweep_blocks: there is no such statistic'
    end select
  end function sampled_statistic

end module nocdyn_test_sweep_blocks
