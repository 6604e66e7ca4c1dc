!> A machine that another program runs: from time to time, reading signals and changing numbers and torques between them.
!>
!> It is read, checked, assembled and integrated as in a run. Nothing is kept outside of it, so that threads may run machines of
!> their own at the same time. What makes texts is done by one thread at a time.
module nocdyn_live_machine
  use nocdyn_column_names, only: choose_columns
  use nocdyn_continued_integration, only: continued_integration_t
  use nocdyn_direct_parameters, only: direct_parameters_t
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_external_excitations, only: external_excitations_t
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_live_numbers, only: find_direct, list_live_numbers, live_number_t
  use nocdyn_machine_parts, only: refuse_mistakes
  use nocdyn_observer, only: observer_t
  use nocdyn_output_units, only: output_units
  use nocdyn_signals, only: signal_t
  use nocdyn_solver_status, only: failure_message
  use nocdyn_targets, only: find_target, set_targets, target_t
  use nocdyn_text, only: quoted, string_t, to_text
  use nocdyn_trajectory_table, only: new_trajectory_table, trajectory_table_t
  use nocdyn_transient, only: build_formulation
  implicit none (type, external)
  private

  !> What changes while a machine moves. A copy is the machine as it was.
  type, public :: live_motion_t
    class(formulation_t), allocatable, private :: formulation
    type(continued_integration_t), private :: integration
    type(input_t), private :: input                !! with the numbers that have been set
    real(wp), allocatable, private :: row(:)       !! all signals at the present time, in the units of the table
    integer, private :: not_finite = 0             !! the first of them that is no finite number
    logical, private :: has_changed = .false.      !! whether numbers have been set since
  end type live_motion_t

  !> It stays where it is: it points to its parts.
  type, public :: live_machine_t
    type(live_motion_t), private :: motion
    type(integration_settings_t), private :: settings
    type(trajectory_table_t), private :: table
    integer, allocatable, private :: chosen(:)     !! signals that are columns of a run
    logical, private :: is_ready = .false.
  contains
    procedure :: start, run_to, time, last_time, end_at, read_row, list_columns, list_numbers, write_input, steps
    procedure :: set_number, set_torque, keep, restore
    procedure, private :: settle_changes, refuse_if_stopped, note_failure
  end type live_machine_t

  !> Makes a row of every time that is asked for.
  type, extends(observer_t) :: row_observer_t
    type(trajectory_table_t), pointer :: table => null()
    type(live_motion_t), pointer :: motion => null()
  contains
    procedure :: on_output
  end type row_observer_t

