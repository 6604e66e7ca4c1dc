!> Linear equations of nodes, each with the coefficients of a series as its unknowns, and of some last rows and columns:
!> [A B; C D] [x; y] = [r; s].
!>
!> A has a block for each pair of nodes that are connected. All nodes but one are eliminated; that one is solved with the last
!> rows and columns as a whole, because A may be singular, as it is at folds. Rows are interchanged within a node only;
!> refinement against the matrix makes good what this costs, and pivots that were too small and have been replaced (X. S. Li,
!> J. W. Demmel, SuperLU_DIST: A scalable distributed-memory sparse direct solver for unsymmetric linear systems, ACM
!> Transactions on Mathematical Software 29 (2003) 110-140). Full parts of blocks that are small beside the constant ones may be
!> left to refinement too.
module nocdyn_bordered_system
  use nocdyn_elimination, only: node_order_t
  use nocdyn_harmonic_blocks, only: harmonic_block_t, new_harmonic_block, subtract_product, swap, take_product
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  implicit none (type, external)
  private

  public :: new_bordered_system

  integer, parameter :: most_refinements = 30
  real(wp), parameter :: exact = 1.0e-14_wp   ! a correction, as a share of the solution
  real(wp), parameter :: slow = 0.5_wp        ! a correction, as a share of the one before
  real(wp), parameter :: small = 0.02_wp      ! full part of a block, as a share of the constant part of its row

  type, public :: bordered_system_t
    integer :: inner = 0                                  !! order of A
    integer :: border = 0                                 !! order of D
    type(harmonic_block_t), allocatable :: blocks(:)      !! of A, by the elements of the order of the nodes
    real(wp), allocatable :: right(:, :)                  !! B and D, [inner + border, border]
    real(wp), allocatable :: below(:, :)                  !! C, [border, inner]
    type(node_order_t), private :: order
    integer, private :: length = 0                        ! unknowns of a node
    integer, private :: last = 1                          ! the node that is not eliminated
    type(harmonic_block_t), allocatable, private :: factors(:)   ! inverses on the diagonal, factors below it
    real(wp), allocatable, private :: beside(:, :)        ! what the elimination makes of B
    real(wp), allocatable, private :: under(:, :)         ! and of C^T, times the inverses
    real(wp), allocatable, private :: core(:, :)          ! of the last node and the border
    integer, allocatable, private :: pivots(:)
    type(harmonic_block_t), private :: product
    logical :: is_whole = .true.                          !! whether the factors are those of the whole matrix
  contains
    procedure :: clear, factor, solve, substitute
    procedure, private :: eliminate, is_small, multiplied, first
  end type bordered_system_t

