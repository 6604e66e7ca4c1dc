!> Tables as they are printed: labels on the left, numbers in right-justified cells.
module nocdyn_table_text
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: append_table, cell, padded, text_width

  integer, parameter, public :: cell_width = 15    !! of a column
  integer, parameter, public :: cell_digits = 7    !! significant digits of a number

  integer, parameter :: max_rows = 60   ! of a table; the rest is in the files only

  !> A number or a text at the right end of a cell.
  interface cell
    module procedure number_cell
    module procedure text_cell
  end interface cell

contains

  !> Appends a line of headings, if there is any heading, and a line for every row.
  subroutine append_table(report, labels, values, heading, headings, indent, rest, width)
    type(text_buffer_t), intent(inout) :: report
    type(string_t), intent(in) :: labels(:)          !! of the rows
    real(wp), intent(in) :: values(:, :)             !! [rows, columns]
    character(len=*), intent(in) :: heading          !! of the labels
    character(len=*), intent(in) :: headings(:)      !! of the columns, [columns] or none
    integer, intent(in) :: indent                    !! blanks before every line
    character(len=*), intent(in) :: rest             !! what and where the other rows of a long table are, e.g. 'more in x.json'
    integer, intent(out), optional :: width          !! of the labels
    character(len=:), allocatable :: line
    integer :: i, k, label_width, rows
    integer :: widths(size(values, 2))

    rows = min(size(labels), max_rows)
    label_width = maxval([len(heading), (text_width(labels(i)%text), i=1, rows)])
    if (present(width)) width = label_width
    widths = cell_width
    line = padded(heading, label_width)
    do k = 1, size(headings)
      widths(k) = max(cell_width, len_trim(headings(k)) + 2)
      line = line // repeat(' ', widths(k) - len_trim(headings(k))) // trim(headings(k))
    end do
    if (line /= '') call report%append_line(repeat(' ', indent) // trim(line))
    do i = 1, rows
      line = repeat(' ', indent) // padded(labels(i)%text, label_width)
      do k = 1, size(values, 2)
        line = line // repeat(' ', widths(k) - cell_width) // cell(values(i, k))
      end do
      call report%append_line(line)
    end do
    if (rows < size(labels)) then
      call report%append_line(repeat(' ', indent) // '(' // to_text(size(labels) - rows) // ' ' // rest // ')')
    end if
  end subroutine append_table

  function number_cell(value) result(text)
    real(wp), intent(in) :: value
    character(len=cell_width) :: text
    integer, parameter :: all_digits = 10   ! of whole numbers, e.g. that of a variant

    text = text_cell(rounded_text(value, merge(all_digits, cell_digits, abs(value - anint(value)) <= 0)))
  end function number_cell

  pure function text_cell(value) result(text)
    character(len=*), intent(in) :: value
    character(len=cell_width) :: text

    text = adjustr(repeat(' ', max(0, cell_width - len(value))) // value)
  end function text_cell

  !> Text followed by blanks; the bytes of a character in UTF-8 count as one.
  pure function padded(text, length)
    character(len=*), intent(in) :: text
    integer, intent(in) :: length   !! characters of the result, at least
    character(len=:), allocatable :: padded

    padded = text // repeat(' ', max(0, length - text_width(text)))
  end function padded

  !> The number of characters of a text in UTF-8.
  pure integer function text_width(text) result(width)
    character(len=*), intent(in) :: text
    integer :: i

    width = count([(iachar(text(i:i)) < 128 .or. iachar(text(i:i)) >= 192, i=1, len(text))])
  end function text_width

end module nocdyn_table_text
