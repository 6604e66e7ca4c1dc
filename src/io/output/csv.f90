!> Tables of comma-separated values: a header line, then rows of numbers that read back as the same values.
module nocdyn_csv
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: number_width, string_t, write_number
  implicit none (type, external)
  private

  public :: write_header, write_row

contains

  !> Writes the header line.
  subroutine write_header(file, labels)
    type(output_file_t), intent(inout) :: file
    type(string_t), intent(in) :: labels(:)   !! without commas and quotes
    integer :: i

    do i = 1, size(labels)
      if (i > 1) call file%put(',')
      call file%put(labels(i)%text)
    end do
    call file%put(new_line('a'))
  end subroutine write_header

  !> Writes one row.
  subroutine write_row(file, values)
    type(output_file_t), intent(inout) :: file
    real(wp), intent(in) :: values(:)   !! [columns]
    character(len=number_width) :: number
    integer :: i, length

    do i = 1, size(values)
      if (i > 1) call file%put(',')
      call write_number(values(i), number, length)
      call file%put(number(:length))
    end do
    call file%put(new_line('a'))
  end subroutine write_row

end module nocdyn_csv
