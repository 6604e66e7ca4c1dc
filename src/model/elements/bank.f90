!> A bank: elements with the same form of law, evaluated together on a block of lanes.
!>
!> The elements of a machine are numbered consecutively, bank after bank (`elements_t`). A bank owns the contiguous part that
!> begins with its element `first`. The polynomial part of its law is given as coefficients, which one loop evaluates for all
!> banks (`polynomial_laws_t`); the rest is added by procedures of the bank. A new kind of element extends `bank_t` and
!> overrides the procedures that its law needs.
!>
!> An element may have *internal states*, for instance the integral of a governor or an armature current. Their rates depend
!> on the speed of the element and on its internal states only. All elements of a bank have the same number of them.
!>
!> A law with kinks or jumps has *branches*: on each branch it is one smooth formula that may be evaluated anywhere. Only
!> `choose` changes the branch. The branches divide the plane of the law's variables, so the branch follows from the state
!> and a law has no memory. Every boundary of a branch is shifted outwards by `boundary_width`, relative to the scale of the
!> law: a lane that has just crossed it is well inside its new branch.
module nocdyn_bank
  use nocdyn_elements, only: elements_t
  use nocdyn_text, only: string_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: append_bank, bank_of, name_length, time_reached

  integer, parameter, public :: role_coupling = 1     !! in K and C of eqs. (21), (22); stores energy
  integer, parameter, public :: role_load = 2         !! in C of eq. (22); takes energy out
  integer, parameter, public :: role_motor = 3        !! in Q_m of eq. (18); puts energy in
  integer, parameter, public :: role_excitation = 4   !! in Q_0 of eq. (17); puts energy in

  real(wp), parameter, public :: boundary_width = 1.0e-10_wp   !! shift of branch boundaries, relative to the scale of a law

  character(len=*), parameter, public :: role_names(4) = ['coupling  ', 'load      ', 'motor     ', 'excitation']

  !> One quantity that a bank writes to the table of results.
  type, public :: quantity_t
    character(len=16) :: name            !! first part of the column's name, e.g. 'torque'
    character(len=8) :: unit             !! e.g. 'N m'
    integer, allocatable :: elements(:)  !! elements that have a column, numbered within the bank
  end type quantity_t

  type, abstract, public :: bank_t
    type(string_t), allocatable :: names(:)       !! of the elements
    integer, allocatable :: from(:)               !! body of each element, 0 = ground
    integer, allocatable :: to(:)                 !! body of each element, 0 = ground; M acts on it, -M on `from`
    integer, allocatable :: with_work(:)          !! elements whose work is integrated, numbered within the bank
    integer, allocatable :: elastic(:)            !! elements that can have a restoring moment, numbered within the bank
    integer :: role = role_coupling               !! role_...: term of eq. (12) to which the bank belongs
    integer :: lanes = 1
    integer :: first = 1                          !! number of its first element in the machine
    integer :: values = 0                         !! lanes * elements
    integer :: first_value = 1                    !! index of lane 1 of `first` in the flat arrays of the machine
    logical :: is_polynomial = .true.             !! whether `polynomials` gives its whole law
    logical :: has_polynomial_potential = .true.  !! whether `polynomials` gives its whole restoring moment
    logical :: is_time_only = .false.             !! whether the rest of its law depends on the time only
    logical :: has_paper_law = .true.             !! whether its law is that of eqs. (3), (5), (17) or (20)
    integer :: states = 0                         !! internal states of each element
    character(len=24), allocatable :: internal_names(:)   !! e.g. 'armature current', [states]
    integer :: first_internal = 1                 !! number of the first internal state of `first` in the machine
    integer :: internal_values = 0                !! lanes * states * elements
    integer :: first_internal_value = 1           !! index of lane 1 of `first_internal` in the flat arrays of the machine
    integer, allocatable :: switch_element(:)     !! element of each switch, numbered within the bank
    character(len=24), allocatable :: switch_names(:)   !! of the boundaries, e.g. 'edge of the gap', [switches]
    integer, allocatable :: branch(:, :)          !! present branch of each switch, [lanes, switches]
  contains
    procedure :: polynomials
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
    procedure :: has_series
    procedure :: forcing_series
    procedure :: series
    procedure :: to_mean_torque
    procedure :: start_internal
    procedure :: steady_internal
    procedure :: knees
    procedure :: evaluate_internal
    procedure :: choose
    procedure :: indicator
    procedure :: connect
    procedure :: add_switches
    procedure :: list_structure
    procedure :: list_parameters
    procedure :: last
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

  !> The time to compare with the times at which a law changes: later by some roundings, by which a step may end too early.
  pure function time_reached(t)
    real(wp), intent(in) :: t   !! [s]
    real(wp) :: time_reached    !! [s]

    time_reached = t + 8.0_wp * spacing(t)
  end function time_reached

  !> Sets the connectivity. Every constructor calls it, after setting `states` where its elements have internal states.
  subroutine connect(self, role, lanes, names, to, from)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: role                 !! role_...
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)      !! [elements]
    integer, intent(in) :: to(:)                !! bodies, 0 = ground, [elements]
    integer, intent(in), optional :: from(:)    !! the same; absent: 0
    integer :: e

    self%role = role
    self%lanes = lanes
    self%values = lanes * size(to)
    self%names = names
    self%from = 0 * to
    if (present(from)) self%from = from
    self%to = to
    self%with_work = [(e, e=1, size(to))]
    self%elastic = [(e, e=1, merge(size(to), 0, role == role_coupling))]
    self%internal_values = lanes * self%states * size(to)
    allocate (self%switch_element(0), self%switch_names(0), self%branch(lanes, 0))
  end subroutine connect

  !> Gives every element one more switch. All branches are 0 until `choose` sets them.
  subroutine add_switches(self, names)
    class(bank_t), intent(inout) :: self
    character(len=*), intent(in) :: names(:)   !! of the boundaries, [elements]
    integer :: e

    self%switch_names = [character(len=len(self%switch_names)) :: self%switch_names, names]
    self%switch_element = [self%switch_element, (e, e=1, size(self%to))]
    deallocate (self%branch)
    allocate (self%branch(self%lanes, size(self%switch_element)), source=0)
  end subroutine add_switches

  !> Adds to the structure of a list which elements the bank has, and of what kind they are.
  subroutine list_structure(self, parameters)
    class(bank_t), intent(in) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure([self%role, self%first, self%states])
    call parameters%add_structure(self%is_polynomial)
    call parameters%add_structure(self%names)
    call parameters%add_structure(self%from, self%to, self%with_work, self%switch_element)
  end subroutine list_structure

  !> Lists the parameter arrays of its elements. An array that holds the values of a key unchanged has the name of the key.
  subroutine list_parameters(self, parameters)
    class(bank_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters
  end subroutine list_parameters

  !> Number of its last element in the machine.
  pure integer function last(self)
    class(bank_t), intent(in) :: self

    last = self%first + size(self%to) - 1
  end function last

  !> Whether the work of the elements counts as work put in, not as work taken out.
  pure logical function is_source(self)
    class(bank_t), intent(in) :: self

    is_source = self%role == role_motor .or. self%role == role_excitation
  end function is_source

  !> Sets the coefficients of its elements among those of the machine, which are zero before. By default there are none.
  subroutine polynomials(self, laws)
    class(bank_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws   !! of the machine
  end subroutine polynomials

  !> Adds the part of the law that is not polynomial to the moments of the bank's elements. All arrays but `time` are flat:
  !> the lanes of its first element, then those of its second, and so on.
  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes)                                  !! t [s]
    real(wp), intent(in) :: angle(self%values), speed(self%values)            !! u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
  end subroutine evaluate

  !> Adds the derivatives of the moments that `evaluate` adds, and sets those of the internal states.
  subroutine differentiate(self, elements)
    class(bank_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements   !! of the machine
  end subroutine differentiate

  !> Adds the potential energies, secant stiffnesses and dampings of the moments that `evaluate` adds.
  subroutine evaluate_energies(self, elements)
    class(bank_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements   !! of the machine
  end subroutine evaluate_energies

  !> Whether the moments have a Taylor series; `forcing_series` and `series` give that of the moments that `evaluate` adds.
  pure logical function has_series(self)
    class(bank_t), intent(in) :: self

    has_series = self%is_polynomial
  end function has_series

  !> Sets the Taylor coefficients 0 to `last` of the applied moments that depend on the time only. Here and in `series` the
  !> arrays begin with the bank's first value, and column k holds the coefficients number k.
  subroutine forcing_series(self, last, stride, time, applied)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: last     !! number of the last coefficient
    integer, intent(in) :: stride   !! from column to column, at least `values`
    real(wp), intent(in) :: time(self%lanes)             !! t [s]
    real(wp), intent(inout) :: applied(stride, 0:last)   !! [N m / s^k]
  end subroutine forcing_series

  !> Adds the Taylor coefficients number k of the other moments that `evaluate` adds. The coefficients of angles and speeds
  !> are known up to number k, those of the moments up to k - 1. Angles are counted from the rest angle in `polynomials`.
  subroutine series(self, k, stride, time, angle, speed, restoring, applied)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: k        !! number of the coefficient
    integer, intent(in) :: stride   !! from column to column, at least `values`
    real(wp), intent(in) :: time(self%lanes)                                  !! t [s]
    real(wp), intent(in) :: angle(stride, 0:k), speed(stride, 0:k)            !! [rad / s^k], [rad/s / s^k]
    real(wp), intent(inout) :: restoring(stride, 0:k), applied(stride, 0:k)   !! [N m / s^k]
  end subroutine series

  !> Replaces torques that keep changing, with the time or with the angle of a turning body, by their means. By default there
  !> are none. Changes that end, such as a ramp, stay as they are: evaluate at a late time.
  subroutine to_mean_torque(self)
    class(bank_t), intent(inout) :: self
  end subroutine to_mean_torque

  !> The internal states at the start, 0 by default.
  subroutine start_internal(self, speed, internal)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)             !! u' at the start [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)    !! [lanes, states, elements]

    internal = 0.0_wp
  end subroutine start_internal

  !> The internal states of one lane that do not change while the speeds stay.
  subroutine steady_internal(self, speed, internal)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(:)          !! u' [rad/s], [elements]
    real(wp), intent(inout) :: internal(:)    !! [states * elements], the states of the first element first

    if (self%states > 0) error stop 'nocdyn_bank: a bank with internal states overrides steady_internal'
  end subroutine steady_internal

  !> Speeds at which the applied moment of an element in the first lane has an extreme, changes its sign, bends or jumps [rad/s]:
  !> where the search of steady states looks closely. By default there are none.
  function knees(self, element) result(speeds)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), allocatable :: speeds(:)

    allocate (speeds(0))
  end function knees

  !> Adds the moments that depend on internal states to those of `evaluate` and of the polynomials, and sets the rates.
  subroutine evaluate_internal(self, speed, internal, applied, rate)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)             !! u' [rad/s]
    real(wp), intent(in) :: internal(self%internal_values)       !! [lanes, states, elements]
    real(wp), intent(inout) :: applied(self%values)        !! [N m]
    real(wp), intent(inout) :: rate(self%internal_values)     !! [lanes, states, elements]

    error stop 'nocdyn_bank: a bank with internal states overrides evaluate_internal'
  end subroutine evaluate_internal

  !> Sets the branch of a switch in one lane to the one that contains the state.
  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: switch          !! numbered within the bank
    integer, intent(in) :: lane
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: angle, speed   !! u [rad], u' [rad/s] of the switching element
    real(wp), intent(in) :: internal(:)       !! its internal states

    error stop 'nocdyn_bank: a bank with switches overrides choose'
  end subroutine choose

  !> Distance of a lane from the nearest boundary of its present branch, in a unit of the law: continuous, negative beyond.
  pure real(wp) function indicator(self, switch, lane, t, angle, speed, internal)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: switch          !! numbered within the bank
    integer, intent(in) :: lane
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: angle, speed   !! u [rad], u' [rad/s] of the switching element
    real(wp), intent(in) :: internal(:)       !! its internal states

    indicator = 0.0_wp
    error stop 'nocdyn_bank: a bank with switches overrides indicator'
  end function indicator

  !> The columns of the bank in the table of results, by default the torque of each element.
  function quantities(self) result(columns)
    class(bank_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1)%name = 'torque'
    columns(1)%unit = 'N m'
    columns(1)%elements = [(e, e=1, size(self%to))]
  end function quantities

  !> Values of one quantity of all elements of the bank, after `evaluate`.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(bank_t), intent(in) :: self
    type(elements_t), intent(in) :: elements   !! of the machine
    integer, intent(in) :: quantity   !! index in `quantities`
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank], in the unit of the quantity

    values = elements%restoring(lane, self%first:self%last()) + elements%applied(lane, self%first:self%last())
    if (quantity /= 1) error stop 'nocdyn_bank: a bank with several quantities overrides observe'
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
