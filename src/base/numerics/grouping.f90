!> Groups of integers in compressed storage: the rows in the columns of a sparse matrix, the neighbours of the nodes of a graph.
module nocdyn_grouping
  implicit none (type, external)
  private

  public :: grouped

  !> Group g has the members member(start(g):start(g + 1) - 1).
  type, public :: groups_t
    integer, allocatable :: start(:)    !! [groups + 1]
    integer, allocatable :: member(:)
  end type groups_t

contains

  !> Sorts members into groups, in linear time; members of a group keep their order.
  pure function grouped(groups, group, member)
    integer, intent(in) :: groups      !! number of groups
    integer, intent(in) :: group(:)    !! group of each member, 1 to groups
    integer, intent(in) :: member(:)
    type(groups_t) :: grouped
    integer, allocatable :: next(:)
    integer :: i

    allocate (grouped%start(groups + 1), source=0)
    do i = 1, size(group)
      grouped%start(group(i) + 1) = grouped%start(group(i) + 1) + 1
    end do
    grouped%start(1) = 1
    do i = 1, groups
      grouped%start(i + 1) = grouped%start(i) + grouped%start(i + 1)
    end do
    allocate (next, source=grouped%start)
    allocate (grouped%member(size(group)))
    do i = 1, size(group)
      grouped%member(next(group(i))) = member(i)
      next(group(i)) = next(group(i)) + 1
    end do
  end function grouped

end module nocdyn_grouping
