!> The machines of a sweep in the lanes of a block.
!>
!> What a variant is does not depend on how it gets into a lane: its numbers are set in the input, and a machine is assembled
!> from that with all the checks of a single run. If it has the layout of the block, its numbers are copied into the
!> lane; if not, as where a friction that is zero in the block is not in the variant, or where other numbers of &run are
!> asked for, the variant is to be run alone.
!>
!> Where all targets are plain (`direct_parameters_t`) or inertias, a variant whose values are allowed is what assembly would make
!> of it if they are written over those of another one, the origin; then no machine is assembled. The constraints do not
!> know of inertias, so that only the responses to moments follow from them. One variant that is set in both ways must have
!> the same bits before any is set so.
!>
!> What makes texts is done by one thread at a time, in critical sections named `texts`: gfortran 12 keeps the lengths of
!> temporary texts in static memory, with -frecursive as without it.
module nocdyn_variant_machines
  use nocdyn_assembly, only: assemble_machine, new_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_direct_parameters, only: new_direct_parameters, direct_parameters_t, trial_value, trials
  use nocdyn_reduced, only: reduced_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_targets, only: set_targets, target_t
  implicit none (type, external)
  private

  public :: new_variant_machines

  real(wp), parameter :: joint_trial = 1.13_wp   ! of all targets together, in their values

  integer, parameter, public :: variant_set = 0       !! its numbers are in the lane
  integer, parameter, public :: variant_refused = 1   !! there is no such machine
  integer, parameter, public :: variant_needs_own_block = 2     !! it needs a formulation of its own

  !> Of one thread. Variables of this type are not to be copied: the lists of numbers point into what they hold.
  type, public :: variant_machines_t
    type(input_t) :: input                                  !! with the numbers of the last variant that was assembled
    class(formulation_t), pointer :: formulation => null()  !! the block
    type(reduced_t), pointer, private :: block => null()    !! the same, if variants may share it
    type(target_t), allocatable, private :: targets(:)
    logical, private :: has_energy_balance = .false.
    logical, allocatable, private :: is_of_run(:)           !! of each target, whether it is a number of &run
    real(wp), allocatable, private :: base(:)               !! values of those in the input
    type(lane_parameters_t), private :: parameters                !! of the block
    type(reduced_t), pointer, private :: assembled => null()   !! that variant, laid out as the block
    type(lane_parameters_t), private :: assembled_parameters
    logical, private :: has_learnt = .false.                !! whether the targets have been tried
    logical, private :: began_at_zero = .false.             !! with a target whose value was 0
    type(direct_parameters_t), private :: direct
    type(reduced_t), pointer, private :: reference => null()   !! a variant whose numbers most lanes have beside plain values
    type(lane_parameters_t), private :: reference_parameters
    real(wp), allocatable, private :: start(:)              !! its start
    logical, allocatable, private :: is_of_reference(:)        !! of each lane
    integer, allocatable, private :: weighed(:)             !! targets that are inertias
    integer, allocatable, private :: weighed_bodies(:)      !! of those
    integer, allocatable, private :: weighed_groups(:)      !! of geared bodies, in which these are
  contains
    procedure :: set_variant
    procedure :: needs_assembly
    procedure :: own_formulation
    procedure :: release
  end type variant_machines_t

