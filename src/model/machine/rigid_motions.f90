!> The rigid motions of a machine, which twist no elastic element: a basis of the null space of the map from the speeds of the
!> coordinates to the rates of twist of the elastic elements.
!>
!> The rows of the map are eliminated one after the other, each at its highest coordinate, which becomes a combination of lower
!> ones. A chain of n bodies takes time linear in n.
!>
!> Where drives turn bodies, elements turn while all coordinates stand still. The coordinates then have a drift, with which the
!> elements do not turn; it is found by the same elimination, in which a clock is coordinate 0.
module nocdyn_rigid_motions
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_rigid_motions

  !> The speed of a coordinate as a combination of others: the sum of ratio * q'(of).
  type :: linear_combination_t
    integer, allocatable :: of(:)
    real(wp), allocatable :: ratio(:)
  end type linear_combination_t

  !> q'(c) is the sum of ratio * s(freedom) over the entries first(c) to first(c + 1) - 1, with the speeds s of the rigid motions.
  type, public :: rigid_motions_t
    integer, allocatable :: free(:)      !! coordinate whose speed is s, [freedoms]
    integer, allocatable :: first(:)     !! first entry of each coordinate, [coordinates + 1]
    integer, allocatable :: freedom(:)   !! rigid motion, [entries]
    real(wp), allocatable :: ratio(:)    !! [entries]
    real(wp), allocatable :: drift(:)    !! speeds q' where all s are zero; all are zero without drives [rad/s], [coordinates]
    integer :: contradiction = 0         !! an element that turns whatever the coordinates do, numbered in `elastic`; 0: none
  contains
    procedure :: combine, speeds, project_torques
  end type rigid_motions_t

  !> A sparse row during the elimination.
  type :: row_t
    integer, allocatable :: active(:)   !! coordinates with an entry, the first `used` of them; 0 is the clock
    integer :: used = 0
    real(wp), allocatable :: value(:)   !! [0:coordinates]
    real(wp), allocatable :: scale(:)   !! sum of the absolute terms of `value`, [0:coordinates]
    logical, allocatable :: is_active(:)
  end type row_t

  real(wp), parameter :: rounding = 1.0e-10_wp   ! a sum is zero below this share of its terms, as in the constraints

