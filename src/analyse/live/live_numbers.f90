!> The numbers of an input that another program may give values: before a machine starts, or also while it moves.
module nocdyn_live_numbers
  use nocdyn_direct_parameters, only: direct_parameters_t, new_direct_parameters
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_reduced, only: reduced_t
  use nocdyn_schema, only: first_key, group_rules, key_rules
  use nocdyn_schema_rules, only: a_number, in_machine, in_torques
  use nocdyn_targets, only: find_target, target_t
  implicit none (type, external)
  private

  public :: find_direct, list_live_numbers

  integer, parameter, public :: change_at_start = 0    !! by a setting, before the machine is assembled
  integer, parameter, public :: change_in_motion = 1   !! also while it moves
  integer, parameter, public :: change_by_torque = 2   !! the torque of an excitation of the kind 'external'
  integer, parameter, public :: change_as_set_point = 3   !! also while it moves, to any sign: the set speed of a governor

  !> A number that is given in the group of an element.
  type, public :: live_number_t
    character(len=:), allocatable :: path      !! such as 'load.work.viscous'
    character(len=:), allocatable :: unit      !! '' if it has none
    character(len=:), allocatable :: caption
    real(wp) :: value = 0.0_wp                 !! in its unit
    integer :: change = change_at_start        !! when it may change
  end type live_number_t

contains

  !> The single numbers that the groups of bodies, couplings, joints and torques give, in their order.
  subroutine list_live_numbers(input, formulation, numbers)
    type(input_t), intent(in) :: input
    class(formulation_t), intent(in) :: formulation
    type(live_number_t), allocatable, intent(out) :: numbers(:)
    type(live_number_t) :: number
    logical :: is_listed
    integer :: g, k

    allocate (numbers(0))
    do g = 1, size(input%groups)
      associate (group => input%groups(g))
        if (group%name == '' .or. all(group_rules(group%rule)%topic /= [in_machine, in_torques])) cycle
        do k = 1, size(group%values)
          associate (rule => key_rules(first_key(group%rule) + k - 1), value => group%values(k))
            if (rule%value_type /= a_number .or. rule%count /= 1 .or. .not. value%is_given) cycle
            if (.not. allocated(value%numbers)) cycle
            call describe_number(input, formulation, group, trim(rule%name), number, is_listed)
            if (is_listed) numbers = [numbers, number]
          end associate
        end do
      end associate
    end do
  end subroutine list_live_numbers

  subroutine describe_number(input, formulation, group, key, number, is_listed)
    type(input_t), intent(in) :: input
    class(formulation_t), intent(in) :: formulation
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    type(live_number_t), intent(out) :: number
    logical, intent(out) :: is_listed   !! whether a path leads to it
    type(direct_parameters_t) :: place
    type(target_t) :: target(1)
    character(len=:), allocatable :: message

    number%path = group%kind // '.' // group%name // '.' // key
    call find_target(input, number%path, target(1), message)
    is_listed = message == ''
    if (.not. is_listed) return
    number%unit = target(1)%unit
    number%caption = target(1)%long_name
    number%value = group%number(key)
    call find_direct(input, target, formulation, place)
    if (place%are_direct) number%change = merge(change_as_set_point, change_in_motion, place%is_set_point(1))
    if (group%kind == 'excitation' .and. key == 'amplitude') then
      if (group%text('kind') == 'external') number%change = change_by_torque
    end if
  end subroutine describe_number

  !> Where a number stands that may change while the machine moves, if it may.
  subroutine find_direct(input, target, formulation, place)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target(1)
    class(formulation_t), intent(in) :: formulation
    type(direct_parameters_t), intent(out) :: place   !! `are_direct` is false if it may not

    select type (formulation)
    class is (reduced_t)
      place = new_direct_parameters(input, target, formulation%machine, has_started=.true.)
    class default   ! has no laws that are evaluated anew
    end select
  end subroutine find_direct

end module nocdyn_live_numbers
