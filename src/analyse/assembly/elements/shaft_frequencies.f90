!> The highest frequency up to which shafts have to be those of the continuum.
module nocdyn_shaft_frequencies
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: highest_frequency

  integer, parameter :: least_modes = 4   ! that are exact where nothing else is asked for
  real(wp), parameter :: reserve = 1.2_wp

contains

  !> 1.2 times that of the highest order at the highest speed of &response; where there are no orders, the fourth lowest of the
  !> frequencies n pi c / length of all shafts between fixed ends [rad/s].
  real(wp) function highest_frequency(input) result(frequency)
    type(input_t), intent(in) :: input
    integer, allocatable :: indices(:)
    real(wp), allocatable :: frequencies(:)
    integer :: i, n

    allocate (indices, source=input%groups_named('response'))
    frequency = 0.0_wp
    if (size(indices) > 0) frequency = response_frequency(input, input%groups(indices(1)))
    if (frequency > 0.0_wp) return
    deallocate (indices)
    allocate (indices, source=input%groups_named('shaft'))
    allocate (frequencies(0))
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        if (.not. group%number('density') > 0) cycle
        frequency = acos(-1.0_wp) * sqrt(group%number('shear_modulus') / group%number('density')) / sum(group%numbers('lengths'))
        frequencies = [frequencies, (n * frequency, n=1, least_modes)]
      end associate
    end do
    do i = 1, min(least_modes, size(frequencies))
      n = minloc(frequencies, dim=1)
      frequency = frequencies(n)
      frequencies(n) = huge(frequency)
    end do
  end function highest_frequency

  !> 0 if no order is known.
  real(wp) function response_frequency(input, response) result(frequency)
    type(input_t), intent(in) :: input
    type(group_t), intent(in) :: response
    integer, allocatable :: engines(:), indices(:)
    real(wp) :: order
    integer :: i

    order = maxval([0.0_wp, abs(response%numbers('orders'))])
    if (.not. order > 0.0_wp) then
      allocate (indices, source=input%groups_named('excitation'))
      do i = 1, size(indices)
        associate (group => input%groups(indices(i)))
          if (group%text('kind') == 'orders') order = maxval([order, abs(group%numbers('orders'))])
        end associate
      end do
      allocate (engines, source=input%groups_named('engine'))
      do i = 1, size(engines)
        associate (group => input%groups(engines(i)))
          order = max(order, merge(maxval([0.0_wp, group%numbers('orders')]), group%number('harmonics_up_to', absent=0.0_wp), &
                                   group%has_value('orders')))
        end associate
      end do
    end if
    frequency = reserve * order * maxval(abs(response%numbers('speed')))
  end function response_frequency

end module nocdyn_shaft_frequencies
