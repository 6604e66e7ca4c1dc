!> What &transit asks for: the body, the ranges of its speed that are passed, and how often.
module nocdyn_transit_settings
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_joint_simplifications, only: refuse_joints
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_response_analysis, only: analyse_response, response_analysis_t
  use nocdyn_response_limits, only: no_limit
  use nocdyn_response_summary, only: barred_range_t, response_summary_t, summarise_response
  use nocdyn_text, only: append, quoted, string_t
  implicit none (type, external)
  private

  public :: read_transit_settings

  !> A range of speeds of the body.
  type, public :: transit_range_t
    real(wp) :: low = 0.0_wp, high = 0.0_wp   !! forwards [rad/s]
    real(wp) :: order = 0.0_wp                !! oscillations per turn whose periods are counted; 0: none
    real(wp) :: ratio = 0.0_wp                !! of the steady response to its limit, 0 if the range is given
  end type transit_range_t

  type, public :: transit_settings_t
    integer :: group = 0                      !! &transit in the input
    integer :: body = 0
    real(wp) :: forwards = 1.0_wp             !! -1 if the body turns backwards
    integer :: turns = 1                      !! over which the mean speed is taken
    logical :: needs_up = .false., needs_down = .false.   !! passages that the run has to make, beside at least one
    real(wp) :: time_limit = no_limit         !! of the time in a range [s]
    real(wp) :: passages = 0.0_wp             !! in the life of the machine, 0: as often as the run
    type(transit_range_t), allocatable :: ranges(:)
  end type transit_settings_t

