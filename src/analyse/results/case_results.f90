!> How an analysis of each load case ended, and what all of them say of limits.
module nocdyn_case_results
  use nocdyn_input, only: load_case_t
  use nocdyn_json, only: json_t
  use nocdyn_verdicts, only: is_not_assessed, new_verdict_line, verdict_line_t, verdict_t
  implicit none (type, external)
  private

  public :: combine_verdicts, is_complete, put_cases, same_refusal

  character(len=*), parameter, public :: status_done = 'done', status_refused = 'refused', status_failed = 'failed'

  !> The analysis of one load case.
  type, public :: case_result_t
    type(load_case_t) :: load_case
    character(len=11) :: status = status_done   !! or failed, interrupted, refused, not run
    character(len=:), allocatable :: message    !! why, if it is not done
    type(verdict_t) :: verdict
  end type case_result_t

contains

  !> Whether all load cases have been computed to their ends.
  pure logical function is_complete(results)
    type(case_result_t), intent(in) :: results(:)

    is_complete = all(results%status == status_done)
  end function is_complete

  !> The verdicts of all load cases, each line with its case; one that is not done has a line of its own.
  subroutine combine_verdicts(analysis, results, verdict)
    character(len=*), intent(in) :: analysis   !! as in `verdict_line_t`
    type(case_result_t), intent(in) :: results(:)
    type(verdict_t), intent(out) :: verdict
    type(verdict_line_t) :: line
    integer :: c

    do c = 1, size(results)
      associate (one => results(c))
        call verdict%add_case(one%verdict, one%load_case%name)
        if (one%status == status_done .or. allocated(one%verdict%lines)) cycle
        line = new_verdict_line(analysis, 'machine', '', 'all', '')
        line%load_case = one%load_case%name
        line%finding = is_not_assessed
        line%reason = trim(one%status)
        if (allocated(one%message)) line%reason = line%reason // ': ' // one%message
        call verdict%add(line)
      end associate
    end do
  end subroutine combine_verdicts

  !> Writes the list of load cases.
  subroutine put_cases(json, results)
    type(json_t), intent(inout) :: json
    type(case_result_t), intent(in) :: results(:)
    integer :: c

    call json%put('is_complete', is_complete(results))
    call json%open_list('load_cases')
    do c = 1, size(results)
      associate (one => results(c))
        call json%open()
        call json%put('name', one%load_case%name)
        call json%put('title', one%load_case%title)
        call json%put('repeats', one%load_case%repeats)
        call json%put('folder', one%load_case%name)
        call json%put('status', trim(one%status))
        if (allocated(one%message)) call json%put('message', one%message)
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_cases

  !> Whether all load cases are refused by the same words, which are those of the file then.
  pure logical function same_refusal(results)
    type(case_result_t), intent(in) :: results(:)
    integer :: k

    same_refusal = all(results%status == status_refused)
    if (same_refusal) same_refusal = all([(results(k)%message == results(1)%message, k=2, size(results))])
  end function same_refusal

end module nocdyn_case_results
