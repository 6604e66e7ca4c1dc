!> The file sweep.nc: the results of a sweep as NetCDF-4, copied from its journals chunk by chunk.
module nocdyn_sweep_netcdf
  use, intrinsic :: iso_fortran_env, only: int8
  use netcdf, only: nf90_byte, nf90_char, nf90_chunked, nf90_def_dim, nf90_def_var, nf90_def_var_chunking, nf90_def_var_fill, &
    nf90_double, nf90_enddef, nf90_global, nf90_int, nf90_put_att, nf90_put_var, nf90_unlimited
  use nocdyn_errors, only: error_t
  use nocdyn_journal_chunks, only: check_sweep, chunk_cursor_t
  use nocdyn_kinds, only: wp
  use nocdyn_netcdf_file, only: check, create, define, netcdf_file_t, new_name, put_text
  use nocdyn_sweep_chunk, only: chunk_t, status_done, status_words
  use nocdyn_sweep_header, only: curve_axis_t, stored_quantity_t, sweep_netcdf_name
  use nocdyn_sweep_journal, only: sweep_journal_t
  use nocdyn_text, only: strings
  implicit none (type, external)
  private

  public :: write_sweep_netcdf

  character(len=14), parameter :: own_names(5) = [character(len=14) :: 'variant', 'status', 'steps', 'failed_variant', 'reason']
  integer, parameter :: block_variants = 16384   ! of one write to each variable
  integer, parameter :: chunk_failures = 4096
  integer, parameter :: megabyte = 2**20      ! the library's unit for the size of caches

  type, extends(netcdf_file_t) :: sweep_file_t
    integer :: variant_dimension = 0, failure_dimension = 0, reason_dimension = 0, axis_dimension = 0
    integer :: variant = 0, status = 0, steps = 0, failed_variant = 0, reason = 0   ! numbers of variables
    integer :: axis = 0
    integer, allocatable :: parameters(:), results(:)   ! all points of a curve have one variable
    integer, allocatable :: points(:)                   ! of the results, 0: of no curve
    integer :: written = 0, failures = 0                                             ! rows
  end type sweep_file_t

  !> Rows that are not yet written.
  type :: rows_t
    integer :: count = 0
    real(wp), allocatable :: parameters(:, :), results(:, :)   ! [rows, columns]
    integer, allocatable :: steps(:), status(:)
  end type rows_t

