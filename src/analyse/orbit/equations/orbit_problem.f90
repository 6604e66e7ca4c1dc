!> What a method that finds periodic motions offers to those who follow a branch: unknowns x with the parameter as the last one,
!> and Newton's method for them with one more row.
module nocdyn_orbit_problem
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: signal_t
  implicit none (type, external)
  private

  public :: measured

  character(len=*), parameter, public :: fold = 'fold', doubling = 'period_doubling', neimark_sacker = 'neimark_sacker', &
    branch_point = 'branch_point', torque_fold = 'torque_fold', hopf = 'hopf'

  type, public :: orbit_point_t
    type(orbit_t) :: orbit
    real(wp) :: direction = 0.0_wp                 !! change of the parameter along the branch, as a share of its range
    real(wp) :: error = 0.0_wp                     !! estimated, as a share of the motion
    integer :: harmonics = 0
    integer :: branch = 1
    integer :: crossed = 0                         !! a switch whose branches the motion changes, 0: none
    complex(wp), allocatable :: multipliers(:)     !! by descending modulus
    character(len=:), allocatable :: kind          !! of a special point, else ''
    integer :: leads_to = 0                        !! branch that begins or ends there, 0: none is known
    logical :: is_supercritical = .false.          !! whether limit cycles begin where the steady state is unstable
  contains
    procedure :: is_stable, unstable
  end type orbit_point_t

  type, public :: signal_range_t
    real(wp) :: half_range = 0.0_wp, largest = 0.0_wp, mean = 0.0_wp   !! in SI units
  end type signal_range_t

  type, abstract, public :: orbit_problem_t
    type(periodic_machine_t) :: periodic           !! of few samples
    real(wp) :: tolerance = 0.0_wp                 !! error of a point, as a share of its motion
  contains
    procedure(begin), deferred :: begin
    procedure(put_together), deferred :: put_together
    procedure(correct), deferred :: correct
    procedure(find_tangent), deferred :: find_tangent
    procedure(weights_of), deferred :: weights_of
    procedure(oscillation), deferred :: oscillation
    procedure(set_scale), deferred :: set_scale
    procedure(complete), deferred :: complete
    procedure(find_multipliers), deferred :: find_multipliers
    procedure(find_fault), deferred :: find_fault
    procedure(measure), deferred :: measure
    procedure(resolution), deferred :: resolution
    procedure :: adapt, least_size, recast, restore, sample, kind_of, keep_phase, meets_other
    procedure :: range => parameter_range
  end type orbit_problem_t

  abstract interface
    !> Goes back to the resolution with which a branch begins.
    subroutine begin(self, error)
      import :: error_t, orbit_problem_t
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
    end subroutine begin

    !> The unknowns of an orbit in the present resolution, and its parameter.
    function put_together(self, orbit) result(x)
      import :: orbit_problem_t, orbit_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      type(orbit_t), intent(in) :: orbit
      real(wp), allocatable :: x(:)
    end function put_together

    !> Solves the equations with row x = target.
    subroutine correct(self, row, target, x, iterations, has_converged, error)
      import :: error_t, orbit_problem_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      real(wp), intent(in) :: row(:)
      real(wp), intent(in) :: target
      real(wp), intent(inout) :: x(:)           !! a guess, on return the solution
      integer, intent(out) :: iterations
      logical, intent(out) :: has_converged
      type(error_t), allocatable, intent(out) :: error
    end subroutine correct

    !> The tangent of the branch at a solution that `correct` has just found, with row tangent > 0 and weighted length 1.
    subroutine find_tangent(self, weights, tangent)
      import :: orbit_problem_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      real(wp), intent(in) :: weights(:)
      real(wp), contiguous, intent(out) :: tangent(:)
    end subroutine find_tangent

    !> The weights of the unknowns and of the parameter, with which changes are measured.
    function weights_of(self, x) result(weights)
      import :: orbit_problem_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp) :: weights(size(x))
    end function weights_of

    !> The size of the oscillation, or what counts as the least [rad].
    real(wp) function oscillation(self, x)
      import :: orbit_problem_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
    end function oscillation

    !> Finds what counts as the least oscillation where nothing oscillates at the first value.
    subroutine set_scale(self, x)
      import :: orbit_problem_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self   !! just corrected
      real(wp), intent(in) :: x(:)
    end subroutine set_scale

    !> Orbit, error and resolution of a point that `correct` has just found.
    subroutine complete(self, x, point, error)
      import :: error_t, orbit_point_t, orbit_problem_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      real(wp), intent(in) :: x(:)
      type(orbit_point_t), intent(inout) :: point
      type(error_t), allocatable, intent(out) :: error
    end subroutine complete

    !> The multipliers of an orbit by descending modulus.
    subroutine find_multipliers(self, orbit, multipliers, error)
      import :: error_t, orbit_problem_t, orbit_t, wp
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      type(orbit_t), intent(inout) :: orbit
      complex(wp), allocatable, intent(out) :: multipliers(:)
      type(error_t), allocatable, intent(out) :: error
    end subroutine find_multipliers

    !> Why a point is not good enough, '' if it is.
    subroutine find_fault(self, point, fault)
      import :: orbit_point_t, orbit_problem_t
      implicit none (type, external)
      class(orbit_problem_t), intent(inout) :: self
      type(orbit_point_t), intent(in) :: point
      character(len=:), allocatable, intent(out) :: fault
    end subroutine find_fault

    !> The ranges of signals on an orbit. Angles are those beside the mean rotation.
    subroutine measure(self, point, signals, ranges, error)
      import :: error_t, orbit_point_t, orbit_problem_t, signal_range_t, signal_t
      implicit none (type, external)
      class(orbit_problem_t), target, intent(inout) :: self
      type(orbit_point_t), intent(inout) :: point
      type(signal_t), intent(in) :: signals(:)
      type(signal_range_t), intent(out) :: ranges(:)
      type(error_t), allocatable, intent(out) :: error
    end subroutine measure

    !> The present resolution in words, after 'with'.
    function resolution(self) result(words)
      import :: orbit_problem_t
      implicit none (type, external)
      class(orbit_problem_t), intent(in) :: self
      character(len=:), allocatable :: words
    end function resolution
  end interface

