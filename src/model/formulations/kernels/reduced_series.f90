!> Taylor series of the motion of a machine in the reduced formulation, by recurrence from one coefficient to the next.
!>
!> From the coefficients of q' up to number k, those of the elements are u'_k = U q'_k and u_k = u'_(k-1) / k. Their laws give
!> the moments M_k, and (k + 1) q'_(k+1) = R M_k. Products in the laws are sums over pairs of coefficients,
!> (f g)_k = sum of f_j g_(k-j). The sums start in the middle, with pairs that were computed long ago, and end with
!> the newest coefficients, so that the processor does not wait for these.
!>
!> Arrays are padded with zeros to whole vectors, so that every value goes through the same operations wherever it stands.
!> All procedures of the recurrence are in this module, so that compilers inline them into its loop.
module nocdyn_reduced_series
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_series_laws, only: new_series_laws, series_laws_t, width
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_reduced_series

  integer, parameter :: max_dense_entries = 256   ! entries of a matrix up to which multiplying its zeros is faster

  !> Column k of an array holds the coefficients number k: the k-th derivatives over k factorial.
  type, public :: reduced_series_t
    private
    integer :: order = 0   !! order of the series of the state
    integer :: lanes = 1
    logical :: has_energy_balance = .false.   !! whether the powers of the elements `machine%with_work` are integrated
    integer :: stride = 0                     !! lanes * elements, rounded up to whole vectors, at least one
    logical :: is_dense = .false.             !! whether U and R are dense matrices
    ! [stride, 0:order]; banks write with offsets, for which the last column leaves room
    real(wp), allocatable :: angle(:, :)       !! u - rest
    real(wp), allocatable :: speed(:, :)       !! u'
    real(wp), allocatable :: restoring(:, :)   !! as in `elements_t`
    real(wp), allocatable :: applied(:, :)
    real(wp), allocatable :: external(:, :)    !! part of `applied` that depends on the time alone
    real(wp), allocatable :: moment(:)         !! present coefficients of the whole moments, [stride]
    real(wp), allocatable :: acceleration(:)   !! present coefficients of q'', [lanes * freedoms in whole vectors]
    real(wp), allocatable :: inverse(:)        !! 1 / k, [order]
    type(series_laws_t) :: laws
    real(wp), allocatable :: twists(:, :)      !! U, [stride, freedoms], if dense
    real(wp), allocatable :: responses(:, :)   !! R, [freedoms in whole vectors, elements], if dense
    integer, allocatable :: series_banks(:)    !! banks whose laws are neither polynomials nor dependent on the time alone
    real(wp), allocatable :: square(:, :)      !! (u - rest)^2 in the `cubic_vectors` of the laws
  contains
    procedure :: expand
    procedure :: refresh_lane
  end type reduced_series_t

