!> check.json: the mass-elastic data of a machine, and its input.
module nocdyn_check_file
  use nocdyn_bank, only: bank_of
  use nocdyn_damper_report, only: put_dampers
  use nocdyn_element_sets, only: element_names, whole_names, wholes
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: find_slopes
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_notes, named_coordinates
  use nocdyn_reduced, only: new_reduced
  use nocdyn_report_openings, only: open_analysis_report
  use nocdyn_rigid_trains, only: ratio_tolerance
  use nocdyn_shaft_segments, only: segment_inertia, segment_stiffness
  use nocdyn_shafts, only: shafts_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: append, selected, string_t
  implicit none (type, external)
  private

  public :: put_check

contains

  !> The members of check.json.
  subroutine put_check(json, input, machine)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: notes(:)
    integer :: b, c, e, i
    integer, allocatable :: entries(:), groups(:)
    real(wp), allocatable :: ratios(:)

    allocate (notes, source=machine_notes(machine))
    do i = 1, size(machine%simplifications)
      call append(notes, machine%simplifications(i)%text)
    end do
    call open_analysis_report(json, input)
    call json%put('degrees_of_freedom', machine%freedoms())
    call json%put('independent', selected(machine%names, named_coordinates(machine)))
    call json%put('notes', notes)
    ! The bodies of the input: their inertias there and with the ends of shafts, their speeds at the start, and these as a sum of
    ! ratios times the speeds of independent bodies.
    allocate (groups, source=input%groups_named('body'))
    call json%open_list('bodies')
    associate (map => machine%coordinates)
      do b = 1, machine%bodies - machine%nodes
        entries = [(e, e=map%first(b), map%first(b + 1) - 1)]
        ratios = [(map%ratio(1, e) / own_ratio(machine, map%coordinate(e)), e=map%first(b), map%first(b + 1) - 1)]
        entries = pack(entries, abs(ratios) > ratio_tolerance * maxval([abs(ratios), 0.0_wp]))
        ratios = pack(ratios, abs(ratios) > ratio_tolerance * maxval([abs(ratios), 0.0_wp]))
        call json%open()
        call json%put('name', machine%names(b)%text)
        call json%put('inertia_kg_m2', input%groups(groups(b))%number('inertia'))
        call json%put('inertia_with_shafts_kg_m2', machine%inertia(1, b))
        call json%put('start_speed_rad_s', machine%start_speed(1, b))
        call json%put('coordinates', selected(machine%names, map%body(map%coordinate(entries))))
        call json%put('ratios', ratios)
        if (size(ratios) == 1) call json%put('referred_inertia_kg_m2', machine%inertia(1, b) * ratios(1)**2)
        call json%close()
      end do
    end associate
    call json%close_list()
    call put_couplings(json, machine)
    call put_dampers(json, input, machine)
    call put_shafts(json, input, machine)
    call put_constraints(json, machine)
    if (allocated(input%load_cases)) then
      call json%open_list('load_cases')
      do c = 1, size(input%load_cases)
        call json%open()
        call json%put('name', input%load_cases(c)%name)
        call json%put('title', input%load_cases(c)%title)
        call json%put('repeats', input%load_cases(c)%repeats)
        call json%close()
      end do
      call json%close_list()
    end if
    call json%put('complete_input', input_text(input))
    call json%close()
  end subroutine put_check

  !> The ratio of the speed of the independent body of a coordinate to this: 1 with the natural complement.
  pure real(wp) function own_ratio(machine, coordinate) result(ratio)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: coordinate

    associate (map => machine%coordinates)
      associate (first => map%first(map%body(coordinate)), last => map%first(map%body(coordinate) + 1) - 1)
        ratio = sum(map%ratio(1, first:last), mask=map%coordinate(first:last) == coordinate)
      end associate
    end associate
  end function own_ratio

  !> Gears, planetary sets and other rigid relations: the sum of coefficients times speeds is 0; of two bodies also the ratio of
  !> the second one's speed to the first one's.
  subroutine put_constraints(json, machine)
    type(json_t), intent(inout) :: json
    type(machine_t), intent(in) :: machine
    integer :: i

    call json%open_list('constraints')
    associate (rows => machine%constraints)
      do i = 1, rows%rows()
        associate (first => rows%first(i), last => rows%first(i + 1) - 1)
          call json%open()
          call json%put('name', rows%names(i)%text)
          call json%put('kind', rows%kinds(i)%text)
          call json%put('bodies', selected(machine%names, rows%body(first:last)))
          call json%put('coefficients', rows%coefficient(1, first:last))
          if (last == first + 1) call json%put('ratio', -rows%coefficient(1, first) / rows%coefficient(1, last))
          call json%close()
        end associate
      end do
    end associate
    call json%close_list()
  end subroutine put_constraints

  !> Couplings, shafts and meshes with their stiffness and damping at the start of a run. Slices of a shaft are in series.
  subroutine put_couplings(json, machine)
    type(json_t), intent(inout) :: json
    type(machine_t), intent(in) :: machine
    class(formulation_t), allocatable :: formulation
    type(string_t), allocatable :: elements(:), names(:)
    type(error_t), allocatable :: ignored   ! numbers that are not finite are written as null
    type(slopes_t) :: slopes
    real(wp), allocatable :: damping(:), stiffness(:), y(:, :)
    integer, allocatable :: elastic(:), whole(:)
    integer :: i

    allocate (elastic, source=machine%elastic())
    allocate (formulation, source=new_reduced(machine, .false.))
    y = formulation%start()
    call find_slopes(formulation, 0.0_wp, y, slopes, ignored)
    stiffness = slopes%stiffness(elastic)
    damping = slopes%damping(elastic) + slopes%stand_in(elastic)
    allocate (elements, source=element_names(machine, elastic))
    allocate (names, source=whole_names(elements))
    whole = wholes(elements)
    call json%open_list('couplings')
    do i = 1, size(names)
      call put_coupling(json, machine, names(i)%text, pack(elastic, whole == i), pack(stiffness, whole == i), &
                        pack(damping, whole == i))
    end do
    call json%close_list()
  end subroutine put_couplings

  !> One coupling of one element, or a shaft of slices.
  subroutine put_coupling(json, machine, name, elements, stiffness, damping)
    type(json_t), intent(inout) :: json
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: name
    integer, intent(in) :: elements(:)
    real(wp), intent(in) :: stiffness(:), damping(:)   !! of these [N m/rad], [N m s/rad]; of a mesh [N/m], [N s/m]
    character(len=:), allocatable :: kind
    integer, allocatable :: bodies(:)

    kind = trim(machine%banks(bank_of(machine%banks, elements(1)))%bank%kind_name())
    call json%open()
    call json%put('name', name)
    call json%put('kind', kind)
    bodies = ends_of(machine, elements)
    call json%put('bodies', names_of(machine, bodies))
    if (kind == 'mesh') then
      call json%put('stiffness_N_m', in_series(stiffness))
      call json%put('damping_N_s_m', in_series(damping))
    else
      call json%put('stiffness_N_m_rad', in_series(stiffness))
      call json%put('damping_N_m_s_rad', in_series(damping))
    end if
    call json%close()
  end subroutine put_coupling

  !> The stiffness or damping of several in series, of one its own.
  pure real(wp) function in_series(values) result(whole)
    real(wp), intent(in) :: values(:)

    whole = values(1)
    if (size(values) == 1) return
    whole = 0.0_wp
    if (all(abs(values) > 0.0_wp)) whole = 1.0_wp / sum(1.0_wp / values)
  end function in_series

  !> The bodies of the input that some elements join; 0, the ground, if there is one only. Slices are numbered from the second
  !> end.
  pure function ends_of(machine, elements) result(bodies)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: elements(:)
    integer, allocatable :: bodies(:)
    integer :: i, k

    allocate (bodies(0))
    associate (rows => machine%elements%rows)
      do i = size(elements), 1, -1
        do k = rows%first(elements(i)), rows%first(elements(i) + 1) - 1
          if (rows%body(k) > machine%bodies - machine%nodes .or. any(bodies == rows%body(k))) cycle
          bodies = [bodies, rows%body(k)]
        end do
      end do
    end associate
    if (size(bodies) == 1) bodies = [bodies, 0]
  end function ends_of

  !> Names of bodies, 'ground' of 0.
  pure function names_of(machine, bodies) result(names)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: bodies(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(size(bodies)))
    do i = 1, size(bodies)
      names(i)%text = 'ground'
      if (bodies(i) > 0) names(i)%text = machine%names(bodies(i))%text
    end do
  end function names_of

  !> The segments of every shaft, and the number of its internal nodes.
  subroutine put_shafts(json, input, machine)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    integer, allocatable :: groups(:)
    integer :: b, i

    allocate (groups, source=input%groups_named('shaft'))
    call json%open_list('shafts')
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        call json%open()
        call json%put('name', group%name)
        call json%put('length_m', group%numbers('lengths'))
        call json%put('diameter_m', group%numbers('diameters'))
        call json%put('bore_m', group%numbers('bores'))
        call json%put('stiffness_N_m_rad', segment_stiffness(group))
        call json%put('inertia_kg_m2', segment_inertia(group))
        call json%put('nodes', count([(index(machine%names(b)%text, group%name // '[') == 1, b=1, machine%bodies)]))
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_shafts

end module nocdyn_check_file
