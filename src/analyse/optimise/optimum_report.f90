!> Reports on the best choice: what is printed, optimise.csv with all candidates, and optimise.json.
module nocdyn_optimum_report
  use nocdyn_column_names, only: with_unit
  use nocdyn_csv, only: text_cell
  use nocdyn_design_choices, only: design_number_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_minimax, only: is_better, kept
  use nocdyn_optimum_search, only: candidate_t, optimum_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_report_openings, only: append_notes, open_analysis_report
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: append, counted, quoted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: list_optimum_notes, optimum_csv, optimum_text, put_optimum

  integer, parameter :: most_printed = 20   ! candidates and limits; all are in the files
  real(wp), parameter :: at_end = 1.0e-6_wp, at_limit = 1.0e-3_wp   ! shares of ranges and limits
  character(len=*), parameter :: line_end = new_line('a')

contains

  !> What a reader must know of the best choice.
  subroutine list_optimum_notes(self)
    type(optimum_t), intent(inout) :: self
    character(len=:), allocatable :: active, broken
    integer :: i

    active = ''
    broken = ''
    associate (best => self%candidates(self%best))
      if (is_better(self%before%point, best%point)) call append_if_worse(self)
      do i = 1, size(self%numbers)
        associate (one => self%numbers(i), value => best%values(i))
          if (.not. one%is_continuous) then
            call append_steps(one, self%notes)
            cycle
          end if
          if (value - one%low <= at_end * (one%high - one%low)) then
            call append(self%notes, one%path // ' is at its bound low = ' // to_text(one%low) // &
                                    ': a better one may lie beyond')
          else if (one%high - value <= at_end * (one%high - one%low)) then
            call append(self%notes, one%path // ' is at its bound high = ' // to_text(one%high) // &
                                    ': a better one may lie beyond')
          end if
        end associate
      end do
      do i = 1, size(self%bounds)
        if (best%excess_of(i) > kept) then
          broken = broken // '; ' // self%bounds(i)%label // ', ' // ratio_text(best, i)
        else if (best%excess_of(i) > -at_limit) then
          active = active // '; ' // self%bounds(i)%label
        end if
      end do
      if (broken /= '') call append(self%notes, 'no choice keeps all limits; of the one that exceeds them least: ' // broken(3:))
      if (active /= '') call append(self%notes, 'a limit is what keeps it from being better: ' // active(3:))
      if (size(self%objectives) > 1) call append(self%notes, 'of the objectives, the worst counts, each over its scale: ' // &
                                                 self%objectives(maxloc(best%point%goal, dim=1))%label)
    end associate
    associate (failed => count([(.not. self%candidates(i)%point%is_valid, i=1, size(self%candidates))]))
      if (failed > 0) call append(self%notes, counted(failed, 'combination gives', 'combinations give') // ' no objective')
    end associate
  end subroutine list_optimum_notes

  !> A note of steps that do not reach the highest value.
  subroutine append_steps(number, notes)
    type(design_number_t), intent(in) :: number   !! one of a list of values
    type(string_t), allocatable, intent(inout) :: notes(:)

    if (maxval(number%values) >= number%high) return
    if (size(number%values) == 1) then
      call append(notes, number%path // ' has one value only, low = ' // to_text(number%low) // &
                  ': the step is larger than the range to high = ' // to_text(number%high))
    else
      call append(notes, number%path // ': the steps from low = ' // to_text(number%low) // ' do not reach high = ' // &
                  to_text(number%high) // '; its highest value is ' // to_text(maxval(number%values)))
    end if
  end subroutine append_steps

  !> A note that the input is better than the best choice, and why it is none of the choices.
  subroutine append_if_worse(self)
    type(optimum_t), intent(inout) :: self
    real(wp), parameter :: rounding = 1.0e-9_wp   ! of goals
    character(len=:), allocatable :: note, why
    integer :: i

    associate (best => self%candidates(self%best), before => self%before)
      note = 'the input is better than the best choice'
      if (before%point%excess() > 0 .or. best%point%excess() > 0) then
        note = note // ', it exceeds limits less'
      else
        associate (i => maxloc(before%point%goal, dim=1), least => rounding * abs(best%point%worst()))
          if (best%point%worst() - before%point%worst() <= least) return
          note = note // ', ' // self%objectives(i)%label // ' ' // &
                 rounded_text(self%objectives(i)%value(before%point%goal(i)), 7) // ' against ' // &
                 rounded_text(self%objectives(i)%value(best%point%goal(i)), 7)
        end associate
      end if
      why = ''
      do i = 1, size(self%sizes)
        if (self%sizes(i)%has(before%sizes(i)%text)) cycle
        why = why // '; ' // self%sizes(i)%path // ' = ' // quoted(before%sizes(i)%text) // ' is not among its sizes'
      end do
      do i = 1, size(self%numbers)
        associate (one => self%numbers(i))
          if (one%has(before%values(i))) cycle
          why = why // '; ' // one%path // ' = ' // to_text(before%values(i))
          if (one%is_continuous) why = why // ' is not from ' // to_text(one%low) // ' to ' // to_text(one%high)
          if (.not. one%is_continuous) why = why // ' is not among its values'
        end associate
      end do
      if (why == '') why = '; the search did not find it, more --starts may'
    end associate
    call append(self%notes, note // ': ' // why(3:))
  end subroutine append_if_worse

  !> "98.2 %" of a limit.
  function ratio_text(candidate, bound) result(text)
    type(candidate_t), intent(in) :: candidate
    integer, intent(in) :: bound
    character(len=:), allocatable :: text

    text = 'none'
    if (candidate%has_limit(bound)) text = rounded_text(100.0_wp * (1.0_wp + candidate%excess_of(bound)), 4) // ' %'
  end function ratio_text

  !> The table of what is chosen and what it gives.
  function optimum_text(file, self) result(text)
    character(len=*), intent(in) :: file
    type(optimum_t), intent(in) :: self
    character(len=:), allocatable :: text
    character(len=:), allocatable :: line
    type(text_buffer_t) :: report
    integer :: i, width

    call append_notes(report, file, self%notes)
    line = file // ': best of ' // counted(self%evaluations, 'machine', 'machines')
    if (size(self%candidates) > 1) line = line // ' in ' // to_text(size(self%candidates)) // ' combinations'
    call report%append_line(line)
    width = max(10, widest(self))
    associate (best => self%candidates(self%best))
      call report%append_line('  ' // padded('chosen', width) // cell('before') // cell('best') // cell('low') // cell('high'))
      do i = 1, size(self%sizes)
        call report%append_line('  ' // padded(self%sizes(i)%path, width) // cell(self%before%sizes(i)%text) // &
                                cell(best%sizes(i)%text))
      end do
      do i = 1, size(self%numbers)
        associate (one => self%numbers(i))
          line = '  ' // padded(one%path, width) // cell(one%before) // cell(best%values(i))
          call report%append_line(line // cell(one%low) // cell(one%high) // '  ' // one%unit)
        end associate
      end do
      call report%append_line('  ' // padded('objective', width) // cell('before') // cell('best') // cell('goal'))
      do i = 1, size(self%objectives)
        associate (one => self%objectives(i))
          line = '  ' // padded(one%label, width)
          if (self%before%point%is_valid) then
            line = line // cell(one%value(self%before%point%goal(i)))
          else
            line = line // cell('none')
          end if
          call report%append_line(line // cell(one%value(best%point%goal(i))) // &
                                  cell(trim(merge('smallest', 'largest ', one%is_minimised))) // '  ' // one%unit)
        end associate
      end do
      if (size(self%bounds) > 0) call report%append_line('  ' // padded('of limit', width) // cell('before') // cell('best'))
      do i = 1, min(size(self%bounds), most_printed)
        call report%append_line('  ' // padded(self%bounds(i)%label, width) // cell(ratio_text(self%before, i)) // &
                                cell(ratio_text(best, i)))
      end do
    end associate
    if (size(self%candidates) > 1) call append_candidates(self, report)
    text = report%text()
  end function optimum_text

  pure integer function widest(self)
    type(optimum_t), intent(in) :: self
    integer :: i

    widest = maxval([(len(self%numbers(i)%path), i=1, size(self%numbers)), &
                     (len(self%sizes(i)%path), i=1, size(self%sizes)), &
                     (text_width(self%objectives(i)%label), i=1, size(self%objectives)), &
                     (text_width(self%bounds(i)%label), i=1, size(self%bounds))])
  end function widest

  !> The combinations, the best first.
  subroutine append_candidates(self, report)
    type(optimum_t), intent(in) :: self
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer, allocatable :: order(:)
    integer :: i, k

    call rank_candidates(self%candidates, order)
    line = ' '
    do i = 1, size(self%sizes)
      line = line // cell('size')
    end do
    do i = 1, size(self%numbers)
      line = line // cell(last_part(self%numbers(i)%path))
    end do
    do i = 1, size(self%objectives)
      if (size(self%objectives) == 1) line = line // cell('objective')
      if (size(self%objectives) > 1) line = line // cell('objective ' // to_text(i))
    end do
    if (size(self%bounds) > 0) line = line // cell('of limits')
    call report%append_line(line)
    do k = 1, size(order)
      associate (one => self%candidates(order(k)))
        line = ' '
        do i = 1, size(self%sizes)
          line = line // cell(one%sizes(i)%text)
        end do
        do i = 1, size(self%numbers)
          line = line // cell(one%values(i))
        end do
        if (.not. one%point%is_valid) then
          line = line // '  none'
        else
          do i = 1, size(self%objectives)
            line = line // cell(self%objectives(i)%value(one%point%goal(i)))
          end do
          if (size(one%point%limit) > 0) line = line // cell(ratio_text(one, maxloc([(one%excess_of(i), &
                                                                                     i=1, size(self%bounds))], dim=1)))
        end if
      end associate
      call report%append_line(line)
    end do
    if (size(order) < size(self%candidates)) then
      call report%append_line('  (' // to_text(size(self%candidates) - size(order)) // ' more combinations in optimise.csv)')
    end if
  end subroutine append_candidates

  !> The key of a path.
  pure function last_part(path) result(key)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: key

    key = path(index(path, '.', back=.true.) + 1:)
  end function last_part

  !> The first candidates by their goals, those that exceed limits last.
  subroutine rank_candidates(candidates, order)
    type(candidate_t), intent(in) :: candidates(:)
    integer, allocatable, intent(out) :: order(:)
    real(wp), parameter :: exceeded = 1.0e100_wp
    real(wp) :: merit(size(candidates))
    integer :: i

    do i = 1, size(candidates)
      associate (point => candidates(i)%point)
        merit(i) = huge(1.0_wp)
        if (point%is_valid) merit(i) = point%worst()
        if (point%is_valid .and. point%excess() > 0) merit(i) = exceeded * (1.0_wp + point%excess())
      end associate
    end do
    allocate (order, source=ascending_order(merit))
    if (size(order) > most_printed) order = order(:most_printed)
  end subroutine rank_candidates

  !> optimise.csv: a row for each candidate.
  subroutine optimum_csv(self, file)
    type(optimum_t), intent(in) :: self
    type(output_file_t), intent(inout) :: file
    integer :: i, k

    call file%put('best')
    do i = 1, size(self%sizes)
      call file%put(',' // text_cell(self%sizes(i)%path))
    end do
    do i = 1, size(self%numbers)
      call file%put(',' // text_cell(with_unit(self%numbers(i)%path, self%numbers(i)%unit)))
    end do
    do i = 1, size(self%objectives)
      call file%put(',' // text_cell(with_unit(self%objectives(i)%label, self%objectives(i)%unit)))
    end do
    do i = 1, size(self%bounds)
      call file%put(',' // text_cell(self%bounds(i)%label // ' [of limit]'))
    end do
    call file%put(line_end)
    do k = 1, size(self%candidates)
      associate (one => self%candidates(k))
        call file%put(trim(merge('yes', 'no ', k == self%best)))
        do i = 1, size(self%sizes)
          call file%put(',' // text_cell(one%sizes(i)%text))
        end do
        call file%put_numbers(one%values, ',')
        if (one%point%is_valid) then
          call file%put_numbers([(self%objectives(i)%value(one%point%goal(i)), i=1, size(self%objectives))], ',')
        else
          call file%put(repeat(',', size(self%objectives)))
        end if
        do i = 1, size(self%bounds)
          if (one%has_limit(i)) then
            call file%put_numbers([1.0_wp + one%excess_of(i)], ',')
          else
            call file%put(',')
          end if
        end do
        call file%put(line_end)
      end associate
    end do
  end subroutine optimum_csv

  !> The members of optimise.json.
  subroutine put_optimum(json, input, self)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(optimum_t), intent(in) :: self
    integer :: i

    call open_analysis_report(json, input)
    call json%put('notes', self%notes)
    call json%put('evaluations', self%evaluations)
    call json%put('combinations', size(self%candidates))
    associate (best => self%candidates(self%best), before => self%before)
      call json%put('keeps_limits', .not. best%point%excess() > 0)
      call json%open_list('sizes')
      do i = 1, size(self%sizes)
        call json%open()
        call json%put('target', self%sizes(i)%path)
        call json%put('before', before%sizes(i)%text)
        call json%put('best', best%sizes(i)%text)
        call json%close()
      end do
      call json%close_list()
      call json%open_list('numbers')
      do i = 1, size(self%numbers)
        call json%open()
        call json%put('target', self%numbers(i)%path)
        call json%put('unit', self%numbers(i)%unit)
        call json%put('before', self%numbers(i)%before)
        call json%put('best', best%values(i))
        call json%put('low', self%numbers(i)%low)
        call json%put('high', self%numbers(i)%high)
        call json%close()
      end do
      call json%close_list()
      call json%open_list('objectives')
      do i = 1, size(self%objectives)
        associate (one => self%objectives(i))
          call json%open()
          call json%put('name', one%label)
          call json%put('unit', one%unit)
          call json%put('goal', trim(merge('minimise', 'maximise', one%is_minimised)))
          call json%put('scale', one%scale)
          if (before%point%is_valid) call json%put('before', one%value(before%point%goal(i)))
          call json%put('best', one%value(best%point%goal(i)))
          call json%close()
        end associate
      end do
      call json%close_list()
      call json%open_list('limits')
      do i = 1, size(self%bounds)
        call json%open()
        call json%put('name', self%bounds(i)%label)
        if (before%has_limit(i)) call json%put('ratio_before', 1.0_wp + before%excess_of(i))
        if (best%has_limit(i)) call json%put('ratio', 1.0_wp + best%excess_of(i))
        call json%close()
      end do
      call json%close_list()
    end associate
    call json%close()
  end subroutine put_optimum

end module nocdyn_optimum_report
