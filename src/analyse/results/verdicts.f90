!> What analyses say of limits: a line for each criterion, with its value, the limit and a finding; the worst line comes first.
module nocdyn_verdicts
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_table_text, only: padded, text_width
  use nocdyn_text, only: quoted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  implicit none (type, external)
  private

  public :: in_words, new_damage_line, new_verdict_line

  !> Findings, from the best to the worst.
  integer, parameter, public :: is_kept = 1
  integer, parameter, public :: is_restricted = 2     !! kept on a condition
  integer, parameter, public :: is_not_assessed = 3   !! nothing can be said, or not of all that is asked for
  integer, parameter, public :: is_exceeded = 4
  character(len=*), parameter :: finding_words(*) = [character(len=12) :: 'kept', 'restricted', 'not assessed', 'exceeded']

  !> What one analysis says of one criterion.
  type, public :: verdict_line_t
    character(len=:), allocatable :: load_case      !! '': the machine itself, or all load cases together
    character(len=:), allocatable :: analysis       !! 'run', 'response', 'campbell'
    character(len=:), allocatable :: element        !! "shaft 'tail'"
    character(len=:), allocatable :: quantity       !! name of the signal
    character(len=:), allocatable :: criterion      !! what is compared: "stress, continuous"
    character(len=:), allocatable :: rule           !! whose limit it is, '': the user's own
    character(len=:), allocatable :: source         !! place of the limit in the input
    character(len=:), allocatable :: unit           !! of value and limit
    character(len=:), allocatable :: detail         !! of where it is: "order 6", "lambda 0.84"
    character(len=:), allocatable :: reason         !! of the finding, '' if there is no more to say
    integer :: finding = is_kept
    logical :: has_value = .false.                  !! whether there are value and limit
    logical :: has_ratio = .false.                  !! whether the limit is the largest value that is allowed
    real(wp) :: value = 0.0_wp, limit = 0.0_wp      !! [unit]
    real(wp) :: ratio = 0.0_wp                      !! above 1: the limit is exceeded
    integer :: speeds = 0                           !! number of the speeds that follow: at one, or from one to another
    real(wp) :: speed(2) = 0.0_wp                   !! [rad/s]
    logical :: are_frequencies = .false.            !! whether they are frequencies of a shaker
    character(len=:), allocatable :: axis, axis_unit   !! of what they are values in place of speeds, and its unit; '': of a speed
    logical :: has_time = .false.
    real(wp) :: time = 0.0_wp                       !! [s]
  contains
    procedure :: compare, stand_at
    procedure, private :: write_assessment, write_place
  end type verdict_line_t

  type, public :: verdict_t
    type(verdict_line_t), allocatable :: lines(:)
  contains
    procedure :: add
    procedure :: add_case       !! adds the lines of a load case
    procedure :: count_found    !! number of lines with a finding
    procedure :: worst_ratio    !! of an element and a criterion
    procedure :: put            !! writes the member `verdict` of a report
    procedure :: write_table    !! as printed
    procedure, private :: list_worst_first
  end type verdict_t

  integer, parameter :: columns = 7         ! of the printed table
  integer, parameter :: most_printed = 40   ! lines; all are in the files
  real(wp), parameter :: negligible = 1.0e-6_wp   ! a ratio that is printed as 0
  integer, parameter :: digits = 4          ! of printed numbers
  integer, parameter :: more_digits = 6     ! of speeds that are as good as equal

