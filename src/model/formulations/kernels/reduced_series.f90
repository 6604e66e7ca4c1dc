!> Taylor series of the motion of a machine in the reduced formulation, by recurrence from one coefficient to the next.
!>
!> From the coefficients of q' up to number k, the coefficients of the elements are u'_k = U q'_k and u_k = u'_(k-1) / k. Their
!> laws give the moments M_k, and (k + 1) q'_(k+1) = R M_k.
!>
!> The numbers of the elements stand in groups of w, [w, 0:order, groups]: a group has some lanes of one element, or in a block
!> of one lane some elements. A strip of lanes goes through all coefficients before the next strip starts.
module nocdyn_reduced_series
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_held_lanes, only: held_lanes_t
  use nocdyn_kinds, only: wp
  use nocdyn_laws, only: narrow, strip_lanes, wide
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_narrow_series, only: narrow_accelerate => accelerate, narrow_begin_motion => begin_motion, &
    narrow_find_moments => find_moments, narrow_find_values => find_values, narrow_multiply_group => multiply_group
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_series_banks, only: new_series_banks, series_banks_t
  use nocdyn_series_maps, only: new_series_map, series_map_t
  use nocdyn_series_terms, only: by_speed, by_speed_squared, constant, cubic, has_angle, has_applied, has_cubic, &
    has_forcing, has_history, has_square, linear, parameters, rest
  use nocdyn_sparse_map, only: sparse_map_t
  use nocdyn_wide_series, only: wide_accelerate => accelerate, wide_begin_motion => begin_motion, &
    wide_find_moments => find_moments, wide_find_values => find_values, wide_multiply_group => multiply_group
  implicit none (type, external)
  private

  public :: new_reduced_series

  !> Column k of an array holds the coefficients number k: the k-th derivatives over k factorial.
  type, public :: reduced_series_t
    integer :: order = 0                        !! of the series of the state
    integer :: last = 0                         !! coefficient of the moments that will be asked for
    integer :: lanes = 1, elements = 0, freedoms = 0
    integer :: components = 0                   !! of the state
    integer :: internal = 0                     !! internal states of the elements
    integer, allocatable :: with_work(:)        !! elements whose powers are integrated
    integer :: strip = 1                        !! lanes of a strip
    integer :: w = narrow                        !! numbers of a group
    integer :: groups = 0                       !! of the elements in a strip
    type(series_map_t) :: twists, accelerations !! U, R
    real(wp), allocatable :: law(:, :, :, :)    !! polynomial laws, [w, groups, parameters, strips]
    integer, allocatable :: terms(:)            !! has_... of `nocdyn_series_terms`, [groups]
    type(series_banks_t) :: banks               !! those with laws that are not polynomial
    real(wp), allocatable :: motion(:, :, :, :) !! u - rest and u', [w, 0:order, groups, 2]
    real(wp), allocatable :: square(:, :, :)    !! (u - rest)^2, the same
    real(wp), allocatable :: restoring(:, :), applied(:, :)   !! present coefficients, as in `elements_t`, [w, groups]
    real(wp), allocatable :: moment(:, :)       !! their sum
    real(wp), allocatable :: powers(:, :, :)    !! series of the applied moments, for the work integrals, [w, 0:order, groups]
    real(wp), allocatable :: rates(:)           !! present coefficients of q', [strip, freedoms], in whole groups
    real(wp), allocatable :: coordinates(:)     !! q, the same
    real(wp), allocatable :: acceleration(:)    !! present coefficients of q'', with one lane
    real(wp), allocatable :: origin(:, :)       !! u where q = 0 [rad], [w, groups]
    real(wp), allocatable :: angles(:), speeds(:)   !! u and u' of the elements of one lane [rad], [rad/s]
  contains
    procedure :: expand, derivative, refresh_lane
  end type reduced_series_t

