!> The map U from coordinates to elements, or R from moments to accelerations, on a strip of lanes whose numbers stand in groups.
!>
!> With several lanes the coefficients of a strip are copies in groups, some for each entry. With one lane, whose elements are the
!> groups, small matrices are multiplied with their zeros, and large ones as `sparse_map_t` does. The terms of a row are always
!> added in the order of its entries.
module nocdyn_series_maps
  use nocdyn_kinds, only: wp
  use nocdyn_laws, only: narrow
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_series_map

  integer, parameter :: max_dense_entries = 1024   ! of a matrix up to which multiplying its zeros is faster

  type, public :: series_map_t
    integer :: mapped = 0                              !! rows, with several lanes
    integer, allocatable :: first(:), column(:)        !! of the rows, [mapped + 1]; of the entries
    real(wp), allocatable :: coefficient(:, :, :)      !! [strip, entries, strips], with several lanes
    integer, private :: lanes = 1, columns = 0
    integer, private :: strip = 1                      !! lanes of a strip, in whole groups if there are several lanes
    logical, private :: is_dense = .false.
    real(wp), private, allocatable :: matrix(:, :, :)  !! [narrow, columns, groups of rows], if dense
    real(wp), private, allocatable :: result(:)        !! [rows], if neither
  contains
    procedure :: multiply, refresh_lane
  end type series_map_t

contains

  !> The map with a matrix of some rows and columns.
  function new_series_map(map, lanes, strip, rows, columns) result(self)
    type(sparse_map_t), intent(in) :: map
    integer, intent(in) :: lanes, strip, rows, columns
    type(series_map_t) :: self
    integer :: lane

    self%lanes = lanes
    self%strip = strip
    self%columns = columns
    if (lanes > 1) then
      self%mapped = rows
      allocate (self%first, source=map%first)
      allocate (self%column, source=map%column)
      allocate (self%coefficient(strip, size(map%column), (lanes + strip - 1) / strip), source=0.0_wp)
    else
      allocate (self%first(1), self%column(1), source=1)
      allocate (self%coefficient(narrow, 1, 1), source=0.0_wp)
      self%is_dense = narrow * groups_of(rows) * columns <= max_dense_entries
      if (self%is_dense) allocate (self%matrix(narrow, columns, groups_of(rows)), source=0.0_wp)
      allocate (self%result(narrow * groups_of(rows)), source=0.0_wp)
    end if
    do lane = 1, lanes
      call self%refresh_lane(lane, map)
    end do
  end function new_series_map

  pure integer function groups_of(numbers)
    integer, intent(in) :: numbers

    groups_of = (numbers + narrow - 1) / narrow
  end function groups_of

  !> Copies the coefficients of a lane. The coefficients of the last lane also fill the lanes beyond it in its strip.
  subroutine refresh_lane(self, lane, map)
    class(series_map_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(sparse_map_t), intent(in) :: map
    real(wp) :: unit(self%columns)
    integer :: at, c, last

    if (self%lanes > 1) then
      at = modulo(lane - 1, self%strip) + 1
      last = merge(self%strip, at, lane == self%lanes)
      do c = 1, size(self%column)
        self%coefficient(at:last, c, (lane - 1) / self%strip + 1) = map%coefficient(lane, c)
      end do
    else if (self%is_dense) then
      do c = 1, self%columns
        unit = 0.0_wp
        unit(c) = 1.0_wp
        call map%multiply(unit, self%result)
        self%matrix(:, c, :) = reshape(self%result, [narrow, size(self%matrix, 3)])
      end do
    end if
  end subroutine refresh_lane

  !> The product of one lane with x, coefficient k of y.
  subroutine multiply(self, map, order, k, x, y)
    class(series_map_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: map
    integer, intent(in) :: order, k
    real(wp), intent(in) :: x(self%columns)
    real(wp), intent(inout) :: y(narrow, 0:order, size(self%result) / narrow)   !! groups of the rows
    integer :: g

    if (self%is_dense) then
      call multiply_dense(size(self%matrix, 3), self%columns, self%matrix, x, order, k, y)
      return
    end if
    call map%multiply(x, self%result)
    do g = 1, size(self%result) / narrow
      y(:, k, g) = self%result(narrow * (g - 1) + 1:narrow * g)
    end do
  end subroutine multiply

  !> With all zeros of the matrix.
  pure subroutine multiply_dense(groups, columns, matrix, x, order, k, y)
    integer, intent(in) :: groups, columns
    real(wp), intent(in) :: matrix(narrow, columns, groups), x(columns)
    integer, intent(in) :: order, k
    real(wp), intent(inout) :: y(narrow, 0:order, groups)
    real(wp) :: sum(narrow)
    integer :: c, g

    do g = 1, groups
      sum = 0.0_wp
      do c = 1, columns
        sum = sum + matrix(:, c, g) * x(c)
      end do
      y(:, k, g) = sum
    end do
  end subroutine multiply_dense

end module nocdyn_series_maps
