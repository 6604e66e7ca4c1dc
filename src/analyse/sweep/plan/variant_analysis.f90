!> Computes the results of a machine that need no motion.
module nocdyn_variant_analysis
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_analysis_results, only: analysis_crossing, analysis_curve, analysis_damping_ratio, analysis_frequency, &
    analysis_margin, analysis_mode_curve, analysis_peak, analysis_peak_frequency, analysis_peak_speed, analysis_ratio, &
    analysis_result_t
  use nocdyn_campbell, only: analyse_campbell, campbell_t
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_excitation_lines, only: line_order
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_margins, only: operating_distance
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_modes, only: find_machine_modes
  use nocdyn_modes, only: mode_oscillating, mode_t
  use nocdyn_named_analyses, only: assemble_analysed, new_analysis
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_response_analysis, only: analyse_response, response_analysis_t
  use nocdyn_moment_forms, only: kind_along, kind_moment, kind_stress, moment_form_t
  use nocdyn_response_results, only: response_results_t
  use nocdyn_response_summary, only: worst_ratio
  use nocdyn_signals, only: former_name
  use nocdyn_text, only: to_text
  use nocdyn_units, only: from_si, unit_hz
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  public :: analyse_variant, find_campbell, find_valleys, matching_quantities, oscillating_modes, place_of

  integer, parameter, public :: recorded_kinds(*) = [kind_moment]                  !! of an element, what its name records
  integer, parameter, public :: limited_kinds(*) = [kind_moment, kind_stress, kind_along]  !! and whose limits count

