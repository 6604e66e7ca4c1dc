!> The equations of a steady state: the torques balance along every rigid motion of the machine, and the internal states are
!> constant.
!>
!> With the rigid motions q' = N s, elastic elements do no work, as their twists are constant. The torques along s are the sum of
!> G^T M over the other elements, whose speeds are G s. The unknowns are z = (s, internal states). Joints that are at rest have no
!> speed in the rigid motions. Bodies that drives turn have their speeds beside those of s (`driven_speed` of a machine).
module nocdyn_torque_balance
  use nocdyn_element_coordinates, only: element_coordinates_t, new_element_coordinates
  use nocdyn_formulation, only: formulation_t
  use nocdyn_joint_balance, only: joint_balance_t, loads_by_moments, new_joint_balance
  use nocdyn_kinds, only: wp
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: set_up_balance

  !> The equations of one machine, and work space for their evaluation.
  type, public :: torque_balance_t
    class(formulation_t), allocatable :: formulation   !! reduced, one lane, without work integrals
    type(element_coordinates_t) :: incidence
    type(rigid_motions_t) :: motions        !! of which `s` are the speeds
    type(rigid_motions_t) :: loose          !! the ones of which the joints at rest slip too
    type(joint_balance_t) :: joints
    logical, allocatable :: is_elastic(:)   !! whether an element can have a restoring moment, [elements]
    integer, allocatable :: elastic(:)      !! elements that the rigid motions do not twist
    integer :: coordinates = 0
    integer :: internal = 0                !! number of internal states
    real(wp), allocatable :: residual(:)   !! after `evaluate`: torques [N m], rates of internal states, [unknowns]
    real(wp), allocatable :: scale(:)      !! sum of the absolute terms of each residual, [unknowns]
    integer, allocatable :: floating(:)    !! motions that no torque acts on, in the block that begins with each unknown, after
                                           !! `hold_floating`, [unknowns]
    ! work space:
    real(wp) :: t(1) = 0.0_wp
    integer :: status(1) = 0
    integer, allocatable :: inelastic(:)            !! elements that are not elastic
    integer, allocatable :: first(:)                !! first entry of each inelastic element, [inelastic + 1]
    integer, allocatable :: freedom(:)              !! rigid motion, [entries]
    real(wp), allocatable :: ratio(:)               !! G, [entries]
    real(wp), allocatable :: driven(:)              !! speeds of the inelastic elements without s [rad/s], [inelastic]
    real(wp), allocatable :: y(:, :)   !! state after `set_state`, [1, states]
    real(wp), allocatable :: rate(:, :)
    real(wp), allocatable :: drag(:, :)       !! torques that keep motions that float at their start, by rigid motions
    real(wp), allocatable :: start_speed(:)   !! of the rigid motions, with `drag` [rad/s]
    real(wp), allocatable, private :: start_twist(:)   !! [rad], [elements]
  contains
    procedure :: unknowns, start, set_state, settle, moments_at, inertia, evaluate, differentiate
    procedure :: turn_drives, blocks, body_speeds, differentiate_at_start
    procedure, private :: evaluate_laws, differentiate_losses
  end type torque_balance_t

