!> The keys and numbers of an input as its file has them, for messages: table_driven_deg(2) = 30. Threads of a sweep make such
!> messages, so that the length of each text is found before it.
module nocdyn_written_values
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_schema_text, only: number_text
  use nocdyn_text, only: lower_case, rounded_text, to_text
  use nocdyn_units, only: from_si, units
  implicit none (type, external)
  private

  public :: written_key, written_number, written_element, written_unit, speed_text, unit_of, shared_unit

contains

  !> Name of a key in the unit in which it is written: "table_driven_deg".
  pure function written_key(group, key) result(text)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    character(len=key_length(group, key)) :: text

    text = key
    associate (unit => unit_of(group, key))
      if (unit > 0) text = key // '_' // lower_case(units(unit)%name)
    end associate
  end function written_key

  pure integer function key_length(group, key) result(length)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    length = len(key)
    associate (unit => unit_of(group, key))
      if (unit > 0) length = length + 1 + len_trim(units(unit)%name)
    end associate
  end function key_length

  !> A number in the unit in which a key is written: "30".
  pure function written_number(group, key, value) result(text)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: value   !! in the unit of the schema
    character(len=len(number_text(value, unit_of(group, key)))) :: text

    text = number_text(value, unit_of(group, key))
  end function written_number

  !> One number of a list: "table_driven_deg(2) = 30".
  pure function written_element(group, key, i) result(text)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key   !! of numbers
    integer, intent(in) :: i              !! in the list
    character(len=element_length(group, key, i)) :: text

    text = written_key(group, key) // '(' // to_text(i) // ') = ' // written_number(group, key, number_of(group, key, i))
  end function written_element

  pure integer function element_length(group, key, i) result(length)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    integer, intent(in) :: i

    length = len(written_key(group, key)) + len(to_text(i)) + 5 + len(written_number(group, key, number_of(group, key, i)))
  end function element_length

  !> The unit in which a key is written: "deg", "rad".
  pure function written_unit(group, key) result(text)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    character(len=unit_length(group, key)) :: text

    associate (unit => unit_of(group, key))
      if (unit > 0) then
        text = units(unit)%name
      else
        text = key_rules(first_key(group%rule) + group%key_position(key) - 1)%unit
      end if
    end associate
  end function written_unit

  pure integer function unit_length(group, key) result(length)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    associate (unit => unit_of(group, key))
      if (unit > 0) then
        length = len_trim(units(unit)%name)
      else
        length = len_trim(key_rules(first_key(group%rule) + group%key_position(key) - 1)%unit)
      end if
    end associate
  end function unit_length

  !> A speed with its unit: "100 rpm".
  pure function speed_text(speed, unit, digits) result(text)
    real(wp), intent(in) :: speed   !! [rad/s]
    integer, intent(in) :: unit     !! index of `units`, 0: rad/s
    integer, intent(in) :: digits   !! to which it is rounded
    character(len=len(rounded_text(from_si(speed, unit), digits)) + 1 + merge(len('rad/s'), len('rpm'), unit == 0)) :: text

    text = rounded_text(from_si(speed, unit), digits) // ' rad/s'
    if (unit > 0) text = rounded_text(from_si(speed, unit), digits) // ' ' // units(unit)%name
  end function speed_text

  !> The unit in which all groups of a kind that give a key write it: index of `units`, 0: the one of the schema, or several.
  pure integer function shared_unit(input, kind, key) result(unit)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, key
    integer :: i
    logical :: is_first

    unit = 0
    is_first = .true.
    do i = 1, size(input%groups)
      if (input%groups(i)%kind /= kind) cycle
      if (.not. input%groups(i)%is_given(key)) cycle
      if (is_first) unit = unit_of(input%groups(i), key)
      if (unit /= unit_of(input%groups(i), key)) unit = 0
      if (unit == 0) return
      is_first = .false.
    end do
  end function shared_unit

  !> The unit in which a key is written: index of `units`, 0: the one of the schema.
  pure integer function unit_of(group, key)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    unit_of = group%values(group%key_position(key))%unit
  end function unit_of

  pure real(wp) function number_of(group, key, i)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    integer, intent(in) :: i

    number_of = group%values(group%key_position(key))%number_at(i)
  end function number_of

end module nocdyn_written_values
