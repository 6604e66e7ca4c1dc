!> The internal states of the elements of a machine, numbered consecutively over all banks, on a block of lanes.
module nocdyn_internal_states
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_internal_states

  type, public :: internal_states_t
    integer :: count = 0
    integer, allocatable :: element(:)             !! element of each state, numbered in the machine, [states]
    integer, allocatable :: first(:)               !! the first state of that element, [states]
    integer, allocatable :: members(:)             !! number of states of that element, [states]
    real(wp), allocatable :: value(:, :)           !! [lanes, states] as `rate`, `applied` and `rate_speed`
    real(wp), allocatable :: rate(:, :)            !! by `evaluate_internal` of the banks
    ! by `differentiate`:
    real(wp), allocatable :: applied(:, :)         !! derivative of the element's `applied` moment by the state
    real(wp), allocatable :: rate_speed(:, :)      !! derivative of the rate by the element's speed
    real(wp), allocatable :: rate_internal(:, :, :)   !! derivatives of the rate by the element's states, [lanes, members, states]
  end type internal_states_t

contains

  !> States with the value 0.
  function new_internal_states(lanes, members) result(self)
    integer, intent(in) :: lanes
    integer, intent(in) :: members(:)   !! number of states of each element of the machine, [elements]
    type(internal_states_t) :: self
    integer :: e, next

    self%count = sum(members)
    allocate (self%element(self%count), self%first(self%count), self%members(self%count))
    next = 1
    do e = 1, size(members)
      self%element(next:next + members(e) - 1) = e
      self%first(next:next + members(e) - 1) = next
      self%members(next:next + members(e) - 1) = members(e)
      next = next + members(e)
    end do
    allocate (self%value(lanes, self%count), source=0.0_wp)
    allocate (self%rate, self%applied, self%rate_speed, source=self%value)
    allocate (self%rate_internal(lanes, maxval([0, members]), self%count), source=0.0_wp)
  end function new_internal_states

end module nocdyn_internal_states
