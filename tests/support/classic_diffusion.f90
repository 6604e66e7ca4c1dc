!> The Brusselator with diffusion along a line: a thousand stiff equations with a Jacobian of bandwidth two.
module nocdyn_classic_diffusion
  use nocdyn_classic_problem, only: allocate_ends, classic_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: diffusion_problem

  !> u' = a + u^2 v - (b + 1) u + diffusion u_xx, v' = b u - u^2 v + diffusion v_xx on 0 < x < 1 with u = a and v = b at
  !> both ends, in central differences at `points` inner points; the components are u1, v1, u2, v2 ...
  type, extends(classic_problem_t), public :: diffusion_t
    integer :: points
    real(wp) :: a = 1.0_wp, b = 3.0_wp
    real(wp) :: diffusion = 0.02_wp
    real(wp) :: exchange   !! diffusion over the squared distance of the points
  contains
    procedure :: law
    procedure :: tangent
    procedure :: jacobian_pattern
  end type diffusion_t

  integer, parameter :: compared_points = 143

contains

  !> 500 points, u = 1 + sin(2 pi x) / 2 and v = 3 at the start.
  function diffusion_problem() result(problem)
    type(diffusion_t) :: problem
    real(wp), parameter :: pi = acos(-1.0_wp)
    integer :: i

    problem%points = 500
    call allocate_ends(problem, 2 * problem%points)
    problem%exchange = problem%diffusion * (problem%points + 1)**2
    problem%name = 'Brusselator 1D'
    problem%source = 'Hairer and Wanner, test set of stiff ODEs, BRUSS'
    problem%is_stiff = .true.
    problem%t_end = 10.0_wp
    problem%published_error = 2.0e-14_wp
    problem%finest = 8
    do i = 1, problem%points
      problem%y_start(2 * i - 1) = 1 + 0.5_wp * sin(2 * pi * i / (problem%points + 1))
      problem%y_start(2 * i) = 3.0_wp
    end do
    problem%compared = [(i, i=1, 7 * compared_points - 6, 7)]
    problem%published = published_end()
    problem%y_end = problem%published
  end function diffusion_problem

  subroutine law(self, y, dydt)
    class(diffusion_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)
    real(wp) :: left(2), right(2)
    integer :: i

    do i = 1, 2 * self%points, 2
      left = [self%a, self%b]
      right = left
      if (i > 1) left = y(i - 2:i - 1)
      if (i + 1 < 2 * self%points) right = y(i + 2:i + 3)
      dydt(i) = self%a + y(i)**2 * y(i + 1) - (self%b + 1) * y(i) + self%exchange * (left(1) - 2 * y(i) + right(1))
      dydt(i + 1) = self%b * y(i) - y(i)**2 * y(i + 1) + self%exchange * (left(2) - 2 * y(i + 1) + right(2))
    end do
  end subroutine law

  !> The entries of each point by itself, four per point, then its exchange with the right neighbour, then the left.
  function jacobian_pattern(self) result(pattern)
    class(diffusion_t), intent(in) :: self
    type(pattern_t) :: pattern
    integer :: i, n

    n = 2 * self%points
    pattern%row = [([i, i + 1, i, i + 1], i=1, n, 2), (i, i=1, n - 2), (i, i=3, n)]
    pattern%column = [([i, i, i + 1, i + 1], i=1, n, 2), (i, i=3, n), (i, i=1, n - 2)]
  end function jacobian_pattern

  subroutine tangent(self, y, dfdy)
    class(diffusion_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    integer :: i

    do i = 1, 2 * self%points, 2
      associate (u => y(i), v => y(i + 1), first => 2 * i - 1)
        dfdy(1, first) = 2 * u * v - self%b - 1 - 2 * self%exchange
        dfdy(1, first + 1) = self%b - 2 * u * v
        dfdy(1, first + 2) = u**2
        dfdy(1, first + 3) = -u**2 - 2 * self%exchange
      end associate
    end do
    dfdy(1, 4 * self%points + 1:) = self%exchange
  end subroutine tangent

  !> Every seventh component.
  pure function published_end() result(y)
    real(wp) :: y(compared_points)

    y = [ &
      0.9949197002317599_wp, 3.0213845767604077_wp, 0.9594350193986054_wp, 3.0585989778165419_wp, 0.9243010095428502_wp, &
      3.0952478919989637_wp, 0.8897959106772672_wp, 3.1310118289054731_wp, 0.8561653620284367_wp, 3.1656101198770159_wp, &
      0.8236197147449046_wp, 3.1988043370624344_wp, 0.7923328094811884_wp, 3.2303999530641514_wp, 0.7624421042573115_wp, &
      3.2602463873623941_wp, 0.7340499750795348_wp, 3.2882356529108807_wp, 0.7072259700779899_wp, 3.3142998590079271_wp, &
      0.6820097782458483_wp, 3.3384078449410937_wp, 0.6584146743834650_wp, 3.3605612157873943_wp, 0.6364312187752559_wp, &
      3.3807900316323134_wp, 0.6160310186921587_wp, 3.3991483695914764_wp, 0.5971703941198909_wp, 3.4157099395342736_wp, &
      0.5797938277687891_wp, 3.4305638938070224_wp, 0.5638371159206763_wp, 3.4438109320334580_wp, 0.5492301695479158_wp, &
      3.4555597666485198_wp, 0.5358994429426996_wp, 3.4659239846027008_wp, 0.5237699892215797_wp, 3.4750193162238476_wp, &
      0.5127671585747183_wp, 3.4829613034792271_wp, 0.5028179665048467_wp, 3.4898633463634923_wp, 0.4938521662914935_wp, &
      3.4958350971335204_wp, 0.4858030633656755_wp, 3.5009811668111510_wp, 0.4786081100251151_wp, 3.5054001059792705_wp, &
      0.4722093177200750_wp, 3.5091836216744015_wp, 0.4665535216425440_wp, 3.5124159935026285_wp, 0.4615925290790646_wp, &
      3.5151736544621075_wp, 0.4572831793403656_wp, 3.5175249049438184_wp, 0.4535873393501199_wp, 3.5195297317024448_wp, &
      0.4504718553589467_wp, 3.5212397070273984_wp, 0.4479084778719241_wp, 3.5226979467564341_wp, 0.4458737738041973_wp, &
      3.5239391090719634_wp, 0.4443490371324889_wp, 3.5249894191569453_wp, 0.4433202068820853_wp, 3.5258667077466495_wp, &
      0.4427777991494095_wp, 3.5265804544017270_wp, 0.4427168579654424_wp, 3.5271318289682063_wp, 0.4431369281018266_wp, &
      3.5275137272135266_wp, 0.4440420513508381_wp, 3.5277107990730161_wp, 0.4454407863109616_wp, 3.5276994703501980_wp, &
      0.4473462502188303_wp, 3.5274479611304068_wp, 0.4497761798232572_wp, 3.5269163066324394_wp, 0.4527530066369863_wp, &
      3.5260563887768472_wp, 0.4563039400688689_wp, 3.5248119894251024_wp, 0.4604610498812091_wp, 3.5231188790654930_wp, &
      0.4652613370907894_wp, 3.5209049576992761_wp, 0.4707467798082714_wp, 3.5180904678044698_wp, 0.4769643375804777_wp, &
      3.5145883024867057_wp, 0.4839658945842979_wp, 3.5103044351908528_wp, 0.4918081185812277_wp, 3.5051385005173827_wp, &
      0.5005522089940899_wp, 3.4989845585737802_wp, 0.5102635039989190_wp, 3.4917320776245013_wp, 0.5210109134090777_wp, &
      3.4832671712209993_wp, 0.5328661417420937_wp, 3.4734741260299615_wp, 0.5459026646938675_wp, 3.4622372546582585_wp, &
      0.5601944229089820_wp, 3.4494431032230182_wp, 0.5758142001453760_wp, 3.4349830354873361_wp, 0.5928316594749734_wp, &
      3.4187562033108012_wp, 0.6113110218368440_wp, 3.4006728962523969_wp, 0.6313083867734524_wp, 3.3806582409098729_wp, &
      0.6528687160104193_wp, 3.3586561928427350_wp, 0.6760225267555723_wp, 3.3346337311179157_wp, 0.7007823726569721_wp, &
      3.3085851288057930_wp, 0.7271392249346637_wp, 3.2805361342349380_wp, 0.7550589020044152_wp, 3.2505478606008622_wp, &
      0.7844787296769868_wp, 3.2187201496972175_wp, 0.8153046416214843_wp, 3.1851941538893653_wp, 0.8474089465959840_wp, &
      3.1501538739882800_wp, 0.8806289904192589_wp, 3.1138264039027113_wp, 0.9147669230929857_wp, 3.0764806689389470_wp, &
      0.9495907429372025_wp, 3.0384245041548366_wp, 0.9848367306701233_wp]
  end function published_end

end module nocdyn_classic_diffusion
