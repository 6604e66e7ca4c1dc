!> A machine at many times of one motion at once: each lane of a block is a sample of the motion. One number of its input can be
!> changed from evaluation to evaluation.
!>
!> Of the conservative machine only inertias and the restoring moments of couplings act, with their means over what changes with
!> the time or a turn; constant torques balance them at given angles.
module nocdyn_sampled_machine
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_bank, only: append_bank, bank_slot_t, role_coupling, role_phase
  use nocdyn_direct_parameters, only: direct_parameters_t, new_direct_parameters
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_input, only: input_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_system, only: evaluation_ok, pattern_t
  use nocdyn_targets, only: set_targets, target_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_sampled_machine, with_start

  type, public :: sampled_machine_t
    class(reduced_t), allocatable :: formulation         !! of `samples` lanes
    type(pattern_t) :: pattern                           !! positions of its Jacobian
    integer :: samples = 0
    integer :: freedoms = 0                              !! coordinates
    integer :: states = 0                                !! q', q and the internal states
    real(wp) :: value = 0.0_wp                           !! of the target, in its unit
    logical :: is_conservative = .false.
    real(wp), allocatable, private :: balance(:)         !! accelerations by the constant torques [rad/s2], [coordinates]
    type(input_t), private :: input
    type(target_t), allocatable, private :: targets(:)   !! the number that changes, or none
    type(direct_parameters_t), private :: place          !! where it stands in the block
  contains
    procedure :: set_samples, set_value, rates, slopes, crossed_switch, balance_at
    procedure, private :: assemble, write_value, choose_branches
  end type sampled_machine_t

