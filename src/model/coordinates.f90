!> The independent coordinates of a machine: L_tau and the operators that follow from it, sparse, on blocks of lanes.
!>
!> A body moves only with the coordinates of its own group of geared bodies: omega(b) is the sum of
!> ratio * q'(coordinate) over the entries first(b) to first(b + 1) - 1. With the same entries,
!> q'' = (L_tau^T J L_tau)^-1 L_tau^T T is the sum of response * T(b).
module nocdyn_coordinates
  use nocdyn_complement, only: complement_factor, natural_complement
  use nocdyn_constraints, only: constraints_t
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse, solve_positive_definite
  implicit none (type, external)
  private

  public :: new_coordinates

  !> The reactions of a group's rows, as linear maps. The lane comes last: a matrix product of strided slices may round
  !> otherwise than one of contiguous ones, and a lane must not depend on its neighbours.
  type, public :: reaction_block_t
    integer, allocatable :: bodies(:), rows(:), kept(:)
    real(wp), allocatable :: of_torques(:, :, :)      !! from the torques T of the elements, [rows, bodies, lanes]
    real(wp), allocatable :: of_imbalances(:, :, :)   !! from J omega' - T, [rows, bodies, lanes]
    real(wp), allocatable :: of_kept(:, :, :)         !! from the reactions of `kept`, [rows, kept, lanes]
  end type reaction_block_t

  type, public :: coordinates_t
    integer :: freedoms = 0                    !! length of q
    integer, allocatable :: body(:)            !! independent body of each coordinate, [freedoms]
    integer, allocatable :: first(:)           !! [bodies + 1]
    integer, allocatable :: coordinate(:)      !! [entries]
    real(wp), allocatable :: ratio(:, :)       !! nonzero blocks of L_tau, [lanes, entries]
    real(wp), allocatable :: response(:, :)    !! those of ((L_tau^T J L_tau)^-1 L_tau^T)^T, [lanes, entries]
    type(reaction_block_t), allocatable :: blocks(:)      !! one for each group with rows
  contains
    procedure :: complement
    procedure :: mobility
    procedure :: project
    procedure :: reactions_of_torques
    procedure :: reactions_of_imbalances
  end type coordinates_t

