!> Loads: the viscous resistance of eq. (5), M_r = -c omega.
module nocdyn_loads
  use nocdyn_bank, only: bank_t, role_load
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_loads

  type, extends(bank_t), public :: loads_t
    real(wp), allocatable :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
  contains
    procedure :: evaluate
    procedure :: differentiate
    procedure :: assess
  end type loads_t

contains

  !> A bank of viscous loads, each on one body.
  function new_loads(names, body, viscous) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    real(wp), intent(in) :: viscous(:, :)   !! c [N m s/rad], shape [lanes, loads]
    type(loads_t) :: bank
    integer :: e

    call bank%connect(role_load, size(viscous, 1), names, [(0, e=1, size(body))], body)
    bank%viscous = viscous
  end function new_loads

  subroutine evaluate(self, time, angle, speed, restoring, working)
    class(loads_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)
    real(wp), intent(inout) :: restoring(self%values), working(self%values)

    call viscous_torques(self%values, self%viscous, speed, working)
  end subroutine evaluate

  !> Eq. (5).
  pure subroutine viscous_torques(n, viscous, speed, working)
    integer, intent(in) :: n
    real(wp), intent(in) :: viscous(n), speed(n)
    real(wp), intent(inout) :: working(n)
    integer :: i

    do i = 1, n
      working(i) = -viscous(i) * speed(i)
    end do
  end subroutine viscous_torques

  subroutine differentiate(self, elements)
    class(loads_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements

    elements%working_speed(:, self%first:self%last()) = -self%viscous
  end subroutine differentiate

  !> The coefficients c are those of C, eq. (22).
  subroutine assess(self, elements)
    class(loads_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements

    elements%damping(:, self%first:self%last()) = self%viscous
  end subroutine assess

end module nocdyn_loads
