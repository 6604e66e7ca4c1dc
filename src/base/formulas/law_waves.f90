!> How a law oscillates while the time and the angles advance evenly: its waves, which are sines of sums of multiples of them; how
!> fast they are, which harmonics they are at constant speeds, and the law without them.
module nocdyn_law_waves
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: apply, expression_t, literal, operator(*), operator(+), operator(-)
  use nocdyn_law_functions, only: cos, sin, size_of
  use nocdyn_law_points, only: law_point_t
  use nocdyn_law_tape, only: at_phase, law_inputs_t, law_node_t, law_tape_t, op_add, op_angle, op_cosine, op_fixed, &
    op_harmonics, op_is_zero, op_multiply, op_reciprocal, op_scale, op_shift, op_sine, op_subtract, op_time, op_wave
  use nocdyn_laws, only: law_t
  implicit none (type, external)
  private

  public :: has_waves, fastest_wave, list_waves, take_means

  character(len=*), parameter :: wrong_argument = &
    'nocdyn_law_waves: the argument of a sine that advances is a sum of a constant and multiples of the time and of angles'

  !> One harmonic of a law at constant speeds: the real part of amplitude exp(i multiple x), where x, the argument of a sine,
  !> grows by its rates from zero on.
  type, public :: law_wave_t
    complex(wp) :: amplitude = 0.0_wp
    integer :: argument = 0           !! node of x
    integer :: multiple = 1
    real(wp) :: by_time = 0.0_wp      !! rate of `multiple` x by the time [rad/s] ...
    real(wp) :: by_angle = 0.0_wp     !! ... by the angle of the element ...
    real(wp) :: by_phase = 0.0_wp     !! ... by the one of its phase
  end type law_wave_t

