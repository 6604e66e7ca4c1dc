!> The quantities of a forced response: moments of couplings and reactions of gears, as sums of the moments of elements.
module nocdyn_response_quantities
  use nocdyn_bank, only: bank_t, role_coupling
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shafts, only: shafts_t
  implicit none (type, external)
  private

  public :: list_quantities

  integer, parameter, public :: quantity_moment = 1     !! of a coupling, with damping, on its first body; force of a mesh
  integer, parameter, public :: quantity_stress = 2     !! shear stress that this moment causes
  integer, parameter, public :: quantity_reaction = 3   !! of a constraint row
  integer, parameter, public :: quantity_along = 4      !! the largest moment along a shaft, of all its sections

  !> A sum of moments of elements.
  type, public :: response_quantity_t
    integer :: kind = quantity_moment
    character(len=:), allocatable :: name          !! of the coupling or gear
    character(len=:), allocatable :: label         !! of its column, without unit
    character(len=:), allocatable :: unit          !! 'N m', 'Pa' or 'N'
    integer, allocatable :: element(:)             !! [terms]
    real(wp), allocatable :: weight(:, :)          !! [points, terms]: of several points, that with the largest half range counts
    real(wp) :: by_held_torque = 0.0_wp            !! per torque on the reference body that holds the speed
  contains
    procedure :: total
  end type response_quantity_t

  !> Quantities that are appended one by one.
  type :: quantity_list_t
    integer :: count = 0
    type(response_quantity_t), allocatable :: list(:)
  contains
    procedure :: add
  end type quantity_list_t

