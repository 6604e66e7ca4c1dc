!> Coefficients of the motion of elements in groups of 32 lanes.
module nocdyn_wide_series
  use nocdyn_kinds, only: wp
  use nocdyn_laws, only: wide
  use nocdyn_series_terms, only: by_speed, by_speed_squared, constant, cubic, has_angle, has_cubic, has_forcing, &
    has_history, has_square, linear
  implicit none (type, external)
  private

  public :: begin_motion, find_values, find_moments, accelerate, multiply_group

  integer, parameter :: w = wide   !! numbers of a group

contains

  include 'series_kernel.inc'

end module nocdyn_wide_series