contains

  !> Reads &transit. Without a range, those that the limits of the steady response bar are taken.
  subroutine read_transit_settings(input, machine, settings, notes, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(transit_settings_t), intent(out) :: settings
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: body
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('transit'))
    if (size(groups) == 0) then
      call raise(error, exit_input, input%shown_case() // ': there is no group &transit; required: for instance ' // &
                 "&transit body = '" // machine%names(1)%text // "' range_rpm = 400, 500 /")
      return
    end if
    settings%group = groups(1)
    allocate (body, source=input%groups(groups(1))%text('body'))
    associate (group => input%groups(settings%group))
      if (.not. group%has_value('range')) call check_response(input, settings%group, error)
      if (allocated(error)) return
      settings%body = findloc([(machine%names(i)%text == body, i=1, machine%bodies)], .true., dim=1)
      call note_drive(input, body, notes)
      settings%needs_up = any(group%text('direction') == [character(len=4) :: 'up', 'both'])
      settings%needs_down = any(group%text('direction') == [character(len=4) :: 'down', 'both'])
      settings%time_limit = group%number('time_limit', absent=no_limit)
      settings%passages = group%number('passages', absent=0.0_wp)
      settings%turns = turns_of(input)
      if (group%has_value('range')) then
        call take_range(input, settings, error)
      else
        call find_barred_ranges(input, settings, error)
      end if
    end associate
  end subroutine read_transit_settings

  !> Refuses an input whose response has no barred ranges of the body.
  subroutine check_response(input, index, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of &transit
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: groups(:)

    allocate (groups, source=input%groups_named('response'))
    if (size(groups) == 0) then
      call raise(error, exit_input, input%location(index) // ': there is no range of speeds to pass; required: range, or ' // &
                 '&response with a &limit, whose barred ranges are taken')
    else if (input%groups(groups(1))%text('body') /= input%groups(index)%text('body')) then
      call raise(error, exit_input, input%location(index, 'body') // ': body = ' // quoted(input%groups(index)%text('body')) // &
                 ' is not ' // quoted(input%groups(groups(1))%text('body')) // ' of &response, whose barred ranges are ' // &
                 'taken; allowed: that body, or a range')
    end if
  end subroutine check_response

  !> The turns of a window: two with half orders, such as those of engines with four strokes.
  integer function turns_of(input) result(turns)
    type(input_t), intent(in) :: input
    integer, allocatable :: engines(:)
    integer :: i

    turns = 1
    associate (group => input%groups(input%position('transit')))
      if (group%has_value('turns')) then
        turns = group%whole_number('turns')
        return
      end if
    end associate
    allocate (engines, source=input%groups_named('engine'))
    do i = 1, size(engines)
      if (input%groups(engines(i))%whole_number('stroke') == 4) turns = 2
    end do
  end function turns_of

  !> Notes that the body of the range moves as a drive prescribes, and so does not vibrate.
  subroutine note_drive(input, body, notes)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: body
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, allocatable :: drives(:)
    integer :: i

    allocate (drives, source=input%groups_named('drive'))
    do i = 1, size(drives)
      if (input%groups(drives(i))%text('body') /= body) cycle
      call append(notes, input%place(drives(i), 'body') // ': the drive prescribes the motion of ' // quoted(body) // &
                  ', which cannot vibrate: the natural frequencies are those with this body held')
    end do
  end subroutine note_drive

  !> The range that the input gives.
  subroutine take_range(input, settings, error)
    type(input_t), intent(in) :: input
    type(transit_settings_t), intent(inout) :: settings
    type(error_t), allocatable, intent(out) :: error   !! no range
    real(wp) :: range(2)

    associate (group => input%groups(settings%group))
      range = group%numbers('range')
      settings%forwards = sign(1.0_wp, range(1))
      range = settings%forwards * range
      if (minval(range) < 0 .or. .not. abs(range(2) - range(1)) > 0) call raise(error, exit_input, &
        input%location(settings%group, 'range') // ': the speeds of range are no range; required: two speeds of one sign ' // &
        'that differ')
      settings%ranges = [transit_range_t(minval(range), maxval(range), group%number('order', absent=0.0_wp))]
    end associate
  end subroutine take_range

  !> The ranges that the limits of the steady response bar, with the tolerance of their rules; those that overlap are one.
  subroutine find_barred_ranges(input, settings, error)
    type(input_t), intent(in) :: input
    type(transit_settings_t), intent(inout) :: settings
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: steady
    type(response_analysis_t) :: analysis
    type(response_summary_t) :: summary
    type(transit_range_t) :: range
    integer :: i

    call refuse_joints(input, .true., 'the response, whose barred ranges nocdyn transit takes if no range is given,', error)
    if (.not. allocated(error)) call assemble_steady_machine(input, .true., steady, error)
    if (.not. allocated(error)) call analyse_response(input, steady, analysis, error)
    if (allocated(error)) return
    summary = summarise_response(analysis)
    settings%forwards = sign(1.0_wp, analysis%settings%speeds(1))
    allocate (settings%ranges(0))
    do i = 1, size(summary%barred)
      if (.not. summary%barred(i)%is_allowed) cycle   ! the rule accepts no range to pass there
      associate (barred => settings%forwards * summary%barred(i)%barred)
        range = transit_range_t(minval(barred), maxval(barred))
      end associate
      call find_order(analysis, summary%barred(i), range)
      range%order = input%groups(settings%group)%number('order', absent=range%order)
      call merge_range(range, settings%ranges)
    end do
  end subroutine find_barred_ranges

  !> The order that is largest where a limit is exceeded most.
  subroutine find_order(analysis, barred, range)
    type(response_analysis_t), intent(in) :: analysis
    type(barred_range_t), intent(in) :: barred
    type(transit_range_t), intent(inout) :: range
    real(wp) :: largest
    integer :: l

    largest = 0.0_wp
    associate (limit => analysis%limits(barred%limit), point => analysis%response%points(barred%worst))
      range%ratio = point%half_range(limit%quantity) / limit%continuous_limit(point%state%speed)
      do l = 1, size(analysis%response%lines)
        if (.not. analysis%response%lines(l)%is_order) cycle
        if (abs(point%quantity(l, limit%quantity)) <= largest) cycle
        largest = abs(point%quantity(l, limit%quantity))
        range%order = analysis%response%lines(l)%order
      end do
    end associate
  end subroutine find_order

  !> Adds a range to others, ascending; it takes in those that it overlaps.
  pure subroutine merge_range(new, ranges)
    type(transit_range_t), intent(in) :: new
    type(transit_range_t), allocatable, intent(inout) :: ranges(:)
    type(transit_range_t) :: whole
    logical :: overlaps(size(ranges))
    integer :: i

    whole = new
    overlaps = ranges%low <= new%high .and. ranges%high >= new%low
    do i = 1, size(overlaps)
      if (.not. overlaps(i)) cycle
      whole%low = min(whole%low, ranges(i)%low)
      whole%high = max(whole%high, ranges(i)%high)
      if (ranges(i)%ratio <= whole%ratio) cycle
      whole%order = ranges(i)%order
      whole%ratio = ranges(i)%ratio
    end do
    ranges = pack(ranges, .not. overlaps)
    ranges = [pack(ranges, ranges%low < whole%low), whole, pack(ranges, ranges%low >= whole%low)]
  end subroutine merge_range

end module nocdyn_transit_settings
