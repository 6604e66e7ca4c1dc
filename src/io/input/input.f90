!> A checked input: the groups in the order of the file, every key of the schema with its value or default.
module nocdyn_input
  use nocdyn_diagnostics, only: diagnostics_t, most_shown, no_line
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: first_key, group_rules, key_rules
  use nocdyn_text, only: counted, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  !> The value of one key. One of the four arrays is allocated, that of the type of the key; none if the key has no value.
  type, public :: value_t
    logical :: is_given = .false.   !! by the file or by an override, not by default
    integer :: line = 0             !! of the key in the file
    integer :: override = 0         !! index of the override that sets it, 0: none
    integer :: unit = 0             !! in which numbers are written: index of `units`, 0: that of the schema
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
  end type group_t

  !> A whole input file with the overrides of the command line.
  type, public :: input_t
    character(len=:), allocatable :: file
    type(string_t), allocatable :: overrides(:)   !! PATH=VALUE, as given
    type(group_t), allocatable :: groups(:)       !! single groups that the file does not have come last
    logical :: takes_means = .false.              !! whether it is looked at in a steady state: means stand for ratios that
                                                  !! depend on the position, and joints are locked or open
    real(wp) :: means_at = huge(1.0_wp)           !! the time at which joints are so [s]; with it
    logical, allocatable :: overruns(:)           !! which joints are open then beside those without engagement, [groups]; not
                                                  !! allocated: none
  contains
    procedure :: groups_named   !! indices of the groups with a name, perhaps only those of one law
    procedure :: position       !! index of the group of a kind that occurs once
    procedure :: single         !! that group
    procedure :: title
    procedure :: shown_file     !! the path for messages
    procedure :: label          !! "&gear 'reducer'"
    procedure, private :: location_of_group, location_of_key
    generic :: location => location_of_group, location_of_key   !! where they come from, to begin a message with
    procedure :: report             !! adds a diagnostic on a key of a group
    procedure :: diagnostics_text   !! all messages with their locations
  end type input_t

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

  !> Indices of the groups of one kind.
  pure function groups_named(self, kind, law) result(indices)
    class(input_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    character(len=*), optional, intent(in) :: law   !! only those whose key `kind` has this value
    integer, allocatable :: indices(:)
    logical :: is_wanted(size(self%groups))
    integer :: i

    if (all(group_rules%name /= kind)) error stop 'nocdyn_input: the schema has no such group'
    do i = 1, size(self%groups)
      is_wanted(i) = self%groups(i)%kind == kind
      if (is_wanted(i) .and. present(law)) is_wanted(i) = self%groups(i)%text('kind') == law
    end do
    indices = pack([(i, i=1, size(is_wanted))], is_wanted)
  end function groups_named

  !> Index of the group of a kind that occurs once.
  pure integer function position(self, kind)
    class(input_t), intent(in) :: self
    character(len=*), intent(in) :: kind

    do position = 1, size(self%groups)
      if (self%groups(position)%kind == kind) return
    end do
    error stop 'nocdyn_input: position() is for groups that occur once'
  end function position

  !> The group of a kind that occurs once.
  pure function single(self, kind) result(group)
    class(input_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    type(group_t) :: group

    group = self%groups(self%position(kind))
  end function single

  !> The title of the file.
  pure function title(self)
    class(input_t), intent(in) :: self
    character(len=:), allocatable :: title

    title = self%groups(self%position('case'))%text('title')
  end function title

  !> "machine.nml:12: &gear 'reducer'".
  pure function location_of_group(self, index) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=source_length(self, self%groups(index)%line, 0) + 2 + label_length(self, index)) :: text

    text = source_text(self, self%groups(index)%line, 0) // ': ' // self%label(index)
  end function location_of_group

  !> The same with the line of `key` if the file sets it, or "--set PATH=VALUE: &gear 'reducer'" if an override does.
  pure function location_of_key(self, index, key) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: key
    character(len=key_source_length(self, index, key) + 2 + label_length(self, index)) :: text

    associate (value => self%groups(index)%values(self%groups(index)%key_position(key)))
      text = source_text(self, merge(value%line, self%groups(index)%line, value%line > 0), value%override) // ': ' // &
             self%label(index)
    end associate
  end function location_of_key

  pure integer function key_source_length(self, index, key) result(length)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=*), intent(in) :: key

    associate (value => self%groups(index)%values(self%groups(index)%key_position(key)))
      length = source_length(self, merge(value%line, self%groups(index)%line, value%line > 0), value%override)
    end associate
  end function key_source_length

  !> "machine.nml:12", or "--set PATH=VALUE" of an override.
  pure function source_text(input, line, override) result(text)
    class(input_t), intent(in) :: input
    integer, intent(in) :: line       !! 0 or `no_line`: the file as a whole
    integer, intent(in) :: override   !! index of the override, 0: none
    character(len=source_length(input, line, override)) :: text
    character(len=:), allocatable :: source

    call make_source(input, line, override, source)
    text = source
  end function source_text

  pure integer function source_length(input, line, override) result(length)
    class(input_t), intent(in) :: input
    integer, intent(in) :: line, override
    character(len=:), allocatable :: source

    call make_source(input, line, override, source)
    length = len(source)
  end function source_length

  pure subroutine make_source(input, line, override, source)
    class(input_t), intent(in) :: input
    integer, intent(in) :: line, override
    character(len=:), allocatable, intent(out) :: source

    if (override > 0) then
      source = '--set ' // shortened(input%overrides(override)%text)
    else
      source = shown_path(input%file)
      if (line > 0 .and. line < no_line) source = source // ':' // to_text(line)
    end if
  end subroutine make_source

  !> Adds a diagnostic on a key of a group, with the line of the key if it is given.
  subroutine report(self, group, key, text, diagnostics, code)
    class(input_t), intent(in) :: self
    integer, intent(in) :: group   !! its index
    character(len=*), intent(in) :: key, text
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, intent(in), optional :: code   !! exit code; exit_input if absent

    associate (value => self%groups(group)%values(self%groups(group)%key_position(key)))
      call diagnostics%add(max(value%line, self%groups(group)%line), group, text, value%override, code)
    end associate
  end subroutine report

  !> The first messages and how many more there are, one a line, each after its file and line or its override.
  function diagnostics_text(self, diagnostics) result(text)
    class(input_t), intent(in) :: self
    type(diagnostics_t), intent(in) :: diagnostics
    character(len=:), allocatable :: text
    type(text_buffer_t) :: buffer
    integer, allocatable :: order(:)
    integer :: i

    call diagnostics%sort_by_line(order)
    do i = 1, min(size(order), most_shown)
      associate (diagnostic => diagnostics%list(order(i)))
        if (i > 1) call buffer%append(new_line('a'))
        call buffer%append(source_text(self, diagnostic%line, diagnostic%override) // ': ')
        if (diagnostic%group > 0 .and. diagnostic%override == 0) call buffer%append(self%label(diagnostic%group) // ': ')
        call buffer%append(diagnostic%text)
      end associate
    end do
    if (size(order) > most_shown) call buffer%append(new_line('a') // self%shown_file() // ': ' // &
                                                     counted(size(order) - most_shown, 'more mistake', 'more mistakes') // &
                                                     '; the first ' // to_text(most_shown) // ' are shown')
    text = buffer%text()
  end function diagnostics_text

  !> The path as messages show it.
  pure function shown_file(self) result(text)
    class(input_t), intent(in) :: self
    character(len=source_length(self, 0, 0)) :: text

    text = shown_path(self%file)
  end function shown_file

  !> "&gear 'reducer'", for messages.
  pure function label(self, index) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=label_length(self, index)) :: text

    text = '&' // shortened(self%groups(index)%kind)
    if (len(self%groups(index)%name) > 0) text = trim(text) // ' ' // quoted(shortened(self%groups(index)%name))
  end function label

  pure integer function label_length(self, index) result(length)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index

    length = 1 + len(shortened(self%groups(index)%kind))
    if (len(self%groups(index)%name) > 0) length = length + 1 + len(quoted(shortened(self%groups(index)%name)))
  end function label_length

end module nocdyn_input
