!> Standard output, error messages and the progress line.
module nocdyn_console
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_printable, only: printable
  use nocdyn_posix, only: is_terminal, standard_error, standard_output, write_bytes
  implicit none (type, external)
  private

  public :: print_text, report_error, new_status_line

  logical, protected, public :: output_is_lost = .false.   !! whether a write to standard output has failed

  character(len=*), parameter :: line_end = new_line('a'), clear_to_end = achar(27) // '[K'
  real(wp), parameter :: first_shown_after = 1.0_wp    ! on a terminal [s]
  real(wp), parameter :: refresh_interval = 0.2_wp     ! of the line on a terminal [s]
  real(wp), parameter :: first_log_interval = 10.0_wp, longest_log_interval = 600.0_wp   ! between lines of a log [s]

  !> A line with the progress. A terminal shows it in place; a log gets new lines at increasing intervals.
  type, public :: status_line_t
    logical, private :: is_wanted = .false.
    logical, private :: is_in_place = .false.
    logical, private :: is_shown = .false.
    integer(int64), private :: began = 0, next = 0, rate = 1
  contains
    procedure :: is_due, elapsed, show
    procedure :: clear => clear_line
  end type status_line_t

contains

  !> Prints one or several lines to standard output. A line end is added if there is none.
  subroutine print_text(text)
    character(len=*), intent(in) :: text

    call put_out(standard_output, text // repeat(line_end, merge(0, 1, index(text, line_end, back=.true.) == len(text))))
  end subroutine print_text

  !> Prints the message of an error to standard error, every line with the program's name before it, and raises the exit code.
  subroutine report_error(error, code)
    type(error_t), intent(in) :: error
    integer, intent(inout) :: code   !! becomes the one of the error if that is higher
    integer :: first, last

    first = 1
    do while (first <= len(error%message))
      last = index(error%message(first:), line_end) + first - 2
      if (last < first - 1) last = len(error%message)
      call put_out(standard_error, 'nocdyn: ' // error%message(first:last) // line_end)
      first = last + 2
    end do
    code = max(code, error%code)
  end subroutine report_error

  !> The one place where text leaves the program.
  subroutine put_out(descriptor, text, before, after)
    integer, intent(in) :: descriptor      !! standard_output or standard_error
    character(len=*), intent(in) :: text
    character(len=*), intent(in), optional :: before, after   !! control characters of the program itself
    character(len=:), allocatable :: whole
    logical :: is_done

    whole = printable(text)
    if (present(before)) whole = before // whole
    if (present(after)) whole = whole // after
    call write_bytes(descriptor, whole, is_done)
    if (descriptor == standard_output .and. .not. is_done) output_is_lost = .true.
  end subroutine put_out

  !> A status line on standard error, which appears some time after this call.
  function new_status_line(is_quiet, shows_in_logs) result(line)
    logical, intent(in) :: is_quiet        !! whether it never appears
    logical, intent(in) :: shows_in_logs   !! whether it appears if standard error is no terminal
    type(status_line_t) :: line

    line%is_in_place = is_terminal(standard_error)
    line%is_wanted = (line%is_in_place .or. shows_in_logs) .and. .not. is_quiet
    call system_clock(line%began, line%rate)
    line%next = line%began + int(merge(first_shown_after, first_log_interval, line%is_in_place) * real(line%rate, wp), int64)
  end function new_status_line

  !> Whether it is time to show the line again. The interval in a log grows with the elapsed time.
  logical function is_due(self)
    class(status_line_t), intent(inout) :: self
    integer(int64) :: now
    real(wp) :: interval

    is_due = self%is_wanted
    if (.not. is_due) return
    call system_clock(now)
    is_due = now >= self%next
    if (.not. is_due) return
    interval = merge(refresh_interval, min(self%elapsed(), longest_log_interval), self%is_in_place)
    self%next = now + int(interval * real(self%rate, wp), int64)
  end function is_due

  !> Time since `new_status_line` [s].
  function elapsed(self)
    class(status_line_t), intent(in) :: self
    real(wp) :: elapsed
    integer(int64) :: now

    call system_clock(now)
    elapsed = real(now - self%began, wp) / real(self%rate, wp)
  end function elapsed

  !> Shows the line with a new text.
  subroutine show(self, text)
    class(status_line_t), intent(inout) :: self
    character(len=*), intent(in) :: text

    if (self%is_in_place) then
      self%is_shown = .true.
      call put_out(standard_error, text, before=achar(13), after=clear_to_end)
    else
      call put_out(standard_error, text // line_end)
    end if
  end subroutine show

  !> Removes the line from a terminal.
  subroutine clear_line(self)
    class(status_line_t), intent(inout) :: self

    if (self%is_shown) call put_out(standard_error, '', before=achar(13), after=clear_to_end)
    self%is_shown = .false.
  end subroutine clear_line

end module nocdyn_console
