!> Notes on what the curves through the tables of relations and drives do that the tables do not say.
module nocdyn_motion_notes
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_motion_assembly, only: spline_shape
  use nocdyn_splines, only: new_spline, spline_smooth, spline_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  use nocdyn_units, only: unit_deg, units
  implicit none (type, external)
  private

  public :: note_motions

  real(wp), parameter :: worth_noting = 0.002_wp   ! of the travel of a table

contains

  !> Notes splines that leave dwells of their tables, and tables of angles that end in motion within the run.
  subroutine note_motions(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp) :: t_end
    integer :: i

    t_end = input%groups(input%position('run'))%number('t_end')
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        select case (group%kind)
        case ('relation')
          if (spline_shape(group%text('interpolation')) == spline_smooth) then
            call note_dwells(group, 'table_angle', 'table_driven', group%text('kind') /= 'lever', notes)
          end if
        case ('drive')
          if (.not. group%has_value('table_time')) cycle
          if (group%text('kind') == 'angle') then
            if (is_smooth(group, default=.true.)) call note_dwells(group, 'table_time', 'table_angle', .false., notes)
            call note_end(group, t_end, notes)
          else if (is_smooth(group, default=.false.)) then
            call note_dwells(group, 'table_time', 'table_speed', .false., notes)
          end if
        case default   ! has no curve that is a spline
        end select
      end associate
    end do
  end subroutine note_motions

  !> Whether the table of a drive is a smooth spline.
  pure logical function is_smooth(group, default)
    type(group_t), intent(in) :: group
    logical, intent(in) :: default   !! if no interpolation is given

    is_smooth = default
    if (group%has_value('interpolation')) is_smooth = group%text('interpolation') == 'spline'
  end function is_smooth

  !> The largest distance of a smooth spline from segments of equal values.
  subroutine note_dwells(group, x_key, y_key, repeats, notes)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: x_key, y_key   !! of the table
    logical, intent(in) :: repeats
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: looks = 12   ! at each segment
    real(wp), allocatable :: x(:), y(:)
    character(len=*), parameter :: names(2) = [character(len=7) :: 'degrees', 'rad/s']
    real(wp) :: distance, place(0:3)
    type(spline_t) :: spline
    integer :: i, k

    allocate (x, source=group%numbers(x_key))
    allocate (y, source=group%numbers(y_key))
    if (.not. any(is_same(y(2:), y(:size(y) - 1)))) return
    spline = new_spline(x, y, repeats)
    distance = 0.0_wp
    do i = 1, size(x) - 1
      if (.not. is_same(y(i), y(i + 1))) cycle
      do k = 1, looks - 1
        place = spline%derivatives(x(i) + k * (x(i + 1) - x(i)) / looks)
        distance = max(distance, abs(place(0) - y(i)))
      end do
    end do
    if (distance <= worth_noting * (maxval(y) - minval(y))) return
    associate (unit => merge(2, 1, y_key == 'table_speed'), share => 100 * distance / (maxval(y) - minval(y)))
      if (unit == 1) distance = distance / units(unit_deg)%factor
      call append(notes, group%kind // ' ' // quoted(group%name) // ': the spline leaves equal values of ' // y_key // &
                  ' by up to ' // rounded_text(distance, 3) // ' ' // trim(names(unit)) // ', ' // rounded_text(share, 2) // &
                  " % of their range; interpolation = 'dwells' keeps them")
    end associate
  end subroutine note_dwells

  !> A table of angles goes on with its last speed.
  subroutine note_end(group, t_end, notes)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: t_end   !! of the run [s]
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), allocatable :: x(:), y(:)
    real(wp) :: last(0:3)
    type(spline_t) :: spline

    allocate (x, source=group%numbers('table_time'))
    allocate (y, source=group%numbers('table_angle'))
    if (x(size(x)) >= t_end) return
    if (group%has_value('interpolation')) then
      spline = new_spline(x, y, .false., spline_shape(group%text('interpolation')))
    else
      spline = new_spline(x, y, .false.)
    end if
    last = spline%derivatives(x(size(x)))
    if (abs(last(1)) * (t_end - x(size(x))) <= worth_noting * (maxval(y) - minval(y))) return
    call append(notes, 'drive ' // quoted(group%name) // ': its table ends at t = ' // to_text(x(size(x))) // &
                ' s in the run, and the angle goes on with the last speed, ' // rounded_text(last(1), 4) // ' rad/s')
  end subroutine note_end

  elemental logical function is_same(a, b)
    real(wp), intent(in) :: a, b

    is_same = .not. abs(a - b) > 0
  end function is_same

end module nocdyn_motion_notes
