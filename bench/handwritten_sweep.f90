!> handwritten_sweep RTOL ATOL RESULTS_FILE PARAMETERS_FILE
!>
!> PARAMETERS_FILE holds c and k1 of each variant as native doubles, RESULTS_FILE gets omega_1, omega_2, phi_1, phi_2 at the
!> end and the largest |elastic moment| of each. As many threads as OMP_NUM_THREADS says.
program handwritten_sweep
  use contest, only: number_argument, numbers_of_file, print_report, seconds_now, text_argument, write_states
  use handwritten_case2, only: end_and_peak, variant_of
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  real(wp), allocatable :: parameters(:, :), results(:, :)
  real(wp) :: rtol, atol, seconds
  integer :: steps, evaluations, these_steps, these_evaluations, i

  rtol = number_argument(1)
  atol = number_argument(2)
  allocate (parameters, source=numbers_of_file(text_argument(4), 2))
  allocate (results(5, size(parameters, 2)))
  steps = 0
  evaluations = 0
  seconds = seconds_now()
  !$omp parallel do schedule(dynamic, 100) private(these_steps, these_evaluations) reduction(+:steps, evaluations)
  do i = 1, size(parameters, 2)
    call end_and_peak(variant_of(viscous=parameters(1, i), cubic_stiffness=parameters(2, i)), rtol, atol, &
                      results(1:4, i), results(5, i), these_steps, these_evaluations)
    steps = steps + these_steps
    evaluations = evaluations + these_evaluations
  end do
  !$omp end parallel do
  seconds = seconds_now() - seconds
  call write_states(text_argument(3), results)
  call print_report([seconds], steps, evaluations)
end program handwritten_sweep
