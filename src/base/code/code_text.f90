!> The text of a program that is being written, line by line.
module nocdyn_code_text
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: list_of, filled

  integer, parameter :: width = 120   ! characters of a line of a list

  type, public :: code_text_t
    character(len=:), allocatable, private :: buffer
    integer, private :: length = 0
  contains
    procedure :: line, text
    procedure, private :: add
  end type code_text_t

  !> The numbers of a C array, without braces.
  interface list_of
    module procedure list_of_integers
    module procedure list_of_reals
  end interface list_of

contains

  !> Adds a line; in a template every `$` is replaced by the next of the numbers, every `@` by the next of a, b and c.
  subroutine line(self, template, numbers, a, b, c)
    class(code_text_t), intent(inout) :: self
    character(len=*), intent(in) :: template
    integer, intent(in), optional :: numbers(:)
    character(len=*), intent(in), optional :: a, b, c

    if (present(numbers)) then
      call self%add(filled(template, numbers, a, b, c))
    else if (present(a)) then
      call self%add(filled(template, [integer ::], a, b, c))
    else
      call self%add(template)
    end if
  end subroutine line

  !> A template with its numbers and texts.
  function filled(template, numbers, a, b, c) result(text)
    character(len=*), intent(in) :: template
    integer, intent(in) :: numbers(:)
    character(len=*), intent(in), optional :: a, b, c
    character(len=:), allocatable :: text
    integer :: i, next_number, next_text

    text = ''
    next_number = 0
    next_text = 0
    do i = 1, len(template)
      if (template(i:i) == '$') then
        next_number = next_number + 1
        text = text // to_text(numbers(next_number))
      else if (template(i:i) == '@') then
        next_text = next_text + 1
        if (next_text == 1) text = text // a
        if (next_text == 2) text = text // b
        if (next_text == 3) text = text // c
      else
        text = text // template(i:i)
      end if
    end do
  end function filled

  subroutine add(self, text)
    class(code_text_t), intent(inout) :: self
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: longer

    if (.not. allocated(self%buffer)) allocate (character(len=4096) :: self%buffer)
    if (self%length + len(text) + 1 > len(self%buffer)) then
      allocate (character(len=2 * (self%length + len(text) + 1)) :: longer)
      longer(:self%length) = self%buffer(:self%length)
      call move_alloc(longer, self%buffer)
    end if
    self%buffer(self%length + 1:self%length + len(text) + 1) = text // new_line(text)
    self%length = self%length + len(text) + 1
  end subroutine add

  !> All lines.
  function text(self)
    class(code_text_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = ''
    if (self%length > 0) text = self%buffer(:self%length)
  end function text

  function list_of_integers(numbers) result(text)
    integer, intent(in) :: numbers(:)
    character(len=:), allocatable :: text
    integer :: i, start

    text = ''
    start = 0
    do i = 1, size(numbers)
      call append_number(text, start, to_text(numbers(i)))
    end do
    text = text // '0'   ! no array is empty
  end function list_of_integers

  function list_of_reals(numbers) result(text)
    real(wp), intent(in) :: numbers(:)
    character(len=:), allocatable :: text
    integer :: i, start

    text = ''
    start = 0
    do i = 1, size(numbers)
      call append_number(text, start, to_text(numbers(i)))
    end do
    text = text // '0'
  end function list_of_reals

  !> Adds a number to a list, on a new line if the present one is full.
  subroutine append_number(text, start, number)
    character(len=:), allocatable, intent(inout) :: text
    integer, intent(inout) :: start   !! characters before the present line
    character(len=*), intent(in) :: number

    if (len(text) - start > width) then
      text = text // new_line(text)
      start = len(text)
    end if
    text = text // number // ', '
  end subroutine append_number

end module nocdyn_code_text
