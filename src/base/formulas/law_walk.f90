!> Carries out the list of a law on a strip of lanes, for one Taylor coefficient after the other.
module nocdyn_law_walk
  use nocdyn_law_work, only: law_work_t
  use nocdyn_laws, only: law_t, narrow
  use nocdyn_narrow_laws, only: narrow_walk => walk
  use nocdyn_wide_laws, only: wide_walk => walk
  implicit none (type, external)
  private

  public :: walk

contains

  !> Computes the coefficient k of the variables of a work space, from coefficients of lower number and from the inputs.
  subroutine walk(law, work, k, first_group)
    type(law_t), intent(in) :: law
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: k
    integer, intent(in) :: first_group   !! of the constants, counted through all strips

    if (law%w == narrow) then
      call narrow_walk(law, work, k, first_group)
    else
      call wide_walk(law, work, k, first_group)
    end if
  end subroutine walk

end module nocdyn_law_walk
