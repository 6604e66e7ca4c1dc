!> The banks of couplings of an input: one for each form of the elastic moment that it has.
module nocdyn_coupling_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_couplings, only: new_couplings
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_gap_couplings, only: new_gap_couplings
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_maxwell_couplings, only: new_maxwell_couplings
  use nocdyn_polynomial_couplings, only: elastic_coefficients, new_polynomial_couplings
  use nocdyn_rubber_couplings, only: new_rubber_couplings
  use nocdyn_rubber_laws, only: new_factors, rubber_law_t
  use nocdyn_saturated_couplings, only: new_saturated_couplings
  use nocdyn_table_couplings, only: new_table_couplings
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: coupling_form, add_coupling_form, check_coupling, is_rubber, new_rubber_law

  integer, parameter :: cubic = 1, slipping = 2, polynomial = 3, gap = 4, saturated = 5, table = 6, maxwell = 7, rubber = 8
  integer, parameter :: elastic_forms = 8   ! these forms with relative damping follow

contains

  !> Refuses gaps and saturations without stiffness, and gaps of which a power is beyond all numbers.
  subroutine check_coupling(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: obstacle

    associate (group => input%groups(index))
      call check_relative_damping(input, index, diagnostics)
      if (is_rubber(group)) call check_rubber(input, index, diagnostics)
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

  !> Refuses rubber without stiffness, and conditions whose numbers are missing.
  subroutine check_rubber(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (group => input%groups(index))
      if (.not. group%number('stiffness', absent=0.0_wp) > 0) call input%report(index, 'kind', &
        "kind = 'rubber' needs stiffness > 0 [N m/rad]", diagnostics)
      if (group%flag('limits') .and. .not. (group%has_value('maximum_torque') .or. group%has_value('vibratory_torque') .or. &
                                            group%has_value('power_loss'))) then
        call input%report(index, 'limits', 'limits need maximum_torque [N m], vibratory_torque [N m] or power_loss [W]', &
                          diagnostics)
      end if
      if (thermal_resistance(group) > 0 .and. .not. group%has_value('ambient_temperature')) call input%report(index, 'kind', &
        'its temperature by its power needs ambient_temperature [degC]', diagnostics)
      if (.not. group%has_value('condition')) return
      select case (group%text('condition'))
      case ('steady')
        if (thermal_resistance(group) > 0) return
        call input%report(index, 'condition', "condition = 'steady' needs thermal_resistance [K/W], or power_loss [W] and " // &
                          'power_loss_rise [K]', diagnostics)
      case ('warm')
        if (group%has_value('warm_temperature') .or. group%has_value('warm_stiffness') .or. &
            group%has_value('warm_damping')) return
        call input%report(index, 'condition', "condition = 'warm' needs warm_temperature [degC] beside table_temperature, " // &
                          'or warm_stiffness [N m/rad] and warm_damping', diagnostics)
      case default   ! cold needs nothing
      end select
    end associate
  end subroutine check_rubber

  !> Whether a group &coupling is one by a data sheet.
  pure logical function is_rubber(group)
    type(group_t), intent(in) :: group

    is_rubber = group%kind == 'coupling'
    if (is_rubber) is_rubber = group%text('kind') == 'rubber'
  end function is_rubber

  !> The law of a rubber coupling, but for its number in the machine. Over the time it has one frequency, the one of its damping.
  type(rubber_law_t) function new_rubber_law(group) result(law)
    type(group_t), intent(in) :: group   !! &coupling of kind rubber
    character(len=:), allocatable :: condition

    law%by_torque = new_factors(group%numbers('table_torque'), group%numbers('torque_stiffness'), group%numbers('torque_damping'))
    law%by_amplitude = new_factors(group%numbers('table_amplitude'), group%numbers('amplitude_stiffness'), &
                                   group%numbers('amplitude_damping'))
    law%by_frequency = new_factors(group%numbers('table_frequency'), group%numbers('frequency_stiffness'), &
                                   group%numbers('frequency_damping'))
    law%by_temperature = new_factors(group%numbers('table_temperature'), group%numbers('temperature_stiffness'), &
                                     group%numbers('temperature_damping'))
    law%ambient = group%number('ambient_temperature', absent=0.0_wp)
    law%temperature = law%ambient
    law%resistance = thermal_resistance(group)
    condition = merge('steady', 'cold  ', law%resistance > 0)
    if (group%has_value('condition')) condition = group%text('condition')
    law%heats_up = condition == 'steady'
    if (condition == 'warm') then
      law%temperature = group%number('warm_temperature', absent=law%ambient)
      if (.not. group%has_value('warm_temperature')) law%by_temperature%are_given = .false.   ! its values have the factors
    end if
    law%base = [law%by_temperature%stiffness(law%temperature), &
                law%by_temperature%damping(law%temperature) * law%by_torque%damping(0.0_wp)]
    if (group%has_value('damping_frequency')) law%base = law%base * &
      [law%by_frequency%stiffness(group%number('damping_frequency')), law%by_frequency%damping(group%number('damping_frequency'))]
  end function new_rubber_law

  !> The rise of the temperature of a coupling by its power [K/W]; 0 if it is not known.
  pure real(wp) function thermal_resistance(group) result(resistance)
    type(group_t), intent(in) :: group   !! &coupling of kind rubber

    resistance = group%number('thermal_resistance', absent=0.0_wp)
    if (resistance > 0 .or. .not. (group%has_value('power_loss') .and. group%has_value('power_loss_rise'))) return
    resistance = group%number('power_loss_rise') / group%number('power_loss')
  end function thermal_resistance

  !> Form of the law of a group &coupling.
  pure integer function coupling_form(group)
    type(group_t), intent(in) :: group

    associate (is_relative => group%number('relative_damping', absent=0.0_wp) > 0 .or. group%has_value('magnifier') .or. &
               is_rubber(group))
      coupling_form = elastic_form(group) + merge(elastic_forms, 0, is_relative)
    end associate
  end function coupling_form

  !> Form of the elastic moment.
  pure integer function elastic_form(group) result(coupling_form)
    type(group_t), intent(in) :: group

    if (group%has_value('table_twist')) then
      coupling_form = table
    else if (group%has_value('table_torque')) then
      coupling_form = rubber
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

    select case (modulo(form - 1, elastic_forms) + 1)
    case (cubic, slipping)
      call append_bank(banks, new_couplings(groups))
    case (polynomial)
      call append_bank(banks, new_polynomial_couplings(groups))
    case (gap)
      call append_bank(banks, new_gap_couplings(groups))
    case (saturated)
      call append_bank(banks, new_saturated_couplings(groups))
    case (maxwell)
      call append_bank(banks, new_maxwell_couplings(groups))
    case (rubber)
      call append_bank(banks, new_rubber_couplings(groups))
    case default
      call append_bank(banks, new_table_couplings(groups))
    end select
    if (form > elastic_forms) banks(size(banks))%bank%parameters%is_key = .false.   ! the damping depends on the stiffness
  end subroutine add_coupling_form

end module nocdyn_coupling_assembly
