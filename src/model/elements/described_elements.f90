!> Elements with the same form of law: their parameters, the law, and the names of its branches.
!>
!> The polynomial part of the law is given as multiples of parameters, which one loop evaluates for all elements of a machine
!> (`polynomial_laws_t`); the rest is written once, as formulas in `describe`, from which moments, rates, derivatives, energies,
!> Taylor series and the choice of branches follow (`element_law_t`). What changes while they are evaluated is a `bank_state_t`.
!>
!> An element may have a *phase*: another element, which belongs to a bank of its own that follows, and whose angle and speed the
!> law reads beside its own. The law gives a moment for both. The phases of a bank follow one another as its elements do.
!>
!> An element may have *internal states*, for instance the integral of a governor or an armature current. Their rates depend
!> on the speed of the element, on its internal states and on the time only. All elements have the same number of them.
!>
!> A law with kinks or jumps has *branches*: on each branch it is one smooth formula that may be evaluated anywhere. A branch
!> selects constants of the formulas (`pick`), or a segment of a curve; guards, which tell where a branch holds, contain no picks.
!> The branches divide the plane of the law's variables, so the branch follows from the state and a law has no memory. Every
!> boundary of a branch is shifted outwards by `boundary_width`, relative to the scale of the law: a lane that has just crossed it
!> is well inside its new branch.
module nocdyn_described_elements
  use nocdyn_curves, only: curve_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_law_expressions, only: expression_t, parameter_of
  use nocdyn_law_tape, only: at_element, law_tape_t, new_law_tape
  use nocdyn_law_waves, only: has_waves, take_means
  use nocdyn_laws, only: law_parameter_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: time_reached

  real(wp), parameter, public :: never = 1.0e60_wp   !! later than all times, of what does not begin or end [s]
  real(wp), parameter, public :: boundary_width = 1.0e-10_wp   !! shift of branch boundaries, relative to the scale of a law

  integer, parameter, public :: stays_as_mean = 1   !! what of a torque is in a steady state: its mean over waves, ...
  integer, parameter, public :: stays_whole = 2     !! ... all of it, as its changes end or belong to a motion ...
  integer, parameter, public :: stays_away = 3      !! ... or nothing

  !> A coefficient of the polynomial part of a law: a multiple of a parameter.
  type, public :: polynomial_term_t
    integer :: parameter = 0      !! its number
    integer :: coefficient = 0    !! coefficient_... of `nocdyn_polynomial_laws`
    real(wp) :: factor = 1.0_wp
  end type polynomial_term_t

  type, public :: described_elements_t
    integer :: lanes = 1
    integer :: count = 0                          !! elements
    integer :: first = 1                          !! number of the first one in the machine
    integer :: values = 0                         !! lanes * elements
    logical :: is_polynomial = .true.             !! whether `polynomials` gives the moments
    logical :: has_described_rows = .false.       !! whether formulas give rows that move (`nocdyn_described_rows`)
    integer :: states = 0                         !! internal states of each element
    integer :: ports = at_element                 !! `at_phase` if the elements have phases
    real(wp) :: phase_order = 0.0_wp              !! most oscillations of a law per turn of its phase
    integer :: steady_part = stays_as_mean        !! stays_...
    logical, private :: is_mean = .false.         !! whether the law is the one of steady states, after `describe_mean`
    logical, private :: turns = .true.            !! whether its angle advances there
    integer :: internal_values = 0                !! lanes * states * elements
    integer, allocatable :: switch_element(:)     !! element of each switch
    character(len=24), allocatable :: switch_names(:)   !! of the boundaries, e.g. 'edge of the gap', [switches]
    integer, allocatable :: choices(:)            !! branches of each switch, [switches]; 0: the segments of `curve`; negative:
                                                  !! something else than guards chooses them
    type(law_parameter_t), allocatable :: parameters(:)
    type(polynomial_term_t), allocatable :: terms(:)   !! of the polynomial part of the law
    type(curve_t), allocatable :: curve(:, :)     !! of the first switch of each element, [lanes, elements]
    type(law_tape_t), allocatable :: tape         !! the part of the law that is not polynomial
  contains
    procedure :: polynomials, set_terms
    procedure :: describe
    procedure :: set_size
    procedure :: add_key
    procedure :: add_parameter
    procedure :: add_parts, part_columns
    procedure :: values_of
    procedure :: add_term
    procedure :: number_of
    procedure :: parameter
    procedure :: add_switches
    procedure :: prepare_law
    procedure :: describe_mean
    procedure :: refresh_lane
    procedure :: fastest_wave
    procedure :: pass_parameters
  end type described_elements_t

