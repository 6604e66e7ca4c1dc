!> A machine: bodies, banks of elements, constraints and the coordinates that they leave, on a block of lanes.
module nocdyn_machine
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_constraints, only: constraints_t
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, public :: machine_t
    integer :: lanes = 1
    integer :: bodies = 0
    type(string_t), allocatable :: names(:)         !! of the bodies
    real(wp), allocatable :: inertia(:, :)          !! J [kg m2], shape [lanes, bodies]
    real(wp), allocatable :: start_angle(:, :)      !! [rad]
    real(wp), allocatable :: start_speed(:, :)      !! [rad/s], obeys the constraints
    type(bank_slot_t), allocatable :: banks(:)
    type(constraints_t) :: constraints
    type(geared_group_t), allocatable :: groups(:)
    type(coordinates_t) :: coordinates
  contains
    procedure :: accounts
    procedure :: accounted_name
    procedure :: evaluate
    procedure :: differentiate
    procedure :: power
    procedure :: kinetic_energy
    procedure :: stored_energy
  end type machine_t

contains

  !> How many elements have their power integrated.
  pure integer function accounts(self)
    class(machine_t), intent(in) :: self
    integer :: i

    accounts = 0
    do i = 1, size(self%banks)
      accounts = accounts + size(self%banks(i)%bank%accounted)
    end do
  end function accounts

  !> Name of the element whose power is integrated as number `index`.
  pure function accounted_name(self, index) result(name)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=:), allocatable :: name
    integer :: i, before

    before = 0
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        if (index <= before + size(bank%accounted)) then
          name = bank%names(bank%accounted(index - before))%text
          return
        end if
        before = before + size(bank%accounted)
      end associate
    end do
    error stop 'nocdyn_machine: there are not so many accounted elements'
  end function accounted_name

  !> The torques T = Q + C omega + K phi of all elements on the bodies, the right-hand side of eq. (12) without reactions.
  subroutine evaluate(self, t, phi, omega, torque)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)   !! [lanes, ground and bodies]
    real(wp), contiguous, intent(inout) :: torque(:, 0:)
    integer :: i

    torque(:, :) = 0.0_wp
    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        call bank%gather(phi, omega)
        call bank%evaluate(t)
        call bank%scatter(torque)
      end associate
    end do
  end subroutine evaluate

  !> Evaluates all elements and their derivatives, which stay in the banks.
  subroutine differentiate(self, t, phi, omega)
    class(machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: phi(:, 0:), omega(:, 0:)
    integer :: i

    do i = 1, size(self%banks)
      associate (bank => self%banks(i)%bank)
        call bank%gather(phi, omega)
        call bank%evaluate(t)
        call bank%differentiate(t)
      end associate
    end do
  end subroutine differentiate

  !> Power of the accounted elements after `evaluate`, positive into the machine [W], shape [lanes, accounts].
  subroutine power(self, watts)
    class(machine_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: watts(:, :)
    integer :: i, last, next

    next = 1
    do i = 1, size(self%banks)
      last = next + size(self%banks(i)%bank%accounted) - 1
      call self%banks(i)%bank%power(watts(:, next:last))
      next = last + 1
    end do
  end subroutine power

  !> omega^T J omega / 2 of one lane [J].
  pure function kinetic_energy(self, lane, omega) result(energy)
    class(machine_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: omega(:)   !! [bodies]
    real(wp) :: energy

    energy = 0.5_wp * sum(self%inertia(lane, :) * omega**2)
  end function kinetic_energy

  !> Potential energy in the elements of one lane, at the angles of the last `evaluate` [J].
  function stored_energy(self, lane) result(energy)
    class(machine_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp) :: energy
    integer :: i

    energy = 0.0_wp
    do i = 1, size(self%banks)
      call self%banks(i)%bank%assess()
      energy = energy + sum(self%banks(i)%bank%stored(lane, :))
    end do
  end function stored_energy

end module nocdyn_machine
