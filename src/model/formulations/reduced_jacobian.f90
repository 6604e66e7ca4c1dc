!> The sparse Jacobian of the reduced formulation.
!>
!> With u' = U q' and q'' = R M, the derivative of q'' by q' is R diag(dM/du') U and the derivative by q is R diag(dM/du) U. Each
!> element adds a product response * ratio * dM at the position of every pair of its coordinates. These products response * ratio
!> and the positions are computed once, so the time to fill the Jacobian is linear in their number.
!>
!> Where the moment of an element depends on the motion of another, which is its phase, the products are of the response of the
!> one and the ratio of the other.
!>
!> An internal state z of an element with the speed u' = U q' has the rate r(u', z). The moment M(z) of the element acts on
!> q'' = R M and on its work integral, W' = M u'.
module nocdyn_reduced_jacobian
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_elements, only: cross_pairs_t, element_values_t, elements_t, internal_states_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: new_reduced_jacobian

  !> Order of the values: the blocks dq''/dq' and dq''/dq with the same pattern; the ones of dq/dt = q'; then, for each coordinate
  !> of each element with a work integral W, dW'/dq' and dW'/dq. Then, for each internal state: for each entry of its element
  !> dq''/dz and, if the entry has a ratio, dr/dq'; dr/dz of each internal state of that element; dW'/dz if the element has a
  !> work integral.
  type, public :: reduced_jacobian_t
    type(pattern_t) :: pattern
    integer, private :: freedoms = 0
    integer, private :: pairs = 0                        !! number of positions of dq''/dq'
    integer, allocatable, private :: element(:)          !! element of each product
    integer, allocatable, private :: position(:)         !! position of each product, 1 to pairs
    integer, allocatable, private :: response_entry(:)   !! entry of the response in each product
    integer, allocatable, private :: ratio_entry(:)      !! entry of the ratio in each product
    real(wp), allocatable, private :: product(:, :)      !! response * ratio, [lanes, products]
    integer, allocatable, private :: pair(:)             !! of `cross_pairs_t`, 0 for the own motion
    integer, private :: works = 0                        !! number of positions of dW'/dq'
    integer, allocatable, private :: work_position(:)    !! of each part of a dW'/dq', 1 to works
    integer, allocatable, private :: work_element(:)     !! its element
    integer, allocatable, private :: work_pair(:)        !! its pair, 0 for the own motion
    real(wp), allocatable, private :: ratio(:, :)        !! ratio of the moving element, [lanes, parts]
    type(element_coordinates_t), private :: incidence       !! entries of the element of each internal state
    logical, allocatable, private :: has_work_integral(:)   !! of the element of each internal state
  contains
    procedure :: fill, refresh_lane, pass_parameters
  end type reduced_jacobian_t

contains

  !> The positions and products of a machine.
  function new_reduced_jacobian(freedoms, incidence, with_work, elements) result(self)
    integer, intent(in) :: freedoms   !! number of coordinates
    type(element_coordinates_t), intent(in) :: incidence   !! entries of all elements
    integer, intent(in) :: with_work(:)   !! elements with work integrals
    type(elements_t), intent(in) :: elements   !! whose internal states stand between the coordinates and the work integrals
    type(reduced_jacobian_t) :: self
    integer, allocatable :: row(:), column(:), work(:), work_column(:)   ! `work` is the number of a work integral
    integer :: c, products, b, e, element_of(size(incidence%coordinate)), pair, begin, i, k, n
    integer, allocatable :: entry(:)   ! of each part
    integer :: position(freedoms)   ! position of each coordinate in the present work integral, if not below `begin`

    self%freedoms = freedoms
    ! the number of products
    element_of = incidence%entry_elements()
    products = 0
    do b = 1, size(element_of)
      if (.not. incidence%has_ratio(b)) cycle
      do pair = 0, elements%cross%count
        e = elements%cross%moved(pair, element_of(b))
        if (e > 0) products = products + incidence%first(e + 1) - incidence%first(e)
      end do
    end do
    allocate (self%element(products), self%pair(products), self%position(products), row(products), column(products))
    allocate (self%response_entry(products), self%ratio_entry(products))
    call form_products(freedoms, incidence, elements%cross, row, column, self)
    row = row(:self%pairs)
    column = column(:self%pairs)
    allocate (self%product, source=incidence%response(:, self%response_entry) * incidence%ratio(:, self%ratio_entry))
    ! The parts of the derivatives of the work integrals: each coordinate of an element, and the coordinates of others on which
    ! its moment depends.
    n = sum(incidence%first(with_work + 1) - incidence%first(with_work)) &
        + sum(incidence%first(elements%cross%by + 1) - incidence%first(elements%cross%by))   ! at most
    allocate (self%work_position(n), self%work_element(n), self%work_pair(n), entry(n), work(n), work_column(n))
    position = 0
    n = 0
    do i = 1, size(with_work)
      begin = self%works + 1
      do pair = 0, elements%cross%count
        e = elements%cross%mover(pair, with_work(i))
        if (e == 0) cycle
        do k = incidence%first(e), incidence%first(e + 1) - 1
          call find_position(i, incidence%coordinate(k), begin, position(incidence%coordinate(k)), self%works, work, work_column)
          n = n + 1
          entry(n) = k
          self%work_position(n) = position(incidence%coordinate(k))
          self%work_element(n) = with_work(i)
          self%work_pair(n) = pair
        end do
      end do
    end do
    self%work_position = self%work_position(:n)
    self%work_element = self%work_element(:n)
    self%work_pair = self%work_pair(:n)
    self%ratio = incidence%ratio(:, entry(:n))
    self%pattern%row = [row, row, (freedoms + c, c=1, freedoms), &
                        (2 * freedoms + elements%internal%count + work((c + 1) / 2), c=1, 2 * self%works)]
    self%pattern%column = [column, freedoms + column, (c, c=1, freedoms), &
                           (work_column(c), freedoms + work_column(c), c=1, self%works)]
    call append_internal(freedoms, incidence, with_work, elements%internal, self)
  end function new_reduced_jacobian

  !> Forms the products of these pairs, column by column, and their distinct positions.
  subroutine form_products(freedoms, incidence, cross, row, column, self)
    integer, intent(in) :: freedoms
    type(element_coordinates_t), intent(in) :: incidence
    type(cross_pairs_t), intent(in) :: cross
    integer, intent(inout) :: row(:), column(:)   !! of each position
    type(reduced_jacobian_t), intent(inout) :: self
    integer :: order(size(incidence%coordinate)), element_of(size(incidence%coordinate)), first(freedoms + 1)
    integer :: position(freedoms)   ! position of each row in the present column, if not below `begin`
    integer :: a, b, begin, e, i, n, pair, q

    call transposed_order(incidence%coordinate, freedoms, order, first)
    element_of = incidence%entry_elements()
    position = 0
    n = 0
    do q = 1, freedoms
      begin = self%pairs + 1
      do i = first(q), first(q + 1) - 1
        b = order(i)
        if (.not. incidence%has_ratio(b)) cycle
        do pair = 0, cross%count
          e = cross%moved(pair, element_of(b))
          if (e == 0) cycle
          do a = incidence%first(e), incidence%first(e + 1) - 1
            call find_position(incidence%coordinate(a), q, begin, position(incidence%coordinate(a)), self%pairs, row, column)
            n = n + 1
            self%element(n) = e
            self%pair(n) = pair
            self%position(n) = position(incidence%coordinate(a))
            self%response_entry(n) = a
            self%ratio_entry(n) = b
          end do
        end do
      end do
    end do
  end subroutine form_products

  !> The position of a row in the present column, if it is not below `begin`; else the next one.
  pure subroutine find_position(row_of, column_of, begin, position, last, row, column)
    integer, intent(in) :: row_of, column_of, begin
    integer, intent(inout) :: position, last      !! of them, last is the number
    integer, intent(inout) :: row(:), column(:)   !! of each position

    if (position >= begin) return
    last = last + 1
    position = last
    row(position) = row_of
    column(position) = column_of
  end subroutine find_position

  subroutine append_internal(freedoms, incidence, with_work, internal, self)
    integer, intent(in) :: freedoms
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: with_work(:)   !! elements with work integrals
    type(internal_states_t), intent(in) :: internal
    type(reduced_jacobian_t), intent(inout) :: self
    type(pattern_t) :: added
    integer :: i, next, s, work(size(incidence%first) - 1)   ! number of the work integral of each element, or 0

    work = 0
    work(with_work) = [(i, i=1, size(with_work))]
    self%incidence = incidence%selected(internal%element, with_ratio_only=.false.)
    self%has_work_integral = work(internal%element) > 0
    next = size(self%incidence%coordinate) + sum(internal%members) + count(self%has_work_integral) &
           + count([(self%incidence%has_ratio(i), i=1, size(self%incidence%coordinate))])
    allocate (added%row(next), added%column(next))
    next = 1
    do s = 1, internal%count
      do i = self%incidence%first(s), self%incidence%first(s + 1) - 1
        call add_position(self%incidence%coordinate(i), 2 * freedoms + s, added, next)
        if (self%incidence%has_ratio(i)) call add_position(2 * freedoms + s, self%incidence%coordinate(i), added, next)
      end do
      do i = 0, internal%members(s) - 1
        call add_position(2 * freedoms + s, 2 * freedoms + internal%first(s) + i, added, next)
      end do
      if (self%has_work_integral(s)) then
        call add_position(2 * freedoms + internal%count + work(internal%element(s)), 2 * freedoms + s, added, next)
      end if
    end do
    self%pattern%row = [self%pattern%row, added%row]
    self%pattern%column = [self%pattern%column, added%column]
  end subroutine append_internal

  subroutine add_position(row, column, pattern, next)
    integer, intent(in) :: row, column
    type(pattern_t), intent(inout) :: pattern
    integer, intent(inout) :: next   !! index of the position; increased by one

    pattern%row(next) = row
    pattern%column(next) = column
    next = next + 1
  end subroutine add_position

  !> Computes the values at the positions of `pattern`, from the elements after `differentiate`.
  subroutine fill(self, states, elements, dfdy)
    class(reduced_jacobian_t), intent(in) :: self
    type(internal_states_t), intent(in) :: states   !! of the machine
    type(element_values_t), intent(in) :: elements
    real(wp), contiguous, intent(inout) :: dfdy(:, :)   !! [lanes, positions]
    integer :: at, e, i, j, l, n, s

    dfdy(:, :2 * self%pairs) = 0.0_wp
    dfdy(:, 2 * self%pairs + 1:2 * self%pairs + self%freedoms) = 1.0_wp
    do n = 1, size(self%element)
      e = self%element(n)
      at = self%position(n)
      if (self%pair(n) > 0) then
        associate (cross => elements%cross, pair => self%pair(n), by_speed => dfdy(:, at), by_angle => dfdy(:, self%pairs + at))
          by_speed = by_speed + self%product(:, n) * cross%applied_speed(:, pair)
          by_angle = by_angle + self%product(:, n) * (cross%restoring_angle(:, pair) + cross%applied_angle(:, pair))
        end associate
        cycle
      end if
      do l = 1, size(dfdy, 1)
        dfdy(l, at) = dfdy(l, at) + self%product(l, n) * elements%applied_speed(l, e)
        dfdy(l, self%pairs + at) = dfdy(l, self%pairs + at) &
                                   + self%product(l, n) * (elements%restoring_angle(l, e) + elements%applied_angle(l, e))
      end do
    end do
    at = 2 * self%pairs + self%freedoms
    call fill_works(self, elements, dfdy(:, at + 1:at + 2 * self%works))
    at = at + 2 * self%works
    if (states%count > 0) then
      j = at
      associate (internal => elements%internal, incidence => self%incidence)
        do s = 1, states%count
          do i = incidence%first(s), incidence%first(s + 1) - 1
            j = j + 1
            dfdy(:, j) = incidence%response(:, i) * internal%applied(:, s)
            if (.not. incidence%has_ratio(i)) cycle
            j = j + 1
            dfdy(:, j) = incidence%ratio(:, i) * internal%rate_speed(:, s)
          end do
          do i = 1, states%members(s)
            dfdy(:, j + i) = internal%rate_internal(:, i, s)
          end do
          j = j + states%members(s)
          if (.not. self%has_work_integral(s)) cycle
          j = j + 1
          dfdy(:, j) = elements%speed(:, states%element(s)) * internal%applied(:, s)
        end do
      end associate
    end if
  end subroutine fill

  !> dW'/dq' and dW'/dq of W' = M u'.
  subroutine fill_works(self, elements, values)
    class(reduced_jacobian_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements
    real(wp), contiguous, intent(inout) :: values(:, :)   !! [lanes, 2 * positions]
    integer :: e, l, n

    values(:, :) = 0.0_wp
    do n = 1, size(self%work_element)
      e = self%work_element(n)
      associate (by_speed => values(:, 2 * self%work_position(n) - 1), by_angle => values(:, 2 * self%work_position(n)), &
                 ratio => self%ratio(:, n), pair => self%work_pair(n), cross => elements%cross)
        if (pair > 0) then
          by_speed = by_speed + ratio * (elements%speed(:, e) * cross%applied_speed(:, pair))
          by_angle = by_angle + ratio * elements%speed(:, e) * cross%applied_angle(:, pair)
          cycle
        end if
        do l = 1, size(values, 1)
          by_speed(l) = by_speed(l) + ratio(l) * (elements%applied(l, e) + elements%speed(l, e) * elements%applied_speed(l, e))
          by_angle(l) = by_angle(l) + ratio(l) * elements%speed(l, e) * elements%applied_angle(l, e)
        end do
      end associate
    end do
  end subroutine fill_works

  !> Updates the products and responses of one lane.
  pure subroutine refresh_lane(self, lane, incidence)
    class(reduced_jacobian_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(element_coordinates_t), intent(in) :: incidence

    call self%incidence%refresh_selected(lane, incidence)
    self%product(lane, :) = incidence%response(lane, self%response_entry) * incidence%ratio(lane, self%ratio_entry)
  end subroutine refresh_lane

  !> Passes the arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(reduced_jacobian_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%element, self%position, self%work_element, self%pattern%row, self%pattern%column)
    call parameters%add('jacobian: product', self%product)
    call parameters%add('jacobian: ratio', self%ratio)
    call self%incidence%pass_parameters(parameters)
  end subroutine pass_parameters

end module nocdyn_reduced_jacobian
