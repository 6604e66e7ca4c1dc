!> Settling times. A settling time is the last time at which a column leaves a band around its end value. That value is known
!> at the end only, so that the course of the column is stored until then.
module nocdyn_settling_time
  use nocdyn_chebyshev, only: differentiate, max_nodes, series_value
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  integer, parameter :: first_room = 64          ! steps
  real(wp), parameter :: largest_ratio = 4.0_wp  ! of a polynomial to its values at up to 40 Chebyshev-Lobatto nodes
  integer, parameter :: max_halvings = 50        ! of a step

  !> The values of some columns at the Chebyshev-Lobatto nodes of every step of a lane. The memory is kept for the next variant.
  type, public :: settling_history_t
    integer, private :: steps = 0
    real(wp), allocatable, private :: t(:, :)           !! start and end of each step [s], [2, room]
    real(wp), allocatable, private :: values(:, :, :)   !! [nodes, columns, room]
  contains
    procedure :: clear, add, last_exit
  end type settling_history_t

contains

  !> Forgets the steps.
  subroutine clear(self)
    class(settling_history_t), intent(inout) :: self

    self%steps = 0
  end subroutine clear

  !> Adds a step.
  subroutine add(self, t_start, t_end, columns, values)
    class(settling_history_t), intent(inout) :: self
    real(wp), intent(in) :: t_start, t_end             !! [s]
    integer, intent(in) :: columns(:)                  !! that are stored
    real(wp), contiguous, intent(in) :: values(:, :)   !! [all columns, nodes]
    integer :: i

    if (.not. allocated(self%t)) then
      allocate (self%t(2, first_room), self%values(size(values, 2), size(columns), first_room))
    else if (self%steps == size(self%t, 2)) then
      call grow(self)
    end if
    self%steps = self%steps + 1
    self%t(:, self%steps) = [t_start, t_end]
    do i = 1, size(columns)
      self%values(:, i, self%steps) = values(columns(i), :)
    end do
  end subroutine add

  subroutine grow(self)
    type(settling_history_t), intent(inout) :: self
    real(wp), allocatable :: t(:, :), values(:, :, :)

    allocate (t(2, 2 * self%steps), values(size(self%values, 1), size(self%values, 2), 2 * self%steps))
    t(:, :self%steps) = self%t
    values(:, :, :self%steps) = self%values
    call move_alloc(t, self%t)
    call move_alloc(values, self%values)
  end subroutine grow

  !> The last time [s] at which a column differs from `end_value` by more than `tolerance`, the start of the steps if there is
  !> none.
  pure real(wp) function last_exit(self, to_series, column, end_value, tolerance)
    class(settling_history_t), intent(in) :: self
    real(wp), intent(in) :: to_series(:, :)   !! of `lobatto_nodes`
    integer, intent(in) :: column             !! number among the stored ones
    real(wp), intent(in) :: end_value         !! of the column
    real(wp), intent(in) :: tolerance         !! half the width of the band
    real(wp) :: deviations(max_nodes), c(max_nodes), position
    logical :: found
    integer :: i, n, step

    n = size(self%values, 1)
    last_exit = self%t(1, 1)
    do step = self%steps, 1, -1
      deviations(:n) = self%values(:, column, step) - end_value
      if (largest_ratio * maxval(abs(deviations(:n))) <= tolerance) cycle
      c(:n) = 0.0_wp
      do i = 1, n
        c(:n) = c(:n) + to_series(:, i) * deviations(i)
      end do
      call find_exit(n, c, tolerance, position, found)
      if (.not. found) cycle
      last_exit = self%t(1, step) + 0.5_wp * (1 + position) * (self%t(2, step) - self%t(1, step))
      if (position >= 1) last_exit = self%t(2, step)
      return
    end do
  end function last_exit

  !> The last position in [-1, 1] at which |p| > tolerance. Parts of the step are halved until a bound shows that p stays in the
  !> band or is monotonic.
  pure subroutine find_exit(n, c, tolerance, position, found)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n)   !! of p, as a sum of Chebyshev polynomials
    real(wp), intent(in) :: tolerance
    real(wp), intent(out) :: position
    logical, intent(out) :: found
    real(wp) :: left(max_halvings + 2), right(max_halvings + 2)   ! parts to be searched, the last one first
    real(wp) :: slopes(n), bend, half, middle, slope
    integer :: parts

    slopes = 0.0_wp
    call differentiate(n, c, slopes)
    bend = largest_curvature(n, c)
    left(1) = -1.0_wp
    right(1) = 1.0_wp
    parts = 1
    found = .true.
    do while (parts > 0)
      half = 0.5_wp * (right(parts) - left(parts))
      middle = left(parts) + half
      slope = series_value(n, slopes, middle)
      position = right(parts)
      if (abs(series_value(n, c, position)) > tolerance) return
      if (abs(series_value(n, c, middle)) + half * (abs(slope) + 0.5_wp * half * bend) <= tolerance &
          .or. parts > max_halvings) then
        parts = parts - 1
      else if (abs(slope) > half * bend) then
        if (abs(series_value(n, c, left(parts))) > tolerance) then
          call find_band_boundary(n, c, slopes, tolerance, left(parts), right(parts), position)
          return
        end if
        parts = parts - 1
      else
        left(parts + 1) = middle
        right(parts:parts + 1) = [middle, right(parts)]
        parts = parts + 1
      end if
    end do
    found = .false.
  end subroutine find_exit

  !> A bound on |p''| in [-1, 1]: |T_k''| <= k^2 (k^2 - 1) / 3.
  pure real(wp) function largest_curvature(n, c)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n)
    integer :: k

    largest_curvature = 0.0_wp
    do k = 2, n - 1
      largest_curvature = largest_curvature + abs(c(k + 1)) * real(k, wp)**2 * (real(k, wp)**2 - 1) / 3
    end do
  end function largest_curvature

  !> The position at which |p| = tolerance between one outside the band and one inside. p must be monotonic between them. Newton's
  !> method, safeguarded by bisection.
  pure subroutine find_band_boundary(n, c, slopes, tolerance, outside, inside, position)
    integer, intent(in) :: n
    real(wp), intent(in) :: c(n), slopes(n)        ! of p and of p'
    real(wp), intent(in) :: tolerance
    real(wp), intent(in) :: outside, inside        ! positions
    real(wp), intent(out) :: position
    real(wp) :: boundary, change, excess, last, next
    integer :: step

    last = outside
    next = inside
    boundary = sign(tolerance, series_value(n, c, outside))
    position = 0.5_wp * (last + next)
    do step = 1, 2 * max_halvings
      excess = series_value(n, c, position) - boundary
      if (excess * boundary > 0) then
        last = position
      else
        next = position
      end if
      change = -excess / series_value(n, slopes, position)
      if (position + change <= last .or. position + change >= next) change = 0.5_wp * (last + next) - position
      position = position + change
      if (abs(change) <= epsilon(position)) exit
    end do
  end subroutine find_band_boundary

end module nocdyn_settling_time
