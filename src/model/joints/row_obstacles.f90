!> Why no motion fits the rows that hold: which of them contradict one another.
module nocdyn_row_obstacles
  use nocdyn_bank, only: bank_of, bank_slot_t, role_loss
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_element_rows, only: element_rows_t
  use nocdyn_geared_pairs, only: has_other_ratio
  use nocdyn_held_rows, only: held_rows_t
  use nocdyn_text, only: quoted, to_text
  implicit none (type, external)
  private

  public :: describe_obstacle

  integer, parameter :: most_names = 4

contains

  !> What ends a motion: that the rank of the rows that move has changed, or is about to, or a contradiction; '' if nothing does.
  subroutine describe_obstacle(held, banks, rows, coordinates, text)
    class(held_rows_t), intent(in) :: held
    type(bank_slot_t), intent(in) :: banks(:)
    type(element_rows_t), intent(in) :: rows   !! of the elements
    type(coordinates_t), intent(in) :: coordinates
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable :: name, others
    integer :: row

    text = ''
    row = held%nearly_lost()
    if (row == 0) return
    call name_joint(held, banks, row, name)
    if (banks(bank_of(banks, held%element(row)))%bank%role == role_loss) then
      text = 'the ' // name // ' jam: their second wheel brakes the first one more than its inertia allows, by their low ' // &
             'reverse efficiency'
    else if (has_other_ratio(coordinates, rows, held%element(row))) then
      text = name // ' contradicts the gears between its bodies: locked, it stops both'
    else
      call name_joints(held, banks, held%partners(row), others)
      text = name // ' contradicts ' // others // ' there, or does not differ from them: a dead centre, or a loop that locks'
    end if
  end subroutine describe_obstacle

  !> "freewheel 'f' and drive 'e'"; of rows with one name the first.
  subroutine name_joints(held, banks, joints, text)
    class(held_rows_t), intent(in) :: held
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: joints(:)
    character(len=:), allocatable, intent(out) :: text
    character(len=:), allocatable :: last, name
    integer :: i

    text = 'other joints and drives'
    last = ''
    do i = 1, size(joints)
      call name_joint(held, banks, joints(i), name)
      if (name == last) cycle
      if (i == 1) then
        text = name
      else if (i > most_names) then
        text = text // ' and ' // to_text(size(joints) - i + 1) // ' more'
        return
      else
        text = text // ' and ' // name
      end if
      last = name
    end do
  end subroutine name_joints

  !> "drive 'd'".
  subroutine name_joint(held, banks, joint, text)
    class(held_rows_t), intent(in) :: held
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: joint
    character(len=:), allocatable, intent(out) :: text

    associate (element => held%element(joint))
      associate (bank => banks(bank_of(banks, element))%bank)
        text = quoted(bank%names(element - bank%first + 1)%text)
        if (bank%role == role_loss) then
          text = 'teeth of ' // text
        else
          text = trim(bank%kind_name()) // ' ' // text
        end if
      end associate
    end associate
  end subroutine name_joint

end module nocdyn_row_obstacles
