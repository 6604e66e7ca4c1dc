!> What can be said of a machine before it moves: bodies, gears, coordinates, redundancies.
module nocdyn_machine_report
  use nocdyn_bank, only: role_names
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, joined, quoted, rounded_text, selected, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: coordinate_names, machine_report, redundancy_notes

contains

  !> The independent bodies in the order of the coordinates.
  function coordinate_names(machine) result(names)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: names(:)

    allocate (names, source=selected(machine%names, machine%coordinates%body))
  end function coordinate_names

  !> One sentence for every redundant gear.
  function redundancy_notes(machine) result(notes)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: notes(:)
    integer :: g, r

    allocate (notes(0))
    do g = 1, size(machine%groups)
      do r = 1, size(machine%groups(g)%redundancies)
        associate (redundancy => machine%groups(g)%redundancies(r), names => machine%constraints%names)
          call append(notes, 'gear ' // quoted(names(redundancy%row)%text) // ' only repeats ' // &
                             joined(selected(names, redundancy%repeats), ', ') // '; their reactions are not unique, ' // &
                             'and those of smallest norm are reported')
        end associate
      end do
    end do
  end function redundancy_notes

  !> What `nocdyn check` prints: counts, coordinates, ratios of geared bodies, redundant gears.
  function machine_report(file, machine) result(text)
    character(len=*), intent(in) :: file
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    type(string_t), allocatable :: notes(:)
    integer :: b, i

    call report%append(file // ': ' // counted(machine%bodies, 'body', 'bodies') // ', ' // &
                       counted(machine%constraints%rows(), 'gear', 'gears'))
    do i = 1, size(machine%banks)
      call report%append(', ' // counted(size(machine%banks(i)%bank%to), trim(role_names(machine%banks(i)%bank%role)), &
                                         trim(role_names(machine%banks(i)%bank%role)) // 's'))
    end do
    call report%append(new_line('a') // '  ' // counted(machine%coordinates%freedoms, 'degree', 'degrees') // ' of freedom')
    call report%append(new_line('a') // '  coordinates: ' // joined(coordinate_names(machine), ', '))
    do b = 1, machine%bodies
      if (all(machine%coordinates%body /= b)) call report%append(new_line('a') // '  ' // speed_relation(machine, b))
    end do
    allocate (notes, source=redundancy_notes(machine))
    do i = 1, size(notes)
      call report%append(new_line('a') // '  note: ' // notes(i)%text)
    end do
    text = report%text()
  end function machine_report

  !> "1 gear", "2 gears".
  function counted(number, singular, plural) result(text)
    integer, intent(in) :: number
    character(len=*), intent(in) :: singular, plural
    character(len=:), allocatable :: text

    text = to_text(number) // ' ' // plural
    if (number == 1) text = to_text(number) // ' ' // singular
  end function counted

  !> "speed of 'machine' = -0.6666667 * speed of 'pinion'", for a body that is no coordinate.
  function speed_relation(machine, body) result(text)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    character(len=:), allocatable :: text
    integer :: entry, start

    start = machine%coordinates%first(body)
    text = 'speed of ' // quoted(machine%names(body)%text) // ' ='
    do entry = start, machine%coordinates%first(body + 1) - 1
      associate (independent => machine%coordinates%body(machine%coordinates%coordinate(entry)), &
                 ratio => machine%coordinates%ratio(1, entry))
        if (entry > start) text = text // ' +'
        text = text // ' ' // rounded_text(ratio / own_ratio(machine, independent), 7) // ' * speed of ' // &
               quoted(machine%names(independent)%text)
      end associate
    end do
  end function speed_relation

  !> How far an independent body itself turns with its coordinate: 1 with the natural complement.
  pure function own_ratio(machine, body) result(ratio)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    real(wp) :: ratio
    integer :: entry

    ratio = 0.0_wp
    do entry = machine%coordinates%first(body), machine%coordinates%first(body + 1) - 1
      if (machine%coordinates%body(machine%coordinates%coordinate(entry)) == body) ratio = machine%coordinates%ratio(1, entry)
    end do
  end function own_ratio

end module nocdyn_machine_report
