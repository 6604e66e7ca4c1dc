!> The banks of motors of an input: one for each form of their laws that it has.
module nocdyn_motor_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_body_index, only: body_index_t
  use nocdyn_curve_motors, only: new_curve_motors
  use nocdyn_dc_motors, only: new_dc_motors
  use nocdyn_element_parameters, only: curves_of, ends_of, names_of, values_of
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_governed_motors, only: new_governed_motors
  use nocdyn_governors, only: governor_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_motors, only: new_motors
  use nocdyn_text, only: string_t, to_text
  use nocdyn_torque_curves, only: induction_curve_t, quadratic_curve_t, table_curve_t, torque_curve_t
  implicit none (type, external)
  private

  public :: add_motors, check_motors

  integer, parameter :: quadratic = 1, induction = 2, table = 3, inductive = 4   ! forms

contains

  !> Refuses induction motors that would drive away from their synchronous speed.
  subroutine check_motors(input, error)
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: indices(:)
    integer :: i

    allocate (indices, source=input%groups_named('motor'))
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        if (form_of(group) /= induction) cycle
        associate (torque => group%number('breakdown_torque'), speed => group%number('synchronous_speed'))
          if ((torque > 0 .and. speed > 0) .or. (torque < 0 .and. speed < 0)) cycle
          call raise(error, exit_input, input%location(indices(i), 'breakdown_torque') // ': breakdown_torque = ' // &
                     to_text(torque) // ' must have the sign of synchronous_speed = ' // to_text(speed))
          return
        end associate
      end associate
    end do
  end subroutine check_motors

  !> A motor with constant torque is a quadratic one, and so is a dc motor without inductance.
  pure integer function form_of(group)
    type(group_t), intent(in) :: group

    select case (group%text('kind'))
    case ('induction')
      form_of = induction
    case ('table')
      form_of = table
    case ('dc')
      form_of = merge(inductive, quadratic, group%number('inductance') > 0)
    case default
      form_of = quadratic
    end select
  end function form_of

  !> A bank of quadratic motors without governors in any case, the others where there are such motors.
  subroutine add_motors(input, body_index, lanes, banks)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    integer, intent(in) :: lanes
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer, allocatable :: free(:), governed(:), indices(:), some(:)
    integer :: form, i

    allocate (indices, source=input%groups_named('motor'))
    do form = quadratic, inductive
      some = pack(indices, [(form_of(input%groups(indices(i))) == form, i=1, size(indices))])
      free = pack(some, [(.not. input%groups(some(i))%has_value('governor_speed'), i=1, size(some))])
      governed = pack(some, [(input%groups(some(i))%has_value('governor_speed'), i=1, size(some))])
      if (form == quadratic .or. size(free) > 0) call add_free(input, free, lanes, form, body_index, banks)
      if (size(governed) > 0) call add_governed(input, governed, lanes, form, body_index, banks)
    end do
  end subroutine add_motors

  subroutine add_free(input, indices, lanes, form, body_index, banks)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes, form
    type(body_index_t), intent(in) :: body_index
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(string_t), allocatable :: names(:)
    class(torque_curve_t), allocatable :: curve
    integer :: body(size(indices))

    allocate (names, source=names_of(input, indices))
    body = ends_of(input, indices, 'body', 1, body_index)
    select case (form)
    case (quadratic)
      call append_bank(banks, new_motors(names, body, standstill_torques(input, indices, lanes), &
                                         values_of(input, indices, lanes, 'b') + drags(input, indices, lanes), &
                                         values_of(input, indices, lanes, 'c')))
    case (inductive)
      call add_inductive(input, indices, lanes, names, body, banks)
    case default
      call make_curve(input, indices, lanes, form, curve)
      call append_bank(banks, new_curve_motors(names, body, lanes, curve))
    end select
  end subroutine add_free

  subroutine add_governed(input, indices, lanes, form, body_index, banks)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes, form
    type(body_index_t), intent(in) :: body_index
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(string_t), allocatable :: names(:)
    class(torque_curve_t), allocatable :: curve
    type(governor_t) :: governor
    integer :: body(size(indices))

    allocate (names, source=names_of(input, indices))
    body = ends_of(input, indices, 'body', 1, body_index)
    allocate (governor%set_speed, source=values_of(input, indices, lanes, 'governor_speed'))
    allocate (governor%gain, source=values_of(input, indices, lanes, 'governor_gain'))
    allocate (governor%time, source=values_of(input, indices, lanes, 'governor_time'))
    allocate (governor%start, source=values_of(input, indices, lanes, 'governor_start'))
    if (form == inductive) then
      call add_inductive(input, indices, lanes, names, body, banks, governor)
    else
      call make_curve(input, indices, lanes, form, curve)
      call append_bank(banks, new_governed_motors(names, body, curve, governor, drags(input, indices, lanes)))
    end if
  end subroutine add_governed

  subroutine add_inductive(input, indices, lanes, names, body, banks, governor)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(governor_t), intent(in), optional :: governor   !! no motor has one if absent

    call append_bank(banks, new_dc_motors(names, body, values_of(input, indices, lanes, 'voltage'), &
                                          values_of(input, indices, lanes, 'resistance'), &
                                          values_of(input, indices, lanes, 'flux_constant'), &
                                          values_of(input, indices, lanes, 'inductance'), governor))
  end subroutine add_inductive

  subroutine make_curve(input, indices, lanes, form, curve)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes, form
    class(torque_curve_t), allocatable, intent(out) :: curve
    type(induction_curve_t) :: kloss
    type(quadratic_curve_t) :: parabola
    type(table_curve_t) :: points

    select case (form)
    case (quadratic)
      allocate (parabola%a, source=standstill_torques(input, indices, lanes))
      allocate (parabola%b, source=values_of(input, indices, lanes, 'b'))
      allocate (parabola%c, source=values_of(input, indices, lanes, 'c'))
      allocate (curve, source=parabola)
    case (induction)
      allocate (kloss%breakdown_torque, source=values_of(input, indices, lanes, 'breakdown_torque'))
      allocate (kloss%breakdown_slip, source=values_of(input, indices, lanes, 'breakdown_slip'))
      allocate (kloss%synchronous_speed, source=values_of(input, indices, lanes, 'synchronous_speed'))
      allocate (curve, source=kloss)
    case default
      allocate (points%curve, source=curves_of(input, indices, lanes, 'table_speed', 'table_torque'))
      allocate (curve, source=points)
    end select
  end subroutine make_curve

  !> a of quadratic motors, the torque of constant ones, k voltage / resistance of dc motors without inductance.
  function standstill_torques(input, indices, lanes) result(torques)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    real(wp) :: torques(lanes, size(indices))

    torques = values_of(input, indices, lanes, 'a') + values_of(input, indices, lanes, 'torque') &
              + values_of(input, indices, lanes, 'flux_constant') * values_of(input, indices, lanes, 'voltage') &
              / values_of(input, indices, lanes, 'resistance', absent=1.0_wp)
  end function standstill_torques

  !> k^2 / resistance of dc motors without inductance, which no throttle changes [N m s/rad].
  function drags(input, indices, lanes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    real(wp) :: drags(lanes, size(indices))

    drags = values_of(input, indices, lanes, 'flux_constant')**2 / values_of(input, indices, lanes, 'resistance', absent=1.0_wp)
  end function drags

end module nocdyn_motor_assembly
