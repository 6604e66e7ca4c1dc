!> The equivalent circuit of an induction machine with two cages, or with deep bars: its steady state.
!>
!> The branches of both cages lie in parallel behind the magnetising reactance; everything is per phase of the star and referred
!> to the stator. Space vectors stand in the frame that turns with the mains, as in `nocdyn_induction_circuits`. With the flux
!> lambda_m of the magnetising branch a cage has the current -i s w lambda_m / (R_k + i s w L_k) at the slip s, so that lambda_m
!> takes the current Y lambda_m from the mains, with Y = 1 / L_m + sum_k i s w / (R_k + i s w L_k).
module nocdyn_double_cage_circuits
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvectors
  implicit none (type, external)
  private

  type, public :: double_cage_circuit_t
    real(wp) :: voltage = 0.0_wp             !! amplitude of a phase of the star [V]
    real(wp) :: frequency = 1.0_wp           !! of the mains [rad/s], positive
    real(wp) :: pole_pairs = 1.0_wp
    real(wp) :: stator_resistance = 0.0_wp   !! [Ohm]
    real(wp) :: stator_leakage = 0.0_wp      !! [H]
    real(wp) :: mutual = 1.0_wp              !! magnetising inductance [H], positive
    real(wp) :: resistance(2) = 1.0_wp       !! of the inner and of the outer cage [Ohm], positive
    real(wp) :: leakage(2) = 1.0_wp          !! of the inner and of the outer cage [H], positive
  contains
    procedure :: steady_flux
    procedure :: stator_current
    procedure :: steady_torque
    procedure :: extreme_slips
    procedure :: breakdown_torque
  end type double_cage_circuit_t

  real(wp), parameter :: real_enough = 1.0e-6_wp   ! imaginary part of a root, over its size: two equal roots have some

