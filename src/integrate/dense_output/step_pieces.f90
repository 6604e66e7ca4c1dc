!> The pieces of a step in which functions of the solution are replaced by polynomials.
!>
!> A step shows what the solution does. A function of it, such as a torque or the reaction of a joint that holds, may do more,
!> above all where the solution hardly moves. So the pieces are at most a part of its fastest wave; and a piece is halved, for the
!> functions whose polynomial has not converged there: its last coefficients are small if it has.
module nocdyn_step_pieces
  use nocdyn_chebyshev, only: interpolation_t, last_terms
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_step_pieces, count_pieces

  real(wp), parameter, public :: before_jump = 64.0_wp   !! spacings of the time between the last node and a jump

  integer, parameter :: most_halvings = 12
  real(wp), parameter :: wave_part = 0.5_wp       ! of a wave in a piece, times the degree of the polynomials [rad]
  real(wp), parameter :: most_pieces = 1.0e3_wp   ! of a step, before they are halved
  real(wp), parameter :: tolerance = 2.0e-5_wp    ! of the last terms, relative to the range of the function so far
  real(wp), parameter :: least_range = 1.0e-3_wp  ! that counts, relative to the largest absolute value so far
  real(wp), parameter :: rounding = 1.0e-6_wp     ! a range that does not count, relative to the scale of the functions
  real(wp), parameter :: noise = 64 * epsilon(1.0_wp)   ! rounding of values, relative to the largest one
  real(wp), parameter :: progress = 0.7_wp        ! larger terms after a halving, relative to those before, are noise

  type, public :: step_pieces_t
    logical :: is_done = .true.
    real(wp) :: begin = 0.0_wp, end = 0.0_wp           !! of the present piece [s]
    logical, allocatable :: is_open(:, :)              !! functions not replaced yet in the present piece, [functions, 0:halvings]
    integer :: depth = 0                               !! halvings of the present piece
    integer, private :: piece = 1, pieces = 1          !! before they are halved
    real(wp), private :: t_start = 0.0_wp, t_end = 0.0_wp   !! of the step [s]
    real(wp), private :: ends(0:most_halvings) = 0.0_wp     !! of the present piece, and of the pieces that contain it [s]
    real(wp), allocatable, private :: terms(:, :)           !! last terms there, [functions, 0:halvings]
    real(wp), allocatable, private :: lowest(:), highest(:) !! values so far, [functions]
  contains
    procedure :: restart, include_values, find_room, find_open, start_step, replaces, advance
  end type step_pieces_t

