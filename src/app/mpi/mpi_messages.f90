!> Messages between the ranks of a sweep: the workers report what they have done and request variants from rank 0.
module nocdyn_mpi_messages
  use mpi_f08, only: mpi_any_source, mpi_any_tag, mpi_bcast, mpi_character, mpi_comm_world, mpi_double_precision, mpi_get_count, &
    mpi_integer, mpi_iprobe, mpi_probe, mpi_recv, mpi_send, mpi_status, mpi_status_ignore
  use nocdyn_errors, only: error_t, raise
  use nocdyn_kinds, only: wp
  use nocdyn_scheduler, only: sweep_counts_t
  implicit none (type, external)
  private

  public :: send_assignment, receive_assignment, send_report, receive_report, send_error, receive_error, send_tag, receive_tag, &
    probe_message, wait_for_message, broadcast_text

  integer, parameter, public :: root = 0

  integer, parameter, public :: tag_request = 1   !! to rank 0: what has been done since the last one, and request for variants
  integer, parameter :: tag_assignment = 2        !! from rank 0: first variant and their number
  integer, parameter, public :: tag_error = 3     !! to rank 0: exit code and message
  integer, parameter, public :: tag_stop = 4      !! from rank 0: stop computing
  integer, parameter, public :: tag_done = 5      !! last message of a worker, with what it has done, and of rank 0 to it

  !> What a rank has done since its last report.
  type, public :: report_t
    type(sweep_counts_t) :: counts           !! without the total
    real(wp) :: variant_time = 0.0_wp        !! of a thread [s], 0 if it is not known
  end type report_t

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

  !> Sends a report to rank 0.
  subroutine send_report(tag, report)
    integer, intent(in) :: tag   !! tag_request or tag_done
    type(report_t), intent(in) :: report
    real(wp) :: numbers(5)

    associate (counts => report%counts)
      numbers = [real([counts%done, counts%refused, counts%failed, counts%new], wp), report%variant_time]
    end associate
    call mpi_send(numbers, size(numbers), mpi_double_precision, root, tag, mpi_comm_world)
  end subroutine send_report

  !> Receives the report that `probe_message` has found.
  subroutine receive_report(rank, tag, report)
    integer, intent(in) :: rank, tag
    type(report_t), intent(out) :: report
    real(wp) :: numbers(5)

    call mpi_recv(numbers, size(numbers), mpi_double_precision, rank, tag, mpi_comm_world, mpi_status_ignore)
    report%counts = sweep_counts_t(0, nint(numbers(1)), nint(numbers(2)), nint(numbers(3)), nint(numbers(4)))
    report%variant_time = numbers(5)
  end subroutine receive_report

  !> Tells rank 0 why this rank cannot go on.
  subroutine send_error(error)
    type(error_t), intent(in) :: error

    call mpi_send([error%code], 1, mpi_integer, root, tag_error, mpi_comm_world)
    call mpi_send(error%message, len(error%message), mpi_character, root, tag_error, mpi_comm_world)
  end subroutine send_error

  !> Receives the error that `probe_message` has found.
  subroutine receive_error(rank, error)
    integer, intent(in) :: rank
    type(error_t), allocatable, intent(out) :: error
    type(mpi_status) :: status
    character(len=:), allocatable :: text
    integer :: code(1), length

    call mpi_recv(code, 1, mpi_integer, rank, tag_error, mpi_comm_world, mpi_status_ignore)
    call mpi_probe(rank, tag_error, mpi_comm_world, status)
    call mpi_get_count(status, mpi_character, length)
    allocate (character(len=length) :: text)
    call mpi_recv(text, length, mpi_character, rank, tag_error, mpi_comm_world, mpi_status_ignore)
    call raise(error, code(1), text)
  end subroutine receive_error

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
