!> The banks of loads and excitations of an input: one for each form of their laws that it has.
module nocdyn_torque_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_excitations, only: new_excitations
  use nocdyn_input, only: group_t
  use nocdyn_kinds, only: wp
  use nocdyn_loads, only: new_loads, new_nonlinear_loads
  use nocdyn_table_excitations, only: new_table_excitations
  use nocdyn_timed_excitations, only: new_timed_excitations, shape_pulse, shape_ramp, shape_step
  use nocdyn_wave_excitations, only: new_wave_excitations
  implicit none (type, external)
  private

  public :: load_form, add_load_form, excitation_form, add_excitation_form

  integer, parameter :: viscous = 1, nonlinear = 2, table = 3     ! forms of loads
  integer, parameter :: harmonic = 1, waves = 2, timed = 4        ! forms of excitations, and `table`

contains

  !> Form of the law of a group &load.
  pure integer function load_form(group)
    type(group_t), intent(in) :: group

    load_form = viscous
    if (group%number('quadratic', absent=0.0_wp) > 0 .or. group%number('constant', absent=0.0_wp) > 0) load_form = nonlinear
    if (group%has_value('table_speed')) load_form = table
  end function load_form

  !> Adds the bank of the loads of one form.
  subroutine add_load_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer :: body(size(groups%indices))
    real(wp), dimension(groups%lanes, size(groups%indices)) :: constant, constant_speed, quadratic, slope

    body = groups%bodies('body', 1)
    slope = groups%values('viscous')
    quadratic = groups%values('quadratic')
    constant = groups%values('constant')
    constant_speed = groups%values('constant_speed', absent=1.0_wp)
    select case (form)
    case (viscous)
      call append_bank(banks, new_loads(groups%names, body, slope))
    case (nonlinear)
      call append_bank(banks, new_nonlinear_loads(groups%names, body, slope, quadratic, constant, constant_speed))
    case default
      call append_bank(banks, new_nonlinear_loads(groups%names, body, slope, quadratic, constant, constant_speed, &
                                                  groups%curves('table_speed', 'table_torque')))
    end select
  end subroutine add_load_form

  !> Form of the law of a group &excitation.
  pure integer function excitation_form(group)
    type(group_t), intent(in) :: group

    select case (group%text('kind'))
    case ('harmonic')
      excitation_form = harmonic
    case ('orders', 'startup')
      excitation_form = waves
    case ('table')
      excitation_form = table
    case default
      excitation_form = timed
    end select
  end function excitation_form

  !> Adds the bank of the excitations of one form.
  subroutine add_excitation_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer :: body(size(groups%indices)), i, shape(size(groups%indices))

    body = groups%bodies('body', 1)
    select case (form)
    case (harmonic)
      call append_bank(banks, new_excitations(groups%names, body, groups%values('amplitude'), groups%values('frequency'), &
                                              groups%values('phase')))
    case (waves)
      call add_waves(groups, body, banks)
    case (table)
      call append_bank(banks, new_table_excitations(groups%names, body, &
                                                    groups%curves('table_time', 'table_torque', extrapolation='constant')))
    case default
      shape = shape_pulse
      do i = 1, size(body)
        if (groups%input%groups(groups%indices(i))%text('kind') == 'step') shape(i) = shape_step
        if (groups%input%groups(groups%indices(i))%text('kind') == 'ramp') shape(i) = shape_ramp
      end do
      call append_bank(banks, new_timed_excitations(groups%names, body, shape, groups%values('amplitude'), &
                                                    groups%values('time'), groups%values('duration', absent=1.0_wp)))
    end select
  end subroutine add_excitation_form

  !> Adds a bank of waves: every order is a term, and so is amplitude sin(2 (frequency t - pole_pairs phi) + phase).
  subroutine add_waves(groups, body, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: body(:)
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    real(wp), allocatable :: amplitude(:), frequency(:), order(:), phase(:)
    integer, allocatable :: owner(:)
    integer :: i

    allocate (owner(0), amplitude(0), frequency(0), order(0), phase(0))
    do i = 1, size(body)
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
      call append_bank(banks, new_wave_excitations(groups%names, body, owner, spread(amplitude, 1, lanes), &
                                                   spread(frequency, 1, lanes), spread(order, 1, lanes), spread(phase, 1, lanes)))
    end associate
  end subroutine add_waves

end module nocdyn_torque_assembly
