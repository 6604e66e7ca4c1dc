!> Estimates of the dominant eigenvalue of the Jacobian of each lane.
module nocdyn_spectra
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: pattern_t, system_t
  implicit none (type, external)
  private

  public :: allocate_spectra, restart_spectrum, dominate

  real(wp), parameter :: freshness = 1.0e-3_wp   !! of the start in the vector: another eigenvalue may come to dominate

  !> A power iteration that goes on from step to step.
  type, public :: spectra_t
    integer, allocatable, private :: position(:)   !! of the Jacobian's entries in the rows of states
    integer, allocatable, private :: row(:)
    integer, allocatable, private :: column(:)
    real(wp), allocatable, private :: vector(:, :) !! of unit length, shape [states, lanes]
    real(wp), allocatable, private :: start(:)     !! of every iteration, of unit length, shape [states]
    real(wp), allocatable, private :: image(:)     !! shape [states]
  end type spectra_t

contains

  !> Room for one vector of each lane.
  subroutine allocate_spectra(spectra, system)
    type(spectra_t), intent(out) :: spectra
    class(system_t), intent(in) :: system
    type(pattern_t) :: pattern
    integer :: i, lane

    pattern = system%jacobian_pattern()
    allocate (spectra%position, source=pack([(i, i=1, size(pattern%row))], pattern%row <= system%states))
    allocate (spectra%row(size(spectra%position)), spectra%column(size(spectra%position)))
    spectra%row(:) = pattern%row(spectra%position)   ! gfortran 12 counts from 0 with `source=` here
    spectra%column(:) = pattern%column(spectra%position)
    allocate (spectra%image(system%states), spectra%vector(system%states, system%lanes), source=0.0_wp)
    allocate (spectra%start(system%states))
    spectra%start(:) = [(1 + 0.5_wp * mod(i, 3), i=1, system%states)]
    spectra%start(:) = spectra%start / max(norm2(spectra%start), tiny(1.0_wp))
    do lane = 1, system%lanes
      call restart_spectrum(spectra, lane)
    end do
  end subroutine allocate_spectra

  !> Forgets what has been found in a lane.
  pure subroutine restart_spectrum(spectra, lane)
    type(spectra_t), intent(inout) :: spectra
    integer, intent(in) :: lane

    spectra%vector(:, lane) = spectra%start
  end subroutine restart_spectrum

  !> Size of the dominant eigenvalue, by two steps of the iteration: the mean growth over both also measures a pair of
  !> conjugate eigenvalues.
  pure subroutine dominate(spectra, lane, dfdy, size_of_eigenvalue)
    type(spectra_t), intent(inout) :: spectra
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: dfdy(:, :)   !! shape [lanes, positions]
    real(wp), intent(out) :: size_of_eigenvalue
    real(wp) :: growth(2)
    integer :: i

    growth(:) = 0.0_wp
    do i = 1, 2
      call multiply(spectra%position, spectra%row, spectra%column, dfdy, lane, spectra%vector(:, lane), spectra%image)
      growth(i) = norm2(spectra%image)
      if (.not. growth(i) > 0) exit
      spectra%vector(:, lane) = spectra%image / growth(i)
    end do
    size_of_eigenvalue = sqrt(growth(1) * growth(2))
    if (growth(2) > 0) then
      spectra%vector(:, lane) = spectra%vector(:, lane) + freshness * spectra%start
      spectra%vector(:, lane) = spectra%vector(:, lane) / norm2(spectra%vector(:, lane))
    else
      spectra%vector(:, lane) = spectra%start
    end if
  end subroutine dominate

  pure subroutine multiply(position, row, column, dfdy, lane, vector, image)
    integer, intent(in) :: position(:), row(:), column(:)
    real(wp), contiguous, intent(in) :: dfdy(:, :)
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: vector(:)
    real(wp), contiguous, intent(out) :: image(:)
    integer :: i

    image(:) = 0.0_wp
    do i = 1, size(position)
      image(row(i)) = image(row(i)) + dfdy(lane, position(i)) * vector(column(i))
    end do
  end subroutine multiply

end module nocdyn_spectra
