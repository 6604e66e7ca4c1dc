!> The results of modes and of the forced response that the groups &record ask for.
module nocdyn_recorded_analyses
  use nocdyn_analyses, only: analysis_t
  use nocdyn_analysis_results, only: analysis_crossing, analysis_crossing_margin, analysis_margin, analysis_mode_curve, &
    analysis_names, analysis_owners, analysis_peak_frequency, analysis_peak_speed, analysis_ratio, analysis_result_t, &
    new_mode_result, new_path_result, new_response_result
  use nocdyn_campbell, only: campbell_t
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t
  use nocdyn_excitation_lines, only: line_order
  use nocdyn_forced_response, only: forced_response_t, new_forced_response
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_modes, only: mode_t
  use nocdyn_named_analyses, only: analysis_words, solve_named
  use nocdyn_output_units, only: output_units
  use nocdyn_recorded_orbits, only: new_orbit_reader, orbit_reader_t
  use nocdyn_response_analysis, only: list_orders
  use nocdyn_response_limits, only: read_limits, response_limit_t
  use nocdyn_moment_forms, only: list_moment_forms, kind_moment, moment_form_t
  use nocdyn_response_settings, only: read_response_settings, response_settings_t
  use nocdyn_schema, only: kind_rules
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: append, quoted, string_t, to_text
  use nocdyn_units, only: unit_for, unit_hz, units
  use nocdyn_variant_analysis, only: find_campbell, limited_kinds, matching_quantities, oscillating_modes, recorded_kinds
  implicit none (type, external)
  private

  public :: new_analysis_reader

  !> What the groups &record can name: the response of the base machine.
  type, public :: analysis_reader_t
    character(len=:), allocatable :: kind              !! of the groups: 'record', or another one with its keys
    integer, allocatable :: wanted_units(:)
    type(response_settings_t) :: settings
    type(moment_form_t), allocatable :: quantities(:)
    type(response_limit_t), allocatable :: limits(:)
    type(forced_response_t), allocatable :: response   !! with its lines, if the base machine has steady states
    integer :: oscillations = huge(1)                   !! number of its modes; unknown if it has no steady state
    integer :: followed = huge(1)                       !! number of the modes over the speed; unknown without a diagram
    type(orbit_reader_t) :: orbit
    type(json_t) :: reports(size(analysis_words))       !! with their numbers, as far as paths ask for them
  contains
    procedure :: add_results
    procedure, private :: add_orbit, add_paths, check_mode, check_response, check_statistic
  end type analysis_reader_t

  integer, parameter :: most_points = 10000   ! of a curve

