!> Tables as they are printed: labels on the left, numbers in right-justified cells.
module nocdyn_table_text
  use nocdyn_kinds, only: wp
  use nocdyn_output_units, only: unit_of
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: append_table, cell, clear_rounding, padded, right, text_width

  integer, parameter, public :: cell_width = 15    !! of a column
  integer, parameter, public :: cell_digits = 7    !! significant digits of a number

  integer, parameter :: max_rows = 60   ! of a table; the rest is in the files only

  !> Numbers below these shares count as zero in print: of the largest one of their unit, and of the largest one of their row.
  real(wp), parameter, public :: rounding = 16 * epsilon(1.0_wp)
  real(wp), parameter :: invisible = 1.0e-9_wp

  !> A number or a text at the right end of a cell.
  interface cell
    module procedure number_cell
    module procedure text_cell
  end interface cell

contains

  !> Appends a line of headings, if there is any heading, and a line for every row.
  subroutine append_table(report, labels, values, headings, indent, rest, width, marks)
    type(text_buffer_t), intent(inout) :: report
    type(string_t), intent(in) :: labels(:)          !! of the rows
    real(wp), intent(in) :: values(:, :)             !! [rows, columns]
    character(len=*), intent(in) :: headings(0:)     !! of the labels, and of the columns if these have any
    integer, intent(in) :: indent                    !! blanks before every line
    character(len=*), intent(in) :: rest             !! what and where the other rows of a long table are, e.g. 'more in x.json'
    integer, intent(out), optional :: width          !! of the labels
    logical, intent(in), optional :: marks(:, :)     !! whether an asterisk follows a number, [rows, columns]
    character(len=:), allocatable :: line
    integer :: i, k, label_width, rows
    integer :: widths(size(values, 2))
    logical :: is_marked(size(labels), size(values, 2))

    rows = min(size(labels), max_rows)
    label_width = maxval([len_trim(headings(0)), (text_width(labels(i)%text), i=1, rows)])
    if (present(width)) width = label_width
    widths = cell_width
    is_marked = .false.
    if (present(marks)) is_marked = marks
    line = padded(trim(headings(0)), label_width)
    do k = 1, ubound(headings, 1)
      widths(k) = max(cell_width, len_trim(headings(k)) + 2)
      line = line // repeat(' ', widths(k) - len_trim(headings(k))) // trim(headings(k)) // &
             repeat(' ', mark_width(is_marked(:, k)))
    end do
    if (line /= '') call report%append_line(repeat(' ', indent) // trim(line))
    do i = 1, rows
      line = repeat(' ', indent) // padded(labels(i)%text, label_width)
      do k = 1, size(values, 2)
        line = line // repeat(' ', widths(k) - cell_width) // cell(values(i, k)) // &
               repeat(merge('*', ' ', is_marked(i, k)), mark_width(is_marked(:, k)))
      end do
      call report%append_line(trim(line))
    end do
    if (rows < size(labels)) then
      call report%append_line(repeat(' ', indent) // '(' // to_text(size(labels) - rows) // ' ' // rest // ')')
    end if
  end subroutine append_table

  pure integer function mark_width(is_marked)
    logical, intent(in) :: is_marked(:)   !! [rows]

    mark_width = merge(1, 0, any(is_marked))
  end function mark_width

  !> Sets numbers to zero that only rounding or the error of the integration keeps from it.
  pure subroutine clear_rounding(labels, values)
    type(string_t), intent(in) :: labels(:)      !! of the rows, with their units
    real(wp), intent(inout) :: values(:, :)      !! [rows, columns]
    real(wp) :: largest, sizes(size(labels))     ! number of the unit, of the row
    logical :: is_left(size(labels)), is_of_unit(size(labels))
    integer :: i, first

    sizes = maxval(abs(values), dim=2)
    is_left = .true.
    do while (any(is_left))
      first = findloc(is_left, .true., dim=1)
      is_of_unit = is_left .and. [(unit_of(labels(i)%text) == unit_of(labels(first)%text), i=1, size(labels))]
      largest = maxval(sizes, mask=is_of_unit)
      do i = 1, size(labels)
        if (.not. is_of_unit(i)) cycle
        where (abs(values(i, :)) <= max(invisible * sizes(i), rounding * largest)) values(i, :) = 0.0_wp
      end do
      is_left = is_left .and. .not. is_of_unit
    end do
  end subroutine clear_rounding

  function number_cell(value) result(text)
    real(wp), intent(in) :: value
    character(len=cell_width) :: text
    integer, parameter :: all_digits = 10   ! of whole numbers, e.g. the one of a variant

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

  !> Text after blanks.
  pure function right(text, width)
    character(len=*), intent(in) :: text
    integer, intent(in) :: width   !! characters of the result, at least
    character(len=:), allocatable :: right

    right = repeat(' ', max(0, width - text_width(text))) // text
  end function right

  !> The number of characters of a text in UTF-8.
  pure integer function text_width(text) result(width)
    character(len=*), intent(in) :: text
    integer :: i

    width = count([(iachar(text(i:i)) < 128 .or. iachar(text(i:i)) >= 192, i=1, len(text))])
  end function text_width

end module nocdyn_table_text
