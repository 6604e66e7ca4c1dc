!> The torques T that teeth with losses transmit (`nocdyn_tooth_losses`), in a block of one lane.
!>
!> T is a sum of the moments of all elements: T = G M. The multipliers of the gears follow from the moments by constant
!> coefficients, as L_lambda is constant, and the force of an elastic mesh is the moment of an element itself.
module nocdyn_tooth_loads
  use nocdyn_bank, only: bank_slot_t, role_coupling
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_element_rows, only: element_rows_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_friction_joints, only: direction_of, first_wheel_drives
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: new_tooth_loads, widened

  real(wp), parameter, public :: mixed = 1.0e-3_wp   !! of the largest terms of equations, in the rounding errors of all of them

  type, public :: tooth_loads_t
    integer :: count = 0
    integer, allocatable :: joint(:)            !! of each loss, [losses] as all that follow
    integer, allocatable :: bank(:), number(:)  !! its bank, and its number there
    integer, allocatable :: loss_of(:)          !! of each joint, 0 for none, [joints]
    real(wp), allocatable :: by_moment(:, :)    !! G, [losses, elements]
    real(wp), allocatable :: by_joint(:, :)     !! V, T by the moments of the joints at the present slopes, [losses, joints]
    real(wp), allocatable :: applied(:)         !! T without the moments of the joints that hold and the losses [N m]
    real(wp), allocatable :: load(:)            !! T [N m]
    real(wp), allocatable :: drag(:)            !! -M while the wheels turn, without the effect of the joints that hold and of
                                                !! other losses, or its derivative [N m]; it is not used for locked wheels
    real(wp), allocatable :: moment(:)          !! of all elements, or its derivative; work space, [elements]
    real(wp), allocatable :: share(:)           !! share s of T that is lost while the wheels turn
    real(wp), allocatable :: share_slope(:)     !! its derivative by the speed [s/rad]
    real(wp), allocatable :: shift(:)           !! by which the boundary of T lies beyond zero [N m]
  contains
    procedure :: find_coefficients
    procedure :: weigh
    procedure :: apply
    procedure :: choose_shares
    procedure :: add_moments
    procedure :: shift_boundaries
    procedure :: power_of_driver
  end type tooth_loads_t

