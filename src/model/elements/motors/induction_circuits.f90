!> The equivalent circuit of an induction machine, per phase of the star and referred to the stator: its steady state.
!>
!> Space vectors x = x_d + i x_q stand in the frame that turns with the mains, whose voltage is along d. Their size is the
!> amplitude of the phase quantities. (P. C. Krause, Analysis of Electric Machinery, 1986, chapter 4.)
module nocdyn_induction_circuits
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  type, public :: induction_circuit_t
    real(wp) :: voltage = 0.0_wp             !! amplitude of a phase of the star [V]
    real(wp) :: frequency = 1.0_wp           !! of the mains [rad/s], positive
    real(wp) :: pole_pairs = 1.0_wp
    real(wp) :: stator_resistance = 0.0_wp   !! [Ohm]
    real(wp) :: rotor_resistance = 0.0_wp    !! [Ohm], positive
    real(wp) :: stator = 0.0_wp              !! leakage and mutual inductance of the stator [H]
    real(wp) :: rotor = 0.0_wp               !! leakage and mutual inductance of the rotor [H]
    real(wp) :: mutual = 0.0_wp              !! [H]
  contains
    procedure :: determinant
    procedure :: slip
    procedure :: steady_flux
    procedure :: stator_current
    procedure :: torque
    procedure :: steady_torque
    procedure :: breakdown_slip
  end type induction_circuit_t

contains

  !> Of the matrix of the inductances [H2].
  elemental real(wp) function determinant(self)
    class(induction_circuit_t), intent(in) :: self

    determinant = self%stator * self%rotor - self%mutual**2
  end function determinant

  !> The slip at a mechanical speed in the direction of the field.
  elemental real(wp) function slip(self, speed)
    class(induction_circuit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    slip = 1.0_wp - self%pole_pairs * speed / self%frequency
  end function slip

  !> The flux linkages of stator and rotor that do not change at a slip [V s].
  pure function steady_flux(self, slip) result(flux)
    class(induction_circuit_t), intent(in) :: self
    real(wp), intent(in) :: slip   !! 1 at standstill, negative as a generator
    complex(wp) :: flux(2)
    complex(wp) :: current   ! of the stator
    complex(wp) :: rotor     ! impedance of the rotor

    associate (frequency => self%frequency, mutual => self%mutual)
      rotor = cmplx(self%rotor_resistance, slip * frequency * self%rotor, wp)
      current = self%voltage / (cmplx(self%stator_resistance, frequency * self%stator, wp) &
                                + slip * (frequency * mutual)**2 / rotor)
      ! the part of the first by the resistance is exact, however small it is beside the flux
      flux = [(self%voltage - self%stator_resistance * current) / cmplx(0.0_wp, frequency, wp), &
              current * mutual * self%rotor_resistance / rotor]
    end associate
  end function steady_flux

  !> The current of the stator [A].
  pure complex(wp) function stator_current(self, flux)
    class(induction_circuit_t), intent(in) :: self
    complex(wp), intent(in) :: flux(2)   !! of stator and rotor [V s]

    stator_current = (self%rotor * flux(1) - self%mutual * flux(2)) / self%determinant()
  end function stator_current

  !> 3/2 p (lambda_ds i_qs - lambda_qs i_ds) [N m].
  pure real(wp) function torque(self, flux)
    class(induction_circuit_t), intent(in) :: self
    complex(wp), intent(in) :: flux(2)   !! of stator and rotor [V s]

    torque = 1.5_wp * self%pole_pairs * aimag(conjg(flux(1)) * self%stator_current(flux))
  end function torque

  !> The torque of the steady state at a slip [N m].
  pure real(wp) function steady_torque(self, slip)
    class(induction_circuit_t), intent(in) :: self
    real(wp), intent(in) :: slip   !! 1 at standstill, negative as a generator

    steady_torque = self%torque(self%steady_flux(slip))
  end function steady_torque

  !> The slip of the largest steady torque as a motor; as a generator it is the negative of it.
  elemental real(wp) function breakdown_slip(self)
    class(induction_circuit_t), intent(in) :: self
    complex(wp) :: source   ! impedance of the mains with the magnetising branch, seen from the rotor

    associate (frequency => self%frequency)
      source = cmplx(0.0_wp, frequency * self%mutual, wp) * cmplx(self%stator_resistance, &
                 frequency * (self%stator - self%mutual), wp) / cmplx(self%stator_resistance, frequency * self%stator, wp)
      breakdown_slip = self%rotor_resistance / abs(source + cmplx(0.0_wp, frequency * (self%rotor - self%mutual), wp))
    end associate
  end function breakdown_slip

end module nocdyn_induction_circuits
