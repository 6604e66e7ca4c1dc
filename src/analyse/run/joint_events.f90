!> The events of clutches and freewheels in a run, with their names, and their form in summary.json.
module nocdyn_joint_events
  use nocdyn_bank, only: bank_of, role_bearing, role_loss, role_names
  use nocdyn_formulation, only: formulation_t
  use nocdyn_friction_joints, only: direction_of, idle, locked, slips_backwards, slips_forwards
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: describe_shared_joints, list_joint_events, put_joint_events

  !> A joint that locks or begins to slip.
  type, public :: named_event_t
    real(wp) :: time = 0.0_wp                  !! [s]
    character(len=:), allocatable :: joint     !! e.g. "clutch engage"
    integer :: from = locked, to = locked      !! modes
    real(wp) :: slip = 0.0_wp                  !! speed of the first body minus speed of the second one, before the event [rad/s]
    real(wp) :: torque = 0.0_wp                !! on the second body after the event [N m]
    real(wp) :: impulse = 0.0_wp               !! of an impact [N m s]
  end type named_event_t

contains

  !> The events that a formulation has noted, in the order of time.
  subroutine list_joint_events(formulation, events)
    class(formulation_t), intent(in) :: formulation
    type(named_event_t), allocatable, intent(out) :: events(:)
    integer :: i, role

    allocate (events(formulation%joints%log%count))
    do i = 1, size(events)
      associate (event => formulation%joints%log%event(i), machine => formulation%machine)
        associate (element => formulation%joints%element(event%joint))
          role = machine%banks(bank_of(machine%banks, element))%bank%role
          events(i)%joint = trim(role_names(role)) // ' ' // machine%element_name(element)
        end associate
        events(i)%time = event%time
        events(i)%from = event%from
        events(i)%to = event%to
        events(i)%slip = event%slip
        events(i)%torque = event%torque
        events(i)%impulse = event%impulse
        if (role == role_bearing .or. role == role_loss) then
          ! turns an event round where the second body of the joint is what moves: a body in its bearings, the first wheel of
          ! teeth
          events(i)%slip = 0.0_wp - events(i)%slip
          events(i)%from = opposite(events(i)%from)
          events(i)%to = opposite(events(i)%to)
        end if
      end associate
    end do
  end subroutine list_joint_events

  !> "clutch 'a', clutch 'b'": the joints whose torques were not unique; '' if there were none.
  subroutine describe_shared_joints(formulation, text)
    class(formulation_t), intent(in) :: formulation
    character(len=:), allocatable, intent(out) :: text
    integer :: element, j

    text = ''
    associate (joints => formulation%joints, machine => formulation%machine)
      do j = 1, joints%count
        if (.not. joints%is_shared(j)) cycle
        element = joints%element(j)
        if (text /= '') text = text // ', '
        text = text // trim(role_names(machine%banks(bank_of(machine%banks, element))%bank%role)) // ' ' // &
               quoted(machine%element_name(element))
      end do
    end associate
  end subroutine describe_shared_joints

  !> The mode with the opposite slip.
  pure integer function opposite(mode)
    integer, intent(in) :: mode

    opposite = mode
    if (direction_of(mode) > 0) opposite = slips_backwards
    if (direction_of(mode) < 0) opposite = slips_forwards
  end function opposite

  !> Writes them as the list joint_events.
  subroutine put_joint_events(json, events)
    type(json_t), intent(inout) :: json
    type(named_event_t), intent(in) :: events(:)
    integer :: i

    call json%open_list('joint_events')
    do i = 1, size(events)
      call json%open()
      call json%put('time', events(i)%time)
      call json%put('joint', events(i)%joint)
      call json%put('from', mode_word(events(i)%from))
      call json%put('to', mode_word(events(i)%to))
      call json%put('slip_rad_s', events(i)%slip)
      call json%put('torque_N_m', events(i)%torque)
      if (abs(events(i)%impulse) > 0) call json%put('impulse_N_m_s', events(i)%impulse)
      call json%close()
    end do
    call json%close_list()
  end subroutine put_joint_events

  !> A mode, by the slip of the first body against the second: its opposite is u'.
  pure function mode_word(mode) result(word)
    integer, intent(in) :: mode
    character(len=:), allocatable :: word

    select case (direction_of(mode))
    case (1)
      word = 'slips behind'
    case (-1)
      word = 'slips ahead'
    case default
      word = 'locked'
      if (mode == idle) word = 'open'
    end select
  end function mode_word

end module nocdyn_joint_events
