!> Tables over one or two dimensions as NetCDF-4: each column is a variable.
!>
!> A single dimension has no fixed size, for a run can fail: its columns are stored in chunks, of the rows written at once.
module nocdyn_grid_netcdf
  use netcdf, only: nf90_chunked, nf90_def_dim, nf90_def_var_chunking, nf90_def_var_fill, nf90_double, nf90_enddef, nf90_global, &
    nf90_put_var, nf90_unlimited
  use nocdyn_errors, only: error_t
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_kinds, only: wp
  use nocdyn_netcdf_file, only: check, create, define, netcdf_file_t, new_name, put_text
  use nocdyn_text, only: string_t
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  integer, parameter :: block_numbers = 2**18   ! of one write, about
  integer, parameter :: least_rows = 64         ! of one write

  type, extends(grid_file_t), public :: netcdf_grid_t
    type(netcdf_file_t), private :: file
    integer, allocatable, private :: dimensions(:), sizes(:)
    integer, allocatable, private :: variables(:)   !! of the present table, [columns]
    integer, private :: rank = 0                    !! of it
    integer, private :: inner = 1                   !! rows of one place in the first dimension
    real(wp), allocatable, private :: rows(:, :)    !! that are not yet written, [rows, columns]
    integer, private :: count = 0                   !! of these
    integer, private :: written = 0                 !! places in the first dimension
  contains
    procedure :: open => open_netcdf
    procedure :: begin_table, put_row, has_failed, complete, finish, discard
  end type netcdf_grid_t

contains

  subroutine open_netcdf(self, folder, name, dimensions, sizes, title, input)
    class(netcdf_grid_t), intent(inout) :: self
    character(len=*), intent(in) :: folder, name
    type(string_t), intent(in) :: dimensions(:)
    integer, intent(in) :: sizes(:)
    character(len=*), intent(in) :: title, input
    integer :: i, extent

    call create(self%file, folder, name)
    self%sizes = sizes
    allocate (self%dimensions(size(sizes)), source=0)
    call put_text(self%file, nf90_global, 'Conventions', 'CF-1.8')
    call put_text(self%file, nf90_global, 'title', title)
    call put_text(self%file, nf90_global, 'source', 'nocdyn ' // version // ' (' // compiler_text // ')')
    call put_text(self%file, nf90_global, 'input', input)
    do i = 1, size(sizes)
      if (allocated(self%file%failure)) return
      extent = merge(sizes(i), nf90_unlimited, size(sizes) > 1)
      call check(self%file, nf90_def_dim(self%file%id, new_name(self%file, dimensions(i)%text), extent, self%dimensions(i)))
    end do
  end subroutine open_netcdf

  subroutine begin_table(self, labels, rank)
    class(netcdf_grid_t), intent(inout) :: self
    type(string_t), intent(in) :: labels(:)
    integer, intent(in) :: rank
    integer :: blocks, bracket, i, places

    call write_rows(self)
    self%rank = rank
    self%inner = product(self%sizes(2:rank))
    self%written = 0
    if (allocated(self%rows)) deallocate (self%rows, self%variables)
    blocks = (self%sizes(1) - 1) / max(1, max(least_rows, block_numbers / size(labels)) / self%inner) + 1
    places = (self%sizes(1) - 1) / blocks + 1   ! equal blocks: a file in chunks has room for whole ones
    allocate (self%rows(places * self%inner, size(labels)), self%variables(size(labels)))
    do i = 1, size(labels)
      if (allocated(self%file%failure)) return
      bracket = index(labels(i)%text, ' [', back=.true.)
      call define(self%file, new_name(self%file, labels(i)%text(:bracket - 1)), nf90_double, self%dimensions(rank:1:-1), &
                  labels(i)%text(:bracket - 1), self%variables(i))
      if (size(self%sizes) == 1) then
        call check(self%file, nf90_def_var_chunking(self%file%id, self%variables(i), nf90_chunked, [places]))
      end if
      call check(self%file, nf90_def_var_fill(self%file%id, self%variables(i), 1, 0))
      call put_text(self%file, self%variables(i), 'units', labels(i)%text(bracket + 2:len(labels(i)%text) - 1))
    end do
    if (.not. allocated(self%file%failure)) call check(self%file, nf90_enddef(self%file%id))
  end subroutine begin_table

  subroutine put_row(self, row)
    class(netcdf_grid_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)

    self%count = self%count + 1
    self%rows(self%count, :) = row
    if (self%count == size(self%rows, 1)) call write_rows(self)
  end subroutine put_row

  pure logical function has_failed(self)
    class(netcdf_grid_t), intent(in) :: self

    has_failed = allocated(self%file%failure)
  end function has_failed

  subroutine write_rows(self)
    class(netcdf_grid_t), intent(inout) :: self
    integer :: first(2), i, places, sizes(2)

    if (self%count == 0) return
    places = self%count / self%inner
    first = 1
    first(self%rank) = self%written + 1
    sizes = self%inner
    sizes(self%rank) = places
    do i = 1, size(self%variables)
      if (allocated(self%file%failure)) exit
      call check(self%file, nf90_put_var(self%file%id, self%variables(i), self%rows(:self%count, i), first(:self%rank), &
                                         sizes(:self%rank)))
    end do
    self%written = self%written + places
    self%count = 0
  end subroutine write_rows

  subroutine complete(self, name, error)
    class(netcdf_grid_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call write_rows(self)
    call self%file%complete(name, error)
  end subroutine complete

  subroutine finish(self, name, error)
    class(netcdf_grid_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call self%file%finish(name, error)
  end subroutine finish

  subroutine discard(self)
    class(netcdf_grid_t), intent(inout) :: self

    call self%file%discard()
  end subroutine discard

end module nocdyn_grid_netcdf
