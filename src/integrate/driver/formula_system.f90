!> Equations y' = f(t, y) that are written once, as formulas: the derivative, the exact Jacobian and the Taylor series follow.
!>
!> The formulas are recorded once, as a list of operations (`nocdyn_law_tape`). Its values, its derivatives and the recurrence of
!> its series are computed by Taylor arithmetic, lanes side by side, with parameters of their own.
module nocdyn_formula_system
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, parameter_of, state_of, time_of
  use nocdyn_law_strips, only: fill, load, load_lanes, unload
  use nocdyn_law_tape, only: law_tape_t, new_law_tape, op_angle, op_larger, op_pick, op_segment, op_size, &
    op_speed, op_state, op_tanh
  use nocdyn_law_values, only: law_program_t, new_law_program
  use nocdyn_law_walk, only: walk
  use nocdyn_law_work, only: law_work_t, new_law_work
  use nocdyn_laws, only: law_parameter_t, law_t, new_law, strip_lanes
  use nocdyn_system, only: pattern_t, system_t
  implicit none (type, external)
  private

  public :: formula_system, formulas_interface

  abstract interface

    !> Writes the rates of all components, `dydt(1) = y(2)` and so on. It is called once, and sees no numbers: an `if` in it
    !> cannot ask for the state.
    subroutine formulas_interface(t, y, p, dydt)
      import :: expression_t
      type(expression_t), intent(in) :: t
      type(expression_t), intent(in) :: y(:)         !! [states]
      type(expression_t), intent(in) :: p(:)         !! parameters, constants of each lane
      type(expression_t), intent(inout) :: dydt(:)   !! [states + quadratures]
    end subroutine formulas_interface

  end interface

  type, extends(system_t), public :: formula_system_t
    private
    type(law_t) :: law
    integer :: time = 0                      !! node of the time
    integer, allocatable :: state(:)         !! nodes of the states, [states]
    integer, allocatable :: rate(:)          !! nodes of the rates, [states + quadratures]
    type(pattern_t) :: pattern               !! of the Jacobian
    type(law_parameter_t), allocatable :: parameters(:)
    type(law_work_t) :: values, tangents, expansion
    type(law_program_t) :: program           !! the values of one lane ...
    real(wp), allocatable :: x(:)            !! ... in these numbers, [0:nodes]
  contains
    procedure, public :: set_parameters
    procedure, public :: derivative
    procedure, public :: jacobian
    procedure, public :: jacobian_pattern
    procedure, public :: series_obstacle
    procedure, public :: prepare_series
    procedure, public :: series
    procedure, public :: evaluation_cost
    procedure, public :: series_cost
  end type formula_system_t

