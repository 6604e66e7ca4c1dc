!> Statistics of columns of trajectory.csv: their kinds, and the labels of the results of a sweep.
module nocdyn_statistics
  use nocdyn_kinds, only: wp
  use nocdyn_sn_curves, only: sn_curve_t
  use nocdyn_signals, only: find_signal, signal_t, signal_work_in
  use nocdyn_text, only: to_text
  use nocdyn_units, only: units
  implicit none (type, external)
  private

  public :: new_statistic, new_fatigue_statistic, find_columns, is_of_fatigue, is_time_of_extreme, is_torque, &
    needs_work_integrals, value_of_zero_column

  integer, parameter, public :: statistic_final = 1           !! at the end
  integer, parameter, public :: statistic_max = 2             !! in continuous time, as all statistics
  integer, parameter, public :: statistic_min = 3
  integer, parameter, public :: statistic_max_abs = 4
  integer, parameter, public :: statistic_mean = 5            !! over time
  integer, parameter, public :: statistic_rms = 6             !! root of the mean square
  integer, parameter, public :: statistic_time_of_max = 7     !! when the largest value is first reached
  integer, parameter, public :: statistic_time_of_min = 8     !! when the smallest value is first reached
  integer, parameter, public :: statistic_time_of_max_abs = 9 !! when the largest magnitude is first reached
  integer, parameter, public :: statistic_settling_time = 10  !! until the last exit from the band, counted from `from`

  integer, parameter, public :: statistic_damage = 11         !! of a &fatigue, by its cycles
  integer, parameter, public :: statistic_cycles = 12         !! their number

  character(len=*), parameter, public :: statistic_names(12) = [character(len=15) :: 'final', 'max', 'min', 'max_abs', 'mean', &
    'rms', 'time_of_max', 'time_of_min', 'time_of_max_abs', 'settling_time', 'damage', 'cycles']
  real(wp), parameter :: default_band = 0.02_wp

  character(len=*), parameter :: descriptions(12) = [character(len=34) :: 'at the end', 'largest value', 'smallest value', &
    'largest absolute value', 'mean over time', 'root mean square over time', 'time of the largest value', &
    'time of the smallest value', 'time of the largest absolute value', 'settling time', 'damage by Miner''s rule', &
    'number of cycles']

  !> A result of each variant: a statistic of a column x from the time `from` on. The settling time ends when
  !> |x - x_end| <= band |x(from) - x_end| from then on. Variants of another structure have other columns, in another order.
  type, public :: statistic_t
    integer :: result = 0                            !! its number among the results of a variant
    type(signal_t), allocatable :: signal            !! of the column; not allocated in runs, whose columns are known
    integer :: column = 0                            !! in the trajectory table of one machine, 0 if that has none
    integer :: kind = statistic_final                !! statistic_...
    real(wp) :: from = 0.0_wp                        !! [s]
    real(wp) :: band = default_band                  !! for settling_time only
    integer :: fatigue = 0                           !! index of the &fatigue in the input, 0: none
    type(sn_curve_t), allocatable :: curve           !! of that; not allocated without a fatigue
    logical :: keeps_classes = .false.               !! whether its cycles are sorted into classes
    character(len=:), allocatable :: shaft           !! its shaft, all of whose points count; not allocated: the signal counts
    logical :: is_stress = .false.                   !! whether that is its stress, not its moment
    character(len=:), allocatable :: label           !! e.g. 'moment_shaft_max_abs_from_2'
    character(len=:), allocatable :: unit            !! e.g. 'N m'
    integer :: in_unit = 0                           !! this unit as index of `units`, 0: SI
    character(len=:), allocatable :: long_name       !! a description
  end type statistic_t

