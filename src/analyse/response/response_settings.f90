!> What &response asks for: body, speeds, orders, speeds in operation.
module nocdyn_response_settings
  use nocdyn_element_groups, only: bodies_of, new_body_index
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_rules, only: load_rule
  use nocdyn_machine, only: machine_t
  use nocdyn_response_limits, only: read_limits, response_limit_t
  use nocdyn_moment_forms, only: list_moment_forms, moment_form_t
  use nocdyn_rule_files, only: rule_t
  use nocdyn_text, only: counted, rounded_text
  use nocdyn_units, only: from_si, unit_rpm
  implicit none (type, external)
  private

  public :: check_response, place_error, read_response_settings

  type, public :: response_settings_t
    integer :: group = 0                        !! &response in the input
    integer :: body = 0                         !! whose speed is held
    real(wp), allocatable :: speeds(:)          !! of the grid, from `speed(1)` to `speed(2)` [rad/s]
    real(wp), allocatable :: orders(:)          !! oscillations per turn of the body; empty: the ones of the excitations
    real(wp), allocatable :: operating(:)       !! lowest and highest speed in operation [rad/s]; empty: unknown
    real(wp) :: margin = 0.0_wp                 !! as a share of the speed
    logical :: has_margin_rule = .false.
    type(rule_t) :: margin_rule                 !! with the margin of each critical speed
  end type response_settings_t

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
      bodies = bodies_of(group, 'body', new_body_index(machine%names))
      settings%body = bodies(1)
      settings%orders = group%numbers('orders')
      settings%operating = group%numbers('operating')
      settings%margin = group%number('margin', absent=0.0_wp)
      settings%has_margin_rule = group%has_value('margin_rule') .or. group%has_value('margin_rule_file')
      count = group%whole_number('count')
      range = group%numbers('speed')
    end associate
    associate (last => range(size(range)))
      if (.not. abs(last - range(1)) > 0) count = 1
      settings%speeds = [(range(1) + (last - range(1)) * (real(i, wp) / max(1, count - 1)), i=0, count - 1)]
      settings%speeds(count) = last
    end associate
    if (settings%has_margin_rule) call load_rule(input, groups(1), 'margin_', settings%margin_rule, error)
  end subroutine read_response_settings

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
      text = new_line('a') // '  response: ' // counted(size(speeds), 'speed', 'speeds') // ' of ' // &
             machine%names(settings%body)%text // ' from ' // rounded_text(from_si(speeds(1), unit_rpm), 6) // ' to ' // &
             rounded_text(from_si(speeds(size(speeds)), unit_rpm), 6) // ' rpm'
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
      error%message = input%location(settings%group, 'speed') // ': at ' // rounded_text(from_si(speed, unit_rpm), 6) // &
                      ' rpm (' // rounded_text(speed, 6) // ' rad/s): ' // error%message
    else
      error%message = input%location(settings%group) // ': ' // error%message
    end if
  end subroutine place_error

end module nocdyn_response_settings
