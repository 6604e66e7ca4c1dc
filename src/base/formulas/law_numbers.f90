!> The values of a law number by number: the guards of one element in one lane, and all values of a few elements of one lane,
!> which take longer in groups.
module nocdyn_law_numbers
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: at_phase, law_inputs_t, law_tape_t
  use nocdyn_law_values, only: law_program_t, new_law_program
  use nocdyn_laws, only: law_t
  implicit none (type, external)
  private

  public :: new_law_numbers

  integer, parameter :: few = 4   ! elements whose values are computed number by number

  !> The guards of a branch of a switch.
  type, private :: guards_t
    integer :: count = 0
    integer, allocatable :: guard(:), shift(:)   !! nodes, as in `law_tape_t`, [count]
    type(law_program_t) :: program
  end type guards_t

  type, extends(law_inputs_t), public :: law_numbers_t
    logical :: is_small = .false.              !! whether all values are computed so
    real(wp), allocatable, private :: x(:, :)  !! values of all nodes, [0:nodes, slots]
    integer, private :: nodes = 0, elements = 0
    integer, private :: restoring = 0, applied = 0       !! nodes of the results, 0 for none, as in `law_tape_t`
    integer, private :: phase_restoring = 0, phase_applied = 0
    integer, private :: stored = 0, argument = 0
    integer, allocatable, private :: rate(:)
    type(law_program_t), private :: motion, energy, curve
    type(guards_t), allocatable, private :: guards(:, :)   !! [branches, switches of an element]
  contains
    procedure :: set_constants, evaluate, evaluate_energies, lowest_guard, curve_argument
  end type law_numbers_t

