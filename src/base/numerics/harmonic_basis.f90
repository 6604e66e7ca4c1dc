!> Truncated Fourier series at evenly spaced samples of one period, and the matrices of their products.
!>
!> A series has the coefficients [a_0, a_1, b_1, ..., a_H, b_H] of a_0 + sum a_k cos(k tau) + b_k sin(k tau). Projection and
!> evaluation are exact for each other, and so are products with samples, projected again: alternating frequency and time, as in
!> T. Detroux, L. Renson, L. Masset, G. Kerschen, The harmonic balance method for bifurcation analysis of large-scale nonlinear
!> mechanical systems, arXiv:1604.05621.
module nocdyn_harmonic_basis
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_harmonic_basis, differentiated, padded_series, product_matrix

  type, public :: harmonic_basis_t
    integer :: harmonics = 0                      !! H
    integer :: samples = 0
    integer :: length = 1                         !! 2 H + 1
    real(wp), allocatable :: values(:, :)         !! of the functions at the samples, [samples, length]
    real(wp), allocatable :: projection(:, :)     !! from samples to coefficients, [length, samples]
    real(wp), allocatable :: wide(:, :)           !! the same up to harmonic 2 H, [4 H + 1, samples]
  end type harmonic_basis_t

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]

contains

  !> The functions and projections for series up to a harmonic.
  type(harmonic_basis_t) function new_harmonic_basis(harmonics, samples) result(self)
    integer, intent(in) :: harmonics
    integer, intent(in) :: samples     !! more than 4 `harmonics`

    if (samples <= 4 * harmonics) error stop 'nocdyn_harmonic_basis: products need more than 4 samples for each harmonic'
    self%harmonics = harmonics
    self%samples = samples
    self%length = 2 * harmonics + 1
    allocate (self%values, source=functions_at(harmonics, samples))
    allocate (self%wide, source=transpose(functions_at(2 * harmonics, samples)) * (2.0_wp / samples))
    self%wide(1, :) = 0.5_wp * self%wide(1, :)
    allocate (self%projection, source=self%wide(:self%length, :))
  end function new_harmonic_basis

  !> The functions 1, cos(tau), sin(tau), ... at the samples.
  pure function functions_at(harmonics, samples) result(values)
    integer, intent(in) :: harmonics, samples
    real(wp) :: values(samples, 2 * harmonics + 1)
    real(wp) :: cosine(0:samples - 1), sine(0:samples - 1)
    integer :: i, k

    do i = 0, samples - 1
      cosine(i) = cos(turn * i / samples)
      sine(i) = sin(turn * i / samples)
    end do
    values(:, 1) = 1.0_wp
    do k = 1, harmonics
      do i = 0, samples - 1
        values(i + 1, 2 * k) = cosine(modulo(k * i, samples))
        values(i + 1, 2 * k + 1) = sine(modulo(k * i, samples))
      end do
    end do
  end function functions_at

  !> Coefficients of the derivatives by tau.
  pure function differentiated(series) result(rate)
    real(wp), intent(in) :: series(:, :)   !! [length, series]
    real(wp) :: rate(size(series, 1), size(series, 2))
    integer :: k

    rate(1, :) = 0.0_wp
    do k = 1, size(series, 1) / 2
      rate(2 * k, :) = k * series(2 * k + 1, :)
      rate(2 * k + 1, :) = -k * series(2 * k, :)
    end do
  end function differentiated

  !> Series with another number of harmonics: zeros are added, or the last ones dropped.
  pure function padded_series(series, length) result(other)
    real(wp), intent(in) :: series(:, :)   !! [former length, series]
    integer, intent(in) :: length
    real(wp) :: other(length, size(series, 2))
    integer :: kept

    kept = min(length, size(series, 1))
    other = 0.0_wp
    other(:kept, :) = series(:kept, :)
  end function padded_series

  !> The matrix that takes the coefficients of a series u to those of the product g u, up to harmonic H.
  pure subroutine product_matrix(harmonics, g, matrix)
    integer, intent(in) :: harmonics         !! H
    real(wp), intent(in) :: g(:)             !! coefficients of the factor, [4 H + 1]
    real(wp), intent(out) :: matrix(:, :)    !! [2 H + 1, 2 H + 1]
    real(wp) :: c(-2 * harmonics:2 * harmonics), s(-2 * harmonics:2 * harmonics)
    integer :: j, k

    c(0) = 2 * g(1)
    s(0) = 0.0_wp
    do k = 1, 2 * harmonics
      c(k) = g(2 * k)
      c(-k) = g(2 * k)
      s(k) = g(2 * k + 1)
      s(-k) = -g(2 * k + 1)
    end do
    matrix(1, 1) = g(1)
    matrix(2:, 1) = g(2:2 * harmonics + 1)
    do j = 1, harmonics
      matrix(1, 2 * j) = 0.5_wp * c(j)
      matrix(1, 2 * j + 1) = 0.5_wp * s(j)
      do k = 1, harmonics
        matrix(2 * k, 2 * j) = 0.5_wp * (c(k - j) + c(k + j))
        matrix(2 * k + 1, 2 * j) = 0.5_wp * (s(k - j) + s(k + j))
        matrix(2 * k, 2 * j + 1) = 0.5_wp * (s(k + j) - s(k - j))
        matrix(2 * k + 1, 2 * j + 1) = 0.5_wp * (c(k - j) - c(k + j))
      end do
    end do
  end subroutine product_matrix

end module nocdyn_harmonic_basis
