!> The backbone of a mode as printed: how its frequency changes with the amplitude.
module nocdyn_orbit_backbone_words
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_analysis, only: orbit_analysis_t
  use nocdyn_periodic_machine, only: orbit_t
  use nocdyn_table_text, only: cell
  use nocdyn_text, only: rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: append_backbone

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: digits = 6, most_rows = 9
  real(wp), parameter :: unchanged = 1.0e-6_wp           ! of a frequency

contains

  !> Adds a sentence and a table.
  subroutine append_backbone(analysis, report)
    type(orbit_analysis_t), intent(in) :: analysis
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: word
    integer :: i, k, rows

    associate (points => analysis%branch%points(:analysis%branch%count), backbone => analysis%backbone)
      associate (first => points(1)%orbit, last => points(size(points))%orbit)
        word = ''
        associate (change => (last%rate - first%rate) * (last%value - first%value))
          if (abs(last%rate - first%rate) > unchanged * first%rate) word = merge(' (hardening)', ' (softening)', change > 0)
        end associate
        call report%append_line('  mode ' // to_text(analysis%settings%mode) // ': ' // at(first) // ', ' // at(last) // word)
      end associate
      call report%append_line('  ' // cell(trim(merge('energy   ', 'amplitude', analysis%settings%is_over_energy))) // &
                              cell('backbone') // cell('quasi-linear') // cell('linear'))
      call report%append_line('  ' // cell(analysis%unit) // cell('Hz') // cell('Hz') // cell('Hz'))
      rows = min(most_rows, size(points))
      do i = 1, rows
        k = 1 + nint(real((i - 1) * (size(points) - 1), wp) / max(1, rows - 1))
        call report%append_line('  ' // cell(points(k)%orbit%value) // cell(points(k)%orbit%rate / turn) // &
                                cell(backbone%quasi_linear_rate(k) / turn) // cell(backbone%linear_rate / turn))
      end do
    end associate

  contains

    function at(orbit) result(text)
      type(orbit_t), intent(in) :: orbit
      character(len=:), allocatable :: text

      text = rounded_text(orbit%rate / turn, digits) // ' Hz at ' // rounded_text(orbit%value, digits) // ' ' // analysis%unit
    end function at

  end subroutine append_backbone

end module nocdyn_orbit_backbone_words
