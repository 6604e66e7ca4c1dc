!> Elements of one kind, evaluated together on a block of lanes.
!>
!> The values of all elements of a machine are numbered through (`elements_t`); a bank works on its own contiguous
!> part of them, from its element `first` on. What of its law is a polynomial it hands over as coefficients, so that the
!> elements of all banks are evaluated in one loop (`polynomial_laws_t`); what is not, it adds by procedures of its own.
!> A new kind of element extends `bank_t` by either or both.
!>
!> An element may have states of its own, its *inner states* (the integral of a governor, an armature current), whose rates
!> depend on its speed and on its inner states alone; all elements of a bank have as many.
!>
!> A law with kinks is evaluated on a *branch* that only `choose` changes: one formula, extended smoothly beyond its
!> borders. The branches part the plane of the law's variables and are chosen by where these are, so that a law has no
!> memory. Each border of a branch is moved outwards by a tiny part `boundary_width` of the law's scale: a lane that has just
!> crossed it is well inside its new branch.
module nocdyn_bank
  use nocdyn_elements, only: elements_t
  use nocdyn_text, only: string_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: append_bank, time_reached

  integer, parameter, public :: role_coupling = 1     !! in K and C of eqs. (21), (22); stores energy
  integer, parameter, public :: role_load = 2         !! in C of eq. (22); takes energy out
  integer, parameter, public :: role_motor = 3        !! in Q_m of eq. (18); puts energy in
  integer, parameter, public :: role_excitation = 4   !! in Q_0 of eq. (17); puts energy in

  real(wp), parameter, public :: boundary_width = 1.0e-10_wp   !! of borders of branches, relative to the scale of a law

  character(len=*), parameter, public :: role_names(4) = ['coupling  ', 'load      ', 'motor     ', 'excitation']

  !> What a bank puts into the table of results for each of its elements.
  type, public :: quantity_t
    character(len=16) :: name          !! first part of the column's name, e.g. 'torque'
    character(len=8) :: unit
    integer, allocatable :: elements(:) !! those that have it, numbered within the bank
  end type quantity_t

  type, abstract, public :: bank_t
    type(string_t), allocatable :: names(:)
    integer, allocatable :: from(:)          !! body, 0 = ground
    integer, allocatable :: to(:)            !! body, 0 = ground
    integer, allocatable :: with_work(:)     !! elements whose power is integrated, numbered within the bank
    integer, allocatable :: elastic(:)       !! elements that can have a restoring moment, numbered within the bank
    integer :: role = role_coupling          !! role_...: which term of eq. (12) the bank belongs to
    integer :: lanes = 1
    integer :: first = 1                     !! number of its first element in the machine
    integer :: values = 0                    !! lanes * elements
    integer :: first_value = 1               !! the place of lane 1 of `first` in the values of the machine
    logical :: is_polynomial = .true.        !! whether `polynomials` says all of its law
    logical :: has_polynomial_potential = .true.   !! whether `polynomials` gives all of its restoring moment
    logical :: is_time_only = .false.         !! whether the rest of its law depends on the time alone
    logical :: has_paper_law = .true.          !! whether its law is that of eqs. (3), (5), (17) or (20)
    integer :: states = 0                     !! inner states of each element
    integer :: first_internal = 1               !! number of the first inner state of `first` in the machine
    integer :: internal_values = 0              !! lanes * inner * elements
    integer :: first_internal_value = 1         !! the place of lane 1 of `first_internal`
    integer, allocatable :: switch_element(:)     !! element of each switch, numbered within the bank
    integer, allocatable :: branch(:, :)     !! present branch of each switch, [lanes, switches]
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
    procedure :: evaluate_internal
    procedure :: internal_name
    procedure :: choose
    procedure :: indicator
    procedure :: switch_name
    procedure :: connect
    procedure :: set_switches
    procedure :: list_structure
    procedure :: list_parameters
    procedure :: last
    procedure :: is_source
    procedure :: quantities
    procedure :: observe
  end type bank_t

  !> One bank of whatever kind, so that a machine can hold a list of them.
  type, public :: bank_slot_t
    class(bank_t), allocatable :: bank
  end type bank_slot_t

