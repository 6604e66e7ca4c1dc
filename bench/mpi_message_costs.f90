!> mpirun -n 2 mpi_message_costs BYTES MESSAGES
!>
!> What a rank and rank 0 tell each other about a chunk, without the chunk: rank 1 asks, gets two numbers, and sends BYTES of
!> results and a time. Prints one JSON object with the seconds of one chunk.
program mpi_message_costs
  use contest, only: seconds_now, whole_argument
  use mpi_f08, only: mpi_byte, mpi_comm_rank, mpi_comm_world, mpi_double_precision, mpi_finalize, mpi_init, mpi_integer, &
    mpi_recv, mpi_send, mpi_status_ignore
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  character(len=:), allocatable :: bytes
  real(wp) :: began, seconds
  integer :: i, messages, rank

  call mpi_init()
  call mpi_comm_rank(mpi_comm_world, rank)
  allocate (character(len=whole_argument(1)) :: bytes)
  bytes(:) = ' '
  messages = whole_argument(2)
  do i = 1, 100
    call exchange()
  end do
  began = seconds_now()
  do i = 1, messages
    call exchange()
  end do
  seconds = (seconds_now() - began) / messages
  if (rank == 1) print '(a, es13.6, a)', '{"seconds": ', seconds, '}'
  call mpi_finalize()

contains

  subroutine exchange()
    real(wp) :: time(1)
    integer :: numbers(2), word(1)

    time = 0.0_wp
    numbers = 0
    word = 0
    if (rank == 0) then
      call mpi_recv(word, 1, mpi_integer, 1, 1, mpi_comm_world, mpi_status_ignore)
      call mpi_send(numbers, 2, mpi_integer, 1, 2, mpi_comm_world)
      call mpi_recv(bytes, len(bytes), mpi_byte, 1, 3, mpi_comm_world, mpi_status_ignore)
      call mpi_recv(time, 1, mpi_double_precision, 1, 4, mpi_comm_world, mpi_status_ignore)
    else if (rank == 1) then
      call mpi_send(word, 1, mpi_integer, 0, 1, mpi_comm_world)
      call mpi_recv(numbers, 2, mpi_integer, 0, 2, mpi_comm_world, mpi_status_ignore)
      call mpi_send(bytes, len(bytes), mpi_byte, 0, 3, mpi_comm_world)
      call mpi_send(time, 1, mpi_double_precision, 0, 4, mpi_comm_world)
    end if
  end subroutine exchange

end program mpi_message_costs
