!> Fourier coefficients of periodic functions.
module nocdyn_fourier
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: fourier_coefficients

contains

  !> The coefficients of f = mean + sum of sine_k sin(k x) + cosine_k cos(k x), k = 1, 2, ..., by the trapezoidal rule, which is
  !> exact if f has no harmonics from the number of samples minus the highest k on.
  pure subroutine fourier_coefficients(sample, mean, sine, cosine)
    real(wp), intent(in) :: sample(0:)                !! f at x = 2 pi i / samples
    real(wp), intent(out) :: mean
    real(wp), intent(out) :: sine(:), cosine(:)       !! of the harmonics 1, 2, ..., fewer than half of the samples
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    real(wp) :: wave_cosine(0:size(sample) - 1), wave_sine(0:size(sample) - 1)
    integer :: i, k, n

    n = size(sample)
    do i = 0, n - 1
      wave_sine(i) = sin(turn * i / n)
      wave_cosine(i) = cos(turn * i / n)
    end do
    mean = sum(sample) / n
    sine = 0.0_wp
    cosine = 0.0_wp
    do k = 1, size(sine)
      do i = 0, n - 1
        sine(k) = sine(k) + sample(i) * wave_sine(modulo(i * k, n))
        cosine(k) = cosine(k) + sample(i) * wave_cosine(modulo(i * k, n))
      end do
    end do
    sine = sine * (2.0_wp / n)
    cosine = cosine * (2.0_wp / n)
  end subroutine fourier_coefficients

end module nocdyn_fourier
