!> The oscillations of a machine at one speed with the adjoint ones of a half range: what a change of the machine does to it.
!>
!> For one line of excitation at the frequency Omega the coordinates x solve sum of U_e^T m_e + Omega^2 M x = 0 with the moments
!> m_e = f_e - D_e (U_e x - s_e) of the elements, their forces f_e and twists in series s_e. An amplitude A = sum of w_e m_e
!> changes by dA = sum of (w_e + U_e a) dm_e + d(Omega^2 a^T M x), where x and the adjoint motion a stay, which solves the same
!> equations with the twists in series -w_e. A half range changes by Re(sum of slopes times the changes of the amplitudes).
module nocdyn_line_responses
  use nocdyn_excitation_lines, only: find_twist, line_work_t, new_line_work, solve_line, source_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_frozen_motions, only: frame_t, view_t
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_pairs, only: angles_of
  use nocdyn_moment_forms, only: moment_form_t
  implicit none (type, external)
  private

  public :: new_line_responses

  !> One line.
  type :: line_response_t
    real(wp) :: frequency = 0.0_wp                       !! Omega [rad/s]
    complex(wp) :: slope = 0.0_wp                        !! of the half range by the amplitude
    complex(wp), allocatable :: x(:), adjoint(:)         !! coordinates
    complex(wp), allocatable :: twist(:)                 !! U_e x - s_e [rad], [elements]
    complex(wp), allocatable :: series(:)                !! s_e [rad], [elements]
    complex(wp), allocatable :: weight(:)                !! w_e + U_e a, [elements]
    complex(wp), allocatable :: angle(:), adjoint_angle(:)   !! [bodies]
  end type line_response_t

  !> All lines of a half range at one speed.
  type, public :: line_responses_t
    integer :: form = 0                                  !! of all moment forms of the machine
    integer :: point = 0                                 !! of its points, the one with the largest half range
    real(wp) :: half_range = 0.0_wp
    real(wp), allocatable, private :: weight(:)          !! w_e, [elements]
    type(line_response_t), allocatable, private :: lines(:)
  contains
    procedure :: changed, slope_by_inertia
  end type line_responses_t

