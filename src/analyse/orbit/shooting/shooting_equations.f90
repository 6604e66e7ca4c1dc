!> The equations of a periodic motion by shooting: the state at the begin of a period returns after it, by integration with all
!> events.
!>
!> The unknowns are this state, the mean speeds or the holding torque, and the parameter. The angle of each free rotation begins
!> at zero; in its place stands the speed that the motion gains along it over a period, which must vanish: of itself where no
!> torque depends on the mean speed, and else by an equation.
!>
!> Where nothing prescribes the period, its rate is unknown too, and the state at the begin lies in a plane across the motion at
!> another begin.
module nocdyn_shooting_equations
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_problem, only: orbit_problem_t
  use nocdyn_orbit_series, only: state_of_series
  use nocdyn_period_flow, only: flow_observer_t, flow_over
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_varied_machine, only: varied_machine_t
  implicit none (type, external)
  private

  type, abstract, extends(orbit_problem_t), public :: shooting_equations_t
    integer :: states = 0
    real(wp) :: least_oscillation = 0.0_wp         !! [rad]
    real(wp), allocatable :: half_range(:)         !! of the states over the last period, [states]
    real(wp), allocatable :: monodromy(:, :)       !! of the last motion with variations
    real(wp), allocatable :: x(:)                  !! its unknowns
    real(wp), allocatable :: matrix(:, :)          !! of the equations there, without the last row
    integer :: grazed = 0                          !! a switch whose edge is touched, 0: none
    real(wp), allocatable, private :: reference(:) !! a begin, through which the plane goes
    real(wp), allocatable, private :: across(:)    !! normal of this plane
  contains
    procedure :: put_together, take_apart, scalars, free_places, find_rates, scales, keep_phase
    procedure :: shoot, flow, fill_matrix, fill_differences
  end type shooting_equations_t

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  real(wp), parameter, public :: shooting_rtol = 1.0e-12_wp   !! of the integration
  real(wp), parameter :: difference = 1.0e-5_wp  ! steps of the central differences, in weighted size
  real(wp), parameter :: grazing = 1.0e-3_wp     ! rate of an indicator, as a share of the usual ones
  real(wp), parameter, public :: silent = 1.0e-30_wp          !! a machine that does not oscillate yet

