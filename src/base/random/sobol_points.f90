!> Sobol points, which fill the unit cube far more evenly than random points.
!>
!> The direction numbers are by S. Joe, F. Y. Kuo, Constructing Sobol sequences with better two-dimensional projections,
!> SIAM J. Sci. Comput. 30 (2008) 2635-2654: the first dimensions of their file new-joe-kuo-6.21201 (LICENSE-sobol-points).
!>
!> The points are in the order of the Gray code (I. A. Antonov, V. M. Saleev, USSR Comput. Math. Math. Phys. 19 (1979) 252-256),
!> as in the authors' program and in SciPy's unscrambled `qmc.Sobol`, so that they can be compared one by one.
!> Point k is the exclusive-or of the direction numbers of the bits of k + k / 2 without carry; the first 2^m points are
!> a permutation of the first 2^m in natural order.
module nocdyn_sobol_points
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  use nocdyn_random_numbers, only: random_words, stream_shifts, word_bits
  implicit none (type, external)
  private

  public :: sobol_points

  integer, parameter, public :: max_dimensions = 64

  ! From the second dimension on. Bit i of a polynomial is its coefficient of x^i, first and last included: 2^s + 2 a + 1 of
  ! the columns s and a of the file. Each has as many initial numbers m as its degree.
  integer, parameter :: polynomials(max_dimensions - 1) = [3, 7, 11, 13, 19, 25, 37, 41, 47, 55, 59, 61, 67, 91, 97, 103, 109, &
    115, 131, 137, 143, 145, 157, 167, 171, 185, 191, 193, 203, 211, 213, 229, 239, 241, 247, 253, 285, 299, 301, 333, 351, 355, &
    357, 361, 369, 391, 397, 425, 451, 463, 487, 501, 529, 539, 545, 557, 563, 601, 607, 617, 623, 631, 637]
  integer, parameter :: initial_numbers(436) = [1, 1, 3, 1, 3, 1, 1, 1, 1, 1, 1, 3, 3, 1, 3, 5, 13, 1, 1, 5, 5, 17, 1, 1, 5, 5, &
    5, 1, 1, 7, 11, 19, 1, 1, 5, 1, 1, 1, 1, 1, 3, 11, 1, 3, 5, 5, 31, 1, 3, 3, 9, 7, 49, 1, 1, 1, 15, 21, 21, 1, 3, 1, 13, 27, &
    49, 1, 1, 1, 15, 7, 5, 1, 3, 1, 15, 13, 25, 1, 1, 5, 5, 19, 61, 1, 3, 7, 11, 23, 15, 103, 1, 3, 7, 13, 13, 15, 69, 1, 1, 3, &
    13, 7, 35, 63, 1, 3, 5, 9, 1, 25, 53, 1, 3, 1, 13, 9, 35, 107, 1, 3, 1, 5, 27, 61, 31, 1, 1, 5, 11, 19, 41, 61, 1, 3, 5, 3, &
    3, 13, 69, 1, 1, 7, 13, 1, 19, 1, 1, 3, 7, 5, 13, 19, 59, 1, 1, 3, 9, 25, 29, 41, 1, 3, 5, 13, 23, 1, 55, 1, 3, 7, 3, 13, &
    59, 17, 1, 3, 1, 3, 5, 53, 69, 1, 1, 5, 5, 23, 33, 13, 1, 1, 7, 7, 1, 61, 123, 1, 1, 7, 9, 13, 61, 49, 1, 3, 3, 5, 3, 55, &
    33, 1, 3, 1, 15, 31, 13, 49, 245, 1, 3, 5, 15, 31, 59, 63, 97, 1, 3, 1, 11, 11, 11, 77, 249, 1, 3, 1, 11, 27, 43, 71, 9, 1, &
    1, 7, 15, 21, 11, 81, 45, 1, 3, 7, 3, 25, 31, 65, 79, 1, 3, 1, 1, 19, 11, 3, 205, 1, 1, 5, 9, 19, 21, 29, 157, 1, 3, 7, 11, &
    1, 33, 89, 185, 1, 3, 3, 3, 15, 9, 79, 71, 1, 3, 7, 11, 15, 39, 119, 27, 1, 1, 3, 1, 11, 31, 97, 225, 1, 1, 1, 3, 23, 43, &
    57, 177, 1, 3, 7, 7, 17, 17, 37, 71, 1, 3, 1, 5, 27, 63, 123, 213, 1, 1, 3, 5, 11, 43, 53, 133, 1, 3, 5, 5, 29, 17, 47, 173, &
    479, 1, 3, 3, 11, 3, 1, 109, 9, 69, 1, 1, 1, 5, 17, 39, 23, 5, 343, 1, 3, 1, 5, 25, 15, 31, 103, 499, 1, 1, 1, 11, 11, 17, &
    63, 105, 183, 1, 1, 5, 11, 9, 29, 97, 231, 363, 1, 1, 5, 15, 19, 45, 41, 7, 383, 1, 3, 7, 7, 31, 19, 83, 137, 221, 1, 1, 1, &
    3, 23, 15, 111, 223, 83, 1, 1, 5, 13, 31, 15, 55, 25, 161, 1, 1, 3, 13, 25, 47, 39, 87, 257]

  type, public :: sobol_points_t
    private
    integer(int64), allocatable :: directions(:, :)   !! [word_bits, dimensions]
    integer(int64), allocatable :: shift(:)           !! [dimensions]
  contains
    procedure :: coordinate, coordinate_bits
  end type sobol_points_t

