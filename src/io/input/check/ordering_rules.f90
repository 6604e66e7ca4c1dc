!> Numbers of one group that stand in an order, and the sentences on those that do not.
module nocdyn_ordering_rules
  use nocdyn_input, only: group_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: group_rules, orders
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: applies, find_order_keys, ordering_message, ascending_message, teeth_message

contains

  !> Whether row `o` of `orders` is about the keys of a group.
  pure logical function applies(o, group)
    integer, intent(in) :: o
    type(group_t), intent(in) :: group

    applies = orders(o)%group == group_rules(group%rule)%name
  end function applies

  !> The two keys of a row of `orders`, as indices of the group's values.
  pure subroutine find_order_keys(o, group, lower, upper)
    integer, intent(in) :: o
    type(group_t), intent(in) :: group
    integer, intent(out) :: lower, upper

    lower = group%key_position(trim(orders(o)%lower))
    upper = group%key_position(trim(orders(o)%upper))
  end subroutine find_order_keys

  !> What is wrong with two keys by row `o` of `orders`, '' if nothing is.
  function ordering_message(o, group) result(message)
    integer, intent(in) :: o
    type(group_t), intent(in) :: group
    character(len=:), allocatable :: message
    integer :: lower, upper

    message = ''
    call find_order_keys(o, group, lower, upper)
    associate (low => group%values(lower), high => group%values(upper))
      if (.not. (allocated(low%numbers) .and. allocated(high%numbers))) return
      if (high%numbers(1) > low%numbers(1)) return
      if (orders(o)%alone /= '' .and. high%numbers(1) >= low%numbers(1)) return
      message = trim(orders(o)%upper) // ' = ' // to_text(high%numbers(1)) // ' is out of range; allowed: ' // &
                  trim(merge('>= ', '>  ', is_alone(o, group))) // ' ' // trim(orders(o)%lower) // ' = ' // &
                  to_text(low%numbers(1))
    end associate
  end function ordering_message

  !> Whether a group has one value only where row `o` of `orders` then allows two equal ends.
  pure logical function is_alone(o, group)
    integer, intent(in) :: o
    type(group_t), intent(in) :: group

    is_alone = .false.
    if (orders(o)%alone == '') return
    if (group%has_value(trim(orders(o)%alone))) is_alone = group%whole_number(trim(orders(o)%alone)) == 1
  end function is_alone

  !> What is wrong with number `i` of an ascending list if it is not above the one before it, else ''.
  function ascending_message(key, numbers, i) result(message)
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: numbers(:)
    integer, intent(in) :: i   !! 2 to size(numbers)
    character(len=:), allocatable :: message

    message = ''
    if (numbers(i) > numbers(i - 1)) return
    message = element(key, numbers, i) // ' is not above ' // element(key, numbers, i - 1) // '; needed: ascending values'
  end function ascending_message

  !> "table_speed(3) = 12".
  function element(key, numbers, i) result(text)
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: numbers(:)
    integer, intent(in) :: i
    character(len=:), allocatable :: text

    text = key // '(' // to_text(i) // ') = ' // to_text(numbers(i))
  end function element

  !> What is wrong with the teeth of a &planetary, '' if nothing is.
  pure function teeth_message(group) result(message)
    type(group_t), intent(in) :: group
    character(len=:), allocatable :: message

    message = ''
    associate (value => group%values(group%key_position('teeth')))
      if (.not. allocated(value%whole_numbers)) return
      if (size(value%whole_numbers) /= 2) return
      if (value%whole_numbers(2) > value%whole_numbers(1)) return
      message = 'teeth = ' // to_text(value%whole_numbers(1)) // ', ' // to_text(value%whole_numbers(2)) // &
                  ' leave no room for planets; allowed: sun, ring with ring > sun'
    end associate
  end function teeth_message

end module nocdyn_ordering_rules
