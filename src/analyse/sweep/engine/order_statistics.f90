!> Minimum, maximum, median, quartiles, 5 % and 95 % quantiles of every result of a sweep, in memory that does not grow beyond
!> megabytes.
!>
!> Radix selection: the bits of a number are rearranged so that they sort like unsigned integers. A few passes over the
!> journals, or over the chunks of a small sweep that the first pass keeps, find these bits digit by digit, from the leading
!> one, by histograms of the next digit. The quantile p of n values is the value at (n - 1) p, counted from 0 in ascending order
!> and interpolated between neighbours, as in numpy.quantile.
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

  !> Of one result; NaN, and 0 for the variants, if no variant has it.
  type, public :: order_statistics_t
    integer :: count = 0   !! variants that have the result
    real(wp) :: minimum = 0.0_wp, low = 0.0_wp, median = 0.0_wp, high = 0.0_wp, maximum = 0.0_wp
    real(wp) :: lower_quartile = 0.0_wp, upper_quartile = 0.0_wp
    integer :: variant_of_minimum = 0, variant_of_maximum = 0   !! the lowest number of several
  end type order_statistics_t

  real(wp), parameter :: quantiles(5) = [0.05_wp, 0.25_wp, 0.5_wp, 0.75_wp, 0.95_wp]
  integer, parameter :: wanted = 2 * size(quantiles)   ! both neighbours of each quantile

  integer, parameter :: million = 2**20
  integer, parameter :: at_a_time = 100   ! results whose histograms are in memory, 30 MB

  ! the 64 bits of a number in five digits, the first of which has 12 bits
  integer, parameter :: digit_bits = 13, passes = 5, values_of_digit = 2**digit_bits

  !> The selection for one result.
  type :: selection_t
    integer :: result = 0                        ! its number
    integer(int64) :: prefix(wanted) = 0         ! the bits of each wanted value that are known, leading ones
    integer :: rank(wanted) = 0                  ! of each wanted value among those with these bits, from 0
    integer :: group(wanted) = 1                 ! number of its prefix among the different ones
    integer :: groups = 1
    integer(int64) :: prefix_of_group(wanted) = 0
    integer, allocatable :: histogram(:, :)      ! [value of the digit, groups]
  end type selection_t

