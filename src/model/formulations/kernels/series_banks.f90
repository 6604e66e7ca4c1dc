!> Coefficients of the moments and internal states of the banks whose laws are not polynomial, by the lists of their laws.
!>
!> The slots of a bank are consecutive slots of all elements; slots beyond its last one are copies of the last one. The moments of
!> some banks follow from the time alone: their series do not wait for the series of the motion, and are computed at the start of
!> a step.
module nocdyn_series_banks
  use nocdyn_element_laws, only: element_law_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_strips, only: load, load_lanes
  use nocdyn_law_walk, only: walk
  use nocdyn_law_work, only: law_work_t
  use nocdyn_laws, only: narrow
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  implicit none (type, external)
  private

  public :: new_series_banks

  type, public :: series_banks_t
    integer :: order = 0               !! of the series
    integer, allocatable :: moved(:)   !! banks whose moments follow from the motion
    integer, allocatable :: timed(:)   !! banks whose moments follow from the time alone
    integer, allocatable :: first(:)   !! element of each bank, [banks]
    integer, allocatable :: first_internal(:)   !! internal state of each bank, [banks]
    integer :: lanes = 1, internal = 0          !! internal states of all elements
    logical, allocatable :: has_angle(:)        !! whether some law reads the angle, [groups of all elements]
    logical, allocatable :: has_motion(:)       !! whether some moment follows from the motion, [groups]
    logical, allocatable :: has_forcing(:)      !! whether some moment follows from the time alone, [groups]
    real(wp), allocatable :: forcing(:, :, :)   !! series of these moments [N m], [w, 0:order, groups], or no groups
  contains
    procedure :: begin, add, integrate
  end type series_banks_t

