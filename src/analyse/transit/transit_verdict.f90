!> What the passages of ranges of speeds say of limits: of half ranges while a range is passed, of largest magnitudes, of the
!> time in the range, and the damage of all passages in the life of the machine. A passage that is missing is not assessed.
module nocdyn_transit_verdict
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_mean_speeds, only: visit_t
  use nocdyn_response_limits, only: no_limit
  use nocdyn_run_fatigue, only: fatigue_item_t
  use nocdyn_run_verdict, only: add_peaks, column_extreme_t
  use nocdyn_text, only: quoted, rounded_text, to_text
  use nocdyn_transit_analysis, only: passage_t, transit_analysis_t
  use nocdyn_transit_settings, only: transit_range_t
  use nocdyn_units, only: from_si, unit_rpm
  use nocdyn_verdicts, only: in_words, is_not_assessed, new_damage_line, new_verdict_line, verdict_line_t, verdict_t
  implicit none (type, external)
  private

  public :: direction_word, find_transit_verdict, range_text, repeats_of, sum_life

  integer, parameter :: digits = 4   ! of printed numbers

  !> The damage of one &fatigue by all passages in the life of the machine, at its worst point.
  type, public :: transit_life_t
    type(fatigue_item_t) :: item
    real(wp) :: damage = 0.0_wp
    real(wp) :: repeats = 1.0_wp             !! of each passage
    real(wp) :: position = 0.0_wp            !! along a shaft [m]
    logical :: exceeds_strength = .false.
  end type transit_life_t

