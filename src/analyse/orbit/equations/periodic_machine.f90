!> A machine that is excited periodically: the period, its free rotations, and the parameter over which its motions are followed.
!>
!> A rigid motion r turns with a mean speed Omega, an unknown; its mean angle is zero. Where the speed of a body is given, the
!> mean torque that holds it is the unknown.
module nocdyn_periodic_machine
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_period, only: follow_period, orbit_period_t
  use nocdyn_sampled_machine, only: sampled_machine_t
  implicit none (type, external)
  private

  public :: body_turning

  !> A periodic motion.
  type, public :: orbit_t
    real(wp) :: value = 0.0_wp                  !! of the parameter, in its unit; of a held speed [rad/s]
    real(wp) :: rate = 0.0_wp                   !! w [rad/s]
    integer :: subharmonic = 1                  !! periods of the excitation in its period
    real(wp), allocatable :: series(:, :)       !! of q [rad] and z, [length, nodes]
    real(wp), allocatable :: speed(:)           !! Omega of the rigid motions [rad/s]
    real(wp) :: torque = 0.0_wp                 !! mean torque that holds the speed of a body [N m]
    real(wp) :: damping = 0.0_wp                !! by which a conservative machine would have to be damped, in w
    real(wp), allocatable :: state(:)           !! at the begin of a period, if it is known, [states]
  end type orbit_t

  type, public :: periodic_machine_t
    type(sampled_machine_t) :: machine
    type(orbit_period_t) :: period
    logical :: rate_is_unknown = .false.             !! whether the machine itself finds w
    real(wp), allocatable :: travel(:)               !! of a conservative machine, where an amplitude is the parameter: the angle
                                                     !! that has it, by the coordinates; not allocated: none
    real(wp), allocatable :: origin(:)               !! angles of the coordinates of a conservative machine in balance [rad]
    logical :: is_over_energy = .false.              !! whether its energy is the parameter, in place of the amplitude
    integer :: subharmonic = 1
    real(wp) :: bounds(2) = 0.0_wp                   !! lowest and highest value of the parameter
    integer :: held = 0                              !! body whose mean speed is the parameter; 0: none
    integer :: held_motion = 0                       !! the rigid motion whose speed the held body gives
    integer, allocatable :: free(:)                  !! coordinate of each rigid motion
    real(wp), allocatable :: rigid(:, :)             !! r, [coordinates, motions]
    real(wp), allocatable :: turning(:, :)           !! speeds of the bodies by the rigid motions, [bodies, motions]
    real(wp), allocatable :: floating_speed(:)       !! speeds of the rigid motions that no torque acts on, else any [rad/s]
    integer, allocatable :: border(:)                !! rigid motions whose speed, or holding torque, is unknown
  contains
    procedure :: conservative_energy, energy_slopes
    procedure :: set_value, find_rate, take_border, put_border, holding_acceleration, repeats
  end type periodic_machine_t

