!> The steppers between which lanes choose, as one: each lane takes steps of one kind, and lanes of different kinds one after the
!> other.
module nocdyn_stepper_kinds
  use nocdyn_explicit_stepper, only: explicit_stepper_t
  use nocdyn_kinds, only: wp
  use nocdyn_method_choice, only: by_series, by_stages, by_systems, kinds
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper_t
  use nocdyn_stage_sums, only: padded_columns
  use nocdyn_step_attempt, only: spread_steps, step_attempt_t
  use nocdyn_system, only: system_t
  use nocdyn_taylor_stepper, only: taylor_stepper_t
  implicit none (type, external)
  private

  type, public :: stepper_kinds_t
    type(taylor_stepper_t) :: series
    type(explicit_stepper_t) :: explicit
    type(rosenbrock_stepper_t) :: implicit
    logical :: has_series = .false.
    integer, allocatable, private :: kind(:)                 !! of the step of each lane
    integer, private :: degree(kinds)                        !! of the dense output of a kind
    logical, allocatable, private :: active(:), mask(:)      !! lanes at the start of an attempt, lanes whose turn it is
    logical, allocatable, private :: succeeded(:)            !! lanes that have not failed so far
    real(wp), allocatable, private :: h(:)                   !! step sizes at the start of an attempt [s]
    real(wp), allocatable, private, dimension(:, :) :: y_new, error_estimate, low_order_estimate   !! of lanes that had their turn
    real(wp), allocatable, private :: coefficients(:, :, :)  !! dense output of one kind
  contains
    procedure :: prepare, start, set_kind, take_steps, interpolate, accept, change_kind, resume
  end type stepper_kinds_t

