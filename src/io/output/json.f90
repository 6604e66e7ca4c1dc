!> A JSON text that is built key by key. On request its numbers are kept too, each with its path, such as 'modes[2].frequency_Hz'.
module nocdyn_json
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_printable, only: as_utf_8
  use nocdyn_text, only: string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  public :: has_utf_8

  integer, parameter :: most_levels = 16
  integer, parameter :: most_held = 65536   ! characters that wait for being written to a file

  !> Nested objects and lists in the order of the calls, indented by two blanks per level.
  type, public :: json_t
    logical :: keeps_numbers = .false.               !! whether `paths` and `numbers` are filled
    type(string_t), allocatable :: paths(:)          !! of the numbers, [at least `count`]
    real(wp), allocatable :: numbers(:)              !! [at least `count`]
    integer :: count = 0
    type(text_buffer_t), private :: buffer
    type(output_file_t), pointer, private :: file => null()   !! that gets the text
    integer, private :: depth = 0                    !! number of open objects and lists
    logical, private :: is_first = .true.            !! the next member or item is the first one
    character(len=:), allocatable, private :: path   !! of what is open; allocated if numbers are kept
    integer, private :: lengths(most_levels) = 0     !! of the paths around it
    integer, private :: items(most_levels) = 0       !! of each open list so far
  contains
    procedure :: find => find_number
    procedure :: open => open_object
    procedure :: open_report
    procedure :: close => close_object
    procedure :: open_list, close_list, write_to, text
    generic :: put => put_text, put_texts, put_number, put_numbers, put_flag, put_integer, put_integers, put_members
    procedure, private :: put_text, put_texts, put_number, put_numbers, put_flag, put_integer, put_integers, put_members
    procedure, private :: begin_member, begin_item, begin_level, end_level, keep
  end type json_t

