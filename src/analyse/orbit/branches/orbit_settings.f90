!> What &orbit asks for.
module nocdyn_orbit_settings
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_log, only: orbit_log_t
  use nocdyn_targets, only: find_target, target_t
  use nocdyn_text, only: lower_case, quoted
  use nocdyn_written_values, only: unit_of, written_element, written_number, written_unit
  implicit none (type, external)
  private

  public :: read_orbit_settings

  integer, parameter :: most_states = 200      ! for which multipliers are computed unasked: they take the cube of it

  character(len=*), parameter :: no_machine = ' case run load_case output response orbit limit fatigue transit sweep vary record '

  integer, parameter, public :: usual_periods = 300

  integer, parameter, public :: any_method = 0, harmonic_balance = 1, shooting = 2

  type, public :: orbit_settings_t
    integer :: group = 0                       !! &orbit in the input
    type(target_t), allocatable :: targets(:)  !! the number over which it goes, none if it is a speed
    integer :: body = 0                        !! whose mean speed it goes over, 0: none
    integer :: mode = 0                        !! nonlinear normal mode over whose amplitude it goes, 0: none
    logical :: is_over_energy = .false.        !! or over whose energy
    integer :: speed_unit = 0                  !! in which the input has speeds: index of `units`, 0: rad/s
    real(wp) :: from = 0.0_wp, to = 0.0_wp     !! in the unit of the target, or [rad/s]
    real(wp) :: at = 0.0_wp                    !! where a branch begins
    real(wp) :: ahead = 1.0_wp                 !! whether it begins towards rising (1) or falling values (-1)
    integer :: periods = usual_periods         !! after which a run has settled
    integer :: starts = 0                      !! scattered starts of runs that look for other branches
    integer :: method = any_method
    integer :: harmonics = 0                   !! by error if it is 0
    integer :: subharmonic = 1
    integer :: count = 0                       !! points at even distances, beside others
    integer :: most_points = 0
    logical :: settles = .false.               !! whether a run settles on the first motion
    logical :: starts_high = .false.           !! whether it is the largest one on which runs settle
    character(len=:), allocatable :: start_file   !! table of a motion near it, else ''
    logical :: switches = .false.              !! whether branches that leave the first one are followed
    logical :: has_stability = .true.          !! whether multipliers are computed
    logical :: asks_stability = .false.        !! whether the input says so
    real(wp) :: tolerance = 0.0_wp             !! error of a point as a share of its motion
    real(wp), allocatable :: motions(:)        !! values at which motions are written
    logical :: has_spectrum = .false.          !! whether the harmonics of the points are written
    type(orbit_log_t), pointer :: log => null()   !! journal of the analysis, if it has one
  contains
    procedure :: is_stopped
  end type orbit_settings_t

