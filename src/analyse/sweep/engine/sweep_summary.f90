!> The summary of a sweep: the text of summary.json, and the printed table.
module nocdyn_sweep_summary
  use nocdyn_input, only: group_t, input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_bands, only: bands_file, sweep_bands_t
  use nocdyn_sweep_header, only: fact_names, stored_quantity_t, sweep_header_t, sweep_netcdf_name
  use nocdyn_order_statistics, only: order_statistics_t
  use nocdyn_run_settings, only: put_settings
  use nocdyn_table_text, only: append_table
  use nocdyn_text, only: counted, longest_path, rounded_text, shortened, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: sweep_columns_json, sweep_json, sweep_line, sweep_note, sweep_table

  !> What the computation took.
  type, public :: sweep_effort_t
    integer :: variants = 0              !! computed, without the variants of a journal that was resumed
    integer :: threads = 1               !! of each process
    integer :: ranks = 1                 !! processes
    integer :: lanes = 1                 !! of a block
    real(wp) :: wall_time = 0.0_wp       !! of the computation and of writing the journal [s]
    real(wp) :: writing_time = 0.0_wp    !! of writing the other files [s]
  end type sweep_effort_t

  type, public :: sweep_summary_t
    integer :: done = 0, refused = 0, failed = 0   !! variants
    type(order_statistics_t), allocatable :: statistics(:)   !! of each result, over the variants that are done
    type(sweep_effort_t), allocatable :: effort              !! not allocated after a merge
    character(len=:), allocatable :: first_reason            !! why the first variant is not done; if no variant is
    integer, allocatable :: without_trajectory(:)            !! variants of which trajectories were requested
    type(sweep_bands_t), allocatable :: bands                !! of curves, if some are kept
  end type sweep_summary_t

