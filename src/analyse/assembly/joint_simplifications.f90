!> What analyses about a steady state make of joints: those that they refuse, those for which means over a turn stand, and losses
!> that they leave out.
module nocdyn_joint_simplifications
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_loss_assembly, only: has_losses
  use nocdyn_text, only: append, quoted, string_t
  implicit none (type, external)
  private

  public :: refuse_joints, list_simplifications, find_left_out

contains

  !> Refuses joints where it is not known which of them are locked, or where they are.
  subroutine refuse_joints(input, what, error, leaves_out_bearings)
    type(input_t), intent(in) :: input     !! joints that means stand for, and losses that are left out, are allowed
    character(len=*), intent(in) :: what   !! does not know it, e.g. 'nocdyn modes'
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: leaves_out_bearings   !! whether friction of bearings is left out, too; absent: no
    character(len=:), allocatable :: reason
    integer :: i
    logical :: allows_bearings

    allows_bearings = input%takes_means
    if (present(leaves_out_bearings)) allows_bearings = allows_bearings .or. leaves_out_bearings
    do i = 1, size(input%groups)
      if (input%groups(i)%kind == 'body' .and. allows_bearings) cycle
      call find_refusal(input%groups(i), input%takes_means, reason)
      if (reason == '') cycle
      call raise(error, exit_input, input%location(i) // ': ' // what // ' ' // reason)
      return
    end do
  end subroutine refuse_joints

  !> Why a group is refused, and what is allowed; '' if it is not.
  subroutine find_refusal(group, takes_means, text)
    type(group_t), intent(in) :: group
    logical, intent(in) :: takes_means   !! as in `input_t`
    character(len=:), allocatable, intent(out) :: text

    text = ''
    select case (group%kind)
    case ('body')
      if (group%number('bearing_friction') > 0) text = 'does not know whether bearings slip; allowed: bearing_friction = 0'
    case ('clutch', 'freewheel')
      text = 'does not know which joints are locked; allowed: no clutches and freewheels; a locked one is a &gear with ' // &
             'teeth = 1, 1 and internal = .true.'
    case ('cardan', 'crank', 'relation', 'drive')
      if (takes_means .and. has_mean(group)) return
      text = 'is for machines whose ratios are constant; allowed: no cardans, cranks, relations, drives'
      if (takes_means) text = 'is for machines whose ratios are constant; allowed: no drives, cams and levers'
    case default
      text = ''
    end select
  end subroutine find_refusal

  !> What an analysis about a steady state replaces or leaves out.
  subroutine list_simplifications(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(out) :: notes(:)
    character(len=:), allocatable :: losses, means
    integer :: i

    allocate (notes(0))
    if (.not. input%takes_means) return
    means = ''
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        if (has_mean(group)) means = means // ', ' // group%kind // ' ' // quoted(group%name)
      end associate
    end do
    if (means /= '') call append(notes, 'means over a turn stand for the ratios, inertias and torques of ' // means(3:))
    call find_left_out(input, .false., losses)
    if (losses /= '') call append(notes, 'the losses of ' // losses // ' are left out')
  end subroutine list_simplifications

  !> The groups whose losses a balance leaves out, e.g. "gear 'worm'"; '' if there are none.
  subroutine find_left_out(input, with_bearings, text)
    type(input_t), intent(in) :: input
    logical, intent(in) :: with_bearings   !! whether it leaves out the friction of bearings, too
    character(len=:), allocatable, intent(out) :: text
    logical :: is_left_out
    integer :: i

    text = ''
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        is_left_out = has_losses(group)
        if (group%kind == 'body' .and. with_bearings) is_left_out = group%number('bearing_friction') > 0
        if (is_left_out) text = text // ', ' // group%kind // ' ' // quoted(group%name)
      end associate
    end do
    if (text /= '') text = text(3:)
  end subroutine find_left_out

  !> Whether the ratio of a joint has a mean that tells how its bodies turn.
  pure logical function has_mean(group)
    type(group_t), intent(in) :: group

    select case (group%kind)
    case ('relation')
      has_mean = group%text('kind') == 'gear'
    case default
      has_mean = group%kind == 'cardan' .or. group%kind == 'crank'
    end select
  end function has_mean

end module nocdyn_joint_simplifications
