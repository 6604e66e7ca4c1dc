!> Messages between the ranks of a sweep: the workers request variants from rank 0 and send it the results.
module nocdyn_mpi_messages
  use mpi_f08, only: mpi_any_source, mpi_any_tag, mpi_bcast, mpi_byte, mpi_character, mpi_comm_world, mpi_double_precision, &
    mpi_get_count, mpi_integer, mpi_iprobe, mpi_probe, mpi_recv, mpi_send, mpi_status, mpi_status_ignore
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: chunk_t, pack_chunk, unpack_chunk
  implicit none (type, external)
  private

  public :: send_assignment, receive_assignment, send_results, receive_results, send_tag, receive_tag, probe_message, &
    wait_for_message, broadcast_text

  integer, parameter, public :: root = 0

  integer, parameter, public :: tag_request = 1    !! to rank 0: request for variants
  integer, parameter :: tag_assignment = 2     !! from rank 0: first variant and their number
  integer, parameter, public :: tag_results = 3    !! to rank 0: a chunk of results
  integer, parameter :: tag_seconds = 4    !! to rank 0: the time to compute it [s]
  integer, parameter, public :: tag_stop = 5       !! from rank 0: stop computing
  integer, parameter, public :: tag_done = 6    !! last message of a worker, and of rank 0 to it

contains

  !> Assigns consecutive variants to a rank, none if there are no more.
  subroutine send_assignment(rank, first, count)
    integer, intent(in) :: rank    !! of the receiver
    integer, intent(in) :: first   !! variant
    integer, intent(in) :: count   !! number of variants

    call mpi_send([first, count], 2, mpi_integer, rank, tag_assignment, mpi_comm_world)
  end subroutine send_assignment

  !> Waits for the answer to a request.
  subroutine receive_assignment(first, count)
    integer, intent(out) :: first   !! variant
    integer, intent(out) :: count   !! number of variants, 0: there are no more
    integer :: numbers(2)

    call mpi_recv(numbers, 2, mpi_integer, root, tag_assignment, mpi_comm_world, mpi_status_ignore)
    first = numbers(1)
    count = numbers(2)
  end subroutine receive_assignment

  !> Sends results to rank 0.
  subroutine send_results(chunk, seconds)
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds   !! to compute them [s]
    character(len=:), allocatable :: bytes

    call pack_chunk(chunk, bytes)
    call mpi_send(bytes, len(bytes), mpi_byte, root, tag_results, mpi_comm_world)
    call mpi_send(seconds, 1, mpi_double_precision, root, tag_seconds, mpi_comm_world)
  end subroutine send_results

  !> Receives the results that `probe_message` has found.
  subroutine receive_results(rank, chunk, seconds)
    integer, intent(in) :: rank        !! of the sender
    type(chunk_t), intent(out) :: chunk
    real(wp), intent(out) :: seconds   !! to compute them [s]
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

  !> Sends a message without content.
  subroutine send_tag(rank, tag)
    integer, intent(in) :: rank, tag

    call mpi_send([tag], 1, mpi_integer, rank, tag, mpi_comm_world)
  end subroutine send_tag

  !> Receives a message without content.
  subroutine receive_tag(rank, tag)
    integer, intent(in) :: rank, tag
    integer :: received(1)

    call mpi_recv(received, 1, mpi_integer, rank, tag, mpi_comm_world, mpi_status_ignore)
  end subroutine receive_tag

  !> Rank and tag of the message to receive next; tag 0 if there is none.
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

  !> Waits for a message of rank 0.
  subroutine wait_for_message(tag)
    integer, intent(out) :: tag
    type(mpi_status) :: status

    call mpi_probe(root, mpi_any_tag, mpi_comm_world, status)
    tag = status%mpi_tag
  end subroutine wait_for_message

  !> Copies a text of rank 0 to all ranks. Called by all ranks.
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
