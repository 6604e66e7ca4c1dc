!> The chunks of one or several journals in the order of their variants, one at a time.
module nocdyn_journal_chunks
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_number_ranges, only: ascending_order, gaps, range_t
  use nocdyn_sweep_chunk, only: chunk_t
  use nocdyn_sweep_differences, only: header_difference
  use nocdyn_sweep_journal, only: is_of_shard, journal_name, missing_variants, sweep_journal_t
  use nocdyn_text, only: shown_path, to_text
  implicit none (type, external)
  private

  public :: check_sweep

  integer, parameter :: max_listed = 3   ! ranges or names in a message

  !> The position of the next chunk. `rewind_to_start` goes to the first one.
  type, public :: chunk_cursor_t
    integer, allocatable, private :: journal(:), entry(:)   !! of each chunk, in the order of the variants
    integer, private :: next = 1
  contains
    procedure :: rewind_to_start, next_chunk
  end type chunk_cursor_t

contains

  !> Goes to the first chunk.
  subroutine rewind_to_start(self, journals)
    class(chunk_cursor_t), intent(inout) :: self
    type(sweep_journal_t), intent(in) :: journals(:)
    type(range_t), allocatable :: ranges(:)
    integer, allocatable :: order(:), journal(:), entry(:)

    call list_entries(journals, ranges, journal, entry)
    call ascending_order(ranges, order)
    self%journal = journal(order)
    self%entry = entry(order)
    self%next = 1
  end subroutine rewind_to_start

  !> The variants of the entries of all journals.
  pure subroutine list_entries(journals, ranges, journal, entry)
    type(sweep_journal_t), intent(in) :: journals(:)
    type(range_t), allocatable, intent(out) :: ranges(:)
    integer, allocatable, intent(out) :: journal(:), entry(:)   !! number of the journal, and of the entry in it
    integer :: i, k, last

    allocate (ranges(sum(journals%entries)))
    journal = [((k, i=1, journals(k)%entries), k=1, size(journals))]
    entry = [((i, i=1, journals(k)%entries), k=1, size(journals))]
    last = 0
    do k = 1, size(journals)
      ranges(last + 1:last + journals(k)%entries) = journals(k)%ranges()
      last = last + journals(k)%entries
    end do
  end subroutine list_entries

  !> Reads the next chunk.
  subroutine next_chunk(self, journals, chunk, is_there, error)
    class(chunk_cursor_t), intent(inout) :: self
    type(sweep_journal_t), intent(inout) :: journals(:)   !! those given to `rewind_to_start`
    type(chunk_t), intent(inout) :: chunk
    logical, intent(out) :: is_there   !! false after the last chunk
    type(error_t), allocatable, intent(out) :: error

    is_there = self%next <= size(self%entry)
    if (.not. is_there) return
    call journals(self%journal(self%next))%read_entry(self%entry(self%next), chunk, error)
    self%next = self%next + 1
  end subroutine next_chunk

  !> Checks that the journals are of one sweep and hold every variant of it once.
  subroutine check_sweep(journals, error)
    type(sweep_journal_t), intent(in) :: journals(:)     !! at least one
    type(error_t), allocatable, intent(out) :: error
    type(range_t), allocatable :: ranges(:), open_ranges(:)
    integer, allocatable :: journal(:), entry(:), order(:)
    integer :: i

    call check_headers(journals, error)
    if (.not. allocated(error)) call check_wholeness(journals, error)
    if (allocated(error)) return
    call list_entries(journals, ranges, journal, entry)
    call ascending_order(ranges, order)
    do i = 2, size(order)
      if (ranges(order(i))%first > ranges(order(i - 1))%last) cycle
      call raise(error, exit_input, 'variant ' // to_text(ranges(order(i))%first) // ' is held twice: by ' // &
                 shown_path(journals(journal(order(i - 1)))%file%path) // ' and ' // &
                 shown_path(journals(journal(order(i)))%file%path))
      return
    end do
    call gaps(ranges, range_t(1, journals(1)%header%variants), open_ranges)
    if (size(open_ranges) > 0) call raise(error, exit_input, absent_shards(journals) // 'no journal holds ' // &
                                          ranges_text(open_ranges) // ' of ' // to_text(journals(1)%header%variants))
  end subroutine check_sweep

  !> E.g. 'sweep.2-of-5.journal is not there: ', as far as it follows from the names of the others; '' if no name is absent.
  function absent_shards(journals) result(text)
    type(sweep_journal_t), intent(in) :: journals(:)
    character(len=:), allocatable :: text, name
    integer :: absent, i, k, shards

    text = ''
    absent = 0
    shards = shards_of(journals(1)%file%path)
    do k = 1, shards
      name = journal_name(k, shards)
      do i = 1, size(journals)
        associate (path => journals(i)%file%path)
          if (path(index(path, '/', back=.true.) + 1:) == name) exit
        end associate
      end do
      if (i <= size(journals)) cycle
      absent = absent + 1
      if (absent > max_listed) cycle
      if (text /= '') text = text // ', '
      text = text // name
    end do
    if (absent > max_listed) text = text // ' and ' // to_text(absent - max_listed) // ' more'
    if (absent > 0) text = text // trim(merge(' is ', ' are', absent == 1)) // ' not there: '
  end function absent_shards

  !> 5 for '.../sweep.2-of-5.journal', 0 for other names.
  pure integer function shards_of(path) result(shards)
    character(len=*), intent(in) :: path
    integer :: first, last, status

    first = index(path, '-of-', back=.true.) + 4
    last = index(path, '.journal', back=.true.) - 1
    shards = 0
    if (first == 4 .or. last < first) return
    read (path(first:last), '(i10)', iostat=status) shards
    if (status /= 0) shards = 0
  end function shards_of

  !> Checks that all journals are of one sweep.
  subroutine check_headers(journals, error)
    type(sweep_journal_t), intent(in) :: journals(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: other_lists = 'the files with their variants differ'
    character(len=:), allocatable :: difference
    integer :: i

    do i = 2, size(journals)
      associate (first => journals(1)%header, second => journals(i)%header)
        difference = header_difference(first, second, 'they were written by ' // first%source // ' and ' // second%source, &
                                       'their inputs differ, from the first to the second: ', other_lists)
        if (difference == '' .and. first%variants /= second%variants) difference = other_lists
      end associate
      if (difference == '') cycle
      call raise(error, exit_input, shown_path(journals(1)%file%path) // ' and ' // shown_path(journals(i)%file%path) // &
                 ' are not of one sweep: ' // difference)
      return
    end do
  end subroutine check_headers

  !> Refuses shards, or a whole sweep, of which the journals lack variants, by the name of the first journal of each.
  subroutine check_wholeness(journals, error)
    type(sweep_journal_t), intent(in) :: journals(:)
    type(error_t), allocatable, intent(out) :: error
    type(range_t), allocatable :: open_ranges(:)
    character(len=:), allocatable :: message
    integer :: i

    message = ''
    do i = 1, size(journals)
      associate (header => journals(i)%header)
        if (any(is_of_shard(journals(:i - 1), header))) cycle
        call missing_variants(journals, header, open_ranges)
        if (size(open_ranges) == 0) cycle
        if (message /= '') message = message // new_line('a')
        message = message // shown_path(journals(i)%file%path) // ': unfinished, without ' // ranges_text(open_ranges) // &
                  ' of ' // to_text(header%first) // ' to ' // to_text(header%last) // '; --resume goes on with it'
      end associate
    end do
    if (message /= '') call raise(error, exit_input, message)
  end subroutine check_wholeness

  !> E.g. 'variants 3 to 5, 8 and 2 more ranges'.
  pure function ranges_text(ranges) result(text)
    type(range_t), intent(in) :: ranges(:)
    character(len=:), allocatable :: text
    integer :: i

    text = 'variants '
    if (size(ranges) == 1) text = trim(merge('variant ', 'variants', ranges(1)%first == ranges(1)%last)) // ' '
    do i = 1, min(size(ranges), max_listed)
      if (i > 1) text = text // ', '
      text = text // to_text(ranges(i)%first)
      if (ranges(i)%last > ranges(i)%first) text = text // ' to ' // to_text(ranges(i)%last)
    end do
    if (size(ranges) > max_listed) text = text // ' and ' // to_text(size(ranges) - max_listed) // ' more ranges'
  end function ranges_text

end module nocdyn_journal_chunks
