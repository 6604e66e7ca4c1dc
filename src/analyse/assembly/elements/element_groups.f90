!> The groups of one kind of an input, sorted into banks by the form of their laws, as the constructors of banks ask for them:
!> values of keys, the same in every lane, and bodies.
module nocdyn_element_groups
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_curves, only: curve_t, extrapolation_constant, extrapolation_linear, interpolation_cubic, interpolation_linear, &
                           new_curve
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema_rules, only: ground
  use nocdyn_text, only: string_t
  use nocdyn_text_sort, only: argsort, sorted_position
  use nocdyn_written_values, only: written_element
  implicit none (type, external)
  private

  public :: new_body_index, bodies_of, new_element_groups, add_banks, group_curve, check_from_standstill

  !> Finds the bodies of an input by name.
  type, public :: body_index_t
    type(string_t), allocatable :: names(:)   !! of the bodies
    integer, allocatable :: order(:)          !! bodies in the order of their names
  end type body_index_t

  !> Some groups of an input. It points to the input and the index of its bodies, which have to outlive it.
  type, extends(element_keys_t), public :: element_groups_t
    integer, allocatable :: indices(:)                      !! of the groups in the input
    type(input_t), pointer :: input => null()
    type(body_index_t), pointer, private :: body_index => null()
  contains
    procedure :: has, values, numbers, curves, bodies, listed_bodies, some, select
  end type element_groups_t

  abstract interface
    !> The form of the law of a group, 1 to the number of forms.
    pure integer function form_interface(group)
      import :: group_t
      type(group_t), intent(in) :: group
    end function form_interface

    !> Adds the bank of some groups, whose laws have one form.
    subroutine add_interface(groups, form, banks)
      import :: bank_slot_t, element_groups_t
      type(element_groups_t), intent(in) :: groups
      integer, intent(in) :: form   !! 1 to the number of forms
      type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    end subroutine add_interface
  end interface

