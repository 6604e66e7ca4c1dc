!> How the moments of the elements change about a state: the linear machine of every analysis.
!>
!> Relative damping is the imaginary part `loss` of a stiffness at every frequency. Over the time a viscous damping stands for it,
!> which is no part of the linear machine.
!>
!> Rubber couplings have the stiffness and the relative damping of a condition: at first the one without vibration, at their mean
!> torque; `set_conditions` sets others. Their factors over the frequency are in `find_stiffness` only: `stiffness` and `loss` are
!> those at the frequency of the data sheet.
module nocdyn_slopes
  use nocdyn_elements, only: element_values_t, internal_states_t
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_rubber_laws, only: rubber_condition_t, rubber_law_t
  use nocdyn_text, only: quoted
  implicit none (type, external)
  private

  public :: new_slopes

  type, public :: slopes_t
    real(wp), allocatable :: stiffness(:)          !! minus the derivatives of the moments by the twists [N m/rad], [elements]
    real(wp), allocatable :: loss(:)               !! the imaginary part of the stiffness [N m/rad], [elements]
    real(wp), allocatable :: damping(:)            !! minus the derivatives by the rates of twist, without the two below
                                                   !! [N m s/rad], [elements]
    real(wp), allocatable :: stand_in(:)           !! viscous damping in place of `loss` over the time, the same
    real(wp), allocatable :: mean_damping(:)       !! of torques that follow the mean rotation: of rigid motions only
    real(wp), allocatable :: by_internal(:)        !! derivatives of the moments by internal states, [internal states]
    real(wp), allocatable :: rate_speed(:)         !! derivatives of their rates by the speed of the element, the same
    real(wp), allocatable :: rate_internal(:, :)   !! derivatives of the rates by the states of the element, [members, the same]
    type(rubber_law_t), allocatable :: rubber(:)   !! rubber couplings
    type(rubber_condition_t), allocatable :: condition(:)        !! their conditions
    real(wp), allocatable, private :: law_stiffness(:), law_loss(:)   !! of these by the laws over the time [N m/rad]
  contains
    procedure :: find_stiffness, find_delay, set_conditions
  end type slopes_t

