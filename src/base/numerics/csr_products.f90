!> Products of sparse matrices in CSR form with vectors, on blocks of lanes: loops of `sparse_map_t`.
module nocdyn_csr_products
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: multiply_rows, multiply_lanes

contains

  !> u = map x in some rows of the matrix, one lane.
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

  !> u = map x in every lane.
  pure subroutine multiply_lanes(lanes, rows, columns, entries, first, column, coefficient, x, u)
    integer, intent(in) :: lanes, rows, columns, entries
    integer, intent(in) :: first(rows + 1), column(entries)
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

end module nocdyn_csr_products
