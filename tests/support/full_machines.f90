!> Machines with elements of every kind, for the tests that compare formulations, Jacobians and lanes.
module nocdyn_test_full_machines
  use nocdyn_bank, only: append_bank
  use nocdyn_couplings, only: coupling_common_t, couplings_t, new_couplings
  use nocdyn_curves, only: curve_t, extrapolation_constant, extrapolation_linear, interpolation_cubic, interpolation_linear, &
                           new_curve
  use nocdyn_dc_motors, only: new_dc_motors
  use nocdyn_double_cage_motors, only: new_double_cage_motors
  use nocdyn_element_rows, only: element_rows_t, new_element_rows
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_external_excitations, only: external_excitations_t, new_external_excitations
  use nocdyn_fault_excitations, only: fault_terms_t, new_fault_excitations
  use nocdyn_flux_motors, only: new_flux_motors
  use nocdyn_gap_couplings, only: gap_couplings_t, new_gap_couplings
  use nocdyn_inverter_motors, only: new_inverter_motors
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_motors, only: new_induction_motors, new_motors, new_table_motors
  use nocdyn_load_shares, only: new_load_shares
  use nocdyn_loads, only: new_loads
  use nocdyn_order_excitations, only: new_order_excitations, order_torque_t
  use nocdyn_phases, only: new_phases, phases_t
  use nocdyn_polynomial_couplings, only: new_polynomial_couplings, polynomial_couplings_t
  use nocdyn_saturated_couplings, only: new_saturated_couplings
  use nocdyn_synchronous_motors, only: new_synchronous_motors
  use nocdyn_table_couplings, only: new_table_couplings
  use nocdyn_table_excitations, only: new_table_excitations
  use nocdyn_test_given_keys, only: given_keys_t, keys
  use nocdyn_test_machines, only: finish, numbered_names
  use nocdyn_test_random, only: random_stream, random_stream_t
  use nocdyn_test_random_machines, only: random_machine
  use nocdyn_timed_excitations, only: new_timed_excitations, shape_pulse, shape_ramp, shape_step
  use nocdyn_wave_excitations, only: new_wave_excitations
  implicit none (type, external)
  private

  public :: full_machine

  character(len=*), parameter :: governor = 'governor_speed governor_gain governor_time governor_start'
  real(wp), parameter :: of_governor(4) = [1.0_wp, 0.3_wp, 0.4_wp, 0.5_wp]

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

  !> Elements whose keys have the same number for every element, a little different in every lane.
  function lane_keys(stem, body, variants, words, values, ends) result(given)
    character(len=*), intent(in) :: stem   !! of the names
    integer, intent(in) :: body(:)         !! as in `keys`
    integer, intent(in) :: variants(:)
    character(len=*), intent(in) :: words  !! keys
    real(wp), intent(in) :: values(:)      !! [keys]
    integer, intent(in), optional :: ends  !! bodies of each element; absent: 1
    type(given_keys_t) :: given
    integer :: e, elements, k

    elements = size(body)
    if (present(ends)) elements = size(body) / ends
    given = keys(numbered_names(stem, elements), body, words, &
                 [((values(k) * (1.0_wp + 0.03_wp * variants), e=1, elements), k=1, size(values))], size(variants))
  end function lane_keys

  !> Numbers that are a little different in every lane, [numbers, lanes].
  pure function all_lanes(numbers, variants)
    real(wp), intent(in) :: numbers(:)
    integer, intent(in) :: variants(:)
    real(wp) :: all_lanes(size(numbers), size(variants))

    all_lanes = spread(numbers, 2, size(variants)) * spread(1.0_wp + 0.03_wp * variants, 1, size(numbers))
  end function all_lanes

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
    real(wp), parameter :: coefficients(5) = [50.0_wp, 25.0_wp, 50.0_wp / 3.0_wp, 12.5_wp, 10.0_wp]
    type(given_keys_t) :: given

    given = lane_keys('polynomial', [0, 1, 1, bodies], variants, 'damping rest_twist friction friction_speed', &
                      [1.0_wp, 0.1_wp, 4.0_wp, 0.5_wp], 2)
    call given%add_list('polynomial', all_lanes(coefficients, variants))
    call append_bank(machine%banks, new_polynomial_couplings(given))
    given = lane_keys('gap', [bodies, 0, 1, 2], variants, 'damping rest_twist gap', [4.0_wp, 0.1_wp, 0.3_wp], 2)
    call given%add_list('polynomial', all_lanes(coefficients, variants))
    call append_bank(machine%banks, new_gap_couplings(given))
    call append_bank(machine%banks, new_saturated_couplings(lane_keys('clutch', [1, 2, 2, 0], variants, &
                                    'rest_twist friction friction_speed stiffness saturation', &
                                    [0.1_wp, 4.0_wp, 0.5_wp, 80.0_wp, 20.0_wp], 2)))
    given = lane_keys('rubber', [0, 1, 2, 2], variants, 'damping rest_twist', [1.0_wp, 0.1_wp], 2)
    call given%add_table('table_twist', curves(twist, moment, interpolation_cubic, extrapolation_linear, variants, 2))
    call append_bank(machine%banks, new_table_couplings(given))
  end subroutine add_couplings

  !> Couplings along random rows of several bodies and the ground, smooth ones and ones with a gap.
  subroutine add_rows(seed, bodies, variants, machine)
    integer, intent(in) :: seed, bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(coupling_common_t) :: shared
    type(element_rows_t) :: rows
    type(given_keys_t) :: given
    type(random_stream_t) :: numbers
    integer :: b
    integer, parameter :: no_bodies(6) = 0   ! of the keys

    numbers = random_stream(7 * seed)
    rows = new_element_rows([1, bodies + 1, bodies + 4, bodies + 6], [(b, b=1, bodies), 1, 0, bodies, 2, 1], &
                            [(numbers%number(-1.5_wp, 1.5_wp), b=1, bodies + 5)])
    given = lane_keys('mesh', no_bodies, variants, 'damping rest_twist stiffness cubic_stiffness', &
                      [0.8_wp, 0.1_wp, 40.0_wp, 6.0_wp], 2)
    shared = coupling_common_t(given)
    shared%rows = rows
    call append_bank(machine%banks, new_couplings(given, shared))
    given = lane_keys('play', no_bodies, variants, 'damping stiffness gap', [0.5_wp, 30.0_wp, 0.2_wp], 2)
    shared = coupling_common_t(given)
    shared%rows = rows
    call append_bank(machine%banks, new_gap_couplings(given, shared))
  end subroutine add_rows

  !> Meshes with transmission errors, one with and one without a gap, each followed by its phase.
  subroutine add_meshes(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(coupling_common_t) :: shared
    type(given_keys_t) :: given
    type(gap_couplings_t) :: rattling
    type(polynomial_couplings_t) :: tight

    given = lane_keys('teeth', [2, bodies], variants, 'damping friction friction_speed stiffness', &
                      [0.6_wp, 1.0_wp, 0.4_wp, 35.0_wp], 2)
    shared = coupling_common_t(given)
    shared%rows = new_element_rows([1, 3], [2, bodies], [0.7_wp, 1.1_wp])
    allocate (shared%error)
    shared%error%order = [1.0_wp, 2.5_wp]
    shared%error%amplitude = [0.2_wp, 0.07_wp]
    shared%error%phase = [0.3_wp, -1.0_wp]
    tight = new_polynomial_couplings(given, shared)
    call append_bank(machine%banks, tight)
    call append_bank(machine%banks, phase_of(tight))
    given = lane_keys('rattle', [bodies, 1], variants, 'stiffness gap', [35.0_wp, 0.2_wp], 2)
    shared%names = given%names
    shared%rows = new_element_rows([1, 3], [bodies, 1], [0.9_wp, -1.3_wp])
    rattling = new_gap_couplings(given, shared)
    call append_bank(machine%banks, rattling)
    call append_bank(machine%banks, phase_of(rattling))
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
    character(len=*), parameter :: circuit = 'voltage resistance flux_constant inductance'
    real(wp), parameter :: of_circuit(4) = [24.0_wp, 2.0_wp, 1.5_wp, 0.5_wp]
    type(given_keys_t) :: given
    type(curve_t), allocatable :: table(:, :)

    call append_bank(machine%banks, new_induction_motors(lane_keys('induction', [1], variants, &
                                    'breakdown_torque breakdown_slip synchronous_speed', [60.0_wp, 0.3_wp, 10.0_wp])))
    given = lane_keys('table', [bodies], variants, '', [real(wp) ::])
    call given%add_table('table_speed', curves([-4.0_wp, 0.0_wp, 1.0_wp, 4.0_wp], [50.0_wp, 60.0_wp, 40.0_wp, -30.0_wp], &
                                               interpolation_linear, extrapolation_linear, variants, 1))
    call append_bank(machine%banks, new_table_motors(given))
    table = given%curve
    call append_bank(machine%banks, new_motors(lane_keys('governed', [2], variants, 'a b c flux_constant ' // governor, &
                                                         [30.0_wp, 3.0_wp, 0.1_wp, 1.4_wp, of_governor])))
    given = lane_keys('throttled', [1], variants, governor, of_governor)
    call given%add_table('table_speed', table)
    call append_bank(machine%banks, new_table_motors(given))
    call append_bank(machine%banks, new_dc_motors(lane_keys('dc', [2], variants, circuit, of_circuit)))
    call append_bank(machine%banks, new_dc_motors(lane_keys('drive', [bodies], variants, circuit // ' ' // governor, &
                                                            [of_circuit, of_governor])))
    call add_three_phase_motors(bodies, variants, machine)
  end subroutine add_motors

  !> Motors on mains and inverters.
  subroutine add_three_phase_motors(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    character(len=*), parameter :: circuit = &   ! inductances are given partly as reactances
      'voltage frequency stator_resistance rotor_resistance stator_leakage rotor_reactance mutual_inductance'
    character(len=*), parameter :: outer = ' outer_resistance outer_reactance'
    real(wp), parameter :: of_circuit(7) = [30.0_wp, 12.0_wp, 0.4_wp, 0.5_wp, 0.05_wp, 0.6_wp, 0.8_wp]
    type(given_keys_t) :: given

    given = lane_keys('starting', [1], variants, 'frequency phase', [4.0_wp, 0.3_wp])
    call given%add_list('poles', [4.0_wp])
    call given%add_list('slips', [0.0_wp, 0.3_wp, 1.0_wp])
    call given%add_list('mean_torques', all_lanes([0.0_wp, 20.0_wp, 12.0_wp], variants))
    call given%add_list('pulsations', all_lanes([0.0_wp, 5.0_wp, 9.0_wp], variants))
    call append_bank(machine%banks, new_synchronous_motors(given))
    given = lane_keys('inverter', [bodies], variants, 'torque_limit ' // governor, [20.0_wp, of_governor])
    call given%add_list('poles', [2.0_wp])
    call given%add_list('set_times', [0.05_wp, 0.5_wp, 4.0_wp])
    call given%add_list('set_speeds', all_lanes([0.5_wp, 1.0_wp, -1.0_wp], variants))
    call given%add_list('harmonics', [2.0_wp, 6.0_wp])
    call given%add_list('harmonic_shares', all_lanes([0.1_wp, 0.1_wp], variants))
    call given%add_list('harmonic_torques', all_lanes([0.5_wp, 0.5_wp], variants))
    call given%add_list('harmonic_phases', all_lanes([0.3_wp, 0.3_wp], variants))
    call append_bank(machine%banks, new_inverter_motors(given))
    given = lane_keys('fluxes', [bodies], variants, circuit, of_circuit)
    call given%add_list('poles', [4.0_wp])
    call given%add_list('reversed', [1.0_wp])
    call append_bank(machine%banks, new_flux_motors(given))
    given = lane_keys('supplied', [1], variants, circuit, of_circuit)
    call given%add_list('poles', [2.0_wp])
    call given%add_list('supply_times', all_lanes([0.05_wp, 0.4_wp, 0.5_wp], variants))
    call given%add_list('supply_factors', all_lanes([0.6_wp, 0.0_wp, 1.7_wp], variants))
    call given%add_list('supply_ramps', all_lanes([0.2_wp, 0.0_wp, 3.0_wp], variants))
    call append_bank(machine%banks, new_flux_motors(given))
    given = lane_keys('cages', [bodies], variants, circuit // outer, [of_circuit, 1.5_wp, 0.4_wp])
    call given%add_list('poles', [4.0_wp])
    call append_bank(machine%banks, new_double_cage_motors(given))
    given = lane_keys('supplied cages', [1], variants, circuit // outer, [of_circuit, 1.5_wp, 0.4_wp])
    call given%add_list('poles', [2.0_wp])
    call given%add_list('supply_times', all_lanes([0.05_wp, 0.4_wp, 0.5_wp], variants))
    call given%add_list('supply_factors', all_lanes([0.6_wp, 0.0_wp, 1.7_wp], variants))
    call given%add_list('supply_ramps', all_lanes([0.2_wp, 0.0_wp, 3.0_wp], variants))
    call append_bank(machine%banks, new_double_cage_motors(given))
  end subroutine add_three_phase_motors

  subroutine add_loads(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(given_keys_t) :: given

    call append_bank(machine%banks, new_loads(lane_keys('fan', [1, bodies], variants, &
                                    'viscous quadratic constant constant_speed', [1.0_wp, 0.5_wp, 5.0_wp, 0.7_wp])))
    call append_bank(machine%banks, new_loads(lane_keys('screw', [2, bodies], variants, &
                                    'viscous quadratic vibration_factor mean_time', [1.0_wp, 0.5_wp, 4.0_wp, 0.2_wp])))
    given = lane_keys('mill', [2, 2], variants, 'viscous quadratic constant_speed', [1.0_wp, 0.5_wp, 1.0_wp])
    call given%add_table('table_speed', curves([-2.0_wp, 0.0_wp, 2.5_wp], [-10.0_wp, 0.0_wp, 30.0_wp], interpolation_cubic, &
                                               extrapolation_constant, variants, 2))
    call append_bank(machine%banks, new_loads(given))
  end subroutine add_loads

  subroutine add_excitations(bodies, variants, machine)
    integer, intent(in) :: bodies, variants(:)
    type(machine_t), intent(inout) :: machine
    type(fault_terms_t) :: faults(2)
    type(given_keys_t) :: given

    call set_fault(faults(1))
    call set_fault(faults(2))
    call append_bank(machine%banks, new_order_excitations(numbered_names('cylinder', 2), [1, bodies], cylinders(variants)))
    call add_shares(bodies, variants, machine)
    associate (one => lane_values(1.0_wp, variants, 3))
      call append_bank(machine%banks, &
                       new_wave_excitations(lane_keys('gas', [1, bodies], variants, '', [real(wp) ::]), [1, 1, 2], 9.0_wp * one, &
                                            spread([0.0_wp, 0.0_wp, 3.0_wp], 1, size(variants)), &
                                            spread([0.5_wp, 1.0_wp, -2.0_wp], 1, size(variants)), 0.4_wp * one))
    end associate
    call append_bank(machine%banks, new_timed_excitations(lane_keys('impact', [1, 2, bodies], variants, &
                                                                    'amplitude time duration', [12.0_wp, 0.35_wp, 0.2_wp]), &
                                                          [shape_step, shape_ramp, shape_pulse]))
    given = lane_keys('fault', [1, bodies], variants, 'time start end decay', [0.3_wp, 0.4_wp, 0.9_wp, 0.5_wp])
    call append_bank(machine%banks, new_fault_excitations(given, faults))
    select type (bank => machine%banks(size(machine%banks))%bank)
    class is (excitation_bank_t)
      call bank%set_window(given, 1)
    class default
      error stop 'full_machine: a fault is an excitation'
    end select
    given = lane_keys('record', [2], variants, '', [real(wp) ::])
    call given%add_table('table_time', curves([0.1_wp, 0.3_wp, 0.6_wp], [0.0_wp, 20.0_wp, -10.0_wp], interpolation_linear, &
                                              extrapolation_constant, variants, 1))
    call append_bank(machine%banks, new_table_excitations(given))
    call append_bank(machine%banks, new_external_excitations(lane_keys('outside', [1, bodies], variants, 'amplitude', [3.0_wp])))
    select type (bank => machine%banks(size(machine%banks))%bank)
    class is (external_excitations_t)
      call bank%set_torque(2, 3.0_wp, -7.0_wp, 0.1_wp)
    class default
      error stop 'full_machine: these torques come from outside'
    end select
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
    type(given_keys_t) :: blades

    blades = lane_keys('blades', [bodies, 1], variants, '', [real(wp) ::])
    call blades%add_list('share_of_load', all_lanes([0.1_wp], variants))
    call blades%add_list('orders', all_lanes([5.0_wp], variants))
    call blades%add_list('phases', all_lanes([1.0_wp], variants))
    call append_bank(machine%banks, new_load_shares(blades, lane_keys('water', [bodies, 1], variants, &
                                    'viscous quadratic constant constant_speed', [2.0_wp, 0.5_wp, 1.0_wp, 0.7_wp])))
  end subroutine add_shares

end module nocdyn_test_full_machines
