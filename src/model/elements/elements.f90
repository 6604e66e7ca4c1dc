!> The elements of a machine, numbered consecutively over all banks: the bodies they join and their internal states; apart from
!> them their values on a block of lanes.
module nocdyn_elements
  use nocdyn_element_rows, only: element_rows_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_elements, new_element_values

  !> The internal states of the elements, numbered consecutively over all banks.
  type, public :: internal_states_t
    integer :: count = 0
    integer, allocatable :: element(:)             !! element of each state, numbered in the machine, [states]
    integer, allocatable :: first(:)               !! the first state of that element, [states]
    integer, allocatable :: members(:)             !! number of states of that element, [states]
  end type internal_states_t

  !> Pairs of an element with another by whose motion its moment changes: of an element that has a phase with the one of its
  !> phase, and the other way round, one after the other.
  type, public :: cross_pairs_t
    integer :: count = 0
    integer, allocatable :: element(:)              !! whose moment, [pairs]
    integer, allocatable :: by(:)                   !! whose motion, [pairs]
  contains
    procedure :: moved
    procedure :: mover
  end type cross_pairs_t

  !> Every element acts along a row: u = sum of coefficient * phi(body). Its moment M(t, u, u') = restoring + applied acts on
  !> these bodies as coefficient * M.
  type, public :: elements_t
    integer :: count = 0
    type(element_rows_t) :: rows                   !! bodies and their coefficients
    type(internal_states_t) :: internal
    type(cross_pairs_t) :: cross
  end type elements_t

  !> The values of `internal_states_t`, [lanes, states] all but one.
  type, public :: internal_values_t
    real(wp), allocatable :: value(:, :)
    real(wp), allocatable :: rate(:, :)            !! by `evaluate` of the laws
    ! by `differentiate`:
    real(wp), allocatable :: applied(:, :)         !! derivative of the element's `applied` moment by the state
    real(wp), allocatable :: rate_speed(:, :)      !! derivative of the rate by the element's speed
    real(wp), allocatable :: rate_time(:, :)       !! derivative of the rate by t
    real(wp), allocatable :: rate_internal(:, :, :)   !! derivatives of the rate by the element's states, [lanes, members, states]
  end type internal_values_t

  !> Derivatives of the moment of one element by the motion of another, of `cross_pairs_t`; by `differentiate`, [lanes, pairs].
  type, public :: cross_slopes_t
    real(wp), allocatable :: restoring_angle(:, :)  !! derivative of `restoring` by u of the other
    real(wp), allocatable :: applied_angle(:, :)    !! derivative of `applied` by u of the other
    real(wp), allocatable :: applied_speed(:, :)    !! derivative of `applied` by u' of the other
    real(wp), allocatable :: curvature(:, :)        !! second derivative of `restoring` by u of the other
    real(wp), allocatable :: mixed(:, :)            !! derivative of `restoring` by u of the other and its own
  contains
    procedure :: clear
  end type cross_slopes_t

  !> Motions, moments and energies of all elements.
  type, public :: element_values_t
    real(wp), allocatable :: time(:)               !! t of the derivatives [s], [lanes]
    real(wp), allocatable :: angle(:, :)           !! u [rad], shape [lanes, elements] as all that follow
    real(wp), allocatable :: speed(:, :)           !! u' [rad/s]
    ! by `evaluate` of the laws:
    real(wp), allocatable :: restoring(:, :)       !! conservative part of M, a function of u only [N m]
    real(wp), allocatable :: applied(:, :)         !! the rest of M, whose power enters or leaves the machine [N m]
    ! by `differentiate`:
    real(wp), allocatable :: restoring_angle(:, :)       !! derivative of `restoring` by u
    real(wp), allocatable :: restoring_curvature(:, :)   !! second derivative of `restoring` by u
    real(wp), allocatable :: applied_angle(:, :)         !! derivative of `applied` by u
    real(wp), allocatable :: applied_speed(:, :)         !! derivative of `applied` by u'
    real(wp), allocatable :: applied_time(:, :)          !! derivative of `applied` by t
    ! by `evaluate_energies`:
    real(wp), allocatable :: stored(:, :)          !! potential energy of `restoring`, and what is kept [J]
    real(wp), allocatable :: kept(:, :)            !! energy that internal states keep: a part of the work of `applied` [J]
    type(internal_values_t) :: internal
    type(cross_slopes_t) :: cross
  contains
    procedure :: gather
    procedure :: scatter
  end type element_values_t

contains

  !> Elements along the given rows.
  function new_elements(rows, internal, phase) result(self)
    type(element_rows_t), intent(in) :: rows
    integer, intent(in) :: internal(:)      !! internal states of each element, [elements]
    integer, intent(in), optional :: phase(:)   !! the phase of each element, an element as well, or 0; absent: none
    type(elements_t) :: self
    integer :: e, next

    self%count = rows%count()
    self%rows = rows
    associate (states => self%internal)
      states%count = sum(internal)
      allocate (states%element(states%count), states%first(states%count), states%members(states%count))
      next = 1
      do e = 1, size(internal)
        states%element(next:next + internal(e) - 1) = e
        states%first(next:next + internal(e) - 1) = next
        states%members(next:next + internal(e) - 1) = internal(e)
        next = next + internal(e)
      end do
    end associate
    allocate (self%cross%element(0), self%cross%by(0))
    if (.not. present(phase)) return
    do e = 1, size(phase)
      if (phase(e) == 0) cycle
      self%cross%element = [self%cross%element, e, phase(e)]
      self%cross%by = [self%cross%by, phase(e), e]
    end do
    self%cross%count = size(self%cross%by)
  end function new_elements

  !> The values of elements at rest and without moments; internal states are 0.
  function new_element_values(elements, lanes) result(self)
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: lanes
    type(element_values_t) :: self

    allocate (self%time(lanes), source=0.0_wp)
    allocate (self%angle(lanes, elements%count), source=0.0_wp)
    allocate (self%speed, self%restoring, self%applied, source=self%angle)
    allocate (self%restoring_angle, self%restoring_curvature, source=self%angle)
    allocate (self%applied_angle, self%applied_speed, self%applied_time, source=self%angle)
    allocate (self%stored, self%kept, source=self%angle)
    associate (states => self%internal, count => elements%internal%count)
      allocate (states%value(lanes, count), states%rate(lanes, count), states%applied(lanes, count), source=0.0_wp)
      allocate (states%rate_speed(lanes, count), states%rate_time(lanes, count), source=0.0_wp)
      allocate (states%rate_internal(lanes, maxval([0, elements%internal%members]), count), source=0.0_wp)
    end associate
    associate (cross => self%cross, count => elements%cross%count)
      allocate (cross%restoring_angle(lanes, count), cross%applied_angle(lanes, count), source=0.0_wp)
      allocate (cross%applied_speed(lanes, count), cross%curvature(lanes, count), cross%mixed(lanes, count), source=0.0_wp)
    end associate
  end function new_element_values

  !> Sets the derivatives to zero.
  pure subroutine clear(self)
    class(cross_slopes_t), intent(inout) :: self

    self%restoring_angle(:, :) = 0.0_wp
    self%applied_angle(:, :) = 0.0_wp
    self%applied_speed(:, :) = 0.0_wp
    self%curvature(:, :) = 0.0_wp
    self%mixed(:, :) = 0.0_wp
  end subroutine clear

  !> The element whose moment depends on the motion of another by a pair, 0 if the pair is none of its; by pair 0 its own.
  pure integer function moved(self, pair, by)
    class(cross_pairs_t), intent(in) :: self
    integer, intent(in) :: pair   !! or 0
    integer, intent(in) :: by     !! element that moves

    moved = by
    if (pair > 0) moved = merge(self%element(pair), 0, self%by(pair) == by)
  end function moved

  !> The element on whose motion the moment of another depends by a pair, in the same way.
  pure integer function mover(self, pair, element)
    class(cross_pairs_t), intent(in) :: self
    integer, intent(in) :: pair      !! or 0
    integer, intent(in) :: element   !! whose moment

    mover = element
    if (pair > 0) mover = merge(self%by(pair), 0, self%element(pair) == element)
  end function mover

  !> Relative angles and speeds of the elements from the ones of the bodies.
  subroutine gather(self, rows, phi, omega)
    class(element_values_t), intent(inout) :: self
    type(element_rows_t), intent(in) :: rows           !! of the elements
    real(wp), contiguous, intent(in) :: phi(:, 0:)     !! [lanes, ground and bodies] [rad]
    real(wp), contiguous, intent(in) :: omega(:, 0:)   !! [lanes, ground and bodies] [rad/s]

    call rows%combine(size(self%time), ubound(phi, 2), phi, self%angle)
    call rows%combine(size(self%time), ubound(omega, 2), omega, self%speed)
  end subroutine gather

  !> Sums the moments of the elements on the bodies and on the ground.
  subroutine scatter(self, rows, torque)
    class(element_values_t), intent(in) :: self
    type(element_rows_t), intent(in) :: rows               !! of the elements
    real(wp), contiguous, intent(inout) :: torque(:, 0:)   !! [lanes, ground and bodies] [N m]
    real(wp) :: moment
    integer :: e, k, l

    torque(:, :) = 0.0_wp
    if (size(self%time) == 1) then   ! in the same bits, without loops of one turn
      do e = 1, size(self%applied, 2)
        moment = self%restoring(1, e) + self%applied(1, e)
        do k = rows%first(e), rows%first(e + 1) - 1
          torque(1, rows%body(k)) = torque(1, rows%body(k)) + rows%coefficient(k) * moment
        end do
      end do
      return
    end if
    do e = 1, size(self%applied, 2)
      do k = rows%first(e), rows%first(e + 1) - 1
        do l = 1, size(self%time)
          moment = self%restoring(l, e) + self%applied(l, e)
          torque(l, rows%body(k)) = torque(l, rows%body(k)) + rows%coefficient(k) * moment
        end do
      end do
    end do
  end subroutine scatter

end module nocdyn_elements
