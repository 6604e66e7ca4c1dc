!> Critical speeds, their margins and the half ranges of a response, as answers that are differentiated.
!>
!> A critical speed n is where a mode omega(n) meets a line Omega(n): dn = (d omega - d Omega) / (dOmega/dn - domega/dn), with the
!> change of the mode at this speed as in `nocdyn_mode_answers`. A half range at the peak of a critical speed is followed along
!> with it: its change is that at a constant speed (`nocdyn_line_responses`) and its slope over the speed times dn.
module nocdyn_response_answers
  use nocdyn_answers, only: answers_t
  use nocdyn_errors, only: error_t
  use nocdyn_excitation_lines, only: list_machine_harmonics, listed_harmonic_t, set_sources, source_t
  use nocdyn_frozen_motions, only: eigenvalue_change, new_frame, new_view, view_t
  use nocdyn_frozen_states, only: freeze_held
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_line_responses, only: new_line_responses
  use nocdyn_machine, only: machine_t
  use nocdyn_margins, only: operating_distance
  use nocdyn_mode_pairs, only: mode_pairs_t
  use nocdyn_moment_forms, only: kind_power, list_moment_forms, moment_form_t
  use nocdyn_number_changes, only: number_change_t
  use nocdyn_response_analysis, only: analyse_response, response_analysis_t
  use nocdyn_response_functionals, only: assemble_response_machine, critical_answers_t, evaluate_critical, evaluate_half, &
    half_range_answer_t, of_mode, response_functionals_t
  use nocdyn_response_summary, only: critical_t, response_summary_t, summarise_response
  use nocdyn_state_modes, only: find_pairs_at
  use nocdyn_text, only: append, rounded_text, string_t, to_text
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  use nocdyn_varied_keys, only: central, find_weights, points
  implicit none (type, external)
  private

  public :: new_response_answers

  real(wp), parameter :: speed_step = 1.0e-3_wp   ! of differences over the speed, as a share of it

  type, extends(answers_t), public :: response_answers_t
    type(response_functionals_t), private :: parts
  contains
    procedure :: differentiate_near, evaluate, finish
  end type response_answers_t

