!> Texts of files that the build puts into the program, which needs no files beside it.
module nocdyn_built_in_texts
  use, intrinsic :: iso_c_binding, only: c_int, c_null_ptr, c_ptr, c_size_t
  use nocdyn_c_texts, only: copy_text
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: find_built_in

  interface
    !> Set, name or content (part 0, 1 or 2) of a text; the result is the number of texts.
    integer(c_int) function c_part(number, part, text, length) bind(c, name='nocdyn_built_in_text')
      import :: c_int, c_ptr, c_size_t
      implicit none (type, external)
      integer(c_int), value :: number, part
      type(c_ptr), intent(inout) :: text
      integer(c_size_t), intent(inout) :: length
    end function c_part
  end interface

contains

  !> The text of a name in a set of them.
  subroutine find_built_in(set, name, text, names)
    character(len=*), intent(in) :: set                         !! 'rule' or 'template'
    character(len=*), intent(in) :: name                        !! of the file, without folder and extension
    character(len=:), allocatable, intent(out) :: text          !! not allocated if there is none
    type(string_t), allocatable, intent(out) :: names(:)        !! all of the set
    character(len=:), allocatable :: part
    type(c_ptr) :: place
    integer(c_size_t) :: length
    integer :: i

    allocate (names(0))
    place = c_null_ptr
    length = 0
    do i = 1, int(c_part(0_c_int, 0_c_int, place, length))
      call read_part(i, 0, part)
      if (part /= set) cycle
      call read_part(i, 1, part)
      call append(names, part)
      if (part == name) call read_part(i, 2, text)
    end do
  end subroutine find_built_in

  subroutine read_part(number, part, text)
    integer, intent(in) :: number, part
    character(len=:), allocatable, intent(out) :: text
    type(c_ptr) :: place
    integer(c_size_t) :: length
    integer :: ignored

    place = c_null_ptr
    length = 0
    ignored = int(c_part(int(number, c_int), int(part, c_int), place, length))
    call copy_text(place, length, text)
  end subroutine read_part

end module nocdyn_built_in_texts
