!> A stiff chain of rotors with a sparse Jacobian pattern, or with the full one.
module nocdyn_chain_problem
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_ok, pattern_t, system_t
  implicit none (type, external)
  private

  public :: chain_problem

  real(wp), parameter :: cubic_stiffness = 1.0e3_wp, damping = 1.0_wp, drag = 10.0_wp
  real(wp), parameter :: torque = 100.0_wp, frequency = 3.0_wp

  !> Rotors of inertia 1, neighbours joined by springs and dampers; torque * cos(frequency * t) on the first, viscous
  !> drag on the last, whose work is the quadrature. States: all speeds, then all angles.
  type, extends(system_t), public :: chain_t
    integer :: rotors
    real(wp), allocatable :: stiffness(:)   !! shape [lanes]
    type(pattern_t) :: pattern
  contains
    procedure :: derivative
    procedure :: jacobian
    procedure :: jacobian_pattern
  end type chain_t

contains

  pure function chain_problem(rotors, stiffness, is_whole) result(problem)
    integer, intent(in) :: rotors
    real(wp), intent(in) :: stiffness(:)
    logical, intent(in) :: is_whole   !! whether the pattern has all positions of the Jacobian
    type(chain_t) :: problem

    problem%lanes = size(stiffness)
    problem%states = 2 * rotors
    problem%quadratures = 1
    problem%rotors = rotors
    allocate (problem%stiffness, source=stiffness)
    problem%pattern = sparse_pattern(rotors)
    if (is_whole) problem%pattern = whole_pattern(2 * rotors + 1, 2 * rotors)
  end function chain_problem

  subroutine derivative(self, t, y, dydt, status)
    class(chain_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: i, lane

    status = evaluation_ok
    associate (n => self%rotors)
      dydt(:, :n) = 0.0_wp
      dydt(:, n + 1:2 * n) = y(:, :n)
      dydt(:, 2 * n + 1) = drag * y(:, n)**2
      dydt(:, n) = -drag * y(:, n)
      !GCC$ novector
      do lane = 1, self%lanes
        dydt(lane, 1) = dydt(lane, 1) + torque * cos(frequency * t(lane))
      end do
      do i = 1, n - 1
        do lane = 1, self%lanes
          associate (moment => spring(self%stiffness(lane), y(lane, n + i + 1) - y(lane, n + i)) &
                     + damping * (y(lane, i + 1) - y(lane, i)))
            dydt(lane, i) = dydt(lane, i) + moment
            dydt(lane, i + 1) = dydt(lane, i + 1) - moment
          end associate
        end do
      end do
    end associate
  end subroutine derivative

  elemental function spring(stiffness, twist) result(moment)
    real(wp), intent(in) :: stiffness, twist
    real(wp) :: moment

    moment = stiffness * twist + cubic_stiffness * twist**3
  end function spring

  pure function sparse_pattern(rotors) result(pattern)
    integer, intent(in) :: rotors
    type(pattern_t) :: pattern
    integer :: i, j

    allocate (pattern%row, pattern%column, source=[integer ::])
    do i = 1, rotors
      do j = max(1, i - 1), min(rotors, i + 1)
        pattern%row = [pattern%row, i, i]
        pattern%column = [pattern%column, j, rotors + j]
      end do
    end do
    pattern%row = [pattern%row, [(rotors + i, i=1, rotors)], 2 * rotors + 1]
    pattern%column = [pattern%column, [(i, i=1, rotors)], rotors]
  end function sparse_pattern

  pure function whole_pattern(rows, columns) result(pattern)
    integer, intent(in) :: rows, columns
    type(pattern_t) :: pattern
    integer :: i, j

    pattern%row = [((i, i=1, rows), j=1, columns)]
    pattern%column = [((j, i=1, rows), j=1, columns)]
  end function whole_pattern

  function jacobian_pattern(self) result(pattern)
    class(chain_t), intent(in) :: self
    type(pattern_t) :: pattern

    pattern = self%pattern
  end function jacobian_pattern

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(chain_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: lane, p

    status = evaluation_ok
    do p = 1, size(dfdy, 2)
      do lane = 1, self%lanes
        dfdy(lane, p) = entry_at(self%pattern%row(p), self%pattern%column(p), self%stiffness(lane), &
                                 y(lane, :self%rotors), y(lane, self%rotors + 1:2 * self%rotors))
      end do
    end do
    dfdt(:, :) = 0.0_wp
    !GCC$ novector
    do lane = 1, self%lanes
      dfdt(lane, 1) = -torque * frequency * sin(frequency * t(lane))
    end do
  end subroutine jacobian

  !> One element of the Jacobian.
  pure function entry_at(row, column, stiffness, omega, phi) result(entry)
    integer, intent(in) :: row, column
    real(wp), intent(in) :: stiffness
    real(wp), intent(in) :: omega(:), phi(:)
    real(wp) :: entry
    integer :: i, j, n

    n = size(omega)
    entry = 0.0_wp
    if (row > 2 * n) then
      if (column == n) entry = 2 * drag * omega(n)
    else if (row > n) then
      if (column == row - n) entry = 1.0_wp
    else
      j = merge(column, column - n, column <= n)
      do i = max(1, row - 1), min(n - 1, row)   ! the shaft between rotors i and i + 1
        if (j /= i .and. j /= i + 1) cycle
        entry = entry + merge(-1, 1, j == row) * merge(damping, slope(stiffness, phi(i + 1) - phi(i)), column <= n)
      end do
      if (row == n .and. column == n) entry = entry - drag
    end if
  end function entry_at

  !> Derivative of `spring` by its twist.
  elemental function slope(stiffness, twist)
    real(wp), intent(in) :: stiffness, twist
    real(wp) :: slope

    slope = stiffness + 3 * cubic_stiffness * twist**2
  end function slope

end module nocdyn_chain_problem
