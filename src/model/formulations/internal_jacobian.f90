!> The part of the sparse Jacobian of the reduced formulation that comes from internal states.
!>
!> An internal state z of an element with the speed u' = U q' has the rate r(u', z). The moment M(z) of the element acts on
!> q'' = R M and on its work integral, W' = M u'.
module nocdyn_internal_jacobian
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_elements, only: elements_t, internal_states_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: new_internal_jacobian

  !> Order of the values, for each internal state: for each entry of its element dq''/dz and, if the entry has a ratio, dr/dq';
  !> dr/dz of each internal state of that element; dW'/dz if the element has a work integral.
  type, public :: internal_jacobian_t
    type(pattern_t) :: pattern
    integer, private :: before = 0                          !! number of positions of the Jacobian before these
    type(element_coordinates_t) :: incidence                !! entries of the element of each internal state
    logical, allocatable, private :: has_work_integral(:)   !! of the element of each internal state
  contains
    procedure :: fill
    procedure :: list_parameters
  end type internal_jacobian_t

contains

  !> The positions. Rows of internal states follow those of the coordinates; rows of the work integrals come last.
  function new_internal_jacobian(freedoms, incidence, with_work, internal, before) result(self)
    integer, intent(in) :: freedoms                        !! number of coordinates
    type(element_coordinates_t), intent(in) :: incidence   !! entries of all elements
    integer, intent(in) :: with_work(:)                    !! elements with work integrals
    type(internal_states_t), intent(in) :: internal
    integer, intent(in) :: before   !! number of positions of the Jacobian before these
    type(internal_jacobian_t) :: self
    integer :: i, next, s, work(size(incidence%first) - 1)   ! number of the work integral of each element, or 0

    work = 0
    work(with_work) = [(i, i=1, size(with_work))]
    self%before = before
    self%incidence = incidence%selected(internal%element, with_ratio_only=.false.)
    self%has_work_integral = work(internal%element) > 0
    next = size(self%incidence%coordinate) + sum(internal%members) + count(self%has_work_integral) &
           + count([(self%incidence%has_ratio(i), i=1, size(self%incidence%coordinate))])
    allocate (self%pattern%row(next), self%pattern%column(next))
    next = 1
    do s = 1, internal%count
      do i = self%incidence%first(s), self%incidence%first(s + 1) - 1
        call add_position(self%incidence%coordinate(i), 2 * freedoms + s, self%pattern, next)
        if (self%incidence%has_ratio(i)) call add_position(2 * freedoms + s, self%incidence%coordinate(i), self%pattern, next)
      end do
      do i = 0, internal%members(s) - 1
        call add_position(2 * freedoms + s, 2 * freedoms + internal%first(s) + i, self%pattern, next)
      end do
      if (self%has_work_integral(s)) then
        call add_position(2 * freedoms + internal%count + work(internal%element(s)), 2 * freedoms + s, self%pattern, next)
      end if
    end do
  end function new_internal_jacobian

  !> Appends a position.
  subroutine add_position(row, column, pattern, next)
    integer, intent(in) :: row, column
    type(pattern_t), intent(inout) :: pattern
    integer, intent(inout) :: next   !! index of the position; increased by one

    pattern%row(next) = row
    pattern%column(next) = column
    next = next + 1
  end subroutine add_position

  !> Computes the values at the positions of `pattern`, from the elements after `differentiate`.
  subroutine fill(self, elements, dfdy)
    class(internal_jacobian_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    real(wp), contiguous, intent(inout) :: dfdy(:, :)   !! [lanes, positions]
    integer :: at, i, s

    at = self%before
    associate (internal => elements%internal, incidence => self%incidence)
      do s = 1, internal%count
        do i = incidence%first(s), incidence%first(s + 1) - 1
          at = at + 1
          dfdy(:, at) = incidence%response(:, i) * internal%applied(:, s)
          if (.not. incidence%has_ratio(i)) cycle
          at = at + 1
          dfdy(:, at) = incidence%ratio(:, i) * internal%rate_speed(:, s)
        end do
        do i = 1, internal%members(s)
          dfdy(:, at + i) = internal%rate_internal(:, i, s)
        end do
        at = at + internal%members(s)
        if (.not. self%has_work_integral(s)) cycle
        at = at + 1
        dfdy(:, at) = elements%speed(:, internal%element(s)) * internal%applied(:, s)
      end do
    end associate
  end subroutine fill

  !> Registers the arrays whose values may differ from variant to variant.
  subroutine list_parameters(self, parameters)
    class(internal_jacobian_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%pattern%row, self%pattern%column)
    call self%incidence%list_parameters(parameters)
  end subroutine list_parameters

end module nocdyn_internal_jacobian
