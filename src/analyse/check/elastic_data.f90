!> Couplings, shafts and meshes of a machine in check.json: stiffnesses, dampings, segments.
module nocdyn_elastic_data
  use nocdyn_bank, only: bank_of
  use nocdyn_element_sets, only: element_names, whole_names, wholes
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: find_slopes
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: new_reduced
  use nocdyn_shaft_segments, only: segment_inertia, segment_stiffness
  use nocdyn_shafts, only: shafts_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: put_couplings, put_shafts

contains

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

end module nocdyn_elastic_data
