!> What the reports of analyses begin with: as JSON the program, the input and its load case; printed the notes.
module nocdyn_report_openings
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_text, only: string_t
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: append_notes, open_analysis_report

contains

  !> Begins the report of an analysis of an input, or of a load case of it.
  subroutine open_analysis_report(json, input, status, message)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    character(len=*), intent(in), optional :: status, message   !! as of `open_report`

    call json%open_report(input%file, input%title(), status, message)
    if (allocated(input%load_case)) call json%put('load_case', input%load_case%name)
  end subroutine open_analysis_report

  !> Appends a line for each note.
  subroutine append_notes(report, file, notes)
    type(text_buffer_t), intent(inout) :: report
    character(len=*), intent(in) :: file   !! the input, as it is shown
    type(string_t), intent(in) :: notes(:)
    integer :: i

    do i = 1, size(notes)
      call report%append_line(file // ': note: ' // notes(i)%text)
    end do
  end subroutine append_notes

end module nocdyn_report_openings
