!> Limits on the threads and processes of a sweep.
module nocdyn_sweep_threads
  use nocdyn_arguments, only: arguments_t
  use nocdyn_console, only: print_text
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_text, only: to_text
  use omp_lib, only: omp_get_num_procs
  implicit none (type, external)
  private

  public :: usable_threads, print_thread_note, refuse_ranks

  integer, parameter :: max_per_processor = 8   ! threads; many more would cost start-up time and memory

contains

  !> The requested number of threads, limited by the number of processors.
  integer function usable_threads(wanted)
    integer, intent(in) :: wanted   !! threads

    usable_threads = min(wanted, max_per_processor * omp_get_num_procs())
  end function usable_threads

  !> Prints a note if fewer threads are used than requested.
  subroutine print_thread_note(file, wanted)
    character(len=*), intent(in) :: file   !! of the input
    integer, intent(in) :: wanted          !! threads

    if (usable_threads(wanted) == wanted) return
    call print_text(file // ': note: ' // to_text(usable_threads(wanted)) // ' threads instead of ' // to_text(wanted) // &
                    ': at most ' // to_text(max_per_processor) // ' for each available processor')
  end subroutine print_thread_note

  !> Refuses several processes of an MPI job without --shard: each of them would compute the whole sweep.
  subroutine refuse_ranks(arguments, error)
    type(arguments_t), intent(in) :: arguments
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: names(*) = [character(len=20) :: 'OMPI_COMM_WORLD_SIZE', 'PMI_SIZE']   ! Open MPI, MPICH
    character(len=12) :: value
    integer :: i, ranks, status

    if (arguments%shards > 0) return
    do i = 1, size(names)
      call get_environment_variable(trim(names(i)), value, status=status)
      if (status /= 0) cycle
      read (value, *, iostat=status) ranks
      if (status /= 0 .or. ranks <= 1) cycle
      call raise(error, exit_input, 'this is one of ' // to_text(ranks) // ' processes of an MPI job (' // trim(names(i)) // &
                 '), which would all compute the same sweep; nocdyn-mpi sweep distributes it among them')
      return
    end do
  end subroutine refuse_ranks

end module nocdyn_sweep_threads
