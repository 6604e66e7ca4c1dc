!> The summary of a run, and its form as summary.json and as printed lines.
module nocdyn_run_summary
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_comparisons, only: comparison_t, put_comparisons
  use nocdyn_energy_balance, only: energy_balance_t, put_energy_balance
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_fatigue_report, only: put_fatigue
  use nocdyn_finite, only: is_finite
  use nocdyn_input, only: input_t
  use nocdyn_joint_events, only: named_event_t, put_joint_events
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: constraint_count, machine_notes, named_coordinates
  use nocdyn_report_openings, only: open_analysis_report
  use nocdyn_run_fatigue, only: run_fatigue_t
  use nocdyn_solver_status, only: max_switch_times, solver_status_t
  use nocdyn_run_settings, only: put_settings
  use nocdyn_signals, only: signal_t
  use nocdyn_start_transient, only: start_transient_t
  use nocdyn_table_text, only: cell_digits
  use nocdyn_text, only: append, counted, longest_path, rounded_text, selected, shortened, string_t, strings, &
    to_text
  use nocdyn_verdicts, only: verdict_t
  implicit none (type, external)
  private

  public :: describe_machine, check_energy_balance, check_extremes
  public :: columns_json, summary_json, summary_line, method_line

  !> The summary notes an energy residual above this share of the largest energy of the vibration: such a motion is not to be
  !> trusted.
  real(wp), parameter :: energy_error_limit = 0.01_wp
  real(wp), parameter :: rounding_share = 1.0e-10_wp   !! of the largest energy or work: less may be rounding
  real(wp), parameter :: passing_share = 1.0e-8_wp     !! of the work that passes through: less says nothing of the vibration

  !> Smallest and largest values of the columns from `from` on, with their times.
  type, public :: column_extremes_t
    integer :: rows = 0                   !! before `from` too
    real(wp) :: from = -huge(1.0_wp)      !! [s]
    logical :: have_begun = .false.       !! whether the run has come to `from`
    logical :: are_continuous = .false.   !! whether they are extremes of the motion, not of the only row
    real(wp), allocatable :: lowest(:), lowest_time(:), highest(:), highest_time(:), last(:)   !! [columns]
  end type column_extremes_t

  type, public :: run_summary_t
    logical :: has_run = .false.                    !! whether the input was integrated
    character(len=11) :: status = 'done'            !! done, failed, interrupted
    character(len=:), allocatable :: message        !! why, if it is not done
    integer :: bodies = 0, gears = 0, constraints = 0, freedoms = 0   !! of the machine
    type(string_t), allocatable :: coordinates(:)   !! names of the independent bodies
    type(string_t), allocatable :: notes(:)         !! on the machine and the run, one sentence each
    type(signal_t), allocatable :: signals(:)       !! of the columns, in the units of the table
    type(string_t), allocatable :: labels(:)        !! of the columns
    integer, allocatable :: chosen(:)               !! columns that are written, ascending, the time first
    real(wp) :: t_start = 0.0_wp                    !! [s]
    type(column_extremes_t) :: extremes
    type(start_transient_t) :: transient            !! of a run that has come to its end
    character(len=:), allocatable :: method         !! of integration
    type(solver_status_t) :: solver_status
    type(energy_balance_t), allocatable :: energy_balance  !! from the start to the last row; not allocated if there are no rows
    type(verdict_t) :: verdict                      !! on limits and damage
    type(run_fatigue_t) :: fatigue                  !! by &fatigue; no items before the first row
    type(comparison_t), allocatable :: comparisons(:)   !! with measurements; not allocated before the first row
    real(wp) :: wall_time = 0.0_wp                  !! of integration and writing of the trajectory [s]
    type(named_event_t), allocatable :: events(:)   !! of joints; not allocated if there are no joints
  end type run_summary_t

