!> Periodic motions by harmonic balance: as many harmonics as the error of a point asks for.
module nocdyn_harmonic_problem
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: padded_series
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_corrector, only: correct_harmonics => correct, estimate_error, find_harmonic_tangent => find_tangent, &
    harmonic_weights => weights_of, largest_harmonic => oscillation, set_least_oscillation
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_orbit_multipliers, only: harmonic_multipliers => find_multipliers
  use nocdyn_orbit_problem, only: orbit_point_t, orbit_problem_t, signal_range_t
  use nocdyn_orbit_signals, only: measure_signals, sample_signals
  use nocdyn_orbit_variations, only: steps_of
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  public :: new_harmonic_problem

  type, extends(orbit_problem_t), public :: harmonic_problem_t
    type(orbit_equations_t) :: equations
    type(orbit_equations_t) :: finer             !! of twice the harmonics, for errors and signals
    integer :: harmonics = 0                     !! by error if it is 0
    integer :: vanishing = 0                     !! harmonics that vanish where the branch meets the one that it has left; 0: none
    integer :: kink = 0                          !! the switch at which a motion has failed, 0: none
  contains
    procedure :: begin, put_together, correct, find_tangent, weights_of, oscillation, set_scale, complete, find_multipliers
    procedure :: find_fault, measure, sample, resolution, adapt, least_size, recast, restore, takes_long
    procedure :: keep_phase, meets_other, set_subharmonic, keep_vanishing
    procedure, private :: least_harmonics, vanishes
  end type harmonic_problem_t

  !> Harmonics that vanish: of limit cycles in a steady state, of motions of twice the period, of motions that are not symmetric.
  integer, parameter, public :: all_harmonics = 1, odd_harmonics = 2, even_harmonics = 3

  integer, parameter :: first_harmonics = 5
  integer, parameter :: most_harmonics = 200
  integer, parameter :: most_of_kinks = 60       ! where laws have kinks, more are of little use
  real(wp), parameter :: most_work = 2.0e6_wp    ! of multipliers that are not asked for: steps times squared states
  real(wp), parameter :: kinked = 1.0e-6_wp      ! error above which a motion across kinks is none
  real(wp), parameter :: unresolved = 1.0e-3_wp  ! error above which any motion is none