contains

  !> Whether a law has sines of variables.
  pure logical function has_waves(tape)
    type(law_tape_t), intent(in) :: tape
    integer :: i

    has_waves = any([(any(tape%node(i)%operation == [op_wave, op_sine, op_cosine, op_harmonics]) .and. &
                .not. tape%node(i)%is_constant, i=1, tape%count)])
  end function has_waves

  !> The largest rate of the arguments of its sines [rad/s], in which harmonics count with their largest multiple. Arguments are
  !> sums of multiples of the time and of angles; other forms do not count.
  pure real(wp) function fastest_wave(law, slot, speed) result(fastest)
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot            !! of the element, counted through all strips
    real(wp), intent(in) :: speed(:)       !! u' of the element, and of its phase if it has one [rad/s]
    integer :: i

    fastest = 0.0_wp
    do i = 1, law%tape%count
      associate (node => law%tape%node(i))
        if (node%is_constant) cycle
        select case (node%operation)
        case (op_wave, op_sine, op_cosine)
          fastest = max(fastest, abs(rate_of(law, slot, speed, node%a)))
        case (op_harmonics)
          associate (last => node%first + (node%last - node%first + 1) / 3 - 1)   ! of the multiples
            fastest = max(fastest, maxval(law%tape%list(node%first:last)) * abs(rate_of(law, slot, speed, node%a)))
          end associate
        case default
          cycle
        end select
      end associate
    end do
  end function fastest_wave

  !> The rate of a node that is a sum of multiples of the time and of angles [1/s], 0 of others. A list of all nodes would be
  !> allocated in every step.
  pure recursive real(wp) function rate_of(law, slot, speed, i) result(rate)
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot, i         !! the element; the node, of which 0 has no rate
    real(wp), intent(in) :: speed(:)

    rate = 0.0_wp
    if (i == 0) return
    associate (node => law%tape%node(i))
      if (node%is_constant) return
      select case (node%operation)
      case (op_time)
        rate = 1.0_wp
      case (op_angle)
        rate = speed(node%a)
      case (op_add)
        rate = rate_of(law, slot, speed, node%a) + rate_of(law, slot, speed, node%b)
      case (op_subtract)
        rate = rate_of(law, slot, speed, node%a) - rate_of(law, slot, speed, node%b)
      case (op_shift)
        rate = rate_of(law, slot, speed, node%a)
      case (op_scale)
        rate = rate_of(law, slot, speed, node%a) * law%constant(slot, law%column(node%b))
      case default
        rate = 0.0_wp
      end select
    end associate
  end function rate_of

  !> Which nodes advance evenly with the time and the angles that turn, and which oscillate with them.
  pure subroutine find_motion(tape, turns, advances, oscillates)
    type(law_tape_t), intent(in) :: tape
    logical, intent(in) :: turns   !! whether the angle of the element does; the one of a phase always turns
    logical, intent(out) :: advances(0:), oscillates(0:)   !! [0:nodes]
    integer :: i

    advances = .false.
    oscillates = .false.
    do i = 1, tape%count
      associate (node => tape%node(i))
        select case (node%operation)
        case (op_time)
          advances(i) = .true.
        case (op_angle)
          advances(i) = turns .or. node%a == at_phase
        case (op_add, op_subtract, op_multiply, op_shift, op_scale)
          advances(i) = advances(node%a) .or. advances(node%b)
          oscillates(i) = oscillates(node%a) .or. oscillates(node%b)
        case (op_wave, op_sine, op_cosine, op_harmonics)
          oscillates(i) = advances(node%a)
        case default
          cycle
        end select
      end associate
    end do
  end subroutine find_motion

  !> Whether a node is a sine of what advances.
  pure logical function is_wave(tape, i, advances)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: i   !! node
    logical, intent(in) :: advances(0:)

    is_wave = any(tape%node(i)%operation == [op_wave, op_sine, op_cosine, op_harmonics])
    if (is_wave) is_wave = advances(tape%node(i)%a)
  end function is_wave

  !> The harmonics of the sum of some nodes: in each product one factor oscillates. The list is as long at every speed, as terms
  !> that the element lacks are not in it.
  subroutine list_waves(tape, inputs, point, results, turns, list)
    type(law_tape_t), intent(in) :: tape
    type(law_inputs_t), intent(in) :: inputs
    type(law_point_t), intent(inout) :: point   !! after `evaluate`, with the time and the angles zero
    integer, intent(in) :: results(:)           !! nodes, or 0
    logical, intent(in) :: turns                !! whether the angle of the element does
    type(law_wave_t), allocatable, intent(out) :: list(:)
    logical, dimension(0:tape%count) :: advances, oscillates
    type(law_wave_t) :: found(count_waves(tape) * size(results))
    integer :: i, k, n

    call find_motion(tape, turns, advances, oscillates)
    n = 0
    do k = 1, size(results)
      call point%differentiate(tape, results(k))
      do i = 1, results(k)
        associate (node => tape%node(i))
          if (.not. point%reaches(i) .or. node%operation <= op_fixed .or. node%is_constant) cycle
          if (oscillates(node%a) .and. (node%operation >= op_reciprocal .or. &
                                        node%operation == op_multiply .and. oscillates(node%b))) then
            error stop 'nocdyn_law_waves: functions and products of waves are no harmonics'
          end if
          if (is_wave(tape, i, advances)) call add_waves(tape, point, i, found, n)
        end associate
      end do
    end do
    do i = 1, n
      call set_rates(tape, inputs, point, found(i))
    end do
    list = pack(found(:n), abs(found(:n)%by_time) + abs(found(:n)%by_angle) + abs(found(:n)%by_phase) > 0)
  end subroutine list_waves

  !> The largest number of harmonics.
  pure integer function count_waves(tape) result(waves)
    type(law_tape_t), intent(in) :: tape
    integer :: i

    waves = 0
    do i = 1, tape%count
      associate (node => tape%node(i))
        if (any(node%operation == [op_wave, op_sine, op_cosine])) waves = waves + 1
        if (node%operation == op_harmonics) waves = waves + (node%last - node%first + 1) / 3
      end associate
    end do
  end function count_waves

  !> Adds the harmonics of a sine, after `differentiate`.
  subroutine add_waves(tape, point, i, list, n)
    type(law_tape_t), intent(in) :: tape
    type(law_point_t), intent(in) :: point
    integer, intent(in) :: i   !! its node
    type(law_wave_t), intent(inout) :: list(:)
    integer, intent(inout) :: n
    integer :: k, terms

    associate (node => tape%node(i), x => point%x)
      select case (node%operation)
      case (op_wave)
        if (.not. point%is_void(node%b)) call add(1, x(node%b), 0.0_wp)
      case (op_sine)
        call add(1, 1.0_wp, 0.0_wp)
      case (op_cosine)
        call add(1, 0.0_wp, 1.0_wp)
      case default
        terms = (node%last - node%first + 1) / 3
        do k = node%first, node%first + terms - 1
          associate (a => tape%list(k + terms), b => tape%list(k + 2 * terms))
            if (.not. (point%is_void(a) .and. point%is_void(b))) call add(tape%list(k), x(a), x(b))
          end associate
        end do
      end select
    end associate

  contains

    !> sine sin(multiple x) + cosine cos(multiple x), times the derivative of the result by the node.
    subroutine add(multiple, sine, cosine)
      integer, intent(in) :: multiple
      real(wp), intent(in) :: sine, cosine
      integer :: m

      do m = 1, n
        if (list(m)%argument == tape%node(i)%a .and. list(m)%multiple == multiple) exit
      end do
      n = max(n, m)
      list(m)%argument = tape%node(i)%a
      list(m)%multiple = multiple
      list(m)%amplitude = list(m)%amplitude + point%slope(i) * cmplx(cosine, -sine, wp)
    end subroutine add

  end subroutine add_waves

  !> Sets the rates of the argument of a harmonic, and turns the amplitude by its value at zero.
  pure subroutine set_rates(tape, inputs, point, wave)
    type(law_tape_t), intent(in) :: tape
    type(law_inputs_t), intent(in) :: inputs
    type(law_point_t), intent(inout) :: point
    type(law_wave_t), intent(inout) :: wave

    call point%differentiate(tape, wave%argument)
    associate (n => wave%multiple, slope => point%slope, angle => wave%multiple * point%x(wave%argument))
      wave%amplitude = wave%amplitude * cmplx(cos(angle), sin(angle), wp)
      if (inputs%time > 0) wave%by_time = n * slope(inputs%time)
      if (inputs%angle > 0) wave%by_angle = n * slope(inputs%angle)
      if (inputs%phase > 0) wave%by_phase = n * slope(inputs%phase)
    end associate
  end subroutine set_rates

  !> Replaces waves by their means at constant speeds: zero, unless neither the time nor an angle moves their argument.
  subroutine take_means(tape, turns)
    type(law_tape_t), target, intent(inout) :: tape
    logical, intent(in) :: turns   !! whether the angle of the element does
    logical, dimension(0:tape%count) :: advances, oscillates
    type(expression_t) :: mean
    integer :: i

    call find_motion(tape, turns, advances, oscillates)
    do i = 1, ubound(advances, 1)
      if (.not. is_wave(tape, i, advances)) cycle
      mean = mean_of_wave(tape, i, advances)
      tape%node(i) = law_node_t(operation=op_fixed, a=mean%node)
    end do
    call tape%find_dependences()
  end subroutine take_means

  !> The mean of a sine, a constant: where all rates of its argument are zero its value, else zero. The rate of harmonics is not
  !> zero.
  function mean_of_wave(tape, i, advances) result(mean)
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: i   !! node
    logical, intent(in) :: advances(0:)
    type(expression_t) :: mean
    type(expression_t) :: amplitude, rate, start
    type(law_node_t) :: node

    node = tape%node(i)
    mean = literal(tape, 0.0_wp)
    if (node%operation == op_harmonics) return
    call split(tape, node%a, advances, start, rate)
    mean = apply(mean%tape, op_is_zero, rate%node)
    if (node%operation == op_cosine) then
      mean = mean * cos(start)
    else
      mean = mean * sin(start)
    end if
    if (node%operation /= op_wave) return
    amplitude = mean
    amplitude%node = node%b
    mean = amplitude * mean
  end function mean_of_wave

  !> The part of an argument that does not advance, and the sum of the absolute rates of the other one; both are constants.
  recursive subroutine split(tape, i, advances, start, rate)
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: i   !! node
    logical, intent(in) :: advances(0:)
    type(expression_t), intent(out) :: start, rate
    type(expression_t) :: constant, other_rate, other_start
    type(law_node_t) :: node

    node = tape%node(i)
    start = literal(tape, 0.0_wp)
    rate = literal(tape, merge(1.0_wp, 0.0_wp, advances(i)))
    constant = start
    constant%node = merge(node%b, node%a, advances(i))
    select case (node%operation)
    case (op_time, op_angle)
      if (.not. advances(i)) error stop wrong_argument
    case (op_fixed)
      start = constant
    case (op_shift)
      call split(tape, node%a, advances, start, rate)
      start = start + constant
    case (op_scale)
      call split(tape, node%a, advances, start, rate)
      start = constant * start
      rate = size_of(constant) * rate
    case (op_add, op_subtract)
      call split(tape, node%a, advances, start, rate)
      call split(tape, node%b, advances, other_start, other_rate)
      if (node%operation == op_add) start = start + other_start
      if (node%operation == op_subtract) start = start - other_start
      rate = rate + other_rate
    case default
      error stop wrong_argument
    end select
  end subroutine split

end module nocdyn_law_waves
