!> Files that appear whole or not at all: they are written under a hidden name and renamed at the end.
module nocdyn_hidden_file
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix, only: last_failure, make_folders, process_id, remove_file, rename_file
  use nocdyn_text, only: quoted, shown_path, to_text
  implicit none (type, external)
  private

  !> A file of any form. After the first failure, `complete` and `finish` report it.
  type, abstract, public :: hidden_file_t
    character(len=:), allocatable :: failure              !! the reason of the first one
    character(len=:), allocatable :: hidden_path          !! of the file until `finish`
    character(len=:), allocatable, private :: folder      !! with a slash at its end, or ''
  contains
    procedure :: place
    procedure :: keep_failure
    procedure(close_interface), deferred :: close
    procedure(close_interface), deferred :: close_whole
    procedure :: complete
    procedure :: finish
    procedure :: discard
  end type hidden_file_t

  abstract interface
    !> `close` closes the file if it is open; `close_whole` first brings what is still held to the disk. Both keep failures.
    subroutine close_interface(self)
      import :: hidden_file_t
      class(hidden_file_t), intent(inout) :: self
    end subroutine close_interface
  end interface

contains

  !> Chooses the hidden path of a new file in `folder`, which is made if it does not exist.
  subroutine place(self, folder, name)
    class(hidden_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: name     !! of the hidden file, without its dot and process number
    character(len=:), allocatable :: reason

    if (allocated(self%failure)) deallocate (self%failure)
    self%folder = folder // '/'
    if (folder == '.') self%folder = ''
    self%hidden_path = self%folder // '.' // name // '.' // to_text(process_id())
    call make_folders(folder, reason)
    if (allocated(reason)) call self%keep_failure('the folder cannot be made: ' // reason)
  end subroutine place

  !> Keeps the reason of the first failure.
  subroutine keep_failure(self, reason)
    class(hidden_file_t), intent(inout) :: self
    character(len=*), intent(in) :: reason

    if (.not. allocated(self%failure)) self%failure = reason
  end subroutine keep_failure

  !> Closes the file, which keeps its hidden name. After a failure since `place` there is an error and no file.
  subroutine complete(self, name, error)
    class(hidden_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name     !! of the finished file, for the message
    type(error_t), allocatable, intent(out) :: error

    call self%close_whole()
    if (allocated(self%failure)) call fail(self, name, error)
  end subroutine complete

  !> Closes the file if it is open, and renames it. After a failure since `place` there is an error and no file.
  subroutine finish(self, name, error)
    class(hidden_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    call self%complete(name, error)
    if (allocated(error)) return
    call rename_file(self%hidden_path, self%folder // name, is_done)
    if (is_done) return
    call self%keep_failure(last_failure())
    call fail(self, name, error)
  end subroutine finish

  !> Closes and removes the file.
  subroutine discard(self)
    class(hidden_file_t), intent(inout) :: self

    call self%close()
    call remove_file(self%hidden_path)
  end subroutine discard

  !> Removes the file and raises the error.
  subroutine fail(self, name, error)
    class(hidden_file_t), intent(in) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call remove_file(self%hidden_path)
    call raise(error, exit_file, 'cannot write ' // quoted(shown_path(self%folder // name)) // ': ' // self%failure)
  end subroutine fail

end module nocdyn_hidden_file
