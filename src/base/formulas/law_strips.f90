!> Moves numbers of elements between arrays [lanes, elements] and the slots of a strip in a work space.
module nocdyn_law_strips
  use nocdyn_kinds, only: wp
  use nocdyn_law_work, only: law_work_t
  use nocdyn_laws, only: law_t
  implicit none (type, external)
  private

  public :: load, load_lanes, fill, unload

contains

  !> Sets coefficient k of a variable in a strip. Slots beyond the last lane or element become copies of the last one.
  pure subroutine load(law, work, node, k, strip, parts, part, x)
    type(law_t), intent(in) :: law
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: node   !! of the list; if it is 0, nothing is set
    integer, intent(in) :: k, strip, parts, part
    real(wp), intent(in) :: x(law%lanes, parts, law%elements)   !! of which `part` is taken, in the unit of the variable
    integer :: at, e, g, i

    if (node == 0) return
    if (work%first(node) == 0) return
    if (law%strip == 1) then
      e = 0   ! elements before the group
      do g = 1, work%groups
        at = work%address(node, k, g) - 1
        do i = 1, min(law%w, law%elements - e)
          work%pool(at + i) = x(1, part, e + i)
        end do
        do i = i, law%w
          work%pool(at + i) = x(1, part, law%elements)
        end do
        e = e + law%w
      end do
      return
    end if
    do e = 1, law%elements
      at = work%address(node, k, e)
      do i = 1, min(law%strip, law%lanes - law%strip * (strip - 1))
        work%pool(at + i - 1) = x(law%strip * (strip - 1) + i, part, e)
      end do
      do i = i, law%strip
        work%pool(at + i - 1) = x(law%lanes, part, e)
      end do
    end do
  end subroutine load

  !> Loads numbers that all elements of a lane share.
  pure subroutine load_lanes(law, work, node, k, strip, x)
    type(law_t), intent(in) :: law
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: node   !! of the list; if it is 0, nothing is set
    integer, intent(in) :: k, strip
    real(wp), intent(in) :: x(law%lanes)   !! in the unit of the variable
    integer :: at, before, g, taken

    if (node == 0) return
    if (work%first(node) == 0) return
    before = law%strip * (strip - 1)
    taken = min(work%w, law%lanes - before)
    do g = 1, work%groups
      at = work%address(node, k, g) - 1
      work%pool(at + 1:at + taken) = x(before + 1:before + taken)
      work%pool(at + taken + 1:at + work%w) = x(law%lanes)
    end do
  end subroutine load_lanes

  !> Sets coefficient k of a variable to the same number everywhere.
  pure subroutine fill(work, node, k, x)
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: node   !! of the list; if it is 0, nothing is set
    integer, intent(in) :: k
    real(wp), intent(in) :: x   !! in the unit of the variable
    integer :: at, g

    if (node == 0) return
    if (work%first(node) == 0) return
    do g = 1, work%groups
      at = work%address(node, k, g)
      work%pool(at:at + work%w - 1) = x
    end do
  end subroutine fill

  !> Adds coefficient k of a variable in a strip.
  pure subroutine unload(law, work, node, k, strip, parts, part, x)
    type(law_t), intent(in) :: law
    type(law_work_t), intent(in) :: work
    integer, intent(in) :: node   !! of the list; if it is 0, nothing is added
    integer, intent(in) :: k, strip, parts, part
    real(wp), intent(inout) :: x(law%lanes, parts, law%elements)   !! to whose `part` it is added, in the unit of the variable
    integer :: at, e, g, i

    if (node == 0) return
    if (law%strip == 1) then
      e = 0
      do g = 1, work%groups
        at = work%address(node, k, g) - 1
        do i = 1, min(law%w, law%elements - e)
          x(1, part, e + i) = x(1, part, e + i) + work%pool(at + i)
        end do
        e = e + law%w
      end do
      return
    end if
    do e = 1, law%elements
      at = work%address(node, k, e) - 1
      associate (before => law%strip * (strip - 1))
        do i = 1, min(law%strip, law%lanes - before)
          x(before + i, part, e) = x(before + i, part, e) + work%pool(at + i)
        end do
      end associate
    end do
  end subroutine unload

end module nocdyn_law_strips
