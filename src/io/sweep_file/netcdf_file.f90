!> What all NetCDF-4 files have in common: they appear whole or not at all, and their bytes depend on their content alone.
!>
!> They hold neither time nor host, and NetCDF tells HDF5 not to store when an object was created. Numbers are not compressed: the
!> last digits of computed numbers are noise.
module nocdyn_netcdf_file
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_loc, &
    c_null_char, c_null_ptr
  use netcdf, only: nf90_clobber, nf90_close, nf90_create, nf90_def_var, nf90_ebadname, nf90_ehdferr, nf90_enameinuse, &
    nf90_max_name, nf90_netcdf4, nf90_noerr, nf90_put_att, nf90_put_att_any, nf90_strerror, nf90_string
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_json, only: has_utf_8
  use nocdyn_posix, only: last_failure, make_folders, process_id, remove_file, rename_file
  use nocdyn_posix_files, only: disk_failure, sync_path
  use nocdyn_posix_programs, only: find_library_procedure
  use nocdyn_text, only: quoted, shown_path, string_t, to_text
  implicit none (type, external)
  private

  public :: check, create, define, put_text, new_name

  !> A file while it is written. After the first failure nothing more is written.
  type, public :: netcdf_file_t
    integer :: id = -1
    type(string_t), allocatable :: reserved(:)              !! names that `new_name` leaves to others
    character(len=:), allocatable :: failure                !! the reason of the first one
    character(len=:), allocatable, private :: folder        !! with a slash at its end, or ''
    character(len=:), allocatable, private :: hidden_path   !! of the file until `finish`
  contains
    procedure :: complete, finish, discard
    procedure, private :: close => close_file
  end type netcdf_file_t

  interface
    !> H5dont_atexit of HDF5.
    integer(c_int) function setting_interface() bind(c)
      import :: c_int
    end function setting_interface
  end interface

contains

  !> Keeps the reason of the first failure. The reason that the disk gives is clearer than that of the library.
  subroutine check(file, status)
    class(netcdf_file_t), intent(inout) :: file
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

  !> Creates a hidden file in `folder`, which is made if it does not exist.
  subroutine create(file, folder, name)
    class(netcdf_file_t), intent(inout) :: file
    character(len=*), intent(in) :: folder
    character(len=*), intent(in) :: name     !! of the hidden file, without its dot and process number
    character(len=:), allocatable :: failure

    file%folder = folder // '/'
    if (folder == '.') file%folder = ''
    file%hidden_path = file%folder // '.' // name // '.' // to_text(process_id())
    if (.not. allocated(file%reserved)) allocate (file%reserved(0))
    call make_folders(folder, failure)
    if (allocated(failure)) then
      file%failure = 'the folder cannot be made: ' // failure
      return
    end if
    call keep_library_from_crashing()
    call check(file, nf90_create(file%hidden_path, ior(nf90_clobber, nf90_netcdf4), file%id))
  end subroutine create

  !> Writes an attribute. The library declares characters as ASCII, so that other texts are written as strings, in UTF-8.
  subroutine put_text(file, variable, name, text)
    class(netcdf_file_t), intent(inout) :: file
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
    class(netcdf_file_t), intent(inout) :: file
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
    do while (status == nf90_enameinuse)   ! only changed letters differ
      possible = possible // '_'
      status = nf90_def_var(file%id, possible, kind, [dimension], variable)
    end do
    call check(file, status)
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

  !> The label without slashes, which separate groups in NetCDF; shortened, and made different from the reserved names.
  function new_name(file, label) result(name)
    class(netcdf_file_t), intent(in) :: file
    character(len=*), intent(in) :: label
    character(len=:), allocatable :: name
    integer :: i

    name = label(:min(len(label), nf90_max_name / 2))
    do i = 1, len(name)
      if (name(i:i) == '/') name(i:i) = '_'
    end do
    do while (any([(file%reserved(i)%text == name, i=1, size(file%reserved))]))
      name = name // '_'
    end do
  end function new_name

  !> Closes the file; the library writes what it still holds.
  subroutine close_file(self)
    class(netcdf_file_t), intent(inout) :: self

    if (self%id >= 0) call check(self, nf90_close(self%id))
    self%id = -1
  end subroutine close_file

  !> Closes the file, which keeps its hidden name. After a failure there is an error and no file.
  subroutine complete(self, name, error)
    class(netcdf_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name     !! of the finished file, for the message
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    if (self%id >= 0) then
      call self%close()
      if (.not. allocated(self%failure)) then
        call sync_path(self%hidden_path, is_done)
        if (.not. is_done) self%failure = last_failure()
      end if
    end if
    if (allocated(self%failure)) call fail(self, name, error)
  end subroutine complete

  !> Closes the file if it is open, and renames it. After a failure there is an error and no file.
  subroutine finish(self, name, error)
    class(netcdf_file_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    logical :: is_done

    call self%complete(name, error)
    if (allocated(error)) return
    call rename_file(self%hidden_path, self%folder // name, is_done)
    if (is_done) return
    self%failure = last_failure()
    call fail(self, name, error)
  end subroutine finish

  !> Removes the file and raises the error.
  subroutine fail(self, name, error)
    class(netcdf_file_t), intent(in) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call remove_file(self%hidden_path)
    call raise(error, exit_file, 'cannot write ' // quoted(shown_path(self%folder // name)) // ': ' // self%failure)
  end subroutine fail

  !> Closes and removes the file.
  subroutine discard(self)
    class(netcdf_file_t), intent(inout) :: self

    call self%close()
    call remove_file(self%hidden_path)
  end subroutine discard

end module nocdyn_netcdf_file
