!> The banks of couplings of an input: one for each form of the elastic moment that it has.
module nocdyn_coupling_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_body_index, only: body_index_t
  use nocdyn_couplings, only: new_couplings
  use nocdyn_element_parameters, only: curves_of, ends_of, names_of, values_of
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_gap_couplings, only: new_gap_couplings
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_couplings, only: elastic_coefficients, new_polynomial_couplings
  use nocdyn_saturated_couplings, only: new_saturated_couplings
  use nocdyn_table_couplings, only: new_table_couplings
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: add_couplings, check_couplings

  integer, parameter :: cubic = 1, slipping = 2, polynomial = 3, gap = 4, saturated = 5, table = 6   ! forms

  !> What all couplings of a bank have.
  type :: ends_t
    type(string_t), allocatable :: names(:)
    integer, allocatable :: from(:), to(:)
    real(wp), allocatable :: damping(:, :), rest_twist(:, :)
    real(wp), allocatable :: friction(:, :), friction_speed(:, :)   !! not allocated: none has friction
  end type ends_t

contains

  !> Refuses edges and limits without stiffness.
  subroutine check_couplings(input, error)
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: indices(:)
    integer :: i

    allocate (indices, source=input%groups_named('coupling'))
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        select case (form_of(group))
        case (gap)
          if (any(abs(coefficients_of(group)) > 0)) cycle
          call raise(error, exit_input, input%location(indices(i), 'gap') // ': gap needs an elastic moment at its edges: ' // &
                     'stiffness, cubic_stiffness or polynomial that is not 0')
        case (saturated)
          if (group%number('stiffness') > 0) cycle
          call raise(error, exit_input, input%location(indices(i), &
                                                       'saturation') // ': saturation needs a stiffness that is not 0')
        case default
          cycle
        end select
        return
      end associate
    end do
  end subroutine check_couplings

  pure integer function form_of(group)
    type(group_t), intent(in) :: group

    if (group%has_value('table_twist')) then
      form_of = table
    else if (group%has_value('saturation')) then
      form_of = saturated
    else if (group%number('gap', absent=0.0_wp) > 0) then
      form_of = gap
    else if (group%has_value('polynomial')) then
      form_of = polynomial
    else if (group%number('friction', absent=0.0_wp) > 0) then
      form_of = slipping
    else
      form_of = cubic
    end if
  end function form_of

  pure function coefficients_of(group) result(coefficients)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: coefficients(:)

    allocate (coefficients, source=elastic_coefficients(group%number('stiffness', absent=0.0_wp), &
              group%number('cubic_stiffness', absent=0.0_wp), group%numbers('polynomial')))
  end function coefficients_of

  !> A bank of cubic couplings in any case, the others where there are such couplings.
  subroutine add_couplings(input, body_index, lanes, banks)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    integer, intent(in) :: lanes
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer, allocatable :: indices(:), some(:)
    integer :: form, i

    allocate (indices, source=input%groups_named('coupling'))
    do form = cubic, table
      some = pack(indices, [(form_of(input%groups(indices(i))) == form, i=1, size(indices))])
      if (form == cubic .or. size(some) > 0) call add_form(input, some, lanes, form, body_index, banks)
    end do
  end subroutine add_couplings

  !> A bank of the couplings of one form.
  subroutine add_form(input, indices, lanes, form, body_index, banks)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes, form
    type(body_index_t), intent(in) :: body_index
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(ends_t) :: at

    at = all_ends(input, indices, lanes, body_index)
    select case (form)
    case (cubic, slipping)
      call append_bank(banks, new_couplings(at%names, at%from, at%to, values_of(input, indices, lanes, 'stiffness'), &
                                            values_of(input, indices, lanes, 'cubic_stiffness'), at%damping, at%rest_twist, &
                                            at%friction, at%friction_speed))
    case (polynomial)
      call append_bank(banks, new_polynomial_couplings(at%names, at%from, at%to, all_coefficients(input, indices, lanes), &
                                                       at%damping, at%rest_twist, at%friction, at%friction_speed))
    case (gap)
      call append_bank(banks, new_gap_couplings(at%names, at%from, at%to, all_coefficients(input, indices, lanes), at%damping, &
                                                at%rest_twist, values_of(input, indices, lanes, 'gap'), &
                                                at%friction, at%friction_speed))
    case (saturated)
      call append_bank(banks, new_saturated_couplings(at%names, at%from, at%to, values_of(input, indices, lanes, 'stiffness'), &
                                                      values_of(input, indices, lanes, 'saturation'), at%damping, &
                                                      at%rest_twist, at%friction, at%friction_speed))
    case default
      call append_bank(banks, new_table_couplings(at%names, at%from, at%to, &
                                                  curves_of(input, indices, lanes, 'table_twist', 'table_moment'), at%damping, &
                                                  at%rest_twist, at%friction, at%friction_speed))
    end select
  end subroutine add_form

  function all_ends(input, indices, lanes, body_index) result(at)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    type(body_index_t), intent(in) :: body_index
    type(ends_t) :: at
    real(wp) :: friction(lanes, size(indices))

    allocate (at%names, source=names_of(input, indices))
    allocate (at%from, source=ends_of(input, indices, 'bodies', 1, body_index))
    allocate (at%to, source=ends_of(input, indices, 'bodies', 2, body_index))
    allocate (at%damping, source=values_of(input, indices, lanes, 'damping'))
    allocate (at%rest_twist, source=values_of(input, indices, lanes, 'rest_twist'))
    friction = values_of(input, indices, lanes, 'friction')
    if (.not. any(friction > 0)) return
    allocate (at%friction, source=friction)
    allocate (at%friction_speed, source=values_of(input, indices, lanes, 'friction_speed', absent=1.0_wp))
  end function all_ends

  !> p_1, p_2, ... of all couplings, [order, lanes, couplings].
  function all_coefficients(input, indices, lanes) result(coefficients)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    real(wp), allocatable :: coefficients(:, :, :)
    integer :: i, order

    order = maxval([(size(coefficients_of(input%groups(indices(i)))), i=1, size(indices))])
    allocate (coefficients(order, lanes, size(indices)), source=0.0_wp)
    do i = 1, size(indices)
      associate (one => coefficients_of(input%groups(indices(i))))
        coefficients(:size(one), :, i) = spread(one, 2, lanes)
      end associate
    end do
  end function all_coefficients

end module nocdyn_coupling_assembly
