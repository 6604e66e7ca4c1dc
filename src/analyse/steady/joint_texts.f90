!> Sentences about the joints of a machine in a steady state: which hold, slip or are open, and which cannot hold.
module nocdyn_joint_texts
  use nocdyn_balance_texts, only: describe_state_speeds
  use nocdyn_bank, only: role_bearing, role_clutch, role_loss
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: friction_joints_t, locked
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_resting_joints, only: resting_joints_t
  use nocdyn_text, only: append, joined, quoted, rounded_text, string_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: describe_joints, describe_losses, describe_overload

  integer, parameter :: most_names = 5     ! in a message
  integer, parameter :: most_digits = 6

contains

  !> Which joints hold, slip or are open in the state that was observed, as ends of sentences on a state.
  subroutine describe_joints(formulation, texts)
    class(formulation_t), intent(in) :: formulation   !! after `observe`
    type(string_t), allocatable, intent(out) :: texts(:)
    character(len=:), allocatable :: holding, open, slipping
    integer :: j

    allocate (texts(0))
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
    if (holding /= '') call append(texts, 'there are locked: ' // holding)
    if (slipping /= '') call append(texts, 'there are slipping: ' // slipping)
    if (open /= '') call append(texts, 'there are open: ' // open)
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
          allowed = rounded_text(resting%least, most_digits) // ' to ' // rounded_text(resting%most, most_digits)
          if (resting%least <= -huge(1.0_wp)) allowed = 'at most ' // rounded_text(resting%most, most_digits)
          if (resting%most >= huge(1.0_wp)) allowed = 'at least ' // rounded_text(resting%least, most_digits)
        end select
      end associate
    end associate
    text = text // ': locked it would carry ' // rounded_text(resting%needed, most_digits) // ' N m; allowed: ' // allowed
  end subroutine describe_overload

  !> "'worm', 'stage'": the teeth with losses; '' if there are none.
  subroutine describe_losses(machine, text)
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable, intent(out) :: text
    type(string_t), allocatable :: names(:)
    integer :: b

    allocate (names(0))
    do b = 1, size(machine%banks)
      select type (losses => machine%banks(b)%bank)
      class is (tooth_losses_t)
        names = [names, losses%names]
      end select
    end do
    text = ''
    if (size(names) > 0) text = joined(names, ', ', most_names)
  end subroutine describe_losses

end module nocdyn_joint_texts
