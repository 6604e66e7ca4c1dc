!> Rubber couplings as their data sheets give them: factors of the dynamic stiffness and of the relative damping over the mean
!> torque, the vibratory torque, the frequency and the temperature, and the temperature by the power that is lost.
!>
!> Their makers iterate as here: the temperature is the ambient one plus a rise in proportion to the lost power, stiffness and
!> relative damping fall with it by factors, and the power follows from both (Renold Couplings, catalogue, 7th edition, RB
!> technical data, 2.4 to 2.7: rise = P_K / P_KW * 70 K, C_T = C_T30 S_t, M_T = M_30 / S_t; CENTA Antriebe, CENTAX, explanation of
!> the technical data, 9: psi_red = psi S_t).
module nocdyn_rubber_laws
  use nocdyn_curves, only: curve_t, extrapolation_constant, interpolation_linear, new_curve
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_factors

  !> Factors of stiffness and relative damping over one quantity; constant beyond their ends.
  type, public :: factors_t
    logical :: are_given = .false.
    type(curve_t), private :: of_stiffness, of_damping
  contains
    procedure :: stiffness => stiffness_factor, damping => damping_factor, stiffness_slope, damping_slope
    procedure :: last_point, write_range
  end type factors_t

  !> What changes in one coupling while the machine vibrates.
  type, public :: rubber_condition_t
    real(wp) :: temperature = 0.0_wp   !! [degC]
    real(wp) :: amplitude = 0.0_wp     !! of the vibratory torque [N m]
    real(wp) :: mean = 0.0_wp          !! mean torque [N m]
  end type rubber_condition_t

  !> One coupling.
  type, public :: rubber_law_t
    integer :: element = 0                     !! in the machine
    type(factors_t) :: by_torque               !! of stiffness they are in the law of the element
    type(factors_t) :: by_amplitude, by_frequency, by_temperature
    logical :: heats_up = .false.              !! whether its temperature follows from its power
    real(wp) :: ambient = 0.0_wp               !! temperature without power [degC]
    real(wp) :: resistance = 0.0_wp            !! rise of the temperature by the power [K/W]
    real(wp) :: temperature = 0.0_wp           !! temperature over the time, and where it does not heat up [degC]
    real(wp) :: base(2) = 1.0_wp               !! the factors of stiffness and relative damping over the time, which the law of
                                               !! the element has; without the ones of stiffness over the torque
  contains
    procedure :: needs_iteration, cold, factors
  end type rubber_law_t

contains

  !> Factors over the points of a quantity.
  type(factors_t) function new_factors(x, stiffness, damping) result(self)
    real(wp), intent(in) :: x(:)                        !! ascending; none: no factors
    real(wp), intent(in) :: stiffness(:), damping(:)    !! [points]

    self%are_given = size(x) > 0
    if (.not. self%are_given) return
    self%of_stiffness = new_curve(x, stiffness, interpolation_linear, extrapolation_constant)
    self%of_damping = new_curve(x, damping, interpolation_linear, extrapolation_constant)
  end function new_factors

  !> The factor of the stiffness.
  pure real(wp) function stiffness_factor(self, x) result(factor)
    class(factors_t), intent(in) :: self
    real(wp), intent(in) :: x   !! the quantity, in the unit of its points

    factor = 1.0_wp
    if (self%are_given) factor = self%of_stiffness%value(x)
  end function stiffness_factor

  !> The factor of the relative damping.
  pure real(wp) function damping_factor(self, x) result(factor)
    class(factors_t), intent(in) :: self
    real(wp), intent(in) :: x   !! the quantity, in the unit of its points

    factor = 1.0_wp
    if (self%are_given) factor = self%of_damping%value(x)
  end function damping_factor

  !> The derivative of the factor of the stiffness.
  pure real(wp) function stiffness_slope(self, x) result(slope)
    class(factors_t), intent(in) :: self
    real(wp), intent(in) :: x   !! the quantity, in the unit of its points
    real(wp) :: y(0:3)

    slope = 0.0_wp
    if (.not. self%are_given) return
    y = self%of_stiffness%derivatives(self%of_stiffness%segment(x), x)
    slope = y(1)
  end function stiffness_slope

  !> The derivative of the factor of the relative damping.
  pure real(wp) function damping_slope(self, x) result(slope)
    class(factors_t), intent(in) :: self
    real(wp), intent(in) :: x   !! the quantity, in the unit of its points
    real(wp) :: y(0:3)

    slope = 0.0_wp
    if (.not. self%are_given) return
    y = self%of_damping%derivatives(self%of_damping%segment(x), x)
    slope = y(1)
  end function damping_slope

  !> The last point, beyond which the factors stay; huge without points.
  pure real(wp) function last_point(self)
    class(factors_t), intent(in) :: self
    real(wp), allocatable :: x(:)

    last_point = huge(last_point)
    if (.not. self%are_given) return
    allocate (x, source=self%of_stiffness%knots())
    last_point = x(size(x))
  end function last_point

  !> The smallest and the largest factor of the stiffness and of the relative damping.
  pure subroutine write_range(self, stiffness, damping)
    class(factors_t), intent(in) :: self
    real(wp), intent(out) :: stiffness(2), damping(2)   !! lowest and highest factor
    real(wp), allocatable :: x(:)
    integer :: i

    stiffness = 1.0_wp
    damping = 1.0_wp
    if (.not. self%are_given) return
    allocate (x, source=self%of_stiffness%knots())
    stiffness = [minval([(self%stiffness(x(i)), i=1, size(x))]), maxval([(self%stiffness(x(i)), i=1, size(x))])]
    damping = [minval([(self%damping(x(i)), i=1, size(x))]), maxval([(self%damping(x(i)), i=1, size(x))])]
  end subroutine write_range

  !> Whether its stiffness or its temperature depends on its own vibration.
  pure logical function needs_iteration(self)
    class(rubber_law_t), intent(in) :: self

    needs_iteration = self%heats_up .or. self%by_amplitude%are_given
  end function needs_iteration

  !> Its condition without vibration.
  type(rubber_condition_t) pure function cold(self, mean) result(condition)
    class(rubber_law_t), intent(in) :: self
    real(wp), intent(in) :: mean   !! torque [N m]

    condition%temperature = self%temperature
    if (self%heats_up) condition%temperature = self%ambient
    condition%mean = mean
  end function cold

  !> Stiffness and relative damping by the ones that the law of the element has over the time, at its nominal frequency.
  pure function factors(self, condition) result(ratio)
    class(rubber_law_t), intent(in) :: self
    type(rubber_condition_t), intent(in) :: condition
    real(wp) :: ratio(2)

    ratio = [self%by_temperature%stiffness(condition%temperature) * self%by_amplitude%stiffness(condition%amplitude), &
             self%by_temperature%damping(condition%temperature) * self%by_amplitude%damping(condition%amplitude) * &
             self%by_torque%damping(abs(condition%mean))] / self%base
  end function factors

end module nocdyn_rubber_laws
