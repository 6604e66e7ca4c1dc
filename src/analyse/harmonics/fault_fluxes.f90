!> Torques of short circuits and faulty synchronisations by the fluxes of the machine, as sums of decaying sines.
!>
!> The machine has the same circuits in both axes of its rotor. In units of the rated ones, its current is
!> i = Y(p) (psi - psi_0), with the flux linkage psi of the stator, psi_0 = 1 the one of no load, seen from the rotor, and the
!> operational admittance
!>
!>   Y(p) = 1 / x'' - sum of s_k / (1 + p T_k),   s = 1 / x'' - 1 / x', 1 / x' - 1 / x,   T = T'', T'
!>
!> whose T_k are the time constants of the short circuit of all phases (P. Kundur, Power System Stability and Control, 1994,
!> chapter 4; C. Concordia, Synchronous Machines, 1951). The stator has the resistance r = x'' / (omega T_a) and the equation
!> psi' = v - omega r i in its own frame. While the rotor turns with the mains, these equations are linear with constant
!> coefficients: in the rotor's frame for faults of all phases, in the stator's frame for faults of two phases. Fluxes and
!> currents are sums of exponentials, and the torque, their product, is one, without any approximation.
module nocdyn_fault_fluxes
  use nocdyn_fault_excitations, only: fault_terms_t
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_solve
  use nocdyn_lapack_eigen, only: eigenvectors
  implicit none (type, external)
  private

  public :: find_flux_terms

  !> A machine at its rated voltage without load, per unit.
  type, public :: fault_machine_t
    real(wp) :: frequency = 0.0_wp        !! omega of the mains [rad/s]
    real(wp) :: reactance = 1.0_wp        !! x''
    real(wp), allocatable :: share(:)     !! s_k
    real(wp), allocatable :: rate(:)      !! 1 / T_k, positive [1/s]
    real(wp) :: stator_rate = 0.0_wp      !! 1 / T_a [1/s]
  end type fault_machine_t

  !> A linear system x' = matrix x, and fluxes and currents as sums of its states; rows: both axes of a frame.
  type :: flux_model_t
    real(wp), allocatable :: matrix(:, :), start(:), flux(:, :), current(:, :)
  end type flux_model_t

  ! States: two of what drives the system, two of the flux of the stator, two of each rotor circuit.
  integer, parameter :: driving = 0, stator = 2, rotor = 4

