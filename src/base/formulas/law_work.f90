!> Work space in which the list of a law is carried out: the Taylor coefficients of its variables, up to an order.
module nocdyn_law_work
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_tape_t, op_fixed, op_harmonics, op_wave
  implicit none (type, external)
  private

  public :: new_law_work, harmonic_work, harmonic_factors

  !> The first columns of the work space of a group; those from the fourth on are H_1 = B_1 + d^4 H_2, H_2 and so on.
  integer, parameter, public :: derivatives = 0, second = 1, third = 2, fourth = 3

  integer, parameter, public :: most_terms = 64   !! of a part of a sum; longer sums have several parts

  !> The coefficients of a variable are the part [w, 0:order, groups] of `pool` that begins with its `first`.
  type, public :: law_work_t
    integer :: order = -1                   !! of the last coefficient; -1: there is no work space
    integer :: w = 0                        !! numbers of a group
    integer :: groups = 0
    integer, allocatable :: nodes(:)        !! variables that are computed, ascending
    integer, allocatable :: later(:)        !! variables whose coefficients from the second on are computed one by one
    integer, allocatable :: first(:)        !! of each node; 0 for constants, and for variables that are not needed
    integer, allocatable :: work_first(:)   !! of the work space of harmonics, which follows
    integer, allocatable :: table_first(:)  !! of the factors of harmonics in `table`
    real(wp), allocatable :: pool(:), table(:)
  contains
    procedure :: address
  end type law_work_t

contains

  !> Work space for some nodes. Coefficients that are never computed are zero.
  function new_law_work(tape, nodes, order, w, groups) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: nodes(:)   !! variables, ascending
    integer, intent(in) :: order      !! of the last coefficient
    integer, intent(in) :: w, groups  !! numbers of a group, groups
    type(law_work_t) :: self
    integer :: i, length, next

    self%order = order
    self%w = w
    self%groups = groups
    allocate (self%nodes, source=pack(nodes, [(tape%node(nodes(i))%operation >= op_fixed, i=1, size(nodes))]))
    allocate (self%later, source=pack(self%nodes, [(tape%node(self%nodes(i))%degree > 1 .and. &
                                                    tape%node(self%nodes(i))%operation /= op_wave, i=1, size(self%nodes))]))
    allocate (self%first(tape%count), self%work_first(tape%count), self%table_first(tape%count), source=0)
    allocate (self%table(0))
    length = w * (order + 1) * groups
    next = 0
    do i = 1, size(nodes)
      self%first(nodes(i)) = next + 1
      next = next + length
      self%work_first(nodes(i)) = next + 1
      associate (node => tape%node(nodes(i)))
        if (node%operation /= op_harmonics) cycle
        next = next + harmonic_work(order) * length
        self%table_first(nodes(i)) = size(self%table) + 1
        associate (last => node%first + (node%last - node%first + 1) / 3 - 1)   ! of the multiples
          self%table = [self%table, harmonic_factors(order, tape%list(node%first:last))]
        end associate
      end associate
    end do
    allocate (self%pool(next), source=0.0_wp)
  end function new_law_work

  !> Where coefficient k of group g of a node begins in `pool`.
  pure integer function address(self, node, k, g)
    class(law_work_t), intent(in) :: self
    integer, intent(in) :: node, k, g

    address = self%first(node) + self%w * (k + (self%order + 1) * (g - 1))
  end function address

  !> Columns [w, 0:order] of work space that each group needs.
  pure integer function harmonic_work(order)
    integer, intent(in) :: order

    harmonic_work = 0
    if (order > 0) harmonic_work = 4 + order / 4
  end function harmonic_work

  !> The factors n^j / j! of derivatives, with the signs of a sine's derivatives.
  pure function harmonic_factors(order, n) result(factors)
    integer, intent(in) :: order, n(:)
    real(wp) :: factors(size(n), 0:order)
    integer :: j

    factors(:, 0) = 1.0_wp
    do j = 1, order
      factors(:, j) = merge(1.0_wp, -1.0_wp, modulo(j, 2) == 1) * factors(:, j - 1) * n / j
    end do
  end function harmonic_factors

end module nocdyn_law_work
