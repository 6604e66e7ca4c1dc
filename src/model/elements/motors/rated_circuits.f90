!> The equivalent circuit of an induction motor from the values on its name plate and its breakdown torque.
!>
!> The circuit has, at the rated speed, the rated torque in the air gap, the rated power factor and the losses of the rated
!> efficiency, and the given largest steady torque. The losses beside the ones of the rotor, which follow from the slip, are
!> shared: `stator_share` of them in the resistance of the stator, the others, of the iron, in a resistance at the terminals,
!> which has no part in torques. With it as 0.4 stator and rotor resistance are about the same in cage motors (L. Pedra, IEEE
!> Transactions on Energy Conversion 19, 2004, takes them as equal). The leakage reactances of stator and rotor are equal.
!>
!> For a given leakage reactance X the other elements have closed forms: with the voltage E behind the stator's impedance and the
!> power P of the air gap of a phase, R_r / s = (E^2 + sqrt(E^4 - 4 P^2 X^2)) / (2 P), and the reactive power that is left over is
!> the one of the magnetising reactance. X is the least one that gives the breakdown torque: the first change of sign in steps of
!> 2 %, then bisection, as the largest torque does not fall with X everywhere.
module nocdyn_rated_circuits
  use nocdyn_induction_circuits, only: induction_circuit_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: fit_circuit, rated_phase

  integer, parameter, public :: rating_fits = 0
  integer, parameter, public :: rating_too_efficient = 1   !! the slip alone takes more than the losses
  integer, parameter, public :: rating_too_strong = 2      !! a smaller breakdown torque fits
  integer, parameter, public :: rating_too_weak = 3        !! a larger breakdown torque fits
  integer, parameter, public :: rating_impossible = 4      !! no reactive power is left for the magnetising reactance

  !> What the name plate says.
  type, public :: rating_t
    real(wp) :: power = 0.0_wp             !! at the shaft [W]
    real(wp) :: speed = 0.0_wp             !! between half of the synchronous speed and the whole [rad/s]
    real(wp) :: efficiency = 0.0_wp        !! 0 to 1
    real(wp) :: power_factor = 0.0_wp      !! 0 to 1
    real(wp) :: breakdown_ratio = 0.0_wp   !! largest steady torque over the rated one, above 1
    real(wp) :: voltage = 0.0_wp           !! between lines, rms [V]
    real(wp) :: frequency = 0.0_wp         !! of the mains [rad/s]
    real(wp) :: pole_pairs = 1.0_wp
    real(wp) :: stator_share = 0.4_wp      !! see above
  contains
    procedure :: slip => rated_slip
    procedure :: current => rated_current
  end type rating_t

  !> What does not depend on the reactances, of one phase.
  type, public :: phase_t
    real(wp) :: voltage = 0.0_wp         !! rms [V]
    real(wp) :: power = 0.0_wp           !! of the air gap [W]
    real(wp) :: slip = 0.0_wp
    real(wp) :: resistance = 0.0_wp      !! of the stator [Ohm]
    complex(wp) :: current = 0.0_wp      !! of the stator without the one of the terminal resistance, rms [A]
  end type phase_t

  real(wp), parameter :: growth = 1.02_wp      ! of the reactance in a step of the search
  real(wp), parameter :: least = 1.0e-6_wp     ! reactance with which it begins, over the rated impedance
  integer, parameter :: most_halvings = 200