contains

  !> Work space for series up to an order.
  function new_reduced_series(machine, state, twists, accelerations, with_energy_balance, order) result(self)
    type(machine_t), intent(in) :: machine
    type(machine_state_t), intent(inout) :: state     !! its laws get work space too
    type(sparse_map_t), intent(in) :: twists          !! U
    type(sparse_map_t), intent(in) :: accelerations   !! R
    logical, intent(in) :: with_energy_balance        !! whether the powers of the elements `machine%with_work` are integrated
    integer, intent(in) :: order
    type(reduced_series_t) :: self
    integer :: lane

    self%order = order
    self%lanes = machine%lanes
    self%elements = machine%elements%count
    self%freedoms = machine%coordinates%freedoms
    self%strip = strip_lanes(machine%lanes, self%elements)
    self%w = max(self%strip, narrow)
    self%groups = max((self%strip * self%elements + self%w - 1) / self%w, 1)
    self%internal = machine%elements%internal%count
    allocate (self%with_work(merge(size(machine%with_work), 0, with_energy_balance)))
    self%with_work(:) = machine%with_work(:size(self%with_work))
    self%components = 2 * self%freedoms + self%internal + size(self%with_work)
    self%twists = new_series_map(twists, self%lanes, self%strip, self%elements, self%freedoms)
    self%accelerations = new_series_map(accelerations, self%lanes, self%strip, self%freedoms, self%elements)
    allocate (self%law(self%w, self%groups, parameters, (machine%lanes + self%strip - 1) / self%strip), source=0.0_wp)
    allocate (self%terms(self%groups), source=merge(has_applied, 0, size(self%with_work) > 0) &
              + merge(has_history, 0, size(self%with_work) > 0 .or. self%lanes == 1))
    associate (length => self%w * ((self%strip * self%freedoms + self%w - 1) / self%w))
      allocate (self%motion(self%w, 0:self%order, self%groups, 2), self%square(self%w, 0:self%order, self%groups), source=0.0_wp)
      allocate (self%restoring(self%w, self%groups), self%applied(self%w, self%groups), source=0.0_wp)
      allocate (self%moment(self%w, self%groups), self%origin(self%w, self%groups), source=0.0_wp)
      if (size(self%with_work) > 0) allocate (self%powers(self%w, 0:self%order, self%groups), source=0.0_wp)
      allocate (self%rates(length), self%coordinates(length), self%acceleration(length), source=0.0_wp)
      allocate (self%angles(self%elements), self%speeds(self%elements), source=0.0_wp)
    end associate
    self%banks = new_series_banks(machine, state, order, self%strip, self%groups)
    where (self%banks%has_angle) self%terms = ior(self%terms, has_angle)
    where (self%banks%has_motion) self%terms = ior(self%terms, has_history)
    where (self%banks%has_forcing) self%terms = ior(self%terms, has_forcing)
    do lane = 1, machine%lanes
      call copy_laws(self, lane, machine%laws)
    end do
  end function new_reduced_series

  !> Updates everything that depends on the parameters of a lane.
  subroutine refresh_lane(self, lane, laws, twists, accelerations)
    class(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R

    if (self%order == 0) return
    call copy_laws(self, lane, laws)
    call self%twists%refresh_lane(lane, twists)
    call self%accelerations%refresh_lane(lane, accelerations)
  end subroutine refresh_lane

  !> Copies the polynomial laws of a lane. The laws of the last lane also fill the lanes beyond it in its strip.
  subroutine copy_laws(self, lane, laws)
    type(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws
    integer :: at, e, first, g, last, slot, strip, terms

    first = modulo(lane - 1, self%strip) + 1
    last = first
    if (lane == self%lanes) last = self%strip
    strip = (lane - 1) / self%strip + 1
    do e = 1, self%elements
      ! the terms that the law of an element has in one lane
      terms = 0
      if (abs(laws%linear(lane, e)) > 0) terms = has_angle
      if (abs(laws%cubic(lane, e)) > 0) terms = has_angle + has_cubic + has_history
      if (abs(laws%constant(lane, e)) > 0 .or. abs(laws%by_speed(lane, e)) > 0) terms = terms + has_applied
      if (abs(laws%by_speed_squared(lane, e)) > 0) terms = ior(terms, has_square + has_history)
      do slot = self%strip * (e - 1) + first, self%strip * (e - 1) + last
        g = (slot - 1) / self%w + 1
        at = slot - self%w * (g - 1)
        self%law(at, g, linear, strip) = laws%linear(lane, e)
        self%law(at, g, constant, strip) = laws%constant(lane, e)
        self%law(at, g, by_speed, strip) = laws%by_speed(lane, e)
        self%law(at, g, cubic, strip) = laws%cubic(lane, e)
        self%law(at, g, by_speed_squared, strip) = laws%by_speed_squared(lane, e)
        self%law(at, g, rest, strip) = laws%rest(lane, e)
        self%terms(g) = ior(self%terms(g), terms)
      end do
    end do
  end subroutine copy_laws

  !> Computes the coefficients number 1 to `order` of q', q, the internal states and the work integrals, which follow one another.
  subroutine expand(self, state, twists, accelerations, twist_at_origin, incidence, held, columns, t, y)
    class(reduced_series_t), intent(inout) :: self
    type(machine_state_t), intent(inout) :: state
    type(sparse_map_t), intent(in) :: twists, accelerations     !! U, R
    real(wp), contiguous, intent(in) :: twist_at_origin(:, :)   !! [rad], [lanes, elements]
    type(element_coordinates_t), intent(in) :: incidence
    type(held_lanes_t), intent(inout) :: held                   !! joints that hold
    integer, intent(in) :: columns                              !! components of the state, and padding
    real(wp), intent(in) :: t(self%lanes)                       !! [s]
    real(wp), intent(inout) :: y(self%lanes, columns, 0:self%order)   !! coefficients; number 0 is given
    integer :: k, last, strip

    self%last = self%order - 1
    do strip = 1, size(self%law, 4)
      call begin(self, state, twists, strip, twist_at_origin, columns, t, y)
      do k = 0, self%order - 1
        call advance(self, state, twists, accelerations, strip, k, columns, y(1, 1, k + 1))
        if (.not. held%is_active) cycle
        last = min(self%strip * strip, self%lanes)
        call held%hold_coefficients(incidence, self%strip * (strip - 1) + 1, last, self%lanes, self%freedoms, y(1, 1, k + 1))
        call gather(self, strip, self%freedoms, y(1, 1, k + 1), self%rates)
      end do
    end do
  end subroutine expand

  !> The derivative of the state, to the same bits as by `evaluate_elements` of the state; with several lanes.
  subroutine derivative(self, state, twists, accelerations, twist_at_origin, t, y, dydt)
    class(reduced_series_t), intent(inout) :: self
    type(machine_state_t), intent(inout) :: state
    type(sparse_map_t), intent(in) :: twists, accelerations     !! U, R
    real(wp), contiguous, intent(in) :: twist_at_origin(:, :)   !! [rad], [lanes, elements]
    real(wp), intent(in) :: t(self%lanes)                       !! [s]
    real(wp), intent(in) :: y(self%lanes, self%components)
    real(wp), intent(inout) :: dydt(self%lanes, self%components)
    integer :: strip

    self%last = 0
    do strip = 1, size(self%law, 4)
      call begin(self, state, twists, strip, twist_at_origin, self%components, t, y)
      call advance(self, state, twists, accelerations, strip, 0, self%components, dydt)
    end do
  end subroutine derivative

  !> Coefficients k + 1 of the state in a strip, from the coefficients of the motion up to number k.
  subroutine advance(self, state, twists, accelerations, strip, k, columns, y)
    type(reduced_series_t), intent(inout) :: self
    type(machine_state_t), intent(inout) :: state
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R
    integer, intent(in) :: strip, k, columns
    real(wp), intent(inout) :: y(self%lanes, columns)         !! coefficients k + 1 of the state

    if (k == 0) then
      call find_values(self, strip)
    else
      if (self%lanes == 1) call self%twists%multiply(twists, self%order, k, self%rates, self%motion(1, 0, 1, 2))
      call find_moments(self, strip, k)
    end if
    call self%banks%add(state, strip, k, self%motion, self%restoring, self%applied)
    if (size(self%with_work) > 0) self%powers(:, k, :) = self%applied
    call add(size(self%moment), self%restoring, self%applied, self%moment)
    call integrate(self, accelerations, strip, k, columns, y)
    if (self%internal > 0) call self%banks%integrate(state, strip, k, y(1, 2 * self%freedoms + 1))
    if (size(self%with_work) > 0) call integrate_powers(self, strip, k, columns, y)
  end subroutine advance

  !> Coefficients 0 of the elements of a strip.
  subroutine begin(self, state, twists, strip, twist_at_origin, columns, t, y)
    type(reduced_series_t), intent(inout) :: self
    type(machine_state_t), intent(inout) :: state
    type(sparse_map_t), intent(in) :: twists                    !! U
    integer, intent(in) :: strip, columns
    real(wp), intent(in) :: twist_at_origin(self%lanes, self%elements)   !! [rad]
    real(wp), intent(in) :: t(self%lanes)                       !! [s]
    real(wp), intent(in) :: y(self%lanes, columns)              !! state
    integer :: g, last, n

    associate (f => self%freedoms)
      call gather(self, strip, f, y, self%rates)
      if (self%lanes == 1) then
        ! angles from rest and speeds of the elements of one lane
        call twists%multiply_pair(twist_at_origin, y(1, f + 1), self%rates, self%angles, self%speeds)
        do g = 1, self%groups
          last = min(narrow * g, self%elements)
          n = last - narrow * (g - 1)
          self%motion(:n, 0, g, 1) = self%angles(last - n + 1:last) - self%law(:n, g, rest, 1)
          self%motion(:n, 0, g, 2) = self%speeds(last - n + 1:last)
        end do
      else
        associate (before => self%strip * (strip - 1))
          if (before + self%strip <= self%lanes) then
            call begin_lanes(self, strip, self%lanes, y(before + 1, f + 1), twist_at_origin(before + 1, 1))
          else
            call gather(self, strip, f, y(1, f + 1), self%coordinates)
            call gather(self, strip, self%elements, twist_at_origin, self%origin)
            call begin_lanes(self, strip, self%strip, self%coordinates, self%origin)
          end if
        end associate
      end if
    end associate
    call self%banks%begin(state, strip, self%last, t, y(1, min(2 * self%freedoms + 1, columns)))
  end subroutine begin

  !> Angles from rest and speeds of the elements of several lanes.
  subroutine begin_lanes(self, strip, stride, q, origin)
    type(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: strip, stride
    real(wp), intent(in) :: q(stride, self%freedoms), origin(stride, self%elements)   !! coordinates; u where they are zero [rad]

    associate (map => self%twists)
      if (self%w == narrow) then
        call narrow_begin_motion(self%order, self%elements, self%terms, map%first, map%column, map%coefficient(1, 1, strip), &
                                 stride, q, origin, self%rates, self%law(1, 1, rest, strip), self%motion(1, 0, 1, 1), &
                                 self%motion(1, 0, 1, 2))
      else
        call wide_begin_motion(self%order, self%elements, self%terms, map%first, map%column, map%coefficient(1, 1, strip), &
                               stride, q, origin, self%rates, self%law(1, 1, rest, strip), self%motion(1, 0, 1, 1), &
                               self%motion(1, 0, 1, 2))
      end if
    end associate
  end subroutine begin_lanes

  !> Copies components of the state of a strip; the last lane to those beyond it, too.
  pure subroutine gather(self, strip, n, y, x)
    type(reduced_series_t), intent(in) :: self
    integer, intent(in) :: strip, n
    real(wp), intent(in) :: y(self%lanes, n)            !! components of the state
    real(wp), intent(inout) :: x(self%strip, n)         !! of the strip
    integer :: before, c, taken

    before = self%strip * (strip - 1)
    taken = min(self%strip, self%lanes - before)
    do c = 1, n
      x(:taken, c) = y(before + 1:before + taken, c)
      x(taken + 1:, c) = y(self%lanes, c)
    end do
  end subroutine gather

  !> Moments of polynomial laws at the start, and their part that follows from the time alone.
  subroutine find_values(self, strip)
    type(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: strip

    if (self%w == narrow) then
      call narrow_find_values(self%order, self%groups, self%terms, self%law(1, 1, 1, strip), self%banks%forcing, &
                              self%motion(1, 0, 1, 2), self%motion(1, 0, 1, 1), self%square, self%restoring, self%applied)
    else
      call wide_find_values(self%order, self%groups, self%terms, self%law(1, 1, 1, strip), self%banks%forcing, &
                            self%motion(1, 0, 1, 2), self%motion(1, 0, 1, 1), self%square, self%restoring, self%applied)
    end if
  end subroutine find_values

  !> Coefficients k > 0 of the motion of the elements, and of these moments.
  subroutine find_moments(self, strip, k)
    type(reduced_series_t), intent(inout) :: self
    integer, intent(in) :: strip, k

    associate (map => self%twists)
      if (self%w == narrow) then
        call narrow_find_moments(self%order, self%groups, k, self%terms, self%law(1, 1, 1, strip), self%banks%forcing, &
                                 map%mapped, map%first, map%column, map%coefficient(1, 1, strip), self%rates, &
                                 self%motion(1, 0, 1, 2), self%motion(1, 0, 1, 1), self%square, self%restoring, self%applied)
      else
        call wide_find_moments(self%order, self%groups, k, self%terms, self%law(1, 1, 1, strip), self%banks%forcing, &
                               map%mapped, map%first, map%column, map%coefficient(1, 1, strip), self%rates, &
                               self%motion(1, 0, 1, 2), self%motion(1, 0, 1, 1), self%square, self%restoring, self%applied)
      end if
    end associate
  end subroutine find_moments

  pure subroutine add(n, x, y, sum)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), y(n)   !! [N m]
    real(wp), intent(inout) :: sum(n)    !! x + y [N m]

    sum = x + y
  end subroutine add

  !> Coefficients k + 1 of q' and q, from the moments and q' number k.
  subroutine integrate(self, accelerations, strip, k, columns, y)
    type(reduced_series_t), intent(inout) :: self
    type(sparse_map_t), intent(in) :: accelerations   !! R
    integer, intent(in) :: strip, k, columns
    real(wp), intent(inout) :: y(self%lanes, columns)   !! coefficients k + 1 of the state
    real(wp) :: inverse
    integer :: c

    inverse = 1.0_wp / (k + 1)
    associate (f => self%freedoms, map => self%accelerations, first => self%strip * (strip - 1) + 1)
      if (self%lanes == 1) then
        call map%multiply(accelerations, 0, 0, self%moment, self%acceleration)
        do c = 1, f
          y(1, f + c) = inverse * self%rates(c)
          self%rates(c) = inverse * self%acceleration(c)
          y(1, c) = self%rates(c)
        end do
      else if (self%w == narrow) then
        call narrow_accelerate(f, map%first, map%column, map%coefficient(1, 1, strip), inverse, self%moment, self%rates, &
                               min(self%strip, self%lanes + 1 - first), self%lanes, y(first, 1))
      else
        call wide_accelerate(f, map%first, map%column, map%coefficient(1, 1, strip), inverse, self%moment, self%rates, &
                             min(self%strip, self%lanes + 1 - first), self%lanes, y(first, 1))
      end if
    end associate
  end subroutine integrate

  !> Coefficients k + 1 of the work integrals; the powers are `applied` times the speed.
  subroutine integrate_powers(self, strip, k, columns, y)
    type(reduced_series_t), intent(in) :: self
    integer, intent(in) :: strip, k, columns
    real(wp), intent(inout) :: y(self%lanes, columns)   !! coefficients k + 1 of the state
    real(wp) :: power(wide)
    integer :: a, before, first, g, i, slot

    before = 2 * self%freedoms + self%internal
    first = self%strip * (strip - 1)
    g = 0
    do a = 1, size(self%with_work)
      slot = self%strip * (self%with_work(a) - 1)
      if (g /= slot / self%w + 1) then
        g = slot / self%w + 1
        if (self%w == narrow) then
          call narrow_multiply_group(k, self%powers(1, 0, g), self%motion(1, 0, g, 2), power)
        else
          call wide_multiply_group(k, self%powers(1, 0, g), self%motion(1, 0, g, 2), power)
        end if
      end if
      do i = 1, min(self%strip, self%lanes - first)
        y(first + i, before + a) = (1.0_wp / (k + 1)) * power(modulo(slot, self%w) + i)
      end do
    end do
  end subroutine integrate_powers

end module nocdyn_reduced_series
