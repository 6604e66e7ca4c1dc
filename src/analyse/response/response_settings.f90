!> What &response asks for: body, speeds, orders, speeds in operation.
module nocdyn_response_settings
  use nocdyn_bank, only: role_excitation
  use nocdyn_element_groups, only: bodies_of, new_body_index
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_rules, only: load_rule
  use nocdyn_machine, only: machine_t
  use nocdyn_response_axes, only: response_axis_t
  use nocdyn_response_limits, only: read_limits, response_limit_t
  use nocdyn_moment_forms, only: list_moment_forms, moment_form_t
  use nocdyn_rule_files, only: rule_t
  use nocdyn_text, only: append, counted, joined, quoted, rounded_text, string_t
  implicit none (type, external)
  private

  public :: check_response, place_error, read_response_settings, sets_response_speed

  type, public :: response_settings_t
    integer :: group = 0                        !! &response in the input
    integer :: body = 0                         !! whose speed is held
    type(response_axis_t) :: axis
    integer :: shaker = 0                       !! element whose frequency is varied, 0: speeds are
    character(len=:), allocatable :: shaker_name
    real(wp), allocatable :: speeds(:)          !! of the grid, from `speed(1)` to `speed(2)`, or frequencies [rad/s]
    real(wp), allocatable :: orders(:)          !! oscillations per turn of the body; empty: the ones of the excitations
    real(wp), allocatable :: operating(:)       !! lowest and highest speed in operation [rad/s]; empty: unknown
    real(wp) :: margin = 0.0_wp                 !! as a share of the speed
    logical :: has_margin_rule = .false.
    type(rule_t) :: margin_rule                 !! with the margin of each critical speed
  end type response_settings_t

  integer, parameter :: most_names = 6   ! of excitations in a message