contains

  !> Prepares the response of the base machine, if one is recorded.
  subroutine new_analysis_reader(input, machine, kind, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! of the input
    character(len=*), intent(in) :: kind     !! as in `analysis_reader_t`
    type(analysis_reader_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: failure
    type(forced_response_t), allocatable :: response
    type(mode_t), allocatable :: modes(:)
    type(campbell_t) :: campbell
    logical :: has_mode_curves, has_response

    self%kind = kind
    allocate (self%wanted_units, source=output_units(input))
    allocate (self%quantities(0), self%limits(0))
    if (asks_for(input, kind, 'mode') .and. asks_for_steady_modes(input, kind)) then
      call oscillating_modes(input, 0, modes, failure)
      if (.not. allocated(failure)) self%oscillations = size(modes)
    end if
    if (asks_for(input, kind, 'path')) call read_reports(input, kind, self%reports)
    if (asks_for(input, kind, 'orbit')) call new_orbit_reader(input, machine, self%orbit, error)
    has_response = asks_for(input, kind, 'response')
    has_mode_curves = asks_for_curves(input, kind, 'mode')
    if (allocated(error) .or. .not. (has_response .or. has_mode_curves)) return
    call read_response_settings(input, machine, self%settings, error)
    if (allocated(error)) return
    if (has_mode_curves) then
      call find_campbell(input, campbell, failure)
      if (.not. allocated(failure)) self%followed = campbell%modes%modes
    end if
    if (.not. has_response) return
    call list_moment_forms(machine, self%settings%body, self%quantities)
    call read_limits(input, self%quantities, self%limits, error)
    if (allocated(error)) return
    allocate (response)
    call new_forced_response(machine, self%settings%body, self%settings%speeds, response, failure, self%settings%shaker)
    if (.not. allocated(failure)) call move_alloc(response, self%response)
  end subroutine new_analysis_reader

  !> Whether a &record asks for modes about the steady state.
  logical function asks_for_steady_modes(input, kind)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind   !! of the groups
    integer, allocatable :: records(:)
    integer :: i

    allocate (records, source=input%groups_named(kind))
    asks_for_steady_modes = any([(input%groups(records(i))%has_value('mode') .and. &
                                  .not. input%groups(records(i))%has_value('order'), i=1, size(records))])
  end function asks_for_steady_modes

  !> Whether a &record of a mode or a response asks for a curve.
  logical function asks_for_curves(input, kind, owner)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, owner   !! of the groups; their key
    integer, allocatable :: records(:)
    integer :: i, k

    asks_for_curves = .false.
    allocate (records, source=input%groups_named(kind))
    do i = 1, size(records)
      if (.not. input%groups(records(i))%has_value(owner)) cycle
      associate (words => input%groups(records(i))%texts('statistic'))
        asks_for_curves = asks_for_curves .or. any([(words(k)%text == 'curve', k=1, size(words))])
      end associate
    end do
  end function asks_for_curves

  !> The reports of the base machine that paths name; without numbers if there is none.
  subroutine read_reports(input, kind, reports)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind        !! of the groups
    type(json_t), intent(inout) :: reports(:)   !! [analyses]
    class(analysis_t), allocatable :: analysis
    type(error_t), allocatable :: failure
    integer, allocatable :: records(:)
    logical :: is_wanted(size(reports))
    integer :: i, k

    is_wanted = .false.
    allocate (records, source=input%groups_named(kind))
    do i = 1, size(records)
      if (.not. input%groups(records(i))%has_value('path')) cycle
      associate (paths => input%groups(records(i))%texts('path'))
        do k = 1, size(paths)
          is_wanted = is_wanted .or. analysis_words == paths(k)%text(:max(index(paths(k)%text, '.') - 1, 0))
        end do
      end associate
    end do
    do k = 1, size(reports)
      if (.not. is_wanted(k)) cycle
      call solve_named(trim(analysis_words(k)), input, analysis, failure)
      if (allocated(failure)) cycle
      reports(k)%keeps_numbers = .true.
      call analysis%judge(input)
      call analysis%put_report(input, reports(k))
    end do
  end subroutine read_reports

  !> Whether a &record has a key.
  logical function asks_for(input, kind, key)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, key   !! of the groups
    integer, allocatable :: records(:)
    integer :: i

    allocate (records, source=input%groups_named(kind))
    asks_for = any([(input%groups(records(i))%has_value(key), i=1, size(records))])
  end function asks_for

  !> Adds the numbers of reports that a &record names by their paths.
  subroutine add_paths(self, input, record, others, results, diagnostics)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record, others   !! as in `add_results`
    type(analysis_result_t), allocatable, intent(inout) :: results(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(analysis_result_t) :: one
    type(string_t), allocatable :: paths(:)
    integer :: i, k

    allocate (paths, source=input%groups(record)%texts('path'))
    do i = 1, size(paths)
      associate (text => paths(i)%text)
        call new_path_result(text, one)
        k = findloc(analysis_words == one%command, .true., dim=1)
        if (k == 0) then
          call input%report(record, 'path', 'path = ' // quoted(text) // ' does not begin with the name of an analysis; ' // &
                            "allowed: 'equilibrium.', 'modes.', 'campbell.', 'response.' or 'orbit.' and what its report has", &
                            diagnostics)
          cycle
        end if
        if (self%reports(k)%count > 0 .and. self%reports(k)%find(one%path) == 0) then
          call input%report(record, 'path', 'path = ' // quoted(text) // ': ' // one%command // '.json of this machine has ' // &
                            'no number ' // quoted(one%path) // &
                            suggestion(one%path, self%reports(k)%paths(:self%reports(k)%count)), diagnostics)
          cycle
        end if
      end associate
      call append_new(input, record, 'path', others, one, results, diagnostics)
    end do
  end subroutine add_paths

  !> Adds the results of a &record with a mode, a response, an orbit or paths.
  subroutine add_results(self, input, record, others, results, diagnostics)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record   !! index of the group
    integer, intent(in) :: others   !! results of a variant that are none of these, so far
    type(analysis_result_t), allocatable, intent(inout) :: results(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(analysis_result_t) :: one
    type(string_t), allocatable :: words(:)
    character(len=:), allocatable :: owner
    integer :: before, i, k, points   ! the last of a curve, 0 without a response

    if (input%groups(record)%has_value('path')) then
      call self%add_paths(input, record, others, results, diagnostics)
      return
    end if
    if (input%groups(record)%has_value('orbit')) then
      call self%add_orbit(input, record, others, results, diagnostics)
      return
    end if
    points = 0
    if (allocated(self%settings%speeds)) points = size(self%settings%speeds)
    owner = 'mode'
    if (input%groups(record)%has_value('response')) owner = 'response'
    before = diagnostics%count
    if (owner == 'response') call self%check_response(input, record, diagnostics)
    if (diagnostics%count > before) return
    words = input%groups(record)%texts('statistic')
    do i = 1, size(words)
      k = findloc(analysis_names == words(i)%text .and. analysis_owners == owner, .true., dim=1)
      if (k == 0) then
        call input%report(record, 'statistic', 'statistic = ' // quoted(words(i)%text) // ' does not belong to ' // owner // &
                          '; allowed: ' // statistics_of(owner, input%groups(record)%kind), diagnostics)
        cycle
      end if
      if (owner == 'mode') then
        call check_order(input, record, k, diagnostics)
        call self%check_mode(input, record, k, diagnostics)
        if (any(k == [analysis_crossing, analysis_crossing_margin])) then
          call new_mode_result(input%groups(record)%whole_number('mode'), &
                               input%groups(record)%number('order', absent=0.0_wp), k, one)
          if (k == analysis_crossing) call turn_unit(self, one)
        else
          call new_mode_result(input%groups(record)%whole_number('mode'), 0.0_wp, k, one)
        end if
      else
        call self%check_statistic(input, record, k, diagnostics)
        call make_response_result(self, input, record, k, one)
      end if
      if (one%is_curve() .and. points > most_points) then
        call input%report(record, 'statistic', "statistic = 'curve' keeps a number at each of the " // &
                          to_text(points) // ' ' // self%settings%axis%plural() // ' of &response; ' // &
                          'allowed: at most ' // to_text(most_points), diagnostics)
      else
        call append_new(input, record, 'statistic', others, one, results, diagnostics, points)
      end if
    end do
  end subroutine add_results

  !> Adds the numbers of periodic motions that a &record names.
  subroutine add_orbit(self, input, record, others, results, diagnostics)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record, others   !! as in `add_results`
    type(analysis_result_t), allocatable, intent(inout) :: results(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(analysis_result_t) :: one
    integer :: before, i

    associate (words => input%groups(record)%texts('statistic'))
      do i = 1, size(words)
        before = diagnostics%count
        call self%orbit%read_result(input, record, words(i)%text, one, diagnostics)
        if (diagnostics%count == before) call append_new(input, record, 'statistic', others, one, results, diagnostics)
      end do
    end associate
  end subroutine add_orbit

  !> "'peak', 'peak_speed'".
  function statistics_of(owner, kind) result(text)
    character(len=*), intent(in) :: owner
    character(len=*), intent(in) :: kind   !! of the group that names one: an &objective has no curves
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    do k = 1, size(analysis_names)
      if (analysis_owners(k) /= owner) cycle
      if (.not. any(kind_rules%group == kind .and. kind_rules%word == analysis_names(k))) cycle
      if (text /= '') text = text // ', '
      text = text // quoted(trim(analysis_names(k)))
    end do
  end function statistics_of

  !> Refuses a mode that the base machine does not have, and curves of modes over what does not move them.
  subroutine check_mode(self, input, record, statistic, diagnostics)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record, statistic
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: mode, modes

    if (input%groups(record)%has_value('order')) return   ! a mode that an order meets over the speed
    mode = input%groups(record)%whole_number('mode')
    modes = merge(self%followed, self%oscillations, statistic == analysis_mode_curve)
    if (statistic == analysis_mode_curve .and. self%settings%axis%is_frequency) then
      call input%report(record, 'statistic', "statistic = 'curve' of a mode is over speeds, and &response is over the " // &
                        'frequency of a shaker, which moves no mode', diagnostics)
    else if (mode > modes) then
      call input%report(record, 'mode', 'mode = ' // to_text(mode) // ' is out of range; the machine of the input has ' // &
                        to_text(modes) // ' oscillating modes ' // &
                        trim(merge('over its speed         ', 'about its steady state ', statistic == analysis_mode_curve)), &
                        diagnostics)
    end if
  end subroutine check_mode

  !> Refuses a response that the base machine does not have, and an order that nothing excites.
  subroutine check_response(self, input, record, diagnostics)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: known
    type(string_t), allocatable :: names(:)
    integer :: q

    associate (group => input%groups(record))
      if (size(matching_quantities(self%quantities, group%text('response'), recorded_kinds)) == 0) then
        allocate (names(0))
        do q = 1, size(self%quantities)
          if (self%quantities(q)%kind == kind_moment) call append(names, self%quantities(q)%element)
          call append(names, self%quantities(q)%name)
        end do
        call input%report(record, 'response', 'response = ' // quoted(group%text('response')) // ' is no coupling, shaft or ' // &
                          'mesh, and no column of response.csv' // suggestion(group%text('response'), names), diagnostics)
      end if
      if (group%has_value('order') .and. self%settings%axis%is_frequency) then
        call input%report(record, 'order', 'order: &response is over the frequency of a shaker, which has no orders', diagnostics)
        return
      end if
      if (.not. group%has_value('order') .or. .not. allocated(self%response)) return
      if (line_order(self%response%lines, group%number('order')) > 0) return
      call list_orders(self%response%lines, known)
      call input%report(record, 'order', 'order = ' // to_text(group%number('order')) // ': no excitation has this order of ' // &
                        quoted(input%groups(self%settings%group)%text('body')) // '; the orders of the excitations are ' // &
                        known, diagnostics)
    end associate
  end subroutine check_response

  !> Refuses statistics for which numbers are missing.
  subroutine check_statistic(self, input, record, statistic, diagnostics)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    integer, intent(in) :: statistic
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: name
    integer, allocatable :: quantities(:)
    integer :: k

    if (any(statistic == [analysis_peak_speed, analysis_peak_frequency]) .and. &
        (statistic == analysis_peak_frequency .neqv. self%settings%axis%is_frequency)) then
      call input%report(record, 'statistic', 'statistic = ' // quoted(trim(analysis_names(statistic))) // &
                        ': &response is over the ' // self%settings%axis%noun() // '; allowed: ' // &
                        quoted('peak_' // self%settings%axis%noun()), diagnostics)
    else if (statistic == analysis_margin .and. size(self%settings%operating) == 0) then
      call input%report(record, 'statistic', "statistic = 'margin' is the distance to the speeds in operation; needed: " // &
                        'operating of &response', diagnostics)
    else if (statistic == analysis_ratio) then
      name = input%groups(record)%text('response')
      allocate (quantities, source=matching_quantities(self%quantities, name, limited_kinds))
      do k = 1, size(self%limits)
        if (all(self%limits(k)%quantity /= quantities)) cycle
        if (.not. input%groups(record)%has_value('order')) return
        if (self%limits(k)%has_continuous() .or. self%limits(k)%has_curve()) return
      end do
      call input%report(record, 'statistic', "statistic = 'ratio' needs a &limit of " // quoted(name) // &
                        '; with order one of its oscillation', diagnostics)
    end if
  end subroutine check_statistic

  !> A result of the response, with its unit.
  subroutine make_response_result(self, input, record, statistic, one)
    class(analysis_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record, statistic
    type(analysis_result_t), intent(out) :: one
    character(len=:), allocatable :: column, name
    integer, allocatable :: quantities(:)

    name = input%groups(record)%text('response')
    allocate (quantities, source=matching_quantities(self%quantities, name, recorded_kinds))
    associate (first => self%quantities(quantities(1)))
      column = first%name
      if (first%element == name) column = first%symbol // '_' // name
      call new_response_result(name, column, first%unit, input%groups(record)%number('order', absent=0.0_wp), statistic, one)
      one%signal = first%signal_t
    end associate
    if (statistic == analysis_peak_speed) call turn_unit(self, one)
    if (statistic /= analysis_peak_frequency) return
    one%in_unit = unit_hz
    one%unit = 'Hz'
  end subroutine make_response_result

  !> Gives a result the unit that the input asks for.
  subroutine turn_unit(self, one)
    class(analysis_reader_t), intent(in) :: self
    type(analysis_result_t), intent(inout) :: one

    one%in_unit = unit_for(one%unit, self%wanted_units)
    if (one%in_unit > 0) one%unit = trim(units(one%in_unit)%name)
  end subroutine turn_unit

  !> Refuses statistics of a mode with an order that has no meaning for them, or without one, or without the speeds in operation.
  subroutine check_order(input, record, statistic, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record
    integer, intent(in) :: statistic
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: what
    integer, allocatable :: groups(:)
    logical :: is_crossing

    what = 'statistic = ' // quoted(trim(analysis_names(statistic)))
    is_crossing = any(statistic == [analysis_crossing, analysis_crossing_margin])
    if (is_crossing .and. .not. input%groups(record)%has_value('order')) then
      call input%report(record, 'statistic', what // ' is where an order meets the mode; needed: order', diagnostics)
    else if (input%groups(record)%has_value('order') .and. .not. is_crossing) then
      call input%report(record, 'order', what // ' is of the mode alone; allowed: no order', diagnostics)
    end if
    if (.not. is_crossing) return
    allocate (groups, source=input%groups_named('response'))
    if (size(groups) == 0) then
      call input%report(record, 'statistic', what // ' needs &response with its speeds', diagnostics)
    else if (statistic == analysis_crossing_margin .and. .not. input%groups(groups(1))%has_value('operating')) then
      call input%report(record, 'statistic', what // ' is the distance to the speeds in operation; needed: operating of ' // &
                        '&response', diagnostics)
    end if
  end subroutine check_order

  !> Appends a result that is not recorded yet; of a curve one for each speed.
  subroutine append_new(input, record, key, others, one, results, diagnostics, points)
    type(input_t), intent(in) :: input
    integer, intent(in) :: record, others     !! as in `add_results`
    character(len=*), intent(in) :: key       !! that asks for it
    type(analysis_result_t), intent(in) :: one
    type(analysis_result_t), allocatable, intent(inout) :: results(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer, intent(in), optional :: points   !! speeds of a curve
    type(analysis_result_t), allocatable :: longer(:)
    integer :: before, k, new

    before = size(results)
    new = 1
    if (one%is_curve()) new = points
    if (any([(results(k)%label == one%label .or. results(k)%label == one%label // '_1', k=1, before)])) then
      call input%report(record, key, quoted(one%label) // ' is recorded already; allowed: once', diagnostics)
      return
    end if
    allocate (longer(before + new))
    longer(:before) = results
    do k = 1, new
      longer(before + k) = one
      longer(before + k)%result = others + before + k
      if (.not. one%is_curve()) cycle
      longer(before + k)%point = k
      longer(before + k)%label = one%label // '_' // to_text(k)
    end do
    call move_alloc(longer, results)
  end subroutine append_new

end module nocdyn_recorded_analyses
