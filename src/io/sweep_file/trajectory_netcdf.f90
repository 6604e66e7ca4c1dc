!> The file trajectory.nc: the rows of a run as NetCDF-4, a variable for each column over the dimension and coordinate `t`.
module nocdyn_trajectory_netcdf
  use netcdf, only: nf90_chunked, nf90_def_dim, nf90_def_var_chunking, nf90_def_var_fill, nf90_double, nf90_enddef, nf90_global, &
    nf90_put_var, nf90_unlimited
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_netcdf_file, only: check, create, define, netcdf_file_t, new_name, put_text
  use nocdyn_text, only: string_t
  use nocdyn_trajectory_file, only: trajectory_file_t
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  integer, parameter :: block_numbers = 2**18   ! of one write, about
  integer, parameter :: least_rows = 64         ! of one write

  type, extends(trajectory_file_t), public :: netcdf_trajectory_t
    type(netcdf_file_t), private :: file
    integer, allocatable, private :: variables(:)
    real(wp), allocatable, private :: rows(:, :)   !! that are not yet written, [rows, columns]
    integer, private :: count = 0                  !! of these
    integer, private :: written = 0                !! rows in the file
  contains
    procedure :: open => open_netcdf
    procedure :: put_row, has_failed, complete, finish, discard
  end type netcdf_trajectory_t

contains

  !> Opens a hidden file. The rows have no fixed number, for a run can fail.
  subroutine open_netcdf(self, folder, labels, rows, title, input)
    class(netcdf_trajectory_t), intent(inout) :: self
    character(len=*), intent(in) :: folder
    type(string_t), intent(in) :: labels(:)
    integer, intent(in) :: rows
    character(len=*), intent(in) :: title, input
    integer :: block, blocks, bracket, dimension, i

    call create(self%file, folder, 'trajectory.nc')
    blocks = (rows - 1) / max(least_rows, block_numbers / size(labels)) + 1
    block = (rows - 1) / blocks + 1   ! equal ones: the file has room for whole blocks
    allocate (self%rows(block, size(labels)), self%variables(size(labels)))
    call put_text(self%file, nf90_global, 'Conventions', 'CF-1.8')
    call put_text(self%file, nf90_global, 'title', title)
    call put_text(self%file, nf90_global, 'source', 'nocdyn ' // version // ' (' // compiler_text // ')')
    call put_text(self%file, nf90_global, 'input', input)
    call check(self%file, nf90_def_dim(self%file%id, 't', nf90_unlimited, dimension))
    do i = 1, size(labels)
      if (.not. allocated(self%file%failure)) then
        bracket = index(labels(i)%text, ' [', back=.true.)
        call define(self%file, new_name(self%file, labels(i)%text(:bracket - 1)), nf90_double, [dimension], &
                    labels(i)%text(:bracket - 1), self%variables(i))
        call check(self%file, nf90_def_var_chunking(self%file%id, self%variables(i), nf90_chunked, [block]))
        call check(self%file, nf90_def_var_fill(self%file%id, self%variables(i), 1, 0))
        call put_text(self%file, self%variables(i), 'units', labels(i)%text(bracket + 2:len(labels(i)%text) - 1))
      end if
    end do
    if (.not. allocated(self%file%failure)) call check(self%file, nf90_enddef(self%file%id))
  end subroutine open_netcdf

  subroutine put_row(self, row)
    class(netcdf_trajectory_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)   !! [columns]

    self%count = self%count + 1
    self%rows(self%count, :) = row
    if (self%count == size(self%rows, 1)) call write_block(self)
  end subroutine put_row

  subroutine write_block(self)
    class(netcdf_trajectory_t), intent(inout) :: self
    integer :: i

    do i = 1, size(self%variables)
      if (allocated(self%file%failure)) exit
      call check(self%file, nf90_put_var(self%file%id, self%variables(i), self%rows(:self%count, i), [self%written + 1]))
    end do
    self%written = self%written + self%count
    self%count = 0
  end subroutine write_block

  pure logical function has_failed(self)
    class(netcdf_trajectory_t), intent(in) :: self

    has_failed = allocated(self%file%failure)
  end function has_failed

  subroutine complete(self, name, error)
    class(netcdf_trajectory_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    if (self%count > 0) call write_block(self)
    call self%file%complete(name, error)
  end subroutine complete

  subroutine finish(self, name, error)
    class(netcdf_trajectory_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call self%file%finish(name, error)
  end subroutine finish

  subroutine discard(self)
    class(netcdf_trajectory_t), intent(inout) :: self

    call self%file%discard()
  end subroutine discard

end module nocdyn_trajectory_netcdf