contains

  !> Reads &response.
  subroutine read_response_settings(input, machine, settings, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(response_settings_t), intent(out) :: settings
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: bodies(:), groups(:)
    real(wp), allocatable :: range(:)
    integer :: count, i

    allocate (groups, source=input%groups_named('response'))
    if (.not. is_in_file(input, groups)) then
      call raise(error, exit_input, input%shown_file() // ': there is no group &response; required: for instance ' // &
                 "&response body = '" // machine%names(1)%text // "' speed_rpm = 100, 2000 /")
      return
    end if
    settings%group = groups(1)
    associate (group => input%groups(groups(1)))
      settings%axis%is_frequency = .not. sets_response_speed(input)
      if (settings%axis%is_frequency) then
        call find_shaker(input, machine, settings, error)
        if (.not. allocated(error)) call refuse_speed_rules(input, error)
        if (allocated(error)) return
      else
        bodies = bodies_of(group, 'body', new_body_index(machine%names))
        settings%body = bodies(1)
      end if
      settings%orders = group%numbers('orders')
      settings%operating = group%numbers('operating')
      settings%margin = group%number('margin', absent=0.0_wp)
      settings%has_margin_rule = group%has_value('margin_rule') .or. group%has_value('margin_rule_file')
      count = group%whole_number('count')
      range = group%numbers(trim(settings%axis%noun()))
    end associate
    associate (last => range(size(range)))
      if (.not. abs(last - range(1)) > 0) count = 1
      settings%speeds = [(range(1) + (last - range(1)) * (real(i, wp) / max(1, count - 1)), i=0, count - 1)]
      settings%speeds(count) = last
    end associate
    if (settings%has_margin_rule) call load_rule(input, groups(1), 'margin_', settings%margin_rule, error)
  end subroutine read_response_settings

  !> Whether responses are at speeds that they set, not at the frequencies of a shaker: so if &response does not say otherwise.
  pure logical function sets_response_speed(input) result(sets_speed)
    type(input_t), intent(in) :: input
    integer, allocatable :: groups(:)

    allocate (groups, source=input%groups_named('response'))
    sets_speed = size(groups) == 0
    if (.not. sets_speed) sets_speed = .not. input%groups(groups(1))%has_value('frequency')
  end function sets_response_speed

  !> Finds the shaker: the harmonic excitation that &response names, or the only one.
  subroutine find_shaker(input, machine, settings, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(response_settings_t), intent(inout) :: settings
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: shakers(:)
    integer, allocatable :: groups(:)
    character(len=:), allocatable :: text
    integer :: b, e, i

    allocate (groups, source=input%groups_named('excitation'))
    allocate (shakers(0))
    do i = 1, size(groups)
      if (input%groups(groups(i))%text('kind') /= 'harmonic') cycle
      if (input%groups(groups(i))%number('frequency') > 0) call append(shakers, input%groups(groups(i))%name)
    end do
    associate (group => input%groups(settings%group))
      settings%shaker_name = ''
      if (size(shakers) == 1) settings%shaker_name = shakers(1)%text
      if (group%has_value('excitation')) settings%shaker_name = group%text('excitation')
      if (.not. any([(shakers(i)%text == settings%shaker_name, i=1, size(shakers))])) then
        text = ': several harmonic excitations may be the shaker'
        if (size(shakers) == 0) text = ": there is no shaker; required: an &excitation of kind 'harmonic' with a frequency"
        if (group%has_value('excitation')) text = ': ' // quoted(settings%shaker_name) // ' is no harmonic excitation'
        if (size(shakers) > 0) text = text // '; allowed: excitation = ' // joined(shakers, ', ', most_names)
        call raise(error, exit_input, input%location(settings%group, trim(merge('excitation', 'frequency ', &
                                                                                group%has_value('excitation')))) // text)
        return
      end if
    end associate
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role /= role_excitation .or. bank%is_engine) cycle
        do e = 1, bank%count
          if (bank%names(e)%text /= settings%shaker_name) cycle
          settings%shaker = bank%first + e - 1
          settings%body = bank%rows%last_body(e)
        end do
      end associate
    end do
  end subroutine find_shaker

  !> Refuses limits of rules, which are for speeds, in a response over the frequency.
  subroutine refuse_speed_rules(input, error)
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: key
    integer :: i

    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        key = ''
        if (group%kind /= 'limit') cycle
        if (group%has_value('rule')) key = 'rule'
        if (group%has_value('rule_file')) key = 'rule_file'
        if (key == '') cycle
      end associate
      call raise(error, exit_input, input%location(i, key) // ': ' // key // ' is for speeds, and &response is over the ' // &
                 'frequency of a shaker')
      return
    end do
  end subroutine refuse_speed_rules

  !> Checks &response and &limit, if there are any.
  subroutine check_response(input, machine, text, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable, intent(out) :: text   !! a line of a report, after a line feed; '' without &response
    type(error_t), allocatable, intent(out) :: error
    type(response_settings_t) :: settings
    type(moment_form_t), allocatable :: quantities(:)
    type(response_limit_t), allocatable :: limits(:)

    text = ''
    if (.not. is_in_file(input, input%groups_named('response'))) return
    call read_response_settings(input, machine, settings, error)
    if (allocated(error)) return
    call list_moment_forms(machine, settings%body, quantities)
    call read_limits(input, quantities, limits, error)
    associate (speeds => settings%speeds)
      text = new_line('a') // '  response: ' // counted(size(speeds), settings%axis%noun(), settings%axis%plural()) // ' of '
      if (settings%axis%is_frequency) text = text // settings%shaker_name
      if (.not. settings%axis%is_frequency) text = text // machine%names(settings%body)%text
      text = text // ' from ' // rounded_text(settings%axis%shown(speeds(1)), 6) // ' to ' // &
             rounded_text(settings%axis%shown(speeds(size(speeds))), 6) // ' ' // settings%axis%unit()
    end associate
  end subroutine check_response

  pure logical function is_in_file(input, groups)
    type(input_t), intent(in) :: input
    integer, intent(in) :: groups(:)

    is_in_file = size(groups) > 0
    if (is_in_file) is_in_file = input%groups(groups(1))%ordinal > 0
  end function is_in_file

  !> Begins the message of a response with the place in the input and, where a computation failed, with the speed.
  subroutine place_error(input, settings, speed, error)
    type(input_t), intent(in) :: input
    type(response_settings_t), intent(in) :: settings
    real(wp), intent(in) :: speed   !! at which it failed [rad/s]
    type(error_t), allocatable, intent(inout) :: error

    if (.not. allocated(error)) return
    if (error%code == exit_failed) then
      error%message = input%location(settings%group, settings%axis%noun()) // ': at ' // &
                      rounded_text(settings%axis%shown(speed), 6) // ' ' // settings%axis%unit() // ' (' // &
                      rounded_text(speed, 6) // ' rad/s): ' // error%message
    else
      error%message = input%location(settings%group) // ': ' // error%message
    end if
  end subroutine place_error

end module nocdyn_response_settings