contains

  !> The torque that brakes the rotor, in units of the rated apparent power over the synchronous speed.
  subroutine find_flux_terms(machine, fault, angle, terms, has_failed)
    type(fault_machine_t), intent(in) :: machine
    character(len=*), intent(in) :: fault            !! 'three_phase', 'two_phase' or 'resynchronisation'
    real(wp), intent(in) :: angle                    !! of a resynchronisation: the rotor is ahead of the mains [rad]
    type(fault_terms_t), intent(inout) :: terms      !! amplitude, multiple, rate, phase
    logical, intent(out) :: has_failed               !! the equations cannot be solved in floating point
    type(flux_model_t) :: model
    complex(wp), allocatable :: current(:, :), flux(:, :), value(:)
    integer :: k, z

    if (fault == 'two_phase') then
      ! No current in axis 1, no voltage in axis 2 of the stator's frame, from the zero of the voltage of axis 2 on, where the
      ! torque is largest. The first states are the flux of no load.
      model = empty_model(size(machine%share))
      model%start(driving + 2) = 1.0_wp
      model%start(stator + 2) = 1.0_wp
      call turn(model%matrix, driving, machine%frequency)
      model%flux(1, driving + 1) = 1.0_wp
      model%flux(2, stator + 2) = 1.0_wp
      model%current(2, stator + 2) = 1.0_wp / machine%reactance
      model%current(2, driving + 2) = -1.0_wp / machine%reactance
      do k = 1, size(machine%share)
        z = rotor + 2 * (k - 1)
        model%flux(1, z + 1) = machine%reactance * machine%share(k)
        model%current(2, z + 2) = -machine%share(k)
      end do
      model%matrix(stator + 2, :) = -machine%stator_rate * machine%reactance * model%current(2, :)
      do k = 1, size(machine%share)
        z = rotor + 2 * (k - 1)
        model%matrix(z + 1, :) = machine%rate(k) * model%flux(1, :)
        model%matrix(z + 1, driving + 1) = 0.0_wp   ! the change of the flux, without the one of no load
        model%matrix(z + 2, stator + 2) = machine%rate(k)
        model%matrix(z + 2, driving + 2) = -machine%rate(k)
        model%matrix(z + 1, z + 1) = model%matrix(z + 1, z + 1) - machine%rate(k)
        model%matrix(z + 2, z + 2) = model%matrix(z + 2, z + 2) - machine%rate(k)
        call turn(model%matrix, z, machine%frequency)
      end do
    else if (fault == 'three_phase') then
      model = three_phase_model(machine, [0.0_wp, 0.0_wp])
    else
      model = three_phase_model(machine, [cos(angle), -sin(angle)])
    end if
    call find_exponentials(model, value, flux, current, has_failed)
    if (has_failed) return
    call multiply(machine%frequency, value, flux, current, terms)
  end subroutine find_flux_terms

  !> A network of a flux that stands still in the frame of the rotor, at its start; 0: a short circuit.
  pure function three_phase_model(machine, network) result(model)
    type(fault_machine_t), intent(in) :: machine
    real(wp), intent(in) :: network(2)
    type(flux_model_t) :: model
    integer :: a, k, z

    model = empty_model(size(machine%share))
    model%start(driving + 1) = 1.0_wp   ! it stays: the flux of no load, to which the ones of the network are in proportion
    model%start(stator + 1) = 1.0_wp
    do a = 1, 2
      model%flux(a, stator + a) = 1.0_wp
      model%current(a, stator + a) = 1.0_wp / machine%reactance
    end do
    model%current(1, driving + 1) = -1.0_wp / machine%reactance
    do k = 1, size(machine%share)
      z = rotor + 2 * (k - 1)
      do a = 1, 2
        model%current(a, z + a) = -machine%share(k)
        model%matrix(z + a, stator + a) = machine%rate(k)
        model%matrix(z + a, z + a) = -machine%rate(k)
      end do
      model%matrix(z + 1, driving + 1) = -machine%rate(k)
    end do
    model%matrix(stator + 1:stator + 2, :) = -machine%stator_rate * machine%reactance * model%current
    call turn(model%matrix, stator, -machine%frequency)
    associate (row => model%matrix(stator + 1:stator + 2, driving + 1))
      row = row + machine%frequency * [-network(2), network(1)]
    end associate
  end function three_phase_model

  pure function empty_model(circuits) result(model)
    integer, intent(in) :: circuits
    type(flux_model_t) :: model

    associate (n => rotor + 2 * circuits)
      allocate (model%matrix(n, n), model%start(n), model%flux(2, n), model%current(2, n), source=0.0_wp)
    end associate
  end function empty_model

  !> Adds the turning of two states with an angular speed.
  pure subroutine turn(matrix, before, speed)
    real(wp), intent(inout) :: matrix(:, :)
    integer, intent(in) :: before   !! the states before both
    real(wp), intent(in) :: speed   !! [rad/s]

    matrix(before + 1, before + 2) = matrix(before + 1, before + 2) - speed
    matrix(before + 2, before + 1) = matrix(before + 2, before + 1) + speed
  end subroutine turn

  !> Fluxes and currents are the sums of flux(:, m) e^(value(m) t) and current(:, m) e^(value(m) t).
  subroutine find_exponentials(model, value, flux, current, has_failed)
    type(flux_model_t), intent(in) :: model
    complex(wp), allocatable, intent(out) :: value(:), flux(:, :), current(:, :)
    logical, intent(out) :: has_failed
    complex(wp), allocatable :: factor(:), vector(:, :), solved(:, :)
    real(wp), parameter :: largest_error = 1.0e-9_wp   ! of the states at the start, which are 0 or 1
    integer :: m, n

    n = size(model%start)
    allocate (value(n), vector(n, n))
    call eigenvectors(model%matrix, value, vector, has_failed)
    if (has_failed) return
    allocate (factor, source=cmplx(model%start, kind=wp))
    allocate (solved, source=vector)
    call complex_solve(solved, factor)
    has_failed = .true.
    if (.not. all(is_finite(abs(factor)))) return
    has_failed = maxval(abs(matmul(vector, factor) - model%start)) > largest_error
    flux = matmul(model%flux, vector)
    current = matmul(model%current, vector)
    do m = 1, n
      flux(:, m) = flux(:, m) * factor(m)
      current(:, m) = current(:, m) * factor(m)
    end do
  end subroutine find_exponentials

  !> The terms of flux_2 current_1 - flux_1 current_2. Of two conjugate exponentials one has twice the amplitude.
  pure subroutine multiply(frequency, value, flux, current, terms)
    real(wp), intent(in) :: frequency                          !! [rad/s]
    complex(wp), intent(in) :: value(:), flux(:, :), current(:, :)   !! [1/s]; [2, exponentials]
    type(fault_terms_t), intent(inout) :: terms
    real(wp), parameter :: quarter = 0.5_wp * acos(-1.0_wp)
    real(wp), parameter :: least = 1.0e-13_wp   ! of a term, relative to the largest
    real(wp), dimension(size(value) * (size(value) + 1) / 2) :: amplitude, multiple, phase, rate
    complex(wp) :: product, total
    integer :: i, m, n

    i = 0
    do m = 1, size(value)
      do n = m, size(value)
        product = torque_of(m, n)
        if (n > m) product = product + torque_of(n, m)
        total = value(m) + value(n)
        i = i + 1
        amplitude(i) = abs(product)
        if (aimag(total) > 0) amplitude(i) = 2.0_wp * amplitude(i)
        if (aimag(total) < 0) amplitude(i) = 0.0_wp
        phase(i) = atan2(aimag(product), real(product)) + quarter
        multiple(i) = aimag(total) / frequency
        rate(i) = max(0.0_wp, -real(total))   ! nothing grows
      end do
    end do
    ! Variants of a sweep have the same number of terms, of which some may be 0.
    associate (is_kept => amplitude > least * maxval(amplitude))
      i = max(count(is_kept), (size(value) / 2)**2)
      terms%amplitude = pack(amplitude, is_kept, spread(0.0_wp, 1, i))
      terms%multiple = pack(multiple, is_kept, spread(0.0_wp, 1, i))
      terms%rate = pack(rate, is_kept, spread(0.0_wp, 1, i))
      terms%phase = pack(phase, is_kept, spread(0.0_wp, 1, i))
    end associate

  contains

    pure complex(wp) function torque_of(m, n)
      integer, intent(in) :: m, n

      torque_of = flux(2, m) * current(1, n) - flux(1, m) * current(2, n)
    end function torque_of

  end subroutine multiply

end module nocdyn_fault_fluxes
