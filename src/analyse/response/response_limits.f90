!> Limits of moments and stresses, by &limit: curves over the speed, and the ratio of a response to them.
!>
!> The rule 'iacs_m68' is IACS Unified Requirement M68, Dimensions of propulsion shafts and their permissible torsional vibration
!> stresses: with lambda = speed / rated speed, the shear stress amplitude for continuous operation [N/mm2] is
!>   tau_C = (sigma_B + 160) / 18 c_K c_D (3 - 2 lambda^2) for lambda < 0.9, ... 1.38 for 0.9 <= lambda < 1.05,
!> with c_D = 0.35 + 0.93 d^(-0.2), d in mm; for passing through quickly it is tau_T = 1.7 tau_C / sqrt(c_K).
module nocdyn_response_limits
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_response_quantities, only: quantity_moment, response_quantity_t
  use nocdyn_schema_text, only: suggestion
  use nocdyn_text, only: quoted, string_t
  implicit none (type, external)
  private

  public :: read_limits

  real(wp), parameter :: mega = 1.0e6_wp, milli = 1.0e-3_wp
  real(wp), parameter, public :: no_limit = huge(1.0_wp)

  !> The limits of one quantity, in its unit.
  type, public :: response_limit_t
    integer :: quantity = 0
    integer :: group = 0                              !! &limit in the input
    real(wp), private :: vibratory = no_limit         !! of the half range
    real(wp), private :: peak = no_limit              !! of the largest magnitude, with the mean
    real(wp), private :: transient = no_limit         !! of the half range while a speed is passed
    real(wp), private :: stress_to_moment = 0.0_wp    !! section modulus [m3]
    logical, private :: has_rule = .false.
    real(wp), private :: tensile_strength = 0.0_wp    !! sigma_B [Pa]
    real(wp), private :: c_k = 1.0_wp, diameter = 0.0_wp, rated = 0.0_wp   !! [1], [m], [rad/s]
  contains
    procedure :: continuous_limit, transient_limit, peak_limit, ratio
  end type response_limit_t

contains

  !> Reads all groups &limit.
  subroutine read_limits(input, quantities, limits, error)
    type(input_t), intent(in) :: input
    type(response_quantity_t), intent(in) :: quantities(:)
    type(response_limit_t), allocatable, intent(out) :: limits(:)
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('limit'))
    allocate (limits(size(groups)))
    do i = 1, size(groups)
      call read_limit(input, groups(i), quantities, limits(i), error)
      if (allocated(error)) return
    end do
  end subroutine read_limits

  subroutine read_limit(input, index, quantities, limit, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(response_quantity_t), intent(in) :: quantities(:)
    type(response_limit_t), intent(inout) :: limit
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: key

    limit%group = index
    call find_quantity(input, index, quantities, limit%quantity, error)
    if (allocated(error)) return
    associate (group => input%groups(index), modulus => quantities(limit%quantity)%section_modulus)
      limit%stress_to_moment = modulus
      key = ''
      if (group%has_value('stress_transient')) key = 'stress_transient'
      if (group%has_value('stress')) key = 'stress'
      if (group%has_value('rule')) key = 'rule'
      if (key /= '' .and. .not. modulus > 0) then
        call raise(error, exit_input, input%location(index, key) // ': ' // key // ' limits a stress, but ' // &
                   quoted(quantities(limit%quantity)%name) // ' has none; required: section_modulus [m3] or diameter [m] of ' // &
                   '&coupling')
        return
      end if
      limit%vibratory = group%number('vibratory_moment', absent=no_limit)
      if (group%has_value('stress')) limit%vibratory = min(limit%vibratory, group%number('stress') * modulus)
      limit%peak = group%number('moment', absent=no_limit)
      if (group%has_value('stress_transient')) limit%transient = group%number('stress_transient') * modulus
      limit%has_rule = group%has_value('rule')
      if (.not. limit%has_rule) return
      limit%tensile_strength = group%number('tensile_strength')
      limit%c_k = group%number('c_k')
      limit%diameter = group%number('diameter', absent=diameter_of(input, quantities(limit%quantity)%name))
      limit%rated = abs(group%number('rated_speed'))
      if (limit%diameter > 0) return
      call raise(error, exit_input, input%location(index, 'rule') // ': the rule iacs_m68 needs a diameter [m], of &limit ' // &
                 'or of &coupling ' // quoted(quantities(limit%quantity)%name))
    end associate
  end subroutine read_limit

  !> The diameter of a coupling [m], 0 if it is not given.
  pure real(wp) function diameter_of(input, name) result(diameter)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    integer, allocatable :: groups(:)
    integer :: i

    diameter = 0.0_wp
    allocate (groups, source=input%groups_named('coupling'))
    do i = 1, size(groups)
      if (input%groups(groups(i))%name == name) diameter = input%groups(groups(i))%number('diameter', absent=0.0_wp)
    end do
  end function diameter_of

  !> The quantity that a group limits.
  subroutine find_quantity(input, index, quantities, quantity, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index
    type(response_quantity_t), intent(in) :: quantities(:)
    integer, intent(out) :: quantity
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: name
    integer :: i

    name = input%groups(index)%text('coupling')
    allocate (names(count(quantities%kind == quantity_moment)))
    do quantity = 1, size(quantities)
      if (quantities(quantity)%kind /= quantity_moment) cycle
      if (quantities(quantity)%name == name) return
    end do
    i = 0
    do quantity = 1, size(quantities)
      if (quantities(quantity)%kind /= quantity_moment) cycle
      i = i + 1
      names(i)%text = quantities(quantity)%name
    end do
    call raise(error, exit_input, input%location(index, 'coupling') // ': there is no coupling ' // quoted(name) // &
               suggestion(name, names))
  end subroutine find_quantity

  !> The limit of the half range in continuous operation at a speed, in the unit of the quantity.
  elemental real(wp) function continuous_limit(self, speed) result(limit)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! of the reference body [rad/s]

    limit = self%vibratory
    if (self%has_rule) limit = min(limit, m68_stress(self, speed) * self%stress_to_moment)
  end function continuous_limit

  !> The limit of the half range while a speed is passed; without one, `no_limit`.
  elemental real(wp) function transient_limit(self, speed) result(limit)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    limit = self%transient
    if (self%has_rule) limit = min(limit, 1.7_wp * m68_stress(self, speed) / sqrt(self%c_k) * self%stress_to_moment)
  end function transient_limit

  !> The limit of the largest magnitude, with the mean.
  elemental real(wp) function peak_limit(self) result(limit)
    class(response_limit_t), intent(in) :: self

    limit = self%peak
  end function peak_limit

  !> tau_C [Pa].
  elemental real(wp) function m68_stress(self, speed) result(stress)
    type(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed
    real(wp) :: lambda

    lambda = abs(speed) / self%rated
    stress = mega * (self%tensile_strength / mega + 160.0_wp) / 18.0_wp * self%c_k &
             * (0.35_wp + 0.93_wp * (self%diameter / milli)**(-0.2_wp)) &
             * merge(3.0_wp - 2.0_wp * lambda**2, 1.38_wp, lambda < 0.9_wp)
  end function m68_stress

  !> The largest ratio of a response to its limits for continuous operation.
  elemental real(wp) function ratio(self, speed, half_range, peak)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed               !! [rad/s]
    real(wp), intent(in) :: half_range, peak    !! in the unit of the quantity

    ratio = max(half_range / self%continuous_limit(speed), peak / self%peak)
  end function ratio

end module nocdyn_response_limits
