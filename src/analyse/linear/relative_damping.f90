!> Relative damping k (1 + i eta) of a linearised machine: that of an oscillation acts at its own frequency.
module nocdyn_relative_damping
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  implicit none (type, external)
  private

  public :: add_loss, find_losses, settle, take_relative_damping

contains

  !> The relative damping of all elements, and the viscous one that stands for it over the time.
  pure subroutine find_losses(machine, factor, damping)
    type(machine_t), intent(in) :: machine
    real(wp), allocatable, intent(out) :: factor(:)    !! eta, [elements]
    real(wp), allocatable, intent(out) :: damping(:)   !! [N m s/rad], [elements]
    integer :: b

    allocate (factor(machine%elements%count), damping(machine%elements%count), source=0.0_wp)
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (.not. allocated(bank%loss_factor)) cycle
        factor(bank%first:bank%last()) = bank%loss_factor
        damping(bank%first:bank%last()) = bank%loss_damping
      end associate
    end do
  end subroutine find_losses

  !> Takes the viscous damping that stands for relative damping over the time out of the first-order matrix, and adds the relative
  !> damping itself.
  subroutine take_relative_damping(machine, linear, loss)
    type(machine_t), intent(in) :: machine
    type(linearisation_t), intent(inout) :: linear
    real(wp), allocatable, intent(out) :: loss(:)   !! k eta [N m/rad], [elements]
    real(wp), allocatable :: damping(:), factor(:)

    call find_losses(machine, factor, damping)
    loss = linear%stiffness * factor
    associate (rates => linear%matrix(:size(linear%natural), :size(linear%natural)))
      rates = rates + matmul(transpose(linear%twists), spread(damping, 2, size(linear%natural)) * linear%twists)
    end associate
    call add_loss(loss, linear)
  end subroutine take_relative_damping

  !> Adds the relative damping to the first-order matrix: that at the frequencies of the undamped modes, and between two of them
  !> that at the mean of their frequencies.
  subroutine add_loss(loss, linear)
    real(wp), intent(in) :: loss(:)   !! k eta [N m/rad], [elements]
    type(linearisation_t), intent(inout) :: linear

    if (.not. any(abs(loss) > 0)) return
    associate (rates => linear%matrix(:size(linear%natural), :size(linear%natural)))
      rates = rates - undamped_loss(linear, loss)
    end associate
  end subroutine add_loss

  function undamped_loss(linear, loss) result(matrix)
    type(linearisation_t), intent(in) :: linear
    real(wp), intent(in) :: loss(:)   !! [elements]
    real(wp) :: matrix(size(linear%natural), size(linear%natural))
    real(wp) :: scaled(size(loss), size(linear%natural))
    integer :: m

    do m = 1, size(linear%natural)
      scaled(:, m) = 0.0_wp
      if (abs(linear%natural(m)) > 0) scaled(:, m) = linear%twists(:, m) / sqrt(abs(linear%natural(m)))
    end do
    matrix = matmul(transpose(scaled), spread(loss, 2, size(linear%natural)) * scaled)
  end function undamped_loss

  !> Moves oscillations of the first-order matrix to where the relative damping is that at their own frequencies. With the right
  !> and left eigenvectors v and u and the change D of the matrix, one is x = v_i + sum of v_j u_j^H D x / (value - value_j), with
  !> the value value_i + u_i^H D x (the perturbation of Brillouin and Wigner). What does not settle stays as it is.
  subroutine settle(linear, loss, values, vectors, left, chosen, value, vector)
    type(linearisation_t), intent(in) :: linear
    real(wp), intent(in) :: loss(:)                        !! that of `add_loss`
    complex(wp), intent(in) :: values(:)                   !! eigenvalues [1/s], [states]
    complex(wp), intent(in) :: vectors(:, :), left(:, :)   !! [states, states]
    integer, intent(in) :: chosen(:)                       !! eigenvalues of which `value` and `vector` are
    complex(wp), intent(inout) :: value(:), vector(:, :)   !! [chosen], [states, chosen]
    integer, parameter :: most_rounds = 100
    real(wp), parameter :: accuracy = 1.0e-13_wp, settled = 1.0e-8_wp, same = 1.0e-9_wp   ! relative
    complex(wp) :: next, part(size(values), size(chosen)), share(size(values), size(chosen))
    complex(wp) :: lefts(size(linear%natural), size(values)), motion(size(linear%natural), size(chosen))
    real(wp), allocatable :: at_one(:, :), start(:, :)   ! the loss of the modes at the frequency 1 and at theirs
    real(wp) :: change(size(chosen)), frequency(size(chosen)), pace
    integer :: i, j, n, round

    n = size(linear%natural)
    allocate (start, source=undamped_loss(linear, loss))
    allocate (at_one, source=matmul(transpose(linear%twists), spread(loss, 2, n) * linear%twists))
    do j = 1, size(values)
      lefts(:, j) = left(:n, j) / sum(left(:, j) * conjg(vectors(:, j)))
    end do
    share = 0.0_wp
    do i = 1, size(chosen)
      share(chosen(i), i) = 1.0_wp
    end do
    change = merge(1.0_wp, 0.0_wp, aimag(value) > 0)
    do round = 1, most_rounds
      motion = matmul(vectors(:n, :), share)
      frequency = merge(aimag(value), 1.0_wp, aimag(value) > 0)
      part = matmul(conjg(transpose(lefts)), matmul(start, motion) - matmul(at_one, motion) / spread(frequency, 1, n))
      pace = merge(1.0_wp, 0.5_wp, round <= most_rounds / 5)   ! what swings to and fro settles at the lower one
      do i = 1, size(chosen)
        if (change(i) <= accuracy) cycle
        next = values(chosen(i)) + part(chosen(i), i)
        change(i) = abs(next - value(i)) / abs(value(i))
        value(i) = next
        do j = 1, size(values)
          if (j == chosen(i)) cycle
          share(j, i) = (1.0_wp - pace) * share(j, i)
          if (abs(values(j) - next) > same * abs(next)) share(j, i) = share(j, i) + pace * part(j, i) / (next - values(j))
        end do
      end do
      if (all(change <= accuracy)) exit
    end do
    do i = 1, size(chosen)
      if (.not. (change(i) <= settled .and. (aimag(value(i)) > 0 .or. .not. aimag(values(chosen(i))) > 0))) then
        value(i) = values(chosen(i))
        cycle
      end if
      vector(:, i) = matmul(vectors, share(:, i))
    end do
  end subroutine settle

end module nocdyn_relative_damping
