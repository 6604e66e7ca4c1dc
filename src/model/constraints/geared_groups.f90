!> Groups of bodies that are geared together; each group is analysed separately.
module nocdyn_geared_groups
  use nocdyn_constraints, only: constraints_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_train_motion, only: elimination_t
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: find_groups

  !> A row that is a combination of other rows; its own reaction is not unique.
  type, public :: redundancy_t
    integer :: row
    integer, allocatable :: repeats(:)   !! the other rows, ascending
  end type redundancy_t

  !> Bodies joined by constraints, directly or through others. A free body is a group of its own.
  type, public :: geared_group_t
    integer, allocatable :: bodies(:)        !! ascending
    integer, allocatable :: rows(:)          !! all constraint rows of the group, ascending
    integer, allocatable :: kept(:)          !! independent rows among them
    integer, allocatable :: independent(:)   !! bodies whose speeds are the coordinates of the group
    type(redundancy_t), allocatable :: redundancies(:)
    integer, allocatable :: trains(:)    !! rigid trains of the group, ascending
    type(elimination_t) :: elimination   !! order in which its relations between trains are solved
  end type geared_group_t

contains

  !> Connected components of the bodies under the constraint rows, in the order of their first body.
  subroutine find_groups(constraints, groups, group_of)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), allocatable, intent(out) :: groups(:)
    integer, allocatable, intent(out) :: group_of(:)   !! group of each body, [bodies]
    integer :: root(constraints%bodies), bodies(constraints%bodies), rows(constraints%rows())
    integer, allocatable :: first_body(:), first_row(:)
    integer :: b, entry, g, r

    root = [(b, b=1, constraints%bodies)]
    do r = 1, constraints%rows()
      do entry = constraints%first(r) + 1, constraints%first(r + 1) - 1
        call join_components(constraints%body(constraints%first(r)), constraints%body(entry), root)
      end do
    end do
    allocate (group_of(constraints%bodies), source=0)
    g = 0
    do b = 1, constraints%bodies
      call find_root(root, b, r)   ! the smallest body of the component
      root(b) = r
      if (r /= b) cycle
      g = g + 1
      group_of(b) = g
    end do
    group_of = group_of(root)
    allocate (groups(g), first_body(g + 1), first_row(g + 1))
    call transposed_order(group_of, g, bodies, first_body)
    call transposed_order([(group_of(constraints%body(constraints%first(r))), r=1, constraints%rows())], g, rows, first_row)
    do g = 1, size(groups)
      groups(g)%bodies = bodies(first_body(g):first_body(g + 1) - 1)
      groups(g)%rows = rows(first_row(g):first_row(g + 1) - 1)
    end do
  end subroutine find_groups

end module nocdyn_geared_groups
