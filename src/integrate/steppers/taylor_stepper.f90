!> Steps along the Taylor series of the solution, of one order throughout.
!>
!> A step is as long as the last two coefficients allow: h is the smaller of ||y_j||^(-1/j), j = p - 1 and p, with the
!> largest |y_j| / (atol + rtol |y|) of the states as norm: the terms h^j y_j do not exceed the tolerance. No step is judged
!> after it has been taken. With p = 1 - ln(tol) / 2 that is the step rho / e^2 of A. Jorba, M. Zou, A software package for
!> the numerical integration of ODEs by means of high-order Taylor methods, Experimental Mathematics 14 (2005) 99-117,
!> who take the work for proportional to p^2. Here it grows more slowly, as long as p is small, and the order is higher.
module nocdyn_taylor_stepper
  use nocdyn_combinations, only: padded_columns, width
  use nocdyn_finite, only: all_finite, is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_masks, only: all_true, any_other
  use nocdyn_step_control, only: any_too_small, smallest_step, step_control_t
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: evaluation_fine, observer_t, steps_t, system_t
  use nocdyn_trial, only: park, park_infinities, trial_fine, trial_not_finite, trial_shorten, trial_t
  use nocdyn_vector_functions, only: exp2s, log2s
  implicit none (type, external)
  private

  public :: taylor_stepper

  real(wp), parameter :: order_offset = 3.0_wp, order_slope = 0.7_wp   !! of the order over -ln(tolerance), by measurement

  integer, parameter :: long = 32   !! numbers that are added up together in blocks of many lanes

  type, extends(stepper_t), public :: taylor_stepper_t
    private
    real(wp), allocatable :: series(:, :, :)   !! y_0, y_1, ... of each lane, [lanes, padded columns, 0:order]
    real(wp), allocatable :: last(:)           !! norms of the last coefficients and then their steps, [lanes]
    real(wp), allocatable :: last_but_one(:)
    logical, allocatable :: moved(:)           !! lanes that have moved since they were expanded
    integer, allocatable :: verdict(:)         !! trial_... on the series of each lane
    integer, allocatable :: culprit(:)         !! component that the verdict is due to, 0 if there is none
    integer, allocatable :: infinite(:)        !! first component whose new series is not finite, 0 if all are
  contains
    procedure :: plan
    procedure :: prepare
    procedure :: begin
    procedure :: attempt
    procedure :: interpolate
    procedure :: accept
    procedure :: show
  end type taylor_stepper_t