contains

  !> Builds the operators group by group, by LAPACK on the dense block of each group.
  function new_coordinates(constraints, groups, inertia, wanted, choice) result(self)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: groups(:)   !! analysed
    real(wp), intent(in) :: inertia(:, :)           !! [lanes, bodies] [kg m2]
    integer, intent(in) :: wanted(:)                !! order of the coordinates as bodies; empty: ascending bodies
    integer, intent(in) :: choice                   !! complement_...
    type(coordinates_t) :: self
    integer :: first_coordinate(size(inertia, 2))
    integer :: g, lane

    call number_coordinates(groups, wanted, self, first_coordinate)
    call lay_out_entries(groups, first_coordinate, size(inertia, 2), size(inertia, 1), self)
    allocate (self%blocks(count([(size(groups(g)%rows) > 0, g=1, size(groups))])))
    call lay_out_reactions(groups, size(inertia, 1), self%blocks)
    do lane = 1, size(inertia, 1)
      call fill_lane(constraints, groups, inertia(lane, :), choice, lane, self)
    end do
  end function new_coordinates

  !> Gives every independent body its coordinate.
  subroutine number_coordinates(groups, wanted, self, coordinate_of)
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: wanted(:)
    type(coordinates_t), intent(inout) :: self
    integer, intent(out) :: coordinate_of(:)   !! [bodies], 0 for dependent bodies
    integer :: b, g, k

    coordinate_of = 0
    do g = 1, size(groups)
      coordinate_of(groups(g)%independent) = 1
    end do
    if (size(wanted) > 0) then
      self%body = wanted
    else
      self%body = pack([(b, b=1, size(coordinate_of))], coordinate_of == 1)
    end if
    self%freedoms = size(self%body)
    coordinate_of(self%body) = [(k, k=1, self%freedoms)]
  end subroutine number_coordinates

  !> Every body has one entry for each coordinate of its group.
  subroutine lay_out_entries(groups, coordinate_of, bodies, lanes, self)
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: coordinate_of(:), bodies, lanes
    type(coordinates_t), intent(inout) :: self
    integer :: group_of(bodies)
    integer :: b, g

    do g = 1, size(groups)
      group_of(groups(g)%bodies) = g
    end do
    allocate (self%first(bodies + 1))
    self%first(1) = 1
    do b = 1, bodies
      self%first(b + 1) = self%first(b) + size(groups(group_of(b))%independent)
    end do
    allocate (self%coordinate(self%first(bodies + 1) - 1))
    do b = 1, bodies
      self%coordinate(self%first(b):self%first(b + 1) - 1) = coordinate_of(groups(group_of(b))%independent)
    end do
    allocate (self%ratio(lanes, size(self%coordinate)), source=0.0_wp)
    allocate (self%response, source=self%ratio)
  end subroutine lay_out_entries

  subroutine lay_out_reactions(groups, lanes, reactions)
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: lanes
    type(reaction_block_t), intent(inout) :: reactions(:)
    integer :: g, k

    k = 0
    do g = 1, size(groups)
      if (size(groups(g)%rows) == 0) cycle
      k = k + 1
      reactions(k)%bodies = groups(g)%bodies
      reactions(k)%rows = groups(g)%rows
      reactions(k)%kept = groups(g)%kept
      allocate (reactions(k)%of_torques(size(groups(g)%rows), size(groups(g)%bodies), lanes), source=0.0_wp)
      allocate (reactions(k)%of_imbalances, source=reactions(k)%of_torques)
      allocate (reactions(k)%of_kept(size(groups(g)%rows), size(groups(g)%kept), lanes), source=0.0_wp)
    end do
  end subroutine lay_out_reactions

  subroutine fill_lane(constraints, groups, inertia, choice, lane, self)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: groups(:)
    real(wp), intent(in) :: inertia(:)
    integer, intent(in) :: choice, lane
    type(coordinates_t), intent(inout) :: self
    real(wp), allocatable :: complement(:, :), dual(:, :)
    integer :: g, k

    k = 0
    do g = 1, size(groups)
      call group_complement(constraints, groups(g), choice, lane, complement, dual)
      call fill_entries(groups(g)%bodies, inertia(groups(g)%bodies), complement, lane, self)
      if (size(groups(g)%rows) == 0) cycle
      k = k + 1
      call fill_reactions(reaction_share(constraints, groups(g), lane), transpose(dual), inertia(groups(g)%bodies), &
                          complement, lane, self, self%blocks(k))
    end do
  end subroutine fill_lane

  !> lambda = D^T (J omega' - T), shared out over all rows; with omega' = L_tau q'' it is linear in T alone.
  subroutine fill_reactions(share, dual, inertia, complement, lane, self, block)
    real(wp), intent(in) :: share(:, :), dual(:, :), inertia(:), complement(:, :)
    integer, intent(in) :: lane
    type(coordinates_t), intent(in) :: self
    type(reaction_block_t), intent(inout) :: block
    real(wp) :: imbalance(size(inertia), size(inertia))   ! J L_tau (L_tau^T J L_tau)^-1 L_tau^T - 1
    real(wp) :: response(size(complement, 2))
    integer :: b, k

    do b = 1, size(inertia)
      k = self%first(block%bodies(b))
      response = self%response(lane, k:k + size(response) - 1)
      imbalance(:, b) = inertia * matmul(complement, response)
      imbalance(b, b) = imbalance(b, b) - 1.0_wp
    end do
    block%of_kept(:, :, lane) = share
    block%of_imbalances(:, :, lane) = matmul(share, dual)
    block%of_torques(:, :, lane) = matmul(block%of_imbalances(:, :, lane), imbalance)
  end subroutine fill_reactions

  !> Eq. (81) or section 6 for one group.
  subroutine group_complement(constraints, group, choice, lane, complement, dual)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: choice, lane
    real(wp), allocatable, intent(out) :: complement(:, :), dual(:, :)
    real(wp) :: log_determinant
    integer :: i, columns(size(group%independent))
    logical :: is_singular

    columns = [(findloc(group%bodies, group%independent(i), dim=1), i=1, size(columns))]
    call natural_complement(constraints%block(lane, group%kept, group%bodies), columns, &
                            complement, dual, log_determinant, is_singular)
    if (is_singular) error stop 'nocdyn_coordinates: the groups must have been analysed'
    complement = complement * complement_factor(choice, log_determinant, size(group%kept))
  end subroutine group_complement

  !> L_tau of the group, and its response from the mass matrix L_tau^T J L_tau, factored once.
  subroutine fill_entries(bodies, inertia, complement, lane, self)
    integer, intent(in) :: bodies(:)
    real(wp), intent(in) :: inertia(:)         !! of `bodies`
    real(wp), intent(in) :: complement(:, :)   !! [bodies, coordinates of the group]
    integer, intent(in) :: lane
    type(coordinates_t), intent(inout) :: self
    real(wp), allocatable :: response(:, :)
    real(wp) :: momentum(size(complement, 1), size(complement, 2))
    integer :: i, k
    logical :: is_indefinite

    do k = 1, size(complement, 2)
      momentum(:, k) = inertia * complement(:, k)
    end do
    call solve_positive_definite(matmul(transpose(complement), momentum), transpose(complement), response, is_indefinite)
    if (is_indefinite) error stop 'nocdyn_coordinates: inertias must be positive'
    do i = 1, size(bodies)
      k = self%first(bodies(i))
      self%ratio(lane, k:k + size(complement, 2) - 1) = complement(i, :)
      self%response(lane, k:k + size(complement, 2) - 1) = response(:, i)
    end do
  end subroutine fill_entries

  !> The reactions of all rows of smallest norm that do what those of the kept rows do; the identity if none is redundant.
  function reaction_share(constraints, group, lane) result(share)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: lane
    real(wp) :: share(size(group%rows), size(group%kept))
    real(wp), parameter :: singular = 1.0e-10_wp   ! as the rank tolerance of the analysis
    integer :: i

    if (size(group%rows) == size(group%kept)) then
      share = 0.0_wp
      do i = 1, size(group%rows)
        share(i, i) = 1.0_wp
      end do
    else
      share = matmul(pseudo_inverse(transpose(constraints%block(lane, group%rows, group%bodies)), singular), &
                     transpose(constraints%block(lane, group%kept, group%bodies)))
    end if
  end function reaction_share

  !> L_tau as a dense matrix [bodies, freedoms], for the paper's matrices and for tests.
  pure function complement(self, lane) result(dense)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp) :: dense(size(self%first) - 1, self%freedoms)
    integer :: b, k

    dense = 0.0_wp
    do b = 1, size(dense, 1)
      do k = self%first(b), self%first(b + 1) - 1
        dense(b, self%coordinate(k)) = self%ratio(lane, k)
      end do
    end do
  end function complement

  !> L_tau (L_tau^T J L_tau)^-1 L_tau^T: the accelerations omega' from the torques T, [bodies, bodies].
  pure function mobility(self, lane) result(matrix)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp) :: matrix(size(self%first) - 1, size(self%first) - 1)
    real(wp) :: response(self%freedoms)
    integer :: b

    do b = 1, size(matrix, 2)
      response = 0.0_wp
      response(self%coordinate(self%first(b):self%first(b + 1) - 1)) = &
        self%response(lane, self%first(b):self%first(b + 1) - 1)
      matrix(:, b) = matmul(self%complement(lane), response)
    end do
  end function mobility

  !> Coordinate speeds q' of body speeds that obey the constraints.
  pure subroutine project(self, lane, inertia, omega, speed)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: inertia(:), omega(:)   !! [bodies]
    real(wp), intent(out) :: speed(:)              !! [freedoms]; mass-weighted projection if omega breaks a constraint
    integer :: b, k

    speed = 0.0_wp
    do b = 1, size(omega)
      do k = self%first(b), self%first(b + 1) - 1
        speed(self%coordinate(k)) = speed(self%coordinate(k)) + self%response(lane, k) * inertia(b) * omega(b)
      end do
    end do
  end subroutine project

  !> Reactions of all rows from the torques of the elements, where the bodies move as the coordinates say.
  pure subroutine reactions_of_torques(self, lane, torque, lambda)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: torque(:)     !! T [N m], shape [bodies]
    real(wp), intent(inout) :: lambda(:)  !! [rows]
    integer :: g

    do g = 1, size(self%blocks)
      associate (block => self%blocks(g))
        call apply(block%of_torques(:, :, lane), block%bodies, torque, block%rows, lambda)
      end associate
    end do
  end subroutine reactions_of_torques

  !> Reactions of all rows from eq. (12), L_lambda^T lambda = J omega' - T, with accelerations found elsewhere.
  pure subroutine reactions_of_imbalances(self, lane, imbalance, lambda)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: imbalance(:)   !! J omega' - T [N m], shape [bodies]
    real(wp), intent(inout) :: lambda(:)   !! [rows]
    integer :: g

    do g = 1, size(self%blocks)
      associate (block => self%blocks(g))
        call apply(block%of_imbalances(:, :, lane), block%bodies, imbalance, block%rows, lambda)
      end associate
    end do
  end subroutine reactions_of_imbalances

  !> y(rows) = map x(columns), without temporary arrays.
  pure subroutine apply(map, columns, x, rows, y)
    real(wp), contiguous, intent(in) :: map(:, :)
    integer, intent(in) :: columns(:)
    real(wp), intent(in) :: x(:)
    integer, intent(in) :: rows(:)
    real(wp), intent(inout) :: y(:)
    integer :: i, j

    y(rows) = 0.0_wp
    do j = 1, size(columns)
      do i = 1, size(rows)
        y(rows(i)) = y(rows(i)) + map(i, j) * x(columns(j))
      end do
    end do
  end subroutine apply

end module nocdyn_coordinates
