!> Stores a sweep of sample variants, whose results need no integration. Command line: sweep_store FOLDER VARIANTS CHUNK. It
!> resumes or creates the journal in FOLDER and appends the missing variants in chunks of CHUNK; then it writes sweep.nc and
!> sweep.csv, prints the order statistics of each result on a line and removes the journal. Exit codes and
!> messages are those of the errors.
program sweep_store
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use nocdyn_errors, only: error_t
  use nocdyn_order_statistics, only: find_order_statistics, order_statistics_t
  use nocdyn_number_ranges, only: range_t
  use nocdyn_posix, only: ignore_file_size_signal
  use nocdyn_sweep_netcdf, only: write_sweep_netcdf
  use nocdyn_sweep_journal, only: create_journal, journal_name, missing_variants, open_journal, sweep_journal_t
  use nocdyn_sweep_csv, only: write_sweep_csv
  use nocdyn_text, only: to_text
  use sample_sweeps, only: header_of, sample_chunk
  implicit none (type, external)

  character(len=1000) :: folder
  type(sweep_journal_t) :: journals(1)
  type(error_t), allocatable :: error
  integer :: variants, chunk

  call ignore_file_size_signal()
  call get_command_argument(1, folder)
  variants = number(2)
  chunk = number(3)
  call begin()
  call compute()
  call write_sweep_netcdf(trim(folder), journals, error)
  call stop_on(error)
  call write_sweep_csv(trim(folder), journals, error)
  call stop_on(error)
  call print_statistics()
  call journals(1)%file%remove()

contains

  integer function number(position)
    integer, intent(in) :: position
    character(len=20) :: word

    call get_command_argument(position, word)
    read (word, *) number
  end function number

  subroutine stop_on(error)
    type(error_t), allocatable, intent(in) :: error

    if (.not. allocated(error)) return
    write (error_unit, '(a)') error%message
    stop error%code, quiet=.true.
  end subroutine stop_on

  subroutine begin()
    type(error_t), allocatable :: error
    logical :: exists

    inquire (file=trim(folder) // '/' // journal_name(1, 1), exist=exists)
    if (exists) then
      call open_journal(trim(folder), journal_name(1, 1), journals(1), error)
    else
      call create_journal(trim(folder), journal_name(1, 1), header_of(1, variants, variants), journals(1), error)
    end if
    call stop_on(error)
    write (output_unit, '(a)') 'found ' // to_text(journals(1)%done + journals(1)%refused + journals(1)%failed)
    flush (output_unit)
  end subroutine begin

  !> Appends the variants that the journal lacks.
  subroutine compute()
    type(error_t), allocatable :: error
    type(range_t), allocatable :: missing(:)
    integer :: i, next, part

    call missing_variants(journals, journals(1)%header, missing)
    do i = 1, size(missing)
      next = missing(i)%first
      do while (next <= missing(i)%last)
        part = min(chunk, missing(i)%last - next + 1)
        call journals(1)%append(sample_chunk(next, part), error)
        call stop_on(error)
        next = next + part
      end do
    end do
  end subroutine compute

  subroutine print_statistics()
    type(order_statistics_t), allocatable :: statistics(:)
    type(error_t), allocatable :: error
    integer :: i

    call find_order_statistics(journals, statistics, error)
    call stop_on(error)
    do i = 1, size(statistics)
      associate (s => statistics(i))
        write (output_unit, '(a)') to_text(s%minimum) // ' ' // to_text(s%low) // ' ' // to_text(s%median) // ' ' // &
          to_text(s%high) // ' ' // to_text(s%maximum) // ' ' // to_text(s%variant_of_minimum) // ' ' // &
          to_text(s%variant_of_maximum)
      end associate
    end do
  end subroutine print_statistics

end program sweep_store
