!> The common type of the classic test problems of the literature: one lane, autonomous, with a known final state.
!>
!> The error of an integration is measured as in the Test Set for IVP Solvers: relative to the final value, or to the ratio of
!> absolute to relative tolerance for components smaller than that ratio ("mixed error significant correct digits").
!>
!> The final states were computed in quadruple precision by Radau IIA collocation with 7 stages, to 20 digits or more, in
!> agreement with 5 stages; the published final states are a check.
module nocdyn_classic_problem
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_recoverable, system_t
  implicit none (type, external)
  private

  public :: allocate_ends, end_error, mixed_error

  real(wp), parameter :: most = 1.0e60_wp   ! size of a state: f must not overflow after an unstable step

  !> y' = f(y) from t = 0 and `y_start` to `t_end`.
  type, abstract, extends(system_t), public :: classic_problem_t
    character(len=:), allocatable :: name
    character(len=:), allocatable :: source     !! of the equations and of the published final state
    logical :: is_stiff = .false.
    real(wp) :: t_end = 0.0_wp
    real(wp), allocatable :: y_start(:)         !! [states]
    integer, allocatable :: compared(:)         !! components whose final value is known
    real(wp), allocatable :: y_end(:)           !! of the problem with all its constants rounded to `wp`; [size(compared)]
    real(wp), allocatable :: published(:)       !! y_end as the source has it; not allocated: it has none
    real(wp) :: published_error = 5.0e-15_wp    !! difference from y_end, measured by `end_error`
    real(wp) :: error_factor = 10.0_wp          !! bound of the error of all suitable methods, in units of the tolerance
    real(wp) :: rounding = 1.0e-13_wp           !! error below which the rounding of double precision may show
    real(wp) :: least_gain = 0.6_wp             !! mean number of digits gained by a decade of the tolerance
    integer :: rodas_steps = 0                  !! that Hairer's RODAS takes at rtol = 1e-5; 0 if not known
    integer :: finest = 12                      !! the tests go down to the tolerance 10**(-finest)
    real(wp) :: atol_ratio = 1.0_wp             !! absolute tolerance over relative tolerance, for all components
  contains
    procedure(law_interface), deferred :: law
    procedure(tangent_interface), deferred :: tangent
    procedure :: derivative
    procedure :: jacobian
  end type classic_problem_t

  abstract interface

    !> dydt = f(y)
    subroutine law_interface(self, y, dydt)
      import :: classic_problem_t, wp
      class(classic_problem_t), intent(in) :: self
      real(wp), intent(in) :: y(self%states)
      real(wp), intent(inout) :: dydt(self%states)
    end subroutine law_interface

    !> Partial derivatives of f at the positions of `jacobian_pattern`, in the only row of dfdy.
    subroutine tangent_interface(self, y, dfdy)
      import :: classic_problem_t, wp
      class(classic_problem_t), intent(in) :: self
      real(wp), intent(in) :: y(self%states)
      real(wp), contiguous, intent(inout) :: dfdy(:, :)
    end subroutine tangent_interface

  end interface

contains

  !> Allocates the initial and final states of a problem, with all components compared.
  pure subroutine allocate_ends(problem, states)
    class(classic_problem_t), intent(inout) :: problem
    integer, intent(in) :: states
    integer :: i

    problem%states = states
    allocate (problem%y_start(states), problem%y_end(states), source=0.0_wp)
    allocate (problem%compared(states))
    do i = 1, states
      problem%compared(i) = i
    end do
  end subroutine allocate_ends

  !> Largest of |y - y_end| / (atol_ratio + |y_end|) over the compared components.
  pure function end_error(problem, y) result(error)
    class(classic_problem_t), intent(in) :: problem
    real(wp), intent(in) :: y(:)   !! [states]
    real(wp) :: error

    error = mixed_error(problem, y(problem%compared))
  end function end_error

  pure function mixed_error(problem, compared) result(error)
    class(classic_problem_t), intent(in) :: problem
    real(wp), intent(in) :: compared(:)   !! the compared components of a state
    real(wp) :: error

    error = maxval(abs(compared - problem%y_end) / (problem%atol_ratio + abs(problem%y_end)))
  end function mixed_error

  subroutine derivative(self, t, y, dydt, status)
    class(classic_problem_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    if (self%lanes /= 1) error stop 'nocdyn_classic_problem: a classic problem has one lane'
    if (any(abs(y) > most)) then
      status = evaluation_recoverable
    else
      call self%law(y, dydt)
    end if
  end subroutine derivative

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(classic_problem_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    if (self%lanes /= 1) error stop 'nocdyn_classic_problem: a classic problem has one lane'
    dfdt = 0.0_wp
    call self%tangent(y, dfdy)
  end subroutine jacobian

end module nocdyn_classic_problem
