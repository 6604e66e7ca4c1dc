!> The joints of a machine in a balance of its torques: bearings with friction, clutches, freewheels and teeth with losses.
!>
!> Of the joints some are at rest; the others slip, and have the moment of slip in the direction of their speed. Teeth with losses
!> that turn have M = -s T, and T follows from the moments of all elements (`nocdyn_tooth_loads`). The ones of elastic elements
!> and of joints at rest are the ones with which the rigid motions take the accelerations that all moments give them (d'Alembert):
!> in a steady state there are none, so that they are the true ones. Where the twists are statically indeterminate, the moments
!> are the ones of springs with the stiffness of the start, and `offset` corrects T.
module nocdyn_joint_balance
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_friction_joints, only: friction_joints_t
  use nocdyn_joint_sets, only: joint_sets_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_linearisation, only: mass_matrix
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_rigid_motions, only: rigid_motions_t
  use nocdyn_tooth_loads, only: tooth_loads_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: dense_motions, loads_by_moments, new_joint_balance, rates_of_elements

  real(wp), parameter :: singular = 1.0e-11_wp   ! relative to the largest singular value

  !> The joints that may lock.
  type, public :: joint_balance_t
    integer :: count = 0
    integer, allocatable :: element(:)           !! of each joint, [joints]
    integer, allocatable :: bank(:), number(:)   !! its bank, and its number there, [joints]
    logical, allocatable :: is_at_rest(:)        !! [joints]
    type(tooth_loads_t) :: teeth                 !! those with losses
    real(wp), allocatable :: by_moment(:, :)     !! T by the moments of the elements that are not elastic, [losses, elements]
    real(wp), allocatable :: offset(:)           !! of T [N m], [losses]
    real(wp), allocatable :: share(:), share_slope(:)   !! s and its derivative by the speed, after `add_losses`, [losses]
    logical, allocatable :: is_driving(:)        !! whether the first wheel drives, [losses]
    real(wp), allocatable :: load(:)             !! T after `add_losses` [N m], [losses]
  contains
    procedure :: choose_modes
    procedure :: add_losses
    procedure :: change_of_losses
    procedure, private :: turns
    procedure, private :: solve_losses
    procedure, private :: set_shares
    procedure, private :: loss_matrix
  end type joint_balance_t

contains

  !> The joints of a formulation, all of which slip.
  function new_joint_balance(joints) result(self)
    type(joint_sets_t), intent(in) :: joints   !! prepared
    type(joint_balance_t) :: self

    self%count = joints%locking
    allocate (self%element, source=joints%element(:joints%locking))
    allocate (self%bank, source=joints%bank(:joints%locking))
    allocate (self%number, source=joints%number(:joints%locking))
    self%teeth = joints%teeth
    allocate (self%is_at_rest(self%count), source=.false.)
    associate (losses => self%teeth%count)
      allocate (self%offset(losses), self%share(losses), self%share_slope(losses), self%load(losses), source=0.0_wp)
      allocate (self%is_driving(losses), source=.false.)
    end associate
  end function new_joint_balance

  !> The speeds of the coordinates in each rigid motion, [coordinates, motions].
  pure function dense_motions(motions) result(matrix)
    type(rigid_motions_t), intent(in) :: motions
    real(wp), allocatable :: matrix(:, :)
    real(wp) :: unit(size(motions%free))
    integer :: i

    allocate (matrix(size(motions%first) - 1, size(unit)))
    do i = 1, size(unit)
      unit = 0.0_wp
      unit(i) = 1.0_wp
      matrix(:, i) = motions%speeds(unit)
    end do
  end function dense_motions

  !> The rates of elements by the speeds of the coordinates, [elements, coordinates].
  pure function rates_of_elements(incidence, elements, coordinates) result(rows)
    type(element_coordinates_t), intent(in) :: incidence
    integer, intent(in) :: elements(:), coordinates   !! numbers of the elements; how many coordinates there are
    real(wp) :: rows(size(elements), coordinates)
    integer :: i, k

    rows = 0.0_wp
    do i = 1, size(elements)
      do k = incidence%first(elements(i)), incidence%first(elements(i) + 1) - 1
        rows(i, incidence%coordinate(k)) = rows(i, incidence%coordinate(k)) + incidence%ratio(1, k)
      end do
    end do
  end function rates_of_elements

  !> The torques T of teeth by the moments of the elements, where some elements keep their twists: those that do are given the
  !> moments that they need for the accelerations of the rigid motions.
  function loads_by_moments(teeth, machine, elements, incidence, motions, rigid) result(by_moment)
    type(tooth_loads_t), intent(in) :: teeth
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements         !! of the machine, differentiated at the start twists
    type(element_coordinates_t), intent(in) :: incidence   !! of its elements
    type(rigid_motions_t), intent(in) :: motions           !! which twist no element of `rigid`
    integer, intent(in) :: rigid(:)                        !! elements, [rigid]
    real(wp), allocatable :: by_moment(:, :)               !! [losses, elements], 0 of those that are rigid
    real(wp), allocatable :: inertia(:, :), inverse(:, :), n(:, :), rows(:, :), torque(:, :)
    real(wp) :: weight(size(rigid))
    integer :: e, i

    allocate (by_moment(teeth%count, machine%elements%count), source=0.0_wp)
    if (teeth%count == 0) return
    by_moment = teeth%by_moment
    allocate (n, source=dense_motions(motions))
    allocate (inertia, source=mass_matrix(machine))
    inertia = matmul(inertia, n)
    allocate (rows, source=rates_of_elements(incidence, [(e, e=1, machine%elements%count)], size(n, 1)))
    torque = -transpose(rows)
    deallocate (rows)
    allocate (inverse, source=pseudo_inverse(matmul(transpose(n), inertia), singular))
    torque = torque - matmul(inertia, matmul(inverse, matmul(transpose(n), torque)))
    deallocate (inverse)
    weight = sqrt(abs(elements%restoring_angle(1, rigid)))
    if (size(weight) > 0) weight = max(weight, 1.0e-3_wp * maxval(weight))
    where (weight <= 0.0_wp) weight = 1.0_wp
    allocate (rows, source=rates_of_elements(incidence, rigid, size(n, 1)))
    do i = 1, size(rigid)
      rows(i, :) = weight(i) * rows(i, :)
    end do
    allocate (inverse, source=pseudo_inverse(transpose(rows), singular))
    torque = matmul(inverse, torque)   ! moments of `rigid` by the ones of all
    by_moment = by_moment + matmul(teeth%by_moment(:, rigid), spread(weight, 2, size(torque, 2)) * torque)
    by_moment(:, rigid) = 0.0_wp
  end function loads_by_moments

  !> Sets the modes by the speeds of the elements.
  subroutine choose_modes(self, machine, state)
    class(joint_balance_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    type(machine_state_t), intent(inout) :: state
    integer :: j

    do j = 1, self%count
      select type (bank => machine%banks(self%bank(j))%bank)
      class is (friction_joints_t)
        call bank%set_mode_by_slip(state%banks(self%bank(j)), self%number(j), state%elements%speed(1, self%element(j)), &
                                   self%is_at_rest(j))
      end select
    end do
  end subroutine choose_modes

  !> Adds the moments of teeth that turn to the ones of the elements, which are evaluated.
  subroutine add_losses(self, machine, elements)
    class(joint_balance_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(inout) :: elements
    real(wp), dimension(self%teeth%count) :: free, moment
    integer, parameter :: together = 6, most_combined = 10
    integer :: first, i, number
    logical :: is_wrong(self%teeth%count), was_driving(self%teeth%count)

    if (self%teeth%count == 0) return
    free = matmul(self%by_moment, elements%restoring(1, :) + elements%applied(1, :)) + self%offset
    was_driving = self%is_driving
    do number = 1, together + 4 * self%teeth%count + 2**min(most_combined, self%teeth%count)
      call self%solve_losses(machine, elements, free, moment, is_wrong)
      if (.not. any(is_wrong)) exit
      if (number <= together) then
        self%is_driving = self%is_driving .neqv. is_wrong
      else if (number <= together + 4 * self%teeth%count) then
        first = findloc(is_wrong, .true., dim=1)
        self%is_driving(first) = .not. self%is_driving(first)
      else
        self%is_driving = [(btest(number - together - 4 * self%teeth%count - 1, modulo(i - 1, most_combined)), &
                            i=1, self%teeth%count)]
      end if
    end do
    if (any(is_wrong)) then   ! there is none; the last modes stand
      self%is_driving = was_driving
      call self%solve_losses(machine, elements, free, moment, is_wrong)
    end if
    elements%applied(1, self%element(self%teeth%joint)) = moment
  end subroutine add_losses

  !> The moments with the present drivers, and which of these contradict them.
  subroutine solve_losses(self, machine, elements, free, moment, is_wrong)
    class(joint_balance_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements
    real(wp), intent(in) :: free(:)      !! T without losses [N m], [losses]
    real(wp), intent(out) :: moment(:)   !! M [N m], [losses]
    logical, intent(out) :: is_wrong(:)
    real(wp), dimension(size(moment), size(moment)) :: inverse, matrix
    real(wp) :: drag(size(moment))
    integer :: i

    call self%set_shares(machine, elements)
    drag = self%share * free
    moment = -drag
    if (any(abs(drag) > 0.0_wp)) then
      matrix = self%loss_matrix()
      inverse = pseudo_inverse(matrix, singular)
      moment = -matmul(inverse, drag)
    end if
    associate (own => self%element(self%teeth%joint))
      self%load = free + matmul(self%by_moment(:, own), moment)
      is_wrong = [(self%turns(i) .and. abs(self%load(i)) > 1.0e-12_wp * (abs(free(i)) + &
                                                                       sum(abs(self%by_moment(i, own) * moment))) .and. &
                   (self%load(i) * elements%speed(1, own(i)) < 0 .neqv. self%is_driving(i)), i=1, size(moment))]
    end associate
  end subroutine solve_losses

  !> Whether teeth turn.
  pure logical function turns(self, loss)
    class(joint_balance_t), intent(in) :: self
    integer, intent(in) :: loss

    turns = .not. self%is_at_rest(self%teeth%joint(loss))
  end function turns

  !> The shares that are lost; 0 of teeth at rest.
  subroutine set_shares(self, machine, elements)
    class(joint_balance_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements
    integer :: i

    self%share = 0.0_wp
    self%share_slope = 0.0_wp
    do i = 1, self%teeth%count
      if (.not. self%turns(i)) cycle
      select type (bank => machine%banks(self%teeth%bank(i))%bank)
      class is (tooth_losses_t)
        call bank%share(self%teeth%number(i), self%is_driving(i), elements%speed(1, self%element(self%teeth%joint(i))), &
                        self%share(i), self%share_slope(i))
      end select
    end do
  end subroutine set_shares

  !> 1 + s V: M = -(1 + s V)^-1 s T, with T without losses.
  pure function loss_matrix(self) result(matrix)
    class(joint_balance_t), intent(in) :: self
    real(wp) :: matrix(self%teeth%count, self%teeth%count)
    integer :: i

    do i = 1, self%teeth%count
      matrix(i, :) = self%share(i) * self%by_moment(i, self%element(self%teeth%joint))
      matrix(i, i) = matrix(i, i) + 1.0_wp
    end do
  end function loss_matrix

  !> The derivatives of the moments of the losses by an unknown, from the ones of the other moments and of the speeds.
  function change_of_losses(self, by_moments, by_speeds) result(change)
    class(joint_balance_t), intent(in) :: self
    real(wp), intent(in) :: by_moments(:), by_speeds(:)   !! [elements]
    real(wp) :: change(self%teeth%count), drag(self%teeth%count)
    real(wp), dimension(self%teeth%count, self%teeth%count) :: inverse, matrix

    matrix = self%loss_matrix()
    inverse = pseudo_inverse(matrix, singular)
    drag = self%share * matmul(self%by_moment, by_moments) &
           + self%share_slope * self%load * by_speeds(self%element(self%teeth%joint))
    change = -matmul(inverse, drag)
  end function change_of_losses

end module nocdyn_joint_balance
