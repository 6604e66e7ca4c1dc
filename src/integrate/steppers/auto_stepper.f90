!> Automatic switching: explicit steps where they are stable, Rosenbrock steps where stability would limit the step size.
!>
!> Each lane switches by itself. A lane with explicit steps is stiff when |h lambda| of its accepted steps stays at the limit of
!> the stability domain, as in Hairer's DOPRI5. A lane with implicit steps is no longer stiff when explicit steps of its size
!> would have been stable for several steps.
module nocdyn_auto_stepper
  use nocdyn_explicit_stepper, only: explicit_stepper, explicit_stepper_t
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper, rosenbrock_stepper_t
  use nocdyn_rosenbrock_tables, only: rosenbrock_table_t
  use nocdyn_stage_sums, only: padded_columns
  use nocdyn_step_attempt, only: spread_steps, step_attempt_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: auto_stepper

  integer, parameter :: max_stiff_steps = 15         !! accepted steps beyond the stability limit that make a lane stiff
  integer, parameter :: nonstiff_steps = 6           !! successive steps within the limit that reset that count, or end stiffness
  real(wp), parameter :: stability_margin = 0.8_wp   !! of the stability limit: below it explicit steps are stable

  type, extends(stepper_t), public :: auto_stepper_t
    private
    type(explicit_stepper_t) :: explicit
    type(rosenbrock_stepper_t) :: implicit
    real(wp) :: stability_limit                     !! of |h lambda| of the explicit method, on the negative real axis
    logical, allocatable :: is_implicit(:)          !! lanes that take Rosenbrock steps
    integer, allocatable :: evidence(:)             !! steps of the lane that speak for the other kind
    integer, allocatable :: nonstiff(:)             !! successive steps of an explicit lane that do not
    real(wp), allocatable :: stiffness(:)           !! |h lambda| of the last attempt
    logical, allocatable :: mask(:)
    logical, allocatable :: active(:)               !! lanes at the start of the attempt
    real(wp), allocatable :: h(:)
    integer, allocatable :: step_status(:)
    real(wp), allocatable :: y_new(:, :), error_estimate(:, :), low_order_estimate(:, :)   !! of the explicit lanes
    real(wp), allocatable :: coefficients(:, :, :)
  contains
    procedure :: prepare
    procedure :: start
    procedure :: take_step
    procedure :: interpolate
    procedure :: accept
    procedure :: resume
  end type auto_stepper_t

