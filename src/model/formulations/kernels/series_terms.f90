!> Names of the numbers of polynomial laws in groups, and of the terms that they have.
module nocdyn_series_terms
  implicit none (type, external)
  private

  integer, parameter, public :: linear = 1, constant = 2, by_speed = 3, cubic = 4, by_speed_squared = 5   !! of a law
  integer, parameter, public :: rest = 6, parameters = 6

  !> Terms that the laws of a group have for some element in some lane, added up.
  integer, parameter, public :: has_angle = 1, has_cubic = 2, has_applied = 4, has_square = 8, has_forcing = 16

  !> Whether coefficients of the motion of a group are read after the next ones are known. In other groups all of them have the
  !> place of the first: less memory goes through the cache.
  integer, parameter, public :: has_history = 32

end module nocdyn_series_terms
