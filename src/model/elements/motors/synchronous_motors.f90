!> Synchronous motors that start asynchronously, by their cages: a mean torque and a pulsation over the slip.
!>
!> With the slip s = 1 - p u' / w and the angle w t - p u between the field and the rotor, p pole pairs, the torque is
!> mean(s) + pulsation(s) sin(2 (w t - p u) + phase), at twice the slip frequency. If T_d and T_q are the torques that the motor
!> would have with the circuits of one axis on both, mean = (T_d + T_q) / 2, and the part of the pulsation by the resistances is
!> (T_d - T_q) / 2; that by the difference of the reactances comes on top of it, so that a curve of the pulsation is better where
!> there is one. (C. Concordia, Synchronous Machines, 1951, on starting; R_s is neglected.)
!> Both are linear between the points of a table; below its least slip with the slope there, above its largest constant.
module nocdyn_synchronous_motors
  use nocdyn_bank, only: bank_t, role_motor
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, literal, node_of, operator(*), operator(+), operator(-), &
    operator(/), pick, speed_of, time_of
  use nocdyn_law_functions, only: add_guard, sin
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: new_synchronous_motors

  type, extends(bank_t), public :: synchronous_motors_t
    integer, private :: segments = 1            !! between, below and above the points
  contains
    procedure :: describe
    procedure :: extremes
  end type synchronous_motors_t

contains

  !> A bank of motors, each on one body.
  function new_synchronous_motors(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(synchronous_motors_t) :: bank
    integer :: e

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_motor, keys)
    call bank%add_key(keys, 'frequency')
    call bank%add_parameter('pole pairs', 0.5_wp * keys%values('poles'), is_key=.false.)
    call bank%add_parameter('direction', 1.0_wp - 2.0_wp * keys%values('reversed'), is_key=.false.)
    call bank%add_key(keys, 'phase')
    bank%segments = 1 + max(1, keys%longest('slips'))
    call add_pieces(bank, keys)
    call bank%add_switches([('point in the table', e=1, bank%count)], bank%segments)
    call bank%prepare_law()
  end function new_synchronous_motors

  !> Adds the slip at the begin of each segment, sorted by segments, and the values and slopes of both torques.
  subroutine add_pieces(bank, keys)
    type(synchronous_motors_t), intent(inout) :: bank
    class(element_keys_t), intent(in) :: keys
    real(wp), dimension(bank%lanes, bank%count, bank%segments) :: begin, mean, mean_slope, pulsation, pulsation_slope
    real(wp), allocatable, dimension(:) :: direct, means, pulsations, quadrature, slips
    integer :: e, lane

    do e = 1, bank%count
      do lane = 1, bank%lanes
        slips = keys%numbers('slips', lane, e)
        means = keys%numbers('mean_torques', lane, e)
        pulsations = keys%numbers('pulsations', lane, e)
        if (size(means) == 0) then
          direct = keys%numbers('d_torques', lane, e)
          quadrature = keys%numbers('q_torques', lane, e)
          means = 0.5_wp * (direct + quadrature)
          pulsations = 0.5_wp * (direct - quadrature)
        end if
        call divide(slips, means, begin(lane, e, :), mean(lane, e, :), mean_slope(lane, e, :))
        call divide(slips, pulsations, begin(lane, e, :), pulsation(lane, e, :), pulsation_slope(lane, e, :))
      end do
    end do
    call bank%add_parts('slip', begin)
    call bank%add_parts('mean', mean)
    call bank%add_parts('mean slope', mean_slope)
    call bank%add_parts('pulsation', pulsation)
    call bank%add_parts('pulsation slope', pulsation_slope)
  end subroutine add_pieces

  !> Begins, values and slopes of the segments. Those that a table lacks begin behind all slips.
  pure subroutine divide(slip, torque, begin, value, slope)
    real(wp), intent(in) :: slip(:), torque(:)   ! [points]
    real(wp), intent(out) :: begin(:), value(:), slope(:)   ! [segments]
    integer :: n

    n = size(slip)
    begin = huge(begin)
    value = torque(n)
    slope = 0.0_wp
    begin(:n + 1) = [slip(1), slip]
    value(:n + 1) = [torque(1), torque]
    slope(2:n) = (torque(2:) - torque(:n - 1)) / (slip(2:) - slip(:n - 1))
    slope(1) = slope(2)
  end subroutine divide

  subroutine describe(self, tape)
    class(synchronous_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: edge, frequency, pole_pairs, slip, torque, width
    integer :: s

    frequency = self%parameter(tape, 'frequency')
    pole_pairs = self%parameter(tape, 'direction') * self%parameter(tape, 'pole pairs')
    slip = 1.0_wp - (pole_pairs / frequency) * speed_of(tape)
    torque = on_segment(self, tape, 'mean', slip) + on_segment(self, tape, 'pulsation', slip) &
             * sin(2.0_wp * (frequency * time_of(tape) - pole_pairs * angle_of(tape)) + self%parameter(tape, 'phase'))
    tape%applied = node_of(self%parameter(tape, 'direction') * torque)
    width = literal(tape, boundary_width)
    do s = 2, self%segments
      edge = self%parameter(tape, 'slip', self%part_columns(s))
      call add_guard(1, s - 1, edge - slip, width)
      call add_guard(1, s, slip - edge, width)
    end do
  end subroutine describe

  !> One of the torques at a slip.
  function on_segment(self, tape, name, slip) result(torque)
    class(synchronous_motors_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    type(expression_t), intent(in) :: slip
    type(expression_t) :: torque
    integer :: s

    torque = pick(1, [(self%parameter(tape, name, self%part_columns(s)), s=1, self%segments)]) &
             + pick(1, [(self%parameter(tape, name // ' slope', self%part_columns(s)), s=1, self%segments)]) &
             * (slip - pick(1, [(self%parameter(tape, 'slip', self%part_columns(s)), s=1, self%segments)]))
  end function on_segment

  !> The synchronous speed.
  function extremes(self, element, t) result(speeds)
    class(synchronous_motors_t), intent(in) :: self
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    real(wp), allocatable :: speeds(:)

    speeds = [self%parameters(self%number_of('frequency'))%value(1, element) &
              * self%parameters(self%number_of('direction'))%value(1, element) &
              / self%parameters(self%number_of('pole pairs'))%value(1, element)]
  end function extremes

end module nocdyn_synchronous_motors
