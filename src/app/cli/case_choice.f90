!> Which inputs of a file a command computes: the machine itself, its load cases, or the load case of --case.
module nocdyn_case_choice
  use nocdyn_arguments, only: arguments_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: append, quoted, shortened, string_t
  implicit none (type, external)
  private

  public :: choose_case, find_case, find_wanted, wanted_case

contains

  !> Which load cases a command computes: the one of --case, else all that are for it.
  subroutine find_wanted(arguments, machine, wanted, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: machine               !! with the load cases of its file
    integer, allocatable, intent(out) :: wanted(:)     !! of its load cases; none of a file without any
    type(error_t), allocatable, intent(out) :: error   !! there is no load case of this name, or none is for the command
    integer :: c, chosen

    call choose_case(arguments, machine, chosen, error)
    if (allocated(error)) return
    wanted = pack([(c, c=1, size(machine%load_cases))], &
                  [(chosen == c .or. (chosen == 0 .and. machine%load_cases(c)%is_for(arguments%command)), &
                    c=1, size(machine%load_cases))])
    if (size(wanted) > 0 .or. size(machine%load_cases) == 0) return
    call raise(error, exit_input, machine%shown_file() // ': no &load_case has ' // quoted(arguments%command) // &
               ' among its analyses; allowed: --case NAME, or a load case with it')
  end subroutine find_wanted

  !> The name of the only load case that is wanted, '' if it is not one alone.
  pure function wanted_case(arguments) result(name)
    type(arguments_t), intent(in) :: arguments
    character(len=:), allocatable :: name

    name = ''
    if (arguments%is_given('--case')) name = arguments%value('--case')
  end function wanted_case

  !> Finds the load case of --case; 0 without that option.
  subroutine choose_case(arguments, machine, chosen, error)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(in) :: machine   !! with the load cases of its file
    integer, intent(out) :: chosen         !! of its load cases
    type(error_t), allocatable, intent(out) :: error   !! there is none of this name

    chosen = 0
    if (arguments%is_given('--case')) call find_case(arguments%value('--case'), machine, chosen, error)
  end subroutine choose_case

  !> Finds a load case by its name.
  subroutine find_case(name, machine, chosen, error)
    character(len=*), intent(in) :: name
    type(input_t), intent(in) :: machine   !! with the load cases of its file
    integer, intent(out) :: chosen         !! of its load cases
    type(error_t), allocatable, intent(out) :: error   !! there is none of this name
    type(string_t), allocatable :: names(:)
    integer :: c

    chosen = 0
    allocate (names(0))
    do c = 1, size(machine%load_cases)
      call append(names, machine%load_cases(c)%name)
      if (names(c)%text == name) chosen = c
    end do
    if (chosen == 0) call raise(error, exit_input, machine%shown_file() // ': --case: there is no &load_case ' // &
                                quoted(shortened(name)) // suggestion(name, names))
  end subroutine find_case

end module nocdyn_case_choice
