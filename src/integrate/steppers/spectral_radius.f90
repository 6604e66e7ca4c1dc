!> Estimates of the spectral radius of the Jacobian of each lane, by power iteration.
module nocdyn_spectral_radius
  use nocdyn_kinds, only: wp
  use nocdyn_pattern_entries, only: entries_in_rows, entries_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: allocate_spectral_radius, restart_power_iteration, estimate_spectral_radius

  real(wp), parameter :: start_share = 1.0e-3_wp   !! of the start vector, added so that another eigenvalue can become dominant

  !> A power iteration that continues from step to step.
  type, public :: spectral_radius_t
    type(entries_t), private :: entries            !! of the Jacobian in the rows of states
    real(wp), allocatable, private :: vector(:, :) !! of unit length, [states, lanes]
    real(wp), allocatable, private :: start(:)     !! start vector, of unit length, [states]
    real(wp), allocatable, private :: image(:)     !! Jacobian times vector, [states]
  end type spectral_radius_t

contains

  !> Allocates one vector for each lane.
  subroutine allocate_spectral_radius(spectrum, system)
    type(spectral_radius_t), intent(out) :: spectrum
    class(system_t), intent(in) :: system
    integer :: i, lane

    spectrum%entries = entries_in_rows(system%jacobian_pattern(), 1, system%states)
    allocate (spectrum%image(system%states), spectrum%vector(system%states, system%lanes), source=0.0_wp)
    allocate (spectrum%start(system%states))
    spectrum%start(:) = [(1 + 0.5_wp * mod(i, 3), i=1, system%states)]
    spectrum%start(:) = spectrum%start / max(norm2(spectrum%start), tiny(1.0_wp))
    do lane = 1, system%lanes
      call restart_power_iteration(spectrum, lane)
    end do
  end subroutine allocate_spectral_radius

  !> Restarts the iteration of a lane.
  pure subroutine restart_power_iteration(spectrum, lane)
    type(spectral_radius_t), intent(inout) :: spectrum
    integer, intent(in) :: lane

    spectrum%vector(:, lane) = spectrum%start
  end subroutine restart_power_iteration

  !> The spectral radius by two steps of the iteration; the geometric mean of both growths is right for a pair of conjugate
  !> eigenvalues too.
  pure subroutine estimate_spectral_radius(spectrum, lane, dfdy, size_of_eigenvalue)
    type(spectral_radius_t), intent(inout) :: spectrum
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: dfdy(:, :)   !! shape [lanes, positions]
    real(wp), intent(out) :: size_of_eigenvalue   !! [1/s]
    real(wp) :: growth(2)
    integer :: i, p

    growth(:) = 0.0_wp
    do i = 1, 2
      spectrum%image(:) = 0.0_wp
      associate (row => spectrum%entries%row, column => spectrum%entries%column, position => spectrum%entries%position)
        do p = 1, size(position)
          spectrum%image(row(p)) = spectrum%image(row(p)) + dfdy(lane, position(p)) * spectrum%vector(column(p), lane)
        end do
      end associate
      growth(i) = norm2(spectrum%image)
      if (.not. growth(i) > 0) exit
      spectrum%vector(:, lane) = spectrum%image / growth(i)
    end do
    size_of_eigenvalue = sqrt(growth(1) * growth(2))
    if (growth(2) > 0) then
      spectrum%vector(:, lane) = spectrum%vector(:, lane) + start_share * spectrum%start
      spectrum%vector(:, lane) = spectrum%vector(:, lane) / norm2(spectrum%vector(:, lane))
    else
      spectrum%vector(:, lane) = spectrum%start
    end if
  end subroutine estimate_spectral_radius

end module nocdyn_spectral_radius
