!> Elastic couplings: the nonlinear spring of eqs. (2), (3), or a table, with viscous damping and a rest twist.
!>
!> Friction in parallel with the spring resists with friction tanh(u' / friction_speed), as a slipping clutch does. Damping and
!> friction have one work integral.
module nocdyn_couplings
  use nocdyn_bank, only: quantity_t, role_coupling
  use nocdyn_curves, only: curve_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_table_laws, only: over_twist, table_laws_t
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: tanh_of
  implicit none (type, external)
  private

  public :: new_couplings, new_table_couplings

  !> What couplings of every elastic law have in common. Parameters have the shape [lanes, couplings].
  type, public :: coupling_common_t
    type(string_t), allocatable :: names(:)
    integer, allocatable :: from(:), to(:)          !! bodies, 0 = ground
    real(wp), allocatable :: damping(:, :)          !! [N m s/rad]
    real(wp), allocatable :: rest_twist(:, :)       !! [rad]
    real(wp), allocatable :: friction(:, :)         !! [N m]; not allocated: none
    real(wp), allocatable :: friction_speed(:, :)   !! [rad/s], positive
  end type coupling_common_t

  ! gfortran 12 loses components of a structure constructor's value that is an argument
  interface coupling_common_t
    procedure :: new_common
  end interface coupling_common_t

  !> M_el = -(K1 + k1 w^2) w on the second body, w = u - rest_twist, or that of a table; damping moment -d u'.
  type, extends(table_laws_t), public :: couplings_t
    real(wp), allocatable :: stiffness(:, :)         !! K1 [N m/rad], shape [lanes, couplings] as all parameters
    real(wp), allocatable :: cubic_stiffness(:, :)   !! k1 [N m/rad3], of either sign
    real(wp), allocatable :: damping(:, :)           !! d [N m s/rad]
    real(wp), allocatable :: friction(:, :)          !! [N m]; not allocated: none
    real(wp), allocatable :: friction_speed(:, :)    !! [rad/s]
  contains
    procedure :: list_parameters
    procedure :: list_common
    procedure :: polynomials
    procedure :: evaluate
    procedure :: differentiate
    procedure :: quantities
    procedure :: observe
  end type couplings_t

  integer, parameter :: twist = 1, moment = 2, damping_moment = 3, shaft_moment = 4   ! the order of `quantities`

contains

  function new_common(names, from, to, damping, rest_twist, friction, friction_speed) result(common)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)                    !! bodies, 0 = ground
    real(wp), intent(in) :: damping(:, :)                    !! [N m s/rad], shape [lanes, couplings] as all that follow
    real(wp), intent(in) :: rest_twist(:, :)                 !! [rad]
    real(wp), intent(in), optional :: friction(:, :)         !! [N m]; absent: none
    real(wp), intent(in), optional :: friction_speed(:, :)   !! [rad/s], positive; present with `friction`
    type(coupling_common_t) :: common

    allocate (common%names, source=names)
    allocate (common%from, source=from)
    allocate (common%to, source=to)
    allocate (common%damping, source=damping)
    allocate (common%rest_twist, source=rest_twist)
    if (.not. present(friction)) return
    allocate (common%friction, source=friction)
    allocate (common%friction_speed, source=friction_speed)
  end function new_common

  !> Couplings by eq. (3). Those without damping and friction in all lanes have no work integral.
  function new_couplings(common, stiffness, cubic_stiffness) result(bank)
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    real(wp), intent(in) :: stiffness(:, :)            !! K1 [N m/rad], shape [lanes, couplings]
    real(wp), intent(in) :: cubic_stiffness(:, :)      !! k1 [N m/rad3]
    type(couplings_t) :: bank
    integer :: e
    logical :: is_dissipative(size(common%to))

    call bank%connect(role_coupling, size(common%damping, 1), common%names, common%to, common%from)
    bank%stiffness = stiffness
    bank%cubic_stiffness = cubic_stiffness
    bank%damping = common%damping
    bank%rest_twist = common%rest_twist
    is_dissipative = any(abs(common%damping) > 0.0_wp, dim=1)
    if (allocated(common%friction)) then
      bank%is_polynomial = .false.
      bank%has_paper_law = .false.
      allocate (bank%friction, source=common%friction)
      allocate (bank%friction_speed, source=common%friction_speed)
      is_dissipative = is_dissipative .or. any(abs(common%friction) > 0.0_wp, dim=1)
    end if
    bank%with_work = pack([(e, e=1, size(common%to))], is_dissipative)
    bank%elastic = pack([(e, e=1, size(common%to))], any(abs(stiffness) > 0.0_wp .or. abs(cubic_stiffness) > 0.0_wp, dim=1))
  end function new_couplings

  !> Couplings with the elastic moment of a curve over the twist.
  function new_table_couplings(common, curve) result(bank)
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    type(curve_t), intent(in) :: curve(:, :)   !! [N m] over [rad], shape [lanes, couplings]
    type(couplings_t) :: bank
    integer :: e

    bank = new_couplings(common, 0.0_wp * common%damping, 0.0_wp * common%damping)
    call bank%set_curves(over_twist, curve)
    bank%elastic = [(e, e=1, size(common%to))]
  end function new_table_couplings

  subroutine polynomials(self, laws)
    class(couplings_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    associate (first => self%first, last => self%last())
      laws%rest(:, first:last) = self%rest_twist
      laws%linear(:, first:last) = self%stiffness
      laws%cubic(:, first:last) = self%cubic_stiffness
      laws%by_speed(:, first:last) = -self%damping
      laws%damping(:, first:last) = self%damping
    end associate
  end subroutine polynomials

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(couplings_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]

    call self%table_laws_t%evaluate(time, angle, speed, restoring, applied)
    if (allocated(self%friction)) call add_friction(self%values, self%friction, self%friction_speed, speed, applied)
  end subroutine evaluate

  pure subroutine add_friction(n, friction, friction_speed, speed, applied)
    integer, intent(in) :: n
    real(wp), intent(in) :: friction(n), friction_speed(n), speed(n)
    real(wp), intent(inout) :: applied(n)
    integer :: i

    do i = 1, n
      applied(i) = applied(i) - friction(i) * tanh_of(speed(i) / friction_speed(i))
    end do
  end subroutine add_friction

  subroutine differentiate(self, elements)
    class(couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements

    call self%table_laws_t%differentiate(elements)
    if (.not. allocated(self%friction)) return
    associate (slope => elements%applied_speed(:, self%first:self%last()), speed => elements%speed(:, self%first:self%last()))
      slope = slope - self%friction / self%friction_speed * (1.0_wp - tanh_of(speed / self%friction_speed)**2)
    end associate
  end subroutine differentiate

  function quantities(self) result(columns)
    class(couplings_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(4))
    columns(twist) = quantity_t('twist', 'rad', [(e, e=1, size(self%to))])
    columns(moment) = quantity_t('moment', 'N m', [(e, e=1, size(self%to))])
    columns(damping_moment) = quantity_t('damping', 'N m', self%with_work)
    columns(shaft_moment) = quantity_t('shaft', 'N m', self%with_work)
  end function quantities

  !> Twist [rad], and the moments on the first body [N m]: the elastic one, F1 of the paper, that of damping and friction, and
  !> both together, the moment in the shaft.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(couplings_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! twist, moment, damping_moment or shaft_moment
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]

    select case (quantity)
    case (twist)
      values = elements%angle(lane, self%first:self%last())
    case (moment)
      values = 0.0_wp - elements%restoring(lane, self%first:self%last())   ! not -0 without any moment
    case (damping_moment)
      values = 0.0_wp - elements%applied(lane, self%first:self%last())
    case default
      values = 0.0_wp - (elements%restoring(lane, self%first:self%last()) + elements%applied(lane, self%first:self%last()))
    end select
  end subroutine observe

  subroutine list_parameters(self, parameters)
    class(couplings_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_key('stiffness', self%stiffness)
    call parameters%add_key('cubic_stiffness', self%cubic_stiffness)
    call self%list_common(parameters)
  end subroutine list_parameters

  !> Lists what couplings with another elastic moment have too.
  subroutine list_common(self, parameters)
    class(couplings_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%table_laws_t%list_parameters(parameters)
    call parameters%add_key('damping', self%damping)
    call parameters%add_key('rest_twist', self%rest_twist)
    call parameters%add_structure(allocated(self%friction))
    if (.not. allocated(self%friction)) return
    call parameters%add_key('friction', self%friction)
    call parameters%add_key('friction_speed', self%friction_speed)
  end subroutine list_common

end module nocdyn_couplings
