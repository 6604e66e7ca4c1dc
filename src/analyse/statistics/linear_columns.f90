!> Columns of the trajectory table that are a linear function x of the state of the reduced formulation, or the elastic moment
!> of a coupling that is an odd cubic polynomial of x; for all lanes of a block. Where rows move there are none: states between
!> the steps are put back on them.
!>
!> x = offset + sum of factor * y(component). An angle, a speed or a twist is x. An elastic moment is (linear + cubic x^2) x,
!> where x is the twist minus that at rest. The moment of a linear coupling with damping is x = k (u - rest) + d u', its stress
!> the moment over the section modulus, its damping moment d u'.
module nocdyn_linear_columns
  use nocdyn_bank, only: role_coupling
  use nocdyn_column_statistics, only: width
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_quantities, only: form_angle, form_applied, form_elastic, form_total
  use nocdyn_reduced, only: reduced_t
  use nocdyn_signals, only: signal_angle, signal_element, signal_source_t, signal_speed
  implicit none (type, external)
  private

  public :: is_linear, is_proportional, has_law, new_linear_columns, strip_of, lane_in_strip

  type, public :: linear_columns_t
    integer :: count = 0
    integer, private :: entries = 0
    integer, allocatable :: first(:)          !! entry of each column, [count + 1]; the number of its entries is even
    integer, allocatable :: component(:)      !! of the state, which the factor multiplies, [entries]
    real(wp), allocatable :: factor(:, :, :)  !! [width, entries, strips of lanes]
    real(wp), allocatable :: offset(:, :, :)  !! [width, columns, strips]
    integer, allocatable, private :: ratio(:)       !! entry of the coordinates, 0 if it only completes a pair; [entries]
    real(wp), allocatable, private :: coefficient(:)   !! the factor is this multiple of that ratio, [entries]
    logical, allocatable, private :: is_speed(:)    !! [columns]
    integer, allocatable, private :: element(:)     !! whose twist or moment the column is, 0 if it is none; [columns]
    logical, allocatable, private :: has_law(:)     !! whether it is an elastic moment; [columns]
    integer, allocatable, private :: bank(:)        !! of a damping or whole moment or a stress, 0 of other columns; [columns]
    logical, allocatable, private :: is_damping(:)  !! whether it is a damping moment, [columns]
    integer, allocatable, private :: divisor(:)     !! parameter of the bank that divides a moment, 0: none; [columns]
    real(wp), allocatable, private :: direction(:)  !! 1 if a moment is positive on the first body, else -1; [columns]
    logical, allocatable, private :: is_rate(:)     !! whether a speed is multiplied, [entries]
    integer, allocatable, private :: body(:)        !! whose angle or speed the column is; [columns]
  contains
    procedure :: copy_lane, find_laws, argument, value_at_end
  end type linear_columns_t

