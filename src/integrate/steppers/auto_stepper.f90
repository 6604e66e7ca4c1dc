!> Automatic choice between steps by a Taylor series, explicit and Rosenbrock steps: those that cost least
!> (`nocdyn_method_choice`).
!>
!> Each lane chooses by itself. A lane of a system without a series begins with explicit steps.
module nocdyn_auto_stepper
  use nocdyn_explicit_stepper, only: explicit_stepper, explicit_stepper_t
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_method_choice, only: begin_calm, begin_trial, by_series, by_stages, by_systems, calm_t, choice_t, count_attempt, &
    end_calm, go_on, kind_data_t, kinds, longest_shared_period, needed_step, note_stiffness, restart_choice, settle, &
    shared_period, wants_trial
  use nocdyn_mixed_attempt, only: allocate_mixed_attempt, begin_kinds, end_kinds, keep_lanes, mixed_attempt_t, select_lanes
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper, rosenbrock_stepper_t
  use nocdyn_rosenbrock_tables, only: rosenbrock_table_t
  use nocdyn_stage_sums, only: padded_columns
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_control, only: reset_control, step_control_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_taylor_stepper, only: taylor_stepper_t
  implicit none (type, external)
  private

  public :: auto_stepper

  integer, parameter :: stride = 3   !! explicit steps for each estimate of the dominant eigenvalue

  type, extends(stepper_t), public :: auto_stepper_t
    private
    type(taylor_stepper_t) :: by_series
    type(explicit_stepper_t) :: explicit
    type(rosenbrock_stepper_t) :: implicit
    type(kind_data_t) :: data
    type(choice_t), allocatable :: choice(:)        !! [lanes]
    logical, allocatable :: mask(:)
    logical, allocatable :: expanded(:)             !! lanes of other kinds whose series is wanted
    logical, allocatable :: active(:)               !! lanes at the start of the attempt
    logical, allocatable :: was_tried(:)            !! an attempt has been made since the last decision
    logical, allocatable :: has_moved(:)            !! and was accepted
    logical :: are_calm = .false.                   !! all active lanes step by series, and have nothing to decide
    type(calm_t) :: calm
    real(wp), allocatable :: h(:)
    real(wp), allocatable :: lambda(:)              !! dominant eigenvalues by the series [1/s]
    type(mixed_attempt_t) :: mixed
    real(wp), allocatable :: coefficients(:, :, :)
  contains
    procedure :: prepare
    procedure :: start
    procedure :: choose_steps
    procedure :: take_step
    procedure :: interpolate
    procedure :: accept
    procedure :: resume
  end type auto_stepper_t

