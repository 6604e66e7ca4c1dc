!> The groups &fatigue of an input: what they may ask for, and their S-N curves.
module nocdyn_fatigue_groups
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema_text, only: suggest
  use nocdyn_sn_curves, only: mean_none, mean_parabola, mean_strength, new_sn_curve, sn_curve_t
  use nocdyn_text, only: quoted, string_t, to_text
  use nocdyn_written_values, only: written_element, written_number, written_unit
  implicit none (type, external)
  private

  public :: check_fatigue, element_kind, fatigue_symbol, quantity_of, read_curve

  character(len=*), parameter :: kinds(*) = [character(len=8) :: 'coupling', 'shaft', 'mesh', 'gear']
  integer, parameter, public :: quantity_stress = 1, quantity_moment = 2   !! other ones: forces
  character(len=*), parameter :: quantities(*) = [character(len=6) :: 'stress', 'moment', 'force']
  character(len=*), parameter, public :: quantity_units(*) = [character(len=3) :: 'Pa', 'N m', 'N']

contains

  !> The kind of the element of a group: 'coupling', 'shaft', 'mesh' or 'gear'.
  pure function element_kind(group) result(kind)
    type(group_t), intent(in) :: group
    character(len=8) :: kind
    integer :: i

    do i = 1, size(kinds)
      kind = kinds(i)
      if (group%has_value(trim(kind))) return
    end do
  end function element_kind

  !> The quantity of the S-N curve of a group: quantity_...
  pure integer function quantity_of(group) result(quantity)
    type(group_t), intent(in) :: group

    do quantity = quantity_stress, quantity_moment
      if (group%has_value('reference_' // trim(quantities(quantity)))) return
      if (group%has_value('table_' // trim(quantities(quantity)))) return
    end do
  end function quantity_of

  !> The symbol of the signal whose cycles a group counts.
  pure function fatigue_symbol(group) result(symbol)
    type(group_t), intent(in) :: group
    character(len=12) :: symbol

    select case (quantity_of(group))
    case (quantity_stress)
      symbol = 'stress'
    case (quantity_moment)
      symbol = 'total_moment'
    case default
      symbol = merge('reaction', 'force   ', element_kind(group) == 'gear')
    end select
  end function fatigue_symbol

  !> Refuses elements that do not exist or have no such quantity, and values that do not fit together.
  subroutine check_fatigue(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    call check_element(input, index, diagnostics)
    call check_curve(input, index, diagnostics)
    call check_mean(input, index, diagnostics)
    call check_profile(input, index, diagnostics)
  end subroutine check_fatigue

  !> The element must exist and have the quantity.
  subroutine check_element(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: names(:)
    integer, allocatable :: candidates(:)
    character(len=:), allocatable :: hint
    character(len=8) :: kind
    integer :: i

    kind = element_kind(input%groups(index))
    associate (group => input%groups(index))
      allocate (candidates, source=input%groups_named(trim(kind)))
      allocate (names(size(candidates)))
      do i = 1, size(candidates)
        names(i)%text = input%groups(candidates(i))%name
        if (names(i)%text /= group%text(trim(kind))) cycle
        call check_quantity(input, index, input%groups(candidates(i)), diagnostics)
        return
      end do
      call suggest(group%text(trim(kind)), names, hint)
      call input%report(index, trim(kind), 'there is no ' // trim(kind) // ' ' // quoted(group%text(trim(kind))), diagnostics, &
                        hint=hint)
    end associate
  end subroutine check_element

  !> A coupling has a stress if its section is given, a gear a force if its radii are.
  subroutine check_quantity(input, index, element, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(group_t), intent(in) :: element
    type(diagnostics_t), intent(inout) :: diagnostics

    if (element%kind == 'coupling' .and. quantity_of(input%groups(index)) == quantity_stress) then
      if (element%has_value('section_modulus') .or. element%has_value('diameter')) return
      call input%report(index, 'coupling', 'a stress needs a section, but coupling ' // quoted(element%name) // &
                 ' has none; required: section_modulus [m3] or diameter [m] of &coupling, or ' // &
                 'a moment in place of the stress', diagnostics)
    else if (element%kind == 'gear') then
      if (element%has_value('radii')) return
      call input%report(index, 'gear', 'a tooth force needs radii, but gear ' // quoted(element%name) // &
                 ' has none; required: radii [m] of &gear', diagnostics)
    end if
  end subroutine check_quantity

  !> The half ranges of a table descend.
  subroutine check_curve(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    real(wp), allocatable :: half_range(:)
    character(len=18) :: key
    integer :: i

    associate (group => input%groups(index))
      if (group%has_value('slope')) return
      key = 'table_' // quantities(quantity_of(group))
      allocate (half_range, source=group%numbers(trim(key)))
      do i = 2, size(half_range)
        if (half_range(i) < half_range(i - 1)) cycle
        call input%report(index, trim(key), trim(key) // '(' // to_text(i) // ') = ' // to_text(half_range(i)) // &
                   ' is not less than the value before, ' // to_text(half_range(i - 1)) // &
                   '; needed: half ranges that descend', diagnostics)
        return
      end do
    end associate
  end subroutine check_curve

  !> The influence of the mean needs the strength, in stresses.
  subroutine check_mean(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=15) :: key

    associate (group => input%groups(index))
      select case (group%text('mean_stress'))
      case ('goodman', 'gerber')
        key = 'ultimate_stress'
      case ('soderberg')
        key = 'yield_stress'
      case default
        key = ''
        if (group%has_value('ultimate_stress')) key = 'ultimate_stress'
        if (group%has_value('yield_stress')) key = 'yield_stress'
        if (key /= '') call input%report(index, trim(key), trim(key) // &
                   " has no effect with mean_stress = 'none'; allowed: goodman and gerber with ultimate_stress, " // &
                   'soderberg with yield_stress', diagnostics)
        return
      end select
      if (quantity_of(group) /= quantity_stress) then
        call input%report(index, 'mean_stress', 'mean_stress = ' // quoted(group%text('mean_stress')) // &
                   ' needs an S-N curve of stresses, reference_stress, table_stress or stress_file', &
                   diagnostics)
      else if (.not. group%has_value(trim(key))) then
        call input%report(index, 'mean_stress', 'mean_stress = ' // quoted(group%text('mean_stress')) // ' needs ' // &
                   trim(key) // ' [Pa]', diagnostics)
      end if
    end associate
  end subroutine check_mean

  !> A profile has speeds of &response.
  subroutine check_profile(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, allocatable :: responses(:)
    real(wp), allocatable :: range(:), speeds(:)
    integer :: i

    allocate (speeds, source=input%groups(index)%numbers('profile_speeds'))
    if (size(speeds) == 0) return
    allocate (responses, source=input%groups_named('response'))
    if (size(responses) == 0) then
      call input%report(index, 'profile_speeds', 'profile_speeds are those of the body of ' // &
                 '&response; required: a group &response', diagnostics)
      return
    end if
    allocate (range, source=input%groups(responses(1))%numbers('speed'))
    if (size(range) == 0) then
      call input%report(index, 'profile_speeds', 'profile_speeds are for speeds, and &response is over the frequency of a ' // &
                        'shaker; required: speed of &response', diagnostics)
      return
    end if
    do i = 1, size(speeds)
      if (minval(range) <= speeds(i) .and. speeds(i) <= maxval(range)) cycle
      associate (group => input%groups(index))
        call input%report(index, 'profile_speeds', written_element(group, 'profile_speeds', i) // &
                   ' is outside of the speeds of &response; allowed: ' // written_number(group, 'profile_speeds', range(1)) // &
                   ' to ' // written_number(group, 'profile_speeds', range(size(range))) // ' [' // written_unit(group, &
                   'profile_speeds') // ']', diagnostics)
      end associate
      return
    end do
  end subroutine check_profile

  !> The S-N curve of a checked group.
  type(sn_curve_t) function read_curve(group) result(curve)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: cycles(:), half_range(:)
    character(len=6) :: name

    name = quantities(quantity_of(group))
    if (group%has_value('slope')) then
      curve = new_sn_curve([group%number('reference_cycles')], [group%number('reference_' // trim(name))], &
                           group%number('slope'), group%number('second_slope', absent=group%number('slope')))
    else
      allocate (cycles, source=group%numbers('table_cycles'))
      allocate (half_range, source=group%numbers('table_' // trim(name)))
      curve = new_sn_curve(cycles, half_range)
      if (group%text('extrapolation') == 'constant') curve%endurance = half_range(size(half_range))
    end if
    curve%endurance = max(curve%endurance, group%number('endurance_limit'))
    curve%notch_factor = group%number('notch_factor')
    select case (group%text('mean_stress'))
    case ('goodman', 'gerber')
      curve%mean_kind = merge(mean_parabola, mean_strength, group%text('mean_stress') == 'gerber')
      curve%strength = group%number('ultimate_stress')
    case ('soderberg')
      curve%mean_kind = mean_strength
      curve%strength = group%number('yield_stress')
    case default
      curve%mean_kind = mean_none
    end select
  end function read_curve

end module nocdyn_fatigue_groups
