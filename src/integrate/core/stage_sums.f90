!> Linear combinations of stages: the inner loops of every Runge-Kutta method.
!>
!> The sums of up to twelve terms are written out, above six for even numbers of terms only: a term of weight zero completes the
!> others. A loop over the terms takes 1.3 to 2 times as long for 8 to 60 numbers and eight terms or more (gfortran 12, AVX2): the
!> sums of several vectors then wait for one another.
module nocdyn_stage_sums
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_finite, only: are_finite => all_finite
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: stage_sum, set_offsets, sum_stages, padded_columns

  integer, parameter :: max_terms = 12      !! of a row of any tableau
  integer(int64), parameter :: exponent_mask = shiftl(2047_int64, 52)   ! all ones in a number that is not finite
  integer, parameter, public :: width = 4          !! length of the vectors; all arrays here consist of whole vectors
  integer, parameter :: few = 16                   !! up to so many numbers a plain loop over vectors finds infinities soonest
  integer, parameter, public :: large_tile = 256   !! numbers of each stage that are summed and checked before the next ones

  !> The non-zero weights of a row of a tableau, and the positions of their stages.
  type, public :: stage_sum_t
    integer :: terms = 0
    real(wp) :: weights(max_terms) = 0.0_wp
    integer :: stages(max_terms) = 0     !! indices in the array of stages
    integer :: length = 0                !! of a stage
    integer :: extent = 0                !! of the array of stages
    integer :: offsets(max_terms) = 0    !! of the stages in that array; after the last term the offsets of the first one
  end type stage_sum_t