contains

  !> Writes sweep.nc of a whole sweep into `folder`: the complete file or none.
  subroutine write_sweep_netcdf(folder, journals, error)
    character(len=*), intent(in) :: folder
    type(sweep_journal_t), intent(inout) :: journals(:)   !! of all shards
    type(error_t), allocatable, intent(out) :: error
    type(sweep_file_t) :: file
    integer :: i, longest

    call check_sweep(journals, error)
    if (allocated(error)) return
    allocate (file%reserved, source=strings(own_names))
    call create(file, folder, sweep_netcdf_name)
    if (.not. allocated(file%failure)) then
      ! defines dimensions, variables and attributes
      longest = max(1, maxval(journals%longest_reason))
      associate (header => journals(1)%header)
        call put_text(file, nf90_global, 'Conventions', 'CF-1.8')
        call put_text(file, nf90_global, 'title', header%title)
        ! characters, for `nocdyn_sweep_provenance`
        call check(file, nf90_put_att(file%id, nf90_global, 'source', header%source))
        call put_text(file, nf90_global, 'design', header%design)
        call check(file, nf90_put_att(file%id, nf90_global, 'seed', header%seed))
        call check(file, nf90_put_att(file%id, nf90_global, 'input', header%input_text))
        if (header%list_checksum /= '') call put_text(file, nf90_global, 'list_checksum', header%list_checksum)
        call check(file, nf90_def_dim(file%id, 'variant', header%variants, file%variant_dimension))
        call check(file, nf90_def_dim(file%id, 'failure', nf90_unlimited, file%failure_dimension))
        call check(file, nf90_def_dim(file%id, 'reason_length', longest, file%reason_dimension))
        call define(file, 'variant', nf90_int, [file%variant_dimension], 'number of the variant', file%variant)
        call define_quantities(file, header%parameters, 'parameter', file%parameters)
        if (header%axis%points_in_use() > 0) call define_axis(file, header%axis)
        call define_quantities(file, header%results, 'result', file%results)
        allocate (file%points(size(header%results)))
        file%points = header%results%point
      end associate
      ! defines the variables for the status of the variants and for the reasons of those that are not done
      call define(file, 'status', nf90_byte, [file%variant_dimension], 'how the variant ended', file%status)
      call check(file, nf90_put_att(file%id, file%status, 'flag_values', [integer(int8) :: 0, 1, 2]))
      call put_text(file, file%status, 'flag_meanings', &
                    trim(status_words(0)) // ' ' // trim(status_words(1)) // ' ' // trim(status_words(2)))
      call define(file, 'steps', nf90_int, [file%variant_dimension], 'steps of the integration', file%steps)
      call define(file, 'failed_variant', nf90_int, [file%failure_dimension], 'number of a variant that is not done', &
                  file%failed_variant)
      ! by default the cache of the library would hold many chunks that are never read again
      call check(file, nf90_def_var(file%id, 'reason', nf90_char, [file%reason_dimension, file%failure_dimension], file%reason, &
                                   chunksizes=[longest, chunk_failures], deflate_level=1, &
                                   cache_size=1 + longest * chunk_failures / megabyte))
      call put_text(file, file%reason, 'long_name', 'why that variant is not done')
      call put_text(file, file%reason, '_Encoding', 'utf-8')
      call check(file, nf90_def_var_chunking(file%id, file%failed_variant, nf90_chunked, [chunk_failures]))
      ! every variant is written, so that filling the variables before would double the work
      associate (of_variants => [file%variant, file%parameters, file%results, file%status, file%steps])
        do i = 1, size(of_variants)
          call check(file, nf90_def_var_fill(file%id, of_variants(i), 1, 0))
        end do
      end associate
      if (.not. allocated(file%failure)) call check(file, nf90_enddef(file%id))
    end if
    associate (axis => journals(1)%header%axis)
      if (axis%points_in_use() > 0 .and. .not. allocated(file%failure)) then
        call check(file, nf90_put_var(file%id, file%axis, axis%points))
      end if
    end associate
    if (.not. allocated(file%failure)) call write_rows(file, journals, error)
    if (allocated(error)) then
      call file%discard()
    else
      call file%finish(sweep_netcdf_name, error)
    end if
  end subroutine write_sweep_netcdf

  !> Defines the coordinate that curves are over.
  subroutine define_axis(file, axis)
    type(sweep_file_t), intent(inout) :: file
    type(curve_axis_t), intent(in) :: axis
    character(len=:), allocatable :: name

    name = new_name(file, axis%label)
    call check(file, nf90_def_dim(file%id, name, size(axis%points), file%axis_dimension))
    call define(file, name, nf90_double, [file%axis_dimension], 'what curves are over', file%axis)
    call put_text(file, file%axis, 'units', axis%unit)
    call put_text(file, file%axis, 'label', axis%label)
    call put_text(file, file%axis, 'role', 'axis')
  end subroutine define_axis

  !> Defines a variable for each quantity, and for each curve. Its name is the label as far as NetCDF allows; the attribute
  !> `label` has all of it.
  subroutine define_quantities(file, quantities, role, variables)
    type(sweep_file_t), intent(inout) :: file
    type(stored_quantity_t), intent(in) :: quantities(:)
    character(len=*), intent(in) :: role
    integer, allocatable, intent(out) :: variables(:)
    character(len=:), allocatable :: label
    integer :: i

    allocate (variables(size(quantities)))
    do i = 1, size(quantities)
      if (quantities(i)%point > 1) then
        variables(i) = variables(i - 1)
        cycle
      end if
      label = quantities(i)%label
      if (quantities(i)%point > 0) then
        label = quantities(i)%curve()
        call define(file, new_name(file, label), nf90_double, [file%variant_dimension, file%axis_dimension], &
                    quantities(i)%long_name, variables(i))
      else
        call define(file, new_name(file, label), nf90_double, [file%variant_dimension], quantities(i)%long_name, variables(i))
      end if
      if (quantities(i)%unit /= '') call put_text(file, variables(i), 'units', quantities(i)%unit)
      call put_text(file, variables(i), 'label', label)
      call put_text(file, variables(i), 'role', role)
    end do
  end subroutine define_quantities

  !> Copies the chunks of the journals into the file.
  subroutine write_rows(file, journals, error)
    type(sweep_file_t), intent(inout) :: file
    type(sweep_journal_t), intent(inout) :: journals(:)
    type(error_t), allocatable, intent(out) :: error
    type(chunk_cursor_t) :: cursor
    type(chunk_t) :: chunk
    type(rows_t) :: rows
    logical :: is_there
    integer :: done, part

    allocate (rows%parameters(block_variants, size(file%parameters)), rows%results(block_variants, size(file%results)))
    allocate (rows%steps(block_variants), rows%status(block_variants))
    call cursor%rewind_to_start(journals)
    do
      call cursor%next_chunk(journals, chunk, is_there, error)
      if (allocated(error) .or. allocated(file%failure) .or. .not. is_there) exit
      done = 0
      do while (done < chunk%count)
        part = min(chunk%count - done, block_variants - rows%count)
        associate (to => rows%count)
          rows%parameters(to + 1:to + part, :) = transpose(chunk%parameters(:, done + 1:done + part))
          rows%results(to + 1:to + part, :) = transpose(chunk%results(:, done + 1:done + part))
          rows%steps(to + 1:to + part) = chunk%steps(done + 1:done + part)
          rows%status(to + 1:to + part) = chunk%status(done + 1:done + part)
        end associate
        rows%count = rows%count + part
        done = done + part
        if (rows%count == block_variants) call write_block(file, rows)
      end do
      call write_failures(file, chunk)
    end do
    call write_block(file, rows)
  end subroutine write_rows

  subroutine write_block(file, rows)
    type(sweep_file_t), intent(inout) :: file
    type(rows_t), intent(inout) :: rows
    integer :: first(1), i

    if (allocated(file%failure) .or. rows%count == 0) return
    first = file%written + 1
    call check(file, nf90_put_var(file%id, file%variant, [(file%written + i, i=1, rows%count)], first))
    do i = 1, size(file%parameters)
      call check(file, nf90_put_var(file%id, file%parameters(i), rows%parameters(:rows%count, i), first))
    end do
    do i = 1, size(file%results)
      if (file%points(i) == 0) then
        call check(file, nf90_put_var(file%id, file%results(i), rows%results(:rows%count, i), first))
      else
        call check(file, nf90_put_var(file%id, file%results(i), rows%results(:rows%count, i), [first, file%points(i)], &
                                      [rows%count, 1]))
      end if
    end do
    call check(file, nf90_put_var(file%id, file%status, int(rows%status(:rows%count), int8), first))
    call check(file, nf90_put_var(file%id, file%steps, rows%steps(:rows%count), first))
    file%written = file%written + rows%count
    rows%count = 0
  end subroutine write_block

  subroutine write_failures(file, chunk)
    type(sweep_file_t), intent(inout) :: file
    type(chunk_t), intent(in) :: chunk
    integer, allocatable :: positions(:)   ! of these variants in the chunk
    integer :: i

    allocate (positions(count(chunk%status /= status_done)))
    if (size(positions) == 0 .or. allocated(file%failure)) return
    positions(:) = pack([(i, i=1, chunk%count)], chunk%status /= status_done)
    call check(file, nf90_put_var(file%id, file%failed_variant, chunk%first - 1 + positions, [file%failures + 1]))
    call write_reasons(file, chunk, positions, maxval([(len(chunk%reasons(positions(i))%text), i=1, size(positions))]))
    file%failures = file%failures + size(positions)
  end subroutine write_failures

  subroutine write_reasons(file, chunk, positions, longest)
    type(sweep_file_t), intent(inout) :: file
    type(chunk_t), intent(in) :: chunk
    integer, intent(in) :: positions(:)
    integer, intent(in) :: longest               !! [characters]
    character(len=longest) :: reasons(size(positions))
    integer :: i

    do i = 1, size(positions)
      associate (text => chunk%reasons(positions(i))%text)
        reasons(i) = text // repeat(achar(0), longest - len(text))
      end associate
    end do
    call check(file, nf90_put_var(file%id, file%reason, reasons, [1, file%failures + 1], [longest, size(positions)]))
  end subroutine write_reasons

end module nocdyn_sweep_netcdf
