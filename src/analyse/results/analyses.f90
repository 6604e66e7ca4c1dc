!> What an analysis of a machine is: a solver, and the report, tables and text that it leaves. One driver runs them all; a new
!> analysis is a type that extends `analysis_t` and a row in the table of commands.
module nocdyn_analyses
  use nocdyn_errors, only: error_t
  use nocdyn_grid_file, only: grid_file_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: string_t
  use nocdyn_verdicts, only: verdict_t
  implicit none (type, external)
  private

  !> What the command line asks for beside the input.
  type, public :: analysis_options_t
    character(len=:), allocatable :: at       !! state about which the machine is linearised; '': the one of the analysis
    integer :: modes = 0                      !! number of oscillating modes that are wanted, the lowest; 0: as many as usual
    integer :: starts = 0                     !! of a search, 0: as many as usual
    logical :: has_range = .false.            !! whether modes in a range are wanted
    real(wp) :: range_hz(2) = 0.0_wp          !! their frequencies, from and to [Hz]
    logical :: has_holzer = .false.           !! whether tables of Holzer are wanted
    logical :: has_peaks = .false.            !! whether peaks of a run are wanted too
    logical :: has_code = .false.             !! whether a program in C is wanted instead of matrices
    logical :: writes_files = .false.         !! whether files are written
    logical :: compares = .true.              !! whether measurements are compared; variants of a sweep are not
    character(len=:), allocatable :: folder   !! of the results of a run of the input
    character(len=:), allocatable :: journal  !! folder in which a journal may be kept, if there is one
    logical :: resumes = .false.              !! whether a journal that is there is gone on with
  end type analysis_options_t

  type, abstract, public :: analysis_t
    logical :: is_steady = .true.       !! whether it looks at the machine in a steady state, else over the time
    logical :: locks_joints = .true.    !! whether clutches and freewheels are locked or open for good then
    logical :: takes_joints = .false.   !! whether it takes joints as they are, as a run does
    logical :: sets_speed = .false.     !! whether it sets the speed of a body, in place of a drive
    logical :: always_writes = .false.  !! whether it writes files without --out too
    logical :: has_report = .true.      !! whether it has a report in JSON
    logical :: is_for_threads = .false. !! whether threads may call `solve` at the same time
    logical :: keeps_journal = .false.  !! whether it keeps a journal, and then looks for interruptions itself
    logical :: is_unfinished = .false.  !! after `solve`: interrupted; its tables say so by their names
    type(verdict_t) :: verdict          !! after `judge`: what it says of limits
    type(error_t), allocatable :: refusal   !! after `solve`: an error beside a report that can be printed, without files
  contains
    procedure(solve_interface), deferred :: solve
    procedure :: list_tables
    procedure :: put_table
    procedure :: grid_name, other_names
    procedure :: put_grid
    procedure :: put_report
    procedure :: judge
    procedure :: find_recorded
    procedure(text_interface), deferred :: text
  end type analysis_t

  abstract interface

    !> Analyses the machine of an input.
    subroutine solve_interface(self, input, machine, options, error)
      import :: analysis_options_t, analysis_t, error_t, input_t, machine_t
      class(analysis_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(machine_t), intent(in) :: machine   !! as `is_steady` and `locks_joints` ask for
      type(analysis_options_t), intent(in) :: options
      type(error_t), allocatable, intent(out) :: error
    end subroutine solve_interface

    !> The printed report.
    subroutine text_interface(self, input, text)
      import :: analysis_t, input_t
      class(analysis_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(len=:), allocatable, intent(out) :: text
    end subroutine text_interface

  end interface

contains

  !> The names of the tables of an analysis. By default there are none.
  subroutine list_tables(self, names)
    class(analysis_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(0))
  end subroutine list_tables

  !> Writes one of these tables.
  subroutine put_table(self, input, name, file)
    class(analysis_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    error stop 'nocdyn_analyses: an analysis with tables overrides put_table'
  end subroutine put_table

  !> The name of the file of tables that an input asks for in place of some; '': none.
  pure function grid_name(self, input) result(name)
    class(analysis_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable :: name

    name = ''
  end function grid_name

  !> The files in which an analysis in another form would have its tables.
  function other_names(self, input) result(names)
    class(analysis_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(string_t), allocatable :: names(:)

    allocate (names(0))
  end function other_names

  !> Writes these tables to that file, which is not open.
  subroutine put_grid(self, input, folder, file)
    class(analysis_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: folder
    class(grid_file_t), intent(inout) :: file

    error stop 'nocdyn_analyses: an analysis with a grid overrides put_grid'
  end subroutine put_grid

  !> Finds the verdict of a solved analysis, which the report has. By default there is none. Only one thread at a time.
  subroutine judge(self, input)
    class(analysis_t), intent(inout) :: self
    type(input_t), intent(in) :: input
  end subroutine judge

  !> Fills the report: the file COMMAND.json, and what sweeps record by paths.
  subroutine put_report(self, input, json)
    class(analysis_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    error stop 'nocdyn_analyses: an analysis with a report overrides put_report'
  end subroutine put_report

  !> A number of a solved analysis that sweeps record by a word of their own, in SI units or in the one of the parameter.
  subroutine find_recorded(self, quantity, statistic, number, value, obstacle)
    class(analysis_t), intent(in) :: self
    character(len=*), intent(in) :: quantity    !! what it belongs to
    character(len=*), intent(in) :: statistic   !! the word
    integer, intent(in) :: number               !! which one of several
    real(wp), intent(out) :: value
    character(len=:), allocatable, intent(out) :: obstacle   !! why there is none, else ''

    error stop 'nocdyn_analyses: an analysis with such numbers overrides find_recorded'
  end subroutine find_recorded

end module nocdyn_analyses
