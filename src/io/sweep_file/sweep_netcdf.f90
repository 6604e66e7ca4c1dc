!> The file sweep.nc: the results of a sweep as NetCDF-4, copied from its journals chunk by chunk.
!>
!> Its bytes depend on the results alone: it holds neither time nor host, and NetCDF tells HDF5 not to store when an object was
!> created. Numbers are not compressed: the last digits of computed numbers are noise.
module nocdyn_sweep_netcdf
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_loc, c_null_char, c_null_ptr
  use, intrinsic :: iso_fortran_env, only: int8
  use netcdf, only: nf90_byte, nf90_char, nf90_chunked, nf90_clobber, nf90_close, nf90_create, nf90_def_dim, &
    nf90_def_var, nf90_def_var_chunking, nf90_def_var_fill, nf90_double, nf90_ebadname, nf90_ehdferr, nf90_enameinuse, &
    nf90_enddef, nf90_global, nf90_int, nf90_max_name, nf90_netcdf4, nf90_noerr, nf90_put_att, nf90_put_att_any, &
    nf90_put_var, nf90_strerror, nf90_string, nf90_unlimited
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_journal_chunks, only: check_sweep, chunk_cursor_t
  use nocdyn_json, only: has_utf_8
  use nocdyn_kinds, only: wp
  use nocdyn_posix, only: last_failure, make_folders, process_id, remove_file, rename_file
  use nocdyn_posix_files, only: disk_failure, sync_path
  use nocdyn_posix_programs, only: find_library_procedure
  use nocdyn_sweep_chunk, only: chunk_t, status_done, status_words
  use nocdyn_sweep_header, only: quantity_t, sweep_netcdf_name, sweep_header_t
  use nocdyn_sweep_journal, only: sweep_journal_t
  use nocdyn_text, only: append, quoted, shown_path, string_t, strings, to_text
  implicit none (type, external)
  private

  public :: write_sweep_netcdf

  character(len=14), parameter :: own_names(5) = [character(len=14) :: 'variant', 'status', 'steps', 'failed_variant', 'reason']
  integer, parameter :: block_variants = 16384   ! of one write to each variable
  integer, parameter :: chunk_failures = 4096
  integer, parameter :: megabyte = 2**20      ! the library's unit for the size of caches

  !> The file while it is written. After the first failure nothing more is written.
  type :: netcdf_file_t
    integer :: id = -1
    integer :: variant_dimension = 0, failure_dimension = 0, reason_dimension = 0
    integer :: variant = 0, status = 0, steps = 0, failed_variant = 0, reason = 0   ! numbers of variables
    integer, allocatable :: parameters(:), results(:)
    type(string_t), allocatable :: names(:)                                          ! of the variables, so far
    character(len=:), allocatable :: failure
    integer :: written = 0, failures = 0                                             ! rows
  end type netcdf_file_t

  !> Rows that are not yet written.
  type :: rows_t
    integer :: count = 0
    real(wp), allocatable :: parameters(:, :), results(:, :)   ! [rows, columns]
    integer, allocatable :: steps(:), status(:)
  end type rows_t

  interface
    !> H5dont_atexit of HDF5.
    integer(c_int) function setting_interface() bind(c)
      import :: c_int
    end function setting_interface
  end interface

