!> The moments of the losses of teeth in a steady state.
!>
!> The moments M = -s T follow from the torques T of the teeth (`nocdyn_tooth_losses`), and these from all moments of the steady
!> state: a fixed point. It is found by Anderson's mixing (H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49, 2011), which needs one
!> steady state more than there are losses where all laws are linear.
module nocdyn_steady_losses
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: joined, string_t
  use nocdyn_tooth_loads, only: new_tooth_loads, tooth_loads_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: describe_losses, new_steady_losses, tell_losses

  integer, parameter :: most_differences = 10   ! that are mixed
  integer, parameter :: most_names = 5          ! in a message

  !> The search of the moments of one machine.
  type, public :: steady_losses_t
    integer :: count = 0
    real(wp), allocatable :: moment(:)             !! of each loss [N m]
    type(tooth_loads_t), private :: teeth
    real(wp), private :: difference = huge(1.0_wp)   !! of the last step, a share of the torques
    real(wp), allocatable, private :: tried(:, :)  !! moments of the last steps, [losses, steps]
    real(wp), allocatable, private :: error(:, :)  !! by which they differed from those that follow
  contains
    procedure :: improve
  end type steady_losses_t

contains

  !> The losses of a machine, without moments.
  function new_steady_losses(machine) result(self)
    type(machine_t), intent(inout) :: machine   !! of one lane
    type(steady_losses_t) :: self
    integer, allocatable :: bank(:), number(:)
    integer :: b, e

    allocate (bank(0), number(0))
    do b = 1, size(machine%banks)
      select type (losses => machine%banks(b)%bank)
      class is (tooth_losses_t)
        if (losses%are_joints) cycle
        bank = [bank, spread(b, 1, losses%count)]
        number = [number, (e, e=1, losses%count)]
      end select
    end do
    self%teeth = new_tooth_loads(machine%banks, bank, number, machine%elements%count)
    self%count = size(bank)
    call self%teeth%find_coefficients(machine%banks, machine%elements%rows, machine%coordinates, machine%constraints%rows(), &
                                      machine%bodies)
    allocate (self%moment(self%count), source=0.0_wp)
    allocate (self%tried(self%count, 0), self%error(self%count, 0))
  end function new_steady_losses

  !> Improves the moments by a steady state with the present ones.
  subroutine improve(self, formulation, t, y, is_solved)
    class(steady_losses_t), intent(inout) :: self
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t         !! [s]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [1, states]
    logical, intent(out) :: is_solved   !! whether they follow from this state
    real(wp), parameter :: rounding = 1.0e-15_wp, tolerance = 1.0e-10_wp   ! shares of the torques
    real(wp) :: difference, following(self%count), torque(self%count)

    call formulation%observe([t], y)
    associate (elements => formulation%machine%elements)
      torque = self%teeth%torques_of(elements%restoring(1, :) + elements%applied(1, :))
    end associate
    call find_following(self, formulation%machine, torque, following)
    difference = maxval(abs(following - self%moment)) / max(maxval(abs([torque, following])), tiny(difference))
    is_solved = difference <= rounding .or. (difference <= tolerance .and. difference >= self%difference)
    self%difference = difference
    if (.not. is_solved) call mix(self, following)
  end subroutine improve

  !> The moments that follow from torques of the teeth. Wheels that stand still may have any between bounds.
  subroutine find_following(self, machine, torque, moment)
    type(steady_losses_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: torque(:)    !! T [N m]
    real(wp), intent(out) :: moment(:)   !! M [N m]
    real(wp), parameter :: standstill = 1.0e-9_wp   ! rad/s
    real(wp) :: least, most, share, slope, speed
    integer :: i

    moment = 0.0_wp
    do i = 1, self%count
      select type (bank => machine%banks(self%teeth%bank(i))%bank)
      class is (tooth_losses_t)
        speed = machine%elements%speed(1, bank%first - 1 + self%teeth%number(i))
        if (abs(speed) <= standstill) then
          call bank%range_under_load(self%teeth%number(i), torque(i), least, most)
          moment(i) = min(max(self%moment(i), least), most)
        else
          call bank%share(self%teeth%number(i), torque(i) * speed < 0, speed, share, slope)
          moment(i) = -share * torque(i)
        end if
      end select
    end do
  end subroutine find_following

  !> Anderson's mixing: the combination of the last steps with the least error.
  subroutine mix(self, following)
    type(steady_losses_t), intent(inout) :: self
    real(wp), intent(in) :: following(:)
    real(wp), parameter :: rounding = 1.0e-10_wp
    real(wp), allocatable :: errors(:, :), weights(:)
    integer :: i, n

    self%tried = reshape([self%moment, self%tried], [self%count, size(self%tried, 2) + 1])
    self%error = reshape([following - self%moment, self%error], [self%count, size(self%error, 2) + 1])
    n = min(size(self%tried, 2), most_differences + 1, self%count + 1) - 1   ! of differences
    self%moment = following
    if (n == 0) return
    allocate (errors(self%count, n))
    do i = 1, n
      errors(:, i) = self%error(:, 1) - self%error(:, i + 1)
    end do
    allocate (weights, source=matmul(pseudo_inverse(errors, rounding), self%error(:, 1)))
    do i = 1, n
      self%moment = self%moment - weights(i) * (self%tried(:, 1) - self%tried(:, i + 1) + errors(:, i))
    end do
  end subroutine mix

  !> Gives the losses of a machine their moments.
  subroutine tell_losses(machine, moments)
    type(machine_t), intent(inout) :: machine
    real(wp), intent(in) :: moments(:)   !! [N m], [losses], in the order of the banks
    integer :: b, told

    told = 0
    do b = 1, size(machine%banks)
      select type (losses => machine%banks(b)%bank)
      class is (tooth_losses_t)
        if (losses%are_joints) cycle
        call losses%tell(moments(told + 1:told + losses%count))
        told = told + losses%count
      end select
    end do
  end subroutine tell_losses

  !> "'worm', 'stage'": the teeth with losses; '' if there are none.
  subroutine describe_losses(machine, text)
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable, intent(out) :: text
    type(string_t), allocatable :: names(:)
    integer :: b

    allocate (names(0))
    do b = 1, size(machine%banks)
      select type (losses => machine%banks(b)%bank)
      class is (tooth_losses_t)
        names = [names, losses%names]
      end select
    end do
    text = ''
    if (size(names) > 0) text = joined(names, ', ', most_names)
  end subroutine describe_losses

end module nocdyn_steady_losses
