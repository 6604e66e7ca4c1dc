!> What the person at the keyboard sees: messages, and progress on a terminal.
module nocdyn_console
  use, intrinsic :: iso_fortran_env, only: error_unit, int64
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_posix, only: is_terminal, standard_error, standard_output, write_bytes
  use nocdyn_text, only: to_text
  use nocdyn_transient, only: progress_t
  implicit none (type, external)
  private

  public :: say, complain, new_console_progress

  logical, protected, public :: output_is_lost = .false.   !! some of standard output could not be written

  real(wp), parameter :: patience = 1.0_wp    ! a run shorter than this shows no progress [s]
  real(wp), parameter :: refresh = 0.2_wp     ! time between two updates of the line [s]

  !> One line on the terminal, rewritten in place.
  type, extends(progress_t), public :: console_progress_t
    character(len=:), allocatable, private :: title
    logical, private :: is_wanted = .false.
    logical, private :: is_shown = .false.
    integer(int64), private :: began = 0, next = 0, rate = 1
  contains
    procedure :: update
    procedure :: clear
  end type console_progress_t

contains

  !> A line, or several, on standard output; the last one may have its end already.
  subroutine say(text)
    character(len=*), intent(in) :: text
    logical :: is_done

    if (index(text, new_line('a'), back=.true.) == len(text)) then
      call write_bytes(standard_output, text, is_done)
    else
      call write_bytes(standard_output, text // new_line('a'), is_done)
    end if
    if (.not. is_done) output_is_lost = .true.
  end subroutine say

  !> The message of an error on standard error, every line with the program's name before it.
  subroutine complain(error)
    type(error_t), intent(in) :: error
    integer :: first, last

    first = 1
    do while (first <= len(error%message))
      last = first + index(error%message(first:) // new_line('a'), new_line('a')) - 2
      write (error_unit, '(a)') 'nocdyn: ' // error%message(first:last)
      first = last + 2
    end do
  end subroutine complain

  !> A line that shows after a second of work, if standard error is a terminal.
  function new_console_progress(title, is_quiet) result(progress)
    character(len=*), intent(in) :: title
    logical, intent(in) :: is_quiet
    type(console_progress_t) :: progress

    progress%title = title
    progress%is_wanted = is_terminal(standard_error) .and. .not. is_quiet
    call system_clock(progress%began, progress%rate)
    progress%next = progress%began + int(patience * real(progress%rate, wp), int64)
  end function new_console_progress

  subroutine update(self, fraction)
    class(console_progress_t), intent(inout) :: self
    real(wp), intent(in) :: fraction
    integer(int64) :: now
    real(wp) :: elapsed, left

    if (.not. self%is_wanted) return
    call system_clock(now)
    if (now < self%next) return
    self%next = now + int(refresh * real(self%rate, wp), int64)
    self%is_shown = .true.
    elapsed = real(now - self%began, wp) / real(self%rate, wp)
    left = elapsed * (1.0_wp - fraction) / max(fraction, epsilon(fraction))
    write (error_unit, '(a)', advance='no') achar(13) // self%title // ': ' // to_text(int(100.0_wp * fraction)) // ' %, ' // &
      to_text(int(min(left, 1.0e8_wp)) + 1) // ' s left' // achar(27) // '[K'
    flush (error_unit)
  end subroutine update

  !> Takes the line away.
  subroutine clear(self)
    class(console_progress_t), intent(inout) :: self

    if (self%is_shown) write (error_unit, '(a)', advance='no') achar(13) // achar(27) // '[K'
    self%is_shown = .false.
  end subroutine clear

end module nocdyn_console