contains

  !> A block of lanes for the variants of an input, laid out as a typical variant. To be given up by `release`.
  subroutine new_variant_machines(input, targets, lanes, with_energy_balance, self, error, typical)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    integer, intent(in) :: lanes
    logical, intent(in) :: with_energy_balance   !! whether the works of the elements are integrated
    type(variant_machines_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! there is no machine of the input
    real(wp), intent(in), optional :: typical(:)       !! values of the targets; absent, or if refused: those of the input
    type(reduced_t), pointer :: block
    character(len=:), allocatable :: message

    self%input = input
    allocate (self%targets, source=targets)
    self%has_energy_balance = with_energy_balance
    call look_at_run(self)
    !$omp critical (texts)
    allocate (block, self%assembled, self%reference)
    message = 'there is no typical variant'
    if (present(typical)) then
      call set_targets(self%input, targets, typical, message)
      if (message == '') call assemble_machine(self%input, block%machine, error, lanes)
      if (message /= '' .or. allocated(error)) self%input = input
    end if
    if (message /= '' .or. allocated(error)) call assemble_machine(self%input, block%machine, error, lanes)
    if (.not. allocated(error)) call lay_out(self, block)
    if (allocated(error)) deallocate (block)
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
          if (target%is_integer) then
            self%base(i) = real(value%whole_numbers(target%position), wp)
          else
            self%base(i) = value%numbers(target%position)
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

    if (formulation_word(self%input) == 'reduced') then
      call block%formulate(self%has_energy_balance, as_block=.true.)
      call block%list_parameters(self%parameters)
      self%block => block
      self%formulation => block
      allocate (self%is_of_reference(block%lanes), source=.false.)
    else
      call new_formulation(formulation_word(self%input), block%machine, formulation, self%has_energy_balance)
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
  subroutine set_variant(self, values, lane, y, status, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)   !! of the targets
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)     !! its start, if it has been set
    integer, intent(out) :: status                 !! variant_...
    character(len=:), allocatable, intent(inout) :: reason   !! why it is refused
    logical :: is_set

    is_set = .false.
    if (.not. self%needs_assembly(values)) then
      call check_values(self, values, reason)
      status = variant_refused
      if (reason /= '') return
      call write_directly(self, values, lane, y, is_set)
      status = variant_set
    end if
    if (is_set) return
    call form_assembled(self, values, status, reason)
    if (status /= variant_set) return
    call self%parameters%copy_lane(lane, self%assembled_parameters, 1)
    y(:) = reshape(self%assembled%start(), shape(y))
    self%is_of_reference(lane) = .false.
    if (may_teach(self, values)) call learn(self, values, lane)
  end subroutine set_variant

  !> The targets are tried with the first variant that is set; once more where that one had a zero, of which no size follows.
  pure logical function may_teach(self, values)
    class(variant_machines_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)

    may_teach = .not. self%has_learnt .or. (self%began_at_zero .and. all(abs(values) > 0))
  end function may_teach

  !> Whether a variant of these values would be assembled.
  pure logical function needs_assembly(self, values)
    class(variant_machines_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)

    needs_assembly = .true.
    if (self%direct%are_direct) needs_assembly = .not. self%direct%may_take(values)
  end function needs_assembly

  !> Whether values that need no assembly are allowed.
  subroutine check_values(self, values, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    character(len=:), allocatable, intent(inout) :: reason   !! '' if they are

    reason = ''
    if (self%direct%have_seen(values)) return
    !$omp critical (texts)
    call set_targets(self%input, self%targets, values, reason)
    !$omp end critical (texts)
    if (reason == '') call self%direct%see(values)
  end subroutine check_values

  !> Writes values over those of the origin.
  subroutine write_directly(self, values, lane, y, is_set)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)
    logical, intent(out) :: is_set   !! rounding may hide inertias
    logical :: is_indefinite

    if (.not. self%is_of_reference(lane)) call self%parameters%copy_lane(lane, self%reference_parameters, 1)
    self%is_of_reference(lane) = .true.
    call self%direct%write_values(values, lane, self%parameters)
    y(:) = self%start
    is_set = .true.
    if (size(self%weighed) == 0) return
    call self%block%update_inertia(lane, self%weighed_bodies, values(self%weighed), self%weighed_groups, is_indefinite)
    is_set = .not. is_indefinite
    self%is_of_reference(lane) = is_set
    if (is_set) call self%block%project_start_speeds(lane, y)
  end subroutine write_directly

  !> The formulation of a variant, if it has the layout of the block: `variant_set`.
  subroutine form_assembled(self, values, status, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(out) :: status
    character(len=:), allocatable, intent(inout) :: reason

    call assemble(self, values, status, reason)
    if (status == variant_refused .or. .not. associated(self%block)) return
    if (any(self%is_of_run .and. abs(values - self%base) > 0)) return
    call self%assembled%formulate(self%has_energy_balance, as_block=.true.)
    call self%assembled%list_parameters(self%assembled_parameters)
    if (self%parameters%has_same_structure(self%assembled_parameters)) status = variant_set
  end subroutine form_assembled

  !> Tries whether the targets need assembly, from the variant that has just been put into a lane: it becomes the origin.
  subroutine learn(self, values, lane)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: lane
    integer :: i, k

    self%has_learnt = .true.
    self%began_at_zero = .not. all(abs(values) > 0)
    call set_reference(self)
    self%direct = new_direct_parameters(values)
    call find_weighed(self)
    do i = 1, size(values)
      if (any(self%weighed == i)) then
        call self%direct%exempt(i)
        cycle
      end if
      do k = 1, trials
        call try(self, values, i, trial_value(values(i), k))
      end do
    end do
    call self%direct%conclude()
    if (self%direct%are_direct) self%direct%are_direct = is_set_the_same(self, joint_trial * values, lane)
    call self%parameters%copy_lane(lane, self%reference_parameters, 1)
    self%is_of_reference(lane) = .true.
  end subroutine learn

  !> Makes the variant that has been assembled the origin.
  subroutine set_reference(self)
    class(variant_machines_t), intent(inout) :: self
    type(reduced_t), pointer :: other
    type(lane_parameters_t) :: other_parameters

    self%is_of_reference(:) = .false.
    other => self%reference
    self%reference => self%assembled
    self%assembled => other
    other_parameters = self%reference_parameters
    self%reference_parameters = self%assembled_parameters
    self%assembled_parameters = other_parameters
    self%start = reshape(self%reference%start(), [self%block%states + self%block%quadratures])
  end subroutine set_reference

  !> Finds the targets that are inertias, unless start speeds were projected by them.
  subroutine find_weighed(self)
    class(variant_machines_t), intent(inout) :: self
    integer, allocatable :: bodies(:)
    integer :: g, i

    self%weighed = pack([(i, i=1, size(self%targets))], [(key_of(self, i) == 'inertia', i=1, size(self%targets))])
    if (allocated(self%reference%machine%start_impulse)) self%weighed = [integer ::]
    allocate (bodies, source=self%input%groups_named('body'))
    self%weighed_bodies = [(findloc(bodies, self%targets(self%weighed(i))%group, dim=1), i=1, size(self%weighed))]
    associate (groups => self%reference%machine%groups)
      self%weighed_groups = pack([(g, g=1, size(groups))], [(has_one_of(groups(g)%bodies, self%weighed_bodies), &
                                                             g=1, size(groups))])
    end associate
  end subroutine find_weighed

  pure logical function has_one_of(list, members)
    integer, intent(in) :: list(:), members(:)
    integer :: i

    has_one_of = any([(any(list == members(i)), i=1, size(members))])
  end function has_one_of

  pure function key_of(self, target) result(key)
    class(variant_machines_t), intent(in) :: self
    integer, intent(in) :: target
    character(len=len(key_rules%name)) :: key

    associate (group => self%input%groups(self%targets(target)%group))
      key = key_rules(first_key(group%rule) + self%targets(target)%key - 1)%name
    end associate
  end function key_of

  !> Whether a variant has the same bits with and without assembly.
  logical function is_set_the_same(self, values, lane) result(is_same)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: lane
    character(len=:), allocatable :: reason
    real(wp), dimension(size(self%start)) :: assembled, start
    integer :: status

    is_same = .false.
    call form_assembled(self, values, status, reason)
    if (status /= variant_set) return
    assembled = reshape(self%assembled%start(), shape(assembled))
    call write_directly(self, values, lane, start, is_same)
    is_same = is_same .and. size(self%parameters%differences(lane, self%assembled_parameters, 1)) == 0 .and. &
              self%parameters%has_same_curves(lane, self%assembled_parameters, 1) .and. &
              .not. any(abs(start - assembled) > 0)
  end function is_set_the_same

  !> Tries one value of one target.
  subroutine try(self, reference, target, value)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: reference(:)   !! values of the targets
    integer, intent(in) :: target
    real(wp), intent(in) :: value
    character(len=:), allocatable :: reason
    real(wp) :: values(size(reference))
    integer :: status

    values = reference
    values(target) = value
    call form_assembled(self, values, status, reason)
    if (status /= variant_set) return
    if (any(abs(reshape(self%assembled%start(), shape(self%start)) - self%start) > 0)) return
    call self%direct%judge(target, trim(key_of(self, target)), value, self%reference_parameters, self%assembled_parameters)
  end subroutine try

  !> The machine of a variant, which may be run alone.
  subroutine assemble(self, values, status, reason)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(out) :: status
    character(len=:), allocatable, intent(inout) :: reason
    type(error_t), allocatable :: error

    status = variant_refused
    !$omp critical (texts)
    call set_targets(self%input, self%targets, values, reason)
    if (reason == '') then
      call assemble_machine(self%input, self%assembled%machine, error)
      if (allocated(error)) then
        call move_alloc(error%message, reason)
      else
        status = variant_needs_own_block
      end if
    end if
    !$omp end critical (texts)
  end subroutine assemble

  !> The formulation, of one lane, of a variant that is to run alone.
  subroutine own_formulation(self, values, formulation)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)   !! of the targets
    class(formulation_t), allocatable, intent(out) :: formulation
    character(len=:), allocatable :: reason
    integer :: status

    call assemble(self, values, status, reason)
    if (status == variant_refused) error stop 'nocdyn_variant_machines: a variant is refused always or never'
    !$omp critical (texts)
    call new_formulation(formulation_word(self%input), self%assembled%machine, formulation, self%has_energy_balance)
    !$omp end critical (texts)
  end subroutine own_formulation

  !> Gives up the block.
  subroutine release(self)
    class(variant_machines_t), intent(inout) :: self

    if (associated(self%formulation)) deallocate (self%formulation)
    if (associated(self%assembled)) deallocate (self%assembled, self%reference)
  end subroutine release

end module nocdyn_variant_machines
