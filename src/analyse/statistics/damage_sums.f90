!> The damage of a column in the lanes of a block, from the extremes of its polynomials in the steps.
module nocdyn_damage_sums
  use nocdyn_chebyshev, only: interpolation_t, list_extremes, max_degree
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_kinds, only: wp
  use nocdyn_sn_curves, only: sn_curve_t
  implicit none (type, external)
  private

  !> The cycles of one column from a time on, by one S-N curve.
  type, public :: damage_sum_t
    integer :: column = 0                                !! number among the columns
    integer :: fatigue = 0                               !! index of the &fatigue in the input
    real(wp) :: from = 0.0_wp                            !! [s]
    type(damage_counter_t), allocatable :: counters(:)   !! [lanes]
  contains
    procedure :: allocate_lanes, start, add_value, add_polynomial, finish
  end type damage_sum_t

contains

  !> Makes room for the lanes.
  subroutine allocate_lanes(self, lanes, curve, keeps_classes)
    class(damage_sum_t), intent(inout) :: self
    integer, intent(in) :: lanes
    type(sn_curve_t), intent(in) :: curve
    logical, intent(in) :: keeps_classes   !! whether the cycles are sorted into classes
    integer :: lane

    allocate (self%counters(lanes))
    do lane = 1, lanes
      self%counters(lane)%curve = curve
      if (keeps_classes) allocate (self%counters(lane)%classes)
      call self%counters(lane)%start()
    end do
  end subroutine allocate_lanes

  !> Starts a variant in a lane.
  pure subroutine start(self, lane)
    class(damage_sum_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%counters(lane)%start()
  end subroutine start

  !> The next value of the column, without extremes between it and the one before.
  pure subroutine add_value(self, lane, value)
    class(damage_sum_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: value

    call self%counters(lane)%add(value)
  end subroutine add_value

  !> The values of the column in a step, or a part of it, by the polynomial through those at the nodes.
  pure subroutine add_polynomial(self, rule, lane, values)
    class(damage_sum_t), intent(inout) :: self
    type(interpolation_t), intent(in) :: rule
    integer, intent(in) :: lane
    real(wp), intent(in) :: values(0:rule%degree)   !! at the nodes
    real(wp) :: turns(max_degree)
    integer :: i, turn_count

    associate (counter => self%counters(lane))
      call counter%add(values(0))
      call list_extremes(rule, values, counter%hysteresis(), turns, turn_count)
      do i = 1, turn_count
        call counter%add(turns(i))
      end do
      call counter%add(values(rule%degree))
    end associate
  end subroutine add_polynomial

  !> Counts what is left at the end of a variant.
  pure subroutine finish(self, lane)
    class(damage_sum_t), intent(inout) :: self
    integer, intent(in) :: lane

    call self%counters(lane)%finish()
  end subroutine finish

end module nocdyn_damage_sums
