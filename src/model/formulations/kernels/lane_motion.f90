!> Accelerations of a block of many lanes, for machines whose laws are polynomials or depend on the time alone.
!>
!> The results have the same bits as those of `sparse_map_t` and `polynomial_laws_t`. Terms that no lane has are left out.
!> Torques that depend on the time alone are kept while the times stay, as in the last two stages of a Runge-Kutta step.
!>
!> The procedures have up to 12 arguments. Their arrays have explicit shapes and are no components of types: gfortran then knows
!> that they are contiguous and vectorises every loop over a strip.
module nocdyn_lane_motion
  use nocdyn_kinds, only: wp
  use nocdyn_lane_terms, only: lane_terms_t
  use nocdyn_machine, only: machine_t
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_lane_motion

  integer, parameter, public :: motion_strip = 32   !! lanes that are computed together; the lanes of a block must be a multiple
  integer, parameter :: strip = motion_strip

  !> Work space, and the kept torques that depend on the time alone.
  type, public :: lane_motion_t
    private
    real(wp), allocatable :: angle(:), speed(:)   !! u - rest [rad], u' [rad/s] of one element, [strip]
    real(wp), allocatable :: moment(:, :)         !! [N m], [lanes, elements]; values of the time-only elements hold at `time`
    real(wp), allocatable :: time(:)              !! [s], [lanes]
    real(wp), allocatable :: zeros(:, :)          !! for the restoring moments that time-only banks do not have, [lanes, elements]
  contains
    procedure :: invalidate
    procedure :: accelerate
  end type lane_motion_t

  real(wp), parameter :: no_time = -huge(1.0_wp)

