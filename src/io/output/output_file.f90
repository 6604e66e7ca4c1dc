!> Text files that appear whole or not at all: they are written under a hidden name and renamed at the end.
module nocdyn_output_file
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix, only: close_file, create_file, last_failure, make_folders, process_id, remove_file, rename_file, write_bytes
  use nocdyn_text, only: quoted, shown_path, to_text
  implicit none (type, external)
  private

  public :: write_file

  integer, parameter :: buffer_size = 65536

  !> A file that is being written. The first failure sets `has_failed`; `complete` and `finish` report it.
  type, public :: output_file_t
    logical :: has_failed = .false.
    character(len=:), allocatable, private :: folder        !! with a slash at its end, or ''
    character(len=:), allocatable, private :: hidden_path   !! of the file until `finish`
    character(len=:), allocatable, private :: reason        !! of the first failure
    character(len=:), allocatable, private :: buffer
    integer, private :: used = 0                            !! bytes of the buffer
    integer, private :: descriptor = -1                     !! -1 if the file is not open
  contains
    procedure :: open => open_hidden
    procedure :: put, complete, finish, discard
    procedure, private :: close => close_hidden
    procedure, private :: flush_buffer, keep_reason, fail
  end type output_file_t

contains

  !> Writes a file with a text.
  subroutine write_file(folder, name, text, error)
    character(len=*), intent(in) :: folder, name, text   !! `name` of the file in the folder
    type(error_t), allocatable, intent(out) :: error     !! there is no file
    type(output_file_t) :: file

    call file%open(folder, name)
    call file%put(text)
    call file%finish(name, error)
  end subroutine write_file

  !> Opens a hidden file in `folder`, which is made if it does not exist.
  subroutine open_hidden(self, folder, name)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: name     !! of the hidden file, without its dot and process number
    character(len=:), allocatable :: failure

    self%folder = folder // '/'
    if (folder == '.') self%folder = ''
    self%hidden_path = self%folder // '.' // name // '.' // to_text(process_id())
    if (.not. allocated(self%buffer)) allocate (character(len=buffer_size) :: self%buffer)
    self%used = 0
    self%has_failed = .false.
    self%descriptor = -1
    call make_folders(folder, failure)
    if (allocated(failure)) then
      call self%keep_reason('the folder cannot be made: ' // failure)
      return
    end if
    self%descriptor = create_file(self%hidden_path)
    if (self%descriptor < 0) call self%keep_reason(last_failure())
  end subroutine open_hidden

  !> Writes a text.
  subroutine put(self, text)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: text
    integer :: done, part

    done = 0
    do while (done < len(text))
      part = min(len(text) - done, buffer_size - self%used)
      self%buffer(self%used + 1:self%used + part) = text(done + 1:done + part)
      self%used = self%used + part
      done = done + part
      if (self%used == buffer_size) call self%flush_buffer()
    end do
  end subroutine put

  subroutine flush_buffer(self)
    class(output_file_t), intent(inout) :: self
    logical :: is_done

    if (.not. self%has_failed .and. self%used > 0) then
      call write_bytes(self%descriptor, self%buffer(:self%used), is_done)
      if (.not. is_done) call self%keep_reason(last_failure())
    end if
    self%used = 0
  end subroutine flush_buffer

  !> Closes the file, which keeps its hidden name. After a failure since `open` there is an error and no file.
  subroutine complete(self, name, error)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name     !! of the finished file, for the message
    type(error_t), allocatable, intent(out) :: error

    call self%flush_buffer()
    call self%close()
    if (self%has_failed) call self%fail(name, error)
  end subroutine complete

  !> Closes the file if it is open, and renames it. After a failure since `open` there is an error and no file.
  subroutine finish(self, name, error)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    call self%complete(name, error)
    if (allocated(error)) return
    call rename_file(self%hidden_path, self%folder // name, is_done)
    if (is_done) return
    call self%keep_reason(last_failure())
    call self%fail(name, error)
  end subroutine finish

  !> Closes and removes the file.
  subroutine discard(self)
    class(output_file_t), intent(inout) :: self

    call self%close()
    call remove_file(self%hidden_path)
  end subroutine discard

  subroutine close_hidden(self)
    class(output_file_t), intent(inout) :: self
    logical :: is_done

    if (self%descriptor < 0) return
    call close_file(self%descriptor, is_done)
    if (.not. is_done) call self%keep_reason(last_failure())
    self%descriptor = -1
  end subroutine close_hidden

  !> Removes the file and raises the error.
  subroutine fail(self, name, error)
    class(output_file_t), intent(in) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call remove_file(self%hidden_path)
    call raise(error, exit_file, 'cannot write ' // quoted(shown_path(self%folder // name)) // ': ' // self%reason)
  end subroutine fail

  !> Keeps the reason of the first failure.
  subroutine keep_reason(self, reason)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: reason

    if (self%has_failed) return
    self%has_failed = .true.
    self%reason = reason
  end subroutine keep_reason

end module nocdyn_output_file