contains

  !> The losses of all banks.
  function new_tooth_loads(banks, bank_of_joint, number_of_joint, elements) result(self)
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: bank_of_joint(:), number_of_joint(:)   !! [joints]
    integer, intent(in) :: elements
    type(tooth_loads_t) :: self
    integer :: j

    allocate (self%joint(0))
    allocate (self%loss_of(size(bank_of_joint)), source=0)
    do j = 1, size(bank_of_joint)
      select type (bank => banks(bank_of_joint(j))%bank)
      class is (tooth_losses_t)
        self%joint = [self%joint, j]
        self%loss_of(j) = size(self%joint)
      end select
    end do
    self%count = size(self%joint)
    self%bank = bank_of_joint(self%joint)
    self%number = number_of_joint(self%joint)
    allocate (self%by_moment(self%count, merge(elements, 0, self%count > 0)), source=0.0_wp)
    allocate (self%by_joint(self%count, size(bank_of_joint)), source=0.0_wp)
    allocate (self%applied(self%count), source=0.0_wp)
    allocate (self%load, self%drag, self%share, self%share_slope, self%shift, source=self%applied)
    allocate (self%moment(size(self%by_moment, 2)), source=0.0_wp)
  end function new_tooth_loads

  !> Sets G at the start.
  subroutine find_coefficients(self, banks, rows, coordinates, constraints, bodies)
    class(tooth_loads_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(element_rows_t), intent(in) :: rows             !! of the elements
    type(coordinates_t), intent(inout) :: coordinates
    integer, intent(in) :: constraints, bodies           !! numbers of them
    real(wp) :: lambda(constraints), torque(bodies), by_torque(self%count, bodies)
    integer :: b, e, i, k

    if (self%count == 0) return
    do b = 1, bodies
      torque = 0.0_wp
      torque(b) = 1.0_wp
      lambda = 0.0_wp
      call coordinates%reactions_of_torques(1, torque, lambda)
      do i = 1, self%count
        by_torque(i, b) = 0.0_wp
        select type (bank => banks(self%bank(i))%bank)
        class is (tooth_losses_t)
          associate (row => bank%row(self%number(i)))
            if (row > 0) by_torque(i, b) = bank%factor(self%number(i)) * lambda(row)
          end associate
        end select
      end do
    end do
    self%by_moment(:, :) = 0.0_wp
    do e = 1, size(self%by_moment, 2)
      do k = rows%first(e), rows%first(e + 1) - 1
        if (rows%body(k) > 0) self%by_moment(:, e) = self%by_moment(:, e) + rows%coefficient(k) * by_torque(:, rows%body(k))
      end do
    end do
    do i = 1, self%count
      select type (bank => banks(self%bank(i))%bank)
      class is (tooth_losses_t)
        if (bank%row(self%number(i)) > 0) cycle
        self%by_moment(i, mesh_named(banks, bank%names(self%number(i)))) = bank%factor(self%number(i))
      end select
    end do
  end subroutine find_coefficients

  !> The element of a mesh.
  pure integer function mesh_named(banks, name)
    type(bank_slot_t), intent(in) :: banks(:)
    type(string_t), intent(in) :: name
    integer :: b, e

    mesh_named = 0
    do b = 1, size(banks)
      associate (bank => banks(b)%bank)
        if (bank%role /= role_coupling) cycle
        do e = 1, bank%count
          if (bank%names(e)%text == name%text) mesh_named = bank%first - 1 + e
        end do
      end associate
    end do
    if (mesh_named == 0) error stop 'nocdyn_tooth_loads: there is no such mesh'
  end function mesh_named

  !> Forms V at the slopes of the present position.
  pure subroutine weigh(self, element, driver, slope)
    class(tooth_loads_t), intent(inout) :: self
    integer, intent(in) :: element(:), driver(:)   !! of each joint; 0: no driver
    real(wp), intent(in) :: slope(:)               !! g', [joints]
    integer :: j

    do j = 1, merge(size(element), 0, self%count > 0)
      self%by_joint(:, j) = self%by_moment(:, element(j))
      if (driver(j) > 0) self%by_joint(:, j) = self%by_joint(:, j) - slope(j) * self%by_moment(:, driver(j))
    end do
  end subroutine weigh

  !> Finds T without the moments of the joints that hold and the losses, after the laws of all elements.
  pure subroutine apply(self, elements)
    class(tooth_loads_t), intent(inout) :: self
    type(element_values_t), intent(in) :: elements

    self%moment(:) = elements%restoring(1, :) + elements%applied(1, :)
    self%applied(:) = matmul(self%by_moment, self%moment)
  end subroutine apply

  !> Sets the shares that are lost at the present modes and speeds, and the drags.
  pure subroutine choose_shares(self, banks, mode, speed)
    class(tooth_loads_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: mode(:)       !! of the joints
    real(wp), intent(in) :: speed(:)     !! of all elements [rad/s]
    integer :: i

    do i = 1, self%count
      select type (bank => banks(self%bank(i))%bank)
      class is (tooth_losses_t)
        call bank%share(self%number(i), first_wheel_drives(mode(self%joint(i))), speed(bank%first - 1 + self%number(i)), &
                        self%share(i), self%share_slope(i))
      end select
    end do
    self%drag(:) = self%share * self%applied
  end subroutine choose_shares

  !> Adds what the moments of all joints do to T.
  pure subroutine add_moments(self, moment)
    class(tooth_loads_t), intent(inout) :: self
    real(wp), intent(in) :: moment(:)   !! [N m], [joints]

    self%load(:) = matmul(self%by_joint, moment)
    self%load(:) = self%applied + self%load
  end subroutine add_moments

  !> Positive where that wheel of turning teeth drives that the mode says [N m].
  pure real(wp) function power_of_driver(self, loss, mode)
    class(tooth_loads_t), intent(in) :: self
    integer, intent(in) :: loss, mode

    power_of_driver = direction_of(mode) * self%load(loss)
    if (first_wheel_drives(mode)) power_of_driver = -power_of_driver
  end function power_of_driver

  !> The shift of a boundary beyond rounding errors, or where a value is beyond it after a decision, which takes small slips for
  !> none, twice as far: they leave the rest after few more decisions.
  elemental real(wp) function widened(shift, inside)
    real(wp), intent(in) :: shift    !! by rounding errors
    real(wp), intent(in) :: inside   !! distance of the value from the boundary, negative beyond it
    real(wp), parameter :: widest = 1.0e6_wp

    widened = max(shift, min(widest * shift, -2 * inside))
  end function widened

  !> Shifts the boundaries of T, after a decision.
  pure subroutine shift_boundaries(self, elements, error, least, mode)
    class(tooth_loads_t), intent(inout) :: self
    type(element_values_t), intent(in) :: elements
    real(wp), intent(in) :: error(:)          !! of the moments of the joints [N m], [joints]
    real(wp), intent(in) :: least             !! least shift: the shift of the boundaries of the moments [N m]
    integer, intent(in) :: mode(:)            !! of the joints
    real(wp), parameter :: width = 1.0e-11_wp   ! relative to the terms of T
    integer :: i

    if (self%count == 0) return
    self%shift(:) = width * matmul(abs(self%by_moment), abs(elements%restoring(1, :)) + abs(elements%applied(1, :)))
    self%shift(:) = max(self%shift, mixed * maxval(self%shift), matmul(abs(self%by_joint), error), least)
    self%shift(:) = widened(self%shift, [(self%power_of_driver(i, mode(self%joint(i))), i=1, self%count)])
  end subroutine shift_boundaries

end module nocdyn_tooth_loads
