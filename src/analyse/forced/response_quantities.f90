!> The quantities of a forced response: moments of couplings and reactions of gears, as sums of the moments of elements.
module nocdyn_response_quantities
  use nocdyn_bank, only: bank_t, role_coupling
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_couplings, only: couplings_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shafts, only: shafts_t
  implicit none (type, external)
  private

  public :: list_quantities

  integer, parameter, public :: quantity_moment = 1     !! of a coupling, elastic and damping moment together, on its first body
  integer, parameter, public :: quantity_reaction = 2   !! of a constraint row

  !> A sum of moments of elements.
  type, public :: response_quantity_t
    integer :: kind = quantity_moment
    character(len=:), allocatable :: name          !! of the coupling or gear
    character(len=:), allocatable :: label         !! of its column, without unit
    character(len=:), allocatable :: unit          !! 'N m' or 'N'
    integer, allocatable :: element(:)             !! [terms]
    real(wp), allocatable :: weight(:)             !! [terms]
    real(wp) :: by_held_torque = 0.0_wp            !! per torque on the reference body that holds the speed
    real(wp) :: section_modulus = 0.0_wp           !! stress = moment / section_modulus [m3]; 0: unknown
  contains
    procedure :: total
  end type response_quantity_t

contains

  !> All quantities of a machine: couplings in the order of the input, then constraint rows.
  subroutine list_quantities(machine, reference, quantities)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference   !! body on which a torque holds the speed
    type(response_quantity_t), allocatable, intent(out) :: quantities(:)
    type(response_quantity_t) :: one
    integer :: b, e, modulus, n

    n = 0
    allocate (quantities(count_of(machine)))
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role /= role_coupling) cycle
        if (bank%has_parts) then
          call list_shafts(bank, n, quantities)
          cycle
        end if
        do e = 1, bank%count
          n = n + 1
          call set_quantity(quantity_moment, bank%names(e)%text, 'moment_', 'N m', one)
          one%element = [bank%first + e - 1]
          one%weight = [-1.0_wp]
          if (is_mesh(bank)) then
            call set_quantity(quantity_moment, bank%names(e)%text, 'force_', 'N', one)
            one%element = [bank%first + e - 1]
            one%weight = [1.0_wp]
          end if
          modulus = bank%number_of('section_modulus')
          if (modulus > 0) one%section_modulus = bank%parameters(modulus)%value(1, e)
          quantities(n) = one
        end do
      end associate
    end do
    call list_reactions(machine, reference, quantities(n + 1:))
  end subroutine list_quantities

  !> Whether the elements of a bank are meshes of teeth.
  pure logical function is_mesh(bank)
    class(bank_t), intent(in) :: bank

    is_mesh = .false.
    select type (bank)
    class is (couplings_t)
      is_mesh = bank%is_mesh
    end select
  end function is_mesh

  !> The moments at both ends of every shaft.
  subroutine list_shafts(bank, n, quantities)
    class(bank_t), intent(in) :: bank
    integer, intent(inout) :: n   !! number of the last quantity
    type(response_quantity_t), intent(inout) :: quantities(:)
    real(wp), allocatable :: modulus(:)
    integer :: e, s, side

    select type (bank)
    type is (shafts_t)
      do s = 1, size(bank%shafts)
        allocate (modulus, source=bank%section_moduli(s, 1))
        associate (shaft => bank%shafts(s))
          do side = 1, 2
            n = n + 1
            call set_quantity(quantity_moment, bank%names(shaft%first)%text, 'moment_', 'N m', quantities(n))
            quantities(n)%label = quantities(n)%label // merge('_1', '_2', side == 1)
            quantities(n)%element = [(bank%first + e - 1, e=shaft%first, shaft%last)]
            quantities(n)%weight = -shaft%moments(merge(1, size(modulus), side == 1), :)
            quantities(n)%section_modulus = modulus(merge(1, size(modulus), side == 1))
          end do
        end associate
        deallocate (modulus)
      end do
    end select
  end subroutine list_shafts

  !> A quantity without terms. (gfortran 12 loses texts of a structure constructor.)
  subroutine set_quantity(kind, name, prefix, unit, quantity)
    integer, intent(in) :: kind   !! quantity_...
    character(len=*), intent(in) :: name, prefix, unit
    type(response_quantity_t), intent(out) :: quantity

    quantity%kind = kind
    quantity%name = name
    quantity%label = prefix // name
    quantity%unit = unit
    allocate (quantity%element(0), quantity%weight(0))
  end subroutine set_quantity

  pure integer function count_of(machine)
    type(machine_t), intent(in) :: machine
    integer :: b

    count_of = machine%constraints%rows()
    do b = 1, size(machine%banks)
      if (machine%banks(b)%bank%role == role_coupling) count_of = count_of + machine%banks(b)%bank%named_count() &
                                                             * merge(2, 1, machine%banks(b)%bank%has_parts)
    end do
  end function count_of

  !> The reactions, which are linear in the moments of the elements.
  subroutine list_reactions(machine, reference, quantities)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: reference
    type(response_quantity_t), intent(inout) :: quantities(:)   !! [rows]
    type(coordinates_t) :: coordinates
    real(wp) :: lambda(size(quantities)), torque(0:machine%bodies)
    integer :: e, r

    if (size(quantities) == 0) return
    coordinates = machine%coordinates
    do r = 1, size(quantities)
      call set_quantity(quantity_reaction, machine%constraints%names(r)%text, 'reaction_', machine%constraints%units(r)%text, &
                        quantities(r))
    end do
    do e = 1, machine%elements%count
      torque = 0.0_wp
      call machine%elements%rows%add_moment(e, 1.0_wp, torque(1:))
      call coordinates%reactions_of_torques(1, torque(1:), lambda)
      do r = 1, size(quantities)
        if (.not. abs(lambda(r)) > 0) cycle
        quantities(r)%element = [quantities(r)%element, e]
        quantities(r)%weight = [quantities(r)%weight, lambda(r)]
      end do
    end do
    torque = 0.0_wp
    torque(reference) = 1.0_wp
    call coordinates%reactions_of_torques(1, torque(1:), lambda)
    quantities%by_held_torque = lambda
  end subroutine list_reactions

  !> The quantity of complex moments of the elements.
  pure complex(wp) function total(self, moment)
    class(response_quantity_t), intent(in) :: self
    complex(wp), intent(in) :: moment(:)   !! [N m], [elements]

    total = sum(self%weight * moment(self%element))
  end function total

end module nocdyn_response_quantities
