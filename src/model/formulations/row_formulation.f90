!> Formulations with rows that hold beside the rows that determine the coordinates: locked joints, and rows that move
!> (`nocdyn_held_rows`), in a block of one lane.
!>
!> The rows that hold add their moments to the moments of the elements, so that q'' is the acceleration on the complement of all
!> rows. Where some move, errors of the integration would let the state leave them: after each step and before each observation
!> it is put back by the least change, weighted by the inertias; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration,
!> section IV.4.
!> Extensions say how elements move with the states, and how the states answer to the moments of elements.
module nocdyn_row_formulation
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: locked
  use nocdyn_joint_sets, only: new_joint_sets
  use nocdyn_kinds, only: wp
  use nocdyn_row_obstacles, only: describe_obstacle
  use nocdyn_system, only: evaluation_fatal
  implicit none (type, external)
  private

  type, abstract, extends(formulation_t), public :: row_formulation_t
    real(wp), allocatable :: acceleration(:)    !! of the first states, work space, [moving]
    real(wp), allocatable, private :: unit(:)   !! a speed or position that changes, work space, [moving]
    real(wp), allocatable, private :: rates(:)  !! of all elements with it, work space, [elements]
    real(wp), allocatable :: near(:)            !! a state that is observed, back on the rows that move; work space, [states]
    real(wp), allocatable :: joint_state(:, :)  !! work space, [1, states]
    integer, allocatable, private :: work_of(:) !! work integral of each joint whose moment does work, 0 of others, [joints]
  contains
    procedure(accelerate_interface), deferred :: accelerate
    procedure(rate_interface), deferred :: element_rate
    procedure(push_interface), deferred :: push_element
    procedure :: prepare_joints, joint_rate, joint_slip, push, move_rows, hold, find_accelerations
    procedure, private :: hold_accelerations
    procedure :: find_held_moments, clean_rates, add_powers, differentiate_rows, hold_derivative, hold_columns
    procedure, private :: hold_column, differentiate_drags
    procedure :: project, project_state, evaluation_obstacle
  end type row_formulation_t

  abstract interface

    !> The accelerations of the first states from the torques `torque` on the bodies, in a block of one lane.
    subroutine accelerate_interface(self, acceleration)
      import :: row_formulation_t, wp
      class(row_formulation_t), intent(inout) :: self
      real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [moving]
    end subroutine accelerate_interface

    !> The rate u' of an element from the speeds of the first states, or u'' from their accelerations.
    pure real(wp) function rate_interface(self, element, rates)
      import :: row_formulation_t, wp
      class(row_formulation_t), intent(in) :: self
      integer, intent(in) :: element
      real(wp), intent(in) :: rates(:)   !! [rad/s] or [rad/s2], [moving] at least
    end function rate_interface

    !> Adds what the moment or the impulse of an element does to the accelerations or speeds of the first states.
    pure subroutine push_interface(self, element, moment, rates)
      import :: row_formulation_t, wp
      class(row_formulation_t), intent(in) :: self
      integer, intent(in) :: element
      real(wp), intent(in) :: moment        !! [N m] or [N m s]
      real(wp), intent(inout) :: rates(:)   !! [moving] at least
    end subroutine push_interface

  end interface

