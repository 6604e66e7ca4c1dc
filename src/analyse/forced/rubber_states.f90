!> The conditions of rubber couplings that follow from their own vibration: their temperatures by the power that they lose, and
!> the amplitudes of their vibratory torques, for the factors over these.
!>
!> A temperature is the ambient one plus the thermal resistance times the mean power of all orders. The amplitude is the square
!> root of the sum of the squares of the amplitudes of all orders, so that all of them meet one stiffness: rubber has one at a
!> time, and of one large order it is the amplitude of that. Both are a fixed point x = g(x). Of several temperatures that are
!> possible near a resonance the one is found that a cold coupling reaches: x' = g(x) - x is followed from there by linearly
!> implicit Euler steps, which grow until they are Newton's (pseudo-transient continuation: Kelley and Keyes, SIAM J. Numer. Anal.
!> 35 (1998) 508-523).
module nocdyn_rubber_states
  use nocdyn_dynamic_stiffness, only: dynamic_stiffness_t
  use nocdyn_excitation_lines, only: find_twist, line_t, line_work_t, lost_power, solve_line
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_response_points, only: response_point_t
  use nocdyn_rubber_laws, only: rubber_condition_t
  implicit none (type, external)
  private

  public :: has_iterated_rubber, settle_rubber

  !> The unknowns of one machine, and what excites it.
  type :: problem_t
    type(machine_t), pointer :: machine => null()
    type(dynamic_stiffness_t), pointer :: matrix => null()
    type(line_t), pointer :: lines(:) => null()
    integer, allocatable :: heated(:)      !! rubber couplings whose temperatures are unknown
    integer, allocatable :: amplified(:)   !! and those whose amplitudes are
  end type problem_t

