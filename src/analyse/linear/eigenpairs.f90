!> The eigenvalues of a linearised machine with their eigenvectors: the one routine by which modes, Campbell's diagram and the
!> forced response find damped frequencies.
module nocdyn_eigenpairs
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvectors
  use nocdyn_linearisation, only: linearisation_t, undamped_loss
  implicit none (type, external)
  private

  public :: find_eigenpairs, clear_rounding

  !> One of each conjugate pair, and all real ones.
  type, public :: eigenpairs_t
    complex(wp), allocatable :: value(:)        !! imaginary part >= 0 [1/s], [pairs]
    complex(wp), allocatable :: vector(:, :)    !! [first-order states, pairs]
    integer, allocatable :: internal(:)         !! the internal state that takes part most, if they do more than the motion; or 0
    complex(wp), allocatable :: speeds(:, :)    !! of the coordinates, [coordinates, pairs]
  end type eigenpairs_t

contains

  !> Finds all, with the relative damping at the frequency of each oscillation.
  subroutine find_eigenpairs(linear, self, error)
    type(linearisation_t), intent(in) :: linear   !! with its matrix
    type(eigenpairs_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    complex(wp), allocatable :: left(:, :), values(:), vectors(:, :)
    integer, allocatable :: kept(:)
    real(wp), parameter :: small = 1.0e-6_wp   ! of a value, or of the lowest natural frequency: more is no rounding
    integer :: i, internal, states
    logical :: has_failed, has_loss

    states = size(linear%matrix, 1)
    allocate (values(states), vectors(states, states))
    has_loss = any(abs(linear%loss) > 0)
    if (has_internal(linear) .or. has_loss) then
      allocate (left(states, states))
      call eigenvectors(linear%matrix, values, vectors, has_failed, left)
    else
      call eigenvectors(linear%matrix, values, vectors, has_failed)
    end if
    if (has_failed) then
      call raise(error, exit_failed, 'the modes were not found: a number of the linearised machine is not finite, or ' // &
                 'LAPACK did not converge')
      return
    end if
    call clear_rounding(values, small * max(abs(values), minval(abs(linear%natural(linear%flexible)))))
    kept = pack([(i, i=1, states)], aimag(values) >= 0.0_wp)
    self%value = values(kept)
    self%vector = vectors(:, kept)
    if (has_loss) call settle(linear, values, vectors, left, kept, self%value, self%vector)
    self%speeds = matmul(cmplx(linear%shapes, kind=wp), self%vector(:size(linear%natural), :))
    allocate (self%internal(size(kept)), source=0)
    if (.not. has_internal(linear)) return
    do i = 1, size(kept)
      ! Which internal state a mode is, if they take part more than the motion does; else 0. Participation factors, products of
      ! left and right eigenvectors, compare states of different units.
      internal = 0
      associate (shares => abs((left(:, kept(i)) * vectors(:, kept(i)))), mechanical => size(linear%natural) + &
        size(linear%flexible))
        if (sum(shares(mechanical + 1:)) > sum(shares(:mechanical))) internal = maxloc(shares(mechanical + 1:), dim=1)
      end associate
      self%internal(i) = internal
    end do
  end subroutine find_eigenpairs

  pure logical function has_internal(linear)
    type(linearisation_t), intent(in) :: linear

    has_internal = size(linear%matrix, 1) > size(linear%natural) + size(linear%flexible)
  end function has_internal

  !> Moves oscillations of the first-order matrix to where the relative damping is that at their own frequencies. With the right
  !> and left eigenvectors v and u and the change D of the matrix, one is x = v_i + sum of v_j u_j^H D x / (value - value_j), with
  !> the value value_i + u_i^H D x (the perturbation of Brillouin and Wigner). What does not settle stays as it is.
  subroutine settle(linear, values, vectors, left, chosen, value, vector)
    type(linearisation_t), intent(in) :: linear
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
    allocate (start, source=undamped_loss(linear))
    allocate (at_one, source=matmul(transpose(linear%twists), spread(linear%loss, 2, n) * linear%twists))
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

  !> Sets real and imaginary parts to zero that are rounding of the largest number.
  pure subroutine clear_rounding(values, most)
    complex(wp), intent(inout) :: values(:)
    real(wp), intent(in), optional :: most(:)   !! larger parts stay, [values]
    real(wp), parameter :: rounding = 1.0e-13_wp
    integer :: i
    real(wp) :: imaginary_part, largest, limit, real_part

    largest = rounding * maxval(abs(values))
    do i = 1, size(values)
      limit = largest
      if (present(most)) limit = min(largest, most(i))
      real_part = real(values(i), wp)
      imaginary_part = aimag(values(i))
      if (abs(real_part) <= limit) real_part = 0.0_wp
      if (abs(imaginary_part) <= limit) imaginary_part = 0.0_wp
      values(i) = cmplx(real_part, imaginary_part, wp)
    end do
  end subroutine clear_rounding

end module nocdyn_eigenpairs