contains

  !> The text of summary.json.
  function sweep_json(input, header, summary) result(text)
    type(input_t), intent(in) :: input
    type(sweep_header_t), intent(in) :: header
    type(sweep_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    type(json_t) :: json
    type(group_t) :: response
    integer :: i

    call json%open_report(input%file, header%title, merge('done  ', 'failed', summary%done > 0))
    call put_settings(json, input%single('run'))
    call json%open('design')
    call json%put('design', header%design)
    call json%put('seed', header%seed)
    if (header%list_checksum /= '') call json%put('list_checksum', header%list_checksum)
    call json%open('varied')
    do i = 1, size(header%parameters)
      call json%put(header%parameters(i)%label, header%parameters(i)%unit)
    end do
    call json%close()
    call json%close()
    call json%open('counts')
    call json%put('variants', header%variants)
    call json%put('done', summary%done)
    call json%put('refused', summary%refused)
    call json%put('failed', summary%failed)
    call json%close()
    if (allocated(summary%effort)) then
      ! what the computation took
      call json%put('wall_time_s', summary%effort%wall_time)
      call json%put('writing_time_s', summary%effort%writing_time)
      call json%put('variants_computed', summary%effort%variants)
      call json%put('variants_per_second', rate(summary%effort))
      call json%put('threads', summary%effort%threads)
      call json%put('ranks', summary%effort%ranks)
      call json%put('lanes', summary%effort%lanes)
    end if
    ! the order statistics of every result; none if no variant is done
    call json%open('statistics')
    do i = 1, merge(size(summary%statistics), 0, summary%done > 0)
      if (header%results(i)%point > 0) cycle
      associate (found => summary%statistics(i))
        call json%open(header%results(i)%label)
        call json%put('unit', header%results(i)%unit)
        call json%put('min', found%minimum)
        call json%put('variant_of_min', found%variant_of_minimum)
        call json%put('p5', found%low)
        call json%put('median', found%median)
        call json%put('p95', found%high)
        call json%put('max', found%maximum)
        call json%put('variant_of_max', found%variant_of_maximum)
        call json%close()
      end associate
    end do
    call json%close()
    if (allocated(summary%bands)) then
      call json%open('bands')
      call json%put('file', bands_file)
      call json%put('points', size(summary%bands%axis))
      call json%put('curves', summary%bands%curves)
      response = input%single('response')
      if (response%has_value('operating')) then
        call json%put('operating_rad_s', response%numbers('operating'))
        call json%put('margin', response%number('margin', absent=0.0_wp))
      end if
      call json%close()
    end if
    call json%close()
    text = json%text()
  end function sweep_json

  !> Variants per second.
  pure real(wp) function rate(effort)
    type(sweep_effort_t), intent(in) :: effort

    rate = 0.0_wp
    if (effort%wall_time > 0) rate = effort%variants / effort%wall_time
  end function rate

  !> The text of columns.json: what the results of the variants are.
  function sweep_columns_json(header, summary) result(text)
    type(sweep_header_t), intent(in) :: header
    type(sweep_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    type(json_t) :: json
    integer :: i, k

    call json%open()
    call json%open_list('columns')
    do i = 1, size(header%results)
      if (header%results(i)%point > 1) cycle
      associate (one => header%results(i))
        call json%open()
        call json%put('label', label(header, i))
        call json%put('file', sweep_netcdf_name)
        call json%put('name', name_of(header%results(i)))
        do k = 1, size(fact_names)
          call json%put(trim(fact_names(k)), one%facts(k)%text)
        end do
        call json%put('unit', one%unit)
        call json%put('long_name', one%long_name)
        call json%close()
      end associate
    end do
    if (allocated(summary%bands)) call summary%bands%put_columns(header, json)
    call json%close_list()
    call json%close()
    text = json%text()
  end function sweep_columns_json

  !> The title, and the distribution of the results over the variants that are done.
  function sweep_table(header, summary) result(text)
    type(sweep_header_t), intent(in) :: header
    type(sweep_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    character(len=*), parameter :: of_columns(*) = &
      [character(len=14) :: 'min', '5 %', 'median', '95 %', 'max', 'variant of min', 'variant of max']
    type(text_buffer_t) :: report
    type(string_t) :: labels(count(header%results%point == 0))
    real(wp) :: values(size(labels), size(of_columns))
    character(len=32) :: headings(0:size(of_columns))
    integer :: i, row

    if (header%title /= '') call report%append_line(header%title)
    row = 0
    do i = 1, size(header%results)
      if (header%results(i)%point > 0) cycle
      row = row + 1
      labels(row)%text = label(header, i)
      associate (found => summary%statistics(i))
        values(row, :) = [found%minimum, found%low, found%median, found%high, found%maximum, &
                        real(found%variant_of_minimum, wp), real(found%variant_of_maximum, wp)]
      end associate
    end do
    headings(0) = 'result (' // counted(summary%done, 'variant', 'variants') // ')'
    headings(1:) = of_columns
    if (row > 0) call append_table(report, labels, values, headings, 0, 'more results in summary.json')
    if (allocated(summary%bands)) then
      call report%append_line('bands of ' // counted(size(summary%bands%curves), 'curve', 'curves') // ' at ' // &
                              counted(size(summary%bands%axis), 'point', 'points') // ' of ' // summary%bands%axis_label // &
                              ': ' // bands_file)
    end if
    text = report%text()
  end function sweep_table

  !> E.g. "moment_shaft_max_abs [N m]".
  pure function label(header, result_number) result(text)
    type(sweep_header_t), intent(in) :: header
    integer, intent(in) :: result_number
    character(len=:), allocatable :: text

    associate (named => header%results(result_number))
      text = name_of(named)
      if (named%unit /= '') text = text // ' [' // named%unit // ']'
    end associate
  end function label

  !> The label of a result, or of the curve that it is a point of.
  pure function name_of(quantity) result(name)
    type(stored_quantity_t), intent(in) :: quantity
    character(len=:), allocatable :: name

    name = quantity%label
    if (quantity%point > 0) name = quantity%curve()
  end function name_of

  !> Lines on limits that no result is compared with, and on the variants that have no trajectory though it was requested; '' if
  !> there are neither.
  function sweep_note(input, summary) result(text)
    type(input_t), intent(in) :: input
    type(sweep_summary_t), intent(in) :: summary
    character(len=:), allocatable :: text
    integer, allocatable :: limits(:)
    integer :: i

    text = ''
    allocate (limits, source=input%groups_named('limit'))
    if (size(limits) > 0 .and. .not. compares(input)) then
      text = input%location(limits(1)) // ': note: a sweep compares nothing with a &limit; &record with statistic ' // &
             "= 'max_abs' of its moment gives what to compare, and 'ratio' of a response compares"
    end if
    associate (variants => summary%without_trajectory)
      if (size(variants) == 0) return
      if (text /= '') text = text // new_line('a')
      text = text // input%shown_file() // ': note: no trajectory of ' // &
             trim(merge('variant ', 'variants', size(variants) == 1)) // ' ' // to_text(variants(1))
      do i = 2, size(variants)
        text = text // ', ' // to_text(variants(i))
      end do
      text = text // ': refused, or with more rows than allowed'
    end associate
  end function sweep_note

  !> Whether a &record compares with limits.
  pure logical function compares(input)
    type(input_t), intent(in) :: input
    integer :: i, k

    compares = .false.
    do i = 1, size(input%groups)
      if (input%groups(i)%kind /= 'record') cycle
      associate (words => input%groups(i)%texts('statistic'))
        compares = compares .or. any([(words(k)%text == 'ratio' .or. words(k)%text == 'curve', k=1, size(words))])
      end associate
    end do
  end function compares

  !> A line on what was done and where the results are.
  function sweep_line(input, summary, folder) result(text)
    type(input_t), intent(in) :: input
    type(sweep_summary_t), intent(in) :: summary
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: text

    text = input%shown_file() // ': ' // counted(summary%done, 'variant', 'variants') // ' done'
    if (summary%refused > 0) text = text // ', ' // to_text(summary%refused) // ' refused'
    if (summary%failed > 0) text = text // ', ' // to_text(summary%failed) // ' failed'
    if (allocated(summary%effort)) then
      associate (effort => summary%effort)
        if (effort%variants > 0) text = text // ', computed in ' // rounded_text(effort%wall_time, 3) // ' s (' // &
                                        rounded_text(rate(effort), 3) // ' per second)'
        text = text // ', written in ' // rounded_text(effort%writing_time, 3) // ' s'
      end associate
    end if
    text = text // '; results in ' // shortened(folder, longest_path)
  end function sweep_line

end module nocdyn_sweep_summary