contains

  !> Computes the order statistics of each result over the variants that are done.
  subroutine find_order_statistics(journals, statistics, error, most_kept)
    type(sweep_journal_t), intent(inout) :: journals(:)   !! at least one; all with the same results
    type(order_statistics_t), allocatable, intent(out) :: statistics(:)
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: most_kept   !! numbers of a sweep that is read once and kept; absent: a million
    type(chunk_t), allocatable :: kept(:)
    integer :: first, most

    allocate (statistics(size(journals(1)%header%results)))
    most = million
    if (present(most_kept)) most = most_kept
    associate (header => journals(1)%header)
      if (real(header%variants, wp) * (size(header%results) + size(header%parameters)) <= most) then
        allocate (kept(sum(journals%entries)))
      end if
    end associate
    do first = 1, size(statistics), at_a_time
      call find_some(journals, kept, first, statistics(first:min(first + at_a_time - 1, size(statistics))), error)
      if (allocated(error)) return
    end do
  end subroutine find_order_statistics

  !> Computes them of some results.
  subroutine find_some(journals, kept, first, statistics, error)
    type(sweep_journal_t), intent(inout) :: journals(:)
    type(chunk_t), allocatable, intent(inout) :: kept(:)   !! the chunks of a small sweep, after the first pass
    integer, intent(in) :: first                           !! of these results
    type(order_statistics_t), intent(inout) :: statistics(:)
    type(error_t), allocatable, intent(out) :: error
    type(selection_t) :: selections(size(statistics))
    integer :: i, pass
    real(wp) :: found(size(quantiles))

    do i = 1, size(selections)
      selections(i)%result = first - 1 + i
      allocate (selections(i)%histogram(0:values_of_digit - 1, wanted))
    end do
    do pass = 1, passes
      call count_digits(journals, kept, pass, selections, statistics, error)
      if (allocated(error)) return
      do i = 1, size(selections)
        if (pass == 1) then   ! both neighbours of every quantile
          selections(i)%rank(1::2) = int((statistics(i)%count - 1) * quantiles)
          selections(i)%rank(2::2) = min(selections(i)%rank(1::2) + 1, statistics(i)%count - 1)
        end if
        if (statistics(i)%count > 0) call resolve_digit(selections(i))
      end do
    end do
    do i = 1, size(selections)
      ! interpolates between the neighbours of every quantile
      if (statistics(i)%count == 0) then
        found = ieee_value(0.0_wp, ieee_quiet_nan)
        statistics(i)%minimum = found(1)
        statistics(i)%maximum = found(1)
      else
        found = between(number_of(selections(i)%prefix(1::2)), number_of(selections(i)%prefix(2::2)), &
                (statistics(i)%count - 1) * quantiles)
      end if
      statistics(i)%low = found(1)
      statistics(i)%lower_quartile = found(2)
      statistics(i)%median = found(3)
      statistics(i)%upper_quartile = found(4)
      statistics(i)%high = found(5)
    end do
  end subroutine find_some

  !> One pass over the journals: histograms of one digit; the first pass also counts and finds extremes.
  subroutine count_digits(journals, kept, pass, selections, statistics, error)
    type(sweep_journal_t), intent(inout) :: journals(:)
    type(chunk_t), allocatable, intent(inout) :: kept(:)   !! the chunks of a small sweep, after the first pass
    integer, intent(in) :: pass
    type(selection_t), intent(inout) :: selections(:)
    type(order_statistics_t), intent(inout) :: statistics(:)   !! counts and extremes
    type(error_t), allocatable, intent(out) :: error
    type(chunk_t) :: chunk
    integer :: i, j, k, number

    do i = 1, size(selections)
      selections(i)%histogram(:, :selections(i)%groups) = 0
    end do
    number = 0
    if (allocated(kept)) number = count([(allocated(kept(k)%results), k=1, size(kept))])
    if (number > 0) then
      do number = 1, size(kept)
        call count_results(kept(number), pass, selections, statistics)
      end do
      return
    end if
    number = 0
    do j = 1, size(journals)
      do k = 1, journals(j)%entries
        call journals(j)%read_entry(k, chunk, error)
        if (allocated(error)) return
        call count_results(chunk, pass, selections, statistics)
        number = number + 1
        if (allocated(kept)) kept(number) = chunk
      end do
    end do
  end subroutine count_digits

  !> Takes the results of a chunk into the histograms; in the first pass into counts and extremes too.
  pure subroutine count_results(chunk, pass, selections, statistics)
    type(chunk_t), intent(in) :: chunk
    integer, intent(in) :: pass
    type(selection_t), intent(inout) :: selections(:)
    type(order_statistics_t), intent(inout) :: statistics(:)
    integer :: i

    do i = 1, size(selections)
      if (pass == 1) call update_extremes(chunk, selections(i)%result, statistics(i))
      call count_chunk(chunk, digit_bits * (passes - pass), selections(i))
    end do
  end subroutine count_results

  !> Takes the values of a chunk into count and extremes.
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

  !> Whether a value is smaller than the smallest so far, or equal and of a lower variant.
  pure logical function precedes(value, variant, best, variant_of_best)
    real(wp), intent(in) :: value, best
    integer, intent(in) :: variant, variant_of_best   !! 0 if there is no value yet

    precedes = variant_of_best == 0 .or. value < best .or. (value <= best .and. variant < variant_of_best)
  end function precedes

  !> Takes the digits of a chunk's values into the histograms of their prefixes.
  pure subroutine count_chunk(chunk, shift, selection)
    type(chunk_t), intent(in) :: chunk
    integer, intent(in) :: shift                      !! number of bits below the digit
    type(selection_t), intent(inout) :: selection
    integer(int64) :: bits, prefix
    integer :: digit, group, i

    do i = 1, chunk%count
      if (chunk%status(i) /= status_done .or. ieee_is_nan(chunk%results(selection%result, i))) cycle
      bits = sortable_bits(chunk%results(selection%result, i))
      prefix = shiftr(bits, min(shift + digit_bits, 64))
      do group = 1, selection%groups
        if (prefix /= selection%prefix_of_group(group)) cycle
        digit = int(iand(shiftr(bits, shift), int(values_of_digit - 1, int64)))
        selection%histogram(digit, group) = selection%histogram(digit, group) + 1
        exit
      end do
    end do
  end subroutine count_chunk

  !> The bits of a number, rearranged so that they sort like unsigned integers.
  pure integer(int64) function sortable_bits(value) result(bits)
    real(wp), intent(in) :: value

    bits = transfer(value, bits)
    if (bits < 0) then
      bits = not(bits)
    else
      bits = ibset(bits, bit_size(bits) - 1)
    end if
  end function sortable_bits

  !> The inverse of `sortable_bits`.
  elemental real(wp) function number_of(bits)
    integer(int64), intent(in) :: bits   !! of `sortable_bits`

    if (bits < 0) then
      number_of = transfer(ibclr(bits, bit_size(bits) - 1), number_of)
    else
      number_of = transfer(not(bits), number_of)
    end if
  end function number_of

  !> Finds one more digit of every wanted value from the histograms.
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

  !> Linear interpolation from the nearer end.
  elemental real(wp) function between(a, b, position)
    real(wp), intent(in) :: a, b
    real(wp), intent(in) :: position   !! its fraction is that between a and b
    real(wp) :: fraction

    fraction = position - int(position)
    between = a + (b - a) * fraction
    if (fraction >= 0.5_wp) between = b - (b - a) * (1.0_wp - fraction)
  end function between

end module nocdyn_order_statistics
