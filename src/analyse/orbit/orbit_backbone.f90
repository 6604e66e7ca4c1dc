!> The frequencies of a nonlinear normal mode: the linear one, and the quasi-linear one at the amplitude of each motion.
!>
!> Quasi-linear: each coupling has the stiffness that the first harmonic of its moment has over the one of its twist (its
!> describing function: A. Gelb, W. E. Vander Velde, Multiple-input describing functions and nonlinear system design, 1968), at
!> the twists of the mode of the machine with these stiffnesses. This is the harmonic balance of a mean value and one harmonic.
module nocdyn_orbit_backbone
  use nocdyn_bank, only: role_coupling, role_names, role_phase
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_problem, only: harmonic_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_equations, only: begin_of
  use nocdyn_orbit_points, only: branch_t
  use nocdyn_orbit_problem, only: orbit_problem_t
  use nocdyn_text, only: append, listed, quoted, string_t
  implicit none (type, external)
  private

  public :: find_quasi_linear, note_left_out

  type, public :: backbone_t
    real(wp) :: linear_rate = 0.0_wp                !! of the mode at small amplitudes [rad/s]
    real(wp), allocatable :: quasi_linear_rate(:)   !! at the amplitudes of the points [rad/s], 0 where it is not found
    real(wp), allocatable :: energy(:)              !! of each point, above the one in balance [J]
  end type backbone_t

  integer, parameter :: samples = 128   ! of a period, for the first harmonic of moments

contains

  !> The quasi-linear frequencies at all points of a branch.
  subroutine find_quasi_linear(problem, branch, backbone)
    class(orbit_problem_t), intent(in) :: problem
    type(branch_t), intent(in) :: branch
    type(backbone_t), intent(inout) :: backbone
    type(harmonic_problem_t), allocatable :: one
    type(error_t), allocatable :: error
    real(wp), allocatable :: row(:), x(:)
    integer :: i, iterations
    logical :: has_converged

    allocate (backbone%quasi_linear_rate(branch%count), backbone%energy(branch%count), source=0.0_wp)
    select type (problem)
    type is (harmonic_problem_t)
      allocate (one, source=problem)
    end select
    call one%equations%set_harmonics(1, error, samples)
    if (allocated(error)) return
    do i = 1, branch%count
      x = one%put_together(branch%points(i)%orbit)
      row = 0.0_wp * x
      row(size(row)) = 1.0_wp
      call one%correct(row, branch%points(i)%orbit%value, x, iterations, has_converged, error)
      if (.not. allocated(error) .and. has_converged) backbone%quasi_linear_rate(i) = x(size(x) - 1)
      if (allocated(error)) deallocate (error)
      associate (series => branch%points(i)%orbit%series)
        call one%equations%conservative_energy(one%equations%origin, begin_of(series, one%equations%free), &
                                               backbone%energy(i), error)
      end associate
      if (allocated(error)) deallocate (error)
    end do
  end subroutine find_quasi_linear

  !> Adds a note on what the conservative machine does not have.
  subroutine note_left_out(machine, notes)
    type(machine_t), intent(in) :: machine   !! the whole one
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(string_t), allocatable :: names(:)
    integer :: b, e

    allocate (names(1))
    names(1) = string_t('damping')
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role == role_coupling .or. bank%role == role_phase) cycle
        do e = 1, bank%count
          call append(names, trim(role_names(bank%role)) // ' ' // quoted(bank%names(e)%text))
        end do
      end associate
    end do
    call append(notes, 'left out of the conservative machine: ' // listed(names, ', ') // &
                '; constant torques hold the twists of the steady state')
  end subroutine note_left_out

end module nocdyn_orbit_backbone
