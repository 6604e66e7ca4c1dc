!> The results of the fatigue of a run: for summary.json, for the printed table, and as cycles.csv.
module nocdyn_fatigue_report
  use nocdyn_csv, only: text_cell, write_header
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_file, only: output_file_t
  use nocdyn_run_fatigue, only: run_fatigue_t
  use nocdyn_text, only: quoted, rounded_text, strings
  implicit none (type, external)
  private

  public :: put_fatigue, fatigue_text, put_cycles_csv

  integer, parameter :: digits = 4   ! of printed numbers

contains

  !> Writes a list with the cycles and the damage of every item; nothing without items.
  subroutine put_fatigue(json, fatigue)
    type(json_t), intent(inout) :: json
    type(run_fatigue_t), intent(in) :: fatigue
    integer :: i, k

    if (size(fatigue%items) == 0) return
    call json%open_list('fatigue')
    do i = 1, size(fatigue%items)
      k = fatigue%worst(i)
      associate (item => fatigue%items(i), counter => fatigue%counters(k))
        call json%open()
        call json%put('name', item%name)
        call json%put('element', item%element)
        call json%put('unit', item%unit)
        if (item%last > item%first) call json%put('position', fatigue%position(k))
        call json%put('cycles', counter%cycles)
        call json%put('largest_range', counter%largest_range)
        call json%put('mean_of_largest_range', counter%mean_of_largest)
        call json%put('damage', counter%damage)
        call json%put('repeats', item%repeats)
        call json%put('damage_of_repeats', item%repeats * counter%damage)
        if (counter%damage > 0) call json%put('repeats_to_failure', 1 / counter%damage)
        call json%put('mean_exceeds_strength', counter%has_failed)
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_fatigue

  !> A line for every item, each with a line feed.
  function fatigue_text(fatigue) result(text)
    type(run_fatigue_t), intent(in) :: fatigue
    character(len=:), allocatable :: text
    integer :: i, k

    text = ''
    do i = 1, size(fatigue%items)
      k = fatigue%worst(i)
      associate (item => fatigue%items(i), counter => fatigue%counters(k))
        text = text // 'fatigue ' // quoted(item%name) // ': ' // rounded_text(counter%cycles, digits) // &
               ' cycles, range up to ' // rounded_text(counter%largest_range, digits) // ' ' // item%unit
        if (item%last > item%first) text = text // ' at ' // rounded_text(fatigue%position(k), digits) // ' m'
        if (counter%damage > 0) then
          text = text // '; damage ' // rounded_text(counter%damage, digits) // ', the life is ' // &
                 rounded_text(1 / counter%damage, digits) // ' such runs'
          if (abs(item%repeats - 1) > 0) text = text // '; ' // rounded_text(item%repeats, digits) // ' of them: damage ' // &
                                                rounded_text(item%repeats * counter%damage, digits)
        else
          text = text // '; no damage'
        end if
        if (counter%has_failed) text = text // '; the mean of a cycle exceeds the strength'
        text = text // new_line('a')
      end associate
    end do
  end function fatigue_text

  !> Writes cycles.csv: the classes of cycles of every item, the ones of a shaft where the damage is largest.
  subroutine put_cycles_csv(fatigue, file)
    type(run_fatigue_t), intent(in) :: fatigue
    type(output_file_t), intent(inout) :: file
    real(wp), allocatable :: rows(:, :)
    integer :: c, i

    call write_header(file, strings([character(len=7) :: 'fatigue', 'unit', 'range', 'mean', 'cycles', 'damage']))
    do i = 1, size(fatigue%items)
      associate (item => fatigue%items(i), classes => fatigue%counters(fatigue%worst(i))%classes)
        allocate (rows, source=classes%list())
        do c = 1, size(rows, 2)
          call file%put(text_cell(item%name) // ',' // item%unit)
          call file%put_numbers(rows(:, c), ',')
          call file%put(new_line('a'))
        end do
        deallocate (rows)
      end associate
    end do
  end subroutine put_cycles_csv

end module nocdyn_fatigue_report
