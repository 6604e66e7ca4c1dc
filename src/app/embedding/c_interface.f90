!> The interface to machines in another program. `nocdyn.h` says what each call does.
!>
!> Threads may call it at the same time: nothing that they share makes a text but in `critical (texts)`.
module nocdyn_c_interface
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
  use nocdyn_case_choice, only: find_case
  use nocdyn_errors, only: error_t, exit_done
  use nocdyn_given_texts, only: c_text_t, give_lines, give_text, take_text
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input, read_input_text
  use nocdyn_kinds, only: wp
  use nocdyn_live_machine, only: live_machine_t, live_motion_t
  use nocdyn_live_numbers, only: live_number_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: string_t
  use nocdyn_version, only: version
  implicit none (type, external)
  private

  public :: nocdyn_open, nocdyn_open_text, nocdyn_close, nocdyn_run_to, nocdyn_read, nocdyn_set, nocdyn_set_torque
  public :: nocdyn_code, nocdyn_message, nocdyn_notes, nocdyn_time, nocdyn_end_time, nocdyn_steps
  public :: nocdyn_signal_count, nocdyn_signal_name, nocdyn_signal_unit, nocdyn_signal_caption, nocdyn_signal_positive, &
    nocdyn_signal_kind, nocdyn_signal_element
  public :: nocdyn_whole_input, nocdyn_number_count, nocdyn_describe_number, nocdyn_set_end_time
  public :: nocdyn_keep, nocdyn_restore, nocdyn_free_state, nocdyn_release

  ! The texts of a signal.
  integer, parameter :: of_name = 1, of_unit = 2, of_caption = 3, of_positive = 4, of_kind = 5, of_element = 6

  !> A number that may be given values.
  type :: number_t
    type(c_text_t) :: path, unit, caption
    real(wp) :: value = 0.0_wp
    integer :: change = 0
  end type number_t

  !> The same for C.
  type, bind(c) :: described_number_t
    type(c_ptr) :: path, unit, caption
    real(c_double) :: value
    integer(c_int) :: change
  end type described_number_t

  !> What a `nocdyn_machine *` points to.
  type :: handle_t
    type(live_machine_t) :: machine
    integer :: code = exit_done
    type(c_text_t) :: message, notes
    type(c_text_t), allocatable :: signals(:, :)   !! [texts of a signal, signals]
    type(number_t), allocatable :: numbers(:)      !! once they have been asked for
    type(c_text_t) :: input
  end type handle_t

  !> What a `nocdyn_state *` points to.
  type :: state_t
    type(live_motion_t) :: motion
  end type state_t

  character(kind=c_char), parameter :: release(*) = [transfer(version, [character(kind=c_char) ::], len(version)), c_null_char]
  character(kind=c_char), target :: kept_release(size(release)) = release

