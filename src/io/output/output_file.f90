!> Text files that appear whole or not at all.
module nocdyn_output_file
  use nocdyn_errors, only: error_t
  use nocdyn_hidden_file, only: hidden_file_t
  use nocdyn_kinds, only: wp
  use nocdyn_posix, only: close_file, create_file, last_failure, write_bytes
  use nocdyn_text, only: number_width, write_number
  implicit none (type, external)
  private

  public :: write_file

  integer, parameter :: buffer_size = 65536

  !> A file that is being written through a buffer.
  type, extends(hidden_file_t), public :: output_file_t
    character(len=:), allocatable, private :: buffer
    integer, private :: used = 0                            !! bytes of the buffer
    integer, private :: descriptor = -1                     !! -1 if the file is not open
  contains
    procedure :: open => open_hidden
    procedure :: put, put_numbers
    procedure :: close => close_hidden
    procedure :: close_whole
    procedure, private :: flush_buffer
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

    if (.not. allocated(self%buffer)) allocate (character(len=buffer_size) :: self%buffer)
    self%used = 0
    self%descriptor = -1
    call self%place(folder, name)
    if (allocated(self%failure)) return
    self%descriptor = create_file(self%hidden_path)
    if (self%descriptor < 0) call self%keep_failure(last_failure())
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

  !> Writes numbers that read back as the same values, with a text before each.
  subroutine put_numbers(self, values, separator)
    class(output_file_t), intent(inout) :: self
    real(wp), intent(in) :: values(:)
    character(len=*), intent(in) :: separator   !! at most `number_width` characters
    integer :: i, length

    do i = 1, size(values)
      if (self%used + 2 * number_width > buffer_size) call self%flush_buffer()
      if (len(separator) > 0) self%buffer(self%used + 1:self%used + len(separator)) = separator
      self%used = self%used + len(separator)
      call write_number(values(i), self%buffer(self%used + 1:), length)
      self%used = self%used + length
    end do
  end subroutine put_numbers

  subroutine flush_buffer(self)
    class(output_file_t), intent(inout) :: self
    logical :: is_done

    if (.not. allocated(self%failure) .and. self%used > 0) then
      call write_bytes(self%descriptor, self%buffer(:self%used), is_done)
      if (.not. is_done) call self%keep_failure(last_failure())
    end if
    self%used = 0
  end subroutine flush_buffer

  !> Writes the buffer and closes the file.
  subroutine close_whole(self)
    class(output_file_t), intent(inout) :: self

    call self%flush_buffer()
    call self%close()
  end subroutine close_whole

  subroutine close_hidden(self)
    class(output_file_t), intent(inout) :: self
    logical :: is_done

    if (self%descriptor < 0) return
    call close_file(self%descriptor, is_done)
    if (.not. is_done) call self%keep_failure(last_failure())
    self%descriptor = -1
  end subroutine close_hidden

end module nocdyn_output_file
