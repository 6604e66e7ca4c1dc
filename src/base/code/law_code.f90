!> Code of the Taylor arithmetic of a law: what `nocdyn_law_walk` carries out, as statements of C for coefficient k of element i.
!>
!> The coefficients of a variable that later ones read stand in an array of the work space, those of others in a local variable.
module nocdyn_law_code
  use nocdyn_code_text, only: code_text_t, filled, list_of
  use nocdyn_law_tape, only: law_inputs_t, law_node_t, law_tape_t, op_add, op_arctangent, op_cosine, op_exponential, op_fixed, &
    op_harmonics, op_larger, op_log_cosh, op_logarithm, op_multiply, op_power, op_reciprocal, op_scale, op_sech_squared, &
    op_shift, op_sine, op_square_root, op_subtract, op_tanh, op_wave, unlimited
  use nocdyn_law_work, only: law_work_t
  use nocdyn_laws, only: law_t, terms_of
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: new_law_code

  !> What the code of the law of a bank needs.
  type, public :: law_code_t
    integer :: bank = 0                            !! number of the bank in the code, from 0
    type(law_t) :: law
    type(law_work_t) :: work
    logical :: is_local = .false.                  !! whether the code has no work space: of values alone
    logical, allocatable, private :: is_kept(:)    !! whether the work space has all coefficients of a node
  contains
    procedure :: declare_work, declare_tables, write_nodes, operand, constant, kept
  end type law_code_t

