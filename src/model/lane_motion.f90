!> The accelerations of many lanes of a machine whose moments are polynomials or depend on the time alone: the same as those
!> of `sparse_map_t` and `polynomial_laws_t`, to the last bit, without what no lane has.
module nocdyn_lane_motion
  use nocdyn_kinds, only: wp
  use nocdyn_lane_terms, only: lane_terms_t
  use nocdyn_machine, only: machine_t
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_lane_motion

  type, public :: lane_motion_t
    private
    real(wp), allocatable :: angle(:), speed(:)   !! u - rest, u' of one element, [lanes]
    real(wp), allocatable :: moment(:, :)         !! [lanes, elements]
    real(wp), allocatable :: none(:, :)           !! for the restoring moments that external banks do not have
  contains
    procedure :: accelerate
  end type lane_motion_t

contains

  pure function new_lane_motion(lanes, elements) result(self)
    integer, intent(in) :: lanes, elements
    type(lane_motion_t) :: self

    allocate (self%angle(lanes), self%speed(lanes), self%moment(lanes, elements), self%none(lanes, elements), source=0.0_wp)
  end function new_lane_motion

  !> q'' = R M.
  subroutine accelerate(self, machine, terms, twists, accelerations, start_twist, t, speed, angle, acceleration)
    class(lane_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    type(sparse_map_t), intent(in) :: twists          !! U
    type(sparse_map_t), intent(in) :: accelerations   !! R
    real(wp), intent(in) :: start_twist(machine%lanes, size(terms%is_external))
    real(wp), intent(in) :: t(machine%lanes)
    real(wp), intent(in), dimension(machine%lanes, machine%coordinates%freedoms) :: speed, angle   !! q', q
    real(wp), intent(inout) :: acceleration(machine%lanes, machine%coordinates%freedoms)
    integer :: e, i

    associate (lanes => machine%lanes, freedoms => machine%coordinates%freedoms, laws => machine%laws)
      do e = 1, size(terms%is_external)
        if (terms%is_external(e)) then
          self%moment(:, e) = laws%constant(:, e)
          cycle
        end if
        associate (entries => size(twists%column), first => twists%first(e), last => twists%first(e + 1) - 1)
          if (terms%has_speed(e)) then
            call sum_speeds(lanes, freedoms, entries, first, last, twists%column, twists%coefficient, speed, self%speed)
          end if
          if (terms%has_angle(e)) then
            call sum_angles(lanes, freedoms, entries, first, last, twists%column, twists%coefficient, angle, &
                            start_twist(1, e), laws%rest(1, e), self%angle)
          end if
        end associate
        call find_working(lanes, terms%has_speed(e), terms%has_square(e), laws%constant(1, e), laws%by_speed(1, e), &
                          laws%by_speed_squared(1, e), self%speed, self%moment(1, e))
        if (terms%has_angle(e)) then
          call add_restoring(lanes, terms%has_cubic(e), laws%linear(1, e), laws%cubic(1, e), self%angle, self%moment(1, e))
        end if
      end do
      call add_external(self, machine, t)
      do i = 1, freedoms
        call sum_moments(lanes, size(terms%is_external), size(accelerations%column), accelerations%first(i), &
                         accelerations%first(i + 1) - 1, accelerations%column, accelerations%coefficient, self%moment, &
                         acceleration(1, i))
      end do
    end associate
  end subroutine accelerate

  !> The torques that depend on the time alone.
  subroutine add_external(self, machine, t)
    type(lane_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t(machine%lanes)
    integer :: i

    do i = 1, size(machine%other_banks)
      associate (bank => machine%banks(machine%other_banks(i))%bank)
        associate (first => bank%first)
          call bank%evaluate(t, machine%elements%angle(1, first), machine%elements%speed(1, first), &
                             self%none(1, first), self%moment(1, first))
        end associate
      end associate
    end do
  end subroutine add_external

  !> u' of an element, from the entries `first` to `last` of U.
  pure subroutine sum_speeds(lanes, freedoms, entries, first, last, column, ratio, q, v)
    integer, intent(in) :: lanes, freedoms, entries, first, last
    integer, intent(in) :: column(entries)
    real(wp), intent(in) :: ratio(lanes, entries), q(lanes, freedoms)
    real(wp), intent(inout) :: v(lanes)
    integer :: c, d, k

    select case (last - first)
    case (0)
      c = column(first)
      v = ratio(:, first) * q(:, c)
    case (1)
      c = column(first)
      d = column(last)
      v = ratio(:, first) * q(:, c) + ratio(:, last) * q(:, d)
    case default
      v = 0.0_wp
      do k = first, last
        c = column(k)
        v = v + ratio(:, k) * q(:, c)
      end do
    end select
  end subroutine sum_speeds

  !> u - rest of an element.
  pure subroutine sum_angles(lanes, freedoms, entries, first, last, column, ratio, q, start, rest, w)
    integer, intent(in) :: lanes, freedoms, entries, first, last
    integer, intent(in) :: column(entries)
    real(wp), intent(in) :: ratio(lanes, entries), q(lanes, freedoms), start(lanes), rest(lanes)
    real(wp), intent(inout) :: w(lanes)
    integer :: c, d, k

    select case (last - first)
    case (0)
      c = column(first)
      w = (start + ratio(:, first) * q(:, c)) - rest
    case (1)
      c = column(first)
      d = column(last)
      w = ((start + ratio(:, first) * q(:, c)) + ratio(:, last) * q(:, d)) - rest
    case default
      w = start
      do k = first, last
        c = column(k)
        w = w + ratio(:, k) * q(:, c)
      end do
      w = w - rest
    end select
  end subroutine sum_angles

  pure subroutine find_working(lanes, has_speed, has_square, constant, by_speed, by_speed_squared, v, moment)
    integer, intent(in) :: lanes
    logical, intent(in) :: has_speed, has_square
    real(wp), intent(in), dimension(lanes) :: constant, by_speed, by_speed_squared, v
    real(wp), intent(inout) :: moment(lanes)

    if (has_square) then
      moment = constant + (by_speed + by_speed_squared * v) * v
    else if (has_speed) then
      moment = constant + by_speed * v
    else
      moment = constant
    end if
  end subroutine find_working

  pure subroutine add_restoring(lanes, has_cubic, linear, cubic, w, moment)
    integer, intent(in) :: lanes
    logical, intent(in) :: has_cubic
    real(wp), intent(in), dimension(lanes) :: linear, cubic, w
    real(wp), intent(inout) :: moment(lanes)

    if (has_cubic) then
      moment = moment - (linear + cubic * w * w) * w
    else
      moment = moment - linear * w
    end if
  end subroutine add_restoring

  !> A row of R M, from the entries `first` to `last` of R.
  pure subroutine sum_moments(lanes, elements, entries, first, last, element, response, moment, acceleration)
    integer, intent(in) :: lanes, elements, entries, first, last
    integer, intent(in) :: element(entries)
    real(wp), intent(in) :: response(lanes, entries), moment(lanes, elements)
    real(wp), intent(inout) :: acceleration(lanes)
    integer :: a, b, c, k

    select case (last - first)
    case (1)
      a = element(first)
      b = element(last)
      acceleration = response(:, first) * moment(:, a) + response(:, last) * moment(:, b)
    case (2)
      a = element(first)
      b = element(first + 1)
      c = element(last)
      acceleration = response(:, first) * moment(:, a) + response(:, first + 1) * moment(:, b) + response(:, last) * moment(:, c)
    case default
      acceleration = 0.0_wp
      do k = first, last
        a = element(k)
        acceleration = acceleration + response(:, k) * moment(:, a)
      end do
    end select
  end subroutine sum_moments

end module nocdyn_lane_motion
