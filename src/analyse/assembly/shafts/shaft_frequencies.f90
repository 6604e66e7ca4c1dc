!> The highest frequency up to which shafts have to be the ones of the continuum.
module nocdyn_shaft_frequencies
  use nocdyn_constraints, only: constraints_t
  use nocdyn_electrical_faults, only: find_fault_terms
  use nocdyn_element_groups, only: bodies_of, body_index_t
  use nocdyn_fault_excitations, only: fault_terms_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_reached_speeds, only: reached_speeds
  use nocdyn_shaft_segments, only: has_inertia, segments_of, segments_t
  implicit none (type, external)
  private

  public :: highest_frequency, excited_frequency

  real(wp), parameter :: pi = acos(-1.0_wp)
  integer, parameter :: least_modes = 4   ! that are exact where nothing faster is excited
  real(wp), parameter :: reserve = 1.2_wp
  real(wp), parameter :: inertia_orders = 6.0_wp   ! of slider-cranks; the following ones are small
  real(wp), parameter :: cardan_orders = 4.0_wp
  real(wp), parameter :: least_rise = 0.05_wp      ! of the range of a table: less is no oscillation

contains

  !> The fourth lowest of the frequencies n pi / (time of a wave) of all shafts between fixed ends, or 1.2 times the highest
  !> frequency that is excited, if that is higher [rad/s].
  real(wp) function highest_frequency(input, excited) result(frequency)
    type(input_t), intent(in) :: input
    real(wp), intent(in) :: excited   !! [rad/s]
    integer, allocatable :: indices(:)
    real(wp), allocatable :: frequencies(:)
    type(segments_t) :: segments
    integer :: i, n

    allocate (indices, source=input%groups_named('shaft'))
    allocate (frequencies(0))
    frequency = 0.0_wp
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        if (.not. has_inertia(group)) cycle
        segments = segments_of(group)
        frequencies = [frequencies, (n * pi / sum(segments%wave_time), n=1, least_modes)]
      end associate
    end do
    if (size(frequencies) == 0) return
    do i = 1, least_modes
      n = minloc(frequencies, dim=1)
      frequency = frequencies(n)
      frequencies(n) = huge(frequency)
    end do
    frequency = max(frequency, reserve * excited)
  end function highest_frequency

  !> The highest frequency that an input excites [rad/s]. Steps, impacts and joints that lock have none.
  real(wp) function excited_frequency(input, body_index, constraints) result(frequency)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    type(constraints_t), intent(in) :: constraints   !! between the bodies
    real(wp), allocatable :: speeds(:)
    integer :: i

    allocate (speeds, source=reached_speeds(input, body_index, constraints))
    frequency = 0.0_wp
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        select case (group%kind)
        case ('excitation')
          frequency = max(frequency, frequency_of_excitation(group, speed_of('body')))
        case ('response')
          frequency = maxval([frequency, largest(group, 'orders') * largest(group, 'speed'), group%numbers('frequency')])
        case ('engine')
          frequency = max(frequency, order_of_engine(group) * speed_of('cylinders'))
        case ('crank')
          frequency = max(frequency, order_of_crank(group) * speed_of('body'))
        case ('mesh')
          frequency = max(frequency, order_of_mesh(group) * speed_of('bodies'))
        case ('cardan')
          frequency = max(frequency, cardan_orders * speed_of('bodies'))
        case ('motor')
          frequency = max(frequency, frequency_of_motor(group, speed_of('body')))
        case ('drive')
          frequency = maxval([frequency, group%number('frequency', absent=0.0_wp), &
                              half_wave(group%numbers('table_time'), group%numbers('table_speed')), &
                              half_wave(group%numbers('table_time'), group%numbers('table_angle'))])
        case ('relation')
          frequency = max(frequency, speed_of('bodies') * half_wave(group%numbers('table_angle'), group%numbers('table_driven')))
        case default
          cycle
        end select
      end associate
    end do

  contains

    !> The highest speed of the bodies that group i names under a key; of two that it joins the one of the first one.
    real(wp) function speed_of(key)
      character(len=*), intent(in) :: key
      integer, allocatable :: bodies(:)

      allocate (bodies, source=bodies_of(input%groups(i), key, body_index))
      associate (counted => bodies(:merge(1, size(bodies), key == 'bodies')))
        speed_of = maxval([0.0_wp, speeds(pack(counted, counted > 0))])
      end associate
    end function speed_of

  end function excited_frequency

  !> The largest magnitude of the numbers of a key, 0 if it has none.
  pure real(wp) function largest(group, key)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    largest = maxval([0.0_wp, abs(group%numbers(key))])
  end function largest

  !> Of &excitation [rad/s]. Rises and pulses count with the frequency of which they are a whole wave.
  real(wp) function frequency_of_excitation(group, speed) result(frequency)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: speed   !! of its body [rad/s]
    type(fault_terms_t) :: terms
    logical :: has_failed

    select case (group%text('kind'))
    case ('harmonic')
      frequency = group%number('frequency')
    case ('startup')
      frequency = 2.0_wp * group%number('frequency')
    case ('orders')
      frequency = largest(group, 'orders') * speed
    case ('table')
      frequency = half_wave(group%numbers('table_time'), group%numbers('table_torque'))
    case ('ramp', 'pulse')
      frequency = 2.0_wp * pi / group%number('duration')
    case ('fault')
      call find_fault_terms(group, terms, has_failed)
      frequency = terms%frequency * maxval(terms%multiple)
    case default   ! a step
      frequency = 0.0_wp
    end select
  end function frequency_of_excitation

  !> Of a table, pi over the shortest half wave: a rise or a fall of more than a small share of the range, or the steepest part of
  !> one continued over the whole range; 0 of a constant.
  pure real(wp) function half_wave(x, y) result(frequency)
    real(wp), intent(in) :: x(:), y(:)
    real(wp) :: range
    integer :: first, i   ! point where the present rise or fall begins

    frequency = 0.0_wp
    if (size(x) < 2 .or. size(y) /= size(x)) return
    range = maxval(y) - minval(y)
    if (.not. range > 0) return
    associate (rise => y(2:) - y(:size(y) - 1), run => x(2:) - x(:size(x) - 1))
      frequency = maxval(pi * abs(rise) / (range * run))
      first = 1
      do i = 1, size(rise)
        if (i > 1) then
          if (.not. rise(i - 1) * rise(i) > 0) first = i
        end if
        if (i < size(rise)) then
          if (rise(i) * rise(i + 1) > 0) cycle
        end if
        if (abs(y(i + 1) - y(first)) > least_rise * range) frequency = max(frequency, pi / (x(i + 1) - x(first)))
      end do
    end associate
  end function half_wave

  !> The highest order of the torque of an engine.
  pure real(wp) function order_of_engine(group) result(order)
    type(group_t), intent(in) :: group

    order = max(largest(group, 'orders'), merge(inertia_orders, 0.0_wp, group%has_value('reciprocating_mass')))
    if (group%has_value('crank_angles')) order = max(order, group%number('harmonics_up_to'))
  end function order_of_engine

  !> The highest order of a slider-crank.
  pure real(wp) function order_of_crank(group) result(order)
    type(group_t), intent(in) :: group

    order = inertia_orders
    if (group%has_value('crank_angles')) order = max(order, group%number('harmonics_up_to', absent=0.0_wp))
  end function order_of_crank

  !> The highest order of the transmission error of a mesh, in turns of its first body.
  pure real(wp) function order_of_mesh(group) result(order)
    type(group_t), intent(in) :: group

    order = largest(group, 'error_orders')
    if (group%has_value('error_orders') .or. .not. group%has_value('teeth')) return
    associate (teeth => group%whole_numbers('teeth'))
      order = real(size(group%numbers('transmission_error')), wp) * teeth(1)
    end associate
  end function order_of_mesh

  !> Of the pulsations of a motor [rad/s].
  pure real(wp) function frequency_of_motor(group, speed) result(frequency)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: speed   !! of its body [rad/s]

    frequency = 0.0_wp
    select case (group%text('kind'))
    case ('induction_dq')
      frequency = group%number('frequency')
    case ('synchronous')
      frequency = 2.0_wp * group%number('frequency')
    case ('inverter')
      if (group%has_value('harmonics')) frequency = 0.5_wp * group%whole_number('poles') * largest(group, 'harmonics') * speed
    case default
      frequency = 0.0_wp
    end select
  end function frequency_of_motor

end module nocdyn_shaft_frequencies
