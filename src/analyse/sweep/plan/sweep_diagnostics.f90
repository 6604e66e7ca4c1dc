!> Diagnostics on keys of the groups of a sweep.
module nocdyn_sweep_diagnostics
  use nocdyn_input, only: input_t
  use nocdyn_diagnostics, only: diagnostics_t
  implicit none (type, external)
  private

  public :: report

contains

  !> Adds a diagnostic on a key of a group, with the line of the key if it is given.
  subroutine report(input, group, key, text, diagnostics, code)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group   !! index in the input
    character(len=*), intent(in) :: key, text
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, intent(in), optional :: code   !! exit code; exit_input if absent

    associate (value => input%groups(group)%values(input%groups(group)%key_position(key)))
      call diagnostics%add(max(value%line, input%groups(group)%line), group, text, value%override, code)
    end associate
  end subroutine report

end module nocdyn_sweep_diagnostics