contains

  !> Refuses extremes that are not finite: the motion between two rows can reach them.
  subroutine check_extremes(extremes, labels, error)
    type(column_extremes_t), intent(in) :: extremes
    type(string_t), intent(in) :: labels(:)   !! of the columns
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    i = findloc(is_finite(extremes%lowest) .and. is_finite(extremes%highest), .false., dim=1)
    if (i > 0) call raise(error, exit_failed, labels(i)%text // ' is not a finite number between two rows, about ' // &
                          't = ' // to_text(merge(extremes%highest_time(i), extremes%lowest_time(i), &
                          is_finite(extremes%lowest(i)))) // ' s')
  end subroutine check_extremes

  !> Takes what the summary says of the machine.
  subroutine describe_machine(machine, summary)
    type(machine_t), intent(in) :: machine
    type(run_summary_t), intent(inout) :: summary

    summary%bodies = machine%bodies - machine%nodes
    summary%gears = constraint_count(machine, 'gear')
    summary%constraints = machine%constraints%rows()
    summary%freedoms = machine%freedoms()
    allocate (summary%coordinates, source=selected(machine%names, named_coordinates(machine)))
    allocate (summary%notes, source=machine_notes(machine))
  end subroutine describe_machine

  !> Adds a note on a large energy balance error. The last five columns are the energies and works; the last one is the error.
  subroutine check_energy_balance(extremes, vibration, negligible, notes)
    type(column_extremes_t), intent(in) :: extremes
    real(wp), intent(in) :: vibration    !! largest energy of the vibration [J]; 0 if nothing can vibrate
    real(wp), intent(in) :: negligible   !! energy of motions within the absolute tolerance [J]
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: compared
    real(wp) :: residual, largest
    integer :: columns

    columns = size(extremes%last)
    residual = max(abs(extremes%lowest(columns)), abs(extremes%highest(columns)))
    largest = maxval(max(abs(extremes%lowest(columns - 4:columns - 1)), abs(extremes%highest(columns - 4:columns - 1))))
    if (.not. extremes%have_begun .or. residual <= negligible) return
    if (vibration > 0) then
      if (residual <= max(energy_error_limit * vibration, rounding_share * largest, &
                          passing_share * min(extremes%highest(columns - 2), extremes%highest(columns - 1)))) return
      compared = 'the vibration, as kinetic energy about the rigid motion and elastic energy, holds at most ' // &
        rounded_text(vibration, 3)
    else
      if (residual <= energy_error_limit * largest) return
      compared = 'the largest energy or work is ' // rounded_text(largest, 3)
    end if
    call append(notes, 'large energy balance error: energy_residual reaches ' // rounded_text(residual, 3) // ' J; ' // &
                       compared // ' J; tighten rtol and atol')
  end subroutine check_energy_balance

  !> The text of columns.json: what the columns of the table are, and those that only the summary has.
  function columns_json(summary, file) result(text)
    type(run_summary_t), intent(in) :: summary
    character(len=*), intent(in) :: file   !! name of the table
    character(len=:), allocatable :: text
    type(column_list_t) :: others, written
    type(json_t) :: json
    integer :: i, next

    next = 1
    call written%start(file, [integer ::])
    call others%start('', [integer ::])
    do i = 1, size(summary%signals)
      if (summary%chosen(min(next, size(summary%chosen))) == i) then
        call written%add(summary%signals(i))
        next = next + 1
      else
        call others%add(summary%signals(i))
      end if
    end do
    call json%open()
    call json%open_list('columns')
    call written%put(json)
    call others%put(json)
    call json%close_list()
    call json%close()
    text = json%text()
  end function columns_json

  !> The text of summary.json.
  function summary_json(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    type(json_t) :: json

    call open_analysis_report(json, input, summary%status, summary%message)
    call summary%verdict%put(json)
    call json%open('machine')
    call json%put('bodies', summary%bodies)
    call json%put('gears', summary%gears)
    call json%put('constraints', summary%constraints)
    call json%put('degrees_of_freedom', summary%freedoms)
    call json%put('independent', summary%coordinates)
    call json%put('notes', summary%notes)
    call json%close()
    call put_settings(json, input%single('run'))
    if (allocated(summary%fatigue%items)) call put_fatigue(json, summary%fatigue)
    if (allocated(summary%comparisons)) call put_comparisons(json, summary%comparisons)
    associate (solver_status => summary%solver_status)
      call json%open('counts')
      call json%put('accepted_steps', solver_status%accepted(1))
      call json%put('rejected_steps', solver_status%rejected(1))
      call json%put('evaluations', solver_status%evaluations(1))
      call json%put('jacobians', solver_status%jacobians(1))
      call json%put('factorisations', solver_status%factorisations(1))
      call json%put('crossings', solver_status%crossings(1))
      call json%put('rows', summary%extremes%rows)
      call json%close()
      call json%put('time_reached', solver_status%t(1))
    end associate
    call json%put('wall_time_s', summary%wall_time)
    call put_method(json, summary)
    if (allocated(summary%energy_balance)) call put_energy_balance(json, summary%energy_balance)
    if (allocated(summary%events)) call put_joint_events(json, summary%events)
    call put_columns(json, summary)
    call json%close()
    text = json%text()
  end function summary_json

  !> The method of integration, its explicit and implicit steps, and the first switches between them.
  subroutine put_method(json, summary)
    type(json_t), intent(inout) :: json
    type(run_summary_t), intent(in) :: summary
    integer :: i
    logical :: to_implicit

    associate (solver_status => summary%solver_status)
      call json%open('method')
      call json%put('name', summary%method)
      call json%put('explicit_steps', solver_status%accepted(1) - solver_status%implicit_steps(1))
      call json%put('implicit_steps', solver_status%implicit_steps(1))
      call json%put('switches', solver_status%switches(1))
      call json%open_list('first_switches')
      do i = 1, min(solver_status%switches(1), max_switch_times)
        to_implicit = solver_status%implicit(1) .eqv. mod(solver_status%switches(1) - i, 2) == 0   ! switches alternate
        call json%open()
        call json%put('time', solver_status%switch_times(i, 1))
        call json%put('to', trim(merge('implicit', 'explicit', to_implicit)))
        call json%close()
      end do
      call json%close_list()
      call json%close()
    end associate
  end subroutine put_method

  !> Extremes and last value of every column but the time.
  subroutine put_columns(json, summary)
    type(json_t), intent(inout) :: json
    type(run_summary_t), intent(in) :: summary
    type(string_t) :: keys(5)
    integer :: i

    keys = strings([character(len=11) :: 'min', 'time_of_min', 'max', 'time_of_max', 'last'])
    associate (extremes => summary%extremes)
      call json%put('extremes', trim(merge('of the motion', 'of the rows  ', extremes%are_continuous)))
      if (extremes%from > summary%t_start) call json%put('extremes_from', extremes%from)
      call put_transient(json, summary)
      call json%open('columns')
      do i = 2, merge(size(summary%labels), 1, extremes%rows > 0)
        if (extremes%have_begun) then
          call json%put(summary%labels(i)%text, keys, [extremes%lowest(i), extremes%lowest_time(i), extremes%highest(i), &
                                                       extremes%highest_time(i), extremes%last(i)])
        else
          call json%put(summary%labels(i)%text, keys(5:), [extremes%last(i)])
        end if
      end do
      call json%close()
    end associate
  end subroutine put_columns

  !> The first fast transient of a start out of balance, and the columns whose extremes lie in it.
  subroutine put_transient(json, summary)
    type(json_t), intent(inout) :: json
    type(run_summary_t), intent(in) :: summary
    integer :: i

    if (.not. allocated(summary%transient%has_lowest)) return
    if (summary%transient%until <= summary%t_start) return
    associate (columns => [(i, i=1, size(summary%labels))], transient => summary%transient)
      call json%open('start_transient')
      call json%put('until', transient%until)
      call json%put('has_min_of', selected(summary%labels, pack(columns, transient%has_lowest)))
      call json%put('has_max_of', selected(summary%labels, pack(columns, transient%has_highest)))
      call json%close()
    end associate
  end subroutine put_transient

  !> One line with the counts of the integration and the folder of the results.
  function summary_line(input, summary, folder) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: text

    text = input%shown_case() // ': done at t = ' // to_text(summary%solver_status%t(1)) // ' s, ' // &
           counted(summary%solver_status%accepted(1), 'step', 'steps') // ' (' // &
           to_text(summary%solver_status%rejected(1)) // ' rejected), '
    if (summary%solver_status%crossings(1) > 0) then
      text = text // counted(summary%solver_status%crossings(1), 'kink or jump', 'kinks or jumps') // ' crossed, '
    end if
    text = text // to_text(summary%extremes%rows) // ' rows, ' // rounded_text(1000.0_wp * summary%wall_time, 3) // &
           ' ms; results in ' // shortened(folder, longest_path)
  end function summary_line

  !> One line on the switches of the method 'auto'; empty if there are none.
  function method_line(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(run_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text

    text = ''
    associate (solver_status => summary%solver_status)
      if (solver_status%switches(1) == 0) return
      text = input%shown_case() // ': stiff: implicit steps from t = ' // rounded_text(solver_status%switch_times(1, 1), &
                                                                               cell_digits) // ' s'
      if (solver_status%switches(1) > 1) text = text // ' (' // to_text(solver_status%switches(1)) // ' switches in all)'
      text = text // ', ' // to_text(solver_status%implicit_steps(1)) // ' of ' // &
             counted(solver_status%accepted(1), 'step', 'steps')
    end associate
  end function method_line

end module nocdyn_run_summary