contains

  !> Whether the stiffness of some coupling depends on its own vibration.
  pure logical function has_iterated_rubber(machine)
    type(machine_t), intent(in) :: machine
    integer :: r

    has_iterated_rubber = .false.
    if (.not. allocated(machine%rubber)) return
    do r = 1, size(machine%rubber)
      has_iterated_rubber = has_iterated_rubber .or. machine%rubber(r)%needs_iteration()
    end do
  end function has_iterated_rubber

  !> Finds the conditions at one speed, and linearises the machine there.
  subroutine settle_rubber(machine, matrix, lines, point, work)
    type(machine_t), target, intent(in) :: machine
    type(dynamic_stiffness_t), target, intent(in) :: matrix
    type(line_t), target, intent(in) :: lines(:)        !! all that excite the machine
    type(response_point_t), intent(inout) :: point      !! with its state and its sources
    type(line_work_t), intent(inout) :: work
    integer, parameter :: most_steps = 400, most_stuck = 8   ! steps that bring nothing
    real(wp), parameter :: first_step = 0.25_wp         ! of the thermal time constants
    real(wp), parameter :: most_growth = 4.0_wp
    real(wp), parameter :: least_step = 0.05_wp, relief = 1.25_wp, unlimited = 1.0e10_wp
    real(wp), parameter :: tolerance = 1.0e-13_wp       ! relative
    real(wp), parameter :: enough = 1.0e-9_wp           ! where rounding allows no more
    type(problem_t) :: problem
    real(wp), allocatable :: g(:), scale(:), x(:)
    real(wp) :: before, longest, residual, step
    integer :: i, stuck

    problem%machine => machine
    problem%matrix => matrix
    problem%lines => lines
    call list_unknowns(problem)
    call start(problem, x)
    call evaluate(problem, x, point, work, g)
    scale = sizes(problem, g)
    residual = maxval(abs(g - x) / scale)
    step = first_step
    longest = unlimited
    stuck = 0
    do i = 1, merge(most_steps, 0, residual > tolerance)
      before = residual
      call take_step(problem, step, scale, point, work, x, g)
      scale = sizes(problem, g)
      residual = maxval(abs(g - x) / scale)
      if (residual <= tolerance) exit
      if (residual >= before) stuck = stuck + 1
      if (residual <= enough .and. stuck >= most_stuck) exit
      ! Newton's steps may cycle about kinks of tables: short ones do not
      longest = min(unlimited, relief * longest)
      if (residual >= before) longest = max(least_step, 0.5_wp * step)
      step = min(longest, step * min(most_growth, max(1.0_wp / most_growth, before / residual)))
    end do
    point%is_settled = residual <= enough
    call set_conditions(problem, x, point)
  end subroutine settle_rubber

  subroutine list_unknowns(problem)
    type(problem_t), intent(inout) :: problem   !! with its machine
    integer :: r

    associate (rubber => problem%machine%rubber)
      allocate (problem%heated, source=pack([(r, r=1, size(rubber))], [(rubber(r)%heats_up, r=1, size(rubber))]))
      allocate (problem%amplified, source=pack([(r, r=1, size(rubber))], &
                                               [(rubber(r)%by_amplitude%are_given, r=1, size(rubber))]))
    end associate
  end subroutine list_unknowns

  !> Cold couplings without vibration.
  subroutine start(problem, x)
    type(problem_t), intent(in) :: problem
    real(wp), allocatable, intent(out) :: x(:)   !! temperatures [degC], amplitudes [N m]

    allocate (x(size(problem%heated) + size(problem%amplified)), source=0.0_wp)
    x(:size(problem%heated)) = problem%machine%rubber(problem%heated)%ambient
  end subroutine start

  !> The sizes of the unknowns, relative to which they are exact: rises of temperatures, at least 1 mK, and amplitudes, at least
  !> 1 pN m.
  function sizes(problem, g) result(scale)
    type(problem_t), intent(in) :: problem
    real(wp), intent(in) :: g(:)
    real(wp) :: scale(size(g))
    real(wp), parameter :: least = 1.0e-3_wp               ! [K]
    real(wp), parameter :: least_amplitude = 1.0e-12_wp    ! [N m]
    integer :: heated

    heated = size(problem%heated)
    scale(:heated) = max(least, g(:heated) - problem%machine%rubber(problem%heated)%ambient)
    scale(heated + 1:) = max(least_amplitude, g(heated + 1:))
  end function sizes

  !> Sets the conditions of the machine at a point.
  subroutine set_conditions(problem, x, point)
    type(problem_t), intent(in) :: problem
    real(wp), intent(in) :: x(:)
    type(response_point_t), intent(inout) :: point
    type(rubber_condition_t) :: condition(size(problem%machine%rubber))

    condition = point%state%slopes%condition
    condition(problem%heated)%temperature = x(:size(problem%heated))
    condition(problem%amplified)%amplitude = x(size(problem%heated) + 1:)
    call point%state%slopes%set_conditions(condition)
  end subroutine set_conditions

  !> The temperatures and amplitudes that follow from some.
  subroutine evaluate(problem, x, point, work, g)
    type(problem_t), intent(in) :: problem
    real(wp), intent(in) :: x(:)
    type(response_point_t), intent(inout) :: point
    type(line_work_t), intent(inout) :: work
    real(wp), allocatable, intent(out) :: g(:)
    complex(wp) :: moment, twist
    real(wp), dimension(size(problem%machine%rubber)) :: power, square
    integer :: l, r

    call set_conditions(problem, x, point)
    power = 0.0_wp
    square = 0.0_wp
    do l = 1, size(problem%lines)
      associate (frequency => point%sources(problem%lines(l)%source(1))%frequency)
        call solve_line(problem%machine, problem%matrix, point%state%slopes, frequency, &
                        point%sources(problem%lines(l)%source), work)
        do r = 1, size(power)
          associate (e => problem%machine%rubber(r)%element)
            call find_twist(problem%matrix, e, work, twist, moment)
            power(r) = power(r) + lost_power(frequency, work%stiffness(e), twist)
            square(r) = square(r) + real(moment, wp)**2 + aimag(moment)**2
          end associate
        end do
      end associate
    end do
    associate (heated => problem%machine%rubber(problem%heated))
      g = [heated%ambient + heated%resistance * power(problem%heated), sqrt(square(problem%amplified))]
    end associate
  end subroutine evaluate

  !> A linearly implicit Euler step, by differences.
  subroutine take_step(problem, step, scale, point, work, x, g)
    type(problem_t), intent(in) :: problem
    real(wp), intent(in) :: step       !! in time constants
    real(wp), intent(in) :: scale(:)   !! of the unknowns
    type(response_point_t), intent(inout) :: point
    type(line_work_t), intent(inout) :: work
    real(wp), intent(inout) :: x(:)
    real(wp), allocatable, intent(inout) :: g(:)
    real(wp), parameter :: difference = 1.0e-6_wp
    real(wp) :: a(size(x), size(x)), change(size(x)), moved(size(x))
    real(wp), allocatable :: other(:)
    integer :: k, pivots(size(x))
    logical :: is_singular

    do k = 1, size(x)
      moved = x
      moved(k) = moved(k) + difference * scale(k)
      call evaluate(problem, moved, point, work, other)
      a(:, k) = -(other - g) / (moved(k) - x(k))
      a(k, k) = a(k, k) + 1.0_wp + 1.0_wp / step
    end do
    change = g - x
    call lu_factor(a, pivots, is_singular)
    if (is_singular) then
      change = change / (1.0_wp + 1.0_wp / step)
    else
      call lu_solve(a, pivots, change)
    end if
    x = x + change
    associate (heated => size(problem%heated))
      x(:heated) = max(x(:heated), problem%machine%rubber(problem%heated)%ambient)
      x(heated + 1:) = max(x(heated + 1:), 0.0_wp)
    end associate
    call evaluate(problem, x, point, work, g)
  end subroutine take_step

end module nocdyn_rubber_states
