!> Taylor series of the motion of a machine in its reduced formulation, by recurrence from one coefficient to the next.
!>
!> With the coefficients of q' up to number k, those of the elements are u'_k = U q'_k and u_k = u'_(k-1) / k; their laws give
!> the moments M_k, and (k + 1) q'_(k+1) = R M_k. Products in the laws are sums over pairs of coefficients,
!> (f g)_k = sum of f_j g_(k-j). They begin in the middle, with the pairs that have been known for longest, and end with
!> the newest coefficients, so that a processor need not wait for those.
!>
!> Arrays are filled up with zeros to whole vectors: every number goes through the same operations wherever it stands.
!> All procedures of the recurrence are here, so that compilers put them into its loop.
module nocdyn_reduced_series
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_series_laws, only: new_series_laws, series_laws_t, width
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_reduced_series

  integer, parameter :: max_dense_entries = 256   ! numbers in the matrix of a map that is worth its zeros

  !> Column k of an array holds the coefficients number k, the k-th derivatives over k factorial.
  type, public :: reduced_series_t
    private
    integer :: order = 0                       !! of the series of the state
    integer :: lanes = 1
    logical :: has_energy_balance = .false.            !! whether the works are integrated
    integer :: stride = 0                      !! lanes * elements in whole vectors
    logical :: is_dense = .false.              !! whether the maps are multiplied out
    real(wp), allocatable :: angle(:, :)       !! u - rest, [stride, 0:order] as all these, the last column for the banks' offsets
    real(wp), allocatable :: speed(:, :)       !! u'
    real(wp), allocatable :: restoring(:, :)   !! as in `elements_t`
    real(wp), allocatable :: applied(:, :)
    real(wp), allocatable :: external(:, :)    !! what of `applied` depends on the time alone
    real(wp), allocatable :: moment(:)         !! present coefficients of the whole moments, [stride]
    real(wp), allocatable :: acceleration(:)   !! present coefficients of q'', [lanes * freedoms in whole vectors]
    real(wp), allocatable :: inverse(:)        !! 1 / k, [order]
    type(series_laws_t) :: laws
    real(wp), allocatable :: twists(:, :)      !! U, [stride, freedoms], if it is dense
    real(wp), allocatable :: responses(:, :)   !! R, [freedoms in whole vectors, elements], if it is dense
    integer, allocatable :: internal_banks(:)     !! whose laws are more than polynomials and external torques
    real(wp), allocatable :: square(:, :)      !! (u - rest)^2 in the vectors that are `cubic_vectors`
  contains
    procedure :: expand
    procedure :: refresh_lane
  end type reduced_series_t

