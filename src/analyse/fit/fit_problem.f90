!> The differences between what was measured and what a machine with some values of its unknowns does, as residuals of least
!> squares: of all measurements, each over its standard deviation, and of what is expected of the unknowns.
module nocdyn_fit_problem
  use nocdyn_comparisons, only: comparison_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_fit_comparisons, only: compare_measurements, fix_delays, refuse_unfitted
  use nocdyn_free_numbers, only: set_free_numbers
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_least_squares, only: residuals_t
  use nocdyn_measurements, only: measurement_t
  use nocdyn_text, only: to_text
  use nocdyn_unknowns, only: unknown_t
  implicit none (type, external)
  private

  public :: new_fit_problem

  type, extends(residuals_t), public :: fit_problem_t
    type(input_t) :: input                               !! with the values that were tried last
    type(unknown_t), allocatable :: unknowns(:)
    type(measurement_t), allocatable :: measurements(:)
    type(comparison_t), allocatable :: comparisons(:)    !! for these values, one for each measurement
  contains
    procedure :: evaluate
  end type fit_problem_t

contains

  !> Prepares a fit, with the comparisons of the input itself.
  subroutine new_fit_problem(input, unknowns, measurements, self, error)
    type(input_t), intent(in) :: input
    type(unknown_t), intent(in) :: unknowns(:)
    type(measurement_t), intent(in) :: measurements(:)
    type(fit_problem_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(diagnostics_t) :: diagnostics
    integer :: i

    self%input = input
    allocate (self%unknowns, source=unknowns)
    allocate (self%measurements, source=measurements)
    call refuse_unfitted(input, measurements, error)
    if (.not. allocated(error)) call fix_delays(self%input, self%measurements, error)
    if (.not. allocated(error)) call compare_measurements(self%input, self%measurements, self%comparisons, error)
    if (allocated(error)) return
    self%count = count(unknowns%has_prior)
    do i = 1, size(self%comparisons)
      associate (values => size(self%comparisons(i)%residuals()))
        self%count = self%count + values
        if (values == 0) call input%report(self%measurements(i)%group, 'name', 'none of its values is where something is ' // &
                                           'computed, and none can be fitted', diagnostics)
      end associate
    end do
    call input%refuse(diagnostics, error)
    if (allocated(error) .or. self%count >= size(unknowns)) return
    call raise(error, exit_input, input%shown_case() // ': there are ' // to_text(self%count) // ' measured values for ' // &
               to_text(size(unknowns)) // ' unknowns; needed: at least as many')
  end subroutine new_fit_problem

  subroutine evaluate(self, x, r, error)
    class(fit_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: r(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: message
    integer :: i, n

    r = 0.0_wp
    call set_free_numbers(self%input, self%unknowns, x, message)
    if (message /= '') then
      call raise(error, exit_input, message)
      return
    end if
    call compare_measurements(self%input, self%measurements, self%comparisons, error)
    if (allocated(error)) return
    n = 0
    do i = 1, size(self%comparisons)
      associate (values => self%comparisons(i)%residuals())
        if (n + size(values) > size(r)) then
          call raise(error, exit_input, 'the number of values that can be compared changes')
          return
        end if
        r(n + 1:n + size(values)) = values
        n = n + size(values)
      end associate
    end do
    do i = 1, size(self%unknowns)
      if (.not. self%unknowns(i)%has_prior) cycle
      n = n + 1
      r(n) = (x(i) - self%unknowns(i)%prior) / self%unknowns(i)%deviation
    end do
  end subroutine evaluate

end module nocdyn_fit_problem