contains

  !> All quantities of a machine: the moment, and where a section modulus is known the stress, of each coupling in the order of
  !> the input; then constraint rows.
  subroutine list_quantities(machine, reference, quantities)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference   !! body on which a torque holds the speed
    type(response_quantity_t), allocatable, intent(out) :: quantities(:)
    type(quantity_list_t) :: list
    integer :: b, e, r

    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role /= role_coupling) cycle
        if (bank%has_parts) then
          call add_shafts(bank, list)
          cycle
        end if
        do e = 1, bank%count
          call add_coupling(bank, e, list)
        end do
      end associate
    end do
    allocate (quantities(list%count + machine%constraints%rows()))
    do r = 1, list%count
      quantities(r) = list%list(r)
    end do
    call list_reactions(machine, reference, quantities(list%count + 1:))
  end subroutine list_quantities

  !> The moment of a coupling and its stress, or the force of a mesh.
  subroutine add_coupling(bank, e, list)
    class(bank_t), intent(in) :: bank
    integer, intent(in) :: e   !! numbered within the bank
    type(quantity_list_t), intent(inout) :: list
    integer :: modulus

    if (bank%is_mesh) then
      call list%add(quantity_moment, bank%names(e)%text, 'force_' // bank%names(e)%text, 'N')
    else
      call list%add(quantity_moment, bank%names(e)%text, 'moment_' // bank%names(e)%text, 'N m')
    end if
    list%list(list%count)%element = [bank%first + e - 1]
    list%list(list%count)%weight = reshape([merge(1.0_wp, -1.0_wp, bank%is_mesh)], [1, 1])
    modulus = bank%number_of('section_modulus')
    if (modulus == 0) return
    associate (value => bank%parameters(modulus)%value(1, e))
      if (.not. value > 0) return
      call list%add(quantity_stress, bank%names(e)%text, 'stress_' // bank%names(e)%text, 'Pa')
      list%list(list%count)%element = [bank%first + e - 1]
      list%list(list%count)%weight = reshape([-1.0_wp / value], [1, 1])
    end associate
  end subroutine add_coupling

  !> The moments at both ends of each shaft, its largest stress and its largest moment.
  subroutine add_shafts(bank, list)
    class(bank_t), intent(in) :: bank
    type(quantity_list_t), intent(inout) :: list
    real(wp), allocatable :: moments(:, :), modulus(:)
    integer :: end, k, s

    select type (bank)
    type is (shafts_t)
      do s = 1, size(bank%shafts)
        modulus = bank%section_moduli(s, 1)
        moments = bank%shafts(s)%all_moments()
        associate (shaft => bank%shafts(s), name => bank%names(bank%shafts(s)%first)%text)
          do end = 1, 4
            if (end == 1) call list%add(quantity_moment, name, 'moment_' // name // '_1', 'N m')
            if (end == 2) call list%add(quantity_moment, name, 'moment_' // name // '_2', 'N m')
            if (end == 3) call list%add(quantity_stress, name, 'stress_' // name, 'Pa')
            if (end == 4) call list%add(quantity_along, name, 'moment_' // name // '_max', 'N m')
            associate (one => list%list(list%count))
              one%element = [(bank%first + k - 1, k=shaft%first, shaft%last)]
              if (end == 1) one%weight = -moments(:1, :)
              if (end == 2) one%weight = -moments(size(modulus):, :)
              if (end == 3) one%weight = -moments / spread(modulus, 2, size(one%element))
              if (end == 4) one%weight = -moments
            end associate
          end do
        end associate
      end do
    end select
  end subroutine add_shafts

  !> Appends a quantity without terms.
  subroutine add(self, kind, name, label, unit)
    class(quantity_list_t), intent(inout) :: self
    integer, intent(in) :: kind   !! quantity_...
    character(len=*), intent(in) :: name, label, unit
    type(response_quantity_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(self%list)) allocate (self%list(8))
    if (self%count == size(self%list)) then
      allocate (longer(2 * self%count))
      do i = 1, self%count
        longer(i) = self%list(i)
      end do
      call move_alloc(longer, self%list)
    end if
    self%count = self%count + 1
    call set_quantity(kind, name, label, unit, self%list(self%count))
  end subroutine add

  !> A quantity without terms. (gfortran 12 loses texts of a structure constructor.)
  subroutine set_quantity(kind, name, label, unit, quantity)
    integer, intent(in) :: kind   !! quantity_...
    character(len=*), intent(in) :: name, label, unit
    type(response_quantity_t), intent(out) :: quantity

    quantity%kind = kind
    quantity%name = name
    quantity%label = label
    quantity%unit = unit
    allocate (quantity%element(0), quantity%weight(1, 0))
  end subroutine set_quantity

  !> The reactions, which are linear in the moments of the elements.
  subroutine list_reactions(machine, reference, quantities)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference
    type(response_quantity_t), intent(inout) :: quantities(:)   !! [rows]
    type(coordinates_t) :: coordinates
    character(len=:), allocatable :: name
    real(wp) :: lambda(size(quantities)), torque(0:machine%bodies)
    integer :: e, r

    if (size(quantities) == 0) return
    coordinates = machine%coordinates
    do r = 1, size(quantities)
      call machine%constraints%name_column(r, name)
      call set_quantity(quantity_reaction, machine%constraints%names(r)%text, name, machine%constraints%units(r)%text, &
                        quantities(r))
    end do
    do e = 1, machine%elements%count
      torque = 0.0_wp
      call machine%elements%rows%add_moment(e, 1.0_wp, torque(1:))
      call coordinates%reactions_of_torques(1, torque(1:), lambda)
      do r = 1, size(quantities)
        if (.not. abs(lambda(r)) > 0) cycle
        quantities(r)%element = [quantities(r)%element, e]
        quantities(r)%weight = reshape([quantities(r)%weight, lambda(r)], [1, size(quantities(r)%element)])
      end do
    end do
    torque = 0.0_wp
    torque(reference) = 1.0_wp
    call coordinates%reactions_of_torques(1, torque(1:), lambda)
    quantities%by_held_torque = lambda
  end subroutine list_reactions

  !> The quantity at one of its points, of complex moments of the elements.
  pure complex(wp) function total(self, point, moment)
    class(response_quantity_t), intent(in) :: self
    integer, intent(in) :: point
    complex(wp), intent(in) :: moment(:)   !! [N m], [elements]
    integer :: k

    total = (0.0_wp, 0.0_wp)
    do k = 1, size(self%element)
      total = total + self%weight(point, k) * moment(self%element(k))
    end do
  end function total

end module nocdyn_response_quantities
