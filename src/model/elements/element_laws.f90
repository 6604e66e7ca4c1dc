!> Evaluates the law of the elements of a bank: moments, rates of internal states, derivatives, energies, guards of branches.
!>
!> All of it follows from one list of operations by Taylor arithmetic: the values are the coefficients 0; the derivatives by an
!> input are the coefficients 1 where that input has the coefficient 1 and all others have none. The values of a few elements of
!> one lane are computed number by number.
module nocdyn_element_laws
  use nocdyn_elements, only: element_values_t, internal_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_numbers, only: law_numbers_t, new_law_numbers
  use nocdyn_law_strips, only: fill, load, load_lanes, unload
  use nocdyn_law_tape, only: at_phase, law_inputs_t, law_tape_t
  use nocdyn_law_walk, only: walk
  use nocdyn_law_waves, only: fastest_wave, has_waves
  use nocdyn_law_work, only: law_work_t, new_law_work
  use nocdyn_curves, only: curve_t
  use nocdyn_laws, only: law_parameter_t, law_t, new_law
  implicit none (type, external)
  private

  public :: new_element_law

  type, extends(law_inputs_t), public :: element_law_t
    type(law_t) :: law
    integer :: states = 0                       !! internal states of each element
    type(law_work_t) :: values                  !! of the moments and rates
    type(law_work_t) :: series                  !! of the moments and rates, with the coefficients of a series
    type(law_work_t), private :: tangents       !! of the moments and rates, with two coefficients more
    type(law_work_t), private :: energies
    type(law_work_t), private :: guards
    logical :: is_ready = .false.               !! whether there is work space for values and guards
    logical :: has_waves = .false.              !! whether there are sines of variables
    type(law_numbers_t) :: numbers              !! the guards, and all values if there are few elements
  contains
    procedure :: refresh, take_constants
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
    procedure :: lowest_guards
    procedure :: fastest => fastest_of_elements
    procedure :: make_ready
    procedure :: prepare_series
  end type element_law_t

