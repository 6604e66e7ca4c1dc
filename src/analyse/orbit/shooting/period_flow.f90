!> The motion of a machine over one period, by integration with the changes of branches, and the variations of its state along it.
!>
!> The variational equations V' = J V are solved along the accepted steps by the implicit Gauss method of four stages with the
!> Jacobian on the dense output.
module nocdyn_period_flow
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_integration, only: integrate
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_observer, only: observer_t, step_block_t
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_solver_status, only: failure_message, integration_done, solver_status_t
  use nocdyn_system, only: evaluation_ok, pattern_t
  use nocdyn_varied_machine, only: varied_machine_t
  implicit none (type, external)
  private

  public :: flow_over, stages, state_in_step

  integer, parameter :: stages = 4

  !> Goes along the steps.
  type, extends(observer_t), public :: flow_observer_t
    class(varied_machine_t), pointer :: machine => null()
    type(pattern_t) :: pattern
    real(wp) :: nodes(stages) = 0.0_wp, weights(stages) = 0.0_wp, a(stages, stages) = 0.0_wp   !! the Gauss method
    real(wp), allocatable :: lowest(:), highest(:)   !! of the states beside their mean rates, [states]
    real(wp), allocatable :: mean_rate(:)            !! [states]
    real(wp), allocatable :: samples(:, :)           !! at the output times, [states, times]
    integer :: count = 0                             !! of these
  contains
    procedure :: on_output, on_steps
    procedure, private :: vary
  end type flow_observer_t

