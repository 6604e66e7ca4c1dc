!> Classic oscillators of few components: van der Pol, Oregonator, Brusselator, and Lorenz's attractor.
module nocdyn_classic_oscillators
  use nocdyn_classic_problem, only: allocate_ends, classic_problem_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: van_der_pol_slow, van_der_pol_fast, oregonator_problem, brusselator_problem, lorenz_problem

  !> y1' = y2, y2' = damping (1 - y1^2) y2 - stiffness y1
  type, extends(classic_problem_t), public :: van_der_pol_t
    real(wp) :: damping, stiffness
  contains
    procedure :: law => van_der_pol_law
    procedure :: tangent => van_der_pol_tangent
  end type van_der_pol_t

  !> y1' = s (y2 + y1 (1 - q y1 - y2)), y2' = (y3 - (1 + y1) y2) / s, y3' = w (y1 - y3)
  type, extends(classic_problem_t), public :: oregonator_t
    real(wp) :: s = 77.27_wp, q = 8.375e-6_wp, w = 0.161_wp
  contains
    procedure :: law => oregonator_law
    procedure :: tangent => oregonator_tangent
  end type oregonator_t

  !> y1' = a + y1^2 y2 - (b + 1) y1, y2' = b y1 - y1^2 y2
  type, extends(classic_problem_t), public :: brusselator_t
    real(wp) :: a = 1.0_wp, b = 3.0_wp
  contains
    procedure :: law => brusselator_law
    procedure :: tangent => brusselator_tangent
  end type brusselator_t

  !> y1' = sigma (y2 - y1), y2' = r y1 - y2 - y1 y3, y3' = y1 y2 - b y3
  type, extends(classic_problem_t), public :: lorenz_t
    real(wp) :: sigma = 10.0_wp, r = 28.0_wp, b = 8.0_wp / 3.0_wp
  contains
    procedure :: law => lorenz_law
    procedure :: tangent => lorenz_tangent
  end type lorenz_t

