!> What all NetCDF-4 files have in common: they appear whole or not at all, and their bytes depend on their content alone.
!>
!> They hold neither time nor host, and NetCDF tells HDF5 not to store when an object was created. Numbers are not compressed: the
!> last digits of computed numbers are noise.
module nocdyn_netcdf_file
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_loc, &
    c_null_char, c_null_ptr
  use netcdf, only: nf90_clobber, nf90_close, nf90_create, nf90_def_var, nf90_ebadname, nf90_ehdferr, nf90_enameinuse, &
    nf90_max_name, nf90_netcdf4, nf90_noerr, nf90_put_att, nf90_put_att_any, nf90_strerror, nf90_string
  use nocdyn_hidden_file, only: hidden_file_t
  use nocdyn_json, only: has_utf_8
  use nocdyn_posix, only: last_failure
  use nocdyn_posix_files, only: disk_failure, sync_path
  use nocdyn_posix_programs, only: find_library_procedure
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: check, create, define, put_text, new_name

  !> A file while it is written. After the first failure nothing more is written.
  type, extends(hidden_file_t), public :: netcdf_file_t
    integer :: id = -1
    type(string_t), allocatable :: reserved(:)   !! names that `new_name` leaves to others
  contains
    procedure :: close => close_file
    procedure :: close_whole
  end type netcdf_file_t

  interface
    !> H5dont_atexit of HDF5.
    integer(c_int) function setting_interface() bind(c)
      import :: c_int
    end function setting_interface
  end interface

contains

  !> Keeps the reason of the first failure. The reason that the disk gives is clearer than the one of the library.
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

    if (.not. allocated(file%reserved)) allocate (file%reserved(0))
    call file%place(folder, name)
    if (allocated(file%failure)) return
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

  !> Defines a variable.
  subroutine define(file, name, kind, dimensions, long_name, variable)
    class(netcdf_file_t), intent(inout) :: file
    character(len=*), intent(in) :: name, long_name
    integer, intent(in) :: kind
    integer, intent(in) :: dimensions(:)   !! the one that changes fastest first
    integer, intent(inout) :: variable
    character(len=:), allocatable :: possible
    integer :: status

    possible = name
    status = nf90_def_var(file%id, possible, kind, dimensions, variable)
    if (status == nf90_ebadname) then   ! names must be UTF-8; this is Latin-1, for example
      possible = ascii(name)
      status = nf90_def_var(file%id, possible, kind, dimensions, variable)
    end if
    do while (status == nf90_enameinuse)   ! only changed letters differ
      possible = possible // '_'
      status = nf90_def_var(file%id, possible, kind, dimensions, variable)
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

  !> Closes the file and has the disk store it.
  subroutine close_whole(self)
    class(netcdf_file_t), intent(inout) :: self
    logical :: is_done

    if (self%id < 0) return
    call self%close()
    if (allocated(self%failure)) return
    call sync_path(self%hidden_path, is_done)
    if (.not. is_done) call self%keep_failure(last_failure())
  end subroutine close_whole

end module nocdyn_netcdf_file