contains

  !> Solves at a state of a response.
  subroutine new_line_responses(response, state, sources, quantity, self)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(source_t), intent(in) :: sources(:)           !! at this state
    type(moment_form_t), intent(in) :: quantity        !! no power
    type(line_responses_t), intent(inout) :: self      !! with `form`
    type(line_work_t) :: work
    complex(wp), allocatable :: amplitude(:, :), moment(:, :), slope(:)   ! [lines, points], [elements, lines], [lines]
    integer :: l, p
    real(wp) :: half_range, high, low

    associate (lines => size(response%lines), elements => response%machine%elements%count, points => size(quantity%weight, 1))
      work = new_line_work(response%machine, response%matrix)
      allocate (self%lines(lines), moment(elements, lines), amplitude(lines, points), slope(lines), self%weight(elements))
      do l = 1, lines
        call solve(response, state, sources(response%lines(l)%source), work, self%lines(l), moment(:, l))
        do p = 1, points
          amplitude(l, p) = quantity%total(p, moment(:, l))
        end do
      end do
      self%half_range = -1.0_wp
      do p = 1, points
        call response%synthesis%extremes(amplitude(:, p), low, high)
        half_range = 0.5_wp * (high - low)
        if (half_range <= self%half_range) cycle
        self%half_range = half_range
        self%point = p
      end do
      call response%synthesis%find_slopes(amplitude(:, self%point), slope)
      self%weight = weights_of(quantity, self%point, elements)
      do l = 1, lines
        self%lines(l)%slope = slope(l)
        self%lines(l)%frequency = sources(response%lines(l)%source(1))%frequency
        call solve_adjoint(response, state, self%weight, work, self%lines(l))
      end do
    end associate
  end subroutine new_line_responses

  !> The weights of all elements in a form.
  pure function weights_of(quantity, point, elements) result(weight)
    type(moment_form_t), intent(in) :: quantity
    integer, intent(in) :: point, elements
    real(wp) :: weight(elements)
    integer :: k

    weight = 0.0_wp
    do k = 1, size(quantity%elements)
      weight(quantity%elements(k)) = weight(quantity%elements(k)) + quantity%weight(point, k)
    end do
  end function weights_of

  !> The motion by the sources of a line.
  subroutine solve(response, state, sources, work, self, moment)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(source_t), intent(in) :: sources(:)   !! of the line
    type(line_work_t), intent(inout) :: work
    type(line_response_t), intent(inout) :: self
    complex(wp), intent(out) :: moment(:)      !! [N m], [elements]
    complex(wp) :: force(size(moment))
    integer :: e

    call solve_line(response%machine, response%matrix, state%slopes, sources(1)%frequency, sources, work)
    allocate (self%twist(size(moment)))
    do e = 1, size(moment)
      call find_twist(response%matrix, e, work, self%twist(e), moment(e))
    end do
    call list_forces(sources, force, self)
    moment = moment + force
    allocate (self%x, source=work%band%x(response%matrix%position(:response%matrix%coordinates)))
    allocate (self%angle, source=angles_of(response%machine, self%x))
  end subroutine solve

  !> The forces of the sources of a line on all elements, and their twists in series.
  pure subroutine list_forces(sources, force, self)
    type(source_t), intent(in) :: sources(:)
    complex(wp), intent(out) :: force(:)   !! [N m], [elements]
    type(line_response_t), intent(inout) :: self
    integer :: i

    if (allocated(self%series)) deallocate (self%series)
    allocate (self%series(size(force)), source=(0.0_wp, 0.0_wp))
    force = (0.0_wp, 0.0_wp)
    do i = 1, size(sources)
      associate (e => sources(i)%element)
        if (sources(i)%is_twist) then
          self%series(e) = self%series(e) + sources(i)%moment
        else
          force(e) = force(e) + sources(i)%moment
        end if
      end associate
    end do
  end subroutine list_forces

  !> The adjoint motion of a line.
  subroutine solve_adjoint(response, state, weight, work, self)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    real(wp), intent(in) :: weight(:)   !! w_e, [elements]
    type(line_work_t), intent(inout) :: work
    type(line_response_t), intent(inout) :: self
    type(source_t) :: twists(count(abs(weight) > 0))
    complex(wp) :: moment
    integer :: e, n

    n = 0
    do e = 1, size(weight)
      if (.not. abs(weight(e)) > 0) cycle
      n = n + 1
      twists(n) = source_t(element=e, moment=cmplx(-weight(e), kind=wp), is_twist=.true.)
    end do
    call solve_line(response%machine, response%matrix, state%slopes, self%frequency, twists, work)
    allocate (self%weight(size(weight)))
    do e = 1, size(weight)
      call find_twist(response%matrix, e, work, self%weight(e), moment)
    end do
    allocate (self%adjoint, source=work%band%x(response%matrix%position(:response%matrix%coordinates)))
    allocate (self%adjoint_angle, source=angles_of(response%machine, self%adjoint))
  end subroutine solve_adjoint

  !> The derivative of the half range by the inertia of a body.
  pure real(wp) function slope_by_inertia(self, body) result(slope)
    class(line_responses_t), intent(in) :: self
    integer, intent(in) :: body
    integer :: l

    slope = 0.0_wp
    do l = 1, size(self%lines)
      associate (one => self%lines(l))
        slope = slope + real(one%slope * one%frequency**2 * one%angle(body) * one%adjoint_angle(body), wp)
      end associate
    end do
  end function slope_by_inertia

  !> The half range of a changed machine to the first order, up to a constant.
  real(wp) function changed(self, response, frame, view, machine, state, sources, quantity)
    class(line_responses_t), intent(in) :: self
    type(forced_response_t), intent(in) :: response       !! of the machine itself
    type(frame_t), intent(in) :: frame
    type(view_t), intent(in) :: view                      !! of the changed machine, as all that follow
    type(machine_t), intent(in) :: machine
    type(held_state_t), intent(in) :: state
    type(source_t), intent(in) :: sources(:)
    type(moment_form_t), intent(in) :: quantity
    type(line_response_t) :: moved
    complex(wp), dimension(machine%elements%count) :: force, stiffness, twist, weight
    complex(wp) :: angle(machine%bodies), adjoint_angle(machine%bodies)
    integer :: l

    changed = 0.0_wp
    do l = 1, size(self%lines)
      associate (one => self%lines(l), list => response%lines(l)%source)
        if (.not. abs(one%slope) > 0) cycle
        associate (frequency => sources(list(1))%frequency)
          call state%slopes%find_stiffness(machine%elements%internal, cmplx(0.0_wp, frequency, wp), stiffness)
          call list_forces(sources(list), force, moved)
          twist = one%twist + view%more_twist(frame, one%x) - (moved%series - one%series)
          weight = one%weight + (weights_of(quantity, self%point, size(weight)) - self%weight) &
                   + view%more_twist(frame, one%adjoint)
          angle = one%angle + view%more_angle(frame, one%x)
          adjoint_angle = one%adjoint_angle + view%more_angle(frame, one%adjoint)
          changed = changed + real(one%slope * (sum(weight * (force - stiffness * twist)) &
                                                + frequency**2 * sum(machine%inertia(1, :) * angle * adjoint_angle)), wp)
        end associate
      end associate
    end do
  end function changed

end module nocdyn_line_responses
