!> Excitations that change during a limited time: steps, ramps and half-sine pulses.
module nocdyn_timed_excitations
  use nocdyn_bank, only: bank_t, role_excitation, time_reached
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: cosine_of, sine_of
  implicit none (type, external)
  private

  public :: new_timed_excitations

  integer, parameter, public :: shape_step = 1    !! 0, then the amplitude
  integer, parameter, public :: shape_ramp = 2    !! linear from 0 to the amplitude, then constant
  integer, parameter, public :: shape_pulse = 3   !! half a sine wave with the amplitude, then 0

  type, extends(bank_t), public :: timed_excitations_t
    integer, allocatable :: shape(:)           !! shape_... of each
    real(wp), allocatable :: amplitude(:, :)   !! [N m], shape [lanes, excitations] as all that follow
    real(wp), allocatable :: begin(:, :)       !! [s]
    real(wp), allocatable :: duration(:, :)    !! [s], positive; not used by steps
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: choose
    procedure :: indicator
  end type timed_excitations_t

  character(len=*), parameter :: switch_names(3) = &   ! by shape
    [character(len=16) :: 'step', 'end of the ramp', 'end of the pulse']

  integer, parameter :: before = 0, during = 1, after = 2   ! the branches
  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> A bank of excitations, each on one body.
  function new_timed_excitations(names, body, shape, amplitude, begin, duration) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    integer, intent(in) :: shape(:)   !! shape_... of each
    real(wp), intent(in) :: amplitude(:, :), begin(:, :), duration(:, :)   !! [N m], [s], [s], shape [lanes, excitations]
    type(timed_excitations_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_excitation, size(amplitude, 1), names, body)
    allocate (bank%shape, source=shape)
    allocate (bank%amplitude, source=amplitude)
    allocate (bank%begin, source=begin)
    allocate (bank%duration, source=duration)
    call bank%add_switches(switch_names(shape))
  end function new_timed_excitations

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(timed_excitations_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        applied(i) = applied(i) + self%amplitude(l, e) * part_of_amplitude(self, l, e, time(l))
      end do
    end do
  end subroutine evaluate

  !> Torque as a part of the amplitude.
  pure real(wp) function part_of_amplitude(self, lane, excitation, time) result(part)
    class(timed_excitations_t), intent(in) :: self
    integer, intent(in) :: lane, excitation
    real(wp), intent(in) :: time   !! [s]

    select case (self%branch(lane, excitation))
    case (before)
      part = 0.0_wp
    case (during)
      part = (time - self%begin(lane, excitation)) / self%duration(lane, excitation)
      if (self%shape(excitation) == shape_pulse) part = sine_of(pi * part)
    case default
      part = merge(0.0_wp, 1.0_wp, self%shape(excitation) == shape_pulse)
    end select
  end function part_of_amplitude

  subroutine differentiate(self, elements)
    class(timed_excitations_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: slope
    integer :: e, l

    do e = 1, size(self%to)
      do l = 1, self%lanes
        if (self%branch(l, e) /= during) cycle
        slope = 1.0_wp
        if (self%shape(e) == shape_pulse) slope = pi * cosine_of(pi * (elements%time(l) - self%begin(l, e)) / self%duration(l, e))
        associate (by_time => elements%applied_time(l, self%first + e - 1))
          by_time = by_time + self%amplitude(l, e) * slope / self%duration(l, e)
        end associate
      end do
    end do
  end subroutine differentiate

  !> Time at which the change ends [s].
  pure real(wp) function end_of_change(self, lane, excitation) result(time)
    class(timed_excitations_t), intent(in) :: self
    integer, intent(in) :: lane, excitation

    time = self%begin(lane, excitation)
    if (self%shape(excitation) /= shape_step) time = time + self%duration(lane, excitation)
  end function end_of_change

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(timed_excitations_t), intent(inout) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    if (time_reached(t) < self%begin(lane, switch)) then
      self%branch(lane, switch) = before
    else if (time_reached(t) < end_of_change(self, lane, switch)) then
      self%branch(lane, switch) = during
    else
      self%branch(lane, switch) = after
    end if
  end subroutine choose

  !> In seconds, without a shift: time does not go back across a boundary.
  pure real(wp) function indicator(self, switch, lane, t, angle, speed, internal)
    class(timed_excitations_t), intent(in) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element

    select case (self%branch(lane, switch))
    case (before)
      indicator = self%begin(lane, switch) - t
    case (during)
      indicator = end_of_change(self, lane, switch) - t
    case default
      indicator = huge(indicator)
    end select
  end function indicator

  subroutine list_parameters(self, parameters)
    class(timed_excitations_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%shape)
    call parameters%add_key('amplitude', self%amplitude)
    call parameters%add_key('time', self%begin)
    call parameters%add_key('duration', self%duration)
  end subroutine list_parameters

end module nocdyn_timed_excitations