contains

  !> The index of the bodies with these names.
  type(body_index_t) function new_body_index(names) result(body_index)
    type(string_t), intent(in) :: names(:)

    allocate (body_index%names, source=names)
    call argsort(body_index%names, body_index%order)
  end function new_body_index

  !> Numbers of the bodies that a group names under a key, in the order of its values, 0 for the ground.
  function bodies_of(group, key, body_index) result(bodies)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    type(body_index_t), intent(in) :: body_index
    integer, allocatable :: bodies(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names, source=group%texts(key))
    allocate (bodies(size(names)), source=0)
    do i = 1, size(names)
      if (names(i)%text /= ground) bodies(i) = sorted_position(names(i)%text, body_index%names, body_index%order)
    end do
  end function bodies_of

  !> All groups of one kind.
  type(element_groups_t) function new_element_groups(input, kind, lanes, body_index) result(groups)
    type(input_t), target, intent(in) :: input
    character(len=*), intent(in) :: kind   !! 'coupling', 'motor' ...
    integer, intent(in) :: lanes
    type(body_index_t), target, intent(in), optional :: body_index   !! for `bodies`

    groups%lanes = lanes
    groups%input => input
    if (present(body_index)) groups%body_index => body_index
    groups%t_start = input%groups(input%position('run'))%number('t_start')
    call groups%select(input%groups_named(kind))
  end function new_element_groups

  !> Makes them other groups of the input.
  subroutine select(self, indices)
    class(element_groups_t), intent(inout) :: self
    integer, intent(in) :: indices(:)
    integer :: i

    self%indices = indices
    if (allocated(self%names)) deallocate (self%names)
    allocate (self%names(size(indices)))
    do i = 1, size(indices)
      self%names(i)%text = self%input%groups(indices(i))%name
    end do
  end subroutine select

  !> Adds a bank of form 1, perhaps empty, and one of each other form that some groups have.
  subroutine add_banks(groups, form_of, add_form, banks)
    type(element_groups_t), intent(in) :: groups   !! all of one kind
    procedure(form_interface) :: form_of
    procedure(add_interface) :: add_form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer :: form, form_of_group(size(groups%indices)), i

    form_of_group = [(form_of(groups%input%groups(groups%indices(i))), i=1, size(groups%indices))]
    do form = 1, max(1, maxval(form_of_group))
      if (form > 1 .and. .not. any(form_of_group == form)) cycle
      call add_form(groups%some(form_of_group == form), form, banks)
    end do
  end subroutine add_banks

  !> The ones of the groups that a mask selects.
  type(element_groups_t) function some(groups, mask)
    class(element_groups_t), intent(in) :: groups
    logical, intent(in) :: mask(:)   !! [groups]

    some = groups
    call some%select(pack(groups%indices, mask))
  end function some

  pure logical function has(self, key)
    class(element_groups_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: i

    has = any([(self%input%groups(self%indices(i))%has_value(key), i=1, size(self%indices))])
  end function has

  pure function values(self, key, absent)
    class(element_groups_t), intent(in) :: self
    character(len=*), intent(in) :: key
    real(wp), intent(in), optional :: absent
    real(wp) :: values(self%lanes, size(self%names))
    integer :: i

    values = 0.0_wp
    if (present(absent)) values = absent
    do i = 1, size(self%indices)
      associate (group => self%input%groups(self%indices(i)))
        associate (value => group%values(group%key_position(key)))
          if (allocated(value%flags)) then
            values(:, i) = merge(1.0_wp, 0.0_wp, value%flags(1))
          else if (value%has_any()) then
            values(:, i) = value%number_at(1)
          end if
        end associate
      end associate
    end do
  end function values

  pure function numbers(self, key, lane, element)
    class(element_groups_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: lane, element
    real(wp), allocatable :: numbers(:)

    numbers = self%input%groups(self%indices(element))%numbers(key)
  end function numbers

  function bodies(self, key, which)
    class(element_groups_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: which
    integer :: bodies(size(self%names))
    integer, allocatable :: named(:)
    integer :: i

    do i = 1, size(self%indices)
      named = bodies_of(self%input%groups(self%indices(i)), key, self%body_index)
      bodies(i) = named(which)
    end do
  end function bodies

  !> All bodies that one group names under a key.
  function listed_bodies(self, key, group) result(bodies)
    class(element_groups_t), intent(in) :: self
    character(len=*), intent(in) :: key   !! of names of bodies
    integer, intent(in) :: group          !! 1 or more
    integer, allocatable :: bodies(:)

    bodies = bodies_of(self%input%groups(self%indices(group)), key, self%body_index)
  end function listed_bodies

  function curves(self, x, y, extrapolation)
    class(element_groups_t), intent(in) :: self
    character(len=*), intent(in) :: x, y
    character(len=*), intent(in), optional :: extrapolation
    type(curve_t), allocatable :: curves(:, :)
    integer :: i, lane

    allocate (curves(self%lanes, size(self%indices)))
    do i = 1, size(self%indices)
      curves(1, i) = group_curve(self%input%groups(self%indices(i)), x, y, extrapolation)
      do lane = 2, self%lanes
        curves(lane, i) = curves(1, i)
      end do
    end do
  end function curves

  !> The table of one group.
  type(curve_t) function group_curve(group, x, y, extrapolation) result(curve)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: x, y                      !! keys of the lists
    character(len=*), intent(in), optional :: extrapolation   !! the one of the group if absent
    character(len=:), allocatable :: beyond
    integer :: inside, outside

    if (present(extrapolation)) beyond = extrapolation
    if (.not. present(extrapolation)) beyond = group%text('extrapolation')
    inside = merge(interpolation_cubic, interpolation_linear, group%text('interpolation') == 'cubic')
    outside = merge(extrapolation_constant, extrapolation_linear, beyond == 'constant')
    curve = new_curve(group%numbers(x), group%numbers(y), inside, outside)
  end function group_curve

  !> Refuses a table over a speed, in either direction, that does not begin at standstill.
  subroutine check_from_standstill(input, index, key, speeds, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index             !! of the group
    character(len=*), intent(in) :: key      !! of the speeds [rad/s]; they may be unset
    character(len=*), intent(in) :: speeds   !! what they are, e.g. 'slips'
    type(diagnostics_t), intent(inout) :: diagnostics
    real(wp), allocatable :: x(:)

    allocate (x, source=input%groups(index)%numbers(key))
    if (size(x) == 0) return
    if (x(1) > 0) call input%report(index, key, written_element(input%groups(index), key, 1) // &
               '; allowed: 0 first, then the ' // speeds // ' in either direction', diagnostics)
  end subroutine check_from_standstill

end module nocdyn_element_groups