contains

  !> The version.
  type(c_ptr) function nocdyn_release() result(text) bind(c)

    text = c_loc(kept_release)
  end function nocdyn_release

  !> A machine from a file.
  type(c_ptr) function nocdyn_open(file, count, overrides, load_case) result(machine) bind(c)
    type(c_ptr), value, intent(in) :: file
    integer(c_int), value, intent(in) :: count
    type(c_ptr), value, intent(in) :: overrides, load_case

    call open_machine(file, c_null_ptr, count, overrides, load_case, machine)
  end function nocdyn_open

  !> A machine from a text.
  type(c_ptr) function nocdyn_open_text(text, name, count, overrides, load_case) result(machine) bind(c)
    type(c_ptr), value, intent(in) :: text, name
    integer(c_int), value, intent(in) :: count
    type(c_ptr), value, intent(in) :: overrides, load_case

    call open_machine(name, text, count, overrides, load_case, machine)
  end function nocdyn_open_text

  subroutine open_machine(file, content, count, overrides, load_case, machine)
    type(c_ptr), intent(in) :: file       !! its name
    type(c_ptr), intent(in) :: content    !! of the file; null: it is read
    integer(c_int), intent(in) :: count
    type(c_ptr), intent(in) :: overrides  !! of so many texts, as of --set
    type(c_ptr), intent(in) :: load_case  !! or null, of the machine by itself
    type(c_ptr), intent(out) :: machine
    type(handle_t), pointer :: handle
    type(c_ptr), pointer :: addresses(:)
    type(string_t), allocatable :: notes(:), settings(:)
    type(string_t) :: words(3)
    type(error_t), allocatable :: error
    type(input_t) :: input
    integer :: i

    allocate (handle)
    machine = c_loc(handle)
    allocate (settings(max(0, count)))
    if (size(settings) > 0) then
      call c_f_pointer(overrides, addresses, [size(settings)])
      do i = 1, size(settings)
        call take_text(addresses(i), settings(i)%text)
      end do
    end if
    call take_text(file, words(1)%text)
    if (c_associated(content)) call take_text(content, words(2)%text)
    if (c_associated(load_case)) call take_text(load_case, words(3)%text)
    allocate (notes(0))
    !$omp critical (texts)
    call read_machine(words, settings, input, error)
    if (.not. allocated(error)) call handle%machine%start(input, notes, error)
    !$omp end critical (texts)
    call give_lines(notes, handle%notes)
    call list_signals(handle)
    call take_error(handle, error)
  end subroutine open_machine

  !> Reads a machine or one of its load cases.
  subroutine read_machine(words, settings, input, error)
    type(string_t), intent(in) :: words(3)      !! name of the file, its content and the load case; these if they are allocated
    type(string_t), intent(in) :: settings(:)   !! as of --set
    type(input_t), intent(out) :: input
    type(error_t), allocatable, intent(out) :: error
    type(input_t), allocatable :: load_cases(:)
    type(string_t) :: only
    integer :: chosen

    only%text = ''
    if (allocated(words(3)%text)) only%text = words(3)%text
    if (allocated(words(2)%text)) then
      call read_input_text(words(2)%text, words(1)%text, settings, input, error, load_cases=load_cases, only_case=only%text)
    else
      call read_input(words(1)%text, settings, input, error, load_cases=load_cases, only_case=only%text)
    end if
    if (allocated(error) .or. only%text == '') return
    call find_case(only%text, input, chosen, error)
    if (.not. allocated(error)) input = load_cases(chosen)
  end subroutine read_machine

  !> Frees a machine.
  subroutine nocdyn_close(machine) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    if (.not. c_associated(machine)) return
    call c_f_pointer(machine, handle)
    deallocate (handle)
  end subroutine nocdyn_close

  !> The code of the last call.
  integer(c_int) function nocdyn_code(machine) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    code = handle%code
  end function nocdyn_code

  !> The message of the last call.
  type(c_ptr) function nocdyn_message(machine) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    text = c_loc(handle%message%characters)
  end function nocdyn_message

  !> What a run prints before it begins.
  type(c_ptr) function nocdyn_notes(machine) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    text = c_loc(handle%notes%characters)
  end function nocdyn_notes

  !> The number of signals.
  integer(c_int) function nocdyn_signal_count(machine) result(count) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    count = size(handle%signals, 2)
  end function nocdyn_signal_count

  !> Its name.
  type(c_ptr) function nocdyn_signal_name(machine, signal) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: signal

    text = text_of_signal(machine, signal, of_name)
  end function nocdyn_signal_name

  !> Its unit.
  type(c_ptr) function nocdyn_signal_unit(machine, signal) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: signal

    text = text_of_signal(machine, signal, of_unit)
  end function nocdyn_signal_unit

  !> What it is.
  type(c_ptr) function nocdyn_signal_caption(machine, signal) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: signal

    text = text_of_signal(machine, signal, of_caption)
  end function nocdyn_signal_caption

  !> When it is positive.
  type(c_ptr) function nocdyn_signal_positive(machine, signal) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: signal

    text = text_of_signal(machine, signal, of_positive)
  end function nocdyn_signal_positive

  !> The group of the input that it is of.
  type(c_ptr) function nocdyn_signal_kind(machine, signal) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: signal

    text = text_of_signal(machine, signal, of_kind)
  end function nocdyn_signal_kind

  !> The name of that group.
  type(c_ptr) function nocdyn_signal_element(machine, signal) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: signal

    text = text_of_signal(machine, signal, of_element)
  end function nocdyn_signal_element

  !> A text of a signal, null if there is no such signal.
  type(c_ptr) function text_of_signal(machine, signal, which) result(text)
    type(c_ptr), intent(in) :: machine
    integer(c_int), intent(in) :: signal   !! from 0
    integer, intent(in) :: which           !! of_...
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    text = c_null_ptr
    if (signal < 0 .or. signal >= size(handle%signals, 2)) return
    text = c_loc(handle%signals(which, signal + 1)%characters)
  end function text_of_signal

  !> The whole input.
  type(c_ptr) function nocdyn_whole_input(machine) result(text) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle
    character(len=:), allocatable :: written

    call c_f_pointer(machine, handle)
    !$omp critical (texts)
    call handle%machine%write_input(written)
    !$omp end critical (texts)
    call give_text(written, handle%input)
    text = c_loc(handle%input%characters)
  end function nocdyn_whole_input

  !> How many numbers may be given values; they are found anew.
  integer(c_int) function nocdyn_number_count(machine) result(count) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle
    type(live_number_t), allocatable :: numbers(:)
    integer :: i

    call c_f_pointer(machine, handle)
    !$omp critical (texts)
    call handle%machine%list_numbers(numbers)
    !$omp end critical (texts)
    if (allocated(handle%numbers)) deallocate (handle%numbers)
    allocate (handle%numbers(size(numbers)))
    do i = 1, size(numbers)
      call give_text(numbers(i)%path, handle%numbers(i)%path)
      call give_text(numbers(i)%unit, handle%numbers(i)%unit)
      call give_text(numbers(i)%caption, handle%numbers(i)%caption)
      handle%numbers(i)%value = numbers(i)%value
      handle%numbers(i)%change = numbers(i)%change
    end do
    count = size(numbers)
  end function nocdyn_number_count

  !> One of them; its number is not checked.
  subroutine nocdyn_describe_number(machine, number, described) bind(c)
    type(c_ptr), value, intent(in) :: machine
    integer(c_int), value, intent(in) :: number   !! from 0
    type(described_number_t), intent(out) :: described
    type(handle_t), pointer :: handle
    type(number_t), pointer :: found

    call c_f_pointer(machine, handle)
    found => handle%numbers(number + 1)
    described%path = c_loc(found%path%characters)
    described%unit = c_loc(found%unit%characters)
    described%caption = c_loc(found%caption%characters)
    described%value = found%value
    described%change = found%change
  end subroutine nocdyn_describe_number

  !> The present time.
  real(c_double) function nocdyn_time(machine) result(t) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    t = handle%machine%time()
  end function nocdyn_time

  !> The end of the run.
  real(c_double) function nocdyn_end_time(machine) result(t) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    t = handle%machine%last_time()
  end function nocdyn_end_time

  !> Moves the end of the run.
  integer(c_int) function nocdyn_set_end_time(machine, t) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine
    real(c_double), value, intent(in) :: t
    type(handle_t), pointer :: handle
    type(error_t), allocatable :: error

    call c_f_pointer(machine, handle)
    call handle%machine%end_at(t, error)
    call take_error(handle, error)
    code = handle%code
  end function nocdyn_set_end_time

  !> The steps so far.
  integer(c_int) function nocdyn_steps(machine) result(steps) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle

    call c_f_pointer(machine, handle)
    steps = handle%machine%steps()
  end function nocdyn_steps

  !> Integrates to a time.
  integer(c_int) function nocdyn_run_to(machine, t) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine
    real(c_double), value, intent(in) :: t
    type(handle_t), pointer :: handle
    type(error_t), allocatable :: error

    call c_f_pointer(machine, handle)
    call handle%machine%run_to(t, error)
    call take_error(handle, error)
    code = handle%code
  end function nocdyn_run_to

  !> Reads the signals.
  integer(c_int) function nocdyn_read(machine, values) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine, values
    type(handle_t), pointer :: handle
    type(error_t), allocatable :: error
    real(c_double), pointer :: row(:)

    call c_f_pointer(machine, handle)
    call c_f_pointer(values, row, [size(handle%signals, 2)])
    call handle%machine%read_row(row, error)
    call take_error(handle, error)
    code = handle%code
  end function nocdyn_read

  !> Sets a number.
  integer(c_int) function nocdyn_set(machine, path, value) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine, path
    real(c_double), value, intent(in) :: value
    type(handle_t), pointer :: handle
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    call c_f_pointer(machine, handle)
    call take_text(path, text)
    call handle%machine%set_number(text, value, error)
    call take_error(handle, error)
    code = handle%code
  end function nocdyn_set

  !> Sets a torque.
  integer(c_int) function nocdyn_set_torque(machine, name, torque, rate) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine, name
    real(c_double), value, intent(in) :: torque, rate
    type(handle_t), pointer :: handle
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    call c_f_pointer(machine, handle)
    call take_text(name, text)
    call handle%machine%set_torque(text, torque, rate, error)
    call take_error(handle, error)
    code = handle%code
  end function nocdyn_set_torque

  !> Copies the motion.
  type(c_ptr) function nocdyn_keep(machine) result(state) bind(c)
    type(c_ptr), value, intent(in) :: machine
    type(handle_t), pointer :: handle
    type(state_t), pointer :: kept
    type(error_t), allocatable :: error

    call c_f_pointer(machine, handle)
    allocate (kept)
    call handle%machine%keep(kept%motion, error)
    state = c_loc(kept)
    if (allocated(error)) then
      deallocate (kept)
      state = c_null_ptr
    end if
    call take_error(handle, error)
  end function nocdyn_keep

  !> Goes back to a motion.
  integer(c_int) function nocdyn_restore(machine, state) result(code) bind(c)
    type(c_ptr), value, intent(in) :: machine, state
    type(handle_t), pointer :: handle
    type(state_t), pointer :: kept
    type(error_t), allocatable :: error

    call c_f_pointer(machine, handle)
    call c_f_pointer(state, kept)
    call handle%machine%restore(kept%motion)
    call take_error(handle, error)
    code = handle%code
  end function nocdyn_restore

  !> Frees a motion.
  subroutine nocdyn_free_state(state) bind(c)
    type(c_ptr), value, intent(in) :: state
    type(state_t), pointer :: kept

    if (.not. c_associated(state)) return
    call c_f_pointer(state, kept)
    deallocate (kept)
  end subroutine nocdyn_free_state

  !> Keeps code and message of a call.
  subroutine take_error(handle, error)
    type(handle_t), intent(inout) :: handle
    type(error_t), allocatable, intent(inout) :: error

    handle%code = exit_done
    if (allocated(error)) then
      handle%code = error%code
      call give_text(error%message, handle%message)
    else
      call give_text('', handle%message)
    end if
  end subroutine take_error

  !> Keeps the texts of all signals.
  subroutine list_signals(handle)
    type(handle_t), intent(inout) :: handle
    type(signal_t), allocatable :: columns(:)
    integer :: i

    call handle%machine%list_columns(columns)
    allocate (handle%signals(of_element, size(columns)))
    do i = 1, size(columns)
      call give_text(columns(i)%name, handle%signals(of_name, i))
      call give_text(columns(i)%unit, handle%signals(of_unit, i))
      call give_text(columns(i)%caption, handle%signals(of_caption, i))
      call give_text(columns(i)%positive, handle%signals(of_positive, i))
      call give_text(columns(i)%element_kind, handle%signals(of_kind, i))
      call give_text(columns(i)%element, handle%signals(of_element, i))
    end do
  end subroutine list_signals

end module nocdyn_c_interface
