!> Critical speeds, where a line of excitation has a natural frequency, and the peaks of a response between the speeds of its
!> grid.
!>
!> The speeds at which the lines cross the frequencies of the damped modes are added to the speeds, so that no narrow peak is
!> missed. Then every maximum of an amplitude is refined: near a resonance 1 / |amplitude|^2 is a parabola over the speed, whose
!> vertex is the next speed. Of more maxima than a table should have, those that promise most are refined.
module nocdyn_critical_speeds
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: sort_ascending
  use nocdyn_response_points, only: response_point_t
  use nocdyn_mode_branches, only: speed_modes_t
  implicit none (type, external)
  private

  public :: find_crossings, keep_new, refine_peaks

  real(wp), parameter :: most_refined = 4.0e6_wp   ! numbers at the speeds between the ones of the grid: 0.06 GB
  real(wp), parameter, public :: undamped = 1.0e-9_wp   !! a mode with a smaller damping ratio has no finite response

  !> Where a line crosses a mode.
  type, public :: crossing_t
    integer :: mode = 0
    integer :: number = 0             !! of the mode among all of the machine
    integer :: line = 0
    real(wp) :: speed = 0.0_wp        !! of the reference body [rad/s]
    real(wp) :: frequency = 0.0_wp    !! [rad/s]
    real(wp) :: damping_ratio = 0.0_wp
    integer :: quantity = 0           !! moment of the coupling with most of the potential energy of the mode, 0: none has any;
                                      !! set where a response needs it
  end type crossing_t

  !> Where maxima are expected.
  type :: vertices_t
    integer :: count = 0
    real(wp), allocatable :: speed(:)   !! [rad/s]
    real(wp), allocatable :: gain(:)    !! of the amplitude, as a share of the largest one of the quantity
  end type vertices_t

