!> The elements of a machine, numbered consecutively over all banks: the bodies they join, and their values and internal states
!> on a block of lanes.
module nocdyn_elements
  use nocdyn_element_rows, only: element_rows_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_elements

  !> The internal states of the elements, numbered consecutively over all banks, on a block of lanes.
  type, public :: internal_states_t
    integer :: count = 0
    integer, allocatable :: element(:)             !! element of each state, numbered in the machine, [states]
    integer, allocatable :: first(:)               !! the first state of that element, [states]
    integer, allocatable :: members(:)             !! number of states of that element, [states]
    real(wp), allocatable :: value(:, :)           !! [lanes, states] as `rate` to `rate_time`
    real(wp), allocatable :: rate(:, :)            !! by `evaluate_internal` of the banks
    ! by `differentiate`:
    real(wp), allocatable :: applied(:, :)         !! derivative of the element's `applied` moment by the state
    real(wp), allocatable :: rate_speed(:, :)      !! derivative of the rate by the element's speed
    real(wp), allocatable :: rate_time(:, :)       !! derivative of the rate by t
    real(wp), allocatable :: rate_internal(:, :, :)   !! derivatives of the rate by the element's states, [lanes, members, states]
  end type internal_states_t

  !> Derivatives of the moment of one element by the motion of another: of an element that has a phase by the one of its phase,
  !> and the other way round, one after the other. By `differentiate`; [lanes, pairs of an element with another] all.
  type, public :: cross_slopes_t
    integer :: count = 0
    integer, allocatable :: element(:)              !! whose moment, [pairs]
    integer, allocatable :: by(:)                   !! whose motion, [pairs]
    real(wp), allocatable :: restoring_angle(:, :)  !! derivative of `restoring` by u of the other
    real(wp), allocatable :: applied_angle(:, :)    !! derivative of `applied` by u of the other
    real(wp), allocatable :: applied_speed(:, :)    !! derivative of `applied` by u' of the other
    real(wp), allocatable :: curvature(:, :)        !! second derivative of `restoring` by u of the other
    real(wp), allocatable :: mixed(:, :)            !! derivative of `restoring` by u of the other and its own
  contains
    procedure :: clear
    procedure :: moved
    procedure :: mover
    procedure :: subtract_curvatures
  end type cross_slopes_t

  !> Every element acts along a row: u = sum of coefficient * phi(body). Its moment M(t, u, u') = restoring + applied acts on
  !> these bodies as coefficient * M.
  type, public :: elements_t
    integer :: count = 0
    type(element_rows_t) :: rows                   !! bodies and their coefficients
    real(wp), allocatable :: time(:)               !! t of the derivatives [s], [lanes]
    real(wp), allocatable :: angle(:, :)           !! u [rad], shape [lanes, elements] as all that follow
    real(wp), allocatable :: speed(:, :)           !! u' [rad/s]
    ! by `evaluate` of the banks:
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
    type(internal_states_t) :: internal
    type(cross_slopes_t) :: cross
  contains
    procedure :: gather
    procedure :: scatter
  end type elements_t

contains

  !> Elements along the given rows, at rest and without moments.
  function new_elements(lanes, rows, internal, phase) result(self)
    integer, intent(in) :: lanes
    type(element_rows_t), intent(in) :: rows
    integer, intent(in) :: internal(:)      !! internal states of each element, [elements]
    integer, intent(in), optional :: phase(:)   !! the phase of each element, an element as well, or 0; absent: none
    type(elements_t) :: self
    integer :: e, next
    type(internal_states_t) :: new_internal_states

    self%count = rows%count()
    self%rows = rows
    allocate (self%time(lanes), source=0.0_wp)
    allocate (self%angle(lanes, self%count), source=0.0_wp)
    allocate (self%speed, self%restoring, self%applied, source=self%angle)
    allocate (self%restoring_angle, self%restoring_curvature, source=self%angle)
    allocate (self%applied_angle, self%applied_speed, self%applied_time, source=self%angle)
    allocate (self%stored, self%kept, source=self%angle)
    ! states with the value 0
    new_internal_states%count = sum(internal)
    allocate (new_internal_states%element(new_internal_states%count), new_internal_states%first(new_internal_states%count), &
      new_internal_states%members(new_internal_states%count))
    next = 1
    do e = 1, size(internal)
      new_internal_states%element(next:next + internal(e) - 1) = e
      new_internal_states%first(next:next + internal(e) - 1) = next
      new_internal_states%members(next:next + internal(e) - 1) = internal(e)
      next = next + internal(e)
    end do
    allocate (new_internal_states%value(lanes, new_internal_states%count), source=0.0_wp)
    allocate (new_internal_states%rate, new_internal_states%applied, new_internal_states%rate_speed, &
      new_internal_states%rate_time, source=new_internal_states%value)
    allocate (new_internal_states%rate_internal(lanes, maxval([0, internal]), new_internal_states%count), source=0.0_wp)
    self%internal = new_internal_states
    self%cross = new_cross_slopes(lanes, [integer ::])
    if (present(phase)) self%cross = new_cross_slopes(lanes, phase)
  end function new_elements

  !> Of each element with a phase two pairs.
  pure function new_cross_slopes(lanes, phase) result(self)
    integer, intent(in) :: lanes
    integer, intent(in) :: phase(:)   !! of each element, or 0, [elements]
    type(cross_slopes_t) :: self
    integer :: e

    self%count = 2 * count(phase > 0)
    allocate (self%element(self%count), self%by(self%count))
    self%count = 0
    do e = 1, size(phase)
      if (phase(e) == 0) cycle
      self%element(self%count + 1:self%count + 2) = [e, phase(e)]
      self%by(self%count + 1:self%count + 2) = [phase(e), e]
      self%count = self%count + 2
    end do
    allocate (self%restoring_angle(lanes, self%count), source=0.0_wp)
    allocate (self%applied_angle, self%applied_speed, self%curvature, self%mixed, source=self%restoring_angle)
  end function new_cross_slopes

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
    class(cross_slopes_t), intent(in) :: self
    integer, intent(in) :: pair   !! or 0
    integer, intent(in) :: by     !! element that moves

    moved = by
    if (pair > 0) moved = merge(self%element(pair), 0, self%by(pair) == by)
  end function moved

  !> The element on whose motion the moment of another depends by a pair, in the same way.
  pure integer function mover(self, pair, element)
    class(cross_slopes_t), intent(in) :: self
    integer, intent(in) :: pair      !! or 0
    integer, intent(in) :: element   !! whose moment

    mover = element
    if (pair > 0) mover = merge(self%by(pair), 0, self%element(pair) == element)
  end function mover

  !> Leaves the mixed derivatives of the pairs of some elements, where `mixed` has half of the second derivatives along both
  !> angles.
  pure subroutine subtract_curvatures(self, first, elements, own)
    class(cross_slopes_t), intent(inout) :: self
    integer, intent(in) :: first      !! pair
    integer, intent(in) :: elements   !! how many
    real(wp), intent(in) :: own(:, :) !! second derivatives by their own angles, of all elements
    integer :: pair

    do pair = first, first + 2 * elements - 1
      self%mixed(:, pair) = self%mixed(:, pair) - 0.5_wp * (own(:, self%element(pair)) + self%curvature(:, pair))
    end do
  end subroutine subtract_curvatures

  !> Relative angles and speeds of the elements from the ones of the bodies.
  subroutine gather(self, phi, omega)
    class(elements_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: phi(:, 0:)     !! [lanes, ground and bodies] [rad]
    real(wp), contiguous, intent(in) :: omega(:, 0:)   !! [lanes, ground and bodies] [rad/s]

    call self%rows%combine(size(self%time), ubound(phi, 2), phi, self%angle)
    call self%rows%combine(size(self%time), ubound(omega, 2), omega, self%speed)
  end subroutine gather

  !> Sums the moments of the elements on the bodies and on the ground.
  subroutine scatter(self, torque)
    class(elements_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: torque(:, 0:)   !! [lanes, ground and bodies] [N m]
    real(wp) :: moment
    integer :: e, k, l

    torque(:, :) = 0.0_wp
    associate (rows => self%rows)
      if (size(self%time) == 1) then   ! in the same bits, without loops of one turn
        do e = 1, self%count
          moment = self%restoring(1, e) + self%applied(1, e)
          do k = rows%first(e), rows%first(e + 1) - 1
            torque(1, rows%body(k)) = torque(1, rows%body(k)) + rows%coefficient(k) * moment
          end do
        end do
        return
      end if
      do e = 1, self%count
        do k = rows%first(e), rows%first(e + 1) - 1
          do l = 1, size(self%time)
            moment = self%restoring(l, e) + self%applied(l, e)
            torque(l, rows%body(k)) = torque(l, rows%body(k)) + rows%coefficient(k) * moment
          end do
        end do
      end do
    end associate
  end subroutine scatter

end module nocdyn_elements
