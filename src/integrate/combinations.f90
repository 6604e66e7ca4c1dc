!> Linear combinations of stages: the inner loops of every one-step method.
module nocdyn_combinations
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: combination, combine

  integer, parameter :: strip_length = 64   !! numbers that a long sum holds at a time, small enough for the first cache

  integer, parameter :: most_terms = 16     !! of a row of any table

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

  !> y = x + h * (sum of weights times stages), in one pass. Every number goes through the same operations in the same
  !> order wherever it stands in the arrays, so that a lane's result does not depend on its place in a block.
  pure subroutine combine(n, stages, combination, k, x, h, y)
    integer, intent(in) :: n        !! lanes * components
    integer, intent(in) :: stages
    type(combination_t), intent(in) :: combination
    real(wp), intent(in) :: k(n, stages), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    integer :: i

    associate (w => combination%weights, s => combination%stages)
      select case (combination%terms)
      case (0)
        y = x
      case (1)
        do i = 1, n
          y(i) = x(i) + h(i) * (w(1) * k(i, s(1)))
        end do
      case (2)
        do i = 1, n
          y(i) = x(i) + h(i) * (w(1) * k(i, s(1)) + w(2) * k(i, s(2)))
        end do
      case (3)
        do i = 1, n
          y(i) = x(i) + h(i) * (w(1) * k(i, s(1)) + w(2) * k(i, s(2)) + w(3) * k(i, s(3)))
        end do
      case (4)
        do i = 1, n
          y(i) = x(i) + h(i) * (w(1) * k(i, s(1)) + w(2) * k(i, s(2)) + w(3) * k(i, s(3)) + w(4) * k(i, s(4)))
        end do
      case (5)
        do i = 1, n
          y(i) = x(i) + h(i) * (w(1) * k(i, s(1)) + w(2) * k(i, s(2)) + w(3) * k(i, s(3)) + w(4) * k(i, s(4)) &
                                + w(5) * k(i, s(5)))
        end do
      case (6)
        do i = 1, n
          y(i) = x(i) + h(i) * (w(1) * k(i, s(1)) + w(2) * k(i, s(2)) + w(3) * k(i, s(3)) + w(4) * k(i, s(4)) &
                                + w(5) * k(i, s(5)) + w(6) * k(i, s(6)))
        end do
      case default
        call combine_by_strips(n, stages, combination, k, x, h, y)
      end select
    end associate
  end subroutine combine

  !> The same for any number of weights.
  pure subroutine combine_by_strips(n, stages, combination, k, x, h, y)
    integer, intent(in) :: n, stages
    type(combination_t), intent(in) :: combination
    real(wp), intent(in) :: k(n, stages), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    real(wp) :: strip(strip_length)
    integer :: i, j, before

    associate (w => combination%weights, s => combination%stages)
      do before = 0, n - 1, strip_length
        do i = 1, min(strip_length, n - before)
          strip(i) = w(1) * k(before + i, s(1))
        end do
        do j = 2, combination%terms
          do i = 1, min(strip_length, n - before)
            strip(i) = strip(i) + w(j) * k(before + i, s(j))
          end do
        end do
        do i = 1, min(strip_length, n - before)
          y(before + i) = x(before + i) + h(before + i) * strip(i)
        end do
      end do
    end associate
  end subroutine combine_by_strips

end module nocdyn_combinations
