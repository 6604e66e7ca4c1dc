!> The state at which a machine is linearised.
module nocdyn_operating_point
  use nocdyn_equilibrium, only: equilibrium_t, mean_formulation, t_infinity
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_joint_simplifications, only: has_joint_that_locks
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_ok, read_real
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: new_reduced
  use nocdyn_rubber_notes, only: note_given_conditions
  use nocdyn_run_settings, only: choose_settings
  use nocdyn_solve, only: solve
  use nocdyn_steady_start, only: find_operating_state
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: find_operating_point

  !> The state, and how reports call it.
  type, public :: operating_point_t
    class(formulation_t), allocatable :: formulation   !! reduced, one lane, without work integrals
    real(wp) :: t = 0.0_wp
    real(wp), allocatable :: y(:, :)          !! [1, states]
    character(len=:), allocatable :: text     !! name in reports: 'the steady state', 'rest', 't = 2 s'
    type(string_t), allocatable :: notes(:)   !! remarks for the report
  end type operating_point_t

contains

  !> Finds the operating point.
  subroutine find_operating_point(input, machine, at, point, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: at   !! 'equilibrium', 'rest' or a time of the run [s]
    type(operating_point_t), intent(out) :: point
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run
    type(machine_t) :: still
    real(wp) :: time

    run = input%single('run')
    point%t = run%number('t_start')
    allocate (point%notes, source=machine%simplifications)
    call note_given_conditions(machine, 'here', point%notes)
    select case (at)
    case ('equilibrium')
      call use_equilibrium(machine, point, error)
    case ('rest')
      ! takes the start angles without speeds, and the mean torques
      still = machine
      if (allocated(still%driven_speed)) deallocate (still%driven_speed)
      call mean_formulation(still, point%formulation)
      point%y = point%formulation%start()
      point%y(1, :machine%coordinates%freedoms) = 0.0_wp
      point%t = t_infinity
      point%text = 'rest'
    case default
      if (allocated(machine%driven_speed)) then
        call raise(error, exit_input, input%shown_file() // ': --at ' // at // ': a drive turns bodies of this machine, ' // &
                   'which is looked at in its steady state only; allowed: equilibrium or rest')
        return
      end if
      call read_time(input, run, at, time, error)
      if (.not. allocated(error)) call use_time(input, machine, time, point, error)
    end select
  end subroutine find_operating_point

  !> Reads a time of the run.
  subroutine read_time(input, run, at, time, error)
    type(input_t), intent(in) :: input
    type(group_t), intent(in) :: run
    character(len=*), intent(in) :: at
    real(wp), intent(out) :: time   !! [s]
    type(error_t), allocatable, intent(out) :: error
    integer :: status

    call read_real(at, time, status)
    if (status /= literal_ok) then
      call raise(error, exit_input, '--at ' // at // ': allowed: equilibrium, rest or a time of the run [s]')
    else if (time < run%number('t_start') .or. time > run%number('t_end')) then
      call raise(error, exit_input, input%shown_file() // ': --at ' // at // ' is no time of the run; allowed: ' // &
                 to_text(run%number('t_start')) // ' to ' // to_text(run%number('t_end')) // ' s')
    else if (has_joint_that_locks(input)) then
      call raise(error, exit_input, input%shown_file() // ': --at ' // at // ': which joints, bearings and teeth are locked ' // &
                 'at a time of the run is not known here; allowed: equilibrium or rest')
    end if
  end subroutine read_time

  !> Takes the steady state that is nearest to the start, a stable one if there is one.
  subroutine use_equilibrium(machine, point, error)
    type(machine_t), intent(in) :: machine
    type(operating_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error
    type(equilibrium_t), allocatable :: equilibria(:)
    integer :: nearest

    call find_operating_state(machine, t_infinity, point%formulation, equilibria, nearest, point%notes, error)
    if (allocated(error)) then
      error%message = error%message // '; --at rest linearises at the start angles without speeds'
      return
    end if
    point%t = t_infinity
    point%y = equilibria(nearest)%y
    point%text = 'the steady state'
    if (size(equilibria) == 1) return
    call append(point%notes, 'there are ' // to_text(size(equilibria)) // ' steady states, ' // &
                             to_text(count(equilibria%stability == 'stable')) // ' of them stable; this is the ' // &
                             trim(merge('stable one', 'one       ', any(equilibria%stability == 'stable'))) // &
                             ' nearest to the start: nocdyn equilibrium shows all')
  end subroutine use_equilibrium

  !> Takes the state at a time of the run, by its method and tolerances.
  subroutine use_time(input, machine, time, point, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: time   !! [s]
    type(operating_point_t), intent(inout) :: point
    type(error_t), allocatable, intent(out) :: error
    type(integration_settings_t) :: settings
    real(wp), allocatable :: states(:, :)

    allocate (point%formulation, source=new_reduced(machine, .false.))
    call choose_settings(input, point%formulation, settings, point%notes, error)
    if (allocated(error)) return
    point%y = point%formulation%start()
    if (time > point%t) then
      allocate (states(size(point%y, 2), 2), source=0.0_wp)
      states(:, 1) = point%y(1, :)
      call solve(point%formulation, [point%t, time], settings, states, error)
      if (allocated(error)) return
      point%y(1, :) = states(:, 2)
    end if
    point%t = time
    point%text = 't = ' // to_text(time) // ' s'
  end subroutine use_time

end module nocdyn_operating_point
