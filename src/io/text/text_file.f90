!> Reads text files as a whole.
module nocdyn_text_file
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: first_position, path_in, read_text_file

  integer, parameter :: reason_length = 256

contains

  !> Path of a file: a relative path begins in the folder.
  pure function path_in(folder, path) result(whole)
    character(len=*), intent(in) :: folder   !! with a slash at its end, or ''
    character(len=*), intent(in) :: path     !! not ''
    character(len=:), allocatable :: whole

    whole = folder // path
    if (path(1:1) == '/') whole = path
  end function path_in

  !> Position after the byte-order mark, if there is one.
  pure integer function first_position(text)
    character(len=*), intent(in) :: text
    character(len=*), parameter :: byte_order_mark = char(239) // char(187) // char(191)

    first_position = 1
    if (index(text, byte_order_mark) == 1) first_position = 1 + len(byte_order_mark)
  end function first_position

  !> Reads all bytes of a file or a pipe.
  subroutine read_text_file(file, text, error)
    character(len=*), intent(in) :: file
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error   !! the file cannot be read
    character(len=reason_length) :: reason
    integer(int64) :: bytes
    integer :: status, unit
    logical :: exists

    if (file == '') then
      call raise(error, exit_file, 'an empty text is not the name of a file')
      return
    end if
    inquire (file=file, exist=exists)
    if (.not. exists) then
      call raise(error, exit_file, file // ': cannot be read: there is no such file')
      return
    end if
    reason = ''
    open (newunit=unit, file=file, access='stream', form='unformatted', action='read', status='old', iostat=status, &
      iomsg=reason)
    if (status /= 0) then
      ! "Cannot open file 'x': Permission denied"
      call raise(error, exit_file, file // ': cannot be read: ' // trim(reason(index(reason, ': ', back=.true.) + 2:)))
      return
    end if
    inquire (unit=unit, size=bytes)
    if (bytes > 0) then
      allocate (character(len=bytes) :: text)
      read (unit, iostat=status, iomsg=reason) text
    else
      call read_to_end(unit, text, status, reason)
    end if
    close (unit)
    if (status /= 0) call raise(error, exit_file, file // ': cannot be read: ' // trim(reason))
  end subroutine read_text_file

  !> Reads byte by byte what has no size, such as a pipe.
  subroutine read_to_end(unit, text, status, reason)
    integer, intent(in) :: unit
    character(len=:), allocatable, intent(out) :: text
    integer, intent(out) :: status                          !! 0 or that of the failed `read`
    character(len=reason_length), intent(inout) :: reason   !! of the failure
    type(text_buffer_t) :: buffer
    character(len=1) :: byte

    do
      read (unit, iostat=status, iomsg=reason) byte
      if (status /= 0) exit
      call buffer%append(byte)
    end do
    text = buffer%text()
    if (is_iostat_end(status)) status = 0
  end subroutine read_to_end

end module nocdyn_text_file
