!> Steps by the Taylor series of the solution, of a constant order p.
!>
!> The last two coefficients limit the step size: h is the smaller of ||y_j||^(-1/j), j = p - 1 and p, where the norm is the
!> largest |y_j| / (atol + rtol |y|) of the states, or of the quantities that the system measures. The terms h^j y_j are then
!> within the tolerance, and there is no error test after a step. The last term of the quadratures is kept within theirs. With
!> p = 1 - ln(tol) / 2 this is the step rho / e^2 of A. Jorba, M. Zou, A software package for the numerical integration of ODEs
!> by means of high-order Taylor methods, Experimental Mathematics 14 (2005) 99-117. They assume that the work grows as p^2. Here
!> it grows more slowly at small p, and the order is higher.
!>
!> A series may not show what a system has: tanh far from its bend is a constant to all digits, and so is its series, however near
!> in time the bend is. The series of the solution is then wrong from the bend on. The defect of a series y(t) is y' - f(t, y)
!> (W. H. Enright, BIT 40 (2000) 629-651). It is computed at some times of a step; the step is shortened until the error to which
!> the defect adds up is within the tolerance.
module nocdyn_taylor_stepper
  use nocdyn_error_norm, only: quadrature_tolerance, remember
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_differs
  use nocdyn_observer, only: observer_t, step_block_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_series_sums, only: scale_series, sum_series
  use nocdyn_stage_sums, only: padded_columns
  use nocdyn_step_attempt, only: attempt_not_finite, attempt_ok, attempt_recoverable, disable_lane, disable_non_finite_lanes, &
    step_attempt_t
  use nocdyn_step_control, only: any_too_small, smallest_step, step_control_t
  use nocdyn_step_costs, only: taylor_cost
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: evaluation_ok, system_t
  use nocdyn_vector_functions, only: exp2s, log2s
  implicit none (type, external)
  private

  public :: taylor_stepper

  real(wp), parameter :: order_offset = 3.0_wp, order_slope = 0.7_wp   !! order as a function of -ln(rtol), measured

  real(wp), parameter, public :: largest_exponent = 300.0_wp   !! of 2, in estimates of eigenvalues: keeps them finite

  real(wp), parameter :: quadrature_share = 0.2_wp   !! of the error allowed to a quadrature, for its last term

  real(wp), parameter :: times(4) = [0.3_wp, 0.6_wp, 0.9_wp, 1.0_wp]   ! of a step, where the defect of a series is computed
  real(wp), parameter :: ratio = 0.3_wp                                ! by which a step is shortened

  !> Work space for the defects of series; [lanes, columns] or [lanes, measures].
  type :: series_defects_t
    real(wp), allocatable :: t(:)                !! [s], [lanes]
    real(wp), allocatable :: h(:, :), y(:, :), slope(:, :), rate(:, :), sizes(:, :), errors(:, :)
    integer, allocatable :: status(:)            !! evaluation_... of each lane
    logical, allocatable :: is_wrong(:)          !! lanes whose steps are too long
  end type series_defects_t

  type, extends(stepper_t), public :: taylor_stepper_t
    private
    real(wp), allocatable :: series(:, :, :)   !! y_0, y_1, ... of each lane, [lanes, padded columns, 0:order]
    real(wp), allocatable :: previous(:, :)    !! y_(p - 1) in the quantities that the system measures, [lanes, measures]
    real(wp), allocatable :: last_norm(:)      !! norms of the last coefficients, then the step sizes, [lanes]
    real(wp), allocatable :: previous_norm(:)
    real(wp), allocatable :: log_growth(:)     !! logarithm to base 2 of the ratio of these norms
    logical, allocatable :: moved(:)           !! lanes that need a new series
    integer, allocatable :: step_status(:)     !! attempt_... of the series of each lane
    integer, allocatable :: component(:)       !! component that caused the status, 0 if none did
    integer, allocatable :: infinite(:)        !! first component whose new series is not finite, 0 if all are
    logical, allocatable :: chosen(:)          !! lanes with new step sizes
    type(series_defects_t) :: defects
  contains
    procedure :: choose_steps, prepare, start, take_step, interpolate, accept, pass_steps, plans_step
    procedure :: find_eigenvalues, stability_limit, cost, describe_plain_steps
  end type taylor_stepper_t

