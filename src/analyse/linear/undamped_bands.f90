!> The undamped modes of a large machine: some of them, by Lanczos' method about shifts, and none missed.
!>
!> The squares of the frequencies are divided into intervals of a dozen modes, by Sturm's count. About the middle of each, the
!> method of Lanczos with full orthogonalisation finds the modes of (K - s M)^-1 M, until there are as many as were counted
!> (T. Ericsson and A. Ruhe, Math. Comp. 35 (1980) 1251-1268; R. G. Grimes, J. G. Lewis and H. D. Simon, SIAM J. Matrix Anal.
!> Appl. 15 (1994) 228-272). A frequency follows from the twists of its mode: its error is of second order.
module nocdyn_undamped_bands
  use nocdyn_band_pencil, only: band_pencil_t
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_lapack_eigen, only: tridiagonal_eigenvectors
  use nocdyn_linearisation, only: linearisation_t
  implicit none (type, external)
  private

  public :: band_modes

  integer, parameter :: some = 6, many = 12   ! modes of an interval

  !> What Lanczos' method has found in an interval.
  type :: interval_modes_t
    integer :: count = 0
    real(wp), allocatable :: square(:)       ! s [rad2/s2], [modes]
    real(wp), allocatable :: shape(:, :)     ! x, x^T M x = 1, [coordinates, modes]
    real(wp), allocatable :: momentum(:, :)  ! M x
  end type interval_modes_t

