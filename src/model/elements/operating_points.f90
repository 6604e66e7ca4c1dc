!> What a law gives at one operating point of one element in the first lane: its branches, the harmonics at a constant speed, the
!> internal states that do not change, the speeds where its branches end. Nothing of the bank changes.
module nocdyn_operating_points
  use nocdyn_described_elements, only: described_elements_t, never, stays_as_mean, time_reached
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_law_points, only: law_point_t, new_law_point
  use nocdyn_law_tape, only: law_inputs_t
  use nocdyn_law_waves, only: law_wave_t, list_waves
  implicit none (type, external)
  private

  public :: waves_at, settle, boundary_speeds

  real(wp), parameter, public :: late = 0.5_wp * never   !! after all that begins [s]

contains

  !> The point at some inputs, on the branches that hold there. Of branches that guards do not choose it is the first one.
  subroutine find_point(bank, element, time, speed, internal, point)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: element       !! numbered within the bank
    real(wp), intent(in) :: time         !! [s]
    real(wp), intent(in) :: speed        !! u' [rad/s]; the angles, and the speed of the phase, are zero
    real(wp), intent(in) :: internal(:)  !! its internal states
    type(law_point_t), intent(out) :: point
    type(law_inputs_t) :: inputs
    integer :: s

    inputs = bank%tape%inputs()
    associate (tape => bank%tape, switches => size(bank%choices) / bank%count)
      point = new_law_point(tape, element, spread(1, 1, switches))
      call set_constants(bank, point)
      if (inputs%time > 0) point%x(inputs%time) = time_reached(time)
      if (inputs%speed > 0) point%x(inputs%speed) = speed
      do s = 1, bank%states
        if (inputs%state(s) > 0) point%x(inputs%state(s)) = internal(s)
      end do
      call point%evaluate(tape, 0)
      do s = 1, switches
        call choose(bank, s, bank%choices(element + bank%count * (s - 1)), point)
      end do
      if (inputs%time > 0) point%x(inputs%time) = time
      call point%evaluate(tape, 0)
    end associate
  end subroutine find_point

  subroutine set_constants(bank, point)
    class(described_elements_t), intent(in) :: bank
    type(law_point_t), intent(inout) :: point

    if (allocated(bank%curve)) then
      call point%set_constants(bank%tape, bank%parameters, bank%curve(1, point%element))
    else
      call point%set_constants(bank%tape, bank%parameters)
    end if
  end subroutine set_constants

  !> Sets one branch to the one that contains the point, as `choose` of `bank_state_t` does.
  subroutine choose(bank, switch, choices, point)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: switch    !! of the element
    integer, intent(in) :: choices   !! as in the type
    type(law_point_t), intent(inout) :: point
    real(wp) :: best, inside
    integer :: i

    if (choices < 0) return
    associate (tape => bank%tape, branch => point%branch(switch))
      if (choices == 0) branch = bank%curve(1, point%element)%segment(point%x(tape%argument))
      best = -huge(best)
      do i = 1, choices
        inside = minval(point%x(tape%guard), mask=tape%guarded_switch == switch .and. &
                        (tape%guarded_branch == i .or. tape%guarded_branch == 0))
        if (inside <= best) cycle
        best = inside
        branch = i
        if (best > 0) exit
      end do
      call set_constants(bank, point)
      call point%evaluate(tape, 0)
    end associate
  end subroutine choose

  !> The harmonics of some nodes at a constant speed, long after all that begins. A torque that decays or ends has some as well.
  subroutine waves_at(bank, element, speed, internal, results, turns, list, kept)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: element       !! numbered within the bank
    real(wp), intent(in) :: speed        !! u' [rad/s]
    real(wp), intent(in) :: internal(:)  !! its internal states
    integer, intent(in) :: results(:)    !! nodes, or 0
    logical, intent(in) :: turns         !! whether the angle of the element advances
    type(law_wave_t), allocatable, intent(out) :: list(:)
    real(wp), intent(in), optional :: kept   !! value of `control`; absent: as the law gives it
    type(law_inputs_t) :: inputs
    type(law_point_t) :: point

    if (bank%steady_part /= stays_as_mean .or. .not. allocated(bank%tape)) then
      allocate (list(0))
      return
    end if
    inputs = bank%tape%inputs()
    associate (tape => bank%tape)
      call find_point(bank, element, late, speed, internal, point)
      if (inputs%time > 0) point%x(inputs%time) = 0.0_wp
      if (present(kept)) point%x(tape%control) = kept
      call point%evaluate(tape, merge(tape%control, 0, present(kept)))
      call list_waves(tape, inputs, point, results, turns, list)
    end associate
  end subroutine waves_at

  !> Replaces internal states by those that do not change at a speed, by Newton's method; linear rates take one step, and one that
  !> finds it exact.
  subroutine settle(bank, element, time, speed, is_decided, internal)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: element         !! numbered within the bank
    real(wp), intent(in) :: time           !! [s]
    real(wp), intent(in) :: speed          !! u' [rad/s]
    logical, intent(in) :: is_decided(:)   !! states that stay as they are
    real(wp), intent(inout) :: internal(:) !! its internal states
    integer, parameter :: most_steps = 50
    real(wp), parameter :: tolerance = 1.0e-13_wp   ! relative to the largest step
    type(law_inputs_t) :: inputs
    type(law_point_t) :: point
    integer :: i, k, pivots(count(.not. is_decided)), unknown(count(.not. is_decided))
    real(wp) :: matrix(size(unknown), size(unknown)), scale, step(size(unknown))
    logical :: is_singular

    unknown = pack([(i, i=1, size(internal))], .not. is_decided)
    internal(unknown) = 0.0_wp
    scale = 0.0_wp
    inputs = bank%tape%inputs()
    associate (tape => bank%tape, state => inputs%state(unknown))
      do i = 1, most_steps
        call find_point(bank, element, time, speed, internal, point)
        do k = 1, size(unknown)
          call point%differentiate(tape, tape%rate(unknown(k)))
          matrix(k, :) = merge(point%slope(state), 0.0_wp, state > 0)
          step(k) = -point%x(tape%rate(unknown(k)))
        end do
        call lu_factor(matrix, pivots, is_singular)
        if (is_singular) return
        call lu_solve(matrix, pivots, step)
        internal(unknown) = internal(unknown) + step
        if (all(abs(step) <= tolerance * scale)) return
        scale = max(scale, maxval(abs(step)))
      end do
    end associate
  end subroutine settle

  !> Speeds at a time between the branches of an element: at the points of a curve over a linear function of the speed alone, and
  !> where guards vanish that are such functions.
  subroutine boundary_speeds(bank, element, time, speeds)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: time     !! [s]
    real(wp), allocatable, intent(out) :: speeds(:)   !! [rad/s]
    real(wp), parameter :: same = 1.0e-12_wp   ! relative
    type(law_point_t) :: point
    real(wp) :: internal(bank%states)
    real(wp), allocatable :: roots(:)
    integer :: i

    allocate (speeds(0), roots(0))
    if (.not. allocated(bank%tape)) return
    internal = 0.0_wp
    call find_point(bank, element, time, 0.0_wp, internal, point)
    associate (tape => bank%tape)
      if (allocated(bank%curve)) roots = roots_of(bank, tape%argument, bank%curve(1, element)%knots(), point)
      do i = 1, size(tape%guard)
        roots = [roots, roots_of(bank, tape%guard(i), [0.0_wp], point)]
      end do
    end associate
    do i = 1, size(roots)
      if (.not. any(abs(speeds - roots(i)) <= same * abs(roots(i)))) speeds = [speeds, roots(i)]
    end do
  end subroutine boundary_speeds

  !> The speeds at which a node has some values, if it is a linear function of the speed alone.
  function roots_of(bank, node, values, point) result(roots)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: node
    real(wp), intent(in) :: values(:)            !! in the unit of the node
    type(law_point_t), intent(inout) :: point    !! without speed
    real(wp), allocatable :: roots(:)
    real(wp), parameter :: none = 1.0e100_wp, rounding = 1.0e-9_wp
    type(law_inputs_t) :: inputs
    real(wp) :: slope, start
    logical :: is_linear

    allocate (roots(0))
    inputs = bank%tape%inputs()
    associate (tape => bank%tape, speed => inputs%speed, one => bank%tape%node(node))
      if (.not. one%has_speed .or. one%has_angle .or. one%has_state) return
      call point%differentiate(tape, node)
      start = point%x(node)
      slope = point%slope(speed)
      if (.not. abs(slope) > 0 .or. abs(start) > none) return
      roots = (values - start) / slope
      associate (last => size(values))
        point%x(speed) = roots(last)
        call point%evaluate(tape, 0)
        is_linear = abs(point%x(node) - values(last)) <= rounding * (abs(start) + abs(values(last)))
      end associate
      if (.not. is_linear) roots = [real(wp) ::]
      point%x(speed) = 0.0_wp
      call point%evaluate(tape, 0)
    end associate
  end function roots_of

end module nocdyn_operating_points
