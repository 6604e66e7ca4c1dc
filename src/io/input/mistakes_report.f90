!> The mistakes of an input in sentences, each with its place.
module nocdyn_mistakes_report
  use nocdyn_input, only: input_t
  use nocdyn_mistakes, only: mistake_t, mistakes_t, no_line
  use nocdyn_text, only: to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: mistakes_report

contains

  !> One line for each mistake.
  function mistakes_report(input, mistakes) result(text)
    type(input_t), intent(in) :: input
    type(mistakes_t), intent(in) :: mistakes
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer, allocatable :: order(:)
    integer :: i

    call mistakes%find_order_by_line(order)
    do i = 1, size(order)
      if (i > 1) call buffer%append(new_line('a'))
      call buffer%append(sentence(input, mistakes%list(order(i))))
    end do
    text = buffer%text()
  end function mistakes_report

  function sentence(input, mistake) result(text)
    type(input_t), intent(in) :: input
    type(mistake_t), intent(in) :: mistake
    character(len=:), allocatable :: text

    if (mistake%override > 0) then
      text = '--set ' // input%overrides(mistake%override)%text
    else
      text = input%file
      if (mistake%line > 0 .and. mistake%line < no_line) text = text // ':' // to_text(mistake%line)
      if (mistake%group > 0) text = text // ': ' // input%label(mistake%group)
    end if
    text = text // ': ' // mistake%text
  end function sentence

end module nocdyn_mistakes_report
