!> Formulations whose states are the speeds and angles of all bodies, omega and phi: `paper` and `multiplier`.
module nocdyn_body_formulation
  use nocdyn_formulation, only: formulation_t
  use nocdyn_incidence, only: add_coefficients, add_moment
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_system, only: evaluation_fine
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: start_of_bodies, observe_bodies, jacobian_of_bodies   ! for extensions that add to them

  !> Extensions find the accelerations; the first 2n states are omega, phi, further states may follow.
  type, abstract, extends(formulation_t), public :: body_formulation_t
    real(wp), allocatable :: slope(:, :)         !! y' at the state last observed, [lanes, states + quadratures]
    integer, allocatable :: status(:)            !! of that evaluation, [lanes]
    real(wp), allocatable :: mobility(:, :, :)   !! omega' = mobility T, shape [bodies, bodies, lanes]
    real(wp), allocatable :: by_angle(:, :)      !! derivative of T by phi, [bodies, bodies], work space
    real(wp), allocatable :: by_speed(:, :)      !! derivative of T by omega
    real(wp), allocatable :: by_time(:)          !! derivative of T by t
  contains
    procedure :: attach_bodies
    procedure :: start => start_of_bodies
    procedure :: place
    procedure :: observe => observe_bodies
    procedure :: jacobian => jacobian_of_bodies
    procedure :: component_name
  end type body_formulation_t

contains

  subroutine attach_bodies(self, machine, states, audited)
    class(body_formulation_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: states   !! at least 2 * bodies
    logical, intent(in) :: audited
    integer :: l

    call self%attach(machine, audited)
    self%states = states
    allocate (self%slope(self%lanes, states + self%quadratures), source=0.0_wp)
    allocate (self%status(self%lanes), source=evaluation_fine)
    allocate (self%mobility(machine%bodies, machine%bodies, self%lanes))
    allocate (self%by_angle(machine%bodies, machine%bodies), self%by_speed(machine%bodies, machine%bodies))
    allocate (self%by_time(machine%bodies))
    do l = 1, self%lanes
      self%mobility(:, :, l) = machine%coordinates%mobility(l)
    end do
  end subroutine attach_bodies

  !> Start speeds and angles; further states and the works are zero.
  function start_of_bodies(self) result(y)
    class(body_formulation_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)

    allocate (y(self%lanes, self%states + self%quadratures), source=0.0_wp)
    y(:, :self%machine%bodies) = self%machine%start_speed
    y(:, self%machine%bodies + 1:2 * self%machine%bodies) = self%machine%start_angle
  end function start_of_bodies

  subroutine place(self, y)
    class(body_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: y(:, :)
    integer :: b

    do b = 1, self%machine%bodies
      self%omega(:, b) = y(:, b)
      self%phi(:, b) = y(:, self%machine%bodies + b)
    end do
  end subroutine place

  !> Evaluates the right-hand side, whose value stays in `slope`.
  subroutine observe_bodies(self, t, y)
    class(body_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)

    call self%derivative(t, y, self%slope, self%status)
  end subroutine observe_bodies

  !> omega' = mobility T(phi, omega, t), phi' = omega, and the works; further states are the extension's.
  subroutine jacobian_of_bodies(self, t, y, dfdy, dfdt, status)
    class(body_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    call fill_of_bodies(self, t, y, size(dfdt, 2), dfdy, dfdt)
  end subroutine jacobian_of_bodies

  !> The Jacobian, all of whose positions are kept, as the array that it then is.
  subroutine fill_of_bodies(self, t, y, components, dfdy, dfdt)
    class(body_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    integer, intent(in) :: components
    real(wp), intent(inout) :: dfdy(self%lanes, components, self%states)
    real(wp), intent(inout) :: dfdt(self%lanes, components)
    integer :: b, l, n

    n = self%machine%bodies
    call self%place(y)
    call self%machine%differentiate(t, self%phi, self%omega)
    dfdy = 0.0_wp
    dfdt = 0.0_wp
    do l = 1, self%lanes
      call differentiate_torques(self, l)
      do b = 1, n
        call multiply(self%mobility(:, :, l), self%by_speed(:, b), dfdy(l, :n, b))
        call multiply(self%mobility(:, :, l), self%by_angle(:, b), dfdy(l, :n, n + b))
        dfdy(l, n + b, b) = 1.0_wp
      end do
      call multiply(self%mobility(:, :, l), self%by_time, dfdt(l, :n))
      call differentiate_powers(self, l, dfdy(l, :, :), dfdt(l, :))
    end do
  end subroutine fill_of_bodies

  !> The derivatives of the torques T of one lane from those of the elements.
  subroutine differentiate_torques(self, lane)
    class(body_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: e

    self%by_angle(:, :) = 0.0_wp
    self%by_speed(:, :) = 0.0_wp
    self%by_time(:) = 0.0_wp
    associate (elements => self%machine%elements)
      call add_coefficients(elements%from, elements%to, -1.0_wp, elements%restoring_angle(lane, :), self%by_angle)
      call add_coefficients(elements%from, elements%to, -1.0_wp, elements%working_angle(lane, :), self%by_angle)
      call add_coefficients(elements%from, elements%to, -1.0_wp, elements%working_speed(lane, :), self%by_speed)
      do e = 1, size(elements%to)
        call add_moment(elements%from(e), elements%to(e), elements%working_time(lane, e), self%by_time)
      end do
    end associate
  end subroutine differentiate_torques

  !> The rows of the integrated works of one lane: the power is M u', M the working moment.
  subroutine differentiate_powers(self, lane, dfdy, dfdt)
    class(body_formulation_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(:)
    integer :: e, k, n

    n = self%machine%bodies
    associate (elements => self%machine%elements)
      do k = 1, self%quadratures
        e = self%machine%accounted(k)
        call add_moment(elements%from(e), elements%to(e), elements%working(lane, e) &
                        + elements%speed(lane, e) * elements%working_speed(lane, e), dfdy(self%states + k, :n))
        call add_moment(elements%from(e), elements%to(e), elements%speed(lane, e) * elements%working_angle(lane, e), &
                        dfdy(self%states + k, n + 1:2 * n))
        dfdt(self%states + k) = elements%working_time(lane, e) * elements%speed(lane, e)
      end do
    end associate
  end subroutine differentiate_powers

  pure subroutine multiply(matrix, vector, product)
    real(wp), intent(in) :: matrix(:, :), vector(:)
    real(wp), intent(inout) :: product(:)
    integer :: j

    product = 0.0_wp
    do j = 1, size(vector)
      product = product + matrix(:, j) * vector(j)
    end do
  end subroutine multiply

  function component_name(self, index) result(name)
    class(body_formulation_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    associate (n => self%machine%bodies)
      if (index <= n) then
        name = 'speed of ' // quoted(self%machine%names(index)%text)
      else if (index <= 2 * n) then
        name = 'angle of ' // quoted(self%machine%names(index - n)%text)
      else if (index <= self%states) then
        name = 'elastic moment on ' // quoted(self%machine%names(index - 2 * n)%text)
      else
        name = 'work of ' // quoted(self%machine%accounted_name(index - self%states))
      end if
    end associate
  end function component_name

end module nocdyn_body_formulation
