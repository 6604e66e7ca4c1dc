!> Couplings with backlash: no moment in a gap, contact beyond its edges.
!>
!> In contact the elastic moment M is a function of the penetration of the edge. The damping moment is d u', limited to the
!> size of M: the contact never pulls, and its moment starts at zero. It is the law of `ElastoBacklash` of the Modelica
!> Standard Library. The damping moment does work. While the bodies separate faster than the contact can follow, it is the
!> opposite of the elastic moment and dissipates the energy that the contact still stores.
module nocdyn_gap_couplings
  use nocdyn_bank, only: boundary_width
  use nocdyn_couplings, only: coupling_common_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_polynomial_couplings, only: elastic_curvature, elastic_energy, elastic_moment, elastic_slope, &
                                         new_polynomial_couplings, polynomial_couplings_t
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: new_gap_couplings

  type, extends(polynomial_couplings_t), public :: gap_couplings_t
    real(wp), allocatable :: gap(:, :)      !! total play [rad], positive, shape [lanes, couplings] as all that follow
    real(wp), allocatable :: boundary_shift(:, :)   !! of the branches, as a moment [N m]
    real(wp), allocatable :: scale(:, :)    !! stiffness that converts a penetration to a moment [N m/rad]
  contains
    procedure :: list_parameters
    procedure :: polynomials
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
    procedure :: choose
    procedure :: indicator
  end type gap_couplings_t

  ! the branches; the negative of each is that at the edge -gap / 2
  integer, parameter :: free = 0
  integer, parameter :: contact = 1      ! the damping moment is d u'
  integer, parameter :: closing = 2      ! d u' is above the elastic moment; the damping moment is equal to that
  integer, parameter :: separating = 3   ! d u' would make the contact pull; the moments cancel