contains

  !> Computes the results of one machine. A point of a curve is not a number where the machine has none: no steady state, one that
  !> does not stay, or an overdamped mode.
  subroutine analyse_variant(input, results, values, error, solved)
    type(input_t), intent(in) :: input
    type(analysis_result_t), intent(in) :: results(:)   !! those of reports are left out
    real(wp), intent(out) :: values(:)               !! [results]
    type(error_t), allocatable, intent(out) :: error
    class(analysis_t), allocatable, intent(out), optional :: solved   !! the response, if there are results of its report too
    type(mode_t), allocatable :: modes(:)
    type(response_results_t) :: response
    logical :: is_of_report, is_steady(size(results))
    integer :: i

    values = 0.0_wp
    is_steady = results%statistic == analysis_frequency .or. results%statistic == analysis_damping_ratio
    if (any(is_steady)) then
      call oscillating_modes(input, maxval(results%mode, mask=is_steady), modes, error)
      if (allocated(error)) return
    end if
    if (any(results%mode == 0)) then
      is_of_report = present(solved) .and. any(results%is_reported_by('response'))
      call find_response(input, is_of_report, response, error)
      if (allocated(error)) return
      if (is_of_report) allocate (solved, source=response)
    end if
    if (any(results%is_crossing)) then
      call find_crossings(input, results, values, error)
      if (allocated(error)) return
    end if
    if (any(results%statistic == analysis_mode_curve)) then
      call find_mode_curves(input, results, values, error)
      if (allocated(error)) return
    end if
    do i = 1, size(results)
      associate (one => results(i))
        if (one%statistic == analysis_frequency) values(i) = modes(one%mode)%frequency()
        if (one%statistic == analysis_damping_ratio) values(i) = modes(one%mode)%damping_ratio()
        if (one%mode == 0) call find_response_value(response%analysis, one, values(i), error)
        values(i) = from_si(values(i), one%in_unit)
      end associate
      if (allocated(error)) return
    end do
  end subroutine analyse_variant

  !> The speeds at which orders meet modes, as the diagram of Campbell has them, whether anything excites the orders or not.
  subroutine find_crossings(input, results, values, error)
    type(input_t), intent(in) :: input
    type(analysis_result_t), intent(in) :: results(:)
    real(wp), intent(inout) :: values(:)   !! [results]
    type(error_t), allocatable, intent(out) :: error
    type(campbell_t) :: campbell
    integer :: c, i
    real(wp), allocatable :: orders(:)

    allocate (orders(0))   ! one may come more than once
    do i = 1, size(results)
      if (results(i)%is_crossing) orders = [orders, results(i)%order]
    end do
    call find_campbell(input, campbell, error, orders)
    if (allocated(error)) return
    do i = 1, size(results)
      if (.not. results(i)%is_crossing) cycle
      associate (crossings => campbell%crossings)
        c = findloc(crossings%mode == results(i)%mode .and. abs(orders(crossings%line) - results(i)%order) <= 0, .true., dim=1)
        if (c == 0) then
          call raise(error, exit_failed, 'order ' // to_text(results(i)%order) // ' does not meet mode ' // &
                     to_text(results(i)%mode) // ' in the speeds of &response')
          return
        end if
        values(i) = crossings(c)%speed
        if (results(i)%statistic /= analysis_crossing) values(i) = operating_distance(campbell%settings, crossings(c)%speed)
      end associate
    end do
  end subroutine find_crossings

  !> The response of an input.
  subroutine find_response(input, is_of_report, response, error)
    type(input_t), intent(in) :: input
    logical, intent(in) :: is_of_report   !! whether all of its report is asked for
    type(response_results_t), intent(out) :: response
    type(error_t), allocatable, intent(out) :: error
    class(analysis_t), allocatable :: command
    type(machine_t) :: machine

    call new_analysis('response', command)
    call assemble_analysed('response', command, input, machine, error)
    if (allocated(error)) return
    if (is_of_report) then
      call response%solve(input, machine, analysis_options_t(at='', compares=.false.), error)
    else
      call analyse_response(input, machine, response%analysis, error)
    end if
  end subroutine find_response

  !> The diagram of Campbell of an input.
  subroutine find_campbell(input, campbell, error, orders)
    type(input_t), intent(in) :: input
    type(campbell_t), intent(out) :: campbell
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(in), optional :: orders(:)   !! in place of those of the input
    class(analysis_t), allocatable :: command
    type(machine_t) :: machine

    call new_analysis('campbell', command)
    call assemble_analysed('campbell', command, input, machine, error)
    if (.not. allocated(error)) call analyse_campbell(input, machine, modes_choice_t(), campbell, error, orders)
  end subroutine find_campbell

  !> The frequencies of modes at the speeds of the grid, as nocdyn campbell has them.
  subroutine find_mode_curves(input, results, values, error)
    type(input_t), intent(in) :: input
    type(analysis_result_t), intent(in) :: results(:)
    real(wp), intent(inout) :: values(:)   !! [results]
    type(error_t), allocatable, intent(out) :: error
    type(campbell_t) :: campbell
    integer :: at, i

    call find_campbell(input, campbell, error)
    if (allocated(error)) return
    do i = 1, size(results)
      if (results(i)%statistic /= analysis_mode_curve) cycle
      associate (modes => campbell%modes, mode => results(i)%mode)
        if (mode > modes%modes) then
          call raise(error, exit_failed, 'mode ' // to_text(mode) // ' is recorded, but the number of oscillating modes ' // &
                     'over the speed is ' // to_text(modes%modes))
          return
        end if
        values(i) = ieee_value(0.0_wp, ieee_quiet_nan)
        at = place_of(campbell%settings%speeds(results(i)%point), campbell%speed)
        if (at == 0) cycle
        if (modes%exists(mode, at)) values(i) = from_si(modes%frequency(mode, at), unit_hz)
      end associate
    end do
  end subroutine find_mode_curves

  !> Where a speed is in a list, 0 if it is left out there.
  pure integer function place_of(speed, speeds)
    real(wp), intent(in) :: speed, speeds(:)

    place_of = findloc(abs(speeds - speed) <= 0, .true., dim=1)
  end function place_of

  !> The oscillating modes about the steady state, by their frequencies.
  subroutine oscillating_modes(input, needed, modes, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: needed   !! modes
    type(mode_t), allocatable, intent(out) :: modes(:)
    type(error_t), allocatable, intent(out) :: error
    class(analysis_t), allocatable :: command
    type(machine_t) :: machine
    type(operating_point_t) :: point
    type(linearisation_t) :: linear
    type(mode_t), allocatable :: all_modes(:)
    integer :: found, i, no_elements(0)

    call new_analysis('modes', command)
    call assemble_analysed('modes', command, input, machine, error)
    if (.not. allocated(error)) call find_operating_point(input, machine, 'equilibrium', point, error)
    if (.not. allocated(error)) call find_machine_modes(point, modes_choice_t(), no_elements, linear, all_modes, error)
    if (allocated(error)) return
    allocate (modes(count(all_modes%kind == mode_oscillating)))
    found = 0
    do i = 1, size(all_modes)
      if (all_modes(i)%kind /= mode_oscillating) cycle
      found = found + 1
      modes(found) = all_modes(i)
    end do
    if (size(modes) < needed) call raise(error, exit_failed, 'mode ' // to_text(needed) // &
      ' is recorded, but the number of oscillating modes about the steady state is ' // to_text(size(modes)))
  end subroutine oscillating_modes

  !> One result of a response.
  subroutine find_response_value(analysis, one, value, error)
    type(response_analysis_t), intent(in) :: analysis
    type(analysis_result_t), intent(in) :: one
    real(wp), intent(out) :: value   !! in SI
    type(error_t), allocatable, intent(inout) :: error
    real(wp) :: amplitude(size(analysis%response%points))
    integer :: i, line, peak

    value = 0.0_wp
    line = line_order(analysis%response%lines, one%order)
    call find_curve(analysis, one, line, amplitude, error)
    if (allocated(error)) return
    if (one%statistic == analysis_curve) then
      i = place_of(analysis%settings%speeds(one%point), analysis%response%speeds())
      value = ieee_value(0.0_wp, ieee_quiet_nan)
      if (i > 0) value = amplitude(i)
      return
    end if
    peak = maxloc(amplitude, dim=1, mask=is_between(analysis, one%window))
    if (peak == 0) return   ! no speed there
    associate (speed => analysis%response%points(peak)%state%speed)
      select case (one%statistic)
      case (analysis_peak)
        value = amplitude(peak)
      case (analysis_peak_speed, analysis_peak_frequency)
        value = speed
      case (analysis_margin)
        value = operating_distance(analysis%settings, critical_speed(analysis, line, speed))
      case default   ! analysis_ratio
        value = largest_ratio(analysis, line, &
                              matching_quantities(analysis%response%quantities, one%quantity, limited_kinds))
      end select
    end associate
  end subroutine find_response_value

  !> The amplitude of an order, or the half range of all, of the largest of its quantities at each point of a response.
  subroutine find_curve(analysis, one, line, amplitude, error)
    type(response_analysis_t), intent(in) :: analysis
    type(analysis_result_t), intent(in) :: one
    integer, intent(in) :: line                 !! of its order, 0: all
    real(wp), intent(out) :: amplitude(:)       !! [points]
    type(error_t), allocatable, intent(inout) :: error
    integer, allocatable :: quantities(:)
    integer :: i, k

    allocate (quantities, source=matching_quantities(analysis%response%quantities, one%quantity, recorded_kinds))
    amplitude = 0.0_wp
    if (one%order > 0 .and. line == 0) then
      call raise(error, exit_input, 'order ' // to_text(one%order) // ' is recorded, but no excitation has it')
    else if (size(quantities) == 0) then
      call raise(error, exit_input, one%quantity // ' is recorded, but this machine has no such response')
    end if
    if (allocated(error)) return
    do i = 1, size(amplitude)
      associate (at => analysis%response%points(i))
        do k = 1, size(quantities)
          if (line > 0) amplitude(i) = max(amplitude(i), abs(at%quantity(line, quantities(k))))
          if (line == 0) amplitude(i) = max(amplitude(i), at%half_range(quantities(k)))
        end do
      end associate
    end do
  end subroutine find_curve

  !> The points of a response whose speeds are in a window.
  pure function is_between(analysis, window)
    type(response_analysis_t), intent(in) :: analysis
    real(wp), intent(in) :: window(2)   !! [rad/s]
    logical :: is_between(size(analysis%response%points))
    integer :: i

    do i = 1, size(is_between)
      associate (speed => analysis%response%points(i)%state%speed)
        is_between(i) = speed >= window(1) .and. speed <= window(2)
      end associate
    end do
  end function is_between

  !> The speeds of the valleys between the high peaks of a response, at least half as high as the highest.
  subroutine find_valleys(input, one, valleys, error)
    type(input_t), intent(in) :: input
    type(analysis_result_t), intent(in) :: one           !! of a response
    real(wp), allocatable, intent(out) :: valleys(:)     !! ascending [rad/s]
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: high = 0.5_wp, deep = 0.999_wp   ! of the highest peak; of the lower one of two peaks
    type(response_results_t) :: response
    real(wp), allocatable :: amplitude(:)
    integer :: i, lowest, peak   ! points: the lowest one since the last peak, which is the highest one since the last valley

    allocate (valleys(0))
    call find_response(input, .false., response, error)
    if (allocated(error)) return
    allocate (amplitude(size(response%analysis%response%points)))
    call find_curve(response%analysis, one, line_order(response%analysis%response%lines, one%order), amplitude, error)
    if (allocated(error)) return
    associate (least => high * maxval(amplitude))
      peak = 1
      lowest = 1
      do i = 2, size(amplitude)
        if (min(amplitude(peak), amplitude(i)) * deep > amplitude(lowest) .and. &
            min(amplitude(peak), amplitude(i)) >= least) then
          valleys = [valleys, response%analysis%response%points(lowest)%state%speed]
          peak = i
          lowest = i
        else if (amplitude(i) > amplitude(peak)) then
          peak = i
          lowest = i
        else if (amplitude(i) < amplitude(lowest)) then
          lowest = i
        end if
      end do
    end associate
  end subroutine find_valleys

  !> The critical speed that a peak belongs to, as the table of the response has it; the speed of the peak if there is none near.
  pure real(wp) function critical_speed(analysis, line, peak) result(speed)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: line     !! 0 stands for all
    real(wp), intent(in) :: peak    !! [rad/s]
    real(wp), parameter :: near = 0.02_wp   ! of the critical speed, without damping
    integer :: i
    real(wp) :: least

    speed = peak
    least = huge(1.0_wp)
    do i = 1, size(analysis%crossings)
      associate (crossing => analysis%crossings(i))
        if (line > 0 .and. crossing%line /= line .or. analysis%modes%is_electrical(crossing%mode)) cycle
        associate (distance => abs(crossing%speed - peak) / abs(crossing%speed))
          if (distance > near + 3.0_wp * crossing%damping_ratio .or. distance >= least) cycle
          least = distance
          speed = crossing%speed
        end associate
      end associate
    end do
  end function critical_speed

  !> The largest ratio of some quantities to their limits for continuous operation over the speed.
  pure real(wp) function largest_ratio(analysis, line, quantities) result(ratio)
    type(response_analysis_t), intent(in) :: analysis
    integer, intent(in) :: line            !! 0 stands for all together
    integer, intent(in) :: quantities(:)
    integer :: i, k
    real(wp) :: amplitude

    ratio = 0.0_wp
    do i = 1, size(analysis%response%points)
      associate (point => analysis%response%points(i))
        if (line == 0) then
          do k = 1, size(quantities)
            ratio = max(ratio, worst_ratio(analysis%limits, point, quantities(k)))
          end do
        else
          do k = 1, size(analysis%limits)
            associate (limit => analysis%limits(k))
              if (all(limit%quantity /= quantities)) cycle
              amplitude = abs(point%quantity(line, limit%quantity))
              ratio = max(ratio, limit%ratio(point%state%speed, amplitude, 0.0_wp), &
                          limit%curve_ratio(point%frequency(line), amplitude))
            end associate
          end do
        end if
      end associate
    end do
  end function largest_ratio

  !> The quantities that a name stands for: a column, or the ones of some kinds of an element; else a column that had this name.
  pure function matching_quantities(quantities, name, kinds) result(matching)
    type(moment_form_t), intent(in) :: quantities(:)
    character(len=*), intent(in) :: name
    integer, intent(in) :: kinds(:)   !! quantity_..., of an element
    integer, allocatable :: matching(:)
    character(len=:), allocatable :: former
    integer :: q

    matching = pack([(q, q=1, size(quantities))], [(quantities(q)%name == name .or. any(quantities(q)%kind == kinds) .and. &
                                                    quantities(q)%element == name, q=1, size(quantities))])
    if (size(matching) > 0 .or. name == '') return
    do q = 1, size(quantities)
      call former_name(quantities(q)%signal_t, .true., former)
      if (former == name) matching = [q]
    end do
  end function matching_quantities

end module nocdyn_variant_analysis
