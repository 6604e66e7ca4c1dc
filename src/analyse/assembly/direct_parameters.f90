!> Targets of a sweep whose values stand in the parameters of a lane as they are, so that a variant is set by writing them there.
!>
!> Banks say which of their parameters hold the values of a key as they are (`is_key`): the laws follow from them by
!> `polynomials`, and assembly asks for nothing but their signs. The inertia of a body is direct too: the constraints do not
!> depend on it, so that only the responses to moments follow. A variant is written into a lane if every target is
!> direct and one with the same signs of all values has been assembled and had the structure of the block.
module nocdyn_direct_parameters
  use nocdyn_derived_values, only: has_derived_values
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_shaft_segments, only: has_own_nodes
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_schema_rules, only: is_too_small
  use nocdyn_targets, only: target_t
  use nocdyn_units, only: in_si
  implicit none (type, external)
  private

  public :: new_direct_parameters

  integer, parameter :: most_patterns = 1000   ! of signs: a search through more costs as much as an assembly
  integer, parameter :: negative_zero = 2      ! the sign of a value that is never direct: a sum with 0 is not -0.0

  !> Where a value stands.
  type :: place_t
    integer :: bank = 0
    integer :: parameter = 0   !! of the bank; 0: there is no such place
    integer :: column = 0
  end type place_t

  type, public :: direct_parameters_t
    logical :: are_direct = .false.                               !! whether all targets are
    logical, allocatable :: is_set_point(:)                       !! whether a target may have any sign, [targets]
    integer, allocatable, private :: unit(:)                      !! of the values of each target: index of `units`
    integer, allocatable, private :: target(:)                    !! targets whose values are in arrays of banks ...
    type(place_t), allocatable, private :: place(:)               !! ... and where each of them is
    integer, allocatable, private :: inertia_target(:)            !! targets that are inertias ...
    integer, allocatable, private :: body(:)                      !! ... and the body of each
    integer, allocatable, private :: groups(:)                    !! of geared bodies, in which these are
    integer, allocatable, private :: signs(:, :)                  !! accepted patterns of signs, [targets, patterns]
    real(wp), allocatable, private :: lowest(:), highest(:)       !! values known to be allowed, [targets]
  contains
    procedure :: accept, are_accepted, allow, are_allowed, write_values, write_elements
  end type direct_parameters_t

