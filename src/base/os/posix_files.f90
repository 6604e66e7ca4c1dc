!> Files as descriptors of the operating system: read at any offset, written at the end, truncated, locked; the names in a folder.
module nocdyn_posix_files
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_int64_t, c_intptr_t, c_null_char, c_size_t
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_bytes, only: widen
  use nocdyn_posix, only: close_file, descriptor_call, failure_number, is_interrupted_call, last_failure, path_call, &
    path_number_call
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: is_irregular, open_new, open_existing, file_size, read_at, read_whole, truncate_file, sync_file, sync_path, &
    lock_file, disk_failure, free_bytes, folder_names, remove_empty_folder

  integer(c_int), parameter :: from_start = 0, from_end = 2      ! SEEK_SET, SEEK_END
  integer(c_int), parameter :: exclusive = 2, without_waiting = 4   ! LOCK_EX, LOCK_NB
  integer, parameter :: would_block = 11   ! EWOULDBLOCK
  integer, parameter :: disk_errors(4) = [5, 27, 28, 122]   ! EIO, EFBIG, ENOSPC, EDQUOT

  procedure(path_call), bind(c, name='nocdyn_open_new') :: c_open_new
  procedure(path_call), bind(c, name='rmdir') :: c_rmdir
  procedure(path_number_call), bind(c, name='nocdyn_open_existing') :: c_open_existing
  procedure(descriptor_call), bind(c, name='fdatasync') :: c_fdatasync
  procedure(descriptor_call), bind(c, name='fsync') :: c_fsync

  interface
    integer(c_intptr_t) function c_pread(descriptor, bytes, length, offset) bind(c, name='pread')
      import :: c_char, c_int, c_int64_t, c_intptr_t, c_size_t
      integer(c_int), value, intent(in) :: descriptor
      character(kind=c_char), intent(inout) :: bytes(*)
      integer(c_size_t), value, intent(in) :: length
      integer(c_int64_t), value, intent(in) :: offset
    end function c_pread

    integer(c_int) function c_is_irregular(path) bind(c, name='nocdyn_is_irregular')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
    end function c_is_irregular

    real(c_double) function c_free_bytes(path) bind(c, name='nocdyn_free_bytes')
      import :: c_char, c_double
      character(kind=c_char), intent(in) :: path(*)
    end function c_free_bytes

    integer(c_intptr_t) function c_read(descriptor, bytes, length) bind(c, name='read')
      import :: c_char, c_int, c_intptr_t, c_size_t
      integer(c_int), value, intent(in) :: descriptor
      character(kind=c_char), intent(inout) :: bytes(*)
      integer(c_size_t), value, intent(in) :: length
    end function c_read

    integer(c_int64_t) function c_lseek(descriptor, offset, from) bind(c, name='lseek')
      import :: c_int, c_int64_t
      integer(c_int), value, intent(in) :: descriptor
      integer(c_int64_t), value, intent(in) :: offset
      integer(c_int), value, intent(in) :: from
    end function c_lseek

    integer(c_int) function c_ftruncate(descriptor, length) bind(c, name='ftruncate')
      import :: c_int, c_int64_t
      integer(c_int), value, intent(in) :: descriptor
      integer(c_int64_t), value, intent(in) :: length
    end function c_ftruncate

    integer(c_int) function c_flock(descriptor, operation) bind(c, name='flock')
      import :: c_int
      integer(c_int), value, intent(in) :: descriptor, operation
    end function c_flock

    !> Writes the names, each followed by a null character (folder_names.cpp); returns the length of all.
    function c_folder_names(path, names, capacity) result(length) bind(c, name='nocdyn_folder_names')
      import :: c_char, c_size_t
      character(kind=c_char), intent(in) :: path(*)
      character(kind=c_char), intent(out) :: names(*)
      integer(c_size_t), value, intent(in) :: capacity
      integer(c_size_t) :: length
    end function c_folder_names
  end interface

