!> What &run says of an integration.
module nocdyn_run_settings
  use nocdyn_input, only: group_t, input_t
  use nocdyn_integration_settings, only: integration_settings_t
  implicit none (type, external)
  private

  public :: settings_of

contains

  !> The settings of a run with a method, which is that of the input or what 'auto' has become.
  pure function settings_of(input, method) result(settings)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: method
    type(integration_settings_t) :: settings
    type(group_t) :: run

    run = input%single('run')
    settings%method = method
    settings%rtol = run%number('rtol')
    settings%atol = run%number('atol')
    settings%max_steps = run%whole_number('max_steps')
  end function settings_of

end module nocdyn_run_settings
