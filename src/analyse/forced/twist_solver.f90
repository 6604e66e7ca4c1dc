!> Static twists of a machine at one speed after the other, by Newton's method from those of the speed before.
!>
!> The stiffness matrix of the coordinates is banded; the coordinates that the rigid motions leave free are held, for no force is
!> left on them. Where every stiffness is as before, its factors serve again: a linear machine is factored once. Where Newton's
!> method does not converge, or a stiffness is not positive, `find_twists` has to search.
module nocdyn_twist_solver
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: band_factor, band_solve
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_t
  use nocdyn_stage_matrix, only: half_bandwidths
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: new_twist_solver

  type, public :: twist_solver_t
    integer, private :: width = 0                        !! number of diagonals on either side of the main one
    integer, allocatable, private :: position(:)         !! of each coordinate in the band
    logical, allocatable, private :: is_free(:)          !! whether a coordinate is held, [coordinates]
    real(wp), allocatable, private :: band(:, :)         !! factors
    real(wp), allocatable, private :: x(:)               !! in the order of the band
    integer, allocatable, private :: pivots(:)
    real(wp), allocatable, private :: factored(:)        !! stiffnesses of the factors [N m/rad], [elastic elements]
    real(wp), allocatable, private :: start_twist(:)     !! [rad], [elements]
    real(wp), allocatable, private :: external(:)        !! torques of the inelastic elements [N m], [coordinates]
    real(wp), allocatable, private :: torque(:)          !! residual [N m], [coordinates]
    real(wp), allocatable, private :: scale(:)           !! sums of the absolute terms of `torque`
  contains
    procedure :: solve
  end type twist_solver_t