contains

  !> Assembles the machine of an input that has been read, and starts it. Errors are those of a run. One thread at a time may do
  !> so, in `critical (texts)`, as what reads the input does.
  subroutine start(self, input, notes, error)
    class(live_machine_t), target, intent(inout) :: self
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(out) :: notes(:)   !! as a run prints them
    type(error_t), allocatable, intent(out) :: error
    type(row_observer_t) :: observer
    real(wp) :: span(2)

    allocate (notes(0))
    call refuse_mistakes(input, error)
    if (allocated(error)) return
    self%motion%input = input
    call build_formulation(input, self%motion%formulation, self%settings, notes, error)
    if (allocated(error)) return
    associate (run => input%groups(input%position('run')))
      span = [run%number('t_start'), run%number('t_end')]
    end associate
    self%table = new_trajectory_table(self%motion%formulation, span(1), output_units(input))
    self%table%columns%in_motion = .true.
    call choose_columns(input, self%table%signals, self%chosen, notes, error)
    if (allocated(error)) return
    allocate (self%motion%row(size(self%table%signals)), source=0.0_wp)
    observer = observer_of(self)
    call self%motion%integration%begin(self%motion%formulation, self%settings, span, self%motion%formulation%start(), &
                                       observer, error)
    self%is_ready = .not. allocated(error)
    if (self%is_ready) call find_failure(self, error)
  end subroutine start

  !> Integrates to a time, by the method and the tolerances of the input. What has been set applies from the present time on.
  subroutine run_to(self, t, error)
    class(live_machine_t), target, intent(inout) :: self
    real(wp), intent(in) :: t                          !! [s]
    type(error_t), allocatable, intent(out) :: error   !! the time is not ahead, or the integration fails
    type(row_observer_t) :: observer

    call self%settle_changes(error)
    if (allocated(error)) return
    if (.not. (t >= self%time() .and. t <= self%last_time())) then
      !$omp critical (texts)
      call raise(error, exit_input, 't = ' // to_text(t) // ' s is not ahead; allowed: from the present time, ' // &
                 to_text(self%time()) // ' s, to the end, ' // to_text(self%last_time()) // ' s')
      !$omp end critical (texts)
      return
    end if
    observer = observer_of(self)
    call self%motion%integration%advance_to(t, self%motion%formulation, observer)
    call self%note_failure(error)
  end subroutine run_to

  !> The present time [s].
  pure real(wp) function time(self)
    class(live_machine_t), intent(in) :: self

    time = self%motion%integration%t
  end function time

  !> The end of the run: t_end of the input, or what `end_at` has set [s].
  pure real(wp) function last_time(self)
    class(live_machine_t), intent(in) :: self

    last_time = 0.0_wp
    if (self%is_ready) last_time = self%motion%integration%end_time()
  end function last_time

  !> Moves the end, beyond which no step goes, before it is reached.
  subroutine end_at(self, t, error)
    class(live_machine_t), intent(inout) :: self
    real(wp), intent(in) :: t                          !! [s]
    type(error_t), allocatable, intent(out) :: error   !! the time is not ahead, or the end has been reached

    call self%refuse_if_stopped(error)
    if (allocated(error)) return
    if (t > self%time() .and. t <= huge(t) .and. self%time() < self%last_time()) then
      call self%motion%integration%end_at(t)
      return
    end if
    !$omp critical (texts)
    call raise(error, exit_input, 'the run cannot end at ' // to_text(t) // ' s; allowed: a time after the present one, ' // &
               to_text(self%time()) // ' s, before the end, ' // to_text(self%last_time()) // ' s, is reached')
    !$omp end critical (texts)
  end subroutine end_at

  !> Steps that have been accepted so far.
  pure integer function steps(self)
    class(live_machine_t), intent(in) :: self

    steps = 0
    if (self%is_ready) steps = self%motion%integration%solver_status%accepted(1)
  end function steps

  !> The columns of a run of the input, the time first.
  subroutine list_columns(self, columns)
    class(live_machine_t), intent(in) :: self
    type(signal_t), allocatable, intent(out) :: columns(:)   !! in the units of &output; none of a machine that is refused

    allocate (columns(0))
    if (self%is_ready) columns = self%table%signals(self%chosen)
  end subroutine list_columns

  !> The numbers of elements that may be given values, none of a machine that is refused. One thread at a time may ask, in
  !> `critical (texts)`.
  subroutine list_numbers(self, numbers)
    class(live_machine_t), intent(in) :: self
    type(live_number_t), allocatable, intent(out) :: numbers(:)

    if (self%is_ready) then
      call list_live_numbers(self%motion%input, self%motion%formulation, numbers)
    else
      allocate (numbers(0))
    end if
  end subroutine list_numbers

  !> The whole input, with settings and numbers that have been set, and with its tables: a file by itself. '' of a machine that is
  !> refused. One thread at a time may ask, in `critical (texts)`.
  subroutine write_input(self, text)
    class(live_machine_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text

    text = ''
    if (self%is_ready) text = input_text(self%motion%input)
  end subroutine write_input

  !> The values of the columns at the present time.
  subroutine read_row(self, values, error)
    class(live_machine_t), target, intent(inout) :: self
    real(wp), intent(out) :: values(:)                 !! in the order of `list_columns`
    type(error_t), allocatable, intent(out) :: error   !! the machine has failed

    values = 0.0_wp
    call self%settle_changes(error)
    if (.not. allocated(error)) values = self%motion%row(self%chosen)
  end subroutine read_row

  !> Gives a key of an element a value from the present time on.
  subroutine set_number(self, path, value, error)
    class(live_machine_t), target, intent(inout) :: self
    character(len=*), intent(in) :: path               !! such as 'load.work.viscous'
    real(wp), intent(in) :: value                      !! in its unit
    type(error_t), allocatable, intent(out) :: error   !! there is no such key, it cannot change in a motion, or not so
    type(direct_parameters_t) :: place
    character(len=:), allocatable :: message
    real(wp) :: values(1)

    call self%refuse_if_stopped(error)
    if (allocated(error)) return
    values = value
    !$omp critical (texts)
    call find_place(self%motion, path, values, place, message)
    if (message /= '') call raise(error, exit_input, message)
    !$omp end critical (texts)
    if (allocated(error)) return
    call begin_change(self)
    call place%write_elements(values, 1, self%motion%formulation%machine)
    call self%motion%formulation%refresh_laws(1)
  end subroutine set_number

  !> Finds where a number stands that may take a value, and sets it in the input.
  subroutine find_place(motion, path, values, place, message)
    type(live_motion_t), intent(inout) :: motion
    character(len=*), intent(in) :: path
    real(wp), intent(in) :: values(1)
    type(direct_parameters_t), intent(out) :: place
    character(len=:), allocatable, intent(out) :: message   !! '', or why it may not
    type(target_t) :: target(1)
    type(input_t) :: changed
    real(wp) :: before(1)

    call find_target(motion%input, path, target(1), message)
    if (message /= '') return
    call find_direct(motion%input, target, motion%formulation, place)
    if (.not. place%are_direct) then
      message = path // ' cannot be set while the machine runs; allowed: numbers of elements that stand in their laws as ' // &
                "they are, with formulation = 'reduced'"
      return
    end if
    changed = motion%input
    call set_targets(changed, target, values, message)
    if (message /= '') return
    before = motion%input%groups(target(1)%group)%values(target(1)%key)%number_at(target(1)%position)
    call place%accept(before)
    if (.not. place%are_accepted(values)) then
      message = path // ' = ' // to_text(values(1)) // ' has another sign than ' // to_text(before(1)) // &
                ', with which the machine has been assembled; allowed: the same sign, 0 if it is 0'
      return
    end if
    motion%input = changed
  end subroutine find_place

  !> Sets the torque of an excitation of the kind 'external' from the present time on.
  subroutine set_torque(self, name, torque, rate, error)
    class(live_machine_t), target, intent(inout) :: self
    character(len=*), intent(in) :: name               !! of the excitation
    real(wp), intent(in) :: torque, rate               !! at the present time [N m], and of its change [N m/s]
    type(error_t), allocatable, intent(out) :: error   !! there is no such excitation, or the numbers are not finite
    integer :: bank, element

    call self%refuse_if_stopped(error)
    if (allocated(error)) return
    element = 0
    do bank = 1, size(self%motion%formulation%machine%banks)
      select type (excitations => self%motion%formulation%machine%banks(bank)%bank)
      class is (external_excitations_t)
        element = place_of(excitations%names, name)
        if (element > 0) exit
      end select
    end do
    if (element == 0 .or. .not. (is_finite(torque) .and. is_finite(rate))) then
      !$omp critical (texts)
      if (element == 0) then
        call raise(error, exit_input, "there is no &excitation kind = 'external' with the name " // quoted(name))
      else
        call raise(error, exit_input, 'the torque of ' // quoted(name) // ' and its rate must be finite numbers')
      end if
      !$omp end critical (texts)
      return
    end if
    call begin_change(self)
    select type (excitations => self%motion%formulation%machine%banks(bank)%bank)
    class is (external_excitations_t)
      call excitations%set_torque(element, torque, rate, self%time())
    end select
    call self%motion%formulation%refresh_laws(1)
  end subroutine set_torque

  pure integer function place_of(names, name)
    type(string_t), intent(in) :: names(:)
    character(len=*), intent(in) :: name
    integer :: i

    place_of = 0
    do i = 1, size(names)
      if (names(i)%text == name) place_of = i
    end do
  end function place_of

  !> A copy of the motion: state, branches, joints, steps and numbers that have been set.
  subroutine keep(self, motion, error)
    class(live_machine_t), target, intent(inout) :: self
    type(live_motion_t), intent(out) :: motion
    type(error_t), allocatable, intent(out) :: error   !! the machine has failed

    call self%settle_changes(error)
    if (.not. allocated(error)) motion = self%motion
  end subroutine keep

  !> Goes back, or on, to a motion that has been kept of this machine.
  subroutine restore(self, motion)
    class(live_machine_t), target, intent(inout) :: self
    type(live_motion_t), intent(in) :: motion

    self%motion = motion
    self%table%columns%formulation => self%motion%formulation
  end subroutine restore

  type(row_observer_t) function observer_of(self) result(observer)
    class(live_machine_t), target, intent(inout) :: self

    observer%takes_shifts = .true.   ! the table evaluates the formulation, which has them
    observer%table => self%table
    observer%motion => self%motion
  end function observer_of

  !> Ends the step that is held, before the first of some changes at one time.
  subroutine begin_change(self)
    class(live_machine_t), target, intent(inout) :: self
    type(row_observer_t) :: observer

    if (self%motion%has_changed) return
    observer = observer_of(self)
    call self%motion%integration%cut_step(self%motion%formulation, observer)
    self%motion%has_changed = .true.
  end subroutine begin_change

  !> Starts anew after changes.
  subroutine settle_changes(self, error)
    class(live_machine_t), target, intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(row_observer_t) :: observer

    call self%refuse_if_stopped(error)
    if (allocated(error) .or. .not. self%motion%has_changed) return
    self%motion%has_changed = .false.
    observer = observer_of(self)
    call self%motion%integration%resume(self%motion%formulation, observer)
    call self%note_failure(error)
  end subroutine settle_changes

  !> The error of a machine that cannot go on.
  subroutine refuse_if_stopped(self, error)
    class(live_machine_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (self%is_ready) then
      call self%note_failure(error)
    else
      call raise(error, exit_input, 'the machine was refused')
    end if
  end subroutine refuse_if_stopped

  !> Why the integration has failed, if it has.
  subroutine note_failure(self, error)
    class(live_machine_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    if (self%motion%not_finite == 0 .and. .not. self%motion%integration%has_failed()) return
    !$omp critical (texts)
    call find_failure(self, error)
    !$omp end critical (texts)
  end subroutine note_failure

  !> The same, by one thread at a time.
  subroutine find_failure(self, error)
    class(live_machine_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error

    associate (motion => self%motion)
      if (motion%integration%has_failed()) then
        call raise(error, exit_failed, failure_message(motion%integration%solver_status, 1, motion%formulation, &
                                                       self%settings%rtol, self%settings%atol))
      else if (motion%not_finite > 0) then
        call raise(error, exit_failed, self%table%labels(motion%not_finite)%text // ' is not a finite number at t = ' // &
                   to_text(motion%integration%t) // ' s')
      end if
    end associate
  end subroutine find_failure

  subroutine on_output(self, lane, t, y)
    class(row_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]

    call self%table%fill(t, y, self%motion%row)
    self%motion%not_finite = findloc(is_finite(self%motion%row), .false., dim=1)
  end subroutine on_output

end module nocdyn_live_machine
