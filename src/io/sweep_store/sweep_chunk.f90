!> The results of some consecutive variants of a sweep.
module nocdyn_sweep_chunk
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_bytes, only: byte_reader_t, integer_bytes, put_integers, put_reals, put_text, real_bytes
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: allocate_chunk, pack_chunk, unpack_chunk, read_summary

  integer, parameter, public :: status_done = 0      !! it has all results
  integer, parameter, public :: status_refused = 1   !! a value is out of range, or there is no such machine
  integer, parameter, public :: status_failed = 2    !! the integration failed
  character(len=7), parameter, public :: status_words(0:2) = ['done   ', 'refused', 'failed ']

  type, public :: chunk_t
    integer :: first = 1                        !! variant
    integer :: count = 0                        !! variants
    real(wp), allocatable :: parameters(:, :)   !! values of the targets, [varied, count]
    real(wp), allocatable :: results(:, :)      !! [statistics, count], NaN unless the variant is done
    integer, allocatable :: status(:)           !! status_...; [count]
    integer, allocatable :: steps(:)            !! of the integration; [count]
    type(string_t), allocatable :: reasons(:)   !! why the variant is not done, in one sentence; [count]
  end type chunk_t

  !> The first bytes of a packed chunk: its sizes, and what became of its variants.
  type, public :: chunk_summary_t
    integer :: first = 0, count = 0, varied = 0, statistics = 0
    integer :: refused = 0, failed = 0
    integer :: longest_reason = 0   !! [characters]
  end type chunk_summary_t

  integer, parameter :: summary_numbers = 7

contains

  !> A chunk of variants that are done, with parameters and results of 0.
  subroutine allocate_chunk(chunk, first, count, varied, statistics)
    type(chunk_t), intent(out) :: chunk
    integer, intent(in) :: first, count
    integer, intent(in) :: varied, statistics   !! numbers of targets and of results

    chunk%first = first
    chunk%count = count
    allocate (chunk%parameters(varied, count), chunk%results(statistics, count), source=0.0_wp)
    allocate (chunk%status(count), source=status_done)
    allocate (chunk%steps(count), source=0)
    allocate (chunk%reasons(count))
  end subroutine allocate_chunk

  !> Packs a chunk into bytes, which `unpack_chunk` reads.
  subroutine pack_chunk(chunk, bytes)
    type(chunk_t), intent(in) :: chunk
    character(len=:), allocatable, intent(out) :: bytes
    integer :: i, longest, used

    longest = 0
    do i = 1, chunk%count
      if (chunk%status(i) /= status_done) longest = max(longest, len(chunk%reasons(i)%text))
    end do
    used = 0
    call put_integers(bytes, used, [chunk%first, chunk%count, size(chunk%parameters, 1), size(chunk%results, 1), &
                                    count(chunk%status == status_refused), count(chunk%status == status_failed), longest])
    call put_reals(bytes, used, chunk%parameters)
    call put_reals(bytes, used, chunk%results)
    call put_integers(bytes, used, chunk%status)
    call put_integers(bytes, used, chunk%steps)
    do i = 1, chunk%count
      if (chunk%status(i) /= status_done) call put_text(bytes, used, chunk%reasons(i)%text)
    end do
    bytes = bytes(:used)
  end subroutine pack_chunk

  !> Unpacks a chunk. Bytes that are not the ones of a chunk are a fault of the program: checksums have been compared before.
  subroutine unpack_chunk(bytes, chunk)
    character(len=*), intent(in) :: bytes
    type(chunk_t), intent(inout) :: chunk        !! arrays of the right shape are reused
    type(chunk_summary_t) :: summary
    type(byte_reader_t) :: reader
    logical :: fits, is_whole
    integer :: i

    call read_summary(bytes, summary, is_whole)
    if (.not. is_whole) error stop 'nocdyn_sweep_chunk: unpack_chunk needs the bytes of a chunk'
    fits = allocated(chunk%status)
    if (fits) fits = size(chunk%parameters, 1) == summary%varied .and. size(chunk%results, 1) == summary%statistics .and. &
                     size(chunk%status) == summary%count
    chunk%first = summary%first
    if (.not. fits) call allocate_chunk(chunk, summary%first, summary%count, summary%varied, summary%statistics)
    reader%next = summary_numbers * integer_bytes + 1
    call reader%take_reals(bytes, chunk%parameters)
    call reader%take_reals(bytes, chunk%results)
    call reader%take_integers(bytes, chunk%status)
    call reader%take_integers(bytes, chunk%steps)
    do i = 1, chunk%count
      if (chunk%status(i) /= status_done) then
        call reader%take_text(bytes, chunk%reasons(i)%text)
      else if (allocated(chunk%reasons(i)%text)) then
        deallocate (chunk%reasons(i)%text)
      end if
    end do
    if (reader%is_short) error stop 'nocdyn_sweep_chunk: unpack_chunk needs all bytes of a chunk'
  end subroutine unpack_chunk

  !> Reads the first bytes of a packed chunk.
  subroutine read_summary(bytes, summary, is_whole)
    character(len=*), intent(in) :: bytes
    type(chunk_summary_t), intent(out) :: summary
    logical, intent(out) :: is_whole               !! whether there are as many bytes as these sizes need
    type(byte_reader_t) :: reader
    integer :: numbers(summary_numbers)
    integer(int64) :: needed

    call reader%take_integers(bytes, numbers)
    summary = chunk_summary_t(numbers(1), numbers(2), numbers(3), numbers(4), numbers(5), numbers(6), numbers(7))
    is_whole = .not. reader%is_short .and. minval(numbers) >= 0 .and. summary%first > 0 .and. summary%count > 0
    if (.not. is_whole) return
    needed = summary_numbers * integer_bytes + &
             summary%count * (real_bytes * (int(summary%varied, int64) + summary%statistics) + 2 * integer_bytes)
    is_whole = needed <= len(bytes)
  end subroutine read_summary

end module nocdyn_sweep_chunk
