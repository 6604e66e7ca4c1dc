!> The forced response of a machine at held speeds: for every line of excitation the complex moments and angles, and their
!> synthesis.
!>
!> At each speed the machine is linearised about its steady state. One complex band matrix is factored for each speed and line.
!> The speeds are independent of each other and are divided among threads.
module nocdyn_forced_response
  use nocdyn_dynamic_stiffness, only: dynamic_stiffness_t, new_dynamic_stiffness
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_excitation_lines, only: find_twist, line_t, line_work_t, list_sources, lost_power, new_line_work, new_lines, &
    solve_at => solve_line, source_t
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t, new_held_speeds
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_response_axes, only: response_axis_t
  use nocdyn_response_points, only: keep_points, merge_points, response_point_t
  use nocdyn_moment_forms, only: list_moment_forms, moment_form_t
  use nocdyn_rubber_states, only: has_iterated_rubber, settle_rubber
  use nocdyn_signals, only: list_signals, signal_angle, signal_t
  use nocdyn_synthesis, only: new_synthesis, synthesis_t
  use nocdyn_text, only: to_text
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  public :: new_forced_response

  real(wp), parameter :: worth_threads = 2.0e4_wp  ! coordinates of all lines and points
  real(wp), parameter :: most_values = 4.0e7_wp   ! of all speeds: 0.6 GB

  type, public :: forced_response_t
    type(machine_t) :: machine
    type(held_speeds_t) :: held
    type(response_axis_t) :: axis
    integer :: shaker = 0                              !! element whose frequency is varied at one steady state, 0: speeds are
    type(dynamic_stiffness_t) :: matrix
    type(line_t), allocatable :: lines(:)
    type(line_t), allocatable :: all_lines(:)          !! those that heat couplings, also where `lines` are only some
    type(moment_form_t), allocatable :: quantities(:)  !! that are computed: all, or the ones of `keep`
    type(signal_t), allocatable :: angles(:)           !! of the bodies, without nodes of shafts
    type(moment_form_t), allocatable :: left_out(:)    !! moments that are not computed, but compared with others
    integer, allocatable :: angle_place(:)             !! of each body among the angles that are computed, or 0, [bodies]
    type(synthesis_t) :: synthesis
    logical :: has_oscillations = .true.               !! whether these are computed, beside the steady states and frequencies
    type(modes_choice_t) :: choice                     !! of modes, for large machines
    type(response_point_t), allocatable :: points(:)   !! ascending by the size of the speed
    real(wp), allocatable :: speeds_left_out(:)        !! speeds of the grid at which there is no steady state [rad/s]
    character(len=:), allocatable :: left_out_message  !! why, at the first one
  contains
    procedure :: add_points, add_quantity, frequencies, keep, largest_left_out, solve_oscillations, speeds, values_at_a_speed
  end type forced_response_t

  !> Work space of one thread.
  type :: work_t
    type(line_work_t) :: line
    integer, allocatable :: elements(:)         !! whose moments are needed
    complex(wp), allocatable :: moment(:, :)    !! of the elements that are needed, [elements, lines]
  end type work_t

