!> A satellite between earth and moon, in coordinates that turn with them: position y(1:2), velocity y(3:4).
module satellite
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t
  use nocdyn_law_operators, only: operator(*), operator(**), operator(+), operator(-), operator(/)
  implicit none (type, external)
  private

  public :: equations

contains

  !> The mass of the moon is p(1), that of the earth 1 - p(1).
  subroutine equations(t, y, p, dydt)
    type(expression_t), intent(in) :: t
    type(expression_t), intent(in) :: y(:)
    type(expression_t), intent(in) :: p(:)
    type(expression_t), intent(inout) :: dydt(:)
    type(expression_t) :: moon, earth, to_earth, to_moon

    moon = p(1)
    earth = 1 - p(1)
    to_earth = ((y(1) + moon)**2 + y(2)**2)**1.5_wp
    to_moon = ((y(1) - earth)**2 + y(2)**2)**1.5_wp
    dydt(1) = y(3)
    dydt(2) = y(4)
    dydt(3) = y(1) + 2 * y(4) - earth * (y(1) + moon) / to_earth - moon * (y(1) - earth) / to_moon
    dydt(4) = y(2) - 2 * y(3) - earth * y(2) / to_earth - moon * y(2) / to_moon
  end subroutine equations

end module satellite

!> Prints Arenstorf's orbit at thirds of its period, and whether it ends where it began.
program arenstorf
  use nocdyn_errors, only: error_t
  use nocdyn_formula_system, only: formula_system, formula_system_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_solve, only: solve
  use satellite, only: equations
  implicit none (type, external)
  real(wp), parameter :: period = 17.0652165601579626_wp
  real(wp), parameter :: times(4) = [0.0_wp, period / 3, 2 * period / 3, period]
  type(formula_system_t) :: system
  type(error_t), allocatable :: error
  real(wp) :: y(4, 4)
  integer :: i

  system = formula_system(4, equations, parameters=[0.012277471_wp])
  y(:, 1) = [0.994_wp, 0.0_wp, 0.0_wp, -2.00158510637908252_wp]
  call solve(system, times, integration_settings_t(method='taylor', rtol=1.0e-14_wp, atol=1.0e-14_wp), y, error)
  if (allocated(error)) error stop error%message
  print '(f8.4, 4f11.6)', (times(i), y(:, i), i=1, 3)
  print '("ends where it began, but for 1e-9: ", l1)', maxval(abs(y(:2, 4) - y(:2, 1))) < 1.0e-9_wp
end program arenstorf
