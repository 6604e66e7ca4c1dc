!> Steady states of a machine whose speed is held, and the machine linearised there.
!>
!> Mean torques at an arbitrary speed of the reference body need not balance. The drive is what holds the speed: the torques of
!> all motors are multiplied by one factor if they drive at that speed, as by a throttle. Induction motors have the slip that the
!> load asks for by the frequency of their supply instead: a factor would leave them at the slip of that speed on the mains, where
!> their torque falls with the slip and their field is no spring. If there are no such motors, a torque on the reference body
!> holds the speed. Governors leave their throttles open while the speed is found; then they hold it.
!>
!> A drive that turns the reference body holds its speed, whatever the torques are; drives that turn with it keep their ratios.
!> What is free has the speeds at which its torques balance.
module nocdyn_held_speeds
  use nocdyn_driven_speeds, only: moves_with
  use nocdyn_equilibrium, only: mean_formulation, t_infinity
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_held_drives, only: all_follow, close_speed_loops, find_free_speeds, follow_free_speeds, idle_share, &
    refuse_standing_friction, set_supplies, sources_of
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_slopes, only: new_slopes, slopes_t
  use nocdyn_static_twists, only: find_twists, twist_problem_t
  use nocdyn_text, only: quoted
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  implicit none (type, external)
  private

  public :: new_held_speeds

  !> The machine linearised about a steady state. Moments act on `to` and, with the other sign, on `from`.
  type, public :: held_state_t
    real(wp) :: speed = 0.0_wp    !! of the reference body, or the frequency of a shaker in a steady state [rad/s]
    real(wp) :: factor = 0.0_wp   !! on the torques of the motors that holds the speed; 0 if a torque does
    real(wp) :: supply = 0.0_wp   !! share of the frequency of the supplies that holds it; 0 if they do not follow
    real(wp) :: torque = 0.0_wp   !! on the reference body that holds the speed [N m]; 0 if the motors do
    real(wp), allocatable :: omega(:)       !! speeds of the bodies [rad/s], [bodies]
    real(wp), allocatable :: phi(:)         !! angles of the bodies when the one of the reference body is zero [rad], [bodies]
    real(wp), allocatable :: twist(:)       !! of the elements [rad], [elements]
    real(wp), allocatable :: rate(:)        !! of twist [rad/s], [elements]
    real(wp), allocatable :: mean(:)        !! moments of the elements [N m], [elements] as all that follow
    type(slopes_t) :: slopes                !! about this state; weighted by `factor` of the motors
  contains
    procedure :: is_driven
  end type held_state_t

  !> The steady states of one machine over the speed, each found from the one before.
  type, public :: held_speeds_t
    type(torque_balance_t) :: balance        !! of the machine with mean torques
    integer :: reference = 0                 !! body whose speed is held
    integer, allocatable :: sources(:)               !! elements whose torques are multiplied, numbered in `balance%inelastic`
    real(wp), allocatable :: ratio(:)                !! speed of the reference body by the rigid motions, [freedoms]
    real(wp), allocatable, private :: z(:)           !! last rigid motions and internal states
    real(wp), allocatable, private :: q(:)           !! last angles of the coordinates [rad]
    type(twist_problem_t), private :: twists
    real(wp), private :: last_speed = 0.0_wp         !! of these
    real(wp), allocatable :: carried(:)              !! speeds of the bodies that a drive turns with the reference body, per speed
                                                     !! of that; not allocated: no drive turns it, [bodies]
    logical :: is_free = .false.                     !! whether nothing holds the speed: there is one steady state
    type(held_state_t), allocatable, private :: steady   !! this one, once it is found
    real(wp), allocatable, private :: beside(:)      !! speeds that other drives give the bodies [rad/s], [bodies]
    logical :: motors_hold = .false.                 !! whether the motors hold the speed, else a torque
    logical :: supply_holds = .false.                !! whether they do so by the frequency of their supply
    logical :: lacks_twists = .false.                !! whether the torques balanced in the last search, but no twists carry them
    real(wp), allocatable :: weight(:)               !! of the last state on the moments, [elements]
    real(wp) :: lead = 0.0_wp                        !! of the last state: angle over speed of the reference body [s]
    real(wp), private :: slip = 0.0_wp               !! last share of the frequency beyond that without slip of the first motor
  contains
    procedure :: hold, has_drive, forget
  end type held_speeds_t

