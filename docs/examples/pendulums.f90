!> Periods of 179 pendulums, integrated by a block of eight lanes, beside their exact values.
program pendulums
  use nocdyn_errors, only: error_t
  use nocdyn_integration, only: integrate_ensemble
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: solver_status_t
  use pendulum, only: pendulum_block, pendulum_t
  use swings, only: swing_queue, swing_queue_t, swing_watcher, swing_watcher_t
  implicit none (type, external)
  integer, parameter :: lanes = 8, variants = 179
  real(wp), parameter :: pi = acos(-1.0_wp), gravity = 9.81_wp
  type(pendulum_t) :: system
  type(swing_watcher_t), target :: watcher
  type(swing_queue_t) :: ensemble
  type(integration_settings_t) :: settings
  type(solver_status_t) :: solver_status
  type(error_t), allocatable :: error
  real(wp) :: amplitude(variants), length(variants), exact(variants)
  integer :: i

  amplitude = [(i * pi / 180, i=1, variants)]
  length = [(0.5_wp * (1 + mod(i, 4)), i=1, variants)]
  settings%method = 'rk853'
  settings%rtol = 1.0e-10_wp
  settings%atol = 1.0e-12_wp
  system = pendulum_block(lanes)
  watcher = swing_watcher(lanes)
  ensemble = swing_queue(amplitude, sqrt(gravity / length), lanes, watcher)
  call integrate_ensemble(system, settings, [0.0_wp, 100.0_wp], ensemble, watcher, solver_status, error)
  if (allocated(error)) error stop error%message

  exact = [(2 * pi * sqrt(length(i) / gravity) / mean(1.0_wp, cos(0.5_wp * amplitude(i))), i=1, variants)]
  print '(a)', 'degrees  period [s]   exact [s]  speed [rad/s]  exact [rad/s]  integral [rad2/s]'
  do i = 30, variants, 30
    print '(i7, 2f12.6, 2f15.6, f19.6)', i, ensemble%period(i), exact(i), ensemble%highest_speed(i), &
      2 * sqrt(gravity / length(i)) * sin(0.5_wp * amplitude(i)), ensemble%integral(i)
  end do
  print '(i0, a)', count(abs(ensemble%period / exact - 1) < 1.0e-7_wp), ' of 179 periods are exact but for 1e-7 of their length'

contains

  !> Arithmetic-geometric mean.
  pure real(wp) function mean(a, b)
    real(wp), intent(in) :: a, b
    real(wp) :: geometric
    integer :: step

    mean = a
    geometric = b
    do step = 1, 10
      mean = 0.5_wp * (mean + geometric)
      geometric = sqrt(geometric * (2 * mean - geometric))
    end do
  end function mean

end program pendulums
