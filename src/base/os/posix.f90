!> Services of the operating system that Fortran lacks: folders, renaming, terminals, signals; and writing, because gfortran's
!> `write`, `flush` and `close` report no error when a disk is full.
module nocdyn_posix
  use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_funptr, c_int, c_intptr_t, c_long, c_null_char, &
    c_null_funptr, c_null_ptr, c_ptr, c_size_t
  use nocdyn_c_texts, only: copy_text
  implicit none (type, external)
  private

  public :: make_folders, rename_file, remove_file, process_id, is_terminal, catch_interrupts, is_interrupted, &
    stop_at_interrupts, hold_interrupts, is_to_stop, ignore_file_size_signal
  public :: create_file, write_bytes, close_file, last_failure, failure_number, is_interrupted_call
  public :: path_call, path_number_call, descriptor_call

  integer, parameter, public :: standard_output = 1, standard_error = 2   !! file descriptors

  integer(c_int), parameter :: everything_allowed = int(o'777', c_int), reading_writing = int(o'666', c_int)   ! less the umask
  integer(c_int), parameter :: hang_up_signal = 1, interrupt_signal = 2, termination_signal = 15, file_size_signal = 25
  integer(c_long), parameter :: echo = 1   ! [s]; within it a second signal is a copy of the first, sent to the process group
  integer(c_intptr_t), parameter :: ignored = 1   ! SIG_IGN
  integer(c_int), parameter :: interrupted_call = 4, exists_already = 17   ! EINTR, EEXIST

  integer(c_int), volatile :: received_signal = 0
  integer(c_long), volatile :: received_time = 0
  character(len=:), allocatable, target :: last_words   ! of a program that stops at a signal; not allocated: it notes the signal
  logical, volatile :: is_held = .false.                ! whether it does not stop yet

  ! Functions of the operating system that return a negative number on failure.
  abstract interface
    integer(c_int) function path_call(path) bind(c)
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
    end function path_call

    integer(c_int) function path_number_call(path, number) bind(c)
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value, intent(in) :: number
    end function path_number_call

    integer(c_int) function descriptor_call(descriptor) bind(c)
      import :: c_int
      integer(c_int), value, intent(in) :: descriptor
    end function descriptor_call
  end interface

  procedure(path_call), bind(c, name='unlink') :: c_unlink
  procedure(path_number_call), bind(c, name='mkdir') :: c_mkdir
  procedure(path_number_call), bind(c, name='creat') :: c_creat
  procedure(descriptor_call), bind(c, name='close') :: c_close
  procedure(descriptor_call), bind(c, name='isatty') :: c_isatty

  interface
    integer(c_int) function c_rename(from, to) bind(c, name='rename')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: from(*), to(*)
    end function c_rename

    integer(c_intptr_t) function c_write(descriptor, bytes, length) bind(c, name='write')
      import :: c_char, c_int, c_intptr_t, c_size_t
      integer(c_int), value, intent(in) :: descriptor
      character(kind=c_char), intent(in) :: bytes(*)
      integer(c_size_t), value, intent(in) :: length
    end function c_write

    integer(c_int) function c_errno() bind(c, name='nocdyn_errno')
      import :: c_int
    end function c_errno

    type(c_ptr) function c_strerror(number) bind(c, name='strerror')
      import :: c_int, c_ptr
      integer(c_int), value, intent(in) :: number
    end function c_strerror

    integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
      import :: c_ptr, c_size_t
      type(c_ptr), value, intent(in) :: text
    end function c_strlen

    integer(c_int) function c_getpid() bind(c, name='getpid')
      import :: c_int
    end function c_getpid

    integer(c_long) function c_time(result) bind(c, name='time')
      import :: c_long, c_ptr
      type(c_ptr), value, intent(in) :: result
    end function c_time

    subroutine c_exit_now(status) bind(c, name='_exit')
      import :: c_int
      integer(c_int), value, intent(in) :: status
    end subroutine c_exit_now

    type(c_funptr) function c_signal(signal, handler) bind(c, name='signal')
      import :: c_funptr, c_int
      integer(c_int), value, intent(in) :: signal
      type(c_funptr), value, intent(in) :: handler
    end function c_signal
  end interface

