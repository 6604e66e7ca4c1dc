!> The induction motors of an input with electrical transients: their circuits, and their supply over the time.
module nocdyn_induction_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_flux_motors, only: circuit_keys, new_flux_motors
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schedules, only: schedule_t
  use nocdyn_text, only: to_text
  use nocdyn_written_values, only: written_element
  implicit none (type, external)
  private

  public :: add_flux_motors, check_flux_motor

contains

  !> Adds a bank of induction motors, all or none of which have a supply over the time.
  subroutine add_flux_motors(groups, body, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: body(:)
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    real(wp), dimension(groups%lanes, size(body)) :: direction, poles
    real(wp) :: values(groups%lanes, size(body), size(circuit_keys))
    integer :: i, k
    type(schedule_t), allocatable :: schedule(:, :)

    do k = 1, size(circuit_keys)
      values(:, :, k) = groups%values(trim(circuit_keys(k)))
    end do
    do i = 1, size(body)
      associate (group => groups%input%groups(groups%indices(i)))
        poles(:, i) = group%whole_number('poles')
        direction(:, i) = merge(-1.0_wp, 1.0_wp, group%flag('reversed'))
      end associate
    end do
    if (groups%input%groups(groups%indices(1))%has_value('supply_times')) call find_schedules(groups, schedule)
    call append_bank(banks, new_flux_motors(groups%names, body, values, poles, direction, schedule))
  end subroutine add_flux_motors

  !> The shares of the voltage over the time, the same in every lane.
  subroutine find_schedules(groups, schedule)
    type(element_groups_t), intent(in) :: groups
    type(schedule_t), allocatable, intent(out) :: schedule(:, :)   !! [lanes, motors]
    integer :: i, lane

    allocate (schedule(groups%lanes, size(groups%indices)))
    do i = 1, size(groups%indices)
      do lane = 1, groups%lanes
        call schedule_supply(groups%input%groups(groups%indices(i)), schedule(lane, i))
      end do
    end do
  end subroutine find_schedules

  !> The share of the voltage of one motor: at each of its times a change to the next factor, within a ramp. Before the first one,
  !> and with the factor 0, the motor is disconnected.
  subroutine schedule_supply(group, schedule)
    type(group_t), intent(in) :: group
    type(schedule_t), intent(out) :: schedule
    real(wp), allocatable, dimension(:) :: factor, ramp, time
    real(wp) :: before
    integer :: k

    allocate (time, source=group%numbers('supply_times'))
    allocate (factor, source=group%numbers('supply_factors'))
    allocate (ramp, source=group%numbers('supply_ramps'))
    call schedule%append(time(1), 0.0_wp, 0.0_wp, .true.)
    before = 0.0_wp
    do k = 1, size(time)
      if (ramp(k) > 0) call schedule%append(time(k), before, (factor(k) - before) / ramp(k), .false.)
      call schedule%append(time(k) + ramp(k), factor(k), 0.0_wp, .not. factor(k) > 0)
      before = factor(k)
    end do
  end subroutine schedule_supply

  !> Refuses an odd number of poles, a voltage that is not positive, and a supply that contradicts itself.
  subroutine check_flux_motor(input, index, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(error_t), allocatable, intent(out) :: error

    associate (group => input%groups(index))
      if (modulo(group%whole_number('poles'), 2) == 1) then
        call raise(error, exit_input, input%location(index, 'poles') // ': poles = ' // to_text(group%whole_number('poles')) // &
                   '; allowed: an even number, twice the pole pairs')
      else if (.not. group%number('voltage') > 0) then
        call raise(error, exit_input, input%location(index, 'voltage') // ': voltage = ' // to_text(group%number('voltage')) // &
                   '; allowed: > 0 [V]')
      else if (group%has_value('supply_times')) then
        call check_supply(input, index, error)
      end if
    end associate
  end subroutine check_flux_motor

  !> Refuses a first factor of 0, and ramps that end after the next change.
  subroutine check_supply(input, index, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    associate (group => input%groups(index))
      associate (time => group%numbers('supply_times'), factor => group%numbers('supply_factors'), &
                 ramp => group%numbers('supply_ramps'))
        if (.not. factor(1) > 0) then
          call raise(error, exit_input, input%location(index, 'supply_factors') // ': ' // &
                     written_element(group, 'supply_factors', 1) // '; allowed: > 0, as the motor is disconnected before ' // &
                     written_element(group, 'supply_times', 1))
          return
        end if
        do k = 1, size(time) - 1
          if (time(k) + ramp(k) <= time(k + 1)) cycle
          call raise(error, exit_input, input%location(index, 'supply_ramps') // ': ' // &
                     written_element(group, 'supply_ramps', k) // ' from ' // written_element(group, 'supply_times', k) // &
                     ' ends after ' // written_element(group, 'supply_times', k + 1) // '; allowed: ramps that end before')
          return
        end do
      end associate
    end associate
  end subroutine check_supply

end module nocdyn_induction_assembly