contains

  !> The law of a bank, with its work space for series.
  function new_law_code(bank, law, work, inputs) result(self)
    integer, intent(in) :: bank
    type(law_t), intent(in) :: law
    type(law_work_t), intent(in) :: work
    class(law_inputs_t), intent(in) :: inputs
    type(law_code_t) :: self
    integer :: i

    self%bank = bank
    self%law = law
    self%work = work
    allocate (self%is_kept(law%tape%count + 1), source=.false.)
    associate (tape => law%tape, is_kept => self%is_kept)
      do i = 1, size(inputs%state)
        if (inputs%state(i) > 0) is_kept(inputs%state(i)) = .true.
      end do
      do i = 1, size(work%nodes)
        associate (node => tape%node(work%nodes(i)), number => work%nodes(i))
          if (node%operation == op_multiply .or. node%operation >= op_reciprocal) is_kept(node%a) = .true.
          select case (node%operation)
          case (op_multiply, op_arctangent, op_log_cosh)
            is_kept(node%b) = .true.
          case (op_sine, op_tanh)
            is_kept(number + 1) = .true.
          case (op_cosine, op_sech_squared)
            is_kept(number - 1) = .true.
          case default
            ! it needs no other series
          end select
          if (node%operation >= op_reciprocal .and. node%operation /= op_harmonics) is_kept(number) = .true.
        end associate
      end do
    end associate
  end function new_law_code

  !> Whether the work space has all coefficients of a node of its own, which is no input of the motion.
  pure logical function kept(self, node)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node

    kept = self%is_kept(node) .and. self%work%first(node) > 0 .and. self%law%tape%node(node)%operation >= op_fixed
  end function kept

  !> Writes where the coefficients begin in the work space, as members of an enumeration.
  subroutine declare_work(self, states, code)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: states(:)   !! nodes of the internal states, or 0
    type(code_text_t), intent(inout) :: code
    integer :: i

    do i = 1, size(states)
      if (states(i) > 0) call declare(member(self, states(i)), '(P + 1)')
    end do
    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i))
        if (self%kept(number)) call declare(member(self, number), '(P + 1)')
        if (self%law%tape%node(number)%operation /= op_harmonics) cycle
        call declare(member(self, number) // 'h', 'HARMONIC_WORK')
      end associate
    end do

  contains

    subroutine declare(name, size)
      character(len=*), intent(in) :: name, size   !! size for each element

      call code%line('  at_@, last_@ = at_' // name // ' + $ * ' // size // ' - 1,', [self%law%elements], name, name)
    end subroutine declare

  end subroutine declare_work

  !> Writes the multiples of harmonics, and the factors of their derivatives.
  subroutine declare_tables(self, code)
    class(law_code_t), intent(in) :: self
    type(code_text_t), intent(inout) :: code
    integer :: i, terms

    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i), node => self%law%tape%node(self%work%nodes(i)), table => self%work%table)
        if (node%operation /= op_harmonics) cycle
        terms = terms_of(node)
        call code%line('static const int ' // member(self, number) // 'n[] = {' // &
                       list_of(self%law%tape%list(node%first:node%first + terms - 1)) // '};')
        associate (first => self%work%table_first(number))
          call code%line('static const double ' // member(self, number) // 'f[] = {' // &
                         list_of(table(first:first + terms * (self%work%order + 1) - 1)) // '};')
        end associate
      end associate
    end do
  end subroutine declare_tables

  !> Name of the member of the work space of a node.
  function member(self, node) result(text)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node
    character(len=:), allocatable :: text

    text = 'b' // to_text(self%bank) // 'n' // to_text(node)
  end function member

  !> Coefficient k of a node, of variable e.
  function operand(self, node) result(text)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node
    character(len=:), allocatable :: text

    if (self%law%tape%node(node)%operation < op_fixed) then
      text = filled('n$[k + d$ * e]', [node, node])
    else
      text = filled('v$[e]', [node])
    end if
  end function operand

  !> Writes the statements that compute the variables v1, v2, ... of g elements from i on. The coefficients n1, n2, ... of the
  !> inputs and the steps d1, d2, ... to those of the next element are there.
  subroutine write_nodes(self, code)
    class(law_code_t), intent(in) :: self
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable :: condition
    integer :: i

    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i))
        if (.not. self%kept(number)) cycle
        if (self%is_local) then
          call code%line('  vd n$[1]; enum { d$ = 0 };', [number, number])
          cycle
        end if
        call code%line('  vd *n$ = z + at_@ + (P + 1) * i;', [number], member(self, number))
        call code%line('  enum { d$ = ACROSS ? WORK : P + 1 };', [number])
      end associate
    end do
    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i), node => self%law%tape%node(self%work%nodes(i)))
        call code%line('  vd v$[MOST];', [number])
        condition = ''
        if (node%degree < unlimited) then
          condition = filled('if (k <= $) ', [node%degree])
          if (.not. self%kept(number)) call code%line('  EACH v$[e] = (vd){};', [number])
        end if
        if (node%operation == op_wave) then
          call code%line('  @;', a=statement(self, number, node))
          call code%line('  EACH v$[e] = n$[k + d$ * e];', [number, number, number])
          cycle
        end if
        call code%line('  @@;', a=condition, b=statement(self, number, node))
        if (self%kept(number)) call code%line('  @EACH n$[k + d$ * e] = v$[e];', [number, number, number], condition)
      end associate
    end do
  end subroutine write_nodes

  !> The statement that computes a node.
  function statement(self, number, node) result(text)
    type(law_code_t), intent(in) :: self
    integer, intent(in) :: number
    type(law_node_t), intent(in) :: node
    character(len=:), allocatable :: text
    character(len=:), allocatable :: a, b, x
    integer :: before, degree, terms

    x = filled('n$, d$', [node%a, node%a])   ! coefficients of the first operand, and of the node itself
    a = filled('n$, d$, v$', [number, number, number])
    degree = 0
    if (node%a > 0) degree = self%law%tape%node(node%a)%degree
    select case (node%operation)
    case (op_fixed)
      text = filled('EACH v$[e] = k == 0 ? @ : (vd){}', [number], constant(self, node%a))
    case (op_add, op_subtract)
      text = filled('EACH v$[e] = @ @ @', [number], self%operand(node%a), merge('+', '-', node%operation == op_add), &
                    self%operand(node%b))
    case (op_shift)
      b = self%operand(node%a)
      text = filled('EACH v$[e] = k == 0 ? @ + @ : @', [number], b, constant(self, node%b), b)
    case (op_scale)
      text = filled('EACH v$[e] = @ * @', [number], constant(self, node%b), self%operand(node%a))
    case (op_multiply)
      text = filled('multiply(g, k, @, n$, d$, v$)', [node%b, node%b, number], x)
    case (op_reciprocal)
      text = filled('reciprocal(g, k, @, @)', [integer ::], x, a)
    case (op_wave)
      text = filled('{ vd c[MOST]; EACH c[e] = @; wave(g, f, k, @, c, n$, d$); }', [number, number], constant(self, node%b), x)
    case (op_sine)
      b = x
      if (self%work%first(min(number + 1, size(self%work%first))) > 0) b = filled('n$, d$', [number + 1, number + 1])
      text = filled('sine(g, f, k, $, @, @, @)', [degree], x, b, a)
    case (op_cosine)
      text = filled('cosine(g, f, k, $, @, n$, d$, v$)', [degree, number - 1, number - 1, number], x)
    case (op_tanh)
      text = filled('hyperbolic_tangent(g, k, $, @, n$, d$, v$)', [degree, number + 1, number + 1, number], x)
    case (op_sech_squared)
      text = filled('sech_squared(g, k, n$, d$, v$)', [number - 1, number - 1, number])
    case (op_exponential)
      text = filled('exponential(g, k, $, @, @)', [degree], x, a)
    case (op_square_root)
      text = filled('square_root(g, k, @, @)', [integer ::], x, a)
    case (op_log_cosh)
      text = filled('log_cosh(g, f, k, $, @, n$, d$, v$)', [degree, node%b, node%b, number], x)
    case (op_logarithm)
      text = filled('quotient(g, f->logarithms, k, @, @, @)', [integer ::], x, x, a)
    case (op_arctangent)
      text = filled('quotient(g, f->arctangents, k, @, n$, d$, @)', [node%b, node%b], x, a)
    case (op_power)
      text = filled('{ vd c[MOST]; EACH c[e] = @; power(g, f, k, @, c, @); }', [integer ::], constant(self, node%b), x, a)
    case (op_larger)
      text = filled('EACH v$[e] = larger(@, @)', [number], self%operand(node%a), self%operand(node%b))
    case default   ! op_harmonics
      terms = terms_of(node)
      before = (self%law%stack(number) - 1) / size(self%law%constant, 1)   ! coefficients of each slot in `stacked`
      b = member(self, number)
      text = filled('harmonics(g, f, k, $, @n, @f, s->stacked[$] + $ * s->slots[$] + (W * $) * ($ * s->strip + i),', &
                    [terms, self%bank, before, self%bank, 2 * terms, self%law%elements], b, b)
      text = filled('@ PARAMETER_STEP($), @,', [2 * terms], text, x)
      text = filled('@ (harmonic_work *)(z + at_@h) + i, ACROSS ? WORK : HARMONIC_WORK, v$)', [number], text, b)
    end select
  end function statement

  !> A constant of element i + e, or of element i in lanes e.
  function constant(self, node) result(text)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node
    character(len=:), allocatable :: text

    text = filled('load(s->constant[$] + $ * s->slots[$] + W * i + PARAMETER_STEP(1) * e)', &
                  [self%bank, self%law%column(node) - 1, self%bank])
  end function constant

end module nocdyn_law_code
