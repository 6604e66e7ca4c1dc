!> mpirun -n 2 mpi_message_costs MESSAGES
!>
!> What a rank and rank 0 tell each other about a share of the variants: rank 1 reports what it has done, and gets two numbers.
!> Prints one JSON object with the seconds of one share.
program mpi_message_costs
  use contest, only: seconds_now, whole_argument
  use mpi_f08, only: mpi_comm_rank, mpi_comm_world, mpi_double_precision, mpi_finalize, mpi_init, mpi_integer, mpi_recv, &
    mpi_send, mpi_status_ignore
  use nocdyn_kinds, only: wp
  implicit none (type, external)

  real(wp) :: began, seconds
  integer :: i, messages, rank

  call mpi_init()
  call mpi_comm_rank(mpi_comm_world, rank)
  messages = whole_argument(1)
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
    real(wp) :: report(5)
    integer :: numbers(2)

    report = 0.0_wp
    numbers = 0
    if (rank == 0) then
      call mpi_recv(report, 5, mpi_double_precision, 1, 1, mpi_comm_world, mpi_status_ignore)
      call mpi_send(numbers, 2, mpi_integer, 1, 2, mpi_comm_world)
    else if (rank == 1) then
      call mpi_send(report, 5, mpi_double_precision, 0, 1, mpi_comm_world)
      call mpi_recv(numbers, 2, mpi_integer, 0, 2, mpi_comm_world, mpi_status_ignore)
    end if
  end subroutine exchange

end program mpi_message_costs