contains

  !> The flux linkages of the stator, the inner and the outer cage that do not change at a slip [V s].
  pure function steady_flux(self, slip) result(flux)
    class(double_cage_circuit_t), intent(in) :: self
    real(wp), intent(in) :: slip   !! 1 at standstill, negative as a generator
    complex(wp) :: flux(3)
    complex(wp) :: admittance   ! current over magnetising flux [1/H]
    complex(wp) :: cage(2)      ! impedance times slip [Ohm]
    complex(wp) :: magnetising  ! flux [V s]

    associate (frequency => self%frequency)
      cage = cmplx(self%resistance, slip * frequency * self%leakage, wp)
      admittance = 1.0_wp / self%mutual + sum(cmplx(0.0_wp, slip * frequency, wp) / cage)
      magnetising = self%voltage / (cmplx(0.0_wp, frequency, wp) &
                                    + cmplx(self%stator_resistance, frequency * self%stator_leakage, wp) * admittance)
      ! the part of the first by the resistance is exact, however small it is beside the flux
      flux = [(self%voltage - self%stator_resistance * admittance * magnetising) / cmplx(0.0_wp, frequency, wp), &
              magnetising * self%resistance / cage]
    end associate
  end function steady_flux

  !> The current of the stator [A], behind whose transient inductance stands the flux that the cages make alone.
  pure complex(wp) function stator_current(self, flux)
    class(double_cage_circuit_t), intent(in) :: self
    complex(wp), intent(in) :: flux(3)   !! of stator, inner and outer cage [V s]

    associate (inductance => 1.0_wp / (1.0_wp / self%mutual + sum(1.0_wp / self%leakage)))
      stator_current = (flux(1) - inductance * sum(flux(2:3) / self%leakage)) / (self%stator_leakage + inductance)
    end associate
  end function stator_current

  !> The torque of the steady state at a slip, 3/2 p (lambda_ds i_qs - lambda_qs i_ds) [N m].
  pure real(wp) function steady_torque(self, slip)
    class(double_cage_circuit_t), intent(in) :: self
    real(wp), intent(in) :: slip   !! 1 at standstill, negative as a generator
    complex(wp) :: flux(3)

    flux = self%steady_flux(slip)
    steady_torque = 1.5_wp * self%pole_pairs * aimag(conjg(flux(1)) * self%stator_current(flux))
  end function steady_torque

  !> The slips at which the steady torque has an extreme: there can be three as a motor, two maxima with a minimum between them,
  !> and three as a generator.
  !>
  !> With D = (R_1 + i s X_1)(R_2 + i s X_2) and N = D / X_m + i s (R_1 + R_2 + i s (X_1 + X_2)) the torque is in proportion to
  !> s (A + B s^2) / |i D + (R_s + i X_s) N|^2, A = R_1 R_2 (R_1 + R_2), B = R_1 X_2^2 + R_2 X_1^2. The zeros of its derivative
  !> are those of a polynomial of degree six.
  function extreme_slips(self) result(slips)
    class(double_cage_circuit_t), intent(in) :: self
    real(wp), allocatable :: slips(:)
    complex(wp) :: roots(6), vectors(6, 6)
    real(wp) :: companion(6, 6), coefficient(0:6), scale
    integer :: k
    logical :: has_failed

    coefficient = slope_coefficients(self)
    scale = abs(coefficient(0) / coefficient(6))**(1.0_wp / 6.0_wp)   ! the geometric mean of the roots becomes 1
    companion = 0.0_wp
    do k = 1, 5
      companion(k + 1, k) = 1.0_wp
    end do
    do k = 1, 6
      companion(k, 6) = -coefficient(k - 1) / coefficient(6) * scale**(k - 7)
    end do
    call eigenvectors(companion, roots, vectors, has_failed)
    allocate (slips(0))
    if (.not. has_failed) slips = scale * pack(real(roots, wp), abs(aimag(roots)) <= real_enough * abs(roots))
  end function extreme_slips

  !> The numerator of the derivative of the torque by the slip, by powers of the slip.
  pure function slope_coefficients(self) result(coefficient)
    class(double_cage_circuit_t), intent(in) :: self
    real(wp) :: coefficient(0:6)
    complex(wp) :: root(0:2)     ! of the denominator of the torque: i D + (R_s + i X_s) N
    real(wp) :: square(0:4), torque(0:2), x(2)
    integer :: n

    x = self%frequency * self%leakage
    associate (r => self%resistance, stator => cmplx(self%stator_resistance, self%frequency * self%stator_leakage, wp), &
               mutual => self%frequency * self%mutual)
      root = [cmplx(r(1) * r(2), kind=wp), cmplx(0.0_wp, r(1) * x(2) + r(2) * x(1), wp), cmplx(-x(1) * x(2), kind=wp)]
      root = (cmplx(0.0_wp, 1.0_wp, wp) + stator / mutual) * root
      root(1:2) = root(1:2) + stator * [cmplx(0.0_wp, sum(r), wp), cmplx(-sum(x), kind=wp)]
      torque = [r(1) * r(2) * sum(r), 0.0_wp, r(1) * x(2)**2 + r(2) * x(1)**2]
    end associate
    square = [abs(root(0))**2, product_of(0, 1), abs(root(1))**2 + product_of(0, 2), product_of(1, 2), abs(root(2))**2]
    coefficient = 0.0_wp
    do n = 0, 4
      coefficient(n:n + 2) = coefficient(n:n + 2) + [1 - n, 0, 3 - n] * torque * square(n)
    end do

  contains

    !> What two coefficients give to the square of the size.
    pure real(wp) function product_of(first, second)
      integer, intent(in) :: first, second

      product_of = 2.0_wp * real(root(first) * conjg(root(second)), wp)
    end function product_of

  end function slope_coefficients

  !> The largest steady torque from standstill to the synchronous speed [N m].
  real(wp) function breakdown_torque(self)
    class(double_cage_circuit_t), intent(in) :: self
    integer :: k

    breakdown_torque = self%steady_torque(1.0_wp)
    associate (slips => self%extreme_slips())
      do k = 1, size(slips)
        if (slips(k) > 0 .and. slips(k) < 1) breakdown_torque = max(breakdown_torque, self%steady_torque(slips(k)))
      end do
    end associate
  end function breakdown_torque

end module nocdyn_double_cage_circuits
