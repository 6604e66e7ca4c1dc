!> The report of `nocdyn check` on a machine: bodies, gears, coordinates, redundant constraints.
module nocdyn_machine_report
  use nocdyn_bank, only: role_phase
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_rigid_trains, only: ratio_tolerance
  use nocdyn_text, only: append, counted, joined, quoted, rounded_text, selected, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: named_coordinates, machine_report, machine_notes, constraint_count

  integer, parameter :: max_names = 12    ! in a line
  integer, parameter :: max_lines = 40    ! of one sort in a report
  integer, parameter :: max_notes = 12    ! of one sort

contains

  !> Notes on redundant constraints, on the start (speeds projected onto the constraints or rounded, a steady state), on bodies
  !> that nothing moves, and on joints that do nothing.
  function machine_notes(machine) result(notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: notes(:)
    integer :: i
    character(len=:), allocatable :: text

    allocate (notes(0))
    call add_redundancy_notes(machine, notes)
    if (allocated(machine%start_impulse)) then
      text = 'the start speeds were projected onto the constraints: impulse'
      associate (impulse => machine%start_impulse)
        do i = 1, min(size(impulse%row), max_names)
          if (i > 1) text = text // ','
          text = text // ' ' // rounded_text(impulse%impulse(i), 7) // ' ' // machine%constraints%units(impulse%row(i))%text // &
                 ' s in ' // label(machine, impulse%row(i))
        end do
        if (size(impulse%row) > max_names) text = text // ' and ' // to_text(size(impulse%row) - max_names) // ' more'
        call append(notes, text // '; kinetic energy lost: ' // rounded_text(impulse%energy_lost, 7) // ' J')
      end associate
    end if
    call add_loose_note(machine, notes)
    call add_self_locking_notes(machine, notes)
    if (.not. allocated(machine%start_notes)) return
    do i = 1, size(machine%start_notes)
      call append(notes, machine%start_notes(i)%text)
    end do
  end function machine_notes

  !> Names teeth that no torque on their second wheel alone can move.
  subroutine add_self_locking_notes(machine, notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: b, e

    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      class is (tooth_losses_t)
        do e = 1, bank%count
          if (bank%is_self_locking(e)) call append(notes, 'the teeth of ' // quoted(bank%names(e)%text) // &
                                                   ' are self-locking: their second wheel cannot drive')
        end do
      end select
    end do
  end subroutine add_self_locking_notes

  subroutine add_redundancy_notes(machine, notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: found, g, i, r

    found = 0
    do g = 1, size(machine%groups)
      do r = 1, size(machine%groups(g)%redundancies)
        found = found + 1
        if (found > max_notes) cycle
        associate (redundancy => machine%groups(g)%redundancies(r), constraints => machine%constraints)
          call append(notes, label(machine, redundancy%row) // ' repeats what ' // &
                             joined(selected(constraints%names, redundancy%repeats), ', ', max_names) // ' already ' // &
                             trim(merge('fixes', 'fix  ', size(redundancy%repeats) == 1)) // '; its ' // &
                             reaction_word(machine, redundancy%row) // ' not unique, the smallest-norm share is reported' // &
                             trim(merge(', and its losses are in the motion', repeat(' ', 34), &
                                        any([(has_losses(machine, redundancy%repeats(i)), i=1, size(redundancy%repeats))]) .or. &
                                        has_losses(machine, redundancy%row))))
        end associate
      end do
    end do
    if (found > max_notes) call append(notes, to_text(found - max_notes) // ' more constraints repeat others')
  end subroutine add_redundancy_notes

  !> Whether the teeth of a row lose something.
  pure logical function has_losses(machine, row)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: row
    integer :: b

    has_losses = .false.
    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      class is (tooth_losses_t)
        has_losses = has_losses .or. any(bank%row == row)
      end select
    end do
  end function has_losses

  !> The name of the multiplier of a row, with its verb.
  function reaction_word(machine, row) result(word)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: row
    character(len=:), allocatable :: word

    select case (machine%constraints%kinds(row)%text)
    case ('gear')
      word = 'torque is'
      if (machine%constraints%units(row)%text == 'N') word = 'tooth force is'
    case ('planetary', 'differential')
      word = 'torques are'
    case default
      word = 'multiplier is'
    end select
  end function reaction_word

  !> Appends a note on the bodies that no element and no constraint acts on.
  subroutine add_loose_note(machine, notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(inout) :: notes(:)
    logical :: is_loose(0:machine%bodies)
    integer :: b

    is_loose = .true.
    is_loose(0) = .false.   ! the ground
    is_loose(machine%elements%rows%body) = .false.
    is_loose(machine%constraints%body) = .false.
    associate (loose => pack([(b, b=1, machine%bodies)], is_loose(1:)))
      if (size(loose) == 0) return
      call append(notes, 'nothing connects or drives ' // joined(selected(machine%names, loose), ', ', max_names) // &
                         trim(merge(': it keeps its speed     ', ': they keep their speeds ', size(loose) == 1)))
    end associate
  end subroutine add_loose_note

  !> "gear 'reducer'".
  function label(machine, row)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: row
    character(len=:), allocatable :: label

    label = machine%constraints%kinds(row)%text // ' ' // quoted(machine%constraints%names(row)%text)
  end function label

  !> The report: counts, bodies geared together, coordinates, ratios of geared bodies, notes.
  function machine_report(file, machine) result(text)
    character(len=*), intent(in) :: file
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    type(string_t), allocatable :: notes(:)
    character(len=*), parameter :: kinds(*) = [character(len=10) :: 'coupling', 'shaft', 'mesh', 'motor', 'load', 'excitation', &
                                               'clutch', 'freewheel', 'cardan', 'crank', 'relation', 'drive', 'bearing', 'loss']
    character(len=*), parameter :: always(*) = [character(len=10) :: 'coupling', 'motor', 'load', 'excitation']
    character(len=:), allocatable :: plural
    integer :: b, i
    logical :: is_coordinate(machine%bodies)
    integer, allocatable :: others(:)

    call report%append(file // ': ' // counted(machine%bodies - machine%nodes, 'body', 'bodies') // counted_constraints(machine))
    do i = 1, size(kinds)
      if (all(always /= kinds(i)) .and. elements_of(machine, kinds(i)) == 0) cycle
      plural = trim(kinds(i)) // trim(merge('es', 's ', index('hs', kinds(i)(len_trim(kinds(i)):len_trim(kinds(i)))) > 0))
      call report%append(', ' // counted(elements_of(machine, kinds(i)), trim(kinds(i)), plural))
    end do
    call put_line(report, counted(machine%freedoms(), 'degree', 'degrees') // ' of freedom')
    call put_groups(report, machine)
    call put_line(report, 'coordinates: ' // joined(selected(machine%names, named_coordinates(machine)), ', ', max_lines))
    ! appends the speeds of the dependent bodies in terms of the independent ones
    is_coordinate = .false.
    is_coordinate(machine%coordinates%body) = .true.
    others = pack([(b, b=1, machine%bodies)], .not. is_coordinate)
    do b = 1, min(size(others), max_lines)
      call put_line(report, speed_relation(machine, others(b)))
    end do
    if (size(others) > max_lines) call put_line(report, 'and ' // to_text(size(others) - max_lines) // ' more dependent speeds')
    allocate (notes, source=machine_notes(machine))
    do i = 1, size(notes)
      call put_line(report, 'note: ' // notes(i)%text)
    end do
    text = report%text()
  end function machine_report

  !> The bodies of the input that are coordinates.
  pure function named_coordinates(machine) result(bodies)
    type(machine_t), intent(in) :: machine
    integer, allocatable :: bodies(:)

    associate (all => machine%coordinates%body)
      allocate (bodies, source=pack(all, all <= machine%bodies - machine%nodes))
    end associate
  end function named_coordinates

  !> The number of elements of one kind.
  pure integer function elements_of(machine, kind)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: kind
    integer :: i

    elements_of = 0
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (bank%kind_name() == kind .and. bank%role /= role_phase) elements_of = elements_of + bank%named_count()
      end associate
    end do
  end function elements_of

  subroutine put_line(report, text)
    type(text_buffer_t), intent(inout) :: report
    character(len=*), intent(in) :: text

    call report%append(new_line('a') // '  ' // text)
  end subroutine put_line

  !> ", 2 gears", and the other kinds of constraints that there are.
  function counted_constraints(machine) result(text)
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: text
    character(len=*), parameter :: kinds(3) = [character(len=13) :: 'planetary', 'differential', 'constraint']
    character(len=*), parameter :: names(3) = [character(len=13) :: 'planetary set', 'differential', 'constraint']
    integer :: i, number

    text = ', ' // counted(constraint_count(machine, 'gear'), 'gear', 'gears')
    do i = 1, size(kinds)
      number = constraint_count(machine, trim(kinds(i)))
      if (number > 0) text = text // ', ' // counted(number, trim(names(i)), trim(names(i)) // 's')
    end do
  end function counted_constraints

  !> The number of constraint rows of one kind.
  integer function constraint_count(machine, kind) result(number)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: kind
    integer :: row

    number = count([(machine%constraints%kinds(row)%text == kind, row=1, machine%constraints%rows())])
  end function constraint_count

  subroutine put_groups(report, machine)
    type(text_buffer_t), intent(inout) :: report
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: text
    integer :: found, g, redundant

    found = 0
    redundant = 0
    do g = 1, size(machine%groups)
      if (size(machine%groups(g)%rows) == 0) cycle
      found = found + 1
      redundant = redundant + size(machine%groups(g)%redundancies)
      if (found > max_lines) cycle
      text = 'geared together: ' // joined(selected(machine%names, machine%groups(g)%bodies), ', ', max_names)
      if (size(machine%groups(g)%independent) > 1) then
        text = text // ' with ' // to_text(size(machine%groups(g)%independent)) // ' degrees of freedom'
      end if
      call put_line(report, text)
    end do
    if (found > max_lines) call put_line(report, 'and ' // to_text(found - max_lines) // ' more groups of geared bodies')
    if (redundant == 0) return
    call put_line(report, counted(redundant, 'constraint repeats', 'constraints repeat') // &
                  ' others; ratios count as equal within 1e-9 of their size')
  end subroutine put_groups

  !> "speed of 'machine' = -0.6666667 * speed of 'pinion'", for a dependent body.
  function speed_relation(machine, body) result(text)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    character(len=:), allocatable :: text
    real(wp) :: factor, largest, ratio
    integer :: entry, terms

    associate (first => machine%coordinates%first(body), last => machine%coordinates%first(body + 1) - 1)
      largest = maxval(abs(machine%coordinates%ratio(1, first:last)))
      text = 'speed of ' // quoted(machine%names(body)%text) // ' ='
      terms = 0
      do entry = first, last
        if (abs(machine%coordinates%ratio(1, entry)) <= ratio_tolerance * largest) cycle
        terms = terms + 1
        if (terms > max_names) cycle
        associate (independent => machine%coordinates%body(machine%coordinates%coordinate(entry)))
          ! the ratio of an independent body's speed to its coordinate: 1 with the natural complement
          associate (map => machine%coordinates, first => machine%coordinates%first(independent), &
                     last => machine%coordinates%first(independent + 1) - 1)
            ratio = sum(map%ratio(1, first:last), mask=map%body(map%coordinate(first:last)) == independent)
          end associate
          factor = machine%coordinates%ratio(1, entry) / ratio
          if (terms > 1) text = text // trim(merge(' -', ' +', factor < 0.0_wp))
          if (terms > 1) factor = abs(factor)
          text = text // ' ' // rounded_text(factor, 7) // ' * speed of ' // quoted(machine%names(independent)%text)
        end associate
      end do
      if (terms > max_names) text = text // ' + ' // to_text(terms - max_names) // ' more terms'
      if (terms == 0) text = text // ' 0'
    end associate
  end function speed_relation

end module nocdyn_machine_report
