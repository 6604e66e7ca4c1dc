!> Taylor series of the motion of many lanes, by the recurrence of `nocdyn_reduced_series` and to the same bits, for machines
!> whose moments are polynomials or depend on the time alone.
!>
!> A strip of lanes goes through all orders before the next one does. What it needs is gathered first, in one array, so that it
!> stays in the first-level cache and no vector crosses from one line of it to the next.
module nocdyn_lane_series
  use nocdyn_alignment, only: line, numbers_to_multiple
  use nocdyn_kinds, only: wp
  use nocdyn_lane_terms, only: lane_terms_t
  use nocdyn_machine, only: machine_t
  use nocdyn_series_strips, only: begin_strip, expand_strip, gather, gather_laws, strip
  use nocdyn_sparse_map, only: sparse_map_t
  implicit none (type, external)
  private

  public :: new_lane_series

  !> Places in `room` of what belongs to a strip.
  type :: places_t
    integer :: speed, angle, square, restoring, moment       !! of the elements
    integer :: motion                                        !! q' and then q at the start; the coefficients of q'
    integer :: ratio, response, law, rest, start_twist       !! numbers of the machine
  end type places_t

  type, public :: lane_series_t
    private
    integer :: order = 0
    integer :: elements = 0
    real(wp), allocatable :: external(:, :, :)   !! moments of the external elements, [lanes, elements, 0:order]
    real(wp), allocatable :: room(:)
    type(places_t) :: places
  contains
    procedure :: expand
  end type lane_series_t

contains

  !> Room for series up to an order.
  function new_lane_series(machine, twists, accelerations, order) result(self)
    type(machine_t), intent(in) :: machine
    type(sparse_map_t), intent(in) :: twists, accelerations
    integer, intent(in) :: order
    type(lane_series_t) :: self
    integer :: next

    self%order = order
    self%elements = size(machine%elements%to)
    allocate (self%external(machine%lanes, self%elements, 0:order), source=0.0_wp)
    next = 0
    associate (places => self%places, elements => self%elements, coefficients => order + 1)
      call reserve(elements * coefficients, places%speed)
      call reserve(elements * coefficients, places%angle)
      call reserve(elements * coefficients, places%square)
      call reserve(elements, places%restoring)
      call reserve(elements, places%moment)
      call reserve(machine%coordinates%freedoms * coefficients, places%motion)
      call reserve(size(twists%column), places%ratio)
      call reserve(size(accelerations%column), places%response)
      call reserve(5 * elements, places%law)
      call reserve(elements, places%rest)
      call reserve(elements, places%start_twist)
    end associate
    allocate (self%room(next + line), source=0.0_wp)

  contains

    subroutine reserve(strips, place)
      integer, intent(in) :: strips
      integer, intent(out) :: place

      place = next
      next = next + strip * strips
    end subroutine reserve

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
    integer :: begin, l

    call drive(self, machine, t)
    begin = 1 + numbers_to_multiple(self%room, line)
    associate (room => self%room, at => self%places, lanes => machine%lanes, f => machine%coordinates%freedoms, &
               n => self%elements, laws => machine%laws, entries => size(twists%column), &
               responses => size(accelerations%column))
      do l = 1, lanes, strip
        call gather(lanes, l, f, y(1, 1, 0), room(begin + at%motion))
        call gather(lanes, l, entries, twists%coefficient, room(begin + at%ratio))
        call gather(lanes, l, n, start_twist, room(begin + at%start_twist))
        call gather(lanes, l, n, laws%rest, room(begin + at%rest))
        call begin_strip(l, lanes, f, n, self%order, entries, twists%first, twists%column, room(begin + at%ratio), &
                         room(begin + at%motion), y(1, f + 1, 0), room(begin + at%start_twist), room(begin + at%rest), &
                         room(begin + at%speed), room(begin + at%angle))
        call gather(lanes, l, responses, accelerations%coefficient, room(begin + at%response))
        call gather_laws(lanes, l, n, laws%constant, laws%by_speed, laws%by_speed_squared, laws%linear, laws%cubic, &
                         room(begin + at%law))
        call expand_strip(l, lanes, f, n, self%order, terms%is_external, terms%has_angle, terms%has_cubic, terms%has_square, &
                          entries, twists%first, twists%column, room(begin + at%ratio), responses, accelerations%first, &
                          accelerations%column, room(begin + at%response), room(begin + at%law), self%external, &
                          room(begin + at%speed), room(begin + at%angle), room(begin + at%square), &
                          room(begin + at%restoring), room(begin + at%moment), room(begin + at%motion), columns, y)
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
        call bank%drive(self%order - 1, machine%lanes * self%elements, t, self%external(1, bank%first, 0))
      end associate
    end do
  end subroutine drive

end module nocdyn_lane_series
