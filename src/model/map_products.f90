!> Products of sparse and of small dense matrices with vectors, on blocks of lanes: the loops of `sparse_map_t`.
module nocdyn_map_products
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: dense_columns, multiply_dense, multiply_rows, multiply_stretch, multiply_lanes

  integer, parameter, public :: width = 4     !! of the vectors that a dense column consists of
  integer, parameter, public :: strip = 256   !! rows of a stretch that stay in the first cache from diagonal to diagonal

contains

  !> The dense matrix of a map, its columns filled up with zeros to whole vectors.
  pure function dense_columns(first, column, coefficient, columns) result(matrix)
    integer, intent(in) :: first(:)            !! [rows + 1]
    integer, intent(in) :: column(:)           !! [entries]
    real(wp), intent(in) :: coefficient(:)     !! [entries]
    integer, intent(in) :: columns
    real(wp), allocatable :: matrix(:, :)
    integer :: k, row

    allocate (matrix(width * ((size(first) + width - 2) / width), columns), source=0.0_wp)
    do row = 1, size(first) - 1
      do k = first(row), first(row + 1) - 1
        matrix(row, column(k)) = coefficient(k)
      end do
    end do
  end function dense_columns

  !> u = matrix x. The terms of a row are added from the first column to the last.
  pure subroutine multiply_dense(rows, columns, matrix, x, u)
    integer, intent(in) :: rows   !! whole vectors
    integer, intent(in) :: columns
    real(wp), intent(in) :: matrix(rows, columns), x(columns)
    real(wp), intent(inout) :: u(rows)
    real(wp) :: sum(width)
    integer :: c, i

    do i = 1, rows, width
      sum = 0.0_wp
      do c = 1, columns
        sum = sum + matrix(i:i + width - 1, c) * x(c)
      end do
      u(i:i + width - 1) = sum
    end do
  end subroutine multiply_dense

  !> u = map x in some rows, whose entries are stored row by row.
  pure subroutine multiply_rows(rows, all_rows, columns, entries, row, first, column, coefficient, x, u)
    integer, intent(in) :: rows, all_rows, columns, entries
    integer, intent(in) :: row(rows), first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(entries), x(columns)
    real(wp), intent(inout) :: u(all_rows)
    real(wp) :: sum
    integer :: i, k

    do i = 1, rows
      sum = 0.0_wp
      do k = first(i), first(i + 1) - 1
        sum = sum + coefficient(k) * x(column(k))
      end do
      u(row(i)) = sum
    end do
  end subroutine multiply_rows

  !> u = map x in rows whose columns advance by one from row to row; the entries are stored diagonal by diagonal.
  pure subroutine multiply_stretch(rows, diagonals, columns, column, coefficient, x, u)
    integer, intent(in) :: rows, diagonals, columns
    integer, intent(in) :: column(rows, diagonals)
    real(wp), intent(in) :: coefficient(rows, diagonals), x(columns)
    real(wp), intent(inout) :: u(rows)
    integer :: begin, c, i, k

    do begin = 1, rows, strip
      c = column(1, 1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = 0.0_wp + coefficient(i, 1) * x(c + i)
      end do
      do k = 2, diagonals
        c = column(1, k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(i, k) * x(c + i)
        end do
      end do
    end do
  end subroutine multiply_stretch

  !> u = map x in every lane.
  pure subroutine multiply_lanes(lanes, rows, columns, entries, first, column, coefficient, x, u)
    integer, intent(in) :: lanes, rows, columns, entries
    integer, intent(in) :: first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(lanes, entries), x(lanes, columns)
    real(wp), intent(inout) :: u(lanes, rows)
    integer :: c, i, k, l

    do i = 1, rows
      do l = 1, lanes
        u(l, i) = 0.0_wp
      end do
      do k = first(i), first(i + 1) - 1
        c = column(k)
        do l = 1, lanes
          u(l, i) = u(l, i) + coefficient(l, k) * x(l, c)
        end do
      end do
    end do
  end subroutine multiply_lanes

end module nocdyn_map_products
