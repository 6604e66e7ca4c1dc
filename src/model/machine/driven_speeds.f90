!> The speeds that drives give the bodies of a machine in a steady state, beside the speeds of its coordinates: omega = L_tau q' +
!> driven speed.
!>
!> They turn no elastic element and fulfil all rows, so that the coordinates need not move with them. Vibrations do not have them:
!> a driven body is ground for these.
module nocdyn_driven_speeds
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_rigid_motions, only: new_rigid_motions, rigid_motions_t
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: find_driven_speeds, moves_with

contains

  !> Finds the speeds that drives give the bodies: those of bodies which they leave free are as they come.
  subroutine find_driven_speeds(machine, offending_row)
    type(machine_t), intent(inout) :: machine   !! with its elements and its rows
    integer, intent(out) :: offending_row       !! a drive that other drives, rows or elastic elements contradict; 0: none
    type(element_coordinates_t) :: equations    ! rows, and twists of elastic elements, by the speeds of the bodies
    type(rigid_motions_t) :: motions
    integer, allocatable :: row(:)              ! of each equation, 0: an element
    real(wp), allocatable :: offset(:)
    integer :: i

    offending_row = 0
    if (.not. any(abs(machine%constraints%demand) > 0)) return
    call list_equations(machine, equations, row)
    allocate (offset(size(row)), source=0.0_wp)
    where (row > 0) offset = -machine%constraints%demand(max(row, 1))
    motions = new_rigid_motions(machine%bodies, equations, [(i, i=1, size(row))], offset)
    if (motions%contradiction > 0) offending_row = row(motions%contradiction)
    machine%driven_speed = motions%drift
  end subroutine find_driven_speeds

  !> The equations of the speeds of the bodies: first those without drives.
  subroutine list_equations(machine, equations, row)
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(out) :: equations
    integer, allocatable, intent(out) :: row(:)   !! of each equation, 0: an elastic element
    integer, allocatable :: elastic(:), entries(:)
    logical, allocatable :: is_drive(:)
    integer :: i, k

    allocate (elastic, source=machine%elastic())
    associate (rows => machine%constraints, twists => machine%elements%rows)
      is_drive = [(rows%kinds(i)%text == 'drive', i=1, rows%rows())]
      row = [pack([(i, i=1, rows%rows())], .not. is_drive), spread(0, 1, size(elastic)), &
             pack([(i, i=1, rows%rows())], is_drive)]
      equations%first = [1]
      allocate (equations%coordinate(0), entries(0))
      allocate (equations%ratio(1, 0))
      do i = 1, size(row)
        if (row(i) > 0) then
          entries = [(k, k=rows%first(row(i)), rows%first(row(i) + 1) - 1)]
          equations%coordinate = [equations%coordinate, rows%body(entries)]
          equations%ratio = reshape([equations%ratio, rows%coefficient(1, entries)], [1, size(equations%coordinate)])
        else
          associate (e => elastic(i - count(.not. is_drive)))
            entries = [(k, k=twists%first(e), twists%first(e + 1) - 1)]
          end associate
          entries = pack(entries, twists%body(entries) > 0)
          equations%coordinate = [equations%coordinate, twists%body(entries)]
          equations%ratio = reshape([equations%ratio, twists%coefficient(entries)], [1, size(equations%coordinate)])
        end if
        equations%first = [equations%first, size(equations%coordinate) + 1]
      end do
    end associate
  end subroutine list_equations

  !> Whether rows or elastic elements join each body to one of them, [bodies].
  function moves_with(machine, body) result(moves)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: body
    logical, allocatable :: moves(:)
    type(element_coordinates_t) :: equations
    integer, allocatable :: row(:)
    integer :: b, component(machine%bodies), i, k, root

    call list_equations(machine, equations, row)
    component = [(b, b=1, size(component))]
    do i = 1, size(row)
      do k = equations%first(i) + 1, equations%first(i + 1) - 1
        call join_components(equations%coordinate(equations%first(i)), equations%coordinate(k), component)
      end do
    end do
    do b = 1, size(component)
      call find_root(component, b, root)
      component(b) = root
    end do
    moves = component == component(body)
  end function moves_with

end module nocdyn_driven_speeds
