!> Derivatives of the laws of banks by central differences of fourth order, to check the analytic ones.
!>
!> They are exact for polynomials of degree four, for which a large step is best: only rounding remains. The branches of a
!> bank do not change.
module nocdyn_test_law_differences
  use nocdyn_bank, only: bank_t
  use nocdyn_bank_states, only: bank_state_t, new_bank_state
  use nocdyn_elements, only: element_values_t, new_element_values, new_elements
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: new_polynomial_laws, polynomial_laws_t
  implicit none (type, external)
  private

  public :: difference_laws, elements_of, evaluate_all, choose_branches, indicators_of

  integer, parameter, public :: by_angle = 1, by_speed = 2, by_time = 3
  integer, parameter, public :: by_state = 3   !! + number of the internal state of each element

  real(wp), parameter :: offset(4) = [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
  real(wp), parameter :: weight(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp] / 12.0_wp
  real(wp), parameter :: state_step = 0.1_wp
  real(wp), parameter :: time_step = 1.0e-3_wp

  !> The values of the elements of a machine with one bank, and the state of the bank.
  type, extends(element_values_t), public :: bank_values_t
    type(bank_state_t) :: state
  end type bank_values_t

  !> Derivatives of the moments and energies of a bank, [lanes, elements].
  type, public :: law_slopes_t
    real(wp), allocatable :: restoring(:, :), applied(:, :), stored(:, :)
    real(wp), allocatable :: tangent(:, :)   !! derivative of `restoring_angle`
    real(wp), allocatable :: rate(:, :)      !! derivatives of the rates of the internal states, [lanes, internal states]
  end type law_slopes_t

contains

  !> The elements of a machine with one bank, at rest.
  function elements_of(bank) result(elements)
    class(bank_t), intent(in) :: bank
    type(bank_values_t) :: elements
    integer :: e

    elements%element_values_t = new_element_values(new_elements(bank%rows, [(bank%states, e=1, bank%count)]), bank%lanes)
    elements%state = new_bank_state(bank, bank%count)
  end function elements_of

  !> Sets moments, derivatives, energies and rates of the elements from their angles, speeds, internal states and time.
  subroutine evaluate_all(bank, elements)
    class(bank_t), intent(in) :: bank
    type(bank_values_t), intent(inout) :: elements
    type(polynomial_laws_t) :: laws

    laws = new_polynomial_laws(bank%lanes, bank%count)
    call bank%polynomials(1, bank%lanes, laws)
    call laws%evaluate(elements%element_values_t)
    call laws%differentiate(elements%element_values_t)
    call laws%evaluate_energies(elements%element_values_t)
    if (.not. allocated(elements%state%law)) return
    associate (law => elements%state%law)
      call law%evaluate(elements%time, elements%angle, elements%speed, elements%internal%value, elements%restoring, &
                        elements%applied, elements%internal%rate)
      call law%differentiate(1, 1, 1, elements%element_values_t)
      call law%evaluate_energies(1, elements%element_values_t)
    end associate
  end subroutine evaluate_all

  !> Sets the branches of all lanes of a bank to those that contain the states of its elements.
  subroutine choose_branches(bank, elements)
    class(bank_t), intent(in) :: bank
    type(bank_values_t), intent(inout) :: elements
    integer :: k, l

    do k = 1, size(bank%switch_element)
      associate (e => bank%switch_element(k))
        do l = 1, bank%lanes
          call elements%state%choose(bank, k, l, elements%time(l), [elements%angle(l, e), elements%speed(l, e), 0.0_wp, 0.0_wp], &
                           states_of(bank, elements, l, e))
        end do
      end associate
    end do
  end subroutine choose_branches

  !> Distances of the lanes from the boundaries of their branches, [lanes, switches].
  function indicators_of(bank, elements) result(indicators)
    class(bank_t), intent(in) :: bank
    type(bank_values_t), intent(inout) :: elements
    real(wp) :: indicators(bank%lanes, size(bank%switch_element))
    integer :: k, l

    do k = 1, size(bank%switch_element)
      associate (e => bank%switch_element(k))
        do l = 1, bank%lanes
          call elements%state%indicator(bank, k, l, [elements%time(l), elements%angle(l, e), elements%speed(l, e), 0.0_wp, &
                                                     0.0_wp], states_of(bank, elements, l, e), indicators(l, k))
        end do
      end associate
    end do
  end function indicators_of

  function states_of(bank, elements, lane, element) result(internal)
    class(bank_t), intent(in) :: bank
    type(bank_values_t), intent(in) :: elements
    integer, intent(in) :: lane, element
    real(wp) :: internal(bank%states)

    internal = elements%internal%value(lane, (element - 1) * bank%states + 1:element * bank%states)
  end function states_of

  !> Derivatives of the laws of a bank by its angles, its speeds, the time or an internal state.
  function difference_laws(bank, elements, variable, by) result(slopes)
    class(bank_t), intent(in) :: bank
    type(bank_values_t), intent(in) :: elements
    integer, intent(in) :: variable   !! by_...
    real(wp), intent(in), optional :: by   !! step; absent: 0.1, in time 0.001
    type(law_slopes_t) :: slopes
    type(bank_values_t) :: moved
    real(wp) :: gain, step
    integer :: k

    allocate (slopes%restoring, slopes%applied, slopes%stored, slopes%tangent, source=0.0_wp * elements%angle)
    allocate (slopes%rate, source=0.0_wp * elements%internal%value)
    step = merge(time_step, state_step, variable == by_time)
    if (present(by)) step = by
    do k = 1, size(offset)
      moved = elements
      if (variable == by_angle) moved%angle = elements%angle + offset(k) * step
      if (variable == by_speed) moved%speed = elements%speed + offset(k) * step
      if (variable == by_time) moved%time = elements%time + offset(k) * step
      if (variable > by_state) then
        moved%internal%value(:, variable - by_state::bank%states) = elements%internal%value(:, variable - by_state::bank%states) &
                                                                + offset(k) * step
      end if
      call evaluate_all(bank, moved)
      gain = weight(k) / step
      slopes%restoring = slopes%restoring + gain * moved%restoring
      slopes%applied = slopes%applied + gain * moved%applied
      slopes%stored = slopes%stored + gain * moved%stored
      slopes%tangent = slopes%tangent + gain * moved%restoring_angle
      slopes%rate = slopes%rate + gain * moved%internal%rate
    end do
  end function difference_laws

end module nocdyn_test_law_differences
