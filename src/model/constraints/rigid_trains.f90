!> Rigid trains: bodies whose speeds rows of two bodies tie to one another, so that one of them, the lead, drives all.
!>
!> The rows that tie a train form a tree, and the ratio of every body to its lead is a product along its branch. A further
!> row of two bodies of a train either repeats what the rows of the tree say or contradicts them. Ratios are carried as
!> fraction and exponent, as those of a long reduction may leave the range of a real number.
module nocdyn_rigid_trains
  use nocdyn_constraints, only: constraints_t
  use nocdyn_kinds, only: wp
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: find_trains

  !> Two ratios agree, and a sum is zero, up to this times their size: decimals such as 0.1 * 3 against 0.3 agree.
  real(wp), parameter, public :: ratio_tolerance = 1.0e-9_wp

  integer, parameter, public :: max_exponent = 500   !! binary exponent up to which squares of ratios are real numbers

  type, public :: rigid_trains_t
    integer, allocatable :: order(:)         !! bodies, train by train, each behind its parent
    integer, allocatable :: position(:)         !! of each body in `order`
    integer, allocatable :: parent(:)        !! neighbour of each body towards the lead, 0 for the lead
    integer, allocatable :: parent_row(:)    !! the row that ties it to its parent, 0 for the lead
    integer, allocatable :: train(:)         !! of each body
    integer, allocatable :: root(:)          !! of each train
  contains
    procedure :: choose_roots
    procedure :: fastest_bodies
    procedure :: largest_exponents
    procedure :: ratios
    procedure :: is_inconsistent
    procedure :: find_path
    procedure :: is_loaded
    procedure, private :: scaled_ratios
  end type rigid_trains_t

