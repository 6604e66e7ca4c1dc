!> What a response is over: the speeds of its reference body, or the frequencies of a shaker.
module nocdyn_response_axes
  use nocdyn_kinds, only: wp
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  implicit none (type, external)
  private

  type, public :: response_axis_t
    logical :: is_frequency = .false.   !! else a speed
  contains
    procedure :: shown, unit, noun, plural, stored, key
  end type response_axis_t

contains

  !> A point in the unit of texts, rpm or Hz.
  elemental real(wp) function shown(self, point)
    class(response_axis_t), intent(in) :: self
    real(wp), intent(in) :: point   !! [rad/s]

    shown = from_si(point, merge(unit_hz, unit_rpm, self%is_frequency))
  end function shown

  !> This unit.
  pure function unit(self)
    class(response_axis_t), intent(in) :: self
    character(len=merge(2, 3, self%is_frequency)) :: unit

    unit = 'rpm'
    if (self%is_frequency) unit = 'Hz'
  end function unit

  !> What a point is.
  pure function noun(self)
    class(response_axis_t), intent(in) :: self
    character(len=merge(9, 5, self%is_frequency)) :: noun

    noun = 'speed'
    if (self%is_frequency) noun = 'frequency'
  end function noun

  !> What several points are.
  pure function plural(self)
    class(response_axis_t), intent(in) :: self
    character(len=merge(11, 6, self%is_frequency)) :: plural

    plural = 'speeds'
    if (self%is_frequency) plural = 'frequencies'
  end function plural

  !> A point as files have it, in rad/s or Hz.
  elemental real(wp) function stored(self, point)
    class(response_axis_t), intent(in) :: self
    real(wp), intent(in) :: point   !! [rad/s]

    stored = point
    if (self%is_frequency) stored = self%shown(point)
  end function stored

  !> The member of a report with a point: "peak_speed_rad_s", "peak_frequency_Hz".
  pure function key(self, first)
    class(response_axis_t), intent(in) :: self
    character(len=*), intent(in) :: first   !! 'peak_'
    character(len=len(first) + merge(12, 11, self%is_frequency)) :: key

    key = first // 'speed_rad_s'
    if (self%is_frequency) key = first // 'frequency_Hz'
  end function key

end module nocdyn_response_axes
