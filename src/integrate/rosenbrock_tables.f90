!> Rosenbrock methods as tables of numbers.
module nocdyn_rosenbrock_tables
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: rodas4

  !> The transformed form of Hairer and Wanner, Solving Ordinary Differential Equations II, (IV.7.25), with u_i = h k_i:
  !> y_new = y + h sum m_i k_i, where
  !> (1/gamma - h J) k_i = f(t + alpha_i h, y + h sum a_ij k_j) + sum c_ij k_j + gamma_i h df/dt.
  type, public :: rosenbrock_table_t
    character(len=:), allocatable :: name
    character(len=:), allocatable :: reference
    integer :: stages
    integer :: order                         !! of y_new
    integer :: error_order                   !! of the embedded solution that y_new is compared with
    integer :: dense_order                   !! of the solution inside a step
    real(wp) :: gamma
    real(wp), allocatable :: a(:, :)         !! strictly lower triangular, shape [stages, stages]
    real(wp), allocatable :: c(:, :)         !! strictly lower triangular, shape [stages, stages]
    real(wp), allocatable :: alpha(:)        !! places of the stages in the step
    real(wp), allocatable :: gamma_sum(:)    !! gamma_i, the factors of df/dt
    real(wp), allocatable :: m(:)
    real(wp), allocatable :: error(:)        !! m minus the embedded weights
    real(wp), allocatable :: dense(:, :)     !! m_i(theta) = sum_p dense(i, p) theta^p, shape [stages, degree]
  end type rosenbrock_table_t

contains

  !> RODAS: order 4(3), stiffly accurate, L-stable, with a dense output of order 3.
  function rodas4() result(table)
    type(rosenbrock_table_t) :: table

    table%name = 'rosenbrock'
    table%reference = 'E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), IV.7 and VI.4, ' // &
      'and their code RODAS (METH = 1)'
    table%stages = 6
    table%order = 4
    table%error_order = 3
    table%dense_order = 3
    table%gamma = 0.25_wp
    allocate (table%a(6, 6), table%c(6, 6), table%dense(6, 3), source=0.0_wp)
    allocate (table%alpha(6), table%gamma_sum(6), table%m(6), table%error(6), source=0.0_wp)
    table%alpha(:) = [0.0_wp, 0.386_wp, 0.21_wp, 0.63_wp, 1.0_wp, 1.0_wp]
    table%gamma_sum(:) = [0.25_wp, -0.1043_wp, 0.1035_wp, -0.0362_wp, 0.0_wp, 0.0_wp]
    table%a(2, 1) = 1.544_wp
    table%a(3, 1:2) = [0.9466785280815826_wp, 0.2557011698983284_wp]
    table%a(4, 1:3) = [3.314825187068521_wp, 2.896124015972201_wp, 0.9986419139977817_wp]
    table%a(5, 1:4) = [1.221224509226641_wp, 6.019134481288629_wp, 12.53708332932087_wp, -0.6878860361058950_wp]
    table%a(6, 1:5) = [table%a(5, 1:4), 1.0_wp]
    table%c(2, 1) = -5.6688_wp
    table%c(3, 1:2) = [-2.430093356833875_wp, -0.2063599157091915_wp]
    table%c(4, 1:3) = [-0.1073529058151375_wp, -9.594562251023355_wp, -20.47028614809616_wp]
    table%c(5, 1:4) = [7.496443313967647_wp, -10.24680431464352_wp, -33.99990352819905_wp, 11.70890893206160_wp]
    table%c(6, 1:5) = [8.083246795921522_wp, -7.981132988064893_wp, -31.52159432874371_wp, 16.31930543123136_wp, &
                       -6.058818238834054_wp]
    table%m(:) = [table%a(6, 1:5), 1.0_wp]
    table%error(:) = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp]
    table%dense(:, :) = rodas_dense(table%m)
  end function rodas4

  !> CONTRO of RODAS, expanded in powers of theta: y (1 - theta) + theta (y_new + (1 - theta) (r + theta s)), where r and s
  !> are sums of the stages with the weights D2i and D3i.
  pure function rodas_dense(m) result(dense)
    real(wp), intent(in) :: m(6)
    real(wp) :: dense(6, 3)
    real(wp), parameter :: r(6) = [10.12623508344586_wp, -7.487995877610167_wp, -34.80091861555747_wp, &
                                   -7.992771707568823_wp, 1.025137723295662_wp, 0.0_wp]
    real(wp), parameter :: s(6) = [-0.6762803392801253_wp, 6.087714651680015_wp, 16.43084320892478_wp, &
                                   24.76722511418386_wp, -6.594389125716872_wp, 0.0_wp]

    dense(:, 1) = m + r
    dense(:, 2) = s - r
    dense(:, 3) = -s
  end function rodas_dense

end module nocdyn_rosenbrock_tables
