!> The registry of signals: all that a machine puts out over the time.
!>
!> A signal has one definition, one name, one unit and one caption in every command. Columns, statistics, limits, damages and
!> responses choose signals by element and symbol; labels are printed and never taken apart.
module nocdyn_signals
  use nocdyn_bank, only: bank_t, role_bearing, role_crank, role_loss, role_names
  use nocdyn_couplings, only: couplings_t
  use nocdyn_machine, only: machine_t
  use nocdyn_kinds, only: wp
  use nocdyn_quantities, only: form_observed, quantity_t, rank_detail, rank_moment, rank_reaction, rank_speed, rank_torque
  use nocdyn_shafts, only: shafts_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: find_signal, former_name, is_largest_along, label_signals, list_points, list_signals

  integer, parameter, public :: signal_time = 1
  integer, parameter, public :: signal_angle = 2         !! of a body
  integer, parameter, public :: signal_speed = 3
  integer, parameter, public :: signal_element = 4       !! a quantity of an element of a bank
  integer, parameter, public :: signal_reaction = 5      !! multiplier of a constraint row
  integer, parameter, public :: signal_member = 6        !! torque of a row on one of its members
  integer, parameter, public :: signal_point_moment = 7  !! at a point of a shaft, see `list_points`
  integer, parameter, public :: signal_point_stress = 8
  integer, parameter, public :: signal_kinetic = 9       !! this and the following: energies and works of the machine
  integer, parameter, public :: signal_elastic = 10
  integer, parameter, public :: signal_work_in = 11
  integer, parameter, public :: signal_work_out = 12
  integer, parameter, public :: signal_residual = 13

  character(len=*), parameter :: energy_names(signal_kinetic:signal_residual) = &
    [character(len=15) :: 'kinetic_energy', 'elastic_energy', 'work_in', 'work_out', 'energy_residual']
  character(len=*), parameter :: energy_captions(signal_kinetic:signal_residual) = [character(len=24) :: 'kinetic energy', &
    'elastic energy', 'work put in', 'work taken out', 'energy balance error']

  !> Where the value of a signal comes from.
  type, public :: signal_source_t
    integer :: kind = signal_time     !! signal_...
    integer :: bank = 0               !! of an element
    integer :: quantity = 0           !! of the bank: index in `quantities`; of a point: the shaft
    integer :: index = 0              !! of the body, of the element within its bank, of the row or of the member; the point
    integer :: form = form_observed   !! of a quantity, as are the following
    integer :: divisor = 0
    integer :: body = 0
    real(wp) :: factor = 1.0_wp
  end type signal_source_t

  type, public :: signal_t
    type(signal_source_t) :: source
    character(len=:), allocatable :: name           !! such as 'total_moment_shaft_1': symbol, element and point
    character(len=:), allocatable :: symbol         !! such as 'total_moment'
    character(len=:), allocatable :: element_kind   !! the group of the input, such as 'coupling'; '' of the whole machine
    character(len=:), allocatable :: element        !! its name
    character(len=:), allocatable :: point          !! of the element, such as 'max' or '[3]'; '' of the whole element
    character(len=:), allocatable :: unit           !! in SI
    character(len=:), allocatable :: caption, positive   !! what it is, and when it is positive
    integer :: rank = rank_detail                   !! rank_...
  contains
    procedure :: is_inner
  end type signal_t

