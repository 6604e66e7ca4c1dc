!> Text files that appear whole or not at all: written aside, renamed at the end.
module nocdyn_output_file
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix, only: close_file, create_file, last_failure, make_folders, process_id, remove_file, rename_file, write_bytes
  use nocdyn_text, only: quoted, shortened, to_text
  implicit none (type, external)
  private

  public :: write_file

  integer, parameter :: buffer_size = 65536
  integer, parameter :: longest_shown = 400   !! bytes of a path in a message

  !> The first failure is kept and told by `finish`; until then `has_failed` answers.
  type, public :: output_file_t
    logical :: has_failed = .false.
    character(len=:), allocatable, private :: folder   !! with its last slash
    character(len=:), allocatable, private :: aside
    character(len=:), allocatable, private :: reason
    character(len=:), allocatable, private :: buffer
    integer, private :: used = 0
    integer, private :: descriptor = -1
  contains
    procedure :: open => open_aside
    procedure :: put
    procedure :: complete
    procedure :: finish
    procedure :: discard
    procedure, private :: flush_buffer
    procedure, private :: close => close_aside
    procedure, private :: note
    procedure, private :: fail
  end type output_file_t

contains

  !> A file with this text, whole or not at all.
  subroutine write_file(folder, name, text, error)
    character(len=*), intent(in) :: folder, name, text
    type(error_t), allocatable, intent(out) :: error
    type(output_file_t) :: file

    call file%open(folder, name)
    call file%put(text)
    call file%finish(name, error)
  end subroutine write_file

  !> Opens a hidden file in `folder`, which is made if need be.
  subroutine open_aside(self, folder, name)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: name     !! of the hidden file, without its dot and process number
    character(len=:), allocatable :: failure

    self%folder = folder // '/'
    if (folder == '.') self%folder = ''
    self%aside = self%folder // '.' // name // '.' // to_text(process_id())
    if (.not. allocated(self%buffer)) allocate (character(len=buffer_size) :: self%buffer)
    self%used = 0
    self%has_failed = .false.
    self%descriptor = -1
    call make_folders(folder, failure)
    if (allocated(failure)) then
      call self%note('the folder cannot be made: ' // failure)
      return
    end if
    self%descriptor = create_file(self%aside)
    if (self%descriptor < 0) call self%note(last_failure())
  end subroutine open_aside

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
      if (.not. is_done) call self%note(last_failure())
    end if
    self%used = 0
  end subroutine flush_buffer

  !> Closes the file, which keeps its hidden name; if anything failed since `open` there is no file and an error.
  subroutine complete(self, name, error)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name     !! that the file is to have, for the message
    type(error_t), allocatable, intent(out) :: error

    call self%flush_buffer()
    call self%close()
    if (self%has_failed) call self%fail(name, error)
  end subroutine complete

  !> Closes the file if that is still to be done and gives it its name, as safely as `complete`.
  subroutine finish(self, name, error)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    call self%complete(name, error)
    if (allocated(error)) return
    call rename_file(self%aside, self%folder // name, is_done)
    if (is_done) return
    call self%note(last_failure())
    call self%fail(name, error)
  end subroutine finish

  !> Leaves no file.
  subroutine discard(self)
    class(output_file_t), intent(inout) :: self

    call self%close()
    call remove_file(self%aside)
  end subroutine discard

  subroutine close_aside(self)
    class(output_file_t), intent(inout) :: self
    logical :: is_done

    if (self%descriptor < 0) return
    call close_file(self%descriptor, is_done)
    if (.not. is_done) call self%note(last_failure())
    self%descriptor = -1
  end subroutine close_aside

  subroutine fail(self, name, error)
    class(output_file_t), intent(in) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call remove_file(self%aside)
    call raise(error, exit_file, 'cannot write ' // quoted(shortened(self%folder // name, longest_shown)) // ': ' // self%reason)
  end subroutine fail

  !> Keeps the reason of the first failure.
  subroutine note(self, reason)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: reason

    if (self%has_failed) return
    self%has_failed = .true.
    self%reason = reason
  end subroutine note

end module nocdyn_output_file
