!> A file of tables over one or two dimensions, such as the rows of a run over the time, which appears whole or not at all. Its
!> forms are elsewhere, for one needs a library.
module nocdyn_grid_file
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  !> After the first failure, `complete` and `finish` report it.
  type, abstract, public :: grid_file_t
  contains
    procedure(open_interface), deferred :: open
    procedure(begin_table_interface), deferred :: begin_table
    procedure(put_row_interface), deferred :: put_row
    procedure(has_failed_interface), deferred :: has_failed
    procedure(complete_interface), deferred :: complete
    procedure(complete_interface), deferred :: finish
    procedure(discard_interface), deferred :: discard
  end type grid_file_t

  abstract interface

    !> Opens a hidden file in `folder`, which is made if it does not exist.
    subroutine open_interface(self, folder, name, dimensions, sizes, title, input)
      import :: grid_file_t, string_t
      class(grid_file_t), intent(inout) :: self
      character(len=*), intent(in) :: folder, name   !! of the finished file
      type(string_t), intent(in) :: dimensions(:)    !! their names, the one that changes slowest first
      integer, intent(in) :: sizes(:)                !! of these; of a single one the most that there may be
      character(len=*), intent(in) :: title          !! of the input
      character(len=*), intent(in) :: input          !! the text of input.nml
    end subroutine open_interface

    !> Begins a table. A column with the name of a dimension has the coordinates of it.
    subroutine begin_table_interface(self, labels, rank)
      import :: grid_file_t, string_t
      class(grid_file_t), intent(inout) :: self
      type(string_t), intent(in) :: labels(:)   !! of the columns, e.g. 'omega_motor [rad/s]'
      integer, intent(in) :: rank               !! it is over so many of the dimensions
    end subroutine begin_table_interface

    subroutine put_row_interface(self, row)
      import :: grid_file_t, wp
      class(grid_file_t), intent(inout) :: self
      real(wp), intent(in) :: row(:)   !! [columns]
    end subroutine put_row_interface

    !> Whether there has been a failure since `open`.
    pure logical function has_failed_interface(self)
      import :: grid_file_t
      class(grid_file_t), intent(in) :: self
    end function has_failed_interface

    !> `complete` closes the file, which keeps its hidden name, and `finish` renames it too. After a failure since `open` there is
    !> an error and no file.
    subroutine complete_interface(self, name, error)
      import :: error_t, grid_file_t
      class(grid_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name     !! of the finished file
      type(error_t), allocatable, intent(out) :: error
    end subroutine complete_interface

    !> Closes and removes the file.
    subroutine discard_interface(self)
      import :: grid_file_t
      class(grid_file_t), intent(inout) :: self
    end subroutine discard_interface

  end interface

end module nocdyn_grid_file
