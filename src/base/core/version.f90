!> The version of nocdyn and of the compiler that built it.
module nocdyn_version
  use, intrinsic :: iso_fortran_env, only: compiler_version
  implicit none (type, external)
  private

  public :: compiler_text

  character(len=*), parameter, public :: version = '0.1.0'   !! as in CMakeLists.txt, which a test compares

contains

  !> Name and version of the compiler.
  function compiler_text() result(text)
    character(len=:), allocatable :: text

    text = compiler_version()
  end function compiler_text

end module nocdyn_version
