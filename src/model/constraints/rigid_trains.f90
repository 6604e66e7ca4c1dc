!> Rigid trains: bodies that rows of two bodies join, so that the speed of one of them, the root, gives all others.
!>
!> The rows that join a train form a tree. The ratio of a body to the root is the product of the ratios along its path. A further
!> row between two bodies of a train is either redundant or inconsistent. Ratios are stored as fraction and exponent, as
!> the ratio of a long reduction may exceed the range of real numbers.
module nocdyn_rigid_trains
  use nocdyn_constraints, only: constraints_t
  use nocdyn_kinds, only: wp
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: find_trains

  !> Relative tolerance for the agreement of two ratios and for sums that are zero: decimals such as 0.1 * 3 and 0.3 agree.
  real(wp), parameter, public :: ratio_tolerance = 1.0e-9_wp

  integer, parameter, public :: most_names = 12   !! of bodies or rows in a message of this room

  integer, parameter, public :: max_exponent = 332   !! up to 2^332, squares of ratios times inertias do not overflow

  !> The trees of all rigid trains of a machine.
  type, public :: rigid_trains_t
    integer, allocatable :: order(:)        !! bodies, train by train, each behind its parent
    integer, allocatable :: position(:)     !! position of each body in `order`
    integer, allocatable :: parent(:)       !! neighbour of each body towards the root, 0 for the root
    integer, allocatable :: parent_row(:)   !! row between a body and its parent, 0 for the root
    integer, allocatable :: train(:)        !! train of each body
    integer, allocatable :: root(:)         !! root of each train
  contains
    procedure :: choose_roots
    procedure :: fastest_bodies
    procedure :: largest_exponents
    procedure :: ratios
    procedure :: first_contradiction
    procedure :: find_path
    procedure :: is_loaded
    procedure, private :: scaled_ratios
  end type rigid_trains_t

contains

  !> The trains that the rows of two bodies join. Their roots are their first bodies, in whose order they are numbered.
  subroutine find_trains(constraints, trains, is_tree)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(out) :: trains
    logical, allocatable, intent(out) :: is_tree(:)   !! whether a row belongs to a tree, [rows]; later rows close loops
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

  !> Makes other bodies the roots of the trees.
  subroutine choose_roots(self, constraints, roots)
    class(rigid_trains_t), intent(inout) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: roots(:)   !! one body of each train
    logical :: is_tree(constraints%rows())
    integer :: b

    is_tree = .false.
    do b = 1, size(self%parent)
      if (self%parent(b) > 0) is_tree(self%parent_row(b)) = .true.
    end do
    call build_trees(constraints, is_tree, roots, self)
  end subroutine choose_roots

  !> Builds the trees from their roots outwards, breadth first.
  subroutine build_trees(constraints, is_tree, roots, trains)
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: is_tree(:)
    integer, intent(in) :: roots(:)   !! one body of each train
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

  !> omega(body) = fraction * 2**exponent * omega(root of its train), with 1/2 <= |fraction| < 1.
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

  !> omega(body) / omega(root of its train) of one lane, [bodies]; 0 where it underflows.
  function ratios(self, constraints, lane) result(ratio)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: lane
    real(wp) :: ratio(constraints%bodies)
    integer :: exponents(constraints%bodies)

    call self%scaled_ratios(constraints, lane, ratio, exponents)
    ratio = scale(ratio, max(exponents, minexponent(1.0_wp) - digits(1.0_wp)))
  end function ratios

  !> The fastest body of each train in the first lane; the first one of several.
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
        else if (scale(abs(fractions(b) / fractions(best)), &
                       max(-max_exponent, min(max_exponent, exponents(b) - exponents(best)))) > 1.0_wp + ratio_tolerance) then
          best = b
        end if
      end associate
    end do
  end function fastest_bodies

  !> The largest binary exponent of a ratio to the root in each train, and the body that has it, in the first lane.
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

  !> The first row of two bodies that closes a loop with another ratio than the rows before it, in the first lane; 0 if there is
  !> none.
  integer function first_contradiction(self, constraints, is_tree) result(row)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: is_tree(:)   !! [rows]
    real(wp) :: fractions(constraints%bodies), quotient
    integer :: exponents(constraints%bodies), a, b, power

    call self%scaled_ratios(constraints, 1, fractions, exponents)
    do row = 1, constraints%rows()
      if (constraints%entries(row) /= 2 .or. is_tree(row)) cycle
      associate (first => constraints%first(row))
        a = constraints%body(first)
        b = constraints%body(first + 1)
        quotient = -fraction(constraints%coefficient(1, first + 1)) * fractions(b) &
                   / (fraction(constraints%coefficient(1, first)) * fractions(a))
        power = exponent(constraints%coefficient(1, first + 1)) + exponents(b) &
                - exponent(constraints%coefficient(1, first)) - exponents(a)
      end associate
      if (abs(scale(quotient, max(-3, min(3, power))) - 1.0_wp) > ratio_tolerance) return
    end do
    row = 0
  end function first_contradiction

  !> The path through the tree from body a to body b of one train: rows(i) is between bodies(i) and bodies(i + 1).
  subroutine find_path(self, a, b, bodies, rows)
    class(rigid_trains_t), intent(in) :: self
    integer, intent(in) :: a, b
    integer, allocatable, intent(out) :: bodies(:), rows(:)
    integer, dimension(size(self%parent)) :: path, path_rows   ! from a forwards, from b backwards
    integer :: head, i, j, tail

    i = a
    j = b
    head = 0
    tail = size(path) + 1
    do while (i /= j)   ! a body has a later position than its parent
      if (self%position(i) > self%position(j)) then
        head = head + 1
        path(head) = i
        path_rows(head) = self%parent_row(i)
        i = self%parent(i)
      else
        tail = tail - 1
        path(tail) = j
        path_rows(tail) = self%parent_row(j)
        j = self%parent(j)
      end if
    end do
    bodies = [path(:head), i, path(tail:)]
    rows = [path_rows(:head), path_rows(tail:)]
  end subroutine find_path

  !> Which tree rows carry load when their reactions, and torques on the roots, balance moments on the bodies, [rows].
  !> A row does if the moments of all bodies behind it, transmitted from body to parent, do not cancel. In the first lane.
  function is_loaded(self, constraints, moments) result(loaded)
    class(rigid_trains_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    real(wp), intent(in) :: moments(:)   !! [N m], [bodies]
    logical :: loaded(constraints%rows())
    real(wp) :: moment(size(moments)), bound(size(moments))   ! transmitted to a body, and the sum of the absolute terms
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
