!> The law of the elements of a bank as a list of elementary operations, in the order in which they are carried out.
!>
!> Every node of the list is a number for each element and lane. Constants follow from the parameters and from the present
!> branches; they change where these do. Variables follow from the motion: the relative angle u and speed u' of an element,
!> u and u' of its phase, its internal states, and the time. `nocdyn_law_expressions` writes such lists from formulas,
!> `nocdyn_law_walk` carries them out.
module nocdyn_law_tape
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  ! Constants: a literal; a parameter; one of several constants, by the branch of a switch; a number of the present segment of a
  ! curve; then arithmetic, with the operations of variables.
  integer, parameter, public :: op_literal = 1, op_parameter = 2, op_pick = 3, op_segment = 4
  ! Variables: what the law is a function of; a constant as a variable; ...
  integer, parameter, public :: op_angle = 5, op_speed = 6, op_time = 7, op_state = 8, op_fixed = 9
  ! ... arithmetic, where `shift` and `scale` take a variable and a constant, and `wave` is a constant times the sine of a
  ! variable that grows evenly; ...
  integer, parameter, public :: op_add = 10, op_subtract = 11, op_multiply = 12, op_shift = 13, op_scale = 14, op_reciprocal = 15
  integer, parameter, public :: op_wave = 16
  ! ... functions; `sech_squared` is 1 - tanh^2; ...
  integer, parameter, public :: op_sine = 17, op_cosine = 18, op_tanh = 19, op_sech_squared = 20, op_exponential = 21
  integer, parameter, public :: op_square_root = 22, op_log_cosh = 23
  ! ... the sum of a(n) sin(n x) + b(n) cos(n x) over whole numbers n; ...
  integer, parameter, public :: op_harmonics = 24
  ! ... the natural logarithm; a variable to the power of a constant; the arctangent of a, with b = 1 + a^2; ...
  integer, parameter, public :: op_logarithm = 25, op_power = 26, op_arctangent = 27
  ! ... and values without a series: the larger of two; the size of a constant, and 1 where it is 0, else 0.
  integer, parameter, public :: op_larger = 28, op_size = 29, op_is_zero = 30

  public :: new_law_tape

  integer, parameter, public :: at_element = 1, at_phase = 2   !! ports, of which motion an angle or a speed is
  integer, parameter, public :: unlimited = huge(1)   !! degree of a variable whose series does not end

  type, public :: law_node_t
    integer :: operation = op_literal
    integer :: a = 0, b = 0             !! operands; a parameter, switch, state, port or part of a segment in `a`
    integer :: first = 1, last = 0      !! part of `list`: columns of a parameter, choices of a pick, terms of harmonics
    integer :: degree = 0               !! of the last Taylor coefficient that can differ from zero; 0 for constants
    logical :: is_constant = .true.
    logical :: has_angle = .false.      !! whether it depends on the angle ...
    logical :: has_speed = .false.      !! ... the speed ...
    logical :: has_time = .false.       !! ... the time ...
    logical :: has_state = .false.      !! ... an internal state
    logical :: has_branch = .false.     !! ... a branch
    real(wp) :: value = 0.0_wp          !! of a literal
  end type law_node_t

  !> What a law reads; nodes, 0 where it does not.
  type, public :: law_inputs_t
    integer :: ports = at_element               !! `at_phase` if the elements are followed by as many phases
    integer :: angle = 0, speed = 0             !! of the element
    integer :: phase = 0, phase_speed = 0       !! of its phase
    integer :: time = 0
    integer, allocatable :: state(:)            !! internal states, [states]
  end type law_inputs_t

  !> What a law gives; nodes, 0 where it gives none.
  type, public :: law_tape_t
    integer :: count = 0
    type(law_node_t), allocatable :: node(:)   !! the first `count` are in use
    integer, allocatable :: list(:)            !! of the nodes
    integer :: restoring = 0                   !! conservative moment [N m]
    integer :: applied = 0                     !! the other moment [N m]
    integer :: phase_restoring = 0             !! part of the conservative moment that acts on the phase [N m]
    integer :: phase_applied = 0               !! part of the other moment that acts on the phase [N m]
    integer :: stored = 0                      !! potential energy of `restoring` [J]
    integer :: twist = 0                       !! what the moments are functions of in place of the angle, with harmonics [rad]
    integer :: control = 0                     !! part of the moment that is its mean, whatever sets that [N m]
    integer, allocatable :: row(:)             !! g of rows that move: of an element, or of all of one driver [rad] or [m]
    integer, allocatable :: rate(:)            !! derivatives of the internal states by the time, [states]
    integer :: argument = 0                    !! of the curve of an element
    integer, allocatable :: guard(:)           !! functions that are positive inside a branch ...
    integer, allocatable :: guarded_switch(:)  !! ... of this switch, [guards]
    integer, allocatable :: guarded_branch(:)  !! ... with this number, 0: every one, [guards]
    integer, allocatable :: guard_shift(:)     !! constants by which boundaries are shifted outwards, [guards]
  contains
    procedure :: append, constants, needed, inputs, find_dependences
  end type law_tape_t

