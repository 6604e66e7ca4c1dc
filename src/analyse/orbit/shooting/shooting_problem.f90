!> Periodic motions by shooting: Newton's method on its equations, multipliers and signals.
module nocdyn_shooting_problem
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_orbit_multipliers, only: multipliers_of
  use nocdyn_orbit_problem, only: measured, orbit_point_t, signal_range_t
  use nocdyn_orbit_series, only: find_series
  use nocdyn_period_flow, only: flow_observer_t
  use nocdyn_period_signals, only: measure_period, sample_period
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_sampled_machine, only: new_sampled_machine
  use nocdyn_shooting_equations, only: shooting_equations_t, shooting_rtol, silent
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: signal_t
  use nocdyn_targets, only: target_t
  use nocdyn_text, only: rounded_text
  use nocdyn_varied_machine, only: varied_machine_t
  implicit none (type, external)
  private

  public :: new_shooting_problem

  type, extends(shooting_equations_t), public :: shooting_problem_t
    real(wp), allocatable, private :: row(:)                !! the last row
    real(wp), allocatable, private :: factors(:, :)
    integer, allocatable, private :: pivots(:)
    real(wp), private :: gained = 0.0_wp                    !! speed in a period, as a share of the oscillation
  contains
    procedure :: begin, correct, find_tangent, weights_of, oscillation, set_scale, complete, find_multipliers
    procedure :: find_fault, measure, resolution, sample
    procedure, private :: factor
  end type shooting_problem_t

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  real(wp), parameter :: coarse = 100.0_wp       ! times it, for the error
  integer, parameter :: samples = 128            ! of a period, for series
  integer, parameter :: most_iterations = 14
  integer, parameter :: most_growths = 3
  real(wp), parameter :: converged_change = 1.0e-9_wp
  real(wp), parameter :: kept = 1.0e-6_wp        ! gain of speed that is none
  real(wp), parameter :: unresolved = 1.0e-3_wp  ! error above which a motion is none

