!> How far critical speeds are from the speeds in operation, and what their modes are. A mode that is mostly a current or a flux
!> has no margin: no order excites it as it does a motion of the bodies.
module nocdyn_margins
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_response_settings, only: response_settings_t
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: margin_text, mode_text, operating_distance, put_margin, put_mode

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

  !> The number of a mode, and the internal state that it mostly is.
  subroutine put_mode(json, machine, modes, mode)
    type(json_t), intent(inout) :: json
    type(machine_t), intent(in) :: machine
    type(speed_modes_t), intent(in) :: modes
    integer, intent(in) :: mode

    call json%put('mode', mode)
    if (modes%internal(mode) == 0) return
    call json%put('mostly', machine%internal_name(modes%internal(mode)))
    call json%put('is_electrical', modes%is_electrical(mode))
  end subroutine put_mode

end module nocdyn_margins
