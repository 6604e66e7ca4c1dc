!> Cells of the tables that are printed.
module nocdyn_table_text
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: cell, right, padded, text_width

  integer, parameter, public :: cell_width = 15    !! of a column
  integer, parameter, public :: cell_digits = 7    !! significant digits shown

contains

  !> A number, right-justified.
  function cell(value)
    real(wp), intent(in) :: value
    character(len=cell_width) :: cell

    cell = right(rounded_text(value, cell_digits))
  end function cell

  !> Text at the right end of a cell.
  pure function right(text) result(aligned)
    character(len=*), intent(in) :: text
    character(len=cell_width) :: aligned

    aligned = adjustr(repeat(' ', max(0, cell_width - len(text))) // text)
  end function right

  !> Text followed by blanks; bytes of a character beyond its first in UTF-8 take no room.
  pure function padded(text, length)
    character(len=*), intent(in) :: text
    integer, intent(in) :: length
    character(len=:), allocatable :: padded

    padded = text // repeat(' ', max(0, length - text_width(text)))
  end function padded

  !> Characters of a text in UTF-8.
  pure integer function text_width(text) result(width)
    character(len=*), intent(in) :: text
    integer :: i

    width = count([(iachar(text(i:i)) < 128 .or. iachar(text(i:i)) >= 192, i=1, len(text))])
  end function text_width

end module nocdyn_table_text
