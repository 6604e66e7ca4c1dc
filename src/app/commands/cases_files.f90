!> The files of all load cases of an input together: cases.json and cases.csv.
module nocdyn_cases_files
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_load_case_peaks, only: case_run_t
  use nocdyn_load_case_report, only: load_cases_json, put_load_cases_csv
  use nocdyn_posix, only: remove_file
  use nocdyn_result_files, only: result_files_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: remove_cases_files, write_cases_files

  character(len=*), parameter :: json_file = 'cases.json', csv_file = 'cases.csv'

contains

  !> Removes the files of an earlier call from the folder of an input.
  subroutine remove_cases_files(folder)
    character(len=*), intent(in) :: folder

    call remove_file(folder // '/' // json_file)
    call remove_file(folder // '/' // csv_file)
  end subroutine remove_cases_files

  !> Writes both; cases.json comes last.
  subroutine write_cases_files(input, runs, folder, error)
    type(input_t), intent(in) :: input   !! of one of the cases
    type(case_run_t), intent(in) :: runs(:)
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(result_files_t) :: files

    call files%open(folder, [string_t(csv_file), string_t(json_file)])
    call put_load_cases_csv(runs, files%files(1))
    call files%files(2)%put(load_cases_json(input, runs))
    call files%finish(error)
  end subroutine write_cases_files

end module nocdyn_cases_files
