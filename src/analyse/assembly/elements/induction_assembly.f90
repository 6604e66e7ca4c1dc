!> The induction motors of an input with electrical transients: their circuits from rated values, and what is refused.
module nocdyn_induction_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_double_cage_circuits, only: double_cage_circuit_t
  use nocdyn_double_cage_motors, only: double_cage_keys, new_double_cage_motors
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_flux_motors, only: circuit_keys, new_flux_motors
  use nocdyn_induction_circuits, only: induction_circuit_t
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_rated_circuits, only: fit_circuit, rating_fits, rating_impossible, rating_t, rating_too_efficient, &
                                   rating_too_strong, rating_too_weak
  use nocdyn_rated_double_cages, only: fit_double_cage, starting_values_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  use nocdyn_written_values, only: written_element, written_key, written_number, written_unit
  implicit none (type, external)
  private

  public :: add_rated_motors, add_rated_double_cages, check_flux_motor, check_poles, note_rated_motors

  real(wp), parameter :: resolution = 1.0e4_wp     ! of limits in messages
  real(wp), parameter :: seen = 1.0e-4_wp          ! relative difference that a note tells
  real(wp), parameter :: tolerated = 0.2_wp        ! relative difference between what is given and what the circuit has

contains

  !> Adds a bank of induction motors whose circuits follow from rated values.
  subroutine add_rated_motors(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    real(wp) :: rated(groups%lanes, size(groups%indices), size(circuit_keys))
    integer :: i

    do i = 1, size(groups%indices)
      rated(:, i, :) = spread(fitted_values(groups%input%groups(groups%indices(i))), 1, groups%lanes)
    end do
    call append_bank(banks, new_flux_motors(groups, rated))
  end subroutine add_rated_motors

  !> The values of the circuit that follows from the rated values, in the order of `circuit_keys`.
  function fitted_values(group) result(values)
    type(group_t), intent(in) :: group
    real(wp) :: values(size(circuit_keys))
    type(induction_circuit_t) :: circuit
    integer :: status
    real(wp) :: limit

    call fit_circuit(rating_of(group), circuit, status, limit)
    if (status /= rating_fits) error stop 'nocdyn_induction_assembly: rated values were not checked'
    values = [group%number('voltage'), circuit%frequency, circuit%stator_resistance, circuit%rotor_resistance, &
              circuit%stator - circuit%mutual, circuit%rotor - circuit%mutual, circuit%mutual, 0.0_wp, 0.0_wp, 0.0_wp]
  end function fitted_values

  !> Adds a bank of induction motors with two cages whose circuits follow from rated values.
  subroutine add_rated_double_cages(groups, banks)
    type(element_groups_t), intent(in) :: groups
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(double_cage_circuit_t) :: circuit
    type(starting_values_t) :: found
    real(wp) :: rated(groups%lanes, size(groups%indices), size(double_cage_keys))
    integer :: i, status

    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        call fit_double_cage(rating_of(group), starting_values_of(group), circuit, found, status)
        if (status /= rating_fits) error stop 'nocdyn_induction_assembly: rated values were not checked'
        rated(:, i, :) = spread([group%number('voltage'), circuit%frequency, circuit%stator_resistance, circuit%resistance(1), &
                                 circuit%stator_leakage, circuit%leakage(1), circuit%mutual, 0.0_wp, 0.0_wp, 0.0_wp, &
                                 circuit%resistance(2), circuit%leakage(2), 0.0_wp], 1, groups%lanes)
      end associate
    end do
    call append_bank(banks, new_double_cage_motors(groups, rated))
  end subroutine add_rated_double_cages

  !> What a circuit with two cages is fitted to.
  pure type(starting_values_t) function starting_values_of(group) result(wanted)
    type(group_t), intent(in) :: group

    wanted = starting_values_t(group%number('breakdown_ratio'), group%number('starting_torque'), group%number('starting_current'))
  end function starting_values_of

  pure type(rating_t) function rating_of(group) result(rating)
    type(group_t), intent(in) :: group

    rating%power = group%number('rated_power')
    rating%speed = group%number('rated_speed')
    rating%efficiency = group%number('efficiency')
    rating%power_factor = group%number('power_factor')
    rating%breakdown_ratio = group%number('breakdown_ratio')
    rating%voltage = group%number('voltage')
    rating%frequency = group%number('frequency')
    rating%pole_pairs = 0.5_wp * group%whole_number('poles')
  end function rating_of

  !> Notes the circuits that follow from rated values, with what they are found from, and starting values that they do not have.
  subroutine note_rated_motors(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(induction_circuit_t) :: circuit
    type(rating_t) :: rating
    integer, allocatable :: indices(:)
    integer :: i, status
    real(wp) :: current, limit, torque

    allocate (indices, source=input%groups_named('motor', 'induction_dq'))
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        if (.not. group%has_value('rated_power')) cycle
        rating = rating_of(group)
        if (group%whole_number('cages') == 2) then
          call note_double_cage(group, rating, notes)
          cycle
        end if
        call fit_circuit(rating, circuit, status, limit)
        torque = circuit%steady_torque(1.0_wp) * rating%speed / rating%power
        current = sqrt(0.5_wp) * abs(circuit%stator_current(circuit%steady_flux(1.0_wp))) / rating%current()
        call append(notes, 'motor ' // quoted(group%name) // ' has from its rated values, with ' // &
                    to_text(nint(100 * rating%stator_share)) // ' % of the losses outside of the rotor in the stator ' // &
                    'winding and equal leakages: stator_resistance = ' // rounded_text(circuit%stator_resistance, 6) // &
                    ', rotor_resistance = ' // rounded_text(circuit%rotor_resistance, 6) // &
                    ', stator_reactance = rotor_reactance = ' // &
                    rounded_text(circuit%frequency * (circuit%stator - circuit%mutual), 6) // ', mutual_reactance = ' // &
                    rounded_text(circuit%frequency * circuit%mutual, 6) // ' Ohm; its starting torque is ' // &
                    rounded_text(torque, 3) // ' of the rated one, its starting current ' // rounded_text(current, 3))
        call compare_start(group, 'starting_torque', torque, notes)
        call compare_start(group, 'starting_current', current, notes)
      end associate
    end do
  end subroutine note_rated_motors

  !> Notes the circuit with two cages that follows from rated values, and what it has of the values that it is fitted to.
  subroutine note_double_cage(group, rating, notes)
    type(group_t), intent(in) :: group
    type(rating_t), intent(in) :: rating
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(double_cage_circuit_t) :: circuit
    type(starting_values_t) :: found
    character(len=:), allocatable :: fit, values
    real(wp) :: worst
    integer :: status

    call fit_double_cage(rating, starting_values_of(group), circuit, found, status)
    worst = maxval(abs(found%misfits(starting_values_of(group))))
    call tell_values(found, values)
    fit = ', as given'
    if (worst > seen) fit = '; they are up to ' // rounded_text(100.0_wp * worst, 2) // ' % beside the given ones'
    call append(notes, 'motor ' // quoted(group%name) // ' has from its rated and starting values, with ' // &
                to_text(nint(100 * rating%stator_share)) // ' % of the losses outside of the rotor in the stator winding ' // &
                'and equal leakages of stator and outer cage: stator_resistance = ' // &
                rounded_text(circuit%stator_resistance, 6) // &
                ', rotor_resistance = ' // rounded_text(circuit%resistance(1), 6) // &
                ', outer_resistance = ' // rounded_text(circuit%resistance(2), 6) // &
                ', stator_reactance = outer_reactance = ' // rounded_text(circuit%frequency * circuit%leakage(2), 6) // &
                ', rotor_reactance = ' // rounded_text(circuit%frequency * circuit%leakage(1), 6) // &
                ', mutual_reactance = ' // rounded_text(circuit%frequency * circuit%mutual, 6) // ' Ohm; ' // values // fit)
  end subroutine note_double_cage

  !> Tells what a circuit with two cages has of the values that it is fitted to.
  subroutine tell_values(found, text)
    type(starting_values_t), intent(in) :: found
    character(len=:), allocatable, intent(out) :: text

    text = 'breakdown torque ' // rounded_text(found%breakdown_ratio, 4) // ' and starting torque ' // &
           rounded_text(found%starting_torque, 4) // ' of the rated torque, starting current ' // &
           rounded_text(found%starting_current, 4) // ' of the rated one'
  end subroutine tell_values

  !> Notes a given starting value that the circuit does not have: for the skin effect in the bars it would need more cages.
  subroutine compare_start(group, key, found, notes)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: found
    type(string_t), allocatable, intent(inout) :: notes(:)

    if (.not. group%has_value(key)) return
    associate (given => group%number(key))
      if (abs(found - given) <= tolerated * given) return
      call append(notes, 'motor ' // quoted(group%name) // ': ' // key // ' = ' // to_text(given) // ', but ' // &
                  rounded_text(found, 3) // ' with the circuit, which knows no skin effect in the bars; ' // &
                  'cages = 2 fits a second cage')
    end associate
  end subroutine compare_start

  !> Refuses an odd number of poles, a voltage that is not positive, and a supply that contradicts itself.
  subroutine check_flux_motor(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: before   ! mistakes of the groups before

    before = diagnostics%count
    associate (group => input%groups(index))
      call check_poles(input, index, diagnostics)
      if (.not. group%number('voltage') > 0) then
        call input%report(index, 'voltage', 'voltage = ' // to_text(group%number('voltage')) // '; allowed: > 0 [V]', diagnostics)
      else if (group%has_value('rated_power') .and. diagnostics%count == before) then   ! the circuit needs poles and voltage
        call check_rated_speed(input, index, diagnostics)
        if (diagnostics%count > before) then
          continue
        else if (group%whole_number('cages') == 2) then
          call check_double_cage(input, index, diagnostics)
        else
          call check_rating(input, index, diagnostics)
        end if
      end if
      if (group%has_value('supply_times')) call check_supply(input, index, diagnostics)
    end associate
  end subroutine check_flux_motor

  !> Refuses an odd number of poles.
  subroutine check_poles(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (poles => input%groups(index)%whole_number('poles'))
      if (modulo(poles, 2) == 1) call input%report(index, 'poles', 'poles = ' // to_text(poles) // &
                 '; allowed: an even number, twice the pole pairs', diagnostics)
    end associate
  end subroutine check_poles

  !> Refuses a rated speed above the synchronous one, or below half of it.
  subroutine check_rated_speed(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (group => input%groups(index), rating => rating_of(input%groups(index)))
      if (rating%slip() > 0 .and. rating%slip() < 0.5_wp) return
      associate (synchronous => rating%frequency / rating%pole_pairs)
        call input%report(index, 'rated_speed', written_key(group, 'rated_speed') // ' = ' // written_number(group, &
                   'rated_speed', rating%speed) // '; allowed: below ' // written_number(group, 'rated_speed', &
                   synchronous) // ' and above ' // written_number(group, 'rated_speed', 0.5_wp * synchronous) // ' [' // &
                   written_unit(group, 'rated_speed') // '], the synchronous speed with poles = ' // &
                   to_text(group%whole_number('poles')) // ' and half of it', diagnostics)
      end associate
    end associate
  end subroutine check_rated_speed

  !> Refuses rated and starting values that no circuit with two cages has, or not nearly.
  subroutine check_double_cage(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(double_cage_circuit_t) :: circuit
    type(starting_values_t) :: found
    character(len=:), allocatable :: values
    integer :: status

    associate (group => input%groups(index), rating => rating_of(input%groups(index)))
      if (.not. (group%has_value('starting_torque') .and. group%has_value('starting_current'))) then
        call input%report(index, 'cages', 'cages = 2 needs starting_torque and starting_current', diagnostics)
        return
      end if
      call fit_double_cage(rating, starting_values_of(group), circuit, found, status)
      select case (status)
      case (rating_too_efficient)
        call report_efficiency(input, index, rating, diagnostics)
      case (rating_impossible)
        call report_power_factor(input, index, rating, diagnostics)
      case default
        if (maxval(abs(found%misfits(starting_values_of(group)))) <= tolerated) return
        call tell_values(found, values)
        call input%report(index, 'cages', 'no circuit with two cages has breakdown_ratio = ' // &
                   to_text(group%number('breakdown_ratio')) // ', starting_torque = ' // &
                   to_text(group%number('starting_torque')) // ' and starting_current = ' // &
                   to_text(group%number('starting_current')) // ' with these losses, slip and power factor; ' // &
                   'the nearest one: ' // values, diagnostics)
      end select
    end associate
  end subroutine check_double_cage

  !> Refuses an efficiency that the slip does not allow.
  subroutine report_efficiency(input, index, rating, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(rating_t), intent(in) :: rating
    type(diagnostics_t), intent(inout) :: diagnostics

    call input%report(index, 'efficiency', 'efficiency = ' // to_text(rating%efficiency) // '; allowed: < ' // &
               rounded_text(1.0_wp - rating%slip(), 6) // ', as the slip takes ' // rounded_text(rating%slip(), 4) // &
               ' of the power of the air gap', diagnostics)
  end subroutine report_efficiency

  !> Refuses a power factor with which no circuit has a magnetising reactance.
  subroutine report_power_factor(input, index, rating, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(rating_t), intent(in) :: rating
    type(diagnostics_t), intent(inout) :: diagnostics

    call input%report(index, 'power_factor', 'power_factor = ' // to_text(rating%power_factor) // &
               ' leaves no reactive power to magnetise the motor; allowed: smaller values', diagnostics)
  end subroutine report_power_factor

  !> Refuses rated values that no circuit has.
  subroutine check_rating(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(induction_circuit_t) :: circuit
    integer :: status
    real(wp) :: limit

    associate (rating => rating_of(input%groups(index)))
      call fit_circuit(rating, circuit, status, limit)
      select case (status)
      case (rating_too_efficient)
        call report_efficiency(input, index, rating, diagnostics)
      case (rating_too_strong)
        call input%report(index, 'breakdown_ratio', 'breakdown_ratio = ' // to_text(rating%breakdown_ratio) // &
                   '; allowed: <= ' // to_text(floor(limit * resolution) / resolution) // &
                   ' with these losses, slip and power factor', diagnostics)
      case (rating_too_weak)
        call input%report(index, 'breakdown_ratio', 'breakdown_ratio = ' // to_text(rating%breakdown_ratio) // &
                   '; allowed: >= ' // to_text(ceiling(limit * resolution) / resolution) // &
                   ' with these losses, slip and power factor', diagnostics)
      case (rating_impossible)
        call report_power_factor(input, index, rating, diagnostics)
      case default
      end select
    end associate
  end subroutine check_rating

  !> Refuses a first factor of 0, and ramps that end after the next change.
  subroutine check_supply(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: k

    associate (group => input%groups(index))
      associate (time => group%numbers('supply_times'), factor => group%numbers('supply_factors'), &
                 ramp => group%numbers('supply_ramps'))
        if (.not. factor(1) > 0) then
          call input%report(index, 'supply_factors', written_element(group, 'supply_factors', 1) // &
                     '; allowed: > 0, as the motor is disconnected before ' // written_element(group, 'supply_times', 1), &
                     diagnostics)
        end if
        do k = 1, size(time) - 1
          if (time(k) + ramp(k) <= time(k + 1)) cycle
          call input%report(index, 'supply_ramps', written_element(group, 'supply_ramps', k) // ' from ' // &
                     written_element(group, 'supply_times', k) // ' ends after ' // written_element(group, 'supply_times', &
                     k + 1) // '; allowed: ramps that end before', diagnostics)
          return
        end do
      end associate
    end associate
  end subroutine check_supply

end module nocdyn_induction_assembly
