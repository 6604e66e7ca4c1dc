!> What can be said of a machine before it moves: bodies, gears, coordinates, redundancies.
module nocdyn_machine_report
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: joined, quoted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none
  private

  public :: coordinate_names, machine_report, redundancy_notes

contains

  !> The independent bodies in the order of the coordinates.
  function coordinate_names(machine) result(names)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: names(:)

    names = machine%names(machine%coordinates%body)
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
          notes = [notes, string_t('gear ' // quoted(names(redundancy%row)%text) // ' repeats what ' // &
                                   joined(names(redundancy%repeats), ', ') // ' already fix; their reactions are not ' // &
                                   'unique, the share of smallest norm is reported')]
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

    call report%append(file // ': ' // to_text(machine%bodies) // ' bodies, ' // &
                       to_text(machine%constraints%rows()) // ' gears, ' // to_text(element_count(machine)) // &
                       ' couplings and torques; degrees of freedom: ' // to_text(machine%coordinates%freedoms))
    call report%append(new_line('a') // '  coordinates: the speeds of ' // joined(coordinate_names(machine), ', '))
    do b = 1, machine%bodies
      if (all(machine%coordinates%body /= b)) call report%append(new_line('a') // '  ' // speed_relation(machine, b))
    end do
    allocate (notes, source=redundancy_notes(machine))
    do i = 1, size(notes)
      call report%append(new_line('a') // '  note: ' // notes(i)%text)
    end do
    text = report%text()
  end function machine_report

  pure integer function element_count(machine)
    type(machine_t), intent(in) :: machine
    integer :: i

    element_count = 0
    do i = 1, size(machine%banks)
      element_count = element_count + size(machine%banks(i)%bank%to)
    end do
  end function element_count

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
