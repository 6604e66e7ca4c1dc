!> Machines with elements of every kind, for the tests that compare formulations, Jacobians and lanes.
module nocdyn_test_full_machines
  use nocdyn_bank, only: append_bank
  use nocdyn_couplings, only: coupling_common_t, couplings_t, new_couplings
  use nocdyn_curves, only: curve_t, extrapolation_constant, extrapolation_linear, interpolation_cubic, interpolation_linear, &
                           new_curve
  use nocdyn_dc_motors, only: new_dc_motors
  use nocdyn_element_rows, only: element_rows_t, new_element_rows
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_fault_excitations, only: fault_terms_t, new_fault_excitations
  use nocdyn_flux_motors, only: circuit_keys, new_flux_motors
  use nocdyn_gap_couplings, only: gap_couplings_t, new_gap_couplings
  use nocdyn_governed_banks, only: governor_t
  use nocdyn_inverter_motors, only: new_inverter_motors, torque_harmonics_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_motors, only: new_induction_motors, new_motors, new_table_motors
  use nocdyn_load_shares, only: new_load_shares, shared_load_t
  use nocdyn_loads, only: new_nonlinear_loads
  use nocdyn_order_excitations, only: new_order_excitations, order_torque_t
  use nocdyn_phases, only: new_phases, phases_t
  use nocdyn_polynomial_couplings, only: new_polynomial_couplings, polynomial_couplings_t
  use nocdyn_saturated_couplings, only: new_saturated_couplings
  use nocdyn_schedules, only: join_points, schedule_t
  use nocdyn_synchronous_motors, only: new_synchronous_motors, slip_curves_t
  use nocdyn_table_couplings, only: new_table_couplings
  use nocdyn_table_excitations, only: new_table_excitations
  use nocdyn_test_machines, only: finish, numbered_names
  use nocdyn_test_random, only: random_stream, random_stream_t
  use nocdyn_test_random_machines, only: random_machine
  use nocdyn_timed_excitations, only: new_timed_excitations, shape_pulse, shape_ramp, shape_step
  use nocdyn_wave_excitations, only: new_wave_excitations
  implicit none (type, external)
  private

  public :: full_machine

