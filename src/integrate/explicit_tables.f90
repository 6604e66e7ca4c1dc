!> Explicit Runge-Kutta methods as tables of numbers.
module nocdyn_explicit_tables
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: dormand_prince_5

  !> y_new = y + h sum b_i k_i with k_i = f(t + c_i h, y + h sum a_ij k_j).
  type, public :: explicit_table_t
    character(len=:), allocatable :: name
    character(len=:), allocatable :: reference
    integer :: stages                        !! of the step
    integer :: dense_stages = 0              !! further ones that only the solution inside the step needs
    integer :: order                         !! of y_new
    integer :: error_order                   !! of the embedded solution that y_new is compared with
    integer :: dense_order                   !! of the solution inside a step
    logical :: first_same_as_last            !! the last stage is f(t + h, y_new), the first stage of the next step
    real(wp), allocatable :: a(:, :)         !! strictly lower triangular, shape [all stages, all stages]
    real(wp), allocatable :: b(:)            !! shape [stages]
    real(wp), allocatable :: c(:)            !! shape [all stages]
    real(wp), allocatable :: error(:)        !! b minus the embedded weights, shape [stages]
    real(wp), allocatable :: coarse_error(:) !! the same of a second embedded method of lower order, if there is one
    real(wp), allocatable :: dense(:, :)     !! b_i(theta) = sum_p dense(i, p) theta^p, shape [all stages, degree]
  end type explicit_table_t

contains

  !> DOPRI5: the pair RK5(4)7M with the fourth-order dense output of its authors' and Hairer's code.
  function dormand_prince_5() result(table)
    type(explicit_table_t) :: table

    table%name = 'rk45'
    table%reference = 'J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26; dense output: E. Hairer, ' // &
      'S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), II.6, and their code DOPRI5'
    table%stages = 7
    table%order = 5
    table%error_order = 4
    table%dense_order = 4
    table%first_same_as_last = .true.
    allocate (table%a(7, 7), table%b(7), table%c(7), table%error(7), table%dense(7, 4), source=0.0_wp)
    table%c(:) = [0.0_wp, 1.0_wp / 5, 3.0_wp / 10, 4.0_wp / 5, 8.0_wp / 9, 1.0_wp, 1.0_wp]
    table%a(2, 1) = 1.0_wp / 5
    table%a(3, 1:2) = [3.0_wp / 40, 9.0_wp / 40]
    table%a(4, 1:3) = [44.0_wp / 45, -56.0_wp / 15, 32.0_wp / 9]
    table%a(5, 1:4) = [19372.0_wp / 6561, -25360.0_wp / 2187, 64448.0_wp / 6561, -212.0_wp / 729]
    table%a(6, 1:5) = [9017.0_wp / 3168, -355.0_wp / 33, 46732.0_wp / 5247, 49.0_wp / 176, -5103.0_wp / 18656]
    table%b(:) = [35.0_wp / 384, 0.0_wp, 500.0_wp / 1113, 125.0_wp / 192, -2187.0_wp / 6784, 11.0_wp / 84, 0.0_wp]
    table%a(7, :) = table%b
    table%error(:) = [71.0_wp / 57600, 0.0_wp, -71.0_wp / 16695, 71.0_wp / 1920, -17253.0_wp / 339200, 22.0_wp / 525, &
                      -1.0_wp / 40]
    table%dense(:, :) = dormand_prince_dense(table%b)
  end function dormand_prince_5

  !> CONTD5 of DOPRI5, expanded in powers of theta:
  !> y + theta (dy + (1 - theta) (h k_1 - dy + theta (2 dy - h k_1 - h k_7 + (1 - theta) h sum d_i k_i))), dy = y_new - y.
  pure function dormand_prince_dense(b) result(dense)
    real(wp), intent(in) :: b(7)
    real(wp) :: dense(7, 4)
    real(wp), parameter :: d(7) = [-12715105075.0_wp / 11282082432.0_wp, 0.0_wp, 87487479700.0_wp / 32700410799.0_wp, &
                                   -10690763975.0_wp / 1880347072.0_wp, 701980252875.0_wp / 199316789632.0_wp, &
                                   -1453857185.0_wp / 822651844.0_wp, 69997945.0_wp / 29380423.0_wp]
    real(wp), parameter :: first(7) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    real(wp), parameter :: last(7) = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp]

    dense(:, 1) = first
    dense(:, 2) = 3 * b - 2 * first - last + d
    dense(:, 3) = first + last - 2 * b - 2 * d
    dense(:, 4) = d
  end function dormand_prince_dense

end module nocdyn_explicit_tables
