!> A method that changes its kind: explicit steps where they are stable, Rosenbrock steps where stability would limit them.
!>
!> Each lane goes its own way. An explicit lane is stiff when |h lambda| of its accepted steps keeps to the border of the
!> stability domain, as in Hairer's DOPRI5; an implicit lane has ceased to be stiff when explicit steps of its size have
!> been stable for a while.
module nocdyn_auto_stepper
  use nocdyn_combinations, only: padded_columns
  use nocdyn_explicit_stepper, only: explicit_stepper, explicit_stepper_t
  use nocdyn_explicit_tables, only: explicit_table_t
  use nocdyn_kinds, only: wp
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper, rosenbrock_stepper_t
  use nocdyn_rosenbrock_tables, only: rosenbrock_table_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_trial, only: spread_steps, trial_t
  implicit none (type, external)
  private

  public :: auto_stepper

  integer, parameter :: most_hits = 15         !! accepted steps on the border of stability that make a lane stiff
  integer, parameter :: calm_steps = 6         !! successive steps off the border that make the earlier ones forgotten
  real(wp), parameter :: comfort = 0.8_wp      !! of the border: below it explicit steps are stable

  type, extends(stepper_t), public :: auto_stepper_t
    private
    type(explicit_stepper_t) :: explicit
    type(rosenbrock_stepper_t) :: implicit
    real(wp) :: border                              !! of the explicit method's stability domain on the negative real axis
    logical, allocatable :: is_implicit(:)          !! lanes that take Rosenbrock steps
    integer, allocatable :: hits(:)                 !! steps of the lane that spoke for the other kind
    integer, allocatable :: calm(:)                 !! successive steps of an explicit lane that did not
    real(wp), allocatable :: stiffness(:)           !! |h lambda| of the last attempt
    logical, allocatable :: mask(:)
    logical, allocatable :: working(:)              !! at the beginning of the attempt, then at the end of the explicit ones
    real(wp), allocatable :: h(:)
    integer, allocatable :: verdict(:)
    real(wp), allocatable :: y_new(:, :), deviation(:, :), coarse_deviation(:, :)   !! of the explicit lanes
    real(wp), allocatable :: coefficients(:, :, :)
  contains
    procedure :: prepare
    procedure :: begin
    procedure :: attempt
    procedure :: interpolate
    procedure :: accept
    procedure :: resume
  end type auto_stepper_t

