!> Two signals of a machine with one name: what asks for one of them would get the other.
module nocdyn_label_checks
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_signals, only: label_signals, list_signals, signal_t
  use nocdyn_text, only: quoted, string_t
  use nocdyn_text_sort, only: argsort
  implicit none (type, external)
  private

  public :: refuse_equal_labels

contains

  !> Refuses names by which two signals of a machine have the same label, as those of a shaft 's' and of a coupling 's_1' have.
  subroutine refuse_equal_labels(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error   !! names file, line and group of the one that comes last
    type(signal_t), allocatable :: signals(:)
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: order(:)
    integer :: first, i, last

    call list_signals(machine, signals)
    call label_signals(signals, labels)
    call argsort(labels, order)
    do i = 2, size(order)
      if (labels(order(i - 1))%text /= labels(order(i))%text) cycle
      first = owner(input, signals(order(i - 1)))
      last = owner(input, signals(order(i)))
      call raise(error, exit_input, input%location(max(first, last), 'name') // ': its column ' // &
                 quoted(labels(order(i))%text) // ' would have the label of one of ' // input%label(min(first, last)) // &
                 '; allowed: another name')
      return
    end do
  end subroutine refuse_equal_labels

  !> The group of the input that a signal belongs to. Engines and cranks have elements whose names begin with theirs.
  integer function owner(input, signal) result(group)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signal

    do group = size(input%groups), 1, -1
      if (input%groups(group)%kind == signal%element_kind .and. input%groups(group)%name == signal%element) return
    end do
    do group = size(input%groups), 2, -1
      if (input%groups(group)%name /= '' .and. index(signal%element, input%groups(group)%name) == 1) return
    end do
  end function owner

end module nocdyn_label_checks
