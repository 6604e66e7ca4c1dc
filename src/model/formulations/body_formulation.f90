!> Formulations whose states are the speeds and angles of all bodies, omega and phi: `paper` and `multiplier`.
module nocdyn_body_formulation
  use nocdyn_element_coordinates, only: new_element_coordinates
  use nocdyn_element_sets, only: coupling_elements
  use nocdyn_error_measures, only: error_measures_t, new_error_measures
  use nocdyn_joint_formulation, only: joint_formulation_t, observe_with_joints
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  use nocdyn_system, only: evaluation_ok
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: start_of_bodies, observe_bodies, jacobian_of_bodies   ! for extensions that add to them

  !> Extensions compute the accelerations. The first 2n states are omega, phi; further mechanical states may follow.
  type, abstract, extends(joint_formulation_t), public :: body_formulation_t
    character(len=10) :: word = ''               !! name of the formulation in the input
    real(wp), allocatable :: slope(:, :)         !! y' at the last observed state, [lanes, states + quadratures]
    integer, allocatable :: status(:)            !! evaluation_... of that evaluation, [lanes]
    real(wp), allocatable :: mobility(:, :, :)   !! matrix of omega' = mobility T [1/(kg m2)], [bodies, bodies, lanes]
    ! work space of the Jacobian, one lane:
    real(wp), allocatable :: by_angle(:, :)   !! derivative of the torques T by phi [N m/rad], [bodies, bodies]
    real(wp), allocatable :: by_speed(:, :)   !! derivative of T by omega [N m s/rad], [bodies, bodies]
    real(wp), allocatable :: by_time(:)       !! derivative of T by t [N m/s], [bodies]
    real(wp), allocatable :: by_state(:)      !! derivative of T by an internal state, [bodies]
  contains
    procedure :: set_bodies
    procedure :: start => start_of_bodies
    procedure :: set_state
    procedure :: observe => observe_bodies
    procedure :: jacobian => jacobian_of_bodies
    procedure :: series_obstacle, switch_motion, accelerate, element_rate, push_element
  end type body_formulation_t

