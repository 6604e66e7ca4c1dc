!> The settings of an integration.
module nocdyn_integration_settings
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: check_settings

  integer, parameter :: most_steps = 100000000   !! so that the number of evaluations fits a default integer

  type, public :: integration_settings_t
    character(len=16) :: method = 'auto'            !! one of `method_names`
    real(wp) :: rtol = 1.0e-6_wp                    !! relative tolerance, at least epsilon(1.0_wp), below 1
    real(wp) :: atol = 1.0e-9_wp                    !! absolute tolerance, positive
    real(wp) :: first_step = 0.0_wp                 !! 0 if it is to be found automatically
    real(wp) :: longest_step = huge(1.0_wp)
    integer :: max_steps = 1000000                  !! step attempts of a lane, accepted or rejected
  end type integration_settings_t

contains

  !> Checks the ranges of the values; the error names the first value outside its range.
  subroutine check_settings(settings, error)
    type(integration_settings_t), intent(in) :: settings
    type(error_t), allocatable, intent(out) :: error   !! allocated if a value is outside its range

    if (.not. (settings%rtol >= epsilon(1.0_wp) .and. settings%rtol < 1)) then
      call refuse('rtol', to_text(settings%rtol), 'at least ' // to_text(epsilon(1.0_wp)) // ' and less than 1', error)
    else if (.not. (settings%atol > 0 .and. settings%atol <= huge(1.0_wp))) then
      call refuse('atol', to_text(settings%atol), 'positive', error)
    else if (.not. (settings%first_step >= 0 .and. settings%first_step <= huge(1.0_wp))) then
      call refuse('first_step', to_text(settings%first_step), 'positive, or 0 to have it found', error)
    else if (.not. settings%longest_step > 0) then
      call refuse('longest_step', to_text(settings%longest_step), 'positive', error)
    else if (settings%max_steps < 1 .or. settings%max_steps > most_steps) then
      call refuse('max_steps', to_text(settings%max_steps), 'between 1 and ' // to_text(most_steps), error)
    end if
  end subroutine check_settings

  !> Raises the error about one value.
  subroutine refuse(name, value, allowed, error)
    character(len=*), intent(in) :: name, value, allowed
    type(error_t), allocatable, intent(out) :: error

    call raise(error, exit_input, name // ' = ' // value // ' is not allowed: it must be ' // allowed)
  end subroutine refuse

end module nocdyn_integration_settings
