!> Derivatives by central differences of fourth order, against which the analytic ones are checked.
!>
!> They are exact for polynomials of degree four, which all laws but the harmonic one are, so that a large step is
!> best: only rounding remains.
module nocdyn_test_differences
  use nocdyn_bank, only: bank_t
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: difference_laws, difference_system

  integer, parameter, public :: by_angle = 1, by_speed = 2, by_time = 3

  real(wp), parameter :: offset(4) = [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
  real(wp), parameter :: weight(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp] / 12.0_wp
  real(wp), parameter :: state_step = 0.1_wp
  real(wp), parameter :: time_step = 1.0e-3_wp

  !> Derivatives of what a bank computes, [lanes, elements].
  type, public :: law_slopes_t
    real(wp), allocatable :: restoring(:, :), working(:, :), stored(:, :)
    real(wp), allocatable :: tangent(:, :)   !! of `restoring_angle`
  end type law_slopes_t

contains

  !> Derivatives of the laws of a bank by its angles, its speeds or the time.
  function difference_laws(bank, t, variable) result(slopes)
    class(bank_t), intent(in) :: bank
    real(wp), contiguous, intent(in) :: t(:)
    integer, intent(in) :: variable   !! by_...
    type(law_slopes_t) :: slopes
    class(bank_t), allocatable :: moved
    real(wp) :: gain, step
    integer :: k

    allocate (slopes%restoring, slopes%working, slopes%stored, slopes%tangent, source=0.0_wp * bank%angle)
    step = merge(time_step, state_step, variable == by_time)
    do k = 1, size(offset)
      if (allocated(moved)) deallocate (moved)
      allocate (moved, source=bank)
      if (variable == by_angle) moved%angle = bank%angle + offset(k) * step
      if (variable == by_speed) moved%speed = bank%speed + offset(k) * step
      call moved%evaluate(t + merge(offset(k) * step, 0.0_wp, variable == by_time))
      call moved%differentiate(t)
      call moved%assess()
      gain = weight(k) / step
      slopes%restoring = slopes%restoring + gain * moved%restoring
      slopes%working = slopes%working + gain * moved%working
      slopes%stored = slopes%stored + gain * moved%stored
      slopes%tangent = slopes%tangent + gain * moved%restoring_angle
    end do
  end function difference_laws

  !> Derivatives of a system's right-hand side, in the shapes of its `jacobian`.
  subroutine difference_system(system, t, y, dfdy, dfdt)
    class(system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), contiguous, intent(inout) :: dfdy(:, :, :), dfdt(:, :)
    real(wp) :: moved(size(y, 1), size(y, 2)), slope(size(y, 1), size(y, 2))
    integer :: j, k, status(size(t))

    dfdy = 0.0_wp
    dfdt = 0.0_wp
    do k = 1, size(offset)
      call system%derivative(t + offset(k) * time_step, y, slope, status)
      dfdt = dfdt + weight(k) / time_step * slope
      do j = 1, system%states
        moved = y
        moved(:, j) = y(:, j) + offset(k) * state_step
        call system%derivative(t, moved, slope, status)
        dfdy(:, :, j) = dfdy(:, :, j) + weight(k) / state_step * slope
      end do
    end do
  end subroutine difference_system

end module nocdyn_test_differences
