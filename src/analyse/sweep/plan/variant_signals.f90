!> The signals of all variants of a sweep: those of the base machine, and those that exist only with other numbers.
module nocdyn_variant_signals
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_run_settings, only: check_size
  use nocdyn_schema, only: has_word
  use nocdyn_signal_checks, only: check_signals
  use nocdyn_signals, only: label_signals, list_signals, signal_t
  use nocdyn_targets, only: set_targets, target_t
  use nocdyn_text, only: string_t
  use nocdyn_text_sort, only: argsort, sorted_position
  implicit none (type, external)
  private

  public :: list_variant_signals

  real(wp), parameter :: nonzero_value = 1.0_wp   ! instead of 0 or of no value

contains

  !> Assembles the base machine and lists its signals, then those that exist only if targets which are 0 or not given are not 0.
  subroutine list_variant_signals(input, targets, machine, signals, error)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: targets(:)
    type(machine_t), intent(out) :: machine
    type(signal_t), allocatable, intent(out) :: signals(:)
    type(error_t), allocatable, intent(out) :: error
    type(target_t), allocatable :: hidden(:)
    logical :: is_valid
    integer :: i

    call assemble_machine(input, machine, error)
    if (.not. allocated(error)) call check_size(input, machine, error)
    if (.not. allocated(error)) call check_signals(input, machine, error)
    if (allocated(error)) return
    call list_signals(machine, signals)
    allocate (hidden, source=pack(targets, [(hides_column(input, targets(i)), i=1, size(targets))]))
    if (size(hidden) == 0) return
    call add_signals(input, hidden, signals, is_valid)
    if (is_valid) return
    do i = 1, size(hidden)
      call add_signals(input, hidden(i:i), signals, is_valid)
    end do
  end subroutine list_variant_signals

  !> Whether a target is 0 or not given, and the columns of its element may depend on it.
  logical function hides_column(input, target)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target

    hides_column = .false.
    if (.not. has_word('coupling motor', input%groups(target%group)%kind)) return
    associate (value => input%groups(target%group)%values(target%key))
      hides_column = .not. value%has_any()
      if (allocated(value%numbers)) hides_column = .not. any(abs(value%numbers) > 0)
    end associate
  end function hides_column

  !> Appends the signals of the machine in which some targets are not 0, as far as that is allowed.
  subroutine add_signals(input, hidden, signals, is_valid)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: hidden(:)
    type(signal_t), allocatable, intent(inout) :: signals(:)
    logical, intent(out) :: is_valid   !! whether such a machine is valid
    type(input_t) :: changed, before
    type(machine_t) :: machine
    type(error_t), allocatable :: error
    type(signal_t), allocatable :: others(:)
    type(string_t), allocatable :: labels(:), other_labels(:)
    character(len=:), allocatable :: message
    integer, allocatable :: order(:)
    integer :: i

    changed = input
    do i = 1, size(hidden)
      before = changed
      call set_targets(changed, hidden(i:i), [nonzero_value], message)
      if (message /= '') changed = before
    end do
    call assemble_machine(changed, machine, error)
    is_valid = .not. allocated(error)
    if (.not. is_valid) return
    call list_signals(machine, others)
    call label_signals(signals, labels)
    call label_signals(others, other_labels)
    call argsort(labels, order)
    signals = [signals, pack(others, [(sorted_position(other_labels(i)%text, labels, order) == 0, i=1, size(others))])]
  end subroutine add_signals

end module nocdyn_variant_signals
