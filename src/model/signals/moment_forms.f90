!> Signals as sums of the moments of elements, which are linear in the motion about a steady state: total moments, forces and
!> stresses of couplings, shafts and meshes, and the reactions of constraint rows.
module nocdyn_moment_forms
  use nocdyn_bank, only: role_coupling
  use nocdyn_coordinates, only: coordinates_t
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

  !> The reactions, which are linear in the moments of all elements.
  subroutine set_reactions(machine, reference, forms)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference
    type(moment_form_t), intent(inout) :: forms(:)   !! [rows]
    type(coordinates_t) :: coordinates
    real(wp) :: lambda(size(forms)), torque(0:machine%bodies)
    integer :: e, r

    if (size(forms) == 0) return
    coordinates = machine%coordinates
    do r = 1, size(forms)
      forms(r)%kind = kind_reaction
      allocate (forms(r)%elements(0), forms(r)%weight(1, 0))
    end do
    do e = 1, machine%elements%count
      torque = 0.0_wp
      call machine%elements%rows%add_moment(e, 1.0_wp, torque(1:))
      call coordinates%reactions_of_torques(1, torque(1:), lambda)
      do r = 1, size(forms)
        if (.not. abs(lambda(r)) > 0) cycle
        forms(r)%elements = [forms(r)%elements, e]
        forms(r)%weight = reshape([forms(r)%weight, lambda(r)], [1, size(forms(r)%elements)])
      end do
    end do
    torque = 0.0_wp
    torque(reference) = 1.0_wp
    call coordinates%reactions_of_torques(1, torque(1:), lambda)
    forms%by_held_torque = lambda
  end subroutine set_reactions

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