contains

  !> A line on a criterion, kept so far.
  pure type(verdict_line_t) function new_verdict_line(analysis, element, quantity, criterion, source) result(self)
    character(len=*), intent(in) :: analysis, element, quantity, criterion, source   !! as in `verdict_line_t`

    self%load_case = ''
    self%analysis = analysis
    self%element = element
    self%quantity = quantity
    self%criterion = criterion
    self%rule = ''
    self%source = source
    self%unit = ''
    self%detail = ''
    self%reason = ''
    self%axis = ''
    self%axis_unit = ''
  end function new_verdict_line

  !> A line on the damage of a &fatigue, of which 1 is allowed.
  pure type(verdict_line_t) function new_damage_line(analysis, kind, element, fatigue, exceeds_strength, damage) result(self)
    character(len=*), intent(in) :: analysis         !! as in `verdict_line_t`
    character(len=*), intent(in) :: kind, element    !! "shaft" and its name
    character(len=*), intent(in) :: fatigue          !! name of the group
    logical, intent(in) :: exceeds_strength          !! whether a mean leaves no strength for an amplitude
    real(wp), intent(in), optional :: damage         !! if cycles are counted

    self = new_verdict_line(analysis, trim(kind) // ' ' // quoted(element), '', 'damage ' // quoted(fatigue), '')
    if (present(damage)) call self%compare(damage, 1.0_wp, '1')
    if (.not. exceeds_strength) return
    self%finding = is_exceeded
    self%reason = 'the mean of a cycle exceeds the strength'
  end function new_damage_line

  !> "total moment" of the symbol total_moment.
  pure function in_words(symbol) result(words)
    character(len=*), intent(in) :: symbol
    character(len=len(symbol)) :: words
    integer :: i

    words = symbol
    do i = 1, len(words)
      if (words(i:i) == '_') words(i:i) = ' '
    end do
  end function in_words

  !> Compares a value with the largest one that is allowed.
  pure subroutine compare(self, value, limit, unit)
    class(verdict_line_t), intent(inout) :: self
    real(wp), intent(in) :: value, limit   !! [unit]
    character(len=*), intent(in) :: unit

    self%has_value = .true.
    self%has_ratio = .true.
    self%value = value
    self%limit = limit
    self%unit = unit
    self%ratio = value / limit
    if (value > limit) self%finding = is_exceeded
  end subroutine compare

  !> Says at which speed the value is.
  pure subroutine stand_at(self, speed)
    class(verdict_line_t), intent(inout) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    self%speeds = 1
    self%speed(1) = speed
  end subroutine stand_at

  !> Adds a line.
  subroutine add(self, line)
    class(verdict_t), intent(inout) :: self
    type(verdict_line_t), intent(in) :: line
    type(verdict_line_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(self%lines)) allocate (self%lines(0))
    allocate (longer(size(self%lines) + 1))
    do i = 1, size(self%lines)
      longer(i) = self%lines(i)
    end do
    longer(size(longer)) = line
    call move_alloc(longer, self%lines)
  end subroutine add

  subroutine add_case(self, verdict, load_case)
    class(verdict_t), intent(inout) :: self
    type(verdict_t), intent(in) :: verdict
    character(len=*), intent(in) :: load_case   !! name
    type(verdict_line_t) :: line
    integer :: i

    if (.not. allocated(verdict%lines)) return
    do i = 1, size(verdict%lines)
      line = verdict%lines(i)
      line%load_case = load_case
      call self%add(line)
    end do
  end subroutine add_case

  pure integer function count_found(self, finding)
    class(verdict_t), intent(in) :: self
    integer, intent(in) :: finding   !! is_...

    count_found = 0
    if (allocated(self%lines)) count_found = count(self%lines%finding == finding)
  end function count_found

  !> Writes the worst finding, how often there is each, and all lines; nothing without lines.
  subroutine put(self, json)
    class(verdict_t), intent(in) :: self
    type(json_t), intent(inout) :: json
    integer, allocatable :: order(:)
    integer :: i

    if (.not. allocated(self%lines)) return
    call json%put('limits_exceeded', self%count_found(is_exceeded) > 0)
    call json%open('verdict')
    call json%put('finding', trim(finding_words(maxval(self%lines%finding))))
    call json%put('exceeded', self%count_found(is_exceeded))
    call json%put('not_assessed', self%count_found(is_not_assessed))
    call json%put('restricted', self%count_found(is_restricted))
    call json%put('kept', self%count_found(is_kept))
    call json%put('largest_ratio', maxval(self%lines%ratio))
    call self%list_worst_first(order)
    call json%open_list('lines')
    do i = 1, size(order)
      call put_line(json, self%lines(order(i)))
    end do
    call json%close_list()
    call json%close()
  end subroutine put

  subroutine put_line(json, line)
    type(json_t), intent(inout) :: json
    type(verdict_line_t), intent(in) :: line
    character(len=:), allocatable :: assessment

    call json%open()
    if (line%load_case /= '') call json%put('load_case', line%load_case)
    call json%put('analysis', line%analysis)
    call json%put('element', line%element)
    if (line%quantity /= '') call json%put('quantity', line%quantity)
    call json%put('criterion', line%criterion)
    if (line%rule /= '') call json%put('rule', line%rule)
    if (line%source /= '') call json%put('limit_at', line%source)
    call json%put('finding', trim(finding_words(line%finding)))
    call line%write_assessment(assessment)
    call json%put('assessment', assessment)
    if (line%has_value) then
      call json%put('value', line%value)
      call json%put('limit', line%limit)
      call json%put('unit', line%unit)
    end if
    if (line%has_ratio) call json%put('ratio', line%ratio)
    if (line%axis /= '' .and. line%speeds > 0) then
      call json%put('parameter', line%axis)
      if (line%axis_unit /= '') call json%put('parameter_unit', line%axis_unit)
      if (line%speeds == 1) call json%put('parameter_value', line%speed(1))
      if (line%speeds == 2) call json%put('parameter_values', line%speed)
    else if (line%are_frequencies) then
      if (line%speeds == 1) call json%put('frequency_Hz', from_si(line%speed(1), unit_hz))
      if (line%speeds == 2) call json%put('frequencies_Hz', from_si(line%speed, unit_hz))
    else
      if (line%speeds == 1) call json%put('speed_rad_s', line%speed(1))
      if (line%speeds == 2) call json%put('speeds_rad_s', line%speed)
    end if
    if (line%has_time) call json%put('time', line%time)
    if (line%detail /= '') call json%put('detail', line%detail)
    call json%close()
  end subroutine put_line

  !> The lines by findings, and by ratios within one.
  pure subroutine list_worst_first(self, order)
    class(verdict_t), intent(in) :: self
    integer, allocatable, intent(out) :: order(:)
    integer :: i, k
    logical :: is_worse

    allocate (order(size(self%lines)))
    do i = 1, size(order)
      order(i) = i
      do k = i, 2, -1
        associate (line => self%lines(order(k)), before => self%lines(order(k - 1)))
          is_worse = line%finding > before%finding .or. (line%finding == before%finding .and. line%ratio > before%ratio)
        end associate
        if (.not. is_worse) exit
        order(k - 1:k) = [order(k), order(k - 1)]
      end do
    end do
  end subroutine list_worst_first

  !> The largest ratio of value to limit of the lines of an element and a criterion; 0 if there is none.
  pure real(wp) function worst_ratio(self, element, criterion)
    class(verdict_t), intent(in) :: self
    character(len=*), intent(in) :: element, criterion
    integer :: i

    worst_ratio = 0.0_wp
    if (.not. allocated(self%lines)) return
    do i = 1, size(self%lines)
      associate (line => self%lines(i))
        if (line%has_ratio .and. line%element == element .and. line%criterion == criterion) then
          worst_ratio = max(worst_ratio, line%ratio)
        end if
      end associate
    end do
  end function worst_ratio

  !> Writes a line with the finding of all, and the table; nothing without lines. Lines that differ in the load case only are one.
  subroutine write_table(self, report)
    class(verdict_t), intent(in) :: self
    type(text_buffer_t), intent(inout) :: report
    type(string_t), allocatable :: cells(:, :)   ! [columns, rows and headings]
    integer, allocatable :: order(:)
    integer :: i, row, rows, width(columns)

    if (.not. allocated(self%lines)) return
    call append_findings(self, report)
    call self%list_worst_first(order)
    allocate (cells(columns, 0:size(order)))
    call write_headings(cells(:, 0))
    rows = 0
    do i = 1, size(order)
      call write_cells(self%lines(order(i)), cells(:, rows + 1))
      do row = 1, rows
        if (are_equal(cells(2:, row), cells(2:, rows + 1))) exit
      end do
      if (row > rows) then
        rows = rows + 1
      else
        cells(1, row)%text = cells(1, row)%text // ', ' // cells(1, rows + 1)%text
      end if
    end do
    do row = 1, rows
      call shorten_cases(cells(1, row)%text)
    end do
    do i = 1, columns
      width(i) = widest(cells(i, :min(rows, most_printed)))
    end do
    if (widest(cells(1, 1:rows)) == 0) width(1) = 0
    do row = 0, min(rows, most_printed)
      call append_cells(cells(:, row), width, report)
    end do
    if (rows > most_printed) call report%append_line('  (' // to_text(rows - most_printed) // &
                                                     ' more lines of the verdict in the files)')
  end subroutine write_table

  pure logical function are_equal(first, second)
    type(string_t), intent(in) :: first(:), second(:)
    integer :: i

    are_equal = all([(first(i)%text == second(i)%text, i=1, size(first))])
  end function are_equal

  !> "start, fault", but "start and 3 more" for "start, fault, full, half".
  pure subroutine shorten_cases(names)
    character(len=:), allocatable, intent(inout) :: names
    integer :: first, i, others

    others = count([(names(i:i) == ',', i=1, len(names))])
    if (others <= 1) return
    first = index(names, ',') - 1
    names = names(:first) // ' and ' // to_text(others) // ' more'
  end subroutine shorten_cases

  !> "verdict: exceeded (1 exceeded, 2 not assessed, 4 kept)".
  subroutine append_findings(self, report)
    type(verdict_t), intent(in) :: self
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: counts
    integer :: finding

    counts = ''
    do finding = is_exceeded, is_kept, -1
      if (self%count_found(finding) == 0) cycle
      counts = counts // ', ' // to_text(self%count_found(finding)) // ' ' // trim(finding_words(finding))
    end do
    call report%append_line('verdict: ' // trim(finding_words(maxval(self%lines%finding))) // ' (' // counts(3:) // ')')
  end subroutine append_findings

  subroutine write_headings(cells)
    type(string_t), intent(out) :: cells(:)
    character(len=*), parameter :: headings(columns) = &
      [character(len=9) :: 'load case', 'element', 'criterion', 'value', 'limit', 'of limit', 'finding']
    integer :: i

    do i = 1, columns
      cells(i)%text = trim(headings(i))
    end do
  end subroutine write_headings

  subroutine write_cells(line, cells)
    type(verdict_line_t), intent(in) :: line
    type(string_t), intent(out) :: cells(:)   !! [columns]

    cells(1)%text = line%load_case
    cells(2)%text = line%element
    cells(3)%text = line%criterion
    if (line%rule /= '') cells(3)%text = line%criterion // ' (' // line%rule // ')'
    cells(4)%text = ''
    cells(5)%text = ''
    cells(6)%text = ''
    if (line%has_value) then
      call write_amount(line%value, line%limit, line%unit, cells(4)%text)
      call write_amount(line%limit, line%limit, line%unit, cells(5)%text)
      if (line%ratio > negligible) cells(6)%text = rounded_text(100.0_wp * line%ratio, digits) // ' %'
      if (line%ratio > 0 .and. line%ratio <= negligible) cells(6)%text = '0 %'
    end if
    call line%write_assessment(cells(7)%text)
  end subroutine write_cells

  !> "exceeded at 106.8 to 107.1 rpm, lambda 0.84: not allowed by IACS UR M68".
  subroutine write_assessment(self, text)
    class(verdict_line_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable :: place

    call self%write_place(place)
    text = trim(finding_words(self%finding))
    if (self%speeds > 0 .or. self%has_time) then
      text = text // trim(merge(', nearest at', ' at         ', self%finding == is_kept)) // ' ' // place
    else if (place /= '') then
      text = text // ', ' // place
    end if
    if (self%reason /= '') text = text // ': ' // self%reason
  end subroutine write_assessment

  !> "106.8 to 107.1 rpm, lambda 0.84", "212 N m of motor.mean.torque"; '' for a line of no place.
  subroutine write_place(self, text)
    class(verdict_line_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text
    real(wp) :: speed(2)   ! [rpm], [Hz] or of the axis
    integer :: all_digits

    text = ''
    speed = from_si(self%speed, merge(unit_hz, unit_rpm, self%are_frequencies))
    if (self%axis /= '') speed = self%speed
    all_digits = digits
    if (self%speeds == 2 .and. rounded_text(speed(1), digits) == rounded_text(speed(2), digits)) all_digits = more_digits
    if (self%speeds > 0) text = rounded_text(speed(1), all_digits)
    if (self%speeds > 1) text = text // ' to ' // rounded_text(speed(2), all_digits)
    if (self%speeds > 0 .and. self%axis == '') text = text // trim(merge(' Hz ', ' rpm', self%are_frequencies))
    if (self%speeds > 0 .and. self%axis_unit /= '') text = text // ' ' // self%axis_unit
    if (self%speeds > 0 .and. self%axis /= '') text = text // ' of ' // self%axis
    if (self%has_time) text = 't = ' // rounded_text(self%time, digits) // ' s'
    if (self%detail == '') return
    if (text /= '') text = text // ', '
    text = text // self%detail
  end subroutine write_place

  !> A value with its unit, in MPa, kN m or kW if the limit is large.
  subroutine write_amount(value, limit, unit, text)
    real(wp), intent(in) :: value, limit   !! [unit]
    character(len=*), intent(in) :: unit
    character(len=:), allocatable, intent(out) :: text
    real(wp), parameter :: large = 1.0e4_wp, kilo = 1.0e3_wp, mega = 1.0e6_wp

    text = rounded_text(value, digits)
    if (unit == '1') return
    if (unit == '%') then
      text = text // ' %'
    else if (unit == 'Pa' .and. limit >= large) then
      text = rounded_text(value / mega, digits) // ' MPa'
    else if (any(unit == [character(len=3) :: 'N m', 'N', 'W']) .and. limit >= large) then
      text = rounded_text(value / kilo, digits) // ' k' // unit
    else
      text = text // ' ' // unit
    end if
  end subroutine write_amount

  pure integer function widest(cells)
    type(string_t), intent(in) :: cells(:)
    integer :: i

    widest = maxval([(text_width(cells(i)%text), i=1, size(cells))])
  end function widest

  !> Adds a line of cells, numbers to the right; columns without a width are left out.
  subroutine append_cells(cells, width, report)
    type(string_t), intent(in) :: cells(:)
    integer, intent(in) :: width(:)
    type(text_buffer_t), intent(inout) :: report
    character(len=:), allocatable :: line
    integer :: i

    line = ''
    do i = 1, columns
      if (width(i) == 0) cycle
      if (i >= 4 .and. i <= 6) then
        line = line // '  ' // repeat(' ', width(i) - text_width(cells(i)%text)) // cells(i)%text
      else
        line = line // '  ' // padded(cells(i)%text, width(i))
      end if
    end do
    call report%append_line(trim(line))
  end subroutine append_cells

end module nocdyn_verdicts