contains

  !> Finds the targets in the machine of a block, or in one that has started.
  type(direct_parameters_t) function new_direct_parameters(input, targets, machine, has_started) result(self)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    type(machine_t), intent(in) :: machine
    logical, intent(in), optional :: has_started   !! whether only its elements can change; absent: no
    logical :: of_elements
    logical :: holds_inertia   ! whether the machine has what follows from inertias: sums of them, or projected start speeds
    integer :: b, g, i

    allocate (self%target(0), self%place(0), self%inertia_target(0), self%body(0))
    allocate (self%signs(size(targets), 0))
    allocate (self%unit(size(targets)))
    allocate (self%is_set_point(size(targets)), source=.false.)
    self%unit(:) = targets%in_unit
    allocate (self%lowest(size(targets)), source=huge(1.0_wp))
    allocate (self%highest(size(targets)), source=-huge(1.0_wp))
    of_elements = .false.
    if (present(has_started)) of_elements = has_started
    self%are_direct = of_elements .or. .not. allocated(machine%steady_internal)   ! the start follows from all values
    if (.not. self%are_direct) return
    holds_inertia = allocated(machine%start_impulse) .or. of_elements
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        holds_inertia = holds_inertia .or. bank%has_parts .or. bank%moving_rows > 0 .or. bank%follows_inertias
      end associate
    end do
    do i = 1, size(targets)
      if (input%groups(targets(i)%group)%kind == 'body') then
        self%are_direct = key_of(input, targets(i)) == 'inertia' .and. .not. holds_inertia .and. &
                          .not. has_derived_values(input) .and. &
                          .not. input%groups(targets(i)%group)%number('entrained', absent=0.0_wp) > 0
        self%inertia_target = [self%inertia_target, i]
        self%body = [self%body, findloc(input%groups_named('body'), targets(i)%group, dim=1)]
      else
        call add_element_value(self, i, input, targets(i), machine, of_elements)
      end if
      if (.not. self%are_direct) return
    end do
    self%groups = pack([(g, g=1, size(machine%groups))], &
                       [(any([(any(machine%groups(g)%bodies == self%body(i)), i=1, size(self%body))]), g=1, &
                         size(machine%groups))])
  end function new_direct_parameters

  !> A value of an element, if its bank declares where it stands.
  subroutine add_element_value(self, number, input, target, machine, in_motion)
    type(direct_parameters_t), intent(inout) :: self
    integer, intent(in) :: number   !! of the target
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target
    type(machine_t), intent(in) :: machine
    logical, intent(in) :: in_motion   !! whether set points count
    type(place_t) :: place
    integer :: b, e

    self%are_direct = .false.
    if (is_shared(input, target) .or. sets_nodes(input, target)) return
    associate (group => input%groups(target%group))
      do b = 1, size(machine%banks)
        associate (bank => machine%banks(b)%bank)
          if (bank%has_parts .or. bank%kind_name() /= group%kind) cycle
          do e = 1, size(bank%names)
            if (bank%names(e)%text /= group%name) cycle
            place = place_of(machine, b, trim(parameter_of(key_of(input, target))), e)
            if (place%parameter == 0) cycle
            self%is_set_point(number) = bank%parameters(place%parameter)%is_set_point
            if (self%is_set_point(number) .and. .not. in_motion) cycle
            self%are_direct = .true.
            self%target = [self%target, number]
            self%place = [self%place, place]
          end do
        end associate
      end do
    end associate
  end subroutine add_element_value

  !> Where the value of a key of an element stands as it is.
  pure type(place_t) function place_of(machine, bank, key, element) result(place)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: bank
    character(len=*), intent(in) :: key
    integer, intent(in) :: element   !! numbered within the bank
    integer :: column, p

    associate (parameters => machine%banks(bank)%bank%parameters)
      do p = 1, size(parameters)
        if (.not. (parameters(p)%is_key .or. parameters(p)%is_set_point) .or. parameters(p)%name /= key) cycle
        column = findloc(parameters(p)%element, element, dim=1)
        if (column > 0) place = place_t(bank, p, column)
      end do
    end associate
  end function place_of

  !> Whether excitations have a share of the target's load: they hold its parameters too.
  pure logical function is_shared(input, target)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target
    integer :: g

    is_shared = .false.
    if (input%groups(target%group)%kind /= 'load') return
    do g = 1, size(input%groups)
      if (input%groups(g)%kind /= 'excitation') cycle
      is_shared = is_shared .or. input%groups(g)%has_value('share_of_load')
    end do
  end function is_shared

  !> Whether nodes of shafts may follow from the target: from frequencies, durations, and numbers of motors, which set speeds.
  pure logical function sets_nodes(input, target)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target
    integer :: g

    sets_nodes = .false.
    associate (unit => key_rules(first_key(input%groups(target%group)%rule) + target%key - 1)%unit)
      if (input%groups(target%group)%kind /= 'motor' .and. unit /= 'rad/s' .and. unit /= 's') return
    end associate
    do g = 1, size(input%groups)
      if (input%groups(g)%kind /= 'shaft') cycle
      sets_nodes = sets_nodes .or. has_own_nodes(input%groups(g))
    end do
  end function sets_nodes

  !> The name of the parameter that holds the values of a key: the backlash of a mesh is the gap of its law.
  pure function parameter_of(key) result(name)
    character(len=*), intent(in) :: key
    character(len=len(key)) :: name

    name = key
    if (key == 'backlash') name = 'gap'
  end function parameter_of

  pure function key_of(input, target) result(key)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target
    character(len=len(key_rules%name)) :: key

    key = key_rules(first_key(input%groups(target%group)%rule) + target%key - 1)%name
  end function key_of

  !> Takes the values of a variant that has been assembled and has the structure of the block.
  subroutine accept(self, values)
    class(direct_parameters_t), intent(inout) :: self
    real(wp), intent(in) :: values(:)   !! [targets]

    if (.not. self%are_direct) return
    call self%allow(values)
    associate (patterns => size(self%signs, 2), pattern => sign_of(values))
      if (self%are_accepted(values) .or. patterns == most_patterns .or. any(pattern == negative_zero)) return
      self%signs = reshape([self%signs, pattern], [size(values), patterns + 1])
    end associate
  end subroutine accept

  !> Whether a variant of these values can be set by writing them.
  pure logical function are_accepted(self, values)
    class(direct_parameters_t), intent(in) :: self
    real(wp), intent(in) :: values(:)   !! [targets]
    integer :: pattern

    are_accepted = .false.
    if (.not. self%are_direct) return
    do pattern = 1, size(self%signs, 2)
      are_accepted = all(sign_of(values) == self%signs(:, pattern) .or. self%is_set_point)
      if (are_accepted) return
    end do
  end function are_accepted

  !> -1, 0, 1, or `negative_zero`.
  elemental integer function sign_of(value)
    real(wp), intent(in) :: value

    if (abs(value) > 0) then
      sign_of = nint(sign(1.0_wp, value))
    else
      sign_of = merge(0, negative_zero, sign(1.0_wp, value) > 0)
    end if
  end function sign_of

  !> Takes values that have been found to be allowed.
  subroutine allow(self, values)
    class(direct_parameters_t), intent(inout) :: self
    real(wp), intent(in) :: values(:)   !! [targets]

    self%lowest = min(self%lowest, values)
    self%highest = max(self%highest, values)
  end subroutine allow

  !> Whether values are between some that are allowed. The range of a key has no hole but one around zero; zero is a sign here.
  pure logical function are_allowed(self, values)
    class(direct_parameters_t), intent(in) :: self
    real(wp), intent(in) :: values(:)   !! [targets]

    are_allowed = all(values >= self%lowest .and. values <= self%highest .and. .not. is_too_small(in_si(values, self%unit)))
  end function are_allowed

  !> Writes the values of a variant into a lane. Everything else in the lane must already be from another variant.
  subroutine write_values(self, values, lane, block, y, is_set)
    class(direct_parameters_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)          !! [targets]
    integer, intent(in) :: lane
    class(reduced_t), intent(inout) :: block
    real(wp), contiguous, intent(inout) :: y(:)            !! the start state of another variant, then of this one
    logical, intent(out) :: is_set                         !! not if rounding makes the mass matrix indefinite
    logical :: is_indefinite

    call self%write_elements(values, lane, block%machine)
    is_set = .true.
    if (size(self%inertia_target) == 0) return
    call block%update_inertia(lane, self%body, values(self%inertia_target), self%groups, is_indefinite)
    is_set = .not. is_indefinite
    if (is_set) call block%project_start_speeds(lane, y)
  end subroutine write_values

  !> Writes the values of elements into a lane.
  subroutine write_elements(self, values, lane, machine)
    class(direct_parameters_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)   !! [targets]
    integer, intent(in) :: lane
    type(machine_t), intent(inout) :: machine
    integer :: i

    do i = 1, size(self%target)
      associate (place => self%place(i), target => self%target(i))
        associate (bank => machine%banks(place%bank)%bank)
          bank%parameters(place%parameter)%value(lane, place%column) = in_si(values(target), self%unit(target))
          call bank%set_terms(place%parameter, place%column, lane, machine%laws)
        end associate
      end associate
    end do
  end subroutine write_elements

end module nocdyn_direct_parameters
