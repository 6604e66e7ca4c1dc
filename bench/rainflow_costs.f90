!> Seconds for counting the cycles of random turning points, with their damage.
program rainflow_costs
  use contest, only: seconds_now
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_kinds, only: wp
  use nocdyn_sn_curves, only: new_sn_curve
  implicit none (type, external)

  integer, parameter :: points = 1000000, repetitions = 5
  type(damage_counter_t) :: counter
  real(wp) :: best, seconds
  real(wp), allocatable :: x(:)
  integer :: i, repetition

  allocate (x(points))
  call random_number(x)
  x(::2) = -x(::2)   ! each value is a turning point
  counter%curve = new_sn_curve([1.0e6_wp], [1.0_wp], 5.0_wp, 5.0_wp)
  best = huge(best)
  do repetition = 1, repetitions
    seconds = seconds_now()
    call counter%start()
    do i = 1, points
      call counter%add(x(i))
    end do
    call counter%finish()
    best = min(best, seconds_now() - seconds)
    if (.not. counter%damage > 0) error stop 'rainflow_costs: random points do some damage'
  end do
  print '(a, i0, a, es13.6, a)', '{"points": ', points, ', "seconds": ', best, '}'
end program rainflow_costs
