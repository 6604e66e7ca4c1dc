!> A root between two arguments at which a function has different signs.
!>
!> The caller evaluates the function at `next()` and gives the value to `narrow`, until the bracket `is_narrow`. The arguments
!> follow regula falsi with the Illinois rule (M. Dowell, P. Jarratt, BIT 11 (1971) 168-174); where it has not halved the bracket
!> enough in two steps, the argument is the middle. A jump or a kink is found like a root.
module nocdyn_brackets
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: have_same_sign, new_bracket

  type, public :: bracket_t
    real(wp) :: x(2)       !! the ends, ascending or not
    real(wp) :: value(2)   !! of the function there, of different signs
    real(wp), private :: weight(2)         ! values, of which the one of an end that stays is halved
    real(wp), private :: old_width = 0.0_wp
    integer, private :: steps = 0          ! since the width was compared
    integer, private :: moved = 0          ! end that was replaced last
    logical, private :: bisects = .false.
  contains
    procedure :: next, narrow, is_narrow, root
  end type bracket_t

contains

  !> A bracket.
  pure type(bracket_t) function new_bracket(x, value) result(self)
    real(wp), intent(in) :: x(2), value(2)   !! arguments, values with different signs; any units

    self%x = x
    self%value = value
    self%weight = value
    self%old_width = abs(x(2) - x(1))
  end function new_bracket

  !> Whether two values are both positive or both negative; their product might overflow.
  pure logical function have_same_sign(one, other)
    real(wp), intent(in) :: one, other   !! of any unit

    have_same_sign = (one > 0.0_wp .and. other > 0.0_wp) .or. (one < 0.0_wp .and. other < 0.0_wp)
  end function have_same_sign

  !> The argument at which the function is to be evaluated.
  pure real(wp) function next(self) result(x)
    class(bracket_t), intent(in) :: self
    real(wp) :: least, share, width
    integer :: near   ! end from which the argument is counted, so that it has no rounding of the other one

    near = minloc(abs(self%weight), dim=1)
    width = self%x(3 - near) - self%x(near)
    ! next to an end that is the root to rounding, a point beyond it narrows the bracket at once
    least = 2.0_wp * spacing(abs(self%x(near))) / abs(width)
    share = max(least, self%weight(near) / (self%weight(near) - self%weight(3 - near)))
    if (self%bisects .or. .not. share < 0.5_wp) share = 0.5_wp
    x = self%x(near) + share * width
  end function next

  !> Replaces the end at which the function has the sign of its value at the argument.
  pure subroutine narrow(self, x, value)
    class(bracket_t), intent(inout) :: self
    real(wp), intent(in) :: x, value
    integer :: end

    end = merge(1, 2, value * sign(1.0_wp, self%value(1)) > 0.0_wp)
    if (self%moved == end) self%weight(3 - end) = 0.5_wp * self%weight(3 - end)
    self%moved = end
    self%x(end) = x
    self%value(end) = value
    self%weight(end) = value
    self%steps = self%steps + 1
    self%bisects = .false.
    if (self%steps < 2) return
    self%bisects = abs(self%x(2) - self%x(1)) > 0.25_wp * self%old_width
    self%old_width = abs(self%x(2) - self%x(1))
    self%steps = 0
  end subroutine narrow

  !> Whether no argument is left between the ends, or an end is a root.
  pure logical function is_narrow(self)
    class(bracket_t), intent(in) :: self

    is_narrow = any(abs(self%value) <= 0.0_wp) .or. abs(self%x(2) - self%x(1)) <= spacing(maxval(abs(self%x)))
  end function is_narrow

  !> The end with the smaller value.
  pure real(wp) function root(self) result(x)
    class(bracket_t), intent(in) :: self

    x = self%x(minloc(abs(self%value), dim=1))
  end function root

end module nocdyn_brackets