contains

  !> The trains that the rows of two bodies tie, led by their first bodies and numbered in the order of those.
  subroutine find_trains(constraints, trains, is_tree)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(out) :: trains
    logical, allocatable, intent(out) :: is_tree(:)   !! whether a row belongs to a tree; later rows close loops, [rows]
    integer :: root(constraints%bodies), a, b, r

    allocate (is_tree(constraints%rows()), source=.false.)
    root = [(b, b=1, constraints%bodies)]
    do r = 1, constraints%rows()
      if (constraints%entries(r) /= 2) cycle
      call find_root(root, constraints%body(constraints%first(r)), a)
      call find_root(root, constraints%body(constraints%first(r) + 1), b)
      is_tree(r) = a /= b
      if (is_tree(r)) call join_components(a, b, root)
    end do
    call build_trees(constraints, is_tree, pack([(b, b=1, constraints%bodies)], root == [(b, b=1, constraints%bodies)]), trains)
  end subroutine find_trains

  !> The trees as seen from other leads, one of each train.
  subroutine choose_roots(self, constraints, roots)
    class(rigid_trains_t), intent(inout) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: roots(:)   !! [trains]
    logical :: is_tree(constraints%rows())
    integer :: b

    is_tree = .false.
    do b = 1, size(self%parent)
      if (self%parent(b) > 0) is_tree(self%parent_row(b)) = .true.
    end do
    call build_trees(constraints, is_tree, roots, self)
  end subroutine choose_roots

  !> Walks the trees from their leads outwards, breadth first.
  subroutine build_trees(constraints, is_tree, roots, trains)
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: is_tree(:)
    integer, intent(in) :: roots(:)                  !! one body of each train
    class(rigid_trains_t), intent(out) :: trains
    integer, allocatable :: first(:), rows(:)
    integer :: b, begin, k, next, other, r, t

    call constraints%list_body_rows(is_tree, first, rows)
    associate (n => constraints%bodies)
      allocate (trains%order(n), trains%position(n), trains%train(n))
      allocate (trains%parent(n), trains%parent_row(n), source=0)
    end associate
    allocate (trains%root, source=roots)
    next = 0
    do t = 1, size(roots)
      begin = next + 1
      next = begin
      trains%order(next) = roots(t)
      do while (begin <= next)
        b = trains%order(begin)
        trains%train(b) = t
        trains%position(b) = begin
        do k = first(b), first(b + 1) - 1
          r = rows(k)
          if (r == trains%parent_row(b)) cycle
          other = sum(constraints%body(constraints%first(r):constraints%first(r) + 1)) - b
          trains%parent(other) = b
          trains%parent_row(other) = r
          next = next + 1
          trains%order(next) = other
        end do
        begin = begin + 1
      end do
    end do
  end subroutine build_trees

  !> omega(body) = fraction * 2**exponent * omega(lead of its train), with 1/2 <= |fraction| < 1.
  subroutine scaled_ratios(self, constraints, lane, fractions, exponents)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: lane
    real(wp), intent(out) :: fractions(:)   !! [bodies]
    integer, intent(out) :: exponents(:)
    real(wp) :: own, other, quotient
    integer :: b, k

    do k = 1, size(self%order)
      b = self%order(k)
      fractions(b) = 0.5_wp
      exponents(b) = 1
      if (self%parent(b) == 0) cycle
      call constraints%pair_coefficients(lane, self%parent_row(b), b, own, other)
      quotient = -fraction(other) / fraction(own) * fractions(self%parent(b))
      fractions(b) = fraction(quotient)
      exponents(b) = exponents(self%parent(b)) + exponent(other) - exponent(own) + exponent(quotient)
    end do
  end subroutine scaled_ratios

  !> omega(body) / omega(lead of its train) of one lane, [bodies]; 0 where that is smaller than any real number.
  function ratios(self, constraints, lane) result(ratio)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: lane
    real(wp) :: ratio(constraints%bodies)
    integer :: exponents(constraints%bodies)

    call self%scaled_ratios(constraints, lane, ratio, exponents)
    ratio = scale(ratio, max(exponents, minexponent(1.0_wp) - digits(1.0_wp)))
  end function ratios

  !> The body of each train that turns fastest in the first lane; of several, the first.
  function fastest_bodies(self, constraints) result(fastest)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    integer :: fastest(size(self%root))
    real(wp) :: fractions(constraints%bodies)
    integer :: exponents(constraints%bodies), b

    call self%scaled_ratios(constraints, 1, fractions, exponents)
    fastest = 0
    do b = 1, constraints%bodies
      associate (best => fastest(self%train(b)))
        if (best == 0) then
          best = b
        else if (quotient_of(fractions, exponents, b, best) > 1.0_wp + ratio_tolerance) then
          best = b
        end if
      end associate
    end do
  end function fastest_bodies

  !> |omega(a)| / |omega(b)|, cut off where it is very large or small.
  pure real(wp) function quotient_of(fractions, exponents, a, b) result(quotient)
    real(wp), intent(in) :: fractions(:)
    integer, intent(in) :: exponents(:), a, b

    quotient = scale(abs(fractions(a) / fractions(b)), max(-max_exponent, min(max_exponent, exponents(a) - exponents(b))))
  end function quotient_of

  !> The largest binary exponent of a ratio to the lead, and the body that has it, for each train in the first lane.
  subroutine largest_exponents(self, constraints, largest, body)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(out) :: largest(:), body(:)   !! [trains]
    real(wp) :: fractions(constraints%bodies)
    integer :: exponents(constraints%bodies), b

    call self%scaled_ratios(constraints, 1, fractions, exponents)
    body = self%root
    largest = exponents(body)
    do b = 1, constraints%bodies
      associate (t => self%train(b))
        if (exponents(b) <= largest(t)) cycle
        largest(t) = exponents(b)
        body(t) = b
      end associate
    end do
  end subroutine largest_exponents

  !> Whether rows of two bodies of one train ask for other ratios than its tree, in the first lane, [rows].
  function is_inconsistent(self, constraints, rows) result(answer)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: rows(:)
    logical :: answer(size(rows))
    real(wp) :: fractions(constraints%bodies), quotient
    integer :: exponents(constraints%bodies), a, b, i, power

    call self%scaled_ratios(constraints, 1, fractions, exponents)
    do i = 1, size(rows)
      associate (first => constraints%first(rows(i)))
        a = constraints%body(first)
        b = constraints%body(first + 1)
        quotient = -fraction(constraints%coefficient(1, first + 1)) * fractions(b) &
                   / (fraction(constraints%coefficient(1, first)) * fractions(a))
        power = exponent(constraints%coefficient(1, first + 1)) + exponents(b) &
                - exponent(constraints%coefficient(1, first)) - exponents(a)
      end associate
      answer(i) = abs(scale(quotient, max(-3, min(3, power))) - 1.0_wp) > ratio_tolerance
    end do
  end function is_inconsistent

  !> The way through the tree from body a to body b of one train: bodies(i) and bodies(i + 1) are tied by rows(i).
  subroutine find_path(self, a, b, bodies, rows)
    class(rigid_trains_t), intent(in) :: self
    integer, intent(in) :: a, b
    integer, allocatable, intent(out) :: bodies(:), rows(:)
    integer :: from_a, from_b, i, j, meeting

    from_a = 0
    from_b = 0
    i = a
    j = b
    do while (i /= j)   ! a body has a later place than its parent
      if (self%position(i) > self%position(j)) then
        i = self%parent(i)
        from_a = from_a + 1
      else
        j = self%parent(j)
        from_b = from_b + 1
      end if
    end do
    meeting = i
    allocate (bodies(from_a + from_b + 1), rows(from_a + from_b))
    i = a
    do j = 1, from_a
      bodies(j) = i
      rows(j) = self%parent_row(i)
      i = self%parent(i)
    end do
    bodies(from_a + 1) = meeting
    i = b
    do j = size(rows), from_a + 1, -1
      bodies(j + 1) = i
      rows(j) = self%parent_row(i)
      i = self%parent(i)
    end do
  end subroutine find_path

  !> The rows of trees whose reactions, with those of the leads, hold moments on the bodies in balance, ascending: those
  !> where the moments, carried from body to parent, do not cancel. In the first lane.
  function is_loaded(self, constraints, moments) result(loaded)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    real(wp), intent(in) :: moments(:)   !! [bodies]
    logical :: loaded(constraints%rows())
    real(wp) :: moment(size(moments)), bound(size(moments))   ! carried to a body, and the sum of the absolute parts
    real(wp) :: lever, other, own
    integer :: b, k, parent

    moment = moments
    bound = abs(moments)
    loaded = .false.
    do k = size(self%order), 1, -1
      b = self%order(k)
      parent = self%parent(b)
      if (parent == 0 .or. abs(moment(b)) <= ratio_tolerance * bound(b)) cycle
      loaded(self%parent_row(b)) = .true.
      call constraints%pair_coefficients(1, self%parent_row(b), b, own, other)
      lever = other / own
      moment(parent) = moment(parent) - lever * moment(b)
      bound(parent) = bound(parent) + abs(lever) * bound(b)
    end do
  end function is_loaded

end module nocdyn_rigid_trains
