!> Formulas that the library refuses; the argument of the program names one.
module wrong_formulas_of_users
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t
  use nocdyn_law_functions, only: larger
  use nocdyn_law_operators, only: constant
  implicit none (type, external)
  private

  public :: incomplete, decay, with_kink

contains

  subroutine incomplete(t, y, p, dydt)
    type(expression_t), intent(in) :: t, y(:), p(:)
    type(expression_t), intent(inout) :: dydt(:)

    dydt(2) = y(1)
  end subroutine incomplete

  subroutine decay(t, y, p, dydt)
    type(expression_t), intent(in) :: t, y(:), p(:)
    type(expression_t), intent(inout) :: dydt(:)

    dydt(1) = constant(t, 1.0_wp)
  end subroutine decay

  subroutine with_kink(t, y, p, dydt)
    type(expression_t), intent(in) :: t, y(:), p(:)
    type(expression_t), intent(inout) :: dydt(:)

    dydt(1) = larger(y(1), t)
  end subroutine with_kink

end module wrong_formulas_of_users

program wrong_formulas
  use nocdyn_formula_system, only: formula_system, formula_system_t
  use nocdyn_kinds, only: wp
  use wrong_formulas_of_users, only: decay, incomplete, with_kink
  implicit none (type, external)
  type(formula_system_t) :: system
  character(len=20) :: what

  call get_command_argument(1, what)
  system = formula_system(1, decay, [1.0_wp], 2)
  select case (what)
  case ('states')
    system = formula_system(0, decay)
  case ('lanes')
    system = formula_system(1, decay, lanes=0)
  case ('quadratures')
    system = formula_system(1, decay, quadratures=-1)
  case ('equation')
    system = formula_system(2, incomplete)
  case ('kink')
    system = formula_system(1, with_kink)
  case ('lane')
    call system%set_parameters(3, [1.0_wp])
  case ('parameters')
    call system%set_parameters(1, [1.0_wp, 2.0_wp])
  case default
    print '(i0)', system%lanes
  end select
end program wrong_formulas