contains

  !> Speeds of the bodies by the rigid motions, [bodies, motions].
  pure function body_turning(machine, rigid) result(turning)
    type(sampled_machine_t), intent(in) :: machine
    real(wp), intent(in) :: rigid(:, :)   !! [coordinates, motions]
    real(wp) :: turning(machine%formulation%machine%bodies, size(rigid, 2))
    integer :: b, k

    turning = 0.0_wp
    associate (coordinates => machine%formulation%machine%coordinates)
      do b = 1, size(turning, 1)
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          turning(b, :) = turning(b, :) + coordinates%ratio(1, k) * rigid(coordinates%coordinate(k), :)
        end do
      end do
    end associate
  end function body_turning

  !> Gives an orbit its value, its unknown speeds and the holding torque.
  subroutine take_border(self, unknowns, value, orbit)
    class(periodic_machine_t), intent(in) :: self
    real(wp), intent(in) :: unknowns(:)     !! [border]
    real(wp), intent(in) :: value           !! of the parameter
    type(orbit_t), intent(inout) :: orbit   !! with speeds
    integer :: n

    do n = 1, size(self%border)
      if (self%border(n) == self%held_motion) then
        orbit%torque = unknowns(n)
      else
        orbit%speed(self%border(n)) = unknowns(n)
      end if
    end do
    orbit%value = value
    orbit%subharmonic = self%subharmonic
    if (self%held_motion > 0) then
      associate (turning => self%turning(self%held, :), m => self%held_motion)
        orbit%speed(m) = 0.0_wp
        orbit%speed(m) = (orbit%value - dot_product(turning, orbit%speed)) / turning(m)
      end associate
    end if
    call self%find_rate(orbit)
  end subroutine take_border

  !> The unknown speeds and the holding torque of an orbit, [border].
  pure function put_border(self, orbit) result(unknowns)
    class(periodic_machine_t), intent(in) :: self
    type(orbit_t), intent(in) :: orbit
    real(wp) :: unknowns(size(self%border))
    integer :: n

    do n = 1, size(self%border)
      unknowns(n) = orbit%speed(self%border(n))
      if (self%border(n) == self%held_motion) unknowns(n) = orbit%torque
    end do
  end function put_border

  !> w of an orbit, if it is prescribed.
  subroutine find_rate(self, orbit)
    class(periodic_machine_t), intent(in) :: self
    type(orbit_t), intent(inout) :: orbit

    if (self%rate_is_unknown) return
    orbit%rate = self%period%rate / orbit%subharmonic
    if (self%period%motion > 0) orbit%rate = orbit%rate * abs(orbit%speed(self%period%motion))
  end subroutine find_rate

  !> Gives the parameter the value of an orbit, and this its w.
  subroutine set_value(self, orbit, error)
    class(periodic_machine_t), intent(inout) :: self
    type(orbit_t), intent(inout) :: orbit
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: before

    before = self%machine%value
    call self%machine%set_value(orbit%value, error)
    if (allocated(error)) return
    associate (machine => self%machine%formulation%machine)
      if (abs(self%machine%value - before) > 0) call follow_period(machine, self%turning, self%period, error)
    end associate
    if (.not. allocated(error)) call self%find_rate(orbit)
  end subroutine set_value

  !> Accelerations of the coordinates by a torque on the held body [rad/s2], zeros if none is held.
  pure function holding_acceleration(self, torque) result(acceleration)
    class(periodic_machine_t), intent(in) :: self
    real(wp), intent(in) :: torque   !! [N m]
    real(wp) :: acceleration(self%machine%freedoms)
    integer :: k

    acceleration = 0.0_wp
    if (self%held == 0) return
    associate (coordinates => self%machine%formulation%machine%coordinates)
      do k = coordinates%first(self%held), coordinates%first(self%held + 1) - 1
        associate (one => acceleration(coordinates%coordinate(k)))
          one = one + coordinates%response(1, k) * torque
        end associate
      end do
    end associate
  end function holding_acceleration

  !> The energy of a conservative machine at rest at some angles, above the one at other angles [J]: the work against its torques
  !> along a straight line, by Gauss's formula of four points in as many parts as samples allow.
  subroutine conservative_energy(self, from, angles, energy, error)
    class(periodic_machine_t), intent(inout) :: self
    real(wp), intent(in) :: from(:), angles(:)   !! of the coordinates [rad]
    real(wp), intent(out) :: energy
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: points = 4
    real(wp), parameter :: near = sqrt(3.0_wp / 7.0_wp - 2.0_wp / 7.0_wp * sqrt(1.2_wp)), &
                           far = sqrt(3.0_wp / 7.0_wp + 2.0_wp / 7.0_wp * sqrt(1.2_wp))
    real(wp), parameter :: place(points) = [-far, -near, near, far]
    real(wp), parameter :: large = (18.0_wp + sqrt(30.0_wp)) / 72.0_wp, small = (18.0_wp - sqrt(30.0_wp)) / 72.0_wp
    real(wp), parameter :: share(points) = [small, large, large, small]
    real(wp) :: t(self%machine%samples)
    real(wp), dimension(self%machine%samples, self%machine%states) :: rates, y
    integer :: i, k, parts

    t = 0.0_wp
    y = 0.0_wp
    rates = 0.0_wp
    parts = self%machine%samples / points
    associate (f => self%machine%freedoms)
      y(:, f + 1:2 * f) = spread(from, 1, size(t))
      do i = 1, parts
        do k = 1, points
          y(points * (i - 1) + k, f + 1:2 * f) = from + (i - 0.5_wp + 0.5_wp * place(k)) / parts * (angles - from)
        end do
      end do
      call self%machine%rates(t, y, rates, error)
      if (allocated(error)) return
      energy = 0.0_wp
      do i = 1, parts
        do k = 1, points
          energy = energy + share(k) / parts * &
                   dot_product(self%energy_slopes(rates(points * (i - 1) + k, :f)), angles - from)
        end do
      end do
    end associate
  end subroutine conservative_energy

  !> Derivatives of this energy by the angles of the coordinates, from their accelerations [N m].
  pure function energy_slopes(self, acceleration) result(slopes)
    class(periodic_machine_t), intent(in) :: self
    real(wp), intent(in) :: acceleration(:)   !! [rad/s2]
    real(wp) :: slopes(size(acceleration))
    real(wp) :: rate
    integer :: b, k

    slopes = 0.0_wp
    associate (machine => self%machine%formulation%machine, coordinates => self%machine%formulation%machine%coordinates)
      do b = 1, machine%bodies
        rate = 0.0_wp
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          rate = rate + coordinates%ratio(1, k) * acceleration(coordinates%coordinate(k))
        end do
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          associate (slope => slopes(coordinates%coordinate(k)))
            slope = slope - coordinates%ratio(1, k) * machine%inertia(1, b) * rate
          end associate
        end do
      end do
    end associate
  end function energy_slopes

  !> Whether the laws repeat themselves some periods later, at the same motion.
  subroutine repeats(self, motion, turns, is_periodic, error)
    class(periodic_machine_t), intent(inout) :: self
    type(orbit_t), intent(inout) :: motion   !! of which the mean values and speeds count
    integer, intent(in) :: turns
    logical, intent(out) :: is_periodic
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: noise = 1.0e-7_wp
    integer, parameter :: times = 24   ! of a period, a multiple of the samples
    real(wp), dimension(times, self%machine%states) :: first, second

    is_periodic = .false.
    call self%set_value(motion, error)
    if (.not. allocated(error)) call find_rates(self, motion, 0, first, error)
    if (.not. allocated(error)) call find_rates(self, motion, turns, second, error)
    if (allocated(error)) return
    associate (f => self%machine%freedoms)
      first(:, f + 1:2 * f) = second(:, f + 1:2 * f)
      is_periodic = all(abs(first - second) <= noise * spread(maxval(abs(first), dim=1) + maxval(abs(first(:, :f))), 1, &
                                                              size(first, 1)))
    end associate
  end subroutine repeats

  !> The rates of a motion without oscillation at even times of a period, some periods later.
  subroutine find_rates(self, motion, turns, rates, error)
    class(periodic_machine_t), intent(inout) :: self
    type(orbit_t), intent(in) :: motion
    integer, intent(in) :: turns
    real(wp), intent(out) :: rates(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp), faster = 1.1_wp
    real(wp) :: steady(self%machine%freedoms), t(self%machine%samples), y(self%machine%samples, self%machine%states)
    real(wp) :: dydt(self%machine%samples, self%machine%states)
    integer :: c, first, i, n

    rates = 0.0_wp
    steady = matmul(self%rigid, motion%speed)
    if (self%rate_is_unknown) steady = faster * steady   ! a steady state has no accelerations with which to compare
    n = self%machine%samples
    do first = 0, size(rates, 1) - n, n
      t = (turns + [(first + i, i=0, n - 1)] / real(size(rates, 1), wp)) * turn / motion%rate
      associate (f => self%machine%freedoms)
        y(:, :f) = spread(steady, 1, n)
        y(:, f + 1:) = spread(motion%series(1, :), 1, n)
        do c = 1, f
          y(:, f + c) = y(:, f + c) + steady(c) * t
        end do
      end associate
      dydt = 0.0_wp
      call self%machine%rates(t, y, dydt, error)
      if (allocated(error)) return
      rates(first + 1:first + n, :) = dydt
    end do
  end subroutine find_rates

end module nocdyn_periodic_machine
