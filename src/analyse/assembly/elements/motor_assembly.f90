!> The banks of motors of an input: one for each form of their laws that it has.
module nocdyn_motor_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_dc_motors, only: new_dc_motors
  use nocdyn_double_cage_motors, only: new_double_cage_motors
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_flux_motors, only: new_flux_motors
  use nocdyn_induction_assembly, only: add_rated_double_cages, add_rated_motors, check_flux_motor, check_poles
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_inverter_motors, only: new_inverter_motors
  use nocdyn_motors, only: new_induction_motors, new_motors, new_table_motors
  use nocdyn_synchronous_motors, only: new_synchronous_motors
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: motor_form, add_motor_form, check_motor

  ! forms; a motor with a governor has the next one, and so has one of `fluxes`, `rated` or with two cages and a supply over the
  ! time; one whose set speed follows the time has the one after that
  integer, parameter :: quadratic = 1, induction = 4, table = 7, inductive = 10, fluxes = 13, rated = 16, inverter = 19, &
                        synchronous = 22, double_cage = 25, rated_double_cage = 27

contains

  !> Refuses motors whose values do not fit together.
  subroutine check_motor(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    select case (input%groups(index)%text('kind'))
    case ('induction')
      call check_induction(input, index, diagnostics)
    case ('induction_dq')
      call check_flux_motor(input, index, diagnostics)
    case ('inverter')
      ! refuses a motor without a set speed, a gain that turns it away from that, and an odd number of poles
      associate (group => input%groups(index))
        if (.not. (group%has_value('governor_speed') .or. group%has_value('set_times'))) then
          call input%report(index, 'kind', "kind = 'inverter' needs a set speed; " // &
                     'required: governor_speed [rad/s], or set_times and set_speeds', diagnostics)
        else if (.not. group%number('governor_gain') > 0) then
          call input%report(index, 'governor_gain', 'governor_gain = ' // to_text(group%number('governor_gain')) // &
                     "; allowed with kind = 'inverter': > 0 [s/rad]", diagnostics)
        end if
        if (group%has_value('poles')) call check_poles(input, index, diagnostics)
      end associate
    case ('synchronous')
      call check_synchronous(input, index, diagnostics)
    case default
    end select
  end subroutine check_motor

  !> Refuses a breakdown torque and a synchronous speed of different signs.
  subroutine check_induction(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (torque => input%groups(index)%number('breakdown_torque'), speed => input%groups(index)%number('synchronous_speed'))
      if ((torque > 0 .and. speed > 0) .or. (torque < 0 .and. speed < 0)) return
      call input%report(index, 'breakdown_torque', 'breakdown_torque = ' // to_text(torque) // &
                 ' must have the sign of synchronous_speed = ' // to_text(speed), diagnostics)
    end associate
  end subroutine check_induction

  !> Refuses an odd number of poles, and curves over the slip of which one is missing.
  subroutine check_synchronous(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    logical :: by_axes, by_parts

    call check_poles(input, index, diagnostics)
    associate (group => input%groups(index))
      by_axes = group%has_value('d_torques') .and. group%has_value('q_torques')
      by_parts = group%has_value('mean_torques') .and. group%has_value('pulsations')
      if (by_axes .neqv. by_parts) return
      call input%report(index, 'slips', 'allowed over the slips: d_torques and q_torques, ' // &
                 'or mean_torques and pulsations', diagnostics)
    end associate
  end subroutine check_synchronous

  !> Form of the law of a group &motor. A motor with constant torque is quadratic, and so is a dc motor without inductance.
  pure integer function motor_form(group)
    type(group_t), intent(in) :: group

    select case (group%text('kind'))
    case ('induction')
      motor_form = induction
    case ('induction_dq')
      if (group%has_value('rated_power')) then
        motor_form = merge(rated_double_cage, rated, group%whole_number('cages') == 2)
      else
        motor_form = merge(double_cage, fluxes, group%has_value('outer_resistance'))
      end if
    case ('inverter')
      motor_form = inverter
    case ('synchronous')
      motor_form = synchronous
    case ('table')
      motor_form = table
    case ('dc')
      motor_form = merge(inductive, quadratic, group%number('inductance') > 0)
    case default
      motor_form = quadratic
    end select
    if (group%has_value('governor_speed') .or. group%has_value('supply_times')) motor_form = motor_form + 1
    if (group%has_value('set_times')) motor_form = motor_form + 2
  end function motor_form

  !> Adds the bank of the motors of one form.
  subroutine add_motor_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)

    select case (form)
    case (quadratic:quadratic + 2)
      call append_bank(banks, new_motors(groups))
    case (induction:induction + 2)
      call append_bank(banks, new_induction_motors(groups))
    case (table:table + 2)
      call append_bank(banks, new_table_motors(groups))
    case (inductive:inductive + 2)
      call append_bank(banks, new_dc_motors(groups))
    case (fluxes:fluxes + 2)
      call append_bank(banks, new_flux_motors(groups))
    case (rated:rated + 2)
      call add_rated_motors(groups, banks)
    case (inverter:inverter + 2)
      call append_bank(banks, new_inverter_motors(groups))
    case (double_cage:double_cage + 1)
      call append_bank(banks, new_double_cage_motors(groups))
    case (rated_double_cage:rated_double_cage + 1)
      call add_rated_double_cages(groups, banks)
    case default
      call append_bank(banks, new_synchronous_motors(groups))
    end select
  end subroutine add_motor_form

end module nocdyn_motor_assembly
