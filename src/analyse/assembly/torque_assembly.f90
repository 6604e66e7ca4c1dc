!> The banks of loads and excitations of an input: one for each form of their laws that it has.
module nocdyn_torque_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_body_index, only: body_index_t
  use nocdyn_element_parameters, only: curves_of, ends_of, names_of, values_of
  use nocdyn_excitations, only: new_excitations
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_loads, only: new_loads
  use nocdyn_nonlinear_loads, only: new_nonlinear_loads
  use nocdyn_table_excitations, only: new_table_excitations
  use nocdyn_table_loads, only: new_table_loads
  use nocdyn_text, only: string_t
  use nocdyn_timed_excitations, only: new_timed_excitations, shape_pulse, shape_ramp, shape_step
  use nocdyn_wave_excitations, only: new_wave_excitations
  implicit none (type, external)
  private

  public :: add_loads, add_excitations

  integer, parameter :: viscous = 1, nonlinear = 2, table = 3     ! forms of loads
  integer, parameter :: harmonic = 1, waves = 2, timed = 4        ! forms of excitations, and `table`

contains

  pure integer function load_form(group)
    type(group_t), intent(in) :: group

    load_form = viscous
    if (group%number('quadratic', absent=0.0_wp) > 0 .or. group%number('constant', absent=0.0_wp) > 0) load_form = nonlinear
    if (group%has_value('table_speed')) load_form = table
  end function load_form

  !> A bank of viscous loads in any case, the others where there are such loads.
  subroutine add_loads(input, body_index, lanes, banks)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    integer, intent(in) :: lanes
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer, allocatable :: indices(:), some(:)
    integer :: form, i

    allocate (indices, source=input%groups_named('load'))
    do form = viscous, table
      some = pack(indices, [(load_form(input%groups(indices(i))) == form, i=1, size(indices))])
      if (form == viscous .or. size(some) > 0) call add_load_form(input, some, lanes, form, body_index, banks)
    end do
  end subroutine add_loads

  subroutine add_load_form(input, indices, lanes, form, body_index, banks)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes, form
    type(body_index_t), intent(in) :: body_index
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(string_t), allocatable :: names(:)
    integer :: body(size(indices))
    real(wp), dimension(lanes, size(indices)) :: constant, constant_speed, quadratic, slope

    allocate (names, source=names_of(input, indices))
    body = ends_of(input, indices, 'body', 1, body_index)
    slope = values_of(input, indices, lanes, 'viscous')
    quadratic = values_of(input, indices, lanes, 'quadratic')
    constant = values_of(input, indices, lanes, 'constant')
    constant_speed = values_of(input, indices, lanes, 'constant_speed', absent=1.0_wp)
    select case (form)
    case (viscous)
      call append_bank(banks, new_loads(names, body, slope))
    case (nonlinear)
      call append_bank(banks, new_nonlinear_loads(names, body, slope, quadratic, constant, constant_speed))
    case default
      call append_bank(banks, new_table_loads(names, body, slope, quadratic, constant, constant_speed, &
                                              curves_of(input, indices, lanes, 'table_speed', 'table_torque')))
    end select
  end subroutine add_load_form

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

  !> A bank of harmonic excitations in any case, the others where there are such excitations.
  subroutine add_excitations(input, body_index, lanes, banks)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    integer, intent(in) :: lanes
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer, allocatable :: indices(:), some(:)
    integer :: form, i

    allocate (indices, source=input%groups_named('excitation'))
    do form = harmonic, timed
      some = pack(indices, [(excitation_form(input%groups(indices(i))) == form, i=1, size(indices))])
      if (form == harmonic .or. size(some) > 0) call add_excitation_form(input, some, lanes, form, body_index, banks)
    end do
  end subroutine add_excitations

  subroutine add_excitation_form(input, indices, lanes, form, body_index, banks)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes, form
    type(body_index_t), intent(in) :: body_index
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(string_t), allocatable :: names(:)
    integer :: body(size(indices)), i

    allocate (names, source=names_of(input, indices))
    body = ends_of(input, indices, 'body', 1, body_index)
    select case (form)
    case (harmonic)
      call append_bank(banks, new_excitations(names, body, values_of(input, indices, lanes, 'amplitude'), &
                                              values_of(input, indices, lanes, 'frequency'), &
                                              values_of(input, indices, lanes, 'phase')))
    case (waves)
      call add_waves(input, indices, lanes, names, body, banks)
    case (table)
      call append_bank(banks, new_table_excitations(names, body, curves_of(input, indices, lanes, 'table_time', 'table_torque', &
                                                                           extrapolation='constant')))
    case default
      call append_bank(banks, new_timed_excitations(names, body, [(shape_of(input%groups(indices(i))), i=1, size(indices))], &
                                                    values_of(input, indices, lanes, 'amplitude'), &
                                                    values_of(input, indices, lanes, 'time'), &
                                                    values_of(input, indices, lanes, 'duration', absent=1.0_wp)))
    end select
  end subroutine add_excitation_form

  pure integer function shape_of(group)
    type(group_t), intent(in) :: group

    select case (group%text('kind'))
    case ('step')
      shape_of = shape_step
    case ('ramp')
      shape_of = shape_ramp
    case default
      shape_of = shape_pulse
    end select
  end function shape_of

  !> Every order is a term; so is amplitude sin(2 (frequency t - pole_pairs phi) + phase).
  subroutine add_waves(input, indices, lanes, names, body, banks)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    real(wp), allocatable :: amplitude(:), frequency(:), order(:), phase(:)
    integer, allocatable :: owner(:)
    integer :: i

    allocate (owner(0), amplitude(0), frequency(0), order(0), phase(0))
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
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
    call append_bank(banks, new_wave_excitations(names, body, owner, spread(amplitude, 1, lanes), &
                                                 spread(frequency, 1, lanes), spread(order, 1, lanes), &
                                                 spread(phase, 1, lanes)))
  end subroutine add_waves

end module nocdyn_torque_assembly
