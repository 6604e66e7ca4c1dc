!> The machines of a sweep in the lanes of a block.
!>
!> What a variant is does not depend on how it gets into a lane: its numbers are set in the input, and a machine is assembled
!> from that with all the checks of a single run. If it has the layout of the block, its numbers are copied into the
!> lane; if not, as where a friction that is zero in the block is not in the variant, or where other numbers of &run are
!> asked for, the variant is to be run alone.
module nocdyn_variant_machines
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_targets, only: set_targets, target_t
  implicit none (type, external)
  private

  public :: new_variant_machines

  integer, parameter, public :: variant_set = 0       !! its numbers are in the lane
  integer, parameter, public :: variant_refused = 1   !! there is no such machine
  integer, parameter, public :: variant_alone = 2     !! it needs a formulation of its own

  !> Of one thread. Variables of this type are not to be copied: the lists of numbers point into what they hold.
  type, public :: variant_machines_t
    type(input_t) :: input                                  !! with the numbers of the last variant that was assembled
    class(formulation_t), pointer :: formulation => null()  !! the block
    type(target_t), allocatable, private :: targets(:)
    logical, private :: is_audited = .false.
    logical, private :: has_lanes = .false.                 !! whether variants may share the block
    logical, allocatable, private :: is_of_run(:)           !! of each target, whether it is a number of &run
    real(wp), allocatable, private :: base(:)               !! values of those in the input
    type(lane_numbers_t), private :: numbers                !! of the block
    type(reduced_t), pointer, private :: single => null()   !! the machine of that variant, and its formulation, laid out as the block
    type(lane_numbers_t), private :: single_numbers
  contains
    procedure :: put
    procedure :: alone_formulation
    procedure :: release
  end type variant_machines_t

contains

  !> A block of lanes for the variants of an input, laid out as a typical variant. To be given up by `release`.
  subroutine new_variant_machines(input, targets, lanes, audited, self, error, typical)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    integer, intent(in) :: lanes
    logical, intent(in) :: audited   !! whether the works of the elements are integrated
    type(variant_machines_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! there is no machine of the input
    real(wp), intent(in), optional :: typical(:)       !! values of the targets; absent, or if refused: those of the input
    type(reduced_t), pointer :: block
    character(len=:), allocatable :: complaint

    self%input = input
    allocate (self%targets, source=targets)
    self%is_audited = audited
    call look_at_run(self)
    allocate (block, self%single)
    complaint = ''
    if (present(typical)) then
      call set_targets(self%input, targets, typical, complaint)
      if (complaint == '') call assemble_machine(self%input, block%machine, error, lanes)
      if (complaint /= '' .or. allocated(error)) self%input = input
    end if
    if (.not. present(typical) .or. complaint /= '' .or. allocated(error)) then
      call assemble_machine(self%input, block%machine, error, lanes)
    end if
    if (.not. allocated(error)) call lay_out(self, block)
  end subroutine new_variant_machines

  !> Which targets are numbers of &run, and what they are for the block.
  subroutine look_at_run(self)
    type(variant_machines_t), intent(inout) :: self
    integer :: i

    allocate (self%is_of_run(size(self%targets)), source=.false.)
    allocate (self%base(size(self%targets)), source=0.0_wp)
    do i = 1, size(self%targets)
      associate (target => self%targets(i))
        self%is_of_run(i) = self%input%groups(target%group)%kind == 'run'
        if (.not. self%is_of_run(i)) cycle
        associate (value => self%input%groups(target%group)%values(target%key))
          if (target%is_whole) then
            self%base(i) = real(value%whole_numbers(target%place), wp)
          else
            self%base(i) = value%numbers(target%place)
          end if
        end associate
      end associate
    end do
  end subroutine look_at_run

  !> Makes the block of its machine.
  subroutine lay_out(self, block)
    type(variant_machines_t), intent(inout) :: self
    type(reduced_t), pointer, intent(inout) :: block
    class(formulation_t), allocatable :: formulation

    self%has_lanes = formulation_word(self%input) == 'reduced'
    if (self%has_lanes) then
      call block%formulate(self%is_audited, as_block=.true.)
      call block%list_numbers(self%numbers)
      self%formulation => block
    else
      call new_formulation(formulation_word(self%input), block%machine, formulation, self%is_audited)
      allocate (self%formulation, source=formulation)
      deallocate (block)
    end if
  end subroutine lay_out

  function formulation_word(input) result(word)
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: word
    type(group_t) :: run

    run = input%single('run')
    word = run%text('formulation')
  end function formulation_word

  !> Puts a variant into a lane.
  subroutine put(self, values, lane, y, verdict, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)   !! of the targets
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)     !! its start, if it has been set
    integer, intent(out) :: verdict                 !! variant_...
    character(len=:), allocatable, intent(inout) :: reason   !! why it is refused

    call assemble(self, values, verdict, reason)
    if (verdict == variant_refused .or. .not. self%has_lanes) return
    if (any(self%is_of_run .and. abs(values - self%base) > 0)) return
    call self%single%formulate(self%is_audited, as_block=.true.)
    call self%single%list_numbers(self%single_numbers)
    if (.not. self%numbers%is_congruent(self%single_numbers)) return
    call self%numbers%copy_lane(lane, self%single_numbers, 1)
    y(:) = reshape(self%single%start(), shape(y))
    verdict = variant_set
  end subroutine put

  !> The machine of a variant, which may be run alone.
  subroutine assemble(self, values, verdict, reason)
    type(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(out) :: verdict
    character(len=:), allocatable, intent(inout) :: reason
    type(error_t), allocatable :: error

    verdict = variant_refused
    call set_targets(self%input, self%targets, values, reason)
    if (reason /= '') return
    call assemble_machine(self%input, self%single%machine, error)
    if (allocated(error)) then
      call move_alloc(error%message, reason)
    else
      verdict = variant_alone
    end if
  end subroutine assemble

  !> The formulation, of one lane, of the variant that is to run alone, after `put`.
  subroutine alone_formulation(self, formulation)
    class(variant_machines_t), intent(in) :: self
    class(formulation_t), allocatable, intent(out) :: formulation

    call new_formulation(formulation_word(self%input), self%single%machine, formulation, self%is_audited)
  end subroutine alone_formulation

  !> Gives up the block.
  subroutine release(self)
    class(variant_machines_t), intent(inout) :: self

    if (associated(self%formulation)) deallocate (self%formulation)
    if (associated(self%single)) deallocate (self%single)
  end subroutine release

end module nocdyn_variant_machines