contains

  subroutine prepare(self, system)
    class(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    if (self%has_series) call self%series%prepare(system)
    call self%explicit%prepare(system)
    call self%implicit%prepare(system)
    if (allocated(self%kind)) deallocate (self%kind, self%active, self%mask, self%succeeded, self%h, self%y_new, &
                                          self%error_estimate, self%low_order_estimate, self%coefficients)
    self%degree(:) = [self%series%degree, self%explicit%degree, self%implicit%degree]
    columns = padded_columns(system%lanes, system%states + system%quadratures)
    associate (lanes => system%lanes)
      allocate (self%kind(lanes), source=by_stages)
      allocate (self%active(lanes), self%mask(lanes), self%succeeded(lanes), source=.false.)
      allocate (self%h(lanes), self%y_new(lanes, columns), self%error_estimate(lanes, columns), &
                self%low_order_estimate(lanes, columns), self%coefficients(lanes, columns, maxval(self%degree)), source=0.0_wp)
    end associate
  end subroutine prepare

  !> Starts lanes, of whatever kind.
  subroutine start(self, attempt, starting)
    class(stepper_kinds_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)

    call self%explicit%start(attempt, starting)
    call self%implicit%reset_spectra(starting)   ! its slopes and Jacobians are renewed when the lane changes to it
    if (self%has_series) call self%series%start(attempt, starting)
  end subroutine start

  !> Sets of which kind the next step of a lane is.
  pure subroutine set_kind(self, attempt, lane, kind)
    class(stepper_kinds_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: lane, kind

    self%kind(lane) = kind
    attempt%error_order(lane) = merge(self%implicit%error_order, self%explicit%error_order, kind == by_systems)
    attempt%max_growth(lane) = merge(self%implicit%max_growth, self%explicit%max_growth, kind == by_systems)
    attempt%degree(lane) = self%degree(kind)
  end subroutine set_kind

  !> Attempts the steps of the active lanes, one kind of steps after another; the other lanes are not active meanwhile.
  subroutine take_steps(self, system, attempt)
    class(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: kind, lane

    self%active(:) = attempt%active
    kind = self%kind(maxloc(merge(1, 0, attempt%active), dim=1))
    if (all(self%kind == kind .or. .not. attempt%active)) then
      call take_steps_of_kind(self, system, attempt, kind)
      return
    end if
    self%succeeded(:) = attempt%active
    self%h(:) = attempt%h
    do kind = 1, kinds
      self%mask(:) = self%kind == kind .and. self%active
      if (.not. any(self%mask)) cycle
      attempt%active(:) = self%mask
      attempt%h(:) = merge(self%h, 0.0_wp, self%mask)
      call spread_steps(attempt)
      call take_steps_of_kind(self, system, attempt, kind)
      do lane = 1, attempt%lanes
        if (.not. self%mask(lane)) cycle
        self%succeeded(lane) = attempt%active(lane)
        self%y_new(lane, :) = attempt%y_new(lane, :)
        self%error_estimate(lane, :) = merge(attempt%error_estimate(lane, :), 0.0_wp, kind /= by_series)
        self%low_order_estimate(lane, :) = merge(attempt%low_order_estimate(lane, :), 0.0_wp, kind == by_stages)
      end do
    end do
    attempt%active(:) = self%succeeded
    attempt%h(:) = merge(self%h, 0.0_wp, self%succeeded)
    call spread_steps(attempt)
    attempt%y_new(:, :) = self%y_new
    attempt%error_estimate(:, :) = self%error_estimate
    attempt%low_order_estimate(:, :) = self%low_order_estimate
  end subroutine take_steps

  !> Attempts the steps of the active lanes, which are of one kind.
  subroutine take_steps_of_kind(self, system, attempt, kind)
    type(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: kind

    select case (kind)
    case (by_series)
      call self%series%take_step(system, attempt)
    case (by_stages)
      call self%explicit%take_step(system, attempt)
    case default
      call self%implicit%take_step(system, attempt)
      attempt%low_order_estimate(:, :) = 0.0_wp
    end select
  end subroutine take_steps_of_kind

  !> Dense output of the wanted lanes, with zeros above the degrees of their kinds.
  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)
    integer :: kind, lane

    do kind = 1, kinds
      self%mask(:) = wanted .and. self%kind == kind
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
    type(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: kind
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)

    associate (degree => self%degree(kind))
      coefficients(:, :, degree + 1:) = 0.0_wp
      select case (kind)
      case (by_series)
        call self%series%interpolate(system, attempt, self%mask, coefficients(:, :, :degree))
      case (by_stages)
        call self%explicit%interpolate(system, attempt, self%mask, coefficients(:, :, :degree))
      case default
        call self%implicit%interpolate(system, attempt, self%mask, coefficients(:, :, :degree))
      end select
    end associate
  end subroutine interpolate_kind

  subroutine accept(self, accepted)
    class(stepper_kinds_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    self%mask(:) = accepted .and. self%kind == by_series
    if (any(self%mask)) call self%series%accept(self%mask)
    self%mask(:) = accepted .and. self%kind == by_stages
    if (any(self%mask)) call self%explicit%accept(self%mask)
    self%mask(:) = accepted .and. self%kind == by_systems
    if (any(self%mask)) call self%implicit%accept(self%mask)
  end subroutine accept

  !> Prepares a lane for a kind of step that it did not take last.
  subroutine change_kind(self, lane, kind)
    class(stepper_kinds_t), intent(inout) :: self
    integer, intent(in) :: lane, kind

    self%mask(:) = .false.
    self%mask(lane) = .true.
    select case (kind)
    case (by_series)
      call self%series%accept(self%mask)
    case (by_stages)
      call self%explicit%invalidate_first_stage(self%mask)
    case default
      call self%implicit%accept(self%mask)
      call self%implicit%reset_spectra(self%mask)
    end select
  end subroutine change_kind

  !> Restarts lanes with the kind of step that they have; what they know of the other kinds is kept.
  subroutine resume(self, attempt, resuming)
    class(stepper_kinds_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: resuming(:)

    self%mask(:) = resuming .and. self%kind == by_stages
    if (any(self%mask)) call self%explicit%start(attempt, self%mask)
    self%mask(:) = resuming .and. self%kind == by_systems
    if (any(self%mask)) call self%implicit%start(attempt, self%mask)
  end subroutine resume

end module nocdyn_stepper_kinds
