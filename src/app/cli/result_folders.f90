!> The folders of results.
module nocdyn_result_folders
  use nocdyn_arguments, only: arguments_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_sweep_header, only: sweep_netcdf_name
  use nocdyn_sweep_journal, only: journal_names
  use nocdyn_text, only: joined, quoted, shown_path, string_t
  implicit none (type, external)
  private

  public :: normalised_path, out_folder, result_folder, refuse_shared_folders, refuse_sweep_folder

  integer, parameter :: max_listed = 3   ! names

contains

  !> The path without "." parts, doubled slashes and a trailing slash: two spellings of a folder become equal.
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

  !> The folder of --out or, with several input files, the folder of one of them in it; '' without --out.
  function out_folder(arguments, file) result(folder)
    type(arguments_t), intent(in) :: arguments
    character(len=*), intent(in) :: file   !! path of the input
    character(len=:), allocatable :: folder

    folder = ''
    if (.not. arguments%is_given('--out')) return
    folder = normalised_path(arguments%value('--out'))
    if (size(arguments%operands) > 1) folder = folder // '/' // stem(file)
  end function out_folder

  !> The folder for the results of an input: the one of --out, else &output directory, else results/<name of the file>.
  function result_folder(arguments, input) result(folder)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: folder
    type(group_t) :: output

    folder = out_folder(arguments, input%file)
    if (folder /= '') return
    output = input%single('output')
    folder = output%text('directory')
    if (folder == '') then
      folder = 'results/' // stem(input%file)
    else
      folder = normalised_path(folder)
    end if
  end function result_folder

  !> The name of a file without its folders and without its extension.
  pure function stem(path)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: stem
    integer :: dot

    stem = path(index(path, '/', back=.true.) + 1:)
    dot = index(stem, '.', back=.true.)
    if (dot > 1) stem = stem(:dot - 1)
  end function stem

  !> Refuses two input files of one call whose results would go to the same folder.
  subroutine refuse_shared_folders(files, folders, error)
    type(string_t), intent(in) :: files(:)     !! paths of the inputs
    type(string_t), intent(in) :: folders(:)   !! of their results, '' where nothing is written
    type(error_t), allocatable, intent(out) :: error
    integer :: i, k

    do i = 2, size(folders)
      if (folders(i)%text == '') cycle
      do k = 1, i - 1
        if (folders(k)%text /= folders(i)%text) cycle
        call raise(error, exit_input, quoted(shown_path(files(k)%text)) // ' and ' // quoted(shown_path(files(i)%text)) // &
                   ' would both write to ' // quoted(shown_path(folders(i)%text)) // '; nothing was run')
        return
      end do
    end do
  end subroutine refuse_shared_folders

  !> Refuses a folder with a sweep for the results of a run: the run would overwrite summary.json of a finished sweep, and an
  !> unfinished sweep would remove the results of the run at its end.
  subroutine refuse_sweep_folder(file, folder, error)
    character(len=*), intent(in) :: file     !! path of the input, for the message
    character(len=*), intent(in) :: folder   !! of the results
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    logical :: is_there

    inquire (file=folder // '/' // sweep_netcdf_name, exist=is_there)
    allocate (names, source=journal_names(folder))
    if (is_there) then
      call raise(error, exit_input, shown_path(file) // ': ' // shown_path(folder) // ' holds the results of a sweep; ' // &
                 'choose another folder with --out, or remove ' // sweep_netcdf_name)
    else if (size(names) > 0) then
      call raise(error, exit_input, shown_path(file) // ': ' // shown_path(folder) // ' holds an unfinished sweep; ' // &
                 'choose another folder with --out, or remove ' // joined(names, ', ', max_listed))
    end if
  end subroutine refuse_sweep_folder

end module nocdyn_result_folders
