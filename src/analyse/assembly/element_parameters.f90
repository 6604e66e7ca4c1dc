!> Some groups of one kind of an input as the arguments of a bank's constructor, the same in every lane.
module nocdyn_element_parameters
  use nocdyn_body_index, only: bodies_of, body_index_t
  use nocdyn_curves, only: curve_t, extrapolation_constant, extrapolation_linear, interpolation_cubic, interpolation_linear, &
                           new_curve
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: names_of, ends_of, values_of, curves_of

contains

  !> The names of some groups.
  function names_of(input, indices) result(names)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)   !! of the groups
    type(string_t) :: names(size(indices))
    integer :: i

    do i = 1, size(indices)
      names(i)%text = input%groups(indices(i))%name
    end do
  end function names_of

  !> Value number `which` of a key that names bodies.
  function ends_of(input, indices, key, which, body_index) result(chosen)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    character(len=*), intent(in) :: key
    integer, intent(in) :: which
    type(body_index_t), intent(in) :: body_index
    integer :: chosen(size(indices))
    integer, allocatable :: bodies(:)
    integer :: i

    do i = 1, size(indices)
      bodies = bodies_of(input%groups(indices(i)), key, body_index)
      chosen(i) = bodies(which)
    end do
  end function ends_of

  !> One number of each group, [lanes, groups].
  function values_of(input, indices, lanes, key, absent) result(values)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    character(len=*), intent(in) :: key
    real(wp), intent(in), optional :: absent   !! where it is unset; absent: 0
    real(wp) :: values(lanes, size(indices))
    real(wp) :: otherwise
    integer :: i

    otherwise = 0.0_wp
    if (present(absent)) otherwise = absent
    do i = 1, size(indices)
      values(:, i) = input%groups(indices(i))%number(key, absent=otherwise)
    end do
  end function values_of

  !> The table of each group, [lanes, groups].
  function curves_of(input, indices, lanes, x, y, extrapolation) result(curves)
    type(input_t), intent(in) :: input
    integer, intent(in) :: indices(:)
    integer, intent(in) :: lanes
    character(len=*), intent(in) :: x, y                    !! keys of the lists
    character(len=*), intent(in), optional :: extrapolation   !! that of the group if absent
    type(curve_t) :: curves(lanes, size(indices))
    character(len=:), allocatable :: beyond
    integer :: i, inside, lane, outside

    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        if (present(extrapolation)) then
          beyond = extrapolation
        else
          beyond = group%text('extrapolation')
        end if
        inside = merge(interpolation_cubic, interpolation_linear, group%text('interpolation') == 'cubic')
        outside = merge(extrapolation_constant, extrapolation_linear, beyond == 'constant')
        curves(1, i) = new_curve(group%numbers(x), group%numbers(y), inside, outside)
        do lane = 2, lanes
          curves(lane, i) = curves(1, i)
        end do
      end associate
    end do
  end function curves_of

end module nocdyn_element_parameters
