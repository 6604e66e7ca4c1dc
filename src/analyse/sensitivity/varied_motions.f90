!> A motion with its derivatives by numbers of the machine: the variational equations s' = f_y s + f_p along the motion y' = f.
!>
!> f_y is the Jacobian of the machine; f_p are differences of f between machines with a number changed, at the state of the
!> machine itself. The states are y and, for each number p, s = |p| dy/dp. Where a law changes its branch at a time tau, which
!> moves with the numbers, s jumps by (f before - f after) dtau/dp.
!>
!> N. J. Kong, J. J. Payne, J. Zhu, A. M. Johnson, Saltation Matrices: The Essential Tool for Linearizing Hybrid Dynamical
!> Systems, arXiv:2306.06862, 2023, derive the jump; here the state is continuous, and numbers move the time of the change too.
module nocdyn_varied_motions
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_system, only: evaluation_ok, pattern_t, system_t
  use nocdyn_varied_keys, only: run_points, varied_key_t
  implicit none (type, external)
  private

  !> The equations of a machine without an energy balance, laid out as those of lanes.
  type, public :: formulation_slot_t
    class(reduced_t), allocatable :: its
  end type formulation_slot_t

  !> Machines with a number changed, at the points of its key.
  type, public :: changed_pair_t
    type(varied_key_t) :: key
    real(wp) :: scale = 1.0_wp              !! |p|
    type(formulation_slot_t) :: near(run_points)
    real(wp), allocatable :: start(:)       !! s at the start, [states of the machine]
  end type changed_pair_t

  !> Changed machines in the lanes of one formulation, which evaluates them together.
  type :: changed_lanes_t
    class(reduced_t), allocatable :: its
    integer, allocatable :: number(:), point(:)     ! in `changed`, and of its points, of the first lanes
    integer, allocatable :: status(:)               ! work space, as all that follow
    real(wp), allocatable :: t(:), y(:, :), f(:, :)
  end type changed_lanes_t

  type, extends(system_t), public :: varied_motion_t
    class(reduced_t), allocatable :: machine        !! without an energy balance
    integer :: numbers = 0
    type(changed_pair_t), allocatable :: changed(:) !! the first `numbers` are in use
    type(changed_lanes_t), allocatable, private :: blocks(:)
    logical, allocatable, private :: is_alone(:, :) !! whether a changed machine fits no lane, [run points, numbers]
    integer :: own = 0                              !! states of the machine
    type(pattern_t), private :: pattern             !! of its Jacobian
    real(wp), allocatable, private :: dfdy(:, :), dfdt(:, :), f(:, :)   !! work space
    real(wp), private :: duration = 0.0_wp          !! up to the end [s]
  contains
    procedure :: prepare, start, of_number, relative_size, by_number
    procedure :: derivative, jacobian, prepare_integration, measure, measure_name, component_name, limit_steps
    procedure :: start_lane, indicator_values, set_indicator, find_fastest_wave, change_branch, switch_name
  end type varied_motion_t

