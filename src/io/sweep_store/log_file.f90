!> Append-only files of checksummed entries.
!>
!> A file begins with a line of text, the version of the format and a number that shows the byte order. An entry is [checksum,
!> tag, length] in four bytes each, then `length` bytes; the checksum covers all that follows it. Each entry is written by one
!> system call: a process that is killed leaves whole entries and at most a part of one. The file is flushed to the disk every
!> few seconds, so that a power failure costs the work of these seconds.
module nocdyn_log_file
  use, intrinsic :: iso_fortran_env, only: int32, int64
  use nocdyn_bytes, only: byte_reader_t, integer_bytes, put_integers, widen
  use nocdyn_checksums, only: checksum_table_t, make_checksum_table
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_posix, only: close_file, last_failure, make_folders, remove_file, write_bytes
  use nocdyn_posix_files, only: file_size, lock_file, open_existing, open_new, read_at, sync_file, truncate_file
  use nocdyn_text, only: quoted, shown_path, to_text
  implicit none (type, external)
  private

  character(len=*), parameter :: line_begin = 'nocdyn ', line_end = ' journal   ' // new_line('a')
  integer(int32), parameter :: format_version = 3, byte_order = int(z'01020304', int32)
  integer, parameter :: line_bytes = len(line_begin) + 5 + len(line_end), start_bytes = line_bytes + 2 * integer_bytes
  integer, parameter :: initial_buffer = 65536
  real, parameter :: flush_interval = 5.0   ! [s]

  integer, parameter, public :: frame_bytes = 3 * integer_bytes

  type, public :: log_file_t
    character(len=:), allocatable :: path
    character(len=5) :: kind = 'sweep'             !! of the work that it is the journal of
    integer(int64) :: end = 0                      !! bytes up to the end of the last whole entry
    character(len=:), allocatable :: buffer        !! the entry that `read` found; its bytes follow the ones of the frame
    type(checksum_table_t), allocatable, private :: table
    integer(int64), private :: flushed = 0         !! count of the system clock at the last flush
    integer, private :: descriptor = -1
    logical, private :: is_read_again = .false.    !! whether it was closed, and is open for reading
  contains
    procedure :: open => open_file
    procedure :: write => write_entry
    procedure :: read => read_entry
    procedure :: size => bytes_in_file
    procedure :: close => close_log_file
    procedure :: create, cut, is_open, remove
    procedure, private :: prepare, make_room, lock, read_start, raise_write_error
  end type log_file_t

