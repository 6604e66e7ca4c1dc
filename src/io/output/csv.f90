!> Tables of comma-separated values: a header line, then rows of numbers that read back as the same values.
module nocdyn_csv
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_printable, only: as_utf_8
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: text_cell, write_header, write_row

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

  !> A name as a cell. A name that spreadsheets would take for a formula is a text with an apostrophe before it.
  pure function text_cell(name) result(cell)
    character(len=*), intent(in) :: name   !! without commas and quotes
    character(len=:), allocatable :: cell

    cell = as_utf_8(name)
    if (scan(name(:min(1, len(name))), '=+-@') > 0) cell = '"''' // cell // '"'
  end function text_cell

  !> Writes one row.
  subroutine write_row(file, values)
    type(output_file_t), intent(inout) :: file
    real(wp), intent(in) :: values(:)   !! [columns]

    call file%put_numbers(values(:1), '')
    call file%put_numbers(values(2:), ',')
    call file%put(new_line('a'))
  end subroutine write_row

end module nocdyn_csv
