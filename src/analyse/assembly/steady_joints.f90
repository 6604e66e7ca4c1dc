!> Which freewheels of a machine overrun in its steady state.
!>
!> Each is locked or overruns: a locked one must not pull, and one that overruns must not be overtaken by its first body. From all
!> locked ones on, one at a time is changed that contradicts its state most (principal pivoting of a complementarity problem).
module nocdyn_steady_joints
  use nocdyn_constraint_assembly, only: constraint_groups
  use nocdyn_element_groups, only: bodies_of, body_index_t, new_body_index
  use nocdyn_equilibrium, only: equilibrium_t
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_steady_start, only: find_operating_state
  use nocdyn_steady_views, only: steady_view_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: choose_overruns

  real(wp), parameter :: rounding = 1.0e-9_wp   ! of torques and speeds, relative to the largest

contains

  !> Changes the state of one freewheel if the steady state contradicts it. A machine without a steady state stays as it is.
  subroutine choose_overruns(input, view, machine, is_changed)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(inout) :: view
    type(machine_t), intent(in) :: machine   !! of this input
    logical, intent(out) :: is_changed       !! then the machine is another one
    class(formulation_t), allocatable :: formulation
    type(equilibrium_t), allocatable :: equilibria(:)
    type(error_t), allocatable :: error
    type(string_t), allocatable :: notes(:)
    integer :: freewheel, nearest

    is_changed = .false.
    if (size(input%groups_named('freewheel')) == 0) return
    call find_operating_state(machine, view%at, formulation, equilibria, nearest, notes, error)
    if (allocated(error)) return
    call formulation%observe([view%at], equilibria(nearest)%y)
    freewheel = pulling_freewheel(input, view, formulation)
    if (freewheel == 0) freewheel = overtaken_freewheel(input, view, formulation)
    is_changed = freewheel > 0
    if (is_changed) view%overruns(freewheel) = .not. view%overruns(freewheel)
  end subroutine choose_overruns

  !> The group of the locked freewheel that pulls most, 0 if none does.
  integer function pulling_freewheel(input, view, formulation) result(group)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    class(formulation_t), intent(inout) :: formulation   !! after `observe`
    integer, allocatable :: indices(:)
    real(wp) :: lambda(formulation%machine%constraints%rows()), least, pull
    integer :: r

    group = 0
    allocate (indices, source=constraint_groups(input, view))
    call formulation%reactions(1, lambda)
    least = rounding * maxval([0.0_wp, abs(lambda)])
    do r = 1, size(lambda)
      if (input%groups(indices(r))%kind /= 'freewheel') cycle
      pull = -lambda(r)
      if (input%groups(indices(r))%text('direction') == 'backward') pull = lambda(r)
      if (pull <= least) cycle
      least = pull
      group = indices(r)
    end do
  end function pulling_freewheel

  !> The group of the overrunning freewheel whose first body overtakes the second one most, 0 if none does.
  integer function overtaken_freewheel(input, view, formulation) result(group)
    type(input_t), intent(in) :: input
    type(steady_view_t), intent(in) :: view
    class(formulation_t), intent(in) :: formulation   !! after `observe`
    type(body_index_t) :: body_index
    integer, allocatable :: bodies(:)
    real(wp) :: least, slip
    integer :: i

    group = 0
    body_index = new_body_index(formulation%machine%names)
    least = rounding * maxval(abs(formulation%omega(1, :)))
    do i = 1, size(input%groups)
      if (.not. view%overruns(i)) cycle
      bodies = bodies_of(input%groups(i), 'bodies', body_index)
      slip = formulation%omega(1, bodies(1)) - formulation%omega(1, bodies(2))
      if (input%groups(i)%text('direction') == 'backward') slip = -slip
      if (slip <= least) cycle
      least = slip
      group = i
    end do
  end function overtaken_freewheel

end module nocdyn_steady_joints
