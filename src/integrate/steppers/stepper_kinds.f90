!> The steppers between which lanes choose, as one: each lane takes steps of one kind, and lanes of different kinds one after the
!> other.
module nocdyn_stepper_kinds
  use nocdyn_explicit_stepper, only: explicit_stepper_t
  use nocdyn_kinds, only: wp
  use nocdyn_method_choice, only: by_series, by_stages, by_systems, kinds
  use nocdyn_mixed_attempt, only: allocate_mixed_attempt, begin_kinds, end_kinds, keep_lanes, mixed_attempt_t, select_lanes
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper_t
  use nocdyn_stage_sums, only: padded_columns
  use nocdyn_step_attempt, only: step_attempt_t
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
    logical, allocatable, private :: active(:), mask(:)      !! work space
    type(mixed_attempt_t), private :: mixed
    real(wp), allocatable, private :: coefficients(:, :, :)  !! dense output of one kind
  contains
    procedure :: prepare
    procedure :: start
    procedure :: set_kind
    procedure :: take_steps
    procedure :: interpolate
    procedure :: accept
    procedure :: change_kind
    procedure :: resume
  end type stepper_kinds_t

contains

  subroutine prepare(self, system)
    class(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    if (self%has_series) call self%series%prepare(system)
    call self%explicit%prepare(system)
    call self%implicit%prepare(system)
    if (allocated(self%kind)) deallocate (self%kind, self%active, self%mask, self%coefficients)
    columns = padded_columns(system%lanes, system%states + system%quadratures)
    associate (lanes => system%lanes, degree => max(self%series%degree, self%explicit%degree, self%implicit%degree))
      allocate (self%kind(lanes), source=by_stages)
      allocate (self%active(lanes), self%mask(lanes), source=.false.)
      call allocate_mixed_attempt(self%mixed, lanes, columns)
      allocate (self%coefficients(lanes, columns, degree), source=0.0_wp)
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
    attempt%degree(lane) = degree_of(self, kind)
  end subroutine set_kind

  !> Degree of the dense output of a kind.
  pure integer function degree_of(self, kind) result(degree)
    type(stepper_kinds_t), intent(in) :: self
    integer, intent(in) :: kind

    select case (kind)
    case (by_series)
      degree = self%series%degree
    case (by_stages)
      degree = self%explicit%degree
    case default
      degree = self%implicit%degree
    end select
  end function degree_of

  !> Attempts the steps of the active lanes, one kind of steps after another.
  subroutine take_steps(self, system, attempt)
    class(stepper_kinds_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: kind

    self%active(:) = attempt%active
    kind = self%kind(maxloc(merge(1, 0, attempt%active), dim=1))
    if (all(self%kind == kind .or. .not. attempt%active)) then
      call take_steps_of_kind(self, system, attempt, kind)
      return
    end if
    call begin_kinds(self%mixed, attempt)
    do kind = 1, kinds
      self%mask(:) = self%kind == kind .and. self%active
      if (.not. any(self%mask)) cycle
      call select_lanes(self%mixed, attempt, self%mask)
      call take_steps_of_kind(self, system, attempt, kind)
      call keep_lanes(self%mixed, attempt, kind /= by_series, kind == by_stages)
    end do
    call end_kinds(self%mixed, attempt)
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

    associate (degree => degree_of(self, kind))
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
