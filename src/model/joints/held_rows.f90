!> The rows of L_lambda that hold now: rows of locked joints and rows that move (`nocdyn_row_motions`), in a block of one lane.
!>
!> The joints that hold are a *set*; each is one more row u' = 0, or u' - g' v' = 0 where it moves. With the response R of the
!> accelerations to the moments and W = U R, the moments of the set are -W^+ u'', with the accelerations u'' of its rows without
!> them: q'' is projected on the complement of the rows that hold. W^+ is found where the set changes, unless rows move: then
!> W is formed from the slopes g' at each position. W is singular where some of the rows are redundant; the least norm shares the
!> moment between them.
!>
!> Teeth with losses that turn hold no row, but their moments x = -s (T + V x) depend on the moments of the set and are found with
!> them.
module nocdyn_held_rows
  use nocdyn_friction_joints, only: locked
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_row_motions, only: row_motions_t
  use nocdyn_semidefinite, only: new_semidefinite, null_tolerance, semidefinite_t
  use nocdyn_tooth_loads, only: tooth_loads_t
  implicit none (type, external)
  private

  type, public :: held_rows_t
    integer :: count = 0                     !! joints that lock, and rows that move
    integer :: locking = 0                   !! the first of them: clutches and freewheels
    type(row_motions_t) :: motions           !! of the others
    type(tooth_loads_t) :: teeth             !! of the clutches and freewheels that are teeth with losses
    integer, allocatable :: element(:)       !! of the machine, [joints] as all that follow
    integer, allocatable :: driver(:)        !! element whose motion moves the row, 0 for none
    integer, allocatable :: mode(:)          !! `locked` where the row holds
    real(wp), allocatable :: slope(:)        !! g' at the present position, 0 without a driver
    real(wp), allocatable :: rate(:)         !! accelerations of the rows u'' without the moments of the set [rad/s2], or
                                             !! slips, whose moments then are impulses
    real(wp), allocatable :: moment(:)       !! of the joints that hold [N m]
    real(wp), allocatable :: mutual(:, :)    !! responses of all elements and then all drivers to their moments [1/(kg m2)],
                                             !! [2 joints, 2 joints]
    real(wp), allocatable :: weight(:, :)    !! W [1/(kg m2)], [joints, joints]
    logical, allocatable :: is_shared(:)     !! whether it was in a set that does not determine its moment
    integer :: lost = 0                      !! a row with which the rank has changed, or that others contradict, 0: none
    logical :: is_assumed = .false.          !! whether the modes are for a trial only
    logical, private :: is_examined = .false.   !! whether `is_shared` knows the present modes
    logical, private :: is_known = .false.   !! whether the set belongs to the present modes and slopes
    integer, private :: order = 0            !! number of rows that hold
    integer, allocatable, private :: holding(:)      !! these rows, the first `order` are in use
    real(wp), allocatable, private :: inverse(:, :)  !! their W^+, the first `order` rows and columns, where none move
    type(semidefinite_t), private :: system          !! their W, where some move
    real(wp), allocatable, private :: right(:)       !! right-hand side, work space
    integer, private :: rank_at_start = 0    !! of the rows that move
    ! where there are teeth with losses:
    logical, private :: has_factors = .false.      !! whether `factors` belong to the present modes, slopes and shares
    real(wp), allocatable, private :: factors(:, :)       !! LU factors of the equations of all moments
    logical, private :: is_singular = .false.             !! `factors` are the pseudo-inverse
    real(wp), allocatable, private :: share(:)            !! of the factors, [losses]
    integer, allocatable, private :: pivots(:)
  contains
    procedure :: allocate_rows
    procedure :: start_rows
    procedure :: weigh
    procedure :: change_set
    procedure :: find_moments, find_holding
    procedure :: moment_errors
    procedure :: nearly_lost
    procedure :: partners
    procedure :: is_active
    procedure, private :: find_moving_moments
    procedure, private :: find_moments_with_teeth
    procedure, private :: factor_with_teeth
    procedure, private :: watch_rank
    procedure, private :: choose_set, invert_weights
    procedure, private :: examine
    procedure, private :: unit_weights
  end type held_rows_t

