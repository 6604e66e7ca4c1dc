!> Text files that appear whole or not at all: written aside, renamed at the end.
module nocdyn_output_file
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_posix, only: make_folders, process_id, remove_file, rename_file
  use nocdyn_text, only: quoted, to_text
  implicit none
  private

  public :: write_whole

  integer, parameter :: buffer_size = 65536

  !> The first failure is kept and told by `finish`; until then `has_failed` answers.
  type, public :: output_file_t
    logical :: has_failed = .false.
    character(len=:), allocatable, private :: folder, aside
    character(len=:), allocatable, private :: reason
    character(len=:), allocatable, private :: buffer
    integer, private :: used = 0
    integer, private :: unit = 0
  contains
    procedure :: open => open_aside
    procedure :: put
    procedure :: finish
    procedure :: discard
    procedure, private :: flush_buffer
    procedure, private :: note
  end type output_file_t

contains

  !> A file with this text, whole or not at all.
  subroutine write_whole(folder, name, text, error)
    character(len=*), intent(in) :: folder, name, text
    type(error_t), allocatable, intent(out) :: error
    type(output_file_t) :: file

    call file%open(folder, name)
    call file%put(text)
    call file%finish(name, error)
  end subroutine write_whole

  !> Opens a hidden file in `folder`, which is made if need be.
  subroutine open_aside(self, folder, name)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: name     !! of the hidden file, without its dot and process number
    character(len=200) :: message
    integer :: status

    self%folder = folder
    self%aside = folder // '/.' // name // '.' // to_text(process_id())
    if (.not. allocated(self%buffer)) allocate (character(len=buffer_size) :: self%buffer)
    self%used = 0
    self%has_failed = .false.
    call make_folders(folder)
    open (newunit=self%unit, file=self%aside, access='stream', form='unformatted', action='write', status='replace', &
          iostat=status, iomsg=message)
    call self%note(status, message)
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
    character(len=200) :: message
    integer :: status

    if (.not. self%has_failed) then
      write (self%unit, iostat=status, iomsg=message) self%buffer(:self%used)
      call self%note(status, message)
    end if
    self%used = 0
  end subroutine flush_buffer

  !> Closes the file and gives it its name; if anything failed since `open` there is no file and an error.
  subroutine finish(self, name, error)
    class(output_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    character(len=200) :: message
    integer :: status
    logical :: is_done

    call self%flush_buffer()
    if (.not. self%has_failed) then
      flush (self%unit, iostat=status, iomsg=message)
      call self%note(status, message)
    end if
    close (self%unit, iostat=status, iomsg=message)
    call self%note(status, message)
    if (.not. self%has_failed) then
      call rename_file(self%aside, self%folder // '/' // name, is_done)
      call self%note(merge(0, 1, is_done), 'it cannot take its name')
    end if
    if (.not. self%has_failed) return
    call remove_file(self%aside)
    call raise(error, exit_file, 'cannot write ' // quoted(self%folder // '/' // name) // ': ' // self%reason)
  end subroutine finish

  !> Leaves no file.
  subroutine discard(self)
    class(output_file_t), intent(inout) :: self
    integer :: status

    close (self%unit, iostat=status)
    call remove_file(self%aside)
  end subroutine discard

  subroutine note(self, status, message)
    class(output_file_t), intent(inout) :: self
    integer, intent(in) :: status
    character(len=*), intent(in) :: message

    if (status == 0 .or. self%has_failed) return
    self%has_failed = .true.
    self%reason = trim(message)
  end subroutine note

end module nocdyn_output_file
