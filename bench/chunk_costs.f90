!> What a chunk of a sweep costs besides the integration of its variants.
!>
!> chunk_costs INPUT VARIANTS CHUNK FOLDER
!>
!> Computes VARIANTS of the sweep in INPUT in chunks of CHUNK with one thread, writes them to a journal in FOLDER, and prints one
!> JSON object: seconds of the computation, of the journal and of the hand-out, bytes of a chunk, steps of all variants, and the
!> lanes of the block.
module counting_scheduler
  use contest, only: seconds_now
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_scheduler, only: scheduler_t
  use nocdyn_sweep_chunk, only: chunk_t, pack_chunk
  use nocdyn_sweep_journal, only: sweep_journal_t
  implicit none (type, external)
  private

  !> Hands out chunks of one size, and writes the results to a journal.
  type, extends(scheduler_t), public :: counting_scheduler_t
    integer :: size = 1    !! of a chunk
    integer :: left = 0    !! variants
    integer :: first = 1   !! of the next chunk
    type(sweep_journal_t) :: journal
    real(wp) :: handing = 0.0_wp, writing = 0.0_wp   !! [s]
    integer :: bytes = 0   !! of a chunk
    integer :: steps = 0   !! of all variants
  contains
    procedure :: next_chunk
    procedure :: submit
    procedure :: poll
    procedure :: finalise
    procedure :: is_cancelled
  end type counting_scheduler_t

contains

  subroutine next_chunk(self, first, count)
    class(counting_scheduler_t), intent(inout) :: self
    integer, intent(out) :: first, count
    real(wp) :: began

    began = seconds_now()
    first = self%first
    count = min(self%size, self%left)
    self%first = first + count
    self%left = self%left - count
    self%handing = self%handing + seconds_now() - began
  end subroutine next_chunk

  subroutine submit(self, chunk, seconds)
    class(counting_scheduler_t), intent(inout) :: self
    type(chunk_t), intent(in) :: chunk
    real(wp), intent(in) :: seconds
    type(error_t), allocatable :: error
    character(len=:), allocatable :: packed
    real(wp) :: began

    if (chunk%count > self%size .or. seconds < 0) error stop 'counting_scheduler: a chunk that was not handed out'
    began = seconds_now()
    call self%journal%append(chunk, error)
    self%writing = self%writing + seconds_now() - began
    if (allocated(error)) error stop 'counting_scheduler: the journal cannot be written'
    self%steps = self%steps + sum(chunk%steps)
    if (self%bytes > 0) return
    call pack_chunk(chunk, packed)
    self%bytes = len(packed)
  end subroutine submit

  subroutine poll(self)
    class(counting_scheduler_t), intent(inout) :: self

    if (self%left < 0) error stop 'counting_scheduler: more was handed out than there is'
  end subroutine poll

  subroutine finalise(self)
    class(counting_scheduler_t), intent(inout) :: self

    if (self%left > 0) error stop 'counting_scheduler: something is left'
  end subroutine finalise

  logical function is_cancelled(self)
    class(counting_scheduler_t), intent(in) :: self

    is_cancelled = self%size < 1
  end function is_cancelled

end module counting_scheduler

program chunk_costs
  use, intrinsic :: iso_fortran_env, only: error_unit
  use contest, only: seconds_now, text_argument, whole_argument
  use counting_scheduler, only: counting_scheduler_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_kinds, only: wp
  use nocdyn_sweep, only: prepare_sweep, sweep_setup_t
  use nocdyn_sweep_code, only: sweep_code_t
  use nocdyn_sweep_block, only: new_sweep_block, sweep_block_t
  use nocdyn_sweep_journal, only: create_journal
  use nocdyn_sweep_plan, only: make_plan, new_sweep_header, sweep_plan_t
  use nocdyn_text, only: string_t
  use omp_lib, only: omp_destroy_lock, omp_init_lock
  implicit none (type, external)

  type(sweep_plan_t), target :: plan
  type(sweep_setup_t) :: setup
  type(sweep_block_t), allocatable, target :: block
  type(counting_scheduler_t), target :: scheduler
  type(sweep_code_t), target :: code
  real(wp) :: computing

  call set_up()
  call measure()
  print '(a, 3(es13.6, a), 3(i0, a))', '{"compute": ', computing, ', "journal": ', scheduler%writing, ', "hand_out": ', &
    scheduler%handing, ', "bytes": ', scheduler%bytes, ', "steps": ', scheduler%steps, ', "lanes": ', setup%lanes, '}'

contains

  subroutine set_up()
    type(input_t) :: input
    type(error_t), allocatable :: error
    type(string_t) :: overrides(0)

    call read_input(text_argument(1), overrides, input, error)
    if (.not. allocated(error)) call make_plan(input, plan, error)
    if (.not. allocated(error)) call prepare_sweep(plan, setup, error)
    if (allocated(error)) call give_up(error%message)
    scheduler%left = whole_argument(2)
    scheduler%size = whole_argument(3)
    call omp_init_lock(scheduler%lock)
    call omp_init_lock(code%lock)
    allocate (block)
    call new_sweep_block(plan, setup%lanes, setup%has_energy_balance, scheduler, code, block)
    call create_journal(text_argument(4), 'sweep.journal', new_sweep_header(plan, 1, 1), scheduler%journal, error)
    if (allocated(error)) call give_up(error%message)
  end subroutine set_up

  subroutine measure()
    real(wp) :: began

    began = seconds_now()
    call block%compute_chunks()
    computing = seconds_now() - began - scheduler%writing - scheduler%handing
    call scheduler%journal%file%remove()
    call scheduler%finalise()
    call omp_destroy_lock(scheduler%lock)
  end subroutine measure

  subroutine give_up(message)
    character(len=*), intent(in) :: message

    write (error_unit, '(a)') 'chunk_costs: ' // message
    error stop 1
  end subroutine give_up

end program chunk_costs
