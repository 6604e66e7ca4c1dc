!> Natural frequencies and mode shapes, as an analysis: modes.csv, modes.json and holzer.csv.
module nocdyn_modes_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_comparisons, only: append_comparison_files, comparison_t, measured_files, put_comparison_table, write_comparisons
  use nocdyn_errors, only: error_t, exit_failed
  use nocdyn_holzer_report, only: holzer_tables
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_lumped_shafts, only: lump_shafts
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_measured_modes, only: compare_modes
  use nocdyn_modes, only: list_oscillations
  use nocdyn_modes_files, only: put_modes, write_modes
  use nocdyn_modes_report, only: modes_report_t, modes_text, new_modes_report
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_output_units, only: output_units
  use nocdyn_text, only: append, string_t
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  character(len=*), parameter :: holzer_name = 'holzer.csv', table_name = 'modes.csv'

  type, extends(analysis_t), public :: modes_results_t
    type(modes_report_t), private :: report
    type(comparison_t), allocatable, private :: comparisons(:)   !! with measured frequencies
    character(len=:), allocatable, private :: holzer_text, holzer_csv   !! not allocated: not wanted
  contains
    procedure :: solve, list_tables, put_table, put_report, text => printed
  end type modes_results_t

contains

  recursive subroutine solve(self, input, machine, options, error)
    class(modes_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(operating_point_t) :: point
    logical :: is_of_point

    if (options%at /= '') call find_operating_point(input, machine, options%at, point, error)
    if (options%at == '') call find_operating_point(input, machine, 'equilibrium', point, error)
    is_of_point = allocated(error)
    if (.not. allocated(error)) call new_modes_report(point, modes_choice_t(options%modes, options%has_range, options%range_hz), &
                                                      self%report, error)
    if (.not. allocated(error) .and. options%compares) then
      call compare_measured(self, input, error)
      is_of_point = allocated(error)
    end if
    if (.not. allocated(self%comparisons)) allocate (self%comparisons(0))
    if (.not. allocated(error) .and. options%has_holzer) call make_tables(self, input, machine, options, error)
    if (.not. allocated(error)) return
    if (.not. is_of_point .or. error%code == exit_failed) error%message = input%shown_case() // ': ' // error%message
  end subroutine solve

  !> Compares measured frequencies with the modes.
  subroutine compare_measured(self, input, error)
    type(modes_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: dampings(:), frequencies(:)
    integer, allocatable :: numbers(:)

    call list_oscillations(self%report%modes, numbers, frequencies, dampings)
    call compare_modes(input, numbers, frequencies, dampings, self%comparisons, error)
  end subroutine compare_measured

  !> Makes the tables of Holzer, of a machine with lumped shafts.
  recursive subroutine make_tables(self, input, machine, options, error)
    class(modes_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(input_t) :: chains
    type(machine_t) :: lumped
    type(modes_results_t) :: of_lumped
    type(analysis_options_t) :: without_tables
    type(string_t), allocatable :: names(:)

    chains = input
    call lump_shafts(machine, chains, names)
    if (size(names) == 0) then
      call holzer_tables(self%report, self%report%linear%natural, names, self%holzer_text, self%holzer_csv, error)
      return
    end if
    without_tables = options
    without_tables%has_holzer = .false.
    without_tables%compares = .false.
    call assemble_steady_machine(chains, self%locks_joints, lumped, error)
    if (.not. allocated(error)) call of_lumped%solve(chains, lumped, without_tables, error)
    if (allocated(error)) return
    call holzer_tables(of_lumped%report, self%report%linear%natural, names, self%holzer_text, self%holzer_csv, error)
  end subroutine make_tables

  subroutine list_tables(self, names)
    class(modes_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(0))
    if (allocated(self%holzer_csv)) call append(names, holzer_name)
    call append(names, table_name)
    call append_comparison_files(self%comparisons, measured_files, names)
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(modes_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    if (name == holzer_name) then
      call file%put(self%holzer_csv)
    else if (name == table_name) then
      call write_modes(file, self%report)
    else
      call put_comparison_table(self%comparisons, name, file)
    end if
  end subroutine put_table

  subroutine put_report(self, input, json)
    class(modes_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_modes(json, input, self%report, self%comparisons)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(modes_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text
    type(text_buffer_t) :: measured

    text = modes_text(input%shown_case(), self%report, output_units(input))
    if (size(self%comparisons) > 0) then
      call write_comparisons(self%comparisons, measured)
      text = text // measured%text()
    end if
    if (allocated(self%holzer_text)) text = text // new_line('a') // self%holzer_text
  end subroutine printed

end module nocdyn_modes_results
