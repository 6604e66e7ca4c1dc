!> A text to which characters are appended in amortised constant time.
module nocdyn_text_buffer
  use nocdyn_bytes, only: widen
  implicit none (type, external)
  private

  character(len=*), parameter :: line_end = new_line('a')

  type, public :: text_buffer_t
    private
    character(len=:), allocatable :: storage
    integer :: length = 0
  contains
    procedure :: append, append_line
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

  !> The text so far.
  pure function buffer_text(self) result(text)
    class(text_buffer_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = ''
    if (self%length > 0) text = self%storage(:self%length)
  end function buffer_text

end module nocdyn_text_buffer