contains

  !> The stepper whose order suits a tolerance, or of a given order.
  pure function taylor_stepper(rtol, order) result(stepper)
    real(wp), intent(in) :: rtol
    integer, intent(in), optional :: order   !! at least 2
    type(taylor_stepper_t) :: stepper

    stepper%order = ceiling(order_offset - order_slope * log(rtol))
    if (present(order)) stepper%order = order
    stepper%error_order = stepper%order
    stepper%degree = stepper%order
    stepper%needs_series = .true.
    stepper%plans_steps = .true.
    stepper%shows_own = .true.
  end function taylor_stepper

  subroutine prepare(self, system)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(in) :: system

    if (allocated(self%series)) deallocate (self%series, self%last, self%last_but_one, self%moved, self%verdict, self%culprit, &
                                             self%infinite)
    associate (lanes => system%lanes)
      allocate (self%series(lanes, padded_columns(lanes, system%states + system%quadratures), 0:self%order), source=0.0_wp)
      allocate (self%last(lanes), self%last_but_one(lanes), source=0.0_wp)
      allocate (self%moved(lanes), source=.true.)
      allocate (self%verdict(lanes), source=trial_fine)
      allocate (self%culprit(lanes), self%infinite(lanes), source=0)
    end associate
  end subroutine prepare

  subroutine begin(self, trial, starting)
    class(taylor_stepper_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: starting(:)

    call note_moves(size(starting), starting, self%moved)
  end subroutine begin

  !> Expands the lanes that have moved and sets their steps; a lane that cannot be expanded is parked by `attempt`.
  subroutine plan(self, system, trial, control)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    type(step_control_t), intent(inout) :: control
    logical :: are_finite, have_all_moved

    have_all_moved = all_true(trial%lanes, self%moved) .and. all_true(trial%lanes, trial%working)
    if (.not. have_all_moved) then
      if (.not. any(self%moved .and. trial%working)) return
    end if
    self%series(:, :, 0) = trial%y
    call system%series(self%order, size(self%series, 2), trial%t, self%series, trial%status)
    ! what is infinite between these coefficients alone shows up in y_new
    are_finite = all_finite(2 * trial%length, self%series) .and. all_finite(2 * trial%length, self%series(1, 1, self%order - 1))
    if (.not. are_finite) call clear_infinities(self)
    call measure(trial%lanes, trial%states, size(self%series, 2), control%rtol, control%atol, self%series, &
                 self%series(1, 1, self%order - 1), self%last, self%last_but_one)
    call find_steps(trial%lanes, self%order, self%last, self%last_but_one)
    if (have_all_moved .and. are_finite .and. .not. any_other(trial%lanes, trial%status, evaluation_fine)) then
      if (.not. any_too_small(trial%lanes, trial%t, self%last)) then
        call take_all_steps(trial%lanes, self%last, self%moved, self%verdict, self%culprit, trial%evaluations, control%h)
        return
      end if
    end if
    call take_steps(self, trial, control)
    trial%status(:) = evaluation_fine
  end subroutine plan

  !> Where all lanes have moved and have good series.
  pure subroutine take_all_steps(lanes, steps, moved, verdict, culprit, evaluations, h)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: steps(lanes)
    logical, intent(inout) :: moved(lanes)
    integer, intent(inout), dimension(lanes) :: verdict, culprit, evaluations
    real(wp), intent(inout) :: h(lanes)

    moved = .false.
    verdict = trial_fine
    culprit = 0
    evaluations = evaluations + 1
    h = steps
  end subroutine take_all_steps

  !> The verdicts on the lanes that have moved, and the steps of those with good series.
  subroutine take_steps(self, trial, control)
    class(taylor_stepper_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    type(step_control_t), intent(inout) :: control
    integer :: lane

    do lane = 1, trial%lanes
      if (.not. (self%moved(lane) .and. trial%working(lane))) cycle
      self%moved(lane) = .false.
      self%verdict(lane) = trial%status(lane)
      self%culprit(lane) = 0
      if (self%infinite(lane) > 0) then
        self%verdict(lane) = trial_not_finite
        self%culprit(lane) = self%infinite(lane)
      end if
      trial%evaluations(lane) = trial%evaluations(lane) + 1
      control%h(lane) = self%last(lane)
      if (self%verdict(lane) == trial_fine .and. control%h(lane) <= smallest_step(trial%t(lane))) then
        self%verdict(lane) = trial_shorten
        self%culprit(lane) = maxloc(abs(self%series(lane, :trial%states, self%order)), dim=1)
      end if
      if (self%verdict(lane) == trial_fine) cycle
      control%h(lane) = 0.0_wp
      self%series(lane, :, 1:) = 0.0_wp
    end do
    self%infinite(:) = 0
  end subroutine take_steps

  !> Clears series that are not finite, and notes the first component that is to blame for it.
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

  !> Largest |y_j| / (atol + rtol |y|) of the states of each lane, for the last two coefficients; no less than a number whose
  !> logarithm is finite.
  pure subroutine measure(lanes, states, columns, rtol, atol, y, y_j, last, last_but_one)
    integer, intent(in) :: lanes, states, columns
    real(wp), intent(in) :: rtol, atol
    real(wp), intent(in) :: y(lanes, states), y_j(lanes, columns, 2)   !! y_j of the orders p - 1 and p
    real(wp), intent(inout) :: last(lanes), last_but_one(lanes)
    real(wp), parameter :: smallest = 1.0e-300_wp
    real(wp) :: weight
    integer :: i, lane

    last = smallest
    last_but_one = smallest
    if (lanes == 1) then
      do i = 1, states
        weight = 1.0_wp / (atol + rtol * abs(y(1, i)))
        last_but_one(1) = max(last_but_one(1), weight * abs(y_j(1, i, 1)))
        last(1) = max(last(1), weight * abs(y_j(1, i, 2)))
      end do
    else
      do i = 1, states
        do lane = 1, lanes
          weight = 1.0_wp / (atol + rtol * abs(y(lane, i)))
          last_but_one(lane) = max(last_but_one(lane), weight * abs(y_j(lane, i, 1)))
          last(lane) = max(last(lane), weight * abs(y_j(lane, i, 2)))
        end do
      end do
    end if
  end subroutine measure

  !> Replaces the norms of the last coefficients by the steps that both pairs allow.
  pure subroutine find_steps(lanes, order, last, last_but_one)
    integer, intent(in) :: lanes, order
    real(wp), intent(inout) :: last(lanes), last_but_one(lanes)
    real(wp) :: per_order, per_lower_order
    integer :: lane

    per_order = -1.0_wp / order
    per_lower_order = -1.0_wp / (order - 1)
    call log2s(lanes, last)
    call log2s(lanes, last_but_one)
    do lane = 1, lanes
      last(lane) = min(per_order * last(lane), per_lower_order * last_but_one(lane))
    end do
    call exp2s(lanes, last)
  end subroutine find_steps

  !> The sum of the series at the end of the step.
  subroutine attempt(self, system, trial)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    integer :: lane

    if (any_other(trial%lanes, self%verdict, trial_fine)) then
      do lane = 1, trial%lanes
        if (self%verdict(lane) /= trial_fine) call park(trial, lane, self%verdict(lane), self%culprit(lane))
      end do
    end if
    call sum_series(trial%length, self%order, self%series, trial%h_length, trial%h_spread, trial%y_new)
    if (.not. all_finite(trial%length, trial%y_new)) call park_infinities(trial, trial%y_new)
  end subroutine attempt

  !> y = sum over k of h^k series(:, k).
  pure subroutine sum_series(n, order, series, h_length, h, y)
    integer, intent(in) :: n          !! whole vectors
    integer, intent(in) :: order
    integer, intent(in) :: h_length   !! n, or less if h serves all vectors alike
    real(wp), intent(in) :: series(n, 0:order), h(h_length)
    real(wp), intent(inout) :: y(n)
    real(wp) :: sum(width)
    integer :: i, j, k

    if (h_length == n .and. modulo(n, long) == 0) then
      call sum_long_vectors(n, order, series, h, y)
      return
    end if
    do i = 1, n, width
      j = merge(i, 1, h_length == n)
      sum = series(i:i + width - 1, order)
      do k = order - 1, 0, -1
        sum = series(i:i + width - 1, k) + h(j:j + width - 1) * sum
      end do
      y(i:i + width - 1) = sum
    end do
  end subroutine sum_series

  !> The same, for so many numbers at a time that a processor need not wait for a sum.
  pure subroutine sum_long_vectors(n, order, series, h, y)
    integer, intent(in) :: n   !! a multiple of `long`
    integer, intent(in) :: order
    real(wp), intent(in) :: series(n, 0:order), h(n)
    real(wp), intent(inout) :: y(n)
    real(wp) :: sum(long)
    integer :: i, k

    do i = 1, n, long
      sum = series(i:i + long - 1, order - 1) + h(i:i + long - 1) * series(i:i + long - 1, order)
      do k = order - 2, 0, -1
        sum = series(i:i + long - 1, k) + h(i:i + long - 1) * sum
      end do
      y(i:i + long - 1) = sum
    end do
  end subroutine sum_long_vectors

  !> The series itself, in powers of theta.
  subroutine interpolate(self, system, trial, wanted, coefficients)
    class(taylor_stepper_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(trial_t), intent(inout) :: trial
    logical, intent(in) :: wanted(:)
    real(wp), contiguous, intent(inout) :: coefficients(:, :, :)

    call scale_series(trial%length, self%order, self%series, trial%h_length, trial%h_spread, coefficients)
  end subroutine interpolate

  !> c(:, k) = h^k series(:, k).
  pure subroutine scale_series(n, order, series, h_length, h, c)
    integer, intent(in) :: n          !! whole vectors
    integer, intent(in) :: order
    integer, intent(in) :: h_length   !! n, or less if h serves all vectors alike
    real(wp), intent(in) :: series(n, 0:order), h(h_length)
    real(wp), intent(inout) :: c(n, order)
    real(wp) :: power(width)
    integer :: i, j, k

    do i = 1, n, width
      j = merge(i, 1, h_length == n)
      power = 1.0_wp
      do k = 1, order
        power = power * h(j:j + width - 1)
        c(i:i + width - 1, k) = power * series(i:i + width - 1, k)
      end do
    end do
  end subroutine scale_series

  subroutine accept(self, accepted)
    class(taylor_stepper_t), intent(inout) :: self
    logical, intent(in) :: accepted(:)

    call note_moves(size(accepted), accepted, self%moved)
  end subroutine accept

  pure subroutine note_moves(lanes, moving, moved)
    integer, intent(in) :: lanes
    logical, intent(in) :: moving(lanes)
    logical, intent(inout) :: moved(lanes)

    moved = merge(.true., moved, moving)
  end subroutine note_moves

  !> The series as it is, in powers of the time.
  subroutine show(self, steps, trial, coefficients, observer)
    class(taylor_stepper_t), intent(in) :: self
    type(steps_t), intent(inout) :: steps
    type(trial_t), intent(in) :: trial
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)
    class(observer_t), intent(inout) :: observer

    steps%scale(:) = steps%h
    call observer%follow_steps(steps, trial%y, trial%y_new, self%series(:, :, 1:))
  end subroutine show

end module nocdyn_taylor_stepper