contains

  !> The non-zero weights of a row, in the order of the stages. Stops if there are more than `max_terms`.
  pure function stage_sum(row)
    real(wp), intent(in) :: row(:)   !! one weight per stage
    type(stage_sum_t) :: stage_sum
    integer :: stage

    do stage = 1, size(row)
      if (.not. abs(row(stage)) > 0) cycle
      if (stage_sum%terms == max_terms) error stop 'nocdyn_stage_sums: a row has more than max_terms weights'
      stage_sum%terms = stage_sum%terms + 1
      stage_sum%weights(stage_sum%terms) = row(stage)
      stage_sum%stages(stage_sum%terms) = stage
    end do
  end function stage_sum

  !> Computes the offsets of the stages in an array [length, stages].
  elemental subroutine set_offsets(stage_sum, length, stages)
    type(stage_sum_t), intent(inout) :: stage_sum
    integer, intent(in) :: length   !! of a stage, whole vectors
    integer, intent(in) :: stages   !! number of stages in the array

    stage_sum%length = length
    stage_sum%extent = length * stages
    stage_sum%offsets = length * (stage_sum%stages - 1)
    stage_sum%offsets(stage_sum%terms + 1:) = stage_sum%offsets(1)
  end subroutine set_offsets

  !> The number of columns, at least one, of an array [lanes, columns] of whole vectors that holds all components.
  pure integer function padded_columns(lanes, components)
    integer, intent(in) :: lanes, components

    padded_columns = max(components, 1)
    do while (modulo(lanes * padded_columns, width) /= 0)
      padded_columns = padded_columns + 1
    end do
  end function padded_columns

  !> y = x + h * (sum of weights times stages). The operations and their order are the same for every element of the arrays, so
  !> that the result of a lane does not depend on its index in the block.
  !>
  !> x and h may be shorter than a stage: with the length `large_tile` they are used again for every large tile.
  pure recursive subroutine sum_stages(stage_sum, k, x_length, x, h_length, h, y, all_finite)
    type(stage_sum_t), intent(in) :: stage_sum         !! after `set_offsets`
    real(wp), intent(in) :: k(stage_sum%extent)        !! the stages, one after the other
    integer, intent(in) :: x_length, h_length          !! the length of a stage, or `large_tile` if that is less
    real(wp), intent(in) :: x(x_length), h(h_length)   !! start of the step and step size [s] of each element of y
    real(wp), intent(inout) :: y(stage_sum%length)
    logical, intent(out), optional :: all_finite     !! whether no element of y is infinite or NaN
    real(wp) :: total(width)   ! sum of the absolute values, finite if they all are
    integer :: i

    if (stage_sum%length > large_tile) then
      call sum_large_tiles(stage_sum, k, x_length, x, h_length, h, y, all_finite)
      return
    end if
    associate (n => stage_sum%length, m => stage_sum%extent, terms => stage_sum%terms, w => stage_sum%weights, &
               o => stage_sum%offsets)
      if (terms <= 6) then
        call sum_few_terms(n, m, terms, w, o, k, x, h, y)
      else
        call sum_many_terms(n, m, terms, w, o, k, x, h, y)
      end if
    end associate
    if (.not. present(all_finite)) return
    if (stage_sum%length > few) then
      all_finite = are_finite(stage_sum%length, y)
      return
    end if
    total = 0.0_wp
    do i = 1, stage_sum%length, width
      total = total + abs(y(i:i + 3))
    end do
    all_finite = iand(transfer((total(1) + total(2)) + (total(3) + total(4)), exponent_mask), exponent_mask) /= exponent_mask
  end subroutine sum_stages

  !> Sums stages in large tiles, each of which stays in the first-level cache until it has been checked for infinities.
  pure recursive subroutine sum_large_tiles(stage_sum, k, x_length, x, h_length, h, y, all_finite)
    type(stage_sum_t), intent(in) :: stage_sum
    real(wp), intent(in) :: k(stage_sum%extent)
    integer, intent(in) :: x_length, h_length
    real(wp), intent(in) :: x(x_length), h(h_length)
    real(wp), intent(inout) :: y(stage_sum%length)
    logical, intent(out), optional :: all_finite
    type(stage_sum_t) :: part
    logical :: is_finite
    integer :: before

    part = stage_sum
    if (present(all_finite)) all_finite = .true.
    do before = 0, stage_sum%length - 1, large_tile
      part%length = min(large_tile, stage_sum%length - before)
      part%extent = stage_sum%extent - before
      call sum_stages(part, k(before + 1), part%length, x(merge(before, 0, x_length > large_tile) + 1), &
                   part%length, h(merge(before, 0, h_length > large_tile) + 1), y(before + 1), is_finite)
      if (present(all_finite)) all_finite = all_finite .and. is_finite
    end do
  end subroutine sum_large_tiles

  !> Sums of up to six terms.
  pure subroutine sum_few_terms(n, m, terms, w, o, k, x, h, y)
    integer, intent(in) :: n, m, terms, o(max_terms)
    real(wp), intent(in) :: w(max_terms), k(m), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    integer :: i

    select case (terms)
    case (0)
      y = x
    case (1)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)))
      end do
    case (2)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)))
      end do
    case (3)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)))
      end do
    case (4)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)) + w(4) * k(i + o(4):i + 3 + o(4)))
      end do
    case (5)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)) + w(4) * k(i + o(4):i + 3 + o(4)) + w(5) * k(i + o(5):i + 3 + o(5)))
      end do
    case default
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)) + w(4) * k(i + o(4):i + 3 + o(4)) + w(5) * k(i + o(5):i + 3 + o(5)) &
          + w(6) * k(i + o(6):i + 3 + o(6)))
      end do
    end select
  end subroutine sum_few_terms

  !> Sums of seven to twelve terms.
  pure subroutine sum_many_terms(n, m, terms, w, o, k, x, h, y)
    integer, intent(in) :: n, m, terms, o(max_terms)
    real(wp), intent(in) :: w(max_terms), k(m), x(n), h(n)
    real(wp), intent(inout) :: y(n)
    integer :: i

    select case (terms)
    case (7, 8)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)) + w(4) * k(i + o(4):i + 3 + o(4)) + w(5) * k(i + o(5):i + 3 + o(5)) &
          + w(6) * k(i + o(6):i + 3 + o(6)) + w(7) * k(i + o(7):i + 3 + o(7)) + w(8) * k(i + o(8):i + 3 + o(8)))
      end do
    case (9, 10)
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)) + w(4) * k(i + o(4):i + 3 + o(4)) + w(5) * k(i + o(5):i + 3 + o(5)) &
          + w(6) * k(i + o(6):i + 3 + o(6)) + w(7) * k(i + o(7):i + 3 + o(7)) + w(8) * k(i + o(8):i + 3 + o(8)) &
          + w(9) * k(i + o(9):i + 3 + o(9)) + w(10) * k(i + o(10):i + 3 + o(10)))
      end do
    case default
      do i = 1, n, width
        y(i:i + 3) = x(i:i + 3) + h(i:i + 3) * (w(1) * k(i + o(1):i + 3 + o(1)) + w(2) * k(i + o(2):i + 3 + o(2)) &
          + w(3) * k(i + o(3):i + 3 + o(3)) + w(4) * k(i + o(4):i + 3 + o(4)) + w(5) * k(i + o(5):i + 3 + o(5)) &
          + w(6) * k(i + o(6):i + 3 + o(6)) + w(7) * k(i + o(7):i + 3 + o(7)) + w(8) * k(i + o(8):i + 3 + o(8)) &
          + w(9) * k(i + o(9):i + 3 + o(9)) + w(10) * k(i + o(10):i + 3 + o(10)) + w(11) * k(i + o(11):i + 3 + o(11)) &
          + w(12) * k(i + o(12):i + 3 + o(12)))
      end do
    end select
  end subroutine sum_many_terms

end module nocdyn_stage_sums
