!> Phrases of messages and reports: "2 gears", "a, b or c".
module nocdyn_text_phrases
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: counted, listed

contains

  !> "1 gear", "2 gears".
  pure function counted(number, singular, plural) result(text)
    integer, intent(in) :: number
    character(len=*), intent(in) :: singular, plural
    character(len=:), allocatable :: text

    text = to_text(number) // ' ' // plural
    if (number == 1) text = to_text(number) // ' ' // singular
  end function counted

  !> "a, b or c".
  pure function listed(texts, conjunction) result(text)
    type(string_t), intent(in) :: texts(:)        !! one at least
    character(len=*), intent(in) :: conjunction   !! ' or ', ' and '
    character(len=:), allocatable :: text
    integer :: i

    text = texts(1)%text
    do i = 2, size(texts)
      if (i < size(texts)) then
        text = text // ', ' // texts(i)%text
      else
        text = text // conjunction // texts(i)%text
      end if
    end do
  end function listed

end module nocdyn_text_phrases
