!> Pressures of cylinders that seem to be absolute, where the crankcase has none.
module nocdyn_pressure_notes
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: append, rounded_text, string_t
  implicit none (type, external)
  private

  public :: note_pressures

contains

  !> Adds a note on each engine and crank whose lowest pressure is about the one of the atmosphere while the crankcase has 0: the
  !> piston would have a vacuum below it. Absolute pressures need the one of the crankcase, and pressures above the atmosphere are
  !> not so high throughout.
  subroutine note_pressures(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: least = 0.5e5_wp   ! [Pa]
    integer :: i

    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        if (group%kind /= 'engine' .and. group%kind /= 'crank') cycle
        if (.not. group%has_value('pressures')) cycle
        if (group%number('crankcase_pressure') > 0 .or. size(group%numbers('pressures')) == 0) cycle
        associate (lowest => minval(group%numbers('pressures')))
          if (lowest < least) cycle
          call append(notes, input%place(i, 'pressures') // ': the lowest pressure is ' // rounded_text(lowest, 4) // &
                             ' Pa, and crankcase_pressure = 0: the piston has a vacuum below it. Absolute pressures need ' // &
                             'crankcase_pressure, about 1e5')
        end associate
      end associate
    end do
  end subroutine note_pressures

end module nocdyn_pressure_notes
