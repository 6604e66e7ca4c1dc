!> Signals as sums of the moments of elements, which are linear in the motion about a steady state: total moments, forces and
!> stresses of couplings, shafts and meshes, and the reactions of constraint rows.
module nocdyn_moment_forms
  use nocdyn_bank, only: role_coupling
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_element_rows, only: element_rows_t
  use nocdyn_geared_groups, only: find_groups, geared_group_t
  use nocdyn_grouping, only: grouped, groups_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_quantities, only: form_elastic, form_total
  use nocdyn_shafts, only: shafts_t
  use nocdyn_signals, only: list_signals, signal_element, signal_reaction, signal_t
  implicit none (type, external)
  private

  public :: list_moment_forms

  integer, parameter, public :: kind_moment = 1     !! total moment of a coupling, at an end of a shaft; force of a mesh
  integer, parameter, public :: kind_stress = 2     !! shear stress that this moment causes
  integer, parameter, public :: kind_reaction = 3   !! of a constraint row
  integer, parameter, public :: kind_along = 4      !! the largest moment along a shaft, of all its sections
  integer, parameter, public :: kind_power = 5      !! such a moment times the speed of a body

  !> A signal with its linear form. A power is the form times the speed of `source%body`.
  type, extends(signal_t), public :: moment_form_t
    integer :: kind = kind_moment
    integer, allocatable :: elements(:)      !! of the machine, [terms]
    real(wp), allocatable :: weight(:, :)    !! [points, terms]: of several points, that with the largest half range counts
    real(wp) :: by_held_torque = 0.0_wp      !! per torque on the reference body that holds the speed
  contains
    procedure :: total
  end type moment_form_t

  !> Reactions by moments of 1 of single elements.
  type :: reaction_terms_t
    integer :: count = 0
    integer, allocatable :: place(:, :)      ! row and element of each, [2, at least count]
    real(wp), allocatable :: weight(:)       ! [at least count]
  contains
    procedure :: add, set_forms
  end type reaction_terms_t