contains

  !> The stepper of an explicit and a Rosenbrock tableau, and of a Taylor series for systems that have one.
  pure function auto_stepper(explicit_table, rosenbrock_table, series) result(stepper)
    type(explicit_table_t), intent(in) :: explicit_table       !! whose last stage is f(t + h, y_new)
    type(rosenbrock_table_t), intent(in) :: rosenbrock_table
    type(taylor_stepper_t), intent(in), optional :: series
    type(auto_stepper_t) :: stepper

    stepper%explicit = explicit_stepper(explicit_table)
    stepper%implicit = rosenbrock_stepper(rosenbrock_table)
    stepper%data%has(:) = [present(series), .true., .true.]
    stepper%data%limit(by_stages) = explicit_table%stability_limit
    if (present(series)) then
      stepper%by_series = series
      stepper%series_order = series%series_order
      stepper%data%limit(by_series) = series%stability_limit()
    end if
    stepper%order = stepper%explicit%order
    stepper%error_order = stepper%explicit%error_order
    stepper%degrees(:) = [stepper%by_series%degree, stepper%explicit%degree, stepper%implicit%degree]
    stepper%degree = maxval(stepper%degrees)
    stepper%max_growth = stepper%explicit%max_growth
    stepper%has_low_order_error = stepper%explicit%has_low_order_error
    stepper%chooses_steps = .true.
  end function auto_stepper

  subroutine prepare(self, system)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    if (self%data%has(by_series)) call self%by_series%prepare(system)
    call self%explicit%prepare(system)
    call self%implicit%prepare(system)
    self%data%cost(by_stages) = self%explicit%cost(system)
    self%data%cost(by_systems) = self%implicit%cost(system)
    if (system%is_shared) then
      self%data%first_period(:) = shared_period
      self%data%longest_period(:) = longest_shared_period
    end if
    self%data%tries(by_stages) = .not. (system%is_shared .and. self%data%has(by_series))
    if (self%data%has(by_series)) self%data%cost(by_series) = self%by_series%cost(system)
    if (allocated(self%choice)) deallocate (self%choice, self%mask, self%expanded, self%active, self%h, self%lambda, &
                                            self%was_tried, self%has_moved, self%calm%steps, &
                                            self%calm%uncounted, self%calm%signs, self%calm%is_in_doubt, &
                                            self%calm%waits, self%coefficients)
    columns = padded_columns(system%lanes, system%states + system%quadratures)
    associate (lanes => system%lanes)
      allocate (self%choice(lanes))
      allocate (self%mask(lanes), self%expanded(lanes), self%active(lanes), source=.false.)
      allocate (self%was_tried(lanes), self%has_moved(lanes), source=.false.)
      allocate (self%calm%steps(lanes), self%calm%uncounted(lanes), self%calm%signs(lanes), source=0)
      allocate (self%calm%is_in_doubt(lanes), self%calm%waits(lanes), source=.false.)
      allocate (self%h(lanes), self%lambda(lanes), source=0.0_wp)
      call allocate_mixed_attempt(self%mixed, lanes, columns)
      allocate (self%coefficients(lanes, columns, self%degree), source=0.0_wp)
    end associate
  end subroutine prepare

  subroutine start(self, attempt, starting)
    class(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)
    integer :: lane

    call self%explicit%start(attempt, starting)
    call self%implicit%reset_spectra(starting)   ! its slopes and Jacobians are renewed when the lane switches
    if (self%data%has(by_series)) call self%by_series%start(attempt, starting)
    do lane = 1, size(starting)
      if (.not. starting(lane)) cycle
      call restart_choice(self%choice(lane), self%data, attempt%t(lane))
      call describe_kind(self, attempt, lane)
      self%was_tried(lane) = .false.
      self%has_moved(lane) = .false.
      call begin_calm(self%calm, lane, self%choice(lane), self%data)
    end do
  end subroutine start

  !> Decides which kind of step each active lane takes next, and the step size where that is another kind than before.
  subroutine choose_steps(self, system, attempt, control)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    integer :: lane

    call choose_calm_steps(self, system, attempt, control)
    if (self%are_calm) return
    do lane = 1, attempt%lanes
      call end_calm(self%calm, lane, self%choice(lane))
      self%expanded(lane) = .false.
      if (.not. attempt%active(lane)) cycle
      if (self%was_tried(lane)) call judge_attempt(self, attempt, control, lane)
      if (self%choice(lane)%kind == by_series .or. control%h(lane) >= control%longest) cycle
      self%expanded(lane) = wants_trial(self%choice(lane), self%data, by_series)
    end do
    if (self%data%has(by_series)) then
      call expand_lanes(self, system, attempt, control)
      call self%by_series%find_eigenvalues(self%lambda)
    end if
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      call try_kinds(self, attempt, control, lane)
      self%was_tried(lane) = .true.
      self%has_moved(lane) = .false.
      call begin_calm(self%calm, lane, self%choice(lane), self%data)
      control%is_given(lane) = self%choice(lane)%kind == by_series
      if (control%is_given(lane)) control%mean_square(lane) = 0.0_wp
    end do
  end subroutine choose_steps

  !> The same as `choose_steps` if no lane has anything to decide: all go on by series. Else does nothing that is done again.
  subroutine choose_calm_steps(self, system, attempt, control)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    logical :: are_calm
    integer :: lane

    are_calm = self%data%has(by_series)
    do lane = 1, attempt%lanes
      are_calm = are_calm .and. (.not. attempt%active(lane) .or. (self%calm%uncounted(lane) + 1 < self%calm%steps(lane) &
                                                              .and. (self%has_moved(lane) .or. .not. self%was_tried(lane))))
    end do
    self%are_calm = .false.
    if (.not. are_calm) return
    self%h(:) = control%h
    call self%by_series%choose_steps(system, attempt, control)
    call self%by_series%find_eigenvalues(self%lambda)
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (self%by_series%plans_step(lane)) cycle
      are_calm = .false.
      control%h(lane) = self%h(lane)
    end do
    call go_on(self%calm, self%data, attempt%lanes, attempt%active, self%has_moved, control%h, self%lambda, are_calm)
    self%are_calm = are_calm
    if (.not. are_calm) return
    self%was_tried(:) = self%was_tried .or. attempt%active
    self%has_moved(:) = self%has_moved .and. .not. attempt%active
    control%is_given(:) = control%is_given .or. attempt%active
    control%mean_square(:) = merge(0.0_wp, control%mean_square, attempt%active)
  end subroutine choose_calm_steps

  !> Draws the conclusions from the last attempt of a lane.
  subroutine judge_attempt(self, attempt, control, lane)
    type(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane
    logical :: is_new   ! the estimate of the eigenvalue
    logical :: is_over
    integer :: tried   ! the kind of the attempt

    associate (choice => self%choice(lane))
      tried = choice%kind
      if (choice%kind == by_series .and. .not. self%has_moved(lane)) call settle(choice, by_stages, by_series)
      is_new = choice%kind == by_systems .or. modulo(choice%steps, stride) == 0
      call count_attempt(choice, self%data, self%has_moved(lane), attempt%t(lane), min(control%h(lane), control%longest), &
                         is_over)
      if (is_over) control%h(lane) = choice%h
      if (choice%kind /= tried) call change_kind(self, control, lane)
      if (self%has_moved(lane) .and. choice%before == 0 .and. choice%kind /= by_series .and. is_new) then
        call note_stiffness(choice, self%data, attempt%t(lane), control%h(lane))
      end if
    end associate
  end subroutine judge_attempt

  !> Prepares a lane for a kind of step that it did not take last.
  subroutine change_kind(self, control, lane)
    type(auto_stepper_t), intent(inout) :: self
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane

    self%mask(:) = .false.
    self%mask(lane) = .true.
    select case (self%choice(lane)%kind)
    case (by_series)
      call self%by_series%accept(self%mask)
    case (by_stages)
      call self%explicit%invalidate_first_stage(self%mask)
    case default
      call self%implicit%accept(self%mask)
      call self%implicit%reset_spectra(self%mask)
    end select
    call reset_control(control, lane)
  end subroutine change_kind

  !> Computes the series of the lanes that step by them, and of those that want to know their step; the latter change to them
  !> where they cost less, the former to explicit steps where the series cannot be used.
  subroutine expand_lanes(self, system, attempt, control)
    type(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    real(wp) :: needed
    integer :: lane

    self%active(:) = attempt%active
    self%h(:) = control%h
    call self%by_series%accept(self%expanded)
    attempt%active(:) = self%active .and. (self%choice%kind == by_series .or. self%expanded)
    if (any(attempt%active)) call self%by_series%choose_steps(system, attempt, control)
    attempt%active(:) = self%active
    do lane = 1, attempt%lanes
      if (.not. self%active(lane)) cycle
      associate (choice => self%choice(lane), t => attempt%t(lane))
        if (self%expanded(lane)) then
          needed = needed_step(choice, self%data, by_series, t, self%h(lane))
          if (self%by_series%plans_step(lane) .and. min(control%h(lane), control%longest) >= needed) then
            call settle(choice, by_series, choice%kind)
            call reset_control(control, lane)
          else
            call settle(choice, choice%kind, by_series)
            control%h(lane) = self%h(lane)
          end if
        else if (choice%kind == by_series .and. .not. self%by_series%plans_step(lane)) then
          call settle(choice, by_stages, by_series)
          control%h(lane) = self%h(lane)
          call change_kind(self, control, lane)
        end if
      end associate
    end do
  end subroutine expand_lanes

  !> Begins a trial in a lane, if it is time for one.
  subroutine try_kinds(self, attempt, control, lane)
    type(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane

    associate (choice => self%choice(lane))
      if (choice%kind == by_series) then
        choice%lambda = self%lambda(lane)
        if (self%has_moved(lane)) call note_stiffness(choice, self%data, attempt%t(lane), control%h(lane))
      end if
    end associate
    call try_kind(self, attempt, control, lane, by_systems)
    call try_kind(self, attempt, control, lane, by_stages)
  end subroutine try_kinds

  !> The same for one kind.
  subroutine try_kind(self, attempt, control, lane, kind)
    type(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane, kind
    real(wp) :: h

    associate (choice => self%choice(lane), t => attempt%t(lane))
      if (.not. wants_trial(choice, self%data, kind)) return
      h = control%h(lane)
      if (h >= control%longest) return   ! no kind can take longer steps
      if (needed_step(choice, self%data, kind, t, h) > min(control%longest, control%t_end - t)) return
      call begin_trial(choice, self%data, kind, t, h)
      control%h(lane) = h
      call change_kind(self, control, lane)
    end associate
  end subroutine try_kind

  subroutine take_step(self, system, attempt)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: kind, lane

    if (self%are_calm) then
      call self%by_series%take_step(system, attempt)
      return
    end if
    self%active(:) = attempt%active
    do lane = 1, attempt%lanes
      call describe_kind(self, attempt, lane)
    end do
    kind = self%choice(maxloc(merge(1, 0, attempt%active), dim=1))%kind
    if (all(self%choice%kind == kind .or. .not. attempt%active)) then
      call take_steps_of_kind(self, system, attempt, kind)
    else
      call attempt_all(self, system, attempt)
    end if
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (self%choice(lane)%kind == by_systems) then
        self%choice(lane)%lambda = self%implicit%stiffness(attempt, lane) / attempt%h(lane)
      else if (self%choice(lane)%kind == by_stages .and. modulo(self%choice(lane)%steps, stride) == 0) then
        self%choice(lane)%lambda = self%explicit%stiffness(attempt, lane) / attempt%h(lane)
      end if
    end do
  end subroutine take_step

  !> Tells the attempt of which kind the step of a lane is.
  subroutine describe_kind(self, attempt, lane)
    type(auto_stepper_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: lane

    associate (kind => self%choice(lane)%kind, before => self%choice(lane)%before)
      attempt%implicit(lane) = merge(before, kind, before > 0) == by_systems   ! a trial is no change of the method
      attempt%error_order(lane) = merge(self%implicit%error_order, self%explicit%error_order, kind == by_systems)
      attempt%max_growth(lane) = merge(self%implicit%max_growth, self%explicit%max_growth, kind == by_systems)
      attempt%degree(lane) = self%degrees(kind)
    end associate
  end subroutine describe_kind

  !> Attempts the steps of the active lanes, which are of one kind.
  subroutine take_steps_of_kind(self, system, attempt, kind)
    type(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: kind

    select case (kind)
    case (by_series)
      call self%by_series%take_step(system, attempt)
    case (by_stages)
      call self%explicit%take_step(system, attempt)
    case default
      call self%implicit%take_step(system, attempt)
      attempt%low_order_estimate(:, :) = 0.0_wp
    end select
  end subroutine take_steps_of_kind

  !> Attempts the steps of one kind after the other; the other lanes are not active meanwhile.
  subroutine attempt_all(self, system, attempt)
    type(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: kind

    call begin_kinds(self%mixed, attempt)
    do kind = 1, kinds
      self%mask(:) = self%choice%kind == kind .and. self%active
      if (.not. any(self%mask)) cycle
      call select_lanes(self%mixed, attempt, self%mask)
      call take_steps_of_kind(self, system, attempt, kind)
      call keep_lanes(self%mixed, attempt, kind /= by_series, kind == by_stages)
    end do
    call end_kinds(self%mixed, attempt)
  end subroutine attempt_all

  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)
    integer :: kind, lane

    do kind = 1, kinds
      self%mask(:) = wanted .and. self%choice%kind == kind
      if (.not. any(self%mask)) cycle
      if (all(self%mask .or. .not. wanted)) then
        call interpolate_kind(self, system, attempt, kind, coefficients)
        return
      end if
      call interpolate_kind(self, system, attempt, kind, self%coefficients)
      do lane = 1, attempt%lanes
        if (self%mask(lane)) coefficients(lane, :, :) = self%coefficients(lane, :, :)
      end do
    end do
  end subroutine interpolate

  !> Dense output of the lanes of one kind, in `mask`.
  subroutine interpolate_kind(self, system, attempt, kind, coefficients)
    type(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: kind
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)

    associate (degree => self%degrees(kind))
      coefficients(:, :, degree + 1:) = 0.0_wp
      select case (kind)
      case (by_series)
        call self%by_series%interpolate(system, attempt, self%mask, coefficients(:, :, :degree))
      case (by_stages)
        call self%explicit%interpolate(system, attempt, self%mask, coefficients(:, :, :degree))
      case default
        call self%implicit%interpolate(system, attempt, self%mask, coefficients(:, :, :degree))
      end select
    end associate
  end subroutine interpolate_kind

  subroutine accept(self, accepted)
    class(auto_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    self%has_moved(:) = self%has_moved .or. accepted
    if (self%are_calm) then
      call self%by_series%accept(accepted)
      return
    end if
    self%mask(:) = accepted .and. self%choice%kind == by_series
    if (any(self%mask)) call self%by_series%accept(self%mask)
    self%mask(:) = accepted .and. self%choice%kind == by_stages
    if (any(self%mask)) call self%explicit%accept(self%mask)
    self%mask(:) = accepted .and. self%choice%kind == by_systems
    if (any(self%mask)) call self%implicit%accept(self%mask)
  end subroutine accept

  !> Restarts lanes with the kind of step that they have; what they know of the other kinds is kept.
  subroutine resume(self, attempt, resuming)
    class(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: resuming(:)

    self%choice%crossings = self%choice%crossings + merge(1, 0, resuming)
    self%mask(:) = resuming .and. self%choice%kind == by_stages
    if (any(self%mask)) call self%explicit%start(attempt, self%mask)
    self%mask(:) = resuming .and. self%choice%kind == by_systems
    if (any(self%mask)) call self%implicit%start(attempt, self%mask)
  end subroutine resume

end module nocdyn_auto_stepper