contains

  !> The stepper of an explicit and an implicit table.
  pure function auto_stepper(explicit_table, rosenbrock_table) result(stepper)
    type(explicit_table_t), intent(in) :: explicit_table       !! whose last stage is f(t + h, y_new)
    type(rosenbrock_table_t), intent(in) :: rosenbrock_table
    type(auto_stepper_t) :: stepper

    stepper%explicit = explicit_stepper(explicit_table)
    stepper%implicit = rosenbrock_stepper(rosenbrock_table)
    stepper%border = explicit_table%stability_border
    stepper%order = stepper%explicit%order
    stepper%error_order = stepper%explicit%error_order
    stepper%degree = max(stepper%explicit%degree, stepper%implicit%degree)
    stepper%most_growth = stepper%explicit%most_growth
    stepper%has_coarse_error = stepper%explicit%has_coarse_error
  end function auto_stepper

  subroutine prepare(self, system)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    call self%explicit%prepare(system)
    call self%implicit%prepare(system)
    if (allocated(self%hits)) deallocate (self%is_implicit, self%hits, self%calm, self%stiffness, self%mask, self%working, &
                                          self%h, self%verdict, self%y_new, self%deviation, self%coarse_deviation, &
                                          self%coefficients)
    columns = padded_columns(system%lanes, system%states + system%quadratures)
    associate (lanes => system%lanes)
      allocate (self%is_implicit(lanes), self%mask(lanes), self%working(lanes), source=.false.)
      allocate (self%hits(lanes), self%calm(lanes), self%verdict(lanes), source=0)
      allocate (self%stiffness(lanes), self%h(lanes), source=0.0_wp)
      allocate (self%y_new(lanes, columns), self%deviation(lanes, columns), self%coarse_deviation(lanes, columns), &
                source=0.0_wp)
      allocate (self%coefficients(lanes, columns, self%degree), source=0.0_wp)
    end associate
  end subroutine prepare

  subroutine begin(self, trial, starting)
    class(auto_stepper_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: starting(:)

    call self%explicit%begin(trial, starting)
    call self%implicit%forget(starting)   ! its slopes and Jacobians are renewed when the lane switches
    where (starting)
      self%is_implicit = .false.
      self%hits = 0
      self%calm = 0
    end where
  end subroutine begin

  subroutine attempt(self, system, trial)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    integer :: lane

    do lane = 1, trial%lanes
      trial%implicit(lane) = self%is_implicit(lane)
      trial%error_order(lane) = merge(self%implicit%error_order, self%explicit%error_order, self%is_implicit(lane))
      trial%most_growth(lane) = merge(self%implicit%most_growth, self%explicit%most_growth, self%is_implicit(lane))
    end do
    if (.not. any(self%is_implicit .and. trial%working)) then
      call self%explicit%attempt(system, trial)
    else if (all(self%is_implicit .or. .not. trial%working)) then
      call self%implicit%attempt(system, trial)
      if (trial%has_coarse_deviation) trial%coarse_deviation(:, :) = 0.0_wp
    else
      call attempt_both(self, system, trial)
    end if
    do lane = 1, trial%lanes
      if (.not. trial%working(lane)) cycle
      if (self%is_implicit(lane)) then
        self%stiffness(lane) = self%implicit%stiffness(trial, lane)
      else
        self%stiffness(lane) = self%explicit%stiffness(trial, lane)
      end if
    end do
  end subroutine attempt

  !> The explicit lanes first, then the others; each time the rest is parked.
  subroutine attempt_both(self, system, trial)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial

    self%working(:) = trial%working
    self%h(:) = trial%h
    call narrow(self, trial, .false.)
    call self%explicit%attempt(system, trial)
    self%mask(:) = trial%working
    self%verdict(:) = trial%verdict
    self%y_new(:, :) = trial%y_new
    self%deviation(:, :) = trial%deviation
    self%coarse_deviation(:, :) = trial%coarse_deviation
    call narrow(self, trial, .true.)
    call self%implicit%attempt(system, trial)
    call join(self, trial)
  end subroutine attempt_both

  !> Only the lanes of one kind take part.
  subroutine narrow(self, trial, implicit)
    type(auto_stepper_t), intent(in) :: self
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: implicit
    integer :: lane

    do lane = 1, trial%lanes
      trial%working(lane) = self%working(lane) .and. (self%is_implicit(lane) .eqv. implicit)
      trial%h(lane) = merge(self%h(lane), 0.0_wp, trial%working(lane))
    end do
    call spread_steps(trial)
  end subroutine narrow

  !> Puts the results of the explicit lanes beside those of the implicit ones.
  subroutine join(self, trial)
    type(auto_stepper_t), intent(in) :: self
    type(trial_t), intent(inout) :: trial
    integer :: component, lane

    do lane = 1, trial%lanes
      if (self%is_implicit(lane)) cycle
      trial%working(lane) = self%mask(lane)
      trial%verdict(lane) = self%verdict(lane)
      trial%h(lane) = merge(self%h(lane), 0.0_wp, self%mask(lane))
    end do
    call spread_steps(trial)
    do component = 1, trial%components
      do lane = 1, trial%lanes
        if (self%is_implicit(lane)) then
          trial%coarse_deviation(lane, component) = 0.0_wp
        else
          trial%y_new(lane, component) = self%y_new(lane, component)
          trial%deviation(lane, component) = self%deviation(lane, component)
          trial%coarse_deviation(lane, component) = self%coarse_deviation(lane, component)
        end if
      end do
    end do
  end subroutine join

  subroutine interpolate(self, system, trial, wanted, coefficients)
    class(auto_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)
    integer :: lane, power

    coefficients(:, :, self%explicit%degree + 1:) = 0.0_wp
    if (.not. any(self%is_implicit)) then
      call self%explicit%interpolate(system, trial, wanted, coefficients(:, :, :self%explicit%degree))
      return
    end if
    self%mask(:) = wanted .and. .not. self%is_implicit
    if (any(self%mask)) call self%explicit%interpolate(system, trial, self%mask, coefficients(:, :, :self%explicit%degree))
    self%coefficients(:, :, self%implicit%degree + 1:) = 0.0_wp
    self%mask(:) = wanted .and. self%is_implicit
    if (.not. any(self%mask)) return
    call self%implicit%interpolate(system, trial, self%mask, self%coefficients(:, :, :self%implicit%degree))
    do power = 1, self%degree
      do lane = 1, trial%lanes
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
      if (accepted(lane)) call weigh_stiffness(self, lane, self%mask(lane))
    end do
    if (.not. any(self%mask)) return
    self%is_implicit(:) = self%is_implicit .neqv. self%mask
    call self%explicit%renew(self%mask)
    call self%implicit%accept(self%mask)
    call self%implicit%forget(self%mask)
  end subroutine accept

  !> Each lane goes on with its kind of method and with what it knows of its stiffness.
  subroutine resume(self, trial, resuming)
    class(auto_stepper_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: resuming(:)

    self%mask(:) = resuming .and. .not. self%is_implicit
    if (any(self%mask)) call self%explicit%begin(trial, self%mask)
    self%mask(:) = resuming .and. self%is_implicit
    if (any(self%mask)) call self%implicit%begin(trial, self%mask)
  end subroutine resume

  !> Counts what an accepted step says about the stiffness of its lane.
  pure subroutine weigh_stiffness(self, lane, switches)
    type(auto_stepper_t), intent(inout) :: self
    integer, intent(in) :: lane
    logical, intent(out) :: switches   !! the lane goes on with the other kind

    associate (hits => self%hits(lane), calm => self%calm(lane))
      if (self%is_implicit(lane)) then
        hits = merge(hits + 1, 0, self%stiffness(lane) < comfort * self%border)
        switches = hits >= calm_steps
      else if (self%stiffness(lane) > self%border) then
        hits = hits + 1
        calm = 0
        switches = hits >= most_hits
      else
        calm = calm + 1
        if (calm >= calm_steps) hits = 0
        switches = .false.
      end if
      if (.not. switches) return
      hits = 0
      calm = 0
    end associate
  end subroutine weigh_stiffness

end module nocdyn_auto_stepper