contains

  !> Adds a bank behind the others.
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

  !> A time as it is compared with those at which a law changes: the end of a step may miss them by rounding.
  pure function time_reached(t)
    real(wp), intent(in) :: t
    real(wp) :: time_reached

    time_reached = t + 8.0_wp * spacing(t)
  end function time_reached

  !> Sets the connectivity; every extension's constructor calls it, with `internal` set where its elements have inner states.
  subroutine connect(self, role, lanes, names, from, to)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: role
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)
    integer :: e

    self%role = role
    self%lanes = lanes
    self%values = lanes * size(to)
    self%names = names
    self%from = from
    self%to = to
    self%with_work = [(e, e=1, size(to))]
    self%elastic = [(e, e=1, merge(size(to), 0, role == role_coupling))]
    self%internal_values = lanes * self%states * size(to)
    call self%set_switches([integer ::])
  end subroutine connect

  !> Gives elements one switch each; the branches are 0 until they are chosen.
  subroutine set_switches(self, elements)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: elements(:)   !! numbered within the bank

    self%switch_element = elements
    if (allocated(self%branch)) deallocate (self%branch)
    allocate (self%branch(self%lanes, size(elements)), source=0)
  end subroutine set_switches

  !> Notes which elements the bank has, and what they do.
  subroutine list_structure(self, parameters)
    class(bank_t), intent(in) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure([self%role, self%first, self%states])
    call parameters%add_structure(self%is_polynomial)
    call parameters%add_structure(self%names)
    call parameters%add_structure(self%from)
    call parameters%add_structure(self%to)
    call parameters%add_structure(self%with_work)
    call parameters%add_structure(self%switch_element)
  end subroutine list_structure

  !> Lists the parameters of its elements: those that stand in the input as they are by the name that they have there.
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

  !> Puts the coefficients of its elements into those of the machine, which are zero before: by default there are none.
  subroutine polynomials(self, laws)
    class(bank_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws   !! of the machine
  end subroutine polynomials

  !> Adds what is not polynomial to the moments of the bank's elements. All arrays but `time` are flat: the lanes of its
  !> first element, then those of its second, and so on.
  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes)                                  !! t [s]
    real(wp), intent(in) :: angle(self%values), speed(self%values)            !! u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
  end subroutine evaluate

  !> Adds the derivatives of what `evaluate` adds.
  subroutine differentiate(self, elements)
    class(bank_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements   !! of the machine
  end subroutine differentiate

  !> Adds the potential energies, secant stiffnesses and dampings of what `evaluate` adds.
  subroutine evaluate_energies(self, elements)
    class(bank_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements   !! of the machine
  end subroutine evaluate_energies

  !> Whether the moments have a Taylor series: that of `polynomials`, and that of `evaluate` by `forcing_series` and `series`.
  pure logical function has_series(self)
    class(bank_t), intent(in) :: self

    has_series = self%is_polynomial
  end function has_series

  !> Sets the Taylor coefficients, number 0 to last, of what of `applied` depends on the time alone. Here and in `series`
  !> the arrays begin with the bank's first value, and column k holds the coefficients number k.
  subroutine forcing_series(self, last, stride, time, applied)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: last
    integer, intent(in) :: stride   !! from column to column
    real(wp), intent(in) :: time(self%lanes)
    real(wp), intent(inout) :: applied(stride, 0:last)
  end subroutine forcing_series

  !> Adds the Taylor coefficients number k of the rest of what `evaluate` adds. Those of the angles, which are counted from
  !> the rest in `polynomials`, and speeds are known up to k, those of the moments up to k - 1.
  subroutine series(self, k, stride, time, angle, speed, restoring, applied)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: k
    integer, intent(in) :: stride
    real(wp), intent(in) :: time(self%lanes)
    real(wp), intent(in) :: angle(stride, 0:k), speed(stride, 0:k)
    real(wp), intent(inout) :: restoring(stride, 0:k), applied(stride, 0:k)
  end subroutine series

  !> Replaces torques that go on changing, with the time or with the angle of a body that turns, by their means: by default
  !> there are none. What comes to an end, as a step does, is found by evaluating at a late time.
  subroutine to_mean_torque(self)
    class(bank_t), intent(inout) :: self
  end subroutine to_mean_torque

  !> The inner states at the start, 0 by default.
  subroutine start_internal(self, speed, internal)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)             !! u' at the start [rad/s]
    real(wp), intent(inout) :: internal(self%internal_values)    !! [lanes, inner, elements]

    internal = 0.0_wp
  end subroutine start_internal

  !> Brings the inner states into `applied`, which holds what `evaluate` and the polynomials gave, and sets their rates.
  subroutine evaluate_internal(self, speed, internal, applied, rate)
    class(bank_t), intent(in) :: self
    real(wp), intent(in) :: speed(self%values)             !! u' [rad/s]
    real(wp), intent(in) :: internal(self%internal_values)       !! [lanes, inner, elements]
    real(wp), intent(inout) :: applied(self%values)        !! [N m]
    real(wp), intent(inout) :: rate(self%internal_values)     !! [lanes, inner, elements]

    error stop 'nocdyn_bank: a bank with inner states overrides evaluate_inner'
  end subroutine evaluate_internal

  !> What an inner state is, e.g. 'armature current'.
  function internal_name(self, index) result(name)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to inner
    character(len=:), allocatable :: name

    name = ''
    error stop 'nocdyn_bank: a bank with inner states overrides inner_name'
  end function internal_name

  !> Chooses the branch of a switch in which a lane is.
  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: angle, speed   !! u [rad], u' [rad/s] of the switching element
    real(wp), intent(in) :: internal(:)       !! its inner states

    error stop 'nocdyn_bank: a bank with switches overrides choose'
  end subroutine choose

  !> How far a lane is from the nearest border of its present branch: negative beyond it, continuous.
  pure function indicator(self, switch, lane, t, angle, speed, internal)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: angle, speed   !! u [rad], u' [rad/s] of the switching element
    real(wp), intent(in) :: internal(:)       !! its inner states
    real(wp) :: indicator

    indicator = 0.0_wp
    error stop 'nocdyn_bank: a bank with switches overrides margin'
  end function indicator

  !> What the borders of a switch are, e.g. 'edge of the gap'.
  function switch_name(self, switch) result(name)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    name = ''
    error stop 'nocdyn_bank: a bank with switches overrides switch_name'
  end function switch_name

  !> The columns of the bank in the table of results: by default the torque of each element.
  function quantities(self) result(columns)
    class(bank_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1)%name = 'torque'
    columns(1)%unit = 'N m'
    columns(1)%elements = [(e, e=1, size(self%to))]
  end function quantities

  !> Values of the quantity number `quantity` of all elements of the bank after `evaluate`.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(bank_t), intent(in) :: self
    type(elements_t), intent(in) :: elements   !! of the machine
    integer, intent(in) :: quantity
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]

    values = elements%restoring(lane, self%first:self%last()) + elements%applied(lane, self%first:self%last())
    if (quantity /= 1) error stop 'nocdyn_bank: a bank with several quantities overrides observe'
  end subroutine observe

end module nocdyn_bank
