!> Notes on a forced response: where it may be other than its reader expects.
module nocdyn_response_notes
  use nocdyn_critical_speeds, only: crossing_t
  use nocdyn_element_sets, only: element_names
  use nocdyn_errors, only: error_t
  use nocdyn_excitation_lines, only: list_sources, source_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_input, only: input_t
  use nocdyn_steady_texts, only: allowed_torques
  use nocdyn_kinds, only: wp
  use nocdyn_linear_ranges, only: excursion_t, find_excursions
  use nocdyn_linearisation, only: linearisation_t, undamped_modes
  use nocdyn_machine, only: machine_t
  use nocdyn_moment_forms, only: kind_reaction, moment_form_t
  use nocdyn_power_notes, only: note_power_signs
  use nocdyn_response_choice, only: has_gap, lose_of
  use nocdyn_response_limits, only: response_limit_t
  use nocdyn_response_settings, only: response_settings_t
  use nocdyn_shaft_errors, only: describe_error, has_shaft_nodes, noted_error, shaft_error
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_state_modes, only: most_coordinates
  use nocdyn_damping_notes, only: note_mean_slopes, note_stand_ins
  use nocdyn_text, only: append, joined, quoted, rounded_text, string_t, to_text
  use nocdyn_tooth_losses, only: tooth_losses_t
  use nocdyn_units, only: from_si, unit_hz, unit_rpm
  implicit none (type, external)
  private

  public :: note_simplifications, note_steady_states, note_separation, note_linear_ranges, note_overloads, note_rated_speeds, &
    note_measurements, note_other_excitations, note_rules
  public :: note_numbers, note_shaft_modes