contains

  elemental real(wp) function rated_slip(self)
    class(rating_t), intent(in) :: self

    rated_slip = 1.0_wp - self%pole_pairs * self%speed / self%frequency
  end function rated_slip

  !> The rated current, rms [A].
  elemental real(wp) function rated_current(self)
    class(rating_t), intent(in) :: self

    rated_current = self%power / (sqrt(3.0_wp) * self%voltage * self%efficiency * self%power_factor)
  end function rated_current

  !> Finds the circuit.
  pure subroutine fit_circuit(rating, circuit, status, limit)
    type(rating_t), intent(in) :: rating
    type(induction_circuit_t), intent(out) :: circuit   !! of no use unless it fits
    integer, intent(out) :: status                      !! rating_...
    real(wp), intent(out) :: limit   !! the largest efficiency, or the largest or least breakdown ratio, that fits
    type(phase_t) :: phase
    real(wp) :: excess, lowest, highest, ratio, x
    logical :: is_possible, starts_above

    limit = 1.0_wp - rating%slip()
    status = rating_too_efficient
    if (.not. rating%efficiency < limit) return
    phase = rated_phase(rating)
    x = least * phase%voltage / abs(phase%current)
    call set_leakage(rating, phase, x, circuit, excess, is_possible)
    status = rating_impossible
    if (.not. is_possible) return
    starts_above = excess > 0
    highest = excess
    lowest = excess
    do
      call set_leakage(rating, phase, growth * x, circuit, excess, is_possible)
      if (.not. is_possible) exit
      highest = max(highest, excess)
      lowest = min(lowest, excess)
      status = rating_fits
      if ((excess > 0) .neqv. starts_above) exit
      x = growth * x
      status = rating_impossible
    end do
    if (status == rating_fits) then
      call bisect(rating, phase, x, starts_above, circuit)
      return
    end if
    ratio = rating%breakdown_ratio
    status = merge(rating_too_weak, rating_too_strong, starts_above)
    limit = ratio + merge(lowest, highest, starts_above)
  end subroutine fit_circuit

  !> What does not depend on the reactances.
  pure type(phase_t) function rated_phase(rating) result(phase)
    type(rating_t), intent(in) :: rating   !! whose efficiency fits its slip
    real(wp) :: losses   ! without the ones of the rotor [W]

    phase%voltage = rating%voltage / sqrt(3.0_wp)
    phase%slip = rating%slip()
    phase%power = rating%power / (1.0_wp - phase%slip) / 3.0_wp
    losses = rating%power / rating%efficiency - 3.0_wp * phase%power
    associate (share => rating%stator_share, factor => rating%power_factor)
      phase%current = rating%current() * cmplx(factor, -sqrt(1.0_wp - factor**2), wp) &
                      - (1.0_wp - share) * losses / (3.0_wp * phase%voltage)
      phase%resistance = share * losses / (3.0_wp * abs(phase%current)**2)
    end associate
  end function rated_phase

  !> Closes in on the leakage reactance between x and the next one.
  pure subroutine bisect(rating, phase, x, starts_above, circuit)
    type(rating_t), intent(in) :: rating
    type(phase_t), intent(in) :: phase
    real(wp), intent(in) :: x   ! [Ohm]
    logical, intent(in) :: starts_above   ! whether the torque is too large with x
    type(induction_circuit_t), intent(out) :: circuit
    real(wp) :: excess, high, low, middle
    logical :: is_possible
    integer :: i

    low = x
    high = growth * x
    do i = 1, most_halvings
      middle = low + 0.5_wp * (high - low)
      call set_leakage(rating, phase, middle, circuit, excess, is_possible)
      if (.not. (middle > low .and. middle < high)) return
      if ((excess > 0) .eqv. starts_above) then
        low = middle
      else
        high = middle
      end if
    end do
  end subroutine bisect

  !> The circuit with a leakage reactance, and by how much its breakdown ratio is too large.
  pure subroutine set_leakage(rating, phase, x, circuit, excess, is_possible)
    type(rating_t), intent(in) :: rating
    type(phase_t), intent(in) :: phase
    real(wp), intent(in) :: x   ! [Ohm]
    type(induction_circuit_t), intent(out) :: circuit
    real(wp), intent(out) :: excess
    logical, intent(out) :: is_possible   ! nothing else is set if not
    complex(wp) :: voltage   ! of the air gap
    real(wp) :: reactive, root, rotor, square

    excess = 0.0_wp
    voltage = phase%voltage - cmplx(phase%resistance, x, wp) * phase%current
    square = real(voltage * conjg(voltage), wp)
    root = square**2 - (2.0_wp * phase%power * x)**2
    is_possible = root >= 0
    if (.not. is_possible) return
    rotor = (square + sqrt(root)) / (2.0_wp * phase%power)
    reactive = aimag(voltage * conjg(phase%current)) - square * x / (rotor**2 + x**2)
    is_possible = reactive > 0
    if (.not. is_possible) return
    associate (frequency => rating%frequency)
      circuit%voltage = sqrt(2.0_wp) * phase%voltage
      circuit%frequency = frequency
      circuit%pole_pairs = rating%pole_pairs
      circuit%stator_resistance = phase%resistance
      circuit%rotor_resistance = rotor * phase%slip
      circuit%mutual = square / reactive / frequency
      circuit%stator = circuit%mutual + x / frequency
      circuit%rotor = circuit%stator
    end associate
    excess = circuit%steady_torque(circuit%breakdown_slip()) * rating%speed / rating%power - rating%breakdown_ratio
  end subroutine set_leakage

end module nocdyn_rated_circuits