contains

  !> Writes sweep.nc of a whole sweep into `folder`: the complete file or none.
  subroutine write_sweep_netcdf(folder, journals, error)
    character(len=*), intent(in) :: folder
    type(sweep_journal_t), intent(inout) :: journals(:)   !! of all shards
    type(error_t), allocatable, intent(out) :: error
    type(netcdf_file_t) :: file
    character(len=:), allocatable :: temporary, failure, path
    logical :: is_done

    call check_sweep(journals, error)
    if (allocated(error)) return
    path = sweep_netcdf_name
    if (folder /= '.') path = folder // '/' // path
    temporary = path(:len(path) - len(sweep_netcdf_name)) // '.' // sweep_netcdf_name // '.' // to_text(process_id())
    call make_folders(folder, failure)
    if (allocated(failure)) then
      call raise(error, exit_file, 'cannot write ' // quoted(shown_path(path)) // ': the folder cannot be made: ' // failure)
      return
    end if
    call create_file(file, temporary, journals)
    if (.not. allocated(file%failure)) call write_rows(file, journals, error)
    call close_file(file)
    if (.not. (allocated(file%failure) .or. allocated(error))) then
      call sync_path(temporary, is_done)
      if (is_done) call rename_file(temporary, path, is_done)
      if (.not. is_done) file%failure = last_failure()
    end if
    if (allocated(file%failure) .or. allocated(error)) call remove_file(temporary)
    if (allocated(file%failure)) call raise(error, exit_file, 'cannot write ' // quoted(shown_path(path)) // ': ' // file%failure)
  end subroutine write_sweep_netcdf

  !> Keeps the reason of the first failure. The reason that the disk gives is clearer than that of the library.
  subroutine check(file, status)
    type(netcdf_file_t), intent(inout) :: file
    integer, intent(in) :: status               !! of a call of the library

    if (status == nf90_noerr .or. allocated(file%failure)) return
    if (status == nf90_ehdferr .or. status > 0) file%failure = disk_failure()
    if (allocated(file%failure)) then
      if (file%failure /= '') return
    end if
    file%failure = trim(nf90_strerror(status))
  end subroutine check

  !> Tells HDF5 to do nothing when the program ends: HDF5 1.10 crashes there if the disk was full while a file was written.
  subroutine keep_library_from_crashing()
    procedure(setting_interface), pointer :: keep_silent
    type(c_funptr) :: address
    integer(c_int) :: status

    address = find_library_procedure('H5dont_atexit')
    if (.not. c_associated(address)) return
    call c_f_procpointer(address, keep_silent)
    status = keep_silent()
  end subroutine keep_library_from_crashing

  !> Creates the file with its dimensions, variables and attributes.
  subroutine create_file(file, path, journals)
    type(netcdf_file_t), intent(inout) :: file
    character(len=*), intent(in) :: path
    type(sweep_journal_t), intent(in) :: journals(:)
    integer :: longest

    allocate (file%names, source=strings(own_names))
    call keep_library_from_crashing()
    call check(file, nf90_create(path, ior(nf90_clobber, nf90_netcdf4), file%id))
    if (allocated(file%failure)) return
    longest = max(1, maxval(journals%longest_reason))
    associate (header => journals(1)%header)
      call put_attributes(file, header)
      call check(file, nf90_def_dim(file%id, 'variant', header%variants, file%variant_dimension))
      call check(file, nf90_def_dim(file%id, 'failure', nf90_unlimited, file%failure_dimension))
      call check(file, nf90_def_dim(file%id, 'reason_length', longest, file%reason_dimension))
      call define(file, 'variant', nf90_int, file%variant_dimension, 'number of the variant', file%variant)
      call define_quantities(file, header%parameters, 'parameter', file%parameters)
      call define_quantities(file, header%results, 'result', file%results)
    end associate
    call define_status_variables(file, longest)
    if (.not. allocated(file%failure)) call check(file, nf90_enddef(file%id))
  end subroutine create_file

  !> Writes the global attributes.
  subroutine put_attributes(file, header)
    type(netcdf_file_t), intent(inout) :: file
    type(sweep_header_t), intent(in) :: header

    call put_text(file, nf90_global, 'Conventions', 'CF-1.8')
    call put_text(file, nf90_global, 'title', header%title)
    call check(file, nf90_put_att(file%id, nf90_global, 'source', header%source))   ! characters, for `nocdyn_sweep_provenance`
    call put_text(file, nf90_global, 'design', header%design)
    call check(file, nf90_put_att(file%id, nf90_global, 'seed', header%seed))
    call check(file, nf90_put_att(file%id, nf90_global, 'input', header%input_text))
    if (header%list_checksum /= '') call put_text(file, nf90_global, 'list_checksum', header%list_checksum)
  end subroutine put_attributes

  !> Writes an attribute. The library declares characters as ASCII, so that other texts are written as strings, in UTF-8.
  subroutine put_text(file, variable, name, text)
    type(netcdf_file_t), intent(inout) :: file
    integer, intent(in) :: variable
    character(len=*), intent(in) :: name, text
    character(kind=c_char), allocatable, target :: string(:)
    character(len=storage_size(c_null_ptr) / storage_size('c')) :: address   ! of the string, from which the library copies

    if (has_utf_8(text)) then
      allocate (string, source=transfer(text // c_null_char, [c_null_char]))
      address = transfer(c_loc(string), address)
      call check(file, nf90_put_att_any(file%id, variable, name, nf90_string, 1, address))
    else
      call check(file, nf90_put_att(file%id, variable, name, text))
    end if
  end subroutine put_text

  !> Defines a variable over one dimension.
  subroutine define(file, name, kind, dimension, long_name, variable)
    type(netcdf_file_t), intent(inout) :: file
    character(len=*), intent(in) :: name, long_name
    integer, intent(in) :: kind, dimension
    integer, intent(inout) :: variable
    character(len=:), allocatable :: possible
    integer :: status

    possible = name
    status = nf90_def_var(file%id, possible, kind, [dimension], variable)
    if (status == nf90_ebadname) then   ! names must be UTF-8; this is Latin-1, for example
      possible = ascii(name)
      status = nf90_def_var(file%id, possible, kind, [dimension], variable)
    end if
    do while (status == nf90_enameinuse)   ! only such letters differ
      possible = possible // '_'
      status = nf90_def_var(file%id, possible, kind, [dimension], variable)
    end do
    call check(file, status)
    ! every variant is written, so that filling the variable before would double the work
    if (dimension == file%variant_dimension) call check(file, nf90_def_var_fill(file%id, variable, 1, 0))
    call put_text(file, variable, 'long_name', long_name)
  end subroutine define

  pure function ascii(text)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: ascii
    integer :: i

    ascii = text
    do i = 1, len(text)
      if (ichar(text(i:i)) < 32 .or. ichar(text(i:i)) > 126) ascii(i:i) = '_'
    end do
  end function ascii

  !> Defines a variable for each quantity. Its name is the label as far as NetCDF allows; the attribute `label` has all of it.
  subroutine define_quantities(file, quantities, role, variables)
    type(netcdf_file_t), intent(inout) :: file
    type(quantity_t), intent(in) :: quantities(:)
    character(len=*), intent(in) :: role
    integer, allocatable, intent(out) :: variables(:)
    character(len=:), allocatable :: name
    integer :: i

    allocate (variables(size(quantities)))
    do i = 1, size(quantities)
      name = new_name(file, quantities(i)%label)
      call define(file, name, nf90_double, file%variant_dimension, quantities(i)%long_name, variables(i))
      if (quantities(i)%unit /= '') call put_text(file, variables(i), 'units', quantities(i)%unit)
      call put_text(file, variables(i), 'label', quantities(i)%label)
      call put_text(file, variables(i), 'role', role)
    end do
  end subroutine define_quantities

  !> The label without slashes, which separate groups in NetCDF; shortened, and made different from the names in use.
  function new_name(file, label) result(name)
    type(netcdf_file_t), intent(inout) :: file
    character(len=*), intent(in) :: label
    character(len=:), allocatable :: name
    integer :: i

    name = label(:min(len(label), nf90_max_name / 2))
    do i = 1, len(name)
      if (name(i:i) == '/') name(i:i) = '_'
    end do
    do while (any([(file%names(i)%text == name, i=1, size(file%names))]))
      name = name // '_'
    end do
    call append(file%names, name)
  end function new_name

  !> Defines the variables for the status of the variants and for the reasons of those that are not done.
  subroutine define_status_variables(file, longest)
    type(netcdf_file_t), intent(inout) :: file
    integer, intent(in) :: longest   !! length of a reason [characters]

    call define(file, 'status', nf90_byte, file%variant_dimension, 'how the variant ended', file%status)
    call check(file, nf90_put_att(file%id, file%status, 'flag_values', [integer(int8) :: 0, 1, 2]))
    call put_text(file, file%status, 'flag_meanings', &
                  trim(status_words(0)) // ' ' // trim(status_words(1)) // ' ' // trim(status_words(2)))
    call define(file, 'steps', nf90_int, file%variant_dimension, 'steps of the integration', file%steps)
    call define(file, 'failed_variant', nf90_int, file%failure_dimension, 'number of a variant that is not done', &
                file%failed_variant)
    ! by default the cache of the library would hold many chunks that are never read again
    call check(file, nf90_def_var(file%id, 'reason', nf90_char, [file%reason_dimension, file%failure_dimension], file%reason, &
                                 chunksizes=[longest, chunk_failures], deflate_level=1, &
                                 cache_size=1 + longest * chunk_failures / megabyte))
    call put_text(file, file%reason, 'long_name', 'why that variant is not done')
    call put_text(file, file%reason, '_Encoding', 'utf-8')
    call check(file, nf90_def_var_chunking(file%id, file%failed_variant, nf90_chunked, [chunk_failures]))
  end subroutine define_status_variables

  !> Copies the chunks of the journals into the file.
  subroutine write_rows(file, journals, error)
    type(netcdf_file_t), intent(inout) :: file
    type(sweep_journal_t), intent(inout) :: journals(:)
    type(error_t), allocatable, intent(out) :: error
    type(chunk_cursor_t) :: cursor
    type(chunk_t) :: chunk
    type(rows_t) :: rows
    logical :: is_there

    allocate (rows%parameters(block_variants, size(file%parameters)), rows%results(block_variants, size(file%results)))
    allocate (rows%steps(block_variants), rows%status(block_variants))
    call cursor%rewind_to_start(journals)
    do
      call cursor%next_chunk(journals, chunk, is_there, error)
      if (allocated(error) .or. allocated(file%failure) .or. .not. is_there) exit
      call add_chunk(file, rows, chunk)
      call write_failures(file, chunk)
    end do
    call write_block(file, rows)
  end subroutine write_rows

  subroutine add_chunk(file, rows, chunk)
    type(netcdf_file_t), intent(inout) :: file
    type(rows_t), intent(inout) :: rows
    type(chunk_t), intent(in) :: chunk
    integer :: done, part

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
  end subroutine add_chunk

  subroutine write_block(file, rows)
    type(netcdf_file_t), intent(inout) :: file
    type(rows_t), intent(inout) :: rows
    integer :: first(1), i

    if (allocated(file%failure) .or. rows%count == 0) return
    first = file%written + 1
    call check(file, nf90_put_var(file%id, file%variant, [(file%written + i, i=1, rows%count)], first))
    do i = 1, size(file%parameters)
      call check(file, nf90_put_var(file%id, file%parameters(i), rows%parameters(:rows%count, i), first))
    end do
    do i = 1, size(file%results)
      call check(file, nf90_put_var(file%id, file%results(i), rows%results(:rows%count, i), first))
    end do
    call check(file, nf90_put_var(file%id, file%status, int(rows%status(:rows%count), int8), first))
    call check(file, nf90_put_var(file%id, file%steps, rows%steps(:rows%count), first))
    file%written = file%written + rows%count
    rows%count = 0
  end subroutine write_block

  subroutine write_failures(file, chunk)
    type(netcdf_file_t), intent(inout) :: file
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
    type(netcdf_file_t), intent(inout) :: file
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

  !> Closes the file; the library writes what it still holds.
  subroutine close_file(file)
    type(netcdf_file_t), intent(inout) :: file

    if (file%id >= 0) call check(file, nf90_close(file%id))
  end subroutine close_file

end module nocdyn_sweep_netcdf
