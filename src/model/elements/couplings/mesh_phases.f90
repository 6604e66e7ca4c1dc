!> The phases of meshes with a transmission error: the angles of their first bodies, on which the error depends. Their moments are
!> part of the law of the mesh, whose bank comes before.
module nocdyn_mesh_phases
  use nocdyn_bank, only: harmonic_t
  use nocdyn_couplings, only: couplings_t
  use nocdyn_kinds, only: wp
  use nocdyn_phases, only: phases_t
  implicit none (type, external)
  private

  public :: new_mesh_phases

  type, extends(phases_t), public :: mesh_phases_t
    real(wp), allocatable :: order(:)          !! of the transmission error e of the mesh
    complex(wp), allocatable :: slope(:)       !! e'(phi) is the sum of the real parts of slope exp(i order phi) [m/rad]
  contains
    procedure :: list_harmonics
  end type mesh_phases_t

contains

  !> The phase of the only mesh of a bank. It has a work integral where the mesh has one.
  function new_mesh_phases(mesh) result(bank)
    class(couplings_t), intent(in) :: mesh   !! with a transmission error
    type(mesh_phases_t) :: bank
    type(harmonic_t), allocatable :: error(:)

    call bank%connect_phases(mesh%lanes, mesh%names, mesh%rows%body(:1))
    bank%with_work = mesh%with_work
    call mesh%list_harmonics(1, 0.0_wp, error)
    bank%order = error%order
    bank%slope = cmplx(0.0_wp, error%order, wp) * error%amplitude
  end function new_mesh_phases

  !> -e' times the mean force of the mesh.
  subroutine list_harmonics(self, element, speed, list)
    class(mesh_phases_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: speed    !! u' [rad/s]
    type(harmonic_t), allocatable, intent(out) :: list(:)
    integer :: k

    allocate (list(size(self%order)))
    do k = 1, size(list)
      list(k) = harmonic_t(-self%slope(k), 0.0_wp, self%order(k), self%rows%last_body(element))
    end do
    list%by_element = self%first - 1
  end subroutine list_harmonics

end module nocdyn_mesh_phases
