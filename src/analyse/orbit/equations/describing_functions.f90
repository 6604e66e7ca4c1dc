!> Describing functions along a motion: the stiffness and the damping that the first harmonic of the moment of a coupling has over
!> the one of its twist, k = Re Z and c = Im Z / (h w) with Z = -M/u. Of several harmonics, h is the one of the largest twist.
module nocdyn_describing_functions
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: describe_couplings

  type, public :: equivalent_t
    real(wp) :: twist = 0.0_wp       !! amplitude of the harmonic [rad], m of a mesh
    real(wp) :: stiffness = 0.0_wp   !! [N m/rad], N/m of a mesh
    real(wp) :: damping = 0.0_wp     !! [N m s/rad], N s/m of a mesh
  end type equivalent_t

contains

  !> The equivalents of some elements on a motion; zeros where an element is not twisted.
  subroutine describe_couplings(equations, orbit, elements, equivalents, error)
    type(orbit_equations_t), intent(inout) :: equations   !! with at least as many harmonics as the motion
    type(orbit_t), intent(inout) :: orbit
    integer, intent(in) :: elements(:)                    !! of the machine
    type(equivalent_t), intent(out) :: equivalents(:)     !! [elements]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: t(equations%machine%samples), y(equations%machine%samples, equations%machine%states)
    real(wp), dimension(equations%basis%length, size(elements)) :: moments, twists
    complex(wp) :: ratio
    integer :: h, i, k

    call equations%set_value(orbit, error)
    if (allocated(error)) return
    call equations%sample(orbit, equations%basis, t, y)
    associate (formulation => equations%machine%formulation, values => equations%machine%formulation%state%elements)
      call formulation%evaluate_at(size(t) * equations%freedoms, size(t) * (equations%nodes - equations%freedoms), t, y)
      twists = equations%basis%coefficients_of(values%angle(:, elements), equations%basis%harmonics)
      moments = equations%basis%coefficients_of(values%restoring(:, elements) + values%applied(:, elements), &
                                                equations%basis%harmonics)
      do i = 1, size(elements)
        associate (twist => twists(:, i), moment => moments(:, i))
          h = 1
          do k = 2, equations%basis%harmonics
            if (norm2(twist(2 * k:2 * k + 1)) > norm2(twist(2 * h:2 * h + 1))) h = k
          end do
          equivalents(i)%twist = norm2(twist(2 * h:2 * h + 1))
          if (.not. equivalents(i)%twist > 0) cycle
          ratio = -cmplx(moment(2 * h), -moment(2 * h + 1), wp) / cmplx(twist(2 * h), -twist(2 * h + 1), wp)
          equivalents(i)%stiffness = real(ratio, wp)
          equivalents(i)%damping = aimag(ratio) / (h * orbit%rate)
        end associate
      end do
    end associate
  end subroutine describe_couplings

end module nocdyn_describing_functions
