!> Texts that pass between C and Fortran: those that C gives, and those that C reads as long as Fortran keeps them.
module nocdyn_given_texts
  use, intrinsic :: iso_c_binding, only: c_char, c_null_char, c_ptr, c_size_t
  use nocdyn_c_texts, only: copy_text
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: take_text, give_text, give_lines

  !> A text that C reads, with its end.
  type, public :: c_text_t
    character(kind=c_char), allocatable :: characters(:)
  end type c_text_t

  interface
    integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
      import :: c_ptr, c_size_t
      type(c_ptr), value, intent(in) :: text
    end function c_strlen
  end interface

contains

  !> A text of C as one of Fortran.
  subroutine take_text(address, text)
    type(c_ptr), intent(in) :: address
    character(len=:), allocatable, intent(out) :: text

    call copy_text(address, c_strlen(address), text)
  end subroutine take_text

  !> A text of Fortran as one of C.
  subroutine give_text(text, given)
    character(len=*), intent(in) :: text
    type(c_text_t), intent(inout) :: given
    integer :: i

    if (allocated(given%characters)) deallocate (given%characters)
    allocate (given%characters(len(text) + 1))
    do i = 1, len(text)
      given%characters(i) = text(i:i)
    end do
    given%characters(len(text) + 1) = c_null_char
  end subroutine give_text

  !> Lines as one text of C.
  subroutine give_lines(lines, given)
    type(string_t), intent(in) :: lines(:)
    type(c_text_t), intent(inout) :: given
    character(len=:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(lines)
      if (i > 1) text = text // new_line('a')
      text = text // lines(i)%text
    end do
    call give_text(text, given)
  end subroutine give_lines

end module nocdyn_given_texts
