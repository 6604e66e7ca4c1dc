!> Code of the Taylor arithmetic of a law: what `nocdyn_law_walk` carries out, as statements of C for coefficient k of element i.
!>
!> The coefficients of a variable that later ones read stand in an array of the work space, those of others in a local variable.
module nocdyn_law_code
  use nocdyn_code_text, only: code_text_t, list_of
  use nocdyn_law_tape, only: law_inputs_t, law_node_t, law_tape_t, op_add, op_arctangent, op_cosine, op_exponential, op_fixed, &
    op_harmonics, op_log_cosh, op_logarithm, op_multiply, op_power, op_reciprocal, op_scale, op_sech_squared, op_shift, op_sine, &
    op_square_root, op_subtract, op_tanh, op_wave, unlimited
  use nocdyn_law_work, only: law_work_t
  use nocdyn_laws, only: law_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: new_law_code

  !> What the code of the law of a bank needs.
  type, public :: law_code_t
    integer :: bank = 0                            !! number of the bank in the code, from 0
    type(law_t) :: law
    type(law_work_t) :: work
    logical, allocatable, private :: is_kept(:)    !! whether the work space has all coefficients of a node
  contains
    procedure :: obstacle, declare_work, declare_tables, write_nodes, operand, kept
  end type law_code_t

