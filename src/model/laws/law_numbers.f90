!> The values of a law number by number: the guards of one element in one lane, and all values of a few elements of one lane,
!> which take longer in groups.
module nocdyn_law_numbers
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: op_angle, op_speed, op_state, op_time
  use nocdyn_law_values, only: law_program_t, new_law_program
  use nocdyn_laws, only: law_t
  implicit none (type, external)
  private

  public :: new_law_numbers

  integer, parameter :: few = 4   ! elements whose values are computed number by number

  type, public :: law_numbers_t
    logical :: is_small = .false.              !! whether all values are computed so
    real(wp), allocatable, private :: x(:, :)  !! values of all nodes, [0:nodes, elements]; of one element if not `is_small`
    integer, private :: nodes = 0
    integer, private :: angle = 0, speed = 0, time = 0   !! nodes of the inputs, 0 where the law does not read them
    integer, allocatable, private :: state(:)            !! the same for internal states
    integer, private :: restoring = 0, applied = 0       !! nodes of the results, 0 for none, as in `law_tape_t`
    integer, private :: stored = 0, secant = 0, damping = 0, argument = 0
    integer, allocatable, private :: rate(:)
    integer, allocatable, private :: guard(:), switch(:), branch(:), shift(:)
    type(law_program_t), private :: motion, energy, guards
  contains
    procedure :: set_constants
    procedure :: evaluate
    procedure :: evaluate_energies
    procedure :: compute_guards
    procedure :: lowest_guard
    procedure :: curve_argument
  end type law_numbers_t

contains

  !> Work space for a law; its constants are not yet set.
  function new_law_numbers(law, motion) result(self)
    type(law_t), intent(in) :: law
    integer, intent(in) :: motion(:)   !! nodes of moments and rates
    type(law_numbers_t) :: self
    integer :: i

    associate (tape => law%tape)
      self%nodes = tape%count
      self%angle = tape%input(op_angle)
      self%speed = tape%input(op_speed)
      self%time = tape%input(op_time)
      allocate (self%state, source=[(tape%input(op_state, i), i=1, size(tape%rate))])
      self%restoring = tape%restoring
      self%applied = tape%applied
      self%stored = tape%stored
      self%secant = tape%secant
      self%damping = tape%damping
      self%argument = tape%argument
      allocate (self%rate, source=tape%rate)
      allocate (self%guard, source=tape%guard)
      allocate (self%switch, source=tape%guarded_switch)
      allocate (self%branch, source=tape%guarded_branch)
      allocate (self%shift, source=tape%guard_shift)
      self%motion = new_law_program(tape, motion)
      self%energy = new_law_program(tape, [tape%stored, tape%secant, tape%damping])
      self%guards = new_law_program(tape, [tape%guard, tape%argument])
      self%is_small = law%lanes == 1 .and. law%elements <= few .and. .not. self%motion%has_harmonics()
      allocate (self%x(0:tape%count, merge(law%elements, 1, self%is_small)), source=0.0_wp)
    end associate
  end function new_law_numbers

  !> Copies the constants of a slot of the law to an element.
  pure subroutine set_constants(self, element, law, slot)
    class(law_numbers_t), intent(inout) :: self
    type(law_t), intent(in) :: law
    integer, intent(in) :: element, slot
    integer :: i

    do i = 1, size(law%constants)
      self%x(law%constants(i), element) = law%constant(slot, i)
    end do
  end subroutine set_constants

  !> Adds the moments of all elements, and sets the rates of the internal states.
  pure subroutine evaluate(self, time, angle, speed, internal, restoring, applied, rate)
    class(law_numbers_t), intent(inout) :: self
    real(wp), intent(in) :: time(1)   !! t [s]
    real(wp), intent(in), dimension(size(self%x, 2)) :: angle, speed            !! u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(size(self%state), size(self%x, 2))         !! internal states
    real(wp), intent(inout), dimension(size(self%x, 2)) :: restoring, applied   !! [N m]
    real(wp), intent(inout) :: rate(size(self%state), size(self%x, 2))          !! of the internal states
    integer :: e, i

    do e = 1, size(self%x, 2)
      call set_inputs(self, e, [time(1), angle(e), speed(e)], internal(:, e))
      call self%motion%compute(self%nodes, self%x(:, e))
      restoring(e) = restoring(e) + self%x(self%restoring, e)
      applied(e) = applied(e) + self%x(self%applied, e)
      do i = 1, size(self%state)
        rate(i, e) = self%x(self%rate(i), e)
      end do
    end do
  end subroutine evaluate

  !> Sets the values of the inputs of an element.
  pure subroutine set_inputs(self, element, motion, internal)
    type(law_numbers_t), intent(inout) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: motion(3)     !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states

    integer :: i

    associate (x => self%x)
      x(self%time, element) = motion(1)
      x(self%angle, element) = motion(2)
      x(self%speed, element) = motion(3)
      do i = 1, size(self%state)
        x(self%state(i), element) = internal(i)
      end do
      x(0, element) = 0.0_wp   ! which stands for what the law has not
    end associate
  end subroutine set_inputs

  !> Adds the energies of the restoring moments of all elements, their secant stiffnesses and viscous dampings.
  pure subroutine evaluate_energies(self, angle, stored, secant, damping)
    class(law_numbers_t), intent(inout) :: self
    real(wp), intent(in), dimension(size(self%x, 2)) :: angle                       !! u [rad]
    real(wp), intent(inout), dimension(size(self%x, 2)) :: stored, secant, damping  !! [J], [N m/rad], [N m s/rad]
    integer :: e

    associate (x => self%x)
      do e = 1, size(x, 2)
        x(self%angle, e) = angle(e)
        x(0, e) = 0.0_wp
        call self%energy%compute(self%nodes, x(:, e))
        stored(e) = stored(e) + x(self%stored, e)
        secant(e) = secant(e) + x(self%secant, e)
        damping(e) = damping(e) + x(self%damping, e)
      end do
    end associate
  end subroutine evaluate_energies

  !> Computes the guards of the branches, and the argument of the curve, of an element.
  pure subroutine compute_guards(self, element, motion, internal)
    class(law_numbers_t), intent(inout) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: motion(3)     !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)   !! internal states

    call set_inputs(self, element, motion, internal)
    call self%guards%compute(self%nodes, self%x(:, element))
  end subroutine compute_guards

  !> The lowest guard of a branch of a switch, after `compute_guards`: positive inside the branch.
  pure real(wp) function lowest_guard(self, element, switch, branch, with_shift) result(lowest)
    class(law_numbers_t), intent(in) :: self
    integer, intent(in) :: element
    integer, intent(in) :: switch, branch    !! of the element
    logical, intent(in) :: with_shift        !! whether the boundaries are shifted outwards
    real(wp) :: distance
    integer :: column, i

    lowest = huge(lowest)
    column = min(element, size(self%x, 2))
    do i = 1, size(self%guard)
      if (self%switch(i) /= switch) cycle
      if (self%branch(i) /= 0 .and. self%branch(i) /= branch) cycle
      distance = self%x(self%guard(i), column)
      if (with_shift) distance = distance + self%x(self%shift(i), column)
      lowest = min(lowest, distance)
    end do
  end function lowest_guard

  !> The argument of the curve of an element, after `compute_guards`.
  pure real(wp) function curve_argument(self, element)
    class(law_numbers_t), intent(in) :: self
    integer, intent(in) :: element

    curve_argument = self%x(self%argument, min(element, size(self%x, 2)))
  end function curve_argument

end module nocdyn_law_numbers
