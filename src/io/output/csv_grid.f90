!> One table as comma-separated values, which appears whole or not at all.
module nocdyn_csv_grid
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_errors, only: error_t
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, extends(grid_file_t), public :: csv_grid_t
    type(output_file_t), private :: file
  contains
    procedure :: open => open_csv
    procedure :: begin_table, put_row, has_failed, complete, finish, discard
  end type csv_grid_t

contains

  !> Opens a hidden file. Dimensions, title and input have no place in it.
  subroutine open_csv(self, folder, name, dimensions, sizes, title, input)
    class(csv_grid_t), intent(inout) :: self
    character(len=*), intent(in) :: folder, name
    type(string_t), intent(in) :: dimensions(:)
    integer, intent(in) :: sizes(:)
    character(len=*), intent(in) :: title, input

    call self%file%open(folder, name)
  end subroutine open_csv

  subroutine begin_table(self, labels, rank)
    class(csv_grid_t), intent(inout) :: self
    type(string_t), intent(in) :: labels(:)
    integer, intent(in) :: rank

    call write_header(self%file, labels)
  end subroutine begin_table

  subroutine put_row(self, row)
    class(csv_grid_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)

    call write_row(self%file, row)
  end subroutine put_row

  pure logical function has_failed(self)
    class(csv_grid_t), intent(in) :: self

    has_failed = allocated(self%file%failure)
  end function has_failed

  subroutine complete(self, name, error)
    class(csv_grid_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call self%file%complete(name, error)
  end subroutine complete

  subroutine finish(self, name, error)
    class(csv_grid_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call self%file%finish(name, error)
  end subroutine finish

  subroutine discard(self)
    class(csv_grid_t), intent(inout) :: self

    call self%file%discard()
  end subroutine discard

end module nocdyn_csv_grid