contains

  !> The machine of an input, of the reduced formulation, from its given start angles.
  subroutine new_sampled_machine(input, targets, value, samples, self, error, is_conservative, mold)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)   !! one number of it, or none
    real(wp), intent(in) :: value              !! of the target
    integer, intent(in) :: samples
    type(sampled_machine_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: is_conservative   !! false if absent
    class(reduced_t), intent(in), optional :: mold     !! of the type of the formulation; absent: `reduced_t`

    if (present(is_conservative)) self%is_conservative = is_conservative
    if (present(mold)) then
      allocate (self%formulation, mold=mold)
    else
      allocate (self%formulation)
    end if
    self%input = with_start(input, 'given')
    allocate (self%targets, source=targets)
    self%samples = samples
    self%value = value
    call self%assemble(error)
  end subroutine new_sampled_machine

  !> An input that starts otherwise.
  type(input_t) function with_start(input, word) result(other)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: word   !! of the key `start` of &run
    type(value_t) :: value

    other = input
    value%texts = [string_t(word)]
    value%is_given = .true.
    associate (run => other%groups(other%position('run')))
      run%values(run%key_position('start')) = value
    end associate
  end function with_start

  !> Changes the number of samples.
  subroutine set_samples(self, samples, error)
    class(sampled_machine_t), intent(inout) :: self
    integer, intent(in) :: samples
    type(error_t), allocatable, intent(out) :: error

    if (samples == self%samples) return
    self%samples = samples
    call self%assemble(error)
  end subroutine set_samples

  !> Gives the target another value.
  subroutine set_value(self, value, error)
    class(sampled_machine_t), intent(inout) :: self
    real(wp), intent(in) :: value                      !! in the unit of the target
    type(error_t), allocatable, intent(out) :: error   !! it may not have this value
    logical :: is_set

    if (size(self%targets) == 0 .or. .not. abs(value - self%value) > 0) return
    self%value = value
    is_set = .false.
    if (self%place%are_accepted([value])) call self%write_value(is_set)
    if (.not. is_set) call self%assemble(error)
  end subroutine set_value

  !> Builds the block with the present value.
  subroutine assemble(self, error)
    class(sampled_machine_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: changed
    type(machine_t) :: machine
    character(len=:), allocatable :: message
    integer :: l

    changed = self%input
    if (size(self%targets) > 0) then
      call set_targets(changed, self%targets, [self%value], message)
      if (message /= '') then
        call raise(error, exit_input, self%input%shown_case() // ': ' // message)
        return
      end if
    end if
    call assemble_machine(changed, machine, error, self%samples)
    if (allocated(error)) return
    if (self%is_conservative) call keep_couplings(machine)
    self%formulation%machine = machine
    call self%formulation%formulate(.false.)
    self%freedoms = machine%coordinates%freedoms
    self%states = self%formulation%states
    self%pattern = self%formulation%jacobian_pattern()
    self%place = new_direct_parameters(self%input, self%targets, self%formulation%machine)
    if (size(self%targets) > 0) call self%place%accept([self%value])
    do l = 1, self%samples
      call self%formulation%refresh_lane(l)
    end do
  end subroutine assemble

  !> Takes all elements but couplings out of a machine.
  subroutine keep_couplings(machine)
    type(machine_t), intent(inout) :: machine
    type(bank_slot_t), allocatable :: kept(:)
    integer :: i

    allocate (kept(0))
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%role == role_coupling .or. bank%role == role_phase) call append_bank(kept, bank)
      end associate
    end do
    call move_alloc(kept, machine%banks)
    call machine%to_mean_torque()
  end subroutine keep_couplings

  !> Balances the conservative machine at some angles by constant torques.
  subroutine balance_at(self, angles, error)
    class(sampled_machine_t), intent(inout) :: self
    real(wp), intent(in) :: angles(:)                    !! of the coordinates [rad]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: t(self%samples)
    real(wp), dimension(self%samples, self%states) :: rates, y

    t = 0.0_wp
    y = 0.0_wp
    y(:, self%freedoms + 1:) = spread(angles, 1, self%samples)
    if (allocated(self%balance)) deallocate (self%balance)
    allocate (self%balance(self%freedoms), source=0.0_wp)
    rates = 0.0_wp
    call self%rates(t, y, rates, error)
    self%balance = -rates(1, :self%freedoms)
  end subroutine balance_at

  !> Writes the present value into all lanes.
  subroutine write_value(self, is_set)
    class(sampled_machine_t), intent(inout) :: self
    logical, intent(out) :: is_set
    real(wp) :: start(self%states)
    integer :: l

    start = 0.0_wp
    do l = 1, self%samples
      call self%place%write_values([self%value], l, self%formulation, start, is_set)
      if (.not. is_set) return
      call self%formulation%refresh_lane(l)
    end do
  end subroutine write_value

  !> The derivative of the state at all samples.
  subroutine rates(self, t, y, dydt, error)
    class(sampled_machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)             !! [s], [samples]
    real(wp), contiguous, intent(in) :: y(:, :)          !! states, [samples, states]
    real(wp), contiguous, intent(inout) :: dydt(:, :)
    type(error_t), allocatable, intent(out) :: error     !! laws that have no values there
    real(wp), allocatable :: resting(:, :)
    integer :: status(self%samples)

    status = evaluation_ok
    if (self%is_conservative) then
      resting = y
      resting(:, :self%freedoms) = 0.0_wp
      call self%choose_branches(0.0_wp * t, resting)
      call self%formulation%derivative(0.0_wp * t, resting, dydt, status)
      dydt(:, :self%freedoms) = dydt(:, :self%freedoms) + spread(self%balance, 1, self%samples)
      dydt(:, self%freedoms + 1:2 * self%freedoms) = y(:, :self%freedoms)
    else
      call self%choose_branches(t, y)
      call self%formulation%derivative(t, y, dydt, status)
    end if
    if (any(status /= evaluation_ok)) call raise(error, exit_failed, 'the laws of the machine have no values on the orbit')
  end subroutine rates

  !> The Jacobian at all samples, at the positions of `pattern`.
  subroutine slopes(self, t, y, dfdy)
    class(sampled_machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)             !! [s], [samples]
    real(wp), contiguous, intent(in) :: y(:, :)          !! states, [samples, states]
    real(wp), contiguous, intent(inout) :: dfdy(:, :)    !! [samples, positions]
    real(wp), allocatable :: resting(:, :)
    real(wp) :: dfdt(self%samples, self%states)
    integer :: k, status(self%samples)

    status = evaluation_ok
    if (self%is_conservative) then
      resting = y
      resting(:, :self%freedoms) = 0.0_wp
      call self%choose_branches(0.0_wp * t, resting)
      call self%formulation%jacobian(0.0_wp * t, resting, dfdy, dfdt, status)
      do k = 1, size(self%pattern%column)
        if (self%pattern%column(k) <= self%freedoms .and. self%pattern%row(k) <= self%freedoms) dfdy(:, k) = 0.0_wp
      end do
    else
      call self%choose_branches(t, y)
      call self%formulation%jacobian(t, y, dfdy, dfdt, status)
    end if
  end subroutine slopes

  !> Each sample is on the branch of every law to which its state belongs.
  subroutine choose_branches(self, t, y)
    class(sampled_machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:), y(:, :)

    if (self%formulation%switches == 0) return
    call self%formulation%gather(y)
    call self%formulation%state%choose_branches(self%formulation%machine, t)
  end subroutine choose_branches

  !> The first switch that is on several branches of its law at the samples evaluated last, 0: none.
  pure integer function crossed_switch(self) result(crossed)
    class(sampled_machine_t), intent(in) :: self
    integer :: b, s

    crossed = 0
    associate (banks => self%formulation%state%banks)
      do b = 1, size(banks)
        do s = 1, size(banks(b)%branch, 2)
          crossed = crossed + 1
          if (any(banks(b)%branch(:, s) /= banks(b)%branch(1, s))) return
        end do
      end do
    end associate
    crossed = 0
  end function crossed_switch

end module nocdyn_sampled_machine
