!> How an element between two bodies enters the vectors and matrices of the machine; body 0 is the ground.
module nocdyn_incidence
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: add_moment, add_coefficient, add_coefficients

contains

  !> A moment on `to` and its opposite on `from`; the ground takes what it gets.
  pure subroutine add_moment(from, to, moment, vector)
    integer, intent(in) :: from, to
    real(wp), intent(in) :: moment
    real(wp), intent(inout) :: vector(:)

    if (to > 0) vector(to) = vector(to) + moment
    if (from > 0) vector(from) = vector(from) - moment
  end subroutine add_moment

  !> The pattern of eq. (21): -k on the diagonal, k beside it.
  pure subroutine add_coefficient(from, to, coefficient, matrix)
    integer, intent(in) :: from, to
    real(wp), intent(in) :: coefficient
    real(wp), intent(inout) :: matrix(:, :)

    if (to > 0) matrix(to, to) = matrix(to, to) - coefficient
    if (from > 0) matrix(from, from) = matrix(from, from) - coefficient
    if (to > 0 .and. from > 0) then
      matrix(to, from) = matrix(to, from) + coefficient
      matrix(from, to) = matrix(from, to) + coefficient
    end if
  end subroutine add_coefficient

  !> The pattern of eq. (21) for many elements, with k = factor * coefficient.
  pure subroutine add_coefficients(from, to, factor, coefficient, matrix)
    integer, intent(in) :: from(:), to(:)          !! [elements]
    real(wp), intent(in) :: factor
    real(wp), intent(in) :: coefficient(:)         !! [elements]
    real(wp), intent(inout) :: matrix(:, :)
    integer :: e

    do e = 1, size(to)
      call add_coefficient(from(e), to(e), factor * coefficient(e), matrix)
    end do
  end subroutine add_coefficients

end module nocdyn_incidence
