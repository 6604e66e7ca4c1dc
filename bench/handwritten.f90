!> handwritten RTOL ATOL REPETITIONS STATES_FILE
program handwritten
  use contest, only: number_argument, print_report, seconds_now, text_argument, whole_argument, write_states
  use handwritten_case2, only: outputs, trajectory, variant_of
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  real(wp) :: states(4, outputs), rtol, atol
  real(wp), allocatable :: seconds(:)
  integer :: steps, evaluations, i

  rtol = number_argument(1)
  atol = number_argument(2)
  allocate (seconds(whole_argument(3)))
  do i = 1, size(seconds)
    seconds(i) = seconds_now()
    call trajectory(variant_of(cubic_stiffness=10.0_wp, viscous=100.0_wp), rtol, atol, states, steps, evaluations)
    seconds(i) = seconds_now() - seconds(i)
  end do
  call write_states(text_argument(4), states)
  call print_report(seconds, steps, evaluations)
end program handwritten
