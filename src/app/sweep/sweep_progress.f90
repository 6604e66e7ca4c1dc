!> The progress line of a sweep.
module nocdyn_sweep_progress
  use nocdyn_console, only: status_line_t
  use nocdyn_kinds, only: wp
  use nocdyn_scheduler, only: sweep_counts_t, sweep_progress_t
  use nocdyn_text, only: rounded_text, to_text
  implicit none (type, external)
  private

  !> "tolerance.nml: 51200 of 100000 variants, 31000 per second, 2 s left, 3 failed"
  type, extends(sweep_progress_t), public :: console_sweep_progress_t
    type(status_line_t) :: line
    character(len=:), allocatable :: title
  contains
    procedure :: update
  end type console_sweep_progress_t

contains

  !> Shows the line if it is due.
  subroutine update(self, counts)
    class(console_sweep_progress_t), intent(inout) :: self
    type(sweep_counts_t), intent(in) :: counts
    real(wp) :: rate
    integer :: failures, left
    character(len=:), allocatable :: text

    if (.not. self%line%is_due()) return
    rate = counts%new / self%line%elapsed()
    failures = counts%refused + counts%failed
    left = counts%total - counts%done - failures
    text = self%title // ': ' // to_text(counts%total - left) // ' of ' // to_text(counts%total) // ' variants'
    if (counts%new > 0) then
      text = text // ', ' // rounded_text(rate, 3) // ' per second, ' // &
             to_text(int(min(left / rate, 1.0e8_wp)) + 1) // ' s left'
    end if
    if (failures > 0) text = text // ', ' // to_text(failures) // ' failed'
    call self%line%show(text)
  end subroutine update

end module nocdyn_sweep_progress
