!> Which mode at one speed goes on as which mode at another speed.
!>
!> Modes x of two speeds are compared with each other as left and right eigenvectors: with T of the mean of both states,
!> x_m^T (T(lambda_m) - T(lambda_n)) / (lambda_m - lambda_n) x_n is 1 for one and the same mode and 0 for two modes of one state
!> (the modal assurance criterion, with the eigenvectors of the damped machine).
module nocdyn_mode_links
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_pairs, only: mode_pairs_t
  implicit none (type, external)
  private

  public :: find_links

contains

  !> Links the modes of two states.
  subroutine find_links(machine, a, b, link, are_clear)
    type(machine_t), intent(in) :: machine
    type(mode_pairs_t), intent(in) :: a, b
    integer, allocatable, intent(out) :: link(:)   !! mode of `b` of each mode of `a`, or 0
    logical, intent(out) :: are_clear              !! whether no other links come into question
    real(wp), parameter :: near = 0.5_wp   ! relative
    real(wp), parameter :: certain = 0.6_wp, doubtful = 0.25_wp, worst = 0.05_wp
    real(wp), allocatable :: likeness(:, :)
    integer :: best(2), k, m, n, i
    real(wp), allocatable :: left(:, :)
    complex(wp), dimension(size(a%value), size(b%value)) :: by_damping, by_loss, by_mass
    real(wp) :: damping(size(a%twist, 1)), loss(size(a%twist, 1))

    ! squares of the products of all modes, 1 for the same ones
    damping = 0.5_wp * (a%slopes%damping + b%slopes%damping)
    loss = 0.5_wp * (a%slopes%loss + b%slopes%loss)
    by_damping = products(damping, a%twist, b%twist)
    by_loss = products(loss, a%twist, b%twist)
    by_mass = products(machine%inertia(1, :), a%angle, b%angle)
    do i = 1, size(b%value)
      do m = 1, size(a%value)
        by_mass(m, i) = by_damping(m, i) + 2.0_wp * by_loss(m, i) / (aimag(a%value(m)) + aimag(b%value(i))) &
                        + (a%value(m) + b%value(i)) * by_mass(m, i)
      end do
    end do
    call subtract_delays(machine, a, b, by_mass)
    allocate (likeness, source=real(by_mass, wp)**2 + aimag(by_mass)**2)
    allocate (link(size(a%value)), source=0)
    left = likeness
    do k = 1, min(size(a%value), size(b%value))
      best = maxloc(left)
      if (left(best(1), best(2)) < worst) exit
      link(best(1)) = best(2)
      left(best(1), :) = -1.0_wp
      left(:, best(2)) = -1.0_wp
    end do
    ! modes without motion, of currents or fluxes, by their eigenvalues
    do m = 1, size(link)
      if (link(m) > 0 .or. a%internal(m) == 0 .or. size(b%value) == 0) cycle
      n = minloc(abs(b%value - a%value(m)), dim=1, mask=[(all(link /= n), n=1, size(b%value))])
      if (n == 0) cycle
      if (abs(b%value(n) - a%value(m)) <= near * abs(a%value(m))) link(m) = n
    end do
    are_clear = size(a%value) == size(b%value) .and. all(link > 0)
    if (.not. are_clear) return
    do m = 1, size(link)
      if (a%internal(m) > 0 .or. b%internal(link(m)) > 0) cycle
      are_clear = are_clear .and. sum(likeness(m, :), mask=are_same(b, link(m))) > certain &
                  .and. .not. any(likeness(m, :) > doubtful .and. .not. are_same(b, link(m)))
    end do
    if (are_clear) are_clear = .not. has_near_crossing(a, b, link)
  end subroutine find_links

  !> Whether two modes change the order of their frequencies while they pass each other so closely that they may turn away from
  !> each other instead, as weakly coupled ones do, and exchange their shapes.
  pure logical function has_near_crossing(a, b, link)
    type(mode_pairs_t), intent(in) :: a, b
    integer, intent(in) :: link(:)
    real(wp), parameter :: share = 0.5_wp   ! of the distance of the eigenvalues that they may move
    integer :: m, n

    has_near_crossing = .false.
    do m = 1, size(link) - 1
      do n = m + 1, size(link)
        associate (va => a%value([m, n]), vb => b%value(link([m, n])))
          if ((aimag(va(1)) - aimag(va(2))) * (aimag(vb(1)) - aimag(vb(2))) >= 0) cycle
          has_near_crossing = has_near_crossing .or. &
                              sum(abs(vb - va)) > share * min(abs(va(1) - va(2)), abs(vb(1) - vb(2)))
        end associate
      end do
    end do
  end function has_near_crossing

  !> Modes of one eigenvalue, between whose shapes nothing tells a difference.
  pure function are_same(pairs, mode)
    type(mode_pairs_t), intent(in) :: pairs
    integer, intent(in) :: mode
    logical :: are_same(size(pairs%value))
    real(wp), parameter :: same = 1.0e-9_wp   ! relative

    are_same = abs(pairs%value - pairs%value(mode)) <= same * abs(pairs%value(mode))
  end function are_same

  pure function products(weight, x, y)
    real(wp), intent(in) :: weight(:)
    complex(wp), intent(in) :: x(:, :), y(:, :)   !! [size(weight), modes]
    complex(wp) :: products(size(x, 2), size(y, 2))
    integer, allocatable :: needed(:)
    integer :: i

    needed = pack([(i, i=1, size(weight))], abs(weight) > 0)
    products = matmul(transpose(x(needed, :)), spread(weight(needed), 2, size(y, 2)) * y(needed, :))
  end function products

  !> The part of the internal states.
  subroutine subtract_delays(machine, a, b, product)
    type(machine_t), intent(in) :: machine
    type(mode_pairs_t), intent(in) :: a, b
    complex(wp), intent(inout) :: product(:, :)
    real(wp), parameter :: apart = 1.0e-6_wp   ! relative
    complex(wp) :: delay_a(size(a%value)), delay_b(size(b%value)), slope_a(size(a%value)), slope_b(size(b%value))
    complex(wp) :: ratio
    integer :: m, n, s

    associate (internal => machine%elements%internal)
      do s = 1, internal%count
        if (internal%first(s) /= s) cycle
        call list_delays(machine, a, b, s, a%value, delay_a, slope_a)
        call list_delays(machine, a, b, s, b%value, delay_b, slope_b)
        do n = 1, size(b%value)
          do m = 1, size(a%value)
            associate (distance => a%value(m) - b%value(n))
              if (abs(distance) > apart * abs(a%value(m))) then
                ratio = (delay_a(m) - delay_b(n)) / distance
              else
                ratio = 0.5_wp * (slope_a(m) + slope_b(n))
              end if
            end associate
            product(m, n) = product(m, n) - ratio * a%twist(internal%element(s), m) * b%twist(internal%element(s), n)
          end do
        end do
      end do
    end associate
  end subroutine subtract_delays

  !> The means of both states.
  subroutine list_delays(machine, a, b, first, values, delay, slope)
    type(machine_t), intent(in) :: machine
    type(mode_pairs_t), intent(in) :: a, b
    integer, intent(in) :: first   !! internal state
    complex(wp), intent(in) :: values(:)
    complex(wp), intent(out) :: delay(:), slope(:)
    complex(wp) :: other_delay, other_slope
    integer :: m

    do m = 1, size(values)
      call a%slopes%find_delay(machine%elements%internal, first, values(m), delay(m), slope(m))
      call b%slopes%find_delay(machine%elements%internal, first, values(m), other_delay, other_slope)
      delay(m) = 0.5_wp * (delay(m) + other_delay)
      slope(m) = 0.5_wp * (slope(m) + other_slope)
    end do
  end subroutine list_delays

end module nocdyn_mode_links