contains

  !> A random machine with further elements of every kind; the parameters of a lane depend on its variant.
  function full_machine(seed, bodies, variants, wanted, choice) result(machine)
    integer, intent(in) :: seed
    integer, intent(in) :: bodies        !! at least 2
    integer, intent(in) :: variants(:)   !! of each lane
    integer, intent(in) :: wanted(:)     !! bodies chosen as coordinates; empty: they are chosen by the analysis
    integer, intent(in) :: choice        !! complement_...
    class(machine_t), allocatable :: machine

    machine = random_machine(seed, bodies, variants, wanted, choice)
    call add_couplings(bodies, variants, machine)
    call add_rows(seed, bodies, variants, machine)
    call add_meshes(bodies, variants, machine)
    call add_motors(bodies, variants, machine)
    call add_loads(bodies, variants, machine)
    call add_excitations(bodies, variants, machine)
    call finish(machine, wanted, choice)
  end function full_machine

  !> A parameter with the same value for every element, a little different in every lane, [lanes, elements].
  pure function lane_values(value, variants, count)
    real(wp), intent(in) :: value
    integer, intent(in) :: variants(:), count
    real(wp) :: lane_values(size(variants), count)

    lane_values = spread(value * (1.0_wp + 0.03_wp * variants), 2, count)
  end function lane_values

  !> A curve for every element, a little different in every lane, [lanes, elements].
  function curves(x, y, interpolation, extrapolation, variants, count) result(all_curves)
    real(wp), intent(in) :: x(:), y(:)
    integer, intent(in) :: interpolation, extrapolation
    integer, intent(in) :: variants(:), count
    type(curve_t) :: all_curves(size(variants), count)
    integer :: e, l

    do e = 1, count
      do l = 1, size(variants)
        all_curves(l, e) = new_curve(x, y * (1.0_wp + 0.03_wp * variants(l)), interpolation, extrapolation)
      end do
    end do
  end function curves

  subroutine add_couplings(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    real(wp), parameter :: twist(4) = [-0.5_wp, -0.1_wp, 0.2_wp, 0.6_wp], moment(4) = [-30.0_wp, -4.0_wp, 5.0_wp, 60.0_wp]
    real(wp) :: coefficient(5, size(variants), 2)
    integer :: k

    do k = 1, 5
      coefficient(k, :, :) = lane_values(50.0_wp / k, variants, 2)
    end do
    associate (one => lane_values(1.0_wp, variants, 2), friction => lane_values(4.0_wp, variants, 2), &
               friction_speed => lane_values(0.5_wp, variants, 2))
      call append_bank(machine%banks, &
                       new_polynomial_couplings(coupling_common_t(numbered_names('polynomial', 2), [0, 1], [1, bodies], one, &
                                                                  0.1_wp * one, friction, friction_speed), coefficient))
      call append_bank(machine%banks, &
                       new_gap_couplings(coupling_common_t(numbered_names('gap', 2), [bodies, 0], [1, 2], 4.0_wp * one, &
                                                           0.1_wp * one), coefficient, 0.3_wp * one))
      call append_bank(machine%banks, &
                       new_saturated_couplings(coupling_common_t(numbered_names('clutch', 2), [1, 2], [2, 0], 0.0_wp * one, &
                                                                 0.1_wp * one, friction, friction_speed), 80.0_wp * one, &
                                               20.0_wp * one))
      call append_bank(machine%banks, &
                       new_table_couplings(coupling_common_t(numbered_names('rubber', 2), [0, 1], [2, 2], one, 0.1_wp * one), &
                                           curves(twist, moment, interpolation_cubic, extrapolation_linear, variants, 2)))
    end associate
  end subroutine add_couplings

  !> Couplings along random rows of several bodies and the ground, smooth ones and ones with a gap.
  subroutine add_rows(seed, bodies, variants, machine)
    integer, intent(in) :: seed, bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(element_rows_t) :: rows
    type(random_stream_t) :: numbers
    real(wp) :: cubic(size(variants), 3)
    integer :: b

    numbers = random_stream(7 * seed)
    rows = new_element_rows([1, bodies + 1, bodies + 4, bodies + 6], [(b, b=1, bodies), 1, 0, bodies, 2, 1], &
                            [(numbers%number(-1.5_wp, 1.5_wp), b=1, bodies + 5)])
    cubic = lane_values(6.0_wp, variants, 3)
    associate (one => lane_values(1.0_wp, variants, 3))
      call append_bank(machine%banks, &
                       new_couplings(coupling_common_t(numbered_names('mesh', 3), rows, 0.8_wp * one, 0.1_wp * one), &
                                     40.0_wp * one, cubic))
      call append_bank(machine%banks, &
                       new_gap_couplings(coupling_common_t(numbered_names('play', 3), rows, 0.5_wp * one, 0.0_wp * one), &
                                         spread(30.0_wp * one, 1, 1), 0.2_wp * one))
    end associate
  end subroutine add_rows

  !> Meshes with transmission errors, one with and one without a gap, each followed by its phase.
  subroutine add_meshes(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(coupling_common_t) :: common
    type(gap_couplings_t) :: rattling
    type(polynomial_couplings_t) :: tight
    real(wp), allocatable :: stiffness(:, :, :)

    stiffness = spread(lane_values(35.0_wp, variants, 1), 1, 2)
    associate (one => lane_values(1.0_wp, variants, 1))
      common = coupling_common_t(numbered_names('teeth', 1), new_element_rows([1, 3], [2, bodies], [0.7_wp, 1.1_wp]), &
                                 0.6_wp * one, 0.0_wp * one, one, 0.4_wp * one)
      allocate (common%error)
      common%error%order = [1.0_wp, 2.5_wp]
      common%error%amplitude = [0.2_wp, 0.07_wp]
      common%error%phase = [0.3_wp, -1.0_wp]
      tight = new_polynomial_couplings(common, stiffness)
      call append_bank(machine%banks, tight)
      call append_bank(machine%banks, phase_of(tight))
      common%names = numbered_names('rattle', 1)
      common%rows = new_element_rows([1, 3], [bodies, 1], [0.9_wp, -1.3_wp])
      rattling = new_gap_couplings(common, stiffness, 0.2_wp * one)
      call append_bank(machine%banks, rattling)
      call append_bank(machine%banks, phase_of(rattling))
    end associate
  end subroutine add_meshes

  !> The phase of a mesh, with work where the mesh has some.
  function phase_of(mesh) result(phase)
    class(couplings_t), intent(in) :: mesh
    type(phases_t) :: phase

    phase = new_phases(mesh%lanes, mesh%names, mesh%rows%body(:1))
    phase%with_work = mesh%with_work
  end function phase_of

  subroutine add_motors(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(governor_t) :: governor
    type(curve_t) :: table(size(variants), 1)

    table = curves([-4.0_wp, 0.0_wp, 1.0_wp, 4.0_wp], [50.0_wp, 60.0_wp, 40.0_wp, -30.0_wp], &
                   interpolation_linear, extrapolation_linear, variants, 1)
    allocate (governor%set_speed, source=lane_values(1.0_wp, variants, 1))
    allocate (governor%gain, source=lane_values(0.3_wp, variants, 1))
    allocate (governor%time, source=lane_values(0.4_wp, variants, 1))
    allocate (governor%start, source=lane_values(0.5_wp, variants, 1))
    associate (one => lane_values(1.0_wp, variants, 1))
      call append_bank(machine%banks, &
                       new_induction_motors(numbered_names('induction', 1), [1], 60.0_wp * one, 0.3_wp * one, 10.0_wp * one))
      call append_bank(machine%banks, &
                       new_table_motors(numbered_names('table', 1), [bodies], table))
      call append_bank(machine%banks, &
                       new_motors(numbered_names('governed', 1), [2], 30.0_wp * one, 3.0_wp * one, 0.1_wp * one, governor, &
                                  2.0_wp * one))
      call append_bank(machine%banks, &
                       new_table_motors(numbered_names('throttled', 1), [1], table, governor, 0.0_wp * one))
      call append_bank(machine%banks, &
                       new_dc_motors(numbered_names('dc', 1), [2], 24.0_wp * one, 2.0_wp * one, 1.5_wp * one, &
                                     0.5_wp * one))
      call append_bank(machine%banks, &
                       new_dc_motors(numbered_names('drive', 1), [bodies], 24.0_wp * one, 2.0_wp * one, 1.5_wp * one, &
                                     0.5_wp * one, governor))
    end associate
    call add_three_phase_motors(bodies, variants, governor, machine)
  end subroutine add_motors

  !> Motors on mains and inverters.
  subroutine add_three_phase_motors(bodies, variants, governor, machine)
    integer, intent(in) :: bodies, variants(:)
    type(governor_t), intent(inout) :: governor
    type(machine_t), intent(inout) :: machine

    associate (one => lane_values(1.0_wp, variants, 1))
      call append_bank(machine%banks, &
                       new_synchronous_motors(numbered_names('starting', 1), [1], slip_curves(variants), 4.0_wp * one, &
                                              4.0_wp + 0.0_wp * one, sign(1.0_wp, one), 0.3_wp * one))
      governor%least = -1.0_wp
      call set_courses(variants, governor)
      call append_bank(machine%banks, &
                       new_inverter_motors(numbered_names('inverter', 1), [bodies], 20.0_wp * one, governor, ripple(variants)))
      call append_bank(machine%banks, new_flux_motors(numbered_names('fluxes', 1), [bodies], circuits(variants), &
                                                      4.0_wp + 0.0_wp * one, sign(1.0_wp, -one), .true.))
      call append_bank(machine%banks, new_flux_motors(numbered_names('supplied', 1), [1], circuits(variants), &
                                                      2.0_wp + 0.0_wp * one, sign(1.0_wp, one), .true., supply(variants)))
    end associate
  end subroutine add_three_phase_motors

  !> A mean torque and a pulsation.
  function slip_curves(variants) result(curves)
    integer, intent(in) :: variants(:)
    type(slip_curves_t) :: curves(size(variants), 1)
    integer :: l

    do l = 1, size(variants)
      curves(l, 1)%slip = [0.0_wp, 0.3_wp, 1.0_wp]
      curves(l, 1)%mean = [0.0_wp, 20.0_wp, 12.0_wp + variants(l)]
      curves(l, 1)%pulsation = [0.0_wp, 5.0_wp + variants(l), 9.0_wp]
    end do
  end function slip_curves

  !> Set speeds that rise from 0.05 s on.
  subroutine set_courses(variants, governor)
    integer, intent(in) :: variants(:)
    type(governor_t), intent(inout) :: governor
    integer :: l

    allocate (governor%course(size(variants), 1))   ! gfortran 12: `source` copies the pointers to allocatable components
    do l = 1, size(variants)
      call join_points([0.05_wp, 0.5_wp, 4.0_wp], [0.5_wp, 1.0_wp + 0.03_wp * variants(l), -1.0_wp], governor%course(l, 1))
    end do
  end subroutine set_courses

  !> Two harmonics of a motor.
  function ripple(variants) result(harmonics)
    integer, intent(in) :: variants(:)
    type(torque_harmonics_t) :: harmonics

    associate (one => reshape(lane_values(1.0_wp, variants, 2), [size(variants), 1, 2]))
      harmonics%order = 0.0_wp * one
      harmonics%order(:, 1, 1) = 2.0_wp
      harmonics%order(:, 1, 2) = 6.0_wp
      harmonics%share = 0.1_wp * one
      harmonics%torque = 0.5_wp * one
      harmonics%phase = 0.3_wp * one
    end associate
  end function ripple

  !> A part of the voltage within a ramp, then disconnected, then another ramp.
  function supply(variants) result(schedule)
    integer, intent(in) :: variants(:)
    type(schedule_t) :: schedule(size(variants), 1)
    integer :: l

    do l = 1, size(variants)
      associate (factor => 1.0_wp + 0.03_wp * variants(l))
        call schedule(l, 1)%append(0.05_wp, 0.0_wp, 0.0_wp, .true.)
        call schedule(l, 1)%append(0.05_wp * factor, 0.1_wp * factor, factor, .false.)
        call schedule(l, 1)%append(0.4_wp * factor, 0.0_wp, 0.0_wp, .true.)
        call schedule(l, 1)%append(0.5_wp * factor, factor, 0.2_wp * factor, .false.)
        call schedule(l, 1)%append(4.0_wp, 1.7_wp * factor, 0.0_wp, .false.)
      end associate
    end do
  end function supply

  !> The circuit of one induction motor, with inductances that are given partly as reactances, [lanes, 1, keys].
  function circuits(variants)
    integer, intent(in) :: variants(:)
    real(wp) :: circuits(size(variants), 1, size(circuit_keys))
    real(wp), parameter :: typical(size(circuit_keys)) = [30.0_wp, 12.0_wp, 0.4_wp, 0.5_wp, 0.05_wp, 0.0_wp, 0.8_wp, &
                                                          0.0_wp, 0.6_wp, 0.0_wp]
    integer :: k

    do k = 1, size(circuit_keys)
      circuits(:, :, k) = lane_values(typical(k), variants, 1)
    end do
  end function circuits

  subroutine add_loads(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine

    associate (one => lane_values(1.0_wp, variants, 2))
      call append_bank(machine%banks, &
                       new_nonlinear_loads(numbered_names('fan', 2), [1, bodies], one, 0.5_wp * one, &
                                           5.0_wp * one, 0.7_wp * one))
      call append_bank(machine%banks, &
                       new_nonlinear_loads(numbered_names('mill', 2), [2, 2], one, 0.5_wp * one, 0.0_wp * one, one, &
                                           curves([-2.0_wp, 0.0_wp, 2.5_wp], [-10.0_wp, 0.0_wp, 30.0_wp], interpolation_cubic, &
                                                  extrapolation_constant, variants, 2)))
    end associate
  end subroutine add_loads

  subroutine add_excitations(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(fault_terms_t) :: faults(2)

    call set_fault(faults(1))
    call set_fault(faults(2))
    call append_bank(machine%banks, new_order_excitations(numbered_names('cylinder', 2), [1, bodies], cylinders(variants)))
    call add_shares(bodies, variants, machine)
    associate (one => lane_values(1.0_wp, variants, 3))
      call append_bank(machine%banks, &
                       new_wave_excitations(numbered_names('gas', 2), [1, bodies], [1, 1, 2], 9.0_wp * one, &
                                            spread([0.0_wp, 0.0_wp, 3.0_wp], 1, size(variants)), &
                                            spread([0.5_wp, 1.0_wp, -2.0_wp], 1, size(variants)), 0.4_wp * one))
      call append_bank(machine%banks, &
                       new_timed_excitations(numbered_names('impact', 3), [1, 2, bodies], &
                                             [shape_step, shape_ramp, shape_pulse], 12.0_wp * one, &
                                             0.35_wp * one, 0.2_wp * one))
      call append_bank(machine%banks, new_fault_excitations(numbered_names('fault', 2), [1, bodies], &
                                                            faults, 0.3_wp * one(:, :2)))
      select type (bank => machine%banks(size(machine%banks))%bank)
      class is (excitation_bank_t)
        call bank%set_window(0.4_wp * one(:, :2), 0.9_wp * one(:, :2), 2.0_wp * one(:, :2))
      class default
        error stop 'full_machine: a fault is an excitation'
      end select
      call append_bank(machine%banks, &
                       new_table_excitations(numbered_names('record', 1), [2], &
                                             curves([0.1_wp, 0.3_wp, 0.6_wp], [0.0_wp, 20.0_wp, -10.0_wp], interpolation_linear, &
                                                    extrapolation_constant, variants, 1)))
    end associate
  end subroutine add_excitations

  !> A constant and two sines that decay.
  subroutine set_fault(terms)
    type(fault_terms_t), intent(out) :: terms

    terms%frequency = 5.0_wp
    terms%amplitude = [3.0_wp, -2.0_wp, 1.0_wp]
    terms%multiple = [1.0_wp, 2.0_wp, 0.0_wp]
    terms%rate = [3.0_wp, 5.0_wp, 1.0_wp]
    terms%phase = [0.1_wp, 0.2_wp, 1.5_wp]
  end subroutine set_fault

  !> Two cylinders, of which one follows the speed at more points, [lanes, cylinders].
  function cylinders(variants) result(torque)
    integer, intent(in) :: variants(:)
    type(order_torque_t), allocatable :: torque(:, :)
    integer :: c, l

    allocate (torque(size(variants), 2))
    do c = 1, 2
      do l = 1, size(variants)
        associate (one => torque(l, c), factor => 1.0_wp + 0.03_wp * variants(l))
          one%order = [0.5_wp, 1.0_wp, 2.25_wp]
          one%speed = [-1.0_wp, 0.5_wp, 2.0_wp] * factor
          if (c == 2) one%speed = one%speed(:2)
          one%mean = [5.0_wp, 7.0_wp, 4.0_wp]
          one%mean = one%mean(:size(one%speed)) * factor
          one%sine = spread(one%mean, 1, 3)
          one%cosine = -0.5_wp * one%sine
          one%square_order = [1.0_wp, 2.0_wp]
          one%square_sine = [0.2_wp, -0.5_wp] * factor
          one%square_cosine = [0.1_wp, 0.0_wp]
        end associate
      end do
    end do
  end function cylinders

  subroutine add_shares(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(shared_load_t) :: load

    associate (one => lane_values(1.0_wp, variants, 2))
      load%viscous = 2.0_wp * one
      load%quadratic = 0.5_wp * one
      load%constant = one
      load%constant_speed = 0.7_wp * one
      call append_bank(machine%banks, new_load_shares(numbered_names('blades', 2), [bodies, 1], [1, 2], 0.1_wp * one, &
                                                      5.0_wp * one, one, load))
    end associate
  end subroutine add_shares

end module nocdyn_test_full_machines