contains

  !> Work space for a block.
  pure function new_lane_motion(lanes, elements) result(self)
    integer, intent(in) :: lanes, elements
    type(lane_motion_t) :: self

    allocate (self%moment(lanes, elements), self%zeros(lanes, elements), self%angle(strip), self%speed(strip), source=0.0_wp)
    allocate (self%time(lanes), source=no_time)
  end function new_lane_motion

  !> Marks the kept torques of a lane as out of date, after its parameters have changed.
  pure subroutine invalidate(self, lane)
    class(lane_motion_t), intent(inout) :: self
    integer, intent(in) :: lane

    self%time(lane) = no_time
  end subroutine invalidate

  !> Computes q'' = R M.
  subroutine accelerate(self, machine, terms, twists, accelerations, start_twist, t, speed, angle, acceleration)
    class(lane_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    type(sparse_map_t), intent(in) :: twists                                                       !! U
    type(sparse_map_t), intent(in) :: accelerations                                                !! R
    real(wp), intent(in) :: start_twist(machine%lanes, size(terms%is_time_only))                   !! [rad]
    real(wp), intent(in) :: t(machine%lanes)                                                       !! [s]
    real(wp), intent(in), dimension(machine%lanes, machine%coordinates%freedoms) :: speed, angle   !! q' [rad/s], q [rad]
    real(wp), intent(inout) :: acceleration(machine%lanes, machine%coordinates%freedoms)           !! q'' [rad/s2]
    integer :: at

    if (time_differs(machine%lanes, t, self%time)) call evaluate_external(self, machine, terms, t)
    do at = 1, machine%lanes, strip
      call find_moments(self, machine, terms, twists, start_twist, at, machine%lanes, machine%coordinates%freedoms, speed, angle)
      call sum_moments(machine%lanes, at, size(terms%is_time_only), machine%coordinates%freedoms, size(accelerations%column), &
                       accelerations%first, accelerations%column, accelerations%coefficient, self%moment, acceleration)
    end do
  end subroutine accelerate

  !> Moments of the elements that do not depend on the time alone, in the lanes `at` to `at + strip - 1`.
  pure subroutine find_moments(self, machine, terms, twists, start_twist, at, lanes, freedoms, speed, angle)
    type(lane_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    type(sparse_map_t), intent(in) :: twists   !! U
    integer, intent(in) :: at, lanes, freedoms
    real(wp), intent(in) :: start_twist(lanes, size(terms%is_time_only))   !! [rad]
    real(wp), intent(in), dimension(lanes, freedoms) :: speed, angle       !! q', q
    integer :: e

    associate (laws => machine%laws, entries => size(twists%column), column => twists%column, ratio => twists%coefficient)
      do e = 1, size(terms%is_time_only)
        if (terms%is_time_only(e)) cycle
        associate (first => twists%first(e), last => twists%first(e + 1) - 1)
          if (terms%has_speed(e)) then
            call sum_speeds(lanes, at, freedoms, entries, first, last, column, ratio, speed, self%speed)
            call find_applied(terms%has_square(e), laws%constant(at, e), laws%by_speed(at, e), laws%by_speed_squared(at, e), &
                              self%speed, self%moment(at, e))
          else
            self%moment(at:at + strip - 1, e) = laws%constant(at:at + strip - 1, e)
          end if
          if (terms%has_angle(e)) then
            call sum_angles(lanes, at, freedoms, entries, first, last, column, ratio, angle, start_twist(at, e), &
                            laws%rest(at, e), self%angle)
            call add_restoring(terms%has_cubic(e), laws%linear(at, e), laws%cubic(at, e), self%angle, self%moment(at, e))
          end if
        end associate
      end do
    end associate
  end subroutine find_moments

  !> Whether the time of any lane has changed.
  pure logical function time_differs(lanes, t, time)
    integer, intent(in) :: lanes
    real(wp), intent(in) :: t(lanes), time(lanes)   !! [s], present and kept times
    real(wp) :: largest(strip), part(strip / 4)
    integer :: before, l

    time_differs = abs(t(1) - time(1)) > 0
    if (time_differs) return
    largest = 0.0_wp
    do before = 0, lanes - 1, strip
      do l = 1, strip
        largest(l) = max(largest(l), abs(t(before + l) - time(before + l)))
      end do
    end do
    do l = 1, strip / 4
      part(l) = max(max(largest(l), largest(l + 8)), max(largest(l + 16), largest(l + 24)))
    end do
    time_differs = max(max(max(part(1), part(2)), max(part(3), part(4))), max(max(part(5), part(6)), max(part(7), part(8)))) > 0
  end function time_differs

  !> Evaluates the torques that depend on the time alone.
  subroutine evaluate_external(self, machine, terms, t)
    type(lane_motion_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    real(wp), intent(in) :: t(machine%lanes)   !! [s]
    integer :: e, i

    self%time(:) = t
    do e = 1, size(terms%is_time_only)
      if (terms%is_time_only(e)) self%moment(:, e) = machine%laws%constant(:, e)
    end do
    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank)
        associate (first => bank%first)
          call bank%evaluate(t, machine%elements%angle(1, first), machine%elements%speed(1, first), &
                             self%zeros(1, first), self%moment(1, first))
        end associate
      end associate
    end do
  end subroutine evaluate_external

  !> Computes u' of an element, from the entries `first` to `last` of U.
  pure subroutine sum_speeds(lanes, at, freedoms, entries, first, last, column, ratio, q, v)
    integer, intent(in) :: lanes, at, freedoms, entries, first, last
    integer, intent(in) :: column(entries)                              !! of the entries of U
    real(wp), intent(in) :: ratio(lanes, entries), q(lanes, freedoms)   !! of the entries of U; q'
    real(wp), intent(inout) :: v(strip)                                 !! u' of the lanes of the strip
    integer :: b, c, d, k

    b = at + strip - 1
    select case (last - first)
    case (0)
      c = column(first)
      v = ratio(at:b, first) * q(at:b, c)
    case (1)
      c = column(first)
      d = column(last)
      v = ratio(at:b, first) * q(at:b, c) + ratio(at:b, last) * q(at:b, d)
    case default
      v = 0.0_wp
      do k = first, last
        c = column(k)
        v = v + ratio(at:b, k) * q(at:b, c)
      end do
    end select
  end subroutine sum_speeds

  !> Computes u - rest of an element, from the entries `first` to `last` of U.
  pure subroutine sum_angles(lanes, at, freedoms, entries, first, last, column, ratio, q, start, rest, w)
    integer, intent(in) :: lanes, at, freedoms, entries, first, last
    integer, intent(in) :: column(entries)                              !! of the entries of U
    real(wp), intent(in) :: ratio(lanes, entries), q(lanes, freedoms)   !! of the entries of U; q
    real(wp), intent(in) :: start(strip), rest(strip)                   !! start twist and rest angle [rad]
    real(wp), intent(inout) :: w(strip)                                 !! u - rest of the lanes of the strip
    integer :: b, c, d, k

    b = at + strip - 1
    select case (last - first)
    case (0)
      c = column(first)
      w = (start + ratio(at:b, first) * q(at:b, c)) - rest
    case (1)
      c = column(first)
      d = column(last)
      w = ((start + ratio(at:b, first) * q(at:b, c)) + ratio(at:b, last) * q(at:b, d)) - rest
    case default
      w = start
      do k = first, last
        c = column(k)
        w = w + ratio(at:b, k) * q(at:b, c)
      end do
      w = w - rest
    end select
  end subroutine sum_angles

  !> Moment of the terms that depend on the speed v, and of the constant.
  pure subroutine find_applied(has_square, constant, by_speed, by_speed_squared, v, moment)
    logical, intent(in) :: has_square
    real(wp), intent(in), dimension(strip) :: constant, by_speed, by_speed_squared, v   !! coefficients of the law, u'
    real(wp), intent(inout) :: moment(strip)                                            !! [N m]

    if (has_square) then
      moment = constant + (by_speed + by_speed_squared * v) * v
    else
      moment = constant + by_speed * v
    end if
  end subroutine find_applied

  !> Adds the moment of the terms that depend on w = u - rest.
  pure subroutine add_restoring(has_cubic, linear, cubic, w, moment)
    logical, intent(in) :: has_cubic
    real(wp), intent(in), dimension(strip) :: linear, cubic, w   !! coefficients of the law, u - rest
    real(wp), intent(inout) :: moment(strip)                     !! [N m]

    if (has_cubic) then
      moment = moment - (linear + cubic * w * w) * w
    else
      moment = moment - linear * w
    end if
  end subroutine add_restoring

  !> Computes R M, in the lanes `at` to `at + strip - 1`.
  pure subroutine sum_moments(lanes, at, elements, freedoms, entries, first, element, response, moment, acceleration)
    integer, intent(in) :: lanes, at, elements, freedoms, entries
    integer, intent(in) :: first(freedoms + 1), element(entries)   !! first entry of each coordinate, element of each entry of R
    real(wp), intent(in) :: response(lanes, entries), moment(lanes, elements)   !! of the entries of R; moments [N m]
    real(wp), intent(inout) :: acceleration(lanes, freedoms)   !! q'' [rad/s2]
    integer :: a, b, i, k, l, m, n

    b = at + strip - 1
    do i = 1, freedoms
      k = first(i)
      select case (first(i + 1) - k)
      case (2)
        l = element(k)
        m = element(k + 1)
        acceleration(at:b, i) = response(at:b, k) * moment(at:b, l) + response(at:b, k + 1) * moment(at:b, m)
      case (3)
        l = element(k)
        m = element(k + 1)
        n = element(k + 2)
        acceleration(at:b, i) = response(at:b, k) * moment(at:b, l) + response(at:b, k + 1) * moment(at:b, m) &
                                + response(at:b, k + 2) * moment(at:b, n)
      case default
        acceleration(at:b, i) = 0.0_wp
        do a = k, first(i + 1) - 1
          l = element(a)
          acceleration(at:b, i) = acceleration(at:b, i) + response(at:b, a) * moment(at:b, l)
        end do
      end select
    end do
  end subroutine sum_moments

end module nocdyn_lane_motion
