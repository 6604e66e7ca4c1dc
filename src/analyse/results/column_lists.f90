!> Columns of tables of results: their labels, and columns.json, which says what they are.
module nocdyn_column_lists
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: string_t
  use nocdyn_units, only: unit_for, units
  implicit none (type, external)
  private

  character(len=*), parameter, public :: columns_file = 'columns.json'

  !> A column: a signal, or a statistic of it such as 'half_range', whose label begins with this word.
  type :: column_t
    type(signal_t) :: signal
    character(len=:), allocatable :: statistic, label, unit
  end type column_t

  !> The columns of one table, appended one by one in amortised constant time.
  type, public :: column_list_t
    integer :: count = 0
    character(len=:), allocatable, private :: file          !! the table; not allocated: values that only a report has
    integer, allocatable, private :: wanted(:)              !! units that columns have if they fit: indices of `units`
    type(column_t), allocatable, private :: list(:)
    integer, allocatable, private :: unit(:)
  contains
    procedure :: start, add, add_named, list_columns, put
  end type column_list_t

contains

  !> Begins the list of a table.
  subroutine start(self, file, wanted)
    class(column_list_t), intent(out) :: self
    character(len=*), intent(in) :: file      !! its name; '' for values that only a report has
    integer, intent(in) :: wanted(:)          !! units that columns have if they fit: indices of `units`

    self%file = file
    allocate (self%list(16), self%unit(16))
    allocate (self%wanted, source=wanted)
  end subroutine start

  !> Appends a signal, or a statistic of it.
  subroutine add(self, signal, statistic, unit)
    class(column_list_t), intent(inout) :: self
    type(signal_t), intent(in) :: signal
    character(len=*), intent(in), optional :: statistic   !! such as 'half_range'; absent: the signal itself
    character(len=*), intent(in), optional :: unit        !! in SI; absent: as for the signal
    type(column_t), allocatable :: longer(:)
    integer :: i

    if (self%count == size(self%list)) then
      allocate (longer(2 * self%count))
      do i = 1, self%count
        longer(i) = self%list(i)
      end do
      call move_alloc(longer, self%list)
      self%unit = [self%unit, self%unit]
    end if
    self%count = self%count + 1
    associate (one => self%list(self%count))
      one%signal = signal
      one%statistic = ''
      one%unit = signal%unit
      one%label = signal%name
      if (present(unit)) one%unit = unit
      if (present(statistic)) then
        one%statistic = statistic
        one%label = statistic // '_' // signal%name
      end if
      self%unit(self%count) = unit_for(one%unit, self%wanted)
      if (self%unit(self%count) > 0) one%unit = trim(units(self%unit(self%count))%name)
      one%label = one%label // ' [' // one%unit // ']'
    end associate
  end subroutine add

  !> Appends a column that is no signal, such as the order of a line.
  subroutine add_named(self, name, unit, caption, element_kind, element)
    class(column_list_t), intent(inout) :: self
    character(len=*), intent(in) :: name, unit, caption
    character(len=*), intent(in), optional :: element_kind, element   !! the group of the input that it is of; absent: none
    type(signal_t) :: signal

    signal%name = name
    signal%symbol = name
    signal%unit = unit
    signal%caption = caption
    signal%positive = ''
    signal%point = ''
    signal%element_kind = ''
    signal%element = ''
    if (present(element_kind)) signal%element_kind = element_kind
    if (present(element)) then
      signal%element = element
      signal%name = name // '_' // element
    end if
    call self%add(signal)
  end subroutine add_named

  !> The labels and units of the columns.
  subroutine list_columns(self, labels, unit)
    class(column_list_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: labels(:)
    integer, allocatable, intent(out) :: unit(:)   !! of each: index of `units`, 0: SI
    integer :: i

    allocate (labels(self%count))
    do i = 1, self%count
      labels(i)%text = self%list(i)%label
    end do
    unit = self%unit(:self%count)
  end subroutine list_columns

  !> Writes what each column is, into an open list.
  subroutine put(self, json)
    class(column_list_t), intent(in) :: self
    type(json_t), intent(inout) :: json
    integer :: i

    do i = 1, self%count
      associate (one => self%list(i), signal => self%list(i)%signal)
        call json%open()
        call json%put('label', one%label)
        if (self%file /= '') call json%put('file', self%file)
        call json%put('name', signal%name)
        call json%put('kind', signal%symbol)
        if (one%statistic /= '') call json%put('statistic', one%statistic)
        call json%put('element_kind', signal%element_kind)
        call json%put('element', signal%element)
        call json%put('point', signal%point)
        call json%put('unit', one%unit)
        call json%put('caption', signal%caption)
        call json%put('positive', signal%positive)
        call json%put('rank', signal%rank)
        call json%close()
      end associate
    end do
  end subroutine put

end module nocdyn_column_lists
