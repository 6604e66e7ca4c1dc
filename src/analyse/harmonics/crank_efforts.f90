!> The harmonics of a torque that is a table over the angle of a crank, as makers of engines and compressors give it: the crank
!> effort. Evenly spaced points have the harmonics of the trigonometric polynomial through them, which are the ones of the torque
!> if it has none above. Between other points lies a monotone cubic.
module nocdyn_crank_efforts
  use nocdyn_fourier, only: fourier_coefficients
  use nocdyn_kinds, only: wp
  use nocdyn_slider_cranks, only: sample_cycle, samples
  implicit none (type, external)
  private

  public :: effort_harmonics, known_harmonics, sampled_effort

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)

contains

  !> Whether the points divide a cycle evenly, but for rounded angles.
  pure logical function is_even(cycle, theta)
    real(wp), intent(in) :: cycle      !! [rad]
    real(wp), intent(in) :: theta(:)   !! points of less than a cycle, ascending [rad]
    real(wp), parameter :: rounded = 1.0e-3_wp   ! of a step: angles with three decimals
    integer :: i

    associate (step => cycle / size(theta))
      is_even = all(abs(theta - theta(1) - [(step * (i - 1), i=1, size(theta))]) <= rounded * step)
    end associate
  end function is_even

  !> How many harmonics of a cycle the points give.
  pure integer function known_harmonics(cycle, theta) result(count)
    real(wp), intent(in) :: cycle, theta(:)   !! as of `is_even`

    count = (merge(size(theta), samples, is_even(cycle, theta)) - 1) / 2
  end function known_harmonics

  !> Mean and harmonics of the torque, sums of sine_k sin(k x) + cosine_k cos(k x), x = 2 pi theta / cycle.
  subroutine effort_harmonics(cycle, theta, torque, mean, sine, cosine)
    real(wp), intent(in) :: cycle, theta(:)       !! as of `is_even`
    real(wp), intent(in) :: torque(:)             !! at the points [N m]
    real(wp), intent(out) :: mean                 !! [N m]
    real(wp), intent(out) :: sine(:), cosine(:)   !! [N m], [harmonics], at most `known_harmonics`
    complex(wp) :: wave
    integer :: k

    if (.not. is_even(cycle, theta)) then
      call fourier_coefficients(sample_cycle(cycle, theta, torque), mean, sine, cosine)
      return
    end if
    call fourier_coefficients(torque, mean, sine, cosine)
    do k = 1, size(sine)
      ! the points begin at theta(1)
      wave = cmplx(cosine(k), -sine(k), wp) * exp(cmplx(0.0_wp, -k * turn * theta(1) / cycle, wp))
      cosine(k) = real(wave)
      sine(k) = -aimag(wave)
    end do
  end subroutine effort_harmonics

  !> The torque at equal distances over a cycle from the angle 0 on, with all harmonics that the points give [N m].
  function sampled_effort(cycle, theta, torque) result(sampled)
    real(wp), intent(in) :: cycle, theta(:), torque(:)   !! as of `effort_harmonics`
    real(wp) :: sampled(0:samples - 1)
    complex(wp) :: unit
    real(wp) :: cosine(known_harmonics(cycle, theta)), mean, sine(size(cosine))
    integer :: i, k

    if (.not. is_even(cycle, theta)) then
      sampled = sample_cycle(cycle, theta, torque)
      return
    end if
    call effort_harmonics(cycle, theta, torque, mean, sine, cosine)
    do i = 0, samples - 1
      unit = exp(cmplx(0.0_wp, turn * i / samples, wp))
      sampled(i) = mean
      do k = size(sine), 1, -1
        sampled(i) = sampled(i) + real(cmplx(cosine(k), -sine(k), wp) * unit**k)
      end do
    end do
  end function sampled_effort

end module nocdyn_crank_efforts
