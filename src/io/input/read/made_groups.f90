!> Groups that an input does not have, but that others stand for: the body and the coupling of a &damper, the &limit of a
!> &coupling by its data sheet. They come last. The assembly sets the numbers of the parts of dampers.
module nocdyn_made_groups
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_schema, only: first_key, group_rule_index, has_word, key_rules, last_key, selector_rule
  use nocdyn_schema_rules, only: required, unset
  use nocdyn_value_conversion, only: default_value
  implicit none (type, external)
  private

  public :: make_groups

contains

  !> Adds the groups, and gives limits of dampers the couplings of these.
  subroutine make_groups(input)
    type(input_t), intent(inout) :: input   !! checked
    type(group_t), allocatable :: groups(:)
    integer, allocatable :: couplings(:), dampers(:)
    integer :: d, g, n

    allocate (dampers, source=input%groups_named('damper'))
    allocate (couplings, source=input%groups_named('coupling', 'rubber'))
    couplings = pack(couplings, [(input%groups(couplings(d))%flag('limits'), d=1, size(couplings))])
    if (size(dampers) + size(couplings) == 0) return
    n = size(input%groups)
    allocate (groups(n + 2 * size(dampers) + size(couplings)))
    do g = 1, n
      groups(g) = input%groups(g)
      if (groups(g)%kind == 'limit') call take_coupling(groups(g))
    end do
    do d = 1, size(dampers)
      associate (damper => input%groups(dampers(d)))
        call start_group('body', dampers(d), damper, groups(n + d))
        call set_text(groups(n + d), 'name', damper%name)
        groups(n + d)%values(groups(n + d)%key_position('inertia'))%numbers = [damper%number('ring_inertia')]
        call start_group('coupling', dampers(d), damper, groups(n + size(dampers) + d))
        call set_text(groups(n + size(dampers) + d), 'name', damper%name)
        call set_text(groups(n + size(dampers) + d), 'bodies', damper%text('body'), damper%name)
      end associate
    end do
    do g = 1, size(couplings)
      call make_limit(input%groups(couplings(g)), couplings(g), groups(n + 2 * size(dampers) + g))
    end do
    call move_alloc(groups, input%groups)
  end subroutine make_groups

  !> The limits of the data sheet of a coupling.
  subroutine make_limit(coupling, number, limit)
    type(group_t), intent(in) :: coupling
    integer, intent(in) :: number   !! of the group in the file
    type(group_t), intent(out) :: limit
    character(len=*), parameter :: from(*) = [character(len=16) :: 'maximum_torque', 'vibratory_torque', 'power_loss']
    character(len=*), parameter :: to(*) = [character(len=16) :: 'moment', 'vibratory_moment', 'heat']
    integer :: k

    call start_group('limit', number, coupling, limit)
    limit%name = ''
    call set_text(limit, 'coupling', coupling%name)
    do k = 1, size(from)
      if (.not. coupling%has_value(trim(from(k)))) cycle
      limit%values(limit%key_position(trim(to(k)))) = coupling%values(coupling%key_position(trim(from(k))))
    end do
  end subroutine make_limit

  !> Names the coupling of a damper where a limit names the damper.
  subroutine take_coupling(limit)
    type(group_t), intent(inout) :: limit   !! &limit

    if (.not. limit%has_value('damper')) return
    call set_text(limit, 'coupling', limit%text('damper'))
    limit%values(limit%key_position('coupling'))%is_derived = .true.
  end subroutine take_coupling

  !> A group with the defaults of its default kind.
  subroutine start_group(kind, number, source, group)
    character(len=*), intent(in) :: kind
    integer, intent(in) :: number          !! of the group in the file
    type(group_t), intent(in) :: source    !! this group
    type(group_t), intent(out) :: group
    character(len=:), allocatable :: word
    integer :: k, rule

    group%kind = kind
    group%name = source%name
    group%rule = group_rule_index(kind)
    group%line = source%line
    group%made_from = number
    word = ''
    if (selector_rule(group%rule) > 0) word = key_rules(selector_rule(group%rule))%default
    if (word /= '') word = word(2:len_trim(word) - 1)   ! without its quotes
    allocate (group%values(last_key(group%rule) - first_key(group%rule) + 1))
    do k = 1, size(group%values)
      rule = first_key(group%rule) + k - 1
      if (key_rules(rule)%default == required .or. key_rules(rule)%default == unset) cycle
      if (key_rules(rule)%only_if /= '' .and. .not. has_word(key_rules(rule)%only_if, word)) cycle
      group%values(k) = default_value(rule)
    end do
  end subroutine start_group

  !> Sets one or two texts of a key.
  subroutine set_text(group, key, first, second)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key, first
    character(len=*), intent(in), optional :: second
    integer :: k

    k = group%key_position(key)
    group%values(k) = value_t(line=group%line)
    allocate (group%values(k)%texts(merge(2, 1, present(second))))
    group%values(k)%texts(1)%text = first
    if (present(second)) group%values(k)%texts(2)%text = second
  end subroutine set_text

end module nocdyn_made_groups
