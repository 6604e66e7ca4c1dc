!> Dense output of one lane: the solution inside its last step as polynomials in theta = (time - t) / h.
module nocdyn_dense_output
  use nocdyn_kinds, only: wp
  use nocdyn_stage_sums, only: width
  use nocdyn_step_attempt, only: step_attempt_t
  implicit none (type, external)
  private

  public :: allocate_dense_output, load_lane, sample, sample_batch, sample_lanes

  integer, parameter :: long = 4 * width     ! numbers whose sums do not wait for one another
  integer, parameter, public :: strip = 8   !! lanes that are sampled together
  integer, parameter, public :: batch = 8   !! values of theta evaluated together: their sums are independent

  !> y(t + theta h) = sum over p = 0 to degree of c(:, p) theta^p.
  type, public :: dense_output_t
    integer :: lane = 0                         !! lane of the polynomials
    integer :: degree = 0                       !! of the polynomials
    real(wp) :: t = 0.0_wp, h = 0.0_wp          !! start and size of its last step [s]
    real(wp), allocatable :: states(:, :)       !! results of `sample_batch`, [whole vectors of components, batch]
    real(wp), allocatable, private :: c(:, :)   !! [whole vectors of components, 0:largest degree]
    real(wp), allocatable, private :: y(:)      !! [whole vectors of components]
  end type dense_output_t

contains

  !> Allocates the polynomials of one lane.
  subroutine allocate_dense_output(dense, components, degree)
    type(dense_output_t), intent(out) :: dense
    integer, intent(in) :: components
    integer, intent(in) :: degree   !! the largest
    integer :: length

    length = width * ((components + width - 1) / width)
    allocate (dense%c(length, 0:degree), dense%y(length), dense%states(length, batch), source=0.0_wp)
  end subroutine allocate_dense_output

  !> Copies the polynomials of one lane of a block, of the degree of its method.
  pure subroutine load_lane(dense, attempt, coefficients, lane)
    type(dense_output_t), intent(inout) :: dense
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! from the power 1 on, [lanes, padded columns, degree]
    integer, intent(in) :: lane
    integer :: power

    dense%lane = lane
    dense%t = attempt%t(lane)
    dense%h = attempt%h(lane)
    dense%degree = attempt%degree(lane)
    associate (n => attempt%components)
      dense%c(:n, 0) = attempt%y(lane, :n)
      do power = 1, dense%degree
        dense%c(:n, power) = coefficients(lane, :n, power)
      end do
    end associate
  end subroutine load_lane

  !> The state at t + theta h, 0 <= theta <= 1.
  pure subroutine sample(dense, theta, y)
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta
    real(wp), contiguous, intent(inout) :: y(:)   !! [components]

    call evaluate(size(dense%y), dense%degree, theta, dense%c, dense%y)
    y(:) = dense%y(:size(y))
  end subroutine sample

  !> Sets `states` to the states at t + theta h for several theta, with the same bits as `sample`.
  pure subroutine sample_batch(dense, theta)
    type(dense_output_t), intent(inout) :: dense
    real(wp), intent(in) :: theta(batch)   !! 0 to 1

    call evaluate_batch(size(dense%y), dense%degree, theta, dense%c, dense%states)
  end subroutine sample_batch

  !> The states of the lanes of a block at t + theta h for several theta of each, with the same bits as `sample`. Lanes that have
  !> taken no step stay where they are.
  pure subroutine sample_lanes(lanes, columns, degree, start, c, taken, theta, y)
    integer, intent(in) :: lanes     !! at least `strip`
    integer, intent(in) :: columns   !! padded
    integer, intent(in) :: degree    !! of the polynomials
    real(wp), intent(in) :: start(lanes, columns), c(lanes, columns, degree)   !! coefficients from the powers 0 and 1 on
    logical, intent(in) :: taken(lanes)
    real(wp), intent(in) :: theta(lanes, batch)   !! 0 to 1
    real(wp), intent(inout) :: y(lanes, columns, batch)
    real(wp) :: add(strip), sum(strip, batch), x(strip, batch)
    logical :: moves(strip)
    integer :: b, column, first, next, p

    do next = 1, lanes, strip
      first = min(next, lanes - strip + 1)
      moves = taken(first:first + strip - 1)
      x = theta(first:first + strip - 1, :)
      do column = 1, columns
        sum = 0.0_wp
        do p = degree, 0, -1
          if (p > 0) then
            add = merge(c(first:first + strip - 1, column, p), 0.0_wp, moves)
          else
            add = start(first:first + strip - 1, column)
          end if
          do b = 1, batch
            sum(:, b) = add + x(:, b) * sum(:, b)
          end do
        end do
        y(first:first + strip - 1, column, :) = sum
      end do
    end do
  end subroutine sample_lanes

  !> Horner's scheme for several arguments x.
  pure subroutine evaluate_batch(n, degree, x, c, y)
    integer, intent(in) :: n, degree
    real(wp), intent(in) :: x(batch), c(n, 0:degree)
    real(wp), intent(inout) :: y(n, batch)
    real(wp) :: sum(width, batch)
    integer :: b, i, p

    do i = 1, n, width
      do b = 1, batch
        sum(:, b) = c(i:i + width - 1, degree)
      end do
      do p = degree - 1, 0, -1
        do b = 1, batch
          sum(:, b) = c(i:i + width - 1, p) + x(b) * sum(:, b)
        end do
      end do
      do b = 1, batch
        y(i:i + width - 1, b) = sum(:, b)
      end do
    end do
  end subroutine evaluate_batch

  !> Horner's scheme.
  pure subroutine evaluate(n, degree, x, c, y)
    integer, intent(in) :: n, degree
    real(wp), intent(in) :: x, c(n, 0:degree)
    real(wp), intent(inout) :: y(n)
    real(wp) :: sum(long)
    integer :: i, p

    do i = 1, n - long + 1, long
      sum = c(i:i + long - 1, degree)
      do p = degree - 1, 0, -1
        sum = c(i:i + long - 1, p) + x * sum
      end do
      y(i:i + long - 1) = sum
    end do
    do i = i, n, width
      sum(:width) = c(i:i + width - 1, degree)
      do p = degree - 1, 0, -1
        sum(:width) = c(i:i + width - 1, p) + x * sum(:width)
      end do
      y(i:i + width - 1) = sum(:width)
    end do
  end subroutine evaluate

end module nocdyn_dense_output