contains

  !> All signals of a machine, in the order of the table of a run.
  subroutine list_signals(machine, signals)
    type(machine_t), intent(in) :: machine
    type(signal_t), allocatable, intent(out) :: signals(:)
    integer :: b, count, kind, member, row
    type(quantity_t) :: one

    allocate (signals(3 * machine%bodies + size(energy_names) + 8))
    count = 0
    call add_signal(signals, count, signal_source_t(signal_time), &
                    quantity_t(symbol='t', unit='s', caption='time', rank=rank_detail), '', '', '')
    do b = 1, machine%bodies
      call add_body(machine, b, signal_angle, signals, count)
    end do
    do b = 1, machine%bodies
      call add_body(machine, b, signal_speed, signals, count)
    end do
    do b = 1, size(machine%banks)
      call add_bank(machine, b, signals, count)
    end do
    ! The multiplier of each row, followed by the torques on its members that have a signal. The multiplier of a row that
    ! holds a joint, such as a clutch, is its torque on the second body.
    member = 1
    associate (rows => machine%constraints, members => machine%constraints%members)
      do row = 1, rows%rows()
        one = quantity_t(symbol='torque', unit=rows%units(row)%text, caption='torque', positive='on the second body', &
                         rank=rank_torque)
        if (rows%is_of_teeth(row)) one = quantity_t(symbol='reaction', unit=rows%units(row)%text, caption='reaction', &
                                                    positive='in the positive direction of both', rank=rank_reaction)
        call add_signal(signals, count, signal_source_t(signal_reaction, index=row), one, rows%kinds(row)%text, &
                        rows%names(row)%text, '')
        do while (member <= size(members%row))
          if (members%row(member) /= row) exit
          one = quantity_t(symbol='reaction', unit='N m', caption='torque on a member', positive='with a positive speed', &
                           rank=rank_reaction)
          call add_signal(signals, count, signal_source_t(signal_member, index=member), one, rows%kinds(row)%text, &
                          rows%names(row)%text, members%names(member)%text)
          member = member + 1
        end do
      end do
    end associate
    do kind = signal_kinetic, signal_residual
      call add_signal(signals, count, signal_source_t(kind), quantity_t(symbol=energy_names(kind), unit='J', &
                      caption=energy_captions(kind), rank=rank_detail), '', '', '')
    end do
    call resize(signals, count, count)
  end subroutine list_signals

  !> The angle or the speed of a body; pistons and rods of cranks move along a line. Parts of a crank and nodes inside of a shaft
  !> are its points.
  subroutine add_body(machine, body, kind, signals, count)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body, kind   !! of the machine; signal_angle or signal_speed
    type(signal_t), allocatable, intent(inout) :: signals(:)
    integer, intent(inout) :: count
    character(len=:), allocatable :: kind_of_element
    integer :: bracket, rank

    associate (name => machine%names(body)%text)
      bracket = index(name // '[', '[')
      kind_of_element = 'body'
      if (bracket <= len(name)) then
        kind_of_element = 'shaft'
        if (is_part_of_crank(machine, name(:bracket - 1))) kind_of_element = 'crank'
      end if
      rank = merge(rank_speed, rank_detail, kind == signal_speed)
      if (is_straight(machine, body)) then
        if (kind == signal_angle) call add('x', 'm', 'position')
        if (kind == signal_speed) call add('v', 'm/s', 'velocity')
      else
        if (kind == signal_angle) call add('phi', 'rad', 'angle')
        if (kind == signal_speed) call add('omega', 'rad/s', 'speed')
      end if
    end associate

  contains

    subroutine add(symbol, unit, caption)
      character(len=*), intent(in) :: symbol, unit, caption

      associate (name => machine%names(body)%text)
        call add_signal(signals, count, signal_source_t(kind, index=body), &
                        quantity_t(symbol=symbol, unit=unit, caption=caption, rank=rank), kind_of_element, name(:bracket - 1), &
                        name(bracket:))
      end associate
    end subroutine add

  end subroutine add_body

  !> Whether there is a crank with a name.
  pure logical function is_part_of_crank(machine, name) result(is_part)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: name
    integer :: i

    is_part = .false.
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%role /= role_crank .or. bank%moving_rows == 0) cycle
        is_part = is_part .or. bank%names(1)%text == name
      end associate
    end do
  end function is_part_of_crank

  !> Whether a body moves along a line: pistons and rods of cranks, but not the angles of rods.
  logical function is_straight(machine, body)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    integer :: e, i

    is_straight = .false.
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%role /= role_crank .or. bank%moving_rows == 0) cycle
        is_straight = is_straight .or. any([(bank%rows%last_body(e) == body, e=1, min(bank%count, 3))])
      end associate
    end do
  end function is_straight

  !> The quantities of the elements of a bank. An elastic moment is a detail where a total moment has it as a part.
  subroutine add_bank(machine, number, signals, count)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: number   !! of the bank
    type(signal_t), allocatable, intent(inout) :: signals(:)
    integer, intent(inout) :: count
    type(quantity_t), allocatable :: quantities(:)
    type(quantity_t) :: one
    integer :: body, e, q

    associate (bank => machine%banks(number)%bank)
      call bank%quantities(quantities)
      do q = 1, size(quantities)
        one = quantities(q)
        do e = 1, size(one%elements)
          associate (element => one%elements(e))
            one%rank = quantities(q)%rank
            if (one%symbol == 'moment' .and. any(bank%with_work == element)) one%rank = rank_detail
            body = 0
            if (allocated(one%body)) body = one%body(e)
            call add_signal(signals, count, signal_source_t(signal_element, number, q, element, one%form, one%divisor, &
                                                            body, one%factor), one, group_kind(machine, bank, element), &
                            bank%names(element)%text, trim(one%point))
          end associate
        end do
      end do
    end associate
  end subroutine add_bank

  !> The group of the input to which an element belongs. A loss belongs to a gear or a similar row, else to a mesh.
  function group_kind(machine, bank, element) result(kind)
    type(machine_t), intent(in) :: machine
    class(bank_t), intent(in) :: bank
    integer, intent(in) :: element   !! numbered within the bank
    character(len=16) :: kind
    integer :: row

    kind = role_names(bank%role)
    if (bank%role == role_bearing) kind = 'body'
    select type (bank)
    class is (couplings_t)
      if (bank%is_mesh) kind = 'mesh'
      if (bank%has_parts) kind = 'shaft'
    end select
    if (bank%role /= role_loss) return
    kind = 'mesh'
    do row = 1, machine%constraints%rows()
      if (machine%constraints%names(row)%text == bank%names(element)%text) kind = machine%constraints%kinds(row)%text
    end do
  end function group_kind

  !> Appends a signal of an element; what it is, `quantity` says.
  pure subroutine add_signal(signals, count, source, quantity, element_kind, element, point)
    type(signal_t), allocatable, intent(inout) :: signals(:)
    integer, intent(inout) :: count
    type(signal_source_t), intent(in) :: source
    type(quantity_t), intent(in) :: quantity   !! but for its point
    character(len=*), intent(in) :: element_kind, element, point

    if (count == size(signals)) call resize(signals, count, 2 * count)
    count = count + 1
    associate (one => signals(count))
      one%source = source
      one%symbol = trim(quantity%symbol)
      one%element_kind = trim(element_kind)
      one%element = element
      one%point = point
      one%unit = trim(quantity%unit)
      one%caption = trim(quantity%caption)
      one%positive = trim(quantity%positive)
      one%rank = quantity%rank
      one%name = one%symbol
      if (element /= '') one%name = one%name // '_' // element
      if (point /= '' .and. index(point, '[') /= 1) one%name = one%name // '_'
      one%name = one%name // point
    end associate
  end subroutine add_signal

  !> Keeps the first signals in an array of another size.
  pure subroutine resize(signals, kept, room)
    type(signal_t), allocatable, intent(inout) :: signals(:)
    integer, intent(in) :: kept, room
    type(signal_t), allocatable :: others(:)
    integer :: i

    allocate (others(room))
    do i = 1, kept
      associate (one => signals(i), other => others(i))
        other%source = one%source
        other%rank = one%rank
        call move_alloc(one%name, other%name)
        call move_alloc(one%symbol, other%symbol)
        call move_alloc(one%element_kind, other%element_kind)
        call move_alloc(one%element, other%element)
        call move_alloc(one%point, other%point)
        call move_alloc(one%unit, other%unit)
        call move_alloc(one%caption, other%caption)
        call move_alloc(one%positive, other%positive)
      end associate
    end do
    call move_alloc(others, signals)
  end subroutine resize

  !> Whether a signal belongs to a node inside of a shaft, which is shown only if it is asked for.
  elemental logical function is_inner(self)
    class(signal_t), intent(in) :: self

    is_inner = index(self%point, '[') == 1
  end function is_inner

  !> The name that a signal had before, which inputs may still have; '' if there is none.
  pure subroutine former_name(signal, is_response, name)
    type(signal_t), intent(in) :: signal
    logical, intent(in) :: is_response   !! whether it is one of response.csv
    character(len=:), allocatable, intent(out) :: name

    name = ''
    if (signal%symbol /= 'total_moment') return
    if (signal%element_kind == 'shaft' .or. is_response) then
      name = signal%name(len('total_') + 1:)
    else
      name = 'shaft_' // signal%element
    end if
  end subroutine former_name

  !> The labels of columns, such as 'total_moment_shaft_1 [N m]', in SI.
  subroutine label_signals(signals, labels)
    type(signal_t), intent(in) :: signals(:)
    type(string_t), allocatable, intent(out) :: labels(:)
    integer :: i

    allocate (labels(size(signals)))
    do i = 1, size(signals)
      labels(i)%text = signals(i)%name // ' [' // signals(i)%unit // ']'
    end do
  end subroutine label_signals

  !> A signal of an element, 0 if there is none. The total moment of a coupling without damping is its elastic moment.
  recursive integer function find_signal(signals, element_kind, element, symbol, point) result(found)
    type(signal_t), intent(in) :: signals(:)
    character(len=*), intent(in) :: element_kind, element   !! the group of the input, and its name
    character(len=*), intent(in) :: symbol
    character(len=*), intent(in), optional :: point          !! of the element; absent: the whole element

    do found = size(signals), 1, -1
      associate (one => signals(found))
        if (one%symbol /= symbol .or. one%element /= element .or. one%element_kind /= element_kind) cycle
        if (present(point)) then
          if (one%point == point) return
        else if (one%point == '') then
          return
        end if
      end associate
    end do
    if (symbol == 'total_moment' .and. element_kind == 'coupling') found = find_signal(signals, element_kind, element, 'moment')
  end function find_signal

  !> The sources of all points of a shaft, which are no signals of the table; none if there is no such shaft.
  subroutine list_points(machine, shaft, kind, points)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: shaft   !! its name
    integer, intent(in) :: kind             !! signal_point_...
    type(signal_source_t), allocatable, intent(out) :: points(:)
    integer :: b, p, s

    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      type is (shafts_t)
        do s = 1, size(bank%shafts)
          if (bank%names(bank%shafts(s)%first)%text /= shaft) cycle
          allocate (points(bank%shafts(s)%last_point - bank%shafts(s)%first_point + 1))
          do p = 1, size(points)
            points(p) = signal_source_t(kind, b, s, p)
          end do
          return
        end do
      class default
        cycle
      end select
    end do
    allocate (points(0))
  end subroutine list_points

  !> Whether a column is the largest moment or stress along a shaft with inertia.
  logical function is_largest_along(machine, column, is_stress)
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: column
    logical, intent(out) :: is_stress
    integer :: shaft

    is_largest_along = .false.
    is_stress = .false.
    if (column%kind /= signal_element) return
    select type (bank => machine%banks(column%bank)%bank)
    type is (shafts_t)
      is_stress = bank%is_stress(column%quantity)
      shaft = findloc(bank%shafts%first, column%index, dim=1)
      is_largest_along = (is_stress .or. bank%is_largest_moment(column%quantity)) .and. size(bank%shafts(shaft)%elements) > 0
    class default
      return
    end select
  end function is_largest_along

end module nocdyn_signals