contains

  !> Work space for series up to an order.
  function new_reduced_series(machine, twists, accelerations, with_energy_balance, order) result(self)
    type(machine_t), intent(in) :: machine
    type(sparse_map_t), intent(in) :: twists          !! U
    type(sparse_map_t), intent(in) :: accelerations   !! R
    logical, intent(in) :: with_energy_balance        !! whether the powers of the elements `machine%with_work` are integrated
    integer, intent(in) :: order
    type(reduced_series_t) :: self
    integer :: b, k

    self%order = order
    self%lanes = machine%lanes
    self%has_energy_balance = with_energy_balance .and. size(machine%with_work) > 0
    self%stride = whole_vectors(max(size(machine%laws%rest), 1))
    allocate (self%angle(self%stride, 0:order), source=0.0_wp)
    allocate (self%speed, self%restoring, self%applied, self%external, self%square, source=self%angle)
    allocate (self%acceleration(whole_vectors(machine%lanes * machine%coordinates%freedoms)), source=0.0_wp)
    allocate (self%inverse(order))
    self%inverse(:) = [(1.0_wp / k, k=1, order)]
    self%series_banks = pack(machine%general_banks, [(.not. machine%banks(machine%general_banks(b))%bank%is_time_only, &
                                                   b=1, size(machine%general_banks))])
    self%laws = new_series_laws(self%stride, machine%laws)
    allocate (self%moment(self%stride), source=0.0_wp)
    self%external(:, 0) = self%laws%constant
    call form_dense_maps(self, twists, accelerations, machine%coordinates%freedoms, size(machine%elements%to))
  end function new_reduced_series

  !> Updates everything that depends on the parameters of a lane.
  subroutine refresh_lane(self, lane, laws, twists, accelerations)
    class(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R

    if (self%order == 0) return
    call self%laws%refresh_lane(lane, laws)
    self%external(:, 0) = self%laws%constant
    if (self%is_dense) call form_matrices(self, twists, accelerations)
  end subroutine refresh_lane

  !> Forms the dense matrices of U and R, if they are small.
  subroutine form_dense_maps(self, twists, accelerations, freedoms, elements)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R
    integer, intent(in) :: freedoms, elements

    self%is_dense = self%lanes == 1 .and. max(self%stride * freedoms, size(self%acceleration) * elements) <= max_dense_entries
    if (.not. self%is_dense) return
    allocate (self%twists(self%stride, freedoms), self%responses(size(self%acceleration), elements), source=0.0_wp)
    call form_matrices(self, twists, accelerations)
  end subroutine form_dense_maps

  !> Fills the dense matrices.
  subroutine form_matrices(self, twists, accelerations)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R
    integer :: i

    do i = 1, size(self%twists, 2)
      call twists%multiply(unit(size(self%twists, 2), i), self%twists(:, i))
    end do
    do i = 1, size(self%responses, 2)
      call accelerations%multiply(unit(size(self%responses, 2), i), self%responses(:, i))
    end do
  end subroutine form_matrices

  !> A number of values, rounded up to whole vectors.
  pure integer function whole_vectors(numbers)
    integer, intent(in) :: numbers

    whole_vectors = width * ((numbers + width - 1) / width)
  end function whole_vectors

  !> The unit vector number i of length n.
  pure function unit(n, i) result(vector)
    integer, intent(in) :: n, i
    real(wp) :: vector(n)

    vector = 0.0_wp
    vector(i) = 1.0_wp
  end function unit

  !> Computes the coefficients number 1 to `order` of q', q and the work integrals, which follow one another in y.
  subroutine expand(self, machine, twists, accelerations, start_twist, n, length, t, y)
    class(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R
    integer, intent(in) :: n                                  !! lanes * freedoms
    integer, intent(in) :: length                             !! length of a column of y
    real(wp), contiguous, intent(in) :: start_twist(:, :)     !! [rad], [lanes, elements]
    real(wp), intent(in) :: t(self%lanes)                     !! [s]
    real(wp), intent(inout) :: y(length, 0:self%order)        !! coefficients; number 0 is given
    integer :: k

    call machine%forcing_series(self%order - 1, self%stride, t, self%external)
    call twists%multiply_pair(start_twist, y(n + 1, 0), y(1, 0), self%angle, self%speed)
    do k = 0, self%order - 1
      if (k > 0) call element_speeds(self, twists, n, y(1, k), self%speed(1, k))
      call find_moments(self, machine, k, t)
      call accelerate(self, accelerations)
      call integrate_coordinates(n, self%inverse(k + 1), self%acceleration, y(1, k), y(1, k + 1))
      if (self%has_energy_balance) call integrate_powers(self, machine, k, y(2 * n + 1, k + 1))
    end do
  end subroutine expand

  !> Computes u'_k = U q'_k.
  subroutine element_speeds(self, twists, n, q, u)
    type(reduced_series_t), intent(in) :: self
    type(sparse_map_t), intent(in) :: twists    !! U
    integer, intent(in) :: n                    !! lanes * freedoms
    real(wp), intent(in) :: q(n)                !! q'_k
    real(wp), intent(inout) :: u(self%stride)   !! u'_k

    if (self%is_dense) then
      call multiply(self%stride, n, self%twists, q, u)
    else
      call twists%multiply(q, u)
    end if
  end subroutine element_speeds

  !> Computes u_k and the moments number k.
  subroutine find_moments(self, machine, k, t)
    type(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: k
    real(wp), intent(in) :: t(self%lanes)   !! [s]

    if (k == 0) then
      call begin_moments(self%stride, self%laws%rest, self%laws%linear, self%laws%by_speed, self%external, self%angle, &
                         self%speed, self%restoring, self%applied)
    else
      call continue_moments(self%stride, k, self%inverse(k), self%laws%linear, self%laws%by_speed, self%external, self%speed, &
                            self%angle, self%restoring, self%applied)
    end if
    if (size(self%laws%cubic_vectors) > 0) then
      call add_cubes(self%stride, k, self%laws%cubic_vectors, self%laws%cubic, self%angle, self%square, self%restoring)
    end if
    if (size(self%laws%square_vectors) > 0) then
      call add_squares(self%stride, k, self%laws%square_vectors, self%laws%by_speed_squared, self%speed, self%applied)
    end if
    if (size(self%series_banks) > 0) call add_banks(self, machine, k, t)
    call add(self%stride, self%restoring(1, k), self%applied(1, k), self%moment)
  end subroutine find_moments

  !> Computes q''_k = R M_k.
  subroutine accelerate(self, accelerations)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: accelerations   !! R

    if (self%is_dense) then
      call multiply(size(self%acceleration), size(self%responses, 2), self%responses, self%moment, self%acceleration)
    else
      call accelerations%multiply(self%moment, self%acceleration)
    end if
  end subroutine accelerate

  !> Adds the moments of the banks in `series_banks`.
  subroutine add_banks(self, machine, k, t)
    type(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: k
    real(wp), intent(in) :: t(self%lanes)   !! [s]
    integer :: i

    do i = 1, size(self%series_banks)
      associate (bank => machine%banks(self%series_banks(i))%bank)
        associate (first => bank%first_value)
          call bank%series(k, self%stride, t, self%angle(first, 0), self%speed(first, 0), self%restoring(first, 0), &
                           self%applied(first, 0))
        end associate
      end associate
    end do
  end subroutine add_banks

  !> Moments at the start of the step, without the terms of higher degree.
  pure subroutine begin_moments(n, rest, linear, by_speed, external, angle, speed, restoring, applied)
    integer, intent(in) :: n                                                        !! stride
    real(wp), intent(in), dimension(n) :: rest, linear, by_speed, external, speed   !! laws, time-only torques, u'
    real(wp), intent(inout) :: angle(n)                                             !! u; on return u - rest
    real(wp), intent(inout) :: restoring(n), applied(n)                             !! moments number 0

    angle = angle - rest
    restoring = -linear * angle
    applied = external + by_speed * speed
  end subroutine begin_moments

  !> u = matrix x, with all zeros of the matrix.
  pure subroutine multiply(rows, columns, matrix, x, u)
    integer, intent(in) :: rows   !! whole vectors
    integer, intent(in) :: columns
    real(wp), intent(in) :: matrix(rows, columns), x(columns)   !! padded with zeros to whole vectors
    real(wp), intent(inout) :: u(rows)
    real(wp) :: sum(width)
    integer :: c, i

    do i = 1, rows, width
      sum = 0.0_wp
      do c = 1, columns
        sum = sum + matrix(i:i + width - 1, c) * x(c)
      end do
      u(i:i + width - 1) = sum
    end do
  end subroutine multiply

  !> Computes u_k and the moments number k, without the terms of higher degree.
  pure subroutine continue_moments(n, k, inverse, linear, by_speed, external, speed, angle, restoring, applied)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: inverse                                                   !! 1 / k
    real(wp), intent(in) :: linear(n), by_speed(n), external(n, 0:k), speed(n, 0:k)   !! laws, time-only torques, u'
    real(wp), intent(inout) :: angle(n, 0:k), restoring(n, 0:k), applied(n, 0:k)      !! column k is set
    integer :: i

    do i = 1, n, width
      associate (j => i + width - 1)
        angle(i:j, k) = inverse * speed(i:j, k - 1)
        restoring(i:j, k) = -linear(i:j) * angle(i:j, k)
        applied(i:j, k) = external(i:j, k) + by_speed(i:j) * speed(i:j, k)
      end associate
    end do
  end subroutine continue_moments

  !> Adds -cubic (u - rest)^3. The square counts each pair of different coefficients once and doubles it.
  pure subroutine add_cubes(n, k, vectors, cubic, w, w2, restoring)
    integer, intent(in) :: n, k                                !! stride, number of the coefficients
    integer, intent(in) :: vectors(:)                          !! first values of the vectors with cubic terms
    real(wp), intent(in) :: cubic(n), w(n, 0:k)                !! w = u - rest
    real(wp), intent(inout) :: w2(n, 0:k), restoring(n, 0:k)   !! w2 = w^2
    real(wp) :: sum(width)
    integer :: i, j, s

    do s = 1, size(vectors)
      i = vectors(s)
      sum = 0.0_wp
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + w(i:i + width - 1, j) * w(i:i + width - 1, k - j)
      end do
      sum = sum + sum
      if (modulo(k, 2) == 0) sum = sum + w(i:i + width - 1, k / 2) * w(i:i + width - 1, k / 2)
      w2(i:i + width - 1, k) = sum
      sum = 0.0_wp
      if (modulo(k, 2) == 0) sum = w(i:i + width - 1, k / 2) * w2(i:i + width - 1, k / 2)
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + (w(i:i + width - 1, j) * w2(i:i + width - 1, k - j) + w(i:i + width - 1, k - j) * w2(i:i + width - 1, j))
      end do
      restoring(i:i + width - 1, k) = restoring(i:i + width - 1, k) - cubic(i:i + width - 1) * sum
    end do
  end subroutine add_cubes

  !> Adds by_speed_squared u'^2.
  pure subroutine add_squares(n, k, vectors, by_speed_squared, speed, applied)
    integer, intent(in) :: n, k                                  !! stride, number of the coefficients
    integer, intent(in) :: vectors(:)                            !! first values of the vectors with quadratic terms
    real(wp), intent(in) :: by_speed_squared(n), speed(n, 0:k)   !! law, u'
    real(wp), intent(inout) :: applied(n, 0:k)                   !! column k is changed
    real(wp) :: sum(width)
    integer :: i, j, s

    do s = 1, size(vectors)
      i = vectors(s)
      sum = 0.0_wp
      do j = (k + 1) / 2 - 1, 0, -1
        sum = sum + speed(i:i + width - 1, j) * speed(i:i + width - 1, k - j)
      end do
      sum = sum + sum
      if (modulo(k, 2) == 0) sum = sum + speed(i:i + width - 1, k / 2) * speed(i:i + width - 1, k / 2)
      applied(i:i + width - 1, k) = applied(i:i + width - 1, k) + by_speed_squared(i:i + width - 1) * sum
    end do
  end subroutine add_squares

  !> Sum of restoring and applied moments.
  pure subroutine add(n, restoring, applied, moment)
    integer, intent(in) :: n
    real(wp), intent(in) :: restoring(n), applied(n)   !! [N m]
    real(wp), intent(inout) :: moment(n)               !! [N m]
    integer :: i

    do i = 1, n, width
      moment(i:i + width - 1) = restoring(i:i + width - 1) + applied(i:i + width - 1)
    end do
  end subroutine add

  !> Computes the next coefficients of q' from those of q'', and of q from those of q'.
  pure subroutine integrate_coordinates(n, inverse, acceleration, speed, y)
    integer, intent(in) :: n                                     !! lanes * freedoms
    real(wp), intent(in) :: inverse, acceleration(n), speed(n)   !! inverse = 1 / (k + 1)
    real(wp), intent(inout) :: y(n, 2)                           !! next coefficients of q' and q
    integer :: i

    if (n < width) then
      !GCC$ novector
      do i = 1, n
        y(i, 1) = inverse * acceleration(i)
        y(i, 2) = inverse * speed(i)
      end do
    else
      do i = 1, n
        y(i, 1) = inverse * acceleration(i)
        y(i, 2) = inverse * speed(i)
      end do
    end if
  end subroutine integrate_coordinates

  !> Computes the next coefficients of the work integrals; the powers are `applied` times the speed.
  subroutine integrate_powers(self, machine, k, work)
    type(reduced_series_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: k
    real(wp), intent(inout) :: work(self%lanes, size(machine%with_work))   !! coefficients number k + 1
    integer :: a, before, j, l

    do a = 1, size(machine%with_work)
      before = (machine%with_work(a) - 1) * self%lanes
      do l = 1, self%lanes
        work(l, a) = 0.0_wp
      end do
      do j = 0, k
        do l = 1, self%lanes
          work(l, a) = work(l, a) + self%applied(before + l, j) * self%speed(before + l, k - j)
        end do
      end do
      do l = 1, self%lanes
        work(l, a) = self%inverse(k + 1) * work(l, a)
      end do
    end do
  end subroutine integrate_powers

end module nocdyn_reduced_series
