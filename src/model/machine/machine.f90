!> A machine on a block of lanes: bodies, banks of elements, constraints, and the independent coordinates.
module nocdyn_machine
  use nocdyn_bank, only: bank_of, bank_slot_t, name_length, role_motor
  use nocdyn_constraints, only: constraints_t
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_element_rows, only: element_rows_t, joined_rows, rows_between
  use nocdyn_elements, only: elements_t, new_elements
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: new_polynomial_laws, polynomial_laws_t
  use nocdyn_rigid_trains, only: rigid_trains_t
  use nocdyn_rubber_laws, only: rubber_law_t
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
    real(wp), allocatable :: driven_speed(:)              !! of the bodies beside their coordinates, where drives turn some in a
                                                          !! steady state; not allocated: none [rad/s], [bodies]
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
    type(rubber_law_t), allocatable :: rubber(:)   !! rubber couplings by data sheets
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
    procedure :: driven_rates
    procedure :: start_internal
    procedure :: internal_name
    procedure :: is_electrical
    procedure :: refresh_lane
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
        bank%first_internal = internal + 1
        total = bank%last()
        rows = joined_rows(rows, bank%rows)
        internal = internal + bank%states * bank%count
        phase = [phase, merge(0, bank%first - 1 + [(e + bank%count, e=1, bank%count)], bank%ports == 1)]
      end associate
    end do
    self%elements = new_elements(rows, [(spread(self%banks(i)%bank%states, 1, self%banks(i)%bank%count), &
                                        i=1, size(self%banks))], phase)
    self%laws = new_polynomial_laws(self%lanes, total)
    do i = 1, size(self%banks)
      call self%banks(i)%bank%polynomials(1, self%lanes, self%laws)
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

  !> Rates of twist of the elements that drives turn while the coordinates stand still [rad/s], [elements]. Elastic ones have
  !> none.
  pure function driven_rates(self) result(rates)
    class(machine_t), intent(in) :: self   !! of one lane, with drives
    real(wp) :: rates(self%elements%count)
    real(wp) :: by_lane(1, self%elements%count)

    call self%elements%rows%combine(1, self%bodies, reshape([0.0_wp, self%driven_speed], [1, self%bodies + 1]), by_lane)
    rates = by_lane(1, :)
    rates(self%elastic()) = 0.0_wp
  end function driven_rates

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

  !> Name of an element.
  pure function element_name(self, element) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: element   !! number in the machine
    character(len=name_length(self%banks, element)) :: name

    associate (bank => self%banks(bank_of(self%banks, element))%bank)
      name = bank%names(element - bank%first + 1)%text
    end associate
  end function element_name

  !> Whether the law of some bank has an operation.
  pure logical function has_operation(self, operation)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: operation   !! op_...
    integer :: i, k

    has_operation = .false.
    do i = 1, size(self%general_banks)
      associate (tape => self%banks(self%general_banks(i))%bank%tape)
        has_operation = has_operation .or. any([(tape%node(k)%operation == operation, k=1, tape%count)])
      end associate
    end do
  end function has_operation

  !> Computes what is kept of the parameters of a lane, after these have changed.
  subroutine refresh_lane(self, lane)
    class(machine_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: i

    call self%laws%refresh_lane(lane)
    do i = 1, size(self%banks)
      call self%banks(i)%bank%refresh_lane(lane)
    end do
  end subroutine refresh_lane

  !> Kinetic energy omega^T J omega / 2 of one lane [J].
  pure real(wp) function kinetic_energy(self, lane, omega) result(energy)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: omega(:)   !! [rad/s], [bodies]

    energy = 0.5_wp * sum(self%inertia(lane, :) * omega**2)
  end function kinetic_energy

end module nocdyn_machine
