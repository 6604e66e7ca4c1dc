!> Bounds of columns of a run inside a step, without evaluations of the machine: how fast moments, torques and reactions change,
!> and how much they bend.
module nocdyn_column_bounds
  use nocdyn_chebyshev, only: max_degree
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_bounds, only: has_bounds, largest, law_bounds_t, new_law_bounds, variable_bounds_t
  use nocdyn_observer, only: step_block_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  use nocdyn_quantities, only: form_angle, form_applied, form_elastic, form_observed, form_speed
  use nocdyn_reduced, only: reduced_t
  use nocdyn_signals, only: signal_element, signal_member, signal_reaction, signal_source_t
  implicit none (type, external)
  private

  public :: can_bound, new_column_bounds

  type, public :: column_bounds_t
    type(signal_source_t), allocatable, private :: columns(:)
    integer, allocatable, private :: elements(:)           !! of the machine, whose moments count
    integer, allocatable, private :: bank(:)               !! of these, 0 if its law is a polynomial
    logical, allocatable, private :: has_angle(:), has_speed(:)   !! whether their angle or speed counts
    real(wp), allocatable, private :: weight(:, :)         !! of their moments in each column, [elements, columns]
    integer, allocatable, private :: first(:), last(:)     !! of the elements that have a weight, [columns]
    type(law_bounds_t), allocatable, private :: laws(:)    !! of the banks
    type(variable_bounds_t), allocatable, private :: restoring(:), applied(:), angle(:), speed(:)   !! of the elements
    type(variable_bounds_t), allocatable, private :: internal(:)   !! of the machine
  contains
    procedure :: bound
  end type column_bounds_t

