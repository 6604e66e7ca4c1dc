!> Linear combinations of stages: the inner loops of every one-step method.
module nocdyn_combinations
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: combination, combine, padded_columns

  integer, parameter :: most_terms = 12     !! of a row of any table
  integer, parameter, public :: width = 4   !! all arrays here consist of whole vectors of this length

  !> The non-zero weights of a row of a method's table and the stages that they belong to.
  type, public :: combination_t
    integer :: terms = 0
    real(wp) :: weights(most_terms) = 0.0_wp
    integer :: stages(most_terms) = 0
  end type combination_t

contains

  !> The non-zero weights of a row, in the order of the stages.
  pure function combination(row)
    real(wp), intent(in) :: row(:)   !! one weight per stage
    type(combination_t) :: combination
    integer :: stage

    do stage = 1, size(row)
      if (.not. abs(row(stage)) > 0) cycle
      if (combination%terms == most_terms) error stop 'nocdyn_combinations: a row has more than most_terms weights'
      combination%terms = combination%terms + 1
      combination%weights(combination%terms) = row(stage)
      combination%stages(combination%terms) = stage
    end do
  end function combination

  !> Columns, at least one, of an array [lanes, columns] that holds all components and consists of whole vectors.
  pure integer function padded_columns(lanes, components)
    integer, intent(in) :: lanes, components

    padded_columns = max(components, 1)
    do while (modulo(lanes * padded_columns, width) /= 0)
      padded_columns = padded_columns + 1
    end do
  end function padded_columns

  !> y = x + h * (sum of weights times stages), in one pass. Every number goes through the same operations in the same
  !> order wherever it stands in the arrays, so that a lane's result does not depend on its place in a block.
  pure subroutine combine(n, stages, combination, k, x, h, y)
    integer, intent(in) :: n        !! length of the arrays, whole vectors
    integer, intent(in) :: stages
    type(combination_t), intent(in) :: combination
    real(wp), intent(in) :: k(n, stages), x(n), h(n)
    real(wp), intent(inout) :: y(n)

    if (combination%terms <= 4) then
      call combine_few(n, stages, combination%terms, combination%weights, combination%stages, k, x, h, y)
    else if (combination%terms <= 8) then
      call combine_several(n, stages, combination%terms, combination%weights, combination%stages, k, x, h, y)
    else
      call combine_many(n, stages, combination%terms, combination%weights, combination%stages, k, x, h, y)
    end if
  end subroutine combine

  !> Sums of up to four terms.
  pure subroutine combine_few(n, stages, terms, w, s, k, x, h, y)
    integer, intent(in) :: n, stages, terms
    real(wp), intent(in) :: w(terms)
    integer, intent(in) :: s(terms)
    real(wp), intent(in) :: k(n, stages), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    integer :: i

    select case (terms)
    case (0)
      y = x
    case (1)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)))
      end do
    case (2)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)))
      end do
    case (3)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)))
      end do
    case (4)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)))
      end do
    end select
  end subroutine combine_few

  !> Sums of five to eight terms.
  pure subroutine combine_several(n, stages, terms, w, s, k, x, h, y)
    integer, intent(in) :: n, stages, terms
    real(wp), intent(in) :: w(terms)
    integer, intent(in) :: s(terms)
    real(wp), intent(in) :: k(n, stages), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    integer :: i

    select case (terms)
    case (5)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)))
      end do
    case (6)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)))
      end do
    case (7)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)) + w(7) * k(i:i + 3, s(7)))
      end do
    case (8)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)) + w(7) * k(i:i + 3, s(7)) + w(8) * k(i:i + 3, s(8)))
      end do
    end select
  end subroutine combine_several

  !> Sums of nine to twelve terms.
  pure subroutine combine_many(n, stages, terms, w, s, k, x, h, y)
    integer, intent(in) :: n, stages, terms
    real(wp), intent(in) :: w(terms)
    integer, intent(in) :: s(terms)
    real(wp), intent(in) :: k(n, stages), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    integer :: i

    select case (terms)
    case (9)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)) + w(7) * k(i:i + 3, s(7)) + w(8) * k(i:i + 3, s(8)) &
                                   + w(9) * k(i:i + 3, s(9)))
      end do
    case (10)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)) + w(7) * k(i:i + 3, s(7)) + w(8) * k(i:i + 3, s(8)) &
                                   + w(9) * k(i:i + 3, s(9)) + w(10) * k(i:i + 3, s(10)))
      end do
    case (11)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)) + w(7) * k(i:i + 3, s(7)) + w(8) * k(i:i + 3, s(8)) &
                                   + w(9) * k(i:i + 3, s(9)) + w(10) * k(i:i + 3, s(10)) + w(11) * k(i:i + 3, s(11)))
      end do
    case (12)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i:i + 3, s(1)) + w(2) * k(i:i + 3, s(2)) &
                                   + w(3) * k(i:i + 3, s(3)) + w(4) * k(i:i + 3, s(4)) + w(5) * k(i:i + 3, s(5)) &
                                   + w(6) * k(i:i + 3, s(6)) + w(7) * k(i:i + 3, s(7)) + w(8) * k(i:i + 3, s(8)) &
                                   + w(9) * k(i:i + 3, s(9)) + w(10) * k(i:i + 3, s(10)) + w(11) * k(i:i + 3, s(11)) &
                                   + w(12) * k(i:i + 3, s(12)))
      end do
    end select
  end subroutine combine_many

end module nocdyn_combinations
