!> Elements of one kind, evaluated together on a block of lanes: gather, one vector loop, scatter.
!>
!> Every element acts between two bodies along its relative angle u = phi_to - phi_from (body 0 is the ground, which
!> stands still): its law gives a moment M(t, u, u') that acts on `to`, and -M on `from`. The moment is the sum of
!> a restoring part, which has a potential, and a working part, whose power enters or leaves the machine.
!> A new kind of element extends `bank_t` by its law and the derivatives of that law.
module nocdyn_bank
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  integer, parameter, public :: role_coupling = 1     !! in K and C of eqs. (21), (22); stores energy
  integer, parameter, public :: role_load = 2         !! in C of eq. (22); takes energy out
  integer, parameter, public :: role_motor = 3        !! in Q_m of eq. (18); puts energy in
  integer, parameter, public :: role_excitation = 4   !! in Q_0 of eq. (17); puts energy in

  character(len=*), parameter, public :: role_names(4) = ['coupling  ', 'load      ', 'motor     ', 'excitation']

  !> What a bank puts into the table of results for each of its elements.
  type, public :: quantity_t
    character(len=16) :: name          !! first part of the column's name, e.g. 'torque'
    character(len=8) :: unit
    integer, allocatable :: elements(:) !! those that have it
  end type quantity_t

  type, abstract, public :: bank_t
    type(string_t), allocatable :: names(:)
    integer, allocatable :: from(:)          !! body, 0 = ground
    integer, allocatable :: to(:)            !! body, 0 = ground
    integer, allocatable :: accounted(:)     !! elements whose power is integrated
    integer :: role = role_coupling          !! role_...: which term of eq. (12) the bank belongs to
    real(wp), allocatable :: damping(:, :)           !! linear damping c: `working` contains -c u' [N m s/rad]
    real(wp), allocatable :: angle(:, :)             !! u [rad], shape [lanes, elements] as all of these
    real(wp), allocatable :: speed(:, :)             !! u' [rad/s]
    real(wp), allocatable :: restoring(:, :)         !! part of M with a potential [N m]
    real(wp), allocatable :: working(:, :)           !! the rest of M [N m]
    real(wp), allocatable :: restoring_angle(:, :)   !! derivative of `restoring` by u
    real(wp), allocatable :: restoring_curvature(:, :)   !! second derivative of `restoring` by u
    real(wp), allocatable :: working_angle(:, :)     !! derivative of `working` by u
    real(wp), allocatable :: working_speed(:, :)     !! derivative of `working` by u'
    real(wp), allocatable :: working_time(:, :)      !! derivative of `working` by t
    real(wp), allocatable :: stored(:, :)            !! potential energy of `restoring` [J]
    real(wp), allocatable :: secant(:, :)            !! secant stiffness K12 of eq. (3), the -K12 u in `restoring` [N m/rad]
  contains
    procedure(law_interface), deferred :: evaluate
    procedure(law_interface), deferred :: differentiate
    procedure :: connect
    procedure :: is_source
    procedure :: gather
    procedure :: scatter
    procedure :: power
    procedure :: assess
    procedure :: quantities
    procedure :: observe
  end type bank_t

  !> One bank of whatever kind, so that a machine can hold a list of them.
  type, public :: bank_slot_t
    class(bank_t), allocatable :: bank
  end type bank_slot_t

  abstract interface
    !> `evaluate` fills `restoring` and `working`, `differentiate` their derivatives, from `angle` and `speed`.
    subroutine law_interface(self, t)
      import :: bank_t, wp
      class(bank_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: t(:)   !! time of each lane [s]
    end subroutine law_interface
  end interface

contains

  !> Sets the connectivity and allocates the work arrays; every extension's constructor calls it.
  subroutine connect(self, role, lanes, names, from, to)
    class(bank_t), intent(inout) :: self
    integer, intent(in) :: role
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: from(:), to(:)
    integer :: e

    self%role = role
    self%names = names
    self%from = from
    self%to = to
    self%accounted = [(e, e=1, size(to))]
    allocate (self%angle(lanes, size(to)), source=0.0_wp)
    allocate (self%speed, self%restoring, self%working, source=self%angle)
    allocate (self%restoring_angle, self%working_angle, self%working_speed, self%working_time, source=self%angle)
    allocate (self%damping, self%stored, self%secant, self%restoring_curvature, source=self%angle)
  end subroutine connect

  !> Whether the work of the elements counts as work put in, not as work taken out.
  pure logical function is_source(self)
    class(bank_t), intent(in) :: self

    is_source = self%role == role_motor .or. self%role == role_excitation
  end function is_source

  !> Relative angles and speeds of the elements from those of the bodies.
  subroutine gather(self, phi, omega)
    class(bank_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: phi(:, 0:)     !! [lanes, ground and bodies] [rad]
    real(wp), contiguous, intent(in) :: omega(:, 0:)   !! [rad/s]
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(self%angle, 1)
        self%angle(l, e) = phi(l, self%to(e)) - phi(l, self%from(e))
        self%speed(l, e) = omega(l, self%to(e)) - omega(l, self%from(e))
      end do
    end do
  end subroutine gather

  !> Adds the moments to the torques on the bodies.
  subroutine scatter(self, torque)
    class(bank_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: torque(:, 0:)   !! [lanes, ground and bodies] [N m]
    real(wp) :: moment
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, size(self%angle, 1)
        moment = self%restoring(l, e) + self%working(l, e)
        torque(l, self%to(e)) = torque(l, self%to(e)) + moment
        torque(l, self%from(e)) = torque(l, self%from(e)) - moment
      end do
    end do
  end subroutine scatter

  !> Power of the working moments of the accounted elements, positive into the machine [W].
  subroutine power(self, watts)
    class(bank_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: watts(:, :)   !! [lanes, accounted elements]
    integer :: k, l

    do k = 1, size(self%accounted)
      do l = 1, size(watts, 1)
        watts(l, k) = self%working(l, self%accounted(k)) * self%speed(l, self%accounted(k))
      end do
    end do
  end subroutine power

  !> Fills `stored` and `secant` from `angle`: by default both are zero.
  subroutine assess(self)
    class(bank_t), intent(inout) :: self

    self%stored(:, :) = 0.0_wp
    self%secant(:, :) = 0.0_wp
  end subroutine assess

  !> The columns of the bank in the table of results: by default the torque of each element.
  function quantities(self) result(columns)
    class(bank_t), intent(in) :: self
    type(quantity_t), allocatable :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1)%name = 'torque'
    columns(1)%unit = 'N m'
    columns(1)%elements = [(e, e=1, size(self%to))]
  end function quantities

  !> Values of the quantity number `quantity` of all elements after `evaluate`.
  pure subroutine observe(self, quantity, lane, values)
    class(bank_t), intent(in) :: self
    integer, intent(in) :: quantity
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements]

    values = self%restoring(lane, :) + self%working(lane, :)
    if (quantity /= 1) error stop 'nocdyn_bank: a bank with several quantities overrides observe'
  end subroutine observe

end module nocdyn_bank
