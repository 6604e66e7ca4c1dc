!> What the inner states of the elements add to the sparse Jacobian of the reduced formulation.
!>
!> An inner state z of an element with the speed u' = U q' changes at a rate r(u', z), and the moment M(z) of the element
!> acts on q'' = R M and on its work, W' = M u'.
module nocdyn_inner_jacobian
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_elements, only: elements_t
  use nocdyn_inner_states, only: inner_states_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: new_inner_jacobian

  !> The values are, for each inner state in turn: dq''/dz and, where it turns with the coordinate, dr/dq' of each entry of its
  !> element; dr/dz of each inner state of that element; dW'/dz if its work is integrated.
  type, public :: inner_jacobian_t
    type(pattern_t) :: pattern
    integer, private :: before = 0                          !! positions of the Jacobian before these
    type(element_coordinates_t), private :: incidence       !! of the element of each inner state
    logical, allocatable, private :: is_accounted(:)        !! [inner states]
  contains
    procedure :: fill
    procedure :: take_lane
    procedure :: list_numbers
  end type inner_jacobian_t

contains

  !> The positions; the rows of the inner states follow those of the coordinates, those of the works come last.
  function new_inner_jacobian(freedoms, incidence, accounted, inner, before) result(self)
    integer, intent(in) :: freedoms
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: accounted(:)   !! elements whose works follow the states
    type(inner_states_t), intent(in) :: inner
    integer, intent(in) :: before         !! positions of the Jacobian before these
    type(inner_jacobian_t) :: self
    integer :: i, next, s, work(size(incidence%first) - 1)   ! number of an element's work, or 0

    work = 0
    work(accounted) = [(i, i=1, size(accounted))]
    self%before = before
    self%incidence = incidence%selected(inner%element, turning=.false.)
    self%is_accounted = work(inner%element) > 0
    next = size(self%incidence%coordinate) + sum(inner%members) + count(self%is_accounted) &
           + count([(self%incidence%has_ratio(i), i=1, size(self%incidence%coordinate))])
    allocate (self%pattern%row(next), self%pattern%column(next))
    next = 1
    do s = 1, inner%count
      do i = self%incidence%first(s), self%incidence%first(s + 1) - 1
        call put(self%incidence%coordinate(i), 2 * freedoms + s, self%pattern, next)
        if (self%incidence%has_ratio(i)) call put(2 * freedoms + s, self%incidence%coordinate(i), self%pattern, next)
      end do
      do i = 0, inner%members(s) - 1
        call put(2 * freedoms + s, 2 * freedoms + inner%first(s) + i, self%pattern, next)
      end do
      if (self%is_accounted(s)) then
        call put(2 * freedoms + inner%count + work(inner%element(s)), 2 * freedoms + s, self%pattern, next)
      end if
    end do
  end function new_inner_jacobian

  subroutine put(row, column, pattern, next)
    integer, intent(in) :: row, column
    type(pattern_t), intent(inout) :: pattern
    integer, intent(inout) :: next

    pattern%row(next) = row
    pattern%column(next) = column
    next = next + 1
  end subroutine put

  !> The values at the positions of `pattern`, from the elements after `differentiate`.
  subroutine fill(self, elements, dfdy)
    class(inner_jacobian_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    real(wp), contiguous, intent(inout) :: dfdy(:, :)   !! [lanes, positions]
    integer :: at, i, s

    at = self%before
    associate (inner => elements%inner, incidence => self%incidence)
      do s = 1, inner%count
        do i = incidence%first(s), incidence%first(s + 1) - 1
          at = at + 1
          dfdy(:, at) = incidence%response(:, i) * inner%working(:, s)
          if (.not. incidence%has_ratio(i)) cycle
          at = at + 1
          dfdy(:, at) = incidence%ratio(:, i) * inner%rate_speed(:, s)
        end do
        do i = 1, inner%members(s)
          dfdy(:, at + i) = inner%rate_inner(:, i, s)
        end do
        at = at + inner%members(s)
        if (.not. self%is_accounted(s)) cycle
        at = at + 1
        dfdy(:, at) = elements%speed(:, inner%element(s)) * inner%working(:, s)
      end do
    end associate
  end subroutine fill

  !> The responses of one lane anew.
  pure subroutine take_lane(self, lane, incidence, inner)
    class(inner_jacobian_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(element_coordinates_t), intent(in) :: incidence
    type(inner_states_t), intent(in) :: inner

    call self%incidence%take_selected(lane, incidence, inner%element, turning=.false.)
  end subroutine take_lane

  subroutine list_numbers(self, numbers)
    class(inner_jacobian_t), target, intent(inout) :: self
    type(lane_numbers_t), intent(inout) :: numbers

    call numbers%remark(self%pattern%row)
    call numbers%remark(self%pattern%column)
    call self%incidence%list_numbers(numbers)
  end subroutine list_numbers

end module nocdyn_inner_jacobian
