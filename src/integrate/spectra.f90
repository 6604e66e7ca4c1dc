!> Estimates of the dominant eigenvalue of the Jacobian of each lane.
module nocdyn_spectra
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: pattern_t, system_t
  implicit none (type, external)
  private

  public :: allocate_spectra, restart_spectrum, dominate

  !> A power iteration that goes on from step to step.
  type, public :: spectra_t
    integer, allocatable, private :: position(:)   !! of the Jacobian's entries in the rows of states
    integer, allocatable, private :: row(:)
    integer, allocatable, private :: column(:)
    real(wp), allocatable, private :: vector(:, :) !! of unit length, shape [states, lanes]
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
    do lane = 1, system%lanes
      call restart_spectrum(spectra, lane)
    end do
  end subroutine allocate_spectra

  !> Forgets what has been found in a lane.
  pure subroutine restart_spectrum(spectra, lane)
    type(spectra_t), intent(inout) :: spectra
    integer, intent(in) :: lane
    integer :: i

    associate (states => size(spectra%vector, 1))
      do i = 1, states
        spectra%vector(i, lane) = (1 + 0.5_wp * mod(i, 3)) / sqrt(real(states, wp))
      end do
    end associate
  end subroutine restart_spectrum

  !> Size of the dominant eigenvalue, by two steps of the iteration: the mean growth over both also measures a pair of
  !> conjugate eigenvalues.
  pure subroutine dominate(spectra, lane, dfdy, size_of_eigenvalue)
    type(spectra_t), intent(inout) :: spectra
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: dfdy(:, :)   !! shape [lanes, positions]
    real(wp), intent(out) :: size_of_eigenvalue
    real(wp) :: growth(2), length
    integer :: i

    growth(:) = 0.0_wp
    length = norm2(spectra%vector(:, lane))
    do i = 1, 2
      call multiply(spectra, dfdy, lane, spectra%vector(:, lane), spectra%image)
      growth(i) = norm2(spectra%image) / length
      length = 1.0_wp
      if (.not. growth(i) > 0) exit
      spectra%vector(:, lane) = spectra%image / norm2(spectra%image)
    end do
    size_of_eigenvalue = sqrt(growth(1) * growth(2))
  end subroutine dominate

  pure subroutine multiply(spectra, dfdy, lane, vector, image)
    type(spectra_t), intent(in) :: spectra
    real(wp), contiguous, intent(in) :: dfdy(:, :)
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: vector(:)
    real(wp), contiguous, intent(out) :: image(:)
    integer :: i

    image(:) = 0.0_wp
    do i = 1, size(spectra%position)
      associate (row => spectra%row(i))
        image(row) = image(row) + dfdy(lane, spectra%position(i)) * vector(spectra%column(i))
      end associate
    end do
  end subroutine multiply

end module nocdyn_spectra
