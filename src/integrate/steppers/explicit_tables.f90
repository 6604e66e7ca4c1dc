!> Tableaux of explicit Runge-Kutta methods.
module nocdyn_explicit_tables
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: dormand_prince_5, dormand_prince_8

  !> y_new = y + h sum b_i k_i with k_i = f(t + c_i h, y + h sum a_ij k_j).
  !>
  !> With one embedded method the error estimate is e = h sum error_i k_i, and `error_order` is the order of that method. With two
  !> it is Hairer's e^2 / sqrt(e^2 + 0.01 e_low^2), e_low = h sum low_order_error_i k_i: with embedded methods of the orders p and
  !> q it falls as h^(2 p - q + 1), and `error_order` is 2 p - q.
  type, public :: explicit_table_t
    integer :: order                              !! of y_new
    integer :: error_order                        !! the error estimate falls as h^(error_order + 1)
    logical :: first_same_as_last                 !! the last stage is f(t + h, y_new), the first stage of the next step
    real(wp) :: max_growth = 6.0_wp               !! largest ratio of step sizes, as in the authors' code
    real(wp) :: stability_limit = 0.0_wp          !! of |h lambda|, just inside the stability domain on the negative real axis
    real(wp), allocatable :: a(:, :)              !! strictly lower triangular, [all stages, all stages]
    real(wp), allocatable :: b(:)                 !! [stages]; the stages after these are for the dense output only
    real(wp), allocatable :: c(:)                 !! [all stages]
    real(wp), allocatable :: error(:)             !! b minus the embedded weights, [stages]
    real(wp), allocatable :: low_order_error(:)   !! b minus the weights of a second embedded method of lower order, if any
    real(wp), allocatable :: dense(:, :)          !! b_i(theta) = sum_p dense(i, p) theta^p, [all stages, degree]
  end type explicit_table_t