contains

  !> Creates a folder and its parents where they do not exist.
  subroutine make_folders(path, failure)
    character(len=*), intent(in) :: path
    character(len=:), allocatable, intent(out) :: failure   !! reason, allocated if that failed
    integer :: i
    logical :: is_folder

    do i = 2, len(path) + 1
      if (i <= len(path)) then
        if (path(i:i) /= '/') cycle
      end if
      if (c_mkdir(path(:i - 1) // c_null_char, everything_allowed) == 0) cycle
      if (c_errno() == exists_already) cycle
      failure = last_failure()
      return
    end do
    inquire (file=path // '/.', exist=is_folder)
    if (.not. is_folder) failure = 'there is a file of this name'
  end subroutine make_folders

  !> Renames a file atomically and replaces the target.
  subroutine rename_file(from, to, is_done)
    character(len=*), intent(in) :: from, to
    logical, intent(out) :: is_done

    is_done = c_rename(from // c_null_char, to // c_null_char) == 0
  end subroutine rename_file

  !> Removes a file if it exists.
  subroutine remove_file(path)
    character(len=*), intent(in) :: path
    integer(c_int) :: status

    status = c_unlink(path // c_null_char)
  end subroutine remove_file

  !> Creates a file, or empties an existing one; the descriptor to write to, negative on failure.
  integer function create_file(path)
    character(len=*), intent(in) :: path

    create_file = int(c_creat(path // c_null_char, reading_writing))
  end function create_file

  !> Writes all bytes, by several calls if necessary.
  subroutine write_bytes(descriptor, bytes, is_done)
    integer, intent(in) :: descriptor
    character(len=*), intent(in) :: bytes
    logical, intent(out) :: is_done
    integer(c_intptr_t) :: written
    integer :: next

    next = 1
    do while (next <= len(bytes))
      written = c_write(int(descriptor, c_int), bytes(next:), int(len(bytes) - next + 1, c_size_t))
      if (written < 0) then
        if (is_interrupted_call()) cycle
      end if
      if (written < 1) exit
      next = next + int(written)
    end do
    is_done = next > len(bytes)
  end subroutine write_bytes

  !> Closes a descriptor. If `is_done` is false, written data may be lost.
  subroutine close_file(descriptor, is_done)
    integer, intent(in) :: descriptor
    logical, intent(out) :: is_done

    is_done = c_close(int(descriptor, c_int)) == 0
  end subroutine close_file

  !> The reason why the last call of the operating system failed, e.g. "No space left on device".
  function last_failure() result(reason)
    character(len=:), allocatable :: reason
    type(c_ptr) :: text

    text = c_strerror(c_errno())
    call copy_text(text, c_strlen(text), reason)
  end function last_failure

  !> Number of the last failure, `errno`.
  integer function failure_number()
    failure_number = int(c_errno())
  end function failure_number

  !> Whether the last call of the operating system was interrupted by a signal before it did anything.
  logical function is_interrupted_call()
    is_interrupted_call = c_errno() == interrupted_call
  end function is_interrupted_call

  !> Number of this process, for unique names.
  integer function process_id()
    process_id = int(c_getpid())
  end function process_id

  !> Whether a file descriptor (1 standard output, 2 standard error) is a terminal.
  logical function is_terminal(descriptor)
    integer, intent(in) :: descriptor

    is_terminal = c_isatty(int(descriptor, c_int)) == 1
  end function is_terminal

  !> Catches Ctrl-C, termination and hang-up: the first signal only sets `is_interrupted`, a second one more than a second later
  !> ends the program.
  subroutine catch_interrupts()
    call watch(interrupt_signal)
    call watch(termination_signal)
    call watch(hang_up_signal)
  end subroutine catch_interrupts

  !> Stops the program with exit code 1 at the first of these signals, from now on, unless `hold_interrupts` has it finish first.
  subroutine stop_at_interrupts(words)
    character(len=*), intent(in) :: words   !! the message, a whole line

    is_held = .false.
    if (allocated(last_words)) deallocate (last_words)
    last_words = words
    call catch_interrupts()
  end subroutine stop_at_interrupts

  !> Has a program that would stop at a signal note it instead, while it writes files.
  subroutine hold_interrupts()
    is_held = .true.
  end subroutine hold_interrupts

  !> Whether a signal has come that `hold_interrupts` keeps from stopping the program.
  logical function is_to_stop()
    is_to_stop = allocated(last_words) .and. is_interrupted()
  end function is_to_stop

  !> Catches a signal, unless it is ignored already (nohup, a background job of a script).
  subroutine watch(signal)
    integer(c_int), intent(in) :: signal
    type(c_funptr) :: previous

    previous = c_signal(signal, c_funloc(note_signal))
    if (transfer(previous, ignored) == ignored) previous = c_signal(signal, previous)
  end subroutine watch

  !> Ignores the signal for files that exceed the size limit of the shell: the write fails instead, and the program goes on.
  subroutine ignore_file_size_signal()
    type(c_funptr) :: previous

    previous = c_signal(file_size_signal, transfer(ignored, c_null_funptr))
  end subroutine ignore_file_size_signal

  !> The signal handler.
  subroutine note_signal(signal) bind(c)
    integer(c_int), value, intent(in) :: signal
    integer(c_long) :: now
    logical :: is_done

    if (allocated(last_words) .and. .not. is_held) then
      call write_bytes(standard_error, last_words, is_done)
      call c_exit_now(1_c_int)
    end if
    now = c_time(c_null_ptr)
    if (received_signal == 0) received_time = now
    if (now - received_time > echo) call c_exit_now(128 + signal)
    received_signal = signal
  end subroutine note_signal

  !> Whether a signal has been caught since `catch_interrupts`.
  logical function is_interrupted()
    is_interrupted = received_signal /= 0
  end function is_interrupted

end module nocdyn_posix
