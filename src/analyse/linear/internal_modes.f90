!> Damped modes that are mostly an internal state, such as a flux of a motor, exact.
!>
!> With the motion q = T0(lambda)^-1 U^T h z that the internal states z cause, they solve S(lambda) z = 0 with
!> S = lambda - A - lambda b U T0^-1 U^T h^T: T0 is the dynamic stiffness without the internal states, h z their moments, and
!> A z + b u' their rates. Newton's method on S (A. Ruhe, SIAM J. Numer. Anal. 10 (1973) 674-689) finds the eigenvalue.
module nocdyn_internal_modes
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, rigid_stiffness
  use nocdyn_elements, only: internal_states_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_complex, only: complex_solve
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_pairs, only: mode_pairs_t, set_motion
  implicit none (type, external)
  private

  public :: refine_internal

  integer, parameter, public :: most_internal = 100   !! internal states that have modes of their own

contains

  !> Refines the eigenvalue and the motion of one.
  subroutine refine_internal(machine, matrix, work, pairs, m, is_exact)
    type(machine_t), intent(in) :: machine              !! one lane
    type(dynamic_stiffness_t), intent(in) :: matrix     !! of it
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: m                            !! the mode
    logical, intent(out) :: is_exact                    !! whether it was found
    integer, parameter :: most_steps = 25, settling = 2
    real(wp), parameter :: accuracy = 1.0e-12_wp, beside = 1.0e-6_wp, far = 0.5_wp   ! relative
    complex(wp), allocatable, dimension(:, :) :: change, residual
    complex(wp), allocatable :: z(:)
    complex(wp) :: start, step, value
    integer :: k, main
    logical :: is_regular

    is_exact = .false.
    value = pairs%value(m)
    if (.not. abs(value) > 0 .or. (.not. aimag(value) > 0 .and. any(abs(pairs%slopes%loss) > 0))) return
    start = value
    main = pairs%internal(m)
    allocate (z(machine%elements%internal%count), source=(0.0_wp, 0.0_wp))
    z(main) = 1.0_wp
    do k = 1, most_steps
      call find_residual(machine, matrix, work, pairs, value * (1.0_wp + beside), change, is_regular)
      if (is_regular) call find_residual(machine, matrix, work, pairs, value, residual, is_regular)
      if (.not. is_regular) return
      z = matmul(change - residual, z) / (beside * value)
      call complex_solve(residual, z, is_exact)
      if (is_exact) exit   ! S is singular
      if (.not. abs(z(main)) > 0) return
      step = 1.0_wp / z(main)
      z = z * step
      if (k <= settling) cycle   ! the states first, then the value
      value = value - step
      if (aimag(start) > 0 .and. aimag(value) < 0) then   ! the other one of the pair
        value = conjg(value)
        z = conjg(z)
      end if
      if (.not. abs(value - start) <= far * abs(start)) return
      is_exact = abs(step) <= accuracy * abs(value)
      if (is_exact) exit
    end do
    if (.not. is_exact) return
    pairs%value(m) = value
    z(main) = 1.0_wp   ! also where the last step has found none
    call add_moments(matrix, machine%elements%internal, pairs, z, work)
    call matrix%solve(work)
    pairs%x(:, m) = work%x(matrix%position(:matrix%coordinates))
    call set_motion(machine, matrix, pairs, m)
  end subroutine refine_internal

  !> S(lambda); leaves the factors of T0(lambda).
  subroutine find_residual(machine, matrix, work, pairs, value, residual, is_regular)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(band_work_t), intent(inout) :: work
    type(mode_pairs_t), intent(in) :: pairs
    complex(wp), intent(in) :: value                              !! lambda [1/s]
    complex(wp), allocatable, intent(out) :: residual(:, :)       !! [internal states, internal states]
    logical, intent(out) :: is_regular                            !! whether T0 has an inverse
    complex(wp) :: stiffness(size(pairs%twist, 1)), unit(machine%elements%internal%count), turn
    integer :: e, i, k, s

    turn = (0.0_wp, 1.0_wp)
    if (aimag(value) > 0) turn = value / aimag(value)
    associate (internal => machine%elements%internal, slopes => pairs%slopes)
      stiffness = slopes%stiffness + (value * slopes%damping + turn * slopes%loss)
      if (allocated(pairs%locked)) stiffness(pairs%locked) = rigid_stiffness
      call matrix%factor_square(-value**2, stiffness, work, is_regular)
      is_regular = .not. is_regular
      if (.not. is_regular) return
      allocate (residual(internal%count, internal%count), source=(0.0_wp, 0.0_wp))
      do s = 1, internal%count
        associate (first => internal%first(s), members => internal%members(s))
          residual(s, first:first + members - 1) = -slopes%rate_internal(:members, s)
        end associate
        residual(s, s) = residual(s, s) + value
      end do
      do s = 1, internal%count   ! the motion by the moment of each state
        unit = (0.0_wp, 0.0_wp)
        unit(s) = 1.0_wp
        call add_moments(matrix, internal, pairs, unit, work)
        call matrix%solve(work)
        do k = 1, internal%count
          e = internal%element(k)
          do i = matrix%incidence%first(e), matrix%incidence%first(e + 1) - 1
            residual(k, s) = residual(k, s) - value * slopes%rate_speed(k) * matrix%incidence%ratio(1, i) &
                             * work%x(matrix%position(matrix%incidence%coordinate(i)))
          end do
        end do
      end do
    end associate
  end subroutine find_residual

  !> Sets the forces to the moments of the internal states.
  subroutine add_moments(matrix, internal, pairs, z, work)
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(internal_states_t), intent(in) :: internal
    type(mode_pairs_t), intent(in) :: pairs
    complex(wp), intent(in) :: z(:)                 !! [internal states]
    type(band_work_t), intent(inout) :: work
    integer :: s

    work%x(:) = (0.0_wp, 0.0_wp)
    do s = 1, internal%count
      call matrix%add_forces(internal%element(s), pairs%slopes%by_internal(s) * z(s), work)
    end do
  end subroutine add_moments

end module nocdyn_internal_modes