contains

  !> Changes the resolution if the error of a point asks for it. By default there is one resolution only.
  subroutine adapt(self, point, has_changed, error)
    class(orbit_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    logical, intent(out) :: has_changed
    type(error_t), allocatable, intent(out) :: error

    has_changed = .false.
  end subroutine adapt

  !> A tangent in the present resolution. By default there is one resolution only.
  function recast(self, point, tangent) result(other)
    class(orbit_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point      !! of the tangent
    real(wp), intent(in) :: tangent(:)
    real(wp), allocatable :: other(:)

    allocate (other, source=tangent)
  end function recast

  !> Samples of signals over one period, at least so many. By default there are none.
  subroutine sample(self, point, signals, least_samples, samples, error)
    class(orbit_problem_t), target, intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(signal_t), intent(in) :: signals(:)
    integer, intent(in) :: least_samples
    type(signal_samples_t), intent(out) :: samples
    type(error_t), allocatable, intent(out) :: error
  end subroutine sample

  !> What `set_scale` has found, 0 if nothing.
  real(wp) function least_size(self)
    class(orbit_problem_t), intent(in) :: self

    least_size = 0.0_wp
  end function least_size

  !> Goes back to the resolution of a point. By default there is one resolution only.
  subroutine restore(self, point, least, error)
    class(orbit_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    real(wp), intent(in) :: least   !! as of `least_size`
    type(error_t), allocatable, intent(out) :: error
  end subroutine restore

  !> The kind of a special point where the multiplier of a number passes the unit circle.
  function kind_of(self, point, number) result(kind)
    class(orbit_problem_t), intent(in) :: self
    type(orbit_point_t), intent(in) :: point   !! the last one that was completed
    integer, intent(in) :: number
    character(len=:), allocatable :: kind
    real(wp), parameter :: none = 1.0e-6_wp    ! imaginary part of a real multiplier

    associate (multiplier => point%multipliers(number))
      if (abs(multiplier%im) > none) then
        kind = neimark_sacker
      else if (multiplier%re < 0) then
        kind = doubling
      else if (self%periodic%held > 0) then
        kind = torque_fold   ! multipliers are those at a constant torque
      else
        kind = branch_point
      end if
    end associate
  end function kind_of

  !> Motions are in phase with an orbit from now on. By default the excitation keeps the phase.
  subroutine keep_phase(self, orbit)
    class(orbit_problem_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
  end subroutine keep_phase

  !> Whether the branch passes the one that it has left between two motions. By default it has left none.
  logical function meets_other(self, before, after)
    class(orbit_problem_t), intent(in) :: self
    type(orbit_t), intent(in) :: before, after

    meets_other = .false.
  end function meets_other

  !> The width of the range of the parameter.
  pure real(wp) function parameter_range(self)
    class(orbit_problem_t), intent(in) :: self

    parameter_range = self%periodic%bounds(2) - self%periodic%bounds(1)
  end function parameter_range

  !> The size of a change.
  pure real(wp) function measured(change, weights)
    real(wp), intent(in) :: change(:), weights(:)

    measured = norm2(weights * change)
  end function measured

  !> The number of multipliers outside the unit circle.
  pure integer function unstable(self)
    class(orbit_point_t), intent(in) :: self
    real(wp), parameter :: neutral = 1.0e-8_wp   ! of a modulus above 1 by rounding

    unstable = count(abs(self%multipliers) > 1.0_wp + neutral)
  end function unstable

  !> Whether disturbances decay.
  pure logical function is_stable(self)
    class(orbit_point_t), intent(in) :: self

    is_stable = self%unstable() == 0
  end function is_stable

end module nocdyn_orbit_problem