contains

  !> The shooting problem of a machine.
  subroutine new_shooting_problem(input, targets, periodic, tolerance, self, error)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)         !! the number that changes, or none
    type(periodic_machine_t), intent(in) :: periodic
    real(wp), intent(in) :: tolerance                !! error of a point, as a share of its motion
    type(shooting_problem_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(varied_machine_t) :: mold

    self%periodic = periodic
    self%tolerance = tolerance
    call new_sampled_machine(input, targets, periodic%machine%value, 1, self%periodic%machine, error, mold=mold)
    if (allocated(error)) return
    self%states = self%periodic%machine%states
    self%half_range = spread(0.0_wp, 1, self%states)
  end subroutine new_shooting_problem

  subroutine begin(self, error)
    class(shooting_problem_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error

    self%half_range(:) = 0.0_wp
    self%least_oscillation = 0.0_wp
  end subroutine begin

  !> Factors the matrix with the last row.
  subroutine factor(self, is_regular)
    class(shooting_problem_t), intent(inout) :: self
    logical, intent(out) :: is_regular
    logical :: singular
    integer :: n

    n = size(self%row)
    self%factors(:n - 1, :) = self%matrix
    self%factors(n, :) = self%row
    call lu_factor(self%factors, self%pivots, singular)
    is_regular = .not. singular
  end subroutine factor

  subroutine correct(self, row, target, x, iterations, has_converged, error)
    class(shooting_problem_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)
    real(wp), intent(in) :: target
    real(wp), intent(inout) :: x(:)
    integer, intent(out) :: iterations
    logical, intent(out) :: has_converged
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: change(size(x)), former, length
    integer :: growths

    has_converged = .false.
    former = huge(former)
    growths = 0
    self%row = row
    if (allocated(self%matrix)) deallocate (self%matrix, self%factors, self%pivots)
    allocate (self%matrix(size(x) - 1, size(x)), self%factors(size(x), size(x)), source=0.0_wp)
    allocate (self%pivots(size(x)), source=0)
    do iterations = 1, most_iterations
      call self%shoot(x, .true., change(:size(x) - 1), error)
      if (allocated(error)) exit
      change(size(x)) = dot_product(row, x) - target
      call self%fill_matrix()
      if (iterations == 1 .or. growths > 0) call self%fill_differences(x, error)
      if (allocated(error)) exit
      call self%factor(has_converged)
      if (.not. has_converged) return
      has_converged = .false.
      change = -change
      call lu_solve(self%factors, self%pivots, change)
      length = measured(change, self%weights_of(x))
      x = x + change
      if (length <= converged_change) then
        has_converged = .true.
        return
      end if
      if (0.5_wp * length > former) growths = growths + 1
      if (.not. length < huge(length) .or. growths > most_growths) return
      former = length
    end do
    if (allocated(error)) deallocate (error)   ! a motion far from a periodic one may have no end
  end subroutine correct

  subroutine find_tangent(self, weights, tangent)
    class(shooting_problem_t), intent(inout) :: self
    real(wp), intent(in) :: weights(:)
    real(wp), contiguous, intent(out) :: tangent(:)
    type(error_t), allocatable :: error
    logical :: is_regular

    tangent = 0.0_wp
    tangent(size(tangent)) = 1.0_wp
    call self%fill_differences(self%x, error)
    call self%factor(is_regular)
    if (is_regular) call lu_solve(self%factors, self%pivots, tangent)
    tangent = tangent / measured(tangent, weights)
  end subroutine find_tangent

  function weights_of(self, x) result(weights)
    class(shooting_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    real(wp) :: weights(size(x))
    type(orbit_t) :: orbit
    real(wp) :: response, scale(self%states)
    integer :: i, k

    call self%take_apart(x, orbit)
    scale = self%scales(orbit%rate)
    associate (n => self%states, f => self%periodic%machine%freedoms, machine => self%periodic%machine%formulation%machine)
      weights(:n) = 1.0_wp / (scale * sqrt(real(n, wp)))
      weights(self%free_places()) = weights(self%periodic%free)
      do k = 1, size(self%periodic%border)
        i = n + k
        weights(i) = abs(x(i))
        if (self%periodic%border(k) == self%periodic%held_motion) then
          associate (coordinates => machine%coordinates, held => self%periodic%held)
            response = maxval(abs(coordinates%response(1, coordinates%first(held):coordinates%first(held + 1) - 1)))
          end associate
          weights(i) = max(weights(i), scale(f + 1) * orbit%rate**2 / response)
        end if
        weights(i) = 1.0_wp / max(weights(i), sqrt(epsilon(response)))
      end do
      if (self%periodic%rate_is_unknown) weights(size(x) - 1) = 1.0_wp / orbit%rate
      weights(size(x)) = 1.0_wp / self%range()
    end associate
  end function weights_of

  real(wp) function oscillation(self, x)
    class(shooting_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)

    associate (f => self%periodic%machine%freedoms)
      oscillation = max(silent, self%least_oscillation, maxval(self%half_range(f + 1:2 * f)))
    end associate
  end function oscillation

  subroutine set_scale(self, x)
    class(shooting_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    real(wp), parameter :: part = 0.01_wp
    real(wp) :: tangent(size(x)), weights(size(x))
    type(orbit_t) :: orbit

    self%least_oscillation = 0.0_wp
    if (self%oscillation(x) > silent) return
    weights = 0.0_wp
    weights(size(x)) = 1.0_wp / self%range()
    call self%find_tangent(weights, tangent)
    call self%take_apart(x, orbit)
    associate (f => self%periodic%machine%freedoms)
      tangent(self%free_places()) = 0.0_wp
      self%least_oscillation = part * max(maxval(abs(tangent(f + 1:2 * f))), maxval(abs(tangent(:f))) / orbit%rate)
    end associate
    if (self%least_oscillation <= part * silent) self%least_oscillation = 0.0_wp
  end subroutine set_scale

  !> The error is the change of the end of a period with a coarser integration.
  subroutine complete(self, x, point, error)
    class(shooting_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error
    type(flow_observer_t) :: fine, rough
    real(wp) :: scale(self%states), times(samples + 1)
    integer :: i

    call self%take_apart(x, point%orbit)
    call self%periodic%set_value(point%orbit, error)
    if (allocated(error)) return
    times = [(turn / point%orbit%rate * i / samples, i=0, samples)]
    call self%flow(point%orbit, shooting_rtol, times, .false., fine, error)
    if (.not. allocated(error)) call self%flow(point%orbit, coarse * shooting_rtol, times, .false., rough, error)
    if (allocated(error)) return
    point%harmonics = 0
    point%crossed = 0
    scale = self%scales(point%orbit%rate)
    self%gained = 0.0_wp
    if (size(self%periodic%free) > 0) self%gained = maxval(abs(x(self%free_places()))) / scale(1)
    point%error = maxval(abs(rough%samples(:, samples + 1) - fine%samples(:, samples + 1)) / scale)
    associate (f => self%periodic%machine%freedoms)
      call find_series(self%periodic, fine%samples(f + 1:, :), 0.0_wp, times(samples + 1), point%orbit)
    end associate
    call self%take_apart(x, point%orbit)
  end subroutine complete

  subroutine find_multipliers(self, orbit, multipliers, error)
    class(shooting_problem_t), intent(inout) :: self
    type(orbit_t), intent(inout) :: orbit
    complex(wp), allocatable, intent(out) :: multipliers(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: known(:, :), matrix(:, :)
    type(flow_observer_t) :: observer
    integer :: m, n

    call self%periodic%set_value(orbit, error)
    if (.not. allocated(error)) call self%flow(orbit, shooting_rtol, [0.0_wp, turn / orbit%rate], .true., observer, error)
    if (allocated(error)) return
    matrix = self%monodromy
    associate (f => self%periodic%machine%freedoms, free => self%periodic%free, rigid => self%periodic%rigid)
      n = size(free)
      associate (border => self%periodic%border)
        allocate (known(self%states, 2 * n - size(border) + merge(1, 0, self%periodic%rate_is_unknown)), source=0.0_wp)
      end associate
      do m = 1, size(free)
        known(f + 1:2 * f, m) = rigid(:, m)
        if (m == self%periodic%period%motion) call self%find_rates(orbit, known(:, m))
        if (any(self%periodic%border == m)) cycle
        n = n + 1
        known(:f, n) = rigid(:, m)
      end do
      if (self%periodic%rate_is_unknown) call self%find_rates(orbit, known(:, size(known, 2)))
      call multipliers_of(f, matrix, known, multipliers, error)
    end associate
  end subroutine find_multipliers

  subroutine find_fault(self, point, fault)
    class(shooting_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    character(len=:), allocatable, intent(out) :: fault

    fault = ''
    if (self%gained > kept) fault = 'the machine gains speed in each period: the mean torques do not balance, and none ' // &
      'depends on the mean speed'
    if (.not. point%error <= unresolved) fault = 'the integration over a period is not exact enough (error ' // &
      rounded_text(point%error, 2) // ' of the motion)'
  end subroutine find_fault

  subroutine measure(self, point, signals, ranges, error)
    class(shooting_problem_t), target, intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(signal_t), intent(in) :: signals(:)
    type(signal_range_t), intent(out) :: ranges(:)
    type(error_t), allocatable, intent(out) :: error

    call self%periodic%set_value(point%orbit, error)
    if (.not. allocated(error)) call measure_period(self%periodic, point%orbit, shooting_rtol, signals, ranges, error)
  end subroutine measure

  subroutine sample(self, point, signals, least_samples, samples, error)
    class(shooting_problem_t), target, intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(signal_t), intent(in) :: signals(:)
    integer, intent(in) :: least_samples
    type(signal_samples_t), intent(out) :: samples
    type(error_t), allocatable, intent(out) :: error

    call self%periodic%set_value(point%orbit, error)
    if (allocated(error)) return
    call sample_period(self%periodic, point%orbit, shooting_rtol, signals, least_samples, samples, error)
  end subroutine sample

  function resolution(self) result(words)
    class(shooting_problem_t), intent(in) :: self
    character(len=:), allocatable :: words

    words = 'shooting'
    if (self%grazed > 0) words = words // '; the motion touches the ' // &
                                 self%periodic%machine%formulation%switch_name(self%grazed) // ' almost tangentially'
  end function resolution

end module nocdyn_shooting_problem