contains

  !> The stepper of an explicit and a Rosenbrock tableau.
  pure function auto_stepper(explicit_table, rosenbrock_table) result(stepper)
    type(explicit_table_t), intent(in) :: explicit_table       !! whose last stage is f(t + h, y_new)
    type(rosenbrock_table_t), intent(in) :: rosenbrock_table
    type(auto_stepper_t) :: stepper

    stepper%explicit = explicit_stepper(explicit_table)
    stepper%implicit = rosenbrock_stepper(rosenbrock_table)
    stepper%stability_limit = explicit_table%stability_limit
    stepper%order = stepper%explicit%order
    stepper%error_order = stepper%explicit%error_order
    stepper%degree = max(stepper%explicit%degree, stepper%implicit%degree)
    stepper%max_growth = stepper%explicit%max_growth
    stepper%has_low_order_error = stepper%explicit%has_low_order_error
  end function auto_stepper

  subroutine prepare(self, system)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    call self%explicit%prepare(system)
    call self%implicit%prepare(system)
    if (allocated(self%evidence)) deallocate (self%is_implicit, self%evidence, self%nonstiff, self%stiffness, self%mask, &
                                              self%active, self%h, self%step_status, self%y_new, self%error_estimate, &
                                              self%low_order_estimate, self%coefficients)
    columns = padded_columns(system%lanes, system%states + system%quadratures)
    associate (lanes => system%lanes)
      allocate (self%is_implicit(lanes), self%mask(lanes), self%active(lanes), source=.false.)
      allocate (self%evidence(lanes), self%nonstiff(lanes), self%step_status(lanes), source=0)
      allocate (self%stiffness(lanes), self%h(lanes), source=0.0_wp)
      allocate (self%y_new(lanes, columns), self%error_estimate(lanes, columns), self%low_order_estimate(lanes, columns), &
                source=0.0_wp)
      allocate (self%coefficients(lanes, columns, self%degree), source=0.0_wp)
    end associate
  end subroutine prepare

  subroutine start(self, attempt, starting)
    class(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)

    call self%explicit%start(attempt, starting)
    call self%implicit%reset_spectra(starting)   ! its slopes and Jacobians are renewed when the lane switches
    where (starting)
      self%is_implicit = .false.
      self%evidence = 0
      self%nonstiff = 0
    end where
  end subroutine start

  subroutine take_step(self, system, attempt)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane

    do lane = 1, attempt%lanes
      attempt%implicit(lane) = self%is_implicit(lane)
      attempt%error_order(lane) = merge(self%implicit%error_order, self%explicit%error_order, self%is_implicit(lane))
      attempt%max_growth(lane) = merge(self%implicit%max_growth, self%explicit%max_growth, self%is_implicit(lane))
    end do
    if (.not. any(self%is_implicit .and. attempt%active)) then
      call self%explicit%take_step(system, attempt)
    else if (all(self%is_implicit .or. .not. attempt%active)) then
      call self%implicit%take_step(system, attempt)
      if (attempt%has_low_order_estimate) attempt%low_order_estimate(:, :) = 0.0_wp
    else
      call attempt_both(self, system, attempt)
    end if
    do lane = 1, attempt%lanes
      if (.not. attempt%active(lane)) cycle
      if (self%is_implicit(lane)) then
        self%stiffness(lane) = self%implicit%stiffness(attempt, lane)
      else
        self%stiffness(lane) = self%explicit%stiffness(attempt, lane)
      end if
    end do
  end subroutine take_step

  !> Attempts the steps of the explicit lanes, then those of the implicit lanes; the other lanes are not active meanwhile.
  subroutine attempt_both(self, system, attempt)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt

    self%active(:) = attempt%active
    self%h(:) = attempt%h
    call select_kind(self, attempt, .false.)
    call self%explicit%take_step(system, attempt)
    self%mask(:) = attempt%active
    self%step_status(:) = attempt%step_status
    self%y_new(:, :) = attempt%y_new
    self%error_estimate(:, :) = attempt%error_estimate
    self%low_order_estimate(:, :) = attempt%low_order_estimate
    call select_kind(self, attempt, .true.)
    call self%implicit%take_step(system, attempt)
    call merge_kinds(self, attempt)
  end subroutine attempt_both

  !> Activates only the lanes of one kind.
  subroutine select_kind(self, attempt, implicit)
    type(auto_stepper_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: implicit
    integer :: lane

    do lane = 1, attempt%lanes
      attempt%active(lane) = self%active(lane) .and. (self%is_implicit(lane) .eqv. implicit)
      attempt%h(lane) = merge(self%h(lane), 0.0_wp, attempt%active(lane))
    end do
    call spread_steps(attempt)
  end subroutine select_kind

  !> Merges the results of the explicit lanes with those of the implicit lanes.
  subroutine merge_kinds(self, attempt)
    type(auto_stepper_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    integer :: component, lane

    do lane = 1, attempt%lanes
      if (self%is_implicit(lane)) cycle
      attempt%active(lane) = self%mask(lane)
      attempt%step_status(lane) = self%step_status(lane)
      attempt%h(lane) = merge(self%h(lane), 0.0_wp, self%mask(lane))
    end do
    call spread_steps(attempt)
    do component = 1, attempt%components
      do lane = 1, attempt%lanes
        if (self%is_implicit(lane)) then
          attempt%low_order_estimate(lane, component) = 0.0_wp
        else
          attempt%y_new(lane, component) = self%y_new(lane, component)
          attempt%error_estimate(lane, component) = self%error_estimate(lane, component)
          attempt%low_order_estimate(lane, component) = self%low_order_estimate(lane, component)
        end if
      end do
    end do
  end subroutine merge_kinds

  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)
    integer :: lane, power

    coefficients(:, :, self%explicit%degree + 1:) = 0.0_wp
    if (.not. any(self%is_implicit)) then
      call self%explicit%interpolate(system, attempt, wanted, coefficients(:, :, :self%explicit%degree))
      return
    end if
    self%mask(:) = wanted .and. .not. self%is_implicit
    if (any(self%mask)) call self%explicit%interpolate(system, attempt, self%mask, coefficients(:, :, :self%explicit%degree))
    self%coefficients(:, :, self%implicit%degree + 1:) = 0.0_wp
    self%mask(:) = wanted .and. self%is_implicit
    if (.not. any(self%mask)) return
    call self%implicit%interpolate(system, attempt, self%mask, self%coefficients(:, :, :self%implicit%degree))
    do power = 1, self%degree
      do lane = 1, attempt%lanes
        if (self%mask(lane)) coefficients(lane, :, power) = self%coefficients(lane, :, power)
      end do
    end do
  end subroutine interpolate

  subroutine accept(self, accepted)
    class(auto_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)
    integer :: lane

    self%mask(:) = accepted .and. .not. self%is_implicit
    if (any(self%mask)) call self%explicit%accept(self%mask)
    self%mask(:) = accepted .and. self%is_implicit
    if (any(self%mask)) call self%implicit%accept(self%mask)
    do lane = 1, size(accepted)
      self%mask(lane) = .false.
      if (accepted(lane)) call count_stiffness(self, lane, self%mask(lane))
    end do
    if (.not. any(self%mask)) return
    self%is_implicit(:) = self%is_implicit .neqv. self%mask
    call self%explicit%invalidate_first_stage(self%mask)
    call self%implicit%accept(self%mask)
    call self%implicit%reset_spectra(self%mask)
  end subroutine accept

  !> Restarts lanes with the kind of method that they have; the counts of stiff steps are kept.
  subroutine resume(self, attempt, resuming)
    class(auto_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: resuming(:)

    self%mask(:) = resuming .and. .not. self%is_implicit
    if (any(self%mask)) call self%explicit%start(attempt, self%mask)
    self%mask(:) = resuming .and. self%is_implicit
    if (any(self%mask)) call self%implicit%start(attempt, self%mask)
  end subroutine resume

  !> Counts whether an accepted step of a lane was stiff.
  pure subroutine count_stiffness(self, lane, switches)
    type(auto_stepper_t), intent(inout) :: self
    integer, intent(in) :: lane
    logical, intent(out) :: switches   !! whether the lane continues with the other kind

    associate (evidence => self%evidence(lane), nonstiff => self%nonstiff(lane))
      if (self%is_implicit(lane)) then
        evidence = merge(evidence + 1, 0, self%stiffness(lane) < stability_margin * self%stability_limit)
        switches = evidence >= nonstiff_steps
      else if (self%stiffness(lane) > self%stability_limit) then
        evidence = evidence + 1
        nonstiff = 0
        switches = evidence >= max_stiff_steps
      else
        nonstiff = nonstiff + 1
        if (nonstiff >= nonstiff_steps) evidence = 0
        switches = .false.
      end if
      if (.not. switches) return
      evidence = 0
      nonstiff = 0
    end associate
  end subroutine count_stiffness

end module nocdyn_auto_stepper