contains

  !> Computes the response of an input.
  subroutine new_response_answers(input, most, self, notes, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: most                  !! critical speeds, those with the largest responses
    type(response_answers_t), intent(out) :: self
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: machine
    type(response_summary_t) :: summary
    integer, allocatable :: chosen(:)
    integer :: i

    call assemble_response_machine(input, machine, error)
    if (.not. allocated(error)) call analyse_response(input, machine, self%parts%analysis, error)
    if (allocated(error)) return
    self%parts%frame = new_frame(self%parts%analysis%response%machine)
    self%parts%laws%machine = self%parts%analysis%response%held%balance%formulation%machine
    self%parts%laws%state = self%parts%analysis%response%held%balance%formulation%state
    if (allocated(machine%driven_speed)) self%parts%laws%machine%driven_speed = machine%driven_speed
    summary = summarise_response(self%parts%analysis)
    call choose_criticals(self%parts%analysis, summary, most, chosen, notes)
    allocate (self%parts%criticals(size(chosen)))
    do i = 1, size(chosen)
      call find_critical(self, summary%criticals(chosen(i)), self%parts%criticals(i), error)
      if (allocated(error)) return
    end do
    call list_halves(self, summary, error)
    if (.not. allocated(error)) call name_answers(self)
    self%functionals = of_mode * size(self%parts%criticals) + size(self%parts%halves)
    allocate (self%scale(self%functionals))
    do i = 1, size(self%parts%criticals)
      associate (one => self%parts%criticals(i))
        self%scale(of_mode * (i - 1) + 1:of_mode * i) = [abs(one%norm * one%value), abs(one%norm * one%value), abs(one%value)]
      end associate
    end do
    do i = 1, size(self%parts%halves)
      self%scale(of_mode * size(self%parts%criticals) + i) = self%parts%halves(i)%lines%half_range
    end do
  end subroutine new_response_answers

  !> The critical speeds whose modes are differentiated: those of motions, the ones with the largest ratios to limits, or half
  !> ranges, first; in the order of the report.
  subroutine choose_criticals(analysis, summary, most, chosen, notes)
    type(response_analysis_t), intent(in) :: analysis
    type(response_summary_t), intent(in) :: summary
    integer, intent(in) :: most
    integer, allocatable, intent(out) :: chosen(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp) :: rank(size(summary%criticals))
    logical :: is_chosen(size(rank))
    integer :: i

    rank = summary%criticals%half_range
    if (any(summary%criticals%ratio > 0)) rank = summary%criticals%ratio
    where (summary%criticals%is_unbounded) rank = huge(rank)
    do i = 1, size(rank)
      if (analysis%modes%is_electrical(summary%criticals(i)%crossing%mode)) rank(i) = -1.0_wp
    end do
    is_chosen = .false.
    do while (count(is_chosen) < most .and. any(rank >= 0 .and. .not. is_chosen))
      is_chosen(maxloc(rank, dim=1, mask=.not. is_chosen)) = .true.
    end do
    allocate (chosen, source=pack([(i, i=1, size(rank))], is_chosen))
    if (size(chosen) < count(rank >= 0)) then
      call append(notes, 'of ' // to_text(count(rank >= 0)) // ' critical speeds, the ' // to_text(size(chosen)) // &
                         ' with the largest responses')
    end if
  end subroutine choose_criticals

  !> The mode of a critical speed there, and how fast its line meets it.
  subroutine find_critical(self, critical, one, error)
    type(response_answers_t), intent(in) :: self
    type(critical_t), intent(in) :: critical
    type(critical_answers_t), intent(inout) :: one
    type(error_t), allocatable, intent(out) :: error
    type(held_speeds_t) :: held
    type(held_state_t) :: state
    type(listed_harmonic_t), allocatable :: list(:)
    type(mode_pairs_t) :: pairs
    type(view_t) :: view
    real(wp) :: change(points), slopes(of_mode), values(of_mode, points), weight(points), weight_here
    integer :: m, p

    one%critical = critical
    one%line = critical%crossing%line
    associate (response => self%parts%analysis%response, speed => critical%crossing%speed)
      held = response%held
      call held%hold(speed, state, error)
      if (.not. allocated(error)) call find_pairs_at(response, state, pairs, error)
      if (allocated(error)) return
      call freeze_held(held, state, one%frozen)
      call list_machine_harmonics(response%machine, state, list, response%shaker)
      one%source = list(response%lines(one%line)%source(1))
      m = minloc(abs(aimag(pairs%value) - critical%crossing%frequency) &
                 + abs(real(pairs%value, wp) + critical%crossing%damping_ratio * abs(pairs%value)), dim=1)
      one%value = pairs%value(m)
      one%motion%x = pairs%x(:, m)
      one%motion%twist = pairs%twist(:, m)
      one%motion%angle = pairs%angle(:, m)
      one%norm = one%motion%form_of_slope(one%motion, response%machine, state%slopes, one%value)
      one%turn = one%motion%form_of_frequency(one%motion, state%slopes, one%value)
      view = new_view(self%parts%frame, response%machine)
      change = speed_step * speed * central
      call find_weights(change, weight, weight_here)
      do p = 1, points
        call held%hold(speed + change(p), state, error)
        if (allocated(error)) return
        call evaluate_critical(self%parts, one, view, response%machine, state, .false., values(:, p))
      end do
      slopes = matmul(values, weight)
      one%approach = slopes(3) - aimag(eigenvalue_change(one%norm, one%turn, cmplx(slopes(1), slopes(2), wp)))
      associate (settings => self%parts%analysis%settings)
        one%has_margin = size(settings%operating) > 0
        if (.not. one%has_margin) return
        one%margin_slope = 0.0_wp   ! inside
        if (abs(speed) < abs(settings%operating(1))) one%margin_slope = -1.0_wp / abs(settings%operating(1))
        if (abs(speed) > abs(settings%operating(2))) one%margin_slope = 1.0_wp / abs(settings%operating(2))
      end associate
    end associate
  end subroutine find_critical

  !> The half ranges: at the peaks of the critical speeds, and the largest of every quantity with a limit.
  subroutine list_halves(self, summary, error)
    type(response_answers_t), intent(inout) :: self
    type(response_summary_t), intent(in) :: summary
    type(error_t), allocatable, intent(out) :: error
    type(half_range_answer_t), allocatable :: halves(:)
    integer :: i, n, q

    associate (response => self%parts%analysis%response)
      call list_moment_forms(response%machine, self%parts%analysis%settings%body, self%parts%forms)
      allocate (halves(size(self%parts%criticals) + size(response%quantities)))
      n = 0
      do i = 1, size(self%parts%criticals)
        associate (critical => self%parts%criticals(i)%critical)
          if (critical%quantity == 0 .or. critical%is_unbounded) cycle
          n = n + 1
          halves(n)%critical = i
          halves(n)%speed = critical%speed
          halves(n)%lines%form = number_of(response%quantities(critical%quantity), self%parts%forms)
        end associate
      end do
      do q = 1, size(response%quantities)
        if (.not. summary%largest(q)%ratio > 0 .or. response%quantities(q)%kind == kind_power) cycle
        n = n + 1
        halves(n)%speed = response%points(summary%largest(q)%ratio_point)%state%speed
        halves(n)%critical = critical_at(self, halves(n)%speed)
        halves(n)%lines%form = number_of(response%quantities(q), self%parts%forms)
      end do
      allocate (self%parts%halves(n))
      do i = 1, n
        self%parts%halves(i)%speed = halves(i)%speed
        self%parts%halves(i)%critical = halves(i)%critical
        self%parts%halves(i)%lines%form = halves(i)%lines%form
        call find_half(self, self%parts%forms(halves(i)%lines%form), self%parts%halves(i), error)
        if (allocated(error)) return
      end do
    end associate
  end subroutine list_halves

  !> The number of a quantity among all forms.
  pure integer function number_of(quantity, forms) result(number)
    type(moment_form_t), intent(in) :: quantity, forms(:)

    do number = size(forms), 2, -1
      if (forms(number)%element == quantity%element .and. forms(number)%symbol == quantity%symbol .and. &
          forms(number)%point == quantity%point) return
    end do
  end function number_of

  !> The critical speed to whose peak a speed belongs, 0 if it belongs to none.
  pure integer function critical_at(self, speed) result(found)
    type(response_answers_t), intent(in) :: self
    real(wp), intent(in) :: speed
    real(wp), parameter :: near = 0.02_wp   ! as of `summarise_response`
    integer :: i
    real(wp) :: distance, nearest

    found = 0
    nearest = huge(nearest)
    do i = 1, size(self%parts%criticals)
      associate (crossing => self%parts%criticals(i)%critical%crossing)
        distance = abs(speed - crossing%speed)
        if (distance > (near + 3.0_wp * crossing%damping_ratio) * abs(crossing%speed) .or. distance >= nearest) cycle
      end associate
      nearest = distance
      found = i
    end do
  end function critical_at

  !> Solves for a half range, and finds its slope over the speed.
  subroutine find_half(self, quantity, half, error)
    type(response_answers_t), intent(in) :: self
    type(moment_form_t), intent(in) :: quantity
    type(half_range_answer_t), intent(inout) :: half
    type(error_t), allocatable, intent(out) :: error
    type(held_speeds_t) :: held
    type(held_state_t) :: state
    type(source_t), allocatable :: sources(:)
    type(view_t) :: view
    real(wp) :: change(points), values(points), weight(points), weight_here
    integer :: p

    associate (response => self%parts%analysis%response)
      held = response%held
      call held%hold(half%speed, state, error)
      if (allocated(error)) return
      call freeze_held(held, state, half%frozen)
      call list_machine_harmonics(response%machine, state, half%harmonics, response%shaker)
      call set_sources(half%harmonics, state, sources)
      call new_line_responses(response, state, sources, quantity, half%lines)
      if (half%critical == 0) return
      view = new_view(self%parts%frame, response%machine)
      change = speed_step * half%speed * central
      call find_weights(change, weight, weight_here)
      do p = 1, points
        call held%hold(half%speed + change(p), state, error)
        if (allocated(error)) return
        call evaluate_half(self%parts, half, view, response%machine, self%parts%forms, state, .false., values(p))
      end do
      half%slope = sum(weight * values)
    end associate
  end subroutine find_half

  !> The answers without their derivatives.
  subroutine name_answers(self)
    type(response_answers_t), intent(inout) :: self
    character(len=:), allocatable :: label
    integer :: i, n, unit
    character(len=16) :: name

    allocate (self%answers(count(self%parts%criticals%has_margin) + size(self%parts%criticals) + size(self%parts%halves)))
    n = 0
    do i = 1, size(self%parts%criticals)
      associate (one => self%parts%criticals(i))
        n = n + 1
        one%answer = n
        unit = unit_rpm
        name = 'critical speed'
        if (self%parts%analysis%settings%axis%is_frequency) then
          unit = unit_hz
          name = 'resonance'
        end if
        call self%answers(n)%set(trim(name), critical_label(self, one), trim(merge('rpm', 'Hz ', unit == unit_rpm)), &
                                 from_si(one%critical%crossing%speed, unit))
        if (.not. one%has_margin) cycle
        n = n + 1
        call self%answers(n)%set('margin', critical_label(self, one), '', &
                                 operating_distance(self%parts%analysis%settings, one%critical%crossing%speed), is_share=.true.)
      end associate
    end do
    do i = 1, size(self%parts%halves)
      associate (half => self%parts%halves(i), form => self%parts%forms(self%parts%halves(i)%lines%form))
        n = n + 1
        half%answer = n
        label = form%name // ' at '
        if (i <= count_peaks(self)) then
          label = label // critical_label(self, self%parts%criticals(half%critical))
        else if (self%parts%analysis%settings%axis%is_frequency) then
          label = label // rounded_text(from_si(half%speed, unit_hz), 6) // ' Hz, nearest to its limit'
        else
          label = label // rounded_text(from_si(half%speed, unit_rpm), 6) // ' rpm, nearest to its limit'
        end if
        call self%answers(n)%set('half range', label, form%unit, half%lines%half_range)
      end associate
    end do
  end subroutine name_answers

  !> The number of half ranges at peaks of critical speeds, which come first.
  pure integer function count_peaks(self) result(peaks)
    type(response_answers_t), intent(in) :: self

    peaks = count(self%parts%criticals%critical%quantity > 0 .and. .not. self%parts%criticals%critical%is_unbounded)
  end function count_peaks

  !> "mode 1, order 4.5".
  function critical_label(self, one) result(label)
    type(response_answers_t), intent(in) :: self
    type(critical_answers_t), intent(in) :: one
    character(len=:), allocatable :: label

    label = 'mode ' // to_text(one%critical%crossing%number)
    if (self%parts%analysis%settings%axis%is_frequency) return
    associate (line => self%parts%analysis%response%lines(one%line))
      if (line%is_order) then
        label = label // ', order ' // line%word()
      else
        label = label // ', ' // line%word() // ' frequency'
      end if
    end associate
  end function critical_label

  subroutine differentiate_near(self, number, slopes, is_done, error)
    class(response_answers_t), intent(inout) :: self
    type(number_change_t), intent(inout) :: number
    real(wp), intent(out) :: slopes(:)
    logical, intent(out) :: is_done
    type(error_t), allocatable, intent(out) :: error

    call self%parts%differentiate_near(number, slopes, is_done, error)
  end subroutine differentiate_near

  subroutine evaluate(self, number, values, error)
    class(response_answers_t), intent(in) :: self
    type(number_change_t), intent(in) :: number
    real(wp), intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error

    call self%parts%evaluate(number, values, error)
  end subroutine evaluate

  subroutine finish(self, slopes)
    class(response_answers_t), intent(inout) :: self
    real(wp), intent(in) :: slopes(:, :)
    real(wp) :: speed(size(slopes, 2), size(self%parts%criticals))
    integer :: i, n

    do i = 1, size(self%parts%criticals)
      associate (one => self%parts%criticals(i), first => of_mode * (i - 1), answer => self%parts%criticals(i)%answer)
        speed(:, i) = (aimag(eigenvalue_change(one%norm, one%turn, cmplx(slopes(first + 1, :), slopes(first + 2, :), wp))) &
                       - slopes(first + 3, :)) / one%approach
        n = merge(unit_hz, unit_rpm, self%parts%analysis%settings%axis%is_frequency)
        self%answers(answer)%derivative = from_si(speed(:, i), n)
        if (one%has_margin) then
          self%answers(answer + 1)%derivative = one%margin_slope * sign(1.0_wp, one%critical%crossing%speed) * speed(:, i)
        end if
      end associate
    end do
    do i = 1, size(self%parts%halves)
      associate (half => self%parts%halves(i))
        self%answers(half%answer)%derivative = slopes(of_mode * size(self%parts%criticals) + i, :)
        if (half%critical == 0) cycle
        self%answers(half%answer)%derivative = self%answers(half%answer)%derivative + half%slope * speed(:, half%critical)
      end associate
    end do
  end subroutine finish

end module nocdyn_response_answers