contains

  !> Counts the states of `machine` and allocates the work space.
  subroutine set_bodies(self, word, mechanical, with_energy_balance)
    class(body_formulation_t), intent(inout) :: self
    character(len=*), intent(in) :: word   !! name of the formulation in the input
    integer, intent(in) :: mechanical            !! number of mechanical states, at least 2 * bodies
    logical, intent(in) :: with_energy_balance   !! whether the powers of the elements `machine%with_work` are integrated
    integer :: b, i, k, l
    type(rigid_motions_t) :: motions
    integer, allocatable :: body(:), couplings(:), first(:)
    real(wp), allocatable :: coefficient(:)
    type(error_measures_t) :: norm

    self%word = word
    associate (machine => self%machine, n => self%machine%bodies)
      call self%allocate_state([(b, b=1, n)], mechanical, with_energy_balance)
      allocate (self%slope(self%lanes, self%states + self%quadratures), source=0.0_wp)
      allocate (self%status(self%lanes), source=evaluation_ok)
      allocate (self%mobility(n, n, self%lanes), self%by_angle(n, n), self%by_speed(n, n), self%by_time(n), self%by_state(n))
      do l = 1, self%lanes
        self%mobility(:, :, l) = machine%coordinates%mobility(l)
      end do
      allocate (self%zero_twist(self%lanes, machine%elements%count), source=0.0_wp)
      ! the measures of errors: every state is one body's
      motions = new_rigid_motions(machine%coordinates%freedoms, &
                                  new_element_coordinates(machine%elements, machine%coordinates), machine%elastic())
      allocate (couplings, source=coupling_elements(machine))
      allocate (body(0), coefficient(0))
      allocate (first(size(couplings) + 1), source=1)
      do i = 1, size(couplings)
        associate (rows => machine%elements%rows)
          do k = rows%first(couplings(i) + 1) - 1, rows%first(couplings(i)), -1
            if (rows%body(k) == 0) cycle
            body = [body, rows%body(k)]
            coefficient = [coefficient, rows%coefficient(k)]
          end do
        end associate
        first(i + 1) = size(body) + 1
      end do
      norm = new_error_measures(couplings, first, body, spread(coefficient, 1, machine%lanes), &
                                machine%coordinates%body(motions%free), machine%bodies, self%states, without_bands=.true.)
      call self%set_norm(norm)
    end associate
    call self%prepare_joints()
  end subroutine set_bodies

  !> Start speeds, angles and internal states; further mechanical states and the work integrals are zero.
  function start_of_bodies(self) result(y)
    class(body_formulation_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)

    allocate (y(self%lanes, self%states + self%quadratures), source=0.0_wp)
    y(:, :self%machine%bodies) = self%machine%start_speed
    y(:, self%machine%bodies + 1:2 * self%machine%bodies) = self%machine%start_angle
    y(:, self%mechanical + 1:self%states) = self%machine%start_internal()
  end function start_of_bodies

  !> Copies the speeds and angles of the bodies and the internal states from the state.
  subroutine set_state(self, y)
    class(body_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: y(:, :)   !! state, [lanes, states], at least
    integer :: b

    do b = 1, self%machine%bodies
      self%omega(:, b) = y(:, b)
      self%phi(:, b) = y(:, self%machine%bodies + b)
    end do
    if (self%internal > 0) self%state%elements%internal%value(:, :) = y(:, self%mechanical + 1:self%states)
  end subroutine set_state

  !> Evaluates the right-hand side at a state and keeps it in `slope`.
  subroutine observe_bodies(self, t, y, in_motion)
    class(body_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! state, [lanes, states], at least
    logical, intent(in), optional :: in_motion    !! as in `observe_elements`

    if (self%joints%count > 0) then
      call observe_with_joints(self, t, y, in_motion)
      call self%derivative(t, self%near, self%slope, self%status)
      call self%state%elements%scatter(self%machine%elements%rows, self%torque)
      return
    end if
    if (self%switches > 0) then
      call self%gather(y)
      call self%state%choose_branches(self%machine, t)
    end if
    call self%derivative(t, y, self%slope, self%status)
  end subroutine observe_bodies

  !> Relative angle and speed of the element of a switch, and of its phase.
  pure subroutine switch_motion(self, lane, switch, y, motion)
    class(body_formulation_t), intent(in) :: self
    integer, intent(in) :: lane, switch
    real(wp), contiguous, intent(in) :: y(:)   !! state, [states + quadratures]
    real(wp), intent(out) :: motion(4)         !! [rad], [rad/s], twice
    integer :: e, k, port

    motion = 0.0_wp
    associate (n => self%machine%bodies, rows => self%machine%elements%rows, switches => self%machine%switches)
      do port = 1, 2
        e = switches%moving(merge(switches%place(switch), switches%phase_place(switch), port == 1))
        associate (angle => motion(2 * port - 1), speed => motion(2 * port))
          do k = rows%first(e), rows%first(e + 1) - 1
            if (rows%body(k) == 0) cycle
            angle = angle + rows%coefficient(k) * y(n + rows%body(k))
            speed = speed + rows%coefficient(k) * y(rows%body(k))
          end do
        end associate
      end do
    end associate
  end subroutine switch_motion

  !> The Jacobian of omega' = mobility T(phi, omega, t), phi' = omega and the work integrals. Rows of further mechanical states
  !> are left zero; the extension fills them.
  subroutine jacobian_of_bodies(self, t, y, dfdy, dfdt, status)
    class(body_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)                                         !! [s]
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)         !! state
    real(wp), contiguous, intent(inout) :: dfdy(:, :)                             !! [lanes, positions]
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)   !! derivative by the time
    integer, intent(inout) :: status(self%lanes)

    call fill_of_bodies(self, t, y, size(dfdt, 2), dfdy, dfdt)
  end subroutine jacobian_of_bodies

  !> The Jacobian as a dense array, as `jacobian_pattern` names all positions.
  subroutine fill_of_bodies(self, t, y, components, dfdy, dfdt)
    class(body_formulation_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)                               !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)                            !! state, [lanes, states], at least
    integer, intent(in) :: components                                      !! states + quadratures
    real(wp), intent(inout) :: dfdy(self%lanes, components, self%states)   !! derivative by the states
    real(wp), intent(inout) :: dfdt(self%lanes, components)                !! derivative by the time
    integer :: b, l, n

    n = self%machine%bodies
    call self%gather(y)
    call self%state%evaluate_elements(self%machine, t)
    call self%state%differentiate_elements(self%machine, t)
    dfdy = 0.0_wp
    dfdt = 0.0_wp
    if (self%joints%count > 0) then
      call self%find_accelerations(t(1), self%acceleration)
      call self%differentiate_rows(self%acceleration)
    end if
    do l = 1, self%lanes
      call differentiate_torques(self, l)
      do b = 1, n
        call multiply(self%mobility(:, :, l), self%by_speed(:, b), dfdy(l, :n, b))
        call multiply(self%mobility(:, :, l), self%by_angle(:, b), dfdy(l, :n, n + b))
        dfdy(l, n + b, b) = 1.0_wp
      end do
      call multiply(self%mobility(:, :, l), self%by_time, dfdt(l, :n))
      call differentiate_powers(self, l, dfdy(l, :, :), dfdt(l, :))
      call differentiate_internal(self, l, dfdy(l, :, :))
      dfdt(l, self%mechanical + 1:self%states) = self%state%elements%internal%rate_time(l, :)
    end do
    if (self%joints%count > 0) call self%hold_columns(components, dfdy(1, :, :), dfdt(1, :))
  end subroutine fill_of_bodies

  !> Derivatives of the torques T of one lane, from the derivatives of the moments of the elements.
  subroutine differentiate_torques(self, lane)
    class(body_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: e

    self%by_angle(:, :) = 0.0_wp
    self%by_speed(:, :) = 0.0_wp
    self%by_time(:) = 0.0_wp
    associate (elements => self%state%elements, rows => self%machine%elements%rows, pairs => self%machine%elements%cross)
      call rows%add_coefficients(-1.0_wp, elements%restoring_angle(lane, :), self%by_angle)
      call rows%add_coefficients(-1.0_wp, elements%applied_angle(lane, :), self%by_angle)
      call rows%add_coefficients(-1.0_wp, elements%applied_speed(lane, :), self%by_speed)
      do e = 1, pairs%count
        associate (x => elements%cross, i => pairs%element(e), by => pairs%by(e))
          call rows%add_product(i, by, x%restoring_angle(lane, e) + x%applied_angle(lane, e), self%by_angle)
          call rows%add_product(i, by, x%applied_speed(lane, e), self%by_speed)
        end associate
      end do
      do e = 1, size(elements%applied, 2)
        call rows%add_moment(e, elements%applied_time(lane, e), self%by_time)
      end do
    end associate
  end subroutine differentiate_torques

  !> The rows of the work integrals of one lane. The power is M u' with the applied torque M and the relative speed u'.
  subroutine differentiate_powers(self, lane, dfdy, dfdt)
    class(body_formulation_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: dfdy(:, :)   !! [states + quadratures, states]
    real(wp), intent(inout) :: dfdt(:)      !! [states + quadratures]
    integer :: c, e, k, n

    n = self%machine%bodies
    associate (elements => self%state%elements, rows => self%machine%elements%rows, pairs => self%machine%elements%cross)
      do k = 1, self%quadratures
        e = self%machine%with_work(k)
        call rows%add_moment(e, elements%applied(lane, e) &
                             + elements%speed(lane, e) * elements%applied_speed(lane, e), dfdy(self%states + k, :n))
        call rows%add_moment(e, elements%speed(lane, e) * elements%applied_angle(lane, e), &
                             dfdy(self%states + k, n + 1:2 * n))
        dfdt(self%states + k) = elements%applied_time(lane, e) * elements%speed(lane, e)
        do c = 1, pairs%count
          if (pairs%element(c) /= e) cycle
          associate (cross => elements%cross, by => pairs%by(c), row => self%states + k)
            call rows%add_moment(by, elements%speed(lane, e) * cross%applied_speed(lane, c), dfdy(row, :n))
            call rows%add_moment(by, elements%speed(lane, e) * cross%applied_angle(lane, c), dfdy(row, n + 1:2 * n))
          end associate
        end do
      end do
    end associate
  end subroutine differentiate_powers

  !> The columns and rows of the internal states of one lane.
  subroutine differentiate_internal(self, lane, dfdy)
    class(body_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: dfdy(:, :)   !! [states + quadratures, states]
    integer :: e, i, k, n, s

    n = self%machine%bodies
    associate (elements => self%state%elements, internal => self%state%elements%internal, rows => self%machine%elements%rows, &
               states => self%machine%elements%internal)
      do s = 1, self%internal
        e = states%element(s)
        self%by_state(:) = 0.0_wp
        call rows%add_moment(e, internal%applied(lane, s), self%by_state)
        call multiply(self%mobility(:, :, lane), self%by_state, dfdy(:n, self%mechanical + s))
        call rows%add_moment(e, internal%rate_speed(lane, s), dfdy(self%mechanical + s, :n))
        do i = 1, states%members(s)
          dfdy(self%mechanical + s, self%mechanical + states%first(s) + i - 1) = internal%rate_internal(lane, i, s)
        end do
        do k = 1, self%quadratures
          if (self%machine%with_work(k) /= e) cycle
          dfdy(self%states + k, self%mechanical + s) = elements%speed(lane, e) * internal%applied(lane, s)
        end do
      end do
    end associate
  end subroutine differentiate_internal

  !> omega' = mobility T.
  subroutine accelerate(self, acceleration)
    class(body_formulation_t), intent(inout) :: self
    real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [bodies]

    call multiply(self%mobility(:, :, 1), self%torque(1, 1:), acceleration)
  end subroutine accelerate

  !> The rate of an element.
  pure real(wp) function element_rate(self, element, rates)
    class(body_formulation_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: rates(:)   !! omega [rad/s] or omega' [rad/s2], [bodies] at least
    integer :: k

    element_rate = 0.0_wp
    associate (rows => self%machine%elements%rows)
      do k = rows%first(element), rows%first(element + 1) - 1
        if (rows%body(k) > 0) element_rate = element_rate + rows%coefficient(k) * rates(rows%body(k))
      end do
    end associate
  end function element_rate

  !> Adds the response to the moment or the impulse of an element.
  pure subroutine push_element(self, element, moment, rates)
    class(body_formulation_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: moment        !! [N m] or [N m s]
    real(wp), intent(inout) :: rates(:)   !! [bodies] at least
    integer :: k

    associate (rows => self%machine%elements%rows, n => self%machine%bodies)
      do k = rows%first(element), rows%first(element + 1) - 1
        if (rows%body(k) > 0) rates(:n) = rates(:n) + rows%coefficient(k) * moment * self%mobility(:, rows%body(k), 1)
      end do
    end associate
  end subroutine push_element

  !> Product of a matrix and a vector, added up column by column.
  pure subroutine multiply(matrix, vector, product)
    real(wp), intent(in) :: matrix(:, :), vector(:)
    real(wp), intent(inout) :: product(:)
    integer :: j

    product = 0.0_wp
    do j = 1, size(vector)
      product = product + matrix(:, j) * vector(j)
    end do
  end subroutine multiply

  !> Only the reduced formulation has a Taylor series.
  subroutine series_obstacle(self, obstacle)
    class(body_formulation_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: obstacle

    obstacle = 'formulation ' // quoted(trim(self%word)) // " has no Taylor series; 'reduced' has one"
  end subroutine series_obstacle

end module nocdyn_body_formulation
