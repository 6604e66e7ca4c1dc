!> The machines of a sweep in the lanes of a block.
!>
!> A variant is what a single run of its input would be, however it gets into a lane. If all its values are direct
!> (`direct_parameters_t`), they are written into a lane that holds another variant. Else its machine is assembled. If that has
!> the structure of the block, its parameters are copied into the lane. If not, the variant needs a block of its own: a friction
!> that is 0 in the block and not in the variant is an example; other values of &run or &fatigue
!> are another.
module nocdyn_variant_machines
  use nocdyn_assembly, only: assemble_machine, new_asked_formulation
  use nocdyn_direct_parameters, only: direct_parameters_t, new_direct_parameters
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_joint_blocks, only: joint_block_t
  use nocdyn_joint_sets, only: joint_sets_t, new_joint_sets
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_schema, only: has_word
  use nocdyn_serial_work, only: check_values
  use nocdyn_targets, only: target_t
  implicit none (type, external)
  private

  public :: new_variant_machines

  integer, parameter, public :: variant_set = 0               !! its parameters are in the lane
  integer, parameter, public :: variant_refused = 1           !! there is no such machine
  integer, parameter, public :: variant_needs_own_block = 2   !! it does not fit a lane of the block

  !> Of one thread. Variables of this type are not to be copied: they point to the block.
  type, public :: variant_machines_t
    type(input_t) :: input                                     !! with the values of the last variant that was assembled
    class(formulation_t), pointer :: formulation => null()     !! the block
    class(reduced_t), pointer, private :: block => null()      !! the block if it is reduced: variants share it
    type(target_t), allocatable, private :: targets(:)
    logical, private :: has_energy_balance = .false.           !! whether the work integrals are among the states
    logical, allocatable, private :: is_of_run(:)              !! whether a target is of &run or &fatigue, [targets]
    real(wp), allocatable, private :: base(:)                  !! values of those for the block, [targets]
    type(lane_parameters_t), private :: parameters             !! of a lane of the block, with its structure
    type(direct_parameters_t), private :: direct
    real(wp), allocatable, private :: start(:)                 !! of a variant that has been set, [states + quadratures]
    logical, allocatable, private :: holds_variant(:)          !! lanes into which direct values may be written
    type(reduced_t), pointer, private :: assembled => null()   !! a variant of one lane, laid out as the block
    type(lane_parameters_t), private :: assembled_parameters
  contains
    procedure :: set_variant, set_by_assembly, needs_assembly, own_formulation, set_input, release
  end type variant_machines_t

