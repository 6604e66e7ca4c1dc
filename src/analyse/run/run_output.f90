!> What a run needs of its caller while it is integrated: somewhere to write the rows, and whether to stop.
module nocdyn_run_output
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, abstract, public :: run_output_t
  contains
    procedure(start_interface), deferred :: start
    procedure(write_row_interface), deferred :: write_row
    procedure(wants_stop_interface), deferred :: wants_stop
  end type run_output_t

  abstract interface

    !> Called once, before the first row.
    subroutine start_interface(self, labels)
      import :: run_output_t, string_t
      class(run_output_t), intent(inout) :: self
      type(string_t), intent(in) :: labels(:)   !! of the columns
    end subroutine start_interface

    !> Called at every output time.
    subroutine write_row_interface(self, row)
      import :: run_output_t, wp
      class(run_output_t), intent(inout) :: self
      real(wp), intent(in) :: row(:)   !! [columns]
    end subroutine write_row_interface

    !> Called after every step: shows the progress, and answers whether the integration is to end here.
    function wants_stop_interface(self, fraction) result(wants_stop)
      import :: run_output_t, wp
      class(run_output_t), intent(inout) :: self
      real(wp), intent(in) :: fraction   !! of the time span, 0 to 1
      logical :: wants_stop
    end function wants_stop_interface

  end interface

end module nocdyn_run_output
