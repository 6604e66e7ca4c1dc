!> The complete input of a computation as a namelist that can be read again.
module nocdyn_input_text
  use nocdyn_input, only: group_t, input_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_printable, only: in_quotes
  use nocdyn_text, only: string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: input_text

  integer, parameter :: line_width = 100

contains

  !> A namelist with every key that has a value, defaults and overrides included, but for values that follow from others. Numbers
  !> read back as the same bits.
  function input_text(input) result(text)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer :: g

    call buffer%append_line('! The complete input of a run: every key with the value that was used.')
    do g = 1, size(input%groups)
      if (input%groups(g)%made_from > 0) cycle
      call append_group(buffer, input%groups(g))
    end do
    text = buffer%text()
  end function input_text

  !> Appends one group.
  subroutine append_group(buffer, group)
    type(text_buffer_t), intent(inout) :: buffer
    type(group_t), intent(in) :: group
    type(string_t), allocatable :: items(:)
    integer :: i, k

    call buffer%append_line('&' // group%kind)
    do i = 1, size(group%values)
      associate (rule => key_rules(first_key(group%rule) + i - 1))
        if (rule%follows .and. .not. group%values(i)%is_given .or. group%values(i)%is_derived) cycle
        allocate (items(group%values(i)%count()))
        do k = 1, size(items)
          if (allocated(group%values(i)%numbers)) then
            items(k)%text = to_text(group%values(i)%numbers(k))
          else if (allocated(group%values(i)%whole_numbers)) then
            items(k)%text = to_text(group%values(i)%whole_numbers(k))
          else if (allocated(group%values(i)%flags)) then
            items(k)%text = trim(merge('.true. ', '.false.', group%values(i)%flags(k)))
          else
            items(k)%text = in_quotes(group%values(i)%texts(k)%text, "'")
          end if
        end do
        if (size(items) > 0) call append_key(buffer, trim(rule%name), items)
        deallocate (items)
      end associate
    end do
    call buffer%append_line('/')
  end subroutine append_group

  !> Appends `key = items`, on several lines if it is long.
  subroutine append_key(buffer, key, items)
    type(text_buffer_t), intent(inout) :: buffer
    character(len=*), intent(in) :: key
    type(string_t), intent(in) :: items(:)
    character(len=:), allocatable :: line
    integer :: i

    line = '  ' // key // ' = ' // items(1)%text
    do i = 2, size(items)
      line = line // ','
      if (len(line) + len(items(i)%text) >= line_width) then
        call buffer%append_line(line)
        line = '   '
      end if
      line = line // ' ' // items(i)%text
    end do
    call buffer%append_line(line)
  end subroutine append_key

end module nocdyn_input_text
