!> Elastic couplings: the nonlinear spring of eqs. (2), (3) with viscous damping and a rest twist.
!>
!> Friction in parallel with the spring resists with friction tanh(u' / friction_speed), as a slipping clutch does. Damping and
!> friction have one work integral.
module nocdyn_couplings
  use nocdyn_bank, only: bank_t, harmonic_t, quantity_t, role_coupling, sine_harmonic
  use nocdyn_element_rows, only: element_rows_t, rows_between
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, node_of, operator(*), operator(-), operator(/), speed_of
  use nocdyn_law_functions, only: tanh
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_by_speed, coefficient_cubic, coefficient_damping, coefficient_linear, &
    coefficient_rest
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_couplings

  !> Orders of the first bodies of meshes by which their wheels deviate from the ideal form.
  type, public :: transmission_error_t
    integer, allocatable :: coupling(:)      !! that each order belongs to, numbered within the bank
    real(wp), allocatable :: order(:)        !! positive
    real(wp), allocatable :: amplitude(:)    !! of sin(order phi + phase) [m]
    real(wp), allocatable :: phase(:)        !! [rad]
  end type transmission_error_t

  !> What couplings of every elastic law have in common. Parameters have the shape [lanes, couplings].
  type, public :: coupling_common_t
    type(string_t), allocatable :: names(:)
    type(element_rows_t) :: rows                    !! bodies
    real(wp), allocatable :: damping(:, :)          !! [N m s/rad]
    real(wp), allocatable :: rest_twist(:, :)       !! [rad]
    real(wp), allocatable :: friction(:, :)         !! [N m]; not allocated: none
    real(wp), allocatable :: friction_speed(:, :)   !! [rad/s], positive
    logical :: is_mesh = .false.                    !! whether the rows are radii: angles are deformations [m], moments forces [N]
    real(wp), allocatable :: section_modulus(:, :)  !! stress = moment / section_modulus [m3], 0: unknown; not allocated: all
    type(transmission_error_t), allocatable :: error !! not allocated: none
  end type coupling_common_t

  ! gfortran 12 loses components of a structure constructor's value that is an argument
  interface coupling_common_t
    procedure :: new_common, common_of_rows
  end interface coupling_common_t

  !> M_el = -(K1 + k1 w^2) w on the second body, w = u - rest_twist; damping moment -d u'. Extensions have another elastic moment.
  type, extends(bank_t), public :: couplings_t
    logical :: has_friction = .false.
    logical :: is_mesh = .false.   !! as in `coupling_common_t`
    type(transmission_error_t), allocatable :: error   !! not allocated: none; forced responses have it, the law has it not
  contains
    procedure :: list_harmonics
    procedure :: set_common
    procedure :: add_damping
    procedure :: describe
    procedure :: twist_from_rest
    procedure :: friction
    procedure :: quantities
    procedure :: observe
  end type couplings_t

  integer, parameter :: tooth_force = 2   ! of a mesh, after the deformation
  integer, parameter :: twist = 1, moment = 2, damping_moment = 3, shaft_moment = 4, stress = 5   ! the order of `quantities`

contains

  !> Couplings between two bodies each.
  function new_common(names, from, to, damping, rest_twist, friction, friction_speed) result(shared)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)                    !! bodies, 0 = ground
    real(wp), intent(in) :: damping(:, :)                    !! [N m s/rad], shape [lanes, couplings] as all that follow
    real(wp), intent(in) :: rest_twist(:, :)                 !! [rad]
    real(wp), intent(in), optional :: friction(:, :)         !! [N m]; absent: none
    real(wp), intent(in), optional :: friction_speed(:, :)   !! [rad/s], positive; present with `friction`
    type(coupling_common_t) :: shared

    shared = common_of_rows(names, rows_between(from, to), damping, rest_twist, friction, friction_speed)
  end function new_common

  !> Couplings along any rows.
  function common_of_rows(names, rows, damping, rest_twist, friction, friction_speed) result(shared)
    type(string_t), intent(in) :: names(:)
    type(element_rows_t), intent(in) :: rows
    real(wp), intent(in) :: damping(:, :)                    !! [N m s/rad], shape [lanes, couplings] as all that follow
    real(wp), intent(in) :: rest_twist(:, :)                 !! [rad]
    real(wp), intent(in), optional :: friction(:, :)         !! [N m]; absent: none
    real(wp), intent(in), optional :: friction_speed(:, :)   !! [rad/s], positive; present with `friction`
    type(coupling_common_t) :: shared

    allocate (shared%names, source=names)
    shared%rows = rows
    allocate (shared%damping, source=damping)
    allocate (shared%rest_twist, source=rest_twist)
    if (.not. present(friction)) return
    allocate (shared%friction, source=friction)
    allocate (shared%friction_speed, source=friction_speed)
  end function common_of_rows

  !> Couplings by eq. (3). Those without damping and friction in all lanes have no work integral.
  function new_couplings(common, stiffness, cubic_stiffness) result(bank)
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    real(wp), intent(in) :: stiffness(:, :)            !! K1 [N m/rad], shape [lanes, couplings]
    real(wp), intent(in) :: cubic_stiffness(:, :)      !! k1 [N m/rad3], of either sign
    type(couplings_t) :: bank
    integer :: e

    call bank%set_common(common)
    call bank%add_parameter('stiffness', stiffness)
    call bank%add_parameter('cubic_stiffness', cubic_stiffness)
    call bank%add_term('rest_twist', coefficient_rest, 1.0_wp)
    call bank%add_term('stiffness', coefficient_linear, 1.0_wp)
    call bank%add_term('cubic_stiffness', coefficient_cubic, 1.0_wp)
    call bank%add_damping()
    bank%is_polynomial = .not. bank%has_friction
    bank%has_paper_law = bank%is_polynomial
    bank%has_polynomial_potential = .true.
    bank%elastic = pack([(e, e=1, bank%count)], any(abs(stiffness) > 0.0_wp .or. abs(cubic_stiffness) > 0.0_wp, dim=1))
    call bank%prepare_law()
  end function new_couplings

  !> Connects the bodies and sets what couplings of every elastic law have in common.
  subroutine set_common(self, common)
    class(couplings_t), intent(inout) :: self
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    integer :: e
    logical :: is_dissipative(size(common%damping, 2))

    call self%connect(role_coupling, size(common%damping, 1), common%names, common%rows)
    call self%add_parameter('damping', common%damping)
    call self%add_parameter('rest_twist', common%rest_twist)
    is_dissipative = any(abs(common%damping) > 0.0_wp, dim=1)
    self%has_friction = allocated(common%friction)
    self%is_mesh = common%is_mesh
    if (allocated(common%error)) allocate (self%error, source=common%error)
    if (self%has_friction) then
      call self%add_parameter('friction', common%friction)
      call self%add_parameter('friction_speed', common%friction_speed)
      is_dissipative = is_dissipative .or. any(abs(common%friction) > 0.0_wp, dim=1)
    end if
    if (allocated(common%section_modulus)) call self%add_parameter('section_modulus', common%section_modulus, is_key=.false.)
    self%with_work = pack([(e, e=1, self%count)], is_dissipative)
    self%is_polynomial = .false.
    self%has_polynomial_potential = .false.
    self%has_paper_law = .false.
  end subroutine set_common

  !> Adds the damping of eq. (5) to the polynomial part of the law.
  subroutine add_damping(self)
    class(couplings_t), intent(inout) :: self

    call self%add_term('damping', coefficient_by_speed, -1.0_wp)
    call self%add_term('damping', coefficient_damping, 1.0_wp)
  end subroutine add_damping

  subroutine describe(self, tape)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    if (self%has_friction) tape%applied = node_of(self%friction(tape))
  end subroutine describe

  !> w = u - rest_twist [rad].
  function twist_from_rest(self, tape) result(w)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: w

    w = angle_of(tape) - self%parameter(tape, 'rest_twist')
  end function twist_from_rest

  !> The moment of friction on the second body [N m].
  function friction(self, tape)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: friction

    friction = -(self%parameter(tape, 'friction') * tanh(speed_of(tape) / self%parameter(tape, 'friction_speed')))
  end function friction

  !> The transmission error of a mesh.
  subroutine list_harmonics(self, element, speed, list)
    class(couplings_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]
    type(harmonic_t), allocatable, intent(out) :: list(:)
    integer :: i, k
    integer, allocatable :: orders(:)

    if (.not. allocated(self%error)) then
      allocate (list(0))
      return
    end if
    orders = pack([(k, k=1, size(self%error%order))], self%error%coupling == element)
    allocate (list(size(orders)))
    do i = 1, size(list)
      associate (error => self%error, k => orders(i))
        list(i) = sine_harmonic(error%amplitude(k), 0.0_wp, error%order(k), error%phase(k), &
                                self%rows%body(self%rows%first(element)))
      end associate
    end do
    list%is_twist = .true.
  end subroutine list_harmonics

  function quantities(self) result(columns)
    class(couplings_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    if (self%is_mesh) then
      allocate (columns(2))
      columns(twist) = quantity_t('deformation', 'm', [(e, e=1, self%count)])
      columns(tooth_force) = quantity_t('force', 'N', [(e, e=1, self%count)])
      return
    end if
    allocate (columns(merge(5, 4, self%number_of('section_modulus') > 0)))
    columns(twist) = quantity_t('twist', 'rad', [(e, e=1, self%count)])
    columns(moment) = quantity_t('moment', 'N m', [(e, e=1, self%count)])
    columns(damping_moment) = quantity_t('damping', 'N m', self%with_work)
    columns(shaft_moment) = quantity_t('shaft', 'N m', self%with_work)
    if (size(columns) < stress) return
    associate (modulus => self%parameters(self%number_of('section_modulus'))%value)
      columns(stress) = quantity_t('stress', 'Pa', pack(columns(twist)%elements, any(modulus > 0, dim=1)))
    end associate
  end function quantities

  !> Twist [rad], and the moments on the first body [N m]: the elastic one, F1 of the paper, that of damping and friction, and
  !> both together, the moment in the shaft; its shear stress [Pa]. Of a mesh the deformation [m] and the force [N], whose product
  !> with the radius of a wheel is the torque on it.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(couplings_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! twist, moment, damping_moment, shaft_moment or stress
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]

    if (self%is_mesh .and. quantity == tooth_force) then
      values = elements%restoring(lane, self%first:self%last()) + elements%applied(lane, self%first:self%last())
      return
    end if
    select case (quantity)
    case (twist)
      values = elements%angle(lane, self%first:self%last())
    case (moment)
      values = 0.0_wp - elements%restoring(lane, self%first:self%last())   ! not -0 without any moment
    case (damping_moment)
      values = 0.0_wp - elements%applied(lane, self%first:self%last())
    case default
      values = 0.0_wp - (elements%restoring(lane, self%first:self%last()) + elements%applied(lane, self%first:self%last()))
      if (quantity /= stress) return
      associate (modulus => self%parameters(self%number_of('section_modulus'))%value(lane, :))
        values = values / merge(modulus, 1.0_wp, modulus > 0)
      end associate
    end select
  end subroutine observe

end module nocdyn_couplings