contains

  !> The rate of the row of a joint from the speeds of the first states, a slip where it locks, or its derivative; a part of the
  !> latter where it moves.
  pure real(wp) function joint_rate(self, joint, rates)
    class(row_formulation_t), intent(in) :: self
    integer, intent(in) :: joint
    real(wp), intent(in) :: rates(:)   !! [rad/s] or [rad/s2], [moving] at least

    joint_rate = self%element_rate(self%joints%element(joint), rates)
    associate (driver => self%joints%driver(joint))
      if (driver > 0) joint_rate = joint_rate - self%joints%slope(joint) * self%element_rate(driver, rates)
    end associate
  end function joint_rate

  !> The rate of the row of a joint at a state, with what drives of a steady state turn.
  pure real(wp) function joint_slip(self, joint, y)
    class(row_formulation_t), intent(in) :: self
    integer, intent(in) :: joint
    real(wp), intent(in) :: y(:)   !! speeds of the first states [rad/s], [moving] at least

    joint_slip = self%joint_rate(joint, y)
    if (allocated(self%driven_rate)) joint_slip = joint_slip + self%driven_rate(self%joints%element(joint))
  end function joint_slip

  !> Adds what the moment or the impulse of a joint does to the accelerations or speeds of the first states.
  pure subroutine push(self, joint, moment, rates)
    class(row_formulation_t), intent(in) :: self
    integer, intent(in) :: joint
    real(wp), intent(in) :: moment        !! [N m] or [N m s]
    real(wp), intent(inout) :: rates(:)   !! [moving] at least

    call self%push_element(self%joints%element(joint), moment, rates)
    associate (driver => self%joints%driver(joint))
      if (driver > 0) call self%push_element(driver, -self%joints%slope(joint) * moment, rates)
    end associate
  end subroutine push

  !> Makes the joints of the machine anew, with how they act on one another in the first lane at the start: nothing of a motion
  !> before, which may have had other parameters, is left in them or in the laws.
  subroutine prepare_joints(self)
    class(row_formulation_t), intent(inout) :: self
    real(wp) :: twist(self%lanes, self%machine%elements%count)
    integer, allocatable :: elements(:)
    integer :: i, j

    self%joints = new_joint_sets(self%machine%banks, self%machine%switches, self%machine%elements%count)
    self%projects = self%joints%motions%count > 0
    self%follows_waves = self%joints%count > 0
    if (self%joints%count == 0) return
    self%acceleration = spread(0.0_wp, 1, size(self%moving))
    self%unit = self%acceleration
    self%rates = spread(0.0_wp, 1, self%machine%elements%count)
    self%near = spread(0.0_wp, 1, self%states)
    self%joint_state = reshape(spread(0.0_wp, 1, self%states), [1, self%states])
    self%work_of = [(merge(findloc(self%machine%with_work, self%joints%element(j), dim=1), 0, &
                           self%joints%driver(j) == 0 .and. (j > self%joints%locking .or. self%joints%has_teeth(j)) &
                           .and. self%quadratures > 0), j=1, self%joints%count)]
    elements = [self%joints%element, self%joints%driver]
    do j = 1, size(elements)
      if (elements(j) == 0) cycle
      self%acceleration(:) = 0.0_wp
      call self%push_element(elements(j), 1.0_wp, self%acceleration)
      do i = 1, size(elements)
        if (elements(i) > 0) self%joints%mutual(i, j) = self%element_rate(elements(i), self%acceleration)
      end do
    end do
    call self%joints%teeth%find_coefficients(self%machine%banks, self%machine%elements%rows, self%machine%coordinates, &
                                             self%machine%constraints%rows(), self%machine%bodies)
    twist = self%machine%start_twist()
    call self%joints%motions%set_start(self%machine%banks, self%state%banks, twist(1, :))
    call self%joints%start(self%machine%banks, self%state%banks)
  end subroutine prepare_joints

  !> The moments of the joints that hold at a state of a block of one lane, where the branches are known; they are put among
  !> the moments of the elements.
  subroutine find_held_moments(self, t, y)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t      !! [s]
    real(wp), intent(in) :: y(:)   !! [states]

    self%joint_state(1, :) = y
    call self%gather(self%joint_state)
    call self%state%evaluate_elements(self%machine, [t])
    call self%find_accelerations(t, self%acceleration)
  end subroutine find_held_moments

  !> The accelerations of the first states from the moments of the elements, to which the moments of the joints that hold are
  !> added.
  subroutine find_accelerations(self, t, acceleration)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t                    !! [s]
    real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [moving]

    call self%state%elements%scatter(self%machine%elements%rows, self%torque)
    call self%accelerate(acceleration)
    call self%hold_accelerations(t, acceleration)
  end subroutine find_accelerations

  !> Adds the moments of the joints that hold, and of teeth with losses, to the accelerations without them.
  subroutine hold_accelerations(self, t, acceleration)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t                    !! [s]
    real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [moving] at least

    call self%move_rows(t)
    associate (joints => self%joints, teeth => self%joints%teeth, elements => self%state%elements)
      if (teeth%count == 0) then
        call self%hold(joints%motions%acceleration, acceleration)
      else
        call teeth%apply(elements)
        call teeth%choose_shares(self%machine%banks, joints%mode, elements%speed(1, :))
        call self%hold(joints%motions%acceleration, acceleration, teeth%drag)
        call teeth%add_moments(joints%moment)
      end if
    end associate
  end subroutine hold_accelerations

  !> Moves the rows to the position of the elements.
  subroutine move_rows(self, t)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! [s]

    if (self%joints%motions%count == 0) return
    associate (elements => self%state%elements)
      call self%joints%motions%move(self%machine%banks, self%state%banks, t, elements%angle(1, :), elements%speed(1, :))
    end associate
    call self%joints%weigh()
  end subroutine move_rows

  !> Adds the moments of the joints that hold to the accelerations of the first states, and puts them among the moments of the
  !> elements.
  subroutine hold(self, demand, acceleration, drag, of_speeds)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: demand(:)            !! what the rates of the rows that move must be [rad/s2], [rows that move]
    real(wp), intent(inout) :: acceleration(:)   !! [rad/s2], [moving] at least; or speeds [rad/s]
    real(wp), intent(in), optional :: drag(:)    !! of teeth [N m], [losses]; absent: those that turn have no moments
    logical, intent(in), optional :: of_speeds   !! whether speeds are held, to which drives of a steady state add; absent: no
    integer :: j
    logical :: are_speeds

    are_speeds = .false.
    if (present(of_speeds)) are_speeds = of_speeds
    associate (joints => self%joints, applied => self%state%elements%applied)
      do j = 1, joints%count
        joints%rate(j) = self%joint_rate(j, acceleration)
        if (are_speeds) joints%rate(j) = self%joint_slip(j, acceleration)
        if (j > joints%locking) joints%rate(j) = joints%rate(j) - demand(j - joints%locking)
      end do
      call joints%find_moments(drag)
      do j = 1, joints%count
        if (.not. joints%is_active(j, present(drag))) cycle
        call self%push(j, joints%moment(j), acceleration)
        applied(1, joints%element(j)) = joints%moment(j)
        if (joints%driver(j) > 0) applied(1, joints%driver(j)) = -joints%slope(j) * joints%moment(j)
      end do
    end associate
  end subroutine hold

  !> Sets the accelerations of the joints without those that hold to zero where they are rounding errors of what the elements
  !> do to them, and so the torques of teeth; after `find_held_moments`. What has no load then is free of any.
  subroutine clean_rates(self)
    class(row_formulation_t), intent(inout) :: self
    real(wp), parameter :: rounding = 64.0_wp * epsilon(1.0_wp)
    real(wp), dimension(self%machine%elements%count) :: moment
    real(wp) :: size_of_terms(self%joints%count), response(size(self%moving))
    integer :: e, j

    associate (joints => self%joints, elements => self%state%elements)
      moment = abs(elements%applied(1, :)) + abs(elements%restoring(1, :))
      do j = 1, joints%count
        if (.not. joints%is_active(j, .true.)) cycle
        moment(joints%element(j)) = 0.0_wp
        if (joints%driver(j) > 0) moment(joints%driver(j)) = 0.0_wp
      end do
      size_of_terms = 0.0_wp
      size_of_terms(joints%locking + 1:) = abs(joints%motions%acceleration)
      do e = 1, size(elements%applied, 2)
        if (moment(e) <= 0) cycle
        response = 0.0_wp
        call self%push_element(e, moment(e), response)
        do j = 1, joints%count
          size_of_terms(j) = size_of_terms(j) + abs(self%joint_rate(j, response))
        end do
      end do
      where (abs(joints%rate) <= rounding * size_of_terms) joints%rate = 0.0_wp
      if (joints%teeth%count == 0) return
      where (abs(joints%teeth%applied) <= rounding * matmul(abs(joints%teeth%by_moment), moment)) joints%teeth%applied = 0.0_wp
    end associate
  end subroutine clean_rates

  !> Adds the powers of prescribed motions, and of teeth with losses, to the powers of the elements.
  subroutine add_powers(self, powers)
    class(row_formulation_t), intent(in) :: self
    real(wp), intent(inout) :: powers(:)   !! [W], [quadratures]
    integer :: j

    do j = 1, self%joints%count
      associate (k => self%work_of(j))
        if (k > 0) powers(k) = powers(k) + self%joints%moment(j) * self%state%elements%speed(1, self%joints%element(j))
      end associate
    end do
  end subroutine add_powers

  !> The derivatives by the position of the moments of the rows that move on their drivers, which turn with it; after
  !> `find_accelerations` and the derivatives of the laws. The moments and accelerations are kept for `hold_column`.
  subroutine differentiate_rows(self, acceleration)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: acceleration(:)   !! [rad/s2], [moving]
    integer :: i

    associate (joints => self%joints, motions => self%joints%motions, elements => self%state%elements)
      motions%held(:) = joints%moment(joints%locking + 1:)
      do i = 1, motions%count
        associate (driver => motions%driver(i))
          if (driver == 0) cycle
          motions%driver_acceleration(i) = self%element_rate(driver, acceleration)
          elements%applied_angle(1, driver) = elements%applied_angle(1, driver) - motions%g(2, i) * motions%held(i)
        end associate
      end do
    end associate
  end subroutine differentiate_rows

  !> Adds what the joints that hold do to a derivative, whose elements are evaluated.
  subroutine hold_derivative(self, components, t, dydt, status)
    class(row_formulation_t), intent(inout) :: self
    integer, intent(in) :: components             !! states + quadratures
    real(wp), intent(in) :: t                     !! [s]
    real(wp), intent(inout) :: dydt(components)   !! of the only lane
    integer, intent(inout) :: status

    call self%hold_accelerations(t, dydt(:size(self%moving)))
    call self%add_powers(dydt(self%states + 1:))
    if (self%joints%lost > 0) status = evaluation_fatal
  end subroutine hold_derivative

  !> Adds what the joints that hold do to a Jacobian with all positions, after `differentiate_rows`.
  subroutine hold_columns(self, components, dfdy, dfdt)
    class(row_formulation_t), intent(inout) :: self
    integer, intent(in) :: components                          !! states + quadratures
    real(wp), intent(inout) :: dfdy(components, self%states)   !! of the only lane
    real(wp), intent(inout) :: dfdt(components)
    integer :: k

    do k = 1, self%states
      call self%hold_column(k, dfdy(:size(self%moving), k), dfdy(self%states + 1:, k))
    end do
    call self%hold_column(0, dfdt(:size(self%moving)), dfdt(self%states + 1:))
  end subroutine hold_columns

  !> Adds what the joints that hold do to a column of the Jacobian.
  subroutine hold_column(self, column, accelerations, powers)
    class(row_formulation_t), intent(inout) :: self
    integer, intent(in) :: column                !! state; 0: derivatives by the time
    real(wp), intent(inout) :: accelerations(:)  !! derivatives of the accelerations of the first states without joints that
                                                 !! hold, [moving]
    real(wp), intent(inout) :: powers(:)         !! derivatives of the powers of the elements with work at these moments,
                                                 !! [quadratures]
    integer :: i

    associate (motions => self%joints%motions, n => size(self%moving), speed => self%state%elements%speed, unit => self%unit, &
               demand => self%joints%motions%demand)
      unit = 0.0_wp
      if (column > 0 .and. column <= 2 * n) unit(1 + modulo(column - 1, n)) = 1.0_wp
      do i = 1, motions%count
        demand(i) = merge(motions%g(3, i), 0.0_wp, column == 0 .and. motions%driver(i) == 0)
        if (motions%driver(i) == 0) cycle
        demand(i) = 2.0_wp * motions%g(2, i) * speed(1, motions%driver(i))
        if (column > n) demand(i) = motions%g(3, i) * speed(1, motions%driver(i))**2 &
                                    + motions%g(2, i) * motions%driver_acceleration(i)
        demand(i) = demand(i) * self%element_rate(motions%driver(i), unit)
      end do
      if (self%joints%teeth%count > 0) then
        call self%differentiate_drags(column)
        call self%hold(demand, accelerations, self%joints%teeth%drag)
      else
        call self%hold(demand, accelerations)
      end if
      call self%add_powers(powers)
    end associate
  end subroutine hold_column

  !> Replaces the drags of teeth by their derivatives by a state or the time.
  subroutine differentiate_drags(self, column)
    class(row_formulation_t), intent(inout) :: self
    integer, intent(in) :: column   !! as in `hold_column`, whose `unit` is the speed or the position that changes
    integer :: e

    associate (elements => self%state%elements, teeth => self%joints%teeth, n => size(self%moving), rates => self%rates, &
               pairs => self%machine%elements%cross, states => self%machine%elements%internal, &
               slope => self%joints%teeth%moment)
      do e = 1, size(elements%applied, 2)
        rates(e) = self%element_rate(e, self%unit)
      end do
      slope = 0.0_wp
      if (column == 0) then
        slope = elements%applied_time(1, :)
      else if (column <= n) then
        slope = elements%applied_speed(1, :) * rates
      else if (column <= 2 * n) then
        slope = (elements%restoring_angle(1, :) + elements%applied_angle(1, :)) * rates
      else if (column > self%mechanical) then
        slope(states%element(column - self%mechanical)) = elements%internal%applied(1, column - self%mechanical)
      end if
      do e = 1, merge(pairs%count, 0, column > 0)
        associate (x => elements%cross, by => rates(pairs%by(e)), moved => slope(pairs%element(e)))
          if (column <= n) moved = moved + x%applied_speed(1, e) * by
          if (column > n) moved = moved + (x%restoring_angle(1, e) + x%applied_angle(1, e)) * by
        end associate
      end do
      teeth%drag(:) = matmul(teeth%by_moment, slope)
      teeth%drag(:) = teeth%share * teeth%drag
      do e = 1, merge(teeth%count, 0, column > 0 .and. column <= n)
        teeth%drag(e) = teeth%drag(e) + teeth%share_slope(e) * teeth%load(e) * rates(self%joints%element(teeth%joint(e)))
      end do
    end associate
  end subroutine differentiate_drags

  !> Puts the state after a step back on the rows that move.
  subroutine project_state(self, lane, t, y)
    class(row_formulation_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)   !! [states + quadratures]

    if (lane == 1) call self%project(t, y)
  end subroutine project_state

  !> Puts a state of a block of one lane back on the rows that move: by the least changes of the positions and speeds, weighted by
  !> the inertias. Joints that are locked stay so.
  subroutine project(self, t, y)
    class(row_formulation_t), intent(inout) :: self
    real(wp), intent(in) :: t          !! [s]
    real(wp), intent(inout) :: y(:)    !! [states] at least
    integer, parameter :: most_steps = 8
    real(wp), parameter :: rounding = 4.0_wp * epsilon(1.0_wp), far = 1.0e-9_wp   ! relative to the terms of a row
    integer :: step

    associate (n => size(self%moving), motions => self%joints%motions, elements => self%state%elements)
      do step = 1, most_steps
        self%joint_state(1, :) = y(:self%states)
        call self%gather(self%joint_state)
        call self%move_rows(t)
        call motions%size_terms(elements%angle(1, :))
        if (all(abs(motions%position) <= rounding * motions%terms)) exit
        self%acceleration(:) = 0.0_wp
        motions%demand(:) = -motions%position
        call self%hold(motions%demand, self%acceleration)
        y(n + 1:2 * n) = y(n + 1:2 * n) + self%acceleration
      end do
      if (any(abs(motions%position) > far * motions%terms)) then
        self%joints%lost = self%joints%locking + maxloc(abs(motions%position) / motions%terms, dim=1)
      end if
      call self%hold(motions%speed, y(:n), of_speeds=.true.)
    end associate
  end subroutine project

  !> Where the rank of the rows that move has changed, or is about to, or they contradict one another.
  function evaluation_obstacle(self, lane) result(text)
    class(row_formulation_t), intent(in) :: self
    integer, intent(in) :: lane
    character(len=:), allocatable :: text

    call describe_obstacle(self%joints, self%machine%banks, self%machine%elements%rows, self%machine%coordinates, text)
  end function evaluation_obstacle

end module nocdyn_row_formulation
