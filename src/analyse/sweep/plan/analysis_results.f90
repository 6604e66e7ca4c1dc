!> Results of a variant that need no motion from its start: of its modes, its forced response, its reports.
module nocdyn_analysis_results
  use nocdyn_kinds, only: wp
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: new_mode_result, new_orbit_result, new_path_result, new_response_result, new_verdict_result

  integer, parameter, public :: analysis_frequency = 1       !! of the damped oscillation, as nocdyn modes has it
  integer, parameter, public :: analysis_damping_ratio = 2
  integer, parameter, public :: analysis_peak = 3            !! largest amplitude over the speeds
  integer, parameter, public :: analysis_peak_speed = 4      !! where this is
  integer, parameter, public :: analysis_margin = 5          !! distance of that speed to the speeds in operation
  integer, parameter, public :: analysis_ratio = 6           !! largest ratio to a limit over the speeds

  integer, parameter, public :: analysis_crossing = 7        !! speed at which an order meets a mode, as nocdyn campbell has it
  integer, parameter, public :: analysis_crossing_margin = 8 !! distance of that speed to the speeds in operation

  integer, parameter, public :: analysis_peak_frequency = 9  !! of a shaker, where the peak is

  integer, parameter, public :: analysis_curve = 10          !! half range or amplitude at a speed of the grid of &response
  integer, parameter, public :: analysis_mode_curve = 11     !! damped frequency there, as nocdyn campbell has it

  character(len=*), parameter, public :: analysis_names(11) = [character(len=15) :: 'frequency', 'damping_ratio', 'peak', &
    'peak_speed', 'margin', 'ratio', 'crossing', 'crossing_margin', 'peak_frequency', 'curve', 'curve']
  character(len=*), parameter, public :: analysis_owners(11) = [character(len=8) :: 'mode', 'mode', 'response', 'response', &
    'response', 'response', 'mode', 'mode', 'response', 'response', 'mode']   !! the key of &record that each belongs to

  integer, parameter, public :: of_path = -1, of_orbit = -2, of_verdict = -3   !! in place of a mode: results that a report has

  character(len=*), parameter, public :: of_branch = 'branch'   !! what special points belong to, in place of a signal
  character(len=*), parameter, public :: signal_words(2) = [character(len=10) :: 'peak', 'peak_value']
  character(len=*), parameter, public :: branch_words(5) = [character(len=15) :: 'fold', 'jump_up', 'jump_down', 'folds', &
    'unstable_ranges']

  !> One result.
  type, public :: analysis_result_t
    integer :: result = 0                           !! its number among the results of a variant
    integer :: statistic = analysis_frequency       !! analysis_...
    integer :: mode = 0                             !! number of an oscillating mode; 0: of the response; or `of_path` ...
    logical :: is_crossing = .false.                !! whether an order meets the mode
    character(len=:), allocatable :: command, path  !! of a number of a report: the command and the path in its report
    character(len=:), allocatable :: word           !! of an orbit: of `signal_words` or `branch_words`
    integer :: number = 1                           !! which one of several folds or jumps
    integer :: point = 0                            !! of a curve: which of the speeds of &response; 0: no point of a curve
    type(signal_t) :: signal                        !! of the response
    character(len=:), allocatable :: quantity       !! element, or column of response.csv without its unit
    real(wp) :: order = 0.0_wp                      !! 0 stands for all orders together
    real(wp) :: window(2) = [-huge(1.0_wp), huge(1.0_wp)]   !! speeds, or frequencies, that count for a peak [rad/s]
    character(len=:), allocatable :: label          !! e.g. 'moment_shaft_order_6_peak'
    character(len=:), allocatable :: unit           !! e.g. 'N m'
    integer :: in_unit = 0                          !! this unit as index of `units`, 0: SI
    character(len=:), allocatable :: long_name      !! a description
  contains
    procedure :: is_reported_by, is_curve
  end type analysis_result_t

