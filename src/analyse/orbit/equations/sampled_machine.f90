!> A machine at many times of one motion at once: each lane of a block is a sample of the motion. One number of its input can be
!> changed from evaluation to evaluation.
module nocdyn_sampled_machine
  use nocdyn_assembly, only: assemble_machine
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
    type(reduced_t) :: formulation                       !! of `samples` lanes
    type(pattern_t) :: pattern                           !! positions of its Jacobian
    integer :: samples = 0
    integer :: freedoms = 0                              !! coordinates
    integer :: states = 0                                !! q', q and the internal states
    real(wp) :: value = 0.0_wp                           !! of the target, in its unit
    type(input_t), private :: input
    type(target_t), allocatable, private :: targets(:)   !! the number that changes, or none
    type(direct_parameters_t), private :: place          !! where it stands in the block
  contains
    procedure :: set_samples, set_value, rates, slopes, crossed_switch
    procedure, private :: assemble, write_value, choose_branches
  end type sampled_machine_t

contains

  !> The machine of an input, of the reduced formulation, from its given start angles.
  subroutine new_sampled_machine(input, targets, value, samples, self, error)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)   !! one number of it, or none
    real(wp), intent(in) :: value              !! of the target
    integer, intent(in) :: samples
    type(sampled_machine_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error

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
    integer :: status(self%samples)

    status = evaluation_ok
    call self%choose_branches(t, y)
    call self%formulation%derivative(t, y, dydt, status)
    if (any(status /= evaluation_ok)) call raise(error, exit_failed, 'the laws of the machine have no values on the orbit')
  end subroutine rates

  !> The Jacobian at all samples, at the positions of `pattern`.
  subroutine slopes(self, t, y, dfdy)
    class(sampled_machine_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)             !! [s], [samples]
    real(wp), contiguous, intent(in) :: y(:, :)          !! states, [samples, states]
    real(wp), contiguous, intent(inout) :: dfdy(:, :)    !! [samples, positions]
    real(wp) :: dfdt(self%samples, self%states)
    integer :: status(self%samples)

    status = evaluation_ok
    call self%choose_branches(t, y)
    call self%formulation%jacobian(t, y, dfdy, dfdt, status)
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
