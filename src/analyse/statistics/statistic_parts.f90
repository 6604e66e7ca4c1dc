!> The parts of statistics: one of a whole shaft has a part for each of its points, of which the worst one counts.
module nocdyn_statistic_parts
  use nocdyn_machine, only: machine_t
  use nocdyn_signals, only: is_largest_along, list_points, signal_point_moment, signal_point_stress, signal_source_t
  use nocdyn_statistics, only: is_time_of_extreme, statistic_max, statistic_max_abs, statistic_min, statistic_t, &
    statistic_time_of_max, statistic_time_of_min
  implicit none (type, external)
  private

  public :: list_parts

contains

  !> The parts of all statistics. The points of shafts become columns after the ones of the table. An extreme of the largest
  !> moment or stress along a shaft has its column as the first part, then the extremes at the points, and the times of these.
  subroutine list_parts(machine, statistics, columns, parts, first_part, is_along)
    type(machine_t), intent(in) :: machine
    type(statistic_t), intent(in) :: statistics(:)
    type(signal_source_t), allocatable, intent(inout) :: columns(:)
    type(statistic_t), allocatable, intent(out) :: parts(:)
    integer, allocatable, intent(out) :: first_part(:)   !! of each statistic, [statistics + 1]
    logical, allocatable, intent(out) :: is_along(:)     !! extremes of the largest moment or stress along a shaft
    type(signal_source_t), allocatable :: points(:)
    integer :: count, first, i, k

    allocate (parts(size(statistics)), first_part(size(statistics) + 1), is_along(size(statistics)))
    count = 0
    do i = 1, size(statistics)
      first_part(i) = count + 1
      associate (statistic => statistics(i))
        call find_points(machine, statistic, columns, points, is_along(i))
        if (is_along(i) .or. size(points) == 0 .and. .not. allocated(statistic%shaft)) then
          call add_part(statistic, statistic%column, statistic%kind, parts, count)
        end if
        call add_columns(points, columns, first)
        if (is_along(i) .and. is_time_of_extreme(statistic%kind)) then
          do k = first, first + size(points) - 1
            call add_part(statistic, k, extreme_of(statistic%kind), parts, count)
          end do
        end if
        do k = first, first + size(points) - 1
          call add_part(statistic, k, statistic%kind, parts, count)
        end do
      end associate
    end do
    first_part(size(statistics) + 1) = count + 1
    call resize(parts, count)
  end subroutine list_parts

  !> Adds a part of a statistic.
  subroutine add_part(statistic, column, kind, parts, count)
    type(statistic_t), intent(in) :: statistic
    integer, intent(in) :: column, kind
    type(statistic_t), allocatable, intent(inout) :: parts(:)
    integer, intent(inout) :: count   !! of the parts so far

    if (count == size(parts)) call resize(parts, 2 * count)
    count = count + 1
    parts(count) = statistic
    parts(count)%column = column
    parts(count)%kind = kind
  end subroutine add_part

  subroutine resize(parts, count)
    type(statistic_t), allocatable, intent(inout) :: parts(:)
    integer, intent(in) :: count
    type(statistic_t) :: none
    type(statistic_t), allocatable :: resized(:)
    integer :: kept

    kept = min(count, size(parts))
    allocate (resized(count), source=none)
    resized(:kept) = parts(:kept)
    call move_alloc(resized, parts)
  end subroutine resize

  !> Adds the columns of the points of a shaft, unless they are there.
  pure subroutine add_columns(points, columns, first)
    type(signal_source_t), intent(in) :: points(:)
    type(signal_source_t), allocatable, intent(inout) :: columns(:)
    integer, intent(out) :: first   !! column of the first point
    integer :: c

    first = size(columns) + 1
    if (size(points) == 0) return
    do c = 1, size(columns)
      if (columns(c)%kind == points(1)%kind .and. columns(c)%bank == points(1)%bank .and. &
          columns(c)%quantity == points(1)%quantity .and. columns(c)%index == points(1)%index) first = min(first, c)
    end do
    if (first > size(columns)) columns = [columns, points]
  end subroutine add_columns

  !> The points of a shaft that a statistic is of, or an extreme of the largest moment or stress along it.
  subroutine find_points(machine, statistic, columns, points, is_along)
    type(machine_t), intent(in) :: machine
    type(statistic_t), intent(in) :: statistic
    type(signal_source_t), intent(in) :: columns(:)
    type(signal_source_t), allocatable, intent(out) :: points(:)   !! columns; none if it is of no shaft
    logical, intent(out) :: is_along                        !! whether it is such an extreme
    logical :: is_stress

    is_along = .false.
    is_stress = statistic%is_stress
    if (allocated(statistic%shaft)) then
      call list_points(machine, statistic%shaft, merge(signal_point_stress, signal_point_moment, is_stress), points)
      return
    end if
    if (statistic%column > 0 .and. any(extreme_of(statistic%kind) == [statistic_max, statistic_min, statistic_max_abs])) then
      associate (column => columns(statistic%column))
        is_along = is_largest_along(machine, column, is_stress)
        if (is_along) call list_points(machine, machine%banks(column%bank)%bank%names(column%index)%text, &
                                       merge(signal_point_stress, signal_point_moment, is_stress), points)
      end associate
    end if
    if (.not. is_along) allocate (points(0))
  end subroutine find_points

  !> The extreme of which a statistic is the time; other statistics as they are.
  pure integer function extreme_of(kind)
    integer, intent(in) :: kind   !! statistic_...

    extreme_of = kind
    if (kind == statistic_time_of_max) then
      extreme_of = statistic_max
    else if (kind == statistic_time_of_min) then
      extreme_of = statistic_min
    else if (is_time_of_extreme(kind)) then
      extreme_of = statistic_max_abs
    end if
  end function extreme_of

end module nocdyn_statistic_parts
