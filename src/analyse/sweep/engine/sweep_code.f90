!> Programs for the series of a sweep: when it pays to write and compile one, and what the threads share of it.
!>
!> The work of a sweep is counted, not timed: what the variants so far have taken, in steps times the cost of a step, tells what
!> all will take. Results have the same bits with a program as without, so it does not matter when the threads change to it.
module nocdyn_sweep_code
  use nocdyn_compiled_code, only: load_code, loaded_code_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_methods, only: taylor_cost
  use nocdyn_reduced, only: reduced_t
  use nocdyn_serial_work, only: write_code
  use omp_lib, only: omp_lock_kind, omp_set_lock, omp_unset_lock
  implicit none (type, external)
  private

  public :: new_sweep_code

  !> When a program is compiled: if it pays, always if it can, never.
  character(len=6), parameter, public :: compile_choices(3) = ['auto  ', 'always', 'never ']
  integer, parameter :: compile_auto = 1, compile_always = 2, compile_never = 3

  real(wp), parameter :: least_work = 2.0e9_wp   ! of a sweep that a program is compiled for [ns]
  integer, parameter :: most_programs = 4        ! of a sweep: the terms of its variants can grow

  !> What the threads of a process share.
  type, public :: sweep_code_t
    integer(omp_lock_kind) :: lock                 !! of OpenMP, while there are threads
    integer, private :: choice = compile_auto
    integer, private :: variants = 0               !! that are to be computed
    character(len=:), allocatable, private :: obstacle   !! why there is no program; not allocated: none was refused
    logical, private :: is_loaded = .false.
    integer, private :: counted = 0                !! variants whose work is known
    real(wp), private :: work = 0.0_wp             !! of these [ns]
    integer, private :: programs = 0               !! that were written
    logical, private :: is_busy = .false.          !! whether a thread makes one
    type(loaded_code_t), private :: loaded
  contains
    procedure :: count_work, offer, unmet_wish
  end type sweep_code_t

contains

  !> The choice of a command line, before anything is compiled.
  pure type(sweep_code_t) function new_sweep_code(choice, variants) result(self)
    character(len=*), intent(in) :: choice   !! of `compile_choices`; '': the first one
    integer, intent(in) :: variants          !! that are to be computed

    self%choice = max(findloc(compile_choices, choice, dim=1), compile_auto)
    self%variants = variants
  end function new_sweep_code

  !> Why there is no program that was asked for, ''.
  pure subroutine unmet_wish(self, reason)
    class(sweep_code_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: reason

    reason = ''
    if (self%choice == compile_always .and. allocated(self%obstacle)) reason = self%obstacle
  end subroutine unmet_wish

  !> Adds the work of variants that have been computed.
  subroutine count_work(self, formulation, order, variants, steps)
    class(sweep_code_t), intent(inout) :: self
    class(formulation_t), intent(in) :: formulation
    integer, intent(in) :: order             !! of the series, 0 without
    integer, intent(in) :: variants, steps   !! numbers of variants, and of their steps

    if (order == 0 .or. self%choice /= compile_auto) return
    call omp_set_lock(self%lock)
    self%counted = self%counted + variants
    self%work = self%work + steps * taylor_cost(formulation, order)
    call omp_unset_lock(self%lock)
  end subroutine count_work

  !> Attaches a program to a block whose series are prepared, if there is one or one is due: the first thread that needs it makes
  !> it, the others go on without.
  subroutine offer(self, formulation)
    class(sweep_code_t), intent(inout) :: self
    class(formulation_t), intent(inout) :: formulation
    type(loaded_code_t) :: loaded
    character(len=:), allocatable :: obstacle, text
    logical :: is_due

    if (self%choice == compile_never) return
    select type (formulation)
    class is (reduced_t)
      if (formulation%runs_code()) return
      call omp_set_lock(self%lock)
      if (self%is_loaded) call formulation%attach_code(self%loaded)
      is_due = .not. (self%is_busy .or. self%programs == most_programs .or. allocated(self%obstacle) .or. formulation%runs_code())
      if (is_due .and. self%choice == compile_auto) then
        is_due = self%work * self%variants > least_work * self%counted
      end if
      if (is_due) self%programs = self%programs + 1
      self%is_busy = self%is_busy .or. is_due
      call omp_unset_lock(self%lock)
      if (.not. is_due) return
      call write_code(formulation, text, obstacle)
      if (obstacle == '') call load_code(text, loaded, obstacle)
      call omp_set_lock(self%lock)
      self%is_busy = .false.
      if (obstacle /= '') then
        self%obstacle = obstacle
      else
        self%loaded = loaded
        self%is_loaded = .true.
        call formulation%attach_code(loaded)
      end if
      call omp_unset_lock(self%lock)
    end select
  end subroutine offer

end module nocdyn_sweep_code