contains

  !> Prepares the matrix of a machine.
  type(twist_solver_t) function new_twist_solver(balance) result(self)
    type(torque_balance_t), intent(in) :: balance
    type(entries_t) :: entries
    integer :: c, order(balance%coordinates), upper

    entries = coupled_coordinates(balance)
    order = reverse_cuthill_mckee(balance%coordinates, entries%row, entries%column)
    call half_bandwidths(order, entries, self%width, upper)
    allocate (self%position(balance%coordinates), self%pivots(balance%coordinates))
    self%position(order) = [(c, c=1, balance%coordinates)]
    allocate (self%is_free(balance%coordinates), source=.false.)
    self%is_free(balance%motions%free) = .true.
    allocate (self%band(3 * self%width + 1, balance%coordinates), self%x(balance%coordinates), source=0.0_wp)
    allocate (self%external, self%torque, self%scale, source=self%x)
    allocate (self%factored(size(balance%elastic)), source=-1.0_wp)
    allocate (self%start_twist, source=pack(balance%formulation%machine%start_twist(), .true.))
  end function new_twist_solver

  !> The pairs of coordinates of every elastic element, and the diagonal.
  type(entries_t) function coupled_coordinates(balance) result(entries)
    type(torque_balance_t), intent(in) :: balance
    integer :: c, i, k, n

    associate (first => balance%incidence%first, coordinate => balance%incidence%coordinate, elastic => balance%elastic)
      n = sum((first(elastic + 1) - first(elastic))**2) + balance%coordinates
      allocate (entries%row(n), entries%column(n))
      entries%row(:balance%coordinates) = [(c, c=1, balance%coordinates)]
      entries%column(:balance%coordinates) = entries%row(:balance%coordinates)
      n = balance%coordinates
      do i = 1, size(elastic)
        associate (members => first(elastic(i) + 1) - first(elastic(i)))
          do k = first(elastic(i)), first(elastic(i) + 1) - 1
            entries%row(n + 1:n + members) = coordinate(first(elastic(i)):first(elastic(i) + 1) - 1)
            entries%column(n + 1:n + members) = coordinate(k)
            n = n + members
          end do
        end associate
      end do
    end associate
  end function coupled_coordinates

  !> Finds the angles of the coordinates. `balance` is evaluated at the speeds of the steady state.
  subroutine solve(self, balance, weight, torque, q, is_found)
    class(twist_solver_t), intent(inout) :: self
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: weight(:)     !! factors on the moments of the inelastic elements, [elements]
    real(wp), intent(in) :: torque(:)     !! more torques on the coordinates [N m], [coordinates]
    real(wp), intent(inout) :: q(:)       !! start, then solution [rad], [coordinates]
    logical, intent(out) :: is_found
    integer, parameter :: most_steps = 20
    real(wp), parameter :: balanced = 1.0e-12_wp
    integer :: step
    logical :: singular

    call set_external(self, balance, weight, torque)
    do step = 1, most_steps
      call set_torque(self, balance, q)
      is_found = all(self%is_free .or. abs(self%torque) <= balanced * self%scale)
      if (is_found .and. step > 1) return
      is_found = .false.
      associate (stiffness => balance%formulation%machine%elements%restoring_angle(1, balance%elastic))
        if (any(-stiffness < 0)) return
        if (any(abs(self%factored + stiffness) > 0)) then
          call factor(self, balance, -stiffness, singular)
          if (singular) return
        end if
      end associate
      self%x(self%position) = merge(0.0_wp, self%torque, self%is_free)
      call band_solve(self%width, self%width, self%band, self%pivots, self%x)
      q = q + self%x(self%position)
      if (.not. all(abs(q) < huge(q))) return
    end do
  end subroutine solve

  !> Torques of the inelastic elements on the coordinates.
  subroutine set_external(self, balance, weight, torque)
    class(twist_solver_t), intent(inout) :: self
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(in) :: weight(:), torque(:)   !! as in `solve`
    integer :: e, i, k

    self%external = torque
    associate (elements => balance%formulation%machine%elements, incidence => balance%incidence)
      do i = 1, size(balance%inelastic)
        e = balance%inelastic(i)
        associate (moment => weight(e) * (elements%restoring(1, e) + elements%applied(1, e)))
          if (.not. abs(moment) > 0) cycle
          do k = incidence%first(e), incidence%first(e + 1) - 1
            associate (c => incidence%coordinate(k))
              self%external(c) = self%external(c) + incidence%ratio(1, k) * moment
            end associate
          end do
        end associate
      end do
    end associate
  end subroutine set_external

  !> Evaluates the elastic elements at the angles q.
  subroutine set_torque(self, balance, q)
    class(twist_solver_t), intent(inout) :: self
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: q(:)   !! [rad], [coordinates]
    integer :: e, i, k

    associate (machine => balance%formulation%machine, elements => balance%formulation%machine%elements, &
               incidence => balance%incidence)
      do i = 1, size(balance%elastic)
        e = balance%elastic(i)
        elements%angle(1, e) = self%start_twist(e)
        do k = incidence%first(e), incidence%first(e + 1) - 1
          elements%angle(1, e) = elements%angle(1, e) + incidence%ratio(1, k) * q(incidence%coordinate(k))
        end do
      end do
      if (machine%switches%count > 0) call machine%choose_branches(balance%t)
      call machine%evaluate_elements(balance%t)
      call machine%differentiate_elements(balance%t)
      self%torque(:) = self%external
      self%scale(:) = abs(self%external)
      do i = 1, size(balance%elastic)
        e = balance%elastic(i)
        do k = incidence%first(e), incidence%first(e + 1) - 1
          associate (c => incidence%coordinate(k), moment => incidence%ratio(1, k) * (elements%restoring(1, e) &
                                                                                    + elements%applied(1, e)))
            self%torque(c) = self%torque(c) + moment
            self%scale(c) = self%scale(c) + abs(moment)
          end associate
        end do
      end do
    end associate
  end subroutine set_torque

  !> Factors the stiffness matrix.
  subroutine factor(self, balance, stiffness, singular)
    class(twist_solver_t), intent(inout) :: self
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(in) :: stiffness(:)   !! of the elastic elements [N m/rad]
    logical, intent(out) :: singular
    integer :: e, i, j, k

    self%band = 0.0_wp
    self%factored(:) = stiffness
    associate (incidence => balance%incidence, position => self%position)
      do i = 1, size(balance%elastic)
        e = balance%elastic(i)
        do j = incidence%first(e), incidence%first(e + 1) - 1
          if (self%is_free(incidence%coordinate(j))) cycle
          do k = incidence%first(e), incidence%first(e + 1) - 1
            if (self%is_free(incidence%coordinate(k))) cycle
            associate (entry => self%band(2 * self%width + 1 + position(incidence%coordinate(k)) &
                                          - position(incidence%coordinate(j)), position(incidence%coordinate(j))))
              entry = entry + stiffness(i) * incidence%ratio(1, k) * incidence%ratio(1, j)
            end associate
          end do
        end do
      end do
    end associate
    do i = 1, size(self%is_free)
      if (self%is_free(i)) self%band(2 * self%width + 1, self%position(i)) = 1.0_wp
    end do
    call band_factor(self%width, self%width, self%band, self%pivots, singular)
    if (singular) self%factored(:) = -1.0_wp
  end subroutine factor

end module nocdyn_twist_solver
