!> Smallest and largest values, median, 5 % and 95 % of every result of a sweep, in memory that does not grow with it.
!>
!> Radix selection: the bits of a number, rearranged so that they sort as whole numbers do, are settled from the top by a few
!> passes over the journals that count which of them begin how. The quantile p of n values is the value at (n - 1) p, counted
!> from 0 in ascending order and interpolated between neighbours, as numpy.quantile has it.
module nocdyn_order_statistics
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: chunk_t, status_done
  use nocdyn_sweep_journal, only: sweep_journal_t
  implicit none (type, external)
  private

  public :: find_order_statistics

  !> Of one result; NaN and 0 if no variant is done.
  type, public :: order_statistics_t
    integer :: count = 0   !! variants that have the result
    real(wp) :: minimum = 0.0_wp, low = 0.0_wp, median = 0.0_wp, high = 0.0_wp, maximum = 0.0_wp
    integer :: variant_of_minimum = 0, variant_of_maximum = 0   !! the first of several
  end type order_statistics_t

  real(wp), parameter :: quantiles(3) = [0.05_wp, 0.5_wp, 0.95_wp]
  integer, parameter :: wanted = 2 * size(quantiles)   ! the neighbours of each

  ! the bits of a number in five digits, the first of 12 bits
  integer, parameter :: digit_bits = 13, passes = 5, values_of_digit = 2**digit_bits

  !> The selection for one result.
  type :: selection_t
    integer(int64) :: prefix(wanted) = 0         ! the leading bits of each wanted value, as far as known
    integer :: rank(wanted) = 0                  ! its place among the values with these bits, from 0
    integer :: group(wanted) = 1                 ! the number of its prefix among the different ones
    integer :: groups = 1
    integer(int64) :: prefix_of_group(wanted) = 0
    integer, allocatable :: histogram(:, :)      ! [value of the digit, groups]
  end type selection_t

