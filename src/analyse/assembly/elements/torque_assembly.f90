!> The banks of loads and excitations of an input: one for each form of their laws that it has.
module nocdyn_torque_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_cylinder_torques, only: cylinder_torques
  use nocdyn_electrical_faults, only: find_fault_terms
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_excitations, only: new_excitations
  use nocdyn_external_excitations, only: new_external_excitations
  use nocdyn_fault_excitations, only: fault_terms_t, new_fault_excitations
  use nocdyn_harmonic_tables, only: table_torque
  use nocdyn_input, only: group_t
  use nocdyn_kinds, only: wp
  use nocdyn_load_shares, only: new_load_shares
  use nocdyn_loads, only: loads_t, new_loads, new_vibration_dampers
  use nocdyn_order_excitations, only: new_order_excitations, order_excitations_t, order_torque_t
  use nocdyn_shared_loads, only: find_shared_load
  use nocdyn_table_excitations, only: new_table_excitations
  use nocdyn_timed_excitations, only: new_timed_excitations, shape_pulse, shape_ramp, shape_step
  use nocdyn_text, only: string_t, to_text
  use nocdyn_wave_excitations, only: new_wave_excitations
  implicit none (type, external)
  private

  public :: load_form, add_load_form, add_steady_load_form, excitation_form, add_excitation_form, add_engines, in_lanes

  integer, parameter :: viscous = 1, nonlinear = 2, table = 3     ! forms of loads; those that damp vibrations have the ones after
  ! Forms of excitations, in the order of their columns; one with a start, an end or a decay has the form after its own.
  integer, parameter :: harmonic = 1, waves = 3, tables = 5, timed = 7, orders = 9, shares = 11, faults = 13, given = 15