contains

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
          end select
          if (node%operation >= op_reciprocal .and. node%operation /= op_harmonics) is_kept(number) = .true.
        end associate
      end do
    end associate
  end function new_law_code

  !> An operation that has no code, '' if there is none.
  function obstacle(self) result(text)
    class(law_code_t), intent(in) :: self
    character(len=:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(self%work%nodes)
      if (self%law%tape%node(self%work%nodes(i))%operation <= op_arctangent) cycle
      text = 'operation ' // to_text(self%law%tape%node(self%work%nodes(i))%operation)
    end do
  end function obstacle

  !> Whether the work space has all coefficients of a node of its own, which is no input of the motion.
  pure logical function kept(self, node)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node

    kept = self%is_kept(node) .and. self%work%first(node) > 0 .and. self%law%tape%node(node)%operation >= op_fixed
  end function kept

  !> Writes the members of the work space.
  subroutine declare_work(self, states, code)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: states(:)   !! nodes of the internal states, or 0
    type(code_text_t), intent(inout) :: code
    integer :: i

    do i = 1, size(states)
      if (states(i) > 0) call code%line('  vd ' // member(self, states(i)) // '[' // to_text(self%law%elements) // '][P + 1];')
    end do
    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i))
        if (self%kept(number)) call code%line('  vd ' // member(self, number) // '[' // to_text(self%law%elements) // '][P + 1];')
        if (self%law%tape%node(number)%operation /= op_harmonics) cycle
        call code%line('  harmonic_work ' // member(self, number) // 'h[' // to_text(self%law%elements) // '];')
      end associate
    end do
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

  pure integer function terms_of(node)
    type(law_node_t), intent(in) :: node

    terms_of = (node%last - node%first + 1) / 3
  end function terms_of

  !> Name of the member of the work space of a node.
  function member(self, node) result(text)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node
    character(len=:), allocatable :: text

    text = 'b' // to_text(self%bank) // 'n' // to_text(node)
  end function member

  !> Coefficient k of a node.
  function operand(self, node) result(text)
    class(law_code_t), intent(in) :: self
    integer, intent(in) :: node
    character(len=:), allocatable :: text

    text = 'n' // to_text(node)
    if (self%is_kept(node) .or. self%law%tape%node(node)%operation < op_fixed) text = text // '[k]'
  end function operand

  !> Writes the statements that compute the variables; the inputs n1[], n2[], ... are there.
  subroutine write_nodes(self, code)
    class(law_code_t), intent(in) :: self
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable :: name, value
    integer :: i

    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i), node => self%law%tape%node(self%work%nodes(i)))
        if (self%kept(number)) call code%line('    vd *n' // to_text(number) // ' = z->' // member(self, number) // '[i];')
      end associate
    end do
    do i = 1, size(self%work%nodes)
      associate (number => self%work%nodes(i), node => self%law%tape%node(self%work%nodes(i)))
        value = value_of(self, number, node)
        name = self%operand(number)
        if (node%operation == op_wave) then
          call code%line('    ' // value // ';')
        else if (self%kept(number)) then
          if (node%degree < unlimited) name = 'if (k <= ' // to_text(node%degree) // ') ' // name
          call code%line('    ' // name // ' = ' // value // ';')
        else if (node%degree < unlimited) then
          call code%line('    const vd ' // name // ' = k > ' // to_text(node%degree) // ' ? (vd){} : ' // value // ';')
        else
          call code%line('    const vd ' // name // ' = ' // value // ';')
        end if
      end associate
    end do
  end subroutine write_nodes

  !> The expression of a node.
  function value_of(self, number, node) result(text)
    type(law_code_t), intent(in) :: self
    integer, intent(in) :: number
    type(law_node_t), intent(in) :: node
    character(len=:), allocatable :: text
    character(len=:), allocatable :: a, argument, b, degree
    integer :: terms

    argument = 'n' // to_text(node%a)
    a = ''
    b = ''
    degree = ''
    if (node%a > 0) degree = to_text(self%law%tape%node(node%a)%degree)
    select case (node%operation)
    case (op_fixed)
      text = 'k == 0 ? ' // constant(self, node%a) // ' : (vd){}'
    case (op_add, op_subtract)
      text = self%operand(node%a) // merge(' + ', ' - ', node%operation == op_add) // self%operand(node%b)
    case (op_shift)
      a = self%operand(node%a)
      text = 'k == 0 ? ' // a // ' + ' // constant(self, node%b) // ' : ' // a
    case (op_scale)
      text = constant(self, node%b) // ' * ' // self%operand(node%a)
    case (op_multiply)
      text = 'multiply(k, ' // argument // ', n' // to_text(node%b) // ')'
    case (op_reciprocal)
      text = 'reciprocal(k, ' // argument // ', n' // to_text(number) // ')'
    case (op_wave)
      text = 'wave(f, k, ' // argument // ', ' // constant(self, node%b) // ', n' // to_text(number) // ')'
    case (op_sine)
      b = argument
      if (self%work%first(min(number + 1, size(self%work%first))) > 0) b = 'n' // to_text(number + 1)
      text = 'sine(f, k, ' // degree // ', ' // argument // ', ' // b // ', n' // to_text(number) // ')'
    case (op_cosine)
      text = 'cosine(f, k, ' // degree // ', ' // argument // ', n' // to_text(number - 1) // ')'
    case (op_tanh)
      text = 'hyperbolic_tangent(k, ' // degree // ', ' // argument // ', n' // to_text(number + 1) // ')'
    case (op_sech_squared)
      text = 'sech_squared(k, n' // to_text(number - 1) // ')'
    case (op_exponential)
      text = 'exponential(k, ' // degree // ', ' // argument // ', n' // to_text(number) // ')'
    case (op_square_root)
      text = 'square_root(k, ' // argument // ', n' // to_text(number) // ')'
    case (op_log_cosh)
      text = 'log_cosh(f, k, ' // degree // ', ' // argument // ', n' // to_text(node%b) // ')'
    case (op_logarithm)
      text = 'logarithm(f, k, ' // argument // ', n' // to_text(number) // ')'
    case (op_power)
      text = 'power(f, k, ' // argument // ', ' // constant(self, node%b) // ', n' // to_text(number) // ')'
    case (op_arctangent)
      text = 'arctangent(f, k, ' // argument // ', n' // to_text(node%b) // ', n' // to_text(number) // ')'
    case default   ! op_harmonics
      terms = terms_of(node)
      text = 'harmonics(f, k, ' // to_text(terms) // ', ' // member(self, number) // 'n, ' // member(self, number) // &
             'f, s->stacked[' // to_text(self%bank) // '] + ' // to_text(2 * terms_before(self, number)) // ' * s->slots[' // &
             to_text(self%bank) // '] + (W * ' // to_text(2 * terms) // ') * (' // to_text(self%law%elements) // &
             ' * s->strip + i), ' // argument // ', &z->' // member(self, number) // 'h[i])'
    end select
  end function value_of

  !> Terms of the harmonics before a node in `stacked`.
  pure integer function terms_before(self, number) result(terms)
    type(law_code_t), intent(in) :: self
    integer, intent(in) :: number
    integer :: i

    terms = 0
    do i = 1, number - 1
      if (self%law%tape%node(i)%operation == op_harmonics) terms = terms + terms_of(self%law%tape%node(i))
    end do
  end function terms_before

  !> A constant of element i.
  function constant(self, node) result(text)
    type(law_code_t), intent(in) :: self
    integer, intent(in) :: node
    character(len=:), allocatable :: text

    text = 'load(s->constant[' // to_text(self%bank) // '] + ' // to_text(self%law%column(node) - 1) // ' * s->slots[' // &
           to_text(self%bank) // '] + W * i)'
  end function constant

end module nocdyn_law_code
