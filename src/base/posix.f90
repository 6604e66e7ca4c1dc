!> The few services of the operating system that Fortran lacks: folders, renaming, terminals, interrupts.
module nocdyn_posix
  use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_funptr, c_int, c_null_char
  implicit none
  private

  public :: make_folders, rename_file, remove_file, process_id, is_terminal, watch_interrupts, is_interrupted

  integer(c_int), parameter :: everything_allowed = int(o'777', c_int)   ! less the umask
  integer(c_int), parameter :: interrupt_signal = 2, termination_signal = 15

  integer(c_int), volatile :: received_signal = 0

  interface
    integer(c_int) function c_mkdir(path, mode) bind(c, name='mkdir')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value, intent(in) :: mode
    end function c_mkdir

    integer(c_int) function c_rename(from, to) bind(c, name='rename')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: from(*), to(*)
    end function c_rename

    integer(c_int) function c_unlink(path) bind(c, name='unlink')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
    end function c_unlink

    integer(c_int) function c_getpid() bind(c, name='getpid')
      import :: c_int
    end function c_getpid

    integer(c_int) function c_isatty(descriptor) bind(c, name='isatty')
      import :: c_int
      integer(c_int), value, intent(in) :: descriptor
    end function c_isatty

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

  !> Makes a folder and those above it; folders that exist are fine, and failure shows when a file is opened in it.
  subroutine make_folders(path)
    character(len=*), intent(in) :: path
    integer(c_int) :: status
    integer :: i

    do i = 2, len(path)
      if (path(i:i) == '/') status = c_mkdir(path(:i - 1) // c_null_char, everything_allowed)
    end do
    status = c_mkdir(path // c_null_char, everything_allowed)
  end subroutine make_folders

  !> Renames a file in one go, replacing the target.
  subroutine rename_file(from, to, is_done)
    character(len=*), intent(in) :: from, to
    logical, intent(out) :: is_done

    is_done = c_rename(from // c_null_char, to // c_null_char) == 0
  end subroutine rename_file

  !> Removes a file if it is there.
  subroutine remove_file(path)
    character(len=*), intent(in) :: path
    integer(c_int) :: status

    status = c_unlink(path // c_null_char)
  end subroutine remove_file

  integer function process_id()
    process_id = int(c_getpid())
  end function process_id

  !> Whether a file descriptor (1 standard output, 2 standard error) shows on a terminal.
  logical function is_terminal(descriptor)
    integer, intent(in) :: descriptor

    is_terminal = c_isatty(int(descriptor, c_int)) == 1
  end function is_terminal

  !> From here on Ctrl-C and termination do not end the program but show in `is_interrupted`; the second one ends it.
  subroutine watch_interrupts()
    type(c_funptr) :: previous

    previous = c_signal(interrupt_signal, c_funloc(note_signal))
    previous = c_signal(termination_signal, c_funloc(note_signal))
  end subroutine watch_interrupts

  subroutine note_signal(signal) bind(c)
    integer(c_int), value, intent(in) :: signal

    if (received_signal /= 0) call c_exit_now(128 + signal)
    received_signal = signal
  end subroutine note_signal

  !> The interruption asked for since `watch_interrupts`.
  logical function is_interrupted()
    is_interrupted = received_signal /= 0
  end function is_interrupted

end module nocdyn_posix
