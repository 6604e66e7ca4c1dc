!> A checked input: the groups in the order of the file, every key of the schema with its value or default.
module nocdyn_input
  use nocdyn_diagnostics, only: diagnostics_t, most_shown, no_line
  use nocdyn_input_group, only: group_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: group_rules
  use nocdyn_text, only: counted, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: group_t, value_t

  !> A load case of a file.
  type, public :: load_case_t
    character(len=:), allocatable :: name, title
    real(wp) :: repeats = 1.0_wp                  !! how often it occurs in the life of the machine
    integer :: line = 0                           !! of its group
    type(string_t), allocatable :: overrides(:)   !! PATH=VALUE, which it sets
    logical, allocatable :: lacks(:)              !! whether it leaves out a group, of the groups of the file
  end type load_case_t

  !> A whole input file with the overrides of the command line: the machine itself, or one of its load cases.
  type, public :: input_t
    character(len=:), allocatable :: file
    type(string_t), allocatable :: overrides(:)   !! PATH=VALUE, as given; the ones of a load case come first
    type(load_case_t), allocatable :: load_case       !! the one of this input; not allocated: the machine itself
    type(load_case_t), allocatable :: load_cases(:)   !! the ones of the file; of the machine itself
    type(group_t), allocatable :: groups(:)       !! single groups that the file does not have come last
  contains
    procedure :: groups_named   !! indices of the groups with a name, perhaps only the ones of one law
    procedure :: position       !! index of the group of a kind that occurs once
    procedure :: single         !! that group
    procedure :: title
    procedure :: shown_file     !! the path for messages
    procedure :: shown_case     !! the same with the load case
    procedure :: label          !! "&gear 'reducer'"
    procedure :: case_overrides !! number of the overrides that the load case gives
    procedure, private :: location_of_group, location_of_key
    generic :: location => location_of_group, location_of_key   !! where they come from, to begin a message with
    procedure :: report             !! adds a diagnostic on a key of a group
    procedure :: diagnostics_text   !! all messages with their locations
  end type input_t

contains

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

  !> Location of a key: the line of `key` if the file sets it, or "--set PATH=VALUE: &gear 'reducer'" if an override does.
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

    if (override == 0) then
      source = shown_path(input%file)
      if (line > 0 .and. line < no_line) source = source // ':' // to_text(line)
      return
    end if
    if (override <= input%case_overrides()) then
      source = shown_path(input%file) // ':' // to_text(input%load_case%line) // ': &load_case ' // &
               quoted(shortened(input%load_case%name)) // ': set ' // quoted(shortened(input%overrides(override)%text))
    else
      source = '--set ' // shortened(input%overrides(override)%text)
    end if
  end subroutine make_source

  !> The number of overrides that the load case gives; they come first.
  pure integer function case_overrides(self) result(count)
    class(input_t), intent(in) :: self

    count = 0
    if (allocated(self%load_case)) count = size(self%load_case%overrides)
  end function case_overrides

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

  !> "machine.nml", or "machine.nml: load case 'start'".
  pure function shown_case(self) result(text)
    class(input_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = self%shown_file()
    if (allocated(self%load_case)) text = text // ': load case ' // quoted(shortened(self%load_case%name))
  end function shown_case

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
