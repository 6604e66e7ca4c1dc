!> Sentences about steady states: the speeds at which torques balance or do not, and the joints that hold, slip, are open, or
!> cannot hold.
module nocdyn_steady_texts
  use nocdyn_bank, only: role_bearing, role_clutch, role_loss
  use nocdyn_block_solutions, only: block_solutions_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: friction_joints_t, locked
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_resting_joints, only: resting_joints_t
  use nocdyn_text, only: append, joined, quoted, rounded_text, selected, string_t, to_text
  use nocdyn_tooth_losses, only: tooth_losses_t
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: allowed_torques, describe_joints, describe_overload, describe_speeds, describe_state_speeds, explain_no_balance, &
            list_moving_bodies

  integer, parameter :: most_names = 5   ! of bodies in a message
  integer, parameter :: digits = 6, speed_digits = 4   ! at a minimum of the torque the speed has half of the digits
  real(wp), parameter :: alike = 1.0e-6_wp   ! relative difference of speeds that are printed alike

contains

  !> Message about a block without solution: that there is none, if that is known, or what was tried.
  subroutine explain_no_balance(balance, block, sentence)
    type(torque_balance_t), intent(in) :: balance
    type(block_solutions_t), intent(in) :: block
    character(len=:), allocatable, intent(out) :: sentence
    character(len=:), allocatable :: bodies
    type(string_t), allocatable :: names(:)

    allocate (names, source=balance%formulation%machine%names)
    call list_moving_bodies(balance, block%members, bodies)
    if (.not. block%is_complete) then
      sentence = 'no steady state was found: nothing was found that balances the torques on ' // &
                 bodies // '; tried: a scan over one speed with the others following it, ' // &
                 'Newton''s method from ' // to_text(block%starts) // ' combinations of rest, synchronous speeds and knees ' // &
                 'of the curves, and the motion from the start'
      return
    end if
    sentence = 'there is no steady state: nothing balances '
    if (block%is_level) then
      sentence = sentence // rounded_text(block%least_torque, digits) // ' N m on ' // &
                 bodies // ' at any speed; a load is missing, or a motor whose torque falls'
    else
      sentence = sentence // 'the torques on ' // bodies // ' at any speed'
      if (block%least_torque < huge(1.0_wp)) then
        sentence = sentence // '; at least ' // rounded_text(block%least_torque, digits) // ' N m are left over, at ' // &
                   rounded_text(block%least_speed, speed_digits) // ' rad/s of ' // &
                   quoted(names(body_of(balance, block%members(1)))%text)
      end if
    end if
  end subroutine explain_no_balance

  !> The independent body of a rigid motion.
  integer function body_of(balance, freedom)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: freedom

    body_of = balance%formulation%machine%coordinates%body(balance%motions%free(freedom))
  end function body_of

  !> Names of the bodies that turn in some rigid motions.
  subroutine list_moving_bodies(balance, members, text)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: members(:)   !! unknowns; those that are internal states are ignored
    character(len=:), allocatable, intent(out) :: text
    real(wp) :: unit(size(balance%motions%free))
    logical :: moves(balance%formulation%machine%bodies)
    integer, allocatable :: bodies(:)
    integer :: b, i

    moves = .false.
    do i = 1, size(members)
      if (members(i) > size(unit)) cycle
      unit = 0.0_wp
      unit(members(i)) = 1.0_wp
      moves = moves .or. abs(balance%body_speeds(unit)) > 0.0_wp
    end do
    bodies = pack([(b, b=1, size(moves))], moves)
    if (any(bodies <= size(moves) - balance%formulation%machine%nodes)) then
      bodies = pack(bodies, bodies <= size(moves) - balance%formulation%machine%nodes)
    end if
    associate (names => balance%formulation%machine%names)
      text = joined(selected(names, bodies), ', ', most_names)
    end associate
  end subroutine list_moving_bodies

  !> Speeds of rigid motions as text, such as "12.5 rad/s of 'motor'".
  subroutine describe_speeds(balance, z, members, text)
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(in) :: z(:)        !! [unknowns]
    integer, intent(in) :: members(:)   !! unknowns; those that are internal states are ignored
    character(len=:), allocatable, intent(out) :: text
    integer, allocatable :: freedoms(:)
    integer :: i

    text = ''
    freedoms = pack(members, members <= size(balance%motions%free))
    do i = 1, min(size(freedoms), most_names)
      if (i > 1) text = text // ', '
      text = text // rounded_text(z(freedoms(i)), digits) // ' rad/s of ' // &
             quoted(balance%formulation%machine%names(body_of(balance, freedoms(i)))%text)
    end do
    if (text == '') text = 'rest'
  end subroutine describe_speeds

  !> Speeds of the bodies of a machine at its state, such as "12.5 rad/s of 'motor'"; of bodies with equal speeds the first.
  subroutine describe_state_speeds(formulation, text)
    class(formulation_t), intent(in) :: formulation
    character(len=:), allocatable, intent(out) :: text
    integer :: b, named

    text = ''
    named = 0
    associate (omega => formulation%omega(1, 1:), machine => formulation%machine)
      do b = 1, machine%bodies
        if (any(abs(omega(:b - 1) - omega(b)) <= alike * abs(omega(b)))) cycle
        named = named + 1
        if (named > most_names) exit
        if (named > 1) text = text // ', '
        text = text // rounded_text(omega(b), digits) // ' rad/s of ' // quoted(machine%names(b)%text)
      end do
    end associate
    if (named > most_names) text = text // ' ...'
  end subroutine describe_state_speeds

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
        else if (abs(formulation%state%elements%applied(1, formulation%joints%element(j))) > 0.0_wp) then
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
    text = text // ': locked it would carry ' // rounded_text(resting%needed, digits) // ' N m; allowed: ' // allowed
  end subroutine describe_overload

  !> "-20 to 20", "at most 20".
  subroutine allowed_torques(least, most, text)
    real(wp), intent(in) :: least, most   !! that a joint holds, huge without a bound [N m]
    character(len=:), allocatable, intent(out) :: text

    text = rounded_text(least, digits) // ' to ' // rounded_text(most, digits)
    if (least <= -huge(1.0_wp)) text = 'at most ' // rounded_text(most, digits)
    if (most >= huge(1.0_wp)) text = 'at least ' // rounded_text(least, digits)
  end subroutine allowed_torques

end module nocdyn_steady_texts