contains

  !> Work space for a law; its constants are not yet set.
  function new_law_numbers(law, motion) result(self)
    type(law_t), intent(in) :: law
    integer, intent(in) :: motion(:)   !! nodes of moments and rates
    type(law_numbers_t) :: self
    integer :: slots

    associate (tape => law%tape)
      self%nodes = tape%count
      self%law_inputs_t = tape%inputs()
      self%restoring = tape%restoring
      self%applied = tape%applied
      self%phase_restoring = tape%phase_restoring
      self%phase_applied = tape%phase_applied
      self%stored = tape%stored
      self%argument = tape%argument
      allocate (self%rate, source=tape%rate)
      self%motion = new_law_program(tape, motion)
      self%energy = new_law_program(tape, [tape%stored])
      self%curve = new_law_program(tape, [tape%argument])
      self%is_small = law%lanes == 1 .and. law%elements <= few .and. .not. self%motion%has_harmonics()
      slots = 0
      if (self%is_small) slots = law%elements
      if (size(tape%guard) > 0) slots = size(law%constant, 1)
      allocate (self%x(0:tape%count, slots), source=0.0_wp)
      self%elements = law%elements
      call find_guards(self, tape)
    end associate
  end function new_law_numbers

  !> The guards of each branch that is named; other branches, in the last column, have the guards of all branches.
  pure subroutine find_guards(self, tape)
    type(law_numbers_t), intent(inout) :: self
    type(law_tape_t), intent(in) :: tape
    integer :: branch, i, switch
    logical :: is_of(size(tape%guard))

    allocate (self%guards(maxval([0, tape%guarded_branch]) + 1, maxval([0, tape%guarded_switch])))
    do switch = 1, size(self%guards, 2)
      do branch = 1, size(self%guards, 1)
        is_of = tape%guarded_switch == switch .and. (tape%guarded_branch == 0 .or. tape%guarded_branch == branch)
        associate (guards => self%guards(branch, switch))
          guards%count = count(is_of)
          allocate (guards%guard, source=pack(tape%guard, is_of))
          allocate (guards%shift, source=pack(tape%guard_shift, is_of))
          guards%program = new_law_program(tape, [(guards%guard(i), i=1, guards%count)])
        end associate
      end do
    end do
  end subroutine find_guards

  !> Copies the constants of a slot of the law, or those alone that depend on a branch.
  pure subroutine set_constants(self, law, slot, is_branch_only)
    class(law_numbers_t), intent(inout) :: self
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot   !! counted through all strips
    logical, intent(in) :: is_branch_only
    integer :: i

    if (slot > size(self%x, 2)) return
    if (is_branch_only) then
      do i = 1, size(law%of_branch)
        self%x(law%constants(law%of_branch(i)), slot) = law%constant(slot, law%of_branch(i))
      end do
    else
      do i = 1, size(law%constants)
        self%x(law%constants(i), slot) = law%constant(slot, i)
      end do
    end if
  end subroutine set_constants

  !> Adds the moments of all elements, and sets the rates of the internal states.
  pure subroutine evaluate(self, time, angle, speed, internal, restoring, applied, rate)
    class(law_numbers_t), intent(inout) :: self
    real(wp), intent(in) :: time(1)   !! t [s]
    real(wp), intent(in), dimension(self%elements, self%ports) :: angle, speed            !! u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(size(self%state), self%elements)                     !! internal states
    real(wp), intent(inout), dimension(self%elements, self%ports) :: restoring, applied   !! [N m]
    real(wp), intent(inout) :: rate(size(self%state), self%elements)          !! of the internal states
    integer :: e, i

    do e = 1, self%elements
      call set_inputs(self, e, [time(1), angle(e, 1), speed(e, 1)], internal(:, e))
      if (self%ports == at_phase) call set_phase(self, e, [angle(e, at_phase), speed(e, at_phase)])
      call self%motion%compute(self%nodes, self%x(:, e))
      restoring(e, 1) = restoring(e, 1) + self%x(self%restoring, e)
      applied(e, 1) = applied(e, 1) + self%x(self%applied, e)
      if (self%ports == at_phase) then
        restoring(e, at_phase) = restoring(e, at_phase) + self%x(self%phase_restoring, e)
        applied(e, at_phase) = applied(e, at_phase) + self%x(self%phase_applied, e)
      end if
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

  !> Sets the motion of the phase of an element, after `set_inputs`.
  pure subroutine set_phase(self, element, motion)
    type(law_numbers_t), intent(inout) :: self
    integer, intent(in) :: element
    real(wp), intent(in) :: motion(2)   !! angle [rad], speed [rad/s]

    self%x(self%phase, element) = motion(1)
    self%x(self%phase_speed, element) = motion(2)
    self%x(0, element) = 0.0_wp
  end subroutine set_phase

  !> Adds the energies of the restoring moments of all elements.
  pure subroutine evaluate_energies(self, angle, stored)
    class(law_numbers_t), intent(inout) :: self
    real(wp), intent(in) :: angle(self%elements, self%ports)                      !! u [rad] of elements and phases
    real(wp), intent(inout) :: stored(self%elements)                              !! [J]
    integer :: e

    associate (x => self%x)
      do e = 1, self%elements
        x(self%angle, e) = angle(e, 1)
        if (self%ports == at_phase) x(self%phase, e) = angle(e, at_phase)
        x(0, e) = 0.0_wp
        call self%energy%compute(self%nodes, x(:, e))
        stored(e) = stored(e) + x(self%stored, e)
      end do
    end associate
  end subroutine evaluate_energies

  !> The lowest guard of a branch of a switch: positive inside the branch.
  pure subroutine lowest_guard(self, slot, switch, branch, motion, internal, with_shift, lowest)
    class(law_numbers_t), intent(inout) :: self
    integer, intent(in) :: slot              !! counted through all strips
    integer, intent(in) :: switch, branch    !! of the element
    real(wp), intent(in) :: motion(5)        !! t [s], u [rad], u' [rad/s], the last two of the phase as well
    real(wp), intent(in) :: internal(:)      !! internal states
    logical, intent(in) :: with_shift        !! whether the boundaries are shifted outwards
    real(wp), intent(out) :: lowest          !! in the unit of the guards
    real(wp) :: distance
    integer :: column, i

    lowest = huge(lowest)
    column = size(self%guards, 1)
    if (branch > 0) column = min(branch, column)
    call set_inputs(self, slot, motion(:3), internal)
    if (self%ports == at_phase) call set_phase(self, slot, motion(4:))
    associate (guards => self%guards(column, switch), x => self%x)
      call guards%program%compute(self%nodes, x(:, slot))
      do i = 1, guards%count
        distance = x(guards%guard(i), slot)
        if (with_shift) distance = distance + x(guards%shift(i), slot)
        lowest = min(lowest, distance)
      end do
    end associate
  end subroutine lowest_guard

  !> The argument of the curve of a slot.
  pure subroutine curve_argument(self, slot, motion, internal, argument)
    class(law_numbers_t), intent(inout) :: self
    integer, intent(in) :: slot              !! counted through all strips
    real(wp), intent(in) :: motion(3)        !! t [s], u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(:)      !! internal states
    real(wp), intent(out) :: argument        !! in the unit of the curve

    call set_inputs(self, slot, motion, internal)
    call self%curve%compute(self%nodes, self%x(:, slot))
    argument = self%x(self%argument, slot)
  end subroutine curve_argument

end module nocdyn_law_numbers
