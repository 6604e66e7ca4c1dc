!> The mistakes of an input in sentences, each with its place.
module nocdyn_diagnostics_text
  use nocdyn_input, only: input_t
  use nocdyn_diagnostics, only: diagnostic_t, diagnostics_t, no_line
  use nocdyn_text, only: to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: diagnostics_text

contains

  !> One line for each mistake.
  function diagnostics_text(input, diagnostics) result(text)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(in) :: diagnostics
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer, allocatable :: order(:)
    integer :: i

    call diagnostics%sort_by_line(order)
    do i = 1, size(order)
      if (i > 1) call buffer%append(new_line('a'))
      call buffer%append(sentence(input, diagnostics%list(order(i))))
    end do
    text = buffer%text()
  end function diagnostics_text

  function sentence(input, diagnostic) result(text)
    type(input_t), intent(in) :: input
    type(diagnostic_t), intent(in) :: diagnostic
    character(len=:), allocatable :: text

    if (diagnostic%override > 0) then
      text = '--set ' // input%overrides(diagnostic%override)%text
    else
      text = input%file
      if (diagnostic%line > 0 .and. diagnostic%line < no_line) text = text // ':' // to_text(diagnostic%line)
      if (diagnostic%group > 0) text = text // ': ' // input%label(diagnostic%group)
    end if
    text = text // ': ' // diagnostic%text
  end function sentence

end module nocdyn_diagnostics_text
