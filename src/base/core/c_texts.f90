!> Texts of C as texts of Fortran.
module nocdyn_c_texts
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_ptr, c_size_t
  implicit none (type, external)
  private

  public :: copy_text

contains

  !> Copies a text.
  subroutine copy_text(address, length, text)
    type(c_ptr), intent(in) :: address         !! of its first character
    integer(c_size_t), intent(in) :: length    !! [bytes]
    character(len=:), allocatable, intent(out) :: text
    character(kind=c_char), pointer :: characters(:)
    integer(c_size_t) :: i

    call c_f_pointer(address, characters, [length])
    allocate (character(len=length) :: text)
    do i = 1, length
      text(i:i) = characters(i)
    end do
  end subroutine copy_text

end module nocdyn_c_texts
