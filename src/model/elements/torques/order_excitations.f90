!> Excitations with a mean and harmonics of the angle u of their body that follow its speed: the cylinders of engines.
!>
!> The torque is M + sum of S sin(order u) + C cos(order u), plus a sum of the same form times u'^2 for reciprocating masses.
!> M, S and C are known at some speeds, linear between them, and constant below the lowest and above the highest one. They are
!> the ones of a cycle at a constant speed: fuel is metered by the cycle. Their slopes over the speed belong to its mean.
module nocdyn_order_excitations
  use nocdyn_bank, only: role_excitation
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_element_rows, only: rows_between
  use nocdyn_excitation_banks, only: excitation_bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: angle_of, expression_t, operator(*), operator(+), operator(-), pick, speed_of
  use nocdyn_law_functions, only: add_guard, cos, harmonics, sin
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_order_terms, only: new_order_terms, order_terms_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_order_excitations

  !> The torque of one excitation.
  type, public :: order_torque_t
    real(wp), allocatable :: order(:)                 !! positive, [orders]
    real(wp), allocatable :: speed(:)                 !! ascending [rad/s], [points]; one: the torque is the same at every speed
    real(wp), allocatable :: mean(:)                  !! [N m], [points]
    real(wp), allocatable :: sine(:, :), cosine(:, :) !! [N m], [orders, points]
    real(wp), allocatable :: square_order(:)          !! orders of the harmonics times u'^2, positive, [square orders]
    real(wp), allocatable :: square_sine(:), square_cosine(:)   !! [N m s2/rad2], [square orders]
  end type order_torque_t

  type, extends(excitation_bank_t), public :: order_excitations_t
    integer :: segments = 1                 !! between, below and above the points; 1 if nothing but squares depends on the speed
    type(order_terms_t) :: sorted, sorted_squares   !! harmonics, and those times u'^2
  contains
    procedure :: torque => order_torque
  end type order_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_order_excitations(names, body, torque) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    type(order_torque_t), intent(in) :: torque(:, :)   !! the numbers of orders and points do not depend on the lane, [lanes, ...]
    type(order_excitations_t) :: bank
    integer, allocatable :: excitation(:), owner(:), square_owner(:)   ! of each mean and harmonic
    integer :: e, lane, s

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    bank%follows_mean_speed = .true.
    call bank%connect(role_excitation, size(torque, 1), names, rows_between(0 * body, body))
    bank%segments = 1 + maxval([0, (size(torque(1, e)%speed), e=1, size(body))])
    if (bank%segments <= 2) bank%segments = 1
    excitation = [(e, e=1, size(body))]
    owner = [(spread(e, 1, size(torque(1, e)%order)), e=1, size(body))]
    square_owner = [(spread(e, 1, size(torque(1, e)%square_order)), e=1, size(body))]
    call add_pieces(bank, 'mean', excitation, torque)
    call add_pieces(bank, 'sine', owner, torque)
    call add_pieces(bank, 'cosine', owner, torque)
    call add_numbers(bank, 'order', owner, torque)
    call add_numbers(bank, 'square order', square_owner, torque)
    call add_numbers(bank, 'square sine', square_owner, torque)
    call add_numbers(bank, 'square cosine', square_owner, torque)
    bank%sorted = new_order_terms(size(body), owner, [(torque(1, e)%order, e=1, size(body))], owner > 0)
    bank%sorted_squares = new_order_terms(size(body), square_owner, [(torque(1, e)%square_order, e=1, size(body))], &
                                          square_owner > 0)
    call bank%add_parameter('base', spread(bank%sorted%base, 1, bank%lanes), is_key=.false.)
    call bank%add_parameter('square base', spread(bank%sorted_squares%base, 1, bank%lanes), is_key=.false.)
    if (bank%segments > 1) then
      call bank%add_parameter('speed', edges(bank, torque), is_key=.false., &
                              element=[(excitation, s=1, bank%segments - 1)])
      call bank%add_parameter('speed size', reshape([((maxval(abs(torque(lane, e)%speed)), lane=1, bank%lanes), &
                                                      e=1, bank%count)], [bank%lanes, bank%count]), is_key=.false.)
      call bank%add_switches([('point in the table', e=1, size(body))], bank%segments)
    end if
    call bank%prepare_law()
  end function new_order_excitations

  !> Adds a number of each harmonic.
  subroutine add_numbers(bank, name, owner, torque)
    type(order_excitations_t), intent(inout) :: bank
    character(len=*), intent(in) :: name               !! as in `numbers_of`
    integer, intent(in) :: owner(:)                    !! excitation of each harmonic, ascending
    type(order_torque_t), intent(in) :: torque(:, :)   !! [lanes, excitations]
    real(wp) :: value(bank%lanes, size(owner))
    integer :: i, k, lane

    i = 0
    do k = 1, size(owner)
      i = 1 + merge(i, 0, any(owner(max(1, k - 1):k - 1) == owner(k)))
      do lane = 1, bank%lanes
        value(lane, k:k) = numbers_of(torque(lane, owner(k)), name, i)
      end do
    end do
    call bank%add_parameter(name, value, is_key=.false., element=owner)
  end subroutine add_numbers

  !> Adds a number of each harmonic that follows the speed: its value at the begin of each segment, and its slope. Their columns
  !> are sorted by segment.
  subroutine add_pieces(bank, name, owner, torque)
    type(order_excitations_t), intent(inout) :: bank
    character(len=*), intent(in) :: name               !! as in `numbers_of`
    integer, intent(in) :: owner(:)                    !! excitation of each harmonic, ascending
    type(order_torque_t), intent(in) :: torque(:, :)   !! [lanes, excitations]
    real(wp), dimension(bank%lanes, size(owner), bank%segments) :: slope, start
    integer :: i, k, lane, s

    i = 0
    do k = 1, size(owner)
      i = 1 + merge(i, 0, any(owner(max(1, k - 1):k - 1) == owner(k)))   ! its number among the ones of the excitation
      do lane = 1, bank%lanes
        associate (one => torque(lane, owner(k)))
          call divide(one%speed, numbers_of(one, name, i), start(lane, k, :), slope(lane, k, :))
        end associate
      end do
    end do
    associate (columns => size(owner) * bank%segments, owners => [(owner, s=1, bank%segments)])
      call bank%add_parameter(name, reshape(start, [bank%lanes, columns]), is_key=.false., element=owners)
      if (bank%segments == 1) return
      call bank%add_parameter(name // ' slope', reshape(slope, [bank%lanes, columns]), is_key=.false., element=owners)
    end associate
  end subroutine add_pieces

  !> A number of harmonic `i`, at each point if it follows the speed.
  pure function numbers_of(torque, name, i) result(numbers)
    type(order_torque_t), intent(in) :: torque
    character(len=*), intent(in) :: name
    integer, intent(in) :: i
    real(wp), allocatable :: numbers(:)

    select case (name)
    case ('mean')
      numbers = torque%mean
    case ('sine')
      numbers = torque%sine(i, :)
    case ('cosine')
      numbers = torque%cosine(i, :)
    case ('order')
      numbers = torque%order(i:i)
    case ('square order')
      numbers = torque%square_order(i:i)
    case ('square sine')
      numbers = torque%square_sine(i:i)
    case default
      numbers = torque%square_cosine(i:i)
    end select
  end function numbers_of

  !> Value at the begin, and slope, of each segment of a number that is known at some speeds.
  pure subroutine divide(speed, value, start, slope)
    real(wp), intent(in) :: speed(:), value(:)   !! [points]
    real(wp), intent(out) :: start(:), slope(:)  !! [segments]; there may be more than points + 1
    integer :: points

    points = size(speed)
    start = value(points)
    slope = 0.0_wp
    start(1) = value(1)
    if (size(start) == 1) return
    start(2:points) = value(:points - 1)
    slope(2:points) = (value(2:) - value(:points - 1)) / (speed(2:) - speed(:points - 1))
  end subroutine divide

  !> The speeds between the segments, sorted by segment; huge where there are no more.
  pure function edges(bank, torque) result(speeds)
    type(order_excitations_t), intent(in) :: bank
    type(order_torque_t), intent(in) :: torque(:, :)   !! [lanes, excitations]
    real(wp) :: speeds(bank%lanes, bank%count * (bank%segments - 1))
    integer :: e, lane, s

    speeds = huge(speeds)
    do e = 1, bank%count
      do lane = 1, bank%lanes
        do s = 1, size(torque(lane, e)%speed)
          speeds(lane, e + bank%count * (s - 1)) = torque(lane, e)%speed(s)
        end do
      end do
    end do
  end function edges

  function order_torque(self, tape) result(torque)
    class(order_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: begin, edge(max(1, self%segments - 1)), speed, torque
    integer :: e, s

    speed = speed_of(tape)
    torque = harmonic_sum(self, tape, self%sorted, '', '')
    if (self%segments > 1) then
      do s = 1, size(edge)
        edge(s) = self%parameter(tape, 'speed', [(e, e=1 + self%count * (s - 1), self%count * s)])
        call add_guard(1, s, edge(s) - speed, boundary_width * self%parameter(tape, 'speed size'))
        call add_guard(1, s + 1, speed - edge(s), boundary_width * self%parameter(tape, 'speed size'))
      end do
      begin = pick(1, [edge(1), edge])   ! below the first point the slope is 0
      torque = torque + (speed - begin) * harmonic_sum(self, tape, self%sorted, '', ' slope')
    end if
    if (size(self%sorted_squares%single) + size(self%sorted_squares%multiples) > 0) then
      torque = torque + speed * speed * harmonic_sum(self, tape, self%sorted_squares, 'square ', '')
    end if
  end function order_torque

  !> The sum of some terms: the torque, its slope over the speed, or the part that is multiplied by u'^2, which has no mean.
  function harmonic_sum(self, tape, terms, prefix, suffix) result(sum)
    class(order_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(order_terms_t), intent(in) :: terms
    character(len=*), intent(in) :: prefix, suffix   !! of the names of the parameters: 'square ', ' slope', or ''
    type(expression_t) :: a(size(terms%multiples)), angle, b(size(terms%multiples)), sum
    integer :: e, k

    if (prefix == '') call add(picked(self, tape, 'mean' // suffix, [(e, e=1, self%count)]))
    do k = 1, size(a)
      a(k) = picked(self, tape, prefix // 'sine' // suffix, terms%multiple(terms%multiples(k), :))
      b(k) = picked(self, tape, prefix // 'cosine' // suffix, terms%multiple(terms%multiples(k), :))
    end do
    if (size(a) > 0) call add(harmonics(terms%multiples, a, b, self%parameter(tape, prefix // 'base') * angle_of(tape)))
    do k = 1, size(terms%single, 1)
      angle = self%parameter(tape, prefix // 'order', terms%single(k, :)) * angle_of(tape)
      call add(picked(self, tape, prefix // 'sine' // suffix, terms%single(k, :)) * sin(angle))
      call add(picked(self, tape, prefix // 'cosine' // suffix, terms%single(k, :)) * cos(angle))
    end do
  contains
    subroutine add(part)
      type(expression_t), intent(in) :: part

      if (associated(sum%tape)) then
        sum = sum + part
      else
        sum = part
      end if
    end subroutine add
  end function harmonic_sum

  !> A parameter in the formulas; the one of the present segment if it follows the speed.
  function picked(self, tape, name, columns) result(number)
    class(order_excitations_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    integer, intent(in) :: columns(:)   !! of each excitation in the first segment, 0 for the value zero
    type(expression_t) :: choices(self%segments), number
    integer :: s, stride

    associate (owners => self%parameters(self%number_of(name))%element)
      if (self%segments == 1 .or. name(:3) == 'squ') then
        number = self%parameter(tape, name, columns)
        return
      end if
      stride = size(owners) / self%segments
    end associate
    do s = 1, self%segments
      choices(s) = self%parameter(tape, name, merge(columns + stride * (s - 1), 0, columns > 0))
    end do
    number = pick(1, choices)
  end function picked

end module nocdyn_order_excitations
