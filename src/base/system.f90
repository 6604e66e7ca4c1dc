!> The contract between a model and an integrator: a first-order system on a block of lanes.
!>
!> A block holds `lanes` copies of one system with different numbers. Every array has the lane as its first,
!> contiguous index, so that each operation is a loop over lanes; one machine is a block of one lane. A lane
!> never reads another lane's numbers.
!>
!> The last `quadratures` components of a state are pure integrals: nothing depends on them, and they do not take
!> part in error control. An integrator solves linear systems only for the first `states` components.
!>
!> The Jacobian is a list of values at the positions that `jacobian_pattern` names once, before the integration: all
!> of them column by column unless a system knows better.
module nocdyn_system
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  integer, parameter, public :: evaluation_fine = 0       !! the values are good
  integer, parameter, public :: evaluation_shorten = 1    !! not admissible here: take a shorter step
  integer, parameter, public :: evaluation_give_up = 2    !! no shorter step will help

  !> Positions of the Jacobian's entries that can differ from zero, each at most once, in the order of their values.
  type, public :: pattern_t
    integer, allocatable :: row(:)      !! 1 to states + quadratures
    integer, allocatable :: column(:)   !! 1 to states
  end type pattern_t

  !> An ordinary differential equation y' = f(t, y) on a block of lanes, with its derivatives.
  type, abstract, public :: system_t
    integer :: lanes = 1         !! copies of the system in the block
    integer :: states = 0        !! components under error control
    integer :: quadratures = 0   !! components that follow them and only accumulate
  contains
    procedure(derivative_interface), deferred :: derivative
    procedure(jacobian_interface), deferred :: jacobian
    procedure :: jacobian_pattern
    procedure :: component_name
  end type system_t

  !> Receives the solution at the requested times, and may stop the integration.
  type, abstract, public :: observer_t
  contains
    procedure(record_interface), deferred :: record
    procedure(stops_interface), deferred :: stops
  end type observer_t

  abstract interface

    !> dydt = f(t, y); y and dydt have the shape [lanes, states + quadratures].
    subroutine derivative_interface(self, t, y, dydt, status)
      import :: system_t, wp
      class(system_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: t(:)           !! time of each lane
      real(wp), contiguous, intent(in) :: y(:, :)
      real(wp), contiguous, intent(inout) :: dydt(:, :)
      integer, contiguous, intent(inout) :: status(:)    !! evaluation_... of each lane
    end subroutine derivative_interface

    !> Partial derivatives of f with respect to the states, at the positions of `jacobian_pattern`, and to the time.
    subroutine jacobian_interface(self, t, y, dfdy, dfdt, status)
      import :: system_t, wp
      class(system_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: t(:)
      real(wp), contiguous, intent(in) :: y(:, :)
      real(wp), contiguous, intent(inout) :: dfdy(:, :)   !! [lanes, positions]
      real(wp), contiguous, intent(inout) :: dfdt(:, :)   !! [lanes, states + quadratures]
      integer, contiguous, intent(inout) :: status(:)
    end subroutine jacobian_interface

    !> One requested time of one lane; the calls of a lane come in the order of its times.
    subroutine record_interface(self, lane, t, y)
      import :: observer_t, wp
      class(observer_t), intent(inout) :: self
      integer, intent(in) :: lane
      real(wp), intent(in) :: t
      real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    end subroutine record_interface

    !> Asked after every step: true ends the integration.
    function stops_interface(self, t) result(stops)
      import :: observer_t, wp
      class(observer_t), intent(inout) :: self
      real(wp), intent(in) :: t   !! time reached by the slowest lane
      logical :: stops
    end function stops_interface

  end interface

contains

  !> All positions, column by column: dfdy may then be taken for an array of the shape [lanes, components, states].
  function jacobian_pattern(self) result(pattern)
    class(system_t), intent(in) :: self
    type(pattern_t) :: pattern
    integer :: i, j

    associate (components => self%states + self%quadratures)
      allocate (pattern%row(components * self%states), pattern%column(components * self%states))
      do j = 1, self%states
        do i = 1, components
          pattern%row(i + (j - 1) * components) = i
          pattern%column(i + (j - 1) * components) = j
        end do
      end do
    end associate
  end function jacobian_pattern

  !> What component `index` is called in a message, e.g. "speed of 'motor'".
  function component_name(self, index) result(name)
    class(system_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    name = 'component ' // to_text(index)
    if (index > self%states) name = 'quadrature ' // to_text(index - self%states)
  end function component_name

end module nocdyn_system