contains

  !> A system of zeros.
  type(bordered_system_t) function new_bordered_system(order, harmonics, border) result(self)
    type(node_order_t), intent(in) :: order   !! one node stays
    integer, intent(in) :: harmonics          !! of the series
    integer, intent(in) :: border             !! order of D
    integer :: i

    self%order = order
    self%length = 2 * harmonics + 1
    self%border = border
    self%inner = order%nodes * self%length
    do i = 1, order%nodes
      if (.not. any(order%pivot == i)) self%last = i
    end do
    allocate (self%blocks(size(order%row)), self%factors(size(order%row)))
    do i = 1, size(order%row)
      self%blocks(i) = new_harmonic_block(harmonics)
      self%factors(i) = new_harmonic_block(harmonics)
    end do
    self%product = new_harmonic_block(harmonics)
    allocate (self%right(self%inner + border, border), self%below(border, self%inner), source=0.0_wp)
    allocate (self%beside(self%inner, border), self%under(self%inner, border), source=0.0_wp)
    allocate (self%core(self%length + border, self%length + border), source=0.0_wp)
    allocate (self%pivots(self%length + border))
  end function new_bordered_system

  !> Sets all elements to zero.
  subroutine clear(self)
    class(bordered_system_t), intent(inout) :: self
    integer :: i

    do i = 1, size(self%blocks)
      call self%blocks(i)%clear()
    end do
    self%right(:, :) = 0.0_wp
    self%below(:, :) = 0.0_wp
  end subroutine clear

  !> Factors the matrix.
  subroutine factor(self, is_rough, singular)
    class(bordered_system_t), intent(inout) :: self
    logical, intent(in) :: is_rough      !! small full parts are left out
    logical, intent(out) :: singular
    integer :: i, k
    logical :: is_left_out

    self%is_whole = .true.
    do i = 1, size(self%blocks)
      is_left_out = is_rough .and. self%is_small(i)
      if (is_left_out) self%is_whole = .false.
      call self%factors(i)%copy(self%blocks(i), .not. is_left_out)
    end do
    self%beside(:, :) = self%right(:self%inner, :)
    self%under(:, :) = transpose(self%below)
    associate (n => self%length)
      self%core(n + 1:, n + 1:) = self%right(self%inner + 1:, :)
      do k = 1, size(self%order%pivot)
        call self%eliminate(k, singular)
        if (singular) return
      end do
      self%core(:n, :n) = 0.0_wp
      do k = 1, n
        self%core(k, k) = 1.0_wp
        self%core(:n, k) = self%factors(self%order%diagonal(self%last))%times(self%core(:n, k))
      end do
      associate (last => self%first(self%last))
        self%core(:n, n + 1:) = self%beside(last:last + n - 1, :)
        self%core(n + 1:, :n) = transpose(self%under(last:last + n - 1, :))
      end associate
    end associate
    call lu_factor(self%core, self%pivots, singular)
  end subroutine factor

  !> Eliminates the k-th pivot.
  subroutine eliminate(self, k, singular)
    class(bordered_system_t), intent(inout) :: self
    integer, intent(in) :: k
    logical, intent(out) :: singular
    integer :: b, i, j, near

    associate (order => self%order, factors => self%factors, n => self%length, own => self%first(self%order%pivot(k)), &
               inverse => self%order%diagonal(self%order%pivot(k)), first => self%order%first(k))
      call factors(inverse)%invert(singular)
      if (singular) return
      do b = 1, self%border
        self%under(own:own + n - 1, b) = factors(inverse)%times_transposed(self%under(own:own + n - 1, b))
      end do
      self%core(n + 1:, n + 1:) = self%core(n + 1:, n + 1:) - matmul(transpose(self%under(own:own + n - 1, :)), &
                                                                     self%beside(own:own + n - 1, :))
      near = order%first(k + 1) - first
      do i = 1, near
        associate (below => factors(order%below(first + i - 1)), beside => factors(order%beside(first + i - 1)), &
                   other => self%first(order%neighbour(first + i - 1)))
          call take_product(below, factors(inverse), self%product)
          call swap(below, self%product)
          do b = 1, self%border
            self%beside(other:other + n - 1, b) = self%beside(other:other + n - 1, b) - &
                                                  below%times(self%beside(own:own + n - 1, b))
            self%under(other:other + n - 1, b) = self%under(other:other + n - 1, b) - &
                                                 beside%times_transposed(self%under(own:own + n - 1, b))
          end do
        end associate
        do j = 1, near
          call subtract_product(factors(order%below(first + i - 1)), factors(order%beside(first + j - 1)), &
                                factors(order%changed(order%first_changed(k) + i + (j - 1) * near)))
        end do
      end do
    end associate
  end subroutine eliminate

  !> Whether the full part of a block is small beside the constant part of its row.
  pure logical function is_small(self, element)
    class(bordered_system_t), intent(in) :: self
    integer, intent(in) :: element

    is_small = .false.
    if (.not. self%blocks(element)%is_full .or. self%length == 1) return
    associate (own => self%blocks(self%order%diagonal(self%order%row(element))))
      is_small = maxval(abs(self%blocks(element)%full)) <= small * minval(abs(own%constant(1:)))
    end associate
  end function is_small

  !> Solves with the factors, those of a matrix near the present one, to rounding. Where they are of no use, the present one is
  !> factored.
  subroutine solve(self, x)
    class(bordered_system_t), intent(inout) :: self
    real(wp), contiguous, intent(inout) :: x(:)   !! [r; s], on return [x; y]
    real(wp) :: given(size(x))
    logical :: has_converged, singular

    given = x
    call refine(self, given, x, has_converged)
    if (has_converged) return
    call self%factor(.false., singular)
    if (.not. singular) call refine(self, given, x, has_converged)
  end subroutine solve

  !> Solves with the factors, then refines against the matrix.
  subroutine refine(self, given, x, has_converged)
    type(bordered_system_t), intent(in) :: self
    real(wp), intent(in) :: given(:)
    real(wp), intent(out) :: x(:)
    logical, intent(out) :: has_converged
    real(wp), parameter :: rounding = 1.0e-9_wp   ! a correction that does not become smaller may be so large
    real(wp) :: correction(size(x)), former, length
    integer :: k

    x = given
    call self%substitute(x)
    former = norm2(x)
    has_converged = .false.
    do k = 1, most_refinements
      correction = given - self%multiplied(x)
      call self%substitute(correction)
      length = norm2(correction)
      if (length > slow * former) exit
      x = x + correction
      has_converged = length <= exact * norm2(x)
      if (has_converged) return
      former = length
    end do
    has_converged = former <= rounding * norm2(x)
  end subroutine refine

  !> Solves with the factors, as exactly as these are.
  subroutine substitute(self, x)
    class(bordered_system_t), intent(in) :: self
    real(wp), intent(inout) :: x(:)
    real(wp) :: core(self%length + self%border), left(self%length)
    integer :: i, k

    associate (order => self%order, n => self%length, last => self%first(self%last))
      core(n + 1:) = x(self%inner + 1:)
      do k = 1, size(order%pivot)
        associate (own => self%first(order%pivot(k)))
          do i = order%first(k), order%first(k + 1) - 1
            associate (other => self%first(order%neighbour(i)))
              x(other:other + n - 1) = x(other:other + n - 1) - self%factors(order%below(i))%times(x(own:own + n - 1))
            end associate
          end do
          core(n + 1:) = core(n + 1:) - matmul(x(own:own + n - 1), self%under(own:own + n - 1, :))
        end associate
      end do
      core(:n) = x(last:last + n - 1)
      call lu_solve(self%core, self%pivots, core)
      x(last:last + n - 1) = core(:n)
      x(self%inner + 1:) = core(n + 1:)
      do k = size(order%pivot), 1, -1
        associate (own => self%first(order%pivot(k)))
          left = x(own:own + n - 1) - matmul(self%beside(own:own + n - 1, :), core(n + 1:))
          do i = order%first(k), order%first(k + 1) - 1
            associate (other => self%first(order%neighbour(i)))
              left = left - self%factors(order%beside(i))%times(x(other:other + n - 1))
            end associate
          end do
          x(own:own + n - 1) = self%factors(order%diagonal(order%pivot(k)))%times(left)
        end associate
      end do
    end associate
  end subroutine substitute

  !> The whole matrix times a vector.
  pure function multiplied(self, x) result(y)
    class(bordered_system_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    real(wp) :: y(size(x))
    integer :: i

    y = matmul(self%right, x(self%inner + 1:))
    y(self%inner + 1:) = y(self%inner + 1:) + matmul(self%below, x(:self%inner))
    associate (n => self%length)
      do i = 1, size(self%blocks)
        associate (row => self%first(self%order%row(i)), column => self%first(self%order%column(i)))
          y(row:row + n - 1) = y(row:row + n - 1) + self%blocks(i)%times(x(column:column + n - 1))
        end associate
      end do
    end associate
  end function multiplied

  !> The place of the first unknown of a node.
  pure integer function first(self, node)
    class(bordered_system_t), intent(in) :: self
    integer, intent(in) :: node

    first = (node - 1) * self%length + 1
  end function first

end module nocdyn_bordered_system
