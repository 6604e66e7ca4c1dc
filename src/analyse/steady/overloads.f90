!> Joints that are taken as locked in a steady state and cannot hold it.
module nocdyn_overloads
  use nocdyn_balance_texts, only: describe_state_speeds
  use nocdyn_constraints, only: constraints_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: quoted, rounded_text
  implicit none (type, external)
  private

  public :: describe_overload

contains

  !> Which joint would slip in a steady state, by how much torque; '' if all hold.
  subroutine describe_overload(formulation, t, y, text)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t         !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [1, states]
    character(len=:), allocatable, intent(out) :: text
    real(wp) :: lambda(formulation%machine%constraints%rows())
    character(len=:), allocatable :: allowed, speeds
    integer :: row

    text = ''
    associate (constraints => formulation%machine%constraints)
      if (all(constraints%least <= -huge(lambda) .and. constraints%most >= huge(lambda))) return
    end associate
    call formulation%observe([t], y)
    call formulation%reactions(1, lambda)
    row = overloaded_row(formulation%machine%constraints, lambda)
    if (row == 0) return
    call describe_state_speeds(formulation, speeds)
    associate (constraints => formulation%machine%constraints)
      allowed = rounded_text(constraints%least(row), 6) // ' to ' // rounded_text(constraints%most(row), 6)
      if (constraints%least(row) <= -huge(lambda)) allowed = 'at most ' // rounded_text(constraints%most(row), 6)
      if (constraints%most(row) >= huge(lambda)) allowed = 'at least ' // rounded_text(constraints%least(row), 6)
      text = 'at ' // speeds // ' ' // constraints%kinds(row)%text // ' ' // quoted(constraints%names(row)%text) // &
             ' does not hold: locked it would carry ' // rounded_text(lambda(row), 6) // ' N m; allowed: ' // allowed
    end associate
  end subroutine describe_overload

  !> The first row whose multiplier is out of its bounds by more than rounding, 0 if there is none.
  pure integer function overloaded_row(constraints, lambda) result(row)
    type(constraints_t), intent(in) :: constraints
    real(wp), intent(in) :: lambda(:)
    real(wp), parameter :: rounding = 1.0e-9_wp
    real(wp) :: shift

    shift = rounding * maxval(abs(lambda))
    do row = 1, size(lambda)
      if (lambda(row) < constraints%least(row) - shift .or. lambda(row) > constraints%most(row) + shift) return
    end do
    row = 0
  end function overloaded_row

end module nocdyn_overloads