contains

  !> Forms the equations, after `machine` and `changed` have been set.
  subroutine prepare(self, wide)
    class(varied_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: wide   !! the machine in as many lanes as are evaluated together

    associate (machine => self%machine, copies => 1 + self%numbers)
      self%own = machine%states
      self%states = self%own * copies
      self%switches = machine%switches
      self%measures = machine%measures * copies
      self%limits_steps = machine%limits_steps
      self%follows_waves = machine%follows_waves
      self%pattern = machine%jacobian_pattern()
      allocate (self%dfdy(1, size(self%pattern%row)), self%dfdt(1, self%own), self%f(1, self%own), source=0.0_wp)
    end associate
    call fill_lanes(self, wide)
  end subroutine prepare

  !> Gives lanes the parameters of the changed machines, but of those with another structure.
  subroutine fill_lanes(self, wide)
    class(varied_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: wide
    type(lane_parameters_t) :: own, structure
    integer :: b, j, k, lane, n

    call structure%take(1)
    call self%machine%pass_parameters(structure)
    allocate (self%is_alone(run_points, self%numbers))
    do j = 1, self%numbers
      do k = 1, run_points
        call own%take(1)
        call self%changed(j)%near(k)%its%pass_parameters(own)
        self%is_alone(k, j) = .not. structure%has_same_structure(own)
      end do
    end do
    allocate (self%blocks((count(.not. self%is_alone) + wide%lanes - 1) / wide%lanes))
    n = 0
    do j = 1, self%numbers
      do k = 1, run_points
        if (self%is_alone(k, j)) cycle
        b = n / wide%lanes + 1
        lane = modulo(n, wide%lanes) + 1
        if (lane == 1) call new_lanes(self%blocks(b), wide)
        call own%take(1)
        call self%changed(j)%near(k)%its%pass_parameters(own)
        call own%give(lane)
        associate (block => self%blocks(b))
          call block%its%pass_parameters(own)
          call block%its%refresh_lane(lane)
          block%number = [block%number, j]
          block%point = [block%point, k]
        end associate
        n = n + 1
      end do
    end do
  end subroutine fill_lanes

  !> Lanes that all hold the machine.
  subroutine new_lanes(self, wide)
    type(changed_lanes_t), intent(inout) :: self
    type(machine_t), intent(in) :: wide

    allocate (reduced_t :: self%its)
    self%its%machine = wide
    call self%its%formulate(.false.)
    allocate (self%number(0), self%point(0), self%t(wide%lanes), self%status(wide%lanes))
    allocate (self%y(wide%lanes, self%its%states), self%f(wide%lanes, self%its%states))
  end subroutine new_lanes

  !> The state at the start, [1, states].
  function start(self) result(y)
    class(varied_motion_t), intent(in) :: self
    real(wp), allocatable :: y(:, :)
    integer :: j

    allocate (y(1, self%states))
    y(:, :self%own) = self%machine%start()
    do j = 1, self%numbers
      y(1, self%of_number(j) + 1:self%of_number(j) + self%own) = self%changed(j)%start
    end do
  end function start

  !> Number of states before those of a number.
  pure integer function of_number(self, j)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: j   !! in `changed`

    of_number = j * self%own
  end function of_number

  !> By how much a change of the state of the machine is larger than the state, in the quantities in which errors are measured.
  real(wp) function relative_size(self, y, change) result(ratio)
    class(varied_motion_t), intent(in) :: self
    real(wp), intent(in) :: y(self%own), change(self%own)
    real(wp), parameter :: least = 1.0e-3_wp   ! of the largest size: a smaller quantity counts as one of that size
    real(wp), dimension(1, self%machine%measures) :: sizes, changes

    call self%machine%measure(self%own, reshape(y, [1, self%own]), reshape(change, [1, self%own]), sizes, changes)
    sizes = abs(sizes)
    ratio = maxval(abs(changes) / max(sizes, least * maxval(sizes), tiny(least)))
  end function relative_size

  !> The derivative of a function by a number, times |p|, of its values at the points of its key and of the machine itself.
  pure real(wp) function by_number(self, j, near, here) result(slope)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: j   !! in `changed`
    real(wp), intent(in) :: near(run_points), here

    associate (changed => self%changed(j))
      slope = changed%scale * (dot_product(changed%key%run_weight, near) + changed%key%run_weight_here * here)
    end associate
  end function by_number

  subroutine derivative(self, t, y, dydt, status)
    class(varied_motion_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), intent(inout) :: dydt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)
    integer :: b, i, j, k

    associate (n => self%own)
      call self%machine%derivative(t, y(:, :n), dydt(:, :n), status)
      if (status(1) == evaluation_ok) call self%machine%jacobian(t, y(:, :n), self%dfdy, self%dfdt, status)
      do j = 1, self%numbers
        associate (changed => self%changed(j), before => self%of_number(j))
          dydt(:, before + 1:before + n) = changed%scale * changed%key%run_weight_here * dydt(:, :n)
          do i = 1, size(self%pattern%row)
            associate (row => before + self%pattern%row(i), column => before + self%pattern%column(i))
              dydt(1, row) = dydt(1, row) + self%dfdy(1, i) * y(1, column)
            end associate
          end do
          do k = 1, run_points
            if (status(1) /= evaluation_ok) return
            if (.not. self%is_alone(k, j)) cycle
            call changed%near(k)%its%derivative(t, y(:, :n), self%f, status)
            dydt(1, before + 1:before + n) = dydt(1, before + 1:before + n) + &
                                             changed%scale * changed%key%run_weight(k) * self%f(1, :)
          end do
        end associate
      end do
    end associate
    do b = 1, size(self%blocks)
      call add_lanes(self, self%blocks(b), t(1), y(1, :self%own), dydt(1, :), status(1))
      if (status(1) /= evaluation_ok) return
    end do
  end subroutine derivative

  !> Adds what the changed machines of some lanes give to the derivatives.
  subroutine add_lanes(self, lanes, t, y, dydt, status)
    class(varied_motion_t), intent(in) :: self
    type(changed_lanes_t), intent(inout) :: lanes
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)         !! of the machine
    real(wp), intent(inout) :: dydt(:)   !! [states]
    integer, intent(inout) :: status
    integer :: i, l

    lanes%t = t
    lanes%status = evaluation_ok
    do i = 1, size(y)
      lanes%y(:, i) = y(i)
    end do
    call lanes%its%derivative(lanes%t, lanes%y, lanes%f, lanes%status)
    do l = 1, size(lanes%number)
      if (lanes%status(l) /= evaluation_ok) status = lanes%status(l)
      associate (changed => self%changed(lanes%number(l)), before => self%of_number(lanes%number(l)))
        associate (weight => changed%scale * changed%key%run_weight(lanes%point(l)))
          do i = 1, size(y)
            dydt(before + i) = dydt(before + i) + weight * lanes%f(l, i)
          end do
        end associate
      end associate
    end do
  end subroutine add_lanes

  subroutine jacobian(self, t, y, dfdy, dfdt, status)
    class(varied_motion_t), intent(inout) :: self
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(in) :: y(self%lanes, self%states + self%quadratures)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp), intent(inout) :: dfdt(self%lanes, self%states + self%quadratures)
    integer, intent(inout) :: status(self%lanes)

    error stop 'nocdyn_varied_motions: explicit methods alone integrate these equations'
  end subroutine jacobian

  subroutine prepare_integration(self, rtol, atol, t_end)
    class(varied_motion_t), intent(inout) :: self
    real(wp), intent(in) :: rtol, atol, t_end

    call self%machine%prepare_integration(rtol, atol, t_end)
    self%duration = t_end
  end subroutine prepare_integration

  !> Errors of a derivative count relative to it, or to the motion itself if that is larger.
  subroutine measure(self, columns, y, error, sizes, errors)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: columns
    real(wp), intent(in), dimension(self%lanes, columns) :: y, error
    real(wp), intent(inout), dimension(self%lanes, self%measures) :: sizes, errors
    real(wp), dimension(1, self%machine%measures) :: again, own
    integer :: j

    associate (m => self%machine%measures, n => self%own)
      call self%machine%measure(n, y(:, :n), error(:, :n), sizes(:, :m), errors(:, :m))
      do j = 1, self%numbers
        associate (from => self%of_number(j) + 1, to => self%of_number(j) + n, first => j * m + 1, last => (j + 1) * m)
          call self%machine%measure(n, y(:, :n), y(:, from:to), again, own)
          call self%machine%measure(n, y(:, :n), error(:, from:to), again, errors(:, first:last))
          sizes(:, first:last) = max(abs(again), abs(own))
        end associate
      end do
    end associate
  end subroutine measure

  function measure_name(self, index) result(name)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    name = with_number(self, (index - 1) / self%machine%measures, &
                       self%machine%measure_name(1 + modulo(index - 1, self%machine%measures)))
  end function measure_name

  function component_name(self, index) result(name)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name

    name = with_number(self, (index - 1) / self%own, self%machine%component_name(1 + modulo(index - 1, self%own)))
  end function component_name

  function with_number(self, j, own) result(name)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: j   !! in `changed`; 0: the machine itself
    character(len=*), intent(in) :: own
    character(len=:), allocatable :: name

    name = own
    if (j > 0) name = 'derivative of the ' // own // ' by ' // self%changed(j)%key%target%path
  end function with_number

  subroutine limit_steps(self, columns, y, longest)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: columns
    real(wp), intent(in) :: y(self%lanes, columns)
    real(wp), intent(inout) :: longest(self%lanes)

    call self%machine%limit_steps(self%own, y(:, :self%own), longest)
  end subroutine limit_steps

  subroutine start_lane(self, lane, t, y)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    integer :: j, k

    call self%machine%start_lane(lane, t, y(:self%own))
    do j = 1, self%numbers
      do k = 1, run_points
        call self%changed(j)%near(k)%its%start_lane(lane, t, y(:self%own))
      end do
    end do
    do j = 1, size(self%blocks)
      do k = 1, size(self%blocks(j)%t)
        call self%blocks(j)%its%start_lane(k, t, y(:self%own))
      end do
    end do
    call take_branches(self)
  end subroutine start_lane

  !> The changed machines are on the branches of the machine.
  subroutine take_branches(self)
    class(varied_motion_t), intent(inout) :: self
    integer :: j, k

    do j = 1, self%numbers
      do k = 1, run_points
        associate (near => self%changed(j)%near(k)%its)
          call near%state%take_branches(near%machine, 1, self%machine%state, 1)
        end associate
      end do
    end do
    do j = 1, size(self%blocks)
      do k = 1, size(self%blocks(j)%t)
        associate (block => self%blocks(j)%its)
          call block%state%take_branches(block%machine, k, self%machine%state, 1)
        end associate
      end do
    end do
  end subroutine take_branches

  subroutine indicator_values(self, lane, t, y, g)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    call self%machine%indicator_values(lane, t, y(:self%own), g)
  end subroutine indicator_values

  subroutine set_indicator(self, which, lane, t, y, g)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: which, lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), contiguous, intent(inout) :: g(:)

    call self%machine%set_indicator(which, lane, t, y(:self%own), g)
  end subroutine set_indicator

  subroutine find_fastest_wave(self, lane, y, fastest)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    real(wp), intent(out) :: fastest

    call self%machine%find_fastest_wave(lane, y(:self%own), fastest)
  end subroutine find_fastest_wave

  function switch_name(self, which) result(name)
    class(varied_motion_t), intent(in) :: self
    integer, intent(in) :: which
    character(len=:), allocatable :: name

    name = self%machine%switch_name(which)
  end function switch_name

  !> The machine changes its branch, at a time that moves with the numbers: the derivatives jump.
  subroutine change_branch(self, lane, which, t, y)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: lane, which
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(inout) :: y(:)
    real(wp), dimension(1, self%own) :: after, before
    real(wp) :: moves(self%numbers)   ! |p| dtau/dp [s]
    integer :: j, status(1)

    status = evaluation_ok
    call self%machine%derivative([t], y(:self%own), before, status)
    call find_moves(self, which, t, y, before(1, :), moves)
    call self%machine%change_branch(lane, which, t, y(:self%own))
    call take_branches(self)
    call self%machine%derivative([t], y(:self%own), after, status)
    if (status(1) /= evaluation_ok) return   ! the next evaluation says so
    do j = 1, self%numbers
      associate (first => self%of_number(j) + 1, last => self%of_number(j) + self%own)
        y(first:last) = y(first:last) + moves(j) * (before(1, :) - after(1, :))
      end associate
    end do
  end subroutine change_branch

  !> How the time moves at which an indicator g falls to zero: by -(g_y s + g_p) / (g_t + g_y f).
  subroutine find_moves(self, which, t, y, rate, moves)
    class(varied_motion_t), intent(inout) :: self
    integer, intent(in) :: which
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(:)       !! [states]
    real(wp), intent(in) :: rate(:)    !! of the machine before the change, [states of the machine]
    real(wp), intent(out) :: moves(:)
    real(wp), parameter :: step = 1.0e-4_wp, short = 1.0e-6_wp   ! relative: of a change of the state; of the duration
    real(wp) :: change, fall, g(self%switches, 2), near(run_points), slope
    integer :: j, k

    associate (own => y(:self%own))
      change = min(short * max(abs(self%duration), tiny(step)), step / max(self%relative_size(own, rate), tiny(step)))
      call self%machine%set_indicator(which, 1, t + change, own + change * rate, g(:, 1))
      call self%machine%set_indicator(which, 1, t - change, own - change * rate, g(:, 2))
      fall = (g(which, 1) - g(which, 2)) / (2.0_wp * change)
      do j = 1, self%numbers
        associate (s => y(self%of_number(j) + 1:self%of_number(j) + self%own))
          change = step / max(1.0_wp, self%relative_size(own, s))
          call self%machine%set_indicator(which, 1, t, own + change * s, g(:, 1))
          call self%machine%set_indicator(which, 1, t, own - change * s, g(:, 2))
          slope = (g(which, 1) - g(which, 2)) / (2.0_wp * change)
        end associate
        do k = 1, run_points
          call self%changed(j)%near(k)%its%set_indicator(which, 1, t, own, g(:, 1))
          near(k) = g(which, 1)
        end do
        call self%machine%set_indicator(which, 1, t, own, g(:, 1))
        slope = slope + self%by_number(j, near, g(which, 1))
        moves(j) = 0.0_wp
        if (abs(fall) > 0) moves(j) = -slope / fall
      end do
    end associate
  end subroutine find_moves

end module nocdyn_varied_motions
