!> Orderings that reduce the bandwidth of a sparse matrix, by the reverse Cuthill-McKee algorithm.
!>
!> E. Cuthill and J. McKee, Proc. 24th National Conference of the ACM (1969) 157-172; reversed by A. George (Stanford
!> STAN-CS-71-208, 1971); start nodes by A. George and J. W. H. Liu, ACM Trans. Math. Softw. 5 (1979) 284-295.
module nocdyn_ordering
  use nocdyn_grouping, only: grouped, groups_t
  implicit none (type, external)
  private

  public :: reverse_cuthill_mckee

  !> A breadth-first search through one connected component of a graph.
  type :: search_t
    integer, allocatable :: reached_in(:)   !! index of the last search that reached each node, 0 for none
    integer, allocatable :: reached(:)      !! nodes in the order in which they were reached
    integer :: searches = 0                 !! number of searches so far
    integer :: first = 1                    !! index of the root in `reached`
    integer :: last_level = 1               !! index in `reached` of the first node of the last level
    integer :: last = 0                     !! index in `reached` of the last node
    integer :: levels = 0
  end type search_t

contains

  !> The node at each new index, for a small bandwidth of the matrix with entries at these positions.
  pure function reverse_cuthill_mckee(nodes, row, column) result(order)
    integer, intent(in) :: nodes                !! rows of the matrix
    integer, intent(in) :: row(:), column(:)    !! of the entries, each at most once, in any order
    integer :: order(nodes)
    type(groups_t) :: double, graph
    type(groups_t) :: by_degree   ! all nodes, those with the fewest neighbours first
    type(search_t) :: search
    integer :: filled, i, node
    integer, allocatable :: seen_by(:)

    ! the graph of A + A^T without its diagonal; each neighbour occurs once
    double = grouped(nodes, [row, column], [column, row])
    allocate (graph%start(nodes + 1), graph%member(size(double%member)), seen_by(nodes), source=0)
    filled = 0
    do node = 1, nodes
      graph%start(node) = filled + 1
      seen_by(node) = node
      do i = double%start(node), double%start(node + 1) - 1
        if (seen_by(double%member(i)) == node) cycle
        seen_by(double%member(i)) = node
        filled = filled + 1
        graph%member(filled) = double%member(i)
      end do
    end do
    graph%start(nodes + 1) = filled + 1
    by_degree = grouped(nodes, graph%start(2:) - graph%start(:nodes) + 1, [(i, i=1, nodes)])
    graph = sorted_neighbours(graph, by_degree%member)
    allocate (search%reached_in(nodes), search%reached(nodes), source=0)
    do i = 1, nodes
      if (search%reached_in(by_degree%member(i)) > 0) cycle
      search%first = search%last + 1
      call search_from_periphery(graph, by_degree%member(i), search)
    end do
    order = search%reached(nodes:1:-1)
  end function reverse_cuthill_mckee

  !> The graph with the neighbours of each node in the order of `nodes`.
  pure function sorted_neighbours(graph, nodes) result(sorted)
    type(groups_t), intent(in) :: graph
    integer, intent(in) :: nodes(:)
    type(groups_t) :: sorted
    integer, allocatable :: node(:), neighbour(:)
    integer :: i, first, last, filled

    allocate (node(graph%start(size(nodes) + 1) - 1), neighbour(graph%start(size(nodes) + 1) - 1), source=0)
    filled = 0
    do i = 1, size(nodes)
      first = graph%start(nodes(i))
      last = graph%start(nodes(i) + 1) - 1
      node(filled + 1:filled + last - first + 1) = graph%member(first:last)
      neighbour(filled + 1:filled + last - first + 1) = nodes(i)
      filled = filled + last - first + 1
    end do
    sorted = grouped(size(nodes), node, neighbour)
  end function sorted_neighbours

  !> Repeats the search from the node with the fewest neighbours in the last level, until the number of levels no longer grows:
  !> the pseudo-peripheral nodes of George and Liu.
  pure subroutine search_from_periphery(graph, start, search)
    type(groups_t), intent(in) :: graph
    integer, intent(in) :: start
    type(search_t), intent(inout) :: search
    integer, allocatable :: last(:)   ! nodes in the last level
    integer :: levels

    call search_levels(graph, start, search)
    do
      levels = search%levels
      last = search%reached(search%last_level:search%last)
      call search_levels(graph, last(minloc(graph%start(last + 1) - graph%start(last), 1)), search)
      if (search%levels <= levels) exit
    end do
  end subroutine search_from_periphery

  !> The Cuthill-McKee order from a root: each node is followed by its neighbours, those with the fewest neighbours first.
  pure subroutine search_levels(graph, root, search)
    type(groups_t), intent(in) :: graph   !! neighbours sorted by their degree
    integer, intent(in) :: root
    type(search_t), intent(inout) :: search
    integer :: position, i, level_end

    search%searches = search%searches + 1
    search%levels = 0
    search%last = search%first
    search%reached(search%first) = root
    search%reached_in(root) = search%searches
    level_end = search%first - 1
    do while (level_end < search%last)
      search%last_level = level_end + 1
      level_end = search%last
      search%levels = search%levels + 1
      do position = search%last_level, level_end
        do i = graph%start(search%reached(position)), graph%start(search%reached(position) + 1) - 1
          if (search%reached_in(graph%member(i)) == search%searches) cycle
          search%reached_in(graph%member(i)) = search%searches
          search%last = search%last + 1
          search%reached(search%last) = graph%member(i)
        end do
      end do
    end do
  end subroutine search_levels

end module nocdyn_ordering
