!> The one real kind of nocdyn.
module nocdyn_kinds
  use, intrinsic :: iso_fortran_env, only: real64
  implicit none (type, external)
  private

  integer, parameter, public :: wp = real64   !! working precision, IEEE double as LAPACK's D routines

end module nocdyn_kinds
