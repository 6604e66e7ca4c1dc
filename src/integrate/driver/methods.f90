!> The integration methods by their names.
module nocdyn_methods
  use nocdyn_auto_stepper, only: auto_stepper
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_explicit_stepper, only: explicit_stepper
  use nocdyn_explicit_tables, only: dormand_prince_5, dormand_prince_8
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_rosenbrock_stepper, only: rosenbrock_stepper
  use nocdyn_rosenbrock_tables, only: rodas4, rodas5p
  use nocdyn_step_costs, only: taylor_cost
  use nocdyn_stepper, only: stepper_t
  use nocdyn_system, only: system_t
  use nocdyn_taylor_stepper, only: taylor_stepper
  use nocdyn_near_words, only: nearest_word
  use nocdyn_text, only: joined, quoted, string_t, strings
  implicit none (type, external)
  private

  public :: select_method, taylor_cost

  !> The names that `select_method` accepts; 'rosenbrock' is another name of 'rodas4'.
  character(len=10), parameter, public :: method_names(7) = &
    [character(len=10) :: 'auto', 'rk45', 'rk853', 'rosenbrock', 'rodas4', 'rodas5p', 'taylor']

contains

  !> The stepper of the method in the settings, one of `method_names`, for a system.
  subroutine select_method(settings, system, stepper, error)
    type(integration_settings_t), intent(in) :: settings
    class(system_t), intent(in) :: system
    class(stepper_t), allocatable, intent(out) :: stepper
    type(error_t), allocatable, intent(out) :: error   !! allocated if there is no such method, or if it is not for the system
    character(len=:), allocatable :: obstacle
    type(string_t), allocatable :: names(:)
    integer :: i

    select case (settings%method)
    case ('auto')
      call system%series_obstacle(obstacle)
      if (len(obstacle) > 0) then
        allocate (stepper, source=auto_stepper(dormand_prince_8(), rodas5p()))
      else
        allocate (stepper, source=auto_stepper(dormand_prince_8(), rodas5p(), taylor_stepper(settings%rtol)))
      end if
    case ('rk45')
      allocate (stepper, source=explicit_stepper(dormand_prince_5()))
    case ('rk853')
      allocate (stepper, source=explicit_stepper(dormand_prince_8()))
    case ('rosenbrock', 'rodas4')
      allocate (stepper, source=rosenbrock_stepper(rodas4()))
    case ('rodas5p')
      allocate (stepper, source=rosenbrock_stepper(rodas5p()))
    case ('taylor')
      call system%series_obstacle(obstacle)
      if (len(obstacle) > 0) call raise(error, exit_input, "method 'taylor' cannot be used: " // obstacle)
      allocate (stepper, source=taylor_stepper(settings%rtol))
    case default
      allocate (names, source=strings(method_names))
      i = nearest_word(trim(settings%method), names)
      call raise(error, exit_input, 'there is no integration method ' // quoted(trim(settings%method)) // &
                 '; the methods are ' // joined(names, ', '))
      if (i > 0) error%message = error%message // '. Did you mean ' // quoted(names(i)%text) // '?'
    end select
  end subroutine select_method

end module nocdyn_methods
