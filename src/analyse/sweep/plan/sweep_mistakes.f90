!> Mistakes that show when the groups of a sweep are put together.
module nocdyn_sweep_mistakes
  use nocdyn_input, only: input_t
  use nocdyn_mistakes, only: mistakes_t
  implicit none (type, external)
  private

  public :: add_mistake

contains

  !> A mistake at a key of a group, with the line of the key if it has one.
  subroutine add_mistake(input, group, key, text, mistakes, code)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group   !! index
    character(len=*), intent(in) :: key, text
    type(mistakes_t), intent(inout) :: mistakes
    integer, intent(in), optional :: code   !! exit code

    associate (value => input%groups(group)%values(input%groups(group)%key_position(key)))
      call mistakes%add(max(value%line, input%groups(group)%line), group, text, value%override, code)
    end associate
  end subroutine add_mistake

end module nocdyn_sweep_mistakes
