!> The describing functions of the couplings along branches of periodic motions.
module nocdyn_orbit_couplings
  use nocdyn_bank, only: role_coupling
  use nocdyn_describing_functions, only: describe_couplings, equivalent_t
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_problem, only: harmonic_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_problem, only: orbit_point_t, orbit_problem_t
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: list_couplings, describe_point

  type, public :: orbit_couplings_t
    type(string_t), allocatable :: names(:)                 !! of the couplings
    integer, allocatable :: elements(:)                     !! of the machine
    type(equivalent_t), allocatable :: equivalents(:, :)    !! [couplings, points]
  contains
    procedure :: changes
  end type orbit_couplings_t

contains

  !> The couplings of a machine, without shafts and meshes.
  subroutine list_couplings(machine, points, self)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: points
    type(orbit_couplings_t), intent(inout) :: self
    integer :: b, e

    allocate (self%names(0), self%elements(0))
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role /= role_coupling .or. bank%kind_name() /= 'coupling') cycle
        do e = 1, bank%count
          call append(self%names, bank%names(e)%text)
          self%elements = [self%elements, bank%first + e - 1]
        end do
      end associate
    end do
    allocate (self%equivalents(size(self%elements), points))
  end subroutine list_couplings

  !> The equivalents on a motion whose signals have just been measured; none without harmonics.
  subroutine describe_point(problem, point, number, self, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(orbit_point_t), intent(inout) :: point
    integer, intent(in) :: number
    type(orbit_couplings_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error

    if (point%harmonics == 0) return   ! a steady state, or a motion by shooting
    select type (problem)
    type is (harmonic_problem_t)
      call describe_couplings(problem%finer, point%orbit, self%elements, self%equivalents(:, number), error)
    end select
  end subroutine describe_point

  !> Whether the stiffness of a coupling changes along the motions that twist it.
  pure logical function changes(self, coupling)
    class(orbit_couplings_t), intent(in) :: self
    integer, intent(in) :: coupling
    real(wp), parameter :: rounding = 1.0e-6_wp

    changes = .false.
    associate (stiffness => self%equivalents(coupling, :)%stiffness, twists => self%equivalents(coupling, :)%twist > 0)
      if (any(twists)) changes = maxval(stiffness, mask=twists) - minval(stiffness, mask=twists) > &
                                 rounding * maxval(abs(stiffness), mask=twists)
    end associate
  end function changes

end module nocdyn_orbit_couplings
