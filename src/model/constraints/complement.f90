!> The natural orthogonal complement of section 5, eqs. (73)-(82), and the other complements of section 6.
module nocdyn_complement
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: invert
  implicit none (type, external)
  private

  public :: extended_constraint, coordinate_selector, natural_complement, complement_factor

  integer, parameter, public :: complement_natural = 1   !! eq. (81)
  integer, parameter, public :: complement_scaled = 2    !! eq. (82) of section 6
  integer, parameter, public :: complement_negated = 3   !! eq. (83) of section 6
  character(len=*), parameter, public :: complement_names(3) = [character(len=7) :: 'natural', 'scaled', 'negated']

contains

  !> L_lambda^ext, eq. (78): a unit row for each independent body, then the rows of L_lambda.
  pure function extended_constraint(constraint, independent) result(extended)
    real(wp), intent(in) :: constraint(:, :)   !! L_lambda, [rows, bodies]
    integer, intent(in) :: independent(:)      !! columns whose speeds are the coordinates, [bodies - rows]
    real(wp) :: extended(size(constraint, 2), size(constraint, 2))
    integer :: i

    extended = 0.0_wp
    do i = 1, size(independent)
      extended(i, independent(i)) = 1.0_wp
    end do
    extended(size(independent) + 1:, :) = constraint
  end function extended_constraint

  !> l_lambda, eq. (79): the coordinates in the first rows, zero in the rows of the constraints.
  pure function coordinate_selector(bodies, coordinates) result(selector)
    integer, intent(in) :: bodies, coordinates   !! numbers of them
    real(wp) :: selector(bodies, coordinates)
    integer :: i

    selector = 0.0_wp
    do i = 1, coordinates
      selector(i, i) = 1.0_wp
    end do
  end function coordinate_selector

  !> L_tau = inverse(L_lambda^ext) l_lambda, eq. (81), by LAPACK.
  !>
  !> The remaining columns D of the inverse obey L_lambda D = 1; from J omega' - T = L_lambda^T lambda they give the
  !> reactions lambda = D^T (J omega' - T) (Blajer, J. Mech. Design 126 (2004) 341-350).
  subroutine natural_complement(constraint, independent, complement, dual, log_determinant, is_singular)
    real(wp), intent(in) :: constraint(:, :)                 !! L_lambda with independent rows, [rows, bodies]
    integer, intent(in) :: independent(:)                    !! bodies whose speeds are the coordinates, [bodies - rows]
    real(wp), allocatable, intent(out) :: complement(:, :)   !! L_tau, [bodies, bodies - rows]
    real(wp), allocatable, intent(out) :: dual(:, :)         !! D, [bodies, rows]
    real(wp), intent(out) :: log_determinant                 !! log |det L_lambda^ext|
    logical, intent(out) :: is_singular                      !! whether these coordinates cannot be independent
    real(wp), allocatable :: inverse(:, :)

    call invert(extended_constraint(constraint, independent), inverse, log_determinant, is_singular)
    complement = matmul(inverse, coordinate_selector(size(constraint, 2), size(independent)))
    dual = inverse(:, size(independent) + 1:)
  end subroutine natural_complement

  !> The factor that turns the natural complement of a group of geared bodies into the complement of eq. (82) or (83).
  !>
  !> Section 6 multiplies the column of the gear pair by R2 or by -R2, which is the determinant of L_lambda^ext up to
  !> its sign; for a group of r gears the factor is the geometric mean over the gears, and 1 for a free body.
  pure real(wp) function complement_factor(choice, log_determinant, rows) result(factor)
    integer, intent(in) :: choice             !! complement_...
    real(wp), intent(in) :: log_determinant   !! log |det L_lambda^ext| of the group
    integer, intent(in) :: rows               !! number of independent rows of the group

    factor = 1.0_wp
    if (choice == complement_natural .or. rows == 0) return
    factor = exp(log_determinant / rows)
    if (choice == complement_negated) factor = -factor
  end function complement_factor

end module nocdyn_complement
