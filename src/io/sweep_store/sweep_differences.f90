!> The differences between the inputs of two sweeps, in a sentence.
module nocdyn_sweep_differences
  use nocdyn_input_differences, only: find_differences
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: input_difference

  integer, parameter :: max_listed = 5   ! differences

contains

  !> The first differences that change results; '' if there are none.
  function input_difference(old, new) result(text)
    character(len=*), intent(in) :: old, new   !! as `input_text` writes them
    character(len=:), allocatable :: text
    type(string_t), allocatable :: changes(:)
    integer :: i

    text = ''
    if (old == new) return
    call find_differences(old, new, changes)
    do i = 1, min(size(changes), max_listed)
      if (i > 1) text = text // '; '
      text = text // changes(i)%text
    end do
    if (size(changes) > max_listed) text = text // '; and ' // to_text(size(changes) - max_listed) // ' more'
  end function input_difference

end module nocdyn_sweep_differences
