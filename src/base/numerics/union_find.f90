!> Connected components by union-find: each member points to a member of its component, a root to itself.
module nocdyn_union_find
  implicit none (type, external)
  private

  public :: find_root, join_components

contains

  !> The root of the component of a member, with path halving.
  pure subroutine find_root(parent, member, root)
    integer, intent(inout) :: parent(:)   !! [members]; at the start parent(i) = i
    integer, intent(in) :: member
    integer, intent(out) :: root          !! smallest member of the component, if only `join_components` joins

    root = member
    do while (parent(root) /= root)
      parent(root) = parent(parent(root))
      root = parent(root)
    end do
  end subroutine find_root

  !> Joins the components of two members.
  pure subroutine join_components(one, other, parent)
    integer, intent(in) :: one, other
    integer, intent(inout) :: parent(:)   !! [members]
    integer :: a, b

    call find_root(parent, one, a)
    call find_root(parent, other, b)
    parent(max(a, b)) = min(a, b)
  end subroutine join_components

end module nocdyn_union_find