contains

  !> The harmonic balance of a machine.
  subroutine new_harmonic_problem(periodic, harmonics, tolerance, self, error)
    type(periodic_machine_t), intent(in) :: periodic
    integer, intent(in) :: harmonics              !! by error if it is 0
    real(wp), intent(in) :: tolerance             !! error of a point, as a share of its motion
    type(harmonic_problem_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error

    self%periodic = periodic
    self%harmonics = harmonics
    self%tolerance = tolerance
    self%equations%periodic_machine_t = periodic
    call self%equations%prepare()
    call self%equations%set_harmonics(first_harmonics, error)
    if (.not. allocated(error)) self%finer = self%equations
  end subroutine new_harmonic_problem

  !> Whether the multipliers of a motion take long.
  logical function takes_long(self, guess)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_t), intent(in) :: guess
    type(orbit_t) :: motion

    motion = guess
    motion%series = padded_series(guess%series, self%equations%basis%length)
    takes_long = steps_of(self%equations, motion) * real(self%equations%machine%states, wp)**2 > most_work
  end function takes_long

  !> The harmonics with which a branch begins: those of the excitation and one more.
  pure integer function least_harmonics(self)
    class(harmonic_problem_t), intent(in) :: self

    associate (equations => self%equations)
      least_harmonics = max(first_harmonics, (maxval([0, equations%period%multiples]) + 1) * equations%subharmonic)
    end associate
  end function least_harmonics

  subroutine begin(self, error)
    class(harmonic_problem_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error

    call self%equations%set_harmonics(merge(self%harmonics, self%least_harmonics(), self%harmonics > 0), error)
  end subroutine begin

  function put_together(self, orbit) result(x)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), allocatable :: x(:)
    type(orbit_t) :: padded

    padded = orbit
    padded%series = padded_series(orbit%series, self%equations%basis%length)
    allocate (x, source=self%equations%put_together(padded))
  end function put_together

  subroutine correct(self, row, target, x, iterations, has_converged, error)
    class(harmonic_problem_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)
    real(wp), intent(in) :: target
    real(wp), intent(inout) :: x(:)
    integer, intent(out) :: iterations
    logical, intent(out) :: has_converged
    type(error_t), allocatable, intent(out) :: error

    call correct_harmonics(self%equations, self%range(), row, target, x, iterations, has_converged, error)
  end subroutine correct

  subroutine find_tangent(self, weights, tangent)
    class(harmonic_problem_t), intent(inout) :: self
    real(wp), intent(in) :: weights(:)
    real(wp), contiguous, intent(out) :: tangent(:)

    call find_harmonic_tangent(self%equations, weights, tangent)
  end subroutine find_tangent

  function weights_of(self, x) result(weights)
    class(harmonic_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    real(wp) :: weights(size(x))

    weights = harmonic_weights(self%equations, x, self%range())
  end function weights_of

  real(wp) function oscillation(self, x)
    class(harmonic_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)

    oscillation = largest_harmonic(self%equations, x)
  end function oscillation

  subroutine set_scale(self, x)
    class(harmonic_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)

    call set_least_oscillation(self%equations, x, self%range())
  end subroutine set_scale

  real(wp) function least_size(self)
    class(harmonic_problem_t), intent(in) :: self

    least_size = self%equations%least_oscillation
  end function least_size

  subroutine restore(self, point, least, error)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    real(wp), intent(in) :: least   !! as of `least_size`
    type(error_t), allocatable, intent(out) :: error

    self%equations%least_oscillation = least
    call self%equations%set_harmonics(point%harmonics, error)
  end subroutine restore

  subroutine complete(self, x, point, error)
    class(harmonic_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error

    point%orbit%speed = self%equations%floating_speed
    call self%equations%take_apart(x, point%orbit)
    call self%equations%set_value(point%orbit, error)
    if (allocated(error)) return
    point%harmonics = self%equations%basis%harmonics
    call estimate_error(self%equations, self%finer, x, point%orbit, point%error, error)
    point%crossed = self%finer%machine%crossed_switch()
  end subroutine complete

  subroutine find_multipliers(self, orbit, multipliers, error)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_t), intent(inout) :: orbit
    complex(wp), allocatable, intent(out) :: multipliers(:)
    type(error_t), allocatable, intent(out) :: error

    call harmonic_multipliers(self%equations, orbit, multipliers, error)
  end subroutine find_multipliers

  subroutine find_fault(self, point, fault)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    character(len=:), allocatable, intent(out) :: fault

    fault = ''
    if (point%crossed > 0 .and. point%error > kinked) then
      self%kink = point%crossed
      fault = 'the motion crosses the ' // self%equations%machine%formulation%switch_name(point%crossed) // ', a kink or ' // &
              'jump of its law that ' // to_text(point%harmonics) // ' harmonics do not describe (error ' // &
              rounded_text(point%error, 2) // ' of the motion)'
    else if (point%error > unresolved) then
      fault = to_text(point%harmonics) // ' harmonics do not describe the motion (error ' // rounded_text(point%error, 2) // &
              ' of it)'
    end if
  end subroutine find_fault

  subroutine measure(self, point, signals, ranges, error)
    class(harmonic_problem_t), target, intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(signal_t), intent(in) :: signals(:)
    type(signal_range_t), intent(out) :: ranges(:)
    type(error_t), allocatable, intent(out) :: error

    call self%finer%set_harmonics(2 * point%harmonics, error)
    if (.not. allocated(error)) call measure_signals(self%finer, point%orbit, signals, ranges, error)
  end subroutine measure

  subroutine sample(self, point, signals, least_samples, samples, error)
    class(harmonic_problem_t), target, intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(signal_t), intent(in) :: signals(:)
    integer, intent(in) :: least_samples
    type(signal_samples_t), intent(out) :: samples
    type(error_t), allocatable, intent(out) :: error

    call self%finer%set_harmonics(2 * point%harmonics, error, least_samples)
    if (.not. allocated(error)) call sample_signals(self%finer, point%orbit, signals, samples, error)
    samples%harmonics = 2 * point%harmonics
  end subroutine sample

  function resolution(self) result(words)
    class(harmonic_problem_t), intent(in) :: self
    character(len=:), allocatable :: words

    words = to_text(self%equations%basis%harmonics) // ' harmonics'
  end function resolution

  !> More harmonics if the error of a point is too large, fewer if it is very small.
  subroutine adapt(self, point, has_changed, error)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    logical, intent(out) :: has_changed
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: spare = 1.0e-4_wp   ! of the tolerance
    integer :: harmonics, most

    harmonics = self%equations%basis%harmonics
    if (self%harmonics > 0) then
      harmonics = self%harmonics
    else if (point%error > self%tolerance) then
      most = merge(most_of_kinks, most_harmonics, point%crossed > 0)
      harmonics = max(harmonics, min(most, harmonics + max(2, harmonics / 3)))
    else if (point%error < spare * self%tolerance) then
      harmonics = max(self%least_harmonics(), harmonics - max(1, harmonics / 6))
    end if
    has_changed = harmonics /= self%equations%basis%harmonics
    if (has_changed) call self%equations%set_harmonics(harmonics, error)
  end subroutine adapt

  function recast(self, point, tangent) result(other)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_point_t), intent(in) :: point
    real(wp), intent(in) :: tangent(:)
    real(wp), allocatable :: other(:)
    real(wp) :: series(2 * point%harmonics + 1, self%equations%nodes)
    type(orbit_t) :: along
    integer :: i, n

    associate (equations => self%equations)
      do n = 1, equations%nodes
        i = (n - 1) * size(series, 1)
        series(:, n) = tangent(i + 1:i + size(series, 1))
      end do
      along%speed = equations%floating_speed
      along%series = padded_series(series, equations%basis%length)
      other = equations%put_together(along)
      associate (scalars => equations%scalars())
        other(size(other) - scalars:) = tangent(size(tangent) - scalars:)
      end associate
    end associate
  end function recast

  subroutine keep_phase(self, orbit)
    class(harmonic_problem_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit

    if (.not. self%equations%rate_is_unknown .or. allocated(self%equations%travel)) return
    call self%equations%anchor(orbit)
    call self%finer%anchor(orbit)
  end subroutine keep_phase

  !> The harmonics that vanish on the other branch change their sign there.
  logical function meets_other(self, before, after)
    class(harmonic_problem_t), intent(in) :: self
    type(orbit_t), intent(in) :: before, after
    real(wp) :: common
    integer :: k

    meets_other = .false.
    if (self%vanishing == 0) return
    common = 0.0_wp
    associate (f => self%equations%freedoms)
      do k = 1, min(size(before%series, 1), size(after%series, 1)) / 2
        if (.not. self%vanishes(k)) cycle
        common = common + sum(before%series(2 * k:2 * k + 1, :f) * after%series(2 * k:2 * k + 1, :f))
      end do
    end associate
    meets_other = common < 0
  end function meets_other

  !> Whether a harmonic vanishes on the other branch.
  pure logical function vanishes(self, harmonic)
    class(harmonic_problem_t), intent(in) :: self
    integer, intent(in) :: harmonic

    vanishes = self%vanishing == all_harmonics .or. self%vanishing == odd_harmonics .and. modulo(harmonic, 2) == 1 .or. &
               self%vanishing == even_harmonics .and. modulo(harmonic, 2) == 0
  end function vanishes

  !> Takes out of a direction all but the harmonics that vanish on the other branch.
  subroutine keep_vanishing(self, direction)
    class(harmonic_problem_t), intent(in) :: self
    real(wp), intent(inout) :: direction(:)   !! [unknowns + 1]
    integer :: i, k, n

    associate (equations => self%equations)
      do n = 1, equations%nodes
        i = equations%first_unknown(n)
        direction(i) = 0.0_wp
        do k = 1, equations%basis%harmonics
          if (.not. self%vanishes(k)) direction(i + 2 * k - 1:i + 2 * k) = 0.0_wp
        end do
      end do
      direction(equations%system%inner + 1:) = 0.0_wp
    end associate
  end subroutine keep_vanishing

  !> Looks for motions with another number of periods of the excitation in theirs.
  subroutine set_subharmonic(self, subharmonic)
    class(harmonic_problem_t), intent(inout) :: self
    integer, intent(in) :: subharmonic

    self%periodic%subharmonic = subharmonic
    self%equations%subharmonic = subharmonic
    self%finer%subharmonic = subharmonic
  end subroutine set_subharmonic

end module nocdyn_harmonic_problem
