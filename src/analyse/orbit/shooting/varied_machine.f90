!> A machine that carries variations of its state along: where it changes a branch, they change as the neighbours of the motion
!> do, which meet the boundary sooner or later.
!>
!> With the indicator g that falls through zero, its gradient n by the state, the rates f- and f+ on both sides and the derivative
!> D of a jump, variations are multiplied by D + (f+ - D f-) n' / (n' f- + dg/dt), the saltation matrix.
module nocdyn_varied_machine
  use nocdyn_friction_joints, only: locked
  use nocdyn_joint_formulation, only: change_with_joints
  use nocdyn_kinds, only: wp
  use nocdyn_reduced, only: reduced_derivative => derivative, reduced_t
  use nocdyn_system, only: evaluation_ok
  implicit none (type, external)
  private

  !> One lane, without work integrals.
  type, extends(reduced_t), public :: varied_machine_t
    logical :: is_varied = .false.                !! whether variations are carried along
    real(wp), allocatable :: variations(:, :)     !! [states, variations]
    real(wp), allocatable :: outside(:)             !! acceleration by a torque from outside [rad/s2], [coordinates]
    real(wp), allocatable :: scale(:)             !! sizes of the states, [states]
    real(wp) :: duration = 1.0_wp                 !! size of times [s]
    integer :: events = 0                         !! changes of branches
    integer :: grazed = 0                         !! the indicator that fell slowest, 0: none
    real(wp) :: slowest = huge(1.0_wp)            !! its rate times `duration`, as a share of what the states do to it
  contains
    procedure :: derivative => pushed_derivative
    procedure :: accelerate => pushed_accelerations
    procedure :: hold_derivative => pushed_hold
    procedure :: series_obstacle => no_series
    procedure :: change_branch => vary_branch
    procedure :: begin_variations, rates_at
    procedure, private :: find_gradient, jump_derivative
  end type varied_machine_t

  real(wp), parameter :: difference = 1.0e-6_wp   ! steps of central differences, as a share of the sizes
  real(wp), parameter :: no_jump = 1.0e-9_wp      ! change of a state, as a share of its size, that is none