contains

  !> The slopes of a machine of one lane from its elements, which are evaluated and differentiated.
  subroutine new_slopes(machine, elements, self, error, weight)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements     !! of the machine
    type(slopes_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if a number is not finite; `self` is complete
    real(wp), intent(in), optional :: weight(:)        !! factors on the moments, [elements]; absent: 1
    real(wp) :: factor(machine%elements%count)
    integer :: b, e

    factor = 1.0_wp
    if (present(weight)) factor = weight
    allocate (self%loss(size(factor)), self%stand_in(size(factor)), source=0.0_wp)
    associate (internal => elements%internal, follows => machine%follows_mean_speed())
      self%stiffness = -factor * (elements%restoring_angle(1, :) + elements%applied_angle(1, :))
      self%damping = -factor * elements%applied_speed(1, :)
      do b = 1, size(machine%banks)
        associate (bank => machine%banks(b)%bank)
          if (.not. allocated(bank%loss_factor)) cycle
          self%loss(bank%first:bank%last()) = self%stiffness(bank%first:bank%last()) * bank%loss_factor
          self%stand_in(bank%first:bank%last()) = bank%stand_in(self%stiffness(bank%first:bank%last()))
        end associate
      end do
      self%damping = self%damping - self%stand_in
      call add_rubber(machine, elements, self)
      self%mean_damping = merge(self%damping, 0.0_wp, follows)
      where (follows) self%damping = 0.0_wp
      call split_damping(machine, elements, self)
      self%by_internal = factor(machine%elements%internal%element) * internal%applied(1, :)
      self%rate_speed = internal%rate_speed(1, :)
      self%rate_internal = internal%rate_internal(1, :, :)
      do e = 1, size(factor)
        if (all(is_finite([self%stiffness(e), self%damping(e) + self%mean_damping(e), &
                           elements%restoring(1, e) + elements%applied(1, e)]))) cycle
        call raise(error, exit_failed, 'the moment, stiffness or damping of ' // quoted(machine%element_name(e)) // &
                   ' in this state is not a finite number')
        return
      end do
    end associate
  end subroutine new_slopes

  !> Gives rubber couplings the stiffness and the relative damping without vibration.
  subroutine add_rubber(machine, elements, self)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements   !! of the machine
    type(slopes_t), intent(inout) :: self
    integer :: r

    if (allocated(machine%rubber)) allocate (self%rubber, source=machine%rubber)
    if (.not. allocated(self%rubber)) allocate (self%rubber(0))
    allocate (self%condition(size(self%rubber)))
    associate (e => self%rubber%element)
      self%law_stiffness = self%stiffness(e)
      self%law_loss = self%loss(e)
    end associate
    do r = 1, size(self%rubber)
      associate (e => self%rubber(r)%element)
        self%condition(r) = self%rubber(r)%cold(elements%restoring(1, e) + elements%applied(1, e))
      end associate
    end do
    call self%set_conditions(self%condition)
  end subroutine add_rubber

  !> Sets the conditions of the rubber couplings.
  pure subroutine set_conditions(self, condition)
    class(slopes_t), intent(inout) :: self
    type(rubber_condition_t), intent(in) :: condition(:)   !! [rubber couplings]
    real(wp) :: ratio(2)
    integer :: r

    do r = 1, size(condition)
      self%condition(r) = condition(r)
      ratio = self%rubber(r)%factors(condition(r))
      self%stiffness(self%rubber(r)%element) = ratio(1) * self%law_stiffness(r)
      self%loss(self%rubber(r)%element) = ratio(1) * ratio(2) * self%law_loss(r)
    end do
  end subroutine set_conditions

  !> Gives elements that damp vibrations otherwise than the mean rotation both of their slopes.
  pure subroutine split_damping(machine, elements, self)
    type(machine_t), intent(in) :: machine
    type(element_values_t), intent(in) :: elements   !! of the machine
    type(slopes_t), intent(inout) :: self
    real(wp) :: damping
    integer :: b, e, i

    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (.not. allocated(bank%vibration_damping)) cycle
        do i = 1, bank%count
          e = bank%first + i - 1
          damping = bank%vibration_damping(i)
          if (abs(elements%speed(1, e)) > 0) damping = damping - bank%vibration_factor(i) * elements%applied(1, e) &
                                                                / elements%speed(1, e)
          self%mean_damping(e) = self%damping(e) - damping
          self%damping(e) = damping
        end do
      end associate
    end do
  end subroutine split_damping

  !> The complex stiffnesses D_e of motions exp(lambda t), and their derivatives by lambda, in which the relative damping stays as
  !> it is: k + lambda c + i loss at a frequency, less the moments of the internal states.
  pure subroutine find_stiffness(self, internal, value, stiffness, slope)
    class(slopes_t), intent(in) :: self
    type(internal_states_t), intent(in) :: internal   !! of the machine
    complex(wp), intent(in) :: value                  !! lambda, imaginary part >= 0 [1/s]
    complex(wp), intent(out) :: stiffness(:)          !! [N m/rad], [elements]
    complex(wp), intent(out), optional :: slope(:)    !! [N m s/rad], [elements]
    complex(wp) :: delay, turn
    integer :: r, s

    turn = (0.0_wp, 1.0_wp)
    if (aimag(value) > 0) turn = value / aimag(value)
    stiffness = self%stiffness + (value * self%damping + turn * self%loss)
    if (present(slope)) then
      slope = self%damping
      if (aimag(value) > 0) slope = self%damping + self%loss / aimag(value)
    end if
    do r = 1, size(self%rubber)
      associate (e => self%rubber(r)%element)
        if (present(slope)) then
          call add_frequency(self, r, value, stiffness(e), slope(e))
        else
          call add_frequency(self, r, value, stiffness(e))
        end if
      end associate
    end do
    do s = 1, internal%count
      if (internal%first(s) /= s) cycle
      associate (e => internal%element(s))
        if (present(slope)) then
          call self%find_delay(internal, s, value, delay, turn)
          slope(e) = slope(e) - turn
        else
          call self%find_delay(internal, s, value, delay)
        end if
        stiffness(e) = stiffness(e) - delay
      end associate
    end do
  end subroutine find_stiffness

  !> Adds what the factors over the frequency change in the complex stiffness of a rubber coupling. Along the axis of the
  !> frequencies its derivative by lambda = i Omega is the one by Omega over i.
  pure subroutine add_frequency(self, number, value, stiffness, slope)
    class(slopes_t), intent(in) :: self
    integer, intent(in) :: number                      !! of the rubber coupling
    complex(wp), intent(in) :: value                   !! lambda [1/s]
    complex(wp), intent(inout) :: stiffness            !! [N m/rad]
    complex(wp), intent(inout), optional :: slope      !! [N m s/rad]
    complex(wp), parameter :: i = (0.0_wp, 1.0_wp)
    complex(wp) :: turn
    real(wp) :: change(2), loss, rate

    associate (factors => self%rubber(number)%by_frequency, e => self%rubber(number)%element, omega => aimag(value))
      if (.not. factors%are_given) return
      turn = i
      if (omega > 0) turn = value / omega
      loss = factors%stiffness(omega) * factors%damping(omega)
      change = [factors%stiffness(omega) - 1.0_wp, loss - 1.0_wp]
      stiffness = stiffness + change(1) * self%stiffness(e) + change(2) * turn * self%loss(e)
      if (.not. present(slope)) return
      rate = factors%stiffness_slope(omega) * factors%damping(omega) + factors%stiffness(omega) * factors%damping_slope(omega)
      if (omega > 0) slope = slope + change(2) * self%loss(e) / omega
      slope = slope - i * factors%stiffness_slope(omega) * self%stiffness(e) - i * rate * turn * self%loss(e)
    end associate
  end subroutine add_frequency

  !> The moment h^T (lambda - A)^-1 b lambda of the internal states of an element per unit of its twist, and its derivative by
  !> lambda.
  pure subroutine find_delay(self, internal, first, value, moment, slope)
    class(slopes_t), intent(in) :: self
    type(internal_states_t), intent(in) :: internal   !! of the machine
    integer, intent(in) :: first        !! the first of the states
    complex(wp), intent(in) :: value    !! lambda [1/s]
    complex(wp), intent(out) :: moment
    complex(wp), intent(out), optional :: slope
    complex(wp), dimension(internal%members(first)) :: z, z_slope
    complex(wp) :: matrix(size(z), size(z)), again(size(z), size(z))
    integer :: i

    do i = 1, size(z)
      matrix(i, :) = -self%rate_internal(:size(z), first + i - 1)
      matrix(i, i) = matrix(i, i) + value
    end do
    z = cmplx(self%rate_speed(first:first + size(z) - 1), kind=wp)
    again = matrix
    call complex_solve(again, z)
    associate (by_internal => self%by_internal(first:first + size(z) - 1))
      moment = value * sum(by_internal * z)
      if (.not. present(slope)) return
      z_slope = z
      call complex_solve(matrix, z_slope)
      slope = sum(by_internal * z) - value * sum(by_internal * z_slope)
    end associate
  end subroutine find_delay

end module nocdyn_slopes
