!> The folders that results go to.
module nocdyn_result_folders
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_sweep_header, only: sweep_netcdf_name
  use nocdyn_sweep_journal, only: journal_names
  use nocdyn_text, only: joined, quoted, string_t
  implicit none (type, external)
  private

  public :: normalised_path, result_folder, stem, refuse_shared_folders, refuse_sweep_folder

  integer, parameter :: max_listed = 3   ! names

contains

  !> The path without "." parts, doubled slashes and a last slash, so that equal folders have equal names.
  pure function normalised_path(path) result(plain)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: plain
    integer :: first, last

    plain = ''
    first = 1
    do while (first <= len(path))
      last = first + index(path(first:) // '/', '/') - 2
      if (path(first:last) /= '' .and. path(first:last) /= '.') plain = plain // '/' // path(first:last)
      first = last + 2
    end do
    if (index(path, '/') /= 1) plain = plain(2:)
    if (plain == '') plain = merge('/', '.', index(path, '/') == 1)
  end function normalised_path

  !> Where the results of a file go if there is no --out: to what the input says, else to results/<its name>.
  function result_folder(input) result(folder)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: folder
    type(group_t) :: output

    output = input%single('output')
    folder = output%text('directory')
    if (folder == '') then
      folder = 'results/' // stem(input%file)
    else
      folder = normalised_path(folder)
    end if
  end function result_folder

  !> The file's name without its folders and its last ending.
  pure function stem(path)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: stem
    integer :: dot

    stem = path(index(path, '/', back=.true.) + 1:)
    dot = index(stem, '.', back=.true.)
    if (dot > 1) stem = stem(:dot - 1)
  end function stem

  !> Two files of one call must not write over each other.
  subroutine refuse_shared_folders(files, folders, is_valid, error)
    type(string_t), intent(in) :: files(:), folders(:)
    logical, intent(in) :: is_valid(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i, k

    do i = 2, size(folders)
      if (.not. is_valid(i)) cycle
      do k = 1, i - 1
        if (.not. is_valid(k) .or. folders(k)%text /= folders(i)%text) cycle
        call raise(error, exit_input, quoted(files(k)%text) // ' and ' // quoted(files(i)%text) // &
                   ' would both write to ' // quoted(folders(i)%text) // '; nothing was run')
        return
      end do
    end do
  end subroutine refuse_shared_folders

  !> A run would take the name of a summary.json that belongs to a sweep, which may be the work of many hours; a sweep that is
  !> not finished would remove the results of the run at its end.
  subroutine refuse_sweep_folder(file, folder, error)
    character(len=*), intent(in) :: file, folder
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    logical :: is_there

    inquire (file=folder // '/' // sweep_netcdf_name, exist=is_there)
    allocate (names, source=journal_names(folder))
    if (is_there) then
      call raise(error, exit_input, file // ': ' // folder // ' holds the results of a sweep; choose another folder by ' // &
                 '--out, or remove ' // sweep_netcdf_name)
    else if (size(names) > 0) then
      call raise(error, exit_input, file // ': ' // folder // ' holds a sweep that is not finished; choose another folder ' // &
                 'by --out, or remove ' // joined(names, ', ', max_listed))
    end if
  end subroutine refuse_sweep_folder

end module nocdyn_result_folders
