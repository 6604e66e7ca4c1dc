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

  !> Functions over a quarter of the period, up to harmonic 2 H.
  type :: quarter_t
    real(wp), allocatable :: functions(:, :)      !! [0:samples / 4, functions]
    real(wp), allocatable :: transposed(:, :)     !! [functions, 0:samples / 4]
  end type quarter_t

  !> Cosines and sines are stored over a quarter of the period: with their signs they are those of the whole one. Even and odd
  !> harmonics are apart: 1, cos 2 tau, cos 4 tau, ...; sin 2 tau, ...; cos tau, cos 3 tau, ...; sin tau, ...
  type, public :: harmonic_basis_t
    integer :: harmonics = 0                      !! H
    integer :: samples = 0                        !! a multiple of 4
    integer :: length = 1                         !! 2 H + 1
    type(quarter_t), private :: parts(4)
  contains
    procedure :: values_of, coefficients_of
  end type harmonic_basis_t

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]

contains

  !> The functions for series up to a harmonic.
  type(harmonic_basis_t) function new_harmonic_basis(harmonics, samples) result(self)
    integer, intent(in) :: harmonics
    integer, intent(in) :: samples     !! more than 4 `harmonics`, a multiple of 4
    real(wp) :: cosine(0:samples - 1), sine(0:samples - 1)
    integer :: i, k

    if (samples <= 4 * harmonics) error stop 'nocdyn_harmonic_basis: products need more than 4 samples for each harmonic'
    if (modulo(samples, 4) > 0) error stop 'nocdyn_harmonic_basis: the samples are no multiple of 4'
    self%harmonics = harmonics
    self%samples = samples
    self%length = 2 * harmonics + 1
    do i = 0, samples - 1
      cosine(i) = cos(turn * i / samples)
      sine(i) = sin(turn * i / samples)
    end do
    do k = 1, 4
      allocate (self%parts(k)%functions(0:samples / 4, harmonics), self%parts(k)%transposed(harmonics, 0:samples / 4))
    end do
    do k = 1, harmonics
      do i = 0, samples / 4
        self%parts(1)%functions(i, k) = cosine(modulo(2 * k * i, samples))
        self%parts(2)%functions(i, k) = sine(modulo(2 * k * i, samples))
        self%parts(3)%functions(i, k) = cosine(modulo((2 * k - 1) * i, samples))
        self%parts(4)%functions(i, k) = sine(modulo((2 * k - 1) * i, samples))
      end do
    end do
    do k = 1, 4
      self%parts(k)%transposed(:, :) = transpose(self%parts(k)%functions)
    end do
  end function new_harmonic_basis

  !> Series at the samples.
  pure function values_of(self, series) result(values)
    class(harmonic_basis_t), intent(in) :: self
    real(wp), intent(in) :: series(:, :)   !! [no more than 4 H + 1, columns]
    real(wp) :: values(self%samples, size(series, 2))
    real(wp) :: parts(0:self%samples / 4, size(series, 2), 4)
    real(wp) :: even, even_sine, odd, odd_sine
    integer :: c, i, k

    do k = 1, 4
      parts(:, :, k) = quarter_of(self%parts(k)%functions, series(first_of(k)::4, :))
    end do
    associate (n => self%samples)
      do c = 1, size(series, 2)
        do i = 0, n / 4
          even = series(1, c) + parts(i, c, 1)
          even_sine = parts(i, c, 2)
          odd = parts(i, c, 3)
          odd_sine = parts(i, c, 4)
          values(1 + modulo(n - i, n), c) = (even + odd) - (even_sine + odd_sine)
          values(1 + i, c) = (even + odd) + (even_sine + odd_sine)
          values(1 + n / 2 - i, c) = (even - odd) - (even_sine - odd_sine)
          values(1 + n / 2 + i, c) = (even - odd) + (even_sine - odd_sine)
        end do
      end do
    end associate
  end function values_of

  !> The place of the first function of a part in a series.
  pure integer function first_of(part)
    integer, intent(in) :: part
    integer, parameter :: places(4) = [4, 5, 2, 3]

    first_of = places(part)
  end function first_of

  !> The sum of functions times coefficients. The temporary array is what makes the product a fast one.
  pure function quarter_of(functions, coefficients) result(values)
    real(wp), intent(in) :: functions(:, :)      !! [samples, functions]
    real(wp), intent(in) :: coefficients(:, :)   !! [no more functions, columns]
    real(wp) :: values(size(functions, 1), size(coefficients, 2))
    real(wp) :: packed(size(coefficients, 1), size(coefficients, 2))

    packed = coefficients
    values = matmul(functions(:, :size(packed, 1)), packed)
  end function quarter_of

  !> The coefficients of samples up to a harmonic.
  pure function coefficients_of(self, values, harmonics) result(series)
    class(harmonic_basis_t), intent(in) :: self
    real(wp), intent(in) :: values(:, :)   !! [samples, columns]
    integer, intent(in) :: harmonics       !! no more than 2 H
    real(wp) :: series(2 * harmonics + 1, size(values, 2))
    real(wp) :: parts(0:self%samples / 4, size(values, 2), 4)
    real(wp) :: products(self%harmonics, size(values, 2))   ! in an array of its own, which makes them fast
    integer :: c, i, k

    associate (n => self%samples)
      do c = 1, size(values, 2)
        do i = 1, n / 4 - 1
          associate (first => values(1 + i, c), second => values(1 + n / 2 - i, c), third => values(1 + n / 2 + i, c), &
                     fourth => values(1 + n - i, c))
            parts(i, c, 1) = (first + fourth) + (second + third)
            parts(i, c, 2) = (first - fourth) - (second - third)
            parts(i, c, 3) = (first + fourth) - (second + third)
            parts(i, c, 4) = (first - fourth) + (second - third)
          end associate
        end do
        parts(0, c, :) = [values(1, c) + values(1 + n / 2, c), 0.0_wp, values(1, c) - values(1 + n / 2, c), 0.0_wp]
        associate (first => values(1 + n / 4, c), third => values(1 + 3 * n / 4, c))
          parts(n / 4, c, :) = [first + third, 0.0_wp, 0.0_wp, first - third]
        end associate
        series(1, c) = sum(parts(:, c, 1)) / n
      end do
      do k = 1, 4
        products = matmul(self%parts(k)%transposed, parts(:, :, k))
        associate (last => size(series(first_of(k)::4, 1)))
          series(first_of(k)::4, :) = (2.0_wp / n) * products(:last, :)
        end associate
      end do
    end associate
  end function coefficients_of

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
