!> Steady states that stay while numbers of their machine change, and how they move with these to the first order.
!>
!> In a steady state the torques on all coordinates c balance, sum of U_ec w_e m_e = 0, with the moments m_e of the elements e,
!> their weights w_e, which are 1 but of motors that hold a speed, and the twists U; the internal states x have the rates 0; a
!> speed may be held. The unknowns are the angles and the speeds of the coordinates, x, and what holds the speed: the weight of
!> the motors, the throttle of one with a governor, the frequency of supplies, or a torque. A number p moves the state by
!> u' = -(R_u)^-1 R_p of these equations R = 0, and R_p are the changes of moments and rates in the state as it is.
module nocdyn_frozen_states
  use nocdyn_elements, only: element_values_t
  use nocdyn_equilibrium, only: mean_machine, t_infinity
  use nocdyn_errors, only: error_t
  use nocdyn_held_drives, only: supply_machine
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t
  use nocdyn_joint_balance, only: joint_balance_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_slopes, only: new_slopes
  use nocdyn_torque_balance, only: torque_balance_t
  use nocdyn_varied_keys, only: central, find_weights, points
  implicit none (type, external)
  private

  public :: freeze_held, freeze_equilibrium, new_mean_laws

  integer, parameter :: most_unknowns = 400   ! of a dense matrix

  !> The laws of the elements of a machine with mean torques.
  type, public :: mean_laws_t
    type(machine_t) :: machine
    type(machine_state_t) :: state
  contains
    procedure :: evaluate_at, refresh, state_at
  end type mean_laws_t

  !> How a state moves by a number: derivatives.
  type, public :: displacement_t
    logical :: is_none = .true.
    real(wp), allocatable :: twist(:), rate(:)    !! [elements]
    real(wp), allocatable :: internal(:)          !! [internal states]
    real(wp), allocatable :: angle(:), speed(:)   !! [bodies]
    real(wp) :: factor = 0.0_wp                   !! of the weights of the motors that hold the speed
    real(wp) :: supply = 0.0_wp                   !! of the share of the supplies that holds it
  end type displacement_t

  !> A steady state.
  type, public :: frozen_state_t
    logical :: is_frozen = .false.         !! whether it is known how it moves
    type(held_state_t) :: state
    real(wp), allocatable, private :: internal(:)   !! [internal states]
    type(joint_balance_t), private :: joints        !! which slip
    real(wp), allocatable, private :: weight(:)     !! [elements]
    integer, allocatable, private :: driving(:)     !! elements whose weight holds the speed
    integer, allocatable, private :: first(:), coordinate(:)   !! U, as of `element_coordinates_t`
    real(wp), allocatable, private :: ratio(:)
    integer, allocatable, private :: angles(:)      !! coordinates whose angles are unknown
    real(wp), allocatable, private :: motion(:, :)  !! speeds of the coordinates by the rigid motions, [coordinates, motions]
    real(wp), allocatable, private :: matrix(:, :), row_scale(:), column_scale(:)   !! factors of R_u, whose rows and columns
    integer, allocatable, private :: pivots(:)                                      !! are scaled
    integer, private :: closed = 0         !! internal state that holds the speed, in place of its rate; 0: none
    integer, private :: reference = 0      !! body whose speed is held, and whose angle is 0; 0: none
    real(wp), private :: lead = 0.0_wp     !! the time in which the reference body turns by the angle that it has otherwise [s]
  contains
    procedure :: move
    procedure, private :: list_matrix, hold_speed, differentiate_supply, add_torque, factor_matrix, twists_of
  end type frozen_state_t

