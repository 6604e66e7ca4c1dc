!> From an input to a machine at its start, and to its formulation.
module nocdyn_assembly
  use nocdyn_balanced_start, only: balanced_start_t, find_balanced_start, has_balanced_start
  use nocdyn_equilibrium, only: t_infinity
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_harmonic_notes, only: note_left_out_harmonics
  use nocdyn_induction_assembly, only: note_rated_motors
  use nocdyn_input, only: input_t
  use nocdyn_idle_notes, only: note_idle_elements
  use nocdyn_joint_simplifications, only: has_joint_that_locks, has_joint_that_moves, refuse_joints
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_parts, only: build_machine
  use nocdyn_machine_start, only: given_speeds
  use nocdyn_motion_notes, only: note_motions
  use nocdyn_multiplier, only: multiplier_t
  use nocdyn_paper, only: paper_t
  use nocdyn_mean_time_notes, only: note_mean_times
  use nocdyn_pressure_notes, only: note_pressures
  use nocdyn_reduced, only: reduced_t
  use nocdyn_rubber_notes, only: note_given_conditions
  use nocdyn_steady_joints, only: choose_overruns
  use nocdyn_steady_start, only: start_steadily
  use nocdyn_steady_views, only: steady_view_t
  use nocdyn_text, only: append
  implicit none (type, external)
  private

  public :: assemble_machine, assemble_steady_machine, allocate_formulation, new_asked_formulation, new_formulation

