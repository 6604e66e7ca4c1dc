!> What the ranks of a sweep tell each other. Rank 0 keeps the books; the others ask it for variants and send it results.
module nocdyn_mpi_messages
  use mpi_f08, only: mpi_any_source, mpi_any_tag, mpi_bcast, mpi_byte, mpi_character, mpi_comm_world, mpi_double_precision, &
    mpi_get_count, mpi_integer, mpi_iprobe, mpi_probe, mpi_recv, mpi_send, mpi_status, mpi_status_ignore
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: chunk_t, pack_chunk, unpack_chunk
  implicit none (type, external)
  private

  public :: send_request, send_assignment, receive_assignment, send_results, receive_results, send_tag, receive_tag, &
    probe_message, wait_for_message
  public :: broadcast_text

  integer, parameter, public :: root = 0

  integer, parameter, public :: tag_request = 1    !! to rank 0: which variants next?
  integer, parameter :: tag_assignment = 2     !! from rank 0: these
  integer, parameter, public :: tag_results = 3    !! to rank 0: a chunk that has been computed
  integer, parameter :: tag_seconds = 4    !! to rank 0: the time that it took
  integer, parameter, public :: tag_stop = 5       !! from rank 0: leave off
  integer, parameter, public :: tag_done = 6    !! to rank 0: nothing more comes; from rank 0: the same

contains

  subroutine send_request()
    call send_tag(root, tag_request)
  end subroutine send_request

  subroutine send_assignment(rank, first, count)
    integer, intent(in) :: rank, first, count

    call mpi_send([first, count], 2, mpi_integer, rank, tag_assignment, mpi_comm_world)
  end subroutine send_assignment

  subroutine receive_assignment(first, count)
    integer, intent(out) :: first, count
    integer :: numbers(2)

    call mpi_recv(numbers, 2, mpi_integer, root, tag_assignment, mpi_comm_world, mpi_status_ignore)
    first = numbers(1)
    count = numbers(2)
  end subroutine receive_assignment

  subroutine send_results(chunk, seconds)
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds
    character(len=:), allocatable :: bytes

    call pack_chunk(chunk, bytes)
    call mpi_send(bytes, len(bytes), mpi_byte, root, tag_results, mpi_comm_world)
    call mpi_send(seconds, 1, mpi_double_precision, root, tag_seconds, mpi_comm_world)
  end subroutine send_results

  !> The results that `probe_message` has found.
  subroutine receive_results(rank, chunk, seconds)
    integer, intent(in) :: rank
    type(chunk_t), intent(out) :: chunk
    real(wp), intent(out) :: seconds
    type(mpi_status) :: status
    character(len=:), allocatable :: bytes
    integer :: length

    call mpi_probe(rank, tag_results, mpi_comm_world, status)
    call mpi_get_count(status, mpi_byte, length)
    allocate (character(len=length) :: bytes)
    call mpi_recv(bytes, length, mpi_byte, rank, tag_results, mpi_comm_world, mpi_status_ignore)
    call mpi_recv(seconds, 1, mpi_double_precision, rank, tag_seconds, mpi_comm_world, mpi_status_ignore)
    call unpack_chunk(bytes, chunk)
  end subroutine receive_results

  !> A message that says nothing but its word.
  subroutine send_tag(rank, tag)
    integer, intent(in) :: rank, tag

    call mpi_send([tag], 1, mpi_integer, rank, tag, mpi_comm_world)
  end subroutine send_tag

  subroutine receive_tag(rank, tag)
    integer, intent(in) :: rank, tag
    integer :: received(1)

    call mpi_recv(received, 1, mpi_integer, rank, tag, mpi_comm_world, mpi_status_ignore)
  end subroutine receive_tag

  !> The message that is to be received next, if there is one; word 0 if there is none.
  subroutine probe_message(rank, tag)
    integer, intent(out) :: rank, tag
    type(mpi_status) :: status
    logical :: is_there

    rank = 0
    tag = 0
    call mpi_iprobe(mpi_any_source, mpi_any_tag, mpi_comm_world, is_there, status)
    if (.not. is_there) return
    rank = status%mpi_source
    tag = status%mpi_tag
  end subroutine probe_message

  !> The same from rank 0, however long it takes.
  subroutine wait_for_message(tag)
    integer, intent(out) :: tag
    type(mpi_status) :: status

    call mpi_probe(root, mpi_any_tag, mpi_comm_world, status)
    tag = status%mpi_tag
  end subroutine wait_for_message

  !> All ranks have rank 0's text then.
  subroutine broadcast_text(text)
    character(len=:), allocatable, intent(inout) :: text
    integer :: length

    length = 0
    if (allocated(text)) length = len(text)
    call mpi_bcast(length, 1, mpi_integer, root, mpi_comm_world)
    if (.not. allocated(text)) allocate (character(len=length) :: text)
    call mpi_bcast(text, length, mpi_character, root, mpi_comm_world)
  end subroutine broadcast_text

end module nocdyn_mpi_messages
