!> Paths of numbers in which * stands for any characters of a name: `coupling.crank_*.stiffness`.
module nocdyn_target_patterns
  use nocdyn_input, only: input_t
  use nocdyn_name_checks, only: collect_names
  use nocdyn_patterns, only: matches
  use nocdyn_schema, only: group_rule_index
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: append, lower_case, quoted, string_t
  implicit none (type, external)
  private

  public :: expand_path

contains

  !> The paths that a pattern stands for, in the order of the input. A path without * stands for itself.
  subroutine expand_path(input, pattern, paths, message)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: pattern
    type(string_t), allocatable, intent(out) :: paths(:)
    character(len=:), allocatable, intent(out) :: message   !! '', or that no name matches
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: kind, name
    integer :: first_dot, i, last_dot

    message = ''
    allocate (paths(0))
    first_dot = index(pattern, '.')
    last_dot = index(pattern, '.', back=.true.)
    kind = lower_case(pattern(:first_dot - 1))
    name = pattern(first_dot + 1:last_dot - 1)
    if (index(name, '*') == 0 .or. group_rule_index(kind) == 0) then
      call append(paths, pattern)
      return
    end if
    associate (groups => input%groups_named(kind))
      call collect_names(input%groups, pack(groups, input%groups(groups)%made_from == 0), names)
    end associate
    do i = 1, size(names)
      if (matches(name, names(i)%text)) call append(paths, kind // '.' // names(i)%text // pattern(last_dot:))
    end do
    if (size(paths) > 0) return
    message = 'no &' // kind // ' has a name like ' // quoted(name) // suggestion(name, names)
  end subroutine expand_path

end module nocdyn_target_patterns