contains

  !> Finds the modes from one number to another, in the order of the squares of their frequencies: all of `self` but `matrix`.
  subroutine band_modes(pencil, first, last, held, self, error)
    type(band_pencil_t), intent(inout) :: pencil
    integer, intent(in) :: first, last     !! 1 to pencil%modes
    integer, intent(in) :: held(:)         !! elements that do not turn
    type(linearisation_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if not all are found
    integer :: begin, below, start
    logical :: has_failed
    real(wp) :: a, b, high
    real(wp), allocatable :: shapes(:, :), square(:)

    a = pencil%bottom
    begin = 0
    if (first > 1) call pencil%place_between(pencil%bottom, 1.01_wp * pencil%top, first - 1 - some, first - 1, a, begin)
    start = begin
    allocate (shapes(pencil%coordinates, last + many - start), square(last + many - start))
    do while (begin < last)
      high = a + 4 * max(abs(a), pencil%lowest)
      call pencil%count_below(high, below)
      do while (below < min(begin + some, pencil%modes) .and. high < pencil%top)
        high = high + 4 * max(abs(high), pencil%lowest)
        call pencil%count_below(high, below)
      end do
      call pencil%place_between(a, min(high, 1.01_wp * pencil%top), min(begin + some, last), begin + many, b, below)
      if (below > start + size(square)) call lengthen(shapes, square, below - start)
      associate (k => begin - start + 1, l => below - start)
        call find_between(pencil, [a, b], begin, square(k:l), shapes(:, k:l), has_failed)
      end associate
      if (has_failed) then
        call raise(error, exit_failed, 'the natural frequencies were not found: LAPACK or the method of Lanczos did not converge')
        return
      end if
      a = b
      begin = below
    end do
    associate (k => first - start, l => last - start)
      call set_modes(pencil, first, square(k:l), shapes(:, k:l), self)
    end associate
    self%held = held
  end subroutine band_modes

  !> Makes room for equal modes at the end.
  subroutine lengthen(shapes, square, modes)
    real(wp), allocatable, intent(inout) :: shapes(:, :), square(:)
    integer, intent(in) :: modes
    real(wp), allocatable :: longer(:), wider(:, :)

    allocate (longer(modes), wider(size(shapes, 1), modes))
    longer(:size(square)) = square
    wider(:, :size(square)) = shapes
    call move_alloc(longer, square)
    call move_alloc(wider, shapes)
  end subroutine lengthen

  !> Fills the linearisation. The rigid modes are the ones with the least squares.
  subroutine set_modes(pencil, first, square, shapes, self)
    type(band_pencil_t), intent(in) :: pencil
    integer, intent(in) :: first           !! number of the first mode
    real(wp), intent(in) :: square(:)      !! [modes]
    real(wp), intent(in) :: shapes(:, :)   !! [coordinates, modes]
    type(linearisation_t), intent(inout) :: self
    integer :: i, number
    logical :: is_rigid(size(square))

    self%stiffness = pencil%stiffness
    self%shapes = shapes
    self%natural = sign(sqrt(abs(square)), square)
    allocate (self%twists(size(self%stiffness), size(square)))
    do i = 1, size(square)
      self%twists(:, i) = pencil%twists_of(shapes(:, i))
    end do
    do i = 1, size(square)
      number = first - 1 + i
      is_rigid(i) = number > pencil%negative .and. number <= pencil%negative + pencil%rigid
    end do
    where (is_rigid) self%natural = 0.0_wp
    self%flexible = pack([(i, i=1, size(square))], .not. is_rigid)
  end subroutine set_modes

  !> Finds all modes of an interval. If Lanczos' method does not do at once, the interval is halved, and so made narrower around
  !> modes that are close together.
  recursive subroutine find_between(pencil, ends, below, square, shapes, has_failed)
    type(band_pencil_t), intent(inout) :: pencil
    real(wp), intent(in) :: ends(2)             !! [rad2/s2]
    integer, intent(in) :: below                !! modes below the interval
    real(wp), intent(out) :: square(:)          !! s, ascending; as many as the interval has [rad2/s2]
    real(wp), intent(out) :: shapes(:, :)       !! [coordinates, modes]
    logical, intent(out) :: has_failed
    integer, parameter :: most_starts = 8, most_halvings = 24
    integer :: halving, middle
    real(wp) :: a, b, shift

    has_failed = .false.
    if (size(square) == 0) return
    call find_about(pencil, ends, 1, square, shapes, has_failed)
    if (.not. has_failed) return
    a = ends(1)
    b = ends(2)
    do halving = 1, most_halvings
      shift = 0.5_wp * (a + b)
      call pencil%step_aside(shift, middle)
      if (middle > below .and. middle < below + size(square)) then
        call find_between(pencil, [a, shift], below, square(:middle - below), shapes(:, :middle - below), has_failed)
        if (.not. has_failed) call find_between(pencil, [shift, b], middle, square(middle - below + 1:), &
                                                shapes(:, middle - below + 1:), has_failed)
        return
      end if
      if (middle == below) a = shift
      if (middle /= below) b = shift
    end do
    call find_about(pencil, [a, b], most_starts, square, shapes, has_failed)
  end subroutine find_between

  !> Finds the modes of an interval about its middle.
  subroutine find_about(pencil, ends, starts, square, shapes, has_failed)
    type(band_pencil_t), intent(inout) :: pencil
    real(wp), intent(in) :: ends(2)             !! [rad2/s2]
    integer, intent(in) :: starts               !! that may be needed
    real(wp), intent(out) :: square(:)          !! s, ascending; as many as the interval has [rad2/s2]
    real(wp), intent(out) :: shapes(:, :)       !! [coordinates, modes]
    logical, intent(out) :: has_failed
    integer :: start
    integer :: order(size(square))
    real(wp) :: shift
    type(interval_modes_t) :: found

    call choose_shift(pencil, ends, shift)
    call pencil%factor(shift)
    allocate (found%square(size(square)), found%shape(size(shapes, 1), size(square)), &
              found%momentum(size(shapes, 1), size(square)))
    do start = 1, starts
      call iterate(pencil, [shift, ends], start, found)
      if (found%count == size(square)) exit
    end do
    has_failed = found%count < size(square)
    if (has_failed) return
    order = ascending_order(found%square)
    square = found%square(order)
    shapes = found%shape(:, order)
  end subroutine find_about

  !> A shift about the middle of an interval, not right beside a mode.
  subroutine choose_shift(pencil, ends, shift)
    type(band_pencil_t), intent(inout) :: pencil
    real(wp), intent(in) :: ends(2)    !! [rad2/s2]
    real(wp), intent(out) :: shift     !! [rad2/s2]
    real(wp), parameter :: beside = 1.0e-4_wp, step = 2.7e-2_wp   ! of the width
    integer :: above, below, try

    do try = 0, 12
      associate (width => ends(2) - ends(1))
        shift = 0.5_wp * (ends(1) + ends(2)) + try * step * width
        call pencil%count_below(shift - beside * width, below)
        call pencil%count_below(shift + beside * width, above)
        if (above == below) return
      end associate
    end do
  end subroutine choose_shift

  !> Lanczos' method, orthogonal to the modes found so far; adds what converges in the interval.
  subroutine iterate(pencil, shifts, start, found)
    type(band_pencil_t), intent(inout) :: pencil     !! factored
    real(wp), intent(in) :: shifts(3)                !! the one of the inverse, and the ends of the interval [rad2/s2]
    integer, intent(in) :: start                     !! number of the start vector
    type(interval_modes_t), intent(inout) :: found
    integer, parameter :: pause = 5                  ! steps between two looks
    real(wp), parameter :: negligible = 1.0e-13_wp   ! of the largest eigenvalue
    integer :: j, left, steps
    logical :: is_closed
    real(wp), allocatable :: p(:, :), q(:, :)        ! basis, and M times it
    real(wp), allocatable :: diagonal(:), beside(:)
    real(wp) :: x(pencil%coordinates)

    left = size(found%square) - found%count
    steps = min(pencil%modes - found%count, 4 * left + 40)
    allocate (q(size(x), steps), p(size(x), steps), diagonal(steps), beside(steps))
    call choose_start(start, x)
    call pencil%solve(x)   ! without motion of what does not turn
    call make_orthogonal(found%shape(:, :found%count), found%momentum(:, :found%count), x)
    call normalise(pencil, x, q(:, 1), p(:, 1))
    do j = 1, steps
      x = p(:, j)
      call pencil%solve(x)
      diagonal(j) = dot_product(x, p(:, j))
      call make_orthogonal(found%shape(:, :found%count), found%momentum(:, :found%count), x)
      call make_orthogonal(q(:, :j), p(:, :j), x)
      beside(j) = sqrt(max(dot_product(x, pencil%masses_times(x)), 0.0_wp))
      is_closed = beside(j) <= negligible * maxval(abs(diagonal(:j)))
      if (is_closed .or. j == steps .or. (j >= 2 * left .and. modulo(j, pause) == 0)) then
        call collect(pencil, shifts, diagonal(:j), beside(:j), q(:, :j), j == steps, found)
        if (found%count == size(found%square) .or. j == steps) return
      end if
      if (is_closed) then   ! goes on elsewhere
        beside(j) = 0.0_wp
        call choose_start(start + j, x)
        call pencil%solve(x)
        call make_orthogonal(found%shape(:, :found%count), found%momentum(:, :found%count), x)
        call make_orthogonal(q(:, :j), p(:, :j), x)
      end if
      call normalise(pencil, x, q(:, j + 1), p(:, j + 1))
    end do
  end subroutine iterate

  !> Adds the modes of a basis that have converged in the interval, if these are all that are left.
  subroutine collect(pencil, shifts, diagonal, beside, basis, is_last, found)
    type(band_pencil_t), intent(in) :: pencil
    real(wp), intent(in) :: shifts(3)                !! the one of the inverse, and the ends of the interval [rad2/s2]
    real(wp), intent(in) :: diagonal(:), beside(:)   !! of the projected inverse, [vectors]
    real(wp), intent(in) :: basis(:, :)              !! [coordinates, vectors]
    logical, intent(in) :: is_last                   !! whether some are taken too
    type(interval_modes_t), intent(inout) :: found
    real(wp), parameter :: accuracy = 1.0e-12_wp     ! relative
    integer :: k, n
    logical :: has_failed, is_wanted(size(diagonal))
    real(wp) :: inverse(size(diagonal)), part(size(diagonal), size(diagonal)), s, x(size(basis, 1))

    n = size(diagonal)
    call tridiagonal_eigenvectors(diagonal, beside, inverse, part, has_failed)
    if (has_failed) return
    do k = 1, n
      is_wanted(k) = abs(inverse(k)) > 0 .and. beside(n) * abs(part(n, k)) <= accuracy * abs(inverse(k))
      if (.not. is_wanted(k)) cycle
      s = shifts(1) + 1.0_wp / inverse(k)
      is_wanted(k) = s > shifts(2) .and. s < shifts(3)
    end do
    if (count(is_wanted) < size(found%square) - found%count .and. .not. is_last) return
    do k = 1, n
      if (.not. is_wanted(k) .or. found%count == size(found%square)) cycle
      x = matmul(basis, part(:, k))
      call make_orthogonal(found%shape(:, :found%count), found%momentum(:, :found%count), x)
      found%count = found%count + 1
      associate (n => found%count)
        call normalise(pencil, x, found%shape(:, n), found%momentum(:, n))
        found%square(n) = sum(pencil%stiffness * pencil%twists_of(found%shape(:, n))**2)
      end associate
    end do
  end subroutine collect

  !> Some vector, different for every number.
  pure subroutine choose_start(number, x)
    integer, intent(in) :: number
    real(wp), intent(out) :: x(:)
    real(wp), parameter :: golden = 0.6180339887498949_wp
    integer :: i

    do i = 1, size(x)
      x(i) = modulo(golden * i * (i + 2 * number - 1), 1.0_wp) - 0.5_wp
    end do
  end subroutine choose_start

  !> Makes a vector orthogonal to others, with the masses.
  pure subroutine make_orthogonal(q, p, x)
    real(wp), contiguous, intent(in) :: q(:, :), p(:, :)   !! vectors, orthonormal, and M times them; [coordinates, vectors]
    real(wp), contiguous, intent(inout) :: x(:)            !! [coordinates]
    integer :: k, round

    do round = 1, 2   ! twice is enough
      do k = 1, size(q, 2)
        x = x - inner_product(p(:, k), x) * q(:, k)
      end do
    end do
  end subroutine make_orthogonal

  !> The inner product in partial sums, which fill a vector of the processor.
  pure real(wp) function inner_product(a, b)
    real(wp), contiguous, intent(in) :: a(:), b(:)
    integer, parameter :: lanes = 16
    integer :: i, whole
    real(wp) :: sums(lanes)

    whole = size(a) - modulo(size(a), lanes)
    sums = 0.0_wp
    do i = 1, whole, lanes
      sums = sums + a(i:i + lanes - 1) * b(i:i + lanes - 1)
    end do
    inner_product = sum(sums) + dot_product(a(whole + 1:), b(whole + 1:))
  end function inner_product

  pure subroutine normalise(pencil, x, q, p)
    type(band_pencil_t), intent(in) :: pencil
    real(wp), intent(in) :: x(:)          !! [coordinates]
    real(wp), intent(out) :: q(:), p(:)   !! with q^T M q = 1, and M q

    p = pencil%masses_times(x)
    associate (length => sqrt(max(dot_product(x, p), tiny(1.0_wp))))
      q = x / length
      p = p / length
    end associate
  end subroutine normalise

end module nocdyn_undamped_bands