contains

  !> A block of lanes for the variants of an input, which can be assembled; laid out as a typical variant. `release` frees it.
  subroutine new_variant_machines(input, targets, lanes, with_energy_balance, self, typical)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    integer, intent(in) :: lanes
    logical, intent(in) :: with_energy_balance     !! whether the work integrals are among the states
    type(variant_machines_t), intent(out) :: self
    real(wp), intent(in), optional :: typical(:)   !! values of the targets; absent, refused or with joints that cannot share
                                                   !! a block: as in the input
    class(formulation_t), allocatable :: formulation
    type(machine_t) :: machine
    type(joint_sets_t) :: joints
    character(len=:), allocatable :: message
    logical :: is_typical
    type(target_t) :: no_targets(0)
    real(wp) :: no_values(0)
    integer :: i

    self%input = input
    allocate (self%targets, source=targets)
    self%has_energy_balance = with_energy_balance
    ! which targets are values of &run or &fatigue, and what they are in the input: the block is integrated with them
    allocate (self%is_of_run(size(self%targets)), source=.false.)
    allocate (self%base(size(self%targets)), source=0.0_wp)
    do i = 1, size(self%targets)
      associate (target => self%targets(i))
        self%is_of_run(i) = has_word('run fatigue', self%input%groups(target%group)%kind)
        if (.not. self%is_of_run(i)) cycle
        self%base(i) = self%input%groups(target%group)%values(target%key)%number_at(target%position)
      end associate
    end do
    allocate (self%assembled)
    self%assembled%is_block = .true.
    is_typical = present(typical)
    if (is_typical) then
      call assemble_variant(self%input, targets, typical, machine, message, lanes)
      is_typical = message == ''
      if (is_typical .and. lanes > 1) then
        joints = joints_of(machine)
        is_typical = joints%only_lock()
      end if
    end if
    if (.not. is_typical) then
      self%input = input
      call assemble_variant(self%input, no_targets, no_values, machine, message, lanes)
      if (message /= '') error stop 'nocdyn_variant_machines: the machine of the input cannot be assembled'
    end if
    allocate (self%holds_variant(lanes), source=is_typical)
    if (self%input%groups(self%input%position('run'))%text('formulation') == 'reduced') then
      call share_block(self, machine, lanes)
      if (is_typical) call self%direct%accept(typical)
    else
      call new_asked_formulation(self%input, machine, formulation, with_energy_balance)
      allocate (self%formulation, source=formulation)
    end if
  end subroutine new_variant_machines

  !> The joints of a machine that lock or move.
  type(joint_sets_t) function joints_of(machine) result(joints)
    type(machine_t), intent(in) :: machine

    joints = new_joint_sets(machine%banks, machine%switches, machine%elements%count)
  end function joints_of

  !> Makes the block of an assembled machine of all lanes.
  subroutine share_block(self, machine, lanes)
    type(variant_machines_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lanes
    class(reduced_t), pointer :: block
    type(joint_sets_t) :: joints
    type(error_t), allocatable :: error
    type(machine_t) :: single

    joints = joints_of(machine)
    if (lanes > 1 .and. joints%count > 0) then
      allocate (joint_block_t :: block)
    else
      allocate (reduced_t :: block)
    end if
    block%machine = machine
    block%is_block = .true.
    call block%formulate(self%has_energy_balance)
    select type (block)
    class is (joint_block_t)
      call assemble_machine(self%input, single, error)   ! with the values of the block
      if (allocated(error)) error stop 'nocdyn_variant_machines: the machine of the block cannot be assembled'
      call block%attach(single)
    end select
    block%is_shared = block%joints%only_lock()   ! whatever the number of lanes
    call self%parameters%take(1)
    call block%pass_parameters(self%parameters)
    self%block => block
    self%formulation => block
    allocate (self%start(block%states + block%quadratures), source=0.0_wp)
    if (self%holds_variant(1)) call take_start(block, self%start)
    self%direct = new_direct_parameters(self%input, self%targets, block%machine)
  end subroutine share_block

  !> The start of lane 1.
  subroutine take_start(formulation, start)
    class(reduced_t), intent(in) :: formulation
    real(wp), intent(out) :: start(:)   !! [states + quadratures]
    real(wp) :: starts(formulation%lanes, size(start))

    starts = formulation%start()
    start = starts(1, :)
  end subroutine take_start

  !> Sets the values of the targets in an input and assembles its machine with all the checks of a single run.
  subroutine assemble_variant(input, targets, values, machine, message, lanes)
    type(input_t), intent(inout) :: input
    type(target_t), intent(in) :: targets(:)
    real(wp), intent(in) :: values(:)                         !! [targets]
    type(machine_t), intent(inout) :: machine                 !! of no use if `message` is not ''
    character(len=:), allocatable, intent(out) :: message     !! '', or why there is no such machine
    integer, intent(in), optional :: lanes                    !! 1 if absent
    type(error_t), allocatable :: error

    call check_values(input, targets, values, message)
    if (message == '') call assemble_machine(input, machine, error, lanes)
    if (allocated(error)) call move_alloc(error%message, message)
  end subroutine assemble_variant

  !> Sets a variant in a lane.
  subroutine set_variant(self, values, lane, y, status, message)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)             !! [targets]
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)               !! its start, if it has been set, [states + quadratures]
    integer, intent(out) :: status                            !! variant_...
    character(len=:), allocatable, intent(inout) :: message   !! why it is refused
    logical :: is_set

    if (self%holds_variant(lane) .and. .not. self%needs_assembly(values)) then
      status = variant_refused
      if (.not. self%direct%are_allowed(values)) then
        call check_values(self%input, self%targets, values, message)
        if (message /= '') return
        call self%direct%allow(values)
      end if
      y(:) = self%start
      call self%direct%write_values(values, lane, self%block, y, is_set)
      status = variant_set
      if (is_set) return
      self%holds_variant(lane) = .false.
    end if
    call self%set_by_assembly(values, lane, y, status, message)
  end subroutine set_variant

  !> Whether a variant of these values is assembled in any case.
  pure logical function needs_assembly(self, values)
    class(variant_machines_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)   !! [targets]

    needs_assembly = .not. self%direct%are_accepted(values)
  end function needs_assembly

  !> Assembles a variant and copies it into a lane.
  subroutine set_by_assembly(self, values, lane, y, status, message)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)             !! [targets]
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: y(:)               !! its start, if it has been set, [states + quadratures]
    integer, intent(out) :: status                            !! variant_...
    character(len=:), allocatable, intent(inout) :: message   !! why it is refused

    call assemble_variant(self%input, self%targets, values, self%assembled%machine, message)
    status = variant_refused
    if (message /= '') return
    status = variant_needs_own_block
    if (.not. associated(self%block)) return
    if (any(self%is_of_run .and. abs(values - self%base) > 0)) return
    call self%assembled%formulate(self%has_energy_balance)
    call self%assembled_parameters%take(1)
    call self%assembled%pass_parameters(self%assembled_parameters)
    if (.not. self%parameters%has_same_structure(self%assembled_parameters)) return
    status = variant_set
    call self%assembled_parameters%give(lane)
    call self%block%pass_parameters(self%assembled_parameters)
    call take_start(self%assembled, self%start)
    y(:) = self%start
    self%holds_variant(lane) = .true.
    call self%direct%accept(values)
  end subroutine set_by_assembly

  !> The formulation, of one lane, of a variant that needs a block of its own.
  subroutine own_formulation(self, values, formulation, message)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)   !! [targets]
    class(formulation_t), allocatable, intent(out) :: formulation
    character(len=:), allocatable, intent(out) :: message   !! why there is no such machine, ''
    type(joint_sets_t) :: joints
    type(machine_t) :: machine

    call assemble_variant(self%input, self%targets, values, machine, message)
    if (message /= '') return
    joints = joints_of(machine)
    call new_asked_formulation(self%input, machine, formulation, joints%count > 0 .or. self%has_energy_balance)
  end subroutine own_formulation

  !> Sets the values of a variant in `input`.
  subroutine set_input(self, values, message)
    class(variant_machines_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)           !! [targets]
    character(len=:), allocatable, intent(out) :: message   !! why they are not allowed, ''

    call check_values(self%input, self%targets, values, message)
  end subroutine set_input

  !> Frees the block.
  subroutine release(self)
    class(variant_machines_t), intent(inout) :: self

    if (associated(self%formulation)) deallocate (self%formulation)
    if (associated(self%assembled)) deallocate (self%assembled)
  end subroutine release

end module nocdyn_variant_machines