contains

  !> The stepper with the best order for a tolerance, or with a given order.
  pure function taylor_stepper(rtol, order) result(stepper)
    real(wp), intent(in) :: rtol   !! relative tolerance
    integer, intent(in), optional :: order   !! at least 2
    type(taylor_stepper_t) :: stepper

    stepper%order = ceiling(order_offset - order_slope * log(rtol))
    if (present(order)) stepper%order = order
    stepper%error_order = stepper%order
    stepper%degree = stepper%order
    stepper%degrees(1) = stepper%order
    stepper%series_order = stepper%order
    stepper%chooses_steps = .true.
    stepper%estimates_errors = .false.
    stepper%passes_series = .true.
    stepper%reads_slope = .false.
  end function taylor_stepper

  subroutine prepare(self, system)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system

    if (allocated(self%series)) deallocate (self%series, self%previous, self%last_norm, self%previous_norm, &
                                            self%log_growth, self%moved, self%step_status, self%component, self%infinite, &
                                            self%chosen)
    associate (lanes => system%lanes)
      allocate (self%series(lanes, padded_columns(lanes, system%states + system%quadratures), 0:self%order), source=0.0_wp)
      allocate (self%previous(lanes, system%measures), self%last_norm(lanes), self%previous_norm(lanes), &
                self%log_growth(lanes), source=0.0_wp)
      allocate (self%moved(lanes), self%chosen(lanes), source=.true.)
      if (system%hides_bends) call allocate_defects(self%defects, system, size(self%series, 2))
      allocate (self%step_status(lanes), source=attempt_ok)
      allocate (self%component(lanes), self%infinite(lanes), source=0)
    end associate
  end subroutine prepare

  !> Allocates the work space for the defects of a system.
  subroutine allocate_defects(defects, system, columns)
    type(series_defects_t), intent(out) :: defects
    class(system_t), intent(in) :: system
    integer, intent(in) :: columns   !! of the states, and padding

    associate (lanes => system%lanes)
      allocate (defects%t(lanes), defects%h(lanes, columns), defects%y(lanes, columns), defects%slope(lanes, columns), &
                defects%rate(lanes, columns), source=0.0_wp)
      allocate (defects%sizes(lanes, system%measures), defects%errors(lanes, system%measures), source=0.0_wp)
      allocate (defects%status(lanes), source=evaluation_ok)
      allocate (defects%is_wrong(lanes), source=.false.)
    end associate
  end subroutine allocate_defects

  subroutine start(self, attempt, starting)
    class(taylor_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: starting(:)

    self%moved(:) = self%moved .or. starting
  end subroutine start

  !> Computes the series of the lanes that have moved, and their step sizes. `take_step` disables the lanes where that fails.
  subroutine choose_steps(self, system, attempt, control)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    logical :: are_finite, have_all_moved
    integer :: lane

    have_all_moved = all_true(attempt%lanes, self%moved) .and. all_true(attempt%lanes, attempt%active)
    if (.not. have_all_moved) then
      if (.not. any(self%moved .and. attempt%active)) return
    end if
    self%series(:, :, 0) = attempt%y
    call system%series(self%order, size(self%series, 2), attempt%t, self%series, attempt%rhs_status)
    ! infinities in the other coefficients alone are found in y_new
    are_finite = all_finite(2 * attempt%length, self%series) .and. all_finite(2 * attempt%length, self%series(1, 1, &
                                                                                                              self%order - 1))
    if (.not. are_finite) call clear_infinities(self)
    call measure_norms(self, system, attempt, control)
    call find_steps(attempt%lanes, self%order, self%last_norm, self%previous_norm, self%log_growth)
    if (attempt%components > attempt%states) call limit_by_quadratures(self, attempt, control)
    if (system%hides_bends) self%chosen(:) = self%moved .and. attempt%active
    if (have_all_moved .and. are_finite .and. .not. any_differs(attempt%lanes, attempt%rhs_status, evaluation_ok)) then
      if (.not. any_too_small(attempt%lanes, attempt%t, self%last_norm)) then
        self%moved(:) = .false.
        self%step_status(:) = attempt_ok
        self%component(:) = 0
        attempt%evaluations(:) = attempt%evaluations + 1
        control%h(:) = self%last_norm
        if (system%hides_bends) call shorten_steps(self, system, attempt, control)
        return
      end if
    end if
    ! sets the status of the lanes that have moved, and the step sizes of those with finite series
    do lane = 1, attempt%lanes
      if (.not. (self%moved(lane) .and. attempt%active(lane))) cycle
      self%moved(lane) = .false.
      self%step_status(lane) = attempt%rhs_status(lane)
      self%component(lane) = 0
      if (self%infinite(lane) > 0) then
        self%step_status(lane) = attempt_not_finite
        self%component(lane) = self%infinite(lane)
      end if
      attempt%evaluations(lane) = attempt%evaluations(lane) + 1
      control%h(lane) = self%last_norm(lane)
      if (self%step_status(lane) == attempt_ok .and. control%h(lane) <= smallest_step(attempt%t(lane))) then
        self%step_status(lane) = attempt_recoverable
        self%component(lane) = maxloc(abs(self%series(lane, :attempt%states, self%order)), dim=1)
      end if
      if (self%step_status(lane) == attempt_ok) cycle
      control%h(lane) = 0.0_wp
      self%series(lane, :, 1:) = 0.0_wp
    end do
    self%infinite(:) = 0
    attempt%rhs_status(:) = evaluation_ok
    if (system%hides_bends) call shorten_steps(self, system, attempt, control)
  end subroutine choose_steps

  !> Shortens new steps whose series do not show what happens in them.
  subroutine shorten_steps(self, system, attempt, control)
    type(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    integer :: i

    self%chosen(:) = self%chosen .and. self%step_status == attempt_ok
    do
      self%defects%is_wrong(:) = .false.
      do i = 1, size(times)
        call test_defects(self, system, attempt, control, self%series, times(i), merge(self%order + 1, 1, i == size(times)))
      end do
      self%defects%is_wrong(:) = self%defects%is_wrong .and. self%chosen .and. ratio * control%h > smallest_step(attempt%t)
      if (.not. any(self%defects%is_wrong)) return
      where (self%defects%is_wrong) control%h = ratio * control%h
    end do
  end subroutine shorten_steps

  !> Adds the lanes whose defects are too large at one time of the step.
  subroutine test_defects(self, system, attempt, control, series, time, allowed)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: series(attempt%length, 0:self%order)   !! of the state
    real(wp), intent(in) :: time      !! of the step, from 0 to 1
    integer, intent(in) :: allowed    !! largest error, in multiples of the tolerance
    integer :: c, columns

    columns = size(self%defects%h, 2)
    do c = 1, columns
      self%defects%h(:, c) = time * control%h
    end do
    call sum_series(attempt%length, self%order, series, attempt%length, self%defects%h, self%defects%y)
    call sum_slopes(attempt%length, self%order, series, self%defects%h, self%defects%slope)
    self%defects%t(:) = attempt%t + time * control%h
    attempt%uncounted = attempt%uncounted + 1
    call system%derivative(self%defects%t, self%defects%y, self%defects%rate, self%defects%status)
    self%defects%is_wrong(:) = self%defects%is_wrong .or. self%defects%status /= evaluation_ok
    self%defects%status(:) = evaluation_ok
    do c = 1, columns
      self%defects%slope(:, c) = control%h * (self%defects%slope(:, c) - self%defects%rate(:, c))
    end do
    if (system%measures > 0) then
      call system%measure(columns, attempt%y, self%defects%slope, self%defects%sizes, self%defects%errors)
      call compare(attempt%lanes, system%measures, control, allowed, self%defects%sizes, self%defects%errors, &
                   self%defects%is_wrong)
    else
      call compare(attempt%lanes, system%states, control, allowed, attempt%y, self%defects%slope, self%defects%is_wrong)
    end if
  end subroutine test_defects

  !> The derivative by h of the sum over k of h^k series(:, k).
  pure subroutine sum_slopes(n, order, series, h, slope)
    integer, intent(in) :: n, order
    real(wp), intent(in) :: series(n, 0:order), h(n)
    real(wp), intent(inout) :: slope(n)
    integer :: k

    slope = order * series(:, order)
    do k = order - 1, 1, -1
      slope = k * series(:, k) + h * slope
    end do
  end subroutine sum_slopes

  !> Adds the lanes with an error that is too large, or no number.
  pure subroutine compare(lanes, states, control, allowed, sizes, errors, is_wrong)
    integer, intent(in) :: lanes, states
    type(step_control_t), intent(in) :: control
    integer, intent(in) :: allowed   !! largest error, in multiples of the tolerance
    real(wp), intent(in), dimension(lanes, states) :: sizes, errors
    logical, intent(inout) :: is_wrong(lanes)
    integer :: i

    do i = 1, states
      is_wrong = is_wrong .or. .not. abs(errors(:, i)) <= allowed * (control%atol + control%rtol * abs(sizes(:, i)))
    end do
  end subroutine compare

  !> Clears series that are not finite, and stores the first component that is not.
  subroutine clear_infinities(self)
    class(taylor_stepper_t), intent(inout) :: self
    integer :: component, lane

    do lane = 1, size(self%infinite)
      do component = 1, size(self%series, 2)
        if (all(is_finite(self%series(lane, component, :)))) cycle
        self%infinite(lane) = component
        self%series(lane, :, 1:) = 0.0_wp
        exit
      end do
    end do
  end subroutine clear_infinities

  !> The norms of the last two coefficients of each lane, over the states or over the quantities that the system measures.
  subroutine measure_norms(self, system, attempt, control)
    type(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(inout) :: control

    associate (lanes => attempt%lanes, columns => size(self%series, 2), order => self%order)
      if (system%measures > 0) then
        call system%measure(columns, attempt%y, self%series(1, 1, order - 1), control%new_size, self%previous)
        call system%measure(columns, attempt%y, self%series(1, 1, order), control%new_size, control%error)
        call remember(lanes * system%measures, control%size, control%new_size)
        call find_norms(lanes, system%measures, control, control%new_size, self%previous, control%error, self%previous_norm, &
                        self%last_norm)
      else
        call find_norms(lanes, attempt%states, control, attempt%y, self%series(1, 1, order - 1), self%series(1, 1, order), &
                        self%previous_norm, self%last_norm)
      end if
    end associate
  end subroutine measure_norms

  !> The largest |y_j| / (atol + rtol |y|) of each lane for j = p - 1 and p, at least 1e-300 so that its logarithm is finite.
  pure subroutine find_norms(lanes, states, control, y, y_previous, y_last, previous_norm, last_norm)
    integer, intent(in) :: lanes, states
    type(step_control_t), intent(in) :: control
    real(wp), intent(in), dimension(lanes, states) :: y, y_previous, y_last   !! y, y_(p - 1) and y_p
    real(wp), intent(inout) :: previous_norm(lanes), last_norm(lanes)
    real(wp), parameter :: smallest = 1.0e-300_wp
    real(wp) :: atol, rtol, weight
    integer :: i, lane

    atol = control%atol
    rtol = control%rtol
    last_norm = smallest
    previous_norm = smallest
    do i = 1, states
      do lane = 1, lanes
        weight = 1.0_wp / (atol + rtol * abs(y(lane, i)))
        previous_norm(lane) = max(previous_norm(lane), weight * abs(y_previous(lane, i)))
        last_norm(lane) = max(last_norm(lane), weight * abs(y_last(lane, i)))
      end do
    end do
  end subroutine find_norms

  !> Replaces the norms `last_norm` by the step sizes that both norms allow.
  pure subroutine find_steps(lanes, order, last_norm, previous_norm, log_growth)
    integer, intent(in) :: lanes, order
    real(wp), intent(inout) :: last_norm(lanes), previous_norm(lanes), log_growth(lanes)
    real(wp) :: per_order, per_lower_order
    integer :: lane

    per_order = -1.0_wp / order
    per_lower_order = -1.0_wp / (order - 1)
    call log2s(lanes, last_norm)
    call log2s(lanes, previous_norm)
    do lane = 1, lanes
      log_growth(lane) = last_norm(lane) - previous_norm(lane)
      last_norm(lane) = min(per_order * last_norm(lane), per_lower_order * previous_norm(lane))
    end do
    call exp2s(lanes, last_norm)
  end subroutine find_steps

  !> Shortens the steps, now in `last_norm`, in which the last term of a quadrature exceeds their tolerance.
  pure subroutine limit_by_quadratures(self, attempt, control)
    type(taylor_stepper_t), intent(inout) :: self
    type(step_attempt_t), intent(in) :: attempt
    type(step_control_t), intent(in) :: control
    real(wp) :: allowed, excess, term
    integer :: lane

    do lane = 1, attempt%lanes
      associate (h => self%last_norm(lane), first => attempt%states + 1, last => attempt%components)
        h = min(h, max(control%t_end - attempt%t(lane), 0.0_wp))
        term = maxval(abs(self%series(lane, first:last, self%order)))
        if (.not. min(h, term) > 0) cycle
        allowed = quadrature_share * quadrature_tolerance(control, maxval(abs(attempt%y(lane, first:last))), &
                                       h * maxval(abs(self%series(lane, first:last, 1))))
        excess = self%order * log(h) + log(term) - log(allowed)
        if (excess > 0) h = h * exp(-excess / (self%order - 1))
      end associate
    end do
  end subroutine limit_by_quadratures

  !> Sums the series at the end of the step.
  subroutine take_step(self, system, attempt)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    integer :: lane

    if (any_differs(attempt%lanes, self%step_status, attempt_ok)) then
      do lane = 1, attempt%lanes
        if (self%step_status(lane) /= attempt_ok) call disable_lane(attempt, lane, self%step_status(lane), self%component(lane))
      end do
    end if
    call sum_series(attempt%length, self%order, self%series, attempt%h_length, attempt%h_spread, attempt%y_new)
    if (.not. all_finite(attempt%length, attempt%y_new)) call disable_non_finite_lanes(attempt, attempt%y_new)
  end subroutine take_step

  !> Dense output: the series in powers of theta.
  subroutine interpolate(self, system, attempt, wanted, coefficients)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)

    call scale_series(attempt%length, self%order, self%series, attempt%h_length, attempt%h_spread, coefficients)
  end subroutine interpolate

  subroutine accept(self, accepted)
    class(taylor_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    self%moved(:) = self%moved .or. accepted
  end subroutine accept

  !> Passes the series itself, in powers of the time, to the observer.
  subroutine pass_steps(self, steps, attempt, coefficients, observer)
    class(taylor_stepper_t), intent(in) :: self
    type(step_block_t), intent(inout) :: steps
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)
    class(observer_t), intent(inout) :: observer

    steps%scale(:) = steps%h
    call observer%on_steps(steps, attempt%y, attempt%y_new, self%series(:, :, 1:))
  end subroutine pass_steps

  !> Every step by a series may be plain.
  subroutine describe_plain_steps(self, steps, is_able)
    class(taylor_stepper_t), target, intent(inout) :: self
    type(plain_steps_t), intent(inout) :: steps
    logical, intent(out) :: is_able

    is_able = .true.
  end subroutine describe_plain_steps

  !> Whether the series of a lane can be used, after `choose_steps`.
  pure logical function plans_step(self, lane)
    class(taylor_stepper_t), intent(in) :: self
    integer, intent(in) :: lane

    plans_step = self%step_status(lane) == attempt_ok .and. .not. self%moved(lane)
  end function plans_step

  !> The sizes of the dominant eigenvalues of the Jacobian, if the motion that belongs to them is in the last coefficients of the
  !> series, a power iteration: y_k = A y_(k - 1) / k for a linear system.
  pure subroutine find_eigenvalues(self, sizes)
    class(taylor_stepper_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: sizes(:)   !! [1/s], [lanes]

    sizes(:) = min(self%log_growth, largest_exponent)
    call exp2s(size(sizes), sizes)
    sizes(:) = self%order * sizes
  end subroutine find_eigenvalues

  !> The limit of |h lambda| on the negative real axis, near the truncated exponential series' limit for orders 5 to 40.
  pure real(wp) function stability_limit(self)
    class(taylor_stepper_t), intent(in) :: self

    stability_limit = 1.3_wp + 0.376_wp * self%order
  end function stability_limit

  !> The cost of a step.
  real(wp) function cost(self, system)
    class(taylor_stepper_t), intent(in) :: self
    class(system_t), intent(in) :: system

    cost = taylor_cost(system, self%order)
  end function cost

end module nocdyn_taylor_stepper
