!> The steady state that the start of a machine belongs to, and the start in it: its speeds, angles and internal states.
module nocdyn_steady_start
  use nocdyn_steady_texts, only: describe_state_speeds
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, find_stability, nearest_equilibrium, t_infinity
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: find_operating_state, find_steady_speed, start_steadily

  integer, parameter :: most_states = 100   ! for which eigenvalues are computed at once, of a steady state without others

contains

  !> Finds the steady states with the mean torques, and which of them is nearest to the start: a stable one if there is one.
  subroutine find_operating_state(machine, t, formulation, equilibria, nearest, notes, error)
    type(machine_t), intent(in) :: machine   !! one lane
    real(wp), intent(in) :: t                !! of torques over the time [s]; `t_infinity`: after all of their changes
    class(formulation_t), allocatable, intent(out) :: formulation
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)   !! with their stability, if there are several
    integer, intent(out) :: nearest
    type(string_t), allocatable, intent(out) :: notes(:)   !! remarks for the report
    type(error_t), allocatable, intent(out) :: error       !! if there is no steady state

    nearest = 0
    call find_equilibria(machine, t, formulation, equilibria, notes, error)
    if (allocated(error)) return
    if (size(equilibria) > 1) call find_stability(formulation, t, equilibria)
    nearest = nearest_equilibrium(formulation, equilibria)
  end subroutine find_operating_state

  !> Finds the speed of a body in that steady state.
  subroutine find_steady_speed(machine, body, has_state, speed)
    type(machine_t), intent(in) :: machine   !! one lane
    integer, intent(in) :: body
    logical, intent(out) :: has_state        !! whether there is a steady state
    real(wp), intent(out) :: speed           !! [rad/s]
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(error_t), allocatable :: error
    type(string_t), allocatable :: notes(:)
    integer :: nearest

    speed = 0.0_wp
    call find_operating_state(machine, t_infinity, formulation, equilibria, nearest, notes, error)
    has_state = .not. allocated(error)
    if (.not. has_state) return
    call formulation%set_state(equilibria(nearest)%y)
    speed = formulation%omega(1, body)
  end subroutine find_steady_speed

  !> Starts a machine in the steady state nearest to its given start speeds, a stable one if there is one, and notes which it is;
  !> if none is given, in the fastest one. Torques over the time have their values at the start, periodic ones their means.
  subroutine start_steadily(machine, is_given, t_start, error)
    type(machine_t), intent(inout) :: machine   !! one lane
    logical, intent(in) :: is_given(:)          !! whether the start speed of a body is given, [bodies]
    real(wp), intent(in) :: t_start             !! [s]
    type(error_t), allocatable, intent(out) :: error   !! there is no steady state, or none was found
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(string_t), allocatable :: notes(:)
    character(len=:), allocatable :: name, speeds
    integer :: i, nearest

    call find_equilibria(machine, t_start, formulation, equilibria, notes, error)
    if (allocated(error)) return
    if (size(equilibria) > 1 .or. formulation%states <= most_states) call find_stability(formulation, t_start, equilibria)
    nearest = nearest_equilibrium(formulation, equilibria, is_given)
    call formulation%set_state(equilibria(nearest)%y)
    machine%start_speed(1, :) = formulation%omega(1, 1:)
    machine%start_angle(1, :) = formulation%phi(1, 1:)
    allocate (machine%steady_internal, source=formulation%state%elements%internal%value)
    ! "steady state 3 of 3, of 2 stable ones the nearest to the given speeds"
    associate (alike => count(equilibria%stability == equilibria(nearest)%stability))
      if (size(equilibria) == 1) then
        name = 'the steady state, which is ' // trim(equilibria(1)%stability)
        if (equilibria(1)%stability == 'not determined') name = 'the steady state, of which the stability is not determined'
      else
        name = 'steady state ' // to_text(nearest) // ' of ' // to_text(size(equilibria)) // ', '
        if (alike == 1) then
          name = name // 'the only one that is ' // trim(equilibria(nearest)%stability)
        else
          name = name // 'of ' // to_text(alike) // ' ' // trim(equilibria(nearest)%stability) // ' ones the ' // &
                 trim(merge('nearest to the given speeds  ', 'fastest, as no speed is given', any(is_given)))
        end if
      end if
    end associate
    call describe_state_speeds(formulation, speeds)
    call append(machine%start_notes, 'the start is ' // name // ', at ' // speeds)
    do i = 1, size(notes)
      call append(machine%start_notes, notes(i)%text)
    end do
  end subroutine start_steadily

end module nocdyn_steady_start