contains

  !> Creates a file to read and write; its descriptor, negative on failure or if a file of that name exists.
  integer function open_new(path)
    character(len=*), intent(in) :: path

    open_new = int(c_open_new(path // c_null_char))
  end function open_new

  !> Opens an existing file; its descriptor, negative on failure.
  integer function open_existing(path, is_to_change)
    character(len=*), intent(in) :: path
    logical, intent(in) :: is_to_change   !! opens it for writing too

    open_existing = int(c_open_existing(path // c_null_char, merge(1_c_int, 0_c_int, is_to_change)))
  end function open_existing

  !> Whether there is something at a path that is no regular file, links followed: a pipe, a device, a folder.
  logical function is_irregular(path)
    character(len=*), intent(in) :: path

    is_irregular = c_is_irregular(path // c_null_char) /= 0
  end function is_irregular

  !> Size of a file [bytes], negative on failure.
  integer(int64) function file_size(descriptor)
    integer, intent(in) :: descriptor

    file_size = c_lseek(int(descriptor, c_int), 0_c_int64_t, from_end)
  end function file_size

  !> Fills `bytes` from the file, from an offset on. `is_done` is false after a failure or at the end of the file.
  subroutine read_at(descriptor, offset, bytes, is_done)
    integer, intent(in) :: descriptor
    integer(int64), intent(in) :: offset
    character(len=*), intent(inout) :: bytes
    logical, intent(out) :: is_done
    integer(c_intptr_t) :: found
    integer :: next

    next = 1
    do while (next <= len(bytes))
      found = c_pread(int(descriptor, c_int), bytes(next:), int(len(bytes) - next + 1, c_size_t), offset + next - 1)
      if (found < 0) then
        if (is_interrupted_call()) cycle
      end if
      if (found < 1) exit
      next = next + int(found)
    end do
    is_done = next > len(bytes)
  end subroutine read_at

  !> Reads all bytes of a file or a pipe from its beginning, but one more than `most` at most.
  subroutine read_whole(descriptor, most, bytes, is_done)
    integer, intent(in) :: descriptor
    integer, intent(in) :: most   !! [bytes], less than half of the largest integer
    character(len=:), allocatable, intent(out) :: bytes
    logical, intent(out) :: is_done
    integer(c_intptr_t) :: found
    integer(int64) :: position
    integer :: used
    integer, parameter :: least = 65536

    call widen(bytes, int(min(max(file_size(descriptor), int(least, int64)), int(most, int64))) + 1)   ! a pipe has no size
    position = c_lseek(int(descriptor, c_int), 0_c_int64_t, from_start)
    used = 0
    do
      if (used == len(bytes)) call widen(bytes, min(2 * used, most + 1))
      found = c_read(int(descriptor, c_int), bytes(used + 1:), int(min(len(bytes), most + 1) - used, c_size_t))
      if (found < 0) then
        if (is_interrupted_call()) cycle
      end if
      if (found < 1) exit
      used = used + int(found)
      if (used > most) exit
    end do
    is_done = found >= 0
    bytes = bytes(:used)
  end subroutine read_whole

  !> Truncates the file to `length` bytes and continues writing there.
  subroutine truncate_file(descriptor, length, is_done)
    integer, intent(in) :: descriptor
    integer(int64), intent(in) :: length
    logical, intent(out) :: is_done

    is_done = c_ftruncate(int(descriptor, c_int), length) == 0
    if (is_done) is_done = c_lseek(int(descriptor, c_int), length, from_start) == length
  end subroutine truncate_file

  !> Waits until the data written to a file are on the disk.
  subroutine sync_file(descriptor, is_done)
    integer, intent(in) :: descriptor
    logical, intent(out) :: is_done

    is_done = c_fdatasync(int(descriptor, c_int)) == 0
  end subroutine sync_file

  !> Writes a file or folder, given by its path, to the disk.
  subroutine sync_path(path, is_done)
    character(len=*), intent(in) :: path
    logical, intent(out) :: is_done
    integer :: descriptor
    logical :: is_closed

    descriptor = open_existing(path, is_to_change=.false.)
    is_done = descriptor >= 0
    if (.not. is_done) return
    is_done = c_fsync(int(descriptor, c_int)) == 0
    call close_file(descriptor, is_closed)
  end subroutine sync_path

  !> Locks the file for this process, until it is closed. `is_done` is false if another process holds the lock; on file systems
  !> without locks it is true.
  subroutine lock_file(descriptor, is_done)
    integer, intent(in) :: descriptor
    logical, intent(out) :: is_done

    is_done = c_flock(int(descriptor, c_int), ior(exclusive, without_waiting)) == 0
    if (.not. is_done) is_done = failure_number() /= would_block
  end subroutine lock_file

  !> Room on the file system of a folder, which need not exist yet [bytes]; the largest number if it cannot be found.
  real(c_double) function free_bytes(folder)
    character(len=*), intent(in) :: folder
    integer :: last

    last = len(folder)
    do while (last > 0)
      free_bytes = c_free_bytes(folder(:last) // c_null_char)
      if (free_bytes >= 0.0_c_double) return
      last = index(folder(:last - 1), '/', back=.true.)
    end do
    free_bytes = c_free_bytes('.' // c_null_char)
    if (free_bytes < 0.0_c_double) free_bytes = huge(free_bytes)
  end function free_bytes

  !> The reason if the last call of a library failed because of the disk, else empty.
  function disk_failure() result(reason)
    character(len=:), allocatable :: reason

    reason = ''
    if (any(disk_errors == failure_number())) reason = last_failure()
  end function disk_failure

  !> The names of files and folders in a folder, in no particular order; none if it cannot be read.
  function folder_names(folder) result(names)
    character(len=*), intent(in) :: folder
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: bytes
    integer(c_size_t) :: length
    integer :: first, last

    length = 0
    do   ! files may appear between the two calls
      allocate (character(len=length) :: bytes)
      length = c_folder_names(folder // c_null_char, bytes, int(len(bytes), c_size_t))
      if (length <= len(bytes)) exit
      deallocate (bytes)
    end do
    allocate (names(0))
    first = 1
    do while (first <= length)
      last = first + index(bytes(first:), c_null_char) - 2
      call append(names, bytes(first:last))
      first = last + 2
    end do
  end function folder_names

  !> Removes a folder if it is empty.
  subroutine remove_empty_folder(path)
    character(len=*), intent(in) :: path
    integer(c_int) :: status

    status = c_rmdir(path // c_null_char)
  end subroutine remove_empty_folder

end module nocdyn_posix_files
