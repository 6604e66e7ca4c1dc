!> check.json: the mass-elastic data of a machine, and its input.
module nocdyn_check_file
  use nocdyn_elastic_data, only: put_couplings, put_shafts
  use nocdyn_input, only: input_t
  use nocdyn_input_text, only: input_text
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_report, only: machine_notes, named_coordinates
  use nocdyn_rigid_trains, only: ratio_tolerance
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
    call json%open_report(input%file, input%title())
    if (allocated(input%load_case)) call json%put('load_case', input%load_case%name)
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

end module nocdyn_check_file