contains

  !> Builds the machine of a checked input, with the same parameters in every lane. Bodies without inertia that move alone,
  !> constraints that lock, start speeds that violate constraints, and a steady start that is not found are errors that name file,
  !> line, group and key.
  recursive subroutine assemble_machine(input, machine, error, lanes)
    type(input_t), target, intent(in) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: lanes   !! 1 if absent

    if (has_balanced_start(input)) then
      call assemble_balanced_machine(input, machine, error, lanes)
    else
      call build_machine(input, steady_view_t(), machine, error, lanes)
      if (.not. allocated(error)) call start_machine(input, .false., machine, error)
    end if
    if (allocated(error)) return
    call note_idle_elements(input, machine%start_notes)
    call note_rated_motors(input, machine%start_notes)
    call note_motions(input, machine%start_notes)
    call note_left_out_harmonics(input, machine%start_notes)
    call note_pressures(input, machine%start_notes)
    call note_mean_times(machine, machine%start_notes)
    call note_given_conditions(machine, 'over the time', machine%start_notes)
  end subroutine assemble_machine

  !> Builds a machine that starts in equilibrium at a given speed, with the number that is found for it.
  subroutine assemble_balanced_machine(input, machine, error, lanes)
    type(input_t), intent(in) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: lanes   !! 1 if absent
    type(balanced_start_t) :: start

    call find_balanced_start(input, start, error)
    if (allocated(error)) return
    call build_machine(start%input, steady_view_t(), machine, error, lanes)
    if (allocated(error)) return
    call start%set(machine)
    call append(machine%start_notes, start%note)
  end subroutine assemble_balanced_machine

  !> Builds the machine as it is in a steady state: with means over a turn, and, if it is asked for, with clutches and freewheels
  !> that are locked as constraint rows.
  recursive subroutine assemble_steady_machine(input, locks_joints, machine, error, t, sets_speed, starts)
    type(input_t), intent(in) :: input
    logical, intent(in) :: locks_joints     !! whether locked joints are rows
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(in), optional :: t   !! the time at which clutches are engaged or not [s]; absent: after all changes
    logical, intent(in), optional :: sets_speed   !! whether an analysis sets the speed in place of a drive; absent: no
    logical, intent(in), optional :: starts   !! whether it starts in its steady state, if the input wants it; absent: yes
    type(steady_view_t) :: view
    character(len=:), allocatable :: text
    logical :: is_changed
    integer :: trials

    view%is_steady = .true.
    view%at = t_infinity
    if (present(t)) view%at = t
    view%locks_joints = locks_joints
    if (present(sets_speed)) view%sets_speed = sets_speed
    allocate (view%overruns(size(input%groups)), source=.false.)
    do trials = 0, 2 * size(input%groups_named('freewheel'))
      call build_machine(input, view, machine, error)
      if (allocated(error)) return
      if (machine%coordinates%freedoms == 0) then
        text = ', so that nothing moves'
        if (allocated(machine%driven_speed)) text = ', so that nothing is left that could oscillate'
        call raise(error, exit_failed, input%shown_file() // ': ' // machine%simplifications(1)%text // text)
        return
      end if
      is_changed = .false.
      if (locks_joints) call choose_overruns(input, view, machine, is_changed)
      if (.not. is_changed) exit
    end do
    if (is_changed) then
      call raise(error, exit_failed, input%shown_file() // ': no steady state was found in which each freewheel ' // &
                 'holds or overruns')
    else
      if (present(starts)) then
        if (.not. starts) return
      end if
      call start_machine(input, .true., machine, error)
    end if
  end subroutine assemble_steady_machine

  !> Starts a machine in its steady state, if the input wants it. Analyses about a steady state do not ask for the speed that a
  !> run has there.
  recursive subroutine start_machine(input, is_steady, machine, error)
    type(input_t), intent(in) :: input
    logical, intent(in) :: is_steady   !! whether the machine is one in a steady state
    type(machine_t), intent(inout) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(machine_t), allocatable :: steady   ! of one lane
    integer :: i

    associate (run => input%groups(input%position('run')))
      if (run%text('start') /= 'equilibrium' .or. has_balanced_start(input)) return
      if (machine%lanes == 1 .and. (is_steady .or. .not. (has_joint_that_locks(input) .or. &
                                                                  has_joint_that_moves(input)))) then
        call start_steadily(machine, given_speeds(input, machine%nodes), run%number('t_start'), error)
        if (allocated(error)) error%message = input%location(input%position('run'), 'start') // ": start = 'equilibrium': " // &
          error%message // "; start = 'given' starts with the speeds of the bodies"
        return
      end if
      call refuse_joints(input, .false., "start = 'equilibrium'", error, knows_locks=.true.)
      if (allocated(error)) return
      allocate (steady)
      call assemble_steady_machine(input, .false., steady, error, run%number('t_start'))
      if (.not. allocated(error)) then
        ! starts all lanes of a machine as another one with the same bodies
        machine%start_speed(:, :) = spread(steady%start_speed(1, :), 1, machine%lanes)
        machine%start_angle(:, :) = spread(steady%start_angle(1, :), 1, machine%lanes)
        allocate (machine%steady_internal, source=spread(steady%steady_internal(1, :), 1, machine%lanes))
        do i = 1, size(steady%start_notes)
          call append(machine%start_notes, steady%start_notes(i)%text)
        end do
      end if
    end associate
  end subroutine start_machine

  !> The formulation that an input asks for.
  subroutine new_asked_formulation(input, machine, formulation, with_energy_balance)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    class(formulation_t), allocatable, intent(out) :: formulation
    logical, intent(in), optional :: with_energy_balance   !! as in `new_formulation`

    call new_formulation(input%groups(input%position('run'))%text('formulation'), machine, formulation, with_energy_balance)
  end subroutine new_asked_formulation

  !> The equations of motion of a machine, a system for an integrator.
  subroutine new_formulation(word, machine, formulation, with_energy_balance)
    character(len=*), intent(in) :: word   !! as in `allocate_formulation`
    type(machine_t), intent(in) :: machine
    class(formulation_t), allocatable, intent(out) :: formulation
    logical, intent(in), optional :: with_energy_balance   !! whether the work of the elements is integrated; absent: .true.
    logical :: has_work_integrals

    has_work_integrals = .true.
    if (present(with_energy_balance)) has_work_integrals = with_energy_balance
    call allocate_formulation(word, formulation)
    formulation%machine = machine
    call formulation%formulate(has_work_integrals)
  end subroutine new_formulation

  !> A formulation without a machine. With one, `formulate` forms its equations.
  subroutine allocate_formulation(word, formulation)
    character(len=*), intent(in) :: word   !! 'reduced', 'paper' or 'multiplier'
    class(formulation_t), allocatable, intent(out) :: formulation

    select case (word)
    case ('reduced')
      allocate (reduced_t :: formulation)
    case ('paper')
      allocate (paper_t :: formulation)
    case ('multiplier')
      allocate (multiplier_t :: formulation)
    case default
      error stop 'nocdyn_assembly: the schema allows an unknown formulation'
    end select
  end subroutine allocate_formulation

end module nocdyn_assembly
