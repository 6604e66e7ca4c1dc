!> The steady state of a machine over the parameter: a motion without harmonics, with eigenvalues in place of multipliers.
!>
!> Its period is the one of its least stable oscillation, and its multipliers belong to this period.
module nocdyn_steady_problem
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_problem, only: harmonic_problem_t, new_harmonic_problem
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_eigenvalues, only: find_eigenvalues
  use nocdyn_orbit_problem, only: branch_point, hopf, orbit_point_t
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  implicit none (type, external)
  private

  public :: new_steady_problem

  type, extends(harmonic_problem_t), public :: steady_problem_t
    complex(wp), allocatable :: eigenvalues(:)   !! of the last point, by descending real part [1/s]
  contains
    procedure :: begin, set_scale, complete, find_multipliers, find_fault, resolution, adapt, kind_of
  end type steady_problem_t

contains

  !> The steady states of a machine.
  subroutine new_steady_problem(periodic, self, error)
    type(periodic_machine_t), intent(in) :: periodic
    class(steady_problem_t), allocatable, intent(out) :: self
    type(error_t), allocatable, intent(out) :: error

    allocate (self)
    call new_harmonic_problem(periodic, 0, 0.0_wp, self%harmonic_problem_t, error)
    self%equations%rate_is_unknown = .false.
    self%equations%period%rate = 1.0_wp   ! any will do
  end subroutine new_steady_problem

  subroutine begin(self, error)
    class(steady_problem_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: some = 1.0e-3_wp   ! [rad]

    self%equations%least_oscillation = some
    call self%equations%set_harmonics(0, error)
  end subroutine begin

  !> Angles are measured by themselves, or by their change over the range if the machine were linear.
  subroutine set_scale(self, x)
    class(steady_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    real(wp), parameter :: least = 1.0e-9_wp   ! [rad]
    real(wp) :: scale, tangent(size(x)), weights(size(x))
    integer :: i, n

    weights = 0.0_wp
    weights(size(x)) = 1.0_wp / self%range()
    call self%find_tangent(weights, tangent)
    scale = least
    do n = 1, self%equations%freedoms
      i = self%equations%first_unknown(n)
      scale = max(scale, abs(x(i)), abs(tangent(i)))
    end do
    self%equations%least_oscillation = scale
  end subroutine set_scale

  subroutine complete(self, x, point, error)
    class(steady_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    point%orbit%speed = self%equations%floating_speed
    call self%equations%take_apart(x, point%orbit)
    point%harmonics = 0
    point%error = 0.0_wp
    call find_eigenvalues(self%equations, point%orbit, self%eigenvalues, error)
    if (allocated(error)) return
    do k = 1, size(self%eigenvalues)
      if (.not. abs(aimag(self%eigenvalues(k))) > 0) cycle
      point%orbit%rate = abs(aimag(self%eigenvalues(k)))
      exit
    end do
  end subroutine complete

  subroutine find_multipliers(self, orbit, multipliers, error)
    class(steady_problem_t), intent(inout) :: self   !! has just completed the point of the orbit
    type(orbit_t), intent(inout) :: orbit
    complex(wp), allocatable, intent(out) :: multipliers(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: most = 600.0_wp   ! of an exponent

    associate (exponents => self%eigenvalues * (2 * acos(-1.0_wp) / orbit%rate))
      multipliers = exp(cmplx(min(real(exponents, wp), most), aimag(exponents), wp))
    end associate
  end subroutine find_multipliers

  !> Every steady state is good enough.
  subroutine find_fault(self, point, fault)
    class(steady_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    character(len=:), allocatable, intent(out) :: fault

    fault = ''
  end subroutine find_fault

  function resolution(self) result(words)
    class(steady_problem_t), intent(in) :: self
    character(len=:), allocatable :: words

    words = 'constant speeds'
  end function resolution

  subroutine adapt(self, point, has_changed, error)
    class(steady_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    logical, intent(out) :: has_changed
    type(error_t), allocatable, intent(out) :: error

    has_changed = .false.
  end subroutine adapt

  !> A pair of eigenvalues that crosses the imaginary axis begins oscillations.
  function kind_of(self, point, number) result(kind)
    class(steady_problem_t), intent(in) :: self
    type(orbit_point_t), intent(in) :: point
    integer, intent(in) :: number
    character(len=:), allocatable :: kind
    real(wp), parameter :: none = 1.0e-6_wp   ! imaginary part, as a share of the largest eigenvalue

    kind = branch_point
    if (abs(aimag(self%eigenvalues(number))) > none * maxval(abs(self%eigenvalues))) kind = hopf
  end function kind_of

end module nocdyn_steady_problem
