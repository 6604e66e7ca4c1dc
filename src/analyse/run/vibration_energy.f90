!> The energy of the vibration of a machine: its kinetic energy about the rigid motions, and the elastic energy.
!>
!> The speeds of the rigid motion are those with the momentum of the bodies along each rigid motion:
!> omega_r = P (P^T J P)^-1 P^T J omega, where the columns of P are the rigid motions.
module nocdyn_vibration_energy
  use nocdyn_element_coordinates, only: new_element_coordinates
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: solve_positive_definite
  use nocdyn_machine, only: machine_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  implicit none (type, external)
  private

  public :: new_vibration

  type, public :: vibration_t
    real(wp), allocatable, private :: motion(:, :)       !! P, [bodies, motions]
    real(wp), allocatable, private :: momentum(:, :)     !! (P^T J P)^-1 P^T J, [motions, bodies]
    real(wp), allocatable, private :: speed(:)           !! of the bodies about the rigid motion [rad/s], work space
    real(wp) :: largest = 0.0_wp                         !! of the energies so far [J]
  contains
    procedure :: include_energy
  end type vibration_t

contains

  !> The rigid motions of a machine of one lane. Without an elastic element there is no vibration, and its energy is 0.
  type(vibration_t) function new_vibration(machine) result(self)
    type(machine_t), intent(in) :: machine
    type(rigid_motions_t) :: motions
    real(wp), allocatable :: momentum(:, :)
    logical :: is_indefinite
    integer :: k, m

    if (size(machine%elastic()) == 0) return
    associate (coordinates => machine%coordinates)
      motions = new_rigid_motions(coordinates%freedoms, new_element_coordinates(machine%elements, coordinates), &
                                  machine%elastic())
      allocate (self%motion(machine%bodies, size(motions%free)))
      do m = 1, size(motions%free)
        self%motion(:, m) = coordinates%body_speeds(1, motions%speeds([(merge(1.0_wp, 0.0_wp, k == m), &
                                                                        k=1, size(motions%free))]))
      end do
    end associate
    allocate (momentum, source=transpose(self%motion) * spread(machine%inertia(1, :), 1, size(motions%free)))
    call solve_positive_definite(matmul(momentum, self%motion), momentum, self%momentum, is_indefinite)
    allocate (self%speed(machine%bodies))
    if (is_indefinite) deallocate (self%motion)   ! by rounding: no energy is known
  end function new_vibration

  !> Takes the energy at the present speeds and twists of a machine, after `evaluate_energies`.
  subroutine include_energy(self, machine, stored, omega)
    class(vibration_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: stored(:)  !! energies of its elements [J], [elements]
    real(wp), intent(in) :: omega(:)   !! speeds [rad/s], [bodies]
    integer :: m

    if (.not. allocated(self%motion)) return
    self%speed(:) = omega
    do m = 1, size(self%motion, 2)
      self%speed(:) = self%speed - self%motion(:, m) * dot_product(self%momentum(m, :), omega)
    end do
    self%largest = max(self%largest, machine%kinetic_energy(1, self%speed) + sum(stored))
  end subroutine include_energy

end module nocdyn_vibration_energy
