!> The first limit cycle of the branch that begins at a Hopf point: an oscillation of the pair of eigenvalues that crosses the
!> imaginary axis there, of a given small size, with the parameter and the rate as unknowns.
module nocdyn_hopf_start
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_harmonic_problem, only: all_harmonics, harmonic_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_eigenvalues, only: find_eigenvalues, find_oscillation
  use nocdyn_orbit_points, only: add_multipliers, complete_point, walk_t
  use nocdyn_orbit_problem, only: orbit_point_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_steady_problem, only: steady_problem_t
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: start_at_hopf

  integer, parameter :: most_sizes = 16
  real(wp), parameter :: first_size = 1.0e-3_wp               ! [rad]
  real(wp), parameter :: wanted = 1.0e-4_wp                   ! change of the parameter by it, as a share of its range
  real(wp), parameter :: least = 1.0e-6_wp, most = 1.0e-3_wp  ! bounds of this change
  real(wp), parameter :: nothing = 1.0e-10_wp                 ! change that may be of rounding
  real(wp), parameter :: counted = 0.01_wp                    ! change by the cycle that counts as the least oscillation

contains

  !> Finds it. Cycles of any size at one value, as of a linear machine, are an error.
  subroutine start_at_hopf(problem, steady, settings, point, walk, error)
    class(harmonic_problem_t), intent(inout) :: problem    !! of an unknown rate
    class(steady_problem_t), intent(inout) :: steady
    type(orbit_settings_t), intent(in) :: settings
    type(orbit_point_t), intent(inout) :: point           !! the Hopf point, gets the rate of the oscillation
    type(walk_t), intent(inout) :: walk
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: oscillation(:, :), row(:)
    type(orbit_t) :: cycle
    real(wp) :: change, size_now
    integer :: i, iterations
    logical :: has_converged

    call find_critical(steady, point, oscillation, error)
    problem%vanishing = all_harmonics
    if (.not. allocated(error)) call problem%begin(error)
    if (allocated(error)) return
    walk%settings = settings
    walk%range = problem%range()
    cycle = point%orbit
    if (allocated(cycle%series)) deallocate (cycle%series)
    allocate (cycle%series(3, size(oscillation, 2)), source=0.0_wp)
    cycle%series(2:3, :) = oscillation
    call problem%keep_phase(cycle)
    row = row_of(problem, cycle)
    cycle%series(1, :) = point%orbit%series(1, :)
    size_now = first_size
    change = 0.0_wp
    has_converged = .false.
    do i = 1, most_sizes
      problem%equations%least_oscillation = size_now
      cycle%series(2:3, :) = size_now * oscillation
      walk%x = problem%put_together(cycle)
      call problem%correct(row, size_now, walk%x, iterations, has_converged, error)
      if (allocated(error)) return
      if (.not. has_converged) then
        size_now = 0.1_wp * size_now
        cycle
      end if
      change = abs(walk%x(size(walk%x)) - point%orbit%value) / walk%range
      if (change >= least .and. change <= most) exit
      if (i == most_sizes) exit
      size_now = size_now * min(100.0_wp, max(0.01_wp, sqrt(wanted / max(change, tiny(change)))))
    end do
    if (i > most_sizes .or. .not. has_converged .or. .not. change >= nothing) then
      call raise(error, exit_failed, 'no limit cycles were found that begin at ' // rounded_text(point%orbit%value, 8) // &
                 ': the machine is linear there, or changes its laws')
      return
    end if
    problem%equations%least_oscillation = size_now * sqrt(counted / change)
    call complete_point(problem, walk, error)
    if (.not. allocated(error)) call add_multipliers(problem, settings, walk%point, error)
  end subroutine start_at_hopf

  !> The rate and the form of the oscillation that begins at a Hopf point.
  subroutine find_critical(steady, point, oscillation, error)
    class(steady_problem_t), intent(inout) :: steady
    type(orbit_point_t), intent(inout) :: point
    real(wp), allocatable, intent(out) :: oscillation(:, :)
    type(error_t), allocatable, intent(out) :: error
    complex(wp), allocatable :: values(:)
    integer :: critical

    call steady%begin(error)
    if (.not. allocated(error)) call find_eigenvalues(steady%equations, point%orbit, values, error)
    if (allocated(error)) return
    critical = minloc(abs(real(values, wp)), dim=1, mask=aimag(values) > 0)
    call find_oscillation(steady%equations, point%orbit, values(critical), oscillation, error)
    point%orbit%rate = aimag(values(critical))
  end subroutine find_critical

  !> The row that measures the size of an oscillation by the form of another one.
  function row_of(problem, form) result(row)
    class(harmonic_problem_t), intent(inout) :: problem
    type(orbit_t), intent(in) :: form   !! without mean values
    real(wp), allocatable :: row(:)

    type(orbit_t) :: coordinates

    coordinates = form
    coordinates%series(:, problem%equations%freedoms + 1:) = 0.0_wp
    row = problem%put_together(coordinates)
    row(problem%equations%system%inner + 1:) = 0.0_wp
    row = row / dot_product(row, row)
  end function row_of

end module nocdyn_hopf_start
