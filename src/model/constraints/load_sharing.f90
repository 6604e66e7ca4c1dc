!> Load sharing of redundant rows: of all reactions with the same effect on the bodies, the solution of minimum norm.
!>
!> Reactions without effect on any body are null vectors. Each redundant row has one, together with the rows that it repeats.
!> Projecting the null vectors out leaves the reactions of minimum norm. Redundancies without a common row are independent of
!> one another: parallel gears in each of thousands of stages are thousands of small problems.
module nocdyn_load_sharing
  use nocdyn_geared_groups, only: geared_group_t, redundancy_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: new_load_sharing

  !> Redundancies that have rows in common.
  type, public :: load_sharing_block_t
    type(redundancy_t), allocatable :: redundancies(:)
    integer, allocatable :: rows(:)                  !! all rows in them, ascending
    real(wp), allocatable :: null_vectors(:, :, :)   !! orthonormal, [rows, redundancies, lanes]
  contains
    procedure :: orthonormalise
  end type load_sharing_block_t

  !> All blocks of a machine.
  type, public :: load_sharing_t
    type(load_sharing_block_t), allocatable :: blocks(:)
  contains
    procedure :: minimise_norm
    procedure :: pass_parameters
  end type load_sharing_t

contains

  !> The blocks of all groups, with null vectors that are zero.
  function new_load_sharing(groups, rows, lanes) result(self)
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: rows, lanes
    type(load_sharing_t) :: self
    type(redundancy_t), allocatable :: redundancies(:)
    integer, allocatable :: first(:), members(:), order(:), redundant(:)
    integer :: parent(rows), block_of(rows)   ! union-find over the rows; block of each row, 0: none
    integer :: g, i, j, k, r, root

    parent = [(r, r=1, rows)]
    block_of = 0
    k = 0
    allocate (redundancies(sum([(size(groups(g)%redundancies), g=1, size(groups))])))
    i = 0
    do g = 1, size(groups)
      redundancies(i + 1:i + size(groups(g)%redundancies)) = groups(g)%redundancies
      i = i + size(groups(g)%redundancies)
    end do
    do i = 1, size(redundancies)
      do j = 1, size(redundancies(i)%repeats)
        call join_components(redundancies(i)%row, redundancies(i)%repeats(j), parent)
      end do
    end do
    do i = 1, size(redundancies)
      call find_root(parent, redundancies(i)%row, root)
      if (block_of(root) > 0) cycle
      k = k + 1
      block_of(root) = k
    end do
    allocate (self%blocks(k))
    if (k == 0) return
    do r = 1, rows
      call find_root(parent, r, root)
      block_of(r) = block_of(root)
    end do
    members = pack([(r, r=1, rows)], block_of > 0)
    allocate (order(size(members)), redundant(size(redundancies)), first(k + 1))
    call transposed_order(block_of(members), k, order, first)
    do k = 1, size(self%blocks)
      self%blocks(k)%rows = members(order(first(k):first(k + 1) - 1))
    end do
    call transposed_order(block_of(redundancies%row), size(self%blocks), redundant, first)
    do k = 1, size(self%blocks)
      associate (block => self%blocks(k))
        allocate (block%redundancies(first(k + 1) - first(k)))
        do i = 1, size(block%redundancies)   ! a copy of all in one assignment is wrong with gfortran
          block%redundancies(i) = redundancies(redundant(first(k) - 1 + i))
        end do
        allocate (block%null_vectors(size(block%rows), size(block%redundancies), lanes), source=0.0_wp)
      end associate
    end do
  end function new_load_sharing

  !> Orthonormalises the null vectors of one lane: Gram-Schmidt, twice per vector.
  pure subroutine orthonormalise(self, lane)
    class(load_sharing_block_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: j, k, pass

    associate (basis => self%null_vectors)
      do k = 1, size(basis, 2)
        basis(:, k, lane) = basis(:, k, lane) / norm2(basis(:, k, lane))
        do pass = 1, 2
          do j = 1, k - 1
            basis(:, k, lane) = basis(:, k, lane) - dot_product(basis(:, j, lane), basis(:, k, lane)) * basis(:, j, lane)
          end do
          basis(:, k, lane) = basis(:, k, lane) / norm2(basis(:, k, lane))
        end do
      end do
    end associate
  end subroutine orthonormalise

  !> Subtracts the projections on the null vectors from the reactions.
  pure subroutine minimise_norm(self, lane, lambda)
    class(load_sharing_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: lambda(:)   !! [rows]
    integer :: b, i, k
    real(wp) :: part

    do b = 1, size(self%blocks)
      associate (block => self%blocks(b))
        do k = 1, size(block%null_vectors, 2)
          part = 0.0_wp
          do i = 1, size(block%rows)
            part = part + block%null_vectors(i, k, lane) * lambda(block%rows(i))
          end do
          do i = 1, size(block%rows)
            lambda(block%rows(i)) = lambda(block%rows(i)) - part * block%null_vectors(i, k, lane)
          end do
        end do
      end associate
    end do
  end subroutine minimise_norm

  !> Passes the arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(load_sharing_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters
    integer :: b

    do b = 1, size(self%blocks)
      call parameters%add_structure(self%blocks(b)%rows)
      call parameters%add_blocks('load sharing: null vectors', self%blocks(b)%null_vectors)
    end do
  end subroutine pass_parameters

end module nocdyn_load_sharing
