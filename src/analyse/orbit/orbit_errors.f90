!> How far a periodic motion of some harmonics is from the exact one: what more harmonics and samples would change.
module nocdyn_orbit_errors
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_corrector, only: oscillation
  use nocdyn_orbit_equations, only: orbit_equations_t, orbit_t
  implicit none (type, external)
  private

  public :: estimate_error

contains

  !> The change of the motion, as a share of its largest harmonic, that harmonics up to twice as many ask for in equations with
  !> twice the samples. The harmonics left out are estimated by their accelerations, the others by the factors of the last
  !> correction.
  subroutine estimate_error(equations, finer, x, orbit, share, error)
    type(orbit_equations_t), intent(inout) :: equations   !! just corrected
    type(orbit_equations_t), intent(inout) :: finer       !! of twice the harmonics
    real(wp), intent(in) :: x(:)                          !! unknowns and the parameter
    type(orbit_t), intent(inout) :: orbit                 !! the motion of these
    real(wp), intent(out) :: share
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: r(:)
    real(wp) :: change(size(x)), largest
    integer :: first, h, i, n

    share = huge(share)
    if (finer%basis%harmonics /= 2 * equations%basis%harmonics) then
      call finer%set_harmonics(2 * equations%basis%harmonics, error)
      if (allocated(error)) return
    end if
    allocate (r(finer%unknowns()))
    call finer%residual(orbit, r, error)
    if (allocated(error)) return
    change = 0.0_wp
    share = 0.0_wp
    largest = oscillation(equations, x)
    associate (length => equations%basis%length, inner => equations%system%inner)
      do n = 1, equations%nodes
        i = equations%first_unknown(n)
        first = finer%first_unknown(n)
        change(i:i + length - 1) = -r(first:first + length - 1)
        do h = equations%basis%harmonics + 1, 2 * equations%basis%harmonics
          associate (rest => norm2(r(first + 2 * h - 1:first + 2 * h)))
            if (n <= equations%freedoms) then
              share = max(share, rest / h**2 / largest)
            else
              share = max(share, rest / h / max(maxval(abs(x(i:i + length - 1))), tiny(largest)))
            end if
          end associate
        end do
      end do
      change(inner + 1:size(x) - 1) = -r(finer%system%inner + 1:)
      call equations%system%solve(change)
      do n = 1, equations%freedoms
        i = equations%first_unknown(n)
        share = max(share, maxval(abs(change(i + 1:i + length - 1))) / largest)
      end do
    end associate
  end subroutine estimate_error

end module nocdyn_orbit_errors