contains

  !> The rigid motions of a machine.
  type(rigid_motions_t) function new_rigid_motions(freedoms, incidence, elastic, offset) result(self)
    integer, intent(in) :: freedoms                        !! number of coordinates
    type(element_coordinates_t), intent(in) :: incidence   !! twists of the elements by coordinates; the first lane is used
    integer, intent(in) :: elastic(:)                      !! elements that must not be twisted
    real(wp), intent(in), optional :: offset(:)            !! rates of all elements while the coordinates stand still [rad/s],
                                                           !! [elements]; absent: zero
    type(linear_combination_t) :: definition(0:freedoms)
    type(row_t) :: row
    integer, allocatable :: left(:)
    integer :: c, e, freedom_of(freedoms), i, k

    allocate (row%active(freedoms + 1), row%value(0:freedoms), row%scale(0:freedoms), row%is_active(0:freedoms))
    allocate (self%drift(freedoms), source=0.0_wp)
    row%is_active = .false.
    do e = 1, size(elastic)
      do k = incidence%first(elastic(e)), incidence%first(elastic(e) + 1) - 1
        call add(row, incidence%coordinate(k), incidence%ratio(1, k), abs(incidence%ratio(1, k)))
      end do
      if (present(offset)) call add(row, 0, offset(elastic(e)), abs(offset(elastic(e))))
      call substitute(row, definition, left)
      if (size(left) == 0) cycle
      c = maxval(left)
      if (c == 0) then
        if (self%contradiction == 0) self%contradiction = e
        cycle
      end if
      left = pack(left, left /= c)
      definition(c)%of = left
      definition(c)%ratio = -row%value(left) / row%value(c)
    end do
    self%free = pack([(c, c=1, freedoms)], [(.not. allocated(definition(c)%of), c=1, freedoms)])
    freedom_of(self%free) = [(i, i=1, size(self%free))]
    do c = 1, freedoms
      if (.not. allocated(definition(c)%of)) cycle
      call add(row, c, 1.0_wp, 1.0_wp)
      call substitute(row, definition, left)
      definition(c)%of = left
      definition(c)%ratio = row%value(left)
    end do
    do c = 1, freedoms
      if (.not. allocated(definition(c)%of)) cycle
      self%drift(c) = sum(definition(c)%ratio, mask=definition(c)%of == 0)
      definition(c)%ratio = pack(definition(c)%ratio, definition(c)%of > 0)
      definition(c)%of = pack(definition(c)%of, definition(c)%of > 0)
    end do
    do i = 1, size(self%free)
      definition(self%free(i))%of = [self%free(i)]
      definition(self%free(i))%ratio = [1.0_wp]
    end do
    allocate (self%first(freedoms + 1))
    self%first(1) = 1
    do c = 1, freedoms
      self%first(c + 1) = self%first(c) + size(definition(c)%of)
    end do
    self%freedom = [(freedom_of(definition(c)%of), c=1, freedoms)]
    self%ratio = [(definition(c)%ratio, c=1, freedoms)]
  end function new_rigid_motions

  !> Adds a term to an entry of a row.
  pure subroutine add(row, coordinate, value, scale)
    type(row_t), intent(inout) :: row
    integer, intent(in) :: coordinate
    real(wp), intent(in) :: value, scale   !! the term, and the sum of its absolute parts

    if (.not. row%is_active(coordinate)) then
      row%used = row%used + 1
      row%active(row%used) = coordinate
      row%is_active(coordinate) = .true.
      row%value(coordinate) = 0.0_wp
      row%scale(coordinate) = 0.0_wp
    end if
    row%value(coordinate) = row%value(coordinate) + value
    row%scale(coordinate) = row%scale(coordinate) + scale
  end subroutine add

  !> Replaces the eliminated coordinates of a row by the coordinates of their definitions, and ends the row: its values stay until
  !> the next `add`.
  pure subroutine substitute(row, definition, left)
    type(row_t), intent(inout) :: row
    type(linear_combination_t), intent(in) :: definition(0:)
    integer, allocatable, intent(out) :: left(:)   ! coordinates of the row whose sums are not rounding
    integer :: c, i, position
    real(wp) :: scale, value

    position = 1
    do while (position <= row%used)
      c = row%active(position)
      if (.not. allocated(definition(c)%of)) then
        position = position + 1
        cycle
      end if
      value = row%value(c)
      scale = row%scale(c)
      row%is_active(c) = .false.
      row%active(position) = row%active(row%used)
      row%used = row%used - 1
      do i = 1, size(definition(c)%of)
        call add(row, definition(c)%of(i), definition(c)%ratio(i) * value, abs(definition(c)%ratio(i)) * scale)
      end do
      position = 1
    end do
    associate (active => row%active(:row%used))
      left = pack(active, abs(row%value(active)) > rounding * row%scale(active))
      row%is_active(active) = .false.
    end associate
    row%used = 0
  end subroutine substitute

  !> Speeds q' of all coordinates, [coordinates].
  pure function speeds(self, s) result(q_rate)
    class(rigid_motions_t), intent(in) :: self
    real(wp), intent(in) :: s(:)   !! speeds of the rigid motions, [freedoms]
    real(wp) :: q_rate(size(self%first) - 1)

    call self%combine(self%ratio, s, q_rate)
  end function speeds

  !> Coordinates as combinations of the rigid motions, with the given ratios in place of the stored ones.
  pure subroutine combine(self, ratio, s, q)
    class(rigid_motions_t), intent(in) :: self
    real(wp), intent(in) :: ratio(:)     !! [entries]
    real(wp), intent(in) :: s(:)         !! of the rigid motions, speeds or angles, [freedoms]
    real(wp), intent(inout) :: q(:)      !! of the coordinates, [coordinates]
    integer :: c, k

    do c = 1, size(q)
      q(c) = 0.0_wp
      do k = self%first(c), self%first(c + 1) - 1
        q(c) = q(c) + ratio(k) * s(self%freedom(k))
      end do
    end do
  end subroutine combine

  !> Torques along the rigid motions from torques along the coordinates: the transpose of `speeds`, [freedoms].
  pure function project_torques(self, torque) result(total)
    class(rigid_motions_t), intent(in) :: self
    real(wp), intent(in) :: torque(:)   !! [N m], [coordinates]
    real(wp) :: total(size(self%free))
    integer :: c, k

    total = 0.0_wp
    do c = 1, size(torque)
      do k = self%first(c), self%first(c + 1) - 1
        total(self%freedom(k)) = total(self%freedom(k)) + self%ratio(k) * torque(c)
      end do
    end do
  end function project_torques

end module nocdyn_rigid_motions
