!> The bodies of a machine in groups that are geared together; each is analysed for itself.
module nocdyn_geared_groups
  use nocdyn_constraints, only: constraints_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: find_groups

  !> A row that other rows already imply; its own reaction is not unique.
  type, public :: redundancy_t
    integer :: row
    integer, allocatable :: repeats(:)   !! the earlier rows of which it is a combination
  end type redundancy_t

  !> Bodies joined by constraints, directly or through others; a free body is a group of its own.
  type, public :: geared_group_t
    integer, allocatable :: bodies(:)        !! ascending
    real(wp), allocatable :: pace(:)         !! size of the speeds of `bodies` when they turn together, the first of them at 1
    integer, allocatable :: rows(:)          !! all constraint rows of the group, ascending
    integer, allocatable :: kept(:)          !! the independent ones among them
    integer, allocatable :: independent(:)   !! bodies whose speeds are the group's coordinates
    type(redundancy_t), allocatable :: redundancies(:)
  end type geared_group_t

contains

  !> Connected components of the bodies under the constraint rows, in the order of their first body.
  subroutine find_groups(constraints, groups)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), allocatable, intent(out) :: groups(:)
    integer :: root(constraints%bodies), group_of(constraints%bodies), bodies(constraints%bodies), rows(constraints%rows())
    integer :: b, g, r

    root = component_roots(constraints)
    group_of = 0
    g = 0
    do b = 1, constraints%bodies
      if (root(b) /= b) cycle
      g = g + 1
      group_of(b) = g
    end do
    group_of = group_of(root)
    bodies = sorted_by_group(group_of, g)
    rows = sorted_by_group([(group_of(constraints%body(constraints%first(r))), r=1, constraints%rows())], g)
    allocate (groups(g))
    call distribute(bodies, rows, group_of, constraints, groups)
    do g = 1, size(groups)
      groups(g)%pace = paces(constraints, groups(g)%bodies, groups(g)%rows)
    end do
  end subroutine find_groups

  !> Speeds that make the terms of a row alike, carried from body to body: the measure of what is small.
  pure function paces(constraints, bodies, rows) result(pace)
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: bodies(:), rows(:)
    real(wp) :: pace(size(bodies))
    real(wp) :: known(constraints%bodies), term   ! 0: not known yet; of `bodies` alone
    integer :: entry, i

    known(bodies) = 0.0_wp
    known(bodies(1)) = 1.0_wp
    do while (any(known(bodies) <= 0.0_wp))
      do i = 1, size(rows)
        associate (first => constraints%first(rows(i)), last => constraints%first(rows(i) + 1) - 1)
          term = maxval(abs(constraints%coefficient(1, first:last)) * known(constraints%body(first:last)))
          if (term <= 0.0_wp) cycle
          do entry = first, last
            associate (body => constraints%body(entry))
              if (known(body) <= 0.0_wp) known(body) = term / abs(constraints%coefficient(1, entry))
            end associate
          end do
        end associate
      end do
    end do
    pace = known(bodies)
  end function paces

  !> Hands the bodies and rows, sorted by group, out to the groups.
  subroutine distribute(bodies, rows, group_of, constraints, groups)
    integer, intent(in) :: bodies(:), rows(:), group_of(:)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(inout) :: groups(:)
    integer :: b, g, last_body, last_row, r

    b = 1
    r = 1
    do g = 1, size(groups)
      last_body = b
      do while (last_body <= size(bodies))
        if (group_of(bodies(last_body)) /= g) exit
        last_body = last_body + 1
      end do
      last_row = r
      do while (last_row <= size(rows))
        if (group_of(constraints%body(constraints%first(rows(last_row)))) /= g) exit
        last_row = last_row + 1
      end do
      groups(g)%bodies = bodies(b:last_body - 1)
      groups(g)%rows = rows(r:last_row - 1)
      b = last_body
      r = last_row
    end do
  end subroutine distribute

  !> The smallest body of each body's component (union-find with path halving).
  pure function component_roots(constraints) result(root)
    type(constraints_t), intent(in) :: constraints
    integer :: root(constraints%bodies)
    integer :: a, b, entry, r

    root = [(b, b=1, constraints%bodies)]
    do r = 1, constraints%rows()
      do entry = constraints%first(r) + 1, constraints%first(r + 1) - 1
        a = root_of(root, constraints%body(constraints%first(r)))
        b = root_of(root, constraints%body(entry))
        root(max(a, b)) = min(a, b)
      end do
    end do
    do b = 1, constraints%bodies
      root(b) = root_of(root, b)
    end do
  end function component_roots

  pure integer function root_of(root, body)
    integer, intent(in) :: root(:), body

    root_of = body
    do while (root(root_of) /= root_of)
      root_of = root(root_of)
    end do
  end function root_of

  !> Indices 1, 2, ... in the order of their group, counting sort.
  pure function sorted_by_group(group_of, groups) result(order)
    integer, intent(in) :: group_of(:), groups
    integer :: order(size(group_of))
    integer :: next(groups + 1)
    integer :: g, i

    next = 0
    do i = 1, size(group_of)
      next(group_of(i) + 1) = next(group_of(i) + 1) + 1
    end do
    next(1) = 1
    do g = 2, groups + 1
      next(g) = next(g) + next(g - 1)
    end do
    do i = 1, size(group_of)
      order(next(group_of(i))) = i
      next(group_of(i)) = next(group_of(i)) + 1
    end do
  end function sorted_by_group

end module nocdyn_geared_groups