contains

  !> Whether there are bounds of some columns of a run: moments, motions and reactions where no joint holds and no row moves.
  logical function can_bound(block, columns)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: columns(:)
    integer :: i

    can_bound = .false.
    select type (block)
    class is (reduced_t)
      if (block%lanes > 1 .or. block%joints%count > 0) return
      can_bound = .true.
      do i = 1, size(columns)
        associate (column => columns(i))
          select case (column%kind)
          case (signal_element)
            can_bound = can_bound .and. column%body == 0 .and. column%form /= form_observed
          case (signal_reaction, signal_member)
            cycle
          case default
            can_bound = .false.
          end select
        end associate
      end do
      do i = 1, size(block%machine%general_banks)
        if (can_bound) can_bound = has_bounds(block%machine%banks(block%machine%general_banks(i))%bank%tape)
      end do
    end select
  end function can_bound

  !> Bounds of columns for which there are some.
  type(column_bounds_t) function new_column_bounds(block, columns) result(self)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: columns(:)
    real(wp) :: weight(block%machine%elements%count, size(columns))
    integer :: b, e, i

    allocate (self%columns, source=columns)
    call find_weights(block, columns, weight)
    allocate (self%elements, source=pack([(e, e=1, size(weight, 1))], any(abs(weight) > 0, dim=2)))
    allocate (self%weight(size(self%elements), size(columns)))
    self%weight(:, :) = weight(self%elements, :)
    allocate (self%first(size(columns)), source=size(self%elements) + 1)
    allocate (self%last(size(columns)), source=0)
    do i = 1, size(columns)
      do e = 1, size(self%elements)
        if (.not. self%weight(e, i) > 0) cycle
        self%first(i) = min(self%first(i), e)
        self%last(i) = e
      end do
    end do
    allocate (self%bank(size(self%elements)), source=0)
    allocate (self%laws(size(block%machine%banks)))
    do i = 1, size(block%machine%general_banks)
      b = block%machine%general_banks(i)
      associate (bank => block%machine%banks(b)%bank)
        self%laws(b) = new_law_bounds(bank%tape)
        where (self%elements >= bank%first .and. self%elements <= bank%last()) self%bank = b
      end associate
    end do
    call find_motions(self, block%machine%laws)
    allocate (self%restoring(size(self%elements)), self%applied(size(self%elements)), self%angle(size(self%elements)), &
              self%speed(size(self%elements)), self%internal(block%internal))
  end function new_column_bounds

  !> Finds the angles and speeds that count.
  subroutine find_motions(self, laws)
    type(column_bounds_t), intent(inout) :: self
    type(polynomial_laws_t), intent(in) :: laws
    integer :: i

    allocate (self%has_angle(size(self%elements)), source=any(self%columns%form == form_angle))
    allocate (self%has_speed(size(self%elements)), source=any(self%columns%form == form_speed))
    do i = 1, size(self%elements)
      associate (e => self%elements(i))
        if (max(abs(laws%linear(1, e)), abs(laws%cubic(1, e))) > 0) self%has_angle(i) = .true.
        if (max(abs(laws%by_speed(1, e)), abs(laws%by_speed_squared(1, e))) > 0) self%has_speed(i) = .true.
      end associate
      if (self%bank(i) == 0) cycle
      if (self%laws(self%bank(i))%angle > 0) self%has_angle(i) = .true.
      if (self%laws(self%bank(i))%speed > 0) self%has_speed(i) = .true.
    end do
  end subroutine find_motions

  !> The weights of the moments of all elements, or of their motions, in the columns.
  subroutine find_weights(block, columns, weight)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: columns(:)
    real(wp), intent(out) :: weight(:, :)   !! [elements, columns]
    type(coordinates_t) :: coordinates
    real(wp) :: lambda(block%machine%constraints%rows()), torque(0:block%machine%bodies)
    integer :: e, i

    weight = 0.0_wp
    coordinates = block%machine%coordinates
    associate (machine => block%machine, members => block%machine%constraints%members)
      do i = 1, size(columns)
        if (columns(i)%kind /= signal_element) cycle
        associate (bank => machine%banks(columns(i)%bank)%bank, number => columns(i)%index)
          weight(bank%first - 1 + number, i) = abs(columns(i)%factor)
          if (columns(i)%divisor > 0) weight(bank%first - 1 + number, i) = &
            abs(columns(i)%factor / bank%parameters(columns(i)%divisor)%value(1, number))
        end associate
      end do
      if (all(columns%kind == signal_element)) return
      do e = 1, machine%elements%count
        torque = 0.0_wp
        call machine%elements%rows%add_moment(e, 1.0_wp, torque(1:))
        call coordinates%reactions_of_torques(1, torque(1:), lambda)
        do i = 1, size(columns)
          if (columns(i)%kind == signal_reaction) weight(e, i) = abs(lambda(columns(i)%index))
          if (columns(i)%kind == signal_member) weight(e, i) = abs(members%factor(1, columns(i)%index) * &
                                                                   lambda(members%row(columns(i)%index)))
        end do
      end do
    end associate
  end subroutine find_weights

  !> Bounds of the first and second derivatives of the columns by theta in the last step; huge where there are none.
  subroutine bound(self, block, steps, y, c, slopes, bends)
    class(column_bounds_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)   !! state = y + sum of c_p theta^p
    real(wp), intent(out) :: slopes(:), bends(:)              !! [columns]
    logical :: is_bounded
    integer :: i

    select type (block)
    class is (reduced_t)
      is_bounded = .true.
      do i = 1, size(self%internal)
        self%internal(i) = bounds_of(y(1, block%mechanical + i), c(1, block%mechanical + i, :))
      end do
      do i = 1, size(self%elements)
        if (self%has_angle(i)) self%angle(i) = bounds_of_motion(block, self%elements(i), .false., y, c)
        if (self%has_speed(i)) self%speed(i) = bounds_of_motion(block, self%elements(i), .true., y, c)
        call bound_moments(self, block, steps, i, is_bounded)
        if (.not. is_bounded) exit
      end do
      slopes = huge(slopes)
      bends = huge(bends)
      if (.not. is_bounded) return
      do i = 1, size(self%columns)
        call sum_bounds(self, i, slopes(i), bends(i))
      end do
    class default
      error stop 'nocdyn_column_bounds: the formulation is the reduced one'
    end select
  end subroutine bound

  !> Bounds of the angle or the speed of an element.
  pure type(variable_bounds_t) function bounds_of_motion(block, element, is_speed, y, c) result(x)
    class(reduced_t), intent(in) :: block
    integer, intent(in) :: element
    logical, intent(in) :: is_speed
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    real(wp) :: series(max_degree), start
    integer :: component, k, p

    start = 0.0_wp
    if (.not. is_speed) start = block%twist_at_origin(1, element)
    series(:size(c, 3)) = 0.0_wp
    associate (twists => block%incidence)
      do k = twists%first(element), twists%first(element + 1) - 1
        component = twists%coordinate(k)
        if (.not. is_speed) component = component + block%machine%coordinates%freedoms
        start = start + twists%ratio(1, k) * y(1, component)
        do p = 1, size(c, 3)
          series(p) = series(p) + twists%ratio(1, k) * c(1, component, p)
        end do
      end do
    end associate
    x = bounds_of(start, series(:size(c, 3)))
  end function bounds_of_motion

  !> Bounds of x + sum of c_p theta^p.
  pure type(variable_bounds_t) function bounds_of(x, c) result(bounds)
    real(wp), intent(in) :: x, c(:)
    real(wp) :: end
    integer :: p

    end = x
    bounds%slope = 0.0_wp
    bounds%bend = 0.0_wp
    do p = 1, size(c)
      end = end + c(p)
      bounds%slope = bounds%slope + p * abs(c(p))
      bounds%bend = bounds%bend + p * (p - 1) * abs(c(p))
    end do
    bounds%low = min(x, end) - 0.125_wp * bounds%bend
    bounds%high = max(x, end) + 0.125_wp * bounds%bend
  end function bounds_of

  !> Bounds of the moments of an element.
  subroutine bound_moments(self, block, steps, i, is_bounded)
    type(column_bounds_t), intent(inout) :: self
    class(reduced_t), intent(in) :: block
    type(step_block_t), intent(in) :: steps
    integer, intent(in) :: i   !! of the elements that count
    logical, intent(inout) :: is_bounded
    type(variable_bounds_t) :: moments(2), time
    real(wp) :: w

    associate (e => self%elements(i), laws => block%machine%laws, u => self%angle(i), v => self%speed(i), &
               of_restoring => self%restoring(i), of_applied => self%applied(i))
      w = max(abs(u%low - laws%rest(1, e)), abs(u%high - laws%rest(1, e)))
      associate (stiffness => abs(laws%linear(1, e)) + 3 * abs(laws%cubic(1, e)) * w**2)
        of_restoring%slope = stiffness * u%slope
        of_restoring%bend = stiffness * u%bend + 6 * abs(laws%cubic(1, e)) * w * u%slope**2
      end associate
      associate (damping => abs(laws%by_speed(1, e)) + 2 * abs(laws%by_speed_squared(1, e)) * largest(v))
        of_applied%slope = damping * v%slope
        of_applied%bend = damping * v%bend + 2 * abs(laws%by_speed_squared(1, e)) * v%slope**2
      end associate
      if (self%bank(i) == 0) return
      time = variable_bounds_t(steps%t(1), steps%t(1) + steps%h(1), steps%h(1), 0.0_wp)
      associate (bank => block%machine%banks(self%bank(i))%bank, law => block%state%banks(self%bank(i))%law%law)
        associate (number => e - bank%first, states => bank%states)
          associate (first => bank%first_internal + states * number)
            call self%laws(self%bank(i))%bound(law, law%slot(1, number + 1), [time, u, v], &
                                               self%internal(first:first + states - 1), moments, is_bounded)
          end associate
        end associate
      end associate
      of_restoring%slope = of_restoring%slope + moments(1)%slope
      of_restoring%bend = of_restoring%bend + moments(1)%bend
      of_applied%slope = of_applied%slope + moments(2)%slope
      of_applied%bend = of_applied%bend + moments(2)%bend
    end associate
  end subroutine bound_moments

  !> Bounds of a column from the ones of the elements.
  pure subroutine sum_bounds(self, i, slope, bend)
    type(column_bounds_t), intent(in) :: self
    integer, intent(in) :: i   !! column
    real(wp), intent(out) :: slope, bend
    integer :: k

    slope = 0.0_wp
    bend = 0.0_wp
    do k = self%first(i), self%last(i)
      associate (weight => self%weight(k, i))
        select case (self%columns(i)%form)
        case (form_angle)
          slope = slope + weight * self%angle(k)%slope
          bend = bend + weight * self%angle(k)%bend
        case (form_speed)
          slope = slope + weight * self%speed(k)%slope
          bend = bend + weight * self%speed(k)%bend
        case (form_elastic)
          slope = slope + weight * self%restoring(k)%slope
          bend = bend + weight * self%restoring(k)%bend
        case (form_applied)
          slope = slope + weight * self%applied(k)%slope
          bend = bend + weight * self%applied(k)%bend
        case default
          slope = slope + weight * (self%restoring(k)%slope + self%applied(k)%slope)
          bend = bend + weight * (self%restoring(k)%bend + self%applied(k)%bend)
        end select
      end associate
    end do
  end subroutine sum_bounds

end module nocdyn_column_bounds
