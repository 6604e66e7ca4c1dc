!> Reads text files as a whole.
module nocdyn_text_file
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix, only: close_file, failure_number, last_failure
  use nocdyn_posix_files, only: is_irregular, open_existing, read_whole
  use nocdyn_text, only: shown_path, to_text
  implicit none (type, external)
  private

  public :: first_position, path_in, read_text_file

  integer, parameter, public :: largest_input = 100000000   !! file [bytes]: half a million bodies
  integer, parameter, public :: largest_table = 500000000   !! file [bytes], also of a list of variants

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

  !> Reads all bytes of a file.
  subroutine read_text_file(file, text, error, most, may_be_pipe)
    character(len=*), intent(in) :: file
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error   !! the file cannot be read
    integer, intent(in), optional :: most              !! longest file [bytes]; `largest_table` if absent
    logical, intent(in), optional :: may_be_pipe       !! of the command line; files that others name are regular ones
    integer :: descriptor, limit
    logical :: is_closed, is_done, takes_pipes

    limit = largest_table
    if (present(most)) limit = most
    if (file == '') then
      call raise(error, exit_file, 'an empty text is not the name of a file')
      return
    end if
    takes_pipes = .false.
    if (present(may_be_pipe)) takes_pipes = may_be_pipe
    if (.not. takes_pipes) then
      if (is_irregular(file)) then
        call raise(error, exit_file, shown_path(file) // ': cannot be read: it is no regular file')
        return
      end if
    end if
    descriptor = open_existing(file, is_to_change=.false.)
    if (descriptor < 0) then
      call raise(error, exit_file, shown_path(file) // ': cannot be read: ' // reason_of_failure())
      return
    end if
    call read_whole(descriptor, limit, text, is_done)
    if (.not. is_done) then
      call raise(error, exit_file, shown_path(file) // ': cannot be read: ' // reason_of_failure())
    else if (len(text) > limit) then
      call raise(error, exit_file, shown_path(file) // ': cannot be read: it has more than ' // to_text(limit) // &
                 ' bytes, the most allowed')
      deallocate (text)
    end if
    call close_file(descriptor, is_closed)
  end subroutine read_text_file

  !> Why the last call of the operating system failed.
  function reason_of_failure() result(reason)
    character(len=:), allocatable :: reason
    integer, parameter :: no_entry = 2, no_folder = 20, loop_of_links = 40   ! ENOENT, ENOTDIR, ELOOP

    select case (failure_number())
    case (no_entry, no_folder)
      reason = 'there is no such file'
    case (loop_of_links)
      reason = 'it is a symbolic link that leads to itself'
    case default
      reason = last_failure()
    end select
  end function reason_of_failure

end module nocdyn_text_file
