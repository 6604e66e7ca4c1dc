!> The switches of a machine, numbered consecutively over all banks. A switch selects the branch of an element's law.
module nocdyn_switches
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_bank_states, only: bank_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: new_switches

  type, public :: switches_t
    integer :: count = 0
    integer, allocatable :: element(:)       !! element of each switch, numbered in the machine, [switches]
    integer, allocatable :: moving(:)        !! elements whose motion they look at: bank by bank its elements, then their phases
    integer, allocatable :: place(:)         !! of the element of each switch in `moving`, [switches]
    integer, allocatable :: phase_place(:)   !! of its phase; the one of the element itself if it has none, [switches]
    real(wp), allocatable :: phase_order(:)  !! most oscillations per turn of the phase; 0 if it has none
    integer, allocatable, private :: first_internal(:)   !! first internal state of that element in the machine, [switches]
    integer, allocatable, private :: last_internal(:)    !! last internal state of that element, [switches]
    integer, allocatable, private :: bank(:)     !! [switches]
    integer, allocatable, private :: number(:)   !! of the switch in its bank, [switches]
  contains
    procedure :: bank_of
    procedure :: choose
    procedure :: indicator
    procedure :: block_indicators
    procedure :: name
  end type switches_t

contains

  !> The switches of banks whose elements have been numbered.
  function new_switches(banks) result(self)
    type(bank_slot_t), intent(in) :: banks(:)
    type(switches_t) :: self
    integer :: e, i, k, next

    self%count = sum([(size(banks(i)%bank%switch_element), i=1, size(banks))])
    allocate (self%phase_order(self%count), source=0.0_wp)
    allocate (self%moving(0), self%place(self%count), self%phase_place(self%count))
    allocate (self%element(self%count), self%first_internal(self%count), self%last_internal(self%count))
    allocate (self%bank(self%count), self%number(self%count))
    next = 0
    do i = 1, size(banks)
      associate (bank => banks(i)%bank)
        do k = 1, size(bank%switch_element)
          next = next + 1
          self%bank(next) = i
          self%number(next) = k
          self%element(next) = bank%first + bank%switch_element(k) - 1
          self%place(next) = size(self%moving) + bank%switch_element(k)
          self%phase_place(next) = self%place(next) + (bank%ports - 1) * bank%count
          self%phase_order(next) = bank%phase_order
          self%first_internal(next) = bank%first_internal + (bank%switch_element(k) - 1) * bank%states
          self%last_internal(next) = self%first_internal(next) + bank%states - 1
        end do
        if (k > 1) self%moving = [self%moving, (bank%first - 1 + e, e=1, bank%ports * bank%count)]
      end associate
    end do
  end function new_switches

  !> The bank of a switch.
  pure integer function bank_of(self, switch)
    class(switches_t), intent(in) :: self
    integer, intent(in) :: switch   !! numbered in the machine

    bank_of = self%bank(switch)
  end function bank_of

  !> Sets the branch of a switch in one lane to the one that contains the state.
  subroutine choose(self, banks, states, switch, lane, t, motion, internal)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks
    integer, intent(in) :: switch, lane   !! switch numbered in the machine
    real(wp), intent(in) :: t             !! [s]
    real(wp), intent(in) :: motion(4)     !! u [rad], u' [rad/s] of the element of the switch, and of its phase
    real(wp), intent(in) :: internal(:)   !! the internal states of all elements

    associate (b => self%bank(switch))
      call states(b)%choose(banks(b)%bank, self%number(switch), lane, t, motion, &
                            internal(self%first_internal(switch):self%last_internal(switch)))
    end associate
  end subroutine choose

  !> Distance of a lane from the nearest boundary of the present branch of a switch, negative beyond it.
  subroutine indicator(self, banks, states, switch, lane, motion, internal, distance)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks
    integer, intent(in) :: switch, lane   !! switch numbered in the machine
    real(wp), intent(in) :: motion(5)     !! t [s]; u [rad], u' [rad/s] of the element of the switch, and of its phase
    real(wp), intent(in) :: internal(:)   !! the internal states of all elements
    real(wp), intent(out) :: distance     !! in a unit of the law

    associate (b => self%bank(switch))
      call states(b)%indicator(banks(b)%bank, self%number(switch), lane, motion, &
                               internal(self%first_internal(switch):self%last_internal(switch)), distance)
    end associate
  end subroutine indicator

  !> Indicators of all switches in all lanes of a block.
  subroutine block_indicators(self, banks, states, time, angle, speed, internal, distance)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(inout) :: states(:)   !! of the banks
    real(wp), intent(in) :: time(:)                   !! t [s], [lanes]
    real(wp), contiguous, intent(in) :: angle(:, :), speed(:, :)  !! of the elements `moving` [rad], [rad/s], [lanes, moving]
    real(wp), contiguous, intent(in) :: internal(:, :)            !! [lanes, states of all elements]
    real(wp), intent(inout) :: distance(:, :)         !! in units of the laws, [lanes, switches]
    integer :: first, i, moving

    first = 1
    moving = 0
    do i = 1, size(banks)
      associate (bank => banks(i)%bank)
        associate (last => first + size(bank%switch_element) - 1)
          if (last < first) cycle
          call states(i)%law%lowest_guards(states(i)%branch, time, angle(:, moving + 1:moving + bank%ports * bank%count), &
                                           speed(:, moving + 1:moving + bank%ports * bank%count), &
                                           internal(:, bank%first_internal:bank%first_internal + bank%states * bank%count - 1), &
                                           distance(:, first:last))
          first = last + 1
          moving = moving + bank%ports * bank%count
        end associate
      end associate
    end do
  end subroutine block_indicators

  !> E.g. "edge of the gap of coupling 'mesh'".
  function name(self, banks, switch)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: switch   !! numbered in the machine
    character(len=:), allocatable :: name

    associate (bank => banks(self%bank(switch))%bank, number => self%number(switch))
      name = trim(bank%switch_names(number)) // ' of ' // trim(bank%kind_name()) // ' ' // &
             quoted(bank%names(bank%switch_element(number))%text)
    end associate
  end function name

end module nocdyn_switches
