!> Elastic couplings: the nonlinear spring of eqs. (2), (3) with viscous damping and a rest twist.
!>
!> A mesh with a transmission error e is a bank of its own with the phase phi, the angle of the first body; it is followed by
!> the bank of its phase (`nocdyn_phases`). Its law has u - e(phi) in place of u. Its moment M acts along the gradient of this:
!> along the row of the mesh, and on the first body with -e'(phi) M besides. So it has a potential.
!>
!> Friction in parallel with the spring resists with friction tanh(u' / friction_speed), as a slipping clutch does. Damping and
!> friction have one work integral.
module nocdyn_couplings
  use nocdyn_bank, only: bank_t, role_coupling
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_element_rows, only: element_rows_t, rows_between
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, node_of, operator(*), operator(+), operator(-), operator(/), &
    phase_of, phase_speed_of, speed_of
  use nocdyn_law_functions, only: cos, sin, tanh
  use nocdyn_law_tape, only: at_phase, law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_by_speed, coefficient_cubic, coefficient_linear, &
    coefficient_rest
  use nocdyn_quantities, only: form_angle, form_applied, form_elastic, form_total, new_quantity, quantity_t, rank_detail, &
    rank_force, rank_moment, rank_stress, rank_twist
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_couplings

  !> By how much the wheels of a mesh deviate from the ideal form: e(phi), a sum of orders of the angle phi of the first body.
  type, public :: transmission_error_t
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
    logical :: is_mesh = .false.                    !! as in `bank_t`
    real(wp), allocatable :: section_modulus(:, :)  !! stress = moment / section_modulus [m3], 0: unknown; not allocated: all
    real(wp), allocatable :: loss_factor(:), loss_damping(:)   !! as in `bank_t`
    type(transmission_error_t), allocatable :: error !! of the only coupling; not allocated: none
  end type coupling_common_t

  interface coupling_common_t
    procedure :: new_common
  end interface coupling_common_t

  !> M_el = -(K1 + k1 w^2) w on the second body, w = u - rest_twist; damping moment -d u'. Extensions have another elastic moment.
  type, extends(bank_t), public :: couplings_t
    logical :: has_friction = .false.
    integer :: error_orders = 0    !! of the transmission error of its only coupling; 0: none
  contains
    procedure :: set_common, set_keys
    procedure :: add_damping
    procedure :: describe
    procedure :: describe_phase
    procedure :: twist_from_rest
    procedure :: twist_speed
    procedure :: friction
    procedure :: quantities
  end type couplings_t

  integer, parameter :: tooth_force = 2   ! of a mesh, after the deformation

contains

  !> Couplings between two bodies each. Relative damping has a viscous damping in its place at `damping_frequency`.
  function new_common(keys) result(common)
    class(element_keys_t), intent(in) :: keys
    type(coupling_common_t) :: common
    real(wp), parameter :: pi = acos(-1.0_wp)
    real(wp), dimension(keys%lanes, size(keys%names)) :: bore, diameter, loss, modulus, viscous

    allocate (common%names, source=keys%names)
    common%rows = rows_between(keys%bodies('bodies', 1), keys%bodies('bodies', 2))
    loss = keys%values('relative_damping') / (2.0_wp * pi)
    where (keys%values('magnifier') > 0) loss = 1.0_wp / keys%values('magnifier')
    viscous = 0.0_wp
    where (keys%values('damping_frequency') > 0) viscous = loss * keys%values('stiffness') / keys%values('damping_frequency')
    allocate (common%damping, source=keys%values('damping') + viscous)
    if (any(loss > 0)) then
      allocate (common%loss_factor, source=loss(1, :))
      allocate (common%loss_damping, source=viscous(1, :))
    end if
    allocate (common%rest_twist, source=keys%values('rest_twist'))
    modulus = keys%values('section_modulus')   ! against torsion
    diameter = keys%values('diameter')
    bore = keys%values('bore')
    where (diameter > 0) modulus = pi / 16.0_wp * (diameter**4 - bore**4) / diameter
    if (any(modulus > 0)) allocate (common%section_modulus, source=modulus)
    if (.not. any(keys%values('friction') > 0)) return
    allocate (common%friction, source=keys%values('friction'))
    allocate (common%friction_speed, source=keys%values('friction_speed', absent=1.0_wp))
  end function new_common

  !> Couplings by eq. (3). Those without damping and friction in all lanes have no work integral.
  function new_couplings(keys, common) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(coupling_common_t), intent(in), optional :: common   !! of meshes; absent: as the keys say
    type(couplings_t) :: bank
    real(wp), dimension(keys%lanes, size(keys%names)) :: cubic_stiffness
    integer :: e

    call bank%set_keys(keys, common)
    cubic_stiffness = 0.0_wp
    if (.not. bank%is_mesh) cubic_stiffness = keys%values('cubic_stiffness')
    call bank%add_key(keys, 'stiffness')
    call bank%add_parameter('cubic_stiffness', cubic_stiffness)
    call bank%add_term('rest_twist', coefficient_rest, 1.0_wp)
    call bank%add_term('stiffness', coefficient_linear, 1.0_wp)
    call bank%add_term('cubic_stiffness', coefficient_cubic, 1.0_wp)
    call bank%add_damping()
    bank%is_polynomial = .not. bank%has_friction
    bank%has_paper_law = bank%is_polynomial
    bank%has_polynomial_potential = .true.
    bank%elastic = pack([(e, e=1, bank%count)], any(abs(keys%values('stiffness')) > 0.0_wp .or. abs(cubic_stiffness) > 0.0_wp, &
                                                    dim=1))
    call bank%prepare_law()
  end function new_couplings

  !> `set_common` with what is given, else with what the keys say.
  subroutine set_keys(self, keys, common)
    class(couplings_t), intent(inout) :: self
    class(element_keys_t), intent(in) :: keys
    type(coupling_common_t), intent(in), optional :: common

    if (present(common)) then
      call self%set_common(common)
    else
      call self%set_common(coupling_common_t(keys))
    end if
  end subroutine set_keys

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
    if (allocated(common%error)) call add_error(self, common%error)
    if (self%has_friction) then
      call self%add_parameter('friction', common%friction)
      call self%add_parameter('friction_speed', common%friction_speed)
      is_dissipative = is_dissipative .or. any(abs(common%friction) > 0.0_wp, dim=1)
    end if
    if (allocated(common%section_modulus)) call self%add_parameter('section_modulus', common%section_modulus, is_key=.false.)
    if (allocated(common%loss_factor)) then
      self%loss_factor = common%loss_factor
      self%loss_damping = common%loss_damping
    end if
    self%with_work = pack([(e, e=1, self%count)], is_dissipative)
    self%is_polynomial = .false.
    self%has_polynomial_potential = .false.
    self%has_paper_law = .false.
  end subroutine set_common

  !> Adds the parameters of a transmission error.
  subroutine add_error(self, error)
    class(couplings_t), intent(inout) :: self
    type(transmission_error_t), intent(in) :: error
    integer :: k

    if (self%count /= 1) error stop 'nocdyn_couplings: a mesh with a transmission error has a bank of its own'
    self%ports = at_phase
    self%error_orders = size(error%order)
    self%phase_order = maxval([0.0_wp, error%order])
    associate (owner => [(1, k=1, self%error_orders)], a => error%amplitude)
      call self%add_parameter('error order', spread(error%order, 1, self%lanes), .false., owner)
      call self%add_parameter('error sine', spread(a * cos(error%phase), 1, self%lanes), .false., owner)
      call self%add_parameter('error cosine', spread(a * sin(error%phase), 1, self%lanes), .false., owner)
    end associate
  end subroutine add_error

  !> Adds the damping of eq. (5) to the polynomial part of the law; the one of a mesh with a transmission error is not in it.
  subroutine add_damping(self)
    class(couplings_t), intent(inout) :: self

    if (self%error_orders > 0) return
    call self%add_term('damping', coefficient_by_speed, -1.0_wp)
  end subroutine add_damping

  subroutine describe(self, tape)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape

    if (self%has_friction) tape%applied = node_of(self%friction(tape))
    if (self%error_orders == 0) return
    tape%applied = node_of(-(self%parameter(tape, 'damping') * self%twist_speed(tape)))
  end subroutine describe

  !> The moments on the phase, from the ones of the mesh, which are described: M times the derivative -e' of the twist by the
  !> phase.
  subroutine describe_phase(self, tape)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment, slope

    if (self%error_orders == 0) return
    slope = error_slope(self, tape)
    moment = slope
    moment%node = tape%restoring
    tape%phase_restoring = node_of(-(slope * moment))
    moment%node = tape%applied
    tape%phase_applied = node_of(-(slope * moment))
  end subroutine describe_phase

  !> w = u - rest_twist [rad], of a mesh less the transmission error.
  function twist_from_rest(self, tape) result(w)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: angle, w
    integer :: k

    w = angle_of(tape) - self%parameter(tape, 'rest_twist')
    do k = 1, self%error_orders
      angle = self%parameter(tape, 'error order', [k]) * phase_of(tape)
      w = w - self%parameter(tape, 'error sine', [k]) * sin(angle)
      w = w - self%parameter(tape, 'error cosine', [k]) * cos(angle)
    end do
    if (self%error_orders > 0) tape%twist = node_of(w)
  end function twist_from_rest

  !> The derivative of the twist by the time: u', of a mesh u' - e'(phi) phi' [rad/s].
  function twist_speed(self, tape) result(speed)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: speed

    speed = speed_of(tape)
    if (self%error_orders > 0) speed = speed - error_slope(self, tape) * phase_speed_of(tape)
  end function twist_speed

  !> e'(phi) [m/rad].
  function error_slope(self, tape) result(slope)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: angle, order, part, slope
    integer :: k

    do k = 1, self%error_orders
      order = self%parameter(tape, 'error order', [k])
      angle = order * phase_of(tape)
      part = order * self%parameter(tape, 'error sine', [k]) * cos(angle) &
             - order * self%parameter(tape, 'error cosine', [k]) * sin(angle)
      if (k > 1) part = slope + part
      slope = part
    end do
  end function error_slope

  !> The moment of friction on the second body [N m].
  function friction(self, tape)
    class(couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: friction

    friction = -(self%parameter(tape, 'friction') * tanh(self%twist_speed(tape) / self%parameter(tape, 'friction_speed')))
  end function friction

  subroutine quantities(self, columns)
    class(couplings_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    if (self%is_mesh) then
      allocate (columns(2))
      columns(1) = new_quantity('deformation', 'm', [(e, e=1, self%count)], 'deformation of the teeth', 'if they are pressed', &
                                rank_twist, form_angle, 1.0_wp)
      columns(2) = new_quantity('force', 'N', [(e, e=1, self%count)], 'tooth force', &
                                'if its torque on the first wheel is', rank_force, form_total, 1.0_wp)
      return
    end if
    allocate (columns(merge(5, 4, self%number_of('section_modulus') > 0)))
    columns(1) = new_quantity('twist', 'rad', [(e, e=1, self%count)], 'twist', 'if the second body is ahead', rank_twist, &
                              form_angle, 1.0_wp)
    columns(2) = new_quantity('moment', 'N m', [(e, e=1, self%count)], 'elastic moment', 'on the first body', rank_moment, &
                              form_elastic, -1.0_wp)
    columns(3) = new_quantity('damping', 'N m', self%with_work, 'moment of damping and friction', 'on the first body', &
                              rank_detail, form_applied, -1.0_wp)
    columns(4) = new_quantity('total_moment', 'N m', self%with_work, 'elastic and damping moment', 'on the first body', &
                              rank_moment, form_total, -1.0_wp)
    if (size(columns) < 5) return
    associate (modulus => self%parameters(self%number_of('section_modulus'))%value)
      columns(5) = new_quantity('stress', 'Pa', pack(columns(1)%elements, any(modulus > 0, dim=1)), &
                                'shear stress', 'with the elastic and damping moment', rank_stress, form_total, &
                                -1.0_wp)
      columns(5)%divisor = self%number_of('section_modulus')
    end associate
  end subroutine quantities

end module nocdyn_couplings