contains

  !> Prepares the search. A reference body that cannot turn steadily is refused. At a time a torque holds the speed, beside motors
  !> with their governors and supplies.
  subroutine new_held_speeds(machine, reference, self, error, is_free, t)
    type(machine_t), intent(in) :: machine   !! one lane
    integer, intent(in) :: reference         !! body
    type(held_speeds_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: is_free   !! whether it is the steady state nearest to the start; absent: no
    real(wp), intent(in), optional :: t        !! the time [s]; absent: after all changes, and the drive holds the speed

    self%reference = reference
    if (present(is_free)) self%is_free = is_free
    self%sources = [integer ::]
    if (present(t)) then
      call set_up(machine, .false., t, self)
    else
      call set_up(machine, .not. self%is_free, t_infinity, self)
    end if
    if (self%is_free) return
    if (.not. any(abs(self%ratio) > 0) .and. allocated(machine%driven_speed)) then
      if (abs(machine%driven_speed(reference)) > 0) call let_drive_hold(machine, self)
      if (allocated(self%carried)) return
    end if
    if (.not. any(abs(self%ratio) > 0)) then
      call raise(error, exit_input, quoted(machine%names(reference)%text) // ' is held by couplings or joints: it has no ' // &
                 'steady speed but 0; allowed: a body that can turn on, or frequency in place of speed')
      return
    end if
    if (.not. present(t)) self%sources = sources_of(self%balance)
    self%supply_holds = all_follow(self%balance, self%sources)
    self%last_speed = sum(self%ratio * self%z(:size(self%ratio)))
  end subroutine new_held_speeds

  !> Sets up the balance at the start.
  subroutine set_up(machine, holds_speed, t, self)
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: holds_speed   !! as in `mean_formulation`
    real(wp), intent(in) :: t            !! [s]
    type(held_speeds_t), intent(inout) :: self
    class(formulation_t), allocatable :: formulation

    call mean_formulation(machine, formulation, holds_speed)
    call set_up_balance(formulation, t, self%balance)
    self%ratio = spread(0.0_wp, 1, size(self%balance%motions%free))
    call find_ratios(self%balance, self%reference, self%ratio)
    self%z = self%balance%start()
    self%q = spread(0.0_wp, 1, self%balance%coordinates)
  end subroutine set_up

  !> Lets the drive that turns the reference body hold its speed.
  subroutine let_drive_hold(machine, self)
    type(machine_t), intent(in) :: machine
    type(held_speeds_t), intent(inout) :: self
    logical, allocatable :: is_carried(:)

    allocate (is_carried, source=moves_with(machine, self%reference))
    self%carried = merge(machine%driven_speed, 0.0_wp, is_carried) / machine%driven_speed(self%reference)
    self%beside = merge(0.0_wp, machine%driven_speed, is_carried)
    call set_up(machine, .false., t_infinity, self)
  end subroutine let_drive_hold

  !> Finds the speeds of what is free where a drive holds the speed.
  subroutine follow_drive(self, speed, z, error)
    type(held_speeds_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! of the reference body [rad/s]
    real(wp), intent(out) :: z(:)   !! rigid motions and internal states
    type(error_t), allocatable, intent(out) :: error

    z = self%z
    call self%balance%turn_drives(speed * self%carried + self%beside)
    if (abs(self%last_speed) > 0) then
      z(:size(self%ratio)) = z(:size(self%ratio)) * (speed / self%last_speed)
      call self%balance%settle(z)
      call follow_free_speeds(self%balance, z, error)
    else
      call find_free_speeds(self%balance, z, error)
    end if
  end subroutine follow_drive

  !> The speed of a body in each rigid motion.
  subroutine find_ratios(balance, body, ratio)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: body
    real(wp), intent(out) :: ratio(:)   !! [rigid motions]
    real(wp) :: omega(balance%formulation%machine%bodies), one(size(ratio))
    integer :: i

    do i = 1, size(ratio)
      one = 0.0_wp
      one(i) = 1.0_wp
      omega = balance%body_speeds(one)
      ratio(i) = omega(body)
    end do
  end subroutine find_ratios

  subroutine iterate_supplies(self, speed, z, share, is_found)
    type(held_speeds_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp), intent(inout) :: z(:)
    real(wp), intent(inout) :: share
    logical, intent(out) :: is_found
    integer, parameter :: most_steps = 50
    real(wp), parameter :: tolerance = 1.0e-12_wp, difference = 1.0e-7_wp, most_slip = 0.5_wp
    real(wp), dimension(size(self%ratio)) :: missing, moved, scale, sources
    real(wp) :: matrix(size(missing), size(missing)), other(size(z))
    integer :: i, k, pivot, pivots(size(missing))
    logical :: is_singular

    pivot = maxloc(abs(self%ratio), dim=1)
    is_found = .false.
    do i = 1, most_steps
      do k = 1, size(missing)
        other = z
        if (k == pivot) then
          call set_supplies(self%balance, share + difference)
        else
          call set_supplies(self%balance, share)
          other(k) = other(k) + difference * abs(speed)
          call impose(self, pivot, speed, other)
        end if
        call residuals(self, other, moved, sources, scale)
        matrix(:, k) = moved + sources
      end do
      call set_supplies(self%balance, share)
      call residuals(self, z, moved, sources, scale)
      missing = -(moved + sources)
      is_found = is_found .or. all(abs(missing) <= tolerance * scale)
      if (is_found) return
      do k = 1, size(missing)
        matrix(:, k) = (matrix(:, k) + missing) / merge(difference, difference * abs(speed), k == pivot)
      end do
      call lu_factor(matrix, pivots, is_singular)
      if (is_singular) return
      call lu_solve(matrix, pivots, missing)
      share = share + missing(pivot)
      is_found = abs(missing(pivot)) <= tolerance * abs(share)   ! the next state is the last one
      missing(pivot) = 0.0_wp
      z(:size(missing)) = z(:size(missing)) + missing
      is_found = is_found .and. all(abs(missing) <= tolerance * abs(speed))
      call impose(self, pivot, speed, z)
      if (.not. all(is_finite([z, share]))) return
      if (abs(share - idle_share(self%balance, self%sources)) > most_slip) return
    end do
    is_found = .false.
  end subroutine iterate_supplies

  !> Finds the steady state at a speed of the reference body, and linearises the machine there.
  subroutine hold(self, speed, state, error)
    class(held_speeds_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! [rad/s], not zero
    type(held_state_t), intent(out) :: state
    type(error_t), allocatable, intent(out) :: error   !! without the speed, which the caller knows
    real(wp) :: z(size(self%z)), held
    logical :: is_found
    integer :: attempt

    self%lacks_twists = .false.
    if (allocated(self%steady)) then
      state = self%steady
      state%speed = speed
      return
    end if
    self%motors_hold = size(self%sources) > 0
    is_found = self%is_free
    held = 0.0_wp
    z = self%z
    if (self%is_free) then
      call find_free_speeds(self%balance, z, error)
      if (allocated(error)) return
    else if (allocated(self%carried)) then
      call follow_drive(self, speed, z, error)
      if (allocated(error)) return
      is_found = .true.
    else if (self%supply_holds) then
      ! Solves for the frequency of the supplies, by Newton's method from the last slip, and from no slip if that fails: the
      ! torque over the slip is concave up to the largest one.
      do attempt = 1, 2
        z = self%z
        if (abs(self%last_speed) > 0) z(:size(self%ratio)) = z(:size(self%ratio)) * (speed / self%last_speed)
        call impose(self, maxloc(abs(self%ratio), dim=1), speed, z)
        call set_supplies(self%balance, 1.0_wp)
        call self%balance%settle(z)
        call self%balance%evaluate(z)
        state%supply = idle_share(self%balance, self%sources)
        if (attempt == 1) state%supply = state%supply + self%slip
        call iterate_supplies(self, speed, z, state%supply, is_found)
        if (is_found) exit
      end do
      if (is_found) then
        self%slip = state%supply - idle_share(self%balance, self%sources)
      else
        call set_supplies(self%balance, idle_share(self%balance, self%sources))
        self%slip = 0.0_wp
      end if
      self%motors_hold = is_found
      held = 1.0_wp
      if (.not. is_found) state%supply = 0.0_wp
    else if (self%motors_hold) then
      call balance_speeds(self, speed, z, held, is_found)
      self%motors_hold = is_found .and. held >= 0 .and. source_power(self) > 0
    end if
    if (.not. (self%motors_hold .or. self%is_free .or. allocated(self%carried))) then
      call balance_speeds(self, speed, z, held, is_found)
    end if
    if (.not. is_found) then
      call raise(error, exit_failed, 'the speeds of the machine were not found: no torques of the drive balance the others')
      return
    end if
    state%speed = speed
    if (self%motors_hold) state%factor = held
    if (.not. self%motors_hold) state%torque = held
    call find_state(self, z, state, error)
    if (allocated(error)) return
    self%z = z
    self%last_speed = speed
    if (self%is_free) self%steady = state
  end subroutine hold

  !> After a change of numbers: a single steady state is to be found again.
  subroutine forget(self)
    class(held_speeds_t), intent(inout) :: self

    if (allocated(self%steady)) deallocate (self%steady)
  end subroutine forget

  !> Whether motors or engines can hold the speed.
  pure logical function has_drive(self)
    class(held_speeds_t), intent(in) :: self

    has_drive = size(self%sources) > 0
  end function has_drive

  !> Whether motors or engines hold the speed, in the direction in which they turn.
  pure logical function is_driven(self)
    class(held_state_t), intent(in) :: self

    is_driven = self%factor > 0 .and. self%supply >= 0
  end function is_driven

  !> Power of the elements that drive, after `evaluate` of the balance [W].
  pure real(wp) function source_power(self)
    type(held_speeds_t), intent(in) :: self

    associate (elements => self%balance%formulation%state%elements, e => self%balance%inelastic(self%sources))
      source_power = sum((elements%restoring(1, e) + elements%applied(1, e)) * elements%speed(1, e))
    end associate
  end function source_power

  !> Solves for the speeds of the rigid motions and for the factor or torque that holds the speed, by Newton's method with
  !> differences in place of derivatives. With one rigid motion the first step is exact.
  subroutine balance_speeds(self, speed, z, held, is_found)
    type(held_speeds_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp), intent(out) :: z(:)   !! rigid motions and internal states
    real(wp), intent(out) :: held   !! factor or torque [N m]
    logical, intent(out) :: is_found
    integer, parameter :: most_steps = 50
    real(wp), parameter :: tolerance = 1.0e-12_wp
    real(wp), dimension(size(self%ratio)) :: scale, step
    real(wp) :: matrix(size(self%ratio), size(self%ratio))
    integer :: i, pivot, pivots(size(self%ratio))
    logical :: is_singular

    associate (r => size(self%ratio))
      pivot = maxloc(abs(self%ratio), dim=1)
      z = self%z
      if (abs(self%last_speed) > 0) z(:r) = z(:r) * (speed / self%last_speed)
      call impose(self, pivot, speed, z)
      held = 0.0_wp
      do i = 1, most_steps
        call differentiate(self, pivot, speed, held, z, matrix, step, scale)
        is_found = i > 1 .and. all(abs(step) <= tolerance * scale)
        if (is_found) return
        is_found = all(abs(step) <= tolerance * scale)   ! nothing drives and nothing brakes, if the matrix is singular
        call lu_factor(matrix, pivots, is_singular)
        if (is_singular) return
        call lu_solve(matrix, pivots, step)
        held = held + step(pivot)
        is_found = r == 1 .and. is_finite(held)
        if (r == 1) return
        step(pivot) = 0.0_wp
        z(:r) = z(:r) + step
        call impose(self, pivot, speed, z)
        if (.not. all(is_finite([z, held]))) return
      end do
    end associate
  end subroutine balance_speeds

  !> Gives the reference body its speed by one of the rigid motions.
  pure subroutine impose(self, pivot, speed, z)
    type(held_speeds_t), intent(in) :: self
    integer, intent(in) :: pivot       !! the rigid motion
    real(wp), intent(in) :: speed      !! [rad/s]
    real(wp), intent(inout) :: z(:)
    real(wp) :: driven   ! by drives

    driven = 0.0_wp
    associate (machine => self%balance%formulation%machine)
      if (allocated(machine%driven_speed)) driven = machine%driven_speed(self%reference)
    end associate
    z(pivot) = z(pivot) + (speed - driven - sum(self%ratio * z(:size(self%ratio)))) / self%ratio(pivot)
  end subroutine impose

  !> The torques that are missing for the balance, and their derivatives by the rigid motions, and in the column `pivot` by what
  !> holds the speed.
  subroutine differentiate(self, pivot, speed, held, z, matrix, missing, scale)
    type(held_speeds_t), intent(inout) :: self
    integer, intent(in) :: pivot           !! the rigid motion that follows from the others
    real(wp), intent(in) :: speed          !! [rad/s]
    real(wp), intent(in) :: held           !! factor or torque [N m]
    real(wp), intent(inout) :: z(:)        !! rigid motions, and internal states, which settle
    real(wp), intent(out) :: matrix(:, :)  !! [rigid motions, rigid motions]
    real(wp), intent(out) :: missing(:)    !! [N m], [rigid motions]
    real(wp), intent(out) :: scale(:)      !! sums of the absolute terms of `missing`
    real(wp), parameter :: difference = 1.0e-6_wp   ! relative
    real(wp), dimension(size(missing)) :: residual, shifted, sources
    real(wp) :: change, moved(size(z))
    integer :: k

    change = difference * max(maxval(abs(z(:size(missing)))), abs(speed))
    call residuals(self, z, residual, sources, scale)
    missing = -(residual + held * sources)
    scale = scale + abs(held * sources)
    matrix(:, pivot) = sources
    do k = 1, size(missing)
      if (k == pivot) cycle
      moved = z
      moved(k) = moved(k) + change
      call impose(self, pivot, speed, moved)
      call residuals(self, moved, shifted, sources, residual)
      matrix(:, k) = (shifted + held * sources + missing) / change
    end do
    if (size(missing) > 1) call residuals(self, z, residual, sources, shifted)   ! the state of the elements is the one of z
  end subroutine differentiate

  !> Torques along the rigid motions without what holds the speed, the torques per unit of that, and the sums of their terms.
  subroutine residuals(self, z, residual, sources, scale)
    type(held_speeds_t), intent(inout) :: self
    real(wp), intent(inout) :: z(:)   !! rigid motions and internal states, which settle
    real(wp), intent(out) :: residual(:), sources(:), scale(:)
    integer :: i, k

    call self%balance%settle(z)
    call self%balance%evaluate(z)
    residual = self%balance%residual(:size(residual))
    scale = self%balance%scale(:size(residual))
    sources = self%ratio
    if (.not. self%motors_hold) return
    sources = 0.0_wp
    associate (balance => self%balance, elements => self%balance%formulation%state%elements)
      do i = 1, size(self%sources)
        associate (e => balance%inelastic(self%sources(i)))
          do k = balance%first(self%sources(i)), balance%first(self%sources(i) + 1) - 1
            sources(balance%freedom(k)) = sources(balance%freedom(k)) &
                                          + balance%ratio(k) * (elements%restoring(1, e) + elements%applied(1, e))
          end do
        end associate
      end do
    end associate
    residual = residual - sources
  end subroutine residuals

  !> Finds the twists, and linearises.
  subroutine find_state(self, z, state, error)
    type(held_speeds_t), intent(inout) :: self
    real(wp), intent(inout) :: z(:)   !! rigid motions and internal states, which get the throttles of governors
    type(held_state_t), intent(inout) :: state
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: extra(self%balance%coordinates), q(self%balance%coordinates), weight(size(self%balance%is_elastic))
    integer :: k
    logical :: is_found

    weight = 1.0_wp
    if (self%motors_hold) weight(self%balance%inelastic(self%sources)) = state%factor
    call refuse_standing_friction(self%balance, error)
    if (allocated(error)) return
    extra = 0.0_wp
    associate (map => self%balance%formulation%machine%coordinates)
      do k = map%first(self%reference), map%first(self%reference + 1) - 1
        extra(map%coordinate(k)) = map%ratio(1, k) * state%torque
      end do
    end associate
    call self%balance%evaluate(z)
    q = self%q
    call find_twists(self%twists, self%balance, q, is_found, error, weight, extra)
    if (is_found) self%q(:) = q
    self%lacks_twists = .not. (allocated(error) .or. is_found)
    if (self%lacks_twists) then
      call raise(error, exit_failed, 'the torques balance, but no twists of the couplings were found that carry them')
    end if
    if (allocated(error)) return
    if (self%motors_hold) then
      call close_speed_loops(self%balance, self%balance%inelastic(self%sources), state%factor, z, weight)
    end if
    self%weight = weight
    call linearise(self, z, weight, state, error)
  end subroutine find_state

  subroutine linearise(self, z, weight, state, error)
    type(held_speeds_t), intent(inout) :: self
    real(wp), intent(in) :: z(:), weight(:)
    type(held_state_t), intent(inout) :: state
    type(error_t), allocatable, intent(out) :: error

    call self%balance%set_state(z)
    associate (balance => self%balance, formulation => self%balance%formulation, &
               elements => self%balance%formulation%state%elements)
      balance%y(1, balance%coordinates + 1:2 * balance%coordinates) = self%q
      call formulation%gather(balance%y)
      call formulation%state%choose_branches(formulation%machine, balance%t)
      call formulation%state%evaluate_elements(formulation%machine, balance%t)
      call formulation%state%differentiate_elements(formulation%machine, balance%t)
      state%omega = formulation%omega(1, 1:)
      state%phi = formulation%phi(1, 1:)
      if (.not. self%is_free) then
        self%lead = state%phi(self%reference) / state%omega(self%reference)
        state%phi = state%phi - self%lead * state%omega
      end if
      state%twist = elements%angle(1, :)
      state%rate = elements%speed(1, :)
      state%mean = weight * (elements%restoring(1, :) + elements%applied(1, :))
      call new_slopes(formulation%machine, elements, state%slopes, error, weight)
    end associate
  end subroutine linearise

end module nocdyn_held_speeds
