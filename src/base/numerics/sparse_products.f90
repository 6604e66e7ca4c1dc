!> Products of sparse matrices with vectors, the loops of `sparse_map_t`: of bands, which are rows whose columns all advance by
!> one from row to row, and of other rows in CSR form, there on blocks of lanes too.
!>
!> `multiply`: u = A x; `pair`: u = offset + A x and v = A y. A band is stored diagonal by diagonal; of a Toeplitz band, whose
!> rows all have the same coefficients, only the first row is stored. The terms of a row are added one after the other.
module nocdyn_sparse_products
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: multiply_band, multiply_lanes, multiply_rows, multiply_toeplitz, pair_of_band, pair_of_toeplitz

  integer, parameter :: strip = 256   !! rows whose results stay in the first-level cache from diagonal to diagonal

contains

  !> u = A x for rows with coefficients of their own.
  pure subroutine multiply_band(rows, width, columns, column, coefficient, x, u)
    integer, intent(in) :: rows, width, columns, column(rows, width)
    real(wp), intent(in) :: coefficient(rows, width), x(columns)
    real(wp), intent(inout) :: u(rows)
    integer :: begin, c, i, k

    do begin = 1, rows, strip
      c = column(1, 1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = 0.0_wp + coefficient(i, 1) * x(c + i)
      end do
      do k = 2, width
        c = column(1, k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(i, k) * x(c + i)
        end do
      end do
    end do
  end subroutine multiply_band

  !> u = A x for rows with equal coefficients.
  pure subroutine multiply_toeplitz(rows, width, columns, column, coefficient, x, u)
    integer, intent(in) :: rows, width, columns, column(width)
    real(wp), intent(in) :: coefficient(width), x(columns)
    real(wp), intent(inout) :: u(rows)
    real(wp) :: a, b
    integer :: begin, c, d, i, k

    if (width == 2) then   ! of a chain: nothing is read twice
      a = coefficient(1)
      b = coefficient(2)
      c = column(1) - 1
      d = column(2) - 1
      do i = 1, rows
        u(i) = (0.0_wp + a * x(c + i)) + b * x(d + i)
      end do
      return
    end if
    do begin = 1, rows, strip
      c = column(1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = 0.0_wp + coefficient(1) * x(c + i)
      end do
      do k = 2, width
        c = column(k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(k) * x(c + i)
        end do
      end do
    end do
  end subroutine multiply_toeplitz

  !> u = offset + A x and v = A y.
  pure subroutine pair_of_band(rows, width, columns, column, coefficient, offset, x, y, u, v)
    integer, intent(in) :: rows, width, columns, column(rows, width)
    real(wp), intent(in) :: coefficient(rows, width), offset(rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(rows), v(rows)
    integer :: begin, c, i, k

    do begin = 1, rows, strip
      c = column(1, 1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = offset(i) + coefficient(i, 1) * x(c + i)
        v(i) = 0.0_wp + coefficient(i, 1) * y(c + i)
      end do
      do k = 2, width
        c = column(1, k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(i, k) * x(c + i)
          v(i) = v(i) + coefficient(i, k) * y(c + i)
        end do
      end do
    end do
  end subroutine pair_of_band

  !> u = offset + A x and v = A y for rows with equal coefficients.
  pure subroutine pair_of_toeplitz(rows, width, columns, column, coefficient, without_offset, offset, x, y, u, v)
    integer, intent(in) :: rows, width, columns, column(width)
    logical, intent(in) :: without_offset   !! whether `offset` is zero
    real(wp), intent(in) :: coefficient(width), offset(rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(rows), v(rows)
    integer :: begin, c, i, k

    if (width == 2) then
      call pair_of_chain(rows, columns, column, coefficient, without_offset, offset, x, y, u, v)
      return
    end if
    do begin = 1, rows, strip
      c = column(1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = offset(i) + coefficient(1) * x(c + i)
        v(i) = 0.0_wp + coefficient(1) * y(c + i)
      end do
      do k = 2, width
        c = column(k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(k) * x(c + i)
          v(i) = v(i) + coefficient(k) * y(c + i)
        end do
      end do
    end do
  end subroutine pair_of_toeplitz

  !> The pair of products with two diagonals, as in a chain: nothing is read twice.
  pure subroutine pair_of_chain(rows, columns, column, coefficient, without_offset, offset, x, y, u, v)
    integer, intent(in) :: rows, columns, column(2)
    logical, intent(in) :: without_offset   !! whether `offset` is zero
    real(wp), intent(in) :: coefficient(2), offset(rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(rows), v(rows)
    real(wp) :: a, b
    integer :: c, d, i

    a = coefficient(1)
    b = coefficient(2)
    c = column(1) - 1
    d = column(2) - 1
    if (without_offset) then
      do i = 1, rows
        u(i) = (0.0_wp + a * x(c + i)) + b * x(d + i)
        v(i) = (0.0_wp + a * y(c + i)) + b * y(d + i)
      end do
    else
      do i = 1, rows
        u(i) = (offset(i) + a * x(c + i)) + b * x(d + i)
        v(i) = (0.0_wp + a * y(c + i)) + b * y(d + i)
      end do
    end if
  end subroutine pair_of_chain

  !> u = A x in some rows in CSR form, one lane.
  pure subroutine multiply_rows(rows, all_rows, columns, entries, row, first, column, coefficient, x, u)
    integer, intent(in) :: rows, all_rows, columns, entries, row(rows), first(rows + 1), column(entries)
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

  !> u = A x in every lane, in CSR form.
  pure subroutine multiply_lanes(lanes, rows, columns, entries, first, column, coefficient, x, u)
    integer, intent(in) :: lanes, rows, columns, entries, first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(lanes, entries), x(lanes, columns)
    real(wp), intent(inout) :: u(lanes, rows)
    integer :: c, i, k, l

    do i = 1, rows
      k = first(i)
      if (k == first(i + 1)) then
        u(:, i) = 0.0_wp
        cycle
      end if
      c = column(k)
      do l = 1, lanes
        u(l, i) = 0.0_wp + coefficient(l, k) * x(l, c)
      end do
      do k = first(i) + 1, first(i + 1) - 1
        c = column(k)
        do l = 1, lanes
          u(l, i) = u(l, i) + coefficient(l, k) * x(l, c)
        end do
      end do
    end do
  end subroutine multiply_lanes

end module nocdyn_sparse_products
