!> Periodic motions by shooting: the state at the begin of a period returns after it, by integration with all events.
!>
!> The unknowns are this state, the mean speeds or the holding torque, and the parameter. The angle of each free rotation begins
!> at zero; in its place stands the speed that the motion gains along it over a period, which must vanish: of itself where no
!> torque depends on the mean speed, and else by an equation.
module nocdyn_shooting_problem
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_orbit_multipliers, only: multipliers_of
  use nocdyn_orbit_problem, only: measured, orbit_point_t, orbit_problem_t, signal_range_t
  use nocdyn_orbit_series, only: find_series, state_of_series
  use nocdyn_period_flow, only: flow_observer_t, flow_over
  use nocdyn_period_signals, only: measure_period, sample_period
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_sampled_machine, only: new_sampled_machine
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: signal_t
  use nocdyn_targets, only: target_t
  use nocdyn_text, only: rounded_text
  use nocdyn_varied_machine, only: varied_machine_t
  implicit none (type, external)
  private

  public :: new_shooting_problem

  type, extends(orbit_problem_t), public :: shooting_problem_t
    integer, private :: states = 0
    real(wp), private :: least_oscillation = 0.0_wp         !! [rad]
    real(wp), allocatable, private :: half_range(:)         !! of the states over the last period, [states]
    real(wp), allocatable, private :: monodromy(:, :)       !! of the last motion with variations
    real(wp), allocatable, private :: x(:)                  !! its unknowns
    real(wp), allocatable, private :: matrix(:, :)          !! of the equations there, without the last row
    real(wp), allocatable, private :: row(:)                !! the last row
    real(wp), allocatable, private :: factors(:, :)
    integer, allocatable, private :: pivots(:)
    integer, private :: grazed = 0                          !! a switch whose edge is touched, 0: none
    real(wp), private :: gained = 0.0_wp                    !! speed in a period, as a share of the oscillation
  contains
    procedure :: begin, put_together, correct, find_tangent, weights_of, oscillation, set_scale, complete, find_multipliers
    procedure :: find_fault, measure, resolution, sample
    procedure, private :: take_apart, free_places, scales, shoot, fill_matrix, fill_differences, factor
  end type shooting_problem_t

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  real(wp), parameter :: rtol = 1.0e-12_wp       ! of the integration
  real(wp), parameter :: coarse = 100.0_wp       ! times it, for the error
  integer, parameter :: samples = 128            ! of a period, for series
  integer, parameter :: most_iterations = 14
  integer, parameter :: most_growths = 3
  real(wp), parameter :: converged_change = 1.0e-9_wp
  real(wp), parameter :: difference = 1.0e-5_wp  ! steps of the central differences, in weighted size
  real(wp), parameter :: silent = 1.0e-30_wp     ! a machine that does not oscillate yet
  real(wp), parameter :: grazing = 1.0e-3_wp     ! rate of an indicator, as a share of the usual ones
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

  !> Places of the angles of the free rotations in the state.
  pure function free_places(self) result(places)
    class(shooting_problem_t), intent(in) :: self
    integer :: places(size(self%periodic%free))

    places = self%periodic%machine%freedoms + self%periodic%free
  end function free_places

  function put_together(self, orbit) result(x)
    class(shooting_problem_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), allocatable :: x(:)

    allocate (x(self%states + size(self%periodic%border) + 1))
    if (allocated(orbit%state)) then
      x(:self%states) = orbit%state
    else
      call state_of_series(self%periodic, orbit, x(:self%states))
    end if
    associate (f => self%periodic%machine%freedoms)
      x(f + 1:2 * f) = x(f + 1:2 * f) - matmul(self%periodic%rigid, x(self%free_places()))
    end associate
    x(self%states + 1:size(x) - 1) = self%periodic%put_border(orbit)
    x(size(x)) = orbit%value
  end function put_together

  !> The orbit of unknowns, with its state.
  subroutine take_apart(self, x, orbit)
    class(shooting_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_t), intent(inout) :: orbit

    orbit%speed = self%periodic%floating_speed
    call self%periodic%take_border(x(self%states + 1:size(x) - 1), x(size(x)), orbit)
    orbit%state = x(:self%states)
    orbit%state(self%free_places()) = 0.0_wp
  end subroutine take_apart

  !> Sizes of the states.
  pure function scales(self, rate) result(scale)
    class(shooting_problem_t), intent(in) :: self
    real(wp), intent(in) :: rate   !! [rad/s]
    real(wp) :: scale(self%states)
    real(wp) :: largest

    associate (f => self%periodic%machine%freedoms)
      largest = max(silent, self%least_oscillation, maxval(self%half_range(f + 1:2 * f)), maxval(self%half_range(:f)) / rate)
      scale(:f) = largest * rate
      scale(f + 1:2 * f) = largest
      scale(2 * f + 1:) = max(self%half_range(2 * f + 1:), sqrt(epsilon(largest)))
    end associate
  end function scales

  !> What is left after a period: of the state, and of speeds that must not be gained.
  subroutine shoot(self, x, with_variations, r, error)
    class(shooting_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    logical, intent(in) :: with_variations
    real(wp), intent(out) :: r(:)   !! [states + border]
    type(error_t), allocatable, intent(out) :: error
    type(flow_observer_t) :: observer
    type(orbit_t) :: orbit

    r = 0.0_wp
    call self%take_apart(x, orbit)
    call self%periodic%set_value(orbit, error)
    if (.not. allocated(error)) call flow(self, orbit, rtol, [0.0_wp, turn / orbit%rate], with_variations, observer, error)
    if (allocated(error)) return
    call leave(self, x, orbit, observer, r)
    if (.not. with_variations) return
    self%half_range = 0.5_wp * (observer%highest - observer%lowest)
    self%x = x
  end subroutine shoot

  !> The motion of an orbit through some times.
  subroutine flow(self, orbit, tolerance, times, with_variations, observer, error)
    class(shooting_problem_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: tolerance, times(:)
    logical, intent(in) :: with_variations
    class(flow_observer_t), intent(inout) :: observer
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: unknown = 1.0e-20_wp, usual = 1.0e-3_wp   ! sizes of states before the first motion
    real(wp) :: y(self%states)

    select type (machine => self%periodic%machine%formulation)
    class is (varied_machine_t)
      machine%scale = self%scales(orbit%rate)
      where (.not. machine%scale > unknown) machine%scale = usual
      machine%duration = times(size(times))
      machine%outside = self%periodic%holding_acceleration(orbit%torque)
      y = orbit%state
      call machine%begin_variations(0.0_wp, y, with_variations)
      observer%mean_rate = spread(0.0_wp, 1, self%states)
      associate (f => self%periodic%machine%freedoms)
        observer%mean_rate(f + 1:2 * f) = matmul(self%periodic%rigid, orbit%speed)
      end associate
      call flow_over(machine, tolerance, times, y, observer, error)
      self%grazed = 0
      if (machine%slowest < grazing) self%grazed = machine%grazed
      if (with_variations .and. .not. allocated(error)) self%monodromy = machine%variations
      machine%is_varied = .false.
    class default
      error stop 'nocdyn_shooting_problem: the machine carries no variations'
    end select
  end subroutine flow

  !> What is left after a period.
  pure subroutine leave(self, x, orbit, observer, r)
    class(shooting_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_t), intent(in) :: orbit
    type(flow_observer_t), intent(in) :: observer
    real(wp), intent(out) :: r(:)
    integer :: places(size(self%periodic%free))
    real(wp) :: free(size(self%periodic%free))

    places = self%free_places()
    free = x(places)
    associate (n => self%states, f => self%periodic%machine%freedoms, last => size(observer%samples, 2))
      r(:n) = observer%samples(:, last) - orbit%state
      r(f + 1:2 * f) = r(f + 1:2 * f) - observer%mean_rate(f + 1:2 * f) * (turn / orbit%rate)
      r(:f) = r(:f) - matmul(self%periodic%rigid, free)
      r(n + 1:) = x(places(self%periodic%border))
    end associate
  end subroutine leave

  !> The matrix of the equations by the variations, after `shoot` with them; the columns of differences stay.
  subroutine fill_matrix(self)
    class(shooting_problem_t), intent(inout) :: self
    integer :: i, k, m, places(size(self%periodic%free))

    places = self%free_places()
    associate (n => self%states, f => self%periodic%machine%freedoms)
      self%matrix(:, :n) = 0.0_wp
      do i = 1, n
        if (any(places == i)) cycle
        self%matrix(:n, i) = self%monodromy(:, i)
        self%matrix(i, i) = self%matrix(i, i) - 1.0_wp
      end do
      do m = 1, size(places)
        self%matrix(:f, places(m)) = -self%periodic%rigid(:, m)
      end do
      do k = 1, size(self%periodic%border)
        self%matrix(n + k, places(self%periodic%border(k))) = 1.0_wp
      end do
    end associate
  end subroutine fill_matrix

  !> The columns of mean speeds, of the holding torque and of the parameter by central differences; those of the parameter do not
  !> leave its range.
  subroutine fill_differences(self, x, error)
    class(shooting_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), dimension(size(x) - 1) :: after, before
    real(wp) :: ends(2), other(size(x)), weights(size(x))
    integer :: i

    weights = self%weights_of(x)
    do i = self%states + 1, size(x)
      ends = x(i) + [-difference, difference] / weights(i)
      if (i == size(x)) ends = min(max(ends, self%periodic%bounds(1)), self%periodic%bounds(2))
      other = x
      other(i) = ends(1)
      call self%shoot(other, .false., before, error)
      if (allocated(error)) return
      other(i) = ends(2)
      call self%shoot(other, .false., after, error)
      if (allocated(error)) return
      self%matrix(:, i) = (after - before) / (ends(2) - ends(1))
    end do
  end subroutine fill_differences

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
    call flow(self, point%orbit, rtol, times, .false., fine, error)
    if (.not. allocated(error)) call flow(self, point%orbit, coarse * rtol, times, .false., rough, error)
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
    if (.not. allocated(error)) call flow(self, orbit, rtol, [0.0_wp, turn / orbit%rate], .true., observer, error)
    if (allocated(error)) return
    matrix = self%monodromy
    associate (f => self%periodic%machine%freedoms, free => self%periodic%free, rigid => self%periodic%rigid)
      n = size(free)
      allocate (known(self%states, 2 * n - size(self%periodic%border)), source=0.0_wp)
      do m = 1, size(free)
        known(f + 1:2 * f, m) = rigid(:, m)
        if (m == self%periodic%period%motion) then
          select type (machine => self%periodic%machine%formulation)
          class is (varied_machine_t)
            call machine%start_lane(1, 0.0_wp, orbit%state)
            call machine%rates_at(0.0_wp, orbit%state, known(:, m))
          end select
        end if
        if (any(self%periodic%border == m)) cycle
        n = n + 1
        known(:f, n) = rigid(:, m)
      end do
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
    if (.not. allocated(error)) call measure_period(self%periodic, point%orbit, rtol, signals, ranges, error)
  end subroutine measure

  subroutine sample(self, point, signals, least_samples, samples, error)
    class(shooting_problem_t), target, intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(signal_t), intent(in) :: signals(:)
    integer, intent(in) :: least_samples
    type(signal_samples_t), intent(out) :: samples
    type(error_t), allocatable, intent(out) :: error

    call self%periodic%set_value(point%orbit, error)
    if (.not. allocated(error)) call sample_period(self%periodic, point%orbit, rtol, signals, least_samples, samples, error)
  end subroutine sample

  function resolution(self) result(words)
    class(shooting_problem_t), intent(in) :: self
    character(len=:), allocatable :: words

    words = 'shooting'
    if (self%grazed > 0) words = words // '; the motion touches the ' // &
                                 self%periodic%machine%formulation%switch_name(self%grazed) // ' almost tangentially'
  end function resolution

end module nocdyn_shooting_problem
