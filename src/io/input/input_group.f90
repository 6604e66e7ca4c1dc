!> One group of an input: its keys in the order of the schema, each with its values.
module nocdyn_input_group
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  !> The value of one key. One of the four arrays is allocated, the one of the type of the key; none if the key has no value.
  type, public :: value_t
    logical :: is_given = .false.   !! by the file or by an override, not by default
    integer :: line = 0             !! of the key in the file
    integer :: override = 0         !! index of the override that sets it, 0: none
    logical :: is_derived = .false. !! from other groups or files that are written
    integer :: unit = 0             !! in which numbers are written: index of `units`, 0: the one of the schema
    real(wp), allocatable :: numbers(:)
    integer, allocatable :: whole_numbers(:)
    logical, allocatable :: flags(:)
    type(string_t), allocatable :: texts(:)
  contains
    procedure :: count => count_of
    procedure :: has_any, number_at
  end type value_t

  !> One group of the file. To ask for a key that the schema does not have, or for another type, is an error of the program.
  type, public :: group_t
    character(len=:), allocatable :: kind   !! 'body', 'gear' ...
    character(len=:), allocatable :: name   !! of the element, '' where the kind has no names
    integer :: rule = 0                     !! its row of `group_rules`
    integer :: ordinal = 0                  !! its number among the groups of its kind, 0: not in the file
    integer :: line = 0                     !! where it begins, 0: not in the file
    integer :: made_from = 0                !! group that it is a part of, which is in the file; 0: none
    type(value_t), allocatable :: values(:) !! one for each key, in the order of the schema
  contains
    procedure :: number          !! the single value of a key
    procedure :: whole_number
    procedure :: flag
    procedure :: text
    procedure :: numbers         !! all values, empty if unset
    procedure :: whole_numbers
    procedure :: texts
    procedure :: is_given        !! set by the user
    procedure :: has_value       !! set by the user or by default
    procedure :: key_position    !! index in `values`
    procedure :: set_number
  end type group_t

contains

  !> Whether a key has a value, perhaps an empty list.
  pure logical function has_any(self)
    class(value_t), intent(in) :: self

    has_any = allocated(self%numbers) .or. allocated(self%whole_numbers) .or. allocated(self%flags) .or. allocated(self%texts)
  end function has_any

  !> How many values a key has.
  pure integer function count_of(self)
    class(value_t), intent(in) :: self

    count_of = 0
    if (allocated(self%numbers)) count_of = size(self%numbers)
    if (allocated(self%whole_numbers)) count_of = size(self%whole_numbers)
    if (allocated(self%flags)) count_of = size(self%flags)
    if (allocated(self%texts)) count_of = size(self%texts)
  end function count_of

  !> One value of a key of numbers or whole numbers.
  pure real(wp) function number_at(self, position)
    class(value_t), intent(in) :: self
    integer, intent(in) :: position   !! in the list

    if (allocated(self%whole_numbers)) then
      number_at = real(self%whole_numbers(position), wp)
    else
      number_at = self%numbers(position)
    end if
  end function number_at

  !> The single value of a key.
  pure real(wp) function number(self, key, absent)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    real(wp), optional, intent(in) :: absent   !! result if the key has no value
    integer :: k

    k = self%key_position(key)
    if (allocated(self%values(k)%numbers)) then
      number = self%values(k)%numbers(1)
    else if (present(absent)) then
      number = absent
    else
      error stop 'nocdyn_input: number() of a key without a number'
    end if
  end function number

  !> The single value of a key of whole numbers, which must have one.
  pure integer function whole_number(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: k

    k = self%key_position(key)
    if (.not. allocated(self%values(k)%whole_numbers)) error stop 'nocdyn_input: whole_number() of a key without one'
    whole_number = self%values(k)%whole_numbers(1)
  end function whole_number

  !> The single value of a logical key, which must have one.
  pure logical function flag(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: k

    k = self%key_position(key)
    if (.not. allocated(self%values(k)%flags)) error stop 'nocdyn_input: flag() of a key without a logical value'
    flag = self%values(k)%flags(1)
  end function flag

  !> The single value of a key of texts, which must have one.
  pure function text(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    character(len=text_length(self, key)) :: text

    text = self%values(self%key_position(key))%texts(1)%text
  end function text

  pure integer function text_length(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: k

    k = self%key_position(key)
    if (.not. allocated(self%values(k)%texts)) error stop 'nocdyn_input: text() of a key without a text'
    text_length = len(self%values(k)%texts(1)%text)
  end function text_length

  !> All values of a key, none if it has no value.
  pure function numbers(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    real(wp), allocatable :: numbers(:)

    allocate (numbers(0))
    associate (value => self%values(self%key_position(key)))
      if (allocated(value%numbers)) numbers = value%numbers
    end associate
  end function numbers

  !> All values of a key, none if it has no value.
  pure function whole_numbers(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, allocatable :: whole_numbers(:)

    allocate (whole_numbers(0))
    associate (value => self%values(self%key_position(key)))
      if (allocated(value%whole_numbers)) whole_numbers = value%whole_numbers
    end associate
  end function whole_numbers

  !> All values of a key, none if it has no value.
  pure function texts(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    type(string_t), allocatable :: texts(:)

    allocate (texts(0))
    associate (value => self%values(self%key_position(key)))
      if (allocated(value%texts)) texts = value%texts
    end associate
  end function texts

  !> Whether the user sets the key.
  pure logical function is_given(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key

    is_given = self%values(self%key_position(key))%is_given
  end function is_given

  !> Whether the key has a value, set by the user or by default.
  pure logical function has_value(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key

    has_value = self%values(self%key_position(key))%has_any()
  end function has_value

  !> Sets the only number of a key.
  pure subroutine set_number(self, key, value)
    class(group_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: value   !! in the unit of the schema

    self%values(self%key_position(key))%numbers = [value]
  end subroutine set_number

  !> Index of a key in `values`.
  pure integer function key_position(self, key)
    class(group_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: first

    first = first_key(self%rule) - 1
    do key_position = 1, size(self%values)
      if (key_rules(first + key_position)%name(1:1) /= key(1:1)) cycle   ! faster than a comparison of the names
      if (key_rules(first + key_position)%name == key) return
    end do
    error stop 'nocdyn_input: the schema has no such key'
  end function key_position

end module nocdyn_input_group
