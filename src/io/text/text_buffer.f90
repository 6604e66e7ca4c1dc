!> A text to which characters are appended in amortised constant time.
module nocdyn_text_buffer
  use nocdyn_bytes, only: widen
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: number_width, write_number
  implicit none (type, external)
  private

  character(len=*), parameter :: line_end = new_line('a')

  type, public :: text_buffer_t
    private
    character(len=:), allocatable :: storage
    integer, public :: length = 0   !! of the text so far
  contains
    procedure :: append, append_line, append_number, clear
    procedure :: text => buffer_text
  end type text_buffer_t

contains

  !> Appends a text.
  subroutine append(self, text)
    class(text_buffer_t), intent(inout) :: self
    character(len=*), intent(in) :: text

    call widen(self%storage, self%length + len(text))
    self%storage(self%length + 1:self%length + len(text)) = text
    self%length = self%length + len(text)
  end subroutine append

  !> Appends a text and a line feed.
  subroutine append_line(self, text)
    class(text_buffer_t), intent(inout) :: self
    character(len=*), intent(in) :: text

    call self%append(text)
    call self%append(line_end)
  end subroutine append_line

  !> Appends the shortest decimal that reads back as a number.
  subroutine append_number(self, value)
    class(text_buffer_t), intent(inout) :: self
    real(wp), intent(in) :: value
    integer :: width

    call widen(self%storage, self%length + number_width)
    call write_number(value, self%storage(self%length + 1:), width)
    self%length = self%length + width
  end subroutine append_number

  !> Removes the text, and keeps the memory.
  subroutine clear(self)
    class(text_buffer_t), intent(inout) :: self

    self%length = 0
  end subroutine clear

  !> The text so far.
  pure function buffer_text(self) result(text)
    class(text_buffer_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = ''
    if (self%length > 0) text = self%storage(:self%length)
  end function buffer_text

end module nocdyn_text_buffer
