!> The damage that a signal does, by Miner's rule, from its cycles by rainflow counting.
!>
!> The signal comes as values one after the other, among them all of its extremes. Ranges below a small part of its largest
!> magnitude are rounding and errors of the integration; they are left out.
module nocdyn_damage_counters
  use nocdyn_cycle_classes, only: cycle_classes_t
  use nocdyn_kinds, only: wp
  use nocdyn_rainflow, only: rainflow_t
  use nocdyn_sn_curves, only: sn_curve_t
  implicit none (type, external)
  private

  real(wp), parameter, public :: least_range = 1.0e-5_wp   !! as a share of the largest magnitude so far

  type, extends(rainflow_t), public :: damage_counter_t
    type(sn_curve_t) :: curve
    type(cycle_classes_t), allocatable :: classes   !! not allocated: cycles are only summed up
    real(wp) :: damage = 0.0_wp, cycles = 0.0_wp    !! sums; complete after `finish`
    real(wp) :: largest_range = 0.0_wp, mean_of_largest = 0.0_wp
    logical :: has_failed = .false.                 !! whether a mean has left no strength
    logical :: has_begun = .false.
    real(wp), private :: candidate = 0.0_wp         !! the last extreme, if the signal turns there
    real(wp), private :: magnitude = 0.0_wp         !! largest so far
    integer, private :: direction = 0               !! in which the signal goes: 1, -1; 0: it has not moved
  contains
    procedure :: count_cycle, start, add, finish, hysteresis
  end type damage_counter_t

contains

  !> Forgets the signal so far.
  pure subroutine start(self)
    class(damage_counter_t), intent(inout) :: self

    call self%start_count()
    self%damage = 0.0_wp
    self%cycles = 0.0_wp
    self%largest_range = 0.0_wp
    self%mean_of_largest = 0.0_wp
    self%has_failed = .false.
    self%has_begun = .false.
    self%magnitude = 0.0_wp
    self%direction = 0
  end subroutine start

  !> Ranges up to this one are left out.
  pure real(wp) function hysteresis(self)
    class(damage_counter_t), intent(in) :: self

    hysteresis = least_range * self%magnitude
  end function hysteresis

  !> The next value of the signal.
  pure subroutine add(self, value)
    class(damage_counter_t), intent(inout) :: self
    real(wp), intent(in) :: value

    self%magnitude = max(self%magnitude, abs(value))
    if (.not. self%has_begun) then
      self%has_begun = .true.
      self%candidate = value
    else if (self%direction == 0) then
      if (abs(value - self%candidate) <= self%hysteresis()) return
      call self%add_point(self%candidate)
      self%direction = merge(1, -1, value > self%candidate)
      self%candidate = value
    else if (self%direction * (value - self%candidate) >= 0) then
      self%candidate = value
    else if (abs(value - self%candidate) > self%hysteresis()) then
      call self%add_point(self%candidate)
      self%direction = -self%direction
      self%candidate = value
    end if
  end subroutine add

  !> Ends the signal: counts what is left.
  pure subroutine finish(self)
    class(damage_counter_t), intent(inout) :: self

    if (self%direction /= 0) call self%add_point(self%candidate)
    call self%finish_count()
    self%direction = 0
    self%has_begun = .false.
  end subroutine finish

  pure subroutine count_cycle(self, range, mean, weight)
    class(damage_counter_t), intent(inout) :: self
    real(wp), intent(in) :: range, mean, weight
    real(wp) :: damage

    damage = weight * self%curve%damage_of(range, mean)
    self%damage = self%damage + damage
    self%cycles = self%cycles + weight
    self%has_failed = self%has_failed .or. self%curve%fails_at_once(mean)
    if (range > self%largest_range) then
      self%largest_range = range
      self%mean_of_largest = mean
    end if
    if (allocated(self%classes)) call self%classes%add(range, mean, weight, damage)
  end subroutine count_cycle

end module nocdyn_damage_counters
