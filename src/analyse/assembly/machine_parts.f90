!> From an input to a machine: bodies, banks, constraints and coordinates.
module nocdyn_machine_parts
  use nocdyn_complement, only: complement_names
  use nocdyn_constraint_analysis, only: analyse_constraints
  use nocdyn_constraint_assembly, only: assemble_constraints, constraint_groups
  use nocdyn_coordinates, only: build_coordinates
  use nocdyn_coupling_assembly, only: add_coupling_form, check_coupling, coupling_form
  use nocdyn_crank_assembly, only: add_cranks, check_crank
  use nocdyn_damper_values, only: check_damper
  use nocdyn_derived_values, only: add_rubber_laws, derive_values, has_derived_values
  use nocdyn_electrical_faults, only: check_fault
  use nocdyn_driven_speeds, only: find_driven_speeds, moves_with
  use nocdyn_element_groups, only: add_banks, bodies_of, body_index_t, element_groups_t, new_body_index, new_element_groups
  use nocdyn_engine_checks, only: check_engine, check_order_torques
  use nocdyn_errors, only: add_error, error_t, exit_input, raise
  use nocdyn_fatigue_groups, only: check_fatigue
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_joint_assembly, only: add_bearings, add_clutch_form, add_freewheels, check_clutch, clutch_form
  use nocdyn_joint_simplifications, only: list_simplifications
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: check_limit
  use nocdyn_loss_assembly, only: add_losses, check_loss
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_start, only: start_bodies
  use nocdyn_massless_motion, only: massless_bodies
  use nocdyn_mesh_assembly, only: add_mesh_form, check_mesh, mesh_form
  use nocdyn_motion_assembly, only: add_cardans, add_drive_form, add_relations, check_drive, check_relation, drive_form, &
    has_steady_speed, steady_speed
  use nocdyn_motor_assembly, only: add_motor_form, check_motor, motor_form
  use nocdyn_output_times, only: check_output_times
  use nocdyn_shaft_assembly, only: add_shafts, new_shaft_set, shaft_set_t
  use nocdyn_shaft_segments, only: check_shaft
  use nocdyn_steady_views, only: steady_view_t
  use nocdyn_text, only: append, joined, quoted, rounded_text, selected, to_text
  use nocdyn_torque_assembly, only: add_engines, add_excitation_form, add_load_form, add_steady_load_form, &
    excitation_form, load_form
  use nocdyn_units, only: from_si, unit_rpm
  use nocdyn_written_values, only: unit_of, written_key, written_number
  implicit none (type, external)
  private

  public :: build_machine, check_input, refuse_mistakes

  integer, parameter :: most_names = 12   ! in a message