contains

  !> Integrates from 0 to the last time.
  subroutine flow_over(machine, rtol, times, y, observer, error)
    class(varied_machine_t), target, intent(inout) :: machine   !! with the variations of the start, if they are wanted
    real(wp), intent(in) :: rtol
    real(wp), contiguous, intent(in) :: times(:)       !! from 0 on [s]
    real(wp), intent(inout) :: y(:)                    !! state at the start, then at the end
    class(flow_observer_t), intent(inout) :: observer
    type(error_t), allocatable, intent(out) :: error   !! the integration fails
    real(wp), parameter :: absolute = 0.01_wp          ! tolerance, as a share of rtol
    type(integration_settings_t) :: settings
    type(solver_status_t) :: status
    real(wp) :: state(1, size(y))

    settings%rtol = rtol
    settings%atol = absolute * rtol
    settings%longest_step = 0.125_wp * times(size(times))
    observer%machine => machine
    observer%pattern = machine%jacobian_pattern()
    observer%wants_steps = .true.
    observer%lowest = spread(huge(1.0_wp), 1, size(y))
    observer%highest = -observer%lowest
    if (allocated(observer%samples)) deallocate (observer%samples)
    allocate (observer%samples(size(y), size(times)), source=0.0_wp)
    observer%count = 0
    call find_gauss_method(observer)
    state(1, :) = y
    call integrate(machine, settings, times, state, observer, status, error)
    if (allocated(error)) return
    if (status%code(1) /= integration_done) then
      call raise(error, exit_failed, 'the motion over a period: ' // &
                 failure_message(status, 1, machine, settings%rtol, settings%atol))
    end if
    y = state(1, :)
  end subroutine flow_over

  !> The coefficients of the Gauss method: a integrates the polynomials through the nodes.
  subroutine find_gauss_method(observer)
    class(flow_observer_t), intent(inout) :: observer
    real(wp) :: powers(stages, stages), integrals(stages)
    integer :: i, k, pivots(stages)
    logical :: singular

    call gauss_legendre_rule(stages, observer%nodes, observer%weights)
    do k = 1, stages
      powers(k, :) = observer%nodes**(k - 1)
    end do
    call lu_factor(powers, pivots, singular)
    do i = 1, stages
      integrals = [(observer%nodes(i)**k / k, k=1, stages)]
      call lu_solve(powers, pivots, integrals)
      observer%a(i, :) = integrals
    end do
  end subroutine find_gauss_method

  subroutine on_output(self, lane, t, y)
    class(flow_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%count = self%count + 1
    self%samples(:, self%count) = y
  end subroutine on_output

  subroutine on_steps(self, steps, y, y_new, c)
    class(flow_observer_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)
    real(wp) :: beside(size(self%lowest)), state(size(self%lowest), stages), t(stages)
    integer :: i

    if (.not. steps%taken(1)) return
    do i = 1, stages
      t(i) = steps%t(1) + self%nodes(i) * steps%theta_end(1) * steps%h(1)
      call state_in_step(steps, y, c, self%nodes(i) * steps%theta_end(1), state(:, i))
      beside = state(:, i) - self%mean_rate * t(i)
      self%lowest = min(self%lowest, beside)
      self%highest = max(self%highest, beside)
    end do
    if (self%machine%is_varied) call self%vary(t, state, steps%theta_end(1) * steps%h(1))
  end subroutine on_steps

  !> The state inside a step.
  pure subroutine state_in_step(steps, y, c, theta, state)
    type(step_block_t), intent(in) :: steps
    real(wp), intent(in) :: y(:, :), c(:, :, :)   !! as of `on_steps`
    real(wp), intent(in) :: theta
    real(wp), intent(out) :: state(:)
    integer :: p

    state = 0.0_wp
    do p = steps%degree(1), 1, -1
      state = (steps%scale(1) * theta) * (state + c(1, :size(state), p))
    end do
    state = state + y(1, :size(state))
  end subroutine state_in_step

  !> A step of the variations: the rates K of the stages from K_i = J_i (V + h sum over j of a_ij K_j).
  subroutine vary(self, t, state, h)
    class(flow_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t(:), state(:, :)   !! at the stages
    real(wp), intent(in) :: h                   !! [s]
    real(wp), dimension(size(state, 1), size(state, 1), stages) :: jacobian
    real(wp), dimension(stages * size(state, 1), stages * size(state, 1)) :: matrix
    real(wp) :: rates(stages * size(state, 1))
    integer :: i, j, k, n, pivots(stages * size(state, 1))
    logical :: singular

    n = size(state, 1)
    do i = 1, stages
      call find_jacobian(self, t(i), state(:, i), jacobian(:, :, i))
    end do
    matrix = 0.0_wp
    do j = 1, stages
      do i = 1, stages
        matrix((i - 1) * n + 1:i * n, (j - 1) * n + 1:j * n) = (-h * self%a(i, j)) * jacobian(:, :, i)
      end do
    end do
    do i = 1, stages * n
      matrix(i, i) = matrix(i, i) + 1.0_wp
    end do
    call lu_factor(matrix, pivots, singular)
    if (singular) return
    do k = 1, size(self%machine%variations, 2)
      associate (v => self%machine%variations(:, k))
        do i = 1, stages
          rates((i - 1) * n + 1:i * n) = matmul(jacobian(:, :, i), v)
        end do
        call lu_solve(matrix, pivots, rates)
        do i = 1, stages
          v = v + (h * self%weights(i)) * rates((i - 1) * n + 1:i * n)
        end do
      end associate
    end do
  end subroutine vary

  !> The Jacobian on the present branches as a matrix.
  subroutine find_jacobian(self, t, state, jacobian)
    class(flow_observer_t), intent(inout) :: self
    real(wp), intent(in) :: t, state(:)
    real(wp), intent(out) :: jacobian(:, :)
    real(wp) :: values(1, size(self%pattern%row)), by_time(1, size(state)), y(1, size(state))
    integer :: f, k, status(1)

    status = evaluation_ok
    y(1, :) = state
    values = 0.0_wp
    by_time = 0.0_wp
    call self%machine%jacobian([t], y, values, by_time, status)
    jacobian = 0.0_wp
    do k = 1, size(self%pattern%row)
      jacobian(self%pattern%row(k), self%pattern%column(k)) = values(1, k)
    end do
    f = self%machine%machine%coordinates%freedoms
    do k = 1, f
      jacobian(f + k, k) = 1.0_wp
    end do
  end subroutine find_jacobian

end module nocdyn_period_flow
