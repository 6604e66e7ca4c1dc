!> The order in which the nodes of a sparse matrix are eliminated, and the elements that each of them changes: those with the
!> fewest neighbours first (minimum degree). Elements may be blocks, or vectors of numbers that are all eliminated alike.
module nocdyn_elimination
  use nocdyn_grouping, only: grouped, groups_t
  implicit none (type, external)
  private

  public :: new_node_order

  !> The elements are those of the matrix, of its transpose, of its diagonal, and those that the elimination adds.
  type, public :: node_order_t
    integer :: nodes = 0
    integer, allocatable :: row(:), column(:)        !! of each element
    integer, allocatable :: diagonal(:)              !! element of each node
    integer, allocatable :: pivot(:)                 !! nodes in the order of their elimination
    integer, allocatable :: first(:)                 !! neighbours of the k-th pivot: first(k) to first(k + 1) - 1
    integer, allocatable :: neighbour(:)             !! nodes that are left when the pivot goes
    integer, allocatable :: below(:), beside(:)      !! elements (neighbour, pivot) and (pivot, neighbour)
    integer, allocatable :: first_changed(:)         !! changed elements of the k-th pivot begin after it
    integer, allocatable :: changed(:)               !! elements (i-th neighbour, j-th neighbour), i running first
  contains
    procedure :: element
  end type node_order_t

  !> Neighbours of a node with the elements beside it.
  type :: node_neighbours_t
    integer, allocatable :: node(:), element(:)      !! elements (this node, neighbour)
    integer :: count = 0
  end type node_neighbours_t

contains

  !> Orders a matrix with elements at these positions; nodes that stay are not eliminated.
  type(node_order_t) function new_node_order(nodes, row, column, stays) result(self)
    integer, intent(in) :: nodes
    integer, intent(in) :: row(:), column(:)   !! in any order, more than once or not
    logical, intent(in) :: stays(:)            !! [nodes]
    type(groups_t) :: graph
    type(node_neighbours_t) :: list(nodes)
    integer :: i, n, rounds
    logical :: is_left(nodes)
    integer :: left(nodes)   ! neighbours that are left

    self%nodes = nodes
    allocate (self%row(0), self%column(0), self%neighbour(0), self%below(0), self%beside(0), self%changed(0))
    graph = grouped(nodes, [row, column], [column, row])
    do n = 1, nodes
      allocate (list(n)%node(4), list(n)%element(4))
      call join(self, list, n, n)
      do i = graph%start(n), graph%start(n + 1) - 1
        call join(self, list, n, graph%member(i))
      end do
    end do
    allocate (self%diagonal(nodes), self%pivot(count(.not. stays)))
    do n = 1, nodes
      self%diagonal(n) = place_in(list(n), n)
      left(n) = list(n)%count
    end do
    self%first = [1]
    self%first_changed = [0]
    is_left = .true.
    do rounds = 1, size(self%pivot)
      n = minloc(left, dim=1, mask=is_left .and. .not. stays)
      self%pivot(rounds) = n
      is_left(n) = .false.
      call eliminate(self, list, n, is_left, left)
    end do
  end function new_node_order

  !> Notes the neighbours of a pivot and what its elimination changes.
  subroutine eliminate(self, list, n, is_left, left)
    type(node_order_t), intent(inout) :: self
    type(node_neighbours_t), intent(inout) :: list(:)
    integer, intent(in) :: n
    logical, intent(in) :: is_left(:)
    integer, intent(inout) :: left(:)
    integer, allocatable :: near(:)
    integer :: i, j

    allocate (near, source=pack(list(n)%node(:list(n)%count), is_left(list(n)%node(:list(n)%count))))
    do j = 1, size(near)
      do i = 1, size(near)
        call join(self, list, near(i), near(j))
      end do
    end do
    self%neighbour = [self%neighbour, near]
    self%below = [self%below, (place_in(list(near(i)), n), i=1, size(near))]
    self%beside = [self%beside, (place_in(list(n), near(i)), i=1, size(near))]
    self%changed = [self%changed, ((place_in(list(near(i)), near(j)), i=1, size(near)), j=1, size(near))]
    self%first = [self%first, size(self%neighbour) + 1]
    self%first_changed = [self%first_changed, size(self%changed)]
    do i = 1, size(near)
      left(near(i)) = count(is_left(list(near(i))%node(:list(near(i))%count)))
    end do
  end subroutine eliminate

  !> Adds an element if it is not there.
  subroutine join(self, list, n, other)
    type(node_order_t), intent(inout) :: self
    type(node_neighbours_t), intent(inout) :: list(:)
    integer, intent(in) :: n, other

    associate (one => list(n))
      if (any(one%node(:one%count) == other)) return
      if (one%count == size(one%node)) then
        one%node = [one%node, one%node]
        one%element = [one%element, one%element]
      end if
      one%count = one%count + 1
      one%node(one%count) = other
      self%row = [self%row, n]
      self%column = [self%column, other]
      one%element(one%count) = size(self%row)
    end associate
  end subroutine join

  !> The element between a node and another, 0 if there is none.
  pure integer function place_in(one, other) result(place)
    type(node_neighbours_t), intent(in) :: one
    integer, intent(in) :: other

    place = findloc(one%node(:one%count), other, dim=1)
    if (place > 0) place = one%element(place)
  end function place_in

  !> The element at a position, 0 if there is none.
  pure integer function element(self, row, column)
    class(node_order_t), intent(in) :: self
    integer, intent(in) :: row, column

    do element = 1, size(self%row)
      if (self%row(element) == row .and. self%column(element) == column) return
    end do
    element = 0
  end function element

end module nocdyn_elimination
