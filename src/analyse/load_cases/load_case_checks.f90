!> What is wrong with the values of a load case, before any of them is run.
module nocdyn_load_case_checks
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_machine_parts, only: check_groups
  use nocdyn_output_times, only: check_output_times
  implicit none (type, external)
  private

  public :: check_load_case, name_load_case

contains

  !> Refuses values that do not fit together; the message names the load case.
  subroutine check_load_case(input, error)
    type(input_t), intent(in) :: input   !! of the load case
    type(error_t), allocatable, intent(out) :: error

    call check_groups(input, error)
    if (.not. allocated(error)) call check_output_times(input, error)
    if (allocated(error)) call name_load_case(input, error)
  end subroutine check_load_case

  !> Begins a message with the load case, unless it tells of a value that the load case sets.
  subroutine name_load_case(input, error)
    type(input_t), intent(in) :: input   !! of the load case
    type(error_t), intent(inout) :: error

    if (index(error%message, ": &load_case '" // input%load_case%name // "': ") > 0) return
    error%message = input%shown_case() // ': ' // error%message
  end subroutine name_load_case

end module nocdyn_load_case_checks
