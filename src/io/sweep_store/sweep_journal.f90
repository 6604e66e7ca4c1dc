!> The journal of a sweep or of a shard: a log file with a header and one entry per chunk, in any order.
module nocdyn_sweep_journal
  use, intrinsic :: iso_fortran_env, only: int32, int64
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_posix_files, only: folder_names
  use nocdyn_number_ranges, only: gaps, range_t
  use nocdyn_log_file, only: frame_bytes, log_file_t
  use nocdyn_sweep_chunk, only: chunk_summary_t, chunk_t, pack_chunk, read_summary, unpack_chunk
  use nocdyn_sweep_header, only: pack_header, sweep_header_t, unpack_header
  use nocdyn_text, only: append_text => append, shown_path, string_t, to_text
  use nocdyn_text_sort, only: argsort
  implicit none (type, external)
  private

  public :: journal_name, journal_names, rank_journal_name, is_of_rank, is_of_shard, missing_variants, create_journal, &
    read_journal_header, &
    open_journal, continue_journal

  character(len=*), parameter :: rank_beginning = 'sweep.rank-'
  integer(int32), parameter :: header_tag = int(z'64616568', int32), chunk_tag = int(z'6B6E6863', int32)   ! 'head', 'chnk'

  !> Where the entry of a chunk is, and its variants.
  type :: log_entry_t
    integer(int64) :: offset = 0   !! of its frame in the file [bytes]
    integer :: first = 1, count = 0
  end type log_entry_t

  type, public :: sweep_journal_t
    type(sweep_header_t) :: header
    integer :: done = 0, refused = 0, failed = 0   !! variants in it
    integer :: entries = 0                         !! chunks in it
    integer :: longest_reason = 0                  !! [characters]
    integer(int64) :: damaged_bytes = 0            !! ignored by `open_journal`
    type(log_file_t) :: file
    type(log_entry_t), allocatable, private :: index(:)
  contains
    procedure :: append, ranges, entry_of, read_entry
    procedure, private :: add_entry, read_chunks
  end type sweep_journal_t

