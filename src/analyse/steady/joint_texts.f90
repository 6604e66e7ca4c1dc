!> Sentences about the joints of a machine in a steady state: which hold, slip or are open, and which cannot hold.
module nocdyn_joint_texts
  use nocdyn_balance_texts, only: describe_state_speeds
  use nocdyn_bank, only: role_bearing, role_clutch, role_loss
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: friction_joints_t, locked
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_resting_joints, only: resting_joints_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: allowed_torques, describe_joints, describe_overload

  integer, parameter :: most_digits = 6

contains

  !> Lists which joints hold, slip or are open in the state that was observed: "locked in this state: clutch 'a', clutch 'b'".
  subroutine describe_joints(formulation, state, notes)
    class(formulation_t), intent(in) :: formulation   !! after `observe`
    character(len=*), intent(in) :: state             !! "this state"
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: holding, open, slipping
    integer :: j

    holding = ''
    open = ''
    slipping = ''
    do j = 1, formulation%joints%locking
      associate (bank => formulation%machine%banks(formulation%joints%bank(j))%bank, number => formulation%joints%number(j))
        if (formulation%joints%mode(j) == locked) then
          call add_to(holding, trim(kind_of(bank%role)) // ' ' // quoted(bank%names(number)%text))
        else if (bank%role == role_bearing .or. bank%role == role_loss) then
          cycle
        else if (abs(formulation%machine%elements%applied(1, formulation%joints%element(j))) > 0.0_wp) then
          call add_to(slipping, trim(kind_of(bank%role)) // ' ' // quoted(bank%names(number)%text))
        else
          call add_to(open, trim(kind_of(bank%role)) // ' ' // quoted(bank%names(number)%text))
        end if
      end associate
    end do
    if (holding /= '') call append(notes, 'locked in ' // state // ': ' // holding)
    if (slipping /= '') call append(notes, 'slipping in ' // state // ': ' // slipping)
    if (open /= '') call append(notes, 'open in ' // state // ': ' // open)
  end subroutine describe_joints

  !> "clutch", before its name.
  pure function kind_of(role) result(text)
    integer, intent(in) :: role
    character(len=19) :: text

    select case (role)
    case (role_bearing)
      text = 'bearing friction of'
    case (role_loss)
      text = 'teeth of'
    case (role_clutch)
      text = 'clutch'
    case default
      text = 'freewheel'
    end select
  end function kind_of

  !> Adds an item to a list.
  subroutine add_to(list, item)
    character(len=:), allocatable, intent(inout) :: list
    character(len=*), intent(in) :: item

    if (list /= '') list = list // ', '
    list = list // item
  end subroutine add_to

  !> Which joint would slip in a state in which it is to be at rest, by how much torque.
  subroutine describe_overload(balance, resting, text)
    type(torque_balance_t), intent(inout) :: balance   !! with the unknowns of the state
    type(resting_joints_t), intent(in) :: resting      !! with a joint that cannot hold
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable :: allowed, speeds

    call balance%formulation%set_state(balance%y)
    call describe_state_speeds(balance%formulation, speeds)
    associate (joints => balance%joints, j => resting%overloaded)
      associate (bank => balance%formulation%machine%banks(joints%bank(j))%bank)
        text = 'at ' // speeds // ' ' // trim(kind_of(bank%role)) // ' ' // quoted(bank%names(joints%number(j))%text) // &
               ' does not hold'
        select type (bank)
        class is (tooth_losses_t)
          return
        class is (friction_joints_t)
          call allowed_torques(resting%least, resting%most, allowed)
        end select
      end associate
    end associate
    text = text // ': locked it would carry ' // rounded_text(resting%needed, most_digits) // ' N m; allowed: ' // allowed
  end subroutine describe_overload

  !> "-20 to 20", "at most 20".
  subroutine allowed_torques(least, most, text)
    real(wp), intent(in) :: least, most   !! that a joint holds, huge without a bound [N m]
    character(len=:), allocatable, intent(out) :: text

    text = rounded_text(least, most_digits) // ' to ' // rounded_text(most, most_digits)
    if (least <= -huge(1.0_wp)) text = 'at most ' // rounded_text(most, most_digits)
    if (most >= huge(1.0_wp)) text = 'at least ' // rounded_text(least, most_digits)
  end subroutine allowed_torques

end module nocdyn_joint_texts
