!> How an element between two bodies contributes to the vectors and matrices of the machine. Body 0 is the ground.
module nocdyn_incidence
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: add_moment, add_coefficient, add_coefficients

contains

  !> Adds a moment on `to` and its opposite on `from`; nothing for the ground.
  pure subroutine add_moment(from, to, moment, vector)
    integer, intent(in) :: from, to
    real(wp), intent(in) :: moment         !! [N m], or any derivative of it
    real(wp), intent(inout) :: vector(:)   !! [bodies]

    if (to > 0) vector(to) = vector(to) + moment
    if (from > 0) vector(from) = vector(from) - moment
  end subroutine add_moment

  !> Adds the pattern of eq. (21): -k on the diagonal, k beside it.
  pure subroutine add_coefficient(from, to, coefficient, matrix)
    integer, intent(in) :: from, to
    real(wp), intent(in) :: coefficient       !! k
    real(wp), intent(inout) :: matrix(:, :)   !! [bodies, bodies]

    if (to > 0) matrix(to, to) = matrix(to, to) - coefficient
    if (from > 0) matrix(from, from) = matrix(from, from) - coefficient
    if (to > 0 .and. from > 0) then
      matrix(to, from) = matrix(to, from) + coefficient
      matrix(from, to) = matrix(from, to) + coefficient
    end if
  end subroutine add_coefficient

  !> Adds the pattern of eq. (21) for many elements, with k = factor * coefficient.
  pure subroutine add_coefficients(from, to, factor, coefficient, matrix)
    integer, intent(in) :: from(:), to(:)     !! [elements]
    real(wp), intent(in) :: factor            !! common factor of all elements
    real(wp), intent(in) :: coefficient(:)    !! [elements]
    real(wp), intent(inout) :: matrix(:, :)   !! [bodies, bodies]
    integer :: e

    do e = 1, size(to)
      call add_coefficient(from(e), to(e), factor * coefficient(e), matrix)
    end do
  end subroutine add_coefficients

end module nocdyn_incidence