contains

  !> The law with a list, for a block; its constants are not yet set.
  function new_element_law(tape, lanes, elements, states, strip) result(self)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: lanes, elements
    integer, intent(in) :: states   !! of each element
    integer, intent(in) :: strip    !! lanes of a strip: 1 of a block of one lane, else whole groups
    type(element_law_t) :: self

    self%law = new_law(tape, lanes, elements, strip)
    self%states = states
    self%has_waves = has_waves(tape)
    self%law_inputs_t = tape%inputs()
  end function new_element_law

  !> Allocates the work space for values and guards when they are first asked for: most machines of a sweep are only looked at.
  subroutine make_ready(self)
    class(element_law_t), intent(inout) :: self
    integer :: slot

    self%is_ready = .true.
    associate (tape => self%law%tape, w => self%law%w, groups => self%law%groups)
      self%values = new_law_work(tape, tape%needed(motion(tape), .false.), 0, w, groups)
      self%tangents = new_law_work(tape, tape%needed(motion(tape), .true.), 2, w, groups)
      self%energies = new_law_work(tape, tape%needed([tape%stored], .false.), 0, w, groups)
      if (self%law%strip > 1 .and. size(tape%guard) > 0) then
        self%guards = new_law_work(tape, tape%needed(tape%guard, .false.), 0, w, groups)
      end if
      self%numbers = new_law_numbers(self%law, motion(tape))
    end associate
    do slot = 1, size(self%law%constant, 1)
      call self%numbers%set_constants(self%law, slot, .false.)
    end do
  end subroutine make_ready

  !> The nodes of moments and rates.
  pure function motion(tape) result(nodes)
    type(law_tape_t), intent(in) :: tape
    integer, allocatable :: nodes(:)

    nodes = [tape%restoring, tape%applied, tape%phase_restoring, tape%phase_applied, tape%rate]
  end function motion

  !> Computes the constants of an element in one lane, after a change of its parameters, or of a branch alone.
  subroutine refresh(self, lane, element, parameters, branch, is_branch_only, curve)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: lane, element
    type(law_parameter_t), intent(in) :: parameters(:)
    integer, intent(in) :: branch(:)                !! as in `law_t`
    logical, intent(in) :: is_branch_only
    type(curve_t), intent(in), optional :: curve    !! of the element, on the segment branch(1)

    call self%law%refresh(lane, element, parameters, branch, is_branch_only, curve)
    if (self%is_ready) call self%numbers%set_constants(self%law, self%law%slot(lane, element), is_branch_only)
  end subroutine refresh

  !> Takes the constants of an element in one lane that depend on branches, after a program has computed them.
  subroutine take_constants(self, lane, element)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: lane, element

    if (self%is_ready) call self%numbers%set_constants(self%law, self%law%slot(lane, element), .true.)
  end subroutine take_constants

  !> Adds the moments, and sets the rates of the internal states. Phases follow all elements.
  subroutine evaluate(self, time, angle, speed, internal, restoring, applied, rate)
    class(element_law_t), intent(inout) :: self
    real(wp), intent(in) :: time(self%law%lanes)   !! t [s]
    real(wp), intent(in), dimension(self%law%lanes, self%law%elements, self%ports) :: angle, speed   !! u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(self%law%lanes, self%states, self%law%elements)     !! internal states
    real(wp), intent(inout), dimension(self%law%lanes, self%law%elements, self%ports) :: restoring, applied   !! [N m]
    real(wp), intent(inout) :: rate(self%law%lanes, self%states, self%law%elements)      !! of the internal states
    integer :: i, strip

    if (.not. self%is_ready) call make_ready(self)
    if (self%numbers%is_small) then
      call self%numbers%evaluate(time, angle, speed, internal, restoring, applied, rate)
      return
    end if
    rate = 0.0_wp
    associate (law => self%law, tape => self%law%tape, values => self%values)
      do strip = 1, law%strips
        call load_inputs(self, values, strip, time, angle, speed, internal)
        call walk(law, values, 0, law%groups * (strip - 1) + 1)
        call unload(law, values, tape%restoring, 0, strip, 1, 1, restoring)
        call unload(law, values, tape%applied, 0, strip, 1, 1, applied)
        call unload(law, values, tape%phase_restoring, 0, strip, 1, 1, restoring(1, 1, self%ports))
        call unload(law, values, tape%phase_applied, 0, strip, 1, 1, applied(1, 1, self%ports))
        do i = 1, self%states
          call unload(law, values, tape%rate(i), 0, strip, self%states, i, rate)
        end do
      end do
    end associate
  end subroutine evaluate

  !> Sets the coefficients 0 of the inputs of a strip.
  subroutine load_inputs(self, work, strip, time, angle, speed, internal)
    class(element_law_t), intent(in) :: self
    type(law_work_t), intent(inout) :: work
    integer, intent(in) :: strip
    real(wp), intent(in) :: time(self%law%lanes)   !! t [s]
    real(wp), intent(in), dimension(self%law%lanes, self%law%elements, self%ports) :: angle, speed   !! u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(self%law%lanes, self%states, self%law%elements)     !! internal states
    integer :: i

    call load(self%law, work, self%angle, 0, strip, 1, 1, angle)
    call load(self%law, work, self%speed, 0, strip, 1, 1, speed)
    call load(self%law, work, self%phase, 0, strip, 1, 1, angle(1, 1, self%ports))
    call load(self%law, work, self%phase_speed, 0, strip, 1, 1, speed(1, 1, self%ports))
    call load_lanes(self%law, work, self%time, 0, strip, time)
    do i = 1, self%states
      call load(self%law, work, self%state(i), 0, strip, self%states, i, internal)
    end do
  end subroutine load_inputs

  !> Adds the derivatives of the moments, and sets the ones of the internal states.
  subroutine differentiate(self, first, first_internal, first_cross, elements)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: first, first_internal   !! first element and internal state of the bank in the machine
    integer, intent(in) :: first_cross             !! first of its derivatives between elements and phases
    type(element_values_t), intent(inout) :: elements
    real(wp) :: none(0)
    integer :: e, i, strip

    if (.not. self%is_ready) call make_ready(self)
    if (self%states > 0) then
      call clear_internal(first_internal, first_internal + self%states * self%law%elements - 1, elements%internal)
    end if
    associate (law => self%law, work => self%tangents, to => elements, z => elements%internal)
      do strip = 1, law%strips
        if (self%states > 0) then
          call load_inputs(self, work, strip, to%time, to%angle(1, first), to%speed(1, first), z%value(1, first_internal))
        else
          call load_inputs(self, work, strip, to%time, to%angle(1, first), to%speed(1, first), none)
        end if
        call walk(law, work, 0, law%groups * (strip - 1) + 1)
        call differentiate_by_motion(self, strip, first, first_internal, elements)
        if (self%ports == at_phase) call differentiate_phases(self, strip, first, first_cross, elements)
        call differentiate_by_states(self, strip, first_internal, z)
      end do
      if (self%ports == at_phase) then   ! `mixed` has half of the second derivatives along both angles
        do e = 1, law%elements
          do i = 0, 1
            associate (pair => first_cross + 2 * (e - 1) + i, own => to%restoring_curvature(:, first - 1 + e + i * law%elements))
              to%cross%mixed(:, pair) = to%cross%mixed(:, pair) - 0.5_wp * (own + to%cross%curvature(:, pair))
            end associate
          end do
        end do
      end if
    end associate
  end subroutine differentiate

  !> Derivatives by the angle, the speed and the time in a strip, after `walk` for the values.
  subroutine differentiate_by_motion(self, strip, first, first_internal, to)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: strip, first, first_internal
    type(element_values_t), intent(inout) :: to
    integer :: i

    associate (law => self%law, tape => self%law%tape, work => self%tangents)
      if (self%angle > 0) then
        call turn(self, strip, [self%angle], 2)
        call unload(law, work, tape%restoring, 1, strip, 1, 1, to%restoring_angle(1, first))
        call unload(law, work, tape%applied, 1, strip, 1, 1, to%applied_angle(1, first))
        do i = 1, 2   ! twice the second coefficient
          call unload(law, work, tape%restoring, 2, strip, 1, 1, to%restoring_curvature(1, first))
        end do
      end if
      if (self%speed > 0) then
        call turn(self, strip, [self%speed], 1)
        call unload(law, work, tape%applied, 1, strip, 1, 1, to%applied_speed(1, first))
        do i = 1, self%states
          call unload(law, work, tape%rate(i), 1, strip, self%states, i, to%internal%rate_speed(1, first_internal))
        end do
      end if
      if (self%time > 0) then
        call turn(self, strip, [self%time], 1)
        call unload(law, work, tape%applied, 1, strip, 1, 1, to%applied_time(1, first))
        do i = 1, self%states
          call unload(law, work, tape%rate(i), 1, strip, self%states, i, to%internal%rate_time(1, first_internal))
        end do
      end if
    end associate
  end subroutine differentiate_by_motion

  !> Derivatives of the moments of the elements by the motion of their phases, and of the ones of the phases, in a strip, after
  !> `walk` for the values. The mixed second derivative is that along both angles, less those along each (`differentiate`).
  subroutine differentiate_phases(self, strip, first, cross, to)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: strip, first
    integer, intent(in) :: cross   !! first derivative between elements and phases: element by phase, then phase by element
    type(element_values_t), intent(inout) :: to
    integer :: i, phase

    phase = first + self%law%elements
    associate (law => self%law, tape => self%law%tape, work => self%tangents, x => to%cross)
      call turn(self, strip, [self%angle], 2)
      call unload(law, work, tape%phase_restoring, 1, strip, 2, 2, x%restoring_angle(1, cross))
      call unload(law, work, tape%phase_applied, 1, strip, 2, 2, x%applied_angle(1, cross))
      do i = 1, 2   ! twice the second coefficient
        call unload(law, work, tape%phase_restoring, 2, strip, 2, 2, x%curvature(1, cross))
      end do
      call turn(self, strip, [self%phase], 2)
      call unload(law, work, tape%restoring, 1, strip, 2, 1, x%restoring_angle(1, cross))
      call unload(law, work, tape%applied, 1, strip, 2, 1, x%applied_angle(1, cross))
      call unload(law, work, tape%phase_restoring, 1, strip, 1, 1, to%restoring_angle(1, phase))
      call unload(law, work, tape%phase_applied, 1, strip, 1, 1, to%applied_angle(1, phase))
      do i = 1, 2
        call unload(law, work, tape%restoring, 2, strip, 2, 1, x%curvature(1, cross))
        call unload(law, work, tape%phase_restoring, 2, strip, 1, 1, to%restoring_curvature(1, phase))
      end do
      call turn(self, strip, [self%angle, self%phase], 2)
      call unload(law, work, tape%restoring, 2, strip, 2, 1, x%mixed(1, cross))
      call unload(law, work, tape%phase_restoring, 2, strip, 2, 2, x%mixed(1, cross))
      call turn(self, strip, [self%speed], 1)
      call unload(law, work, tape%phase_applied, 1, strip, 2, 2, x%applied_speed(1, cross))
      call turn(self, strip, [self%phase_speed], 1)
      call unload(law, work, tape%applied, 1, strip, 2, 1, x%applied_speed(1, cross))
      call unload(law, work, tape%phase_applied, 1, strip, 1, 1, to%applied_speed(1, phase))
    end associate
  end subroutine differentiate_phases

  pure subroutine clear_internal(first, last, internal)
    integer, intent(in) :: first, last
    type(internal_values_t), intent(inout) :: internal

    internal%applied(:, first:last) = 0.0_wp
    internal%rate_speed(:, first:last) = 0.0_wp
    internal%rate_time(:, first:last) = 0.0_wp
    internal%rate_internal(:, :, first:last) = 0.0_wp
  end subroutine clear_internal

  !> Derivatives by the internal states in a strip, after `walk` for the values.
  subroutine differentiate_by_states(self, strip, first, internal)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: strip
    integer, intent(in) :: first   !! internal state of the bank in the machine
    type(internal_values_t), intent(inout) :: internal
    integer :: i, j, members

    members = size(internal%rate_internal, 2)
    associate (law => self%law, tape => self%law%tape, work => self%tangents)
      do j = 1, self%states
        if (self%state(j) == 0) cycle
        call turn(self, strip, [self%state(j)], 1)
        call unload(law, work, tape%applied, 1, strip, self%states, j, internal%applied(1, first))
        do i = 1, self%states
          call unload(law, work, tape%rate(i), 1, strip, members * self%states, members * (i - 1) + j, &
                      internal%rate_internal(1, 1, first))
        end do
      end do
    end associate
  end subroutine differentiate_by_states

  !> Computes the coefficients 1 to `last` where some inputs grow with the rate 1 and the others stay.
  subroutine turn(self, strip, inputs, last)
    type(element_law_t), intent(inout) :: self
    integer, intent(in) :: strip
    integer, intent(in) :: inputs(:)   !! their nodes
    integer, intent(in) :: last
    integer :: i, k

    call fill(self%tangents, self%angle, 1, 0.0_wp)
    call fill(self%tangents, self%speed, 1, 0.0_wp)
    call fill(self%tangents, self%phase, 1, 0.0_wp)
    call fill(self%tangents, self%phase_speed, 1, 0.0_wp)
    call fill(self%tangents, self%time, 1, 0.0_wp)
    do i = 1, self%states
      call fill(self%tangents, self%state(i), 1, 0.0_wp)
    end do
    do i = 1, size(inputs)
      call fill(self%tangents, inputs(i), 1, 1.0_wp)
    end do
    do k = 1, last
      call walk(self%law, self%tangents, k, self%law%groups * (strip - 1) + 1)
    end do
  end subroutine turn

  !> Adds the energies of the restoring moments.
  subroutine evaluate_energies(self, first, elements)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: first   !! element of the bank in the machine
    type(element_values_t), intent(inout) :: elements
    integer :: strip

    associate (law => self%law, tape => self%law%tape, work => self%energies, to => elements)
      if (tape%stored == 0) return
      if (.not. self%is_ready) call make_ready(self)
      if (self%numbers%is_small) then
        call self%numbers%evaluate_energies(to%angle(1, first), to%stored(1, first))
        return
      end if
      do strip = 1, law%strips
        call load(law, work, self%angle, 0, strip, 1, 1, to%angle(1, first))
        call load(law, work, self%phase, 0, strip, 1, 1, to%angle(1, first + law%elements * (self%ports - 1)))
        call walk(law, work, 0, law%groups * (strip - 1) + 1)
        call unload(law, work, tape%stored, 0, strip, 1, 1, to%stored(1, first))
      end do
    end associate
  end subroutine evaluate_energies

  !> The lowest guards of the present branches of the switches in a block of lanes: positive inside the branches.
  subroutine lowest_guards(self, branch, time, angle, speed, internal, g)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: branch(:, :)                                                  !! [lanes, switches]
    real(wp), intent(in) :: time(self%law%lanes)                                         !! t [s]
    real(wp), intent(in), dimension(self%law%lanes, self%law%elements, self%ports) :: angle, speed   !! u [rad], u' [rad/s]
    real(wp), intent(in) :: internal(self%law%lanes, self%states, self%law%elements)     !! internal states
    real(wp), intent(inout) :: g(:, :)   !! in the unit of the guards, [lanes, switches]
    integer :: e, first, i, last, strip, switch

    if (.not. self%is_ready) call make_ready(self)
    g = huge(g)
    if (size(self%law%tape%guard) == 0) return
    associate (law => self%law, tape => self%law%tape, work => self%guards)
      do strip = 1, law%strips
        first = law%strip * (strip - 1) + 1
        last = min(law%strip * strip, law%lanes)
        call load_inputs(self, work, strip, time, angle, speed, internal)
        call walk(law, work, 0, law%groups * (strip - 1) + 1)
        do i = 1, size(tape%guard)
          do e = 1, law%elements
            switch = (tape%guarded_switch(i) - 1) * law%elements + e
            if (tape%guarded_branch(i) > 0) then
              if (is_absent(last - first + 1, tape%guarded_branch(i), branch(first:last, switch))) cycle
            end if
            call keep_lower(last - first + 1, tape%guarded_branch(i), branch(first:last, switch), &
                            work%pool(work%address(tape%guard(i), 0, e)), &
                            law%constant(law%slot(first, e), law%column(tape%guard_shift(i))), g(first:last, switch))
          end do
        end do
      end do
    end associate
  end subroutine lowest_guards

  !> Whether no lane is on a branch.
  pure logical function is_absent(lanes, branch, present_branch)
    integer, intent(in) :: lanes, branch
    integer, intent(in) :: present_branch(lanes)

    is_absent = count(present_branch == branch) == 0
  end function is_absent

  !> Lowers g to a guard, with its boundary shifted outwards, where a branch is the present one.
  pure subroutine keep_lower(lanes, branch, present_branch, guard, shift, g)
    integer, intent(in) :: lanes, branch   !! branch of the guard, 0 for all
    integer, intent(in) :: present_branch(lanes)
    real(wp), intent(in) :: guard(lanes), shift(lanes)
    real(wp), intent(inout) :: g(lanes)
    integer :: l

    do l = 1, lanes
      g(l) = merge(min(g(l), guard(l) + shift(l)), g(l), branch == 0 .or. present_branch(l) == branch)
    end do
  end subroutine keep_lower

  !> The largest rate of the sines of all elements of one lane [rad/s].
  pure real(wp) function fastest_of_elements(self, lane, speed) result(fastest)
    class(element_law_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: speed(:)   !! u' of the elements, then of their phases [rad/s]
    real(wp) :: one(at_phase)
    integer :: e

    fastest = 0.0_wp
    if (.not. self%has_waves) return
    do e = 1, self%law%elements
      one = [speed(e), speed((self%ports - 1) * self%law%elements + e)]
      fastest = max(fastest, fastest_wave(self%law, self%law%slot(lane, e), one))
    end do
  end function fastest_of_elements

  !> Allocates work space for Taylor series.
  subroutine prepare_series(self, order)
    class(element_law_t), intent(inout) :: self
    integer, intent(in) :: order   !! of the moments

    associate (tape => self%law%tape)
      self%series = new_law_work(tape, tape%needed(motion(tape), .true.), order, self%law%w, self%law%groups)
      if (order > 0) call fill(self%series, self%time, 1, 1.0_wp)   ! the time grows evenly
    end associate
  end subroutine prepare_series

end module nocdyn_element_laws
