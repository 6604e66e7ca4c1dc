!> Excitations that are sums of sines of the time and of the angle u of their body: sum of A sin(f t + order u + phase).
!>
!> Engine orders have f = 0. A synchronous motor with p pole pairs pulsates during its start at twice the slip frequency:
!> f = 2 omega_mains, order = -2 p.
module nocdyn_wave_excitations
  use nocdyn_bank, only: bank_t, role_excitation
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_text, only: string_t
  use nocdyn_vector_functions, only: cosine_of, sine_of
  implicit none (type, external)
  private

  public :: new_wave_excitations

  type, extends(bank_t), public :: wave_excitations_t
    integer, allocatable :: owner(:)           !! excitation of each term
    real(wp), allocatable :: amplitude(:, :)   !! A [N m], shape [lanes, terms] as all that follow
    real(wp), allocatable :: frequency(:, :)   !! f [rad/s]
    real(wp), allocatable :: order(:, :)
    real(wp), allocatable :: phase(:, :)       !! [rad]
  contains
    procedure :: list_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: to_mean_torque
  end type wave_excitations_t

contains

  !> A bank of excitations, each on one body.
  function new_wave_excitations(names, body, owner, amplitude, frequency, order, phase) result(bank)
    type(string_t), intent(in) :: names(:)
    integer, intent(in) :: body(:)
    integer, intent(in) :: owner(:)   !! excitation of each term
    real(wp), intent(in) :: amplitude(:, :), frequency(:, :)   !! [N m], [rad/s], shape [lanes, terms]
    real(wp), intent(in) :: order(:, :), phase(:, :)           !! [1], [rad], shape [lanes, terms]
    type(wave_excitations_t) :: bank

    bank%is_polynomial = .false.
    bank%has_paper_law = .false.
    call bank%connect(role_excitation, size(amplitude, 1), names, body)
    allocate (bank%owner, source=owner)
    allocate (bank%amplitude, source=amplitude)
    allocate (bank%frequency, source=frequency)
    allocate (bank%order, source=order)
    allocate (bank%phase, source=phase)
  end function new_wave_excitations

  subroutine evaluate(self, time, angle, speed, restoring, applied)
    class(wave_excitations_t), intent(in) :: self
    real(wp), intent(in) :: time(self%lanes), angle(self%values), speed(self%values)   !! t [s], u [rad], u' [rad/s]
    real(wp), intent(inout) :: restoring(self%values), applied(self%values)   !! [N m]
    integer :: i, k, l

    do k = 1, size(self%owner)
      do l = 1, self%lanes
        i = self%lanes * (self%owner(k) - 1) + l
        applied(i) = applied(i) + self%amplitude(l, k) * sine_of(self%frequency(l, k) * time(l) + self%order(l, k) * angle(i) &
                                                                 + self%phase(l, k))
      end do
    end do
  end subroutine evaluate

  subroutine differentiate(self, elements)
    class(wave_excitations_t), intent(in) :: self
    type(elements_t), intent(inout) :: elements
    real(wp) :: wave
    integer :: i, k, l

    do k = 1, size(self%owner)
      i = self%first + self%owner(k) - 1
      do l = 1, self%lanes
        wave = self%amplitude(l, k) * cosine_of(self%frequency(l, k) * elements%time(l) &
                                                + self%order(l, k) * elements%angle(l, i) + self%phase(l, k))
        elements%applied_angle(l, i) = elements%applied_angle(l, i) + self%order(l, k) * wave
        elements%applied_time(l, i) = elements%applied_time(l, i) + self%frequency(l, k) * wave
      end do
    end do
  end subroutine differentiate

  !> The mean of a sine is zero.
  subroutine to_mean_torque(self)
    class(wave_excitations_t), intent(inout) :: self

    self%amplitude = 0.0_wp
    self%frequency = 0.0_wp
  end subroutine to_mean_torque

  subroutine list_parameters(self, parameters)
    class(wave_excitations_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%owner)
    call parameters%add_key('amplitude', self%amplitude, self%owner)
    call parameters%add('frequency', self%frequency)
    call parameters%add('order', self%order)
    call parameters%add_key('phase', self%phase, self%owner)
  end subroutine list_parameters

end module nocdyn_wave_excitations