contains

  !> Sets the numbers of lanes and elements, which have no parameters yet.
  subroutine set_size(self, lanes, count)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: lanes, count

    self%lanes = lanes
    self%count = count
    self%values = lanes * count
    self%internal_values = lanes * self%states * count
    allocate (self%parameters(0), self%terms(0))
    allocate (self%switch_element(0), self%switch_names(0), self%choices(0))
  end subroutine set_size

  !> The time to compare with the times at which a law changes: later by some roundings, by which a step may end too early.
  pure function time_reached(t)
    real(wp), intent(in) :: t   !! [s]
    real(wp) :: time_reached    !! [s]

    time_reached = t + 8.0_wp * spacing(t)
  end function time_reached

  !> Adds the values of a key as parameters with its name.
  subroutine add_key(self, keys, key, absent)
    class(described_elements_t), intent(inout) :: self
    class(element_keys_t), intent(in) :: keys
    character(len=*), intent(in) :: key
    real(wp), intent(in), optional :: absent   !! where it has no value; absent: 0

    call self%add_parameter(key, keys%values(key, absent))
  end subroutine add_key

  !> Adds an array of parameters, one column for each element unless `element` says otherwise.
  subroutine add_parameter(self, name, value, is_key, element)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: value(:, :)          !! in the unit of the key, [lanes, columns]
    logical, intent(in), optional :: is_key      !! whether these are the values of the key with this name; absent: they are
    integer, intent(in), optional :: element(:)  !! of each column, numbered within the bank
    type(law_parameter_t), allocatable :: longer(:)
    integer :: e, n

    n = size(self%parameters)
    allocate (longer(n + 1))
    longer(:n) = self%parameters
    longer(n + 1)%name = name
    longer(n + 1)%is_key = .true.
    if (present(is_key)) longer(n + 1)%is_key = is_key
    allocate (longer(n + 1)%value, source=value)
    allocate (longer(n + 1)%element(size(value, 2)))
    longer(n + 1)%element(:) = [(e, e=1, size(value, 2))]
    if (present(element)) longer(n + 1)%element(:) = element
    call move_alloc(longer, self%parameters)
  end subroutine add_parameter

  !> Adds an array of parameters in parts, such as the terms of a sum, sorted by them; they are not the values of a key.
  subroutine add_parts(self, name, value)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: value(:, :, :)   !! [lanes, elements, parts]
    integer :: e, k

    call self%add_parameter(name, reshape(value, [size(value, 1), size(value, 2) * size(value, 3)]), is_key=.false., &
                            element=[((e, e=1, size(value, 2)), k=1, size(value, 3))])
  end subroutine add_parts

  !> The columns of a part of all elements, see `add_parts`.
  pure function part_columns(self, part) result(columns)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: part
    integer :: columns(self%count)
    integer :: e

    columns = [(e + (part - 1) * self%count, e=1, self%count)]
  end function part_columns

  !> Number of a parameter; 0 if there is none.
  pure integer function number_of(self, name)
    class(described_elements_t), intent(in) :: self
    character(len=*), intent(in) :: name

    do number_of = size(self%parameters), 1, -1
      if (self%parameters(number_of)%name == name) return
    end do
  end function number_of

  !> The values of a parameter, [lanes, columns].
  pure function values_of(self, name) result(values)
    class(described_elements_t), intent(in) :: self
    character(len=*), intent(in) :: name
    real(wp), allocatable :: values(:, :)

    allocate (values, source=self%parameters(self%number_of(name))%value)
  end function values_of

  !> Adds a coefficient of the polynomial part of the law.
  subroutine add_term(self, parameter, coefficient, factor)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: parameter   !! its name
    integer, intent(in) :: coefficient          !! coefficient_...
    real(wp), intent(in) :: factor              !! by which the parameter is multiplied

    self%terms = [self%terms, polynomial_term_t(self%number_of(parameter), coefficient, factor)]
  end subroutine add_term

  !> A parameter in the formulas of a law: of each element its own column, or the one of a list.
  function parameter(self, tape, name, columns)
    class(described_elements_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    integer, intent(in), optional :: columns(:)   !! of each element, 0 for the value zero
    type(expression_t) :: parameter
    integer :: e

    if (present(columns)) then
      parameter = parameter_of(tape, number_of(self, name), columns)
    else
      parameter = parameter_of(tape, number_of(self, name), [(e, e=1, self%count)])
    end if
  end function parameter

  !> Gives every element one more switch.
  subroutine add_switches(self, names, choices)
    class(described_elements_t), intent(inout) :: self
    character(len=*), intent(in) :: names(:)   !! of the boundaries, [elements]
    integer, intent(in) :: choices             !! as in the type
    integer :: e

    self%switch_names = [character(len=len(self%switch_names)) :: self%switch_names, names]
    self%switch_element = [self%switch_element, (e, e=1, self%count)]
    self%choices = [self%choices, spread(choices, 1, self%count)]
  end subroutine add_switches

  !> Records the law. Every constructor of a bank that overrides `describe` calls it at the end.
  subroutine prepare_law(self)
    class(described_elements_t), intent(inout) :: self
    type(law_tape_t), target :: tape

    if (allocated(self%tape)) deallocate (self%tape)
    if (self%is_polynomial .and. .not. self%has_described_rows .or. self%values == 0) return
    tape = new_law_tape(self%states)
    call self%describe(tape)
    if (self%is_mean) call take_means(tape, self%turns)
    if (self%is_mean .and. self%steady_part == stays_away) tape%applied = 0
    allocate (self%tape, source=tape)
  end subroutine prepare_law
  !> Replaces the law by the one of steady states.
  subroutine describe_mean(self, turns)
    class(described_elements_t), intent(inout) :: self
    logical, intent(in) :: turns   !! whether its angle advances, else it is a twist that stays

    if (self%steady_part == stays_whole .or. .not. allocated(self%tape)) return
    if (.not. has_waves(self%tape)) return
    self%is_mean = .true.
    self%turns = turns
    call self%prepare_law()
  end subroutine describe_mean

  !> Computes what the elements keep of the parameters of a lane, after these have changed. By default they keep nothing.
  subroutine refresh_lane(self, lane)
    class(described_elements_t), intent(inout) :: self
    integer, intent(in) :: lane
  end subroutine refresh_lane
  !> Lists the parameter arrays of its elements, and the operations of its law.
  subroutine pass_parameters(self, parameters)
    class(described_elements_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters
    integer :: i

    do i = 1, size(self%parameters)
      associate (one => self%parameters(i))
        call parameters%add(trim(one%name), one%value)
      end associate
    end do
    if (allocated(self%curve)) call parameters%add_curves(self%curve)
    if (.not. (allocated(self%tape) .and. parameters%describes)) return
    associate (node => self%tape%node, count => self%tape%count)
      call parameters%add_structure([(node(i)%operation, i=1, count)], [(node(i)%a, i=1, count)], [(node(i)%b, i=1, count)], &
                                    self%tape%list)
    end associate
  end subroutine pass_parameters

  !> Sets the coefficients of its elements among the ones of the machine, which are zero before, in some lanes.
  pure subroutine polynomials(self, first_lane, last_lane, laws)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: first_lane, last_lane
    type(polynomial_laws_t), intent(inout) :: laws   !! of the machine
    integer :: e, i, l

    do i = 1, size(self%terms)
      do e = 1, self%count
        do l = first_lane, last_lane
          call set_term(self, i, e, l, laws)
        end do
      end do
    end do
  end subroutine polynomials

  !> Sets the coefficients that follow from one parameter of an element, in a lane.
  pure subroutine set_terms(self, parameter, element, lane, laws)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: parameter, element, lane
    type(polynomial_laws_t), intent(inout) :: laws   !! of the machine
    integer :: i

    do i = 1, size(self%terms)
      if (self%terms(i)%parameter == parameter) call set_term(self, i, element, lane, laws)
    end do
  end subroutine set_terms

  !> Sets one coefficient of an element in a lane.
  pure subroutine set_term(self, number, element, lane, laws)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: number   !! of the term
    integer, intent(in) :: element, lane
    type(polynomial_laws_t), intent(inout) :: laws

    associate (term => self%terms(number))
      call laws%set(term%coefficient, lane, self%first - 1 + element, &
                    term%factor * self%parameters(term%parameter)%value(lane, element))
    end associate
  end subroutine set_term

  !> Writes the part of the law that is not polynomial as formulas: sets `restoring`, `applied`, `stored`, `rate`, `row` of the
  !> list and the guards of its branches. By default there is none.
  subroutine describe(self, tape)
    class(described_elements_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    if (tape%count > 0 .or. self%values > 0) then
      error stop 'nocdyn_described_elements: elements that are not polynomial override describe'
    end if
  end subroutine describe

  !> The largest rate of oscillations in one lane that are no part of the law [rad/s]. By default there are none.
  pure real(wp) function fastest_wave(self, lane)
    class(described_elements_t), intent(in) :: self
    integer, intent(in) :: lane

    fastest_wave = 0.0_wp
  end function fastest_wave

end module nocdyn_described_elements
