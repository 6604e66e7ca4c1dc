!> A hint after a run: the machine ends in a slow steady state, as a motor does that cannot start its load, and could run faster.
module nocdyn_missed_states
  use nocdyn_steady_texts, only: describe_state_speeds
  use nocdyn_equilibrium, only: distances, equilibrium_t, find_equilibria, find_stability, mean_formulation
  use nocdyn_errors, only: error_t
  use nocdyn_floating_motions, only: hold_floating
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, string_t
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  implicit none (type, external)
  private

  public :: note_missed_state

  integer, parameter :: most_bodies = 100    ! of a machine that is searched: the search is to take no time
  real(wp), parameter :: near = 1.0e-3_wp    ! kinetic energy of the difference, as a share of that between two states
  real(wp), parameter :: far = 0.1_wp        ! the one of a step to where torques balance, as a share of that there
  real(wp), parameter :: slow = 1.0e-6_wp    ! the one at the end, as a share of that of the step: the machine is at rest

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
    if (is_changing(machine, t_end, omega)) return
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

  !> Whether the machine turns, and a step of Newton's method to where the torques balance changes its speeds by a lot: then it is
  !> next to no steady state, and the search for all of them, which takes longer than many a run, is left out.
  logical function is_changing(machine, t_end, omega)
    type(machine_t), intent(in) :: machine   !! one lane
    real(wp), intent(in) :: t_end            !! [s]
    real(wp), intent(in) :: omega(:)         !! speeds at the end [rad/s], [bodies]
    class(formulation_t), allocatable :: formulation
    type(torque_balance_t) :: balance
    real(wp), allocatable :: slopes(:, :), z(:)
    real(wp) :: change(size(omega))

    is_changing = .false.
    call mean_formulation(machine, formulation)
    if (formulation%joints%count > 0) return   ! what holds decides where torques balance
    formulation%machine%start_speed(1, :) = omega
    call set_up_balance(formulation, t_end, balance)
    call hold_floating(balance)
    z = balance%start()
    call balance%settle(z)
    allocate (slopes(size(z), size(z)))
    call balance%evaluate(z)
    call balance%differentiate(slopes)
    z = -matmul(pseudo_inverse(slopes, epsilon(1.0_wp)), balance%residual)
    change = balance%body_speeds(z(:size(balance%motions%free)))
    associate (of_change => machine%kinetic_energy(1, change))
      is_changing = of_change > far * machine%kinetic_energy(1, omega + change) .and. &
                    machine%kinetic_energy(1, omega) > slow * of_change
    end associate
  end function is_changing

end module nocdyn_missed_states