contains

  !> Couplings with play, the elastic moment being sum p_k x^k of the penetration x. The damping is that in contact, the rest
  !> twist is at the middle of the gap, the friction acts in the gap and in contact.
  function new_gap_couplings(common, coefficient, gap) result(bank)
    type(coupling_common_t), intent(in) :: common   !! names, bodies, damping, rest twists, friction
    real(wp), intent(in) :: coefficient(:, :, :)       !! p_k [N m/rad^k], shape [order, lanes, couplings], some not zero
    real(wp), intent(in) :: gap(:, :)                  !! [rad], positive, shape [lanes, couplings]
    type(gap_couplings_t) :: bank
    integer :: e, k, l

    bank%polynomial_couplings_t = new_polynomial_couplings(common, coefficient)
    allocate (bank%gap, source=gap)
    allocate (bank%boundary_shift, bank%scale, source=0.0_wp * gap)
    do e = 1, size(bank%to)
      do l = 1, size(gap, 1)
        bank%scale(l, e) = sum([(abs(coefficient(k, l, e)) * gap(l, e)**(k - 1), k=1, size(coefficient, 1))])
      end do
    end do
    if (any(bank%gap <= 0) .or. any(bank%scale <= 0)) error stop 'nocdyn_gap_couplings: gaps have widths and edges stiffness'
    bank%boundary_shift = boundary_width * bank%scale * bank%gap
    bank%with_work = pack([(e, e=1, size(bank%to))], [(any(bank%with_work == e) .or. can_pull(coefficient(:, :, e)), &
                                                  e=1, size(bank%to))])
    call bank%add_switches([('edge of the gap', e=1, size(bank%to))])
  end function new_gap_couplings

  !> Whether the elastic moment of a contact can change its sign. A contact that would pull dissipates its stored energy, even
  !> without damping.
  pure logical function can_pull(coefficient)
    real(wp), intent(in) :: coefficient(:, :)   !! p_k, shape [order, lanes]

    can_pull = any(coefficient(1::2, :) < 0) .or. any(abs(coefficient(2::2, :)) > 0)
  end function can_pull

  !> Sets no coefficients, because no polynomial holds on both sides of an edge.
  subroutine polynomials(self, laws)
    class(gap_couplings_t), intent(in) :: self
    type(polynomial_laws_t), intent(inout) :: laws
  end subroutine polynomials

  !> Penetration of the edge of a branch [rad], negative at the lower edge.
  pure real(wp) function penetration(self, branch, lane, coupling, angle) result(x)
    class(gap_couplings_t), intent(in) :: self
    integer, intent(in) :: branch, lane, coupling
    real(wp), intent(in) :: angle   !! u [rad]

    x = (angle - self%rest_twist(lane, coupling)) - sign(0.5_wp * self%gap(lane, coupling), real(branch, wp))
  end function penetration

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(gap_couplings_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
    real(wp) :: moment
    integer :: e, i, l

    i = 0
    do e = 1, size(self%to)
      do l = 1, self%lanes
        i = i + 1
        associate (branch => self%branch(l, e))
          if (branch == free) cycle
          moment = elastic_moment(self%coefficient(:, l, e), penetration(self, branch, l, e, angle(i)))
          restoring(i) = restoring(i) - moment
          applied(i) = applied(i) - damping_moment(branch, moment, self%damping(l, e) * speed(i))
        end associate
      end do
    end do
    call self%couplings_t%evaluate(time, angle, speed, restoring, applied)
  end subroutine evaluate

  !> Damping moment of a branch [N m], or a derivative of it from those of M and d u'.
  pure real(wp) function damping_moment(branch, elastic, viscous) result(moment)
    integer, intent(in) :: branch
    real(wp), intent(in) :: elastic, viscous   !! M, d u'

    select case (abs(branch))
    case (contact)
      moment = viscous
    case (closing)
      moment = elastic
    case default
      moment = -elastic
    end select
  end function damping_moment

  subroutine differentiate(self, elements)
    class(gap_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: stiffness, x
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (branch => self%branch(l, e), curvature => elements%restoring_curvature(l, i))
          if (branch == free) cycle
          x = penetration(self, branch, l, e, elements%angle(l, i))
          stiffness = elastic_slope(self%coefficient(:, l, e), x)
          elements%restoring_angle(l, i) = elements%restoring_angle(l, i) - stiffness
          curvature = curvature - elastic_curvature(self%coefficient(:, l, e), x)
          elements%applied_angle(l, i) = elements%applied_angle(l, i) - damping_moment(branch, stiffness, 0.0_wp)
          elements%applied_speed(l, i) = elements%applied_speed(l, i) - damping_moment(branch, 0.0_wp, self%damping(l, e))
        end associate
      end do
    end do
    call self%couplings_t%differentiate(elements)
  end subroutine differentiate

  subroutine evaluate_energies(self, elements)
    class(gap_couplings_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: x
    integer :: e, i, l

    do e = 1, size(self%to)
      i = self%first + e - 1
      do l = 1, self%lanes
        associate (branch => self%branch(l, e))
          if (branch == free) cycle
          x = penetration(self, branch, l, e, elements%angle(l, i))
          elements%stored(l, i) = elements%stored(l, i) + elastic_energy(self%coefficient(:, l, e), x)
          elements%secant(l, i) = elements%secant(l, i) &
                                  + elastic_moment(self%coefficient(:, l, e), x) / (elements%angle(l, i) - self%rest_twist(l, e))
          if (abs(branch) == contact) elements%damping(l, i) = elements%damping(l, i) + self%damping(l, e)
        end associate
      end do
    end do
  end subroutine evaluate_energies

  !> Depth of the penetration, and the elastic and viscous moments, positive where they push the bodies apart.
  pure subroutine contact_moments(self, side, lane, coupling, angle, speed, depth, elastic, viscous)
    class(gap_couplings_t), intent(in) :: self
    integer, intent(in) :: side             !! 1 for the upper edge, -1 for the lower edge
    integer, intent(in) :: lane, coupling
    real(wp), intent(in) :: angle, speed    !! u [rad], u' [rad/s]
    real(wp), intent(out) :: depth          !! [rad]
    real(wp), intent(out) :: elastic, viscous   !! M, d u' [N m]
    real(wp) :: x

    x = penetration(self, side, lane, coupling, angle)
    depth = side * x
    elastic = side * elastic_moment(self%coefficient(:, lane, coupling), x)
    viscous = side * self%damping(lane, coupling) * speed
  end subroutine contact_moments

  subroutine choose(self, switch, lane, t, angle, speed, internal)
    class(gap_couplings_t), intent(inout) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element
    real(wp) :: depth, elastic, viscous
    integer :: side

    side = merge(1, -1, angle > self%rest_twist(lane, switch))
    call contact_moments(self, side, lane, switch, angle, speed, depth, elastic, viscous)
    associate (branch => self%branch(lane, switch))
      if (depth <= 0) then
        branch = free
      else if (elastic + min(viscous, 0.0_wp) < 0) then
        branch = side * separating
      else if (viscous > elastic) then
        branch = side * closing
      else
        branch = side * contact
      end if
    end associate
  end subroutine choose

  pure real(wp) function indicator(self, switch, lane, t, angle, speed, internal)
    class(gap_couplings_t), intent(in) :: self
    integer, intent(in) :: switch, lane   !! switch numbered within the bank
    real(wp), intent(in) :: t, angle, speed   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states of the element
    real(wp) :: depth, elastic, viscous
    integer :: side

    associate (branch => self%branch(lane, switch), gap => self%gap(lane, switch))
      side = sign(1, branch)
      call contact_moments(self, side, lane, switch, angle, speed, depth, elastic, viscous)
      depth = depth * self%scale(lane, switch)
      select case (abs(branch))
      case (free)
        indicator = self%scale(lane, switch) * (0.5_wp * gap - abs(angle - self%rest_twist(lane, switch)))
      case (contact)
        indicator = min(depth, elastic - abs(viscous))
      case (closing)
        indicator = min(depth, elastic, viscous - elastic)
      case default
        indicator = min(depth, -(elastic + min(viscous, 0.0_wp)))
      end select
    end associate
    indicator = indicator + self%boundary_shift(lane, switch)
  end function indicator

  subroutine list_parameters(self, parameters)
    class(gap_couplings_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call self%polynomial_couplings_t%list_parameters(parameters)
    call parameters%add('gap', self%gap)
    call parameters%add('boundary_shift', self%boundary_shift)
    call parameters%add('scale', self%scale)
  end subroutine list_parameters

end module nocdyn_gap_couplings