contains

  !> The forms of a machine: of each coupling in the order of the banks the moment, then what follows from it; then the rows.
  subroutine list_moment_forms(machine, reference, forms)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference   !! body on which a torque holds the speed
    type(moment_form_t), allocatable, intent(out) :: forms(:)
    type(signal_t), allocatable :: signals(:)
    type(groups_t) :: of_elements
    integer, allocatable :: chosen(:)
    integer :: i, k, rows

    call list_signals(machine, signals)
    allocate (chosen, source=pack([(i, i=1, size(signals))], [(has_form(machine, signals(i)), i=1, size(signals))]))
    of_elements = grouped(machine%elements%count, [(number_of(machine, signals(chosen(i))), i=1, size(chosen))], chosen)
    k = size(chosen)
    rows = machine%constraints%rows()
    allocate (forms(k + rows))
    do i = 1, k
      forms(i)%signal_t = signals(of_elements%member(i))
      call set_terms(machine, forms(i))
    end do
    do i = 1, size(signals)
      if (signals(i)%source%kind /= signal_reaction) cycle
      forms(k + signals(i)%source%index)%signal_t = signals(i)
    end do
    call set_reactions(machine, reference, forms(k + 1:))
  end subroutine list_moment_forms

  !> Whether a signal is a total moment, a force or a stress of a coupling, a shaft or a mesh. The elastic moment is the total one
  !> of a coupling without damping.
  logical function has_form(machine, signal)
    type(machine_t), intent(in) :: machine
    type(signal_t), intent(in) :: signal

    has_form = .false.
    if (signal%source%kind /= signal_element) return
    associate (bank => machine%banks(signal%source%bank)%bank, source => signal%source)
      if (bank%role /= role_coupling) return
      has_form = source%form == form_total .or. source%body > 0 .or. any(signal%symbol == ['total_moment', 'stress      '])
      if (source%form == form_elastic) has_form = all(bank%with_work /= source%index)
    end associate
  end function has_form

  !> The element of the machine that a signal is of.
  integer function number_of(machine, signal)
    type(machine_t), intent(in) :: machine
    type(signal_t), intent(in) :: signal

    number_of = machine%banks(signal%source%bank)%bank%first - 1 + signal%source%index
  end function number_of

  subroutine set_terms(machine, form)
    type(machine_t), intent(in) :: machine
    type(moment_form_t), intent(inout) :: form
    real(wp), allocatable :: moments(:, :)
    integer :: k, shaft

    form%kind = kind_moment
    if (form%symbol == 'stress') form%kind = kind_stress
    if (form%point == 'max') form%kind = kind_along
    if (form%source%body > 0) form%kind = kind_power
    associate (source => form%source)
      select type (bank => machine%banks(source%bank)%bank)
      type is (shafts_t)
        shaft = findloc(bank%shafts%first, source%index, dim=1)
        form%elements = [(bank%first - 1 + k, k=bank%shafts(shaft)%first, bank%shafts(shaft)%last)]
        moments = bank%shafts(shaft)%all_moments()
        if (form%kind == kind_stress) moments = moments / spread(bank%section_moduli(shaft, 1), 2, size(form%elements))
        if (form%point == '1') moments = moments(:1, :)
        if (form%point == '2') moments = moments(size(moments, 1):, :)
        if (form%kind == kind_power) moments = -moments([merge(1, size(moments, 1), bank%shafts(shaft)%ends(1) > 0)], :)
        form%weight = -moments
      class default
        form%elements = [number_of(machine, form%signal_t)]
        allocate (form%weight(1, 1), source=source%factor)
        if (source%divisor > 0) form%weight = form%weight / bank%parameters(source%divisor)%value(1, source%index)
      end select
    end associate
  end subroutine set_terms

  !> The reactions, which are linear in the moments of all elements. Each depends on the moments on bodies of its own group alone,
  !> so that elements on different groups are taken together.
  subroutine set_reactions(machine, reference, forms)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference
    type(moment_form_t), intent(inout) :: forms(:)   !! [rows]
    type(coordinates_t) :: coordinates
    type(geared_group_t), allocatable :: groups(:)
    type(reaction_terms_t) :: terms
    integer, allocatable :: element(:), group_of(:)
    logical :: is_left(machine%elements%count)
    real(wp) :: lambda(size(forms)), torque(machine%bodies)
    integer :: r

    if (size(forms) == 0) return
    coordinates = machine%coordinates
    call find_groups(machine%constraints, groups, group_of)
    is_left = .true.
    do while (any(is_left))
      call take_elements(machine%elements%rows, groups, group_of, is_left, element, torque)
      call coordinates%reactions_of_torques(1, torque, lambda)
      do r = 1, size(forms)
        if (abs(lambda(r)) > 0) call terms%add(r, element(group_of(machine%constraints%body(machine%constraints%first(r)))), &
                                               lambda(r))
      end do
    end do
    call terms%set_forms(machine%elements%count, forms)
    torque = 0.0_wp
    torque(reference) = 1.0_wp
    call coordinates%reactions_of_torques(1, torque, lambda)
    forms%by_held_torque = lambda
  end subroutine set_reactions

  !> Takes elements of those that are left, at most one of each group with rows, and their torques with moments of 1.
  subroutine take_elements(rows, groups, group_of, is_left, element, torque)
    type(element_rows_t), intent(in) :: rows
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: group_of(:)                !! [bodies]
    logical, intent(inout) :: is_left(:)              !! [elements]
    integer, allocatable, intent(out) :: element(:)   !! that is taken of each group, 0: none; [groups]
    real(wp), intent(out) :: torque(:)                !! [bodies]
    integer :: e, g, k
    logical :: is_free

    allocate (element(size(groups)), source=0)
    torque = 0.0_wp
    do e = 1, size(is_left)
      if (.not. is_left(e)) cycle
      is_free = .true.
      do k = rows%first(e), rows%first(e + 1) - 1
        if (rows%body(k) > 0) is_free = is_free .and. element(group_of(rows%body(k))) == 0
      end do
      if (.not. is_free) cycle
      is_left(e) = .false.
      call rows%add_moment(e, 1.0_wp, torque)
      do k = rows%first(e), rows%first(e + 1) - 1
        if (rows%body(k) == 0) cycle
        g = group_of(rows%body(k))
        if (size(groups(g)%rows) > 0) element(g) = e
      end do
    end do
  end subroutine take_elements

  !> Adds a term.
  subroutine add(self, row, element, weight)
    class(reaction_terms_t), intent(inout) :: self
    integer, intent(in) :: row, element
    real(wp), intent(in) :: weight
    integer, parameter :: first_size = 64
    integer, allocatable :: longer(:, :)
    real(wp), allocatable :: longer_weight(:)

    if (.not. allocated(self%weight)) allocate (self%place(2, first_size), self%weight(first_size))
    if (self%count == size(self%weight)) then
      allocate (longer(2, 2 * self%count), longer_weight(2 * self%count))
      longer(:, :self%count) = self%place
      longer_weight(:self%count) = self%weight
      call move_alloc(longer, self%place)
      call move_alloc(longer_weight, self%weight)
    end if
    self%count = self%count + 1
    self%place(:, self%count) = [row, element]
    self%weight(self%count) = weight
  end subroutine add

  !> Gives each row its terms, in the order of the elements.
  subroutine set_forms(self, elements, forms)
    class(reaction_terms_t), intent(inout) :: self
    integer, intent(in) :: elements                  !! number of the elements of the machine
    type(moment_form_t), intent(inout) :: forms(:)   !! [rows]
    type(groups_t) :: of_elements, of_rows
    integer :: i, r

    if (self%count == 0) allocate (self%place(2, 0), self%weight(0))
    of_elements = grouped(elements, self%place(2, :self%count), [(i, i=1, self%count)])
    of_rows = grouped(size(forms), self%place(1, of_elements%member), of_elements%member)
    do r = 1, size(forms)
      forms(r)%kind = kind_reaction
      associate (of_row => of_rows%member(of_rows%start(r):of_rows%start(r + 1) - 1))
        forms(r)%elements = self%place(2, of_row)
        forms(r)%weight = reshape(self%weight(of_row), [1, size(of_row)])
      end associate
    end do
  end subroutine set_forms

  !> The value at one point, of complex moments of the elements.
  pure complex(wp) function total(self, point, moment)
    class(moment_form_t), intent(in) :: self
    integer, intent(in) :: point
    complex(wp), intent(in) :: moment(:)   !! [N m], [elements of the machine]
    integer :: k

    total = (0.0_wp, 0.0_wp)
    do k = 1, size(self%elements)
      total = total + self%weight(point, k) * moment(self%elements(k))
    end do
  end function total

end module nocdyn_moment_forms
