!> The differences between two sweeps, as phrases.
module nocdyn_sweep_differences
  use nocdyn_input_differences, only: find_differences
  use nocdyn_sweep_header, only: sweep_header_t
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: header_difference, input_difference

  integer, parameter :: max_listed = 5   ! differences

contains

  !> What is said of the first difference between two sweeps; '' if program, input and list of variants are the same.
  function header_difference(old, new, sources, inputs, lists) result(text)
    type(sweep_header_t), intent(in) :: old, new
    character(len=*), intent(in) :: sources, inputs, lists   !! what is said if that differs; differences of inputs follow
    character(len=:), allocatable :: text

    text = sources
    if (old%source /= new%source) return
    text = input_difference(old%input_text, new%input_text)
    if (text /= '') then
      text = inputs // text
    else if (old%list_checksum /= new%list_checksum) then
      text = lists
    end if
  end function header_difference

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
