!> A machine on a block of lanes: bodies, banks of elements, constraints, and the independent coordinates.
module nocdyn_machine
  use nocdyn_bank, only: bank_of, bank_slot_t, bank_t, name_length, role_motor
  use nocdyn_constraints, only: constraints_t
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_element_rows, only: element_rows_t, joined_rows, rows_between
  use nocdyn_elements, only: elements_t, internal_states_t, new_elements
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: new_polynomial_laws, polynomial_laws_t
  use nocdyn_rigid_trains, only: rigid_trains_t
  use nocdyn_switches, only: new_switches, switches_t
  use nocdyn_text, only: quoted, string_t
  implicit none (type, external)
  private

  !> Impulses of the start: start speeds that violate constraints are projected on those that obey them.
  type, public :: start_impulse_t
    integer, allocatable :: row(:)        !! constraint rows with an impulse: violated rows, and rows geared to them
    real(wp), allocatable :: impulse(:)   !! impulse in each of these rows [unit of the row's multiplier * s]
    real(wp) :: energy_lost = 0.0_wp      !! kinetic energy lost [J]
  end type start_impulse_t

  !> All data of a machine; the parameters of each lane may differ.
  type, public :: machine_t
    integer :: lanes = 1
    integer :: bodies = 0
    integer :: nodes = 0                                  !! the last bodies: nodes inside of shafts
    type(string_t), allocatable :: names(:)               !! names of the bodies
    real(wp), allocatable :: inertia(:, :)                !! J [kg m2], shape [lanes, bodies]
    real(wp), allocatable :: start_angle(:, :)            !! [rad], [lanes, bodies]
    real(wp), allocatable :: start_speed(:, :)            !! [rad/s], [lanes, bodies], obeys the constraints
    type(start_impulse_t), allocatable :: start_impulse   !! if the start speeds of the input were projected
    real(wp), allocatable :: steady_internal(:, :)        !! internal states of a steady start, [lanes, internal states]
    type(string_t), allocatable :: start_notes(:)         !! how the start was found; joints that do nothing
    type(string_t), allocatable :: simplifications(:)     !! simplifications of the model, one sentence each
    type(bank_slot_t), allocatable :: banks(:)
    type(elements_t) :: elements                !! elements of all banks, after `number_elements`
    type(polynomial_laws_t) :: laws             !! polynomial parts of their laws, after `number_elements`
    integer, allocatable :: general_banks(:)    !! banks with laws that are not polynomials
    integer, allocatable :: internal_banks(:)   !! banks with internal states
    type(switches_t) :: switches                !! switches of all banks, after `number_elements`
    integer, allocatable :: with_work(:)        !! elements whose power may be integrated, ascending
    type(constraints_t) :: constraints
    type(rigid_trains_t) :: trains
    type(geared_group_t), allocatable :: groups(:)
    type(coordinates_t) :: coordinates
  contains
    procedure :: add_nodes
    procedure :: freedoms
    procedure :: number_elements
    procedure :: pass_parameters
    procedure :: to_mean_torque
    procedure :: follows_mean_speed
    procedure :: elastic
    procedure :: element_name
    procedure :: start_twist
    procedure :: start_internal
    procedure :: internal_name
    procedure :: is_electrical
    procedure :: choose_branches
    procedure :: keep_branches, restore_branches, take_branches
    procedure :: settle_internal
    procedure :: evaluate
    procedure :: evaluate_elements
    procedure :: differentiate_elements
    procedure :: evaluate_energies
    procedure :: fastest_wave
    procedure :: refresh_lane
    procedure :: power
    procedure :: has_operation
    procedure :: kinetic_energy
  end type machine_t

contains

  !> Adds bodies that the input does not name, after the others.
  subroutine add_nodes(self, names, inertia)
    class(machine_t), intent(inout) :: self
    type(string_t), intent(in) :: names(:)   !! [nodes]
    real(wp), intent(in) :: inertia(:)       !! [kg m2], kg of bodies that move along a line, [nodes]

    self%nodes = self%nodes + size(names)
    self%bodies = self%bodies + size(names)
    self%constraints%bodies = self%bodies
    self%names = [self%names, names]
    self%start_angle = reshape([self%start_angle, spread(0.0_wp * inertia, 1, self%lanes)], [self%lanes, self%bodies])
    self%start_speed = reshape([self%start_speed, spread(0.0_wp * inertia, 1, self%lanes)], [self%lanes, self%bodies])
    self%inertia = reshape([self%inertia, spread(inertia, 1, self%lanes)], [self%lanes, self%bodies])
  end subroutine add_nodes

  !> Degrees of freedom.
  pure integer function freedoms(self)
    class(machine_t), intent(in) :: self
    integer :: i

    freedoms = self%coordinates%freedoms - sum([(self%banks(i)%bank%moving_rows, i=1, size(self%banks))])
  end function freedoms

  !> Numbers the elements of all banks consecutively, and collects their laws and switches. Call it once all banks are set.
  subroutine number_elements(self)
    class(machine_t), intent(inout) :: self
    type(element_rows_t) :: rows
    integer :: e, i, internal, total
    integer, allocatable :: phase(:)   ! of each element, 0 for none

    total = 0
    internal = 0
    allocate (phase(0))
    rows = rows_between([integer ::], [integer ::])
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        bank%first = total + 1
        bank%first_value = self%lanes * total + 1
        bank%first_internal = internal + 1
        total = bank%last()
        rows = joined_rows(rows, bank%rows)
        internal = internal + bank%states * bank%count
        phase = [phase, merge(0, bank%first - 1 + [(e + bank%count, e=1, bank%count)], bank%ports == 1)]
      end associate
    end do
    self%elements = new_elements(self%lanes, rows, &
                                 [(spread(self%banks(i)%bank%states, 1, self%banks(i)%bank%count), i=1, size(self%banks))], &
                                 phase)
    self%laws = new_polynomial_laws(self%lanes, total)
    do i = 1, size(self%banks)
      call self%banks(i)%bank%polynomials(1, self%lanes, self%laws)
      call self%banks(i)%bank%prepare_law(total)
    end do
    call self%laws%find_plain_parts()
    self%general_banks = pack([(i, i=1, size(self%banks))], [(self%banks(i)%bank%values > 0 .and. &
                                                            .not. self%banks(i)%bank%is_polynomial, i=1, size(self%banks))])
    self%internal_banks = pack([(i, i=1, size(self%banks))], [(self%banks(i)%bank%internal_values > 0, i=1, size(self%banks))])
    self%with_work = [(self%banks(i)%bank%first - 1 + self%banks(i)%bank%with_work, i=1, size(self%banks))]
    self%switches = new_switches(self%banks)
  end subroutine number_elements

  !> Passes all arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(machine_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters
    integer :: i

    call parameters%add_structure([self%bodies])
    call parameters%add('machine: inertia', self%inertia)
    call parameters%add('machine: start_angle', self%start_angle)
    call parameters%add('machine: start_speed', self%start_speed)
    call parameters%add_structure(allocated(self%steady_internal))
    if (allocated(self%steady_internal)) call parameters%add('machine: steady_internal', self%steady_internal)
    do i = 1, size(self%banks)
      if (parameters%describes) call self%banks(i)%bank%list_structure(parameters)
      call self%banks(i)%bank%pass_parameters(parameters)
    end do
    call self%laws%pass_parameters(parameters)
    call self%constraints%pass_parameters(parameters)
    call self%coordinates%pass_parameters(parameters)
  end subroutine pass_parameters

  !> Replaces periodic torques by their means, for the search of a steady state.
  subroutine to_mean_torque(self)
    class(machine_t), intent(inout) :: self
    integer :: i

    do i = 1, size(self%banks)
      call self%banks(i)%bank%to_mean_torque()
    end do
    call self%number_elements()
  end subroutine to_mean_torque

  !> Whether the torque of each element follows the mean speed of a cycle, and not its oscillations, [elements].
  pure function follows_mean_speed(self) result(follows)
    class(machine_t), intent(in) :: self
    logical, allocatable :: follows(:)
    integer :: i

    allocate (follows(self%elements%count), source=.false.)
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        if (bank%follows_mean_speed) follows(bank%first:bank%last()) = .true.
      end associate
    end do
  end function follows_mean_speed

  !> Elements that can have a restoring moment, ascending.
  pure function elastic(self) result(elements)
    class(machine_t), intent(in) :: self
    integer, allocatable :: elements(:)
    integer :: i

    elements = [(self%banks(i)%bank%first - 1 + self%banks(i)%bank%elastic, i=1, size(self%banks))]
  end function elastic

  !> Twists of the elements at the start [rad], [lanes, elements].
  pure function start_twist(self) result(twist)
    class(machine_t), intent(in) :: self
    real(wp) :: twist(self%lanes, self%elements%count)
    real(wp) :: angle(self%lanes, 0:self%bodies)

    angle(:, 0) = 0.0_wp
    angle(:, 1:) = self%start_angle
    call self%elements%rows%combine(self%lanes, self%bodies, angle, twist)
  end function start_twist

  !> Internal states at the start, [lanes, internal states].
  function start_internal(self) result(internal)
    class(machine_t), intent(in) :: self
    real(wp), allocatable :: internal(:, :)
    real(wp) :: omega(self%lanes, 0:self%bodies), speed(self%lanes, self%elements%count)
    integer :: i

    if (allocated(self%steady_internal)) allocate (internal, source=self%steady_internal)
    if (allocated(internal)) return
    allocate (internal(self%lanes, self%elements%internal%count), source=0.0_wp)
    omega = reshape([spread(0.0_wp, 1, self%lanes), self%start_speed], shape(omega))
    do i = 1, size(self%internal_banks)
      associate (bank => self%banks(self%internal_banks(i))%bank)
        call bank%rows%combine(self%lanes, self%bodies, omega, speed(:, :bank%count))
        call bank%start_internal(speed(:, :bank%count), &
                              internal(:, bank%first_internal:bank%first_internal + bank%states * bank%count - 1))
      end associate
    end do
  end function start_internal

  !> Name of an internal state for messages, e.g. "armature current of motor 'drive'".
  function internal_name(self, index) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to elements%internal%count
    character(len=:), allocatable :: name
    integer :: i

    do i = 1, size(self%internal_banks)
      associate (bank => self%banks(self%internal_banks(i))%bank)
        associate (offset => index - bank%first_internal)
          if (offset >= bank%states * bank%count) cycle
          name = trim(bank%internal_names(1 + modulo(offset, bank%states))) // ' of ' // trim(bank%kind_name()) // ' ' // &
                 quoted(bank%names(1 + offset / bank%states)%text)
          return
        end associate
      end associate
    end do
    error stop 'nocdyn_machine: there are not so many inner states'
  end function internal_name

  !> Whether an internal state is a current or a flux, and no part of a controller.
  logical function is_electrical(self, state)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: state   !! as `index` of `internal_name`, or 0
    integer :: i

    is_electrical = .false.
    do i = 1, merge(size(self%internal_banks), 0, state > 0)
      associate (bank => self%banks(self%internal_banks(i))%bank)
        if (state < bank%first_internal .or. state >= bank%first_internal + bank%states * bank%count) cycle
        is_electrical = bank%role == role_motor .and. &
                        index(bank%internal_names(1 + modulo(state - bank%first_internal, bank%states)), 'governor') /= 1
      end associate
    end do
  end function is_electrical

  !> Chooses the branches of the laws in all lanes, from the angles, speeds and internal states in `elements`.
  subroutine choose_branches(self, t)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)   !! [s], [lanes]
    integer :: k, lane

    associate (switches => self%switches, elements => self%elements)
      do k = 1, switches%count
        do lane = 1, self%lanes
          associate (e => switches%element(k), p => switches%moving(switches%phase_place(k)))
            call switches%choose(self%banks, k, lane, t(lane), [elements%angle(lane, e), elements%speed(lane, e), &
                                                                elements%angle(lane, p), elements%speed(lane, p)], &
                                 elements%internal%value(lane, :))
          end associate
        end do
      end do
    end associate
  end subroutine choose_branches

  !> Keeps the present branches of all laws, to which `restore_branches` goes back.
  subroutine keep_branches(self)
    class(machine_t), intent(inout) :: self
    integer :: i

    do i = 1, merge(size(self%banks), 0, self%switches%count > 0)
      call self%banks(i)%bank%keep_branches()
    end do
  end subroutine keep_branches

  subroutine restore_branches(self)
    class(machine_t), intent(inout) :: self
    integer :: i

    do i = 1, merge(size(self%banks), 0, self%switches%count > 0)
      call self%banks(i)%bank%restore_branches()
    end do
  end subroutine restore_branches

  !> Puts a lane on the branches of a lane of a machine with the same structure.
  subroutine take_branches(self, lane, from, from_lane)
    class(machine_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(machine_t), intent(in) :: from
    integer, intent(in) :: from_lane   !! lane of `from`
    integer :: i, switch

    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        do switch = 1, size(bank%switch_element)
          call bank%set_branch(switch, lane, from%banks(i)%bank%branch(from_lane, switch))
        end do
      end associate
    end do
  end subroutine take_branches

  !> Replaces the internal states in the first lane of `elements` by those that do not change at the speeds there.
  subroutine settle_internal(self, t)
    class(machine_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! [s]
    integer :: i

    do i = 1, size(self%internal_banks)
      associate (bank => self%banks(self%internal_banks(i))%bank, speed => self%elements%speed, z => self%elements%internal%value)
        call bank%steady_internal(t, speed(1, bank%first:bank%last()), &
                                  z(1, bank%first_internal:bank%first_internal + bank%states * bank%count - 1))
      end associate
    end do
  end subroutine settle_internal

  !> Name of an element.
  pure function element_name(self, element) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: element   !! number in the machine
    character(len=name_length(self%banks, element)) :: name

    associate (bank => self%banks(bank_of(self%banks, element))%bank)
      name = bank%names(element - bank%first + 1)%text
    end associate
  end function element_name

  !> Torques T = Q + C omega + K phi of all elements on the bodies: the right-hand side of eq. (12) without reactions.
  subroutine evaluate(self, t, phi, omega, torque)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)               !! [s], [lanes]
    real(wp), contiguous, intent(in) :: phi(:, 0:)         !! angles [rad], [lanes, 0:bodies], body 0 is the ground
    real(wp), contiguous, intent(in) :: omega(:, 0:)       !! speeds [rad/s], [lanes, 0:bodies]
    real(wp), contiguous, intent(inout) :: torque(:, 0:)   !! [N m], [lanes, 0:bodies]

    call self%elements%gather(phi, omega)
    call self%evaluate_elements(t)
    call self%elements%scatter(torque)
  end subroutine evaluate

  !> Moments of all elements, from the angles and speeds in `elements`.
  subroutine evaluate_elements(self, t)
    class(machine_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)   !! [s]
    integer :: i

    call self%laws%evaluate(self%elements)
    do i = 1, size(self%general_banks)
      associate (bank => self%banks(self%general_banks(i))%bank, elements => self%elements, internal => self%elements%internal)
        call evaluate_bank(bank, size(elements%angle), t, elements%angle, elements%speed, internal, elements%restoring, &
                           elements%applied)
      end associate
    end do
  end subroutine evaluate_elements

  !> Whether the law of some bank has an operation.
  pure logical function has_operation(self, operation)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: operation   !! op_...
    integer :: i, k

    has_operation = .false.
    do i = 1, size(self%general_banks)
      associate (tape => self%banks(self%general_banks(i))%bank%law%law%tape)
        has_operation = has_operation .or. any([(tape%node(k)%operation == operation, k=1, tape%count)])
      end associate
    end do
  end function has_operation

  !> Calls the law of a bank with its part of all values. Only addresses are passed, no array descriptors.
  subroutine evaluate_bank(bank, n, t, angle, speed, internal, restoring, applied)
    class(bank_t), intent(inout) :: bank
    integer, intent(in) :: n                              !! lanes * elements of the machine
    real(wp), intent(in) :: t(bank%lanes)                 !! [s]
    real(wp), intent(in) :: angle(n), speed(n)            !! [rad], [rad/s]
    type(internal_states_t), intent(inout) :: internal
    real(wp), intent(inout) :: restoring(n), applied(n)   !! [N m]
    real(wp) :: no_rates(0)

    associate (first => bank%first_value, state => bank%first_internal)
      if (bank%states > 0) then
        call bank%evaluate(t, angle(first), speed(first), internal%value(1, state), restoring(first), applied(first), &
                           internal%rate(1, state))
      else
        call bank%evaluate(t, angle(first), speed(first), no_rates, restoring(first), applied(first), no_rates)
      end if
    end associate
  end subroutine evaluate_bank

  !> Derivatives of the moments, after `evaluate_elements`.
  subroutine differentiate_elements(self, t)
    class(machine_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)   !! [s]
    integer :: first_cross, i

    self%elements%time(:) = t
    call self%laws%differentiate(self%elements)
    call self%elements%cross%clear()
    first_cross = 1
    do i = 1, size(self%general_banks)
      associate (bank => self%banks(self%general_banks(i))%bank)
        call bank%law%differentiate(bank%first, bank%first_internal, first_cross, self%elements)
        if (bank%ports > 1) first_cross = first_cross + 2 * bank%count
      end associate
    end do
  end subroutine differentiate_elements

  !> Stored energies of all elements, from the angles and speeds in `elements`.
  subroutine evaluate_energies(self)
    class(machine_t), intent(inout) :: self
    integer :: i

    call self%laws%evaluate_energies(self%elements)
    do i = 1, size(self%general_banks)
      associate (bank => self%banks(self%general_banks(i))%bank)
        call bank%law%evaluate_energies(bank%first, self%elements)
        if (bank%states == 0) cycle
        call bank%keep_energy(self%elements)
        self%elements%stored(:, bank%first:bank%last()) = self%elements%stored(:, bank%first:bank%last()) &
                                                          + self%elements%kept(:, bank%first:bank%last())
      end associate
    end do
  end subroutine evaluate_energies

  !> The largest rate at which the moments of one lane oscillate with the time or an angle [rad/s], at the speeds in `elements`.
  pure real(wp) function fastest_wave(self, lane) result(fastest)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: lane
    integer :: i

    fastest = 0.0_wp
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        if (bank%is_polynomial .and. bank%moving_rows == 0) cycle
        associate (last => bank%first - 1 + bank%ports * bank%count)   ! of its phases
          fastest = max(fastest, bank%fastest_wave(lane, self%elements%speed(lane, bank%first:last)))
        end associate
      end associate
    end do
  end function fastest_wave

  !> Computes what the laws keep of the parameters of a lane, after these have changed.
  subroutine refresh_lane(self, lane)
    class(machine_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: i

    call self%laws%refresh_lane(lane)
    do i = 1, size(self%banks)
      call self%banks(i)%bank%refresh_lane(lane)
    end do
  end subroutine refresh_lane

  !> Powers of the elements `with_work` after `evaluate`, positive into the machine.
  subroutine power(self, watts)
    class(machine_t), intent(in) :: self
    real(wp), intent(inout) :: watts(self%lanes, size(self%with_work))   !! [W]
    integer :: e, k, l

    do k = 1, size(self%with_work)
      e = self%with_work(k)
      do l = 1, self%lanes
        watts(l, k) = self%elements%applied(l, e) * self%elements%speed(l, e)
      end do
    end do
  end subroutine power

  !> Kinetic energy omega^T J omega / 2 of one lane [J].
  pure real(wp) function kinetic_energy(self, lane, omega) result(energy)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: omega(:)   !! [rad/s], [bodies]

    energy = 0.5_wp * sum(self%inertia(lane, :) * omega**2)
  end function kinetic_energy

end module nocdyn_machine