contains

  !> The equations of a machine with mean torques.
  subroutine set_up_balance(formulation, t, self, is_at_rest)
    class(formulation_t), allocatable, intent(inout) :: formulation   !! reduced, one lane, without work integrals
    real(wp), intent(in) :: t                                         !! [s]
    type(torque_balance_t), intent(out) :: self
    logical, intent(in), optional :: is_at_rest(:)   !! joints that are; absent: none, and teeth lose nothing
    integer :: e
    integer, allocatable :: rigid(:)   ! elements
    real(wp) :: offset(formulation%machine%elements%count)

    call move_alloc(formulation, self%formulation)
    associate (machine => self%formulation%machine)
      self%coordinates = machine%coordinates%freedoms
      self%internal = self%formulation%states - 2 * self%coordinates
      self%incidence = new_element_coordinates(machine%elements, machine%coordinates)
      self%elastic = machine%elastic()
      allocate (self%is_elastic(machine%elements%count), source=.false.)
      self%is_elastic(self%elastic) = .true.
      self%inelastic = pack([(e, e=1, size(self%is_elastic))], .not. self%is_elastic)
      self%loose = new_rigid_motions(self%coordinates, self%incidence, self%elastic)
      self%motions = self%loose
    end associate
    self%t = t
    allocate (self%start_twist, source=pack(self%formulation%machine%start_twist(), .true.))
    self%joints = new_joint_balance(self%formulation%joints)
    if (present(is_at_rest)) then
      ! holds joints at rest, and finds what the teeth carry
      self%joints%is_at_rest = is_at_rest
      rigid = [self%elastic, pack(self%joints%element, is_at_rest)]
      offset = 0.0_wp
      if (allocated(self%formulation%driven_rate)) offset = self%formulation%driven_rate
      if (any(is_at_rest)) self%motions = new_rigid_motions(self%coordinates, self%incidence, rigid, offset)
      call self%differentiate_at_start()
      associate (joints => self%joints, formulation => self%formulation)
        joints%by_moment = loads_by_moments(joints%teeth, formulation%machine, formulation%state%elements, self%incidence, &
                                            self%motions, rigid)
      end associate
    end if
    call gather_ratios(self)
    call set_driven(self)
    allocate (self%y(1, self%formulation%states), source=0.0_wp)
    allocate (self%rate, source=self%y)
    allocate (self%residual(self%unknowns()), self%scale(self%unknowns()), source=0.0_wp)
  end subroutine set_up_balance

  !> Differentiates the laws of the elements at the start twists, without speeds.
  subroutine differentiate_at_start(self)
    class(torque_balance_t), intent(inout) :: self

    associate (machine => self%formulation%machine, state => self%formulation%state)
      state%elements%angle(1, :) = self%start_twist
      state%elements%speed(1, :) = 0.0_wp
      call state%settle_internal(machine, self%t(1))
      call state%choose_branches(machine, self%t)
      call state%evaluate_elements(machine, self%t)
      call state%differentiate_elements(machine, self%t)
    end associate
  end subroutine differentiate_at_start

  !> Gives the bodies other speeds by drives.
  subroutine turn_drives(self, driven_speed)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(in) :: driven_speed(:)   !! [rad/s], [bodies]

    call self%formulation%turn_drives(driven_speed)
    call set_driven(self)
  end subroutine turn_drives

  !> The speeds of the inelastic elements without s: by drives, and by what joints at rest make of these.
  subroutine set_driven(self)
    type(torque_balance_t), intent(inout) :: self
    integer :: i, k

    if (.not. allocated(self%driven)) allocate (self%driven(size(self%inelastic)))
    self%driven = 0.0_wp
    if (.not. allocated(self%formulation%driven_rate)) return
    self%driven = self%formulation%driven_rate(self%inelastic)
    do i = 1, size(self%inelastic)
      do k = self%incidence%first(self%inelastic(i)), self%incidence%first(self%inelastic(i) + 1) - 1
        self%driven(i) = self%driven(i) + self%incidence%ratio(1, k) * self%motions%drift(self%incidence%coordinate(k))
      end do
    end do
    do i = 1, size(self%inelastic)   ! without rounding
      if (any(self%joints%element == self%inelastic(i) .and. self%joints%is_at_rest)) self%driven(i) = 0.0_wp
    end do
  end subroutine set_driven

  !> Computes G = U N of the inelastic elements.
  subroutine gather_ratios(self)
    type(torque_balance_t), intent(inout) :: self
    real(wp) :: row(size(self%motions%free))
    integer, allocatable :: touched(:)
    integer :: i, k, next

    associate (incidence => self%incidence, motions => self%motions)
      allocate (self%first(size(self%inelastic) + 1))
      self%first(1) = 1
      self%freedom = [integer ::]
      self%ratio = [real(wp) ::]
      row = 0.0_wp
      do i = 1, size(self%inelastic)
        touched = [integer ::]
        do k = incidence%first(self%inelastic(i)), incidence%first(self%inelastic(i) + 1) - 1
          do next = motions%first(incidence%coordinate(k)), motions%first(incidence%coordinate(k) + 1) - 1
            associate (s => motions%freedom(next))
              if (all(touched /= s)) touched = [touched, s]
              row(s) = row(s) + incidence%ratio(1, k) * motions%ratio(next)
            end associate
          end do
        end do
        self%freedom = [self%freedom, touched]
        self%ratio = [self%ratio, row(touched)]
        self%first(i + 1) = self%first(i) + size(touched)
        row(touched) = 0.0_wp
      end do
    end associate
  end subroutine gather_ratios

  !> Number of unknowns: rigid motions and internal states.
  pure integer function unknowns(self)
    class(torque_balance_t), intent(in) :: self

    unknowns = size(self%motions%free) + self%internal
  end function unknowns

  !> The unknowns at the start of the machine: rigid motions with the angular momenta of the start speeds, [unknowns].
  function start(self) result(z)
    class(torque_balance_t), intent(in) :: self
    real(wp) :: z(self%unknowns())
    real(wp), allocatable :: y(:, :)

    allocate (y, source=self%formulation%start())
    z(:size(self%motions%free)) = mean_motion(self, y(1, :self%coordinates) - self%motions%drift)
    z(size(self%motions%free) + 1:) = y(1, 2 * self%coordinates + 1:self%formulation%states)
  end function start

  !> Solves N^T M N s = N^T M q' by conjugate gradients; the matrix is well conditioned and is not formed.
  function mean_motion(self, q_rate) result(s)
    class(torque_balance_t), intent(in) :: self
    real(wp), intent(in) :: q_rate(:)   !! [rad/s], [coordinates]
    real(wp) :: s(size(self%motions%free))
    real(wp), dimension(size(s)) :: direction, image, rest
    real(wp) :: norm, old_norm, scale
    integer :: i

    s = 0.0_wp
    rest = self%motions%project_torques(inertial_torque(self, q_rate))
    direction = rest
    norm = sum(rest**2)
    scale = norm
    do i = 1, 10 * size(s)
      if (norm <= epsilon(norm)**2 * scale) exit
      image = self%motions%project_torques(inertial_torque(self, self%motions%speeds(direction)))
      associate (step => norm / sum(direction * image))
        s = s + step * direction
        rest = rest - step * image
      end associate
      old_norm = norm
      norm = sum(rest**2)
      direction = rest + norm / old_norm * direction
    end do
  end function mean_motion

  !> Inertias of some unknowns: the ones of rigid motions, N^T L_tau^T J L_tau N [kg m2]; 1 of internal states, [members,
  !> members].
  function inertia(self, members) result(matrix)
    class(torque_balance_t), intent(in) :: self
    integer, intent(in) :: members(:)   !! unknowns
    real(wp) :: matrix(size(members), size(members))
    real(wp) :: column(self%unknowns()), unit(size(self%motions%free))
    integer :: k

    do k = 1, size(members)
      column = 0.0_wp
      if (members(k) > size(unit)) then
        column(members(k)) = 1.0_wp
      else
        unit = 0.0_wp
        unit(members(k)) = 1.0_wp
        column(:size(unit)) = self%motions%project_torques(inertial_torque(self, self%motions%speeds(unit)))
      end if
      matrix(:, k) = column(members)
    end do
  end function inertia

  !> L_tau^T J L_tau v, [coordinates].
  pure function inertial_torque(self, v) result(torque)
    class(torque_balance_t), intent(in) :: self
    real(wp), intent(in) :: v(:)   !! [coordinates]
    real(wp) :: torque(size(v))
    real(wp) :: momentum(self%formulation%machine%bodies)
    integer :: b, k

    torque = 0.0_wp
    associate (machine => self%formulation%machine, map => self%formulation%machine%coordinates)
      momentum = map%body_speeds(1, v) * machine%inertia(1, :)
      do b = 1, machine%bodies
        do k = map%first(b), map%first(b + 1) - 1
          torque(map%coordinate(k)) = torque(map%coordinate(k)) + map%ratio(1, k) * momentum(b)
        end do
      end do
    end associate
  end function inertial_torque

  !> Speeds of the bodies in rigid motions [rad/s], [bodies].
  pure function body_speeds(self, s) result(omega)
    class(torque_balance_t), intent(in) :: self
    real(wp), intent(in) :: s(:)   !! speeds of the rigid motions [rad/s], [freedoms]
    real(wp) :: omega(self%formulation%machine%bodies)

    omega = self%formulation%machine%coordinates%body_speeds(1, self%motions%speeds(s))
  end function body_speeds

  !> Sets the state y from the unknowns, at the start angles.
  subroutine set_state(self, z)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(in) :: z(:)   !! [unknowns]

    associate (f => self%coordinates, s => z(:size(self%motions%free)))
      self%y(1, :f) = self%motions%speeds(s) + self%motions%drift
      self%y(1, f + 1:2 * f) = 0.0_wp
      self%y(1, 2 * f + 1:) = z(size(s) + 1:)
    end associate
  end subroutine set_state

  !> Gives the elements the speeds and internal states of the unknowns, at the start angles.
  subroutine set_elements(self, z)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(in) :: z(:)   !! [unknowns]
    integer :: i, k
    real(wp) :: speed

    associate (elements => self%formulation%state%elements)
      elements%angle(1, :) = self%start_twist
      elements%speed(1, :) = 0.0_wp
      do i = 1, size(self%inelastic)
        speed = self%driven(i)
        do k = self%first(i), self%first(i + 1) - 1
          speed = speed + self%ratio(k) * z(self%freedom(k))
        end do
        elements%speed(1, self%inelastic(i)) = speed
      end do
      elements%internal%value(1, :) = z(size(self%motions%free) + 1:)
    end associate
  end subroutine set_elements

  !> Replaces the internal states by those that do not change at the speeds.
  subroutine settle(self, z)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(inout) :: z(:)   !! [unknowns]

    if (self%internal == 0) return
    call set_elements(self, z)
    call self%formulation%state%settle_internal(self%formulation%machine, self%t(1))
    z(size(self%motions%free) + 1:) = self%formulation%state%elements%internal%value(1, :)
  end subroutine settle

  !> Moments of the inelastic elements that all have one speed, with internal states that do not change [N m], [inelastic].
  function moments_at(self, speed) result(moments)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! u' [rad/s]
    real(wp) :: moments(size(self%inelastic))

    associate (machine => self%formulation%machine, state => self%formulation%state)
      state%elements%angle(1, :) = self%start_twist
      state%elements%speed(1, :) = 0.0_wp
      state%elements%speed(1, self%inelastic) = speed
      call state%settle_internal(machine, self%t(1))
      call self%joints%choose_modes(machine, state)
      call state%choose_branches(machine, self%t)
      call state%evaluate_elements(machine, self%t)
      moments = state%elements%restoring(1, self%inelastic) + state%elements%applied(1, self%inelastic)
    end associate
  end function moments_at

  !> Computes the residuals of the equations.
  subroutine evaluate(self, z)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(in) :: z(:)   !! [unknowns]
    real(wp) :: term
    integer :: e, i, k

    call self%set_state(z)
    call set_elements(self, z)
    self%residual = 0.0_wp
    self%scale = 0.0_wp
    associate (state => self%formulation%state, r => size(self%motions%free))
      call self%evaluate_laws()
      do i = 1, size(self%inelastic)
        e = self%inelastic(i)
        do k = self%first(i), self%first(i + 1) - 1
          term = self%ratio(k) * (state%elements%restoring(1, e) + state%elements%applied(1, e))
          self%residual(self%freedom(k)) = self%residual(self%freedom(k)) + term
          self%scale(self%freedom(k)) = self%scale(self%freedom(k)) + abs(term)
        end do
      end do
      if (allocated(self%drag)) then
        do i = 1, r
          self%residual(i) = self%residual(i) - dot_product(self%drag(:, i), z(:r) - self%start_speed)
          self%scale(i) = self%scale(i) + dot_product(abs(self%drag(:, i)), abs(z(:r)) + abs(self%start_speed))
        end do
      end if
      self%residual(r + 1:) = state%elements%internal%rate(1, :)
      self%scale(r + 1:) = abs(self%residual(r + 1:))
    end associate
  end subroutine evaluate

  !> Evaluates the elements, whose joints that are not at rest slip.
  subroutine evaluate_laws(self)
    class(torque_balance_t), intent(inout) :: self

    associate (machine => self%formulation%machine, state => self%formulation%state)
      call self%joints%choose_modes(machine, state)
      call state%choose_branches(machine, self%t)
      call state%evaluate_elements(machine, self%t)
      if (allocated(self%joints%by_moment)) call self%joints%add_losses(machine, state%elements)
    end associate
  end subroutine evaluate_laws

  !> Derivatives of the residuals by the unknowns, after `evaluate` with the same unknowns.
  subroutine differentiate(self, matrix)
    class(torque_balance_t), intent(inout) :: self
    real(wp), intent(out) :: matrix(:, :)   !! [unknowns, unknowns]
    integer :: column, i, j, k, m, x

    matrix = 0.0_wp
    call self%formulation%state%differentiate_elements(self%formulation%machine, self%t)
    associate (elements => self%formulation%state%elements)
      do i = 1, size(self%inelastic)
        do k = self%first(i), self%first(i + 1) - 1
          do j = self%first(i), self%first(i + 1) - 1
            associate (entry => matrix(self%freedom(k), self%freedom(j)))
              entry = entry + self%ratio(k) * self%ratio(j) * elements%applied_speed(1, self%inelastic(i))
            end associate
          end do
        end do
      end do
    end associate
    if (allocated(self%drag)) then
      associate (r => size(self%motions%free))
        matrix(:r, :r) = matrix(:r, :r) - self%drag
      end associate
    end if
    ! fills the rows and columns of the internal states x
    associate (states => self%formulation%machine%elements%internal, values => self%formulation%state%elements%internal, &
               r => size(self%motions%free))
      do x = 1, self%internal
        do m = 1, states%members(x)
          column = r + states%first(x) + m - 1
          matrix(r + x, column) = values%rate_internal(1, m, x)
        end do
        i = findloc(self%inelastic, states%element(x), dim=1)
        if (i == 0) cycle   ! an elastic coupling, which does not turn
        do k = self%first(i), self%first(i + 1) - 1
          matrix(self%freedom(k), r + x) = matrix(self%freedom(k), r + x) + self%ratio(k) * values%applied(1, x)
          matrix(r + x, self%freedom(k)) = matrix(r + x, self%freedom(k)) + self%ratio(k) * values%rate_speed(1, x)
        end do
      end do
    end associate
    if (allocated(self%joints%by_moment) .and. self%joints%teeth%count > 0) call self%differentiate_losses(matrix)
  end subroutine differentiate

  !> Adds the derivatives of the losses of teeth that turn.
  subroutine differentiate_losses(self, matrix)
    class(torque_balance_t), intent(in) :: self
    real(wp), intent(inout) :: matrix(:, :)   !! [unknowns, unknowns]
    real(wp), dimension(self%formulation%machine%elements%count) :: moments, speeds
    real(wp) :: change(self%joints%teeth%count)
    integer :: i, k, place, unknown

    associate (elements => self%formulation%state%elements, states => self%formulation%machine%elements%internal, &
               r => size(self%motions%free), joints => self%joints)
      do unknown = 1, size(matrix, 2)
        speeds = 0.0_wp
        moments = 0.0_wp
        if (unknown > r) then
          moments(states%element(unknown - r)) = elements%internal%applied(1, unknown - r)
        else
          do i = 1, size(self%inelastic)
            do k = self%first(i), self%first(i + 1) - 1
              if (self%freedom(k) == unknown) speeds(self%inelastic(i)) = self%ratio(k)
            end do
          end do
          moments(self%inelastic) = elements%applied_speed(1, self%inelastic) * speeds(self%inelastic)
        end if
        change = joints%change_of_losses(moments, speeds)
        do i = 1, size(change)
          place = findloc(self%inelastic, joints%element(joints%teeth%joint(i)), dim=1)
          do k = self%first(place), self%first(place + 1) - 1
            matrix(self%freedom(k), unknown) = matrix(self%freedom(k), unknown) + self%ratio(k) * change(i)
          end do
        end do
      end do
    end associate
  end subroutine differentiate_losses

  !> Numbers of the blocks of unknowns, [unknowns]. Unknowns of different blocks have no common equation.
  function blocks(self) result(block_of)
    class(torque_balance_t), intent(in) :: self
    real(wp), parameter :: rounding = 1.0e-9_wp
    integer :: block_of(self%unknowns())
    integer :: i, k, l, place, root, x

    block_of = [(i, i=1, size(block_of))]
    do i = 1, size(self%inelastic)
      do k = self%first(i) + 1, self%first(i + 1) - 1
        call join_components(self%freedom(self%first(i)), self%freedom(k), block_of)
      end do
    end do
    if (allocated(self%joints%by_moment)) then
      ! joins what teeth that turn join: their losses depend on the moments of other elements
      associate (joints => self%joints, first => self%first)
        do l = 1, joints%teeth%count
          place = findloc(self%inelastic, joints%element(joints%teeth%joint(l)), dim=1)
          if (first(place) == first(place + 1)) cycle
          do i = 1, size(self%inelastic)
            if (first(i) == first(i + 1)) cycle
            if (abs(joints%by_moment(l, self%inelastic(i))) <= rounding * maxval(abs(joints%by_moment(l, :)))) cycle
            call join_components(self%freedom(first(place)), self%freedom(first(i)), block_of)
          end do
        end do
      end associate
    end if
    associate (states => self%formulation%machine%elements%internal, r => size(self%motions%free))
      do x = 1, self%internal
        call join_components(r + states%first(x), r + x, block_of)
        i = findloc(self%inelastic, states%element(x), dim=1)
        if (i == 0) cycle   ! an elastic coupling, which does not turn
        if (self%first(i) < self%first(i + 1)) call join_components(self%freedom(self%first(i)), r + x, block_of)
      end do
    end associate
    do i = 1, size(block_of)
      call find_root(block_of, i, root)
      block_of(i) = root
    end do
  end function blocks

end module nocdyn_torque_balance
