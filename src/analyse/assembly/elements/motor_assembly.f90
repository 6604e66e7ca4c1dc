!> The banks of motors of an input: one for each form of their laws that it has.
module nocdyn_motor_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_dc_motors, only: new_dc_motors
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_governed_banks, only: governor_t
  use nocdyn_induction_assembly, only: add_flux_motors, check_flux_motor, check_poles
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_inverter_motors, only: new_inverter_motors, torque_harmonics_t
  use nocdyn_kinds, only: wp
  use nocdyn_motors, only: new_induction_motors, new_motors, new_table_motors
  use nocdyn_schedules, only: join_points
  use nocdyn_synchronous_motors, only: new_synchronous_motors, slip_curves_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: motor_form, add_motor_form, check_motor

  ! forms; a motor with a governor has the next one, and so has one of `fluxes` or `rated` with a supply over the time; one whose
  ! set speed follows the time has the one after that
  integer, parameter :: quadratic = 1, induction = 4, table = 7, inductive = 10, fluxes = 13, rated = 16, inverter = 19, &
                        synchronous = 22

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
      motor_form = merge(rated, fluxes, group%has_value('rated_power'))
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
    type(governor_t), allocatable :: governor
    real(wp), allocatable :: drag(:, :)
    integer :: body(size(groups%indices))

    body = groups%bodies('body', 1)
    if (modulo(form, 3) /= quadratic .and. (form < fluxes .or. form > inverter .and. form < synchronous)) then
      allocate (governor)
      call set_governor(groups, governor)
      allocate (drag, source=drags(groups))
    end if
    select case (form)
    case (quadratic)
      call append_bank(banks, new_motors(groups%names, body, standstill_torques(groups), groups%values('b') + drags(groups), &
                                         groups%values('c')))
    case (quadratic + 1, quadratic + 2)
      call append_bank(banks, new_motors(groups%names, body, standstill_torques(groups), groups%values('b'), groups%values('c'), &
                                         governor, drag))
    case (induction:induction + 2)
      call append_bank(banks, new_induction_motors(groups%names, body, groups%values('breakdown_torque'), &
                                                   groups%values('breakdown_slip'), groups%values('synchronous_speed'), &
                                                   governor, drag))
    case (table:table + 2)
      call append_bank(banks, new_table_motors(groups%names, body, groups%curves('table_speed', 'table_torque'), governor, drag))
    case (fluxes:inverter - 1)
      call add_flux_motors(groups, body, banks)
    case (synchronous)
      call add_synchronous_motors(groups, body, banks)
    case (inverter:inverter + 2)
      call append_bank(banks, new_inverter_motors(groups%names, body, groups%values('torque_limit'), governor, &
                                                  torque_harmonics(groups)))
    case default
      call append_bank(banks, new_dc_motors(groups%names, body, groups%values('voltage'), groups%values('resistance'), &
                                            groups%values('flux_constant'), groups%values('inductance'), governor))
    end select
  end subroutine add_motor_form

  !> The governors of motors, all or none of whose set speeds follow the time.
  subroutine set_governor(groups, governor)
    type(element_groups_t), intent(in) :: groups
    type(governor_t), intent(out) :: governor
    integer :: i, lane
    real(wp) :: t_start

    allocate (governor%set_speed, source=groups%values('governor_speed'))
    allocate (governor%gain, source=groups%values('governor_gain'))
    allocate (governor%time, source=groups%values('governor_time'))
    allocate (governor%start, source=groups%values('governor_start'))
    if (groups%input%groups(groups%indices(1))%text('kind') == 'inverter') governor%least = -1.0_wp
    if (.not. groups%input%groups(groups%indices(1))%has_value('set_times')) return
    t_start = groups%input%groups(groups%input%position('run'))%number('t_start')
    allocate (governor%course(groups%lanes, size(groups%indices)))
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        do lane = 1, groups%lanes
          call join_points(group%numbers('set_times'), group%numbers('set_speeds'), governor%course(lane, i))
          governor%set_speed(lane, i) = governor%course(lane, i)%at(t_start)
        end do
      end associate
    end do
  end subroutine set_governor

  !> Adds a bank of synchronous motors.
  subroutine add_synchronous_motors(groups, body, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: body(:)
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(slip_curves_t) :: curves(groups%lanes, size(body))
    real(wp), dimension(groups%lanes, size(body)) :: direction, poles
    integer :: i, lane

    do i = 1, size(body)
      associate (group => groups%input%groups(groups%indices(i)))
        poles(:, i) = group%whole_number('poles')
        direction(:, i) = merge(-1.0_wp, 1.0_wp, group%flag('reversed'))
        do lane = 1, groups%lanes
          curves(lane, i)%slip = group%numbers('slips')
          if (group%has_value('mean_torques')) then
            curves(lane, i)%mean = group%numbers('mean_torques')
            curves(lane, i)%pulsation = group%numbers('pulsations')
          else
            curves(lane, i)%mean = 0.5_wp * (group%numbers('d_torques') + group%numbers('q_torques'))
            curves(lane, i)%pulsation = 0.5_wp * (group%numbers('d_torques') - group%numbers('q_torques'))
          end if
        end do
      end associate
    end do
    call append_bank(banks, new_synchronous_motors(groups%names, body, curves, groups%values('frequency'), poles, direction, &
                                                   groups%values('phase')))
  end subroutine add_synchronous_motors

  !> The harmonics of the torque of motors on inverters.
  function torque_harmonics(groups) result(harmonics)
    type(element_groups_t), intent(in) :: groups
    type(torque_harmonics_t) :: harmonics
    integer :: i, k, most

    most = maxval([0, (size(groups%input%groups(groups%indices(i))%numbers('harmonics')), i=1, size(groups%indices))])
    allocate (harmonics%order(groups%lanes, size(groups%indices), most), source=0.0_wp)
    allocate (harmonics%share, harmonics%torque, harmonics%phase, source=harmonics%order)
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        associate (order => group%numbers('harmonics'), share => group%numbers('harmonic_shares'), &
                   torque => group%numbers('harmonic_torques'), phase => group%numbers('harmonic_phases'))
          do k = 1, size(order)
            harmonics%order(:, i, k) = 0.5_wp * group%whole_number('poles') * order(k)
            harmonics%phase(:, i, k) = phase(k)
            if (size(share) > 0) harmonics%share(:, i, k) = share(k)
            if (size(torque) > 0) harmonics%torque(:, i, k) = torque(k)
          end do
        end associate
      end associate
    end do
  end function torque_harmonics

  !> Torques at standstill [N m]: `a` of quadratic motors, `torque` of constant ones, k voltage / resistance of dc motors.
  function standstill_torques(groups) result(torques)
    type(element_groups_t), intent(in) :: groups
    real(wp) :: torques(groups%lanes, size(groups%indices))

    torques = groups%values('a') + groups%values('torque') &
              + groups%values('flux_constant') * groups%values('voltage') / groups%values('resistance', absent=1.0_wp)
  end function standstill_torques

  !> Drags k^2 / resistance of dc motors without inductance, which are not throttled [N m s/rad].
  function drags(groups)
    type(element_groups_t), intent(in) :: groups
    real(wp) :: drags(groups%lanes, size(groups%indices))

    drags = groups%values('flux_constant')**2 / groups%values('resistance', absent=1.0_wp)
  end function drags

end module nocdyn_motor_assembly
