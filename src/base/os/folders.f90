!> The names in a folder, and removal of empty folders.
module nocdyn_folders
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_size_t
  use nocdyn_posix, only: path_call
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: folder_names, remove_empty_folder

  interface
    !> Writes the names, each followed by a null character (folder_names.cpp); returns the length of all.
    function c_folder_names(path, names, capacity) result(length) bind(c, name='nocdyn_folder_names')
      import :: c_char, c_size_t
      character(kind=c_char), intent(in) :: path(*)
      character(kind=c_char), intent(out) :: names(*)
      integer(c_size_t), value, intent(in) :: capacity
      integer(c_size_t) :: length
    end function c_folder_names
  end interface

  procedure(path_call), bind(c, name='rmdir') :: c_rmdir

contains

  !> The names of files and folders in a folder, in no particular order; none if it cannot be read.
  function folder_names(folder) result(names)
    character(len=*), intent(in) :: folder
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: bytes
    integer(c_size_t) :: length
    integer :: first, last

    length = 0
    do   ! files may appear between the two calls
      allocate (character(len=length) :: bytes)
      length = c_folder_names(folder // c_null_char, bytes, int(len(bytes), c_size_t))
      if (length <= len(bytes)) exit
      deallocate (bytes)
    end do
    allocate (names(0))
    first = 1
    do while (first <= length)
      last = first + index(bytes(first:), c_null_char) - 2
      call append(names, bytes(first:last))
      first = last + 2
    end do
  end function folder_names

  !> Removes a folder if it is empty.
  subroutine remove_empty_folder(path)
    character(len=*), intent(in) :: path
    integer(c_int) :: status

    status = c_rmdir(path // c_null_char)
  end subroutine remove_empty_folder

end module nocdyn_folders
