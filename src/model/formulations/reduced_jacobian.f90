!> The sparse Jacobian of the reduced formulation.
!>
!> With u' = U q' and q'' = R M, the derivative of q'' by q' is R diag(dM/du') U and the derivative by q is R diag(dM/du) U. Each
!> element adds a product response * ratio * dM at the position of every pair of its coordinates. These products response * ratio
!> and the positions are computed once, so the time to fill the Jacobian is linear in their number.
module nocdyn_reduced_jacobian
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_system, only: pattern_t
  implicit none (type, external)
  private

  public :: new_reduced_jacobian

  !> Order of the values: the blocks dq''/dq' and dq''/dq with the same pattern; the ones of dq/dt = q'; then, for each entry of
  !> each element with a work integral W, dW'/dq' and dW'/dq.
  type, public :: reduced_jacobian_t
    type(pattern_t) :: pattern
    integer, private :: freedoms = 0
    integer, private :: pairs = 0                        !! number of positions of dq''/dq'
    integer, allocatable, private :: element(:)          !! element of each product
    integer, allocatable, private :: position(:)         !! position of each product, 1 to pairs
    integer, allocatable, private :: response_entry(:)   !! entry of the response in each product
    integer, allocatable, private :: ratio_entry(:)      !! entry of the ratio in each product
    real(wp), allocatable, private :: product(:, :)      !! response * ratio, [lanes, products]
    integer, allocatable, private :: work_element(:)     !! element of each entry of a work integral
    real(wp), allocatable, private :: ratio(:, :)        !! ratio of these entries, [lanes, entries of work integrals]
  contains
    procedure :: fill
    procedure :: refresh_lane
    procedure :: list_parameters
  end type reduced_jacobian_t

