!> The list of the classic test problems of the literature.
module nocdyn_classic_problems
  use nocdyn_classic_diffusion, only: diffusion_problem
  use nocdyn_classic_orbits, only: arenstorf_problem, kepler_problem, pleiades_problem
  use nocdyn_classic_oscillators, only: brusselator_problem, lorenz_problem, oregonator_problem, van_der_pol_fast, &
    van_der_pol_slow
  use nocdyn_classic_problem, only: classic_problem_t
  use nocdyn_classic_reactions, only: e5_problem, hires_problem, pollution_problem, robertson_problem
  implicit none (type, external)
  private

  public :: make_classic_problem

  integer, parameter, public :: classic_count = 13   !! the nonstiff problems come first

contains

  subroutine make_classic_problem(index, problem)
    integer, intent(in) :: index   !! 1 to classic_count
    class(classic_problem_t), allocatable, intent(out) :: problem

    select case (index)
    case (1)
      allocate (problem, source=lorenz_problem())
    case (2)
      allocate (problem, source=brusselator_problem())
    case (3)
      allocate (problem, source=kepler_problem())
    case (4)
      allocate (problem, source=arenstorf_problem())
    case (5)
      allocate (problem, source=pleiades_problem())
    case (6)
      allocate (problem, source=van_der_pol_slow())
    case (7)
      allocate (problem, source=van_der_pol_fast())
    case (8)
      allocate (problem, source=oregonator_problem())
    case (9)
      allocate (problem, source=hires_problem())
    case (10)
      allocate (problem, source=robertson_problem())
    case (11)
      allocate (problem, source=e5_problem())
    case (12)
      allocate (problem, source=pollution_problem())
    case (13)
      allocate (problem, source=diffusion_problem())
    case default
      error stop 'nocdyn_classic_problems: there is no such problem'
    end select
  end subroutine make_classic_problem

end module nocdyn_classic_problems
