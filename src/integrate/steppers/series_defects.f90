!> Looks for what a Taylor series does not show: tanh far from its bend is a constant to all digits, and so is its series, however
!> near in time the bend is. The series of the solution is then wrong from the bend on.
!>
!> The defect of a series y(t) is y' - f(t, y) (W. H. Enright, BIT 40 (2000) 629-651). It is computed at some times of a step; the
!> step is shortened until the error to which the defect adds up is within the tolerance.
module nocdyn_series_defects
  use nocdyn_kinds, only: wp
  use nocdyn_series_sums, only: sum_series
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_step_control, only: smallest_step, step_control_t
  use nocdyn_system, only: evaluation_ok, system_t
  implicit none (type, external)
  private

  public :: new_series_defects

  real(wp), parameter :: times(4) = [0.3_wp, 0.6_wp, 0.9_wp, 1.0_wp]   ! of a step, where the defect is computed
  real(wp), parameter :: ratio = 0.3_wp                                ! by which a step is shortened

  !> Work space; [lanes, columns] or [lanes, measures].
  type, public :: series_defects_t
    private
    integer :: order = 0, columns = 0            !! of the series, of the states with padding
    real(wp), allocatable :: t(:)                !! [s], [lanes]
    real(wp), allocatable :: h(:, :), y(:, :), slope(:, :), rate(:, :), sizes(:, :), errors(:, :)
    integer, allocatable :: status(:)            !! evaluation_... of each lane
    logical, allocatable :: is_wrong(:)          !! lanes whose steps are too long
  contains
    procedure :: shorten_steps
  end type series_defects_t

contains

  !> Work space for a system.
  function new_series_defects(system, order, columns) result(self)
    class(system_t), intent(in) :: system
    integer, intent(in) :: order     !! of the series
    integer, intent(in) :: columns   !! of the states, and padding
    type(series_defects_t) :: self

    self%order = order
    self%columns = columns
    associate (lanes => system%lanes)
      allocate (self%t(lanes), self%h(lanes, columns), self%y(lanes, columns), self%slope(lanes, columns), &
                self%rate(lanes, columns), source=0.0_wp)
      allocate (self%sizes(lanes, system%measures), self%errors(lanes, system%measures), source=0.0_wp)
      allocate (self%status(lanes), source=evaluation_ok)
      allocate (self%is_wrong(lanes), source=.false.)
    end associate
  end function new_series_defects

  !> Shortens the steps of some lanes until the defects of their series are small.
  subroutine shorten_steps(self, system, attempt, control, series, chosen)
    class(series_defects_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(inout) :: control
    real(wp), intent(in) :: series(attempt%lanes, self%columns, 0:self%order)   !! of the state
    logical, intent(in) :: chosen(:)                                            !! the lanes
    integer :: i

    do
      self%is_wrong(:) = .false.
      do i = 1, size(times)
        call test(self, system, attempt, control, series, times(i), merge(self%order + 1, 1, i == size(times)))
      end do
      self%is_wrong(:) = self%is_wrong .and. chosen .and. ratio * control%h > smallest_step(attempt%t)
      if (.not. any(self%is_wrong)) return
      where (self%is_wrong) control%h = ratio * control%h
    end do
  end subroutine shorten_steps

  !> Adds the lanes whose defects are too large at one time of the step.
  subroutine test(self, system, attempt, control, series, time, allowed)
    type(series_defects_t), intent(inout) :: self
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(inout) :: attempt
    type(step_control_t), intent(in) :: control
    real(wp), intent(in) :: series(attempt%lanes, self%columns, 0:self%order)
    real(wp), intent(in) :: time      !! of the step, from 0 to 1
    integer, intent(in) :: allowed    !! largest error, in multiples of the tolerance
    integer :: c

    do c = 1, self%columns
      self%h(:, c) = time * control%h
    end do
    call sum_series(attempt%lanes * self%columns, self%order, series, attempt%lanes * self%columns, self%h, self%y)
    call sum_slopes(attempt%lanes * self%columns, self%order, series, self%h, self%slope)
    self%t(:) = attempt%t + time * control%h
    attempt%uncounted = attempt%uncounted + 1
    call system%derivative(self%t, self%y, self%rate, self%status)
    self%is_wrong(:) = self%is_wrong .or. self%status /= evaluation_ok
    self%status(:) = evaluation_ok
    do c = 1, self%columns
      self%slope(:, c) = control%h * (self%slope(:, c) - self%rate(:, c))
    end do
    if (system%measures > 0) then
      call system%measure(self%columns, attempt%y, self%slope, self%sizes, self%errors)
      call compare(attempt%lanes, system%measures, control, allowed, self%sizes, self%errors, self%is_wrong)
    else
      call compare(attempt%lanes, system%states, control, allowed, attempt%y, self%slope, self%is_wrong)
    end if
  end subroutine test

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

end module nocdyn_series_defects