contains

  !> The points as published for seed 0. Another seed shifts all by the exclusive-or with one random word a dimension: what
  !> makes them even stays, and the averages over several seeds tell the error of one.
  pure function sobol_points(dimensions, seed) result(points)
    integer, intent(in) :: dimensions   !! at most `max_dimensions`
    integer, intent(in) :: seed         !! at least 0
    type(sobol_points_t) :: points
    integer(int64) :: words(4)
    integer :: i, used

    if (dimensions > max_dimensions) error stop 'nocdyn_sobol_points: there are no direction numbers for so many dimensions'
    allocate (points%directions(word_bits, dimensions), points%shift(dimensions))
    points%shift = 0
    used = 0
    do i = 1, dimensions
      call find_directions(i, used, points%directions(:, i))
      if (seed == 0) cycle
      words = random_words(seed, stream_shifts, i, 0)
      points%shift(i) = words(1)
    end do
  end function sobol_points

  !> The direction numbers of one dimension: the given ones, then the recurrence of its polynomial.
  pure subroutine find_directions(dimension, used, directions)
    integer, intent(in) :: dimension
    integer, intent(inout) :: used   !! of `initial_numbers`, by the dimensions before
    integer(int64), intent(out) :: directions(word_bits)
    integer :: degree, i, k, polynomial

    if (dimension == 1) then
      directions = [(shiftl(1_int64, word_bits - i), i=1, word_bits)]
      return
    end if
    polynomial = polynomials(dimension - 1)
    degree = bit_size(polynomial) - 1 - leadz(polynomial)
    do i = 1, degree
      directions(i) = shiftl(int(initial_numbers(used + i), int64), word_bits - i)
    end do
    used = used + degree
    do i = degree + 1, word_bits
      directions(i) = ieor(directions(i - degree), shiftr(directions(i - degree), degree))
      do k = 1, degree - 1
        if (btest(polynomial, degree - k)) directions(i) = ieor(directions(i), directions(i - k))
      end do
    end do
  end subroutine find_directions

  !> A coordinate as a number for quantiles: the middle of its interval of length 2^-32, hence never 0 or 1.
  pure real(wp) function coordinate(self, k, dimension)
    class(sobol_points_t), intent(in) :: self
    integer, intent(in) :: k           !! number of the point, at least 0
    integer, intent(in) :: dimension

    coordinate = (real(self%coordinate_bits(k, dimension), wp) + 0.5_wp) * 2.0_wp**(-word_bits)
  end function coordinate

  !> The published coordinate times 2^32, shifted.
  pure integer(int64) function coordinate_bits(self, k, dimension) result(bits)
    class(sobol_points_t), intent(in) :: self
    integer, intent(in) :: k, dimension   !! as for `coordinate`
    integer :: gray_code, i

    bits = self%shift(dimension)
    gray_code = ieor(k, shiftr(k, 1))
    do while (gray_code /= 0)
      i = trailz(gray_code)
      bits = ieor(bits, self%directions(i + 1, dimension))
      gray_code = ibclr(gray_code, i)
    end do
  end function coordinate_bits

end module nocdyn_sobol_points
