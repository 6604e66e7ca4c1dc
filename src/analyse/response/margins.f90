!> How far critical speeds are from the speeds in operation, and what their modes are. A mode that is mostly a current or a flux
!> has no margin: no order excites it as it does a motion of the bodies.
module nocdyn_margins
  use nocdyn_critical_speeds, only: crossing_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_rules, only: margin_of
  use nocdyn_machine, only: machine_t
  use nocdyn_response_settings, only: response_settings_t
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_text, only: quoted, rounded_text, to_text
  use nocdyn_units, only: from_si, unit_rpm
  use nocdyn_unstable_speeds, only: unstable_speed_t
  use nocdyn_verdicts, only: is_exceeded, is_kept, is_not_assessed, is_restricted, new_verdict_line, verdict_line_t, verdict_t
  implicit none (type, external)
  private

  public :: add_coverage, add_critical, add_nearest, margin_text, mode_text, operating_distance, put_margin, put_mode

  real(wp), parameter, public :: unknown_ratio = -1.0_wp   !! of a response that is not computed
  real(wp), parameter :: percent = 100.0_wp
  character(len=*), parameter :: distance_criterion = 'distance of a critical speed, at least'

contains

  !> Distance of a critical speed to the speeds in operation, as a share of the nearer one; 0 between them, and if there are none.
  pure real(wp) function operating_distance(settings, speed) result(distance)
    type(response_settings_t), intent(in) :: settings
    real(wp), intent(in) :: speed   !! [rad/s]

    distance = 0.0_wp
    associate (operating => abs(settings%operating))
      if (size(operating) == 0) return
      distance = max(0.0_wp, (operating(1) - abs(speed)) / operating(1), (abs(speed) - operating(2)) / operating(2))
    end associate
  end function operating_distance

  !> Whether a critical speed is between the speeds in operation, or nearer than the margin.
  pure logical function is_too_near(settings, distance)
    type(response_settings_t), intent(in) :: settings
    real(wp), intent(in) :: distance   !! as of `operating_distance`

    is_too_near = distance < settings%margin .or. distance <= 0
  end function is_too_near

  !> "  12 %, too near", "  in operation", "  electrical mode"; '' without speeds in operation.
  function margin_text(settings, modes, mode, distance) result(text)
    type(response_settings_t), intent(in) :: settings
    type(speed_modes_t), intent(in) :: modes
    integer, intent(in) :: mode
    real(wp), intent(in) :: distance   !! as of `operating_distance`
    character(len=:), allocatable :: text

    text = ''
    if (size(settings%operating) == 0) return
    if (modes%is_electrical(mode)) then
      text = '  electrical mode'
    else if (distance <= 0) then
      text = '  in operation'
    else
      text = '  ' // rounded_text(100.0_wp * distance, 3) // ' %'
      if (is_too_near(settings, distance)) text = text // ', too near'
    end if
  end function margin_text

  !> "  mostly armature current of motor 'drive'", if a mode is that.
  function mode_text(machine, modes, mode) result(text)
    type(machine_t), intent(in) :: machine
    type(speed_modes_t), intent(in) :: modes
    integer, intent(in) :: mode
    character(len=:), allocatable :: text

    text = ''
    if (modes%internal(mode) > 0) text = '  mostly ' // machine%internal_name(modes%internal(mode))
  end function mode_text

  !> The distance of a critical speed to the speeds in operation, unless its mode is electrical or there are no such speeds.
  subroutine put_margin(json, settings, modes, mode, distance)
    type(json_t), intent(inout) :: json
    type(response_settings_t), intent(in) :: settings
    type(speed_modes_t), intent(in) :: modes
    integer, intent(in) :: mode
    real(wp), intent(in) :: distance   !! as of `operating_distance`

    if (size(settings%operating) == 0 .or. modes%is_electrical(mode)) return
    call json%put('distance_to_operation', distance)
    call json%put('is_too_near', is_too_near(settings, distance))
  end subroutine put_margin

  !> A critical speed in operation, or too near to it: whether the limits of its response judge it.
  subroutine add_critical(analysis, settings, crossing, title, distance, ratio, element, verdict)
    character(len=*), intent(in) :: analysis   !! 'response', 'campbell'
    type(response_settings_t), intent(in) :: settings
    type(crossing_t), intent(in) :: crossing   !! its mode is not electrical
    character(len=*), intent(in) :: title      !! of the line
    real(wp), intent(in) :: distance           !! as of `operating_distance`
    real(wp), intent(in) :: ratio              !! of the response there to its limits; 0: there are none; `unknown_ratio`
    character(len=*), intent(in) :: element    !! whose response it is
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line

    if (size(settings%operating) == 0) return
    if (settings%has_margin_rule) call add_margin(analysis, settings, crossing, title, distance, ratio, element, verdict)
    if (settings%has_margin_rule .or. .not. is_too_near(settings, distance)) return
    call start_critical(analysis, settings, crossing, distance, line)
    line%detail = title
    line%finding = is_not_assessed
    line%reason = 'too near to operation'
    if (distance <= 0) line%reason = 'in operation'
    if (ratio > 0) then
      line%finding = merge(is_exceeded, is_restricted, ratio > 1)
      line%reason = line%reason // ', the response of ' // quoted(element) // ' has ' // rounded_text(percent * ratio, 3) // &
                    ' % of its limit'
    else if (ratio < 0) then
      line%reason = line%reason // ': nocdyn response with a &limit judges it'
    else
      line%reason = line%reason // ', and there is no &limit of the vibration of ' // quoted(element) // ', which swings most'
    end if
    call verdict%add(line)
  end subroutine add_critical

  !> A critical speed against the margin that a rule asks for; the arguments are those of `add_critical`.
  subroutine add_margin(analysis, settings, crossing, title, distance, ratio, element, verdict)
    character(len=*), intent(in) :: analysis, title, element
    type(response_settings_t), intent(in) :: settings
    type(crossing_t), intent(in) :: crossing
    real(wp), intent(in) :: distance, ratio
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp) :: margin

    margin = margin_of(settings%margin_rule, crossing%frequency / abs(crossing%speed))
    call start_critical(analysis, settings, crossing, distance, line)
    line%rule = settings%margin_rule%label
    line%limit = percent * margin
    line%detail = title
    line%finding = is_kept
    if (distance < margin) then
      line%finding = is_exceeded
      line%reason = 'too near to operation'
      if (distance <= 0) line%reason = 'in operation'
      if (ratio > 0) line%reason = line%reason // '; the response of ' // quoted(element) // ' has ' // &
                                   rounded_text(percent * ratio, 3) // ' % of its limit'
    end if
    call verdict%add(line)
  end subroutine add_margin

  !> If all critical speeds are far enough from operation, the nearest one; a rule has a line for each.
  subroutine add_nearest(analysis, settings, modes, crossings, verdict)
    character(len=*), intent(in) :: analysis   !! 'response', 'campbell'
    type(response_settings_t), intent(in) :: settings
    type(speed_modes_t), intent(in) :: modes
    type(crossing_t), intent(in) :: crossings(:)
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp) :: distance(size(crossings))
    integer :: i, nearest

    if (size(settings%operating) == 0 .or. settings%has_margin_rule) return
    distance = [(operating_distance(settings, crossings(i)%speed), i=1, size(crossings))]
    nearest = minloc(distance, dim=1, mask=[(.not. modes%is_electrical(crossings(i)%mode), i=1, size(crossings))])
    if (nearest == 0) return
    if (is_too_near(settings, distance(nearest))) return
    call start_critical(analysis, settings, crossings(nearest), distance(nearest), line)
    line%finding = is_kept
    call verdict%add(line)
  end subroutine add_nearest

  subroutine start_critical(analysis, settings, crossing, distance, line)
    character(len=*), intent(in) :: analysis   !! 'response', 'campbell'
    type(response_settings_t), intent(in) :: settings
    type(crossing_t), intent(in) :: crossing
    real(wp), intent(in) :: distance           !! as of `operating_distance`
    type(verdict_line_t), intent(out) :: line

    line = new_verdict_line(analysis, 'mode ' // to_text(crossing%number), '', distance_criterion, '')
    line%has_value = .true.
    line%value = percent * distance
    line%limit = percent * settings%margin
    line%unit = '%'
    call line%stand_at(crossing%speed)
  end subroutine start_critical

  !> Speeds in operation, or within the margin of it, at which nothing is computed.
  subroutine add_coverage(analysis, settings, unstable, verdict)
    character(len=*), intent(in) :: analysis   !! 'response', 'campbell'
    type(response_settings_t), intent(in) :: settings
    type(unstable_speed_t), intent(in) :: unstable(:)   !! speeds without a stable steady state
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    real(wp) :: computed(2), needed(2)   ! [rad/s]

    if (size(settings%operating) > 0) then
      computed = abs([settings%speeds(1), settings%speeds(size(settings%speeds))])
      needed = abs(settings%operating) * [1.0_wp - settings%margin, 1.0_wp + settings%margin]
      if (computed(1) > needed(1) .or. computed(2) < needed(2)) then
        line = new_verdict_line(analysis, 'machine', '', 'speeds in operation with their margin', '')
        line%finding = is_not_assessed
        line%reason = 'the speeds of &response are ' // rpm_text(computed(1)) // ' to ' // rpm_text(computed(2)) // ' rpm'
        line%speeds = 2
        line%speed = needed
        call verdict%add(line)
      end if
    end if
    if (size(unstable) == 0) return
    line = new_verdict_line(analysis, 'machine', '', 'stable steady states', '')
    line%finding = is_not_assessed
    line%reason = 'unstable at ' // to_text(size(unstable)) // ' of ' // to_text(size(settings%speeds)) // ' ' // &
                  settings%axis%plural()
    line%are_frequencies = settings%axis%is_frequency
    line%speeds = 2
    line%speed = [minval(unstable%speed), maxval(unstable%speed)]
    call verdict%add(line)
  end subroutine add_coverage

  function rpm_text(speed) result(text)
    real(wp), intent(in) :: speed   !! [rad/s]
    character(len=:), allocatable :: text

    text = rounded_text(from_si(speed, unit_rpm), 5)
  end function rpm_text

  !> The number of a mode, and the internal state that it mostly is.
  subroutine put_mode(json, machine, modes, mode)
    type(json_t), intent(inout) :: json
    type(machine_t), intent(in) :: machine
    type(speed_modes_t), intent(in) :: modes
    integer, intent(in) :: mode

    call json%put('mode', modes%number(mode))
    if (modes%internal(mode) == 0) return
    call json%put('mostly', machine%internal_name(modes%internal(mode)))
    call json%put('is_electrical', modes%is_electrical(mode))
  end subroutine put_mode

end module nocdyn_margins
