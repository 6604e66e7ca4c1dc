!> Finds the bodies of an input by name.
module nocdyn_body_index
  use nocdyn_input, only: group_t
  use nocdyn_schema_rules, only: ground
  use nocdyn_text, only: string_t
  use nocdyn_text_sort, only: argsort, sorted_position
  implicit none (type, external)
  private

  public :: new_body_index, bodies_of

  type, public :: body_index_t
    type(string_t), allocatable :: names(:)   !! of the bodies
    integer, allocatable :: order(:)          !! bodies in the order of their names
  contains
    procedure :: body
  end type body_index_t

contains

  !> The index of the bodies with these names.
  function new_body_index(names) result(body_index)
    type(string_t), intent(in) :: names(:)
    type(body_index_t) :: body_index

    allocate (body_index%names, source=names)
    call argsort(body_index%names, body_index%order)
  end function new_body_index

  !> Number of a body, 0 for the ground.
  pure integer function body(self, name)
    class(body_index_t), intent(in) :: self
    character(len=*), intent(in) :: name

    body = 0
    if (name /= ground) body = sorted_position(name, self%names, self%order)
  end function body

  !> Numbers of the bodies that a group names under a key, in the order of its values, 0 for the ground.
  function bodies_of(group, key, body_index) result(bodies)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    type(body_index_t), intent(in) :: body_index
    integer, allocatable :: bodies(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names, source=group%texts(key))
    allocate (bodies(size(names)))
    do i = 1, size(names)
      bodies(i) = body_index%body(names(i)%text)
    end do
  end function bodies_of

end module nocdyn_body_index