contains

  subroutine find_order_statistics(journals, statistics, error)
    type(sweep_journal_t), intent(inout) :: journals(:)   !! with the same results, at least one journal
    type(order_statistics_t), allocatable, intent(out) :: statistics(:)
    type(error_t), allocatable, intent(out) :: error
    type(selection_t), allocatable :: selections(:)
    integer :: i, pass

    allocate (statistics(size(journals(1)%header%results)), selections(size(journals(1)%header%results)))
    do i = 1, size(selections)
      allocate (selections(i)%histogram(0:values_of_digit - 1, wanted))
    end do
    do pass = 1, passes
      call count_digits(journals, pass, selections, statistics, error)
      if (allocated(error)) return
      do i = 1, size(selections)
        if (pass == 1) call choose_ranks(statistics(i)%count, selections(i)%rank)
        if (statistics(i)%count > 0) call resolve_digit(selections(i))
      end do
    end do
    do i = 1, size(selections)
      call interpolate_quantiles(selections(i), statistics(i))
    end do
  end subroutine find_order_statistics

  !> One pass over the journals.
  subroutine count_digits(journals, pass, selections, statistics, error)
    type(sweep_journal_t), intent(inout) :: journals(:)
    integer, intent(in) :: pass
    type(selection_t), intent(inout) :: selections(:)
    type(order_statistics_t), intent(inout) :: statistics(:)   !! counts and extremes, by the first pass
    type(error_t), allocatable, intent(out) :: error
    type(chunk_t) :: chunk
    integer :: i, j, k

    do i = 1, size(selections)
      selections(i)%histogram = 0
    end do
    do j = 1, size(journals)
      do k = 1, journals(j)%entries
        call journals(j)%read_entry(k, chunk, error)
        if (allocated(error)) return
        do i = 1, size(selections)
          if (pass == 1) call update_extremes(chunk, i, statistics(i))
          call count_chunk(chunk, i, digit_bits * (passes - pass), selections(i))
        end do
      end do
    end do
  end subroutine count_digits

  pure subroutine update_extremes(chunk, result, statistics)
    type(chunk_t), intent(in) :: chunk
    integer, intent(in) :: result                            !! its number
    type(order_statistics_t), intent(inout) :: statistics
    integer :: i, variant

    do i = 1, chunk%count
      if (chunk%status(i) /= status_done .or. ieee_is_nan(chunk%results(result, i))) cycle
      statistics%count = statistics%count + 1
      variant = chunk%first - 1 + i
      associate (value => chunk%results(result, i))
        if (precedes(value, variant, statistics%minimum, statistics%variant_of_minimum)) then
          statistics%minimum = value
          statistics%variant_of_minimum = variant
        end if
        if (precedes(-value, variant, -statistics%maximum, statistics%variant_of_maximum)) then
          statistics%maximum = value
          statistics%variant_of_maximum = variant
        end if
      end associate
    end do
  end subroutine update_extremes

  pure logical function precedes(value, variant, best, variant_of_best)
    real(wp), intent(in) :: value, best
    integer, intent(in) :: variant, variant_of_best   !! 0 if there is no best one yet

    precedes = variant_of_best == 0 .or. value < best .or. &
                  (value <= best .and. variant < variant_of_best)
  end function precedes

  pure subroutine count_chunk(chunk, result, shift, selection)
    type(chunk_t), intent(in) :: chunk
    integer, intent(in) :: result
    integer, intent(in) :: shift                      !! bits behind the digit
    type(selection_t), intent(inout) :: selection
    integer(int64) :: bits, prefix
    integer :: digit, group, i

    do i = 1, chunk%count
      if (chunk%status(i) /= status_done .or. ieee_is_nan(chunk%results(result, i))) cycle
      bits = sortable_bits(chunk%results(result, i))
      prefix = shiftr(bits, min(shift + digit_bits, 64))
      do group = 1, selection%groups
        if (prefix /= selection%prefix_of_group(group)) cycle
        digit = int(iand(shiftr(bits, shift), int(values_of_digit - 1, int64)))
        selection%histogram(digit, group) = selection%histogram(digit, group) + 1
        exit
      end do
    end do
  end subroutine count_chunk

  !> The bits of a number such that, without a sign, they sort as the numbers do.
  pure integer(int64) function sortable_bits(value) result(bits)
    real(wp), intent(in) :: value

    bits = transfer(value, bits)
    if (bits < 0) then
      bits = not(bits)
    else
      bits = ibset(bits, bit_size(bits) - 1)
    end if
  end function sortable_bits

  pure real(wp) function number_of(bits)
    integer(int64), intent(in) :: bits   !! of `sortable_bits`

    if (bits < 0) then
      number_of = transfer(ibclr(bits, bit_size(bits) - 1), number_of)
    else
      number_of = transfer(not(bits), number_of)
    end if
  end function number_of

  !> The places of both neighbours of every quantile, from 0.
  pure subroutine choose_ranks(n, rank)
    integer, intent(in) :: n
    integer, intent(out) :: rank(wanted)
    integer :: i

    do i = 1, size(quantiles)
      rank(2 * i - 1) = int((n - 1) * quantiles(i))
      rank(2 * i) = min(rank(2 * i - 1) + 1, n - 1)
    end do
  end subroutine choose_ranks

  !> One more digit of every wanted value, from the histograms.
  pure subroutine resolve_digit(selection)
    type(selection_t), intent(inout) :: selection
    integer :: digit, i, j

    do i = 1, wanted
      associate (histogram => selection%histogram(:, selection%group(i)), rank => selection%rank(i))
        do digit = 0, values_of_digit - 2
          if (rank < histogram(digit + 1)) exit
          rank = rank - histogram(digit + 1)
        end do
      end associate
      selection%prefix(i) = ior(shiftl(selection%prefix(i), digit_bits), int(digit, int64))
    end do
    selection%groups = 0
    do i = 1, wanted
      do j = 1, selection%groups
        if (selection%prefix_of_group(j) == selection%prefix(i)) exit
      end do
      selection%group(i) = j
      selection%prefix_of_group(j) = selection%prefix(i)
      selection%groups = max(selection%groups, j)
    end do
  end subroutine resolve_digit

  pure subroutine interpolate_quantiles(selection, statistics)
    type(selection_t), intent(in) :: selection
    type(order_statistics_t), intent(inout) :: statistics
    real(wp) :: found(size(quantiles))
    integer :: i

    if (statistics%count == 0) then
      found = ieee_value(0.0_wp, ieee_quiet_nan)
      statistics%minimum = found(1)
      statistics%maximum = found(1)
    else
      do i = 1, size(quantiles)
        found(i) = between(number_of(selection%prefix(2 * i - 1)), number_of(selection%prefix(2 * i)), &
                           (statistics%count - 1) * quantiles(i))
      end do
    end if
    statistics%low = found(1)
    statistics%median = found(2)
    statistics%high = found(3)
  end subroutine interpolate_quantiles

  !> Linear interpolation from the nearer end.
  pure real(wp) function between(a, b, position)
    real(wp), intent(in) :: a, b
    real(wp), intent(in) :: position   !! of which the fraction counts
    real(wp) :: fraction

    fraction = position - int(position)
    between = a + (b - a) * fraction
    if (fraction >= 0.5_wp) between = b - (b - a) * (1.0_wp - fraction)
  end function between

end module nocdyn_order_statistics
