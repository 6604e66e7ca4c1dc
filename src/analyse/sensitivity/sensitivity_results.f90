!> Derivatives of what analyses answer by the numbers of a machine, as an analysis: sensitivity.csv and sensitivity.json.
module nocdyn_sensitivity_results
  use nocdyn_analyses, only: analysis_options_t, analysis_t
  use nocdyn_answers, only: answer_t, differentiate, answers_group_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_answers, only: mode_answers_t, new_mode_answers
  use nocdyn_output_file, only: output_file_t
  use nocdyn_peak_answers, only: find_peak_answers
  use nocdyn_response_answers, only: new_response_answers, response_answers_t
  use nocdyn_sensitivity_report, only: put_sensitivity, sensitivity_csv, sensitivity_t, sensitivity_text
  use nocdyn_text, only: append, quoted, string_t
  use nocdyn_varied_keys, only: list_varied_keys
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  character(len=*), parameter :: table_name = 'sensitivity.csv'
  integer, parameter :: most_criticals = 20   ! those with the largest responses

  type, extends(analysis_t), public :: sensitivity_results_t
    type(sensitivity_t), private :: found
  contains
    procedure :: solve, list_tables, put_table, put_report, text => printed
  end type sensitivity_results_t

contains

  subroutine solve(self, input, machine, options, error)
    class(sensitivity_results_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(analysis_options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(mode_answers_t), target :: modes
    type(response_answers_t), target :: response
    type(answers_group_t) :: groups(2)
    type(answer_t), allocatable :: peaks(:)
    integer :: count
    character(len=:), allocatable :: at

    at = 'equilibrium'
    if (options%at /= '') at = options%at
    call refuse_rubber(machine, error)
    if (allocated(error)) then
      call input%name_case(error)
      return
    end if
    allocate (self%found%notes(0), self%found%answers(0))
    call list_varied_keys(input, self%found%keys, self%found%notes)
    call new_mode_answers(input, at, modes_choice_t(options%modes, options%has_range, options%range_hz), modes, &
                          self%found%notes, error)
    if (allocated(error)) then
      call input%name_case(error)
      return
    end if
    count = 1
    groups(1)%answers => modes
    if (size(input%groups_named('response')) > 0) then
      call new_response_answers(input, most_criticals, response, self%found%notes, error)
      if (allocated(error)) return
      count = 2
      groups(2)%answers => response
    end if
    call differentiate(input, machine, self%found%keys, groups(:count), self%found%notes, error)
    if (allocated(error)) then
      call input%name_case(error)
      return
    end if
    if (options%has_peaks) then
      call find_peak_answers(input, self%found%keys, peaks, self%found%notes, error)
      if (allocated(error)) return
      call add_answers(peaks, self%found%answers)
    end if
    if (count == 2) call add_answers(response%answers, self%found%answers)
    call add_answers(modes%answers, self%found%answers)
  end subroutine solve

  !> Refuses couplings whose stiffness follows from the vibration itself.
  subroutine refuse_rubber(machine, error)
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer :: r

    if (.not. allocated(machine%rubber)) return
    do r = 1, size(machine%rubber)
      if (.not. (machine%rubber(r)%needs_iteration() .or. machine%rubber(r)%by_frequency%are_given)) cycle
      call raise(error, exit_input, 'the stiffness of ' // quoted(machine%element_name(machine%rubber(r)%element)) // &
                 ' follows from its frequency, its amplitude or its heat, which has no derivatives here; allowed: a ' // &
                 "coupling without tables over these, with condition = 'cold' or 'warm'")
      return
    end do
  end subroutine refuse_rubber

  subroutine add_answers(new, answers)
    type(answer_t), intent(in) :: new(:)
    type(answer_t), allocatable, intent(inout) :: answers(:)
    type(answer_t), allocatable :: all(:)

    allocate (all(size(answers) + size(new)))
    all(:size(answers)) = answers
    all(size(answers) + 1:) = new
    call move_alloc(all, answers)
  end subroutine add_answers

  subroutine list_tables(self, names)
    class(sensitivity_results_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(0))
    call append(names, table_name)
  end subroutine list_tables

  subroutine put_table(self, input, name, file)
    class(sensitivity_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    call sensitivity_csv(self%found, file)
  end subroutine put_table

  subroutine put_report(self, input, json)
    class(sensitivity_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    type(json_t), intent(inout) :: json

    call put_sensitivity(json, input, self%found)
  end subroutine put_report

  subroutine printed(self, input, text)
    class(sensitivity_results_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: text

    text = sensitivity_text(input%shown_case(), self%found)
  end subroutine printed

end module nocdyn_sensitivity_results
