!> The version of nocdyn and of the compiler that built it.
module nocdyn_version
  use, intrinsic :: iso_fortran_env, only: compiler_version
  implicit none (type, external)
  private

  character(len=*), parameter, public :: version = '0.2.0'   !! as in CMakeLists.txt, which a test compares
  character(len=*), parameter, public :: compiler_text = compiler_version()   !! name and version

end module nocdyn_version
