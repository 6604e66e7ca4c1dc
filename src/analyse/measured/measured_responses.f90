!> Measured orders and peaks beside the forced response, at the measured speeds.
module nocdyn_measured_responses
  use nocdyn_comparisons, only: comparison_t, new_comparison
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_excitation_lines, only: line_order
  use nocdyn_forced_response, only: forced_response_t, new_forced_response
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_machine, only: machine_t
  use nocdyn_measurements, only: measured_order, measured_peak, measurement_t, peak_half_range, peak_largest, peak_smallest, &
    read_measurements
  use nocdyn_signals, only: list_signals, signal_speed, signal_t
  use nocdyn_synthesis, only: new_synthesis
  use nocdyn_text, only: quoted, to_text
  implicit none (type, external)
  private

  public :: compare_responses, respond_at

contains

  !> Compares the orders, and the peaks that were measured at a speed, of an input with the response of its machine.
  subroutine compare_responses(input, machine, body, comparisons, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane, with its periodic torques
    integer, intent(in) :: body              !! of &response
    type(comparison_t), allocatable, intent(out) :: comparisons(:)
    type(error_t), allocatable, intent(out) :: error   !! names the measurement
    type(measurement_t), allocatable :: list(:)
    type(signal_t), allocatable :: signals(:)
    real(wp), allocatable :: computed(:), measured(:), speeds(:)
    logical, allocatable :: has_state(:)
    integer :: i, n

    call list_signals(machine, signals)
    call read_measurements(input, [measured_order, measured_peak], signals, list, error)
    if (allocated(error)) return
    allocate (comparisons(count(list%kind == measured_order .or. abs(list%speed) > 0.0_wp)))
    n = 0
    do i = 1, size(list)
      if (list(i)%kind == measured_peak .and. .not. abs(list(i)%speed) > 0.0_wp) cycle   ! of a run
      if (list(i)%kind == measured_peak) then
        speeds = [list(i)%speed]
        measured = list(i)%values
      else
        call take_ascending(list(i), speeds, measured)
      end if
      call respond_at(machine, body, list(i), signals(list(i)%signal), speeds, computed, has_state, error)
      if (allocated(error)) then
        error%message = input%location(list(i)%group) // ': ' // error%message
        return
      end if
      n = n + 1
      comparisons(n) = new_comparison(list(i), pack(speeds, has_state), pack(measured, has_state), pack(computed, has_state))
      comparisons(n)%outside = size(list(i)%values) - count(has_state)
    end do
  end subroutine compare_responses

  !> The amplitudes in the range of speeds, ascending by the size of the speed.
  pure subroutine take_ascending(m, speeds, amplitudes)
    type(measurement_t), intent(in) :: m
    real(wp), allocatable, intent(out) :: speeds(:), amplitudes(:)
    integer :: order(size(m%abscissa))
    logical :: is_inside(size(order))

    order = ascending_order(abs(m%abscissa))
    is_inside = m%abscissa(order) >= m%from .and. m%abscissa(order) <= m%until
    allocate (speeds, source=pack(m%abscissa(order), is_inside))
    allocate (amplitudes, source=pack(m%values(order), is_inside))
  end subroutine take_ascending

  !> Amplitudes of an order of a signal, or its peaks, at speeds.
  subroutine respond_at(machine, body, m, signal, speeds, computed, has_state, error)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    type(measurement_t), intent(in) :: m       !! an order or a peak
    type(signal_t), intent(in) :: signal
    real(wp), intent(in) :: speeds(:)          !! ascending by their size [rad/s]
    real(wp), allocatable, intent(out) :: computed(:)
    logical, allocatable, intent(out) :: has_state(:)   !! whether there is a steady state at each speed
    type(error_t), allocatable, intent(out) :: error
    type(forced_response_t) :: response
    logical :: bodies(machine%bodies)
    integer :: i, line, p, q
    real(wp) :: failed_speed

    allocate (computed(size(speeds)), source=0.0_wp)
    allocate (has_state(size(speeds)), source=.false.)
    if (size(speeds) == 0) return
    if (any(speeds * speeds(1) <= 0.0_wp)) then
      call raise(error, exit_input, 'speeds of both signs, or 0; needed: one sign')
      return
    end if
    call new_forced_response(machine, body, speeds, response, error)
    if (allocated(error)) return
    line = 0
    if (m%kind == measured_order) then
      line = line_order(response%lines, m%order)
      if (line == 0) then
        call raise(error, exit_input, 'order = ' // to_text(m%order) // ': nothing excites this order')
        return
      end if
    end if
    do q = size(response%quantities), 1, -1
      if (response%quantities(q)%name == signal%name) exit
    end do
    bodies = .false.
    if (q == 0) then
      if (signal%source%kind == signal_speed .or. signal%name(:min(4, len(signal%name))) == 'phi_') then
        bodies(signal%source%index) = m%kind == measured_order
      end if
      if (.not. any(bodies)) then
        call raise(error, exit_input, 'signal = ' // quoted(signal%name) // ' is not among the quantities of a response; ' // &
                   'allowed: moments, stresses, forces and reactions, for orders also phi and omega of bodies')
        return
      end if
    end if
    call response%keep([(i == q, i=1, size(response%quantities))], bodies)
    response%synthesis = new_synthesis(response%lines%order, response%lines%family)
    call response%add_points(speeds, .true., error, failed_speed)
    if (allocated(error)) return
    p = 1
    do i = 1, size(speeds)
      if (p > size(response%points)) exit
      associate (point => response%points(p))
        if (abs(point%state%speed - speeds(i)) > 0.0_wp) cycle
        has_state(i) = .true.
        p = p + 1
        if (m%kind == measured_order .and. q > 0) then
          computed(i) = abs(point%quantity(line, 1))
        else if (m%kind == measured_order) then
          computed(i) = abs(point%angle(line, response%angle_place(signal%source%index)))
          if (signal%source%kind == signal_speed) computed(i) = computed(i) * point%frequency(line)
        else if (m%statistic == peak_half_range) then
          computed(i) = point%half_range(1)
        else if (m%statistic == peak_largest) then
          computed(i) = point%mean(1) + point%highest(1)
        else if (m%statistic == peak_smallest) then
          computed(i) = point%mean(1) + point%lowest(1)
        else
          computed(i) = point%mean(1)
        end if
      end associate
    end do
  end subroutine respond_at

end module nocdyn_measured_responses
