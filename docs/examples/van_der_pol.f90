module van_der_pol_equation
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private
  public :: f

contains
  subroutine f(t, y, dydt)
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)
    real(wp), intent(out) :: dydt(:)

    dydt(1) = y(2)
    dydt(2) = ((1 - y(1)**2) * y(2) - y(1)) / 1.0e-6_wp
  end subroutine f
end module van_der_pol_equation

program van_der_pol
  use nocdyn_errors, only: error_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_plain_system, only: plain_system, plain_system_t
  use nocdyn_solve, only: solve
  use van_der_pol_equation, only: f
  implicit none (type, external)
  type(plain_system_t) :: system
  type(error_t), allocatable :: error
  real(wp), parameter :: times(5) = [0.0_wp, 0.5_wp, 1.0_wp, 1.5_wp, 2.0_wp]
  real(wp) :: y(2, 5)
  integer :: i

  system = plain_system(2, f)
  y(:, 1) = [2.0_wp, 0.0_wp]
  call solve(system, times, integration_settings_t(method='rodas5p', rtol=1.0e-8_wp, atol=1.0e-8_wp), y, error)
  if (allocated(error)) error stop error%message
  print '(f4.1, 2f12.6)', (times(i), y(:, i), i=1, 5)
end program van_der_pol
