!> The keys of &run, as settings of the integrator and in summaries.
module nocdyn_run_settings
  use nocdyn_input, only: group_t, input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_json, only: json_t
  implicit none (type, external)
  private

  public :: settings_of, put_settings

contains

  !> The settings of an integration with a method.
  pure function settings_of(input, method) result(settings)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: method   !! of `choose_method`
    type(integration_settings_t) :: settings
    type(group_t) :: run

    run = input%single('run')
    settings%method = method
    settings%rtol = run%number('rtol')
    settings%atol = run%number('atol')
    settings%max_steps = run%whole_number('max_steps')
  end function settings_of

  !> Writes the keys of &run that describe the integration, with their values.
  subroutine put_settings(json, run)
    type(json_t), intent(inout) :: json
    type(group_t), intent(in) :: run
    character(len=*), parameter :: keys(*) = &
      [character(len=11) :: 't_start', 't_end', 'method', 'rtol', 'atol', 'formulation', 'complement', 'max_steps']
    integer :: i, k

    call json%open('settings')
    do i = 1, size(keys)
      k = run%key_position(trim(keys(i)))
      if (allocated(run%values(k)%numbers)) then
        call json%put(trim(keys(i)), run%values(k)%numbers(1))
      else if (allocated(run%values(k)%whole_numbers)) then
        call json%put(trim(keys(i)), run%values(k)%whole_numbers(1))
      else
        call json%put(trim(keys(i)), run%values(k)%texts(1)%text)
      end if
    end do
    call json%close()
  end subroutine put_settings

end module nocdyn_run_settings
