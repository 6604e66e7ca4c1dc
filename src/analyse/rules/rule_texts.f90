!> The rules that come with the program: the texts of the files beside this one, which the build puts into the program.
module nocdyn_rule_texts
  use, intrinsic :: iso_c_binding, only: c_int, c_ptr, c_size_t
  use nocdyn_c_texts, only: copy_text
  use nocdyn_text, only: split_lines, string_t
  implicit none (type, external)
  private

  public :: find_rule_text, rule_names

  interface
    !> Name and text of a rule; the number of all rules for another number.
    integer(c_int) function rule_part(number, is_text, text, length) bind(c, name='nocdyn_rule_part')
      import :: c_int, c_ptr, c_size_t
      implicit none (type, external)
      integer(c_int), value :: number, is_text   !! 0 for the name
      type(c_ptr), intent(out) :: text
      integer(c_size_t), intent(out) :: length
    end function rule_part
  end interface

contains

  !> The names of all rules.
  subroutine rule_names(names)
    type(string_t), allocatable, intent(out) :: names(:)
    integer :: i

    allocate (names(part_count()))
    do i = 1, size(names)
      call read_part(i, 0, names(i)%text)
    end do
  end subroutine rule_names

  !> The lines of a rule; a name that there is not is a mistake of the program, for the schema allows the names of files only.
  subroutine find_rule_text(name, lines)
    character(len=*), intent(in) :: name
    type(string_t), allocatable, intent(out) :: lines(:)
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: text
    integer :: i

    call rule_names(names)
    do i = 1, size(names)
      if (names(i)%text == name) exit
    end do
    if (i > size(names)) error stop 'nocdyn_rule_texts: there is no such rule'
    call read_part(i, 1, text)
    call split_lines(text, lines)
  end subroutine find_rule_text

  integer function part_count()
    type(c_ptr) :: place
    integer(c_size_t) :: length

    part_count = int(rule_part(0_c_int, 0_c_int, place, length))
  end function part_count

  subroutine read_part(number, is_text, text)
    integer, intent(in) :: number, is_text
    character(len=:), allocatable, intent(out) :: text
    type(c_ptr) :: place
    integer(c_size_t) :: length
    integer :: ignored

    ignored = int(rule_part(int(number, c_int), int(is_text, c_int), place, length))
    call copy_text(place, length, text)
  end subroutine read_part

end module nocdyn_rule_texts
