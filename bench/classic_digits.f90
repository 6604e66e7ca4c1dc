!> Prints which accuracy each method reaches on the classic problems at each tolerance, and at what price: two tables
!> in Markdown.
program classic_digits
  use, intrinsic :: iso_fortran_env, only: output_unit
  use nocdyn_classic_problem, only: classic_problem_t
  use nocdyn_classic_problems, only: classic_count, make_classic_problem
  use nocdyn_classic_runs, only: classic_methods, solve_classic, suits
  use nocdyn_kinds, only: wp
  use nocdyn_solver_status, only: solver_status_t
  implicit none (type, external)

  integer, parameter :: first = 3, last = 12      ! tolerances are 10**(-first) to 10**(-last)
  integer, parameter :: priced(3) = [4, 7, 10]    ! tolerances whose steps and evaluations are shown
  integer, parameter :: row_length = 200

  character(len=row_length) :: digits(classic_count * size(classic_methods))
  character(len=row_length) :: prices(classic_count * size(classic_methods))
  integer :: problem, method, rows

  rows = 0
  do problem = 1, classic_count
    do method = 1, size(classic_methods)
      call add_row(problem, trim(classic_methods(method)), rows)
    end do
  end do
  call print_table('digits reached at tolerance 1e-', [(problem, problem=first, last)], digits(:rows))
  call print_table('steps / evaluations / factorisations at tolerance 1e-', priced, prices(:rows))

contains

  subroutine add_row(problem_index, method_name, rows)
    integer, intent(in) :: problem_index
    character(len=*), intent(in) :: method_name
    integer, intent(inout) :: rows
    class(classic_problem_t), allocatable :: problem
    type(solver_status_t) :: solver_status
    real(wp) :: error
    integer :: i

    call make_classic_problem(problem_index, problem)
    if (.not. suits(method_name, problem%is_stiff)) return
    rows = rows + 1
    digits(rows) = '| ' // problem%name // ' | `' // method_name // '` |'
    prices(rows) = digits(rows)
    do i = first, last
      call solve_classic(problem, method_name, 10.0_wp**(-i), error, solver_status)
      digits(rows) = trim(digits(rows)) // digits_cell(error)
      if (any(priced == i)) prices(rows) = trim(prices(rows)) // price_cell(solver_status)
    end do
  end subroutine add_row

  pure function digits_cell(error) result(cell)
    real(wp), intent(in) :: error
    character(len=:), allocatable :: cell
    character(len=5) :: number

    cell = ' failed |'
    if (error >= 0.5_wp * huge(error)) return
    write (number, '(f5.1)') -log10(max(error, epsilon(error)))
    cell = number // ' |'
  end function digits_cell

  pure function price_cell(solver_status) result(cell)
    type(solver_status_t), intent(in) :: solver_status
    character(len=:), allocatable :: cell
    character(len=40) :: numbers

    write (numbers, '(i0, " / ", i0, " / ", i0)') solver_status%steps(1), solver_status%evaluations(1), &
      solver_status%factorisations(1)
    cell = ' ' // trim(numbers) // ' |'
  end function price_cell

  subroutine print_table(title, tolerances, rows)
    character(len=*), intent(in) :: title
    integer, intent(in) :: tolerances(:)
    character(len=*), intent(in) :: rows(:)
    integer :: i

    write (output_unit, '(a, *(i0, :, ", "))') title, tolerances
    write (output_unit, '()')
    write (output_unit, '(a, *(i0, " | "))') '| problem | method | ', tolerances
    write (output_unit, '(*(a))') '| --- | --- |', (' --: |', i=1, size(tolerances))
    write (output_unit, '(a)') (trim(rows(i)), i=1, size(rows))
    write (output_unit, '()')
  end subroutine print_table

end program classic_digits
