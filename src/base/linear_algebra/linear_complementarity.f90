!> Linear complementarity: w = q + M z with w >= 0, z >= 0 and in each pair w(i) = 0 or z(i) = 0, with any square M.
!>
!> By the pivoting of C. E. Lemke: R. Fletcher, Practical Methods of Optimization, 2nd ed., section 10.6. A variable z0 that is
!> added to all w takes their negative parts away; from pivot to pivot the complement of what has left the basis enters it, until
!> z0 leaves. Ties are broken by the order of the rows of the inverse of the basis, so that no basis comes back.
module nocdyn_linear_complementarity
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: solve_linear_complementarity

contains

  !> Solves the problem. It may have several solutions, or none.
  pure subroutine solve_linear_complementarity(m, q, z, is_basic, is_solved)
    real(wp), intent(in) :: m(:, :)          !! [n, n], rows and columns of like sizes
    real(wp), intent(in) :: q(:)             !! [n]
    real(wp), intent(out) :: z(:)            !! [n]
    logical, intent(out) :: is_basic(:)      !! whether it is w(i) that is zero, [n]
    logical, intent(out) :: is_solved        !! not where z0 may grow for ever; there may be a solution still
    integer :: basis(size(q)), change, entering, i, leaving, row
    real(wp) :: factor(size(q))
    real(wp), allocatable :: table(:, :)     ! of w, z, z0 and the constants, [n, 2 n + 2]

    associate (n => size(q))
      allocate (table(n, 2 * n + 2), source=0.0_wp)
      do row = 1, n
        table(row, row) = 1.0_wp
        basis(row) = row
      end do
      table(:, n + 1:2 * n) = -m
      table(:, 2 * n + 1) = -1.0_wp
      table(:, 2 * n + 2) = q
      is_solved = all(q >= 0)
      entering = 2 * n + 1
      do change = 1, merge(0, 100 + 50 * n, is_solved)
        call choose_row(table, basis, entering, change == 1, row)
        if (row == 0) exit
        leaving = basis(row)
        table(row, :) = table(row, :) / table(row, entering)
        factor = table(:, entering)
        do i = 1, n
          if (i /= row .and. abs(factor(i)) > 0) table(i, :) = table(i, :) - factor(i) * table(row, :)
        end do
        table(:, entering) = 0.0_wp
        table(row, entering) = 1.0_wp
        basis(row) = entering
        is_solved = leaving == 2 * n + 1
        if (is_solved) exit
        entering = merge(leaving + n, leaving - n, leaving <= n)
      end do
      z = 0.0_wp
      is_basic = .false.
      do row = 1, n
        if (basis(row) <= n .or. basis(row) > 2 * n) cycle
        is_basic(basis(row) - n) = .true.
        z(basis(row) - n) = max(0.0_wp, table(row, 2 * n + 2))
      end do
    end associate
  end subroutine solve_linear_complementarity

  !> The row whose variable leaves the basis: the first that comes to zero, in the order of the constants and then of the columns
  !> of the inverse of the basis; 0: none does.
  pure subroutine choose_row(table, basis, entering, is_first, row)
    real(wp), intent(in) :: table(:, :)
    integer, intent(in) :: basis(:), entering
    logical, intent(in) :: is_first   !! whether z0 enters, which grows until no variable is negative
    integer, intent(out) :: row
    real(wp), parameter :: least_pivot = 1.0e-10_wp, tie = 1.0e-12_wp   ! relative to the column, and to the ratios
    logical :: is_left(size(basis))
    integer :: column
    real(wp) :: ratio(size(basis))

    associate (n => size(basis), steps => table(:, entering))
      is_left = steps > least_pivot * maxval(abs(steps))
      if (is_first) is_left = .true.
      row = 0
      do column = 0, n
        if (count(is_left) == 0) return
        where (is_left) ratio = table(:, merge(2 * n + 2, column, column == 0)) / steps
        if (is_first) ratio = -ratio   ! whose steps are -1: the most negative one
        where (is_left) is_left = ratio <= minval(ratio, mask=is_left) + tie * (1 + abs(minval(ratio, mask=is_left)))
        if (column == 0 .and. .not. is_first .and. any(is_left .and. basis == 2 * n + 1)) then
          row = findloc(is_left .and. basis == 2 * n + 1, .true., dim=1)
          return
        end if
        row = findloc(is_left, .true., dim=1)
        if (count(is_left) == 1) return
      end do
    end associate
  end subroutine choose_row

end module nocdyn_linear_complementarity