contains

  subroutine pushed_derivative(self, t, y, dydt, status)
    class(varied_machine_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    call reduced_derivative(self, t, y, dydt, status)
    if (self%joints%count > 0 .or. .not. allocated(self%outside)) return   ! else it has been added before joints hold
    dydt(1, :size(self%outside)) = dydt(1, :size(self%outside)) + self%outside
  end subroutine pushed_derivative

  subroutine pushed_accelerations(self, acceleration)
    class(varied_machine_t), intent(inout) :: self
    real(wp), intent(inout) :: acceleration(:)

    call self%reduced_t%accelerate(acceleration)
    if (allocated(self%outside)) acceleration(:size(self%outside)) = acceleration(:size(self%outside)) + self%outside
  end subroutine pushed_accelerations

  subroutine pushed_hold(self, components, t, dydt, status)
    class(varied_machine_t), intent(inout) :: self
    integer, intent(in) :: components
    real(wp), intent(in) :: t
    real(wp), intent(inout) :: dydt(components)
    integer, intent(inout) :: status

    if (allocated(self%outside)) dydt(:size(self%outside)) = dydt(:size(self%outside)) + self%outside
    call self%reduced_t%hold_derivative(components, t, dydt, status)
  end subroutine pushed_hold

  !> Series know nothing of the torque from outside, and their steps are too long for those of the variations.
  subroutine no_series(self, obstacle)
    class(varied_machine_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = 'variations are carried along'
  end subroutine no_series

  !> The rates at a state, on the present branches.
  subroutine rates_at(self, t, y, rates)
    class(varied_machine_t), intent(inout) :: self
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    real(wp), intent(out) :: rates(:)
    real(wp) :: dydt(1, self%states), state(1, self%states)
    integer :: status(1)

    status = evaluation_ok
    state(1, :) = y
    dydt = 0.0_wp
    call self%derivative([t], state, dydt, status)
    rates = dydt(1, :)
  end subroutine rates_at

  !> Begins with unit variations at a state. Joints that are locked there, and rows that move, hold the state and its variations;
  !> without variations the state alone.
  subroutine begin_variations(self, t, y, with_variations)
    class(varied_machine_t), intent(inout) :: self
    real(wp), intent(in) :: t
    real(wp), intent(inout) :: y(:)
    logical, intent(in) :: with_variations
    real(wp), dimension(size(y)) :: after, before
    integer :: i
    logical :: holds

    self%is_varied = .false.
    self%events = 0
    self%grazed = 0
    self%slowest = huge(self%slowest)
    call self%start_lane(1, t, y)
    holds = .false.
    if (self%joints%count > 0) holds = self%joints%motions%count > 0 .or. any(self%joints%mode(:self%joints%locking) == locked)
    if (with_variations) then
      if (allocated(self%variations)) deallocate (self%variations)
      allocate (self%variations(size(y), size(y)), source=0.0_wp)
      do i = 1, size(y)
        self%variations(i, i) = 1.0_wp
        if (.not. holds) cycle
        before = y
        after = y
        before(i) = y(i) - difference * self%scale(i)
        after(i) = y(i) + difference * self%scale(i)
        call self%project(t, before)
        call self%project(t, after)
        self%variations(:, i) = (after - before) / (2.0_wp * difference * self%scale(i))
      end do
    end if
    if (holds) call self%project(t, y)
    self%is_varied = with_variations
  end subroutine begin_variations

  !> Changes a branch, and the variations.
  subroutine vary_branch(self, lane, which, t, y)
    class(varied_machine_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    class(varied_machine_t), allocatable :: former
    real(wp), dimension(size(y)) :: after, before, gradient, jumped, y_before
    real(wp) :: fall, rate, terms
    integer :: k

    self%events = self%events + 1
    if (.not. self%is_varied) then
      call change_with_joints(self, lane, which, t, y)
      return
    end if
    call self%find_gradient(which, t, y, gradient, rate)
    call self%rates_at(t, y, before)
    fall = dot_product(gradient, before) + rate
    terms = sum(abs(gradient) * self%scale) + abs(rate) * self%duration
    terms = abs(fall) * self%duration / max(terms, tiny(terms))
    if (terms < self%slowest) then
      self%slowest = terms
      self%grazed = which
    end if
    y_before = y
    if (self%joints%count > 0) allocate (former, source=self)
    call change_with_joints(self, lane, which, t, y)
    call self%rates_at(t, y, after)
    if (.not. abs(fall) > tiny(fall)) return
    jumped = before
    if (any(abs(y - y_before) > no_jump * self%scale)) call former%jump_derivative(which, t, y_before, before, jumped, self)
    do k = 1, size(self%variations, 2)
      self%variations(:, k) = self%variations(:, k) + (after - jumped) * &
                              (dot_product(gradient, self%variations(:, k)) / fall)
    end do
  end subroutine vary_branch

  !> The derivatives of an indicator by the state and by the time.
  subroutine find_gradient(self, which, t, y, gradient, rate)
    class(varied_machine_t), intent(inout) :: self
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    real(wp), intent(out) :: gradient(:), rate
    real(wp) :: after(self%switches), before(self%switches), other(size(y)), step
    integer :: i

    after = 0.0_wp
    before = 0.0_wp
    do i = 1, size(y)
      step = difference * self%scale(i)
      other = y
      other(i) = y(i) - step
      call self%set_indicator(which, 1, t, other, before)
      other(i) = y(i) + step
      call self%set_indicator(which, 1, t, other, after)
      gradient(i) = (after(which) - before(which)) / (2.0_wp * step)
    end do
    step = difference * self%duration
    other = y
    call self%set_indicator(which, 1, t - step, other, before)
    call self%set_indicator(which, 1, t + step, other, after)
    rate = (after(which) - before(which)) / (2.0_wp * step)
    call self%indicator_values(1, t, other, after)
  end subroutine find_gradient

  !> Multiplies the variations of another machine, which has jumped, by the derivative D of the jump, and gives D f-. D comes from
  !> central differences of jumps of this one, which has not.
  subroutine jump_derivative(self, which, t, y, before, jumped, other)
    class(varied_machine_t), intent(in) :: self
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)         !! before the jump
    real(wp), intent(in) :: before(:)    !! f-
    real(wp), intent(out) :: jumped(:)   !! D f-
    class(varied_machine_t), intent(inout) :: other
    class(varied_machine_t), allocatable :: trial
    real(wp) :: derivative(size(y), size(y)), ends(size(y), 2), step
    integer :: i, k

    do i = 1, size(y)
      step = difference * self%scale(i)
      do k = 1, 2
        ends(:, k) = y
        ends(i, k) = y(i) + (2 * k - 3) * step
        if (allocated(trial)) deallocate (trial)
        allocate (trial, source=self)
        call change_with_joints(trial, 1, which, t, ends(:, k))
      end do
      derivative(:, i) = (ends(:, 2) - ends(:, 1)) / (2.0_wp * step)
    end do
    jumped = matmul(derivative, before)
    other%variations = matmul(derivative, other%variations)
  end subroutine jump_derivative

end module nocdyn_varied_machine