contains

  !> y'' = mu (1 - y^2) y' - y with mu = 1e3, in the time of the slow oscillator.
  function van_der_pol_slow() result(problem)
    type(van_der_pol_t) :: problem

    call allocate_ends(problem, 2)
    problem%name = 'Van der Pol, mu = 1e3'
    problem%source = 'Mazzia and Magherini, Test Set for IVP Solvers 2.4, VDPOLM'
    problem%is_stiff = .true.
    problem%damping = 1.0e3_wp
    problem%stiffness = 1.0_wp
    problem%t_end = 2000.0_wp
    problem%rodas_steps = 568
    problem%rounding = 1.0e-12_wp
    problem%atol_ratio = 1.0e-3_wp
    problem%y_start = [2.0_wp, 0.0_wp]
    problem%published = [1.706167732170469_wp, -0.8928097010248125e-3_wp]
    problem%y_end = [1.70616773217046501_wp, -8.92809701024816548e-4_wp]
  end function van_der_pol_slow

  !> y'' = 1e6 ((1 - y^2) y' - y). With the time in units of mu = 1e3 it is the same oscillator, epsilon = 1 / mu^2.
  function van_der_pol_fast() result(problem)
    type(van_der_pol_t) :: problem

    call allocate_ends(problem, 2)
    problem%name = 'Van der Pol, 1/epsilon = 1e6'
    problem%source = 'Hairer and Wanner, test set of stiff ODEs, VDPOL'
    problem%is_stiff = .true.
    problem%damping = 1.0e6_wp
    problem%stiffness = 1.0e6_wp
    problem%t_end = 1.0_wp
    problem%rodas_steps = 295
    problem%rounding = 1.0e-12_wp
    problem%y_start = [2.0_wp, 0.0_wp]
    problem%published = [-1.863646254808130_wp, 0.7535430865435460_wp]
    problem%y_end = [-1.86364625480813389_wp, 0.753543086543543360_wp]
  end function van_der_pol_fast

  subroutine van_der_pol_law(self, y, dydt)
    class(van_der_pol_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)

    dydt(1) = y(2)
    dydt(2) = self%damping * (1 - y(1)**2) * y(2) - self%stiffness * y(1)
  end subroutine van_der_pol_law

  subroutine van_der_pol_tangent(self, y, dfdy)
    class(van_der_pol_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)

    dfdy(1, 1:2) = [0.0_wp, -2 * self%damping * y(1) * y(2) - self%stiffness]
    dfdy(1, 3:4) = [1.0_wp, self%damping * (1 - y(1)**2)]
  end subroutine van_der_pol_tangent

  !> Belousov and Zhabotinskii's reaction.
  function oregonator_problem() result(problem)
    type(oregonator_t) :: problem

    call allocate_ends(problem, 3)
    problem%name = 'Oregonator'
    problem%source = 'Mazzia and Magherini, Test Set for IVP Solvers 2.4, OREGO'
    problem%is_stiff = .true.
    problem%t_end = 360.0_wp
    problem%rodas_steps = 760
    problem%rounding = 1.0e-12_wp
    problem%published_error = 2.0e-13_wp
    problem%atol_ratio = 1.0e-6_wp
    problem%y_start = [1.0_wp, 2.0_wp, 3.0_wp]
    problem%published = [1.000814870318523_wp, 1228.178521549917_wp, 132.0554942846706_wp]
    problem%y_end = [1.00081487031852272_wp, 1228.17852154988743_wp, 132.055494284650455_wp]
  end function oregonator_problem

  subroutine oregonator_law(self, y, dydt)
    class(oregonator_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)

    dydt(1) = self%s * (y(2) + y(1) * (1 - self%q * y(1) - y(2)))
    dydt(2) = (y(3) - (1 + y(1)) * y(2)) / self%s
    dydt(3) = self%w * (y(1) - y(3))
  end subroutine oregonator_law

  subroutine oregonator_tangent(self, y, dfdy)
    class(oregonator_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)

    dfdy(1, 1:3) = [self%s * (1 - 2 * self%q * y(1) - y(2)), -y(2) / self%s, self%w]
    dfdy(1, 4:6) = [self%s * (1 - y(1)), -(1 + y(1)) / self%s, 0.0_wp]
    dfdy(1, 7:9) = [0.0_wp, 1 / self%s, -self%w]
  end subroutine oregonator_tangent

  !> The Brusselator without diffusion.
  function brusselator_problem() result(problem)
    type(brusselator_t) :: problem

    call allocate_ends(problem, 2)
    problem%name = 'Brusselator'
    problem%source = 'Hairer, Norsett and Wanner, Solving ODEs I; end as Mathematica''s NDSolve has it to 32 digits'
    problem%t_end = 20.0_wp
    problem%rodas_steps = 187
    problem%error_factor = 20.0_wp
    problem%y_start = [1.5_wp, 3.0_wp]
    problem%published = [0.4986370712683478291402659846476_wp, 4.596780349452011024598321237263_wp]
    problem%y_end = [0.498637071268347849_wp, 4.59678034945201118_wp]
  end function brusselator_problem

  subroutine brusselator_law(self, y, dydt)
    class(brusselator_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)

    dydt(1) = self%a + y(1)**2 * y(2) - (self%b + 1) * y(1)
    dydt(2) = self%b * y(1) - y(1)**2 * y(2)
  end subroutine brusselator_law

  subroutine brusselator_tangent(self, y, dfdy)
    class(brusselator_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)

    dfdy(1, 1:2) = [2 * y(1) * y(2) - self%b - 1, self%b - 2 * y(1) * y(2)]
    dfdy(1, 3:4) = [y(1)**2, -y(1)**2]
  end subroutine brusselator_tangent

  !> A short part of the chaotic trajectory.
  function lorenz_problem() result(problem)
    type(lorenz_t) :: problem

    call allocate_ends(problem, 3)
    problem%name = 'Lorenz'
    problem%source = 'Lorenz 1963, sigma = 10, r = 28, b = 8/3; end computed'
    problem%t_end = 5.0_wp
    problem%rodas_steps = 333
    problem%error_factor = 1000.0_wp
    problem%rounding = 1.0e-12_wp
    problem%y_start = [-8.0_wp, 8.0_wp, 27.0_wp]
    problem%y_end = [12.5336267392778136_wp, 6.84913379236251409_wp, 37.5298740876345202_wp]
  end function lorenz_problem

  subroutine lorenz_law(self, y, dydt)
    class(lorenz_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)

    dydt(1) = self%sigma * (y(2) - y(1))
    dydt(2) = self%r * y(1) - y(2) - y(1) * y(3)
    dydt(3) = y(1) * y(2) - self%b * y(3)
  end subroutine lorenz_law

  subroutine lorenz_tangent(self, y, dfdy)
    class(lorenz_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)

    dfdy(1, 1:3) = [-self%sigma, self%r - y(3), y(2)]
    dfdy(1, 4:6) = [self%sigma, -1.0_wp, y(1)]
    dfdy(1, 7:9) = [0.0_wp, -y(1), -self%b]
  end subroutine lorenz_tangent

end module nocdyn_classic_oscillators
