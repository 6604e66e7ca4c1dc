!> The loads whose torque &excitation shares.
module nocdyn_shared_loads
  use nocdyn_input, only: input_t
  use nocdyn_text, only: joined, quoted, string_t
  implicit none (type, external)
  private

  public :: find_shared_load

contains

  !> The load of an excitation with `share_of_load`: the one on its body, or the one of its key `load`.
  subroutine find_shared_load(input, excitation, load, text)
    type(input_t), intent(in) :: input
    integer, intent(in) :: excitation   !! index of the group
    integer, intent(out) :: load        !! index of its group, 0: not found
    character(len=:), allocatable, intent(out) :: text   !! what is wrong, '' if nothing is
    integer, allocatable :: loads(:)
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: body
    integer :: i

    load = 0
    text = ''
    associate (group => input%groups(excitation))
      body = group%text('body')
      loads = input%groups_named('load')
      loads = pack(loads, [(input%groups(loads(i))%text('body') == body, i=1, size(loads))])
      allocate (names(size(loads)))
      do i = 1, size(loads)
        names(i)%text = input%groups(loads(i))%name
        if (.not. group%has_value('load')) cycle
        if (names(i)%text == group%text('load')) load = loads(i)
      end do
      if (size(loads) == 0) then
        text = 'share_of_load needs a &load on ' // quoted(body)
      else if (load == 0 .and. group%has_value('load')) then
        text = 'load = ' // quoted(group%text('load')) // ' is no &load on ' // quoted(body) // '; there: ' // joined(names, ', ')
      else if (size(loads) > 1 .and. load == 0) then
        text = 'share_of_load needs load, the name of one of the loads on ' // quoted(body) // ': ' // joined(names, ', ')
      else if (load == 0) then
        load = loads(1)
      end if
    end associate
  end subroutine find_shared_load

end module nocdyn_shared_loads
