!> The switches of a machine, of all banks numbered through.
module nocdyn_switches
  use nocdyn_bank, only: bank_slot_t, role_names
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: new_switches

  type, public :: switches_t
    integer :: count = 0
    integer, allocatable :: element(:)       !! whose branch each changes, [switches]
    integer, allocatable :: first_internal(:)   !! the inner states of that element
    integer, allocatable :: last_internal(:)
    integer, allocatable, private :: bank(:)
    integer, allocatable, private :: number(:)   !! in its bank
  contains
    procedure :: choose
    procedure :: indicator
    procedure :: name
  end type switches_t

contains

  !> The switches of banks whose elements have been numbered.
  function new_switches(banks) result(self)
    type(bank_slot_t), intent(in) :: banks(:)
    type(switches_t) :: self
    integer :: i, k, next

    self%count = sum([(size(banks(i)%bank%switch_element), i=1, size(banks))])
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
          self%first_internal(next) = bank%first_internal + (bank%switch_element(k) - 1) * bank%states
          self%last_internal(next) = self%first_internal(next) + bank%states - 1
        end do
      end associate
    end do
  end function new_switches

  !> Chooses the branch of a switch in which a lane is.
  subroutine choose(self, banks, switch, lane, t, angle, speed, internal)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(inout) :: banks(:)
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed   !! of the switching element
    real(wp), intent(in) :: internal(:)          !! its inner states

    call banks(self%bank(switch))%bank%choose(self%number(switch), lane, t, angle, speed, internal)
  end subroutine choose

  !> How far a lane is from the nearest border of the present branch of a switch.
  pure function indicator(self, banks, switch, lane, t, angle, speed, internal)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: switch, lane
    real(wp), intent(in) :: t, angle, speed   !! of the switching element
    real(wp), intent(in) :: internal(:)          !! its inner states
    real(wp) :: indicator

    indicator = banks(self%bank(switch))%bank%indicator(self%number(switch), lane, t, angle, speed, internal)
  end function indicator

  !> E.g. "edge of the gap of coupling 'mesh'".
  function name(self, banks, switch)
    class(switches_t), intent(in) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    integer, intent(in) :: switch
    character(len=:), allocatable :: name

    associate (bank => banks(self%bank(switch))%bank, number => self%number(switch))
      name = bank%switch_name(number) // ' of ' // trim(role_names(bank%role)) // ' ' // &
             quoted(bank%names(bank%switch_element(number))%text)
    end associate
  end function name

end module nocdyn_switches
