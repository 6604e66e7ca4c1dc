!> Classic problems of chemical kinetics, written as their reactions: mass action gives f and its Jacobian.
module nocdyn_classic_reactions
  use nocdyn_classic_problem, only: allocate_ends, classic_problem_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: robertson_problem, e5_problem, hires_problem, pollution_problem

  integer, parameter :: most_species = 4   ! on one side of a reaction

  !> A reaction: its rate is the constant times the concentrations of the reactants. A species may be listed twice; 0 is none.
  type :: reaction_t
    real(wp) :: rate
    integer :: reactants(2)
    integer :: products(most_species)
  end type reaction_t

  type, extends(classic_problem_t), public :: reactions_t
    type(reaction_t), allocatable :: reactions(:)
  contains
    procedure :: law
    procedure :: tangent
  end type reactions_t

contains

  pure function reaction(rate, reactants, products)
    real(wp), intent(in) :: rate
    integer, intent(in) :: reactants(:), products(:)
    type(reaction_t) :: reaction

    reaction%rate = rate
    reaction%reactants = 0
    reaction%products = 0
    reaction%reactants(:size(reactants)) = reactants
    reaction%products(:size(products)) = products
  end function reaction

  subroutine law(self, y, dydt)
    class(reactions_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), intent(inout) :: dydt(self%states)
    real(wp) :: speed
    integer :: i, k

    dydt = 0.0_wp
    do i = 1, size(self%reactions)
      associate (r => self%reactions(i))
        speed = r%rate
        do k = 1, 2
          if (r%reactants(k) > 0) speed = speed * y(r%reactants(k))
        end do
        call balance(r, speed, dydt)
      end associate
    end do
  end subroutine law

  subroutine tangent(self, y, dfdy)
    class(reactions_t), intent(in) :: self
    real(wp), intent(in) :: y(self%states)
    real(wp), contiguous, intent(inout) :: dfdy(:, :)
    real(wp) :: slope
    integer :: i, k, other, column

    dfdy = 0.0_wp
    do i = 1, size(self%reactions)
      associate (r => self%reactions(i))
        do k = 1, 2
          if (r%reactants(k) == 0) cycle
          other = r%reactants(3 - k)
          slope = r%rate
          if (other > 0) slope = slope * y(other)
          column = (r%reactants(k) - 1) * self%states
          call balance(r, slope, dfdy(1, column + 1:column + self%states))
        end do
      end associate
    end do
  end subroutine tangent

  !> Adds the rate of each reaction to its products and subtracts it from its reactants.
  pure subroutine balance(reaction, speed, total)
    type(reaction_t), intent(in) :: reaction
    real(wp), intent(in) :: speed
    real(wp), intent(inout) :: total(:)
    integer :: k

    do k = 1, 2
      if (reaction%reactants(k) > 0) total(reaction%reactants(k)) = total(reaction%reactants(k)) - speed
    end do
    do k = 1, most_species
      if (reaction%products(k) > 0) total(reaction%products(k)) = total(reaction%products(k)) + speed
    end do
  end subroutine balance

  !> Three reactions with rates from 0.04 to 3e7; the second component falls to 8e-14.
  function robertson_problem() result(problem)
    type(reactions_t) :: problem

    call allocate_ends(problem, 3)
    problem%name = 'Robertson'
    problem%source = 'Mazzia and Magherini, Test Set for IVP Solvers 2.4, ROBER'
    problem%is_stiff = .true.
    problem%t_end = 1.0e11_wp
    problem%rodas_steps = 240
    problem%finest = 11
    problem%rounding = 1.0e-9_wp
    problem%least_gain = 0.3_wp
    problem%published_error = 2.0e-14_wp
    problem%atol_ratio = 1.0e-6_wp
    problem%reactions = [ &
      reaction(0.04_wp, [1], [2]), &
      reaction(3.0e7_wp, [2, 2], [2, 3]), &
      reaction(1.0e4_wp, [2, 3], [1, 3])]
    problem%y_start = [1.0_wp, 0.0_wp, 0.0_wp]
    problem%published = [0.2083340149701255e-7_wp, 0.8333360770334713e-13_wp, 0.9999999791665050_wp]
    problem%y_end = [2.08334014970129414e-8_wp, 8.33336077033478323e-14_wp, 0.999999979166515169_wp]
  end function robertson_problem

  !> Pyrolysis; the first part of an integration to 1e13, at whose end all concentrations are zero.
  function e5_problem() result(problem)
    type(reactions_t) :: problem

    call allocate_ends(problem, 4)
    problem%name = 'E5'
    problem%source = 'Hairer and Wanner, test set of stiff ODEs, E5'
    problem%is_stiff = .true.
    problem%t_end = 1.0e3_wp
    problem%rodas_steps = 41
    problem%rounding = 1.0e-10_wp
    problem%least_gain = 0.5_wp
    problem%atol_ratio = 1.0e-14_wp
    problem%reactions = [ &
      reaction(7.89e-10_wp, [1], [2, 3]), &
      reaction(1.1e7_wp, [1, 3], [4]), &
      reaction(1.13e9_wp, [2, 3], [integer ::]), &
      reaction(1.13e3_wp, [4], [3])]
    problem%y_start(1) = 1.76e-3_wp
    problem%published = [1.6180769999072942552e-3_wp, 1.3822370304983735443e-10_wp, 8.2515735006838336088e-12_wp, &
                         1.2997212954915352082e-10_wp]
    problem%y_end = [1.61807699990729432e-3_wp, 1.38223703049837356e-10_wp, &
                     8.25157350068383343e-12_wp, 1.29972129549153523e-10_wp]
  end function e5_problem

  !> High irradiance responses of photomorphogenesis on the basis of phytochrome.
  function hires_problem() result(problem)
    type(reactions_t) :: problem

    call allocate_ends(problem, 8)
    problem%name = 'HIRES'
    problem%source = 'Mazzia and Magherini, Test Set for IVP Solvers 2.4, HIRES'
    problem%is_stiff = .true.
    problem%t_end = 321.8122_wp
    problem%rodas_steps = 175
    problem%rounding = 1.0e-12_wp
    problem%atol_ratio = 1.0e-4_wp
    problem%reactions = [ &
      reaction(1.71_wp, [1], [2]), reaction(0.43_wp, [2], [1]), reaction(8.32_wp, [2], [4]), &
      reaction(8.32_wp, [3], [1]), reaction(1.71_wp, [3], [4]), reaction(0.43_wp, [4], [3]), &
      reaction(0.69_wp, [4], [6]), reaction(0.035_wp, [5], [3]), reaction(1.71_wp, [5], [6]), &
      reaction(0.43_wp, [6], [5]), reaction(0.43_wp, [7], [5, 8]), reaction(0.69_wp, [7], [6, 8]), &
      reaction(0.69_wp, [7], [8]), reaction(280.0_wp, [6, 8], [7]), reaction(0.0007_wp, [integer ::], [1])]
    problem%y_start(1) = 1.0_wp
    problem%y_start(8) = 0.0057_wp
    problem%published = [ &
      0.7371312573325668e-3_wp, 0.1442485726316185e-3_wp, 0.5888729740967575e-4_wp, 0.1175651343283149e-2_wp, &
      0.2386356198831331e-2_wp, 0.6238968252742796e-2_wp, 0.2849998395185769e-2_wp, 0.2850001604814231e-2_wp]
    problem%y_end = [ &
      7.37131257332566782e-4_wp, 1.44248572631618458e-4_wp, 5.88872974096757467e-5_wp, 1.17565134328314918e-3_wp, &
      2.38635619883132949e-3_wp, 6.23896825274279254e-3_wp, 2.84999839518576812e-3_wp, 2.85000160481423208e-3_wp]
  end function hires_problem

  !> Air pollution model of the Dutch National Institute of Public Health and Environmental Protection.
  function pollution_problem() result(problem)
    type(reactions_t) :: problem

    call allocate_ends(problem, 20)
    problem%name = 'Pollution'
    problem%source = 'Verwer, Test Set for IVP Solvers 2.4 (Mazzia and Magherini), POLLU'
    problem%is_stiff = .true.
    problem%t_end = 60.0_wp
    problem%rodas_steps = 117
    problem%atol_ratio = 1.0e-9_wp
    problem%reactions = pollution_reactions()
    problem%y_start([2, 4, 7, 8, 9, 17]) = [0.2_wp, 0.04_wp, 0.1_wp, 0.3_wp, 0.01_wp, 0.007_wp]
    problem%published = [ &
      0.5646255480022769e-1_wp, 0.1342484130422339_wp, 0.4139734331099427e-8_wp, 0.5523140207484359e-2_wp, &
      0.2018977262302196e-6_wp, 0.1464541863493966e-6_wp, 0.7784249118997964e-1_wp, 0.3245075353396018_wp, &
      0.7494013383880406e-2_wp, 0.1622293157301561e-7_wp, 0.1135863833257075e-7_wp, 0.2230505975721359e-2_wp, &
      0.2087162882798630e-3_wp, 0.1396921016840158e-4_wp, 0.8964884856898295e-2_wp, 0.4352846369330103e-17_wp, &
      0.6899219696263405e-2_wp, 0.1007803037365946e-3_wp, 0.1772146513969984e-5_wp, 0.5682943292316392e-4_wp]
    problem%y_end = [ &
      5.64625548002276953e-2_wp, 0.134248413042233861_wp, 4.13973433109942689e-9_wp, 5.52314020748435919e-3_wp, &
      2.01897726230219599e-7_wp, 1.46454186349396577e-7_wp, 7.78424911899796460e-2_wp, 0.324507535339601812_wp, &
      7.49401338388040573e-3_wp, 1.62229315730156026e-8_wp, 1.13586383325707476e-8_wp, 2.23050597572135989e-3_wp, &
      2.08716288279863009e-4_wp, 1.39692101684015780e-5_wp, 8.96488485689829446e-3_wp, 4.35284636933010304e-18_wp, &
      6.89921969626340555e-3_wp, 1.00780303736594596e-4_wp, 1.77214651396998421e-6_wp, 5.68294329231639246e-5_wp]
  end function pollution_problem

  !> In the order of the source.
  function pollution_reactions() result(reactions)
    type(reaction_t), allocatable :: reactions(:)

    reactions = [ &
      reaction(0.35_wp, [1], [2, 3]), reaction(26.6_wp, [2, 4], [1]), reaction(1.23e4_wp, [5, 2], [1, 6]), &
      reaction(0.86e-3_wp, [7], [5, 5, 8]), reaction(0.82e-3_wp, [7], [8]), reaction(1.5e4_wp, [7, 6], [5, 8]), &
      reaction(0.13e-3_wp, [9], [10, 5, 8]), reaction(2.4e4_wp, [9, 6], [11]), reaction(1.65e4_wp, [11, 2], [10, 12, 1]), &
      reaction(0.9e4_wp, [11, 1], [13]), reaction(0.022_wp, [13], [11, 1]), reaction(1.2e4_wp, [10, 2], [14, 1]), &
      reaction(1.88_wp, [14], [7, 5]), reaction(1.63e4_wp, [1, 6], [15]), reaction(4.8e6_wp, [3], [4]), &
      reaction(0.35e-3_wp, [4], [16]), reaction(0.0175_wp, [4], [3]), reaction(1.0e8_wp, [16], [6, 6]), &
      reaction(4.44e11_wp, [16], [3]), reaction(1.24e3_wp, [17, 6], [18, 5]), reaction(2.1_wp, [19], [2]), &
      reaction(5.78_wp, [19], [1, 3]), reaction(0.0474_wp, [1, 4], [19]), reaction(1.78e3_wp, [19, 1], [20]), &
      reaction(3.12_wp, [20], [19, 1])]
  end function pollution_reactions

end module nocdyn_classic_reactions
