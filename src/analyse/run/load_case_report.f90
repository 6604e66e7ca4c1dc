!> The table over load cases: as printed, for cases.json and for cases.csv.
module nocdyn_load_case_report
  use nocdyn_case_results, only: case_result_t, combine_verdicts, is_complete, put_cases, status_done
  use nocdyn_column_names, only: with_unit
  use nocdyn_csv, only: text_cell, write_header
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_load_case_peaks, only: case_run_t, find_peaks, life_t, peak_t, sum_damage
  use nocdyn_output_file, only: output_file_t
  use nocdyn_run_table, only: columns_to_show
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: counted, quoted, rounded_text, string_t, strings
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_verdicts, only: is_kept, is_not_assessed, new_damage_line, verdict_line_t, verdict_t
  implicit none (type, external)
  private

  public :: find_cases_verdict, load_cases_json, load_cases_text, put_load_cases_csv

  integer, parameter :: most_lines = 25   ! printed
  integer, parameter :: digits = 4        ! of printed damages
  integer, parameter :: most_parts = 6    ! of a printed damage

contains

  !> The text of cases.json.
  function load_cases_json(input, runs, verdict) result(text)
    type(input_t), intent(in) :: input   !! of one of the cases
    type(case_run_t), intent(in) :: runs(:)
    type(verdict_t), intent(in) :: verdict   !! of all runs
    character(len=:), allocatable :: text
    type(json_t) :: json
    integer :: i
    type(peak_t), allocatable :: peaks(:)

    call json%open_report(input%file, input%title())
    call verdict%put(json)
    call put_cases(json, results_of(runs))
    call find_peaks(runs, peaks)
    call json%open_list('peaks')
    do i = 1, size(peaks)
      call json%open()
      call json%put('column', peaks(i)%signal%name)
      call json%put('unit', peaks(i)%signal%unit)
      call json%put('largest', peaks(i)%largest)
      call json%put('time', peaks(i)%time)
      call json%put('load_case', runs(peaks(i)%load_case)%load_case%name)
      call json%close()
    end do
    call json%close_list()
    call put_lives(json, runs)
    call json%close()
    text = json%text()
  end function load_cases_json

  !> How the runs ended. A section `runs%case_result_t` would be copied with a warning in a debug build.
  pure function results_of(runs) result(results)
    type(case_run_t), intent(in) :: runs(:)
    type(case_result_t) :: results(size(runs))
    integer :: c

    do c = 1, size(runs)
      results(c) = runs(c)%case_result_t
    end do
  end function results_of

  !> What all runs say of limits, and their damage together.
  subroutine find_cases_verdict(runs, verdict)
    type(case_run_t), intent(in) :: runs(:)
    type(verdict_t), intent(out) :: verdict
    type(life_t), allocatable :: lives(:)
    type(verdict_line_t) :: line
    integer :: i

    call combine_verdicts('run', results_of(runs), verdict)
    call sum_damage(runs, lives)
    do i = 1, size(lives)
      associate (life => lives(i))
        line = new_damage_line('run', life%kind, life%element, life%name, life%exceeds_strength, life%damage)
      end associate
      line%detail = 'all load cases'
      if (line%finding == is_kept .and. .not. is_complete(results_of(runs))) then
        line%finding = is_not_assessed
        line%reason = 'load cases are missing'
      end if
      call verdict%add(line)
    end do
  end subroutine find_cases_verdict

  subroutine put_lives(json, runs)
    type(json_t), intent(inout) :: json
    type(case_run_t), intent(in) :: runs(:)
    type(life_t), allocatable :: lives(:)
    integer :: c, i

    call sum_damage(runs, lives)
    if (size(lives) == 0) return
    call json%open_list('fatigue')
    do i = 1, size(lives)
      call json%open()
      call json%put('name', lives(i)%name)
      call json%put('element', lives(i)%element)
      call json%put('unit', lives(i)%unit)
      if (lives(i)%is_shaft) call json%put('position', lives(i)%position)
      call json%put('damage', lives(i)%damage)
      if (lives(i)%damage > 0 .and. is_complete(results_of(runs))) call json%put('repeats_to_failure', 1 / lives(i)%damage)
      call json%put('mean_exceeds_strength', lives(i)%exceeds_strength)
      call json%open('damage_of_load_cases')
      do c = 1, size(runs)
        call json%put(runs(c)%load_case%name, lives(i)%of_case(c))
      end do
      call json%close()
      call json%close()
    end do
    call json%close_list()
  end subroutine put_lives

  !> Writes cases.csv: the extremes of every column that is written in every load case.
  subroutine put_load_cases_csv(runs, file)
    type(case_run_t), intent(in) :: runs(:)
    type(output_file_t), intent(inout) :: file
    integer :: c, i

    call write_header(file, strings([character(len=15) :: 'load_case', 'column', 'min', 'time_of_min [s]', 'max', &
                                     'time_of_max [s]']))
    do c = 1, size(runs)
      if (.not. runs(c)%summary%extremes%have_begun) cycle
      do i = 2, size(runs(c)%summary%chosen)
        associate (extremes => runs(c)%summary%extremes, column => runs(c)%summary%chosen(i))
          call file%put(text_cell(runs(c)%load_case%name) // ',' // runs(c)%summary%labels(column)%text)
          call file%put_numbers([extremes%lowest(column), extremes%lowest_time(column), extremes%highest(column), &
                                    extremes%highest_time(column)], ',')
          call file%put(new_line('a'))
        end associate
      end do
    end do
  end subroutine put_load_cases_csv

  !> The printed table: the largest magnitudes of the columns that one looks for, with their times and cases; the damage.
  function load_cases_text(runs, verdict) result(text)
    type(case_run_t), intent(in) :: runs(:)
    type(verdict_t), intent(in) :: verdict   !! of all runs
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    type(peak_t), allocatable :: peaks(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: ranks(:), shown(:)
    integer :: i, width

    call verdict%write_table(report)
    call find_peaks(runs, peaks)
    allocate (labels(size(peaks)))
    do i = 1, size(peaks)
      labels(i)%text = with_unit(peaks(i)%signal%name, peaks(i)%signal%unit)
    end do
    ranks = peaks%signal%rank
    allocate (shown, source=columns_to_show(ranks, [(i, i=1, size(peaks))], abs(peaks%largest), most_lines))
    width = maxval([text_width('largest of all load cases'), (text_width(labels(shown(i))%text), i=1, size(shown))])
    call report%append_line(padded('largest of all load cases', width) // cell('value') // cell('at t [s]') // '  load case')
    do i = 1, size(shown)
      associate (peak => peaks(shown(i)))
        call report%append_line(padded(labels(shown(i))%text, width) // cell(peak%largest) // cell(peak%time) // '  ' // &
                                runs(peak%load_case)%load_case%name)
      end associate
    end do
    if (size(shown) < size(peaks)) call report%append_line('(' // counted(size(peaks) - size(shown), 'more column', &
                                                           'more columns') // ' in cases.json)')
    call append_lives(report, runs)
    text = report%text()
  end function load_cases_text

  subroutine append_lives(report, runs)
    type(text_buffer_t), intent(inout) :: report
    type(case_run_t), intent(in) :: runs(:)
    type(life_t), allocatable :: lives(:)
    character(len=:), allocatable :: line
    integer :: c, i

    call sum_damage(runs, lives)
    do i = 1, size(lives)
      line = 'fatigue ' // quoted(lives(i)%name) // ': damage of all load cases ' // rounded_text(lives(i)%damage, digits)
      if (lives(i)%is_shaft) line = line // ' at ' // rounded_text(lives(i)%position, digits) // ' m'
      if (lives(i)%damage > 1) line = line // ', above 1: the part does not last'
      if (is_complete(results_of(runs)) .and. lives(i)%damage > 0 .and. lives(i)%damage <= 1) then
        line = line // ', all of them may occur ' // rounded_text(1 / lives(i)%damage, digits) // ' times'
      end if
      line = line // parts_text(runs, lives(i)%of_case)
      if (lives(i)%exceeds_strength) line = line // '; the mean of a cycle exceeds the strength'
      call report%append_line(line)
    end do
    if (is_complete(results_of(runs))) return
    line = ''
    do c = 1, size(runs)
      if (runs(c)%status == status_done) cycle
      line = line // ', ' // runs(c)%load_case%name // ' (' // trim(runs(c)%status) // ')'
    end do
    call report%append_line('incomplete: ' // line(3:))
  end subroutine append_lives

  !> The largest parts of a damage: " (start 0.2, fault 0.1)".
  function parts_text(runs, damage) result(text)
    type(case_run_t), intent(in) :: runs(:)
    real(wp), intent(in) :: damage(:)   !! [runs]
    character(len=:), allocatable :: text
    logical :: is_left(size(damage))
    integer :: c, k

    text = ''
    is_left = damage > 0
    do k = 1, most_parts
      c = maxloc(damage, dim=1, mask=is_left)
      if (c == 0) exit
      is_left(c) = .false.
      text = text // ', ' // runs(c)%load_case%name // ' ' // rounded_text(damage(c), digits)
    end do
    if (text == '') return
    text = ' (' // text(3:)
    if (any(is_left)) text = text // ', ' // counted(count(is_left), 'other', 'others')
    text = text // ')'
  end function parts_text

end module nocdyn_load_case_report