contains

  !> A list without operations, of a law with some internal states.
  function new_law_tape(states) result(self)
    integer, intent(in) :: states
    type(law_tape_t) :: self

    allocate (self%node(16), self%list(0), self%guard(0), self%guarded_switch(0), self%guarded_branch(0), self%guard_shift(0), &
              self%row(0))
    allocate (self%rate(states), source=0)
  end function new_law_tape

  !> Adds a node, or finds an equal one.
  subroutine append(self, node, number)
    class(law_tape_t), intent(inout) :: self
    type(law_node_t), intent(in) :: node
    integer, intent(out) :: number
    type(law_node_t), allocatable :: longer(:)

    do number = 1, self%count
      if (are_equal(self, self%node(number), node)) return
    end do
    if (self%count == size(self%node)) then
      allocate (longer(2 * self%count))
      longer(:self%count) = self%node
      call move_alloc(longer, self%node)
    end if
    self%count = self%count + 1
    self%node(self%count) = node
    call find_properties(self, self%node(self%count))
    number = self%count
  end subroutine append

  pure logical function are_equal(self, x, y)
    type(law_tape_t), intent(in) :: self
    type(law_node_t), intent(in) :: x, y

    are_equal = x%operation == y%operation .and. x%a == y%a .and. x%b == y%b .and. .not. abs(x%value - y%value) > 0
    if (are_equal) are_equal = x%last - x%first == y%last - y%first
    if (are_equal) are_equal = all(self%list(x%first:x%last) == self%list(y%first:y%last))
  end function are_equal

  !> Finds what every node depends on, after a change of operations.
  pure subroutine find_dependences(self)
    class(law_tape_t), intent(inout) :: self
    integer :: i

    do i = 1, self%count
      call find_properties(self, self%node(i))
    end do
  end subroutine find_dependences

  !> What a node depends on, and where its series ends.
  pure subroutine find_properties(self, node)
    type(law_tape_t), intent(in) :: self
    type(law_node_t), intent(inout) :: node

    node%is_constant = node%operation < op_angle
    node%has_angle = node%operation == op_angle
    node%has_speed = node%operation == op_speed
    node%has_time = node%operation == op_time
    node%has_state = node%operation == op_state
    node%has_branch = node%operation == op_pick .or. node%operation == op_segment
    node%degree = 0
    if (node%operation >= op_angle .and. node%operation <= op_state) node%degree = merge(1, unlimited, node%has_time)
    if (node%operation < op_add) return
    associate (a => self%node(node%a))
      node%is_constant = a%is_constant
      call depend(node, a)
      node%degree = a%degree
      if (node%operation >= op_reciprocal .and. a%degree > 0) node%degree = unlimited
      if (node%b == 0 .or. node%operation > op_multiply .and. node%operation < op_larger) return
    end associate
    associate (b => self%node(node%b))
      node%is_constant = node%is_constant .and. b%is_constant
      call depend(node, b)
      if (node%operation == op_multiply .and. max(node%degree, b%degree) < unlimited) then
        node%degree = node%degree + b%degree
      else
        node%degree = max(node%degree, b%degree)
      end if
    end associate
  end subroutine find_properties

  pure subroutine depend(node, on)
    type(law_node_t), intent(inout) :: node
    type(law_node_t), intent(in) :: on

    node%has_angle = node%has_angle .or. on%has_angle
    node%has_speed = node%has_speed .or. on%has_speed
    node%has_time = node%has_time .or. on%has_time
    node%has_state = node%has_state .or. on%has_state
    node%has_branch = node%has_branch .or. on%has_branch
  end subroutine depend

  !> The nodes of all inputs.
  pure function inputs(self)
    class(law_tape_t), intent(in) :: self
    type(law_inputs_t) :: inputs
    integer :: i

    inputs%angle = input(self, op_angle, at_element)
    inputs%speed = input(self, op_speed, at_element)
    inputs%phase = input(self, op_angle, at_phase)
    inputs%phase_speed = input(self, op_speed, at_phase)
    if (max(inputs%phase, inputs%phase_speed) > 0) inputs%ports = at_phase
    inputs%time = input(self, op_time, 0)
    allocate (inputs%state(size(self%rate)))
    inputs%state(:) = [(input(self, op_state, i), i=1, size(self%rate))]
  end function inputs

  !> The node of an input, 0 where the law does not read it.
  pure integer function input(self, operation, number)
    class(law_tape_t), intent(in) :: self
    integer, intent(in) :: operation   !! op_angle to op_state
    integer, intent(in) :: number      !! of an internal state, or the port of an angle or a speed; 0 for the time
    integer :: i

    input = 0
    do i = 1, self%count
      if (self%node(i)%operation == operation .and. self%node(i)%a == number) input = i
    end do
  end function input

  !> The nodes that are constants, ascending.
  pure function constants(self) result(nodes)
    class(law_tape_t), intent(in) :: self
    integer, allocatable :: nodes(:)
    integer :: i

    nodes = pack([(i, i=1, self%count)], [(self%node(i)%is_constant, i=1, self%count)])
  end function constants

  !> The variables that some nodes need, these among them, ascending. The series of a sine needs the cosine, which follows it in
  !> the list, unless its argument grows evenly; the series of tanh needs 1 - tanh^2, which follows too, the one of atan x needs
  !> 1 + x^2.
  pure function needed(self, results, with_series) result(nodes)
    class(law_tape_t), intent(in) :: self
    integer, intent(in) :: results(:)        !! nodes, or 0
    logical, intent(in) :: with_series       !! whether more than the values are needed
    integer, allocatable :: nodes(:)
    logical :: is_needed(0:self%count + 1)
    integer :: i

    is_needed = .false.
    is_needed(results) = .true.
    do i = self%count, 1, -1
      associate (node => self%node(i))
        if (node%operation == op_cosine .and. with_series) is_needed(i - 1) = is_needed(i - 1) .or. is_needed(i)
        if (node%operation == op_sech_squared) is_needed(i - 1) = is_needed(i - 1) .or. is_needed(i)
        if (.not. is_needed(i) .or. node%operation < op_add) cycle
        is_needed(node%a) = .true.
        if (with_series .or. node%operation /= op_arctangent) is_needed(node%b) = .true.
        if (with_series .and. node%operation == op_tanh) is_needed(i + 1) = .true.
        if (with_series .and. node%operation == op_sine .and. self%node(node%a)%degree > 1) is_needed(i + 1) = .true.
      end associate
    end do
    nodes = pack([(i, i=1, self%count)], [(is_needed(i) .and. .not. self%node(i)%is_constant, i=1, self%count)])
  end function needed

end module nocdyn_law_tape
