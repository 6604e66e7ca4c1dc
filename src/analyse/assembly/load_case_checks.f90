!> What is wrong with the values of an input, before anything is computed.
module nocdyn_load_case_checks
  use nocdyn_errors, only: add_error, error_t
  use nocdyn_input, only: input_t
  use nocdyn_machine_parts, only: check_groups
  use nocdyn_output_times, only: check_output_times
  implicit none (type, external)
  private

  public :: check_input, name_load_case

contains

  !> Refuses values that do not fit together: all mistakes at once. The message names the load case, if it is one.
  subroutine check_input(input, error, known)
    type(input_t), intent(in) :: input   !! of a machine or a load case
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable, intent(in), optional :: known   !! mistakes that are not told again
    type(error_t), allocatable :: own

    call check_groups(input, error)
    call check_output_times(input, own)
    call add_error(error, own)
    if (allocated(error) .and. allocated(input%load_case)) call name_load_case(input, error, known)
  end subroutine check_input

  !> Begins each line of a message with the load case, unless it tells of a value that the load case sets.
  subroutine name_load_case(input, error, known)
    type(input_t), intent(in) :: input   !! of the load case
    type(error_t), allocatable, intent(inout) :: error   !! allocated; not afterwards if all of it is known
    type(error_t), allocatable, intent(in), optional :: known   !! of which the lines are left out
    character(len=:), allocatable :: left, line, message, others
    integer :: length

    message = ''
    others = ''
    if (present(known)) then
      if (allocated(known)) others = new_line('a') // known%message // new_line('a')
    end if
    left = error%message // new_line('a')
    do while (len(left) > 0)
      length = index(left, new_line('a'))
      line = left(:length)
      left = left(length + 1:)
      if (index(others, new_line('a') // line(:scan(line, ';' // new_line('a')) - 1)) > 0) cycle   ! whatever else it suggests
      if (index(line, ": &load_case '" // input%load_case%name // "': ") == 0) line = input%shown_case() // ': ' // line
      message = message // line
    end do
    if (message == '') then
      deallocate (error)
    else
      error%message = message(:len(message) - 1)
    end if
  end subroutine name_load_case

end module nocdyn_load_case_checks
