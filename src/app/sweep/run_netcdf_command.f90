!> nocdyn run in the program that can write NetCDF.
module nocdyn_run_netcdf_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_run_command, only: run_inputs
  use nocdyn_trajectory_netcdf, only: netcdf_trajectory_t
  implicit none (type, external)
  private

  public :: run_netcdf_command

contains

  !> Runs all files.
  subroutine run_netcdf_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code   !! the highest exit code of all files

    call run_inputs(arguments, code, netcdf_trajectory_t())
  end subroutine run_netcdf_command

end module nocdyn_run_netcdf_command
