!> Rows that move whose g(v) is written as formulas: `describe` sets `row` of the list, and g and its derivatives follow.
module nocdyn_described_rows
  use nocdyn_kinds, only: wp
  use nocdyn_described_elements, only: stays_whole
  use nocdyn_row_derivatives, only: row_derivatives_t, new_row_derivatives
  use nocdyn_law_expressions, only: expression_t, phase_of, time_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_moving_rows, only: moving_rows_t
  implicit none (type, external)
  private

  !> Extensions override `describe`, and call `prepare_rows` at the end of their constructor.
  type, abstract, extends(moving_rows_t), public :: described_rows_t
    type(row_derivatives_t), private :: derivatives   !! of all rows of the list
  contains
    procedure :: motions   ! not `non_overridable`: gfortran 12 then calls another procedure through `moving_rows_t`
    procedure, non_overridable :: driver
    procedure, non_overridable :: prepare_rows
    procedure :: fastest_wave
  end type described_rows_t

contains

  !> v in formulas, the angle of the driver [rad] or the time [s].
  function driver(self, tape) result(v)
    class(described_rows_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: v

    if (self%is_driven_by_time) then
      v = time_of(tape)
    else
      v = phase_of(tape)
    end if
  end function driver

  !> Records the formulas.
  subroutine prepare_rows(self)
    class(described_rows_t), intent(inout) :: self

    self%has_described_rows = .true.
    self%steady_part = stays_whole
    call self%prepare_law()
    if (.not. allocated(self%law)) return
    associate (law => self%law%law)
      self%derivatives = new_row_derivatives(law, max(self%law%phase, self%law%time), law%tape%row)
    end associate
  end subroutine prepare_rows

  pure subroutine motions(self, v, g)
    class(described_rows_t), intent(in) :: self
    real(wp), intent(in) :: v(self%count)          !! [rad] or [s]
    real(wp), intent(out) :: g(0:3, self%count)    !! [rad] or [m]
    integer :: e

    associate (law => self%law%law)
      do e = 1, self%count, size(law%tape%row)
        call self%derivatives%compute(law, law%slot(1, e), v(e), g(0, e))
      end do
    end associate
  end subroutine motions

  !> Zero, as their moments are reactions.
  pure real(wp) function fastest_wave(self, lane, speed)
    class(described_rows_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: speed(:)

    fastest_wave = 0.0_wp
  end function fastest_wave

end module nocdyn_described_rows
