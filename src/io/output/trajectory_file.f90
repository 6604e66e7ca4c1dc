!> The file with the rows of a run, which appears whole or not at all; its form as comma-separated values.
module nocdyn_trajectory_file
  use nocdyn_csv, only: write_header, write_row
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  !> A file of any form. After the first failure, `complete` and `finish` report it.
  type, abstract, public :: trajectory_file_t
  contains
    procedure(open_interface), deferred :: open
    procedure(put_row_interface), deferred :: put_row
    procedure(has_failed_interface), deferred :: has_failed
    procedure(complete_interface), deferred :: complete
    procedure(complete_interface), deferred :: finish
    procedure(discard_interface), deferred :: discard
  end type trajectory_file_t

  abstract interface

    !> Opens a hidden file in `folder`, which is made if it does not exist.
    subroutine open_interface(self, folder, labels, rows, title, input)
      import :: string_t, trajectory_file_t
      class(trajectory_file_t), intent(inout) :: self
      character(len=*), intent(in) :: folder
      type(string_t), intent(in) :: labels(:)   !! of the columns, e.g. 'omega_motor [rad/s]', the one of the time first
      integer, intent(in) :: rows               !! their number, if the run does not fail
      character(len=*), intent(in) :: title     !! of the input
      character(len=*), intent(in) :: input     !! the text of input.nml
    end subroutine open_interface

    subroutine put_row_interface(self, row)
      import :: trajectory_file_t, wp
      class(trajectory_file_t), intent(inout) :: self
      real(wp), intent(in) :: row(:)   !! [columns]
    end subroutine put_row_interface

    !> Whether there has been a failure since `open`.
    pure logical function has_failed_interface(self)
      import :: trajectory_file_t
      class(trajectory_file_t), intent(in) :: self
    end function has_failed_interface

    !> `complete` closes the file, which keeps its hidden name, and `finish` renames it too. After a failure since `open` there is
    !> an error and no file.
    subroutine complete_interface(self, name, error)
      import :: error_t, trajectory_file_t
      class(trajectory_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name     !! of the finished file
      type(error_t), allocatable, intent(out) :: error
    end subroutine complete_interface

    !> Closes and removes the file.
    subroutine discard_interface(self)
      import :: trajectory_file_t
      class(trajectory_file_t), intent(inout) :: self
    end subroutine discard_interface

  end interface

  !> Comma-separated values.
  type, extends(trajectory_file_t), public :: csv_trajectory_t
    type(output_file_t), private :: file
  contains
    procedure :: open => open_csv
    procedure :: put_row, has_failed, complete, finish, discard
  end type csv_trajectory_t

contains

  subroutine open_csv(self, folder, labels, rows, title, input)
    class(csv_trajectory_t), intent(inout) :: self
    character(len=*), intent(in) :: folder
    type(string_t), intent(in) :: labels(:)
    integer, intent(in) :: rows
    character(len=*), intent(in) :: title, input

    call self%file%open(folder, 'trajectory.csv')
    call write_header(self%file, labels)
  end subroutine open_csv

  subroutine put_row(self, row)
    class(csv_trajectory_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)   !! [columns]

    call write_row(self%file, row)
  end subroutine put_row

  pure logical function has_failed(self)
    class(csv_trajectory_t), intent(in) :: self

    has_failed = allocated(self%file%failure)
  end function has_failed

  subroutine complete(self, name, error)
    class(csv_trajectory_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call self%file%complete(name, error)
  end subroutine complete

  subroutine finish(self, name, error)
    class(csv_trajectory_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    call self%file%finish(name, error)
  end subroutine finish

  subroutine discard(self)
    class(csv_trajectory_t), intent(inout) :: self

    call self%file%discard()
  end subroutine discard

end module nocdyn_trajectory_file
