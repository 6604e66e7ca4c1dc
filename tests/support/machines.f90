!> Machines for tests: polymorphic, although of one type, for a compiler then copies and frees them by calls instead of tens of
!> kilobytes of code for each.
module nocdyn_test_machines
  use nocdyn_bank, only: append_bank, bank_slot_t, bank_t
  use nocdyn_cardan_rows, only: new_cardan_rows
  use nocdyn_constraint_analysis, only: analyse_constraints
  use nocdyn_constraints, only: constraints_t, new_constraints
  use nocdyn_coordinates, only: build_coordinates
  use nocdyn_couplings, only: new_couplings
  use nocdyn_crank_rows, only: new_crank_rows, slider_crank_t
  use nocdyn_curves, only: extrapolation_constant, interpolation_linear, new_curve
  use nocdyn_drives, only: new_drives
  use nocdyn_errors, only: error_t
  use nocdyn_excitations, only: new_excitations
  use nocdyn_kinds, only: wp
  use nocdyn_loads, only: new_loads
  use nocdyn_machine, only: machine_t
  use nocdyn_motors, only: new_motors
  use nocdyn_phases, only: new_phases
  use nocdyn_piston_forces, only: new_piston_force, periodic_force_t
  use nocdyn_relation_rows, only: new_relation_rows
  use nocdyn_splines, only: spline_smooth
  use nocdyn_test_given_keys, only: given_keys_t, keys
  use nocdyn_text, only: string_t, strings, to_text
  use nocdyn_tooth_losses, only: new_tooth_losses, teeth_t
  implicit none (type, external)
  private

  public :: paper_machine, damped_chain, long_chain, branched_train, gear_loop, moving_machine, machine_of_bodies
  public :: install, gear_rows, numbered_names, finish, row

  character(len=*), parameter :: coupling = 'damping rest_twist stiffness cubic_stiffness'   ! keys

