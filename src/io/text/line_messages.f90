!> Messages on the lines of a file.
module nocdyn_line_messages
  use nocdyn_text, only: append, shown_path, string_t, to_text
  implicit none (type, external)
  private

  integer, parameter :: most_messages = 5   ! a file of another format has as many errors as lines

  !> Messages on the lines of a file: the first ones, and how many more there are.
  type, public :: line_messages_t
    character(len=:), allocatable :: file        !! its name in messages
    integer :: errors = 0                        !! number of wrong lines
    type(string_t), allocatable :: messages(:)   !! at most `most_messages`, and the number of the others
  contains
    procedure :: add => add_message
    procedure :: close => close_messages
  end type line_messages_t

contains

  !> Counts a message on a line; the first ones are kept.
  subroutine add_message(self, line, text)
    class(line_messages_t), intent(inout) :: self
    integer, intent(in) :: line            !! its number, 0 for the file as a whole
    character(len=*), intent(in) :: text

    if (.not. allocated(self%messages)) allocate (self%messages(0))
    self%errors = self%errors + 1
    if (self%errors > most_messages) return
    if (line > 0) then
      call append(self%messages, shown_path(self%file) // ':' // to_text(line) // ': ' // text)
    else
      call append(self%messages, shown_path(self%file) // ': ' // text)
    end if
  end subroutine add_message

  !> The messages, with the number of those that are not kept; of a file that is not a text only this.
  subroutine close_messages(self, messages)
    class(line_messages_t), intent(inout) :: self
    type(string_t), allocatable, intent(out) :: messages(:)

    if (.not. allocated(self%messages)) allocate (self%messages(0))
    if (self%errors > most_messages) call append(self%messages, shown_path(self%file) // ': ' // &
                                                 to_text(self%errors - most_messages) // ' more lines are wrong')
    call move_alloc(self%messages, messages)
  end subroutine close_messages

end module nocdyn_line_messages
