!> Two quantities of a machine with one label: what asks for one of them would get the other.
module nocdyn_label_checks
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: quoted, string_t
  use nocdyn_text_sort, only: argsort
  use nocdyn_trajectory_columns, only: column_angle, column_element, column_member, column_reaction, column_speed, column_t, &
    list_columns
  implicit none (type, external)
  private

  public :: refuse_equal_labels

contains

  !> Refuses names by which two columns of a machine have the same label, as those of a shaft 's' and of a coupling 's_1' have.
  subroutine refuse_equal_labels(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error   !! names file, line and group of the one that comes last
    type(column_t), allocatable :: columns(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: order(:)
    integer :: first, i, last

    call list_columns(machine, columns, labels)
    call argsort(labels, order)
    do i = 2, size(order)
      if (labels(order(i - 1))%text /= labels(order(i))%text) cycle
      first = owner(input, machine, columns(order(i - 1)))
      last = owner(input, machine, columns(order(i)))
      call raise(error, exit_input, input%location(max(first, last), 'name') // ': its column ' // &
                 quoted(labels(order(i))%text) // ' would have the label of one of ' // input%label(min(first, last)) // &
                 '; allowed: another name')
      return
    end do
  end subroutine refuse_equal_labels

  !> The group of the input that a column belongs to.
  integer function owner(input, machine, column) result(group)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(column_t), intent(in) :: column
    character(len=:), allocatable :: name
    logical :: is_body

    is_body = any(column%kind == [column_angle, column_speed])
    select case (column%kind)
    case (column_angle, column_speed)
      name = machine%names(column%index)%text
    case (column_element)
      name = machine%banks(column%bank)%bank%names(column%index)%text
    case (column_reaction)
      name = machine%constraints%names(column%index)%text
    case (column_member)
      name = machine%constraints%names(machine%constraints%members%row(column%index))%text
    case default
      error stop 'nocdyn_label_checks: columns of a whole machine have labels of their own'
    end select
    do group = size(input%groups), 1, -1
      if (input%groups(group)%name == name .and. (is_body .eqv. input%groups(group)%kind == 'body')) return
    end do
    do group = size(input%groups), 2, -1   ! a node of a shaft 's' is the body 's[1]', a bearing has the name of its body
      if (input%groups(group)%name == '') cycle
      if (index(name, input%groups(group)%name) == 1) return
    end do
  end function owner

end module nocdyn_label_checks
