!> Rows of order, amplitude and phase, perhaps at several speeds and loads: from the lists of a group to harmonics over the speed.
module nocdyn_harmonic_tables
  use nocdyn_input, only: group_t
  use nocdyn_kinds, only: wp
  use nocdyn_order_excitations, only: order_torque_t
  use nocdyn_text, only: counted, to_text
  use nocdyn_written_values, only: written_element, written_number, written_unit
  implicit none (type, external)
  private

  public :: find_table_obstacle, table_torque, distinct

  ! More than any table of an engine has: the law of a cylinder has a formula for each order and segment between speeds.
  integer, parameter :: most_rows = 20000, most_orders = 200, most_numbers = 5000

contains

  !> What is wrong with the rows of a group, '' if nothing is.
  pure subroutine find_table_obstacle(group, key, text)
    type(group_t), intent(in) :: group                       !! &engine or &excitation, with orders
    character(len=:), allocatable, intent(out) :: key, text   !! which key is wrong, and what about it, '' if nothing
    real(wp), allocatable :: load(:), order(:), phase(:), speed(:)
    integer :: i

    key = 'orders'
    text = ''
    call take_rows(group, order, speed, load)
    if (size(order) > most_rows) then
      text = to_text(size(order)) // ' rows of orders; allowed: at most ' // to_text(most_rows)
      return
    end if
    allocate (phase, source=group%numbers('phases'))
    do i = 1, size(order)
      if (order(i) > 0 .or. i > size(phase)) cycle
      if (abs(phase(i)) > 0) text = 'orders(' // to_text(i) // ') = 0 is a mean, and ' // &
                                    written_element(group, 'phases', i) // '; needed: the phase 0'
    end do
    if (text == '') call find_gap(group, order, speed, load, text)
  end subroutine find_table_obstacle

  !> Which order does not have one row at each speed and load, '' if all have.
  pure subroutine find_gap(group, order, speed, load, text)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: order(:), speed(:), load(:)   !! of the rows
    character(len=:), allocatable, intent(out) :: text
    real(wp), allocatable :: loads(:), orders(:), speeds(:)
    integer :: i, j, k, n

    text = ''
    allocate (orders, source=distinct(order))
    allocate (speeds, source=distinct(speed))
    allocate (loads, source=distinct(load))
    if (size(orders) > most_orders .or. size(orders) > most_numbers / size(speeds)) then
      text = to_text(size(orders)) // ' orders at ' // counted(size(speeds), 'speed', 'speeds') // '; allowed: at most ' // &
             to_text(most_orders) // ' orders, and ' // to_text(most_numbers) // ' orders times speeds'
      return
    end if
    do k = 1, size(loads)
      do j = 1, size(speeds)
        do i = 1, size(orders)
          if (text /= '') return
          n = count(is_same(order, orders(i)) .and. is_same(speed, speeds(j)) .and. is_same(load, loads(k)))
          if (n == 1) cycle
          text = 'order ' // to_text(orders(i)) // ' has ' // to_text(n) // ' rows'
          if (size(speeds) > 1) text = text // ' at the speed ' // written_number(group, 'speeds', speeds(j)) // &
            ' ' // written_unit(group, 'speeds')
          if (size(loads) > 1) text = text // ' at the load ' // to_text(loads(k))
          text = text // '; needed: one'
          if (size(speeds) > 1 .and. size(loads) > 1) then
            text = text // ' at each speed and load'
          else if (size(speeds) > 1) then
            text = text // ' at each speed'
          else if (size(loads) > 1) then
            text = text // ' at each load'
          end if
        end do
      end do
    end do
  end subroutine find_gap

  !> Order, speed and load of each row; 0 where all rows hold for all speeds or loads.
  pure subroutine take_rows(group, order, speed, load)
    type(group_t), intent(in) :: group
    real(wp), allocatable, intent(out) :: order(:), speed(:), load(:)   !! [1], [rad/s], [1]

    order = group%numbers('orders')
    speed = group%numbers('speeds')
    if (size(speed) == 0) speed = spread(0.0_wp, 1, size(order))
    load = spread(0.0_wp, 1, size(order))
    if (group%kind /= 'engine') return
    if (size(group%numbers('loads')) > 0) load = group%numbers('loads')
  end subroutine take_rows

  elemental logical function is_same(x, y)
    real(wp), intent(in) :: x, y

    is_same = .not. abs(x - y) > 0
  end function is_same

  !> The different values of a list, ascending.
  pure function distinct(values)
    real(wp), intent(in) :: values(:)
    real(wp), allocatable :: distinct(:)
    real(wp) :: next

    allocate (distinct(0))
    if (size(values) == 0) return
    next = minval(values)
    do while (next <= maxval(values))
      distinct = [distinct, next]
      if (.not. any(values > next)) return
      next = minval(values, mask=values > next)
    end do
  end function distinct

  !> The torque of rows without obstacle, at the load `load_share` if they have several.
  pure function table_torque(group, amplitudes, phases) result(torque)
    type(group_t), intent(in) :: group                   !! &engine or &excitation, with orders
    character(len=*), intent(in) :: amplitudes, phases   !! keys of the lists; without values they are 0
    type(order_torque_t) :: torque
    real(wp), allocatable :: amplitude(:), load(:), loads(:), order(:), phase(:), speed(:)
    real(wp) :: weight
    integer :: i, j, k, row

    call take_rows(group, order, speed, load)
    allocate (amplitude, source=at_least(group%numbers(amplitudes), size(order)))
    allocate (phase, source=at_least(group%numbers(phases), size(order)))
    torque%order = distinct(pack(order, order > 0))
    torque%speed = distinct(speed)
    if (size(order) == 0) torque%speed = [0.0_wp]
    loads = distinct(load)
    allocate (torque%mean(size(torque%speed)), source=0.0_wp)
    allocate (torque%sine(size(torque%order), size(torque%speed)), source=0.0_wp)
    allocate (torque%cosine, source=torque%sine)
    allocate (torque%square_order(0), torque%square_sine(0), torque%square_cosine(0))
    do row = 1, size(order)
      k = findloc(is_same(loads, load(row)), .true., dim=1)
      weight = 1.0_wp
      if (size(loads) > 1) weight = weight_of(loads, k, group%number('load_share'))
      j = findloc(is_same(torque%speed, speed(row)), .true., dim=1)
      if (order(row) > 0) then
        i = findloc(is_same(torque%order, order(row)), .true., dim=1)
        torque%sine(i, j) = torque%sine(i, j) + weight * amplitude(row) * cos(phase(row))
        torque%cosine(i, j) = torque%cosine(i, j) + weight * amplitude(row) * sin(phase(row))
      else
        torque%mean(j) = torque%mean(j) + weight * amplitude(row)
      end if
    end do
  end function table_torque

  !> A list, or as many zeros if it is empty.
  pure function at_least(list, count)
    real(wp), intent(in) :: list(:)
    integer, intent(in) :: count
    real(wp) :: at_least(count)

    at_least = 0.0_wp
    if (size(list) == count) at_least = list
  end function at_least

  !> Weight of point k in the linear interpolation between ascending points.
  pure real(wp) function weight_of(points, k, x) result(weight)
    real(wp), intent(in) :: points(:)
    integer, intent(in) :: k
    real(wp), intent(in) :: x   !! not outside the points

    weight = 0.0_wp
    if (is_same(x, points(k))) weight = 1.0_wp
    if (k > 1) then
      if (x < points(k) .and. x > points(k - 1)) weight = (x - points(k - 1)) / (points(k) - points(k - 1))
    end if
    if (k < size(points)) then
      if (x > points(k) .and. x < points(k + 1)) weight = (points(k + 1) - x) / (points(k + 1) - points(k))
    end if
  end function weight_of

end module nocdyn_harmonic_tables
