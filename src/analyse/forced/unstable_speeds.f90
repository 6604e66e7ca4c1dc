!> Speeds at which a steady state is unstable, or there is none: a response has no values there.
module nocdyn_unstable_speeds
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_mode_pairs, only: mode_pairs_t
  use nocdyn_response_axes, only: response_axis_t
  use nocdyn_state_modes, only: find_pairs_at
  use nocdyn_text, only: append, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: describe_first, find_unstable, mark_between, note_speeds

  real(wp), parameter :: rounding = 1.0e-12_wp   ! of a damping ratio

  !> What grows at a speed.
  type, public :: unstable_speed_t
    real(wp) :: speed = 0.0_wp           !! [rad/s]
    real(wp) :: frequency = 0.0_wp       !! of the oscillation that grows fastest [rad/s]; 0: a motion without oscillation
    real(wp) :: damping_ratio = 0.0_wp   !! of this
    real(wp) :: divergence = 0.0_wp      !! its growth, negative [1/s]
  end type unstable_speed_t

contains

  !> The points of a response at which a mode grows.
  subroutine find_unstable(speed, modes, list, is_unstable)
    real(wp), intent(in) :: speed(:)           !! [points]
    type(speed_modes_t), intent(in) :: modes   !! at the points
    type(unstable_speed_t), allocatable, intent(out) :: list(:)
    logical, intent(out) :: is_unstable(:)     !! [points]
    integer :: i, m

    allocate (list(0))
    is_unstable = .false.
    do i = 1, size(speed)
      if (modes%divergence(i) < 0) then
        is_unstable(i) = .true.
        list = [list, unstable_speed_t(speed(i), divergence=modes%divergence(i))]
        cycle
      end if
      if (modes%modes == 0) cycle
      m = minloc(modes%damping_ratio(:, i), dim=1, mask=modes%exists(:, i))
      if (m == 0) cycle
      if (modes%damping_ratio(m, i) >= -rounding) cycle
      is_unstable(i) = .true.
      list = [list, unstable_speed_t(speed(i), modes%frequency(m, i), modes%damping_ratio(m, i))]
    end do
  end subroutine find_unstable

  !> Marks unstable points between those with known modes.
  subroutine mark_between(response, is_unstable)
    type(forced_response_t), intent(in) :: response
    logical, intent(out) :: is_unstable(:)   !! [points]; false for the ones of the grid
    type(error_t), allocatable :: error
    type(mode_pairs_t) :: pairs
    integer :: i

    is_unstable = .false.
    do i = 1, size(response%points)
      if (response%points(i)%is_of_grid) cycle
      call find_pairs_at(response, response%points(i)%state, pairs, error)
      if (allocated(error)) cycle
      is_unstable(i) = pairs%divergence < 0 .or. any(-real(pairs%value, wp) < -rounding * abs(pairs%value))
    end do
  end subroutine mark_between

  !> Says what grows: "an oscillation with 3.2 Hz has the negative damping ratio -0.01, for a torque grows with the speed".
  subroutine describe_first(list, text)
    type(unstable_speed_t), intent(in) :: list(:)
    character(len=:), allocatable, intent(out) :: text
    integer :: worst

    if (any(list%divergence < 0)) then
      worst = minloc(list%divergence, dim=1)
      text = 'a stiffness or a damping is negative there, and a motion grows e-fold in ' // &
             rounded_text(-1.0_wp / list(worst)%divergence, 4) // ' s'
    else
      worst = minloc(list%damping_ratio, dim=1)
      text = 'an oscillation with ' // rounded_text(list(worst)%frequency / (2.0_wp * acos(-1.0_wp)), 6) // &
             ' Hz has the negative damping ratio ' // rounded_text(list(worst)%damping_ratio, 4) // &
             ', for a torque grows with the speed'
    end if
  end subroutine describe_first

  !> Adds a note on the speeds: those that are unstable, and those without a steady state.
  subroutine note_speeds(response, list, consequence, notes)
    type(forced_response_t), intent(in) :: response
    type(unstable_speed_t), intent(in) :: list(:)
    character(len=*), intent(in) :: consequence   !! what the analysis does there
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: speeds, text
    real(wp) :: speed(size(list))

    if (size(list) > 0) then
      speed = list%speed
      call describe_first(list, text)
      call describe_speeds(response%axis, speed, speeds)
      call append(notes, 'the steady state is unstable at ' // speeds // ': ' // text // '; ' // consequence)
    end if
    if (size(response%speeds_left_out) > 0) then
      call describe_speeds(response%axis, response%speeds_left_out, speeds)
      call append(notes, 'there is no steady state at ' // speeds // ', which are left out: ' // &
                         response%left_out_message)
    end if
  end subroutine note_speeds

  !> "3 speeds from 100 to 120 rpm".
  subroutine describe_speeds(axis, speed, text)
    type(response_axis_t), intent(in) :: axis
    real(wp), intent(in) :: speed(:)   !! [rad/s]
    character(len=:), allocatable, intent(out) :: text

    text = rounded_text(axis%shown(minval(abs(speed))), 6)
    if (size(speed) > 1) text = to_text(size(speed)) // ' ' // axis%plural() // ' from ' // text // ' to ' // &
                                rounded_text(axis%shown(maxval(abs(speed))), 6)
    text = text // ' ' // axis%unit()
  end subroutine describe_speeds

end module nocdyn_unstable_speeds
