!> Computes statistics of columns while variants, or the machine of a run, are integrated in the lanes of a block.
module nocdyn_statistics_observer
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_chebyshev, only: interpolation_t
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_column_bounds, only: can_bound, column_bounds_t, new_column_bounds
  use nocdyn_energy_statistics, only: energy_statistics_t, has_energies, is_energy, new_energy_statistics
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: has_law, is_linear, is_proportional
  use nocdyn_linear_statistics, only: linear_statistics_t, new_linear_statistics
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_sampled_statistics, only: new_sampled_statistics, sampled_statistics_t
  use nocdyn_statistic_parts, only: list_parts
  use nocdyn_statistics, only: find_columns, is_of_fatigue, is_time_of_extreme, is_torque, statistic_final, statistic_max, &
    statistic_max_abs, statistic_min, statistic_settling_time, statistic_t, statistic_time_of_max, statistic_time_of_min, &
    value_of_zero_column
  use nocdyn_observer, only: observer_t, piece_t, step_block_t
  use nocdyn_plain_ranges, only: plain_ranges_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_quantities, only: form_applied
  use nocdyn_signals, only: list_signals, signal_source_t, signal_t
  implicit none (type, external)
  private

  public :: new_statistics_observer

  !> The requested times must be, or contain, the start and the end of the variants.
  !>
  !> A statistic is computed by `linear` if its column allows it, or by `energies` in a run, else by `sampled`. A torque that the
  !> machine of the block does not have is 0 at all times. A statistic of a whole shaft has a part for each of its points, of
  !> which the worst one counts.
  type, extends(observer_t), public :: statistics_observer_t
    character(len=:), allocatable :: missing                  !! the first quantity without a column that is no torque, or ''
    class(formulation_t), pointer, private :: block => null()
    real(wp), private :: t_start = 0.0_wp, t_end = 0.0_wp     !! of every variant [s]
    type(linear_statistics_t), private :: linear
    type(energy_statistics_t), private :: energies
    type(sampled_statistics_t), private :: sampled
    type(plain_ranges_t), private :: plain
    type(column_bounds_t), private :: bounds                  !! of the sampled columns of a run
    integer, allocatable, private :: first_part(:)            !! of each statistic, [statistics + 1]
    integer, allocatable, private :: linear_index(:)          !! of each part in `linear`, or 0; [parts]
    integer, allocatable, private :: energy_index(:)          !! in `energies`, or 0
    integer, allocatable, private :: sampled_index(:)         !! in `sampled`, or 0
    real(wp), allocatable, private :: default_value(:)        !! where a statistic has no column, [statistics]
    integer, allocatable, private :: kind(:)                  !! statistic_..., [statistics]
    logical, allocatable, private :: is_along(:)              !! extremes of the largest moment or stress along a shaft
    type(signal_values_t), private :: recorded             !! the tracked columns
    logical, private :: has_recorded = .false.                !! whether it has any
    real(wp), allocatable, private :: t(:), y(:, :)   !! where lanes start and end, [lanes], [lanes, components]
    logical, allocatable, private :: is_complete(:)           !! lanes that have reached the end
  contains
    procedure :: results, value_of, has_begun, take_counters, on_start, on_output, on_steps, on_shift, on_jump
    procedure :: observe_lanes, tracked_values, bound_functions, find_pace, on_piece, list_ranges
  end type statistics_observer_t

