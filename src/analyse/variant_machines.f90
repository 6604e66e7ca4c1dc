!> The machines of a sweep in the lanes of a block.
!>
!> What a variant is does not depend on how it gets into a lane: its numbers are set in the input, and a machine is assembled
!> from that with all the checks of a single run. If it has the layout of the block, its numbers are copied into the
!> lane; if not, as where a friction that is zero in the block is not in the variant, or where other numbers of &run are
!> asked for, the variant is to be run alone.
!>
!> Where all targets are plain (`plain_targets_t`), a variant whose values are allowed is what assembly would make of it if they
!> are written over those of another one; the machine is not assembled then.
!>
!> What makes texts is done by one thread at a time, in critical sections named `texts`: gfortran 12 keeps the lengths of
!> temporary texts in static memory, with -frecursive as without it.
module nocdyn_variant_machines
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_plain_targets, only: new_plain_targets, plain_targets_t, trial_value, trials
  use nocdyn_reduced, only: reduced_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_targets, only: set_targets, target_t
  implicit none (type, external)
  private

  public :: new_variant_machines

  real(wp), parameter :: joint_trial = 1.13_wp   ! of all targets together, in their values

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
    type(reduced_t), pointer, private :: single => null()   !! that variant, laid out as the block
    type(lane_numbers_t), private :: single_numbers
    logical, private :: has_learnt = .false.                !! whether the targets have been tried
    logical, private :: began_at_zero = .false.             !! with a target whose value was 0
    type(plain_targets_t), private :: plain
    type(reduced_t), pointer, private :: origin => null()   !! a variant whose numbers most lanes have beside plain values
    type(lane_numbers_t), private :: origin_numbers
    real(wp), allocatable, private :: start(:)              !! its start
    logical, allocatable, private :: is_of_origin(:)        !! of each lane
  contains
    procedure :: put
    procedure :: assembles
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
    !$omp critical (texts)
    allocate (block, self%single, self%origin)
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
    !$omp end critical (texts)
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
      allocate (self%is_of_origin(block%lanes), source=.false.)
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

    logical :: is_quick

    is_quick = .false.
    if (self%plain%are_plain) is_quick = self%plain%may_take(values)
    if (is_quick) then
      call put_plain(self, values, lane, y, verdict, reason)
    else
      call put_assembled(self, values, lane, y, verdict, reason)
      if (verdict == variant_set .and. may_teach(self, values)) call learn(self, values)
    end if
  end subroutine put

  !> The targets are tried with the first variant that is set; once more where that one had a zero, of which no size follows.
  pure logical function may_teach(self, values)
    class(variant_machines_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)

    may_teach = .not. self%has_learnt .or. (self%began_at_zero .and. all(abs(values) > 0))
  end function may_teach

  !> Whether a variant of these values would be assembled.
  pure logical function assembles(self, values)
    class(variant_machines_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)

    assembles = .true.
    if (self%plain%are_plain) assembles = .not. self%plain%may_take(values)
  end function assembles

  !> Writes plain values over those of the origin.
  subroutine put_plain(self, values, lane, y, verdict, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)
    integer, intent(out) :: verdict
    character(len=:), allocatable, intent(inout) :: reason

    verdict = variant_refused
    if (.not. self%plain%have_seen(values)) then
      !$omp critical (texts)
      call set_targets(self%input, self%targets, values, reason)
      !$omp end critical (texts)
      if (reason /= '') return
      call self%plain%see(values)
    end if
    if (.not. self%is_of_origin(lane)) call self%numbers%copy_lane(lane, self%origin_numbers, 1)
    self%is_of_origin(lane) = .true.
    call self%plain%write_values(values, lane, self%numbers)
    y(:) = self%start
    verdict = variant_set
  end subroutine put_plain

  !> Assembles the machine of a variant and copies its numbers.
  subroutine put_assembled(self, values, lane, y, verdict, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)
    integer, intent(out) :: verdict
    character(len=:), allocatable, intent(inout) :: reason

    call form_single(self, values, verdict, reason)
    if (verdict /= variant_set) return
    self%is_of_origin(lane) = .false.
    call self%numbers%copy_lane(lane, self%single_numbers, 1)
    y(:) = reshape(self%single%start(), shape(y))
  end subroutine put_assembled

  !> The formulation of a variant, if it has the layout of the block: `variant_set`.
  subroutine form_single(self, values, verdict, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(out) :: verdict
    character(len=:), allocatable, intent(inout) :: reason

    call assemble(self, values, verdict, reason)
    if (verdict == variant_refused .or. .not. self%has_lanes) return
    if (any(self%is_of_run .and. abs(values - self%base) > 0)) return
    call self%single%formulate(self%is_audited, as_block=.true.)
    call self%single%list_numbers(self%single_numbers)
    if (self%numbers%is_congruent(self%single_numbers)) verdict = variant_set
  end subroutine form_single

  !> Tries whether the targets are plain, from a variant that has the layout of the block and has just been assembled: it
  !> becomes the origin.
  subroutine learn(self, values)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    type(reduced_t), pointer :: other
    type(lane_numbers_t) :: other_numbers
    character(len=:), allocatable :: reason
    integer :: i, k, verdict

    self%has_learnt = .true.
    self%began_at_zero = .not. all(abs(values) > 0)
    self%is_of_origin(:) = .false.
    other => self%origin
    self%origin => self%single
    self%single => other
    other_numbers = self%origin_numbers
    self%origin_numbers = self%single_numbers
    self%single_numbers = other_numbers
    self%start = reshape(self%origin%start(), [self%formulation%states + self%formulation%quadratures])
    self%plain = new_plain_targets(values)
    do i = 1, size(values)
      do k = 1, trials
        call try(self, values, i, trial_value(values(i), k))
      end do
    end do
    call self%plain%conclude()
    if (.not. self%plain%are_plain) return
    call form_single(self, joint_trial * values, verdict, reason)
    if (verdict /= variant_set) return
    self%plain%are_plain = self%plain%is_as_tried(joint_trial * values, self%origin_numbers, self%single_numbers)
  end subroutine learn

  !> Tries one value of one target.
  subroutine try(self, origin, target, value)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: origin(:)   !! values of the targets
    integer, intent(in) :: target
    real(wp), intent(in) :: value
    character(len=:), allocatable :: reason
    real(wp) :: values(size(origin))
    integer :: verdict

    values = origin
    values(target) = value
    call form_single(self, values, verdict, reason)
    if (verdict /= variant_set) return
    if (any(abs(reshape(self%single%start(), shape(self%start)) - self%start) > 0)) return
    associate (group => self%input%groups(self%targets(target)%group))
      call self%plain%judge(target, trim(key_rules(first_key(group%rule) + self%targets(target)%key - 1)%name), value, &
                            self%origin_numbers, self%single_numbers)
    end associate
  end subroutine try

  !> The machine of a variant, which may be run alone.
  subroutine assemble(self, values, verdict, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(out) :: verdict
    character(len=:), allocatable, intent(inout) :: reason
    type(error_t), allocatable :: error

    verdict = variant_refused
    !$omp critical (texts)
    call set_targets(self%input, self%targets, values, reason)
    if (reason == '') then
      call assemble_machine(self%input, self%single%machine, error)
      if (allocated(error)) then
        call move_alloc(error%message, reason)
      else
        verdict = variant_alone
      end if
    end if
    !$omp end critical (texts)
  end subroutine assemble

  !> The formulation, of one lane, of the variant that is to run alone, after `put`.
  subroutine alone_formulation(self, formulation)
    class(variant_machines_t), intent(in) :: self
    class(formulation_t), allocatable, intent(out) :: formulation

    !$omp critical (texts)
    call new_formulation(formulation_word(self%input), self%single%machine, formulation, self%is_audited)
    !$omp end critical (texts)
  end subroutine alone_formulation

  !> Gives up the block.
  subroutine release(self)
    class(variant_machines_t), intent(inout) :: self

    if (associated(self%formulation)) deallocate (self%formulation)
    if (associated(self%single)) deallocate (self%single, self%origin)
  end subroutine release

end module nocdyn_variant_machines
