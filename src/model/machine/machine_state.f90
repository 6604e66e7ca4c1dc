!> What changes while a machine is evaluated: the values of its elements, the branches of their laws, work space. A machine is
!> only read, and may have several states.
module nocdyn_machine_state
  use nocdyn_bank_states, only: bank_state_t, new_bank_state
  use nocdyn_elements, only: element_values_t, new_element_values
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  implicit none (type, external)
  private

  public :: new_machine_state

  type, public :: machine_state_t
    type(element_values_t) :: elements            !! values of the elements of the machine
    type(bank_state_t), allocatable :: banks(:)   !! of the banks of the machine
  contains
    procedure :: choose_branches
    procedure :: keep_branches, restore_branches, take_branches
    procedure :: settle_internal
    procedure :: evaluate
    procedure :: evaluate_elements
    procedure :: differentiate_elements
    procedure :: evaluate_energies
    procedure :: fastest_wave
    procedure :: refresh_lane, take_constants
    procedure :: power
  end type machine_state_t

contains

  !> A state of a machine: at rest, without moments, on the first branches.
  function new_machine_state(machine) result(self)
    type(machine_t), intent(in) :: machine
    type(machine_state_t) :: self
    integer :: i

    self%elements = new_element_values(machine%elements, machine%lanes)
    allocate (self%banks(size(machine%banks)))
    do i = 1, size(machine%banks)
      self%banks(i) = new_bank_state(machine%banks(i)%bank, machine%elements%count)
    end do
  end function new_machine_state

  !> Chooses the branches of the laws in all lanes, from the angles, speeds and internal states in `elements`.
  subroutine choose_branches(self, machine, t)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), contiguous, intent(in) :: t(:)   !! [s], [lanes]
    integer :: k, lane

    associate (switches => machine%switches, elements => self%elements)
      do k = 1, switches%count
        do lane = 1, machine%lanes
          associate (e => switches%element(k), p => switches%moving(switches%phase_place(k)))
            call switches%choose(machine%banks, self%banks, k, lane, t(lane), &
                                 [elements%angle(lane, e), elements%speed(lane, e), elements%angle(lane, p), &
                                  elements%speed(lane, p)], elements%internal%value(lane, :))
          end associate
        end do
      end do
    end associate
  end subroutine choose_branches

  !> Keeps the present branches of all laws, to which `restore_branches` goes back.
  subroutine keep_branches(self)
    class(machine_state_t), intent(inout) :: self
    integer :: i

    do i = 1, size(self%banks)
      if (size(self%banks(i)%branch) > 0) self%banks(i)%kept_branch(:, :) = self%banks(i)%branch
    end do
  end subroutine keep_branches

  subroutine restore_branches(self, machine)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer :: i, lane, switch

    do i = 1, size(self%banks)
      associate (state => self%banks(i))
        do switch = 1, size(state%branch, 2)
          do lane = 1, size(state%branch, 1)
            call state%set_branch(machine%banks(i)%bank, switch, lane, state%kept_branch(lane, switch))
          end do
        end do
      end associate
    end do
  end subroutine restore_branches

  !> Puts a lane on the branches of a lane of another state, of a machine with the same structure.
  subroutine take_branches(self, machine, lane, from, from_lane)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    type(machine_state_t), intent(in) :: from
    integer, intent(in) :: from_lane   !! lane of `from`
    integer :: i, switch

    do i = 1, size(self%banks)
      do switch = 1, size(self%banks(i)%branch, 2)
        call self%banks(i)%set_branch(machine%banks(i)%bank, switch, lane, from%banks(i)%branch(from_lane, switch))
      end do
    end do
  end subroutine take_branches

  !> Replaces the internal states in the first lane of `elements` by those that do not change at the speeds there.
  subroutine settle_internal(self, machine, t)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t   !! [s]
    integer :: i

    do i = 1, size(machine%internal_banks)
      associate (bank => machine%banks(machine%internal_banks(i))%bank, speed => self%elements%speed, &
                 z => self%elements%internal%value)
        call bank%steady_internal(t, speed(1, bank%first:bank%last()), &
                                  z(1, bank%first_internal:bank%first_internal + bank%states * bank%count - 1))
      end associate
    end do
  end subroutine settle_internal

  !> Torques T = Q + C omega + K phi of all elements on the bodies: the right-hand side of eq. (12) without reactions.
  subroutine evaluate(self, machine, t, phi, omega, torque)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), contiguous, intent(in) :: t(:)               !! [s], [lanes]
    real(wp), contiguous, intent(in) :: phi(:, 0:)         !! angles [rad], [lanes, 0:bodies], body 0 is the ground
    real(wp), contiguous, intent(in) :: omega(:, 0:)       !! speeds [rad/s], [lanes, 0:bodies]
    real(wp), contiguous, intent(inout) :: torque(:, 0:)   !! [N m], [lanes, 0:bodies]

    call self%elements%gather(machine%elements%rows, phi, omega)
    call self%evaluate_elements(machine, t)
    call self%elements%scatter(machine%elements%rows, torque)
  end subroutine evaluate

  !> Moments of all elements, from the angles and speeds in `elements`. Only addresses are passed, no array descriptors.
  subroutine evaluate_elements(self, machine, t)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t(machine%lanes)   !! [s]
    real(wp) :: none(0)
    integer :: i

    call machine%laws%evaluate(self%elements)
    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank, law => self%banks(machine%general_banks(i))%law, &
                 x => self%elements, internal => self%elements%internal)
        associate (e => bank%first, s => bank%first_internal)
          if (bank%states > 0) then
            call law%evaluate(t, x%angle(1, e), x%speed(1, e), internal%value(1, s), x%restoring(1, e), x%applied(1, e), &
                              internal%rate(1, s))
          else
            call law%evaluate(t, x%angle(1, e), x%speed(1, e), none, x%restoring(1, e), x%applied(1, e), none)
          end if
        end associate
      end associate
    end do
  end subroutine evaluate_elements

  !> Derivatives of the moments, after `evaluate_elements`.
  subroutine differentiate_elements(self, machine, t)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t(machine%lanes)   !! [s]
    integer :: first_cross, i

    self%elements%time(:) = t
    call machine%laws%differentiate(self%elements)
    call self%elements%cross%clear()
    first_cross = 1
    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank)
        call self%banks(machine%general_banks(i))%law%differentiate(bank%first, bank%first_internal, first_cross, self%elements)
        if (bank%ports > 1) first_cross = first_cross + 2 * bank%count
      end associate
    end do
  end subroutine differentiate_elements

  !> Stored energies of all elements, from the angles and speeds in `elements`.
  subroutine evaluate_energies(self, machine)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer :: i

    call machine%laws%evaluate_energies(self%elements)
    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank, elements => self%elements)
        call self%banks(machine%general_banks(i))%law%evaluate_energies(bank%first, elements)
        if (bank%states == 0) cycle
        call bank%keep_energy(elements)
        elements%stored(:, bank%first:bank%last()) = elements%stored(:, bank%first:bank%last()) &
                                                     + elements%kept(:, bank%first:bank%last())
      end associate
    end do
  end subroutine evaluate_energies

  !> The largest rate at which the moments of one lane oscillate with the time or an angle [rad/s], at the speeds in `elements`.
  pure real(wp) function fastest_wave(self, machine, lane) result(fastest)
    class(machine_state_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    integer :: i

    fastest = 0.0_wp
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%moving_rows > 0) then   ! whose moments are reactions
          fastest = max(fastest, bank%fastest_wave(lane))
        else if (allocated(self%banks(i)%law)) then
          associate (last => bank%first - 1 + bank%ports * bank%count)   ! of its phases
            fastest = max(fastest, self%banks(i)%law%fastest(lane, self%elements%speed(lane, bank%first:last)))
          end associate
        end if
      end associate
    end do
  end function fastest_wave

  !> Computes what the laws keep of the parameters of a lane, after these have changed.
  subroutine refresh_lane(self, machine, lane)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    integer :: i

    do i = 1, size(self%banks)
      call self%banks(i)%refresh_lane(machine%banks(i)%bank, lane)
    end do
  end subroutine refresh_lane

  !> Takes the constants of a switch's element in one lane, after a program has put them on another branch.
  subroutine take_constants(self, machine, switch, lane)
    class(machine_state_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: switch, lane

    associate (bank => machine%switches%bank_of(switch))
      call self%banks(bank)%law%take_constants(lane, machine%switches%element(switch) - machine%banks(bank)%bank%first + 1)
    end associate
  end subroutine take_constants

  !> Powers of the elements `with_work` after `evaluate`, positive into the machine.
  subroutine power(self, machine, watts)
    class(machine_state_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(inout) :: watts(machine%lanes, size(machine%with_work))   !! [W]
    integer :: e, k, l

    if (machine%lanes == 1) then   ! without loops of one turn
      associate (elements => machine%with_work, applied => self%elements%applied, speed => self%elements%speed)
        do k = 1, size(elements)
          watts(1, k) = applied(1, elements(k)) * speed(1, elements(k))
        end do
      end associate
      return
    end if
    do k = 1, size(machine%with_work)
      e = machine%with_work(k)
      do l = 1, machine%lanes
        watts(l, k) = self%elements%applied(l, e) * self%elements%speed(l, e)
      end do
    end do
  end subroutine power

end module nocdyn_machine_state
