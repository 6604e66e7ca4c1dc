!> Search for the speeds at which the torques on a machine balance, from many starts: by Newton's method, and by following the
!> motion from the start of the machine until it is steady.
module nocdyn_balance_starts
  use nocdyn_block_solutions, only: block_solutions_t, is_nearly_balanced
  use nocdyn_eliminated_balance, only: eliminated_balance_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_torque_balance, only: torque_balance_t
  implicit none (type, external)
  private

  public :: search_from_starts, solve_by_newton

  real(wp), parameter :: singular = 1.0e-13_wp   ! relative to the largest singular value

contains

  !> Newton's method from the start of the machine and from combinations of speeds, and the motion from the start. The speeds of
  !> elements whose torques rise are combined, and the others follow.
  subroutine search_from_starts(reduced, block)
    type(eliminated_balance_t), intent(inout) :: reduced
    type(block_solutions_t), intent(inout) :: block
    integer, parameter :: most_starts = 400
    real(wp) :: point(reduced%balance%unknowns()), speeds(size(reduced%speeds)), start(reduced%balance%unknowns())
    integer :: counts(size(speeds)), digits(size(speeds)), i, k

    start = reduced%balance%start()
    counts = [(size(candidates(reduced, k)), k=1, size(speeds))]
    block%starts = nint(min(real(most_starts, wp), product(real(counts, wp))))
    do i = 1, block%starts
      digits = combination(i, counts, product(real(counts, wp)) > most_starts)
      speeds = 0.0_wp
      do k = 1, size(speeds)
        associate (list => candidates(reduced, k))
          if (size(list) > 0) speeds(k) = list(digits(k))
        end associate
      end do
      reduced%z = start
      reduced%z(reduced%speeds) = matmul(reduced%basis, speeds)
      call reduced%solve(speeds(1), holds_rising=.true.)
      point = reduced%z
      call solve_by_newton(reduced%balance, point, block)
    end do
    point = start
    call solve_by_newton(reduced%balance, point, block)
    point = start
    call follow_motion(reduced%balance, point, block)
    call solve_by_newton(reduced%balance, point, block)
  end subroutine search_from_starts

  !> Speeds to begin with for a column of the basis [rad/s]: rest, those at which laws bend, and between them; one for others.
  function candidates(reduced, column) result(speeds)
    type(eliminated_balance_t), intent(in) :: reduced
    integer, intent(in) :: column
    real(wp), allocatable :: speeds(:)

    associate (knees => reduced%rising(column)%knees)
      allocate (speeds, source=[0.0_wp, knees, 0.5_wp * knees])
      if (size(knees) > 1) speeds = [speeds, 0.5_wp * (knees(2:) + knees(:size(knees) - 1))]
    end associate
  end function candidates

  !> The candidates of a combination: all combinations in turn, or of many a part that has each candidate.
  pure function combination(number, counts, are_many) result(digits)
    integer, intent(in) :: number      !! 1 to the number of combinations, or less if they are many
    integer, intent(in) :: counts(:)   !! of the candidates of each speed
    logical, intent(in) :: are_many
    integer :: digits(size(counts))
    integer :: k, rest

    rest = number - 1
    do k = 1, size(counts)
      digits(k) = 1 + modulo(rest, counts(k))
      if (are_many) then
        rest = (number - 1) * (2 * k + 1) / 2
      else
        rest = rest / counts(k)
      end if
    end do
  end function combination

  !> Newton's method with steps of minimum norm, halved until the residuals fall. Adds the solution if it converges.
  subroutine solve_by_newton(balance, z, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(inout) :: z(:)   !! start, then the last iterate, [unknowns]
    type(block_solutions_t), intent(inout) :: block
    integer, parameter :: most_steps = 100
    real(wp), parameter :: tiny_step = 1.0e-13_wp, highest = 1.0e7_wp   ! relative; a speed [rad/s]
    real(wp) :: slopes(size(z), size(z)), step(size(block%members)), weight(size(block%members)), ahead(size(z)), before, factor
    integer :: i

    associate (members => block%members)
      call balance%evaluate(z)
      do i = 1, most_steps
        if (all(abs(balance%residual(members)) <= epsilon(1.0_wp) * balance%scale(members))) exit   ! zero up to the last bit
        call balance%differentiate(slopes)
        weight = 1.0_wp / max(maxval(abs(slopes(members, members)), dim=2), tiny(1.0_wp)**0.25_wp)
        before = norm2(weight * balance%residual(members))
        step = -matmul(pseudo_inverse(spread(weight, 2, size(members)) * slopes(members, members), singular), &
                       weight * balance%residual(members))
        factor = 1.0_wp
        do while (factor > 1.0e-6_wp)
          ahead = z
          ahead(members) = z(members) + factor * step
          call balance%evaluate(ahead)
          if (norm2(weight * balance%residual(members)) < (1.0_wp - 1.0e-4_wp * factor) * before) exit
          factor = 0.5_wp * factor
        end do
        if (factor <= 1.0e-6_wp) exit
        z = ahead
        if (all(abs(step) <= tiny_step * abs(z(members)))) exit
      end do
      if (any(abs(z(members)) > highest .and. members <= size(balance%motions%free))) return
      if (is_nearly_balanced(balance, members, z)) call block%add_or_join(balance, z)
      call balance%evaluate(z)
      if (abs(balance%residual(members(1))) < abs(block%least_torque)) then
        block%least_torque = balance%residual(members(1))
        block%least_speed = z(members(1))
      end if
    end associate
  end subroutine solve_by_newton

  !> Follows the motion of the rigid bodies and the internal states by Euler's implicit method, with steps that grow while
  !> Newton's method converges in a few iterations: at the end they are long, and what is left is steady.
  subroutine follow_motion(balance, z, block)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(inout) :: z(:)   !! start, then the end, [unknowns]
    type(block_solutions_t), intent(in) :: block
    real(wp), parameter :: highest = 1.0e12_wp   ! rad/s
    real(wp), parameter :: converged = 1.0e-9_wp, least = 1.0e-12_wp   ! change, relative or in rad/s
    integer, parameter :: most_iterations = 8
    integer, parameter :: most_steps = 400
    real(wp), parameter :: first_step = 1.0e-6_wp, longest = 1.0e12_wp   ! s
    real(wp), allocatable :: inertia(:, :)
    real(wp) :: ahead(size(z)), step, change(size(block%members)), slopes(size(z), size(z))
    integer :: i, j
    logical :: is_solved

    allocate (inertia, source=balance%inertia(block%members))
    step = first_step
    do i = 1, most_steps
      ahead = z
      ! one step of Euler's implicit method: inertia (ahead - z) / step = torques (ahead)
      is_solved = .false.
      do j = 1, most_iterations
        call balance%evaluate(ahead)
        call balance%differentiate(slopes)
        change = matmul(pseudo_inverse(inertia / step - slopes(block%members, block%members), singular), &
                        balance%residual(block%members) - matmul(inertia, ahead(block%members) - z(block%members)) / step)
        ahead(block%members) = ahead(block%members) + change
        is_solved = all(abs(change) <= converged * abs(ahead(block%members)) + least)
        if (is_solved .or. any(abs(ahead(block%members)) > highest)) exit
      end do
      if (is_solved) z = ahead
      step = merge(2.0_wp, 0.25_wp, is_solved) * step
      if (step > longest .or. step < epsilon(1.0_wp) * first_step) exit
    end do
  end subroutine follow_motion

end module nocdyn_balance_starts
