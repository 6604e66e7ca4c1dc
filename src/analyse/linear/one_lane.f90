!> A formulation of one lane, whose state [1, states] is also a vector.
module nocdyn_one_lane
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: choose_branches

contains

  !> The laws of the elements take the branches of this state.
  subroutine choose_branches(formulation, t, y)
    class(formulation_t), intent(inout) :: formulation   !! of one lane, without works
    real(wp), intent(in) :: t
    real(wp), intent(in) :: y(formulation%states)

    call formulation%start_lane(1, t, y)
  end subroutine choose_branches

end module nocdyn_one_lane
