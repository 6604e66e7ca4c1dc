!> The forced response that &response of an input asks for, with its modes, critical speeds and peaks.
module nocdyn_response_analysis
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_backward_speeds, only: refuse_backward_speeds
  use nocdyn_comparisons, only: comparison_t
  use nocdyn_critical_speeds, only: crossing_t, keep_new, refine_peaks
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_excitation_lines, only: line_order, line_t
  use nocdyn_followed_modes, only: follow_modes
  use nocdyn_forced_response, only: forced_response_t, new_forced_response
  use nocdyn_harmonic_notes, only: note_left_out_harmonics
  use nocdyn_heat_results, only: note_rubber
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_moment_forms, only: moment_form_t
  use nocdyn_response_choice, only: choose_quantities, choose_shown, find_couplings
  use nocdyn_response_fatigue, only: find_response_fatigue, response_fatigue_t
  use nocdyn_response_limits, only: read_limits, response_limit_t
  use nocdyn_response_notes, only: note_linear_ranges, note_measurements, note_numbers, note_other_excitations, &
    note_overloads, note_rated_speeds, note_rules, note_separation, note_shaft_modes, note_simplifications, note_steady_states
  use nocdyn_response_points, only: keep_points
  use nocdyn_response_settings, only: place_error, read_response_settings, response_settings_t
  use nocdyn_state_modes, only: most_coordinates
  use nocdyn_synthesis, only: new_synthesis
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  use nocdyn_unstable_speeds, only: describe_first, find_unstable, mark_between, note_speeds, unstable_speed_t
  implicit none (type, external)
  private

  public :: analyse_response, add_fatigue, list_orders, wants_grid

  type, public :: response_analysis_t
    type(response_settings_t) :: settings
    character(len=:), allocatable :: body_name       !! of the body whose speed is held
    type(forced_response_t) :: response
    type(speed_modes_t) :: modes                     !! at the speeds of the grid, and at critical ones where modes move
    type(crossing_t), allocatable :: crossings(:)
    type(unstable_speed_t), allocatable :: unstable(:)   !! speeds of the grid that are left out for it
    type(response_limit_t), allocatable :: limits(:)
    logical :: writes_grid = .false.                 !! whether the tables are written to one file
    integer, allocatable :: shown(:), shown_angles(:)   !! quantities and angles of the response that are written
    type(response_fatigue_t), allocatable :: fatigue(:)   !! after `add_fatigue`
    type(comparison_t), allocatable :: comparisons(:)     !! with measurements; not allocated for a shaker
    type(string_t), allocatable :: notes(:)
    real(wp) :: wall_time = 0.0_wp                   !! of the computation, without reading and writing files [s]
  end type response_analysis_t

  real(wp), parameter :: accuracy = 1.0e-6_wp   ! relative, of the speeds
  real(wp), parameter :: beyond = 50.0_wp       ! logarithm of a ratio that is no more than a limit without bounds

