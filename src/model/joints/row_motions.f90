!> The rows of L_lambda that move, of all banks of a machine in a block of one lane (`nocdyn_moving_rows`), at a position:
!> u - g(v) - constant = 0, u' - g' v' = 0 and u'' - g' v'' = g'' v'^2, or with the time v = t.
module nocdyn_row_motions
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_bank_states, only: bank_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_moving_rows, only: moving_rows_t
  implicit none (type, external)
  private

  public :: new_row_motions

  type, public :: row_motions_t
    integer :: count = 0
    integer, allocatable :: element(:)       !! of the machine, [rows] as all that follow
    integer, allocatable :: driver(:)        !! element whose angle is v, 0: v is the time
    integer, allocatable :: bank(:), number(:)   !! its bank, and its number there
    real(wp), allocatable :: constant(:)     !! u - g(v) at the start [rad] or [m]
    real(wp), allocatable :: v(:)            !! where g is known [rad] or [s]
    logical, allocatable :: is_new(:)        !! whether v has changed
    real(wp), allocatable :: g(:, :)         !! g and its derivatives at the present position, [0:3, rows]
    real(wp), allocatable :: position(:)     !! u - g(v) - constant
    real(wp), allocatable :: speed(:)        !! what u' - g' v' is: 0, or g' of the time
    real(wp), allocatable :: acceleration(:) !! what u'' - g' v'' is: g'' v'^2
    real(wp), allocatable :: terms(:)        !! sizes of the terms of `position`, of which its rounding errors are parts
    real(wp), allocatable :: demand(:)       !! of the rates of the rows, work space
    ! for the derivatives of the accelerations:
    real(wp), allocatable :: held(:)         !! moments [N m]
    real(wp), allocatable :: driver_acceleration(:)   !! v''
  contains
    procedure :: set_start
    procedure :: move
    procedure :: size_terms
  end type row_motions_t

contains

  !> The rows of all banks.
  function new_row_motions(banks) result(self)
    type(bank_slot_t), intent(in) :: banks(:)
    type(row_motions_t) :: self
    integer :: b, e

    allocate (self%element(0), self%driver(0), self%bank(0), self%number(0))
    do b = 1, size(banks)
      select type (bank => banks(b)%bank)
      class is (moving_rows_t)
        do e = 1, bank%count
          self%element = [self%element, bank%first - 1 + e]
          self%driver = [self%driver, merge(0, bank%last() + e, bank%is_driven_by_time)]
          self%bank = [self%bank, b]
          self%number = [self%number, e]
        end do
      end select
    end do
    self%count = size(self%element)
    allocate (self%constant(self%count), source=0.0_wp)
    allocate (self%v(self%count), source=huge(1.0_wp))
    allocate (self%is_new(self%count), source=.true.)
    allocate (self%position, self%speed, self%acceleration, self%terms, self%demand, self%held, self%driver_acceleration, &
              source=self%constant)
    allocate (self%g(0:3, self%count), source=0.0_wp)
  end function new_row_motions

  !> Sets the constants so that a position at the start fulfils the rows. Prescribed motions are zero there.
  subroutine set_start(self, banks, states, angle)
    class(row_motions_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(in) :: states(:)   !! of the banks
    real(wp), intent(in) :: angle(:)   !! u of all elements [rad]

    self%constant(:) = 0.0_wp
    self%v(:) = huge(1.0_wp)   ! with parameters that may have changed
    call self%move(banks, states, 0.0_wp, angle, 0.0_wp * angle)
    self%constant(:) = merge(self%position, angle(self%element), self%driver > 0)
  end subroutine set_start

  !> Sets g, where v has changed, and what the rows demand at a position.
  pure subroutine move(self, banks, states, t, angle, speed)
    class(row_motions_t), intent(inout) :: self
    type(bank_slot_t), intent(in) :: banks(:)
    type(bank_state_t), intent(in) :: states(:)   !! of the banks
    real(wp), intent(in) :: t                    !! [s]
    real(wp), intent(in) :: angle(:), speed(:)   !! of all elements, [rad], [rad/s]
    integer :: i
    real(wp) :: v

    do i = 1, self%count
      v = t
      if (self%driver(i) > 0) v = angle(self%driver(i))
      self%is_new(i) = self%driver(i) == 0 .or. .not. abs(v - self%v(i)) <= 0   ! drives have branches
      self%v(i) = v
    end do
    i = 1
    do while (i <= self%count)
      select type (bank => banks(self%bank(i))%bank)
      class is (moving_rows_t)
        if (any(self%is_new(i:i + bank%count - 1))) call bank%motions(states(self%bank(i)), self%v(i), self%g(0, i))
        i = i + bank%count
      end select
    end do
    do i = 1, self%count
      self%position(i) = angle(self%element(i)) - self%g(0, i) - self%constant(i)
      if (self%driver(i) > 0) then
        self%speed(i) = 0.0_wp
        self%acceleration(i) = self%g(2, i) * speed(self%driver(i))**2
      else
        self%speed(i) = self%g(1, i)
        self%acceleration(i) = self%g(2, i)
      end if
    end do
  end subroutine move

  !> Sets `terms` at the present position.
  pure subroutine size_terms(self, angle)
    class(row_motions_t), intent(inout) :: self
    real(wp), intent(in) :: angle(:)   !! of all elements [rad]
    integer :: i

    do i = 1, self%count
      self%terms(i) = 1.0_wp + abs(angle(self%element(i))) + abs(self%constant(i)) + abs(self%g(0, i))
      if (self%driver(i) > 0) self%terms(i) = self%terms(i) + abs(self%g(1, i)) * abs(angle(self%driver(i)))
    end do
  end subroutine size_terms

end module nocdyn_row_motions
