!> A hint after a run: the machine ends in a slow steady state, as a motor does that cannot start its load, and could run faster.
module nocdyn_missed_states
  use nocdyn_steady_texts, only: describe_state_speeds
  use nocdyn_equilibrium, only: distances, equilibrium_t, find_equilibria, find_stability
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: note_missed_state

  integer, parameter :: most_bodies = 100    ! of a machine that is searched: the search is to take no time
  real(wp), parameter :: near = 1.0e-3_wp    ! kinetic energy of the difference, as a share of that between two states

contains

  !> Adds a note if the machine ends next to a stable steady state and there is another one with more kinetic energy.
  subroutine note_missed_state(machine, t_end, omega, notes)
    type(machine_t), intent(in) :: machine   !! one lane
    real(wp), intent(in) :: t_end            !! [s]
    real(wp), intent(in) :: omega(:)         !! speeds at the end [rad/s], [bodies]
    type(string_t), allocatable, intent(inout) :: notes(:)
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(string_t), allocatable :: remarks(:)
    type(error_t), allocatable :: error
    real(wp), allocatable :: distance(:), energy(:)
    character(len=:), allocatable :: here, there
    integer :: fastest, nearest

    if (machine%bodies > most_bodies) return
    call find_equilibria(machine, t_end, formulation, equilibria, remarks, error)
    if (allocated(error)) return
    if (size(equilibria) < 2) return
    call find_stability(formulation, t_end, equilibria)
    equilibria = pack(equilibria, equilibria%stability == 'stable')
    if (size(equilibria) < 2) return
    allocate (distance, source=distances(formulation, equilibria, omega))
    allocate (energy, source=distances(formulation, equilibria, 0.0_wp * omega))
    nearest = minloc(distance, dim=1)
    fastest = maxloc(energy, dim=1)
    if (nearest == fastest .or. distance(nearest) > near * distance(fastest)) return
    call formulation%set_state(equilibria(nearest)%y)
    call describe_state_speeds(formulation, here)
    call formulation%set_state(equilibria(fastest)%y)
    call describe_state_speeds(formulation, there)
    call append(notes, 'the machine ends in the steady state at ' // here // '; it could run at ' // &
                       there // ", where &run start = 'equilibrium' starts it")
  end subroutine note_missed_state

end module nocdyn_missed_states
