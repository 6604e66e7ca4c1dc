!> Natural frequencies over the speed, the lines of excitation, and where they meet: what Campbell's diagram shows.
!>
!> The machine is linearised about its steady state at every speed, so that frequencies move with the load. Modes are followed by
!> their shapes.
module nocdyn_campbell
  use nocdyn_backward_speeds, only: refuse_backward_speeds
  use nocdyn_critical_speeds, only: crossing_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_excitation_lines, only: line_t
  use nocdyn_followed_modes, only: follow_modes, frequencies_of
  use nocdyn_forced_response, only: forced_response_t, new_forced_response
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_margins, only: operating_distance
  use nocdyn_dense_pairs, only: most_modes
  use nocdyn_response_notes, only: note_numbers, note_shaft_modes, note_simplifications, note_steady_states
  use nocdyn_response_settings, only: place_error, read_response_settings, response_settings_t
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_state_modes, only: has_choice, most_coordinates
  use nocdyn_text, only: append, counted, rounded_text, string_t, to_text
  use nocdyn_unstable_speeds, only: find_unstable, note_speeds, unstable_speed_t
  use nocdyn_wanted_modes, only: default_modes, modes_choice_t
  implicit none (type, external)
  private

  public :: analyse_campbell

  type, public :: campbell_t
    type(response_settings_t) :: settings
    type(forced_response_t) :: response              !! steady states and lines; its moments are not used
    type(speed_modes_t) :: modes
    real(wp), allocatable :: speed(:)                !! of the reference body [rad/s], [points]
    logical, allocatable :: is_of_grid(:)            !! [points]
    real(wp), allocatable :: order(:)                !! oscillations per turn, at the lowest speed, [lines]
    logical, allocatable :: is_order(:)              !! whether the frequency grows with the speed, [lines]
    real(wp), allocatable :: frequency(:, :)         !! [rad/s], [lines, points]
    type(crossing_t), allocatable :: crossings(:)
    real(wp), allocatable :: distance(:)             !! of each crossing to the speeds in operation, as a share; 0 inside
    type(unstable_speed_t), allocatable :: unstable(:)   !! speeds at which a mode grows
    type(string_t), allocatable :: notes(:)
  end type campbell_t

contains

  !> Computes the diagram of an input.
  subroutine analyse_campbell(input, machine, choice, self, error, orders)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane
    type(modes_choice_t), intent(in) :: choice
    type(campbell_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(in), optional :: orders(:)   !! in place of those of the input
    real(wp) :: failed_speed
    integer :: i
    logical, allocatable :: is_unstable(:)

    call read_response_settings(input, machine, self%settings, error)
    if (allocated(error)) return
    if (self%settings%axis%is_frequency) then
      call raise(error, exit_input, input%location(self%settings%group, 'frequency') // &
                 ': a Campbell diagram is over speeds; nocdyn response is over the frequency, nocdyn modes has the modes; ' // &
                 'allowed: speed')
      return
    end if
    if (present(orders)) self%settings%orders = orders
    failed_speed = self%settings%speeds(1)
    call new_forced_response(machine, self%settings%body, self%settings%speeds, self%response, error)
    self%response%has_oscillations = .false.
    if (.not. allocated(error)) then
      self%response%choice = choice
      if (.not. has_choice(choice) .and. self%response%matrix%coordinates > most_coordinates) then
        self%response%choice%count = default_modes
      end if
      call choose_lines(self)
    end if
    if (.not. allocated(error)) call self%response%add_points(self%settings%speeds, .true., error, failed_speed)
    call place_error(input, self%settings, failed_speed, error)
    if (.not. allocated(error)) call refuse_backward_speeds(input, self%settings, machine, self%response, error)
    if (allocated(error)) return
    call follow_modes(machine, self%response, self%settings%orders, self%modes, self%crossings, error, failed_speed)
    call place_error(input, self%settings, failed_speed, error)
    if (allocated(error)) return
    self%speed = self%response%speeds()
    self%is_of_grid = self%response%points%is_of_grid
    self%frequency = frequencies_of(self%response, self%settings%orders)
    call note_simplifications(machine, self%notes)
    call note_numbers(self%modes, self%notes)
    call note_left_out(self%response%choice, self%modes%modes, self%response%matrix%coordinates, self%notes)
    allocate (is_unstable(size(self%speed)))
    call find_unstable(self%speed, self%modes, self%unstable, is_unstable)
    call note_speeds(self%response, self%unstable, 'nothing stays near the steady state there', self%notes)
    call note_steady_states(self%response, self%notes)
    call note_shaft_modes(machine, self%modes, self%crossings, .true., self%notes)
    self%distance = [(operating_distance(self%settings, self%crossings(i)%speed), i=1, size(self%crossings))]
  end subroutine analyse_campbell

  !> Adds a note on the modes that are left out.
  subroutine note_left_out(choice, modes, coordinates, notes)
    type(modes_choice_t), intent(in) :: choice
    integer, intent(in) :: modes         !! that are followed
    integer, intent(in) :: coordinates
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: text

    if (has_choice(choice)) then
      text = counted(modes, 'mode is', 'modes are') // ' followed over the speed, '
      if (choice%has_range) then
        text = text // 'from ' // rounded_text(choice%range_hz(1), 8) // ' to ' // rounded_text(choice%range_hz(2), 8) // &
               ' Hz at the first speed'
      else
        text = text // 'of the lowest frequencies at the first speed'
      end if
      call append(notes, text // ', of ' // to_text(coordinates) // ' degrees of freedom; whether other modes grow is not ' // &
                         'known; others with --modes NUMBER or --range_hz LOW,HIGH')
    else if (coordinates > modes .and. modes >= most_modes) then
      call append(notes, 'the highest modes are left out: there are ' // to_text(modes) // ', for ' // to_text(coordinates) // &
                         ' degrees of freedom')
    end if
  end subroutine note_left_out

  !> The orders that the input names, excited or not; else the lines of the excitations.
  subroutine choose_lines(self)
    type(campbell_t), intent(inout) :: self
    type(line_t) :: none(0)

    if (size(self%settings%orders) > 0) then
      self%response%lines = none
      self%order = self%settings%orders
      allocate (self%is_order(size(self%order)), source=.true.)
    else
      self%order = self%response%lines%order
      self%is_order = self%response%lines%is_order
    end if
  end subroutine choose_lines

end module nocdyn_campbell
