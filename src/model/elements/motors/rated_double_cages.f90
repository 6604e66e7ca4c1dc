!> The circuit with two cages of an induction motor from its name plate, breakdown torque, starting torque and starting current.
!>
!> The losses are shared as in `nocdyn_rated_circuits`, whose rated point this circuit has too. Its leakage reactances X_s of the
!> stator, X_1 of the inner and X_2 of the outer cage are one more than the values that are known: X_2 is k_x X_s, and X_1 is
!> larger, as in J. Susanto's asm_toolkit (github.com/susantoj/asm_toolkit, nr_solver.m); here with k_x = 1.
!>
!> With the reactances of stator and inner cage and the resistance of the outer one the rated point gives the rest: with the
!> voltage E of the magnetising branch the inner cage takes the power P of the air gap that the outer one leaves over,
!> R_1 / s = (E^2 + sqrt(E^4 - 4 P^2 X_1^2)) / (2 P), and the magnetising reactance the reactive power that is left over. Those
!> three are found by the method of Levenberg and Marquardt, as logarithms, for the least sum of the squares of the relative
!> misfits of breakdown torque, starting torque and starting current, from the best point of a grid.
module nocdyn_rated_double_cages
  use nocdyn_double_cage_circuits, only: double_cage_circuit_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: solve_positive_definite
  use nocdyn_rated_circuits, only: phase_t, rated_phase, rating_fits, rating_impossible, rating_t, rating_too_efficient
  implicit none (type, external)
  private

  public :: fit_double_cage

  !> What a circuit has of the values that it is fitted to, over the rated torque and the rated current.
  type, public :: starting_values_t
    real(wp) :: breakdown_ratio = 0.0_wp
    real(wp) :: starting_torque = 0.0_wp
    real(wp) :: starting_current = 0.0_wp
  contains
    procedure :: misfits
  end type starting_values_t

  ! first points: reactance of the stator over the rated impedance, that which the inner cage has more over it, and resistance of
  ! the outer cage over that impedance and the slip
  real(wp), parameter :: first_reactance(4) = [0.03_wp, 0.06_wp, 0.10_wp, 0.15_wp]
  real(wp), parameter :: first_excess(3) = [0.3_wp, 1.0_wp, 3.0_wp], first_resistance(3) = [3.0_wp, 8.0_wp, 20.0_wp]

  ! bounds of the three, over the rated impedance: an outer cage without a current would have no bound, and no time constant
  real(wp), parameter :: least(3) = [0.005_wp, 0.001_wp, 0.001_wp], largest(3) = [1.0_wp, 3.0_wp, 2.0_wp]

  integer, parameter :: most_steps = 60, most_trials = 20
  real(wp), parameter :: step = 1.0e-4_wp              ! of a logarithm, for differences
  real(wp), parameter :: close_enough = 1.0e-24_wp     ! sum of the squares of misfits
  real(wp), parameter :: first_damping = 1.0e-2_wp, least_damping = 1.0e-12_wp, fewer = 0.2_wp, more = 4.0_wp

