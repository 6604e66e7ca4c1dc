!> A bank: elements with the same form of law, evaluated together on a block of lanes.
!>
!> The elements of a machine are numbered consecutively, bank after bank (`elements_t`). A bank owns the contiguous part that
!> begins with its element `first`. A new kind of element extends `bank_t`, adds its parameters and writes its law in `describe`
!> (`described_elements_t`).
module nocdyn_bank
  use nocdyn_described_elements, only: described_elements_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_element_rows, only: element_rows_t, rows_between
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_law_waves, only: has_waves, law_wave_t
  use nocdyn_operating_points, only: boundary_speeds, late, settle, waves_at
  use nocdyn_quantities, only: form_total, new_quantity, quantity_t, rank_torque
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: append_bank, bank_of, name_length

  integer, parameter, public :: role_coupling = 1     !! in K and C of eqs. (21), (22); stores energy
  integer, parameter, public :: role_load = 2         !! in C of eq. (22); takes energy out
  integer, parameter, public :: role_motor = 3        !! in Q_m of eq. (18); puts energy in
  integer, parameter, public :: role_excitation = 4   !! in Q_0 of eq. (17); puts energy in
  integer, parameter, public :: role_phase = 5        !! part of a coupling: the phase of an element of the bank before
  integer, parameter, public :: role_clutch = 6       !! locks or slips; takes energy out
  integer, parameter, public :: role_freewheel = 7    !! locks or slips in one direction; takes energy out
  integer, parameter, public :: role_cardan = 8       !! joints with a ratio that depends on the position
  integer, parameter, public :: role_crank = 9
  integer, parameter, public :: role_relation = 10
  integer, parameter, public :: role_drive = 11       !! prescribed motion; puts energy in
  integer, parameter, public :: role_bearing = 12     !! dry friction on the ground; takes energy out
  integer, parameter, public :: role_loss = 13        !! friction of teeth; takes energy out

  character(len=*), parameter, public :: role_names(*) = [character(len=10) :: 'coupling', 'load', 'motor', 'excitation', &
                                                          'coupling', 'clutch', 'freewheel', 'cardan', 'crank', 'relation', &
                                                          'drive', 'bearing', 'loss']

  !> One harmonic of the torque of an element that turns steadily, by the angle phi of `body`.
  type, public :: harmonic_t
    integer :: element = 0              !! of the machine, on which it acts: the element, or its phase
    complex(wp) :: amplitude = 0.0_wp   !! the torque is the real part of amplitude exp(i (frequency t + order phi)) [N m]
    real(wp) :: frequency = 0.0_wp      !! [rad/s]
    real(wp) :: order = 0.0_wp          !! oscillations per turn of the body
    integer :: body = 0
    logical :: is_twist = .false.       !! a twist in series with the element instead of a torque; its amplitude is in rad
    integer :: by_element = 0           !! element of the machine whose mean moment multiplies the amplitude; 0: none
  end type harmonic_t

  type, abstract, extends(described_elements_t), public :: bank_t
    type(string_t), allocatable :: names(:)       !! of the elements
    type(element_rows_t) :: rows                  !! bodies of the elements; M acts on them by the coefficients
    integer, allocatable :: with_work(:)          !! elements whose work is integrated, numbered within the bank
    integer, allocatable :: elastic(:)            !! elements that can have a restoring moment, numbered within the bank
    integer :: moving_rows = 0                    !! rows of L_lambda that its elements hold always (`nocdyn_moving_rows`)
    integer :: role = role_coupling               !! role_...: term of eq. (12) to which the bank belongs
    logical :: has_polynomial_potential = .true.  !! whether `polynomials` gives its whole restoring moment
    logical :: has_paper_law = .true.             !! whether its law is the one of eqs. (3), (5), (17) or (20)
    logical :: is_engine = .false.                !! whether its elements are excitations whose means drive
    character(len=10) :: works = ''               !! of the cylinders of one machine: as an 'engine' or a 'compressor'
    logical :: follows_mean_speed = .false.       !! whether its torque changes with the speed from cycle to cycle, not within one
    logical :: is_mesh = .false.                  !! whether its rows are radii: angles are deformations [m], moments forces [N]
    logical :: is_damper = .false.                 !! whether they damp the vibration of cylinders, and are no loads
    logical :: has_parts = .false.                !! whether consecutive elements of one name are parts of one element
    character(len=24), allocatable :: internal_names(:)   !! e.g. 'armature current', [states]
    integer :: first_internal = 1                 !! number of the first internal state of `first` in the machine
    real(wp), allocatable :: loss_factor(:)       !! k (1 + i loss_factor) is the stiffness at a frequency; not allocated: 0
    real(wp), allocatable :: loss_damping(:)      !! part of the damping that replaces it over the time [N m s/rad]; with it
    real(wp), allocatable :: vibration_damping(:) !! of oscillations in place of the slope over the speed, which is then the one
                                                  !! of the mean rotation [N m s/rad], [elements]; not allocated: the slope
    real(wp), allocatable :: vibration_factor(:)  !! more of it, over the moment over the speed, [elements]; with it
    logical :: follows_inertias = .false.         !! whether parameters follow from the inertias of bodies
  contains
    procedure, non_overridable :: to_mean_torque
    procedure, non_overridable :: list_harmonics
    procedure :: has_ended
    procedure :: transient_frequency
    procedure :: hold_speed
    procedure :: follows_supply, set_supply, idle_supply
    procedure :: start_internal
    procedure, non_overridable :: steady_internal
    procedure :: decide_internal
    procedure, non_overridable :: knees
    procedure :: extremes
    procedure :: keep_energy
    procedure :: stand_in
    generic :: connect => connect_keys, connect_rows
    procedure, private :: connect_keys, connect_rows
    procedure :: list_structure
    procedure :: last
    procedure :: named_count
    procedure :: kind_name
    procedure :: is_source
    procedure :: quantities
    procedure :: observe
  end type bank_t

  !> One bank of any type, so that a machine can hold a list of them.
  type, public :: bank_slot_t
    class(bank_t), allocatable :: bank
  end type bank_slot_t