contains

  !> Begins an object. The outermost object and the objects in a list have no key.
  subroutine open_object(self, key)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in), optional :: key

    if (present(key)) then
      call self%begin_member(key)
      call self%begin_level('{', key)
    else
      if (self%depth > 0) call self%begin_item()
      call self%begin_level('{')
    end if
  end subroutine open_object

  !> Begins the outermost object, the one of a report: the program, how a computation ended, the input.
  subroutine open_report(self, input, title, status, message)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: input, title                !! path and title of the input
    character(len=*), optional, intent(in) :: status, message   !! 'done' or another end, and its reason

    call self%open()
    call self%put('program', 'nocdyn')
    call self%put('version', version)
    call self%put('compiler', compiler_text)
    if (present(status)) call self%put('status', trim(status))
    if (present(message)) call self%put('message', message)
    call self%put('input', input)
    call self%put('title', title)
  end subroutine open_report

  !> Ends the object that was opened last.
  subroutine close_object(self)
    class(json_t), intent(inout) :: self

    call self%end_level('}')
    if (self%depth == 0) call self%buffer%append(new_line('a'))
    if (.not. associated(self%file)) return
    if (self%depth > 0 .and. self%buffer%length < most_held) return
    call self%file%put(self%buffer%text())
    call self%buffer%clear()
  end subroutine close_object

  !> Writes the text to a file as it grows, before the first object is opened; `text` has no use then.
  subroutine write_to(self, file)
    class(json_t), intent(inout) :: self
    type(output_file_t), target, intent(inout) :: file   !! open until the outermost object is closed

    self%file => file
  end subroutine write_to

  !> Begins a list of objects.
  subroutine open_list(self, key)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key

    call self%begin_member(key)
    call self%begin_level('[', key)
  end subroutine open_list

  !> Ends the list that was opened last.
  subroutine close_list(self)
    class(json_t), intent(inout) :: self

    call self%end_level(']')
  end subroutine close_list

  !> Begins an object or a list; without a key it is an item of a list, or the outermost object.
  subroutine begin_level(self, bracket, key)
    class(json_t), intent(inout) :: self
    character(len=1), intent(in) :: bracket
    character(len=*), intent(in), optional :: key

    call self%buffer%append(bracket)
    self%is_first = .true.
    if (self%keeps_numbers) then
      if (.not. allocated(self%path)) self%path = ''
      if (self%depth > 0) self%lengths(self%depth) = len(self%path)
      if (present(key)) then
        self%path = member_path(self%path, key)
      else if (self%depth > 0) then
        self%items(self%depth) = self%items(self%depth) + 1
        self%path = self%path // '[' // to_text(self%items(self%depth)) // ']'
      end if
      self%items(self%depth + 1) = 0
    end if
    self%depth = self%depth + 1
  end subroutine begin_level

  !> The path of a member of an object.
  pure function member_path(path, key)
    character(len=*), intent(in) :: path, key
    character(len=len(path) + len(key) + merge(1, 0, path /= '')) :: member_path

    member_path = key
    if (path /= '') member_path = path // '.' // key
  end function member_path

  !> Keeps the number of a member, on request.
  subroutine keep(self, key, value)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: value
    type(string_t), allocatable :: paths(:)
    integer :: i

    if (.not. self%keeps_numbers) return
    if (.not. allocated(self%paths)) allocate (self%paths(100), self%numbers(100))
    if (self%count == size(self%paths)) then
      allocate (paths(2 * self%count))
      do i = 1, self%count
        call move_alloc(self%paths(i)%text, paths(i)%text)
      end do
      call move_alloc(paths, self%paths)
      self%numbers = [self%numbers, self%numbers]
    end if
    self%count = self%count + 1
    self%paths(self%count)%text = member_path(self%path, key)
    self%numbers(self%count) = value
  end subroutine keep

  !> The place in `numbers` of the number with a path; 0 if none was kept.
  pure integer function find_number(self, path) result(found)
    class(json_t), intent(in) :: self
    character(len=*), intent(in) :: path

    do found = self%count, 1, -1
      if (self%paths(found)%text == path) return
    end do
  end function find_number

  !> Ends an object or a list.
  subroutine end_level(self, bracket)
    class(json_t), intent(inout) :: self
    character(len=1), intent(in) :: bracket

    self%depth = self%depth - 1
    if (self%keeps_numbers .and. self%depth > 0) self%path = self%path(:self%lengths(self%depth))
    if (.not. self%is_first) call self%buffer%append(new_line('a') // repeat('  ', self%depth))
    call self%buffer%append(bracket)
    self%is_first = .false.
  end subroutine end_level

  !> The text so far.
  pure function text(self)
    class(json_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = self%buffer%text()
  end function text

  !> A text.
  subroutine put_text(self, key, value)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key, value

    call self%begin_member(key)
    call append_string(self%buffer, value)
  end subroutine put_text

  !> A list of texts, on one line.
  subroutine put_texts(self, key, values)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    type(string_t), intent(in) :: values(:)
    type(string_t) :: items(size(values))
    integer :: i

    do i = 1, size(values)
      items(i)%text = escaped(values(i)%text)
    end do
    call put_list(self, key, items)
  end subroutine put_texts

  !> Items that are JSON already, on one line.
  subroutine put_list(self, key, items)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    type(string_t), intent(in) :: items(:)
    integer :: i

    call self%begin_member(key)
    call self%buffer%append('[')
    do i = 1, size(items)
      if (i > 1) call self%buffer%append(', ')
      call self%buffer%append(items(i)%text)
    end do
    call self%buffer%append(']')
  end subroutine put_list

  !> A number, null if it is not finite: JSON has no such numbers.
  subroutine put_number(self, key, value)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: value

    call self%begin_member(key)
    call append_number(self%buffer, value)
    call self%keep(key, value)
  end subroutine put_number

  !> A list of numbers, on one line.
  subroutine put_numbers(self, key, values)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: values(:)
    integer :: i

    call self%begin_member(key)
    call self%buffer%append('[')
    do i = 1, size(values)
      if (i > 1) call self%buffer%append(', ')
      call append_number(self%buffer, values(i))
      if (self%keeps_numbers) call self%keep(key // '[' // to_text(i) // ']', values(i))   ! its path costs more than the number
    end do
    call self%buffer%append(']')
  end subroutine put_numbers

  subroutine append_number(buffer, value)
    type(text_buffer_t), intent(inout) :: buffer
    real(wp), intent(in) :: value

    if (ieee_is_finite(value)) then
      call buffer%append_number(value)
    else
      call buffer%append('null')
    end if
  end subroutine append_number

  !> A logical value.
  subroutine put_flag(self, key, value)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    logical, intent(in) :: value

    call self%begin_member(key)
    call self%buffer%append(trim(merge('true ', 'false', value)))
    call self%keep(key, merge(1.0_wp, 0.0_wp, value))
  end subroutine put_flag

  !> A whole number.
  subroutine put_integer(self, key, value)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: value

    call self%begin_member(key)
    call self%buffer%append(to_text(value))
    call self%keep(key, real(value, wp))
  end subroutine put_integer

  !> A list of whole numbers, on one line.
  subroutine put_integers(self, key, values)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: values(:)
    type(string_t) :: items(size(values))
    integer :: i

    do i = 1, size(values)
      items(i)%text = to_text(values(i))
    end do
    call put_list(self, key, items)
  end subroutine put_integers

  !> An object of numbers.
  subroutine put_members(self, key, labels, values)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    type(string_t), intent(in) :: labels(:)
    real(wp), intent(in) :: values(:)   !! [labels]
    integer :: i

    call self%open(key)
    do i = 1, size(labels)
      call self%put(labels(i)%text, values(i))
    end do
    call self%close()
  end subroutine put_members

  !> Begins a member of an object.
  subroutine begin_member(self, key)
    class(json_t), intent(inout) :: self
    character(len=*), intent(in) :: key

    call self%begin_item()
    call append_string(self%buffer, key)
    call self%buffer%append(': ')
  end subroutine begin_member

  !> Begins a line, after a comma if the member or item is not the first.
  subroutine begin_item(self)
    class(json_t), intent(inout) :: self

    if (.not. self%is_first) call self%buffer%append(',')
    call self%buffer%append(new_line('a') // repeat('  ', self%depth))
    self%is_first = .false.
  end subroutine begin_item

  !> Appends a JSON string with its quotes; most texts need no escapes.
  subroutine append_string(buffer, text)
    type(text_buffer_t), intent(inout) :: buffer
    character(len=*), intent(in) :: text
    integer :: i, others

    others = 0
    do i = 1, len(text)
      associate (code => iachar(text(i:i)))
        others = others + merge(1, 0, code < 32 .or. code > 126 .or. code == iachar('"') .or. code == iachar('\'))
      end associate
    end do
    if (others > 0) then
      call buffer%append(escaped(text))
      return
    end if
    call buffer%append('"')
    call buffer%append(text)
    call buffer%append('"')
  end subroutine append_string

  !> A JSON string with its quotes. Control characters, which no input contains, become blanks.
  function escaped(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: escaped
    type(text_buffer_t) :: buffer
    character(len=:), allocatable :: utf_8
    integer :: i

    utf_8 = as_utf_8(text)
    call buffer%append('"')
    do i = 1, len(utf_8)
      select case (utf_8(i:i))
      case ('"', '\')
        call buffer%append('\' // utf_8(i:i))
      case (achar(10))
        call buffer%append('\n')
      case (achar(0):achar(9), achar(11):achar(31))
        call buffer%append(' ')
      case default
        call buffer%append(utf_8(i:i))
      end select
    end do
    call buffer%append('"')
    escaped = buffer%text()
  end function escaped

  !> Whether a text is valid UTF-8 and has characters that are not ASCII.
  pure logical function has_utf_8(text)
    character(len=*), intent(in) :: text
    integer :: i

    has_utf_8 = .false.
    do i = 1, len(text)
      has_utf_8 = has_utf_8 .or. iachar(text(i:i)) > 127
    end do
    has_utf_8 = has_utf_8 .and. as_utf_8(text) == text
  end function has_utf_8

end module nocdyn_json
