!> The linear machine at one frequency: the harmonics that excite it, and the twists and moments of its elements.
module nocdyn_line_solutions
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, new_band_work
  use nocdyn_excitation_lines, only: source_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_slopes, only: slopes_t
  implicit none (type, external)
  private

  public :: new_line_work, solve_line, find_twist, lost_power

  !> Work space of one thread, and the last solution.
  type, public :: line_work_t
    type(band_work_t) :: band
    complex(wp), allocatable :: stiffness(:)    !! [N m/rad], [elements]
    complex(wp), allocatable :: series(:)       !! twists in series with the elements [rad], [elements]
  end type line_work_t

contains

  !> Work space for a machine.
  type(line_work_t) function new_line_work(machine, matrix) result(work)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix   !! of it

    work%band = new_band_work(matrix)
    allocate (work%stiffness(machine%elements%count), work%series(machine%elements%count), source=(0.0_wp, 0.0_wp))
  end function new_line_work

  !> Solves for the coordinates at one frequency.
  pure subroutine solve_line(machine, matrix, slopes, frequency, sources, work)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix   !! of it
    type(slopes_t), intent(in) :: slopes
    real(wp), intent(in) :: frequency                 !! Omega [rad/s]
    type(source_t), intent(in) :: sources(:)          !! all with this frequency
    type(line_work_t), intent(inout) :: work
    real(wp), parameter :: beside = 1.0e-9_wp   ! an undamped resonance, where there is no response
    logical :: singular

    call slopes%find_stiffness(machine%elements%internal, cmplx(0.0_wp, frequency, wp), work%stiffness)
    call matrix%factor(frequency, work%stiffness, work%band, singular)
    if (singular) call matrix%factor(frequency * (1.0_wp + beside), work%stiffness, work%band, singular)
    work%band%x(:) = (0.0_wp, 0.0_wp)
    call add_sources(matrix, sources, work)
    call matrix%solve(work%band)
  end subroutine solve_line

  !> The forces of some harmonics, and their twists in series.
  pure subroutine add_sources(matrix, sources, work)
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(source_t), intent(in) :: sources(:)
    type(line_work_t), intent(inout) :: work
    integer :: i

    work%series(:) = (0.0_wp, 0.0_wp)
    do i = 1, size(sources)
      associate (e => sources(i)%element, amplitude => sources(i)%moment)
        if (sources(i)%is_twist) then
          work%series(e) = work%series(e) + amplitude
          call matrix%add_twist(e, work%stiffness(e), amplitude, work%band)
        else
          call matrix%add_forces(e, amplitude, work%band)
        end if
      end associate
    end do
  end subroutine add_sources

  !> The twist of an element without that in series, and its moment, after `solve_line`.
  pure subroutine find_twist(matrix, element, work, twist, moment)
    type(dynamic_stiffness_t), intent(in) :: matrix
    integer, intent(in) :: element
    type(line_work_t), intent(in) :: work
    complex(wp), intent(out) :: twist    !! [rad]
    complex(wp), intent(out) :: moment   !! [N m]

    call matrix%find_moment(element, work%stiffness(element), work%series(element), work%band, twist, moment)
  end subroutine find_twist

  !> The mean power that an element loses at a frequency [W].
  pure real(wp) function lost_power(frequency, stiffness, twist) result(power)
    real(wp), intent(in) :: frequency         !! [rad/s]
    complex(wp), intent(in) :: stiffness      !! [N m/rad]
    complex(wp), intent(in) :: twist          !! amplitude [rad]

    power = 0.5_wp * frequency * aimag(stiffness) * (real(twist, wp)**2 + aimag(twist)**2)
  end function lost_power

end module nocdyn_line_solutions
