!> The frequency of the supplies of motors whose speed is held.
module nocdyn_held_supplies
  use nocdyn_bank, only: bank_of
  use nocdyn_kinds, only: wp
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: all_follow, idle_share, set_supplies

contains

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

  !> Gives all supplies a frequency.
  subroutine set_supplies(balance, share)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: share   !! of the frequency in the input
    integer :: b

    do b = 1, size(balance%formulation%machine%banks)
      call balance%formulation%machine%banks(b)%bank%set_supply(share)
    end do
  end subroutine set_supplies

  !> The share of the frequency at which the first motor has no slip, after `evaluate`.
  real(wp) function idle_share(balance, sources)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: sources(:)   !! elements that drive, numbered in `balance%inelastic`

    associate (e => balance%inelastic(sources(1)), machine => balance%formulation%machine)
      associate (bank => machine%banks(bank_of(machine%banks, e))%bank)
        idle_share = bank%idle_supply(e - bank%first + 1, machine%elements%speed(1, e))
      end associate
    end associate
  end function idle_share

end module nocdyn_held_supplies