contains

  !> The statistic of a signal.
  type(statistic_t) function new_statistic(signals, column, kind, t_start, from, band, unit, of_magnitude) result(self)
    type(signal_t), intent(in) :: signals(:)    !! of the trajectory table
    integer, intent(in) :: column, kind
    real(wp), intent(in) :: t_start             !! [s]
    real(wp), intent(in), optional :: from      !! [s]; t_start if absent
    real(wp), intent(in), optional :: band      !! of a settling time; `default_band` if absent
    integer, intent(in), optional :: unit       !! of its values: index of `units`; absent: SI
    logical, intent(in), optional :: of_magnitude   !! whether `time_of_max` is of the largest magnitude; absent: it is not

    self%signal = signals(column)
    self%column = column
    self%kind = kind
    if (present(of_magnitude) .and. kind == statistic_time_of_max) then
      if (of_magnitude) self%kind = statistic_time_of_max_abs
    end if
    self%from = t_start
    if (present(band)) self%band = band
    self%label = self%signal%name // '_' // trim(statistic_names(kind))
    self%unit = self%signal%unit
    self%long_name = self%signal%name // ', ' // trim(descriptions(self%kind))
    if (is_time_of_extreme(kind) .or. kind == statistic_settling_time) then
      self%unit = 's'
    else if (present(unit)) then
      self%in_unit = unit
      if (unit > 0) self%unit = trim(units(unit)%name)
    end if
    if (present(from)) then
      self%from = from
      self%label = self%label // '_from_' // to_text(from)
      self%long_name = self%long_name // ' from ' // to_text(from) // ' s'
    end if
    if (present(band) .and. kind == statistic_settling_time) then
      self%label = self%label // '_band_' // to_text(band)
      self%long_name = self%long_name // ' in a band of ' // to_text(band)
    end if
  end function new_statistic

  !> The damage or the number of cycles of a &fatigue. The curve is the one of a variant.
  type(statistic_t) function new_fatigue_statistic(name, fatigue, signal, kind, from) result(self)
    character(len=*), intent(in) :: name       !! of the &fatigue
    integer, intent(in) :: fatigue             !! its index in the input
    type(signal_t), intent(in) :: signal       !! of the column, of any for a shaft
    integer, intent(in) :: kind                !! statistic_damage or statistic_cycles
    real(wp), intent(in) :: from               !! [s]

    self%fatigue = fatigue
    allocate (self%curve)
    self%signal = signal
    self%kind = kind
    self%from = from
    self%label = name // '_' // trim(statistic_names(kind))
    self%unit = ''
    self%long_name = name // ', ' // trim(descriptions(kind))
  end function new_fatigue_statistic

  !> Whether a kind of statistics is one of fatigue.
  elemental logical function is_of_fatigue(kind)
    integer, intent(in) :: kind   !! statistic_...

    is_of_fatigue = kind == statistic_damage .or. kind == statistic_cycles
  end function is_of_fatigue

  !> Whether a kind of statistics is the time of an extreme.
  elemental logical function is_time_of_extreme(kind)
    integer, intent(in) :: kind   !! statistic_...

    is_time_of_extreme = any(kind == [statistic_time_of_max, statistic_time_of_min, statistic_time_of_max_abs])
  end function is_time_of_extreme

  !> Finds the columns of statistics in the trajectory table of a machine.
  subroutine find_columns(signals, statistics)
    type(signal_t), intent(in) :: signals(:)   !! of the machine's trajectory table
    type(statistic_t), intent(inout) :: statistics(:)
    integer :: i

    do i = 1, size(statistics)
      if (allocated(statistics(i)%shaft) .or. .not. allocated(statistics(i)%signal)) cycle
      associate (statistic => statistics(i), wanted => statistics(i)%signal)
        if (statistic%column >= 1 .and. statistic%column <= size(signals)) then
          if (signals(statistic%column)%name == wanted%name) cycle
        end if
        statistic%column = find_signal(signals, wanted%element_kind, wanted%element, wanted%symbol, wanted%point)
      end associate
    end do
  end subroutine find_columns

  !> Whether the column is a torque. In a machine without such a column the torque is 0.
  pure logical function is_torque(statistic)
    type(statistic_t), intent(in) :: statistic

    is_torque = statistic%signal%unit == 'N m'
  end function is_torque

  !> The statistic of a column that is 0 at all times.
  elemental real(wp) function value_of_zero_column(statistic) result(value)
    type(statistic_t), intent(in) :: statistic

    value = 0.0_wp
    if (is_time_of_extreme(statistic%kind)) value = statistic%from
  end function value_of_zero_column

  !> Whether a statistic is of a work, or of the energy balance, and so needs the work integrals.
  pure logical function needs_work_integrals(statistics)
    type(statistic_t), intent(in) :: statistics(:)
    integer :: i

    needs_work_integrals = .false.
    do i = 1, size(statistics)
      if (.not. allocated(statistics(i)%signal)) cycle
      needs_work_integrals = needs_work_integrals .or. statistics(i)%signal%source%kind >= signal_work_in
    end do
  end function needs_work_integrals

end module nocdyn_statistics