contains

  !> The positions and products of a machine.
  function new_reduced_jacobian(freedoms, incidence, with_work, internal) result(self)
    integer, intent(in) :: freedoms   !! number of coordinates
    type(element_coordinates_t), intent(in) :: incidence   !! entries of all elements
    integer, intent(in) :: with_work(:)   !! elements with work integrals
    integer, intent(in) :: internal   !! number of internal states, which stand between the coordinates and the work integrals
    type(reduced_jacobian_t) :: self
    integer, allocatable :: row(:), column(:)
    integer :: c, e, products

    self%freedoms = freedoms
    products = product_count(incidence)
    allocate (self%element(products), self%position(products), self%response_entry(products), self%ratio_entry(products))
    allocate (row(products), column(products))
    allocate (self%product(size(incidence%ratio, 1), size(self%element)))
    call form_products(freedoms, incidence, row, column, self)
    row = row(:self%pairs)
    column = column(:self%pairs)
    self%pattern%row = [row, row, [(freedoms + c, c=1, freedoms)]]
    self%pattern%column = [column, freedoms + column, [(c, c=1, freedoms)]]
    call append_works(freedoms, incidence, with_work, 2 * freedoms + internal, self)
    self%work_element = [(spread(with_work(e), 1, incidence%first(with_work(e) + 1) - incidence%first(with_work(e))), &
                          e=1, size(with_work))]
  end function new_reduced_jacobian

  !> Number of pairs of entries of one element of which the second has a ratio.
  pure integer function product_count(incidence) result(products)
    type(element_coordinates_t), intent(in) :: incidence
    integer :: b, e

    products = 0
    do e = 1, size(incidence%first) - 1
      do b = incidence%first(e), incidence%first(e + 1) - 1
        if (incidence%has_ratio(b)) products = products + incidence%first(e + 1) - incidence%first(e)
      end do
    end do
  end function product_count

  !> Forms the products of these pairs, column by column, and their distinct positions.
  subroutine form_products(freedoms, incidence, row, column, self)
    integer, intent(in) :: freedoms
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(inout) :: row(:), column(:)   !! of each position
    type(reduced_jacobian_t), intent(inout) :: self
    integer :: element_of(size(incidence%coordinate)), order(size(incidence%coordinate)), first(freedoms + 1)
    integer :: position(freedoms)   ! position of each row in the present column, if not below `begin`
    integer :: a, b, begin, e, i, n, q

    element_of = incidence%entry_elements()
    call transposed_order(incidence%coordinate, freedoms, order, first)
    position = 0
    n = 0
    do q = 1, freedoms
      begin = self%pairs + 1
      do i = first(q), first(q + 1) - 1
        b = order(i)
        if (.not. incidence%has_ratio(b)) cycle
        e = element_of(b)
        do a = incidence%first(e), incidence%first(e + 1) - 1
          associate (at => position(incidence%coordinate(a)))
            if (at < begin) then
              self%pairs = self%pairs + 1
              at = self%pairs
              row(at) = incidence%coordinate(a)
              column(at) = q
            end if
            n = n + 1
            self%element(n) = e
            self%position(n) = at
            self%response_entry(n) = a
            self%ratio_entry(n) = b
            self%product(:, n) = incidence%response(:, a) * incidence%ratio(:, b)
          end associate
        end do
      end do
    end do
  end subroutine form_products

  !> Appends the positions of the work integrals: two for each entry of an element.
  subroutine append_works(freedoms, incidence, with_work, states, self)
    integer, intent(in) :: freedoms
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: with_work(:)   !! elements with work integrals
    integer, intent(in) :: states         !! number of states
    type(reduced_jacobian_t), intent(inout) :: self
    integer, allocatable :: row(:), column(:), entry(:)
    integer :: i, k, n

    n = sum(incidence%first(with_work + 1) - incidence%first(with_work))
    allocate (row(2 * n), column(2 * n), entry(n))
    n = 0
    do k = 1, size(with_work)
      do i = incidence%first(with_work(k)), incidence%first(with_work(k) + 1) - 1
        n = n + 1
        entry(n) = i
        row(2 * n - 1:2 * n) = states + k
        column(2 * n - 1) = incidence%coordinate(i)
        column(2 * n) = freedoms + incidence%coordinate(i)
      end do
    end do
    self%ratio = incidence%ratio(:, entry)
    self%pattern%row = [self%pattern%row, row]
    self%pattern%column = [self%pattern%column, column]
  end subroutine append_works

  !> Computes the values at the positions of `pattern`, from the elements after `differentiate`.
  subroutine fill(self, elements, dfdy)
    class(reduced_jacobian_t), intent(in) :: self
    type(elements_t), intent(in) :: elements
    real(wp), contiguous, intent(inout) :: dfdy(:, :)   !! [lanes, positions]
    integer :: at, e, l, n

    dfdy(:, :2 * self%pairs) = 0.0_wp
    dfdy(:, 2 * self%pairs + 1:2 * self%pairs + self%freedoms) = 1.0_wp
    do n = 1, size(self%element)
      e = self%element(n)
      at = self%position(n)
      do l = 1, size(dfdy, 1)
        dfdy(l, at) = dfdy(l, at) + self%product(l, n) * elements%applied_speed(l, e)
        dfdy(l, self%pairs + at) = dfdy(l, self%pairs + at) &
                                   + self%product(l, n) * (elements%restoring_angle(l, e) + elements%applied_angle(l, e))
      end do
    end do
    at = 2 * self%pairs + self%freedoms
    do n = 1, size(self%work_element)
      e = self%work_element(n)
      do l = 1, size(dfdy, 1)
        associate (speed => elements%speed(l, e), ratio => self%ratio(l, n))
          dfdy(l, at + 1) = ratio * (elements%applied(l, e) + speed * elements%applied_speed(l, e))
          dfdy(l, at + 2) = ratio * speed * elements%applied_angle(l, e)
        end associate
      end do
      at = at + 2
    end do
  end subroutine fill

  !> Updates the products of one lane.
  pure subroutine refresh_lane(self, lane, incidence)
    class(reduced_jacobian_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(element_coordinates_t), intent(in) :: incidence

    self%product(lane, :) = incidence%response(lane, self%response_entry) * incidence%ratio(lane, self%ratio_entry)
  end subroutine refresh_lane

  !> Registers the arrays whose values may differ from variant to variant.
  subroutine list_parameters(self, parameters)
    class(reduced_jacobian_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%element)
    call parameters%add_structure(self%position)
    call parameters%add_structure(self%work_element)
    call parameters%add_structure(self%pattern%row)
    call parameters%add_structure(self%pattern%column)
    call parameters%add('jacobian: product', self%product)
    call parameters%add('jacobian: ratio', self%ratio)
  end subroutine list_parameters

end module nocdyn_reduced_jacobian