contains

  !> What the analysis leaves out of the input, and what stands for it.
  subroutine note_simplifications(machine, notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(out) :: notes(:)
    integer :: e, i

    allocate (notes, source=machine%simplifications)
    ! excitations that are over in a steady state
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        do e = 1, bank%count
          if (bank%has_ended(e)) call append(notes, 'excitation ' // quoted(bank%names(e)%text) // &
                                             ' ends or decays, and has no part in the response')
        end do
      end associate
    end do
  end subroutine note_simplifications

  !> Modes whose numbers are not in the order of their frequencies at all speeds.
  subroutine note_numbers(modes, notes)
    type(speed_modes_t), intent(in) :: modes
    type(string_t), allocatable, intent(inout) :: notes(:)

    if (modes%change_places) call append(notes, 'modes change places over the speeds: their numbers are in the order of the ' // &
      'frequencies at ' // rounded_text(from_si(modes%numbered_at, unit_rpm), 6) // ' rpm')
  end subroutine note_numbers

  !> Modes that the nodes of shafts do not resolve, and critical speeds of these.
  subroutine note_shaft_modes(machine, modes, crossings, lists_modes, notes)
    type(machine_t), intent(in) :: machine
    type(speed_modes_t), intent(in) :: modes
    type(crossing_t), intent(in) :: crossings(:)
    logical, intent(in) :: lists_modes   !! whether modes are reported that no line crosses
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: size_text, text
    real(wp) :: errors(modes%modes), natural(modes%modes)
    integer :: first, m

    if (modes%modes == 0 .or. .not. has_shaft_nodes(machine)) return
    do m = 1, modes%modes
      natural(m) = modes%undamped(m, max(1, findloc(modes%exists(m, :), .true., dim=1)))
      errors(m) = shaft_error(machine, modes%shape(:, m), natural(m))
    end do
    if (.not. any(errors > noted_error)) return
    first = minloc(natural, dim=1, mask=errors > noted_error)
    call describe_error(errors(first), size_text)
    text = 'the nodes of shafts resolve ' // to_text(count(errors <= noted_error)) // ' of the ' // to_text(modes%modes) // &
           ' modes: that at ' // rounded_text(from_si(natural(first), unit_hz), 6) // ' Hz has an error of ' // &
           size_text // ', higher ones a larger one'
    associate (crossed => count([(errors(crossings(m)%mode) > noted_error, m=1, size(crossings))]))
      if (crossed == 0 .and. .not. lists_modes) return
      if (crossed > 0) text = text // ', and with them ' // to_text(crossed) // ' of the ' // to_text(size(crossings)) // &
                              ' critical speeds'
    end associate
    call append(notes, text // '; more nodes of &shaft resolve more')
  end subroutine note_shaft_modes

  !> Notes on the speeds and the steady states: what nocdyn campbell has too.
  subroutine note_steady_states(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: rounding = 1.0e-9_wp
    integer :: e, held, i, open
    real(wp) :: factor(size(response%points)), supply(size(response%points))
    real(wp), allocatable :: power(:, :)
    integer, allocatable :: elastic(:)
    type(string_t), allocatable :: names(:)

    ! adds a note on each elastic element whose moment does not change with its twist at some speeds

    allocate (elastic, source=response%machine%elastic())
    allocate (names, source=element_names(response%machine, elastic))
    do e = 1, size(elastic)
      open = 0
      do i = 1, size(response%points)
        if (abs(response%points(i)%state%slopes%stiffness(elastic(e))) <= 0) open = open + 1
      end do
      if (open == 0) cycle
      call append(notes, quoted(names(e)%text) // ' has no stiffness at ' // to_text(open) // ' of ' // &
                         to_text(size(response%points)) // ' ' // response%axis%plural() // &
                         ': it is inside its gap, whose edge counts as inside, ' // &
                         'or its law is level there')
    end do
    call note_mean_slopes(response%machine, steepest_slopes(response), notes)
    allocate (power(size(response%machine%with_work), size(response%points)))
    do i = 1, size(response%points)
      associate (state => response%points(i)%state, e => response%machine%with_work)
        power(:, i) = state%mean(e) * state%rate(e)
      end associate
    end do
    call note_power_signs(response%machine, power, 'W', response%axis%plural(), notes)
    held = 0
    do i = 1, size(response%points)
      if (abs(response%points(i)%state%torque) > 0) held = held + 1
    end do
    if (held > 0 .and. response%held%has_drive()) then
      call append(notes, 'the motors or engines do not drive at ' // to_text(held) // ' of ' // &
                         to_text(size(response%points)) // ' speeds: there a torque on the body of &response holds the ' // &
                         'speed, the column drive_torque')
    end if
    call note_losses(response, notes)
    ! drives that would have to be stronger than they are, and supplies that follow the speed
    factor = [(response%points(i)%state%factor, i=1, size(factor))]
    supply = [(response%points(i)%state%supply, i=1, size(supply))]
    if (any(factor > 1.0_wp + rounding)) then
      call append(notes, 'the drive of the input is too weak at ' // to_text(count(factor > 1.0_wp + rounding)) // ' of ' // &
                         to_text(size(factor)) // ' speeds: the load there needs up to ' // rounded_text(maxval(factor), 4) // &
                         ' times its torque, which is taken as given')
    end if
    if (any(supply > 0)) then
      call append(notes, 'the supplies of the induction motors are taken to follow the speeds, with the flux of the mains: ' // &
                         'from ' // rounded_text(minval(supply, mask=supply > 0), 4) // ' to ' // &
                         rounded_text(maxval(supply), 4) // ' times their frequency')
    end if
    call note_damping(response, notes)
  end subroutine note_steady_states

  !> Notes on the damping of the modes of a run at the highest speed.
  subroutine note_damping(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(linearisation_t) :: linear
    type(error_t), allocatable :: error

    associate (highest => response%points(size(response%points))%state%slopes)
      if (.not. any(highest%stand_in > 0) .or. response%matrix%coordinates > most_coordinates) return
      call undamped_modes(response%machine, response%matrix%incidence, highest%stiffness, linear, error)
    end associate
    if (.not. allocated(error)) call note_stand_ins(response%machine, linear, notes)
  end subroutine note_damping

  !> The slopes over the mean speed with the largest size at any speed [N m s/rad], [elements].
  pure function steepest_slopes(response) result(slope)
    type(forced_response_t), intent(in) :: response
    real(wp) :: slope(response%machine%elements%count)
    integer :: i

    slope = 0.0_wp
    do i = 1, size(response%points)
      associate (here => response%points(i)%state%slopes%mean_damping)
        where (abs(here) > abs(slope)) slope = -here
      end associate
    end do
  end function steepest_slopes

  !> Teeth with losses, and the largest torque that these take from a first wheel at its mean torque.
  subroutine note_losses(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: most_names = 5
    integer :: b, e, i, q, worst, worst_point
    real(wp) :: largest, lost
    type(string_t), allocatable :: names(:)

    allocate (names(0))
    largest = -1.0_wp
    do b = 1, size(response%machine%banks)
      select type (bank => response%machine%banks(b)%bank)
      class is (tooth_losses_t)
        do e = 1, bank%count
          call append(names, bank%names(e)%text)
          q = findloc(lose_of(bank, e, response%quantities), .true., dim=1)
          do i = 1, size(response%points)
            lost = lost_torque(response%quantities(q), bank, e, response%points(i)%state)
            if (lost <= largest) cycle
            largest = lost
            worst = size(names)
            worst_point = i
          end do
        end do
      end select
    end do
    if (size(names) == 0) return
    call append(notes, 'the losses of ' // joined(names, ', ', most_names) // ' are left out, at the mean torques up to ' // &
                       rounded_text(largest, 4) // ' N m on the first wheel of ' // quoted(names(worst)%text) // ' at ' // &
                       rounded_text(response%axis%shown(response%points(worst_point)%state%speed), 6) // ' ' // &
                       response%axis%unit())
  end subroutine note_losses

  !> The torque that teeth would take from their first wheel in a steady state [N m].
  pure real(wp) function lost_torque(quantity, losses, element, state) result(lost)
    type(moment_form_t), intent(in) :: quantity   !! that they lose a share of
    type(tooth_losses_t), intent(in) :: losses
    integer, intent(in) :: element                !! numbered within the bank
    type(held_state_t), intent(in) :: state
    real(wp) :: share, slope, torque

    associate (one => quantity, speed => state%rate(losses%first - 1 + element))
      torque = losses%factor(element) * (sum(one%weight(1, :) * state%mean(one%elements)) + one%by_held_torque * state%torque)
      call losses%share(element, torque * speed < 0, speed, share, slope)
    end associate
    lost = abs(share * torque)
  end function lost_torque

  !> Couplings and meshes with a gap whose oscillation is larger than their mean: they leave contact, which no linear response
  !> has.
  subroutine note_separation(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: i, open, q

    do q = 1, size(response%quantities)
      associate (one => response%quantities(q))
        if (.not. has_gap(response%machine, one)) cycle
        open = 0
        do i = 1, size(response%points)
          associate (point => response%points(i))
            if (point%half_range(q) > abs(point%mean(q)) .and. abs(point%mean(q)) > 0) open = open + 1
          end associate
        end do
        if (open == 0) cycle
        call append(notes, quoted(one%element) // ' oscillates by more than its mean at ' // to_text(open) // ' of ' // &
                           to_text(size(response%points)) // ' ' // response%axis%plural() // &
                           ' and leaves contact: the linear response does not hold ' // &
                           'there; nocdyn run gives the motion')
      end associate
    end do
  end subroutine note_separation

  !> Elements whose laws are not straight over their oscillations, which no linear response has.
  subroutine note_linear_ranges(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: least = 0.01_wp   ! a shift of half of this share of a natural frequency
    type(excursion_t), allocatable :: excursions(:)
    character(len=:), allocatable :: change, law
    integer :: i

    call find_excursions(response, least, excursions)
    do i = 1, size(excursions)
      associate (one => excursions(i))
        law = 'stiffness'
        if (.not. one%is_elastic) law = 'slope over the speed'
        if (abs(one%tangent) > 1.0e-6_wp * abs(one%equivalent)) then
          change = rounded_text(100.0_wp * abs(one%equivalent / one%tangent - 1.0_wp), 2) // ' % ' // &
                   trim(merge('above', 'below', one%equivalent / one%tangent > 1.0_wp)) // ' that at its mean'
        else
          change = rounded_text(one%equivalent, 3) // ', and about 0 at its mean'
        end if
        call append(notes, 'over the vibration of ' // quoted(response%machine%element_name(one%element)) // ' at ' // &
                           rounded_text(response%axis%shown(response%points(one%worst)%state%speed), 6) // ' ' // &
                           response%axis%unit() // ' its ' // law // &
                           ' is on average ' // change // '; by more than 1 % at ' // to_text(one%points) // ' of ' // &
                           to_text(size(response%points)) // ' ' // response%axis%plural() // &
                           ': the linear response does not hold there, nocdyn run ' // &
                           'gives the motion')
      end associate
    end do
  end subroutine note_linear_ranges

  !> Joints that are taken as locked, and would slip or open.
  subroutine note_overloads(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: rounding = 1.0e-9_wp
    character(len=:), allocatable :: allowed
    integer :: i, q, row, slipping, worst
    real(wp) :: excess, most

    associate (constraints => response%machine%constraints, points => response%points)
      do q = 1, size(response%quantities)
        if (response%quantities(q)%kind /= kind_reaction) cycle
        row = response%quantities(q)%source%index
        slipping = 0
        worst = 1
        most = 0.0_wp
        do i = 1, size(points)
          excess = max(points(i)%mean(q) + points(i)%highest(q) - constraints%most(row), &
                       constraints%least(row) - points(i)%mean(q) - points(i)%lowest(q))
          if (excess <= rounding * points(i)%peak(q)) cycle
          slipping = slipping + 1
          if (excess <= most) cycle
          most = excess
          worst = i
        end do
        if (slipping == 0) cycle
        call allowed_torques(constraints%least(row), constraints%most(row), allowed)
        call append(notes, constraints%kinds(row)%text // ' ' // quoted(constraints%names(row)%text) // ' does not hold at ' // &
                           to_text(slipping) // ' of ' // to_text(size(points)) // ' ' // response%axis%plural() // &
                           ': locked it would carry up to ' // &
                           rounded_text(points(worst)%peak(q), 4) // ' N m at ' // &
                           rounded_text(response%axis%shown(points(worst)%state%speed), 6) // ' ' // response%axis%unit() // &
                           '; allowed: ' // &
                           allowed // ' N m; nocdyn run gives the motion')
      end do
    end associate
  end subroutine note_overloads

  !> Excitations beside the shaker of a response over its frequency.
  subroutine note_other_excitations(settings, response, notes)
    type(response_settings_t), intent(in) :: settings
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(source_t), allocatable :: sources(:)

    call list_sources(response%machine, response%points(1)%state, sources)
    if (all(sources%element == settings%shaker)) return
    call append(notes, 'the response is the one of ' // quoted(settings%shaker_name) // ' alone: the oscillations ' // &
                       'that other excitations add are left out')
  end subroutine note_other_excitations

  !> Measured orders and peaks at speeds, which a response over the frequency of a shaker has not.
  subroutine note_measurements(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('measurement'))
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        if (group%text('kind') /= 'order' .and. .not. (group%text('kind') == 'peak' .and. group%has_value('speed'))) cycle
        call append(notes, 'the measurement ' // quoted(group%name) // ' at speeds is compared with nothing: the response ' // &
                           'is over the frequency of a shaker')
      end associate
    end do
  end subroutine note_measurements

  !> Rated speeds of the rule iacs_m68 that are far from the ones of the body of &response, to which they belong.
  subroutine note_rated_speeds(input, settings, notes)
    type(input_t), intent(in) :: input
    type(response_settings_t), intent(in) :: settings
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, allocatable :: limits(:)
    real(wp) :: highest, lowest, rated   ! [rpm]
    integer :: i

    lowest = from_si(abs(settings%speeds(1)), unit_rpm)
    highest = from_si(abs(settings%speeds(size(settings%speeds))), unit_rpm)
    allocate (limits, source=input%groups_named('limit'))
    do i = 1, size(limits)
      if (.not. input%groups(limits(i))%has_value('rated_speed')) cycle
      rated = from_si(abs(input%groups(limits(i))%number('rated_speed')), unit_rpm)
      if (rated >= lowest .and. rated <= 2.0_wp * highest) cycle
      call append(notes, input%place(limits(i), 'rated_speed') // ': the rated speed of ' // rounded_text(rated, 5) // &
                         ' rpm is that of the body of &response, which turns with ' // rounded_text(lowest, 5) // ' to ' // &
                         rounded_text(highest, 5) // ' rpm')
    end do
  end subroutine note_rated_speeds

  !> Numbers outside of the ranges of rules.
  subroutine note_rules(limits, notes)
    type(response_limit_t), intent(in) :: limits(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(string_t), allocatable :: own(:)
    integer :: i, k

    do i = 1, size(limits)
      call limits(i)%list_notes(own)
      do k = 1, size(own)
        call append(notes, own(k)%text)
      end do
    end do
  end subroutine note_rules

end module nocdyn_response_notes
