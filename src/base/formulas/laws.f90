!> The law of the elements of a bank, and its values, derivatives and Taylor series on a block of lanes.
!>
!> The lanes of a block are divided into strips. The slots of a strip are the elements of its first lane to last lane, lanes
!> first: slot (e - 1) strip + l; a block of one lane is one strip whose slots are the elements. Slots beyond the last lane or
!> element are copies of the last one, so that they do what others do.
module nocdyn_laws
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_node_t, law_tape_t, op_harmonics, op_literal, op_parameter, op_pick, op_sech_squared, op_segment
  use nocdyn_law_values, only: value_of
  implicit none (type, external)
  private

  public :: new_law, strip_lanes, terms_of

  integer, parameter, public :: narrow = 8, wide = 32   !! numbers of a group

  !> One array of parameters of a bank.
  type, public :: law_parameter_t
    character(len=24) :: name
    logical :: is_key = .false.            !! whether it holds the values of the key with this name as they are
    logical :: is_set_point = .false.      !! whether it does so, of any sign, in a motion: the start follows from them too
    integer, allocatable :: element(:)     !! of each column, numbered in the bank
    real(wp), allocatable :: value(:, :)   !! in the unit of the key, [lanes, columns]
  end type law_parameter_t

  type, public :: law_t
    type(law_tape_t) :: tape
    integer :: lanes = 1, elements = 0
    integer :: strip = 1                   !! lanes of a strip, whole groups if there are several
    integer :: strips = 1
    integer :: w = narrow                   !! numbers of a group: the lanes of a strip, or some elements of one lane
    integer :: groups = 0                  !! of a strip
    integer, allocatable, private :: first_slot(:)   !! of each lane, counted through all strips
    integer, allocatable :: constants(:)   !! nodes that are constants, ascending
    integer, allocatable :: column(:)      !! of each constant in `constant`, [nodes]
    integer, allocatable :: of_branch(:)   !! columns of the constants that depend on a branch, ascending
    integer, allocatable :: stack(:)       !! where the coefficients of harmonics begin in `stacked`, [nodes]
    real(wp), allocatable :: constant(:, :)   !! values of the constants, [slots of all strips, constants]
    real(wp), allocatable :: stacked(:)    !! coefficients of harmonics, [w, terms, groups of all strips] each
  contains
    procedure :: slot, copies, refresh
  end type law_t

