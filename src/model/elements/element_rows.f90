!> The rows along which elements act: u = sum of coefficient * phi(body), and the moment M acts on each of these bodies as
!> coefficient * M. Body 0 is the ground. An element between two bodies has the row (-1, 1).
module nocdyn_element_rows
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_element_rows, rows_between, joined_rows

  !> Element e has the entries first(e) to first(e + 1) - 1, at least one, each of another body.
  type, public :: element_rows_t
    integer, allocatable :: first(:)          !! [elements + 1]
    integer, allocatable :: body(:)           !! 0 = ground, [entries]
    real(wp), allocatable :: coefficient(:)   !! [entries]
  contains
    procedure :: count => row_count
    procedure :: last_body
    procedure :: combine
    procedure :: add_moment
    procedure :: add_product
    procedure :: add_coefficient
    procedure :: add_coefficients
  end type element_rows_t

contains

  !> The given rows.
  pure type(element_rows_t) function new_element_rows(first, body, coefficient) result(self)
    integer, intent(in) :: first(:)            !! first entry of each element, [elements + 1]
    integer, intent(in) :: body(:)             !! 0 = ground, [entries]
    real(wp), intent(in) :: coefficient(:)     !! [entries]

    allocate (self%first, source=first)
    allocate (self%body, source=body)
    allocate (self%coefficient, source=coefficient)
  end function new_element_rows

  !> The rows (-1, 1) of elements between two bodies.
  pure type(element_rows_t) function rows_between(from, to) result(self)
    integer, intent(in) :: from(:), to(:)   !! bodies, 0 = ground, [elements]
    integer :: e

    self = new_element_rows([(2 * e - 1, e=1, size(to) + 1)], [(from(e), to(e), e=1, size(to))], &
                            [(-1.0_wp, 1.0_wp, e=1, size(to))])
  end function rows_between

  !> The rows of both lists, one after the other.
  pure type(element_rows_t) function joined_rows(left, right) result(self)
    type(element_rows_t), intent(in) :: left, right

    self = new_element_rows([left%first, size(left%body) + right%first(2:)], [left%body, right%body], &
                            [left%coefficient, right%coefficient])
  end function joined_rows

  !> The number of elements.
  pure integer function row_count(self)
    class(element_rows_t), intent(in) :: self

    row_count = size(self%first) - 1
  end function row_count

  !> The last body of a row, the one that a motor, a load or an excitation turns.
  pure integer function last_body(self, element)
    class(element_rows_t), intent(in) :: self
    integer, intent(in) :: element

    last_body = self%body(self%first(element + 1) - 1)
  end function last_body

  !> The values u of all elements for the values of the bodies.
  pure subroutine combine(self, lanes, bodies, phi, u)
    class(element_rows_t), intent(in) :: self
    integer, intent(in) :: lanes, bodies
    real(wp), intent(in) :: phi(lanes, 0:bodies)                    !! of the ground and the bodies
    real(wp), intent(inout) :: u(lanes, size(self%first) - 1)
    real(wp) :: sum
    integer :: e, k, l

    if (lanes == 1) then   ! in the same bits, without loops of one turn
      do e = 1, size(self%first) - 1
        sum = self%coefficient(self%first(e)) * phi(1, self%body(self%first(e)))
        do k = self%first(e) + 1, self%first(e + 1) - 1
          sum = sum + self%coefficient(k) * phi(1, self%body(k))
        end do
        u(1, e) = sum
      end do
      return
    end if
    do e = 1, size(self%first) - 1
      do l = 1, lanes
        u(l, e) = self%coefficient(self%first(e)) * phi(l, self%body(self%first(e)))
      end do
      do k = self%first(e) + 1, self%first(e + 1) - 1
        do l = 1, lanes
          u(l, e) = u(l, e) + self%coefficient(k) * phi(l, self%body(k))
        end do
      end do
    end do
  end subroutine combine

  !> Adds the moment of an element on its bodies; nothing for the ground.
  pure subroutine add_moment(self, element, moment, vector)
    class(element_rows_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: moment         !! M [N m], or any derivative of it
    real(wp), intent(inout) :: vector(:)   !! [bodies]
    integer :: k

    do k = self%first(element), self%first(element + 1) - 1
      if (self%body(k) > 0) vector(self%body(k)) = vector(self%body(k)) + self%coefficient(k) * moment
    end do
  end subroutine add_moment

  !> Adds k c d^T with the rows c and d of two elements: the torques on the bodies where the moment of one grows with the motion
  !> of the other.
  pure subroutine add_product(self, element, by, factor, matrix)
    class(element_rows_t), intent(in) :: self
    integer, intent(in) :: element            !! whose moment
    integer, intent(in) :: by                 !! whose motion
    real(wp), intent(in) :: factor            !! k
    real(wp), intent(inout) :: matrix(:, :)   !! [bodies, bodies]
    integer :: i, j

    do j = self%first(by), self%first(by + 1) - 1
      do i = self%first(element), self%first(element + 1) - 1
        if (min(self%body(i), self%body(j)) == 0) cycle
        associate (entry => matrix(self%body(i), self%body(j)))
          entry = entry + self%coefficient(i) * self%coefficient(j) * factor
        end associate
      end do
    end do
  end subroutine add_product

  !> Adds the pattern of eq. (21), -k c c^T with the row c: -k on the diagonal and k beside it for an element between two bodies.
  pure subroutine add_coefficient(self, element, factor, matrix)
    class(element_rows_t), intent(in) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: factor            !! k
    real(wp), intent(inout) :: matrix(:, :)   !! [bodies, bodies]

    call self%add_product(element, element, -factor, matrix)
  end subroutine add_coefficient

  !> Adds the pattern of eq. (21) for all elements, with k = common * factor.
  pure subroutine add_coefficients(self, common, factor, matrix)
    class(element_rows_t), intent(in) :: self
    real(wp), intent(in) :: common            !! of all elements
    real(wp), intent(in) :: factor(:)         !! [elements]
    real(wp), intent(inout) :: matrix(:, :)   !! [bodies, bodies]
    integer :: e

    do e = 1, size(factor)
      call self%add_coefficient(e, common * factor(e), matrix)
    end do
  end subroutine add_coefficients

end module nocdyn_element_rows