contains

  !> Appends a copy of a bank.
  subroutine append_bank(banks, bank)
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    class(bank_t), intent(in) :: bank
    type(bank_slot_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(banks) + 1))
    do i = 1, size(banks)
      call move_alloc(banks(i)%bank, longer(i)%bank)
    end do
    ! `allocate (source=)`: gfortran 12 corrupts the heap on assignment to a polymorphic component of an array element
    allocate (longer(size(longer))%bank, source=bank)
    call move_alloc(longer, banks)
  end subroutine append_bank

  !> The viscous damping in place of the relative one over the time [N m s/rad], [elements]. `loss_damping` is allocated.
  pure function stand_in(self, stiffness) result(damping)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: stiffness(:)   !! in this state [N m/rad], [elements]
    real(wp) :: damping(size(stiffness))

    damping = self%loss_damping
  end function stand_in

  !> Elements that act on one body each, the one of the key `body`.
  subroutine connect_keys(self, role, keys)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: role   !! role_...
    class(element_keys_t), intent(in) :: keys

    associate (body => keys%bodies('body', 1))
      call self%connect(role, keys%lanes, keys%names, rows_between(0 * body, body))
    end associate
  end subroutine connect_keys

  !> Sets the connectivity. Every constructor calls it, after setting `states` where its elements have internal states.
  subroutine connect_rows(self, role, lanes, names, rows)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: role                 !! role_...
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)      !! [elements]
    type(element_rows_t), intent(in) :: rows    !! of the elements
    integer :: e

    call self%set_size(lanes, rows%count())
    self%role = role
    self%names = names
    self%rows = rows
    self%with_work = [(e, e=1, self%count)]
    self%elastic = [(e, e=1, merge(self%count, 0, role == role_coupling))]
  end subroutine connect_rows

  !> Adds to the structure of a list which elements the bank has, and of what kind they are.
  subroutine list_structure(self, parameters)
    class(bank_t), intent(in) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure([self%role, self%first, self%states])
    call parameters%add_structure(self%is_polynomial)
    call parameters%add_structure(self%names)
    call parameters%add_structure(self%rows%first, self%rows%body, self%with_work, self%switch_element)
    call parameters%add_structure(transfer(self%rows%coefficient, [integer ::]))
  end subroutine list_structure

  !> Number of its last element in the machine.
  pure integer function last(self)
    class(bank_t), intent(in) :: self

    last = self%first + self%count - 1
  end function last

  !> The kind of its elements as the input calls it: the one of the role, 'shaft', 'mesh' or 'damper'.
  pure character(len=10) function kind_name(self)
    class(bank_t), intent(in) :: self

    kind_name = role_names(self%role)
    if (self%is_mesh) kind_name = 'mesh'
    if (self%is_damper) kind_name = 'damper'
    if (self%has_parts) kind_name = 'shaft'
  end function kind_name

  !> The number of elements with a name of their own.
  pure integer function named_count(self)
    class(bank_t), intent(in) :: self
    integer :: e

    named_count = self%count
    if (.not. self%has_parts) return
    do e = 2, self%count
      if (self%names(e)%text == self%names(e - 1)%text) named_count = named_count - 1
    end do
  end function named_count

  !> Whether the work of the elements counts as work put in, not as work taken out.
  pure logical function is_source(self)
    class(bank_t), intent(in) :: self

    is_source = any(self%role == [role_motor, role_excitation, role_crank, role_drive])
  end function is_source

  !> Replaces torques that keep changing, with the time or with the angle of a turning body, by their means. Changes that end,
  !> such as a ramp, stay as they are: evaluate at a late time.
  subroutine to_mean_torque(self)
    class(bank_t), intent(inout) :: self

    call self%describe_mean(size(self%elastic) == 0)
  end subroutine to_mean_torque

  !> The harmonics of the torque, or of a twist in series, of an element in the first lane, which turns with a constant speed;
  !> `to_mean_torque` removes them. The ones of an element that `has_ended` do not count. With a transmission error, the element
  !> has the twists, and its phase the moments -e' M of the mean moment M.
  subroutine list_harmonics(self, element, speed, list)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]
    type(harmonic_t), allocatable, intent(out) :: list(:)
    type(law_wave_t), allocatable :: base(:), waves(:)
    real(wp) :: internal(self%states), settled(self%states * self%count), speeds(self%count)
    integer :: n

    allocate (list(0))
    if (.not. allocated(self%tape)) return
    if (.not. has_waves(self%tape)) return
    speeds = speed
    call self%steady_internal(late, speeds, settled)
    internal = settled(self%states * (element - 1) + 1:self%states * element)
    associate (tape => self%tape, turns => size(self%elastic) == 0, number => self%first - 1 + element)
      if (tape%twist > 0) then
        call waves_at(self, element, speed, internal, [tape%twist], .false., waves)
        n = size(waves)
        list = [harmonics_of(self, element, waves), harmonics_of(self, element, waves)]
        list(:n)%amplitude = -waves%amplitude
        list(:n)%is_twist = .true.
        list(n + 1:)%element = number + self%count
        list(n + 1:)%by_element = number
        list(n + 1:)%amplitude = cmplx(0.0_wp, waves%by_phase, wp) * waves%amplitude
      else if (tape%control > 0) then   ! its part without the control torque, then the part by that
        call waves_at(self, element, speed, internal, [tape%restoring, tape%applied], turns, base, 0.0_wp)
        call waves_at(self, element, speed, internal, [tape%restoring, tape%applied], turns, waves, 1.0_wp)
        waves%amplitude = waves%amplitude - base%amplitude
        list = [harmonics_of(self, element, base), harmonics_of(self, element, waves)]
        list(size(base) + 1:)%by_element = number
      else
        call waves_at(self, element, speed, internal, [tape%restoring, tape%applied], turns, waves)
        list = harmonics_of(self, element, waves)
      end if
    end associate
  end subroutine list_harmonics

  !> Harmonics of the law of an element, by the angle of its last body, or of its phase, which is the angle of the first one.
  pure function harmonics_of(self, element, waves) result(list)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    type(law_wave_t), intent(in) :: waves(:)
    type(harmonic_t) :: list(size(waves))

    list%element = self%first - 1 + element
    list%amplitude = waves%amplitude
    list%frequency = waves%by_time
    list%order = waves%by_angle + waves%by_phase
    list%body = merge(self%rows%body(self%rows%first(element)), self%rows%last_body(element), abs(waves%by_phase) > 0)
  end function harmonics_of

  !> Whether an element of the first lane has no part in a steady state, because its torque ends or decays; by default none has.
  pure logical function has_ended(self, element)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank

    has_ended = .false.
  end function has_ended

  !> Frequency with which an element of the first lane oscillates after a change of its own [rad/s]; 0 by default.
  pure real(wp) function transient_frequency(self, element, is_steady)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element     !! numbered within the bank
    logical, intent(in) :: is_steady   !! whether its internal states begin as they stay

    transient_frequency = 0.0_wp
  end function transient_frequency

  !> Prepares the elements for speeds that something outside of the machine holds: governors leave their throttles open, induction
  !> motors may follow the frequency of a supply. By default there is nothing to do.
  subroutine hold_speed(self)
    class(bank_t), intent(inout) :: self
  end subroutine hold_speed

  !> Whether its motors can have any speed by the frequency of their supply, after `hold_speed`. By default they cannot.
  pure logical function follows_supply(self)
    class(bank_t), intent(in) :: self

    follows_supply = .false.
  end function follows_supply

  !> Gives the supply of the motors in the first lane a frequency: the slip of a motor is this share minus its speed over the
  !> synchronous one. Its flux stays the one of the mains, and so does the stator with its transients.
  subroutine set_supply(self, share)
    class(bank_t), intent(inout) :: self
    real(wp), intent(in) :: share   !! of the frequency in the input

  end subroutine set_supply

  !> The frequency of the supply with which a motor of the first lane has no slip, as a share.
  pure real(wp) function idle_supply(self, element, speed)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]

    idle_supply = 1.0_wp
  end function idle_supply

  !> The internal states at the start, 0 by default.
  subroutine start_internal(self, speed, internal)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)             !! u' at the start [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)    !! [lanes, states, elements]

    internal = 0.0_wp
  end subroutine start_internal

  !> The internal states of one lane that do not change while the speeds stay, and what follows the time stays as it is.
  subroutine steady_internal(self, t, speed, internal)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: t                 !! [s]
    real(wp), intent(in) :: speed(:)          !! u' [rad/s], [elements]
    real(wp), intent(inout) :: internal(:)    !! [states * elements], the states of the first element first
    logical :: is_decided(self%states)
    integer :: e

    call self%decide_internal(t, speed, internal, is_decided)
    if (all(is_decided)) return
    do e = 1, self%count
      call settle(self, e, t, speed(e), is_decided, internal(self%states * (e - 1) + 1:self%states * e))
    end do
  end subroutine steady_internal

  !> Sets internal states that do not follow from the rates when these are zero. By default there are none.
  subroutine decide_internal(self, t, speed, internal, is_decided)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: t                 !! [s]
    real(wp), intent(in) :: speed(:)          !! u' [rad/s], [elements]
    real(wp), intent(inout) :: internal(:)    !! as for `steady_internal`
    logical, intent(out) :: is_decided(:)     !! which these are, [states]

    is_decided = .false.
  end subroutine decide_internal

  !> Speeds at which the applied moment of an element in the first lane has an extreme, changes its sign, bends or jumps [rad/s]:
  !> where the search of steady states at a time looks closely.
  function knees(self, element, t) result(speeds)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    call boundary_speeds(self, element, t, speeds)
    speeds = [speeds, self%extremes(element, t)]
  end function knees

  !> The ones of `knees` that are no boundaries between branches by the speed. By default there are none.
  function extremes(self, element, t) result(speeds)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    allocate (speeds(0))
  end function extremes

  !> Sets the energies that internal states keep. By default they keep none.
  pure subroutine keep_energy(self, elements)
    class(bank_t), intent(in) :: self
    type(element_values_t), intent(inout) :: elements   !! of the machine
  end subroutine keep_energy

  !> What the elements put out, by default the torque of each on its body.
  subroutine quantities(self, columns)
    class(bank_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1) = new_quantity('torque', 'N m', [(e, e=1, self%count)], 'torque on the body', 'with a positive speed', &
                              rank_torque, form_total, 1.0_wp)
  end subroutine quantities

  !> Values of a quantity without a form, of all elements of the bank, after `evaluate`. Banks that have one override this.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(bank_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements   !! of the machine
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank], in the unit of the quantity

    values = elements%applied(lane, self%first:self%last())
    if (quantity > 0) error stop 'nocdyn_bank: a bank with a quantity without a form overrides observe'
  end subroutine observe

  !> Number of the bank that holds an element.
  pure integer function bank_of(banks, element)
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: element   !! number in the machine

    do bank_of = 1, size(banks)
      if (element <= banks(bank_of)%bank%last()) return
    end do
    error stop 'nocdyn_bank: there are not so many elements'
  end function bank_of

  !> Length of the name of an element.
  pure integer function name_length(banks, element)
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: element   !! number in the machine

    associate (bank => banks(bank_of(banks, element))%bank)
      name_length = len(bank%names(element - bank%first + 1)%text)
    end associate
  end function name_length

end module nocdyn_bank
