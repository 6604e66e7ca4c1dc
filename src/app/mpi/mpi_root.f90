!> Rank 0 of a sweep: computes as the others do, and between its steps keeps the books for all of them.
module nocdyn_mpi_root
  use, intrinsic :: iso_c_binding, only: c_int
  use nocdyn_kinds, only: wp
  use nocdyn_mpi_messages, only: answer, goodbye_word, look, receive_results, receive_word, request_word, results_word, &
    send_word, stop_word
  use nocdyn_sweep_chunk, only: chunk_t
  use nocdyn_sweep_ledger, only: sweep_ledger_t
  implicit none (type, external)
  private

  integer(c_int), parameter :: nap = 200   ! while the others are waited for [microseconds]

  interface
    integer(c_int) function c_usleep(microseconds) bind(c, name='usleep')
      import :: c_int
      integer(c_int), value, intent(in) :: microseconds
    end function c_usleep
  end interface

  type, extends(sweep_ledger_t), public :: mpi_root_t
    integer :: others = 0                       !! ranks besides this one
    integer, private :: farewells = 0           !! of ranks from which nothing more comes
    logical, private :: has_stopped = .false.   !! the others have been told to leave off
  contains
    procedure :: attend
    procedure :: conclude
    procedure, private :: serve
  end type mpi_root_t

contains

  subroutine attend(self)
    class(mpi_root_t), intent(inout) :: self
    integer :: rank, word

    call self%sweep_ledger_t%attend()
    do
      call look(rank, word)
      if (word == 0) exit
      call self%serve(rank, word)
    end do
    if (self%has_stopped) return
    if (.not. self%is_over()) return
    self%has_stopped = .true.
    do rank = 1, self%others
      call send_word(rank, stop_word)
    end do
  end subroutine attend

  !> Does what a message asks for.
  subroutine serve(self, rank, word)
    class(mpi_root_t), intent(inout) :: self
    integer, intent(in) :: rank, word
    type(chunk_t) :: chunk
    real(wp) :: seconds
    integer :: count, first

    select case (word)
    case (request_word)
      call receive_word(rank, word)
      call self%hand_out(first, count)
      call answer(rank, first, count)
    case (results_word)
      call receive_results(rank, chunk, seconds)
      call self%book(chunk, seconds)
    case (goodbye_word)
      call receive_word(rank, word)
      self%farewells = self%farewells + 1
    case default
      error stop 'nocdyn_mpi_root: a message that rank 0 does not know'
    end select
  end subroutine serve

  !> Waits until the others have nothing more to send, and lets them go.
  subroutine conclude(self)
    class(mpi_root_t), intent(inout) :: self
    integer(c_int) :: status
    integer :: rank

    do while (self%farewells < self%others)
      call self%attend()
      status = c_usleep(nap)
    end do
    do rank = 1, self%others
      call send_word(rank, goodbye_word)
    end do
  end subroutine conclude

end module nocdyn_mpi_root
