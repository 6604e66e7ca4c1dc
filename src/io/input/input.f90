!> A checked input: the groups in the order of the file, every key of the schema with its value or default.
module nocdyn_input
  use nocdyn_diagnostics, only: diagnostics_t, most_shown, no_line
  use nocdyn_errors, only: add_error, error_t, raise
  use nocdyn_input_group, only: group_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: group_rules
  use nocdyn_text, only: counted, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: diagnostics_t, group_t, value_t

  !> A load case of a file.
  type, public :: load_case_t
    character(len=:), allocatable :: name, title
    real(wp) :: repeats = 1.0_wp                  !! how often it occurs in the life of the machine
    integer :: line = 0                           !! of its group
    type(string_t), allocatable :: overrides(:)   !! PATH=VALUE, which it sets
    type(string_t), allocatable :: analyses(:)    !! commands that compute it; none: all
    logical, allocatable :: lacks(:)              !! whether it leaves out a group, of the groups of the file
  contains
    procedure :: is_for
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
    procedure :: shown_case     !! the path and the load case for messages
    procedure :: name_case      !! puts them before a message
    procedure :: label          !! "&gear 'reducer'"
    procedure :: case_overrides !! number of the overrides that the load case gives
    procedure, private :: location_of_group, location_of_key
    generic :: location => location_of_group, location_of_key   !! where they come from, to begin a message with
    procedure :: place              !! where a key comes from, without the load case, for notes
    procedure :: report             !! adds a diagnostic on a key of a group
    procedure :: refuse, refuse_new   !! make an error of diagnostics
    procedure :: diagnostics_text   !! all messages with their locations
  end type input_t