contains

  !> Whether the report of an analysis has the number.
  elemental logical function is_reported_by(self, word)
    class(analysis_result_t), intent(in) :: self
    character(len=*), intent(in) :: word   !! the analysis

    is_reported_by = self%mode < 0
    if (is_reported_by) is_reported_by = self%command == word
  end function is_reported_by

  !> Whether it is a point of a curve.
  elemental logical function is_curve(self)
    class(analysis_result_t), intent(in) :: self

    is_curve = self%statistic == analysis_curve .or. self%statistic == analysis_mode_curve
  end function is_curve

  !> Of an oscillating mode.
  subroutine new_mode_result(mode, order, statistic, self)
    integer, intent(in) :: mode, statistic
    real(wp), intent(in) :: order   !! that meets it; 0 for other statistics
    type(analysis_result_t), intent(out) :: self

    self%mode = mode
    self%order = order
    self%statistic = statistic
    self%is_crossing = any(statistic == [analysis_crossing, analysis_crossing_margin])
    self%label = 'mode_' // to_text(mode) // '_'
    if (order > 0) self%label = self%label // 'order_' // to_text(order) // '_'
    self%label = self%label // trim(analysis_names(statistic))
    self%quantity = ''
    self%unit = ''
    select case (statistic)
    case (analysis_frequency)
      self%unit = 'Hz'
      self%long_name = 'frequency of mode ' // to_text(mode) // ' with damping'
    case (analysis_mode_curve)
      self%unit = 'Hz'
      self%long_name = 'frequency of mode ' // to_text(mode) // ' with damping over the speed'
    case (analysis_damping_ratio)
      self%long_name = 'damping ratio of mode ' // to_text(mode)
    case (analysis_crossing)
      self%unit = 'rad/s'
      self%long_name = 'speed at which order ' // to_text(order) // ' meets mode ' // to_text(mode)
    case default   ! analysis_crossing_margin
      self%long_name = 'distance to operation of the speed at which order ' // to_text(order) // ' meets mode ' // to_text(mode)
    end select
  end subroutine new_mode_result

  !> A number of the report of an analysis.
  subroutine new_path_result(text, self)
    character(len=*), intent(in) :: text   !! command and path, with a point between them
    type(analysis_result_t), intent(out) :: self
    integer :: point

    point = index(text, '.')
    self%mode = of_path
    self%statistic = 0
    self%command = text(:point - 1)
    self%path = text(point + 1:)
    self%label = text
    self%quantity = ''
    self%unit = ''
    self%long_name = self%path // ' in ' // self%command // '.json'
  end subroutine new_path_result

  !> Of periodic motions.
  subroutine new_orbit_result(quantity, word, number, unit, self)
    character(len=*), intent(in) :: quantity   !! signal, or `of_branch`
    character(len=*), intent(in) :: word       !! of `signal_words` or `branch_words`
    integer, intent(in) :: number              !! which one of several folds or jumps
    character(len=*), intent(in) :: unit       !! of the signal if it is a peak, else of what changes along the branch
    type(analysis_result_t), intent(out) :: self

    self%mode = of_orbit
    self%statistic = 0
    self%command = 'orbit'
    self%path = ''
    self%quantity = quantity
    self%word = word
    self%number = number
    self%unit = unit
    self%label = quantity // '_orbit_' // word
    if (quantity == of_branch) self%label = 'orbit_' // word
    select case (word)
    case ('peak')
      self%long_name = quantity // ': largest half range of the periodic motions'
    case ('peak_value')
      self%long_name = quantity // ': where the half range of the periodic motions is largest'
    case ('folds')
      self%unit = ''
      self%long_name = 'number of folds of the periodic motions'
    case ('unstable_ranges')
      self%unit = ''
      self%long_name = 'number of ranges of unstable periodic motions'
    case default   ! fold, jump_up, jump_down
      self%label = self%label // '_' // to_text(number)
      self%long_name = 'where the periodic motions have fold ' // to_text(number)
      if (word == 'jump_up') self%long_name = 'where a rising value jumps, number ' // to_text(number)
      if (word == 'jump_down') self%long_name = 'where a falling value jumps, number ' // to_text(number)
    end select
  end subroutine new_orbit_result

  !> The largest ratio of what an analysis says of a limit; 0 if it says nothing of it.
  subroutine new_verdict_result(command, element, criterion, self)
    character(len=*), intent(in) :: command              !! of the analysis
    character(len=*), intent(in) :: element, criterion   !! of lines of a verdict
    type(analysis_result_t), intent(out) :: self

    self%mode = of_verdict
    self%statistic = 0
    self%command = command
    self%path = ''
    self%quantity = element
    self%word = criterion
    self%label = element // ', ' // criterion
    self%unit = ''
    self%long_name = self%label // ': of the limit'
  end subroutine new_verdict_result

  !> Of a quantity of the forced response.
  subroutine new_response_result(quantity, column, unit, order, statistic, self)
    character(len=*), intent(in) :: quantity   !! as a user writes it
    character(len=*), intent(in) :: column     !! its label without unit
    character(len=*), intent(in) :: unit       !! of its amplitude
    real(wp), intent(in) :: order              !! 0 stands for all orders together
    integer, intent(in) :: statistic           !! analysis_...
    type(analysis_result_t), intent(out) :: self
    character(len=:), allocatable :: what

    self%quantity = quantity
    self%order = order
    self%statistic = statistic
    self%label = column
    what = column // ', all orders: '
    if (order > 0) then
      self%label = self%label // '_order_' // to_text(order)
      what = column // ', order ' // to_text(order) // ': '
    end if
    self%label = self%label // '_' // trim(analysis_names(statistic))
    self%unit = ''
    select case (statistic)
    case (analysis_peak)
      self%unit = unit
      self%long_name = what // 'largest half range over the speed'
      if (order > 0) self%long_name = what // 'largest amplitude over the speed'
    case (analysis_curve)
      self%unit = unit
      self%long_name = what // 'half range over the speed'
      if (order > 0) self%long_name = what // 'amplitude over the speed'
    case (analysis_peak_speed)
      self%unit = 'rad/s'
      self%long_name = what // 'speed of the peak'
    case (analysis_peak_frequency)
      self%unit = 'rad/s'
      self%long_name = what // 'frequency of the peak'
    case (analysis_margin)
      self%long_name = what // 'distance of the peak to operation'
    case default   ! analysis_ratio
      self%long_name = what // 'largest ratio to its limits'
    end select
  end subroutine new_response_result

end module nocdyn_analysis_results
