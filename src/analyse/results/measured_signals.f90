!> The signals of a machine that were measured: which one a &measurement is of, and the unit of its values.
module nocdyn_measured_signals
  use nocdyn_column_names, only: explain_no_signal
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_output_units, only: match_signal, unit_of
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: quoted, shortened
  use nocdyn_unit_expressions, only: find_conversion, unit_conversion_t
  implicit none (type, external)
  private

  public :: check_measured_signals, drives_only, find_measured_signal

contains

  !> Refuses measurements of signals that the machine does not have, and in units of other quantities.
  subroutine check_measured_signals(input, signals, diagnostics)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)   !! of the machine, in SI
    type(diagnostics_t), intent(inout) :: diagnostics
    type(unit_conversion_t) :: conversion
    integer, allocatable :: groups(:)
    integer :: i, signal

    allocate (groups, source=input%groups_named('measurement'))
    do i = 1, size(groups)
      if (input%groups(groups(i))%text('kind') == 'frequency' .or. drives_only(input%groups(groups(i)))) cycle
      call find_measured_signal(input, groups(i), signals, signal, conversion, diagnostics)
    end do
  end subroutine check_measured_signals

  !> Whether a measurement names no signal with which it is compared: it may be the torque or the speed of a run.
  pure logical function drives_only(measurement)
    type(group_t), intent(in) :: measurement

    drives_only = measurement%text('kind') == 'series' .and. .not. measurement%has_value('signal')
  end function drives_only

  !> The signal of a measurement, and the conversion of its values to SI.
  subroutine find_measured_signal(input, group, signals, signal, conversion, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group               !! &measurement
    type(signal_t), intent(in) :: signals(:)   !! of the machine, in SI
    integer, intent(out) :: signal             !! index, 0: there is none, which is reported
    type(unit_conversion_t), intent(out) :: conversion
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: hint, message, name, unit
    logical :: is_former, matches
    integer :: index_of_unit

    signal = 0
    associate (measurement => input%groups(group))
      if (.not. measurement%has_value('signal')) then
        call input%report(group, 'name', 'signal is missing; needed: the name of a column of the results, such as ' // &
                          quoted(signals(size(signals) / 2)%name), diagnostics)
        return
      end if
      name = measurement%text('signal')
      do signal = 1, size(signals)
        call match_signal(signals(signal), name, [integer ::], matches, index_of_unit, is_former)
        if (matches) exit
      end do
      if (signal > size(signals)) then
        call explain_no_signal(name, signals, hint)
        call input%report(group, 'signal', 'signal: there is no signal ' // quoted(shortened(name)) // hint, diagnostics)
        signal = 0
        return
      end if
      unit = unit_of(name)   ! of 'omega_motor [rpm]'
      if (measurement%has_value('unit')) unit = measurement%text('unit')
      if (unit == '') return
      call find_conversion(unit, signals(signal)%unit, conversion, message)
      if (message == '') return
      call input%report(group, 'unit', 'unit: ' // message // '; the signal is ' // quoted(signals(signal)%name), diagnostics)
      signal = 0
    end associate
  end subroutine find_measured_signal

end module nocdyn_measured_signals
