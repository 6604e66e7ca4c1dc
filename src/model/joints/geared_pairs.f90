!> Joints whose bodies are geared together.
module nocdyn_geared_pairs
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_element_rows, only: element_rows_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: has_other_ratio

contains

  !> Whether gears keep the speeds of the two bodies of an element in another ratio than 1, in the first lane. Locked, it would
  !> stop both.
  pure logical function has_other_ratio(coordinates, rows, element)
    type(coordinates_t), intent(in) :: coordinates
    type(element_rows_t), intent(in) :: rows   !! of the elements
    integer, intent(in) :: element
    real(wp), parameter :: rounding = 1.0e-10_wp
    real(wp) :: speed(size(coordinates%body), 2)   ! of both bodies, by the speeds of the coordinates
    integer :: body, i, k

    has_other_ratio = .false.
    if (rows%first(element + 1) - rows%first(element) /= 2) return
    speed = 0.0_wp
    do i = 1, 2
      body = rows%body(rows%first(element) - 1 + i)
      if (body == 0) return
      do k = coordinates%first(body), coordinates%first(body + 1) - 1
        speed(coordinates%coordinate(k), i) = coordinates%ratio(1, k)
      end do
    end do
    associate (a => speed(:, 1), b => speed(:, 2))
      has_other_ratio = norm2(sum(a * b) * a - sum(a**2) * b) <= rounding * sum(a**2) * norm2(b) .and. any(abs(a - b) > rounding)
    end associate
  end function has_other_ratio

end module nocdyn_geared_pairs
