!> The number of lanes of a block of variants.
module nocdyn_block_sizes
  use nocdyn_series_strips, only: strip
  implicit none (type, external)
  private

  public :: lanes_for

  ! Measured: chains of 10 rotors are fastest with 32 lanes, those of 100 with 8 to 32, those of 1000 with 4 to 8.
  integer, parameter :: max_states = 250   ! the parameters of `strip` lanes fit into the second-level cache
  integer, parameter :: small_block = 8   ! a multiple of the vector length of any processor

contains

  !> The number of lanes with which machines of so many states are fastest. No result depends on it.
  pure integer function lanes_for(states)
    integer, intent(in) :: states

    lanes_for = merge(strip, small_block, states <= max_states)
  end function lanes_for

end module nocdyn_block_sizes