contains

  !> Locks the rows that move, and no joints.
  subroutine allocate_rows(self, mode)
    class(held_rows_t), intent(inout) :: self
    integer, intent(in) :: mode   !! of the joints that are not locked

    associate (n => self%count)
      allocate (self%mode(n), source=mode)
      self%mode(self%locking + 1:) = locked
      allocate (self%rate(n), self%moment(n), self%slope(n), source=0.0_wp)
      allocate (self%weight(n, n), self%mutual(2 * n, 2 * n), source=0.0_wp)
      allocate (self%is_shared(n), source=.false.)
      allocate (self%holding(n), self%inverse(n, n), self%right(n))
      self%system = new_semidefinite(merge(n, 0, self%motions%count > 0))
      if (self%teeth%count == 0) return
      allocate (self%factors(n, n), self%pivots(n))
      allocate (self%share(self%teeth%count), source=0.0_wp)
    end associate
  end subroutine allocate_rows

  !> Weighs the rows at their first position, where `mutual` is known.
  subroutine start_rows(self)
    class(held_rows_t), intent(inout) :: self
    integer :: dependent, j

    call self%weigh()
    if (self%motions%count == 0) return
    call self%system%find_rank(self%weight, [(j, j=self%locking + 1, self%count)], self%rank_at_start, dependent)
  end subroutine start_rows

  !> Forms W with the slopes of the present position.
  subroutine weigh(self)
    class(held_rows_t), intent(inout) :: self
    integer :: i, j

    self%slope(self%locking + 1:) = merge(self%motions%g(1, :), 0.0_wp, self%motions%driver > 0)
    associate (n => self%count, w => self%mutual, s => self%slope)
      do j = 1, n
        do i = 1, n
          self%weight(i, j) = w(i, j) - s(i) * w(n + i, j) - s(j) * (w(i, n + j) - s(i) * w(n + i, n + j))
        end do
      end do
    end associate
    call self%teeth%weigh(self%element, self%driver, self%slope)
    self%is_known = .false.
    self%has_factors = .false.
  end subroutine weigh

  !> Takes note that modes have changed.
  pure subroutine change_set(self)
    class(held_rows_t), intent(inout) :: self

    self%is_known = .false.
    self%is_examined = .false.
    self%has_factors = .false.
  end subroutine change_set

  !> Whether a joint has a moment that follows from the moments of others: it is locked, or teeth with losses that turn.
  pure logical function is_active(self, joint, with_losses)
    class(held_rows_t), intent(in) :: self
    integer, intent(in) :: joint
    logical, intent(in) :: with_losses   !! whether teeth that turn count

    is_active = self%mode(joint) == locked
    if (with_losses .and. joint <= self%locking) is_active = is_active .or. self%teeth%loss_of(joint) > 0
  end function is_active

  !> The moments of the locked joints, from the accelerations `rate` without them; and the moments of the teeth that turn, from
  !> their drags without them.
  subroutine find_moments(self, drag)
    class(held_rows_t), intent(inout) :: self
    real(wp), intent(in), optional :: drag(:)   !! s T [N m], [losses]; absent: teeth that turn have no moments
    integer :: column, row

    if (present(drag) .and. self%teeth%count > 0) then
      call self%find_moments_with_teeth(drag)
      return
    end if
    if (self%motions%count > 0) then
      call self%find_moving_moments()
      return
    end if
    call self%invert_weights()
    self%moment(:) = 0.0_wp
    do column = 1, self%order
      do row = 1, self%order
        associate (moment => self%moment(self%holding(row)))
          moment = moment - self%inverse(row, column) * self%rate(self%holding(column))
        end associate
      end do
    end do
  end subroutine find_moments

  !> Finds W^+ of the set, where no rows move and no teeth have losses.
  subroutine invert_weights(self)
    class(held_rows_t), intent(inout) :: self

    if (self%is_known) return
    call self%choose_set()
    associate (which => self%holding(:self%order))
      self%inverse(:self%order, :self%order) = pseudo_inverse(self%weight(which, which), null_tolerance)
      call self%examine(which)
    end associate
  end subroutine invert_weights

  !> W^+ of the set with zeros for the joints that do not hold: the moments are -W^+ u''.
  subroutine find_holding(self, holding)
    class(held_rows_t), intent(inout) :: self
    real(wp), intent(inout) :: holding(:, :)   !! [kg m2], [joints, joints]
    integer :: i, j

    call self%invert_weights()
    holding(:, :) = 0.0_wp
    do j = 1, self%order
      do i = 1, self%order
        holding(self%holding(i), self%holding(j)) = self%inverse(i, j)
      end do
    end do
  end subroutine find_holding

  !> Moments of locked joints where rows move.
  subroutine find_moving_moments(self)
    class(held_rows_t), intent(inout) :: self
    integer :: i

    if (.not. self%is_known) then
      call self%choose_set()
      call self%system%set_matrix(self%weight, self%holding, self%order)
      if (self%system%is_singular) call self%examine(self%holding(:self%order))
      if (self%system%is_singular .or. self%rank_at_start < self%motions%count) call self%watch_rank()
    end if
    do i = 1, self%order
      self%right(i) = self%rate(self%holding(i))
    end do
    call self%system%solve(self%right)
    self%moment(:) = 0.0_wp
    do i = 1, self%order
      self%moment(self%holding(i)) = -self%right(i)
    end do
  end subroutine find_moving_moments

  !> Moments of locked joints beside teeth with losses.
  subroutine find_moments_with_teeth(self, drag)
    class(held_rows_t), intent(inout) :: self
    real(wp), intent(in) :: drag(:)   !! s T [N m], [losses]
    integer :: j

    if (any(abs(self%share - self%teeth%share) > 0)) self%has_factors = .false.
    if (.not. self%has_factors) call self%factor_with_teeth()
    do j = 1, self%count
      self%moment(j) = 0.0_wp
      if (self%mode(j) == locked) then
        self%moment(j) = -self%rate(j)
        if (self%weight(j, j) > 0) self%moment(j) = self%moment(j) / self%weight(j, j)
      else if (self%is_active(j, .true.)) then
        self%moment(j) = -drag(self%teeth%loss_of(j))
      end if
    end do
    if (self%is_singular) then
      self%right(:) = self%moment
      self%moment(:) = matmul(self%factors, self%right)
    else
      call lu_solve(self%factors, self%pivots, self%moment)
    end if
  end subroutine find_moments_with_teeth

  !> Factors the equations of all moments: rows of W where joints are locked, x + s V x where teeth turn, x elsewhere.
  subroutine factor_with_teeth(self)
    class(held_rows_t), intent(inout) :: self
    real(wp) :: equations(self%count, self%count), pivots(self%count)
    integer :: j

    self%share(:) = self%teeth%share
    equations = 0.0_wp
    do j = 1, self%count
      if (self%mode(j) == locked) then
        equations(j, :) = self%weight(j, :)
        if (self%weight(j, j) > 0) equations(j, :) = equations(j, :) / self%weight(j, j)
      else
        equations(j, j) = 1.0_wp
        if (.not. self%is_active(j, .true.)) cycle
        associate (loss => self%teeth%loss_of(j))
          equations(j, :) = equations(j, :) + self%share(loss) * self%teeth%by_joint(loss, :)
        end associate
      end if
    end do
    self%factors(:, :) = equations
    call lu_factor(self%factors, self%pivots, self%is_singular)
    pivots = [(abs(self%factors(j, j)), j=1, self%count)]
    if (minval(pivots) <= null_tolerance * maxval(pivots)) self%is_singular = .true.
    if (self%is_singular) then
      self%factors(:, :) = pseudo_inverse(equations, null_tolerance)
      call self%examine(pack([(j, j=1, self%count)], self%mode == locked))
    end if
    self%has_factors = .true.
  end subroutine factor_with_teeth

  !> Bounds of the rounding errors of the present moments: equations that mix them give all errors of the largest ones, in the
  !> unit of the square roots of the diagonal of W.
  pure function moment_errors(self) result(error)
    class(held_rows_t), intent(in) :: self
    real(wp) :: error(self%count)   !! [N m]
    real(wp), parameter :: rounding = 64.0_wp * epsilon(1.0_wp)
    integer :: j
    real(wp) :: root(self%count)

    root = [(merge(sqrt(abs(self%weight(j, j))), 1.0_wp, self%weight(j, j) > 0), j=1, self%count)]
    error = rounding * maxval(abs(self%moment) * root) / root
  end function moment_errors

  !> A row that moves and is a combination of others, or almost one, at the last position; 0: none.
  pure integer function nearly_lost(self)
    class(held_rows_t), intent(in) :: self
    real(wp), parameter :: small = 1.0e-6_wp   ! a pivot

    nearly_lost = self%lost
    if (nearly_lost > 0 .or. self%motions%count == 0 .or. self%system%least_pivot > small) return
    if (self%system%weakest > 0) nearly_lost = self%holding(self%system%weakest)
    if (nearly_lost <= self%locking) nearly_lost = 0
  end function nearly_lost

  !> The other rows that hold of which a row is a combination, or nearly so: those that it may contradict.
  function partners(self, row) result(rows)
    class(held_rows_t), intent(in) :: self
    integer, intent(in) :: row
    integer, allocatable :: rows(:)
    real(wp), parameter :: small = 1.0e-6_wp   ! a share of the combination
    integer :: j
    real(wp), allocatable :: share(:), w(:, :)

    rows = pack([(j, j=1, self%count)], [(self%mode(j) == locked .and. j /= row, j=1, self%count)])
    allocate (w, source=self%unit_weights([rows, row]))
    associate (n => size(rows))
      share = matmul(pseudo_inverse(w(:n, :n), null_tolerance), w(:n, n + 1))
    end associate
    rows = pack(rows, abs(share) > small)
  end function partners

  !> W of some rows, scaled to a unit diagonal, or to zero where the diagonal is.
  pure function unit_weights(self, rows) result(w)
    class(held_rows_t), intent(in) :: self
    integer, intent(in) :: rows(:)
    real(wp), dimension(size(rows), size(rows)) :: w
    real(wp) :: scale(size(rows))
    integer :: j

    scale = 0.0_wp
    do j = 1, size(rows)
      if (self%weight(rows(j), rows(j)) > 0) scale(j) = 1.0_wp / sqrt(self%weight(rows(j), rows(j)))
    end do
    do j = 1, size(rows)
      w(:, j) = self%weight(rows, rows(j)) * (scale * scale(j))
    end do
  end function unit_weights

  !> Looks whether the rank of the rows that move is still the rank at the start. Locks may be combinations of them.
  subroutine watch_rank(self)
    class(held_rows_t), intent(inout) :: self
    integer :: dependent, j, rank

    call self%system%find_rank(self%weight, [(j, j=self%locking + 1, self%count)], rank, dependent)
    if (rank < self%rank_at_start) self%lost = dependent
    if (rank > self%rank_at_start) self%lost = self%count
    call self%system%set_matrix(self%weight, self%holding, self%order)
  end subroutine watch_rank

  !> Lists the rows that hold in the present modes.
  pure subroutine choose_set(self)
    class(held_rows_t), intent(inout) :: self
    integer :: j

    self%order = 0
    do j = 1, self%count
      if (self%mode(j) /= locked) cycle
      self%order = self%order + 1
      self%holding(self%order) = j
    end do
    self%is_known = .true.
  end subroutine choose_set

  !> Takes note of the joints of a set whose moments are not unique: those in the null vectors of W.
  subroutine examine(self, which)
    class(held_rows_t), intent(inout) :: self
    integer, intent(in) :: which(:)   !! joints that hold
    real(wp), dimension(size(which), size(which)) :: inverse, w
    integer :: j

    if (self%is_examined .or. self%is_assumed) return
    self%is_examined = .true.
    w = self%unit_weights(which)
    inverse = pseudo_inverse(w, null_tolerance)
    do j = 1, size(which)
      if (1 - dot_product(inverse(j, :), w(:, j)) > sqrt(null_tolerance)) self%is_shared(which(j)) = .true.
    end do
  end subroutine examine

end module nocdyn_held_rows