contains

  !> Form of the law of a group &load.
  pure integer function load_form(group)
    type(group_t), intent(in) :: group

    load_form = viscous
    if (group%number('quadratic', absent=0.0_wp) > 0 .or. group%number('constant', absent=0.0_wp) > 0) load_form = nonlinear
    if (group%has_value('table_speed')) load_form = table
    if (group%has_value('vibration_damping') .or. group%has_value('vibration_factor')) load_form = load_form + table
  end function load_form

  !> Adds the bank of the loads of one form.
  subroutine add_load_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form   !! their constructor knows it by the keys
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)

    call append_bank(banks, new_loads(groups))
  end subroutine add_load_form

  !> Adds the bank of the loads of one form to the machine of a steady state.
  subroutine add_steady_load_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)

    call append_bank(banks, new_loads(groups, is_steady=.true.))
  end subroutine add_steady_load_form

  !> Form of the law of a group &excitation.
  pure integer function excitation_form(group)
    type(group_t), intent(in) :: group

    select case (group%text('kind'))
    case ('harmonic')
      excitation_form = harmonic
    case ('orders', 'startup')
      excitation_form = waves
      if (group%has_value('speeds')) excitation_form = orders
      if (group%has_value('share_of_load')) excitation_form = shares
    case ('table')
      excitation_form = tables
    case ('fault')
      excitation_form = faults
    case ('external')
      excitation_form = given
    case default
      excitation_form = timed
    end select
    if (group%has_value('start') .or. group%has_value('end') .or. group%has_value('decay')) excitation_form = excitation_form + 1
  end function excitation_form

  !> Adds the bank of the excitations of one form, or its banks.
  subroutine add_excitation_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(fault_terms_t) :: terms(size(groups%indices))
    integer :: before, first, i, shape(size(groups%indices))
    logical :: has_failed

    before = size(banks)
    select case (form - 1 + modulo(form, 2))   ! without its window
    case (harmonic)
      call append_bank(banks, new_excitations(groups))
    case (waves)
      call add_waves(groups, banks)
    case (orders)
      call append_bank(banks, new_order_excitations(groups%names, groups%bodies('body', 1), &
                                                    in_lanes(torques(groups), groups%lanes)))
    case (shares)
      call add_shares(groups, banks)
    case (tables)
      call append_bank(banks, new_table_excitations(groups))
    case (faults)
      do i = 1, size(terms)
        call find_fault_terms(groups%input%groups(groups%indices(i)), terms(i), has_failed)
        if (has_failed) error stop 'nocdyn_torque_assembly: the groups are checked'
      end do
      call append_bank(banks, new_fault_excitations(groups, terms))
    case (given)
      call append_bank(banks, new_external_excitations(groups))
    case default
      shape = shape_pulse
      do i = 1, size(shape)
        if (groups%input%groups(groups%indices(i))%text('kind') == 'step') shape(i) = shape_step
        if (groups%input%groups(groups%indices(i))%text('kind') == 'ramp') shape(i) = shape_ramp
      end do
      call append_bank(banks, new_timed_excitations(groups, shape))
    end select
    if (modulo(form, 2) == 1) return
    first = 1
    do i = before + 1, size(banks)
      select type (bank => banks(i)%bank)
      class is (excitation_bank_t)
        call bank%set_window(groups, first)
        first = first + bank%count
      class default
        error stop 'nocdyn_torque_assembly: an excitation has no window'
      end select
    end do
  end subroutine add_excitation_form

  !> Adds a bank of waves: every order is a term, and so is amplitude sin(2 (frequency t - pole_pairs phi) + phase).
  subroutine add_waves(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    real(wp), allocatable :: amplitude(:), frequency(:), order(:), phase(:)
    integer, allocatable :: owner(:)
    integer :: i

    allocate (owner(0), amplitude(0), frequency(0), order(0), phase(0))
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        if (group%text('kind') == 'startup') then
          amplitude = [amplitude, group%number('amplitude')]
          frequency = [frequency, 2.0_wp * group%number('frequency')]
          order = [order, -2.0_wp * group%whole_number('pole_pairs')]
          phase = [phase, group%number('phase')]
        else
          amplitude = [amplitude, group%numbers('amplitudes')]
          order = [order, group%numbers('orders')]
          frequency = [frequency, spread(0.0_wp, 1, size(order) - size(frequency))]
          phase = [phase, group%numbers('phases')]
          phase = [phase, spread(0.0_wp, 1, size(order) - size(phase))]
        end if
        owner = [owner, spread(i, 1, size(order) - size(owner))]
      end associate
    end do
    associate (lanes => groups%lanes)
      call append_bank(banks, new_wave_excitations(groups, owner, spread(amplitude, 1, lanes), spread(frequency, 1, lanes), &
                                                   spread(order, 1, lanes), spread(phase, 1, lanes)))
    end associate
  end subroutine add_waves

  !> The torque of each group with orders at several speeds.
  function torques(groups)
    type(element_groups_t), intent(in) :: groups
    type(order_torque_t), allocatable :: torques(:)
    integer :: i

    allocate (torques(size(groups%indices)))
    do i = 1, size(torques)
      torques(i) = table_torque(groups%input%groups(groups%indices(i)), 'amplitudes', 'phases')
    end do
  end function torques

  !> Repeats the torques in every lane.
  function in_lanes(torque, lanes) result(all_torques)
    type(order_torque_t), intent(in) :: torque(:)
    integer, intent(in) :: lanes
    type(order_torque_t), allocatable :: all_torques(:, :)   !! [lanes, torques]
    integer :: i, lane

    allocate (all_torques(lanes, size(torque)))   ! gfortran 12: `spread` copies the pointers to allocatable components
    do i = 1, size(torque)
      do lane = 1, lanes
        all_torques(lane, i) = torque(i)
      end do
    end do
  end function in_lanes

  !> Adds banks of shares of loads, one for each: their loads may have switches that the ones of others do not have.
  subroutine add_shares(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(element_groups_t) :: load, one
    character(len=:), allocatable :: text
    integer :: i, index

    one = groups
    load = groups
    do i = 1, size(groups%indices)
      call find_shared_load(groups%input, groups%indices(i), index, text)
      if (index == 0) error stop 'nocdyn_torque_assembly: the load of an excitation was not checked'
      call one%select(groups%indices(i:i))
      call load%select([index])
      call append_bank(banks, new_load_shares(one, load))
    end do
  end subroutine add_shares

  !> Adds the banks of engines: their cylinders are the elements, and the dampers of their vibrations.
  subroutine add_engines(groups, inertia, is_steady, banks)
    type(element_groups_t), intent(in) :: groups
    real(wp), intent(in) :: inertia(:, :)   !! of the bodies [kg m2], [lanes, bodies]
    logical, intent(in) :: is_steady        !! whether it is the machine of a steady state
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(order_torque_t), allocatable :: torque(:)
    type(string_t), allocatable :: names(:)
    type(order_excitations_t) :: bank
    integer :: c, i

    do i = 1, size(groups%indices)
      torque = cylinder_torques(groups%input%groups(groups%indices(i)))
      allocate (names(size(torque)))
      do c = 1, size(torque)
        names(c)%text = groups%names(i)%text // '_' // to_text(c)
      end do
      bank = new_order_excitations(names, groups%listed_bodies('cylinders', i), in_lanes(torque, groups%lanes))
      bank%works = groups%input%groups(groups%indices(i))%text('works')
      bank%is_engine = bank%works == 'engine'
      call append_bank(banks, bank)
      deallocate (names)
      associate (group => groups%input%groups(groups%indices(i)))
        if (group%has_value('vibration_damping') .or. group%has_value('magnifier')) then
          call add_cylinder_dampers(group, groups%listed_bodies('cylinders', i), inertia, is_steady, banks)
        end if
      end associate
    end do
  end subroutine add_engines

  !> Adds the damping of the vibration at each cylinder of an engine: given, or the inertia of its crank times the frequency over
  !> the magnifier, which is the ratio of the torque of that inertia to the one of the damping. Cylinders share the inertia of a
  !> crank that they have in common.
  subroutine add_cylinder_dampers(group, body, inertia, is_steady, banks)
    type(group_t), intent(in) :: group
    integer, intent(in) :: body(:)          !! of each cylinder
    real(wp), intent(in) :: inertia(:, :)   !! of the bodies [kg m2], [lanes, bodies]
    logical, intent(in) :: is_steady
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(loads_t) :: bank
    type(string_t) :: names(size(body))
    real(wp) :: damping(size(inertia, 1), size(body))
    integer :: c

    do c = 1, size(body)
      names(c)%text = group%name // '_damping_' // to_text(c)
      if (group%has_value('magnifier')) then
        damping(:, c) = inertia(:, body(c)) / count(body == body(c)) * group%number('damping_frequency') &
                        / group%number('magnifier')
      else
        damping(:, c) = group%number('vibration_damping')
      end if
    end do
    bank = new_vibration_dampers(names, body, damping, group%number('mean_time'), is_steady)
    bank%follows_inertias = group%has_value('magnifier')
    call append_bank(banks, bank)
  end subroutine add_cylinder_dampers

end module nocdyn_torque_assembly