contains

  !> The laws of a machine.
  subroutine new_mean_laws(machine, holds_speed, self)
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: holds_speed   !! as of `mean_machine`
    type(mean_laws_t), intent(out) :: self

    self%machine = machine
    call mean_machine(self%machine, holds_speed)
    self%state = new_machine_state(self%machine)
    call self%refresh()
  end subroutine new_mean_laws

  !> Computes what follows from parameters that have changed.
  subroutine refresh(self)
    class(mean_laws_t), intent(inout) :: self

    call self%machine%refresh_lane(1)
    call self%state%refresh_lane(self%machine, 1)
  end subroutine refresh

  !> Evaluates the elements in a state, or in one that has moved.
  subroutine evaluate_at(self, frozen, displacement, step)
    class(mean_laws_t), intent(inout) :: self
    type(frozen_state_t), intent(in) :: frozen
    type(displacement_t), intent(in), optional :: displacement
    real(wp), intent(in), optional :: step   !! of the number
    real(wp) :: supply

    associate (elements => self%state%elements, t => [t_infinity])
      elements%angle(1, :) = frozen%state%twist
      elements%speed(1, :) = frozen%state%rate
      elements%internal%value(1, :) = frozen%internal
      supply = frozen%state%supply
      if (present(displacement)) then
        if (.not. displacement%is_none) then
          elements%angle(1, :) = elements%angle(1, :) + step * displacement%twist
          elements%speed(1, :) = elements%speed(1, :) + step * displacement%rate
          elements%internal%value(1, :) = elements%internal%value(1, :) + step * displacement%internal
          supply = supply + step * displacement%supply
        end if
      end if
      if (frozen%state%supply > 0) call supply_machine(self%machine, self%state, supply)
      if (frozen%joints%count > 0) call frozen%joints%choose_modes(self%machine, self%state)
      call self%state%choose_branches(self%machine, t)
      call self%state%evaluate_elements(self%machine, t)
    end associate
  end subroutine evaluate_at

  !> The machine linearised in a state that has moved.
  subroutine state_at(self, frozen, displacement, step, state, error)
    class(mean_laws_t), intent(inout) :: self
    type(frozen_state_t), intent(in) :: frozen
    type(displacement_t), intent(in) :: displacement
    real(wp), intent(in) :: step                       !! of the number
    type(held_state_t), intent(out) :: state
    type(error_t), allocatable, intent(out) :: error   !! if a slope is not finite
    real(wp) :: weight(size(frozen%weight))

    call self%evaluate_at(frozen, displacement, step)
    call self%state%differentiate_elements(self%machine, [t_infinity])
    state = frozen%state
    weight = frozen%weight
    associate (elements => self%state%elements)
      if (.not. displacement%is_none) then
        weight(frozen%driving) = weight(frozen%driving) + step * displacement%factor
        state%twist = elements%angle(1, :)
        state%rate = elements%speed(1, :)
        if (allocated(state%omega)) then
          state%omega = state%omega + step * displacement%speed
          state%phi = state%phi + step * displacement%angle
        end if
      end if
      state%mean = weight * (elements%restoring(1, :) + elements%applied(1, :))
      call new_slopes(self%machine, elements, state%slopes, error, weight)
    end associate
  end subroutine state_at

  !> Keeps a state that has just been held. Unknown is how states move beside which supplies idle.
  subroutine freeze_held(held, state, self)
    type(held_speeds_t), intent(in) :: held
    type(held_state_t), intent(in) :: state
    type(frozen_state_t), intent(out) :: self
    real(wp), allocatable :: matrix(:, :)
    integer :: i
    logical :: closes(size(held%sources)), is_held

    self%state = state
    self%weight = held%weight
    is_held = .not. (held%is_free .or. allocated(held%carried))
    associate (balance => held%balance, elements => held%balance%formulation%state%elements, &
               internal => held%balance%formulation%machine%elements%internal)
      self%internal = elements%internal%value(1, :)
      allocate (self%driving(0))
      if ((held%supply_holds .and. .not. held%motors_hold) .or. is_special(balance) .or. .not. all_slip(balance)) return
      self%joints = balance%joints
      if (.not. held%is_free) self%reference = held%reference
      self%lead = held%lead
      if (is_held .and. held%motors_hold .and. .not. held%supply_holds) then
        self%driving = balance%inelastic(held%sources)
        closes = abs(self%weight(self%driving) - state%factor) > 0
        if (any(closes)) then
          if (size(closes) > 1) return
          i = findloc(internal%element, self%driving(1), dim=1)
          if (i == 0) return
          if (internal%members(i) > 1 .or. .not. abs(elements%internal%applied(1, i)) > 0) return
          self%closed = i
          deallocate (self%driving)
          allocate (self%driving(0))
        end if
      end if
      call self%list_matrix(balance, merge(1, 0, is_held .and. self%closed == 0), matrix)
      if (is_held) call self%hold_speed(held, matrix)
      call self%factor_matrix(matrix)
    end associate
  end subroutine freeze_held

  !> The row of the speed of the reference body, which stays, and the column of what holds it.
  subroutine hold_speed(self, held, matrix)
    class(frozen_state_t), intent(in) :: self
    type(held_speeds_t), intent(in) :: held
    real(wp), intent(inout) :: matrix(:, :)
    integer :: e, i, k, n

    associate (balance => held%balance, elements => held%balance%formulation%state%elements)
      n = size(matrix, 1)
      if (self%closed > 0) n = balance%coordinates + self%closed
      matrix(n, :) = 0.0_wp
      matrix(n, size(self%angles) + 1:size(self%angles) + size(held%ratio)) = held%ratio
      if (self%closed > 0) return
      associate (column => matrix(:, size(matrix, 2)))
        if (held%supply_holds) then
          call self%differentiate_supply(balance, column)
        else if (held%motors_hold) then
          do i = 1, size(self%driving)
            e = self%driving(i)
            call self%add_torque(e, elements%restoring(1, e) + elements%applied(1, e), column)
          end do
        else
          associate (map => balance%formulation%machine%coordinates)
            do k = map%first(self%reference), map%first(self%reference + 1) - 1
              column(map%coordinate(k)) = column(map%coordinate(k)) + map%ratio(1, k)
            end do
          end associate
        end if
      end associate
    end associate
  end subroutine hold_speed

  !> The derivatives of the equations by the share of the supplies.
  subroutine differentiate_supply(self, balance, column)
    class(frozen_state_t), intent(in) :: self
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(inout) :: column(:)
    real(wp), parameter :: step = 2.0e-4_wp   ! small beside the slips at which the torques turn
    type(mean_laws_t) :: laws
    type(displacement_t) :: displacement
    real(wp) :: weight(points), weight_here
    integer :: e, p

    laws%machine = balance%formulation%machine
    laws%state = balance%formulation%state
    displacement%is_none = .false.
    displacement%supply = self%state%supply
    allocate (displacement%twist, source=0.0_wp * self%state%twist)
    allocate (displacement%rate, source=0.0_wp * self%state%rate)
    allocate (displacement%internal, source=0.0_wp * self%internal)
    call find_weights(self%state%supply * step * central, weight, weight_here)
    do p = 1, points
      call laws%evaluate_at(self, displacement, step * central(p))
      associate (elements => laws%state%elements, f => balance%coordinates)
        do e = 1, size(self%weight)
          call self%add_torque(e, weight(p) * self%weight(e) * (elements%restoring(1, e) + elements%applied(1, e)), column)
        end do
        column(f + 1:f + balance%internal) = column(f + 1:f + balance%internal) + weight(p) * elements%internal%rate(1, :)
      end associate
    end do
  end subroutine differentiate_supply

  !> Adds a moment of an element to torques on the coordinates.
  pure subroutine add_torque(self, element, moment, torque)
    class(frozen_state_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: moment        !! [N m]
    real(wp), intent(inout) :: torque(:)  !! [N m], of the coordinates first
    integer :: k

    do k = self%first(element), self%first(element + 1) - 1
      torque(self%coordinate(k)) = torque(self%coordinate(k)) + self%ratio(k) * moment
    end do
  end subroutine add_torque

  !> Keeps a steady state in which nothing is held. The balance is evaluated and differentiated there.
  subroutine freeze_equilibrium(balance, self)
    type(torque_balance_t), intent(in) :: balance
    type(frozen_state_t), intent(out) :: self
    real(wp), allocatable :: matrix(:, :)

    associate (elements => balance%formulation%state%elements)
      self%state%twist = elements%angle(1, :)
      self%state%rate = elements%speed(1, :)
      self%internal = elements%internal%value(1, :)
      self%weight = spread(1.0_wp, 1, size(self%state%twist))
      allocate (self%driving(0))
      if (is_special(balance) .or. .not. all_slip(balance)) return
      self%joints = balance%joints
      call self%list_matrix(balance, 0, matrix)
      call self%factor_matrix(matrix)
    end associate
  end subroutine freeze_equilibrium

  !> Whether more acts in a machine than the laws of its elements, or it has too many unknowns.
  pure logical function is_special(balance)
    type(torque_balance_t), intent(in) :: balance

    is_special = balance%joints%teeth%count > 0 .or. allocated(balance%drag) .or. &
                 balance%coordinates + balance%internal > most_unknowns
  end function is_special

  !> Whether all joints slip, none of them hardly.
  pure logical function all_slip(balance)
    type(torque_balance_t), intent(in) :: balance
    real(wp), parameter :: hardly = 1.0e-6_wp   ! as a share of the largest speed

    all_slip = balance%joints%count == 0
    if (all_slip) return
    associate (speed => abs(balance%formulation%state%elements%speed(1, :)))
      all_slip = .not. any(balance%joints%is_at_rest) .and. all(speed(balance%joints%element) > hardly * maxval(speed))
    end associate
  end function all_slip

  !> R_u without what holds a speed: the rows of the coordinates and internal states, the columns of their angles, of the rigid
  !> motions and of the internal states.
  subroutine list_matrix(self, balance, more, matrix)
    class(frozen_state_t), intent(inout) :: self
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: more   !! rows and columns, which are 0
    real(wp), allocatable, intent(out) :: matrix(:, :)
    real(wp) :: unit(size(balance%motions%free))
    real(wp), allocatable :: rate(:, :)   ! of the elements by the rigid motions
    integer :: c, e, i, k, l, m, n

    associate (elements => balance%formulation%state%elements, machine => balance%formulation%machine, r => size(unit), &
               f => balance%coordinates)
      self%first = balance%incidence%first
      self%coordinate = balance%incidence%coordinate
      self%ratio = balance%incidence%ratio(1, :)
      self%angles = pack([(c, c=1, f)], [(all(balance%loose%free /= c), c=1, f)])
      allocate (self%motion(f, r), rate(machine%elements%count, r))
      do m = 1, r
        unit = 0.0_wp
        unit(m) = 1.0_wp
        self%motion(:, m) = balance%motions%speeds(unit)
        rate(:, m) = self%twists_of(self%motion(:, m))
      end do
      n = f + balance%internal + more
      allocate (matrix(n, n), source=0.0_wp)
      do e = 1, machine%elements%count
        do k = self%first(e), self%first(e + 1) - 1
          c = self%coordinate(k)
          do l = self%first(e), self%first(e + 1) - 1
            i = findloc(self%angles, self%coordinate(l), dim=1)
            if (i > 0) matrix(c, i) = matrix(c, i) + self%ratio(k) * self%ratio(l) * elements%restoring_angle(1, e)
          end do
          matrix(c, f - r + 1:f) = matrix(c, f - r + 1:f) &
                                   + self%ratio(k) * self%weight(e) * elements%applied_speed(1, e) * rate(e, :)
        end do
      end do
      do i = 1, machine%elements%cross%count
        associate (pairs => machine%elements%cross)
          do k = self%first(pairs%element(i)), self%first(pairs%element(i) + 1) - 1
            matrix(self%coordinate(k), f - r + 1:f) = matrix(self%coordinate(k), f - r + 1:f) + self%ratio(k) &
              * self%weight(pairs%element(i)) * elements%cross%applied_speed(1, i) * rate(pairs%by(i), :)
          end do
        end associate
      end do
      associate (internal => machine%elements%internal, values => elements%internal)
        do i = 1, internal%count
          e = internal%element(i)
          call self%add_torque(e, self%weight(e) * values%applied(1, i), matrix(:, f + i))
          matrix(f + i, f - r + 1:f) = values%rate_speed(1, i) * rate(e, :)
          do m = 1, internal%members(i)
            matrix(f + i, f + internal%first(i) + m - 1) = values%rate_internal(1, m, i)
          end do
        end do
      end associate
    end associate
  end subroutine list_matrix

  !> Factors R_u, unless it is singular: then there are other steady states beside this one.
  subroutine factor_matrix(self, matrix)
    class(frozen_state_t), intent(inout) :: self
    real(wp), allocatable, intent(inout) :: matrix(:, :)
    real(wp), parameter :: none = 1.0e-13_wp   ! as a share of the largest pivot
    integer :: i
    logical :: is_singular

    associate (n => size(matrix, 1))
      allocate (self%row_scale(n), self%column_scale(n), self%pivots(n))
      do i = 1, n
        self%row_scale(i) = 1.0_wp / max(tiny(1.0_wp), maxval(abs(matrix(i, :))))
        matrix(i, :) = self%row_scale(i) * matrix(i, :)
      end do
      do i = 1, n
        self%column_scale(i) = 1.0_wp / max(tiny(1.0_wp), maxval(abs(matrix(:, i))))
        matrix(:, i) = self%column_scale(i) * matrix(:, i)
      end do
      if (n > 0) then
        call lu_factor(matrix, self%pivots, is_singular)
        if (is_singular) return
        if (minval([(abs(matrix(i, i)), i=1, n)]) <= none * maxval([(abs(matrix(i, i)), i=1, n)])) return
      end if
    end associate
    call move_alloc(matrix, self%matrix)
    self%is_frozen = .true.
  end subroutine factor_matrix

  !> The twists, or their rates, of a motion of the coordinates, [elements].
  pure function twists_of(self, q) result(twist)
    class(frozen_state_t), intent(in) :: self
    real(wp), intent(in) :: q(:)
    real(wp) :: twist(size(self%first) - 1)
    integer :: e, k

    do e = 1, size(twist)
      twist(e) = 0.0_wp
      do k = self%first(e), self%first(e + 1) - 1
        twist(e) = twist(e) + self%ratio(k) * q(self%coordinate(k))
      end do
    end do
  end function twists_of

  !> How the state moves by a number, of which the derivatives of the moments and of the rates in the state as it is are given.
  function move(self, machine, moment, rate) result(displacement)
    class(frozen_state_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: moment(:)   !! without weights, [elements]
    real(wp), intent(in) :: rate(:)     !! [internal states]
    type(displacement_t) :: displacement
    real(wp) :: q(size(self%motion, 1)), speed(size(self%motion, 1)), u(size(self%pivots))
    integer :: e

    displacement%is_none = .not. (any(abs(moment) > 0) .or. any(abs(rate) > 0))
    if (displacement%is_none) return
    u = 0.0_wp
    associate (f => size(q), r => size(self%motion, 2))
      do e = 1, size(moment)
        call self%add_torque(e, -self%weight(e) * moment(e), u)
      end do
      u(f + 1:f + size(rate)) = -rate
      if (self%closed > 0) u(f + self%closed) = 0.0_wp
      u = self%row_scale * u
      if (size(u) > 0) call lu_solve(self%matrix, self%pivots, u)
      u = self%column_scale * u
      q = 0.0_wp
      q(self%angles) = u(:f - r)
      speed = matmul(self%motion, u(f - r + 1:f))
      displacement%internal = u(f + 1:f + size(rate))
      if (size(self%driving) > 0) displacement%factor = u(size(u))
      if (self%state%supply > 0) displacement%supply = u(size(u))
      displacement%twist = self%twists_of(q)
      displacement%rate = self%twists_of(speed)
      displacement%speed = machine%coordinates%body_speeds(1, speed)
      displacement%angle = machine%coordinates%body_speeds(1, q) - self%lead * displacement%speed
      if (self%reference == 0) return
      displacement%angle = displacement%angle - self%state%omega * (displacement%angle(self%reference) &
                                                                    / self%state%omega(self%reference))
    end associate
  end function move

end module nocdyn_frozen_states
