!> Couplings and meshes that a forced response finds without stiffness: inside a gap.
module nocdyn_open_gaps
  use nocdyn_element_sets, only: element_names
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_text, only: append, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: note_open_gaps

contains

  !> Adds a note on each elastic element whose moment does not change with its twist at some speeds.
  subroutine note_open_gaps(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, allocatable :: elastic(:)
    type(string_t), allocatable :: names(:)
    integer :: e, i, open

    allocate (elastic, source=response%machine%elastic())
    allocate (names, source=element_names(response%machine, elastic))
    do e = 1, size(elastic)
      open = 0
      do i = 1, size(response%points)
        if (abs(response%points(i)%state%stiffness(elastic(e))) <= 0) open = open + 1
      end do
      if (open == 0) cycle
      call append(notes, quoted(names(e)%text) // ' has no stiffness at ' // to_text(open) // ' of ' // &
                         to_text(size(response%points)) // ' speeds: it is inside its gap, whose edge counts as inside, ' // &
                         'or its law is level there')
    end do
  end subroutine note_open_gaps

end module nocdyn_open_gaps