contains

  !> Lists what is said of all ranges, limits and damages.
  subroutine find_transit_verdict(input, analysis, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(verdict_t), intent(out) :: verdict
    integer :: k

    if (size(analysis%settings%ranges) == 0) call add_no_range(input, analysis, verdict)
    do k = 1, size(analysis%settings%ranges)
      call add_missing(input, analysis, k, verdict)
    end do
    do k = 1, size(analysis%passages)
      call add_time(input, analysis, analysis%passages(k), verdict)
      call add_largest(input, analysis, analysis%passages(k), verdict)
      call add_half_ranges(input, analysis, analysis%passages(k), verdict)
    end do
    call add_damage(input, analysis, verdict)
  end subroutine find_transit_verdict

  !> "48.63 to 58.71 rpm"
  function range_text(range) result(text)
    type(transit_range_t), intent(in) :: range
    character(len=:), allocatable :: text

    text = rounded_text(from_si(range%low, unit_rpm), digits) // ' to ' // &
           rounded_text(from_si(range%high, unit_rpm), digits) // ' rpm'
  end function range_text

  !> 'up', 'down', or how a visit does not pass the range.
  pure function direction_word(visit) result(word)
    type(visit_t), intent(in) :: visit
    character(len=:), allocatable :: word

    if (visit%passes()) then
      word = trim(merge('up  ', 'down', visit%to > 0))
    else if (visit%to == 0) then
      word = 'the run ends in it'
    else if (visit%from == 0) then
      word = 'the run begins in it'
    else
      word = 'turns back'
    end if
  end function direction_word

  subroutine add_no_range(input, analysis, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line

    line = new_verdict_line('transit', 'machine', '', 'barred ranges of speed', input%place(analysis%settings%group, ''))
    line%reason = 'no &limit bars a range of &response'
    call verdict%add(line)
  end subroutine add_no_range

  !> Passages of a range that the run does not make.
  subroutine add_missing(input, analysis, number, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the range
    type(verdict_t), intent(inout) :: verdict
    logical :: is_up, is_down

    associate (passages => analysis%passages)
      is_up = any(passages%range == number .and. passages%visit%passes() .and. passages%visit%to > 0)
      is_down = any(passages%range == number .and. passages%visit%passes() .and. passages%visit%to < 0)
    end associate
    if (analysis%settings%needs_up .and. .not. is_up) call add_gap('passage up')
    if (analysis%settings%needs_down .and. .not. is_down) call add_gap('passage down')
    if (.not. (is_up .or. is_down .or. analysis%settings%needs_up .or. analysis%settings%needs_down)) call add_gap('passage')

  contains

    subroutine add_gap(what)
      character(len=*), intent(in) :: what
      type(verdict_line_t) :: line

      line = new_verdict_line('transit', element_of(analysis), '', what // ' of ' // &
                              range_text(analysis%settings%ranges(number)), input%place(analysis%settings%group, ''))
      line%finding = is_not_assessed
      line%reason = reason_of(analysis, number)
      call verdict%add(line)
    end subroutine add_gap

  end subroutine add_missing

  !> Why the run does not pass a range as it should.
  function reason_of(analysis, number) result(text)
    type(transit_analysis_t), intent(in) :: analysis
    integer, intent(in) :: number   !! of the range
    character(len=:), allocatable :: text
    integer :: i

    if (.not. analysis%highest > 0) then
      text = 'the run has no whole turn forwards'
      return
    end if
    text = 'the mean speed of the run goes from ' // rounded_text(from_si(analysis%lowest, unit_rpm), digits) // ' to ' // &
           rounded_text(from_si(analysis%highest, unit_rpm), digits) // ' rpm'
    do i = 1, size(analysis%passages)
      if (analysis%passages(i)%range /= number .or. analysis%passages(i)%visit%passes()) cycle
      text = text // '; at t = ' // rounded_text(analysis%passages(i)%visit%enters, digits) // ' s it is in the range: ' // &
             direction_word(analysis%passages(i)%visit)
    end do
  end function reason_of

  !> "body 'propeller'"
  function element_of(analysis) result(text)
    type(transit_analysis_t), intent(in) :: analysis
    character(len=:), allocatable :: text

    text = 'body ' // quoted(analysis%body_name)
  end function element_of

  !> The time in the range.
  subroutine add_time(input, analysis, passage, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(passage_t), intent(in) :: passage
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line

    if (analysis%settings%time_limit >= no_limit) return
    line = new_verdict_line('transit', element_of(analysis), '', &
                            'time in ' // range_text(analysis%settings%ranges(passage%range)), &
                            input%place(analysis%settings%group, 'time_limit'))
    call line%compare(passage%visit%duration(), analysis%settings%time_limit, 's')
    call place(passage, line)
    call verdict%add(line)
  end subroutine add_time

  !> The limits of largest magnitudes.
  subroutine add_largest(input, analysis, passage, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(passage_t), intent(in) :: passage
    type(verdict_t), intent(inout) :: verdict
    type(column_extreme_t) :: extremes(size(analysis%signals))
    type(verdict_t) :: own
    integer :: i

    associate (from => passage%extremes)
      extremes%size = max(abs(from%lowest), abs(from%highest))
      extremes%time = merge(from%highest_time, from%lowest_time, abs(from%highest) > abs(from%lowest))
    end associate
    call add_peaks(input, 'transit', analysis%signals, extremes, own)
    if (.not. allocated(own%lines)) return
    do i = 1, size(own%lines)
      own%lines(i)%detail = direction_word(passage%visit)
      call verdict%add(own%lines(i))
    end do
  end subroutine add_largest

  !> The limits of half ranges while speeds are passed. A limit for continuous operation alone says nothing of a passage, unless
  !> there is one of the largest magnitude too.
  subroutine add_half_ranges(input, analysis, passage, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(passage_t), intent(in) :: passage
    type(verdict_t), intent(inout) :: verdict
    type(verdict_line_t) :: line
    character(len=:), allocatable :: at_rule
    integer :: i

    do i = 1, size(passage%peaks)
      associate (peak => passage%peaks(i), limit => analysis%limits(passage%peaks(i)%limit))
        if (.not. limit%has_transient() .and. (.not. limit%has_continuous() .or. limit%peak_limit() < no_limit)) cycle
        line = new_verdict_line('transit', peak%signal%element_kind // ' ' // quoted(peak%signal%element), peak%signal%name, &
                                in_words(peak%signal%symbol) // ', transient', input%place(limit%group, ''))
        call limit%write_rule(line%rule)
        if (limit%has_transient()) then
          call line%compare(peak%half_range, peak%allowed, peak%signal%unit)
          call line%stand_at(peak%half_range_speed)
          call limit%write_place(peak%half_range_speed, at_rule)
          line%detail = direction_word(passage%visit) // ', t = ' // rounded_text(peak%half_range_time, digits) // ' s'
          if (at_rule /= '') line%detail = line%detail // ', ' // at_rule
        else
          line%finding = is_not_assessed
          line%detail = direction_word(passage%visit)
          line%reason = 'no limit for passing the range is given'
        end if
        call verdict%add(line)
      end associate
    end do
  end subroutine add_half_ranges

  subroutine place(passage, line)
    type(passage_t), intent(in) :: passage
    type(verdict_line_t), intent(inout) :: line

    line%has_time = .true.
    line%time = passage%visit%enters
    line%detail = direction_word(passage%visit)
  end subroutine place

  !> How often a passage occurs in the life of the machine.
  real(wp) function repeats_of(input, analysis, item) result(repeats)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(fatigue_item_t), intent(in) :: item

    repeats = analysis%settings%passages
    if (repeats > 0) return
    repeats = item%repeats
    if (allocated(input%load_case)) repeats = repeats * input%load_case%repeats
  end function repeats_of

  !> Adds up the damage of all passages, at each point of a shaft.
  subroutine sum_life(input, analysis, lives)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(transit_life_t), allocatable, intent(out) :: lives(:)
    real(wp), allocatable :: damage(:)   ! [points]
    integer :: i, k, worst

    if (size(analysis%passages) == 0) then
      allocate (lives(0))
      return
    end if
    allocate (lives(size(analysis%passages(1)%fatigue%items)))
    do i = 1, size(lives)
      lives(i)%item = analysis%passages(1)%fatigue%items(i)
      lives(i)%repeats = repeats_of(input, analysis, lives(i)%item)
      associate (first => lives(i)%item%first, last => lives(i)%item%last)
        allocate (damage(first:last), source=0.0_wp)
        do k = 1, size(analysis%passages)
          associate (counters => analysis%passages(k)%fatigue%counters(first:last))
            damage = damage + lives(i)%repeats * counters%damage
            lives(i)%exceeds_strength = lives(i)%exceeds_strength .or. any(counters%has_failed)
          end associate
        end do
        worst = first - 1 + maxloc(damage, dim=1)
        lives(i)%damage = damage(worst)
        lives(i)%position = analysis%passages(1)%fatigue%position(worst)
        deallocate (damage)
      end associate
    end do
  end subroutine sum_life

  subroutine add_damage(input, analysis, verdict)
    type(input_t), intent(in) :: input
    type(transit_analysis_t), intent(in) :: analysis
    type(verdict_t), intent(inout) :: verdict
    type(transit_life_t), allocatable :: lives(:)
    type(verdict_line_t) :: line
    integer :: i

    call sum_life(input, analysis, lives)
    do i = 1, size(lives)
      associate (item => lives(i)%item)
        line = new_damage_line('transit', item%kind, item%element, item%name, lives(i)%exceeds_strength, lives(i)%damage)
      end associate
      line%detail = rounded_text(lives(i)%repeats, 6) // ' times ' // to_text(size(analysis%passages)) // ' in the range'
      call verdict%add(line)
    end do
  end subroutine add_damage

end module nocdyn_transit_verdict
