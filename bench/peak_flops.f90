!> Additions and multiplications in a second, of a loop in registers that does nothing else and no fused ones: what the
!> processor could do for code that is compiled with -ffp-contract=off.
program peak_flops
  use contest, only: seconds_now
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  integer, parameter :: chains = 64, rounds = 2000000, repetitions = 5
  real(wp) :: x(chains), seconds, best
  integer :: i

  best = huge(best)
  do i = 1, repetitions
    call random_number(x)
    seconds = seconds_now()
    call work(x)
    best = min(best, seconds_now() - seconds)
  end do
  if (any(x < 0)) error stop 'peak_flops: the compiler must not know what comes out'
  print '(a, es13.6, a)', '{"flops": ', 2.0_wp * chains * rounds / best, '}'

contains

  subroutine work(x)
    real(wp), intent(inout) :: x(chains)
    real(wp) :: mine(chains)
    integer :: i

    mine = x
    do i = 1, rounds
      mine = mine * 0.999999_wp + 1.0e-6_wp
    end do
    x = mine
  end subroutine work

end program peak_flops