contains

  !> Work space for series up to an order.
  function new_series_banks(machine, state, order, strip, groups) result(self)
    type(machine_t), intent(in) :: machine
    type(machine_state_t), intent(inout) :: state   !! its laws get work space too
    integer, intent(in) :: order
    integer, intent(in) :: strip, groups        !! lanes of a strip, groups of all elements in it
    type(series_banks_t) :: self
    integer :: i, w
    logical, allocatable :: timed(:)

    self%order = order
    allocate (self%first(size(machine%banks)), self%first_internal(size(machine%banks)))
    self%first(:) = [(machine%banks(i)%bank%first, i=1, size(machine%banks))]
    self%first_internal(:) = [(machine%banks(i)%bank%first_internal, i=1, size(machine%banks))]
    self%lanes = machine%lanes
    self%internal = machine%elements%internal%count
    w = max(strip, narrow)
    allocate (self%has_angle(groups), self%has_motion(groups), self%has_forcing(groups), source=.false.)
    associate (numbers => machine%general_banks)
      allocate (timed(size(numbers)))
      do i = 1, size(numbers)
        associate (bank => machine%banks(numbers(i))%bank, law => state%banks(numbers(i))%law)
          call law%prepare_series(order)
          timed(i) = bank%states == 0 .and. bank%tape%restoring == 0
          if (timed(i)) then
            associate (applied => bank%tape%node(bank%tape%applied))
              timed(i) = .not. (applied%has_angle .or. applied%has_speed)
            end associate
          end if
          associate (first => strip * (bank%first - 1) / w + 1, &
                     last => (strip * (bank%last() + (bank%ports - 1) * bank%count) - 1) / w + 1)
            self%has_forcing(first:last) = self%has_forcing(first:last) .or. timed(i)
            self%has_motion(first:last) = self%has_motion(first:last) .or. .not. timed(i)
            self%has_angle(first:last) = self%has_angle(first:last) .or. max(law%angle, law%phase) > 0
          end associate
        end associate
      end do
      self%timed = pack(numbers, timed)
      self%moved = pack(numbers, .not. timed)
    end associate
    allocate (self%forcing(w, 0:order, merge(groups, 0, any(timed))), source=0.0_wp)
  end function new_series_banks

  !> What the banks need besides the motion at the start of a step, in a strip. Moments will be asked for up to number `last`.
  subroutine begin(self, state, strip, last, t, internal)
    class(series_banks_t), intent(inout) :: self
    type(machine_state_t), intent(inout) :: state
    integer, intent(in) :: strip, last
    real(wp), intent(in) :: t(self%lanes)                              !! [s]
    real(wp), intent(in) :: internal(self%lanes, self%internal)        !! states of the elements
    integer :: i

    do i = 1, size(self%moved)
      associate (law => state%banks(self%moved(i))%law)
        if (law%states > 0) then
          call begin_bank(law, strip, t, internal(1, self%first_internal(self%moved(i))))
        else
          call begin_bank(law, strip, t, internal)
        end if
      end associate
    end do
    do i = 1, size(self%timed)
      associate (law => state%banks(self%timed(i))%law)
        call begin_bank(law, strip, t, internal)
        call set_forcing(law, self%first(self%timed(i)), strip, last, self%order, size(self%forcing, 3), self%forcing)
      end associate
    end do
  end subroutine begin

  !> Adds the coefficients k of the moments that follow from the motion.
  subroutine add(self, state, strip, k, motion, restoring, applied)
    class(series_banks_t), intent(in) :: self
    type(machine_state_t), intent(inout) :: state
    integer, intent(in) :: strip, k
    real(wp), contiguous, intent(in) :: motion(:, 0:, :, :)   !! angles [rad] and speeds [rad/s], [w, 0:order, groups, 2]
    real(wp), contiguous, intent(inout) :: restoring(:, :), applied(:, :)   !! [N m], [w, groups]
    integer :: i

    do i = 1, size(self%moved)
      call add_bank(state%banks(self%moved(i))%law, self%first(self%moved(i)), strip, k, motion, restoring, applied)
    end do
  end subroutine add

  !> Coefficients k + 1 of the internal states.
  subroutine integrate(self, state, strip, k, internal)
    class(series_banks_t), intent(in) :: self
    type(machine_state_t), intent(inout) :: state
    integer, intent(in) :: strip, k
    real(wp), intent(inout) :: internal(self%lanes, self%internal)   !! states of the elements
    integer :: i

    do i = 1, size(self%moved)
      associate (law => state%banks(self%moved(i))%law)
        if (law%states > 0) call internal_coefficients(law, strip, k, internal(1, self%first_internal(self%moved(i))))
      end associate
    end do
  end subroutine integrate

  !> Sets the time and the internal states at the start of a step.
  subroutine begin_bank(law, strip, t, internal)
    type(element_law_t), intent(inout) :: law
    integer, intent(in) :: strip
    real(wp), intent(in) :: t(law%law%lanes)                                        !! [s]
    real(wp), intent(in) :: internal(law%law%lanes * law%states * law%law%elements) !! [lanes, states, elements]
    integer :: i

    call load_lanes(law%law, law%series, law%time, 0, strip, t)
    do i = 1, law%states
      call load(law%law, law%series, law%state(i), 0, strip, law%states, i, internal)
    end do
  end subroutine begin_bank

  !> Sets the series of the moments of a bank that follow from the time alone, after `begin_bank`, up to number `last`.
  subroutine set_forcing(bank_law, first, strip, last, order, groups, forcing)
    type(element_law_t), intent(inout) :: bank_law
    integer, intent(in) :: first   !! element of the bank
    integer, intent(in) :: strip, last, order, groups
    real(wp), intent(inout) :: forcing(bank_law%law%w, 0:order, groups)   !! of all elements [N m]
    integer :: at, g, k, slot

    associate (law => bank_law%law, work => bank_law%series)
      do k = 0, last
        call walk(law, work, k, law%groups * (strip - 1) + 1)
      end do
      if (law%strip == 1) then
        do slot = first - 1, first + law%elements - 2
          associate (x => forcing(modulo(slot, law%w) + 1, :, slot / law%w + 1), i => slot - first + 1)
            do k = 0, last
              x(k + 1) = work%pool(work%address(law%tape%applied, k, i / law%w + 1) + modulo(i, law%w))
            end do
          end associate
        end do
        return
      end if
      do g = 1, law%groups
        at = work%address(law%tape%applied, 0, g)
        call copy(law%w * (last + 1), work%pool(at), forcing(1, 0, first - 1 + g))
      end do
    end associate
  end subroutine set_forcing

  pure subroutine copy(n, x, y)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    real(wp), intent(inout) :: y(n)

    y = x
  end subroutine copy

  !> Adds the coefficients k of the moments, from the coefficients of the motion up to number k.
  subroutine add_bank(law, first, strip, k, motion, restoring, applied)
    type(element_law_t), intent(inout) :: law
    integer, intent(in) :: first   !! element of the bank
    integer, intent(in) :: strip, k
    real(wp), contiguous, intent(in) :: motion(:, 0:, :, :)   !! angles [rad] and speeds [rad/s] of all elements
    real(wp), contiguous, intent(inout) :: restoring(:, :), applied(:, :)   !! moments of all elements [N m]
    integer :: before, slots

    associate (work => law%series, tape => law%law%tape, groups => size(restoring, 2))
      before = law%law%strip * (first - 1)
      slots = law%law%strip * law%law%elements
      call feed(work, law%angle, k, before, slots, motion(:, :, :, 1))
      call feed(work, law%speed, k, before, slots, motion(:, :, :, 2))
      if (law%ports > 1) then
        call feed(work, law%phase, k, before + slots, slots, motion(:, :, :, 1))
        call feed(work, law%phase_speed, k, before + slots, slots, motion(:, :, :, 2))
      end if
      call walk(law%law, work, k, law%law%groups * (strip - 1) + 1)
      call drain(work, tape%restoring, k, before, slots, groups, restoring)
      call drain(work, tape%applied, k, before, slots, groups, applied)
      if (law%ports == 1) return
      call drain(work, tape%phase_restoring, k, before + slots, slots, groups, restoring)
      call drain(work, tape%phase_applied, k, before + slots, slots, groups, applied)
    end associate
  end subroutine add_bank

  !> Sets coefficient k of an input.
  pure subroutine feed(work, node, k, before, slots, x)
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: node            !! of the list; if it is 0, nothing is set
    integer, intent(in) :: k
    integer, intent(in) :: before, slots   !! slots before the bank, slots of the bank
    real(wp), contiguous, intent(in) :: x(:, 0:, :)   !! [w, 0:order, groups], in the unit of the input
    integer :: at, g, i, slot

    if (node == 0) return
    if (work%first(node) == 0) return
    do g = 1, work%groups
      at = work%address(node, k, g) - 1
      if (modulo(before, work%w) == 0 .and. work%w * g <= slots) then
        work%pool(at + 1:at + work%w) = x(:, k, before / work%w + g)
        cycle
      end if
      do i = 1, work%w
        slot = before + min(work%w * (g - 1) + i, slots) - 1
        work%pool(at + i) = x(modulo(slot, work%w) + 1, k, slot / work%w + 1)
      end do
    end do
  end subroutine feed

  !> Adds coefficient k of a result.
  pure subroutine drain(work, node, k, before, slots, groups, x)
    type(law_work_t), intent(in) :: work
    integer, intent(in) :: node                    !! of the list; if it is 0, nothing is added
    integer, intent(in) :: k, before, slots
    integer, intent(in) :: groups                  !! of all elements
    real(wp), intent(inout) :: x(work%w, groups)   !! of all elements, in the unit of the result
    integer :: at, g, i, slot

    if (node == 0) return
    do g = 1, work%groups
      at = work%address(node, k, g) - 1
      if (modulo(before, work%w) == 0 .and. work%w * g <= slots) then
        x(:, before / work%w + g) = x(:, before / work%w + g) + work%pool(at + 1:at + work%w)
        cycle
      end if
      do i = 1, min(work%w, slots - work%w * (g - 1))
        slot = before + work%w * (g - 1) + i - 1
        associate (value => x(modulo(slot, work%w) + 1, slot / work%w + 1))
          value = value + work%pool(at + i)
        end associate
      end do
    end do
  end subroutine drain

  !> Computes coefficient k + 1 of the internal states from coefficient k of their rates.
  subroutine internal_coefficients(law, strip, k, internal)
    type(element_law_t), intent(inout) :: law
    integer, intent(in) :: strip, k
    real(wp), intent(inout) :: internal(law%law%lanes, law%states, law%law%elements)   !! [lanes, states, elements]
    integer :: e, i, lane, slot, state
    real(wp) :: inverse

    inverse = 1.0_wp / (k + 1)
    associate (work => law%series)
      do i = 1, law%states
        state = law%state(i)
        do slot = 0, work%w * work%groups - 1
          associate (at => work%w * (k + (work%order + 1) * (slot / work%w)) + modulo(slot, work%w))
            if (k < work%order .and. state > 0) then
              work%pool(work%first(state) + at + work%w) = inverse * work%pool(work%first(law%law%tape%rate(i)) + at)
            end if
          end associate
        end do
        do e = 1, law%law%elements
          do lane = law%law%strip * (strip - 1) + 1, min(law%law%strip * strip, law%law%lanes)
            slot = law%law%strip * (e - 1) + lane - law%law%strip * (strip - 1) - 1
            internal(lane, i, e) = inverse * work%pool(work%first(law%law%tape%rate(i)) + modulo(slot, work%w) &
                                                       + work%w * (k + (work%order + 1) * (slot / work%w)))
          end do
        end do
      end do
    end associate
  end subroutine internal_coefficients

end module nocdyn_series_banks