contains

  !> Builds the machine of a checked input, at the start that the input gives. Errors are the ones of `assemble_machine`.
  subroutine build_machine(input, view, machine, error, lanes)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: lanes   !! 1 if absent
    type(input_t), allocatable :: derived

    if (has_derived_values(input)) then
      allocate (derived, source=input)
      call derive_values(derived)
      call build_parts(derived, view, machine, error, lanes)
    else
      call build_parts(input, view, machine, error, lanes)
    end if
    if (.not. allocated(error)) call add_rubber_laws(input, machine)
  end subroutine build_machine

  !> Builds the machine of an input whose values are complete.
  subroutine build_parts(input, view, machine, error, lanes)
    type(input_t), target, intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: lanes   !! 1 if absent
    type(body_index_t), target :: body_index
    type(shaft_set_t) :: shafts
    type(diagnostics_t) :: diagnostics
    integer :: i

    if (present(lanes)) machine%lanes = lanes
    call set_bodies(input, view, machine)
    body_index = new_body_index(machine%names)
    call assemble_constraints(input, view, body_index, machine%lanes, machine%constraints, error)
    call check_groups(input, diagnostics)
    call input%refuse(diagnostics, error)
    if (allocated(error)) return
    call add_elements(input, view, body_index, machine)
    call new_shaft_set(input, body_index, machine%constraints, shafts)
    call add_shafts(shafts, machine)
    do i = 1, size(shafts%notes)
      call append(machine%start_notes, shafts%notes(i)%text)
    end do
    call add_cranks(new_element_groups(input, 'crank', machine%lanes, body_index), view%is_steady, machine)
    call machine%number_elements()
    call analyse_machine_constraints(input, view, body_index, machine, error)
    if (allocated(error)) return
    call start_bodies(input, constraint_groups(input, view), view%is_steady, body_index, shafts, machine, error)
  end subroutine build_parts

  !> Adds all mistakes of `check_input` to an error or to none.
  subroutine refuse_mistakes(input, error, known)
    type(input_t), intent(in) :: input   !! of a machine or a load case
    type(error_t), allocatable, intent(inout) :: error
    type(diagnostics_t), intent(in), optional :: known   !! mistakes of the machine, which a load case does not repeat
    type(diagnostics_t) :: diagnostics

    call check_input(input, diagnostics)
    if (present(known)) then
      call input%refuse_new(diagnostics, known, error)
    else
      call input%refuse(diagnostics, error)
    end if
  end subroutine refuse_mistakes

  !> All mistakes of an input whose groups and keys are right, before anything is computed.
  subroutine check_input(input, diagnostics)
    type(input_t), intent(in) :: input   !! of a machine or a load case
    type(diagnostics_t), intent(inout) :: diagnostics

    call check_groups(input, diagnostics)
    call check_output_times(input, diagnostics)
  end subroutine check_input

  !> Refuses values that do not fit together, which the schema does not know.
  subroutine check_groups(input, diagnostics)
    type(input_t), intent(in) :: input
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: g

    do g = 1, size(input%groups)
      call check_group(input, g, diagnostics)
    end do
  end subroutine check_groups

  !> Refuses values of one group.
  subroutine check_group(input, g, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g   !! index of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    select case (input%groups(g)%kind)
    case ('coupling')
      call check_coupling(input, g, diagnostics)
    case ('damper')
      call check_damper(input, g, diagnostics)
    case ('shaft')
      call check_shaft(input, g, diagnostics)
    case ('mesh')
      call check_mesh(input, g, diagnostics)
      call check_loss(input, g, diagnostics)
    case ('gear', 'planetary')
      call check_loss(input, g, diagnostics)
    case ('clutch')
      if (input%groups(g)%text('kind') == 'friction') call check_clutch(input, g, diagnostics)
    case ('relation')
      call check_relation(input, g, diagnostics)
    case ('drive')
      call check_drive(input, g, diagnostics)
    case ('crank')
      call check_crank(input, g, diagnostics)
    case ('motor')
      call check_motor(input, g, diagnostics)
    case ('engine')
      call check_engine(input, g, diagnostics)
    case ('excitation')
      if (input%groups(g)%text('kind') == 'orders') call check_order_torques(input, g, diagnostics)
      if (input%groups(g)%text('kind') == 'fault') call check_fault(input, g, diagnostics)
    case ('limit')
      call check_limit(input, g, diagnostics)
    case ('response')
      ! refuses ranges that begin with the faster speed, or whose ends differ in direction
      associate (group => input%groups(g))
        call check_range(input, g, 'speed', group%numbers('speed'), diagnostics)
        call check_range(input, g, 'frequency', group%numbers('frequency'), diagnostics)
        call check_range(input, g, 'operating', group%numbers('operating'), diagnostics)
      end associate
    case ('fatigue')
      call check_fatigue(input, g, diagnostics)
    case ('run')
      if (input%groups(g)%has_value('start_speed') .and. input%groups(g)%text('start') /= 'equilibrium') then
        call input%report(g, 'start_speed', "start_speed is for start = 'equilibrium'; allowed: that, or the speeds of bodies", &
                          diagnostics)
      end if
    case default
    end select
  end subroutine check_group

  !> Adds the banks of all elements that join or turn bodies of the input.
  subroutine add_elements(input, view, body_index, machine)
    type(input_t), target, intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(body_index_t), target, intent(in) :: body_index
    type(machine_t), intent(inout) :: machine
    integer, allocatable :: rows(:)   ! groups of the constraint rows

    allocate (machine%banks(0))
    associate (n => machine%lanes)
      call add_banks(new_element_groups(input, 'coupling', n, body_index), coupling_form, add_coupling_form, machine%banks)
      call add_banks(new_element_groups(input, 'mesh', n, body_index), mesh_form, add_mesh_form, machine%banks)
      if (.not. (view%is_steady .and. view%locks_joints)) then
        call add_banks(new_element_groups(input, 'clutch', n, body_index), clutch_form, add_clutch_form, machine%banks)
        call add_freewheels(new_element_groups(input, 'freewheel', n, body_index), machine%banks)
      end if
      call add_bearings(new_element_groups(input, 'body', n, body_index), machine%banks)
      if (.not. view%is_steady) then
        call add_cardans(new_element_groups(input, 'cardan', n, body_index), machine%banks)
        call add_relations(new_element_groups(input, 'relation', n, body_index), machine%banks)
      end if
      allocate (rows, source=constraint_groups(input, view))
      call add_losses(new_element_groups(input, 'gear', n, body_index), rows, machine%banks)
      call add_losses(new_element_groups(input, 'planetary', n, body_index), rows, machine%banks)
      call add_losses(new_element_groups(input, 'mesh', n, body_index), rows, machine%banks)
      if (.not. view%is_steady) then
        call add_banks(new_element_groups(input, 'drive', n, body_index), drive_form, add_drive_form, machine%banks)
      end if
      call add_banks(new_element_groups(input, 'motor', n, body_index), motor_form, add_motor_form, machine%banks)
      if (view%is_steady) then
        call add_banks(new_element_groups(input, 'load', n, body_index), load_form, add_steady_load_form, machine%banks)
      else
        call add_banks(new_element_groups(input, 'load', n, body_index), load_form, add_load_form, machine%banks)
      end if
      call add_banks(new_element_groups(input, 'excitation', n, body_index), excitation_form, add_excitation_form, machine%banks)
      call add_engines(new_element_groups(input, 'engine', n, body_index), machine%inertia, view%is_steady, machine%banks)
    end associate
  end subroutine add_elements

  subroutine set_bodies(input, view, machine)
    type(input_t), target, intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(machine_t), intent(inout) :: machine
    type(element_groups_t) :: bodies

    bodies = new_element_groups(input, 'body', machine%lanes)
    machine%bodies = size(bodies%names)
    machine%names = bodies%names
    machine%inertia = bodies%values('inertia') * (1.0_wp + bodies%values('entrained'))
    machine%start_angle = bodies%values('angle')
    machine%start_speed = bodies%values('speed')
    allocate (machine%start_notes(0))
    call list_simplifications(input, view, machine%simplifications)
  end subroutine set_bodies

  !> Analyses the constraints and chooses the coordinates. A message begins with file, line and group: the ones of a constraint
  !> row, or of `independent`.
  subroutine analyse_machine_constraints(input, view, body_index, machine, error)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(body_index_t), intent(in) :: body_index
    type(machine_t), intent(inout) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: indices(:), wanted(:)   ! groups of the rows, bodies that are to be the coordinates
    integer :: offending_row

    associate (run => input%groups(input%position('run')))
      allocate (wanted, source=bodies_of(run, 'independent', body_index))
      call analyse_constraints(machine%constraints, machine%names, wanted, machine%trains, machine%groups, offending_row, error)
      if (.not. allocated(error)) then
        call refuse_massless_motion(input, machine, error)
        if (.not. allocated(error)) call turn_by_drives(input, view, body_index, machine, error)
        if (allocated(error)) return
        call build_coordinates(machine%constraints, machine%names, machine%trains, machine%groups, machine%inertia, wanted, &
                               findloc(complement_names == run%text('complement'), .true., dim=1), machine%coordinates, error)
      end if
    end associate
    if (.not. allocated(error)) return
    if (offending_row > 0) then
      allocate (indices, source=constraint_groups(input, view))
      error%message = input%location(indices(offending_row)) // ': ' // error%message
    else
      error%message = input%location(input%position('run'), 'independent') // ': independent ' // error%message
    end if
  end subroutine analyse_machine_constraints

  !> Finds the speeds that drives give the bodies in a steady state. Drives are refused that contradict each other, gears or
  !> elastic couplings, and drives whose speed changes where &response does not set it.
  subroutine turn_by_drives(input, view, body_index, machine, error)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    type(body_index_t), intent(in) :: body_index
    type(machine_t), intent(inout) :: machine   !! its rows are analysed
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: body(:), indices(:), responses(:)
    integer :: i, offending_row

    call find_driven_speeds(machine, offending_row)
    allocate (indices, source=constraint_groups(input, view))
    if (offending_row > 0) then
      associate (drive => input%groups(indices(offending_row)))
        call raise(error, exit_input, input%location(indices(offending_row)) // ': gears, elastic couplings or other drives ' // &
                   'do not let ' // quoted(drive%text('body')) // ' turn at ' // rounded_text(steady_speed(drive), 6) // &
                   ' rad/s for good: there is no steady state')
      end associate
      return
    end if
    allocate (responses, source=input%groups_named('response'))
    do i = 1, merge(size(indices), 0, view%sets_speed .and. size(responses) > 0)
      associate (group => input%groups(indices(i)))
        if (group%kind /= 'drive') cycle
        if (has_steady_speed(group, .false.)) cycle
        body = [bodies_of(group, 'body', body_index), bodies_of(input%groups(responses(1)), 'body', body_index)]
        if (all(moves_with(machine, body(1)) .eqv. moves_with(machine, body(2)))) cycle
        call raise(error, exit_input, input%location(indices(i)) // ': the speed of this drive changes, and ' // &
                   quoted(machine%names(body(2))%text) // ' of &response does not turn with it: there is no steady state; ' // &
                   'allowed: a drive of constant speed')
        return
      end associate
    end do
  end subroutine turn_by_drives

  !> Refuses bodies that can move while all bodies with inertia stand still: the reduced mass matrix is singular.
  subroutine refuse_massless_motion(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! its constraints are analysed
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: bodies(:), indices(:)

    allocate (bodies, source=massless_bodies(machine))
    if (size(bodies) == 0) return
    allocate (indices, source=input%groups_named('body'))
    call raise(error, exit_input, input%location(indices(bodies(1)), 'inertia') // ': inertia = 0: ' // &
               joined(selected(machine%names, bodies), ', ', most_names) // ' can turn while every body with an inertia ' // &
               'stands still; allowed: > 0 [kg m2], or 0 where a body with an inertia is geared to it')
  end subroutine refuse_massless_motion

  !> Two speeds are the lowest and the highest one, in the same direction. The ones of a response may be one.
  subroutine check_range(input, group, key, range, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: range(:)   !! [rad/s], or empty
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: text

    if (size(range) == 0) return
    if (size(range) == 1 .and. key /= 'operating') return
    if (size(range) > 2) then
      text = ' speeds; allowed: one, or the slowest and the fastest one'
      if (key == 'frequency') text = ' frequencies; allowed: one, or the lowest and the highest one'
      call input%report(group, key, to_text(size(range)) // text, diagnostics)
      return
    end if
    if (range(1) * range(2) > 0 .and. abs(range(1)) < abs(range(2))) return
    if (key /= 'operating' .and. .not. abs(range(1) - range(2)) > 0) return
    associate (written => input%groups(group))
      text = written_key(written, key) // ' = ' // written_number(written, key, range(1)) // ', ' // &
             written_number(written, key, range(2))
      if (key == 'frequency') then
        call input%report(group, key, text // '; allowed: first the lower frequency, then the higher one', diagnostics)
        return
      end if
      if (unit_of(written, key) == 0) text = text // ' rad/s, which is ' // rounded_text(from_si(range(1), unit_rpm), 6) // &
                                             ', ' // rounded_text(from_si(range(2), unit_rpm), 6) // ' rpm'
    end associate
    call input%report(group, key, text // '; allowed: first the slower speed, then the faster one, both with one sign', &
               diagnostics)
  end subroutine check_range

end module nocdyn_machine_parts
