!> The steady state of a machine in operation: of several, the one that its start belongs to.
module nocdyn_operating_states
  use nocdyn_equilibrium, only: equilibrium_t, find_equilibria, find_stability, nearest_equilibrium
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: find_operating_state

contains

  !> Finds the steady states with the mean torques, and which of them is nearest to the start: a stable one if there is one.
  subroutine find_operating_state(machine, t, formulation, equilibria, nearest, notes, error)
    type(machine_t), intent(in) :: machine   !! one lane
    real(wp), intent(in) :: t                !! of torques over the time [s]; `t_infinity`: after all of their changes
    class(formulation_t), allocatable, intent(out) :: formulation
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)   !! with their stability, if there are several
    integer, intent(out) :: nearest
    type(string_t), allocatable, intent(out) :: notes(:)   !! remarks for the report
    type(error_t), allocatable, intent(out) :: error   !! if there is no steady state

    nearest = 0
    call find_equilibria(machine, t, formulation, equilibria, notes, error)
    if (allocated(error)) return
    if (size(equilibria) > 1) call find_stability(formulation, t, equilibria)
    nearest = nearest_equilibrium(formulation, equilibria)
  end subroutine find_operating_state

end module nocdyn_operating_states
