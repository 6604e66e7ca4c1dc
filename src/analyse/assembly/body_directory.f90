!> The bodies of an input by name.
module nocdyn_body_directory
  use nocdyn_input, only: group_t
  use nocdyn_schema_rules, only: ground
  use nocdyn_text, only: string_t
  use nocdyn_text_order, only: find_order, first_position
  implicit none (type, external)
  private

  public :: new_directory, bodies_of

  type, public :: directory_t
    type(string_t), allocatable :: names(:)
    integer, allocatable :: order(:)
  contains
    procedure :: body
  end type directory_t

contains

  !> The places of these bodies, sorted by name.
  function new_directory(names) result(directory)
    type(string_t), intent(in) :: names(:)
    type(directory_t) :: directory

    allocate (directory%names, source=names)
    call find_order(directory%names, directory%order)
  end function new_directory

  !> Body by name, 0 for the ground.
  pure integer function body(self, name)
    class(directory_t), intent(in) :: self
    character(len=*), intent(in) :: name

    body = 0
    if (name /= ground) body = first_position(name, self%names, self%order)
  end function body

  !> The bodies that one group names under a key, in the order of its values.
  function bodies_of(group, key, directory) result(bodies)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    type(directory_t), intent(in) :: directory
    integer, allocatable :: bodies(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names, source=group%texts(key))
    allocate (bodies(size(names)))
    do i = 1, size(names)
      bodies(i) = directory%body(names(i)%text)
    end do
  end function bodies_of

end module nocdyn_body_directory