contains

  !> Whether an analysis with a journal has been interrupted.
  logical function is_stopped(self)
    class(orbit_settings_t), intent(in) :: self

    is_stopped = .false.
    if (associated(self%log)) is_stopped = self%log%is_stopped()
  end function is_stopped

  !> Reads &orbit.
  subroutine read_orbit_settings(input, machine, settings, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(orbit_settings_t), intent(out) :: settings
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: groups(:)
    real(wp) :: range(2)
    integer :: i

    allocate (groups, source=input%groups_named('orbit'))
    if (size(groups) == 0) then
      call raise(error, exit_input, input%shown_case() // ': there is no group &orbit; required: for instance ' // &
                 "&orbit over = 'excitation.shaker.frequency_hz' range = 5, 20 /")
      return
    end if
    settings%group = groups(1)
    associate (group => input%groups(groups(1)))
      if (group%has_value('over')) then
        call find_number(input, group%text('over'), settings, error)
        range = group%numbers('range')
      else if (group%has_value('mode')) then
        allocate (settings%targets(0))
        settings%mode = group%whole_number('mode')
        settings%is_over_energy = group%has_value('energy')
        if (settings%is_over_energy) then
          range = group%numbers('energy')
        else
          range = group%numbers('amplitude')
        end if
      else
        allocate (settings%targets(0))
        settings%body = findloc([(machine%names(i)%text == group%text('body'), i=1, machine%bodies)], .true., dim=1)
        range = group%numbers('speed')
        settings%speed_unit = unit_of(group, 'speed')
      end if
      if (allocated(error)) return
      settings%start_file = ''
      if (group%has_value('start')) call read_start(group%text('start'), settings)
      if ((settings%settles .or. settings%starts_high .or. group%has_value('starts')) .and. settings%body > 0) then
        call raise(error, exit_input, input%location(groups(1), trim(merge('starts', 'start ', group%has_value('starts')))) // &
                   ': a run does not hold the mean speed of a body; allowed: over in place of body')
        return
      end if
      if (.not. abs(range(2) - range(1)) > 0) then
        call raise(error, exit_input, input%location(groups(1), range_key(settings)) // &
                   ': the two numbers are the same; required: a range')
        return
      end if
      settings%from = range(1)
      settings%to = range(2)
      settings%at = range(1)
      settings%ahead = sign(1.0_wp, range(2) - range(1))
      settings%switches = group%flag('switch_branches')
      if (group%has_value('starts')) settings%starts = group%whole_number('starts')
      if (group%has_value('method')) settings%method = merge(shooting, harmonic_balance, group%text('method') == 'shooting')
      if (group%has_value('harmonics')) settings%harmonics = group%whole_number('harmonics')
      if (group%has_value('count')) settings%count = group%whole_number('count')
      if (group%has_value('subharmonic')) settings%subharmonic = group%whole_number('subharmonic')
      settings%most_points = group%whole_number('most_points')
      settings%tolerance = group%number('tolerance')
      settings%has_stability = 2 * machine%coordinates%freedoms + machine%elements%internal%count <= most_states
      settings%asks_stability = group%has_value('stability')
      if (settings%asks_stability) settings%has_stability = group%flag('stability')
      if (settings%mode > 0) settings%has_stability = .false.
      settings%has_spectrum = group%flag('spectrum')
    end associate
    call read_motions(input, settings, error)
  end subroutine read_orbit_settings

  !> The key of the first and last value.
  pure function range_key(settings) result(key)
    type(orbit_settings_t), intent(in) :: settings
    character(len=:), allocatable :: key

    key = 'range'
    if (settings%body > 0) key = 'speed'
    if (settings%mode > 0) key = 'amplitude'
    if (settings%is_over_energy) key = 'energy'
  end function range_key

  !> Where the branch begins: a word, in any case, or the name of a file.
  subroutine read_start(text, settings)
    character(len=*), intent(in) :: text
    type(orbit_settings_t), intent(inout) :: settings

    select case (lower_case(text))
    case ('low')
    case ('high')
      settings%starts_high = .true.
    case ('settled_run')
      settings%settles = .true.
    case default
      settings%start_file = text
    end select
  end subroutine read_start

  !> The values at which motions are written.
  subroutine read_motions(input, settings, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(inout) :: settings
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: key, unit
    integer :: i

    key = trim(merge('motion_speeds', 'motions      ', settings%body > 0))
    associate (group => input%groups(settings%group))
      settings%motions = group%numbers(key)
      do i = 1, size(settings%motions)
        if ((settings%motions(i) - settings%from) * (settings%motions(i) - settings%to) <= 0) cycle
        if (settings%body > 0) then
          unit = ' [' // written_unit(group, key) // ']'
          call raise(error, exit_input, input%location(settings%group, key) // ': ' // written_element(group, key, i) // &
                     ' is outside of the speeds; allowed: ' // written_number(group, key, settings%from) // ' to ' // &
                     written_number(group, key, settings%to) // unit)
        else
          call raise(error, exit_input, input%location(settings%group, key) // ': ' // written_element(group, key, i) // &
                     ' is outside of the range; allowed: ' // written_number(group, 'range', settings%from) // ' to ' // &
                     written_number(group, 'range', settings%to))
        end if
        return
      end do
    end associate
  end subroutine read_motions

  !> Finds the number over which the branch goes.
  subroutine find_number(input, path, settings, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: path
    type(orbit_settings_t), intent(inout) :: settings
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: message

    allocate (settings%targets(1))
    call find_target(input, path, settings%targets(1), message)
    if (message /= '') then
      call raise(error, exit_input, input%location(settings%group, 'over') // ': over = ' // quoted(path) // ': ' // message)
    else if (index(no_machine, ' ' // input%groups(settings%targets(1)%group)%kind // ' ') > 0) then
      call raise(error, exit_input, input%location(settings%group, 'over') // ': over = ' // quoted(path) // &
                 ' is no number of the machine; allowed: numbers of bodies and elements')
    else if (settings%targets(1)%is_integer) then
      call raise(error, exit_input, input%location(settings%group, 'over') // ': over = ' // quoted(path) // &
                 ' is a whole number, which does not change continuously; allowed: other numbers')
    end if
  end subroutine find_number

end module nocdyn_orbit_settings
