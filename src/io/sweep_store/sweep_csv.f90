!> The file sweep.csv: the numbers of sweep.nc as text.
module nocdyn_sweep_csv
  use nocdyn_csv, only: put_known, write_header
  use nocdyn_errors, only: error_t
  use nocdyn_journal_chunks, only: check_sweep, chunk_cursor_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_sweep_chunk, only: chunk_t, status_done, status_words
  use nocdyn_sweep_header, only: stored_quantity_t, sweep_header_t
  use nocdyn_sweep_journal, only: sweep_journal_t
  use nocdyn_printable, only: in_quotes
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: write_sweep_csv

  character(len=*), parameter, public :: sweep_csv_name = 'sweep.csv'

contains

  !> Writes sweep.csv of a whole sweep into `folder`: one row per variant. A variant that is not done has no results.
  subroutine write_sweep_csv(folder, journals, error)
    character(len=*), intent(in) :: folder
    type(sweep_journal_t), intent(inout) :: journals(:)   !! of all shards
    type(error_t), allocatable, intent(out) :: error
    type(output_file_t) :: file
    type(chunk_cursor_t) :: cursor
    type(chunk_t) :: chunk
    integer :: i
    logical :: is_done, is_there

    call check_sweep(journals, error)
    if (allocated(error)) return
    call file%open(folder, sweep_csv_name)
    call write_header(file, column_labels(journals(1)%header))
    call cursor%rewind_to_start(journals)
    do
      call cursor%next_chunk(journals, chunk, is_there, error)
      if (allocated(error) .or. allocated(file%failure) .or. .not. is_there) exit
      do i = 1, chunk%count
        is_done = chunk%status(i) == status_done
        call file%put(to_text(chunk%first - 1 + i))
        call file%put_numbers(chunk%parameters(:, i), ',')
        if (is_done) then
          call put_known(file, chunk%results(:, i))
        else
          call file%put(repeat(',', size(chunk%results, 1)))
        end if
        call file%put(',' // trim(status_words(chunk%status(i))) // ',' // to_text(chunk%steps(i)) // ',')
        if (.not. is_done) call file%put(in_quotes(chunk%reasons(i)%text, '"'))
        call file%put(new_line('a'))
      end do
    end do
    if (allocated(error)) then
      call file%discard()
    else
      call file%finish(sweep_csv_name, error)
    end if
  end subroutine write_sweep_csv

  pure function column_labels(header) result(labels)
    type(sweep_header_t), intent(in) :: header
    type(string_t), allocatable :: labels(:)

    allocate (labels(0))
    call append(labels, 'variant')
    call append_quantities(labels, header%parameters)
    call append_quantities(labels, header%results)
    call append(labels, 'status')
    call append(labels, 'steps')
    call append(labels, 'reason')
  end function column_labels

  pure subroutine append_quantities(labels, quantities)
    type(string_t), allocatable, intent(inout) :: labels(:)
    type(stored_quantity_t), intent(in) :: quantities(:)
    integer :: i

    do i = 1, size(quantities)
      if (quantities(i)%unit == '') then
        call append(labels, quantities(i)%label)
      else
        call append(labels, quantities(i)%label // ' [' // quantities(i)%unit // ']')
      end if
    end do
  end subroutine append_quantities

end module nocdyn_sweep_csv