contains

  !> Whether a column is a linear function of the state or such a moment.
  logical function is_linear(block, column)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: column

    is_linear = .false.
    select type (block)
    class is (reduced_t)
      is_linear = .not. block%projects .and. (any(column%kind == [signal_angle, signal_speed]) .or. &
                                              column%form == form_angle .or. has_law(block%machine, column))
    end select
  end function is_linear

  !> Whether a column is a moment, elastic, damping or whole, or the stress of a coupling without friction, and without cubic
  !> stiffness in all lanes unless it is the damping moment: a linear function of the state.
  logical function is_proportional(block, column)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: column

    is_proportional = .false.
    if (column%kind /= signal_element .or. block%projects) return
    associate (machine => block%machine, bank => block%machine%banks(column%bank)%bank)
      select type (block)
      class is (reduced_t)
        is_proportional = bank%role == role_coupling .and. bank%has_paper_law .and. bank%has_polynomial_potential .and. &
                          any(column%form == [form_elastic, form_applied, form_total])
      end select
      if (.not. is_proportional .or. column%form == form_applied) return
      is_proportional = all(abs(machine%laws%cubic(:, bank%first - 1 + column%index)) <= 0)
    end associate
  end function is_proportional

  !> Whether a column is the elastic moment of a coupling with the law of eq. (3).
  logical function has_law(machine, column)
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: column

    has_law = column%kind == signal_element .and. column%form == form_elastic
    if (has_law) has_law = machine%banks(column%bank)%bank%has_polynomial_potential
  end function has_law

  !> The given columns, each `is_linear`. `copy_lane` sets the parameters of a lane.
  type(linear_columns_t) function new_linear_columns(block, columns) result(self)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: columns(:)
    integer :: i, k, strips

    self%count = size(columns)
    strips = strip_of(block%lanes)
    allocate (self%first(self%count + 1), source=1)
    allocate (self%component(0), self%ratio(0), self%coefficient(0), self%is_rate(0))
    allocate (self%is_speed, source=columns%kind == signal_speed)
    allocate (self%has_law(self%count), self%is_damping(self%count), source=.false.)
    allocate (self%element(self%count), self%body(self%count), self%bank(self%count), self%divisor(self%count), source=0)
    allocate (self%direction(self%count), source=1.0_wp)
    do i = 1, self%count
      call set_column(self, i, block%machine, columns(i))
      if (self%element(i) == 0) then
        call add_body(self, block%machine%coordinates, self%body(i), 1.0_wp, self%is_speed(i))
      else
        associate (rows => block%machine%elements%rows, e => self%element(i), coordinates => block%machine%coordinates)
          do k = rows%first(e + 1) - 1, rows%first(e), -1
            if (.not. self%is_damping(i)) call add_body(self, coordinates, rows%body(k), rows%coefficient(k), .false.)
            if (self%bank(i) > 0) call add_body(self, coordinates, rows%body(k), rows%coefficient(k), .true.)
          end do
        end associate
      end if
      if (modulo(self%entries, 2) == 1) call add_entry(self, 0, 0.0_wp, self%component(self%entries), .false.)
      self%first(i + 1) = self%entries + 1
    end do
    call resize(self, self%entries)
    allocate (self%factor(width, size(self%component), strips), self%offset(width, self%count, strips), source=0.0_wp)
  end function new_linear_columns

  subroutine set_column(self, number, machine, column)
    type(linear_columns_t), intent(inout) :: self
    integer, intent(in) :: number
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: column

    self%body(number) = column%index
    if (column%kind /= signal_element) return
    self%element(number) = machine%banks(column%bank)%bank%first - 1 + column%index
    self%has_law(number) = has_law(machine, column)
    if (column%form /= form_angle) self%direction(number) = -column%factor
    if (self%has_law(number) .or. column%form == form_angle) return
    self%is_damping(number) = column%form == form_applied
    self%bank(number) = column%bank
    self%divisor(number) = column%divisor
  end subroutine set_column

  subroutine add_body(self, coordinates, body, coefficient, is_rate)
    type(linear_columns_t), intent(inout) :: self
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: body              !! 0 = ground, which has no coordinates
    real(wp), intent(in) :: coefficient
    logical, intent(in) :: is_rate           !! whether it multiplies the speed, not the angle
    integer :: k

    if (body == 0) return
    do k = coordinates%first(body), coordinates%first(body + 1) - 1
      call add_entry(self, k, coefficient, coordinates%coordinate(k) + merge(0, coordinates%freedoms, is_rate), is_rate)
    end do
  end subroutine add_body

  !> Appends an entry, in amortised constant time.
  subroutine add_entry(self, ratio, coefficient, component, is_rate)
    type(linear_columns_t), intent(inout) :: self
    integer, intent(in) :: ratio, component
    real(wp), intent(in) :: coefficient
    logical, intent(in) :: is_rate

    if (self%entries == size(self%ratio)) call resize(self, 2 * self%entries + 8)
    self%entries = self%entries + 1
    self%ratio(self%entries) = ratio
    self%coefficient(self%entries) = coefficient
    self%component(self%entries) = component
    self%is_rate(self%entries) = is_rate
  end subroutine add_entry

  !> Changes the room for entries.
  subroutine resize(self, room)
    type(linear_columns_t), intent(inout) :: self
    integer, intent(in) :: room
    integer :: i

    associate (kept => min(room, self%entries))
      self%ratio = [self%ratio(:kept), (0, i=kept + 1, room)]
      self%coefficient = [self%coefficient(:kept), (0.0_wp, i=kept + 1, room)]
      self%component = [self%component(:kept), (0, i=kept + 1, room)]
      self%is_rate = [self%is_rate(:kept), (.false., i=kept + 1, room)]
    end associate
  end subroutine resize

  !> Copies the parameters of a lane of the block.
  pure subroutine copy_lane(self, block, lane)
    class(linear_columns_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: lane
    integer :: i, k

    associate (machine => block%machine, at => lane_in_strip(lane), strip => strip_of(lane))
      do k = 1, size(self%ratio)
        if (self%ratio(k) == 0) cycle
        associate (ratio => machine%coordinates%ratio(lane, self%ratio(k)))
          self%factor(at, k, strip) = self%coefficient(k) * ratio
        end associate
      end do
      do i = 1, self%count
        if (self%is_speed(i)) cycle
        associate (offset => self%offset(at, i, strip))
          if (self%element(i) == 0) then
            offset = block%angle_at_zero(lane, self%body(i))
            cycle
          end if
          offset = block%twist_at_zero(lane, self%element(i))
          if (self%has_law(i) .or. self%bank(i) > 0) offset = offset - machine%laws%rest(lane, self%element(i))
        end associate
        if (self%bank(i) > 0) call scale_column(self, i, machine, lane)
      end do
    end associate
  end subroutine copy_lane

  !> Makes a damping or whole moment or a stress of a twist and its rate.
  pure subroutine scale_column(self, i, machine, lane)
    class(linear_columns_t), intent(inout) :: self
    integer, intent(in) :: i   !! column
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    real(wp) :: stiffness, damping
    integer :: k

    stiffness = 0.0_wp
    if (.not. self%is_damping(i)) stiffness = self%direction(i) * machine%laws%linear(lane, self%element(i))
    damping = -self%direction(i) * machine%laws%by_speed(lane, self%element(i))
    if (self%divisor(i) > 0) then
      associate (bank => machine%banks(self%bank(i))%bank)
        associate (modulus => bank%parameters(self%divisor(i))%value(lane, self%element(i) - bank%first + 1))
          stiffness = stiffness / modulus
          damping = damping / modulus
        end associate
      end associate
    end if
    associate (at => lane_in_strip(lane), strip => strip_of(lane))
      self%offset(at, i, strip) = 0.0_wp + stiffness * self%offset(at, i, strip)   ! not -0
      do k = self%first(i), self%first(i + 1) - 1
        self%factor(at, k, strip) = merge(damping, stiffness, self%is_rate(k)) * self%factor(at, k, strip)
      end do
    end associate
  end subroutine scale_column

  !> Sets the coefficients of the moments of a lane; the ones of other columns remain.
  pure subroutine find_laws(self, machine, lane, linear, cubic)
    class(linear_columns_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    real(wp), intent(inout) :: linear(:, :), cubic(:, :)   !! [lanes, columns]
    integer :: i

    do i = 1, self%count
      if (.not. self%has_law(i)) cycle
      linear(lane, i) = self%direction(i) * machine%laws%linear(lane, self%element(i))
      cubic(lane, i) = self%direction(i) * machine%laws%cubic(lane, self%element(i))
    end do
  end subroutine find_laws

  !> The number of the strip in which a lane is.
  elemental integer function strip_of(lane)
    integer, intent(in) :: lane

    strip_of = (lane - 1) / width + 1
  end function strip_of

  !> The number of a lane in its strip.
  elemental integer function lane_in_strip(lane)
    integer, intent(in) :: lane

    lane_in_strip = modulo(lane - 1, width) + 1
  end function lane_in_strip

  !> x at a state of a lane.
  pure real(wp) function argument(self, number, lane, y) result(x)
    class(linear_columns_t), intent(in) :: self
    integer, intent(in) :: number, lane
    real(wp), contiguous, intent(in) :: y(:)
    integer :: k

    associate (at => lane_in_strip(lane), strip => strip_of(lane))
      x = self%offset(at, number, strip)
      do k = self%first(number), self%first(number + 1) - 1
        x = x + self%factor(at, k, strip) * y(self%component(k))
      end do
    end associate
  end function argument

  !> x at the end of a lane; an angle with the bits of the row of a run.
  real(wp) function value_at_end(self, block, number, lane, y) result(x)
    class(linear_columns_t), intent(in) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: number, lane
    real(wp), contiguous, intent(in) :: y(:)

    if (self%element(number) == 0 .and. .not. self%is_speed(number)) then
      select type (block)
      class is (reduced_t)
        x = block%body_angle(lane, self%body(number), y)
        return
      end select
    end if
    x = self%argument(number, lane, y)
  end function value_at_end

end module nocdyn_linear_columns
