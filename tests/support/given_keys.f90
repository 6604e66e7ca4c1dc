!> The keys of elements as tests give them to the constructors of banks; the ones that are not given have no values.
module nocdyn_test_given_keys
  use nocdyn_curves, only: curve_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: key_rules
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: keys

  integer, parameter :: longest_key = len(key_rules%name)

  !> Lists of numbers, the same for all elements.
  type :: given_list_t
    character(len=longest_key) :: key = ''
    real(wp), allocatable :: numbers(:, :)   !! [numbers, lanes], or of one lane for all
  end type given_list_t

  type, extends(element_keys_t), public :: given_keys_t
    integer, allocatable :: body(:)                       !! the first ones of all elements, then the second ones
    character(len=longest_key), allocatable :: given(:)   !! keys of numbers
    real(wp), allocatable :: number(:, :, :)              !! [lanes, elements, keys]
    type(given_list_t), allocatable :: list(:)
    character(len=longest_key) :: table = ''              !! key of the first list of `curve`
    type(curve_t), allocatable :: curve(:, :)             !! [lanes, elements]
  contains
    procedure :: has, values, numbers, curves, bodies
    procedure :: add_table
    generic :: add_list => add_numbers, add_lanes
    procedure, private :: add_numbers, add_lanes
  end type given_keys_t

contains

  !> Elements with keys of one number each.
  function keys(names, body, words, values, lanes) result(self)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)                !! as in the type
    character(len=*), intent(in) :: words         !! the keys, with blanks between them
    real(wp), intent(in) :: values(:)             !! one for each key, or [lanes, elements, keys]
    integer, intent(in), optional :: lanes        !! absent: 1, or as many as there are values for
    type(given_keys_t) :: self
    character(len=longest_key), allocatable :: given(:)
    integer :: begin, blank, k

    allocate (given(0))
    begin = 1
    do while (begin <= len_trim(words))
      blank = index(words(begin:) // ' ', ' ')
      given = [character(len=longest_key) :: given, words(begin:begin + blank - 2)]
      if (all(key_rules%name /= given(size(given)))) error stop 'nocdyn_test_given_keys: the schema has no such key'
      begin = begin + blank
    end do
    self%names = names
    self%body = body
    self%given = given
    if (size(values) > size(given)) self%lanes = size(values) / (size(given) * size(names))
    if (present(lanes)) self%lanes = lanes
    allocate (self%number(self%lanes, size(names), size(given)), self%list(0))
    if (size(values) == size(given)) then
      do k = 1, size(given)
        self%number(:, :, k) = values(k)
      end do
    else
      self%number = reshape(values, shape(self%number))
    end if
  end function keys

  !> Adds a list of numbers of all elements in every lane.
  subroutine add_numbers(self, key, numbers)
    class(given_keys_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: numbers(:)

    call self%add_list(key, reshape(numbers, [size(numbers), 1]))
  end subroutine add_numbers

  !> Adds a list of numbers of all elements.
  subroutine add_lanes(self, key, numbers)
    class(given_keys_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: numbers(:, :)   !! as in the type
    type(given_list_t), allocatable :: longer(:)
    integer :: i

    if (all(key_rules%name /= key)) error stop 'nocdyn_test_given_keys: the schema has no such key'
    allocate (longer(size(self%list) + 1))
    do i = 1, size(self%list)
      longer(i) = self%list(i)
    end do
    longer(size(longer))%key = key
    longer(size(longer))%numbers = numbers
    call move_alloc(longer, self%list)
  end subroutine add_lanes

  !> Adds a table of each element.
  subroutine add_table(self, key, curve)
    class(given_keys_t), intent(inout) :: self
    character(len=*), intent(in) :: key         !! of its first list
    type(curve_t), intent(in) :: curve(:, :)    !! [lanes, elements]

    self%table = key
    self%curve = curve
  end subroutine add_table

  pure logical function has(self, key)
    class(given_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: i

    has = any(self%given == key) .or. any([(self%list(i)%key == key, i=1, size(self%list))]) .or. self%table == key
  end function has

  pure function values(self, key, absent)
    class(given_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in), optional :: absent
    real(wp) :: values(self%lanes, size(self%names))
    real(wp), allocatable :: list(:)
    integer :: k, lane

    values = 0.0_wp
    if (present(absent)) values = absent
    do k = 1, size(self%given)
      if (self%given(k) == key) values = self%number(:, :, k)
    end do
    do lane = 1, merge(self%lanes, 0, size(self%names) > 0)
      list = self%numbers(key, lane, 1)
      if (size(list) > 0) values(lane, :) = list(1)
    end do
  end function values

  pure function numbers(self, key, lane, element)
    class(given_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: lane, element
    real(wp), allocatable :: numbers(:)
    integer :: i

    allocate (numbers(0))
    do i = 1, size(self%list)
      if (self%list(i)%key == key) numbers = self%list(i)%numbers(:, min(lane, size(self%list(i)%numbers, 2)))
    end do
  end function numbers

  function curves(self, x, y, extrapolation)
    class(given_keys_t), intent(in) :: self
    character(len=*), intent(in) :: x, y
    character(len=*), intent(in), optional :: extrapolation
    type(curve_t), allocatable :: curves(:, :)

    if (x /= self%table) error stop 'nocdyn_test_given_keys: no table is given'
    curves = self%curve
  end function curves

  function bodies(self, key, which)
    class(given_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: which
    integer :: bodies(size(self%names))

    bodies = self%body((which - 1) * size(self%names) + 1:which * size(self%names))
  end function bodies

end module nocdyn_test_given_keys