contains

  !> Creates a file in `folder`, and the folder if needed. A file of that name is refused unless it is empty: a process that was
  !> killed before its first entry leaves such a file.
  subroutine create(self, folder, name, error)
    class(log_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder, name
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: failure

    call self%prepare(folder, name)
    call make_folders(folder, failure)
    if (allocated(failure)) then
      call self%raise_write_error('the folder cannot be made: ' // failure, error)
      return
    end if
    self%descriptor = open_new(self%path)
    if (self%descriptor < 0) then
      call self%raise_write_error(last_failure(), error)
      self%descriptor = open_existing(self%path, .true.)
      if (self%size() == 0) deallocate (error)
    end if
    if (.not. allocated(error)) call self%lock(error)
    if (allocated(error)) call self%close()
  end subroutine create

  !> Opens an existing file to read it, and to append to it once `end` is set.
  subroutine open_file(self, folder, name, error)
    class(log_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder, name
    type(error_t), allocatable, intent(out) :: error   !! `exit_file` if it cannot be opened, else `exit_input`

    call self%prepare(folder, name)
    self%descriptor = open_existing(self%path, .true.)
    if (self%descriptor < 0) then
      call raise(error, exit_file, shown_path(self%path) // ': cannot be opened: ' // last_failure())
      return
    end if
    call self%lock(error)
    if (.not. allocated(error)) call self%read_start(error)
    if (allocated(error)) call self%close()
  end subroutine open_file

  subroutine prepare(self, folder, name)
    class(log_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder, name

    self%path = folder // '/' // name
    if (folder == '.') self%path = name
    call self%make_room()
    call system_clock(self%flushed)
  end subroutine prepare

  !> Allocates what reading and writing need.
  subroutine make_room(self)
    class(log_file_t), intent(inout) :: self

    allocate (character(len=initial_buffer) :: self%buffer)
    allocate (self%table)
    call make_checksum_table(self%table)
  end subroutine make_room

  !> Whether the file is open.
  pure logical function is_open(self)
    class(log_file_t), intent(in) :: self

    is_open = self%descriptor >= 0
  end function is_open

  subroutine lock(self, error)
    class(log_file_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    call lock_file(self%descriptor, is_done)
    if (.not. is_done) call raise(error, exit_input, shown_path(self%path) // ': another process is at work on this ' // &
                                  self%kind)
  end subroutine lock

  !> Reads and checks what precedes the entries.
  subroutine read_start(self, error)
    class(log_file_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    character(len=start_bytes) :: start
    type(byte_reader_t) :: reader
    integer(int32) :: numbers(2)
    logical :: is_done

    start = ''
    call read_at(self%descriptor, 0_int64, start, is_done)
    if (start(:line_bytes) /= line_begin // self%kind // line_end .or. .not. is_done) then
      call raise(error, exit_input, shown_path(self%path) // ': is no journal of a ' // self%kind // ', or its beginning is lost')
      return
    end if
    reader%next = line_bytes + 1
    call reader%take_integers(start, numbers)
    if (numbers(2) /= byte_order) then
      call raise(error, exit_input, shown_path(self%path) // ': was written on a machine with another order of bytes')
    else if (numbers(1) /= format_version) then
      call raise(error, exit_input, shown_path(self%path) // ': has format ' // to_text(numbers(1)) // &
                 ' of journals; this nocdyn reads format ' // to_text(format_version))
    end if
    self%end = start_bytes
  end subroutine read_start

  !> Appends an entry. After an error the file is cut to what it was before, if the disk allows it.
  subroutine write_entry(self, tag, bytes, error)
    class(log_file_t), intent(inout) :: self
    integer(int32), intent(in) :: tag         !! what kind of entry it is
    character(len=*), intent(in) :: bytes
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: now, rate
    integer :: begins, length, used
    logical :: is_cut, is_done

    call widen(self%buffer, start_bytes + frame_bytes + len(bytes))
    used = 0
    if (self%end == 0) then
      self%buffer(:line_bytes) = line_begin // self%kind // line_end
      used = line_bytes
      call put_integers(self%buffer, used, [format_version, byte_order])
    end if
    begins = used
    used = begins + integer_bytes
    call put_integers(self%buffer, used, [tag, len(bytes)])
    length = used + len(bytes)
    self%buffer(used + 1:length) = bytes
    call put_integers(self%buffer, begins, [self%table%checksum(self%buffer(begins + integer_bytes + 1:length))])
    call write_bytes(self%descriptor, self%buffer(:length), is_done)
    call system_clock(now, rate)
    if (is_done .and. real(now - self%flushed) >= flush_interval * real(rate)) then
      call sync_file(self%descriptor, is_done)
      self%flushed = now
    end if
    if (is_done) then
      self%end = self%end + length
    else
      call self%raise_write_error(last_failure(), error)
      call truncate_file(self%descriptor, self%end, is_cut)
    end if
  end subroutine write_entry

  !> Reads the entry at `offset` into the buffer, frame included. A file that has been closed is opened again.
  subroutine read_entry(self, offset, tag, length, is_there, is_good)
    class(log_file_t), intent(inout) :: self
    integer(int64), intent(in) :: offset
    integer(int32), intent(in) :: tag       !! expected
    integer, intent(out) :: length           !! of the entry without its frame [bytes]
    logical, intent(out) :: is_there         !! whether there are a frame with that tag and as many bytes as it says
    logical, intent(out) :: is_good          !! whether, besides, the checksum is right
    type(byte_reader_t) :: reader
    integer(int32) :: numbers(3)

    is_good = .false.
    length = 0
    if (.not. self%is_open()) then
      self%descriptor = open_existing(self%path, .false.)
      self%is_read_again = .true.
      call self%make_room()
    end if
    call read_at(self%descriptor, offset, self%buffer(:frame_bytes), is_there)
    if (.not. is_there) return
    call reader%take_integers(self%buffer(:frame_bytes), numbers)
    is_there = numbers(2) == tag .and. numbers(3) > 0
    if (is_there) is_there = numbers(3) <= self%size() - offset - frame_bytes
    if (.not. is_there) return
    length = numbers(3)
    call widen(self%buffer, frame_bytes + length)
    call read_at(self%descriptor, offset, self%buffer(:frame_bytes + length), is_there)
    if (is_there) is_good = self%table%checksum(self%buffer(integer_bytes + 1:frame_bytes + length)) == numbers(1)
  end subroutine read_entry

  integer(int64) function bytes_in_file(self)
    class(log_file_t), intent(in) :: self

    bytes_in_file = file_size(self%descriptor)
  end function bytes_in_file

  !> Removes what follows `end`, where the next entry will be written.
  subroutine cut(self, error)
    class(log_file_t), intent(in) :: self
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    call truncate_file(self%descriptor, self%end, is_done)
    if (.not. is_done) call self%raise_write_error(last_failure(), error)
  end subroutine cut

  subroutine raise_write_error(self, reason, error)
    class(log_file_t), intent(in) :: self
    character(len=*), intent(in) :: reason
    type(error_t), allocatable, intent(out) :: error

    call raise(error, exit_file, 'cannot write ' // quoted(shown_path(self%path)) // ': ' // reason)
  end subroutine raise_write_error

  !> Closes the file; entries of it can still be read. Thousands of closed files take little memory.
  subroutine close_log_file(self)
    class(log_file_t), intent(inout) :: self
    logical :: is_done

    if (allocated(self%table)) deallocate (self%table, self%buffer)
    if (.not. self%is_open()) return
    if (.not. self%is_read_again) call sync_file(self%descriptor, is_done)
    call close_file(self%descriptor, is_done)
    self%descriptor = -1
  end subroutine close_log_file

  !> Closes and removes the file.
  subroutine remove(self)
    class(log_file_t), intent(inout) :: self
    logical :: is_done

    call remove_file(self%path)
    if (.not. self%is_open()) return
    call close_file(self%descriptor, is_done)
    self%descriptor = -1
  end subroutine remove

end module nocdyn_log_file
