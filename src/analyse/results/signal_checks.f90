!> Checks that need the signals of a machine: two with one name, of which what asks for one would get the other, and limits or
!> measurements of quantities that there are not.
module nocdyn_signal_checks
  use nocdyn_errors, only: add_error, error_t, exit_input, raise
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_limit_groups, only: limited_kind
  use nocdyn_machine, only: machine_t
  use nocdyn_measured_signals, only: check_measured_signals
  use nocdyn_signals, only: find_signal, label_signals, list_signals, signal_t
  use nocdyn_text, only: append, joined, quoted, string_t
  use nocdyn_text_sort, only: argsort
  implicit none (type, external)
  private

  public :: check_signals

contains

  !> Refuses an input whose signals have one label twice, or which limits or measures others.
  subroutine check_signals(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error   !! names file, line, group and key
    type(signal_t), allocatable :: signals(:)
    type(diagnostics_t) :: diagnostics
    type(error_t), allocatable :: own

    call list_signals(machine, signals)
    call refuse_equal_labels(input, signals, error)
    call refuse_unknown_quantities(input, signals, own)
    call add_error(error, own)
    call check_measured_signals(input, signals, diagnostics)
    call input%refuse(diagnostics, error)
  end subroutine check_signals

  !> Refuses limits of quantities that their elements do not have.
  subroutine refuse_unknown_quantities(input, signals, error)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: own
    type(string_t), allocatable :: known(:)
    integer, allocatable :: limits(:)
    character(len=:), allocatable :: kind, name
    integer :: i, k

    allocate (limits, source=input%groups_named('limit'))
    do i = 1, size(limits)
      if (.not. input%groups(limits(i))%has_value('quantity')) cycle
      kind = trim(limited_kind(input%groups(limits(i))))
      name = input%groups(limits(i))%text(kind)
      if (find_signal(signals, kind, name, input%groups(limits(i))%text('quantity')) > 0) cycle
      allocate (known(0))
      do k = 1, size(signals)
        if (signals(k)%element_kind /= kind .or. signals(k)%element /= name .or. signals(k)%point /= '') cycle
        call append(known, signals(k)%symbol)
      end do
      if (size(known) > 0) then   ! else the load case lacks the element
        call raise(own, exit_input, input%location(limits(i), 'quantity') // ': ' // kind // ' ' // quoted(name) // &
                   ' has no quantity ' // quoted(input%groups(limits(i))%text('quantity')) // '; allowed: ' // &
                   joined(known, ', '))
        call add_error(error, own)
      end if
      deallocate (known)
    end do
  end subroutine refuse_unknown_quantities

  !> Refuses names by which two signals of a machine have the same label, as the ones of a shaft 's' and of a coupling 's_1' have.
  subroutine refuse_equal_labels(input, signals, error)
    type(input_t), intent(in) :: input
    type(signal_t), intent(in) :: signals(:)
    type(error_t), allocatable, intent(out) :: error   !! names file, line and group of the one that comes last
    type(string_t), allocatable :: labels(:)
    integer, allocatable :: order(:)
    integer :: first, i, last

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

end module nocdyn_signal_checks
