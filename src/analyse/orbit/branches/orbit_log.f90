!> The journal of an analysis of periodic motions: an interrupted or killed analysis goes on from there.
!>
!> A log file of the head, the version and the input, and of what was found, in the order of the computation.
module nocdyn_orbit_log
  use, intrinsic :: iso_fortran_env, only: int32, int64
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_log_file, only: frame_bytes, log_file_t
  use nocdyn_posix, only: is_interrupted
  use nocdyn_text, only: shown_path
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  character(len=*), parameter, public :: journal_name = 'orbit.journal'
  integer(int32), parameter :: head_tag = int(z'64616568', int32), entry_tag = int(z'7972746E', int32)   ! 'head', 'ntry'

  type, public :: orbit_log_t
    integer :: walks = 0                                !! branches begun so far
    type(log_file_t), private :: file
    integer(int64), private :: next = 0, held = 0       !! the entry that is read next, and the end of those there [bytes]
    character(len=:), allocatable, private :: folder, head   !! where the file is made with the first entry; its first one
  contains
    procedure :: open => open_log
    procedure :: put, read_next, is_stopped, remove
  end type orbit_log_t

contains

  !> Opens the journal of a folder to go on. A new one is made with its first entry: what fails at once leaves nothing.
  subroutine open_log(self, input, folder, resumes, error)
    class(orbit_log_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder             !! made if it does not exist
    logical, intent(in) :: resumes                     !! whether a journal that is there is welcome
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: bytes
    logical :: is_there

    self%folder = folder
    self%head = version // ' ' // compiler_text // new_line('a') // input_text(input)
    self%file%kind = 'orbit'
    inquire (file=folder // '/' // journal_name, exist=is_there, size=bytes)
    if (.not. (is_there .and. bytes > 0)) return
    if (resumes) then
      call self%file%open(folder, journal_name, error)
      if (.not. allocated(error)) call read_entries(self, error)
    else
      call raise(error, exit_input, shown_path(folder // '/' // journal_name) // ' holds the motions of an unfinished ' // &
                 'analysis; continue it with --resume, or remove it')
    end if
  end subroutine open_log

  !> Checks the head and finds the end of the whole entries.
  subroutine read_entries(self, error)
    type(orbit_log_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: length
    logical :: is_good, is_there

    call self%file%read(self%file%end, head_tag, length, is_there, is_good)
    if (is_good) is_good = self%file%buffer(frame_bytes + 1:frame_bytes + length) == self%head
    if (.not. is_good) then
      call raise(error, exit_input, shown_path(self%file%path) // ' is of another input or another nocdyn; ' // &
                 'continue with those, or remove it')
      return
    end if
    self%next = self%file%end + frame_bytes + length
    self%file%end = self%next
    do
      call self%file%read(self%file%end, entry_tag, length, is_there, is_good)
      if (.not. is_good) exit
      self%file%end = self%file%end + frame_bytes + length
    end do
    self%held = self%file%end
    call self%file%cut(error)
  end subroutine read_entries

  !> Appends an entry.
  subroutine put(self, bytes, error)
    class(orbit_log_t), intent(inout) :: self
    character(len=*), intent(in) :: bytes
    type(error_t), allocatable, intent(out) :: error

    if (.not. self%file%is_open()) then
      call self%file%create(self%folder, journal_name, error)
      if (.not. allocated(error)) call self%file%write(head_tag, self%head, error)
      if (allocated(error)) return
    end if
    call self%file%write(entry_tag, bytes, error)
  end subroutine put

  !> The next entry of those that were there; ''  if there is none.
  subroutine read_next(self, bytes, goes_on)
    class(orbit_log_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: bytes
    logical, intent(in) :: goes_on   !! whether the one after it follows; else it is read again
    integer :: length
    logical :: is_good, is_there

    bytes = ''
    if (self%next >= self%held) return
    call self%file%read(self%next, entry_tag, length, is_there, is_good)
    if (.not. is_good) return
    bytes = self%file%buffer(frame_bytes + 1:frame_bytes + length)
    if (goes_on) self%next = self%next + frame_bytes + length
  end subroutine read_next

  !> Removes the journal of an analysis that has failed: it would fail again.
  subroutine remove(self)
    class(orbit_log_t), intent(inout) :: self

    if (self%file%is_open()) call self%file%remove()
  end subroutine remove

  !> Whether the user has interrupted the analysis.
  logical function is_stopped(self)
    class(orbit_log_t), intent(in) :: self

    is_stopped = is_interrupted()
  end function is_stopped

end module nocdyn_orbit_log