contains

  !> Room for series up to an order, and what their coefficients need of the machine.
  function new_reduced_series(machine, twists, accelerations, with_energy_balance, order) result(self)
    type(machine_t), intent(in) :: machine
    type(sparse_map_t), intent(in) :: twists          !! U
    type(sparse_map_t), intent(in) :: accelerations   !! R
    logical, intent(in) :: with_energy_balance                    !! whether the works are integrated
    integer, intent(in) :: order
    type(reduced_series_t) :: self
    integer :: b, k

    self%order = order
    self%lanes = machine%lanes
    self%has_energy_balance = with_energy_balance .and. machine%work_count() > 0
    self%stride = whole_vectors(size(machine%laws%rest))
    allocate (self%angle(self%stride, 0:order), source=0.0_wp)
    allocate (self%speed, self%restoring, self%applied, self%external, self%square, source=self%angle)
    allocate (self%acceleration(whole_vectors(machine%lanes * machine%coordinates%freedoms)), source=0.0_wp)
    allocate (self%inverse(order))
    self%inverse(:) = [(1.0_wp / k, k=1, order)]
    self%internal_banks = pack(machine%general_banks, [(.not. machine%banks(machine%general_banks(b))%bank%is_time_only, &
                                                   b=1, size(machine%general_banks))])
    self%laws = new_series_laws(self%stride, machine%laws)
    allocate (self%moment(self%stride), source=0.0_wp)
    self%external(:, 0) = self%laws%constant
    call form_dense_maps(self, twists, accelerations, machine%coordinates%freedoms, size(machine%elements%to))
  end function new_reduced_series

  !> Takes the numbers that a lane has now.
  subroutine refresh_lane(self, lane, laws, twists, accelerations)
    class(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws
    type(sparse_map_t), intent(in) :: twists, accelerations

    if (self%order == 0) return
    call self%laws%refresh_lane(lane, laws)
    self%external(:, 0) = self%laws%constant
    if (self%is_dense) call form_matrices(self, twists, accelerations)
  end subroutine refresh_lane

  !> The matrices of the maps, if they are small.
  subroutine form_dense_maps(self, twists, accelerations, freedoms, elements)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: twists, accelerations
    integer, intent(in) :: freedoms, elements

    self%is_dense = self%lanes == 1 .and. max(self%stride * freedoms, size(self%acceleration) * elements) <= max_dense_entries
    if (.not. self%is_dense) return
    allocate (self%twists(self%stride, freedoms), self%responses(size(self%acceleration), elements), source=0.0_wp)
    call form_matrices(self, twists, accelerations)
  end subroutine form_dense_maps

  subroutine form_matrices(self, twists, accelerations)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: twists, accelerations
    integer :: i

    do i = 1, size(self%twists, 2)
      call twists%multiply(unit(size(self%twists, 2), i), self%twists(:, i))
    end do
    do i = 1, size(self%responses, 2)
      call accelerations%multiply(unit(size(self%responses, 2), i), self%responses(:, i))
    end do
  end subroutine form_matrices

  !> The length of so many numbers in whole vectors.
  pure integer function whole_vectors(numbers)
    integer, intent(in) :: numbers

    whole_vectors = width * ((numbers + width - 1) / width)
  end function whole_vectors

  pure function unit(n, i) result(vector)
    integer, intent(in) :: n, i
    real(wp) :: vector(n)

    vector = 0.0_wp
    vector(i) = 1.0_wp
  end function unit

  !> The coefficients number 1 to order of q', q and the works of the accounted elements, which follow each other in y.
  subroutine expand(self, machine, twists, accelerations, start_twist, n, length, t, y)
    class(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(sparse_map_t), intent(in) :: twists, accelerations
    integer, intent(in) :: n                          !! lanes * freedoms
    integer, intent(in) :: length                     !! of a column of y
    real(wp), contiguous, intent(in) :: start_twist(:, :)   !! [lanes, elements]
    real(wp), intent(in) :: t(self%lanes)
    real(wp), intent(inout) :: y(length, 0:self%order)
    integer :: k

    call forcing_series(self, machine, t)
    call twists%multiply_pair(start_twist, y(n + 1, 0), y(1, 0), self%angle, self%speed)
    do k = 0, self%order - 1
      if (k > 0) call element_speeds(self, twists, n, y(1, k), self%speed(1, k))
      call find_moments(self, machine, k, t)
      call accelerate(self, accelerations)
      call integrate_coordinates(n, self%inverse(k + 1), self%acceleration, y(1, k), y(1, k + 1))
      if (self%has_energy_balance) call integrate_powers(self, machine, k, y(2 * n + 1, k + 1))
    end do
  end subroutine expand

  !> The coefficients of the external torques.
  subroutine forcing_series(self, machine, t)
    type(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t(self%lanes)
    integer :: i

    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank)
        call bank%forcing_series(self%order - 1, self%stride, t, self%external(bank%first_value, 0))
      end associate
    end do
  end subroutine forcing_series

  !> u'_k = U q'_k.
  subroutine element_speeds(self, twists, n, q, u)
    type(reduced_series_t), intent(in) :: self
    type(sparse_map_t), intent(in) :: twists
    integer, intent(in) :: n
    real(wp), intent(in) :: q(n)
    real(wp), intent(inout) :: u(self%stride)

    if (self%is_dense) then
      call multiply(self%stride, n, self%twists, q, u)
    else
      call twists%multiply(q, u)
    end if
  end subroutine element_speeds

  !> u_k, and the moments number k.
  subroutine find_moments(self, machine, k, t)
    type(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: k
    real(wp), intent(in) :: t(self%lanes)

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
    if (size(self%internal_banks) > 0) call add_banks(self, machine, k, t)
    call add(self%stride, self%restoring(1, k), self%applied(1, k), self%moment)
  end subroutine find_moments

  !> q''_k = R M_k.
  subroutine accelerate(self, accelerations)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: accelerations

    if (self%is_dense) then
      call multiply(size(self%acceleration), size(self%responses, 2), self%responses, self%moment, self%acceleration)
    else
      call accelerations%multiply(self%moment, self%acceleration)
    end if
  end subroutine accelerate

  !> What the inner banks add to the moments.
  subroutine add_banks(self, machine, k, t)
    type(reduced_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: k
    real(wp), intent(in) :: t(self%lanes)
    integer :: i

    do i = 1, size(self%internal_banks)
      associate (bank => machine%banks(self%internal_banks(i))%bank)
        associate (first => bank%first_value)
          call bank%series(k, self%stride, t, self%angle(first, 0), self%speed(first, 0), self%restoring(first, 0), &
                           self%applied(first, 0))
        end associate
      end associate
    end do
  end subroutine add_banks

  !> The moments at the start of the step, without the powers.
  pure subroutine begin_moments(n, rest, linear, by_speed, external, angle, speed, restoring, applied)
    integer, intent(in) :: n
    real(wp), intent(in), dimension(n) :: rest, linear, by_speed, external, speed
    real(wp), intent(inout) :: angle(n)   !! u, on return less `rest`
    real(wp), intent(inout) :: restoring(n), applied(n)

    angle = angle - rest
    restoring = -linear * angle
    applied = external + by_speed * speed
  end subroutine begin_moments

  !> u = matrix x, zeros included.
  pure subroutine multiply(rows, columns, matrix, x, u)
    integer, intent(in) :: rows   !! whole vectors
    integer, intent(in) :: columns
    real(wp), intent(in) :: matrix(rows, columns), x(columns)
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

  !> u_k, and the moments without the powers.
  pure subroutine continue_moments(n, k, inverse, linear, by_speed, external, speed, angle, restoring, applied)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: inverse   !! 1 / k
    real(wp), intent(in) :: linear(n), by_speed(n), external(n, 0:k), speed(n, 0:k)
    real(wp), intent(inout) :: angle(n, 0:k), restoring(n, 0:k), applied(n, 0:k)
    integer :: i

    do i = 1, n, width
      associate (j => i + width - 1)
        angle(i:j, k) = inverse * speed(i:j, k - 1)
        restoring(i:j, k) = -linear(i:j) * angle(i:j, k)
        applied(i:j, k) = external(i:j, k) + by_speed(i:j) * speed(i:j, k)
      end associate
    end do
  end subroutine continue_moments

  !> Adds -cubic (u - rest)^3. The coefficients of the square count each pair of different coefficients once, doubled.
  pure subroutine add_cubes(n, k, vectors, cubic, w, w2, restoring)
    integer, intent(in) :: n, k
    integer, intent(in) :: vectors(:)   !! of values with such terms
    real(wp), intent(in) :: cubic(n), w(n, 0:k)
    real(wp), intent(inout) :: w2(n, 0:k), restoring(n, 0:k)
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
    integer, intent(in) :: n, k
    integer, intent(in) :: vectors(:)   !! of values with such terms
    real(wp), intent(in) :: by_speed_squared(n), speed(n, 0:k)
    real(wp), intent(inout) :: applied(n, 0:k)
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

  pure subroutine add(n, restoring, applied, moment)
    integer, intent(in) :: n
    real(wp), intent(in) :: restoring(n), applied(n)
    real(wp), intent(inout) :: moment(n)
    integer :: i

    do i = 1, n, width
      moment(i:i + width - 1) = restoring(i:i + width - 1) + applied(i:i + width - 1)
    end do
  end subroutine add

  !> The next coefficients of q' from those of q'', and of q from those of q'.
  pure subroutine integrate_coordinates(n, inverse, acceleration, speed, y)
    integer, intent(in) :: n
    real(wp), intent(in) :: inverse, acceleration(n), speed(n)
    real(wp), intent(inout) :: y(n, 2)
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

  !> The next coefficients of the works of the accounted elements, whose powers are `applied` times the speed.
  subroutine integrate_powers(self, machine, k, work)
    type(reduced_series_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: k
    real(wp), intent(inout) :: work(self%lanes, size(machine%with_work))
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
