!> Sentences about the speeds of a machine at which its torques balance, or do not.
module nocdyn_balance_texts
  use nocdyn_block_solutions, only: block_solutions_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: joined, quoted, rounded_text, selected, string_t, to_text
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: describe_speeds, describe_state_speeds, explain_no_balance, list_moving_bodies

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

end module nocdyn_balance_texts