contains

  !> Whether a command computes a load case.
  pure logical function is_for(self, analysis)
    class(load_case_t), intent(in) :: self
    character(len=*), intent(in) :: analysis   !! name of the command
    integer :: i

    is_for = size(self%analyses) == 0
    if (.not. is_for) is_for = any([(self%analyses(i)%text == analysis, i=1, size(self%analyses))])
  end function is_for

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
      if (len(self%groups(position)%kind) /= len(kind)) cycle   ! compared at once
      if (self%groups(position)%kind == kind) return
    end do
    error stop 'nocdyn_input: position() is for groups that occur once'
  end function position

  !> The group of a kind that occurs once.
  pure function single(self, kind) result(group)
    class(input_t), intent(in) :: self
    character(len=*), intent(in) :: kind
    type(group_t) :: group
    integer :: i

    i = self%position(kind)   ! in the next line gfortran asks for it again for each component
    group = self%groups(i)
  end function single

  !> The title of the file.
  pure function title(self)
    class(input_t), intent(in) :: self
    character(len=:), allocatable :: title

    title = self%groups(self%position('case'))%text('title')
  end function title

  !> "machine.nml:12: &gear 'reducer'", and the load case after the line.
  pure function location_of_group(self, index) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=location_length(self, index, '', .true.)) :: text
    character(len=:), allocatable :: location

    call make_location(self, index, '', .true., location)
    text = location
  end function location_of_group

  !> Location of a key: the line of `key` if the file sets it, or "--set PATH=VALUE: &gear 'reducer'" if an override does.
  pure function location_of_key(self, index, key) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: key
    character(len=location_length(self, index, key, .true.)) :: text
    character(len=:), allocatable :: location

    call make_location(self, index, key, .true., location)
    text = location
  end function location_of_key

  !> The location of a key without the load case, for what is said of it: notes and its report.
  pure function place(self, index, key) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: key   !! '': the group
    character(len=location_length(self, index, key, .false.)) :: text
    character(len=:), allocatable :: location

    call make_location(self, index, key, .false., location)
    text = location
  end function place

  pure integer function location_length(self, index, key, names_case) result(length)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=*), intent(in) :: key
    logical, intent(in) :: names_case
    character(len=:), allocatable :: location

    call make_location(self, index, key, names_case, location)
    length = len(location)
  end function location_length

  pure subroutine make_location(self, index, key, names_case, location)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=*), intent(in) :: key   !! '': the group
    logical, intent(in) :: names_case     !! whether a load case is named
    character(len=:), allocatable, intent(out) :: location
    integer :: line, override

    line = self%groups(index)%line
    override = 0
    if (key /= '') then
      associate (value => self%groups(index)%values(self%groups(index)%key_position(key)))
        if (value%line > 0) line = value%line
        override = value%override
      end associate
    end if
    call make_source(self, line, override, names_case, location)
    location = location // ': ' // self%label(index)
  end subroutine make_location

  !> "machine.nml:12: load case 'start'", or "--set PATH=VALUE" of an override.
  pure function source_text(input, line, override) result(text)
    class(input_t), intent(in) :: input
    integer, intent(in) :: line       !! 0 or `no_line`: the file as a whole
    integer, intent(in) :: override   !! index of the override, 0: none
    character(len=source_length(input, line, override)) :: text
    character(len=:), allocatable :: source

    call make_source(input, line, override, .true., source)
    text = source
  end function source_text

  pure integer function source_length(input, line, override) result(length)
    class(input_t), intent(in) :: input
    integer, intent(in) :: line, override
    character(len=:), allocatable :: source

    call make_source(input, line, override, .true., source)
    length = len(source)
  end function source_length

  pure subroutine make_source(input, line, override, names_case, source)
    class(input_t), intent(in) :: input
    integer, intent(in) :: line, override
    logical, intent(in) :: names_case   !! whether a load case is named
    character(len=:), allocatable, intent(out) :: source
    logical :: has_case

    has_case = names_case .and. allocated(input%load_case)
    source = shown_path(input%file)
    if (override > 0 .and. override <= input%case_overrides()) then
      source = source // ':' // to_text(input%load_case%line) // ': &load_case ' // &
               quoted(shortened(input%load_case%name)) // ': set ' // quoted(shortened(input%overrides(override)%text))
      return
    end if
    if (override == 0 .and. line > 0 .and. line < no_line) source = source // ':' // to_text(line)
    if (has_case) source = source // ': load case ' // quoted(shortened(input%load_case%name))
    if (override == 0) return
    if (has_case) then
      source = source // ': --set ' // shortened(input%overrides(override)%text)
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
  subroutine report(self, group, key, text, diagnostics, code, hint)
    class(input_t), intent(in) :: self
    integer, intent(in) :: group   !! its index
    character(len=*), intent(in) :: key, text
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, intent(in), optional :: code   !! exit code; exit_input if absent
    character(len=*), intent(in), optional :: hint   !! on what may have been meant; '' if absent

    associate (value => self%groups(group)%values(self%groups(group)%key_position(key)))
      if (value%override > 0) then   ! which may set a key of several groups
        call diagnostics%add(value%line, group, self%label(group) // ': ' // text, value%override, code, hint)
      else
        call diagnostics%add(merge(value%line, self%groups(group)%line, value%line > 0), group, text, code=code, hint=hint)
      end if
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
        call buffer%append(diagnostic%text // diagnostic%hint)
      end associate
    end do
    if (size(order) > most_shown) call buffer%append(new_line('a') // self%shown_file() // ': ' // &
                                                     counted(size(order) - most_shown, 'more mistake', 'more mistakes') // &
                                                     '; the first ' // to_text(most_shown) // ' are shown')
    text = buffer%text()
  end function diagnostics_text

  !> Adds what is wrong, if anything is, to an error or to none.
  subroutine refuse(self, diagnostics, error)
    class(input_t), intent(in) :: self
    type(diagnostics_t), intent(in) :: diagnostics
    type(error_t), allocatable, intent(inout) :: error
    type(error_t), allocatable :: own

    if (diagnostics%count == 0) return
    call raise(own, diagnostics%worst_code(), self%diagnostics_text(diagnostics))
    call add_error(error, own)
  end subroutine refuse

  !> Adds those mistakes of a load case to an error or to none that the machine itself does not have.
  subroutine refuse_new(self, diagnostics, known, error)
    class(input_t), intent(in) :: self   !! a load case
    type(diagnostics_t), intent(in) :: diagnostics, known   !! its mistakes, and the ones of the machine
    type(error_t), allocatable, intent(inout) :: error
    type(diagnostics_t) :: new
    integer :: i, k, override
    logical :: is_known

    do i = 1, diagnostics%count
      associate (own => diagnostics%list(i))
        override = max(0, own%override - self%case_overrides())   ! in the machine
        is_known = .false.
        if (own%override == 0 .or. override > 0) then   ! else the load case sets the value
          is_known = any([(known%list(k)%line == own%line .and. known%list(k)%override == override .and. &
                           known%list(k)%text == own%text, k=1, known%count)])
        end if
        if (.not. is_known) call new%add(own%line, own%group, own%text, own%override, own%code, own%hint)
      end associate
    end do
    call self%refuse(new, error)
  end subroutine refuse_new

  !> The path as messages show it.
  pure function shown_file(self) result(text)
    class(input_t), intent(in) :: self
    character(len=shown_length(self)) :: text

    text = shown_path(self%file)
  end function shown_file

  pure integer function shown_length(self) result(length)
    class(input_t), intent(in) :: self

    length = len(shown_path(self%file))
  end function shown_length

  !> "machine.nml", or "machine.nml: load case 'start'".
  pure function shown_case(self) result(text)
    class(input_t), intent(in) :: self
    character(len=source_length(self, 0, 0)) :: text

    text = source_text(self, 0, 0)
  end function shown_case

  !> Puts the path and the load case before a message that does not begin with the path.
  subroutine name_case(self, error)
    class(input_t), intent(in) :: self
    type(error_t), intent(inout) :: error

    if (index(error%message, self%shown_file()) /= 1) error%message = self%shown_case() // ': ' // error%message
  end subroutine name_case

  !> "&gear 'reducer'", for messages.
  pure function label(self, index) result(text)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index   !! of the group
    character(len=label_length(self, index)) :: text

    text = '&' // shortened(label_kind(self, index))
    if (len(self%groups(index)%name) > 0) text = trim(text) // ' ' // quoted(shortened(self%groups(index)%name))
  end function label

  !> The kind of a group in the file: the group itself, or the one that it is a part of.
  pure function label_kind(self, index) result(kind)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index
    character(len=len(self%groups(in_file(self, index))%kind)) :: kind

    kind = self%groups(in_file(self, index))%kind
  end function label_kind

  pure integer function in_file(self, index) result(group)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index

    group = index
    if (self%groups(index)%made_from > 0) group = self%groups(index)%made_from
  end function in_file

  pure integer function label_length(self, index) result(length)
    class(input_t), intent(in) :: self
    integer, intent(in) :: index

    length = 1 + len(shortened(label_kind(self, index)))
    if (len(self%groups(index)%name) > 0) length = length + 1 + len(quoted(shortened(self%groups(index)%name)))
  end function label_length

end module nocdyn_input