contains

  !> Lanes of a strip: many in small machines, which share the work of a step; few in large ones, whose numbers stay in the cache.
  pure integer function strip_lanes(lanes, elements) result(strip)
    integer, intent(in) :: lanes      !! of the block
    integer, intent(in) :: elements   !! of the machine
    integer, parameter :: small = 48   ! elements of a small machine; measured with engines and chains of 10 to 120 rotors

    strip = 1
    if (lanes == 1) return
    strip = narrow
    if (elements <= small .and. lanes > narrow) strip = wide
  end function strip_lanes

  !> The law with a list, for a block.
  function new_law(tape, lanes, elements, strip) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: lanes, elements
    integer, intent(in) :: strip   !! lanes of a strip: 1 of a block of one lane, else whole groups
    type(law_t) :: self
    integer :: i, next

    self%tape = tape
    self%lanes = lanes
    self%elements = elements
    self%strip = strip
    self%strips = (lanes + strip - 1) / strip
    self%w = max(strip, narrow)
    self%groups = (strip * elements + self%w - 1) / self%w
    self%first_slot = [((i - 1) / strip * self%w * self%groups + modulo(i - 1, strip) + 1, i=1, lanes)]
    self%constants = tape%constants()
    allocate (self%column(tape%count), self%stack(tape%count), source=0)
    self%column(self%constants) = [(i, i=1, size(self%constants))]
    self%of_branch = pack([(i, i=1, size(self%constants))], [(tape%node(self%constants(i))%has_branch, &
                                                              i=1, size(self%constants))])
    allocate (self%constant(self%w * self%groups * self%strips, size(self%constants)), source=0.0_wp)
    next = 1
    do i = 1, tape%count
      if (tape%node(i)%operation /= op_harmonics) cycle
      self%stack(i) = next
      next = next + self%w * self%groups * self%strips * 2 * terms_of(tape%node(i))
    end do
    allocate (self%stacked(next - 1), source=0.0_wp)
  end function new_law

  !> Number of terms of harmonics.
  pure integer function terms_of(node)
    type(law_node_t), intent(in) :: node

    terms_of = (node%last - node%first + 1) / 3
  end function terms_of

  !> The slot of an element in one lane, counted through all strips.
  pure integer function slot(self, lane, element)
    class(law_t), intent(in) :: self
    integer, intent(in) :: lane, element

    slot = self%first_slot(lane) + (element - 1) * self%strip
  end function slot

  !> How many slots after the slot of an element in one lane are copies of it.
  pure integer function copies(self, lane, element)
    class(law_t), intent(in) :: self
    integer, intent(in) :: lane, element

    copies = 0
    if (self%strip == 1) then
      if (element == self%elements) copies = self%w * self%groups - self%elements
    else
      if (lane == self%lanes) copies = self%strips * self%strip - self%lanes
    end if
  end function copies

  !> Computes the constants of an element in one lane, after a change of its parameters, or of a branch alone.
  subroutine refresh(self, lane, element, parameters, branch, is_branch_only, curve)
    class(law_t), intent(inout) :: self
    integer, intent(in) :: lane, element
    type(law_parameter_t), intent(in) :: parameters(:)
    integer, intent(in) :: branch(:)                !! of the switches of the element, 1 to the number of choices
    logical, intent(in) :: is_branch_only           !! whether the parameters are as before
    type(curve_t), intent(in), optional :: curve    !! of the element, on the segment branch(1)
    integer :: a, at, copies, i, k
    real(wp) :: y

    at = self%slot(lane, element)
    copies = self%copies(lane, element)
    do k = 1, merge(size(self%of_branch), size(self%constants), is_branch_only)
      i = k
      if (is_branch_only) i = self%of_branch(k)
      associate (node => self%tape%node(self%constants(i)), constant => self%constant(at, i))
        select case (node%operation)
        case (op_literal)
          constant = node%value
        case (op_parameter)
          constant = 0.0_wp
          associate (column => self%tape%list(node%first - 1 + element))
            if (column > 0) constant = parameters(node%a)%value(lane, column)
          end associate
        case (op_pick)
          constant = self%constant(at, self%column(self%tape%list(node%first - 1 + branch(node%a))))
        case (op_segment)
          constant = curve%segment_number(branch(1), node%a)
        case default
          a = merge(self%constants(i) - 1, node%a, node%operation == op_sech_squared)
          y = 0.0_wp
          if (node%b > 0) y = self%constant(at, self%column(node%b))
          constant = value_of(node%operation, self%constant(at, self%column(a)), y)
        end select
        self%constant(at + 1:at + copies, i) = constant
      end associate
    end do
    if (size(self%stacked) == 0) return
    do i = at, at + copies
      call stack_harmonics(self, i, is_branch_only)
    end do
  end subroutine refresh

  !> Copies the coefficients of harmonics in a slot to where they follow one another.
  pure subroutine stack_harmonics(self, at, is_branch_only)
    type(law_t), intent(inout) :: self
    integer, intent(in) :: at                 !! slot
    logical, intent(in) :: is_branch_only     !! whether only coefficients that depend on a branch have changed
    integer :: i, k, next

    do i = 1, self%tape%count
      if (self%stack(i) == 0) cycle
      associate (node => self%tape%node(i))
        associate (terms => terms_of(node), group => (at - 1) / self%w)
          next = self%stack(i) + self%w * 2 * terms * group + at - 1 - self%w * group
          do k = node%first + terms, node%last
            if (.not. is_branch_only .or. self%tape%node(self%tape%list(k))%has_branch) then
              self%stacked(next) = self%constant(at, self%column(self%tape%list(k)))
            end if
            next = next + self%w
          end do
        end associate
      end associate
    end do
  end subroutine stack_harmonics

end module nocdyn_laws
