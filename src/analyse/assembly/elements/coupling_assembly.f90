!> The banks of couplings of an input: one for each form of the elastic moment that it has.
module nocdyn_coupling_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_couplings, only: coupling_common_t, new_couplings
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_element_rows, only: rows_between
  use nocdyn_gap_couplings, only: new_gap_couplings
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_maxwell_couplings, only: new_maxwell_couplings
  use nocdyn_polynomial_couplings, only: elastic_coefficients, new_polynomial_couplings
  use nocdyn_saturated_couplings, only: new_saturated_couplings
  use nocdyn_table_couplings, only: new_table_couplings
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: coupling_form, add_coupling_form, check_coupling

  integer, parameter :: cubic = 1, slipping = 2, polynomial = 3, gap = 4, saturated = 5, table = 6, maxwell = 7   ! forms
  integer, parameter :: elastic_forms = 7   ! these forms with relative damping follow

contains

  !> Refuses gaps and saturations without stiffness, and gaps of which a power is beyond all numbers.
  subroutine check_coupling(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: obstacle

    associate (group => input%groups(index))
      call check_relative_damping(input, index, diagnostics)
      select case (elastic_form(group))
      case (gap)
        call find_gap_obstacle(coefficients_of(group), group%number('gap'), obstacle)
        if (obstacle == '') return
        call input%report(index, 'gap', 'gap = ' // to_text(group%number('gap')) // obstacle, diagnostics)
      case (saturated)
        if (group%number('stiffness') > 0) return
        call input%report(index, 'saturation', 'saturation = ' // to_text(group%number('saturation')) // &
                   ' needs stiffness > 0 [N m/rad]', diagnostics)
      case default
        return
      end select
    end associate
  end subroutine check_coupling

  !> What is wrong with the stiffness sum |p_k| gap^(k - 1) at the edges of a gap, '' if nothing is.
  pure subroutine find_gap_obstacle(coefficient, width, text)
    real(wp), intent(in) :: coefficient(:)   !! p_k [N m/rad^k]
    real(wp), intent(in) :: width            !! of the gap [rad]
    character(len=:), allocatable, intent(out) :: text
    real(wp), parameter :: largest_exponent = 200.0_wp   ! in 1e-200 to 1e200
    real(wp) :: exponent
    integer :: k

    exponent = -huge(exponent)
    do k = 1, size(coefficient)
      if (abs(coefficient(k)) > 0) exponent = max(exponent, log10(abs(coefficient(k))) + (k - 1) * log10(width))
    end do
    text = ''
    if (exponent <= -huge(exponent)) then
      text = ' needs an elastic moment at its edges: stiffness, cubic_stiffness or polynomial that is not 0'
    else if (abs(exponent) > largest_exponent) then
      text = ' gives its edges a stiffness of about 1e' // to_text(nint(exponent)) // &
             ' N m/rad; allowed: with cubic_stiffness or polynomial, one from 1e-200 to 1e200'
    end if
  end subroutine find_gap_obstacle

  !> Refuses damping over the time in proportion to a stiffness that is not given.
  subroutine check_relative_damping(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (group => input%groups(index))
      if (.not. group%has_value('damping_frequency') .or. group%number('stiffness', absent=0.0_wp) > 0) return
      call input%report(index, 'damping_frequency', 'damping_frequency needs stiffness > 0 ' // &
                 '[N m/rad], in proportion to which relative damping acts over the time', diagnostics)
    end associate
  end subroutine check_relative_damping

  !> The loss factor psi / (2 pi) = 1 / M of a group &coupling; 0 without relative damping.
  pure real(wp) function loss_factor_of(group) result(factor)
    type(group_t), intent(in) :: group
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)

    factor = group%number('relative_damping', absent=0.0_wp) / turn
    if (group%has_value('magnifier')) factor = 1.0_wp / group%number('magnifier')
  end function loss_factor_of

  !> Form of the law of a group &coupling.
  pure integer function coupling_form(group)
    type(group_t), intent(in) :: group

    coupling_form = elastic_form(group)
    if (loss_factor_of(group) > 0) coupling_form = coupling_form + elastic_forms
  end function coupling_form

  !> Form of the elastic moment.
  pure integer function elastic_form(group) result(coupling_form)
    type(group_t), intent(in) :: group

    if (group%has_value('table_twist')) then
      coupling_form = table
    else if (group%has_value('maxwell_stiffness')) then
      coupling_form = maxwell
    else if (group%has_value('saturation')) then
      coupling_form = saturated
    else if (group%number('gap', absent=0.0_wp) > 0) then
      coupling_form = gap
    else if (group%has_value('polynomial')) then
      coupling_form = polynomial
    else if (group%number('friction', absent=0.0_wp) > 0) then
      coupling_form = slipping
    else
      coupling_form = cubic
    end if
  end function elastic_form

  !> p_1, p_2, ... [N m/rad^k] of a group &coupling.
  pure function coefficients_of(group) result(coefficients)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: coefficients(:)

    allocate (coefficients, source=elastic_coefficients(group%number('stiffness', absent=0.0_wp), &
              group%number('cubic_stiffness', absent=0.0_wp), group%numbers('polynomial')))
  end function coefficients_of

  !> Adds the bank of the couplings of one form.
  subroutine add_coupling_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(coupling_common_t) :: shared
    real(wp), allocatable :: damping(:, :)
    integer :: i

    shared = common_of(groups)
    select case (modulo(form - 1, elastic_forms) + 1)
    case (cubic, slipping)
      call append_bank(banks, new_couplings(shared, groups%values('stiffness'), groups%values('cubic_stiffness')))
    case (polynomial)
      call append_bank(banks, new_polynomial_couplings(shared, all_coefficients(groups)))
    case (gap)
      call append_bank(banks, new_gap_couplings(shared, all_coefficients(groups), groups%values('gap'), &
                                                  groups%values('stiffness')))
    case (saturated)
      call append_bank(banks, new_saturated_couplings(shared, groups%values('stiffness'), groups%values('saturation')))
    case (maxwell)
      call append_bank(banks, new_maxwell_couplings(shared, groups%values('stiffness'), groups%values('cubic_stiffness'), &
                                                    branches(groups, 'maxwell_stiffness', 0.0_wp), &
                                                    branches(groups, 'maxwell_time', 1.0_wp)))
    case default
      call append_bank(banks, new_table_couplings(shared, groups%curves('table_twist', 'table_moment')))
    end select
    if (form <= elastic_forms) return
    associate (bank => banks(size(banks))%bank)
      bank%loss_factor = [(loss_factor_of(groups%input%groups(groups%indices(i))), i=1, size(groups%indices))]
      damping = loss_damping(groups)
      bank%loss_damping = damping(1, :)
      bank%parameters%is_key = .false.   ! the damping depends on the stiffness
    end associate
  end subroutine add_coupling_form

  !> The numbers of the Maxwell branches of all couplings, [lanes, couplings, branches].
  function branches(groups, key, absent) result(values)
    type(element_groups_t), intent(in) :: groups
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: absent   !! of a coupling with fewer branches
    real(wp), allocatable :: values(:, :, :)
    integer :: i, most

    most = maxval([(size(groups%input%groups(groups%indices(i))%numbers(key)), i=1, size(groups%indices))])
    allocate (values(groups%lanes, size(groups%indices), most), source=absent)
    do i = 1, size(groups%indices)
      associate (one => groups%input%groups(groups%indices(i))%numbers(key))
        values(:, i, :size(one)) = spread(one, 1, groups%lanes)
      end associate
    end do
  end function branches

  !> The viscous damping that has the loss of relative damping at `damping_frequency` [N m s/rad], [lanes, couplings].
  function loss_damping(groups) result(damping)
    type(element_groups_t), intent(in) :: groups
    real(wp) :: damping(groups%lanes, size(groups%indices))
    integer :: i

    damping = 0.0_wp
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        if (.not. group%has_value('damping_frequency')) cycle
        damping(:, i) = loss_factor_of(group) * group%number('stiffness') / group%number('damping_frequency')
      end associate
    end do
  end function loss_damping

  !> What the constructors of all forms take.
  type(coupling_common_t) function common_of(groups) result(shared)
    type(element_groups_t), intent(in) :: groups
    real(wp), parameter :: pi = acos(-1.0_wp)
    real(wp), dimension(groups%lanes, size(groups%indices)) :: friction, modulus
    integer :: i

    allocate (shared%names, source=groups%names)
    shared%rows = rows_between(groups%bodies('bodies', 1), groups%bodies('bodies', 2))
    allocate (shared%damping, source=groups%values('damping') + loss_damping(groups))
    allocate (shared%rest_twist, source=groups%values('rest_twist'))
    ! section moduli against torsion pi (D^4 - d^4) / (16 D) [m3], 0 where the diameter is unknown, [lanes, couplings]
    modulus = groups%values('section_modulus')
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        if (group%has_value('diameter')) then
          associate (outer => group%number('diameter'), inner => group%number('bore', absent=0.0_wp))
            modulus(:, i) = pi / 16.0_wp * (outer**4 - inner**4) / outer
          end associate
        end if
      end associate
    end do
    if (any(modulus > 0)) allocate (shared%section_modulus, source=modulus)
    friction = groups%values('friction')
    if (.not. any(friction > 0)) return
    allocate (shared%friction, source=friction)
    allocate (shared%friction_speed, source=groups%values('friction_speed', absent=1.0_wp))
  end function common_of

  !> p_1, p_2, ... of all couplings, [order, lanes, couplings].
  function all_coefficients(groups) result(coefficients)
    type(element_groups_t), intent(in) :: groups
    real(wp), allocatable :: coefficients(:, :, :)
    integer :: i, order

    order = maxval([(size(coefficients_of(groups%input%groups(groups%indices(i)))), i=1, size(groups%indices))])
    allocate (coefficients(order, groups%lanes, size(groups%indices)), source=0.0_wp)
    do i = 1, size(groups%indices)
      associate (one => coefficients_of(groups%input%groups(groups%indices(i))))
        coefficients(:size(one), :, i) = spread(one, 2, groups%lanes)
      end associate
    end do
  end function all_coefficients

end module nocdyn_coupling_assembly
