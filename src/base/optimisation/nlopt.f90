!> The part of NLopt that is used here (S. G. Johnson, The NLopt nonlinear-optimization package): its C functions, as nlopt.h
!> declares them.
module nocdyn_nlopt
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funptr, c_int, c_ptr
  implicit none (type, external)
  private

  public :: nlopt_algorithm_from_string, nlopt_create, nlopt_destroy, nlopt_set_lower_bounds, nlopt_set_upper_bounds
  public :: nlopt_set_min_objective, nlopt_add_inequality_mconstraint, nlopt_set_maxeval, nlopt_set_xtol_abs1, nlopt_optimize
  public :: nlopt_set_ftol_rel

  interface

    integer(c_int) function nlopt_algorithm_from_string(name) bind(c)
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: name(*)   !! with its end, e.g. 'LD_SLSQP'
    end function nlopt_algorithm_from_string

    type(c_ptr) function nlopt_create(algorithm, n) bind(c)
      import :: c_int, c_ptr
      integer(c_int), value, intent(in) :: algorithm, n
    end function nlopt_create

    subroutine nlopt_destroy(opt) bind(c)
      import :: c_ptr
      type(c_ptr), value, intent(in) :: opt
    end subroutine nlopt_destroy

    integer(c_int) function nlopt_set_lower_bounds(opt, low) bind(c)
      import :: c_double, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt
      real(c_double), intent(in) :: low(*)
    end function nlopt_set_lower_bounds

    integer(c_int) function nlopt_set_upper_bounds(opt, high) bind(c)
      import :: c_double, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt
      real(c_double), intent(in) :: high(*)
    end function nlopt_set_upper_bounds

    !> f(n, x, gradient or null, data).
    integer(c_int) function nlopt_set_min_objective(opt, f, data) bind(c)
      import :: c_funptr, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt, data
      type(c_funptr), value, intent(in) :: f
    end function nlopt_set_min_objective

    !> f(m, result, n, x, gradient [m][n] or null, data); all results are to be at most 0, up to a tolerance each.
    integer(c_int) function nlopt_add_inequality_mconstraint(opt, m, f, data, tolerance) bind(c)
      import :: c_double, c_funptr, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt, data
      integer(c_int), value, intent(in) :: m
      type(c_funptr), value, intent(in) :: f
      real(c_double), intent(in) :: tolerance(*)
    end function nlopt_add_inequality_mconstraint

    integer(c_int) function nlopt_set_maxeval(opt, most) bind(c)
      import :: c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt
      integer(c_int), value, intent(in) :: most
    end function nlopt_set_maxeval

    integer(c_int) function nlopt_set_xtol_abs1(opt, tolerance) bind(c)
      import :: c_double, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt
      real(c_double), value, intent(in) :: tolerance
    end function nlopt_set_xtol_abs1

    integer(c_int) function nlopt_set_ftol_rel(opt, tolerance) bind(c)
      import :: c_double, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt
      real(c_double), value, intent(in) :: tolerance
    end function nlopt_set_ftol_rel

    integer(c_int) function nlopt_optimize(opt, x, value) bind(c)
      import :: c_double, c_int, c_ptr
      type(c_ptr), value, intent(in) :: opt
      real(c_double), intent(inout) :: x(*)
      real(c_double), intent(out) :: value
    end function nlopt_optimize

  end interface

end module nocdyn_nlopt