contains

  !> Pieces for some functions.
  pure type(step_pieces_t) function new_step_pieces(functions) result(self)
    integer, intent(in) :: functions

    allocate (self%is_open(functions, 0:most_halvings + 1), source=.true.)
    allocate (self%terms(functions, 0:most_halvings), self%lowest(functions), self%highest(functions), source=0.0_wp)
    call self%restart()
  end function new_step_pieces

  !> Forgets the ranges of the functions.
  pure subroutine restart(self)
    class(step_pieces_t), intent(inout) :: self

    self%lowest(:) = huge(0.0_wp)
    self%highest(:) = -huge(0.0_wp)
  end subroutine restart

  !> Adds values of the functions to their ranges.
  pure subroutine include_values(self, values)
    class(step_pieces_t), intent(inout) :: self
    real(wp), intent(in) :: values(:)   !! [functions]

    self%lowest(:) = min(self%lowest, values)
    self%highest(:) = max(self%highest, values)
  end subroutine include_values

  !> How far values of the functions are inside their ranges, less the rounding of other values.
  pure subroutine find_room(self, values, room)
    class(step_pieces_t), intent(in) :: self
    real(wp), intent(in) :: values(:)
    real(wp), intent(inout) :: room(:)   !! negative outside, [functions]

    room(:) = min(self%highest - values, values - self%lowest) - noise * max(self%highest, -self%lowest)
  end subroutine find_room

  !> Opens the functions that may leave their ranges in a step, closes the others: they leave the chord by an eighth of the bound
  !> of their second derivative at most.
  pure subroutine find_open(self, start, end, slopes, bends)
    class(step_pieces_t), intent(inout) :: self
    real(wp), intent(in) :: start(:), end(:)         !! values at the ends of the step, [functions]
    real(wp), intent(in) :: slopes(:), bends(:)      !! bounds of the derivatives over the length of the step
    real(wp) :: margin
    integer :: i

    do i = 1, size(start)
      margin = 0.0_wp   ! of a constant
      if (slopes(i) > 0) margin = 0.125_wp * bends(i) + noise * max(self%highest(i), -self%lowest(i))
      self%is_open(i, 0) = max(start(i), end(i)) + margin > self%highest(i) .or. min(start(i), end(i)) - margin < self%lowest(i)
    end do
  end subroutine find_open

  !> Begins with the first piece of a step, or of a part of one.
  pure subroutine start_step(self, t_start, t_end, fastest, degree)
    class(step_pieces_t), intent(inout) :: self
    real(wp), intent(in) :: t_start, t_end   !! [s]
    real(wp), intent(in) :: fastest          !! rate of the fastest wave [rad/s]
    integer, intent(in) :: degree            !! of the polynomials

    self%t_start = t_start
    self%t_end = t_end
    self%piece = 1
    self%pieces = count_pieces(t_start, t_end, fastest, degree)
    self%is_done = .false.
    self%begin = t_start
    call start_piece(self)
  end subroutine start_step

  !> The number of pieces of a step, or of a part of one, before they are halved. A step over many more waves has found them
  !> smaller than its tolerance, as those of a speed that runs away to infinity are.
  pure integer function count_pieces(t_start, t_end, fastest, degree) result(pieces)
    real(wp), intent(in) :: t_start, t_end, fastest   !! as in `start_step`
    integer, intent(in) :: degree

    pieces = ceiling(max(1.0_wp, min(most_pieces, (t_end - t_start) * fastest / (wave_part * degree))))
  end function count_pieces

  pure subroutine start_piece(self)
    class(step_pieces_t), intent(inout) :: self

    self%depth = 0
    self%ends(0) = self%t_end
    if (self%piece < self%pieces) self%ends(0) = self%t_start + (self%t_end - self%t_start) * self%piece / self%pieces
    self%end = self%ends(0)
    self%is_open(:, 1) = .false.
  end subroutine start_piece

  !> Whether the polynomial of an open function that may bend more than the solution replaces it in the present piece. If not, it
  !> stays open in the halves.
  pure subroutine replaces(self, function, rule, values, scale, answer)
    class(step_pieces_t), intent(inout) :: self
    integer, intent(in) :: function
    type(interpolation_t), intent(in) :: rule
    real(wp), intent(in) :: values(0:rule%degree)   !! of the function at the nodes of the piece
    real(wp), intent(in) :: scale                   !! of which a small part is rounding, in the unit of the function
    logical, intent(out) :: answer
    real(wp) :: range

    answer = .true.
    associate (depth => self%depth, terms => self%terms(function, self%depth), lowest => self%lowest(function), &
               highest => self%highest(function))
      lowest = min(lowest, minval(values))
      highest = max(highest, maxval(values))
      range = max(highest - lowest, least_range * max(highest, -lowest), rounding * scale)
      terms = last_terms(rule, values)
      if (.not. terms > tolerance * range .or. depth == most_halvings) return
      if (depth > 0) then
        if (terms > progress * self%terms(function, depth - 1)) return
      end if
      answer = .false.
      self%is_open(function, depth + 1) = .true.
    end associate
  end subroutine replaces

  !> Goes to the next piece: to the first half of the present one if a function is still open, else to the one after it.
  pure subroutine advance(self, has_moved)
    class(step_pieces_t), intent(inout) :: self
    logical, intent(out) :: has_moved   !! whether the next piece begins where the present one ends
    real(wp) :: middle

    middle = self%begin + 0.5_wp * (self%end - self%begin)
    has_moved = .not. (any(self%is_open(:, self%depth + 1)) .and. middle > self%begin .and. middle < self%end)
    if (.not. has_moved) then
      self%depth = self%depth + 1
      self%ends(self%depth) = middle
      self%end = middle
      self%is_open(:, self%depth + 1) = .false.
      return
    end if
    self%begin = self%end
    do while (self%depth > 0)
      if (self%ends(self%depth - 1) > self%begin) exit
      self%depth = self%depth - 1
    end do
    self%is_open(:, self%depth + 1) = .false.
    if (self%depth > 0) then
      self%ends(self%depth) = self%ends(self%depth - 1)
      self%end = self%ends(self%depth)
      return
    end if
    self%piece = self%piece + 1
    self%is_done = self%piece > self%pieces
    if (.not. self%is_done) call start_piece(self)
  end subroutine advance

end module nocdyn_step_pieces