contains

  !> The system of `states` equations, and of `quadratures` integrals on which no equation depends, in some lanes.
  function formula_system(states, formulas, parameters, lanes, quadratures) result(system)
    integer, intent(in) :: states
    procedure(formulas_interface) :: formulas
    real(wp), intent(in), optional :: parameters(:)   !! of all lanes, in units of the formulas; none without
    integer, intent(in), optional :: lanes            !! 1 without
    integer, intent(in), optional :: quadratures      !! 0 without
    type(formula_system_t) :: system
    type(law_tape_t), target :: tape
    real(wp), allocatable :: values(:)
    integer :: lane

    allocate (values(0))
    if (present(parameters)) values = parameters
    if (present(lanes)) system%lanes = lanes
    if (present(quadratures)) system%quadratures = quadratures
    system%states = states
    if (states < 1) error stop 'nocdyn_formula_system: there is at least one state'
    if (system%lanes < 1) error stop 'nocdyn_formula_system: there is at least one lane'
    if (system%quadratures < 0) error stop 'nocdyn_formula_system: the number of quadratures is not negative'
    tape = new_law_tape(0)
    call record(system, tape, size(values), formulas)
    call find_pattern(system, tape)
    call make_room(system, tape, size(values))
    do lane = 1, system%lanes
      call system%set_parameters(lane, values)
    end do
  end function formula_system

  !> Records the formulas.
  subroutine record(system, tape, parameters, formulas)
    type(formula_system_t), intent(inout) :: system
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: parameters
    procedure(formulas_interface) :: formulas
    integer, parameter :: refused(*) = [op_angle, op_speed, op_pick, op_segment, op_larger, op_size]
    type(expression_t) :: dydt(system%states + system%quadratures), p(parameters), t, y(system%states)
    integer :: i

    t = time_of(tape)
    do i = 1, system%states
      y(i) = state_of(tape, i)
    end do
    do i = 1, parameters
      p(i) = parameter_of(tape, i, [1])
    end do
    system%time = t%node
    allocate (system%state, source=[(y(i)%node, i=1, system%states)])
    call formulas(t, y, p, dydt)
    allocate (system%rate(size(dydt)))
    do i = 1, size(dydt)
      if (.not. associated(dydt(i)%tape)) error stop 'nocdyn_formula_system: every component has an equation'
      system%rate(i) = node_of(dydt(i))
    end do
    do i = 1, tape%count
      if (any(tape%node(i)%operation == refused)) then
        error stop 'nocdyn_formula_system: a function in the formulas is not smooth, or is for elements of machines'
      end if
    end do
  end subroutine record

  !> The entries of the Jacobian whose states occur in the equations.
  subroutine find_pattern(system, tape)
    type(formula_system_t), intent(inout) :: system
    type(law_tape_t), intent(in) :: tape
    logical :: depends(0:tape%count)   ! whether a node depends on a state
    integer :: i, j

    allocate (system%pattern%row(0), system%pattern%column(0))
    do j = 1, system%states
      depends = .false.
      do i = 1, tape%count
        associate (node => tape%node(i))
          if (node%operation == op_state) depends(i) = node%a == j
          if (node%operation > op_state .and. .not. node%is_constant) depends(i) = depends(node%a) .or. depends(node%b)
        end associate
      end do
      associate (rows => pack([(i, i=1, size(system%rate))], depends(system%rate)))
        system%pattern%row = [system%pattern%row, rows]
        system%pattern%column = [system%pattern%column, [(j, i=1, size(rows))]]
      end associate
    end do
  end subroutine find_pattern

  !> Allocates parameters and work space.
  subroutine make_room(system, tape, parameters)
    type(formula_system_t), intent(inout) :: system
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: parameters
    integer :: i

    allocate (system%parameters(parameters))
    do i = 1, parameters
      system%parameters(i)%name = ''
      allocate (system%parameters(i)%value(system%lanes, 1), source=0.0_wp)
    end do
    system%law = new_law(tape, system%lanes, 1, strip_lanes(system%lanes, 1))
    system%hides_bends = any(tape%node(:tape%count)%operation == op_tanh)
    associate (w => system%law%w, groups => system%law%groups)
      system%values = new_law_work(tape, tape%needed(system%rate, .false.), 0, w, groups)
      system%tangents = new_law_work(tape, tape%needed(system%rate, .true.), 1, w, groups)
    end associate
    system%program = new_law_program(tape, system%rate)
    allocate (system%x(0:tape%count), source=0.0_wp)
  end subroutine make_room

  !> Sets the parameters of a lane, at the start or between variants.
  subroutine set_parameters(self, lane, parameters)
    class(formula_system_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: parameters(:)   !! in units of the formulas
    integer, parameter :: no_branches(0) = 0
    integer :: i

    if (lane < 1 .or. lane > self%lanes) error stop 'nocdyn_formula_system: there is no such lane'
    if (size(parameters) /= size(self%parameters)) error stop 'nocdyn_formula_system: the number of parameters stays the same'
    do i = 1, size(parameters)
      self%parameters(i)%value(lane, 1) = parameters(i)
    end do
    call self%law%refresh(lane, 1, self%parameters, no_branches, .false.)
    if (self%lanes > 1) return
    do i = 1, size(self%law%constants)
      self%x(self%law%constants(i)) = self%law%constant(1, i)
    end do
  end subroutine set_parameters

  subroutine derivative(self, t, y, dydt, status)
    class(formula_system_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes), y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: i, strip

    if (self%lanes == 1 .and. .not. self%program%has_harmonics()) then
      self%x(self%time) = t(1)
      do i = 1, self%states
        self%x(self%state(i)) = y(1, i)
      end do
      call self%program%compute(size(self%x) - 1, self%x)
      do i = 1, size(self%rate)
        dydt(1, i) = self%x(self%rate(i))
      end do
      return
    end if
    dydt = 0.0_wp
    do strip = 1, self%law%strips
      call load_inputs(self, self%values, strip, t, y)
      call walk(self%law, self%values, 0, self%law%groups * (strip - 1) + 1)
      do i = 1, size(self%rate)
        call unload(self%law, self%values, self%rate(i), 0, strip, 1, 1, dydt(1, i))
      end do
    end do
  end subroutine derivative

  !> Sets the time and the states of a strip.
  subroutine load_inputs(self, work, strip, t, y)
    class(formula_system_t), intent(in) :: self
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: strip
    real(wp), intent(in) :: t(self%lanes)                 !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states)    !! in units of the formulas
    integer :: i

    call load_lanes(self%law, work, self%time, 0, strip, t)
    do i = 1, self%states
      call load(self%law, work, self%state(i), 0, strip, 1, 1, y(1, i))
    end do
  end subroutine load_inputs

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(formula_system_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes), y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: i, j, position, strip

    dfdy(:, :) = 0.0_wp
    dfdt = 0.0_wp
    do strip = 1, self%law%strips
      call load_inputs(self, self%tangents, strip, t, y)
      call walk(self%law, self%tangents, 0, self%law%groups * (strip - 1) + 1)
      call fill(self%tangents, self%time, 1, 1.0_wp)
      do i = 1, self%states
        call fill(self%tangents, self%state(i), 1, 0.0_wp)
      end do
      call walk(self%law, self%tangents, 1, self%law%groups * (strip - 1) + 1)
      do i = 1, size(self%rate)
        call unload(self%law, self%tangents, self%rate(i), 1, strip, 1, 1, dfdt(1, i))
      end do
      call fill(self%tangents, self%time, 1, 0.0_wp)
      position = 1
      do j = 1, self%states
        call fill(self%tangents, self%state(j), 1, 1.0_wp)
        call differentiate_by(self, strip, j, position, dfdy)
        call fill(self%tangents, self%state(j), 1, 0.0_wp)
      end do
    end do
  end subroutine jacobian

  !> Computes the derivatives by the state that alone grows.
  subroutine differentiate_by(self, strip, state, position, dfdy)
    class(formula_system_t), intent(inout) :: self
    integer, intent(in) :: strip, state
    integer, intent(inout) :: position   !! of the next entry of the pattern
    real(wp), intent(inout) :: dfdy(self%lanes, size(self%pattern%row))   !! in units of the formulas

    if (position > size(self%pattern%row)) return
    if (self%pattern%column(position) /= state) return
    call walk(self%law, self%tangents, 1, self%law%groups * (strip - 1) + 1)
    do while (position <= size(self%pattern%row))
      if (self%pattern%column(position) /= state) exit
      call unload(self%law, self%tangents, self%rate(self%pattern%row(position)), 1, strip, 1, 1, dfdy(1, position))
      position = position + 1
    end do
  end subroutine differentiate_by

  function jacobian_pattern(self) result(pattern)
    class(formula_system_t), intent(in) :: self
    type(pattern_t) :: pattern

    pattern = self%pattern
  end function jacobian_pattern

  subroutine series_obstacle(self, obstacle)
    class(formula_system_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = ''
  end subroutine series_obstacle

  subroutine prepare_series(self, order)
    class(formula_system_t), intent(inout) :: self
    integer, intent(in) :: order

    associate (tape => self%law%tape)
      self%expansion = new_law_work(tape, tape%needed(self%rate, .true.), order, self%law%w, self%law%groups)
    end associate
    call fill(self%expansion, self%time, 1, 1.0_wp)   ! the time grows evenly
  end subroutine prepare_series

  subroutine series(self, order, columns, t, y, status)
    class(formula_system_t), intent(inout) :: self
    integer, intent(in) :: order, columns
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(self%lanes, columns, 0:order)
    integer, intent(inout) :: status(self%lanes)
    integer :: i, k, strip

    y(:, :, 1:) = 0.0_wp
    do strip = 1, self%law%strips
      call load_inputs(self, self%expansion, strip, t, y)
      do k = 0, order - 1
        call walk(self%law, self%expansion, k, self%law%groups * (strip - 1) + 1)
        do i = 1, size(self%rate)
          call unload(self%law, self%expansion, self%rate(i), k, strip, 1, 1, y(1, i, k + 1))
        end do
        call divide(self%expansion, self%law%strip * (strip - 1) + 1, self%lanes, size(self%rate), k + 1, y(1, 1, k + 1))
        do i = 1, self%states
          call load(self%law, self%expansion, self%state(i), k + 1, strip, 1, 1, y(1, i, k + 1))
        end do
      end do
    end do
  end subroutine series

  !> Divides the rates of the lanes of a strip by k.
  pure subroutine divide(work, first, lanes, components, k, y)
    type(law_work_t), intent(in) :: work
    integer, intent(in) :: first, lanes, components, k
    real(wp), intent(inout) :: y(lanes, components)   !! in units of the formulas
    integer :: i, last

    last = min(first + work%w - 1, lanes)
    do i = 1, components
      y(first:last, i) = y(first:last, i) / k
    end do
  end subroutine divide

  !> The cost of the operations one by one.
  pure real(wp) function evaluation_cost(self) result(cost)
    class(formula_system_t), intent(in) :: self
    real(wp), parameter :: start = 20.0_wp, operation = 5.0_wp   ! [ns]

    cost = start + operation * self%program%steps
  end function evaluation_cost

  !> The cost of the operations for each coefficient in one lane, which leaves most of a vector empty. It does not depend on the
  !> block, nor does the choice of `auto`; users whose lanes share vectors set `is_shared`.
  pure real(wp) function series_cost(self, order) result(cost)
    class(formula_system_t), intent(in) :: self
    integer, intent(in) :: order
    real(wp), parameter :: operation = 25.0_wp, input = 10.0_wp   ! [ns]

    cost = order * (operation * size(self%expansion%later) + input * size(self%rate))
  end function series_cost

end module nocdyn_formula_system
