!> Reads the number of turning points of a signal and the points, and writes range, mean and weight of each cycle.
program rainflow_cycles
  use nocdyn_cycle_lists, only: cycle_list_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  type(cycle_list_t) :: list
  real(wp), allocatable :: points(:)
  integer :: i, n

  read (*, *) n
  allocate (points(n))
  read (*, *) points
  call list%count_all(points)
  do i = 1, list%count
    write (*, '(3es25.16)') list%range(i), list%mean(i), list%weight(i)
  end do
end program rainflow_cycles