contains

  !> Places of the angles of the free rotations in the state.
  pure function free_places(self) result(places)
    class(shooting_equations_t), intent(in) :: self
    integer :: places(size(self%periodic%free))

    places = self%periodic%machine%freedoms + self%periodic%free
  end function free_places

  !> The number of unknowns beside the state, without the parameter.
  pure integer function scalars(self)
    class(shooting_equations_t), intent(in) :: self

    scalars = size(self%periodic%border) + merge(1, 0, self%periodic%rate_is_unknown)
  end function scalars

  function put_together(self, orbit) result(x)
    class(shooting_equations_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), allocatable :: x(:)

    allocate (x(self%states + self%scalars() + 1))
    if (allocated(orbit%state)) then
      x(:self%states) = orbit%state
    else
      call state_of_series(self%periodic, orbit, x(:self%states))
    end if
    associate (f => self%periodic%machine%freedoms)
      x(f + 1:2 * f) = x(f + 1:2 * f) - matmul(self%periodic%rigid, x(self%free_places()))
    end associate
    associate (n => self%states)
      x(n + 1:n + size(self%periodic%border)) = self%periodic%put_border(orbit)
    end associate
    if (self%periodic%rate_is_unknown) x(size(x) - 1) = orbit%rate
    x(size(x)) = orbit%value
  end function put_together

  !> The orbit of unknowns, with its state.
  subroutine take_apart(self, x, orbit)
    class(shooting_equations_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    type(orbit_t), intent(inout) :: orbit

    orbit%speed = self%periodic%floating_speed
    associate (n => self%states)
      call self%periodic%take_border(x(n + 1:n + size(self%periodic%border)), x(size(x)), orbit)
    end associate
    if (self%periodic%rate_is_unknown) orbit%rate = x(size(x) - 1)
    orbit%state = x(:self%states)
    orbit%state(self%free_places()) = 0.0_wp
  end subroutine take_apart

  !> Sizes of the states.
  pure function scales(self, rate) result(scale)
    class(shooting_equations_t), intent(in) :: self
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
    class(shooting_equations_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    logical, intent(in) :: with_variations
    real(wp), intent(out) :: r(:)   !! [states + scalars]
    type(error_t), allocatable, intent(out) :: error
    type(flow_observer_t) :: observer
    type(orbit_t) :: orbit

    r = 0.0_wp
    call self%take_apart(x, orbit)
    call self%periodic%set_value(orbit, error)
    if (allocated(error)) return
    call self%flow(orbit, shooting_rtol, [0.0_wp, turn / orbit%rate], with_variations, observer, error)
    if (allocated(error)) return
    call leave(self, x, orbit, observer, r)
    if (.not. with_variations) return
    self%half_range = 0.5_wp * (observer%highest - observer%lowest)
    self%x = x
  end subroutine shoot

  !> The motion of an orbit through some times.
  subroutine flow(self, orbit, tolerance, times, with_variations, observer, error)
    class(shooting_equations_t), intent(inout) :: self
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
    class(shooting_equations_t), intent(in) :: self
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
      r(n + 1:n + size(self%periodic%border)) = x(places(self%periodic%border))
    end associate
    if (self%periodic%rate_is_unknown) r(size(r)) = dot_product(self%across, orbit%state - self%reference)
  end subroutine leave

  !> The rates of the state at the begin of an orbit, whose value has been set.
  subroutine find_rates(self, orbit, rates)
    class(shooting_equations_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(out) :: rates(:)

    select type (machine => self%periodic%machine%formulation)
    class is (varied_machine_t)
      call machine%start_lane(1, 0.0_wp, orbit%state)
      call machine%rates_at(0.0_wp, orbit%state, rates)
    end select
  end subroutine find_rates

  !> Begins lie in the plane across the motion at the begin of an orbit from now on.
  subroutine keep_phase(self, orbit)
    class(shooting_equations_t), intent(inout) :: self
    type(orbit_t), intent(in) :: orbit
    type(orbit_t) :: motion
    type(error_t), allocatable :: error
    real(wp), allocatable :: x(:)
    real(wp) :: rates(self%states), scale(self%states)

    if (.not. self%periodic%rate_is_unknown) return
    motion = orbit
    x = self%put_together(orbit)
    call self%take_apart(x, motion)
    call self%periodic%set_value(motion, error)   ! of which it has been found
    call self%find_rates(motion, rates)
    associate (f => self%periodic%machine%freedoms)
      rates(f + 1:2 * f) = rates(f + 1:2 * f) - matmul(self%periodic%rigid, motion%speed)
    end associate
    rates(self%free_places()) = 0.0_wp
    associate (f => self%periodic%machine%freedoms, largest => maxval(abs(orbit%series(2:, :)), dim=1))
      scale(f + 1:2 * f) = maxval(largest(:f))
      scale(:f) = scale(f + 1) * motion%rate
      scale(2 * f + 1:) = largest(f + 1:)
    end associate
    scale = max(scale, silent)
    self%reference = motion%state
    self%across = rates / scale**2
    self%across = self%across / norm2(self%across * scale)
  end subroutine keep_phase

  !> The matrix of the equations by the variations, after `shoot` with them; the columns of differences stay.
  subroutine fill_matrix(self)
    class(shooting_equations_t), intent(inout) :: self
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
      if (self%periodic%rate_is_unknown) self%matrix(size(self%matrix, 1), :n) = self%across
    end associate
  end subroutine fill_matrix

  !> The columns of mean speeds, of the holding torque and of the parameter by central differences; those of the parameter do not
  !> leave its range.
  subroutine fill_differences(self, x, error)
    class(shooting_equations_t), intent(inout) :: self
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

end module nocdyn_shooting_equations
