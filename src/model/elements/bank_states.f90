!> What changes while the law of a bank is evaluated: its present branches, its constants on them, work space.
!>
!> The branches follow from the motion by `choose`; they are kept only because a law is one smooth formula on each of them.
module nocdyn_bank_states
  use nocdyn_described_elements, only: described_elements_t, time_reached
  use nocdyn_element_laws, only: element_law_t, new_element_law
  use nocdyn_kinds, only: wp
  use nocdyn_laws, only: strip_lanes
  implicit none (type, external)
  private

  public :: new_bank_state

  type, public :: bank_state_t
    integer, allocatable :: branch(:, :)        !! present branch of each switch, 1 or more, or a segment; [lanes, switches]
    integer, allocatable :: kept_branch(:, :)   !! those of a motion, while other states are observed
    type(element_law_t), allocatable :: law     !! the part of the law that is not polynomial
  contains
    procedure :: refresh_lane
    procedure :: choose
    procedure :: set_branch
    procedure :: indicator
  end type bank_state_t

contains

  !> The state of a bank whose switches are on their first branches.
  function new_bank_state(bank, elements) result(self)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: elements   !! of the machine
    type(bank_state_t) :: self
    integer :: lane

    allocate (self%branch(bank%lanes, size(bank%switch_element)), source=1)
    allocate (self%kept_branch, source=self%branch)
    if (.not. allocated(bank%tape)) return
    allocate (self%law, source=new_element_law(bank%tape, bank%lanes, bank%count, bank%states, &
                                               strip_lanes(bank%lanes, elements)))
    do lane = 1, bank%lanes
      call self%refresh_lane(bank, lane)
    end do
  end function new_bank_state

  !> Computes the constants of the law again, after a change of the parameters of a lane.
  subroutine refresh_lane(self, bank, lane)
    class(bank_state_t), intent(inout) :: self
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: lane
    integer :: e

    if (.not. allocated(self%law)) return
    do e = 1, bank%count
      call refresh_element(self, bank, lane, e, .false.)
    end do
  end subroutine refresh_lane

  subroutine refresh_element(self, bank, lane, element, is_branch_only)
    type(bank_state_t), intent(inout) :: self
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: lane, element
    logical, intent(in) :: is_branch_only   !! whether the parameters are as before

    associate (branch => self%branch(lane, element::bank%count), law => self%law)
      if (allocated(bank%curve)) then
        call law%refresh(lane, element, bank%parameters, branch, is_branch_only, bank%curve(lane, element))
      else
        call law%refresh(lane, element, bank%parameters, branch, is_branch_only)
      end if
    end associate
  end subroutine refresh_element

  !> Sets the branch of a switch in one lane to the one that contains the state.
  subroutine choose(self, bank, switch, lane, t, motion_of_element, internal)
    class(bank_state_t), intent(inout) :: self
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: switch          !! numbered within the bank
    integer, intent(in) :: lane
    real(wp), intent(in) :: t              !! [s]
    real(wp), intent(in) :: motion_of_element(4)   !! u [rad], u' [rad/s] of the switching element, and of its phase
    real(wp), intent(in) :: internal(:)    !! its internal states
    real(wp) :: best, inside, motion(5)
    integer :: before, i, slot

    if (bank%choices(switch) < 0) return
    if (.not. self%law%is_ready) call self%law%make_ready()
    associate (branch => self%branch(lane, switch), e => bank%switch_element(switch), numbers => self%law%numbers)
      before = branch
      slot = self%law%law%slot(lane, e)
      motion = [time_reached(t), motion_of_element]
      if (bank%choices(switch) == 0) then
        call numbers%curve_argument(slot, motion(:3), internal, inside)
        branch = bank%curve(lane, e)%segment(inside)
      else
        best = -huge(best)
        do i = 1, bank%choices(switch)
          call numbers%lowest_guard(slot, number_in_element(bank, switch), i, motion, internal, .false., inside)
          if (inside <= best) cycle
          best = inside
          branch = i
          if (best > 0) exit
        end do
      end if
      if (branch /= before) call refresh_element(self, bank, lane, e, .true.)
    end associate
  end subroutine choose

  !> Sets the branch of a switch in one lane.
  subroutine set_branch(self, bank, switch, lane, branch)
    class(bank_state_t), intent(inout) :: self
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: switch   !! numbered within the bank
    integer, intent(in) :: lane, branch

    if (self%branch(lane, switch) == branch) return
    self%branch(lane, switch) = branch
    call refresh_element(self, bank, lane, bank%switch_element(switch), .true.)
  end subroutine set_branch

  !> Number of a switch among the ones of its element.
  pure integer function number_in_element(bank, switch)
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: switch   !! numbered within the bank

    number_in_element = (switch - 1) / bank%count + 1
  end function number_in_element

  !> Distance of a lane from the nearest boundary of its present branch, in a unit of the law: continuous, negative beyond.
  subroutine indicator(self, bank, switch, lane, motion, internal, distance)
    class(bank_state_t), intent(inout) :: self
    class(described_elements_t), intent(in) :: bank
    integer, intent(in) :: switch          !! numbered within the bank
    integer, intent(in) :: lane
    real(wp), intent(in) :: motion(5)      !! t [s], u [rad], u' [rad/s] of the switching element, and of its phase
    real(wp), intent(in) :: internal(:)    !! its internal states
    real(wp), intent(out) :: distance

    if (.not. self%law%is_ready) call self%law%make_ready()
    call self%law%numbers%lowest_guard(self%law%law%slot(lane, bank%switch_element(switch)), number_in_element(bank, switch), &
                                       self%branch(lane, switch), motion, internal, .true., distance)
  end subroutine indicator

end module nocdyn_bank_states
