!> Taylor series of the motion of many lanes, by the recurrence of `nocdyn_reduced_series` and to the same bits, for machines
!> whose moments are polynomials or depend on the time alone.
!>
!> What no lane has had so far is left out: a term of zero changes no bit.
module nocdyn_lane_series
  use nocdyn_kinds, only: wp
  use nocdyn_lane_terms, only: lane_terms_t
  use nocdyn_machine, only: machine_t
  use nocdyn_series_products, only: accelerate_row, add_cubic, add_linear, add_square, begin_speeds, continue_speeds
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_lane_series

  !> Coefficients of the elements.
  type, public :: lane_series_t
    private
    integer :: order = 0
    integer :: elements = 0
    real(wp), allocatable :: angle(:, :, :)      !! u - rest, [lanes, 0:order, elements]
    real(wp), allocatable :: square(:, :, :)     !! (u - rest)^2
    real(wp), allocatable :: speed(:, :, :)      !! u', [lanes, elements, 0:order]
    real(wp), allocatable :: external(:, :, :)   !! moments of the external elements
    real(wp), allocatable :: moment(:, :)        !! present coefficients, [lanes, elements]
    real(wp), allocatable :: start(:, :)         !! u at the start of the step, [lanes, elements]
    real(wp), allocatable :: inverse(:)          !! 1 / k, [order]
  contains
    procedure :: expand
  end type lane_series_t

contains

  !> Room for series up to an order.
  function new_lane_series(machine, order) result(self)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: order
    type(lane_series_t) :: self
    integer :: k

    self%order = order
    self%elements = size(machine%elements%to)
    associate (lanes => machine%lanes, elements => self%elements)
      allocate (self%speed(lanes, elements, 0:order), source=0.0_wp)
      allocate (self%external, source=self%speed)
      allocate (self%angle(lanes, 0:order, elements), source=0.0_wp)
      allocate (self%square, source=self%angle)
      allocate (self%moment(lanes, elements), self%start(lanes, elements), source=0.0_wp)
    end associate
    allocate (self%inverse(order))
    self%inverse(:) = [(1.0_wp / k, k=1, order)]
  end function new_lane_series

  !> The coefficients number 1 to order of q' and q, which follow each other in y.
  subroutine expand(self, machine, terms, twists, accelerations, start_twist, columns, t, y)
    class(lane_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    type(sparse_map_t), intent(in) :: twists          !! U
    type(sparse_map_t), intent(in) :: accelerations   !! R
    real(wp), contiguous, intent(in) :: start_twist(:, :)   !! [lanes, elements]
    integer, intent(in) :: columns
    real(wp), intent(in) :: t(machine%lanes)
    real(wp), intent(inout) :: y(machine%lanes, columns, 0:self%order)
    integer :: i, k

    call drive(self, machine, t)
    associate (lanes => machine%lanes, f => machine%coordinates%freedoms, first => accelerations%first)
      call twists%map_pair(start_twist, y(1, f + 1, 0), y, self%start, self%speed)
      self%angle(:, 0, :) = self%start - machine%laws%rest
      do k = 0, self%order - 1
        call find_moments(self, machine, terms, twists, k, lanes, f, y(1, 1, k))
        do i = 1, f
          call accelerate_row(lanes, f, columns, self%elements, size(accelerations%column), first(i), first(i + 1) - 1, &
                              accelerations%column, accelerations%coefficient, self%inverse(k + 1), self%moment, y(1, i, k))
        end do
      end do
    end associate
  end subroutine expand

  !> The coefficients of the external torques.
  subroutine drive(self, machine, t)
    type(lane_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t(machine%lanes)
    integer :: i

    do i = 1, size(machine%other_banks)
      associate (bank => machine%banks(machine%other_banks(i))%bank)
        call bank%drive(self%order - 1, size(self%moment), t, self%external(1, bank%first, 0))
      end associate
    end do
  end subroutine drive

  !> The moments number k.
  pure subroutine find_moments(self, machine, terms, twists, k, lanes, freedoms, q)
    type(lane_series_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(lane_terms_t), intent(in) :: terms
    type(sparse_map_t), intent(in) :: twists
    integer, intent(in) :: k, lanes, freedoms
    real(wp), intent(in) :: q(lanes, freedoms)   !! coefficients number k of q'
    real(wp) :: inverse
    integer :: before, e

    before = max(k - 1, 0)
    inverse = self%inverse(max(k, 1))
    associate (laws => machine%laws, first => twists%first, n => self%elements)
      do e = 1, n
        if (terms%is_external(e)) then
          self%moment(:, e) = self%external(:, e, k)
          cycle
        end if
        if (k == 0) then
          call begin_speeds(lanes, laws%constant(1, e), laws%by_speed(1, e), self%speed(1, e, 0), self%moment(1, e))
        else
          call continue_speeds(lanes, freedoms, size(twists%column), first(e), first(e + 1) - 1, twists%column, &
                               twists%coefficient, q, laws%by_speed(1, e), self%speed(1, e, k), self%moment(1, e))
        end if
        if (terms%has_square(e)) then
          call add_square(lanes, n, k, laws%by_speed_squared(1, e), self%speed(1, e, 0), self%moment(1, e))
        end if
        if (terms%has_cubic(e)) then
          call add_cubic(lanes, k, inverse, laws%linear(1, e), laws%cubic(1, e), self%speed(1, e, before), self%angle(1, 0, e), &
                         self%square(1, 0, e), self%moment(1, e))
        else if (terms%has_angle(e)) then
          call add_linear(lanes, k, inverse, laws%linear(1, e), self%speed(1, e, before), self%angle(1, k, e), self%moment(1, e))
        end if
      end do
    end associate
  end subroutine find_moments

end module nocdyn_lane_series
