!> Tableaux of Rosenbrock methods.
module nocdyn_rosenbrock_tables
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: rodas4, rodas5p

  !> The transformed form of Hairer and Wanner, Solving Ordinary Differential Equations II, (IV.7.25), with u_i = h k_i:
  !> y_new = y + h sum m_i k_i, where (1/gamma - h J) k_i = f(t + alpha_i h, y + h sum a_ij k_j) + sum c_ij k_j + gamma_i h df/dt.
  type, public :: rosenbrock_table_t
    integer :: order                         !! of y_new
    integer :: error_order                   !! of the embedded solution
    real(wp) :: gamma
    real(wp), allocatable :: a(:, :)         !! strictly lower triangular, [stages, stages]
    real(wp), allocatable :: c(:, :)         !! strictly lower triangular, [stages, stages]
    real(wp), allocatable :: alpha(:)        !! theta of the stages
    real(wp), allocatable :: gamma_sum(:)    !! gamma_i, the factors of df/dt
    real(wp), allocatable :: m(:)
    real(wp), allocatable :: error(:)        !! m minus the embedded weights
    real(wp), allocatable :: dense(:, :)     !! m_i(theta) = sum_p dense(i, p) theta^p, [stages, degree]
  end type rosenbrock_table_t

contains

  !> RODAS, of order 4(3), stiffly accurate, L-stable, with a dense output of order 3: E. Hairer, G. Wanner, Solving Ordinary
  !> Differential Equations II, 2nd ed. (1996), IV.7 and VI.4, and their code RODAS (METH = 1).
  function rodas4() result(table)
    type(rosenbrock_table_t) :: table
    real(wp), parameter :: r(6) = [10.12623508344586_wp, -7.487995877610167_wp, -34.80091861555747_wp, &
                                   -7.992771707568823_wp, 1.025137723295662_wp, 0.0_wp]
    real(wp), parameter :: s(6) = [-0.6762803392801253_wp, 6.087714651680015_wp, 16.43084320892478_wp, &
                                   24.76722511418386_wp, -6.594389125716872_wp, 0.0_wp]

    table%order = 4
    table%error_order = 3
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
    ! the dense output CONTRO of RODAS in powers of theta: y (1 - theta) + theta (y_new + (1 - theta) (r + theta s)), where r and
    ! s are sums of the stages with the weights D2i and D3i
    table%dense(:, 1) = table%m + r
    table%dense(:, 2) = s - r
    table%dense(:, 3) = -s
  end function rodas4

  !> RODAS5P, of order 5(4), stiffly accurate, L-stable, with a dense output of order 4; no loss of order on stiff problems of
  !> Prothero and Robinson's kind: G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within
  !> the Julia Differential Equations package, BIT Numer. Math. 63 (2023) 27.
  function rodas5p() result(table)
    type(rosenbrock_table_t) :: table
    real(wp), parameter :: r(8) = [25.948786856663858_wp, -2.5579724845846235_wp, 10.433815404888879_wp, &
                                   -2.3679251022685204_wp, 0.524948541321073_wp, 1.1241088310450404_wp, &
                                   0.4272876194431874_wp, -0.17202221070155493_wp]
    real(wp), parameter :: s(8) = [-9.91568850695171_wp, -0.9689944594115154_wp, 3.0438037242978453_wp, &
                                   -24.495224566215796_wp, 20.176138334709044_wp, 15.98066361424651_wp, &
                                   -6.789040303419874_wp, -6.710236069923372_wp]
    real(wp), parameter :: q(8) = [11.419903575922262_wp, 2.8879645146136994_wp, 72.92137995996029_wp, &
                                   80.12511834622643_wp, -52.072871366152654_wp, -59.78993625266729_wp, &
                                   -0.15582684282751913_wp, 4.883087185713722_wp]

    table%order = 5
    table%error_order = 4
    table%gamma = 0.21193756319429014_wp
    allocate (table%a(8, 8), table%c(8, 8), table%dense(8, 4), source=0.0_wp)
    allocate (table%alpha(8), table%gamma_sum(8), table%m(8), table%error(8), source=0.0_wp)
    table%alpha(:) = [0.0_wp, 0.6358126895828704_wp, 0.4095798393397535_wp, 0.9769306725060716_wp, &
                      0.4288403609558664_wp, 1.0_wp, 1.0_wp, 1.0_wp]
    table%gamma_sum(:) = [0.21193756319429014_wp, -0.42387512638858027_wp, -0.3384627126235924_wp, &
                          1.8046452872882734_wp, 2.325825639765069_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    table%a(2, 1) = 3.0_wp
    table%a(3, 1:2) = [2.849394379747939_wp, 0.45842242204463923_wp]
    table%a(4, 1:3) = [-6.954028509809101_wp, 2.489845061869568_wp, -10.358996098473584_wp]
    table%a(5, 1:4) = [2.8029986275628964_wp, 0.5072464736228206_wp, -0.3988312541770524_wp, -0.04721187230404641_wp]
    table%a(6, 1:5) = [-7.502846399306121_wp, 2.561846144803919_wp, -11.627539656261098_wp, -0.18268767659942256_wp, &
                       0.030198172008377946_wp]
    table%a(7, 1:6) = [table%a(6, 1:5), 1.0_wp]
    table%a(8, 1:7) = [table%a(7, 1:6), 1.0_wp]
    table%c(2, 1) = -14.155112264123755_wp
    table%c(3, 1:2) = [-17.97296035885952_wp, -2.859693295451294_wp]
    table%c(4, 1:3) = [147.12150275711716_wp, -1.41221402718213_wp, 71.68940251302358_wp]
    table%c(5, 1:4) = [165.43517024871676_wp, -0.4592823456491126_wp, 42.90938336958603_wp, -5.961986721573306_wp]
    table%c(6, 1:5) = [24.854864614690072_wp, -3.0009227002832186_wp, 47.4931110020768_wp, 5.5814197821558125_wp, &
                       -0.6610691825249471_wp]
    table%c(7, 1:6) = [30.91273214028599_wp, -3.1208243349937974_wp, 77.79954646070892_wp, 34.28646028294783_wp, &
                       -19.097331116725623_wp, -28.087943162872662_wp]
    table%c(8, 1:7) = [37.80277123390563_wp, -3.2571969029072276_wp, 112.26918849496327_wp, 66.9347231244047_wp, &
                       -40.06618937091002_wp, -54.66780262877968_wp, -9.48861652309627_wp]
    table%m(:) = [table%a(8, 1:7), 1.0_wp]
    table%error(8) = 1.0_wp
    ! Steinebach's y (1 - theta) + theta (y_new + (1 - theta) (r + theta (s + theta q))), expanded in powers of theta, where
    ! r, s and q are sums of the stages. The conditions of order 4 do not contain the weights of the last stage, which is y_new
    ! minus the embedded solution.
    table%dense(:, 1) = table%m + r
    table%dense(:, 2) = s - r
    table%dense(:, 3) = q - s
    table%dense(:, 4) = -q
  end function rodas5p

end module nocdyn_rosenbrock_tables
