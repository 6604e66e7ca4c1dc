!> Rubber couplings whose stiffness depends on the mean torque: the moment over the twist that has this stiffness.
module nocdyn_rubber_couplings
  use nocdyn_couplings, only: coupling_common_t
  use nocdyn_curves, only: curve_t, new_curve_by_slopes
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(-)
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_table_couplings, only: set_table, table_couplings_t
  use nocdyn_tables, only: curve_slope
  implicit none (type, external)
  private

  public :: new_rubber_couplings, torque_curve

  !> M_el = -curve(w) on the second body. The viscous damping in place of the relative one is in proportion to the slope of the
  !> curve, so that the relative damping over the time is the same at every mean torque.
  type, extends(table_couplings_t), public :: rubber_couplings_t
  contains
    procedure :: describe, stand_in
  end type rubber_couplings_t

contains

  !> Couplings with a table over the mean torque.
  function new_rubber_couplings(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(rubber_couplings_t) :: bank
    type(coupling_common_t) :: shared
    type(curve_t) :: curve(keys%lanes, size(keys%names))
    real(wp), dimension(keys%lanes, size(keys%names)) :: stiffness, viscous
    integer :: e, lane

    shared = coupling_common_t(keys)
    stiffness = keys%values('stiffness')
    viscous = keys%values('damping')
    do e = 1, size(curve, 2)
      do lane = 1, size(curve, 1)
        curve(lane, e) = torque_curve(keys%numbers('table_torque', lane, e), &
                                      stiffness(lane, e) * keys%numbers('torque_stiffness', lane, e))
      end do
    end do
    call set_table(bank, shared, curve)
    call bank%add_parameter('damping_time', (shared%damping - viscous) / stiffness, is_key=.false.)
    bank%parameters(bank%number_of('damping'))%value(:, :) = viscous
    call bank%prepare_law()
  end function new_rubber_couplings

  !> The elastic moment over the twist whose slope is a stiffness at some moments, in both directions: between them the stiffness
  !> is linear in the twist, so that u_2 - u_1 = 2 (M_2 - M_1) / (k_1 + k_2); below the first moment and above the last one it
  !> stays.
  function torque_curve(torque, stiffness) result(curve)
    real(wp), intent(in) :: torque(:)      !! ascending, 0 or more, at least 2 [N m]
    real(wp), intent(in) :: stiffness(:)   !! positive, of each [N m/rad]
    type(curve_t) :: curve
    real(wp), allocatable :: moment(:), slope(:), twist(:)
    integer :: i, n

    n = size(torque)
    allocate (twist(n))
    twist(1) = torque(1) / stiffness(1)
    do i = 2, n
      twist(i) = twist(i - 1) + 2.0_wp * (torque(i) - torque(i - 1)) / (stiffness(i - 1) + stiffness(i))
    end do
    associate (first => merge(1, 2, torque(1) > 0))   ! 0 occurs once
      allocate (moment, source=[-torque(n:first:-1), torque])
      allocate (slope, source=[stiffness(n:first:-1), stiffness])
      curve = new_curve_by_slopes([-twist(n:first:-1), twist], moment, slope)
    end associate
  end function torque_curve

  subroutine describe(self, tape)
    class(rubber_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: damping

    call self%table_couplings_t%describe(tape)
    damping = self%parameter(tape, 'damping_time') * curve_slope(tape, self%twist_from_rest(tape))
    tape%applied = node_of(-(damping * self%twist_speed(tape)))
  end subroutine describe

  !> The damping in place of the relative one where the curve has a slope.
  pure function stand_in(self, stiffness) result(damping)
    class(rubber_couplings_t), intent(in) :: self
    real(wp), intent(in) :: stiffness(:)   !! slopes [N m/rad], [elements]
    real(wp) :: damping(size(stiffness))

    damping = self%parameters(self%number_of('damping_time'))%value(1, :) * stiffness
  end function stand_in

end module nocdyn_rubber_couplings