contains

  !> All crossings between the lowest and the highest speed, by modes and lines.
  subroutine find_crossings(speed, frequency, modes, crossings)
    real(wp), intent(in) :: speed(:)            !! of the reference body [rad/s], [points]
    real(wp), intent(in) :: frequency(:, :)     !! of the lines [rad/s], [lines, points]
    type(speed_modes_t), intent(in) :: modes    !! at the points
    type(crossing_t), allocatable, intent(out) :: crossings(:)
    integer :: i, l, m
    real(wp) :: after, before, share

    allocate (crossings(0))
    do m = 1, modes%modes
      do l = 1, size(frequency, 1)
        do i = 1, size(speed) - 1
          if (.not. all(modes%exists(m, i:i + 1))) cycle
          before = frequency(l, i) - modes%frequency(m, i)
          after = frequency(l, i + 1) - modes%frequency(m, i + 1)
          if (before * after > 0 .or. (abs(after) <= 0 .and. i < size(speed) - 1)) cycle
          if (abs(before - after) <= 0) cycle
          share = before / (before - after)
          crossings = [crossings, crossing_t(m, modes%number(m), l, between(speed(i), speed(i + 1), share), &
                                             between(modes%frequency(m, i), modes%frequency(m, i + 1), share), &
                                             between(modes%damping_ratio(m, i), modes%damping_ratio(m, i + 1), share))]
        end do
      end do
    end do
  end subroutine find_crossings

  pure real(wp) function between(first, second, share)
    real(wp), intent(in) :: first, second
    real(wp), intent(in) :: share   !! 0 to 1

    between = first + share * (second - first)
  end function between

  !> Adds speeds to a response until the maxima of all amplitudes are found.
  subroutine refine_peaks(response, crossings, unrefined, error, failed_speed)
    type(forced_response_t), intent(inout) :: response
    type(crossing_t), intent(in) :: crossings(:)
    real(wp), intent(out) :: unrefined      !! by how much a maximum that was left is higher, as a share of the largest one
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(out) :: failed_speed   !! as in `add_points`
    integer, parameter :: most_rounds = 12
    real(wp), allocatable :: speeds(:)
    integer :: i, room, round

    failed_speed = 0.0_wp
    unrefined = 0.0_wp
    room = int(most_refined / response%values_at_a_speed())
    speeds = pack([(crossings(i)%speed, i=1, size(crossings))], [(crossings(i)%damping_ratio > undamped, i=1, size(crossings))])
    call keep_new(response, speeds)
    do round = 1, most_rounds
      if (size(speeds) == 0 .and. round > 1) return
      room = room - size(speeds)
      if (size(speeds) > 0) call response%add_points(speeds, .false., error, failed_speed)
      if (allocated(error)) return
      ! a third of the room: the next rounds know better which ones matter
      call find_vertices(response, crossings, max(0, room / 3), speeds, unrefined)
    end do
  end subroutine refine_peaks

  !> Sorts speeds, and drops those that the response has.
  subroutine keep_new(response, speeds)
    type(forced_response_t), intent(in) :: response
    real(wp), allocatable, intent(inout) :: speeds(:)   !! [rad/s]
    real(wp), parameter :: same = 1.0e-12_wp
    real(wp) :: known(size(response%points))
    logical :: is_new(size(speeds))
    integer :: i

    call sort_ascending(speeds)
    if (response%points(1)%state%speed < 0) speeds = speeds(size(speeds):1:-1)
    known = [(response%points(i)%state%speed, i=1, size(known))]
    do i = 1, size(speeds)
      is_new(i) = .not. any(abs(known - speeds(i)) <= same * abs(speeds(i)))
      if (i > 1) is_new(i) = is_new(i) .and. abs(speeds(i) - speeds(i - 1)) > same * abs(speeds(i))
    end do
    speeds = pack(speeds, is_new)
  end subroutine keep_new

  !> The vertices of the parabolas through the maxima and their neighbours, where they promise a higher peak.
  subroutine find_vertices(response, crossings, most, speeds, unrefined)
    type(forced_response_t), intent(in) :: response
    type(crossing_t), intent(in) :: crossings(:)
    integer, intent(in) :: most                  !! speeds
    real(wp), allocatable, intent(out) :: speeds(:)
    real(wp), intent(out) :: unrefined           !! as in `refine_peaks`
    real(wp), parameter :: counts = 1.0e-2_wp   ! of the largest amplitude of all lines: smaller ones are left as they are
    real(wp) :: largest, square(size(response%points), size(response%lines))   ! of the amplitudes
    type(vertices_t) :: vertices
    integer :: first, i, l, q

    allocate (vertices%speed(64), vertices%gain(64), speeds(0))
    unrefined = 0.0_wp
    if (size(response%points) < 3) return
    associate (points => response%points)
      do q = 1, size(response%quantities)
        do i = 1, size(points)
          square(i, :) = real(points(i)%quantity(:, q), wp)**2 + aimag(points(i)%quantity(:, q))**2
        end do
        largest = maxval(square)
        do l = 1, size(response%lines)
          do i = 1, size(points)
            if (square(i, l) < maxval(square(max(1, i - 1):min(size(points), i + 1), l)) .or. &
                .not. square(i, l) > counts**2 * largest) cycle
            first = max(1, min(i - 1, size(points) - 2))   ! of three points; the maximum may be at the end of all
            if (any(crossings%line == l .and. crossings%damping_ratio <= undamped .and. &
                crossings%speed >= min(points(first)%state%speed, points(first + 2)%state%speed) .and. &
                crossings%speed <= max(points(first)%state%speed, points(first + 2)%state%speed))) cycle
            call add_vertex(points(first:first + 2), i - first + 1, square(first:first + 2, l), sqrt(square(i, l) / largest), &
                            vertices)
          end do
        end do
      end do
    end associate
    call keep_highest(vertices, most, speeds, unrefined)
    call keep_new(response, speeds)
  end subroutine find_vertices

  !> The speeds of the maxima that promise most.
  subroutine keep_highest(vertices, most, speeds, unrefined)
    type(vertices_t), intent(in) :: vertices
    integer, intent(in) :: most
    real(wp), allocatable, intent(out) :: speeds(:)
    real(wp), intent(out) :: unrefined
    real(wp), allocatable :: gain(:)

    unrefined = 0.0_wp
    allocate (gain, source=vertices%gain(:vertices%count))
    if (size(gain) <= most) then
      allocate (speeds, source=vertices%speed(:vertices%count))
      return
    end if
    call sort_ascending(gain)
    unrefined = gain(size(gain) - most)
    speeds = pack(vertices%speed(:vertices%count), vertices%gain(:vertices%count) > unrefined)
  end subroutine keep_highest

  !> Adds the vertex of a maximum, unless it is so near that the peak grows by rounding only, or another speed is there.
  subroutine add_vertex(points, top, amplitude, share, vertices)
    type(response_point_t), intent(in) :: points(3)
    integer, intent(in) :: top             !! the maximum, of the three
    real(wp), intent(in) :: amplitude(3)   !! squares of the amplitudes
    real(wp), intent(in) :: share          !! the maximum, as a share of the largest one of the quantity
    type(vertices_t), intent(inout) :: vertices
    real(wp), parameter :: accuracy = 1.0e-5_wp   ! relative, of the square of a peak
    real(wp), parameter :: narrow = 1.0e-12_wp    ! relative distance of speeds
    real(wp), parameter :: believed = 0.5_wp      ! a parabola beside an antiresonance falls below zero
    real(wp) :: bend, distance, gain, promised, slope, vertex, x(3), y(3)
    integer :: k, others(2)

    others = pack([1, 2, 3], [1, 2, 3] /= top)
    x = [points(1)%state%speed, points(2)%state%speed, points(3)%state%speed]
    x = x - points(top)%state%speed
    y = min(amplitude(top) / max(amplitude, tiny(1.0_wp)), 1.0e12_wp)   ! 1 at the maximum
    associate (a => others(1), b => others(2))
      bend = ((y(b) - 1.0_wp) / x(b) - (y(a) - 1.0_wp) / x(a)) / (x(b) - x(a))
      slope = (y(b) - 1.0_wp) / x(b) - bend * x(b)
    end associate
    if (.not. bend > 0) return
    vertex = -0.5_wp * slope / bend
    if (top /= 2 .and. vertex * x(2) < 0) return   ! beyond the end
    gain = 0.25_wp * slope**2 / bend   ! y falls by so much
    if (gain <= accuracy .or. abs(vertex) <= narrow * abs(points(top)%state%speed)) return
    distance = sqrt(accuracy / bend)
    promised = share * (1.0_wp / sqrt(1.0_wp - min(gain, believed)) - 1.0_wp)
    associate (n => vertices%count, speed => points(top)%state%speed + vertex)
      do k = 1, n
        if (abs(vertices%speed(k) - speed) > distance) cycle
        vertices%gain(k) = max(vertices%gain(k), promised)
        return
      end do
      if (n == size(vertices%speed)) then
        vertices%speed = [vertices%speed, vertices%speed]
        vertices%gain = [vertices%gain, vertices%gain]
      end if
      n = n + 1
      vertices%speed(n) = speed
      vertices%gain(n) = promised
    end associate
  end subroutine add_vertex

end module nocdyn_critical_speeds
