!> Numbers of periodic motions that sweeps record: peaks of signals, folds, jumps, unstable ranges.
module nocdyn_orbit_records
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_measures, only: measured_orbits_t
  use nocdyn_orbit_parts, only: jump_direction, part_t, unstable_stretches
  use nocdyn_orbit_problem, only: fold
  use nocdyn_text, only: counted, quoted, to_text
  implicit none (type, external)
  private

  public :: find_orbit_number

contains

  !> Finds a number of an analysis. Folds and jumps are counted along the branches, as in orbit.csv.
  subroutine find_orbit_number(analysis, quantity, word, number, value, obstacle)
    type(measured_orbits_t), intent(in) :: analysis
    character(len=*), intent(in) :: quantity   !! signal, or 'branch'
    character(len=*), intent(in) :: word       !! peak, peak_value; fold, jump_up, jump_down, folds, unstable_ranges
    integer, intent(in) :: number              !! which one of several folds or jumps
    real(wp), intent(out) :: value             !! of a signal in SI units, else in the unit of the parameter
    character(len=:), allocatable, intent(out) :: obstacle   !! why there is none, else ''
    type(part_t), allocatable :: stretches(:)
    integer :: i, signal

    value = 0.0_wp
    obstacle = ''
    if (.not. analysis%settings%has_stability .and. any(word == [character(len=15) :: 'jump_up', 'jump_down', &
                                                                 'unstable_ranges'])) then
      obstacle = word // ' needs the stability of the motions; required: stability = .true. in &orbit'
      return
    end if
    associate (points => analysis%branch%points(:analysis%branch%count))
      select case (word)
      case ('peak', 'peak_value')
        signal = findloc([(analysis%signals(i)%name == quantity, i=1, size(analysis%signals))], .true., dim=1)
        if (signal == 0) then
          obstacle = 'orbit.csv of this variant has no signal ' // quoted(quantity)
          return
        end if
        i = analysis%peak(signal)
        value = points(i)%orbit%value
        if (word == 'peak') value = analysis%measures(i)%ranges(signal)%half_range
      case ('folds')
        value = count([(points(i)%kind == fold, i=1, size(points))])
      case ('unstable_ranges')
        call unstable_stretches(points, stretches)
        value = size(stretches)
      case default
        call find_special(word, number, value, obstacle)
      end select
    end associate

  contains

    !> The value of a fold of a kind.
    subroutine find_special(word, number, value, obstacle)
      character(len=*), intent(in) :: word
      integer, intent(in) :: number
      real(wp), intent(inout) :: value
      character(len=:), allocatable, intent(inout) :: obstacle
      integer :: found, i
      logical :: is_one

      found = 0
      associate (points => analysis%branch%points)
        do i = 1, analysis%branch%count
          is_one = points(i)%kind == fold
          if (is_one .and. word /= 'fold') is_one = jump_direction(points, i) == merge(1, -1, word == 'jump_up')
          if (is_one) found = found + 1
          if (.not. is_one .or. found < number) cycle
          value = points(i)%orbit%value
          return
        end do
      end associate
      obstacle = word // ' ' // to_text(number) // ' is recorded, but the motions of this variant have ' // &
                 counted(found, 'such point', 'such points')
    end subroutine find_special

  end subroutine find_orbit_number

end module nocdyn_orbit_records
