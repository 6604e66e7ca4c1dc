!> Automatic choice between steps by a Taylor series, explicit and Rosenbrock steps: those that cost least
!> (`nocdyn_method_choice`).
!>
!> Each lane chooses by itself. A lane of a system without a series begins with explicit steps.
module nocdyn_auto_stepper
  use, intrinsic :: iso_c_binding, only: c_loc
  use nocdyn_explicit_stepper, only: explicit_stepper
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_method_choice, only: begin_trial, by_series, by_stages, by_systems, choice_t, count_attempt, count_steps, &
    kind_data_t, longest_shared_period, near_limit, needed_step, note_stiffness, restart_choice, settle, shared_period, &
    stiff_signs, wants_trial, weak_sign
  use nocdyn_plain_steps, only: calm_lane_t, plain_steps_t
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper
  use nocdyn_rosenbrock_tables, only: rosenbrock_table_t
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_control, only: reset_control, step_control_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_stepper_kinds, only: stepper_kinds_t
  use nocdyn_system, only: system_t
  use nocdyn_taylor_stepper, only: largest_exponent, taylor_stepper_t
  implicit none (type, external)
  private

  public :: auto_stepper

  integer, parameter :: stride = 3   !! explicit steps for each estimate of the dominant eigenvalue

  type, extends(stepper_t), public :: auto_stepper_t
    private
    type(stepper_kinds_t) :: steppers
    type(kind_data_t) :: data
    type(choice_t), allocatable :: choice(:)   !! [lanes]
    type(calm_lane_t), allocatable :: calm(:)  !! of lanes that step by series and have nothing to decide, [lanes]
    logical :: are_calm = .false.              !! all active lanes step by series, and have nothing to decide
    logical, allocatable :: expanded(:)        !! lanes of other kinds whose series is wanted
    logical, allocatable :: active(:)          !! lanes at the start of the attempt
    logical, allocatable :: was_tried(:)       !! an attempt has been made since the last decision
    logical, allocatable :: has_moved(:)       !! and was accepted
    real(wp), allocatable :: h(:)              !! step sizes before new series change them [s]
    real(wp), allocatable :: lambda(:)         !! dominant eigenvalues by the series [1/s]
  contains
    procedure :: prepare, start, choose_steps, take_step, interpolate, accept, resume
    procedure :: describe_plain_steps, accept_plain_steps
  end type auto_stepper_t