contains

  !> Computes the response.
  subroutine analyse_response(input, machine, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane
    type(response_analysis_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(moment_form_t), allocatable :: forms(:)
    integer, allocatable :: limited(:)   ! quantities
    integer(int64) :: began, ended, rate
    real(wp) :: failed_speed

    call system_clock(began, rate)
    allocate (self%crossings(0), self%unstable(0))
    call note_simplifications(machine, self%notes)
    call note_left_out_harmonics(input, self%notes)
    call read_response_settings(input, machine, self%settings, error)
    if (allocated(error)) return
    self%body_name = machine%names(self%settings%body)%text
    self%writes_grid = wants_grid(input)
    associate (speeds => self%settings%speeds)
      failed_speed = speeds(1)
      call new_forced_response(machine, self%settings%body, speeds, self%response, error, self%settings%shaker)
      call place_error(input, self%settings, failed_speed, error)
      if (.not. allocated(error)) call choose_lines(input, self%settings, self%response%lines, error)
      if (.not. allocated(error)) call read_limits(input, self%response%quantities, self%limits, error)
      if (.not. allocated(error)) call choose_shown(input, self%response, self%shown, self%shown_angles, self%notes, error)
      if (.not. allocated(error)) then
        forms = self%response%quantities
        limited = self%limits%quantity
        call choose_quantities(input, self%response, self%shown, self%shown_angles, limited)
        self%limits%quantity = limited
        call prepare_synthesis(self%response)
        call self%response%add_points(speeds, .true., error, failed_speed, only_states=.true.)
        call place_error(input, self%settings, failed_speed, error)
      end if
    end associate
    if (.not. allocated(error)) call refuse_backward_speeds(input, self%settings, machine, self%response, error)
    if (allocated(error)) return
    call find_peaks(machine, self, forms, error, failed_speed)
    if (allocated(error)) then
      call place_error(input, self%settings, failed_speed, error)
    else
      call note_speeds(self%response, self%unstable, 'they are left out', self%notes)
      if (self%settings%shaker > 0) then
        call note_other_excitations(self%settings, self%response, self%notes)
        call note_measurements(input, self%notes)
      end if
      call note_steady_states(self%response, self%notes)
      call note_numbers(self%modes, self%notes)
      if (self%modes%modes > 0) call note_shaft_modes(machine, self%modes, self%crossings, .false., self%notes)
      call note_separation(self%response, self%notes)
      call note_linear_ranges(self%response, self%notes)
      call note_rubber(self%response, self%notes)
      call note_overloads(self%response, self%notes)
      call note_rated_speeds(input, self%settings, self%notes)
      call note_rules(self%limits, self%notes)
    end if
    call system_clock(ended)
    self%wall_time = real(ended - began, wp) / real(rate, wp)
  end subroutine analyse_response

  !> Whether an input asks for one file of all tables.
  pure logical function wants_grid(input)
    type(input_t), intent(in) :: input

    wants_grid = .false.
    if (size(input%groups_named('response')) == 0) return
    wants_grid = input%groups(input%position('response'))%text('format') == 'netcdf'
  end function wants_grid

  !> Adds the damage by &fatigue to a response.
  subroutine add_fatigue(input, self, error)
    type(input_t), intent(in) :: input
    type(response_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: began, ended, rate
    real(wp) :: failed_speed

    call system_clock(began, rate)
    call find_response_fatigue(input, self%response, self%fatigue, error, failed_speed)
    call place_error(input, self%settings, failed_speed, error)
    call system_clock(ended)
    self%wall_time = self%wall_time + real(ended - began, wp) / real(rate, wp)
  end subroutine add_fatigue

  !> Groups the lines by their frequencies.
  subroutine prepare_synthesis(response)
    type(forced_response_t), intent(inout) :: response
    integer :: family(size(response%lines)), l
    real(wp) :: order(size(response%lines))

    do l = 1, size(response%lines)
      order(l) = response%lines(l)%order
      family(l) = response%lines(l)%family
    end do
    response%synthesis = new_synthesis(order, family)
  end subroutine prepare_synthesis

  !> Leaves only the lines of the orders that the input names.
  subroutine choose_lines(input, settings, lines, error)
    type(input_t), intent(in) :: input
    type(response_settings_t), intent(in) :: settings
    type(line_t), allocatable, intent(inout) :: lines(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: chosen(size(settings%orders)), i
    character(len=:), allocatable :: known

    if (size(lines) == 0) then
      call raise(error, exit_input, input%location(settings%group) // ': nothing excites this machine; required: an ' // &
                 "&engine, an &excitation of kind 'orders' or 'harmonic' (with a frequency), or transmission_error of a &mesh")
      return
    end if
    do i = 1, size(chosen)
      chosen(i) = line_order(lines, settings%orders(i))
      if (chosen(i) > 0) cycle
      call list_orders(lines, known)
      call raise(error, exit_input, input%location(settings%group, 'orders') // ': no excitation has the order ' // &
                 to_text(settings%orders(i)) // ' of ' // quoted(input%groups(settings%group)%text('body')) // &
                 '; the orders of the excitations are ' // known)
      return
    end do
    if (size(chosen) > 0) lines = lines(chosen)
  end subroutine choose_lines

  !> "0.5, 1, 1.5".
  subroutine list_orders(lines, text)
    type(line_t), intent(in) :: lines(:)
    character(len=:), allocatable, intent(out) :: text
    integer :: i

    text = ''
    do i = 1, size(lines)
      if (.not. lines(i)%is_order) cycle
      if (text /= '') text = text // ', '
      text = text // rounded_text(lines(i)%order, 8)
    end do
    if (text == '') text = 'none'
  end subroutine list_orders

  !> Finds modes, critical speeds, oscillations and their peaks between the speeds of the grid.
  subroutine find_peaks(machine, self, forms, error, failed_speed)
    type(machine_t), intent(in) :: machine
    type(response_analysis_t), intent(inout) :: self
    type(moment_form_t), intent(in) :: forms(:)   !! all quantities of the machine
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(inout) :: failed_speed
    real(wp) :: no_orders(0), unrefined
    logical, allocatable :: is_unstable(:)

    if (self%response%matrix%coordinates > most_coordinates) then
      call append(self%notes, 'this machine has ' // to_text(self%response%matrix%coordinates) // ' degrees of freedom: ' // &
                              'neither critical speeds nor peaks between the speeds of the grid are found for more than ' // &
                              to_text(most_coordinates) // '; nocdyn campbell has natural frequencies')
    else
      call follow_modes(machine, self%response, no_orders, self%modes, self%crossings, error, failed_speed)
      if (.not. allocated(error)) call leave_out_unstable(self, error, failed_speed)
      if (allocated(error)) return
    end if
    call find_couplings(forms, self%modes, self%response, self%crossings)
    call self%response%solve_oscillations()
    unrefined = 0.0_wp
    if (self%response%matrix%coordinates <= most_coordinates) then
      call refine_peaks(self%response, self%crossings, unrefined, error, failed_speed)
    end if
    if (.not. allocated(error) .and. unrefined > 0) then
      call append(self%notes, 'there are too many peaks between the ' // self%settings%axis%plural() // ' of the grid to ' // &
                              'refine all: some may be higher by ' // rounded_text(100.0_wp * unrefined, 2) // &
                              ' % of the largest one of their quantity; fewer orders or a shorter range refine all')
    end if
    if (.not. allocated(error)) call refine_edges(self%response, self%limits, error, failed_speed)
    if (size(self%unstable) == 0 .or. allocated(error)) return
    allocate (is_unstable(size(self%response%points)))
    call mark_between(self%response, is_unstable)
    call keep_points(self%response%points, .not. is_unstable)
  end subroutine find_peaks

  !> Finds the critical speeds, and leaves out the speeds at which the steady state does not stay.
  subroutine leave_out_unstable(self, error, failed_speed)
    type(response_analysis_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error   !! if no speed is left
    real(wp), intent(inout) :: failed_speed
    character(len=:), allocatable :: text
    integer :: i
    logical, dimension(size(self%response%points)) :: is_of_grid, is_unstable

    call find_unstable(self%response%speeds(), self%modes, self%unstable, is_unstable)
    if (all(is_unstable)) then
      failed_speed = self%unstable(1)%speed
      call describe_first(self%unstable(:1), text)
      call raise(error, exit_failed, 'the steady state is unstable: ' // text)
      return
    end if
    if (size(self%unstable) == 0) return
    do i = 1, size(is_of_grid)
      is_of_grid(i) = self%response%points(i)%is_of_grid
    end do
    self%unstable = pack(self%unstable, pack(is_of_grid, is_unstable))
    self%crossings = pack(self%crossings, [(.not. is_between(self%crossings(i)%speed), i=1, size(self%crossings))])
    call keep_points(self%response%points, .not. is_unstable)

  contains

    !> Whether a speed is between two points one of which is unstable.
    pure logical function is_between(speed)
      real(wp), intent(in) :: speed
      integer :: k

      is_between = .false.
      associate (points => self%response%points)
        do k = 2, size(points)
          if ((points(k - 1)%state%speed - speed) * (points(k)%state%speed - speed) > 0) cycle
          is_between = is_between .or. is_unstable(k - 1) .or. is_unstable(k)
        end do
      end associate
    end function is_between

  end subroutine leave_out_unstable

  !> Adds speeds where a half range crosses a limit: by the secant of the logarithm of their ratio, and by bisection in every
  !> other round.
  subroutine refine_edges(response, limits, error, failed_speed)
    type(forced_response_t), intent(inout) :: response
    type(response_limit_t), intent(in) :: limits(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(out) :: failed_speed   !! as in `add_points`
    integer, parameter :: most_rounds = 16
    real(wp), allocatable :: speeds(:)
    integer :: k, round

    failed_speed = 0.0_wp
    do round = 1, most_rounds
      allocate (speeds(0))
      do k = 1, size(limits)
        call add_edges(response, limits(k), modulo(round, 2) == 0, speeds)
      end do
      call keep_new(response, speeds)
      if (size(speeds) == 0) return
      call response%add_points(speeds, .false., error, failed_speed)
      if (allocated(error)) return
      deallocate (speeds)
    end do
  end subroutine refine_edges

  subroutine add_edges(response, limit, bisects, speeds)
    type(forced_response_t), intent(in) :: response
    type(response_limit_t), intent(in) :: limit
    logical, intent(in) :: bisects
    real(wp), allocatable, intent(inout) :: speeds(:)
    real(wp) :: excess(size(response%points)), share, speed(size(response%points))
    integer :: i

    speed = response%speeds()
    do i = 1, size(speed)
      excess(i) = log(max(response%points(i)%half_range(limit%quantity), tiny(1.0_wp)) / limit%continuous_limit(speed(i)))
    end do
    excess = max(-beyond, min(beyond, excess))
    do i = 1, size(speed) - 1
      if (excess(i) > 0 .eqv. excess(i + 1) > 0) cycle
      if (abs(speed(i + 1) - speed(i)) <= accuracy * abs(speed(i))) cycle
      share = 0.5_wp
      if (.not. bisects) share = excess(i) / (excess(i) - excess(i + 1))
      share = max(0.02_wp, min(0.98_wp, share))
      speeds = [speeds, speed(i) + share * (speed(i + 1) - speed(i))]
    end do
  end subroutine add_edges

end module nocdyn_response_analysis