contains

  !> DOPRI5, the pair RK5(4)7M of J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26, with the dense output of
  !> order 4 of E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), II.6, and of
  !> their code DOPRI5.
  function dormand_prince_5() result(table)
    type(explicit_table_t) :: table

    table%order = 5
    table%error_order = 4
    table%first_same_as_last = .true.
    table%max_growth = 10.0_wp
    table%stability_limit = 3.25_wp
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
    ! CONTD5 in the form of `expand` with dy = y_new - y: r = dy, h k_1 - dy, 2 dy - h k_1 - h k_7, h sum d_i k_i
    table%dense(:, 1) = table%b
    table%dense(:, 2) = stage_weights(1, 7) - table%b
    table%dense(:, 3) = 2 * table%b - stage_weights(1, 7) - stage_weights(7, 7)
    table%dense(:, 4) = [-12715105075.0_wp / 11282082432.0_wp, 0.0_wp, 87487479700.0_wp / 32700410799.0_wp, &
                         -10690763975.0_wp / 1880347072.0_wp, 701980252875.0_wp / 199316789632.0_wp, &
                         -1453857185.0_wp / 822651844.0_wp, 69997945.0_wp / 29380423.0_wp]
    call expand(table%dense)
  end function dormand_prince_5

  !> DOP853, of order 8 with twelve stages, embedded methods of orders 5 and 3, dense output of order 7 with three more stages:
  !> E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), II.5, II.6 and II.10, and
  !> their code DOP853; the method is due to J. R. Dormand and P. J. Prince.
  function dormand_prince_8() result(table)
    type(explicit_table_t) :: table

    table%order = 8
    table%error_order = 7
    table%first_same_as_last = .true.
    table%stability_limit = 6.1_wp
    allocate (table%a(16, 16), table%b(13), table%c(16), table%dense(16, 7), source=0.0_wp)
    allocate (table%error(13), table%low_order_error(13), source=0.0_wp)
    table%c(2:5) = [5.26001519587677318785587544488e-2_wp, 7.89002279381515978178381316732e-2_wp, &
      0.118350341907227396726757197510_wp, 0.281649658092772603273242802490_wp]
    table%c(6:) = [1.0_wp / 3, 1.0_wp / 4, 4.0_wp / 13, 127.0_wp / 195, 3.0_wp / 5, 6.0_wp / 7, 1.0_wp, 1.0_wp, &
                   1.0_wp / 10, 1.0_wp / 5, 7.0_wp / 9]
    table%b(1) = 5.42937341165687622380535766363e-2_wp
    table%b(6:12) = [4.45031289275240888144113950566_wp, 1.89151789931450038304281599044_wp, &
      -5.8012039600105847814672114227_wp, 0.31116436695781989440891606237_wp, -0.152160949662516078556178806805_wp, &
      0.201365400804030348374776537501_wp, 4.47106157277725905176885569043e-2_wp]
    table%a(2, 1) = 5.26001519587677318785587544488e-2_wp
    table%a(3, 1:2) = [1.97250569845378994544595329183e-2_wp, 5.91751709536136983633785987549e-2_wp]
    table%a(4, [1, 3]) = [2.95875854768068491816892993775e-2_wp, 8.87627564304205475450678981324e-2_wp]
    table%a(5, [1, 3, 4]) = [0.241365134159266685502369798665_wp, -0.884549479328286085344864962717_wp, &
      0.924834003261792003115737966543_wp]
    table%a(6, [1, 4, 5]) = [3.7037037037037037037037037037e-2_wp, 0.170828608729473871279604482173_wp, &
      0.125467687566822425016691814123_wp]
    table%a(7, [1, 4, 5, 6]) = [3.7109375e-2_wp, 0.170252211019544039314978060272_wp, 6.02165389804559606850219397283e-2_wp, &
      -1.7578125e-2_wp]
    table%a(8, [1, 4, 5, 6, 7]) = [3.70920001185047927108779319836e-2_wp, 0.170383925712239993810214054705_wp, &
      0.107262030446373284651809199168_wp, -1.53194377486244017527936158236e-2_wp, &
      8.27378916381402288758473766002e-3_wp]
    table%a(9, [1, 4, 5, 6, 7, 8]) = [0.624110958716075717114429577812_wp, -3.36089262944694129406857109825_wp, &
      -0.868219346841726006818189891453_wp, 27.5920996994467083049415600797_wp, 20.1540675504778934086186788979_wp, &
      -43.4898841810699588477366255144_wp]
    table%a(10, [1, 4, 5, 6, 7, 8, 9]) = [0.477662536438264365890433908527_wp, -2.48811461997166764192642586468_wp, &
      -0.590290826836842996371446475743_wp, 21.2300514481811942347288949897_wp, 15.2792336328824235832596922938_wp, &
      -33.2882109689848629194453265587_wp, -2.03312017085086261358222928593e-2_wp]
    table%a(11, [1, 4, 5, 6, 7, 8, 9, 10]) = [-0.93714243008598732571704021658_wp, 5.18637242884406370830023853209_wp, &
      1.09143734899672957818500254654_wp, -8.14978701074692612513997267357_wp, -18.5200656599969598641566180701_wp, &
      22.7394870993505042818970056734_wp, 2.49360555267965238987089396762_wp, -3.0467644718982195003823669022_wp]
    table%a(12, [1, 4, 5, 6, 7, 8, 9, 10, 11]) = [2.27331014751653820792359768449_wp, -10.5344954667372501984066689879_wp, &
      -2.00087205822486249909675718444_wp, -17.9589318631187989172765950534_wp, 27.9488845294199600508499808837_wp, &
      -2.85899827713502369474065508674_wp, -8.87285693353062954433549289258_wp, 12.3605671757943030647266201528_wp, &
      0.643392746015763530355970484046_wp]
    table%a(13, :13) = table%b
    table%a(14, [1, 7, 8, 9, 10, 11, 12, 13]) = [5.61675022830479523392909219681e-2_wp, 0.253500210216624811088794765333_wp, &
      -0.246239037470802489917441475441_wp, -0.124191423263816360469010140626_wp, 0.15329179827876569731206322685_wp, &
      8.20105229563468988491666602057e-3_wp, 7.56789766054569976138603589584e-3_wp, -8.298e-3_wp]
    table%a(15, [1, 6, 7, 8, 11, 12, 13, 14]) = [3.18346481635021405060768473261e-2_wp, &
      2.83009096723667755288322961402e-2_wp, 5.35419883074385676223797384372e-2_wp, &
      -5.49237485713909884646569340306e-2_wp, -1.08347328697249322858509316994e-4_wp, &
      3.82571090835658412954920192323e-4_wp, -3.40465008687404560802977114492e-4_wp, &
      0.141312443674632500278074618366_wp]
    table%a(16, [1, 6, 7, 8, 9, 13, 14, 15]) = [-0.428896301583791923408573538692_wp, -4.69762141536116384314449447206_wp, &
      7.68342119606259904184240953878_wp, 4.06898981839711007970213554331_wp, 0.356727187455281109270669543021_wp, &
      -1.39902416515901462129418009734e-3_wp, 2.9475147891527723389556272149_wp, -9.15095847217987001081870187138_wp]
    table%error(1) = 1.312004499419488073250102996e-2_wp
    table%error(6:12) = [-1.225156446376204440720569753_wp, -0.4957589496572501915214079952_wp, &
      1.664377182454986536961530415_wp, -0.3503288487499736816886487290_wp, 0.3341791187130174790297318841_wp, &
      8.192320648511571246570742613e-2_wp, -2.235530786388629525884427845e-2_wp]
    table%low_order_error(:) = table%b
    table%low_order_error([1, 9, 12]) = table%b([1, 9, 12]) - [ &
      0.244094488188976377952755905512_wp, 0.733846688281611857341361741547_wp, 2.20588235294117647058823529412e-2_wp]
    table%dense(:, :) = dormand_prince_8_dense(table%b)
  end function dormand_prince_8

  !> The dense output CONTD8 of DOP853, in the form of `expand` with dy = y_new - y:
  !> r = dy, h k_1 - dy, 2 dy - h k_1 - h k_13, and h sum d_ji k_i with j = 4 to 7.
  pure function dormand_prince_8_dense(b) result(dense)
    real(wp), intent(in) :: b(13)
    real(wp) :: dense(16, 7)
    integer, parameter :: used(12) = [1, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]

    dense = 0.0_wp
    dense(:13, 1) = b
    dense(:, 2) = stage_weights(1, 16) - dense(:, 1)
    dense(:, 3) = 2 * dense(:, 1) - stage_weights(1, 16) - stage_weights(13, 16)
    dense(used, 4) = [-8.4289382761090128651353491142_wp, 0.56671495351937776962531783590_wp, &
      -3.0689499459498916912797304727_wp, 2.3846676565120698287728149680_wp, 2.1170345824450282767155149946_wp, &
      -0.87139158377797299206789907490_wp, 2.2404374302607882758541771650_wp, 0.63157877876946881815570249290_wp, &
      -8.8990336451333310820698117400e-2_wp, 18.148505520854727256656404962_wp, -9.1946323924783554000451984436_wp, &
      -4.4360363875948939664310572000_wp]
    dense(used, 5) = [10.427508642579134603413151009_wp, 242.28349177525818288430175319_wp, &
      165.20045171727028198505394887_wp, -374.54675472269020279518312152_wp, -22.113666853125306036270938578_wp, &
      7.7334326684722638389603898808_wp, -30.674084731089398182061213626_wp, -9.3321305264302278729567221706_wp, &
      15.697238121770843886131091075_wp, -31.139403219565177677282850411_wp, -9.3529243588444783865713862664_wp, &
      35.816841486394083752465898540_wp]
    dense(used, 6) = [19.985053242002433820987653617_wp, -387.03730874935176555105901742_wp, &
      -189.17813819516756882830838328_wp, 527.80815920542364900561016686_wp, -11.573902539959630126141871134_wp, &
      6.8812326946963000169666922661_wp, -1.0006050966910838403183860980_wp, 0.77771377980534432092869265740_wp, &
      -2.7782057523535084065932004339_wp, -60.196695231264120758267380846_wp, 84.320405506677161018159903784_wp, &
      11.992291136182789328035130030_wp]
    dense(used, 7) = [-25.693933462703749003312586129_wp, -154.18974869023643374053993627_wp, &
      -231.52937917604549567536039109_wp, 357.63911791061412378285349910_wp, 93.405324183624310003907691704_wp, &
      -37.458323136451633156875139351_wp, 104.09964950896230045147246184_wp, 29.840293426660503123344363579_wp, &
      -43.533456590011143754432175058_wp, 96.324553959188282948394950600_wp, -39.177261675615439165231486172_wp, &
      -149.72683625798562581422125276_wp]
    call expand(dense)
  end function dormand_prince_8_dense

  !> Expands Hairer's form theta (r_1 + (1 - theta) (r_2 + theta (r_3 + (1 - theta) (r_4 + ...)))) in powers of theta.
  pure subroutine expand(dense)
    real(wp), intent(inout) :: dense(:, :)   !! columns r_1, r_2 ...; on return coefficients of theta, theta^2 ...
    real(wp) :: nest(size(dense, 1), 0:size(dense, 2))
    integer :: i

    nest = 0.0_wp
    do i = size(dense, 2), 1, -1
      nest(:, 0) = nest(:, 0) + dense(:, i)
      nest = eoshift(nest, -1, dim=2)
      if (mod(i, 2) == 0) nest = eoshift(nest, 1, dim=2) - nest
    end do
    dense = nest(:, 1:)
  end subroutine expand

  !> The weights of a sum over the stages that is equal to one stage.
  pure function stage_weights(stage, stages) result(weights)
    integer, intent(in) :: stage, stages
    real(wp) :: weights(stages)

    weights = 0.0_wp
    weights(stage) = 1.0_wp
  end function stage_weights

end module nocdyn_explicit_tables