contains

  !> The name of the file.
  function journal_name(shard, shards) result(name)
    integer, intent(in) :: shard, shards   !! 1 of 1 is the whole sweep
    character(len=:), allocatable :: name

    name = 'sweep.journal'
    if (shards > 1) name = 'sweep.' // to_text(shard) // '-of-' // to_text(shards) // '.journal'
  end function journal_name

  !> The name of the file that a rank above 0 adds to the journal of the whole sweep.
  function rank_journal_name(rank) result(name)
    integer, intent(in) :: rank
    character(len=:), allocatable :: name

    name = rank_beginning // to_text(rank) // '.journal'
  end function rank_journal_name

  !> Whether a journal has such a name.
  pure logical function is_of_rank(name)
    character(len=*), intent(in) :: name

    is_of_rank = index(name, rank_beginning) == 1
  end function is_of_rank

  !> The names of all journals in a folder, sorted.
  function journal_names(folder) result(names)
    character(len=*), intent(in) :: folder
    type(string_t), allocatable :: names(:)
    character(len=*), parameter :: beginning = 'sweep.', ending = 'journal'
    type(string_t), allocatable :: all_names(:)
    integer, allocatable :: order(:)
    integer :: i

    allocate (all_names, source=folder_names(folder))
    call argsort(all_names, order)
    allocate (names(0))
    do i = 1, size(all_names)
      associate (name => all_names(order(i))%text)
        if (index(name, beginning) /= 1 .or. len(name) < len(beginning) + len(ending)) cycle
        if (name(len(name) - len(ending) + 1:) == ending) call append_text(names, name)
      end associate
    end do
  end function journal_names

  !> Creates a journal in `folder`, and the folder if needed. An existing journal of that name is refused.
  subroutine create_journal(folder, name, header, journal, error)
    character(len=*), intent(in) :: folder, name
    type(sweep_header_t), intent(in) :: header
    type(sweep_journal_t), intent(out) :: journal
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: bytes

    journal%header = header
    allocate (journal%index(1))
    call journal%file%create(folder, name, error)
    if (allocated(error)) return
    call pack_header(header, bytes)
    call journal%file%write(header_tag, bytes, error)
    if (allocated(error)) call journal%file%remove()
  end subroutine create_journal

  !> Opens an existing journal to read it or to resume the sweep. An entry that was not written as a whole is removed.
  subroutine open_journal(folder, name, journal, error, only_header)
    character(len=*), intent(in) :: folder, name
    type(sweep_journal_t), intent(out) :: journal
    type(error_t), allocatable, intent(out) :: error   !! `exit_file` if it cannot be opened, else `exit_input`
    logical, intent(in), optional :: only_header       !! leaves the entries unread, and their file as it is
    integer :: length
    logical :: is_good, is_there

    allocate (journal%index(1))
    call journal%file%open(folder, name, error)
    if (allocated(error)) return
    call journal%file%read(journal%file%end, header_tag, length, is_there, is_good)
    if (is_good) call unpack_header(journal%file%buffer(frame_bytes + 1:frame_bytes + length), journal%header, is_good)
    if (is_good .and. present(only_header)) return
    if (is_good) then
      journal%file%end = journal%file%end + frame_bytes + length
      call journal%read_chunks()
      call journal%file%cut(error)
    else
      call raise(error, exit_input, shown_path(journal%file%path) // ': the head of this journal is damaged, so that ' // &
                 'nothing can be made of the rest; remove it, or choose another folder with --out')
    end if
    if (allocated(error)) call journal%file%close()
  end subroutine open_journal

  !> Reads what a journal says of its sweep; the journal stays as it is.
  subroutine read_journal_header(folder, name, header, error)
    character(len=*), intent(in) :: folder, name
    type(sweep_header_t), intent(out) :: header
    type(error_t), allocatable, intent(out) :: error   !! as of `open_journal`
    type(sweep_journal_t) :: journal

    call open_journal(folder, name, journal, error, only_header=.true.)
    if (allocated(error)) return
    header = journal%header
    call journal%file%close()
  end subroutine read_journal_header

  !> Opens a journal to append to it, or creates it if there is none or an empty one.
  subroutine continue_journal(folder, name, header, journal, error)
    character(len=*), intent(in) :: folder, name
    type(sweep_header_t), intent(in) :: header   !! of the sweep of an existing journal
    type(sweep_journal_t), intent(out) :: journal
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: bytes
    logical :: is_there

    inquire (file=folder // '/' // name, exist=is_there, size=bytes)
    if (is_there .and. bytes > 0) then
      call open_journal(folder, name, journal, error)
    else
      call create_journal(folder, name, header, journal, error)
    end if
  end subroutine continue_journal

  !> Finds the entries of chunks. A damaged one is ignored; the first bytes that are no entry end the journal.
  subroutine read_chunks(self)
    class(sweep_journal_t), intent(inout) :: self
    type(chunk_summary_t) :: summary
    integer(int64) :: offset
    integer :: length
    logical :: is_good, is_there

    offset = self%file%end
    do
      call self%file%read(offset, chunk_tag, length, is_there, is_good)
      if (.not. is_there) exit
      if (is_good) call read_summary(self%file%buffer(frame_bytes + 1:frame_bytes + length), summary, is_good)
      if (is_good) is_good = belongs(summary, self%header)
      if (is_good) then
        self%damaged_bytes = self%damaged_bytes + offset - self%file%end
        call self%add_entry(offset, summary)
        self%file%end = offset + frame_bytes + length
      end if
      offset = offset + frame_bytes + length
    end do
    self%damaged_bytes = self%damaged_bytes + self%file%size() - self%file%end
  end subroutine read_chunks

  pure logical function belongs(summary, header)
    type(chunk_summary_t), intent(in) :: summary
    type(sweep_header_t), intent(in) :: header

    belongs = summary%varied == size(header%parameters) .and. summary%statistics == size(header%results) .and. &
              summary%first >= header%first .and. summary%count <= header%last - summary%first + 1
  end function belongs

  !> Takes an entry into the index and its variants into the counts.
  subroutine add_entry(self, offset, summary)
    class(sweep_journal_t), intent(inout) :: self
    integer(int64), intent(in) :: offset
    type(chunk_summary_t), intent(in) :: summary

    if (self%entries == size(self%index)) self%index = [self%index, self%index]
    self%entries = self%entries + 1
    self%index(self%entries) = log_entry_t(offset, summary%first, summary%count)
    self%refused = self%refused + summary%refused
    self%failed = self%failed + summary%failed
    self%done = self%done + summary%count - summary%refused - summary%failed
    self%longest_reason = max(self%longest_reason, summary%longest_reason)
  end subroutine add_entry

  !> Appends a chunk. After an error the journal is what it was before, if the disk allows it.
  subroutine append(self, chunk, error)
    class(sweep_journal_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: bytes
    type(chunk_summary_t) :: summary
    integer(int64) :: offset
    logical :: is_whole

    call pack_chunk(chunk, bytes)
    call read_summary(bytes, summary, is_whole)
    if (is_whole) is_whole = belongs(summary, self%header)
    if (.not. is_whole) error stop 'nocdyn_sweep_journal: append needs a chunk of this sweep'
    offset = self%file%end
    call self%file%write(chunk_tag, bytes, error)
    if (.not. allocated(error)) call self%add_entry(offset, summary)
  end subroutine append

  !> The range of variants of each entry.
  pure function ranges(self)
    class(sweep_journal_t), intent(in) :: self
    type(range_t), allocatable :: ranges(:)
    integer :: i

    ranges = [(range_t(self%index(i)%first, self%index(i)%first + self%index(i)%count - 1), i=1, self%entries)]
  end function ranges

  !> The variants of a shard that none of its journals holds, as ascending ranges.
  pure subroutine missing_variants(journals, shard, open_ranges)
    type(sweep_journal_t), intent(in) :: journals(:)   !! of all shards
    type(sweep_header_t), intent(in) :: shard
    type(range_t), allocatable, intent(out) :: open_ranges(:)
    type(range_t), allocatable :: held(:)
    integer :: i, last

    allocate (held(sum(journals%entries, mask=is_of_shard(journals, shard))))
    last = 0
    do i = 1, size(journals)
      if (.not. is_of_shard(journals(i), shard)) cycle
      held(last + 1:last + journals(i)%entries) = journals(i)%ranges()
      last = last + journals(i)%entries
    end do
    call gaps(held, range_t(shard%first, shard%last), open_ranges)
  end subroutine missing_variants

  !> Whether a journal is of a shard: the one of a whole sweep is the only one.
  elemental logical function is_of_shard(journal, shard)
    type(sweep_journal_t), intent(in) :: journal
    type(sweep_header_t), intent(in) :: shard

    is_of_shard = journal%header%first == shard%first .and. journal%header%last == shard%last
  end function is_of_shard

  !> The number of the entry that holds a variant, 0 if there is none.
  pure integer function entry_of(self, variant) result(number)
    class(sweep_journal_t), intent(in) :: self
    integer, intent(in) :: variant

    do number = self%entries, 1, -1
      if (variant >= self%index(number)%first .and. variant - self%index(number)%first < self%index(number)%count) return
    end do
  end function entry_of

  !> Reads the chunk of entry `number`, 1 to `entries`.
  subroutine read_entry(self, number, chunk, error)
    class(sweep_journal_t), intent(inout) :: self
    integer, intent(in) :: number
    type(chunk_t), intent(inout) :: chunk
    type(error_t), allocatable, intent(out) :: error
    integer :: length
    logical :: is_good, is_there, was_open

    was_open = self%file%is_open()
    call self%file%read(self%index(number)%offset, chunk_tag, length, is_there, is_good)
    if (is_good) then
      call unpack_chunk(self%file%buffer(frame_bytes + 1:frame_bytes + length), chunk)
    else
      call raise(error, exit_file, shown_path(self%file%path) // ': cannot be read: it is not as it was when it was opened')
    end if
    if (.not. was_open) call self%file%close()
  end subroutine read_entry

end module nocdyn_sweep_journal
