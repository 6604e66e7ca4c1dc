!> Which program and input a sweep.nc is of.
module nocdyn_sweep_provenance
  use netcdf, only: nf90_close, nf90_ehdferr, nf90_enotatt, nf90_get_att, nf90_global, nf90_inquire_attribute, nf90_noerr, &
    nf90_nowrite, nf90_open, nf90_strerror
  use nocdyn_errors, only: error_t, exit_file, raise
  use nocdyn_sweep_header, only: sweep_netcdf_name, sweep_header_t
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: read_provenance

contains

  !> Reads the source, the input and the checksum of a list, and nothing else of a header.
  subroutine read_provenance(folder, header, error)
    character(len=*), intent(in) :: folder
    type(sweep_header_t), intent(out) :: header
    type(error_t), allocatable, intent(out) :: error
    integer :: id, status

    status = nf90_open(folder // '/' // sweep_netcdf_name, nf90_nowrite, id)
    if (status == nf90_noerr) then
      call read_text(id, 'source', header%source, status)
      if (status == nf90_noerr) call read_text(id, 'input', header%input_text, status)
      if (status == nf90_noerr) call read_text(id, 'list_checksum', header%list_checksum, status)
      if (nf90_close(id) /= nf90_noerr) status = nf90_ehdferr
    end if
    if (status /= nf90_noerr) call raise(error, exit_file, quoted(folder // '/' // sweep_netcdf_name) // ' cannot be read: ' // &
                                         trim(nf90_strerror(status)))
  end subroutine read_provenance

  !> A global attribute that is a text; '' if the file does not have it.
  subroutine read_text(id, name, text, status)
    integer, intent(in) :: id                              !! of the file
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: text
    integer, intent(out) :: status                         !! of the library
    integer :: length

    status = nf90_inquire_attribute(id, nf90_global, name, len=length)
    if (status /= nf90_noerr) length = 0
    allocate (character(len=length) :: text)
    if (status == nf90_noerr .and. length > 0) status = nf90_get_att(id, nf90_global, name, text)
    if (status == nf90_enotatt) status = nf90_noerr
  end subroutine read_text

end module nocdyn_sweep_provenance