contains

  !> The stepper of an explicit and a Rosenbrock tableau, and of a Taylor series for systems that have one.
  pure function auto_stepper(explicit_table, rosenbrock_table, series) result(stepper)
    type(explicit_table_t), intent(in) :: explicit_table       !! whose last stage is f(t + h, y_new)
    type(rosenbrock_table_t), intent(in) :: rosenbrock_table
    type(taylor_stepper_t), intent(in), optional :: series
    type(auto_stepper_t) :: stepper

    associate (steppers => stepper%steppers, data => stepper%data)
      steppers%explicit = explicit_stepper(explicit_table)
      steppers%implicit = rosenbrock_stepper(rosenbrock_table)
      steppers%has_series = present(series)
      data%has(:) = [present(series), .true., .true.]
      data%limit(by_stages) = explicit_table%stability_limit
      if (present(series)) then
        steppers%series = series
        stepper%series_order = series%series_order
        data%limit(by_series) = series%stability_limit()
      end if
      stepper%order = steppers%explicit%order
      stepper%error_order = steppers%explicit%error_order
      stepper%degrees(:) = [steppers%series%degree, steppers%explicit%degree, steppers%implicit%degree]
      stepper%degree = maxval(stepper%degrees)
      stepper%max_growth = steppers%explicit%max_growth
      stepper%has_low_order_error = steppers%explicit%has_low_order_error
      stepper%chooses_steps = .true.
    end associate
  end function auto_stepper

  subroutine prepare(self, system)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system

    call self%steppers%prepare(system)
    associate (data => self%data, steppers => self%steppers, lanes => system%lanes)
      data%cost(by_stages) = steppers%explicit%cost(system)
      data%cost(by_systems) = steppers%implicit%cost(system)
      if (data%has(by_series)) data%cost(by_series) = steppers%series%cost(system)
      if (system%is_shared) then
        data%first_period(:) = shared_period
        data%longest_period(:) = longest_shared_period
      end if
      data%tries(by_stages) = .not. (system%is_shared .and. data%has(by_series))
      if (allocated(self%choice)) deallocate (self%choice, self%calm, self%expanded, self%active, self%was_tried, &
                                              self%has_moved, self%h, self%lambda)
      allocate (self%choice(lanes), self%calm(lanes))
      allocate (self%expanded(lanes), self%active(lanes), self%was_tried(lanes), self%has_moved(lanes), source=.false.)
      allocate (self%h(lanes), self%lambda(lanes), source=0.0_wp)
    end associate
  end subroutine prepare

  subroutine start(self, attempt, starting)
    class(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)
    integer :: lane

    call self%steppers%start(attempt, starting)
    do lane = 1, size(starting)
      if (.not. starting(lane)) cycle
      call restart_choice(self%choice(lane), self%data, attempt%t(lane))
      call describe_kind(self, attempt, lane)
      self%was_tried(lane) = .false.
      self%has_moved(lane) = .false.
      call begin_calm(self%calm(lane), self%choice(lane), self%data)
    end do
  end subroutine start

  !> Decides which kind of step each active lane takes next, and the step size where that is another kind than before.
  subroutine choose_steps(self, system, attempt, control)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    integer :: lane
    logical :: is_new   ! the estimate of the eigenvalue
    logical :: is_over
    integer :: tried   ! the kind of the attempt

    call choose_calm_steps(self, system, attempt, control)
    if (self%are_calm) return
    do lane = 1, attempt%lanes
      if (self%calm(lane)%uncounted > 0) then
        call count_steps(self%choice(lane), self%calm(lane)%uncounted)
        self%choice(lane)%signs(by_systems) = self%calm(lane)%signs
        self%choice(lane)%is_in_doubt = self%calm(lane)%is_in_doubt > 0
        self%calm(lane)%uncounted = 0
      end if
      self%expanded(lane) = .false.
      if (.not. attempt%active(lane)) cycle
      if (self%was_tried(lane)) then
        associate (choice => self%choice(lane))
          tried = choice%kind
          if (choice%kind == by_series .and. .not. self%has_moved(lane)) call settle(choice, self%data, by_stages, by_series)
          is_new = choice%kind == by_systems .or. modulo(choice%steps, stride) == 0
          call count_attempt(choice, self%data, self%has_moved(lane), attempt%t(lane), &
                             min(control%h(lane), control%longest(lane)), is_over)
          if (is_over) control%h(lane) = choice%h
          if (choice%kind /= tried) call change_kind(self, control, lane)
          if (self%has_moved(lane) .and. choice%before == 0 .and. choice%kind /= by_series .and. is_new) then
            call note_stiffness(choice, self%data, attempt%t(lane), control%h(lane))
          end if
        end associate
      end if
      if (self%choice(lane)%kind == by_series .or. control%h(lane) >= control%longest(lane)) cycle
      self%expanded(lane) = wants_trial(self%choice(lane), self%data, by_series)
    end do
    if (self%data%has(by_series)) then
      call expand_lanes(self, system, attempt, control)
      call self%steppers%series%find_eigenvalues(self%lambda)
    end if
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (self%choice(lane)%kind == by_series) then
        self%choice(lane)%lambda = self%lambda(lane)
        if (self%has_moved(lane)) call note_stiffness(self%choice(lane), self%data, attempt%t(lane), control%h(lane))
      end if
      call try_kind(self, attempt, control, lane, by_systems)
      call try_kind(self, attempt, control, lane, by_stages)
      self%was_tried(lane) = .true.
      self%has_moved(lane) = .false.
      call begin_calm(self%calm(lane), self%choice(lane), self%data)
      control%is_given(lane) = self%choice(lane)%kind == by_series
      if (control%is_given(lane)) control%mean_square(lane) = 0.0_wp
    end do
  end subroutine choose_steps

  !> Takes what is counted of a lane, after a decision.
  pure subroutine begin_calm(calm, choice, data)
    type(calm_lane_t), intent(out) :: calm
    type(choice_t), intent(in) :: choice
    type(kind_data_t), intent(in) :: data

    calm%signs = choice%signs(by_systems)
    calm%is_in_doubt = merge(1, 0, choice%is_in_doubt)
    calm%waits = merge(1, 0, choice%wait(by_systems) > 0)
    if (choice%kind /= by_series .or. choice%before > 0) return
    calm%steps = huge(calm%steps)
    if (calm%waits > 0) then
      calm%steps = choice%wait(by_systems)
    else if (choice%is_in_doubt) then
      calm%steps = choice%doubt
    end if
    if (data%tries(by_stages)) calm%steps = min(calm%steps, choice%wait(by_stages))
  end subroutine begin_calm

  !> Chooses series for all lanes if none has anything to decide. Otherwise leaves the state unchanged.
  subroutine choose_calm_steps(self, system, attempt, control)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    logical :: are_calm
    real(wp) :: near, weak   ! values of |h lambda|
    integer :: lane

    self%are_calm = .false.
    if (.not. self%data%has(by_series)) return
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (self%calm(lane)%uncounted + 1 >= self%calm(lane)%steps) return
      if (self%was_tried(lane) .and. .not. self%has_moved(lane)) return
    end do
    self%h(:) = control%h
    call self%steppers%series%choose_steps(system, attempt, control)
    call self%steppers%series%find_eigenvalues(self%lambda)
    near = near_limit * self%data%limit(by_series)
    weak = weak_sign * self%data%limit(by_series)
    are_calm = .true.
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (self%steppers%series%plans_step(lane)) then
        associate (calm => self%calm(lane), size_of_step => control%h(lane) * self%lambda(lane))
          if (calm%waits > 0) cycle
          are_calm = are_calm .and. merge(calm%signs + 1, 0, size_of_step > near) < stiff_signs &
                     .and. (calm%is_in_doubt > 0 .or. .not. size_of_step > weak)
        end associate
      else
        are_calm = .false.
        control%h(lane) = self%h(lane)
      end if
    end do
    if (.not. are_calm) return
    do lane = 1, attempt%lanes
      if (.not. (attempt%active(lane) .and. self%has_moved(lane))) cycle
      associate (calm => self%calm(lane), size_of_step => control%h(lane) * self%lambda(lane))
        calm%uncounted = calm%uncounted + 1
        calm%signs = merge(calm%signs + 1, 0, size_of_step > near)
        calm%is_in_doubt = merge(1, int(calm%is_in_doubt), size_of_step > weak)
      end associate
    end do
    self%are_calm = .true.
    self%was_tried(:) = self%was_tried .or. attempt%active
    self%has_moved(:) = self%has_moved .and. .not. attempt%active
    control%is_given(:) = control%is_given .or. attempt%active
    control%mean_square(:) = merge(0.0_wp, control%mean_square, attempt%active)
  end subroutine choose_calm_steps

  !> Prepares a lane for a kind of step that it did not take last.
  subroutine change_kind(self, control, lane)
    type(auto_stepper_t), intent(inout) :: self
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane

    call self%steppers%change_kind(lane, self%choice(lane)%kind)
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
    call self%steppers%series%accept(self%expanded)
    attempt%active(:) = self%active .and. (self%choice%kind == by_series .or. self%expanded)
    if (any(attempt%active)) call self%steppers%series%choose_steps(system, attempt, control)
    attempt%active(:) = self%active
    do lane = 1, attempt%lanes
      if (.not. self%active(lane)) cycle
      associate (choice => self%choice(lane), t => attempt%t(lane))
        if (self%expanded(lane)) then
          needed = needed_step(choice, self%data, by_series, t, self%h(lane))
          if (self%steppers%series%plans_step(lane) .and. min(control%h(lane), control%longest(lane)) >= needed) then
            call settle(choice, self%data, by_series, choice%kind)
            call reset_control(control, lane)
          else
            call settle(choice, self%data, choice%kind, by_series)
            control%h(lane) = self%h(lane)
          end if
        else if (choice%kind == by_series .and. .not. self%steppers%series%plans_step(lane)) then
          call settle(choice, self%data, by_stages, by_series)
          control%h(lane) = self%h(lane)
          call change_kind(self, control, lane)
        end if
      end associate
    end do
  end subroutine expand_lanes

  !> Tries one kind of step.
  subroutine try_kind(self, attempt, control, lane, kind)
    type(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(inout) :: control
    integer, intent(in) :: lane, kind
    real(wp) :: h

    associate (choice => self%choice(lane), t => attempt%t(lane))
      if (.not. wants_trial(choice, self%data, kind)) return
      h = control%h(lane)
      if (h >= control%longest(lane)) return   ! no kind can take longer steps
      if (needed_step(choice, self%data, kind, t, h) > min(control%longest(lane), control%t_end - t)) return
      call begin_trial(choice, self%data, kind, t, h)
      control%h(lane) = h
      call change_kind(self, control, lane)
    end associate
  end subroutine try_kind

  subroutine take_step(self, system, attempt)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane

    if (self%are_calm) then
      call self%steppers%series%take_step(system, attempt)
      return
    end if
    do lane = 1, attempt%lanes
      call describe_kind(self, attempt, lane)
    end do
    call self%steppers%take_steps(system, attempt)
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      associate (choice => self%choice(lane))
        if (choice%kind == by_systems) then
          choice%lambda = self%steppers%implicit%stiffness(attempt, lane) / attempt%h(lane)
        else if (choice%kind == by_stages .and. modulo(choice%steps, stride) == 0) then
          choice%lambda = self%steppers%explicit%stiffness(attempt, lane) / attempt%h(lane)
        end if
      end associate
    end do
  end subroutine take_step

  !> Tells the attempt of which kind the step of a lane is.
  subroutine describe_kind(self, attempt, lane)
    type(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: lane

    associate (kind => self%choice(lane)%kind, before => self%choice(lane)%before)
      attempt%implicit(lane) = merge(before, kind, before > 0) == by_systems   ! a trial is no change of the method
      call self%steppers%set_kind(attempt, lane, kind)
    end associate
  end subroutine describe_kind

  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)

    call self%steppers%interpolate(system, attempt, wanted, coefficients)
  end subroutine interpolate

  subroutine accept(self, accepted)
    class(auto_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    self%has_moved(:) = self%has_moved .or. accepted
    if (self%are_calm) then
      call self%steppers%series%accept(accepted)
      return
    end if
    call self%steppers%accept(accepted)
  end subroutine accept

  !> Plain steps are those of calm lanes.
  subroutine describe_plain_steps(self, steps, is_able)
    class(auto_stepper_t), target, intent(inout) :: self
    type(plain_steps_t), intent(inout) :: steps
    logical, intent(out) :: is_able

    is_able = self%data%has(by_series)
    if (.not. is_able) return
    self%calm%has_moved = merge(1, 0, self%has_moved)
    where (.not. self%was_tried) self%calm%has_moved = 2
    steps%calm = c_loc(self%calm)
    steps%near = near_limit * self%data%limit(by_series)
    steps%weak = weak_sign * self%data%limit(by_series)
    steps%stiff_signs = stiff_signs
    steps%largest_exponent = largest_exponent
  end subroutine describe_plain_steps

  subroutine accept_plain_steps(self, accepted)
    class(auto_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    self%was_tried(:) = self%was_tried .or. accepted
    self%has_moved(:) = self%has_moved .or. accepted
    call self%steppers%series%accept(accepted)
  end subroutine accept_plain_steps

  !> Restarts lanes with the kind of step that they have; what they know of the other kinds is kept.
  subroutine resume(self, attempt, resuming)
    class(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: resuming(:)

    self%choice%crossings = self%choice%crossings + merge(1, 0, resuming)
    call self%steppers%resume(attempt, resuming)
  end subroutine resume

end module nocdyn_auto_stepper