contains

  !> An observer of a block, which stays where it is.
  function new_statistics_observer(block, statistics, t_start, t_end, may_bend, is_run) result(self)
    class(formulation_t), target, intent(inout) :: block   !! with work integrals if `needs_work_integrals`
    type(statistic_t), intent(inout) :: statistics(:)      !! each with t_start <= from < t_end; get their columns
    real(wp), intent(in) :: t_start, t_end                 !! of every variant [s]
    logical, intent(in) :: may_bend                        !! whether variants differ in cubic stiffnesses
    logical, intent(in), optional :: is_run                !! whether the machine of a run is the only variant; absent: no
    type(statistics_observer_t) :: self
    type(statistic_t), allocatable :: parts(:)
    type(signal_source_t), allocatable :: columns(:)
    type(signal_t), allocatable :: signals(:)
    integer :: i

    self%block => block
    self%t_start = t_start
    self%t_end = t_end
    self%wants_steps = .true.
    self%takes_shifts = .true.
    call list_signals(block%machine, signals)
    columns = signals%source
    call find_columns(signals, statistics)
    call list_parts(block%machine, statistics, columns, parts, self%first_part, self%is_along)
    self%missing = ''
    do i = size(statistics), 1, -1
      if (allocated(statistics(i)%shaft) .or. statistics(i)%column > 0) cycle
      if (.not. is_torque(statistics(i))) self%missing = statistics(i)%signal%name
    end do
    allocate (self%default_value, source=value_of_zero_column(statistics))
    allocate (self%kind(size(statistics)))
    self%kind(:) = statistics%kind
    call distribute(self, parts, columns, may_bend, is_run)
    call record_columns(self, columns(self%sampled%columns))
    allocate (self%is_complete(block%lanes), source=.false.)
  end function new_statistics_observer

  !> Evaluates the tracked columns by the formulation that is integrated.
  subroutine record_columns(self, columns)
    type(statistics_observer_t), intent(inout) :: self
    type(signal_source_t), intent(in) :: columns(:)

    self%has_recorded = size(columns) > 0
    if (.not. self%has_recorded) return
    self%recorded = new_signal_values(self%block, columns)
    self%recorded%in_motion = .true.
    associate (lanes => self%block%lanes)
      allocate (self%t(lanes), self%y(lanes, self%block%states + self%block%quadratures), source=0.0_wp)
    end associate
  end subroutine record_columns

  !> Chooses how each statistic is computed. The time of the largest moment is not the one of the largest twist in a coupling that
  !> softens. A value at the end is the one of the row of a run, to the last bit.
  subroutine distribute(self, statistics, columns, may_bend, is_run)
    type(statistics_observer_t), intent(inout) :: self
    type(statistic_t), intent(in) :: statistics(:)
    type(signal_source_t), intent(in) :: columns(:)   !! of the trajectory table, and points of shafts
    logical, intent(in) :: may_bend            !! as in `new_statistics_observer`
    logical, intent(in), optional :: is_run
    logical, dimension(size(statistics)) :: is_of_energies, is_of_linear, is_of_sampled
    logical :: is_multiple, of_run
    integer :: i

    of_run = .false.
    if (present(is_run)) of_run = is_run
    is_of_linear = .false.
    is_of_energies = .false.
    do i = 1, size(statistics)
      if (statistics(i)%column == 0 .or. statistics(i)%kind == statistic_settling_time) cycle
      associate (column => columns(statistics(i)%column))
        is_multiple = is_proportional(self%block, column) .and. (column%form == form_applied .or. .not. may_bend)
        is_of_linear(i) = is_linear(self%block, column) .or. is_multiple
        if (statistics(i)%kind == statistic_final) is_of_linear(i) = is_linear(self%block, column) &
                                                                     .and. self%block%joints%count == 0
        if (has_law(self%block%machine, column)) then
          if (is_time_of_extreme(statistics(i)%kind) .or. is_of_fatigue(statistics(i)%kind)) is_of_linear(i) = is_multiple
        end if
        if (.not. of_run) cycle
        if (is_energy(column)) is_of_energies(i) = has_energies(self%block)
      end associate
    end do
    is_of_sampled = statistics%column > 0 .and. .not. (is_of_linear .or. is_of_energies)
    allocate (self%linear_index, source=indices_among(is_of_linear))
    allocate (self%energy_index, source=indices_among(is_of_energies))
    allocate (self%sampled_index, source=indices_among(is_of_sampled))
    self%linear = new_linear_statistics(self%block, columns, pack(statistics, is_of_linear), self%t_start, self%t_end)
    self%energies = new_energy_statistics(self%block, columns, pack(statistics, is_of_energies), self%t_start, self%t_end)
    self%sampled = new_sampled_statistics(self%block%lanes, pack(statistics, is_of_sampled), self%t_start, self%t_end)
    call self%sampled%track(self%block%machine, columns, may_bend, self)
    if (of_run .and. self%sampled%has_only_extremes()) then
      self%bounds_functions = can_bound(self%block, columns(self%sampled%columns))
      if (self%bounds_functions) self%bounds = new_column_bounds(self%block, columns(self%sampled%columns))
    end if
    if (self%tracked == 0 .and. .not. any(is_of_energies)) call self%linear%read_components(self%first_read, self%last_read)
  end subroutine distribute

  !> Numbers the true elements of a mask from 1 on; 0 for the others.
  pure function indices_among(mask) result(indices)
    logical, intent(in) :: mask(:)
    integer :: indices(size(mask))
    integer :: count, i

    count = 0
    do i = 1, size(mask)
      if (mask(i)) count = count + 1
      indices(i) = merge(count, 0, mask(i))
    end do
  end function indices_among

  !> Starts the statistics of a variant that starts in a lane of the block.
  subroutine on_start(self, lane, t, y)
    class(statistics_observer_t), target, intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%is_complete(lane) = .false.
    call self%linear%start_lane(self%block, lane, y)
    call self%energies%start_run(self%block, y)
    call self%sampled%start_accumulators(lane)
    if (.not. self%has_recorded) return
    call observe_lane(self, lane, t, y)
    call self%recorded%start_lane(lane)
  end subroutine on_start

  !> The ranges of the linear statistics, if there are no others.
  subroutine list_ranges(self, order, steps, are_all)
    class(statistics_observer_t), target, intent(inout) :: self
    integer, intent(in) :: order
    type(plain_steps_t), intent(inout) :: steps
    logical, intent(out) :: are_all

    are_all = .not. (self%has_recorded .or. any(self%energy_index > 0))
    if (are_all) call self%plain%list(self%linear, order, steps, are_all)
  end subroutine list_ranges

  !> Brings one lane to a time and state; the others stay where they started or ended.
  subroutine observe_lane(self, lane, t, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%t(lane) = t
    self%y(lane, :) = y
    call self%recorded%observe(self%t, self%y)
  end subroutine observe_lane

  !> The statistics of the last variant in a lane; NaN if it has not reached its end. After the last step, once.
  subroutine results(self, lane, values)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [statistics]
    integer :: i

    values(:) = ieee_value(1.0_wp, ieee_quiet_nan)
    if (.not. self%is_complete(lane)) return
    call self%linear%finish_damages(lane)
    call self%sampled%finish_damages(lane)
    do i = 1, size(values)
      values(i) = self%value_of(i, lane)
    end do
  end subroutine results

  !> Whether a lane has come to the time from which on the first statistic is taken that is not linear: of energies in a run.
  pure logical function has_begun(self, lane)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: lane

    if (size(self%energies%accumulators) > 0) then
      has_begun = self%energies%accumulators(1)%bound(lane) <= 0
    else
      has_begun = self%sampled%accumulators(1)%bound(lane) <= 0
    end if
  end function has_begun

  !> A statistic of the variant in a lane, up to the last step.
  real(wp) function value_of(self, statistic, lane) result(value)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: statistic, lane
    integer :: part

    if (self%is_along(statistic)) then
      value = value_along(self, statistic, lane)
      return
    end if
    part = worst_part(self, statistic, lane)
    value = self%default_value(statistic)
    if (self%linear_index(part) > 0) value = self%linear%value(self%linear_index(part), lane)
    if (self%energy_index(part) > 0) value = self%energies%value(self%energy_index(part), lane)
    if (self%sampled_index(part) > 0) value = self%sampled%value(self%sampled_index(part), lane)
  end function value_of

  !> Ends the counting of the cycles of a statistic of a &fatigue, and takes its counters.
  subroutine take_counters(self, statistic, lane, counters)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: statistic, lane
    type(damage_counter_t), intent(inout) :: counters(:)   !! [parts]
    integer :: i

    do i = 1, size(counters)
      associate (part => self%first_part(statistic) - 1 + i)
        if (self%linear_index(part) > 0) counters(i) = self%linear%counter(self%linear_index(part), lane)
        if (self%sampled_index(part) > 0) counters(i) = self%sampled%counter(self%sampled_index(part), lane)
      end associate
      call counters(i)%finish()
    end do
  end subroutine take_counters

  !> An extreme of the largest moment or stress along a shaft. Its value of largest magnitude jumps from one section to another,
  !> often between a positive and a negative one, and so is no polynomial in a step; those at the points of the shaft are. The
  !> extreme is the one of the points; where all of these have one sign,
  !> the smaller end of the range is the one of the column itself, which does not jump then.
  real(wp) function value_along(self, statistic, lane) result(value)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: statistic, lane
    real(wp) :: extremes(self%first_part(statistic) + 1:self%first_part(statistic + 1) - 1)
    integer :: part, points

    associate (first => self%first_part(statistic))
      value = self%sampled%value(self%sampled_index(first), lane)
      do part = lbound(extremes, 1), ubound(extremes, 1)
        extremes(part) = self%sampled%value(self%sampled_index(part), lane)
      end do
      points = size(extremes) / 2
      select case (self%kind(statistic))
      case (statistic_max)
        if (maxval(extremes) > 0 .or. value > maxval(extremes)) value = maxval(extremes)
      case (statistic_min)
        if (minval(extremes) < 0 .or. value < minval(extremes)) value = minval(extremes)
      case (statistic_max_abs)
        value = maxval(extremes)
      case (statistic_time_of_min)   ! the smallest values, then their times
        if (minval(extremes(first + 1:first + points)) < 0) then
          value = extremes(first + points + minloc(extremes(first + 1:first + points), dim=1))
        end if
      case default   ! the largest values or magnitudes, then their times
        if (maxval(extremes(first + 1:first + points)) > 0) then
          value = extremes(first + points + maxloc(extremes(first + 1:first + points), dim=1))
        end if
      end select
    end associate
  end function value_along

  !> The part of a statistic that counts: that with the largest damage; without any damage, with the largest range.
  pure integer function worst_part(self, statistic, lane) result(worst)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: statistic, lane
    real(wp) :: largest(2), severity(2)
    integer :: part

    worst = self%first_part(statistic)
    if (self%first_part(statistic + 1) == worst + 1) return
    largest = -1.0_wp
    do part = worst, self%first_part(statistic + 1) - 1
      severity = self%sampled%severity(self%sampled_index(part), lane)
      if (severity(1) > largest(1) .or. .not. severity(1) > 0 .and. .not. largest(1) > 0 .and. severity(2) > largest(2)) then
        worst = part
        largest = severity
      end if
    end do
  end function worst_part

  !> Takes the end of a lane.
  subroutine on_output(self, lane, t, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (t < self%t_end) return
    self%is_complete(lane) = .true.
    call self%linear%finish_lane(self%block, lane, y)
    if (.not. self%has_recorded) return
    call observe_lane(self, lane, t, y)
    call self%recorded%fill_row(lane, t, y, self%sampled%x_end(lane, :))
  end subroutine on_output

  !> Takes the shift that `block` has made of the state of a lane.
  subroutine on_shift(self, lane, shift)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: shift(:)

    call self%linear%copy_lane(self%block, lane)
  end subroutine on_shift

  !> Takes the state after a jump.
  subroutine on_jump(self, lane, t, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (t > self%t_start) then
      call self%linear%add_state(lane, t, y)
    else
      call self%linear%start_lane(self%block, lane, y)
    end if
    call self%energies%add_state(self%block, t, y)
  end subroutine on_jump

  subroutine on_steps(self, steps, y, y_new, c)
    class(statistics_observer_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)

    call self%linear%add_steps(steps, y, y_new, c)
    call self%energies%add_step(self%block, steps, y, c)
  end subroutine on_steps

  subroutine observe_lanes(self, t, y)
    class(statistics_observer_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:), y(:, :)

    call self%recorded%observe(t, y)
  end subroutine observe_lanes

  subroutine tracked_values(self, lane, t, y, values)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: values(:)

    call self%recorded%fill_row(lane, t, y, values)
  end subroutine tracked_values

  subroutine bound_functions(self, lane, steps, y, c, slopes, bends)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    real(wp), intent(out) :: slopes(:), bends(:)

    call self%bounds%bound(self%block, steps, y, c, slopes, bends)
  end subroutine bound_functions

  subroutine find_pace(self, lane, fastest, scale)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: fastest, scale   !! [rad/s], [N m]

    call self%recorded%find_pace(lane, fastest, scale)
  end subroutine find_pace

  subroutine on_piece(self, lane, piece, rule, values, replaced)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(piece_t), intent(in) :: piece
    type(interpolation_t), intent(in) :: rule
    real(wp), contiguous, intent(in) :: values(:, :)   !! [tracked, nodes]
    logical, intent(in) :: replaced(:)

    call self%sampled%add_piece(lane, piece, rule, values, replaced)
  end subroutine on_piece

end module nocdyn_statistics_observer
