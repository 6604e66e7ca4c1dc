!> Derivatives by central differences of fourth order, against which the analytic ones are checked.
!>
!> They are exact for polynomials of degree four. For these a large step is best, as only rounding remains.
module nocdyn_test_differences
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: evaluation_ok, pattern_t, system_t
  implicit none (type, external)
  private

  public :: difference_system, whole_jacobian

  real(wp), parameter :: offset(4) = [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
  real(wp), parameter :: weight(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp] / 12.0_wp
  real(wp), parameter :: state_step = 0.1_wp
  real(wp), parameter :: time_step = 1.0e-3_wp

contains

  !> Derivatives of a system's right-hand side.
  subroutine difference_system(system, t, y, dfdy, dfdt, step)
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(inout) :: dfdy(:, :, :)   !! shape [lanes, components, states]
    real(wp), contiguous, intent(inout) :: dfdt(:, :)
    real(wp), intent(in), optional :: step   !! of the states; absent: 0.1
    real(wp) :: by, moved(size(y, 1), size(y, 2)), slope(size(y, 1), size(y, 2))
    integer :: j, k, status(size(t))

    by = state_step
    if (present(step)) by = step
    dfdy = 0.0_wp
    dfdt = 0.0_wp
    status = evaluation_ok
    do k = 1, size(offset)
      call system%derivative(t + offset(k) * time_step, y, slope, status)
      dfdt = dfdt + weight(k) / time_step * slope
      do j = 1, system%states
        moved = y
        moved(:, j) = y(:, j) + offset(k) * by
        call system%derivative(t, moved, slope, status)
        dfdy(:, :, j) = dfdy(:, :, j) + weight(k) / by * slope
      end do
    end do
  end subroutine difference_system

  !> The Jacobian of a system as a dense array; zero at positions that are not in its pattern.
  subroutine whole_jacobian(system, t, y, dfdy, dfdt, status)
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(inout) :: dfdy(:, :, :)   !! shape [lanes, components, states]
    real(wp), contiguous, intent(inout) :: dfdt(:, :)
    integer, contiguous, intent(inout) :: status(:)
    type(pattern_t) :: pattern
    real(wp), allocatable :: values(:, :)
    integer :: p

    pattern = system%jacobian_pattern()
    allocate (values(size(t), size(pattern%row)), source=0.0_wp)
    call system%jacobian(t, y, values, dfdt, status)
    dfdy = 0.0_wp
    do p = 1, size(pattern%row)
      dfdy(:, pattern%row(p), pattern%column(p)) = values(:, p)
    end do
  end subroutine whole_jacobian

end module nocdyn_test_differences