contains

  !> Finds the circuit whose misfits are least.
  subroutine fit_double_cage(rating, wanted, circuit, found, status)
    type(rating_t), intent(in) :: rating
    type(starting_values_t), intent(in) :: wanted         !! with the breakdown ratio of the rating
    type(double_cage_circuit_t), intent(out) :: circuit   !! of no use unless it fits
    type(starting_values_t), intent(out) :: found         !! of the circuit
    integer, intent(out) :: status   !! rating_fits, whatever the misfits are, rating_too_efficient or rating_impossible
    type(phase_t) :: phase
    real(wp) :: damping, misfit(3), slopes(3, 3), x(3)
    integer :: i
    logical :: has_moved, is_possible

    status = rating_too_efficient
    if (.not. rating%efficiency < 1.0_wp - rating%slip()) return
    status = rating_impossible
    phase = rated_phase(rating)
    call find_start(rating, phase, wanted, x, misfit, is_possible)
    if (.not. is_possible) return
    damping = first_damping
    do i = 1, most_steps
      if (sum(misfit**2) < close_enough) exit
      call find_slopes(rating, phase, wanted, x, slopes, is_possible)
      if (.not. is_possible) exit
      call take_step(rating, phase, wanted, slopes, damping, x, misfit, has_moved)
      if (.not. has_moved) exit
    end do
    call evaluate(rating, phase, x, circuit, found, is_possible)
    status = rating_fits
  end subroutine fit_double_cage

  !> By how much values are too large, over the wanted ones: breakdown torque, starting torque, starting current.
  pure function misfits(self, wanted)
    class(starting_values_t), intent(in) :: self
    type(starting_values_t), intent(in) :: wanted
    real(wp) :: misfits(3)

    misfits = [self%breakdown_ratio / wanted%breakdown_ratio, self%starting_torque / wanted%starting_torque, &
               self%starting_current / wanted%starting_current] - 1.0_wp
  end function misfits

  !> The first point with the least misfits.
  subroutine find_start(rating, phase, wanted, x, misfit, is_possible)
    type(rating_t), intent(in) :: rating
    type(phase_t), intent(in) :: phase
    type(starting_values_t), intent(in) :: wanted
    real(wp), intent(out) :: x(3), misfit(3)
    logical, intent(out) :: is_possible   ! whether one of the points has a circuit
    type(double_cage_circuit_t) :: circuit
    type(starting_values_t) :: found
    real(wp) :: point(3)
    integer :: i, j, k
    logical :: has_circuit

    is_possible = .false.
    x = 0.0_wp
    misfit = huge(1.0_wp)
    do i = 1, size(first_reactance)
      do j = 1, size(first_excess)
        do k = 1, size(first_resistance)
          point = log(phase%voltage / rating%current()) + log([first_reactance(i), first_excess(j) * first_reactance(i), &
                                                               first_resistance(k) * phase%slip])
          call evaluate(rating, phase, point, circuit, found, has_circuit)
          if (.not. has_circuit) cycle
          if (is_possible) then
            if (sum(found%misfits(wanted)**2) >= sum(misfit**2)) cycle
          end if
          is_possible = .true.
          x = point
          misfit = found%misfits(wanted)
        end do
      end do
    end do
  end subroutine find_start

  !> The derivatives of the misfits, by central differences.
  subroutine find_slopes(rating, phase, wanted, x, slopes, is_possible)
    type(rating_t), intent(in) :: rating
    type(phase_t), intent(in) :: phase
    type(starting_values_t), intent(in) :: wanted
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: slopes(3, 3)   ! [misfits, x]
    logical, intent(out) :: is_possible
    type(double_cage_circuit_t) :: circuit
    type(starting_values_t) :: above, below
    real(wp) :: aside(3)
    integer :: k

    slopes = 0.0_wp
    do k = 1, 3
      aside = 0.0_wp
      aside(k) = step
      call evaluate(rating, phase, x + aside, circuit, above, is_possible)
      if (.not. is_possible) return
      call evaluate(rating, phase, x - aside, circuit, below, is_possible)
      if (.not. is_possible) return
      slopes(:, k) = (above%misfits(wanted) - below%misfits(wanted)) / (2.0_wp * step)
    end do
  end subroutine find_slopes

  !> One step, with as much damping as it needs to make the misfits smaller.
  subroutine take_step(rating, phase, wanted, slopes, damping, x, misfit, has_moved)
    type(rating_t), intent(in) :: rating
    type(phase_t), intent(in) :: phase
    type(starting_values_t), intent(in) :: wanted
    real(wp), intent(in) :: slopes(3, 3)
    real(wp), intent(inout) :: damping, x(3), misfit(3)
    logical, intent(out) :: has_moved
    type(double_cage_circuit_t) :: circuit
    type(starting_values_t) :: found
    real(wp), allocatable :: change(:, :)
    real(wp) :: next(3), normal(3, 3), target_side(3, 1)
    integer :: i, k
    logical :: is_indefinite, is_possible

    has_moved = .false.
    target_side(:, 1) = -matmul(misfit, slopes)
    do i = 1, most_trials
      normal = matmul(transpose(slopes), slopes)
      do k = 1, 3
        normal(k, k) = normal(k, k) * (1.0_wp + damping) + least_damping
      end do
      call solve_positive_definite(normal, target_side, change, is_indefinite)
      is_possible = .not. is_indefinite
      if (is_possible) then
        associate (impedance => log(phase%voltage / rating%current()))
          next = min(max(x + change(:, 1), impedance + log(least)), impedance + log(largest))
        end associate
        call evaluate(rating, phase, next, circuit, found, is_possible)
      end if
      if (is_possible) is_possible = sum(found%misfits(wanted)**2) < sum(misfit**2)
      if (is_possible) then
        has_moved = .true.
        x = next
        misfit = found%misfits(wanted)
        damping = max(least_damping, fewer * damping)
        return
      end if
      damping = more * damping
    end do
  end subroutine take_step

  !> The circuit with the rated point at a point x, and its values.
  subroutine evaluate(rating, phase, x, circuit, found, is_possible)
    type(rating_t), intent(in) :: rating
    type(phase_t), intent(in) :: phase
    real(wp), intent(in) :: x(3)   ! logarithms: reactance of the stator, excess of the inner cage, resistance of the outer one
    type(double_cage_circuit_t), intent(out) :: circuit
    type(starting_values_t), intent(out) :: found
    logical, intent(out) :: is_possible   ! nothing else is set if not
    complex(wp) :: voltage   ! of the magnetising branch
    real(wp) :: power, reactance(2), reactive, root, rotor(2), square

    reactance = exp(x(1)) + [exp(x(2)), 0.0_wp]
    rotor(2) = exp(x(3)) / phase%slip
    voltage = phase%voltage - cmplx(phase%resistance, reactance(2), wp) * phase%current
    square = real(voltage * conjg(voltage), wp)
    power = phase%power - square * rotor(2) / (rotor(2)**2 + reactance(2)**2)
    root = square**2 - (2.0_wp * power * reactance(1))**2
    is_possible = power > 0 .and. root >= 0   ! not so with a number that is not finite
    if (.not. is_possible) return
    rotor(1) = (square + sqrt(root)) / (2.0_wp * power)
    reactive = aimag(voltage * conjg(phase%current)) - square * sum(reactance / (rotor**2 + reactance**2))
    is_possible = reactive > 0
    if (.not. is_possible) return
    circuit%voltage = sqrt(2.0_wp) * phase%voltage
    circuit%frequency = rating%frequency
    circuit%pole_pairs = rating%pole_pairs
    circuit%stator_resistance = phase%resistance
    circuit%stator_leakage = reactance(2) / rating%frequency
    circuit%mutual = square / reactive / rating%frequency
    circuit%resistance = rotor * phase%slip
    circuit%leakage = reactance / rating%frequency
    associate (torque => rating%power / rating%speed)
      found%breakdown_ratio = circuit%breakdown_torque() / torque
      found%starting_torque = circuit%steady_torque(1.0_wp) / torque
    end associate
    found%starting_current = sqrt(0.5_wp) * abs(circuit%stator_current(circuit%steady_flux(1.0_wp))) / rating%current()
  end subroutine evaluate

end module nocdyn_rated_double_cages
