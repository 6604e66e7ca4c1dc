!> Tables of comma-separated values: a header line, then rows of numbers that read back as the same values.
module nocdyn_csv
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_printable, only: as_utf_8
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: put_known, text_cell, write_header, write_row

contains

  !> Writes the header line.
  subroutine write_header(file, labels)
    type(output_file_t), intent(inout) :: file
    type(string_t), intent(in) :: labels(:)   !! without commas and quotes
    integer :: i

    do i = 1, size(labels)
      if (i > 1) call file%put(',')
      call file%put(as_utf_8(labels(i)%text))
    end do
    call file%put(new_line('a'))
  end subroutine write_header

  !> A text as a cell, in quotes if it has commas or quotes. A text that spreadsheets would take for a formula has an apostrophe
  !> before it.
  pure function text_cell(text) result(cell)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: cell
    integer :: i

    cell = as_utf_8(text)
    if (scan(text(:min(1, len(text))), '=+-@') > 0) cell = "'" // cell
    if (scan(text, ',"') + len(cell) - len(as_utf_8(text)) == 0) return
    do i = len(cell), 1, -1
      if (cell(i:i) == '"') cell = cell(:i) // cell(i:)
    end do
    cell = '"' // cell // '"'
  end function text_cell

  !> Writes one row.
  subroutine write_row(file, values)
    type(output_file_t), intent(inout) :: file
    real(wp), intent(in) :: values(:)   !! [columns]

    call file%put_numbers(values(:1), '')
    call file%put_numbers(values(2:), ',')
    call file%put(new_line('a'))
  end subroutine write_row

  !> Writes cells after others; those of numbers that are not known are empty.
  subroutine put_known(file, values)
    type(output_file_t), intent(inout) :: file
    real(wp), intent(in) :: values(:)   !! not a number where none is known
    integer :: first, last

    first = 1
    do while (first <= size(values))
      if (ieee_is_nan(values(first))) then
        call file%put(',')
        first = first + 1
        cycle
      end if
      last = first
      do while (last < size(values))
        if (ieee_is_nan(values(last + 1))) exit
        last = last + 1
      end do
      call file%put_numbers(values(first:last), ',')
      first = last + 1
    end do
  end subroutine put_known

end module nocdyn_csv
