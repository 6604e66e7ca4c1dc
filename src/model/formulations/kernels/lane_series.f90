!> Taylor series of the motion of a block of many lanes, for machines whose laws are polynomials or depend on the time alone.
!>
!> It is the recurrence of `nocdyn_reduced_series`, with the same bits.
!>
!> A strip of lanes goes through all orders before the next strip starts. The parameters of a strip are first gathered in
!> arrays that stay in the first-level cache.
module nocdyn_lane_series
  use nocdyn_kinds, only: wp
  use nocdyn_lane_terms, only: lane_terms_t
  use nocdyn_machine, only: machine_t
  use nocdyn_series_strips, only: begin_strip, expand_strip, gather, gather_laws, strip
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_lane_series

  !> Work space of the recurrence.
  type, public :: lane_series_t
    private
    integer :: order = 0
    integer :: elements = 0
    real(wp), allocatable :: external(:, :, :)   !! series of the time-only elements' moments, [lanes, elements, 0:order]
    ! work space of one strip:
    real(wp), allocatable, dimension(:, :, :) :: speed, angle, square   !! u', u - rest and its square, [strip, 0:order, elements]
    real(wp), allocatable, dimension(:, :) :: restoring, moment         !! present coefficients, [strip, elements]
    real(wp), allocatable :: motion(:, :, :)                            !! coefficients of q', [strip, freedoms, 0:order]
    real(wp), allocatable, dimension(:, :) :: ratio, response           !! coefficients of U and R, [strip, entries]
    real(wp), allocatable :: law(:, :, :)                               !! parameters of the laws, [strip, 5, elements]
    real(wp), allocatable, dimension(:, :) :: rest, start_twist         !! [rad], [strip, elements]
  contains
    procedure :: expand
  end type lane_series_t

contains

  !> Work space for series up to an order.
  function new_lane_series(machine, twists, accelerations, order) result(self)
    type(machine_t), intent(in) :: machine
    type(sparse_map_t), intent(in) :: twists, accelerations   !! U, R
    integer, intent(in) :: order
    type(lane_series_t) :: self

    self%order = order
    self%elements = size(machine%elements%to)
    associate (elements => self%elements)
      allocate (self%external(machine%lanes, elements, 0:order), source=0.0_wp)
      allocate (self%speed(strip, 0:order, elements), source=0.0_wp)
      allocate (self%angle, self%square, source=self%speed)
      allocate (self%restoring(strip, elements), source=0.0_wp)
      allocate (self%moment, self%rest, self%start_twist, source=self%restoring)
      allocate (self%motion(strip, machine%coordinates%freedoms, 0:order), source=0.0_wp)
      allocate (self%ratio(strip, size(twists%column)), self%response(strip, size(accelerations%column)), source=0.0_wp)
      allocate (self%law(strip, 5, elements), source=0.0_wp)
    end associate
  end function new_lane_series

  !> Computes the coefficients number 1 to `order` of q' and q, which follow one another in y.
  subroutine expand(self, machine, terms, twists, accelerations, start_twist, columns, t, y)
    class(lane_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    type(sparse_map_t), intent(in) :: twists                             !! U
    type(sparse_map_t), intent(in) :: accelerations                      !! R
    real(wp), contiguous, intent(in) :: start_twist(:, :)                !! [rad], [lanes, elements]
    integer, intent(in) :: columns                                       !! components of the state
    real(wp), intent(in) :: t(machine%lanes)                             !! [s]
    real(wp), intent(inout) :: y(machine%lanes, columns, 0:self%order)   !! coefficients; number 0 is given
    integer :: l

    call machine%forcing_series(self%order - 1, machine%lanes * self%elements, t, self%external)
    associate (lanes => machine%lanes, f => machine%coordinates%freedoms, n => self%elements, laws => machine%laws, &
               entries => size(twists%column), responses => size(accelerations%column))
      do l = 1, lanes, strip
        call gather(lanes, l, f, y(1, 1, 0), self%motion)
        call gather(lanes, l, entries, twists%coefficient, self%ratio)
        call gather(lanes, l, n, start_twist, self%start_twist)
        call gather(lanes, l, n, laws%rest, self%rest)
        call begin_strip(l, lanes, f, n, self%order, entries, twists%first, twists%column, self%ratio, self%motion, &
                         y(1, f + 1, 0), self%start_twist, self%rest, self%speed, self%angle)
        call gather(lanes, l, responses, accelerations%coefficient, self%response)
        call gather_laws(lanes, l, n, laws%constant, laws%by_speed, laws%by_speed_squared, laws%linear, laws%cubic, self%law)
        call expand_strip(l, lanes, f, n, self%order, terms%is_time_only, terms%has_angle, terms%has_cubic, terms%has_square, &
                          entries, twists%first, twists%column, self%ratio, responses, accelerations%first, &
                          accelerations%column, self%response, self%law, self%external, self%speed, self%angle, self%square, &
                          self%restoring, self%moment, self%motion, columns, y)
      end do
    end associate
  end subroutine expand

end module nocdyn_lane_series
