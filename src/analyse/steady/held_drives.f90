!> What drives a machine whose speed is held: its motors or engines; the frequency of the supplies of motors; the speed control,
!> whose governors have that speed as the set one, and a throttle between its limits that follows the oscillations. Where a drive
!> holds the speed, the speeds of what it leaves free.
module nocdyn_held_drives
  use nocdyn_balance_starts, only: solve_by_newton
  use nocdyn_bank, only: bank_of, role_bearing, role_excitation, role_motor
  use nocdyn_block_solutions, only: block_solutions_t
  use nocdyn_equilibrium, only: equilibrium_t, t_infinity
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_governed_banks, only: governed_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_steady_start, only: find_operating_state
  use nocdyn_text, only: quoted, string_t
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: all_follow, close_speed_loops, find_free_speeds, follow_free_speeds, idle_share, refuse_standing_friction, &
    set_supplies, sources_of, supply_machine

contains

  !> The elements that drive: motors; if there are none, the cylinders of engines.
  function sources_of(balance) result(sources)
    type(torque_balance_t), intent(in) :: balance
    integer, allocatable :: sources(:)
    integer :: b, i, role
    logical :: is_source(size(balance%inelastic))

    do role = role_motor, role_excitation
      is_source = .false.
      do b = 1, size(balance%formulation%machine%banks)
        associate (bank => balance%formulation%machine%banks(b)%bank)
          if (bank%role /= role .or. (role == role_excitation .and. .not. bank%is_engine)) cycle
          is_source = is_source .or. (balance%inelastic >= bank%first .and. balance%inelastic <= bank%last())
        end associate
      end do
      sources = pack([(i, i=1, size(is_source))], is_source)
      if (size(sources) > 0) return
    end do
  end function sources_of

  !> Whether all that drives can follow the frequency of a supply.
  logical function all_follow(balance, sources)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: sources(:)   !! elements that drive, numbered in `balance%inelastic`
    integer :: i

    all_follow = size(sources) > 0
    associate (banks => balance%formulation%machine%banks)
      do i = 1, size(sources)
        all_follow = all_follow .and. banks(bank_of(banks, balance%inelastic(sources(i))))%bank%follows_supply()
      end do
    end associate
  end function all_follow

  !> Gives all supplies of a balance a frequency.
  subroutine set_supplies(balance, share)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: share   !! of the frequency in the input

    associate (formulation => balance%formulation)
      call supply_machine(formulation%machine, formulation%state, share)
    end associate
  end subroutine set_supplies

  !> Gives all supplies of a machine a frequency.
  subroutine supply_machine(machine, state, share)
    type(machine_t), intent(inout) :: machine
    type(machine_state_t), intent(inout) :: state
    real(wp), intent(in) :: share   !! of the frequency in the input
    integer :: b

    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (.not. bank%follows_supply()) cycle
        call bank%set_supply(share)
        call state%banks(b)%refresh_lane(bank, 1)
      end associate
    end do
  end subroutine supply_machine

  !> The share of the frequency at which the first motor has no slip, after `evaluate`.
  real(wp) function idle_share(balance, sources)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: sources(:)   !! elements that drive, numbered in `balance%inelastic`

    associate (e => balance%inelastic(sources(1)), machine => balance%formulation%machine, state => balance%formulation%state)
      associate (bank => machine%banks(bank_of(machine%banks, e))%bank)
        idle_share = bank%idle_supply(e - bank%first + 1, state%elements%speed(1, e))
      end associate
    end associate
  end function idle_share

  !> Gives the governors of the motors that drive the throttles at which these have their torques. A throttle beyond its limits
  !> stays open; so does the one of a motor with an armature current of its own.
  subroutine close_speed_loops(balance, sources, factor, z, weight)
    type(torque_balance_t), intent(inout) :: balance
    integer, intent(in) :: sources(:)      !! elements that drive
    real(wp), intent(in) :: factor         !! on their torques with open throttles
    real(wp), intent(inout) :: z(:)        !! rigid motions and internal states, with open throttles
    real(wp), intent(inout) :: weight(:)   !! on the moments, [elements]
    integer :: b, e

    do b = 1, size(balance%formulation%machine%banks)
      select type (bank => balance%formulation%machine%banks(b)%bank)
      class is (governed_bank_t)
        if (.not. bank%has_governor .or. bank%states > 1) cycle
        do e = 1, bank%count
          if (any(sources == bank%first + e - 1)) call close_loop(balance, bank, e, factor, z, weight(bank%first + e - 1))
        end do
      class default
        cycle
      end select
    end do
  end subroutine close_speed_loops

  !> The torque of a motor is a linear function of its throttle, which two throttles tell.
  subroutine close_loop(balance, bank, element, factor, z, weight)
    type(torque_balance_t), intent(inout) :: balance
    class(governed_bank_t), intent(in) :: bank
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: factor
    real(wp), intent(inout) :: z(:), weight
    real(wp), parameter :: half = 0.5_wp
    real(wp) :: opened(size(z)), torque(2), throttle

    associate (integral => size(balance%motions%free) + bank%first_internal + element - 1, &
               elements => balance%formulation%state%elements, e => bank%first + element - 1)
      opened = z
      call balance%evaluate(z)
      torque(1) = elements%restoring(1, e) + elements%applied(1, e)
      z(integral) = bank%integral_of(element, balance%t(1), elements%speed(1, e), half)
      call balance%evaluate(z)
      torque(2) = elements%restoring(1, e) + elements%applied(1, e)
      throttle = 1.0_wp
      if (abs(torque(1) - torque(2)) > 0) throttle = half + half * (factor * torque(1) - torque(2)) / (torque(1) - torque(2))
      if (bank%least_throttle() < throttle .and. throttle < 1.0_wp) then
        z(integral) = bank%integral_of(element, balance%t(1), elements%speed(1, e), throttle)
        weight = 1.0_wp
      else
        z = opened
      end if
    end associate
  end subroutine close_loop

  !> Finds the steady state that is nearest to the start, a stable one if there is one.
  subroutine find_free_speeds(balance, z, error)
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(inout) :: z(:)                      !! rigid motions and internal states
    type(error_t), allocatable, intent(out) :: error     !! there is none, or none was found
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(string_t), allocatable :: notes(:)
    integer :: nearest

    if (size(z) == 0) return
    call find_operating_state(balance%formulation%machine, t_infinity, formulation, equilibria, nearest, notes, error)
    if (allocated(error)) return
    associate (y => equilibria(nearest)%y)
      z = [y(1, balance%motions%free), y(1, 2 * balance%coordinates + 1:)]
    end associate
  end subroutine find_free_speeds

  !> Follows a steady state that is near, by Newton's method; searches for one if that fails.
  subroutine follow_free_speeds(balance, z, error)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(inout) :: z(:)                      !! rigid motions and internal states
    type(error_t), allocatable, intent(out) :: error
    type(block_solutions_t) :: block
    real(wp) :: ahead(size(z))
    integer :: i

    if (size(z) == 0) return
    block%members = [(i, i=1, size(z))]
    allocate (block%values(size(z), 0), block%is_range(0))
    ahead = z
    call solve_by_newton(balance, ahead, block)
    if (size(block%values, 2) > 0) then
      z = ahead
    else
      call find_free_speeds(balance, z, error)
    end if
  end subroutine follow_free_speeds

  !> Refuses bearings with friction that stand still: whether they hold in vibrations is not known.
  subroutine refuse_standing_friction(balance, error)
    type(torque_balance_t), intent(in) :: balance   !! evaluated
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: none = 1.0e-10_wp        ! relative to the largest speed
    integer :: j

    associate (joints => balance%joints, machine => balance%formulation%machine, &
               speed => balance%formulation%state%elements%speed)
      do j = 1, joints%count
        if (machine%banks(joints%bank(j))%bank%role /= role_bearing) cycle
        if (abs(speed(1, joints%element(j))) > none * maxval(abs(speed(1, :)))) cycle
        call raise(error, exit_failed, quoted(machine%element_name(joints%element(j))) // ' stands still: whether the ' // &
                   'friction of its bearing holds in vibrations is not known; allowed: bearing_friction = 0 there')
        return
      end do
    end associate
  end subroutine refuse_standing_friction

end module nocdyn_held_drives
