!> Runs of an input whose rows are kept in memory: up to a time, with extremes and cycles from another time on.
module nocdyn_passage_runs
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_text, only: string_t
  use nocdyn_transient, only: run_output_t, run_transient
  implicit none (type, external)
  private

  public :: run_part

  !> The rows of a run from a time on.
  type, extends(run_output_t), public :: kept_rows_t
    real(wp) :: from = -huge(1.0_wp)              !! [s]
    type(string_t), allocatable :: labels(:)      !! of the columns
    real(wp), allocatable :: values(:, :)         !! in SI units, the time first, [columns, rows]
    integer :: count = 0                          !! of the rows
  contains
    procedure :: start, write_row, wants_stop
  end type kept_rows_t

contains

  !> Runs an input up to a time. Its own output does not matter.
  subroutine run_part(input, names, span, intervals, kept, summary, error)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: names(:)          !! of the columns that are kept beside the time
    real(wp), intent(in) :: span(2)                 !! from where extremes and cycles count, and the end of the run [s]
    integer, intent(in) :: intervals                !! between the rows
    type(kept_rows_t), target, intent(inout) :: kept
    type(run_summary_t), intent(out) :: summary
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: part
    type(value_t) :: value

    part = input
    value%texts = names
    call set('output', 'columns')
    call set('output', 'interval')
    call set('output', 'units')
    value%whole_numbers = [intervals + 1]
    call set('output', 'points')
    value%numbers = span(1:1)
    call set('output', 'extremes_from')
    value%numbers = span(2:2)
    call set('run', 't_end')
    call run_transient(part, kept, summary, error)

  contains

    !> Gives a key the value, which then is none.
    subroutine set(kind, key)
      character(len=*), intent(in) :: kind, key

      value%is_given = value%has_any()
      associate (group => part%groups(part%position(kind)))
        group%values(group%key_position(key)) = value
      end associate
      value = value_t()
    end subroutine set

  end subroutine run_part

  subroutine start(self, labels, rows, error)
    class(kept_rows_t), intent(inout) :: self
    type(string_t), intent(in) :: labels(:)
    integer, intent(in) :: rows
    type(error_t), allocatable, intent(out) :: error

    allocate (self%labels, source=labels)
    allocate (self%values(size(labels), rows))
    self%count = 0
  end subroutine start

  subroutine write_row(self, row)
    class(kept_rows_t), intent(inout) :: self
    real(wp), intent(in) :: row(:)

    if (row(1) < self%from) return
    self%count = self%count + 1
    self%values(:, self%count) = row
  end subroutine write_row

  logical function wants_stop(self, fraction)
    class(kept_rows_t), intent(inout) :: self
    real(wp), intent(in) :: fraction

    wants_stop = .false.
  end function wants_stop

end module nocdyn_passage_runs