contains

  !> The machine of the paper's section 7.
  function paper_machine(amplitude, choice) result(machine)
    real(wp), intent(in) :: amplitude   !! M_0 [N m]: 0 in case 1, which has no excitation, 20 in case 2
    integer, intent(in) :: choice       !! complement_...
    class(machine_t), allocatable :: machine

    machine = machine_of_bodies(row([10.0_wp, 5.0_wp, 5.0_wp]))
    machine%names = strings([character(len=7) :: 'motor', 'pinion', 'machine'])
    call install(machine%banks, new_couplings(keys(strings(['coupling']), [1, 2], coupling, &
                                                   [0.0_wp, 0.0_wp, 100.0_wp, 10.0_wp])))
    call install(machine%banks, new_motors(keys(strings(['drive']), [1], 'a b c', [200.0_wp, 10.0_wp, 1.0_wp])))
    call install(machine%banks, new_loads(keys(strings(['work']), [3], 'viscous', [100.0_wp])))
    if (abs(amplitude) > 0.0_wp) then
      call install(machine%banks, new_excitations(keys(strings(['shaker']), [1], 'amplitude frequency', [amplitude, 5.0_wp])))
    end if
    machine%constraints = gear_rows(3, reshape([2, 3], [2, 1]), row([2.0_wp, 3.0_wp]))
    machine%constraints%names(1)%text = 'reducer'
    call finish(machine, [1, 2], choice)
  end function paper_machine

  !> Four bodies without gears between two walls: damping, rest twists, softening and hardening springs, phases.
  function damped_chain() result(machine)
    class(machine_t), allocatable :: machine

    machine = machine_of_bodies(row([4.0_wp, 2.0_wp, 1.0_wp, 3.0_wp]))
    call install(machine%banks, new_couplings(keys(numbered_names('spring', 5), [0, 1, 2, 3, 4, 1, 2, 3, 4, 0], coupling, &
                                                   [0.7_wp, 3.0_wp, 0.0_wp, 1.5_wp, 0.0_wp, &
                                                    0.3_wp, 0.2_wp, 0.0_wp, -0.1_wp, 0.4_wp, &
                                                    30.0_wp, 100.0_wp, 80.0_wp, 50.0_wp, 20.0_wp, &
                                                    5.0_wp, 10.0_wp, -4.0_wp, 0.0_wp, 0.0_wp])))
    call install(machine%banks, new_motors(keys(numbered_names('motor', 1), [1], 'a b c', [90.0_wp, 6.0_wp, 0.5_wp])))
    call install(machine%banks, new_loads(keys(numbered_names('load', 1), [3], 'viscous', [12.0_wp])))
    call install(machine%banks, new_excitations(keys(numbered_names('shaker', 2), [2, 4], 'amplitude frequency phase', &
                                                     [8.0_wp, 5.0_wp, 3.0_wp, 7.0_wp, 0.5_wp, -1.0_wp])))
    machine%start_angle = row([0.1_wp, -0.2_wp, 0.3_wp, 0.05_wp])
    machine%start_speed = row([1.0_wp, 0.5_wp, -0.4_wp, 2.0_wp])
    call finish(machine, [integer ::], 1)
  end function damped_chain

  !> Rotors of 1 kg m2 in a row, driven at the first one and braked at the last one.
  function long_chain(bodies) result(machine)
    integer, intent(in) :: bodies
    class(machine_t), allocatable :: machine
    integer :: i

    machine = machine_of_bodies(row([(1.0_wp, i=1, bodies)]))
    call install(machine%banks, new_couplings(keys(numbered_names('shaft', bodies - 1), &
                                                   [(i, i=1, bodies - 1), (i + 1, i=1, bodies - 1)], coupling, &
                                                   [1.0_wp, 0.0_wp, 1.0e4_wp, 1.0e5_wp])))
    call install(machine%banks, new_motors(keys(numbered_names('motor', 1), [1], 'a', [100.0_wp])))
    call install(machine%banks, new_loads(keys(numbered_names('load', 1), [bodies], 'viscous', [10.0_wp])))
    call finish(machine, [integer ::], 1)
  end function long_chain

  !> Seven bodies: body 2 drives 1, 3 (an internal gear) and 4; 5 drives 6; 7 is free. The couplings form a loop.
  function branched_train(choice) result(machine)
    integer, intent(in) :: choice   !! complement_...
    class(machine_t), allocatable :: machine

    machine = machine_of_bodies(row([4.0_wp, 2.0_wp, 6.0_wp, 1.0_wp, 3.0_wp, 2.5_wp, 8.0_wp]))
    call install(machine%banks, new_couplings(keys(numbered_names('shaft', 4), [4, 3, 6, 0, 5, 5, 7, 7], coupling, &
                                                   [0.5_wp, 0.0_wp, 1.0_wp, 0.2_wp, &
                                                    0.0_wp, 0.1_wp, -0.2_wp, 0.0_wp, &
                                                    60.0_wp, 40.0_wp, 90.0_wp, 10.0_wp, &
                                                    4.0_wp, 0.0_wp, 7.0_wp, 0.0_wp])))
    call install(machine%banks, new_motors(keys(numbered_names('motor', 1), [1], 'a b c', [150.0_wp, 8.0_wp, 0.3_wp])))
    call install(machine%banks, new_loads(keys(numbered_names('load', 2), [3, 7], 'viscous', [5.0_wp, 20.0_wp])))
    machine%constraints = gear_rows(7, reshape([1, 2, 2, 3, 2, 4, 5, 6], [2, 4]), &
                                    row([2.0_wp, 3.0_wp, 1.5_wp, -4.0_wp, 1.0_wp, 2.5_wp, 1.0_wp, 1.25_wp]))
    call finish(machine, [integer ::], choice)
  end function branched_train

  !> Four wheels in a ring, whose last gear is redundant, and a fifth body on a coupling.
  function gear_loop() result(machine)
    class(machine_t), allocatable :: machine

    machine = machine_of_bodies(row([4.0_wp, 2.0_wp, 6.0_wp, 1.0_wp, 3.0_wp]))
    call install(machine%banks, new_couplings(keys(numbered_names('shaft', 1), [3, 5], coupling, &
                                                   [0.5_wp, 0.0_wp, 60.0_wp, 4.0_wp])))
    call install(machine%banks, new_motors(keys(numbered_names('motor', 1), [1], 'a b c', [150.0_wp, 8.0_wp, 0.3_wp])))
    call install(machine%banks, new_loads(keys(numbered_names('load', 2), [4, 5], 'viscous', [5.0_wp, 20.0_wp])))
    machine%constraints = gear_rows(5, reshape([1, 2, 2, 3, 3, 4, 4, 1], [2, 4]), &
                                    row([0.2_wp, 0.3_wp, 0.3_wp, 0.5_wp, 0.5_wp, 0.4_wp, 0.4_wp, 0.2_wp]))
    call finish(machine, [integer ::], 1)
  end function gear_loop

  !> Two geared bodies, of which the second drives the third by a cardan joint, that the fourth by a cam, and both a slider-crank
  !> with a heavy rod and a force on the piston; an elastic coupling to the fifth, which a drive moves.
  function moving_machine() result(machine)
    class(machine_t), allocatable :: machine
    type(string_t) :: names(4)
    type(given_keys_t) :: given
    type(teeth_t) :: teeth
    integer :: k

    machine = machine_of_bodies(row([4.0_wp, 2.0_wp, 6.0_wp, 1.0_wp, 3.0_wp]))
    call machine%add_nodes(numbered_names('part', 4), [1.5_wp, 0.8_wp, 0.8_wp, 0.1_wp])
    machine%nodes = 0
    call install(machine%banks, new_couplings(keys(numbered_names('shaft', 1), [4, 5], coupling, &
                                                   [0.5_wp, 0.0_wp, 60.0_wp, 4.0_wp])))
    call install(machine%banks, new_motors(keys(numbered_names('motor', 1), [1], 'a b c', [150.0_wp, 8.0_wp, 0.3_wp])))
    call append_bank(machine%banks, new_cardan_rows(keys(numbered_names('cardan', 1), [2, 3], 'angle phase', [0.4_wp, 0.3_wp])))
    call append_bank(machine%banks, new_phases(1, numbered_names('cardan', 1), [2]))
    given = keys(numbered_names('cam', 1), [3, 4], '', [real(wp) ::])
    call given%add_list('table_angle', [0.0_wp, 1.0_wp, 3.0_wp, 5.0_wp, 6.0_wp])
    call given%add_list('table_driven', [0.0_wp, 0.8_wp, 0.3_wp, -0.6_wp, 0.0_wp])
    call append_bank(machine%banks, new_relation_rows(given, [.true.], [spline_smooth]))
    call append_bank(machine%banks, new_phases(1, numbered_names('cam', 1), [3]))
    names = numbered_names('crank', 4)
    call append_bank(machine%banks, new_crank_rows(1, names, [6, 7, 8, 9], &
                                                   slider_crank_t(0.5_wp, 1.2_wp, 0.2_wp, 0.7_wp, 0.4_wp)))
    call append_bank(machine%banks, new_phases(1, names, [3, 3, 3, 3]))
    call append_bank(machine%banks, new_piston_force(1, names(1), 6, 0.7_wp, &
                                                     periodic_force_t(0.5_wp, 3.0_wp, [2.0_wp, 1.0_wp], [0.5_wp, -4.0_wp])))
    call append_bank(machine%banks, new_phases(1, names(:1), [3]))
    call append_bank(machine%banks, new_drives(keys(numbered_names('drive', 1), [5], 'speed speed_amplitude frequency phase', &
                                                    [2.0_wp, 3.0_wp, 1.7_wp, 0.4_wp]), .false.))
    machine%constraints = gear_rows(9, reshape([1, 2], [2, 1]), row([2.0_wp, 3.0_wp]))
    teeth%row = [1]
    teeth%factor = [2.0_wp]
    teeth%forward = row([1.0_wp])
    teeth%backward = row([1.0_wp])
    allocate (teeth%forward_over_speed, teeth%backward_over_speed)
    teeth%forward_over_speed = new_curve([0.0_wp, 9.0_wp], [0.7_wp, 0.9_wp], interpolation_linear, extrapolation_constant)
    teeth%backward_over_speed = new_curve([0.0_wp, 9.0_wp], [0.4_wp, 0.8_wp], interpolation_linear, extrapolation_constant)
    call append_bank(machine%banks, new_tooth_losses(numbered_names('gear', 1), [0], [1], teeth))
    machine%start_angle(1, 6:9) = [(0.3_wp * k, k=1, 4)]
    call finish(machine, [integer ::], 1)
  end function moving_machine

  !> Bodies at rest without elements and constraints.
  function machine_of_bodies(inertia) result(machine)
    real(wp), intent(in) :: inertia(:, :)   !! [lanes, bodies] [kg m2]
    class(machine_t), allocatable :: machine

    allocate (machine)
    machine%lanes = size(inertia, 1)
    machine%bodies = size(inertia, 2)
    allocate (machine%names, source=numbered_names('body', machine%bodies))
    machine%inertia = inertia
    allocate (machine%start_angle, machine%start_speed, source=0.0_wp * inertia)
    machine%banks = element_banks(machine%lanes)
    machine%constraints = gear_rows(machine%bodies, reshape([integer ::], [2, 0]), inertia(:, :0))
  end function machine_of_bodies

  !> One empty bank of each role, in the order of the roles.
  function element_banks(lanes) result(banks)
    integer, intent(in) :: lanes
    type(bank_slot_t), allocatable :: banks(:)
    type(string_t) :: names(0)

    allocate (banks(4))
    call install(banks, new_couplings(keys(names, [integer ::], '', [real(wp) ::], lanes)))
    call install(banks, new_motors(keys(names, [integer ::], '', [real(wp) ::], lanes)))
    call install(banks, new_loads(keys(names, [integer ::], '', [real(wp) ::], lanes)))
    call install(banks, new_excitations(keys(names, [integer ::], '', [real(wp) ::], lanes)))
  end function element_banks

  !> Replaces the bank of the same role.
  subroutine install(banks, bank)
    type(bank_slot_t), intent(inout) :: banks(:)
    class(bank_t), intent(in) :: bank

    associate (slot => banks(bank%role))
      if (allocated(slot%bank)) deallocate (slot%bank)
      allocate (slot%bank, source=bank)
    end associate
  end subroutine install

  !> Gears 'gear1', 'gear2' ... between two bodies each.
  function gear_rows(bodies, wheels, coefficients) result(constraints)
    integer, intent(in) :: bodies
    integer, intent(in) :: wheels(:, :)          !! [2, gears]
    real(wp), intent(in) :: coefficients(:, :)   !! radii [m], negative for the second of an internal gear, [lanes, 2 gears]
    type(constraints_t) :: constraints
    integer :: i

    associate (gears => size(wheels, 2))
      constraints = new_constraints(bodies, numbered_names('gear', gears), strings([('N', i=1, gears)]), &
                                    [(2 * i - 1, i=1, gears + 1)], reshape(wheels, [2 * gears]), coefficients)
    end associate
  end function gear_rows

  !> Numbers the elements and analyses the constraints, once all banks and rows are set.
  subroutine finish(machine, wanted, choice)
    type(machine_t), intent(inout) :: machine
    integer, intent(in) :: wanted(:)   !! bodies that become the coordinates; empty: they are found
    integer, intent(in) :: choice      !! complement_...
    type(error_t), allocatable :: error
    integer :: offending_row

    call machine%number_elements()
    call analyse_constraints(machine%constraints, machine%names, wanted, machine%trains, machine%groups, offending_row, error)
    if (allocated(error)) error stop 'nocdyn_test_machines: a machine for tests has gears that lock'
    call build_coordinates(machine%constraints, machine%names, machine%trains, machine%groups, machine%inertia, wanted, choice, &
                           machine%coordinates, error)
    if (allocated(error)) error stop 'nocdyn_test_machines: the ratios of a machine for tests are too large'
  end subroutine finish

  function numbered_names(stem, count) result(names)
    character(len=*), intent(in) :: stem
    integer, intent(in) :: count
    type(string_t) :: names(count)
    integer :: i

    do i = 1, count
      names(i)%text = stem // to_text(i)
    end do
  end function numbered_names

  !> The parameters of a single lane, [1, elements].
  pure function row(values)
    real(wp), intent(in) :: values(:)
    real(wp) :: row(1, size(values))

    row(1, :) = values
  end function row

end module nocdyn_test_machines