contains

  !> Prepares the response of a machine: its lines at the lowest and the highest speed, its quantities.
  subroutine new_forced_response(machine, reference, speeds, self, error, shaker)
    type(machine_t), intent(in) :: machine   !! one lane, with its periodic torques
    integer, intent(in) :: reference         !! body
    real(wp), intent(in) :: speeds(:)        !! from the lowest to the highest one [rad/s]; frequencies of a shaker
    type(forced_response_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! a message of a steady state begins with its speed
    integer, intent(in), optional :: shaker  !! an element; absent or 0: none
    type(held_state_t) :: high, low
    type(source_t), allocatable :: of_high(:), of_low(:)
    type(signal_t), allocatable :: signals(:)
    real(wp), parameter :: beside = 1.01_wp   ! a second speed, which tells orders from frequencies
    real(wp), parameter :: unexcited = 1.0e100_wp   ! [rad/s]: no stiffness is large
    integer :: b
    real(wp) :: lowest   ! frequency [rad/s]

    self%machine = machine
    if (present(shaker)) self%shaker = shaker
    self%axis%is_frequency = self%shaker > 0
    call new_held_speeds(machine, reference, self%held, error, is_free=self%shaker > 0)
    if (allocated(error)) return
    if (size(speeds) > 1) then
      call hold_first(self%held, speeds(size(speeds):1:-1), high, error)
    else
      call self%held%hold(beside * speeds(1), high, error)
    end if
    if (.not. allocated(error)) call hold_first(self%held, speeds, low, error)
    if (allocated(error)) return
    call list_sources(machine, low, of_low, self%shaker)
    call list_sources(machine, high, of_high, self%shaker)
    call new_lines(of_low, of_high, self%lines)
    self%all_lines = self%lines
    lowest = minval([unexcited, of_low%frequency], mask=[.true., of_low%frequency > 0])
    call new_dynamic_stiffness(machine, self%held%balance%incidence, lowest, &
                               max(abs(low%slopes%stiffness) + lowest * abs(low%slopes%damping), &
                                   abs(high%slopes%stiffness) + lowest * abs(high%slopes%damping)), self%matrix, error)
    if (allocated(error)) return
    call list_moment_forms(machine, reference, self%quantities)
    call list_signals(machine, signals)
    self%angles = pack(signals, signals%source%kind == signal_angle .and. &
                       signals%source%index <= machine%bodies - machine%nodes)
    self%angle_place = [(b, b=1, machine%bodies)]
    allocate (self%points(0), self%speeds_left_out(0), self%left_out(0))
  end subroutine new_forced_response

  !> Computes only some of the quantities, and the angles of some bodies. The angles that powers need are among them.
  subroutine keep(self, quantities, bodies)
    class(forced_response_t), intent(inout) :: self
    logical, intent(in) :: quantities(:)   !! [quantities]
    logical, intent(in) :: bodies(:)       !! [bodies]
    integer :: b, q
    logical :: is_needed(size(bodies))

    self%quantities = self%quantities(pack([(q, q=1, size(quantities))], quantities))
    is_needed = bodies
    do q = 1, size(self%quantities)
      if (self%quantities(q)%source%body > 0) is_needed(self%quantities(q)%source%body) = .true.
    end do
    self%angle_place = unpack([(b, b=1, count(is_needed))], is_needed, 0)
  end subroutine keep

  !> Adds a quantity, before oscillations are computed.
  subroutine add_quantity(self, quantity)
    class(forced_response_t), intent(inout) :: self
    type(moment_form_t), intent(in) :: quantity

    self%quantities = [self%quantities, quantity]
    associate (body => quantity%source%body)
      if (body == 0) return
      if (self%angle_place(body) == 0) self%angle_place(body) = maxval(self%angle_place) + 1
    end associate
  end subroutine add_quantity

  !> The first of some speeds that has a steady state. Twists that are found at none of several speeds are sought no longer.
  subroutine hold_first(held, speeds, state, error)
    type(held_speeds_t), intent(inout) :: held
    real(wp), intent(in) :: speeds(:)   !! [rad/s]
    type(held_state_t), intent(out) :: state
    type(error_t), allocatable, intent(out) :: error   !! of the first one, if none has
    type(error_t), allocatable :: another
    integer, parameter :: most = 10   ! speeds without twists
    integer :: i, lacking

    call held%hold(speeds(1), state, error)
    if (.not. allocated(error)) return
    lacking = 0
    do i = 2, size(speeds)
      if (held%lacks_twists) lacking = lacking + 1
      if (lacking >= most) return
      call held%hold(speeds(i), state, another)
      if (allocated(another)) cycle
      deallocate (error)
      return
    end do
  end subroutine hold_first

  !> Computes the response at more speeds, and puts it between the others. Speeds without a steady state are left out, unless all
  !> are.
  subroutine add_points(self, speeds, are_of_grid, error, failed_speed, only_states)
    class(forced_response_t), intent(inout) :: self
    real(wp), intent(in) :: speeds(:)        !! of the reference body [rad/s]
    logical, intent(in) :: are_of_grid
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(out) :: failed_speed    !! at which there is no steady state; set with `error`
    logical, intent(in), optional :: only_states   !! whether the oscillations wait for `solve_oscillations`
    type(response_point_t), allocatable :: new(:)
    integer :: i
    logical :: has_state(size(speeds)), is_complete

    failed_speed = 0.0_wp
    call refuse_too_many(self, size(speeds), are_of_grid, error)
    if (allocated(error)) then
      failed_speed = speeds(1)
      return
    end if
    allocate (new(size(speeds)))
    do i = 1, size(speeds)
      new(i)%is_of_grid = are_of_grid
      allocate (new(i)%state)
      call self%held%hold(speeds(i), new(i)%state, error)
      has_state(i) = .not. allocated(error)
      if (has_state(i)) cycle
      if (.not. are_of_grid) cycle
      if (size(self%speeds_left_out) == 0) self%left_out_message = error%message
      self%speeds_left_out = [self%speeds_left_out, speeds(i)]
    end do
    if (size(self%points) == 0 .and. .not. any(has_state)) then
      failed_speed = speeds(1)
      return
    end if
    if (allocated(error)) deallocate (error)
    call keep_points(new, has_state)
    do i = 1, size(new)
      call set_lines(self, new(i))
    end do
    if (has_iterated_rubber(self%machine)) call settle_points(self, new)
    is_complete = .not. self%has_oscillations
    if (present(only_states)) is_complete = is_complete .or. only_states
    if (.not. is_complete) call solve_points(self, new)
    call merge_points(self%points, new)
  end subroutine add_points

  !> Computes the oscillations at all points, which have their states only.
  subroutine solve_oscillations(self)
    class(forced_response_t), intent(inout) :: self
    type(response_point_t), allocatable :: points(:)

    call move_alloc(self%points, points)
    call solve_points(self, points)
    call move_alloc(points, self%points)
  end subroutine solve_oscillations

  !> Amplitudes that are kept of each speed.
  pure real(wp) function values_at_a_speed(self) result(values)
    class(forced_response_t), intent(in) :: self

    values = real(size(self%lines), wp)
    if (self%has_oscillations) values = values * (size(self%quantities) + maxval(self%angle_place))
    values = max(1.0_wp, values)
  end function values_at_a_speed

  !> Refuses more numbers than memory and files should have.
  subroutine refuse_too_many(self, speeds, are_of_grid, error)
    type(forced_response_t), intent(in) :: self
    integer, intent(in) :: speeds       !! that are added
    logical, intent(in) :: are_of_grid
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: of_state = 6.0_wp   ! complex numbers of each element in a steady state
    character(len=:), allocatable :: advice

    associate (each => self%values_at_a_speed() + of_state * self%machine%elements%count, all => size(self%points) + speeds)
      if (each * all <= most_values) return
      if (are_of_grid .and. 2 * each <= most_values) then
        advice = 'allowed: at most count = ' // to_text(int(most_values / each)) // ', fewer orders or fewer signals'
      else
        advice = 'allowed: fewer orders, fewer signals or a shorter range of ' // self%axis%plural()
      end if
      call raise(error, exit_input, 'the response of ' // to_text(size(self%lines)) // ' orders and frequencies at ' // &
                 to_text(all) // ' ' // self%axis%plural() // ' is ' // to_text(nint(each * all / 1.0e6_wp)) // &
                 ' million numbers; at most ' // to_text(nint(most_values / 1.0e6_wp)) // ' million are kept; ' // advice)
    end associate
  end subroutine refuse_too_many

  !> Finds the conditions of rubber couplings at all points, by threads.
  subroutine settle_points(self, points)
    type(forced_response_t), intent(in) :: self
    type(response_point_t), intent(inout) :: points(:)
    type(line_work_t) :: work
    integer :: i

    !$omp parallel private(work) if (size(points) > 1)
    work = new_line_work(self%machine, self%matrix)
    !$omp do schedule(dynamic, 4)
    do i = 1, size(points)
      call settle_rubber(self%machine, self%matrix, self%all_lines, points(i), work)
    end do
    !$omp end do
    deallocate (work%stiffness, work%series)
    !$omp end parallel
  end subroutine settle_points

  !> Solves at all points, by threads. They wait for each other longer than they compute few points.
  subroutine solve_points(self, points)
    type(forced_response_t), intent(in) :: self
    type(response_point_t), intent(inout) :: points(:)
    type(work_t) :: work
    integer :: i

    if (real(size(points), wp) * size(self%lines) * self%matrix%coordinates < worth_threads) then
      call prepare_work(self, self%quantities, work)
      do i = 1, size(points)
        call solve_point(self, points(i), work)
      end do
      return
    end if
    !$omp parallel private(work)
    call prepare_work(self, self%quantities, work)
    !$omp do schedule(dynamic, 4)
    do i = 1, size(points)
      call solve_point(self, points(i), work)
    end do
    !$omp end do
    deallocate (work%elements, work%moment, work%line%stiffness, work%line%series)
    !$omp end parallel
  end subroutine solve_points

  subroutine prepare_work(self, quantities, work)
    type(forced_response_t), intent(in) :: self
    type(moment_form_t), intent(in) :: quantities(:)   !! that are computed
    type(work_t), intent(out) :: work
    integer :: e, q
    logical :: is_needed(self%machine%elements%count)

    is_needed = .false.
    do q = 1, size(quantities)
      is_needed(quantities(q)%elements) = .true.
    end do
    work%line = new_line_work(self%machine, self%matrix)
    work%elements = pack([(e, e=1, size(is_needed))], is_needed)
    allocate (work%moment(size(is_needed), size(self%lines)), source=(0.0_wp, 0.0_wp))
  end subroutine prepare_work

  !> The harmonics in a steady state, and the frequencies of the lines.
  subroutine set_lines(self, point)
    type(forced_response_t), intent(in) :: self
    type(response_point_t), intent(inout) :: point
    integer :: l

    call list_sources(self%machine, point%state, point%sources, self%shaker)
    point%frequency = [(point%sources(self%lines(l)%source(1))%frequency, l=1, size(self%lines))]
  end subroutine set_lines

  !> Solves for every line at one speed.
  subroutine solve_point(self, point, work)
    type(forced_response_t), intent(in) :: self
    type(response_point_t), intent(inout) :: point
    type(work_t), intent(inout) :: work
    integer :: l, q

    associate (lines => size(self%lines), quantities => size(self%quantities))
      allocate (point%quantity(lines, quantities), point%angle(lines, maxval(self%angle_place)))
      allocate (point%heat(self%machine%elements%count), source=0.0_wp)
      allocate (point%mean(quantities), point%lowest(quantities), point%highest(quantities))
      do l = 1, lines
        call solve_line(self, l, point, work)
      end do
      do q = 1, quantities
        call find_quantity(self, q, point, work)
      end do
    end associate
  end subroutine solve_point

  !> One quantity of all lines, and its synthesis. If it has several points, they are the ones of the point with the largest half
  !> range.
  pure subroutine find_quantity(self, q, point, work)
    type(forced_response_t), intent(in) :: self
    integer, intent(in) :: q
    type(response_point_t), intent(inout) :: point
    type(work_t), intent(in) :: work
    complex(wp) :: amplitude(size(self%lines))
    real(wp) :: highest, lowest, mean
    integer :: p

    associate (one => self%quantities(q))
      do p = 1, size(one%weight, 1)
        amplitude = amplitudes(one, p, work)
        mean = sum(one%weight(p, :) * point%state%mean(one%elements)) + one%by_held_torque * point%state%torque
        if (one%source%body > 0) then   ! a power, to the first order
          associate (speed => point%state%omega(one%source%body), angle => point%angle(:, self%angle_place(one%source%body)))
            amplitude = speed * amplitude + mean * (0.0_wp, 1.0_wp) * point%frequency * angle
            mean = mean * speed
          end associate
        end if
        call self%synthesis%extremes(amplitude, lowest, highest)
        if (p > 1) then
          if (highest - lowest <= point%highest(q) - point%lowest(q)) cycle
        end if
        point%quantity(:, q) = amplitude
        point%lowest(q) = lowest
        point%highest(q) = highest
        point%mean(q) = mean
      end do
    end associate
  end subroutine find_quantity

  !> The largest half range of the moments in `left_out` at a speed. The sum of its amplitudes bounds each.
  real(wp) function largest_left_out(self, point) result(largest)
    class(forced_response_t), intent(in) :: self
    type(response_point_t), intent(in) :: point
    type(response_point_t) :: again
    type(work_t) :: work
    real(wp) :: bound(size(self%left_out)), highest, lowest
    integer :: l, p, q

    call prepare_work(self, self%left_out, work)
    again = point
    do l = 1, size(self%lines)
      call solve_line(self, l, again, work)
    end do
    do q = 1, size(bound)
      bound(q) = maxval([(sum(abs(amplitudes(self%left_out(q), p, work))), p=1, size(self%left_out(q)%weight, 1))])
    end do
    largest = 0.0_wp
    do while (any(bound > largest))
      q = maxloc(bound, dim=1)
      do p = 1, size(self%left_out(q)%weight, 1)
        call self%synthesis%extremes(amplitudes(self%left_out(q), p, work), lowest, highest)
        largest = max(largest, 0.5_wp * (highest - lowest))
      end do
      bound(q) = 0.0_wp
    end do
  end function largest_left_out

  !> A quantity at one of its points, without the speed of a power.
  pure function amplitudes(quantity, point, work)
    type(moment_form_t), intent(in) :: quantity
    integer, intent(in) :: point
    type(work_t), intent(in) :: work
    complex(wp) :: amplitudes(size(work%moment, 2))
    integer :: l

    do l = 1, size(amplitudes)
      amplitudes(l) = quantity%total(point, work%moment(:, l))
    end do
  end function amplitudes

  !> Moments, angles and heat of one line.
  pure subroutine solve_line(self, l, point, work)
    type(forced_response_t), intent(in) :: self
    integer, intent(in) :: l
    type(response_point_t), intent(inout) :: point
    type(work_t), intent(inout) :: work
    complex(wp) :: twist
    integer :: e, i

    associate (frequency => point%frequency(l), sources => point%sources, line => self%lines(l))
      call solve_at(self%machine, self%matrix, point%state%slopes, frequency, sources(line%source), work%line)
      work%moment(:, l) = (0.0_wp, 0.0_wp)
      do i = 1, size(work%elements)
        e = work%elements(i)
        call find_twist(self%matrix, e, work%line, twist, work%moment(e, l))
        point%heat(e) = point%heat(e) + lost_power(frequency, work%line%stiffness(e), twist)
      end do
      do i = 1, size(line%source)
        associate (source => sources(line%source(i)))
          if (source%is_twist) cycle
          work%moment(source%element, l) = work%moment(source%element, l) + source%moment
        end associate
      end do
      call set_angles(self, work, point%angle(l, :))
    end associate
  end subroutine solve_line

  !> The angles of the bodies that are kept.
  pure subroutine set_angles(self, work, angle)
    type(forced_response_t), intent(in) :: self
    type(work_t), intent(in) :: work
    complex(wp), intent(out) :: angle(:)   !! [rad], [bodies that are kept]
    integer :: b, k

    angle = (0.0_wp, 0.0_wp)
    associate (map => self%machine%coordinates, place => self%angle_place)
      do b = 1, size(place)
        if (place(b) == 0) cycle
        do k = map%first(b), map%first(b + 1) - 1
          angle(place(b)) = angle(place(b)) + map%ratio(1, k) * work%line%band%x(self%matrix%position(map%coordinate(k)))
        end do
      end do
    end associate
  end subroutine set_angles

  !> Speeds of the reference body at all points [rad/s].
  pure function speeds(self)
    class(forced_response_t), intent(in) :: self
    real(wp) :: speeds(size(self%points))
    integer :: i

    do i = 1, size(speeds)
      speeds(i) = self%points(i)%state%speed
    end do
  end function speeds

  !> Frequencies of the lines at all points [rad/s], [lines, points].
  pure function frequencies(self)
    class(forced_response_t), intent(in) :: self
    real(wp) :: frequencies(size(self%lines), size(self%points))
    integer :: i

    do i = 1, size(self%points)
      frequencies(:, i) = self%points(i)%frequency
    end do
  end function frequencies

end module nocdyn_forced_response
