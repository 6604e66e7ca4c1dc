!> Loads with the viscous resistance of eq. (5), M_r = -c omega.
module nocdyn_loads
  use nocdyn_bank, only: role_load
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_table_laws, only: table_laws_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_loads

  type, extends(table_laws_t), public :: loads_t
    real(wp), allocatable :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
  contains
    procedure :: list_parameters
    procedure :: polynomials
  end type loads_t

contains

  !> A bank of viscous loads, each on one body.
  function new_loads(names, body, viscous) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
    type(loads_t) :: bank
    integer :: e

    call bank%connect(role_load, size(viscous, 1), names, [(0, e=1, size(body))], body)
    bank%viscous = viscous
  end function new_loads

  !> The coefficients c are in C, eq. (22).
  subroutine polynomials(self, laws)
    class(loads_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws

    laws%by_speed(:, self%first:self%last()) = -self%viscous
    laws%damping(:, self%first:self%last()) = self%viscous
  end subroutine polynomials

  subroutine list_parameters(self, parameters)
    class(loads_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%table_laws_t%list_parameters(parameters)
    call parameters%add_key('viscous', self%viscous)
  end subroutine list_parameters

end module nocdyn_loads
