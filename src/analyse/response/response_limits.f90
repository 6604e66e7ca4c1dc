!> Limits of moments and stresses, by &limit: curves over the speed, and the ratio of a response to them.
!>
!> The rule 'iacs_m68' is IACS Unified Requirement M68, Dimensions of propulsion shafts and their permissible torsional vibration
!> stresses: with lambda = speed / rated speed, the shear stress amplitude for continuous operation [N/mm2] is
!>   tau_C = (sigma_B + 160) / 18 c_K c_D (3 - 2 lambda^2) for lambda < 0.9, ... 1.38 for 0.9 <= lambda < 1.05,
!> with c_D = 0.35 + 0.93 d^(-0.2), d in mm; for passing through quickly it is tau_T = 1.7 tau_C / sqrt(c_K), for lambda < 0.8:
!> from there on the rule accepts no restricted range of speeds in normal operation.
module nocdyn_response_limits
  use nocdyn_errors, only: add_error, error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: limited_kind, limited_signal
  use nocdyn_moment_forms, only: moment_form_t
  use nocdyn_signals, only: find_signal, signal_t
  use nocdyn_text, only: quoted, rounded_text
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
    logical, private :: has_rule = .false.
    real(wp), private :: tensile_strength = 0.0_wp    !! sigma_B [Pa]
    real(wp), private :: c_k = 1.0_wp, diameter = 0.0_wp, rated = 0.0_wp   !! [1], [m], [rad/s]
  contains
    procedure :: continuous_limit, transient_limit, peak_limit, ratio, allows_passing, has_continuous, has_transient
    procedure :: write_rule, write_place
  end type response_limit_t

contains

  !> Reads all groups &limit. The error has a line for each mistake.
  subroutine read_limits(input, quantities, limits, error)
    type(input_t), intent(in) :: input
    type(moment_form_t), intent(in) :: quantities(:)
    type(response_limit_t), allocatable, intent(out) :: limits(:)
    type(error_t), allocatable, intent(out) :: error
    type(signal_t), allocatable :: signals(:)
    type(error_t), allocatable :: own
    integer, allocatable :: groups(:)
    character(len=8) :: kind
    integer :: before, i

    allocate (groups, source=input%groups_named('limit'))
    allocate (limits(0), signals(size(quantities)))
    do i = 1, size(signals)
      signals(i) = quantities(i)%signal_t
    end do
    do i = 1, size(groups)
      before = size(limits)
      kind = limited_kind(input%groups(groups(i)))
      call add_limit(input%groups(groups(i)), groups(i), signals, limits)
      call add_stress_limits(input, groups(i), trim(kind), signals, limits, own)
      if (size(limits) == before .and. .not. (allocated(own) .or. input%groups(groups(i))%has_value('quantity'))) then
        call raise(own, exit_input, input%location(groups(i)) // ': nothing is limited; needed: ' // &
                   trim(merge('vibratory_force or force                                  ', &
                              'vibratory_moment, moment, stress, stress_transient or rule', kind == 'mesh')))
      end if
      call add_error(error, own)
    end do
  end subroutine read_limits

  !> A limit of the moment of a coupling or shaft, the force of a mesh or a named quantity, if it is linear in the motion.
  subroutine add_limit(group, index, signals, limits)
    type(group_t), intent(in) :: group
    integer, intent(in) :: index   !! of the group
    type(signal_t), intent(in) :: signals(:)   !! of the quantities
    type(response_limit_t), allocatable, intent(inout) :: limits(:)
    character(len=*), parameter :: vibratory(*) = [character(len=16) :: 'vibratory_moment', 'vibratory_force', 'vibratory']
    character(len=*), parameter :: peak(*) = [character(len=7) :: 'moment', 'force', 'largest']
    type(response_limit_t) :: limit
    integer :: k

    limit%group = index
    do k = 1, size(peak)
      limit%vibratory = min(limit%vibratory, group%number(trim(vibratory(k)), absent=no_limit))
      limit%peak = min(limit%peak, group%number(trim(peak(k)), absent=no_limit))
    end do
    if (min(limit%vibratory, limit%peak) >= no_limit) return
    limit%quantity = limited_signal(group, signals)
    if (limit%quantity > 0) limits = [limits, limit]
  end subroutine add_limit

  !> Limits of its stress.
  subroutine add_stress_limits(input, index, kind, signals, limits, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: kind
    type(signal_t), intent(in) :: signals(:)   !! of the quantities
    type(response_limit_t), allocatable, intent(inout) :: limits(:)
    type(error_t), allocatable, intent(out) :: error
    type(response_limit_t) :: limit
    character(len=:), allocatable :: key

    associate (group => input%groups(index))
      key = ''
      if (group%has_value('stress_transient')) key = 'stress_transient'
      if (group%has_value('stress')) key = 'stress'
      if (group%has_value('rule')) key = 'rule'
      if (key == '') return
      limit%quantity = find_signal(signals, kind, group%text(kind), 'stress')
      if (limit%quantity == 0) then
        call raise(error, exit_input, input%location(index, key) // ': ' // key // ' limits a stress, but ' // &
                   quoted(group%text(kind)) // ' has none; required: section_modulus [m3] or diameter [m] of &coupling')
        return
      end if
      limit%group = index
      limit%vibratory = group%number('stress', absent=no_limit)
      limit%transient = group%number('stress_transient', absent=no_limit)
      if (key == 'rule') call set_rule(input, index, kind, limit, error)
    end associate
    limits = [limits, limit]
  end subroutine add_stress_limits

  !> The numbers of the rule iacs_m68.
  subroutine set_rule(input, index, kind, limit, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: kind
    type(response_limit_t), intent(inout) :: limit
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: groups(:)
    integer :: i
    real(wp) :: diameter

    associate (group => input%groups(index))
      limit%has_rule = .true.
      limit%tensile_strength = group%number('tensile_strength')
      limit%c_k = group%number('c_k')
      ! the diameter of a coupling, or the smallest one of a shaft [m]; 0 if it is not given
      diameter = 0.0_wp
      allocate (groups, source=input%groups_named(kind))
      do i = 1, size(groups)
        if (input%groups(groups(i))%name /= group%text(kind)) cycle
        if (kind == 'coupling') diameter = input%groups(groups(i))%number('diameter', absent=0.0_wp)
        if (kind == 'shaft') diameter = minval(input%groups(groups(i))%numbers('diameters'))
      end do
      limit%diameter = group%number('diameter', absent=diameter)
      limit%rated = abs(group%number('rated_speed'))
      if (limit%diameter > 0) return
      call raise(error, exit_input, input%location(index, 'rule') // ': the rule iacs_m68 needs a diameter [m], of &limit ' // &
                 'or of &' // kind // ' ' // quoted(group%text(kind)))
    end associate
  end subroutine set_rule

  !> The limit of the half range in continuous operation at a speed, in the unit of the quantity.
  elemental real(wp) function continuous_limit(self, speed) result(limit)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! of the reference body [rad/s]

    limit = self%vibratory
    if (self%has_rule) limit = min(limit, m68_stress(self, speed))
  end function continuous_limit

  !> The limit of the half range while a speed is passed; without one, `no_limit`.
  elemental real(wp) function transient_limit(self, speed) result(limit)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    limit = self%transient
    if (.not. self%has_rule) return
    if (self%allows_passing(speed)) then
      limit = min(limit, 1.7_wp * m68_stress(self, speed) / sqrt(self%c_k))
    else
      limit = min(limit, m68_stress(self, speed))
    end if
  end function transient_limit

  !> Whether a range of speeds may be barred there, and be passed.
  elemental logical function allows_passing(self, speed)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    real(wp), parameter :: share = 0.8_wp   ! of the rated speed

    allows_passing = .true.
    if (self%has_rule) allows_passing = abs(speed) < share * self%rated
  end function allows_passing

  !> The limit of the largest magnitude, with the mean.
  elemental real(wp) function peak_limit(self) result(limit)
    class(response_limit_t), intent(in) :: self

    limit = self%peak
  end function peak_limit

  !> Whether there is a limit for continuous operation.
  elemental logical function has_continuous(self)
    class(response_limit_t), intent(in) :: self

    has_continuous = self%has_rule .or. self%vibratory < no_limit
  end function has_continuous

  !> Whether there is a limit for passing a range of speeds.
  elemental logical function has_transient(self)
    class(response_limit_t), intent(in) :: self

    has_transient = self%has_rule .or. self%transient < no_limit
  end function has_transient

  !> The rule that the limit for continuous operation comes from, '' if it is the user's own.
  pure subroutine write_rule(self, text)
    class(response_limit_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text

    text = ''
    if (self%has_rule) text = 'IACS UR M68'
  end subroutine write_rule

  !> A speed in the terms of the rule, "lambda 0.84"; '' without a rule.
  pure subroutine write_place(self, speed, text)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    character(len=:), allocatable, intent(out) :: text

    text = ''
    if (self%has_rule) text = 'lambda ' // rounded_text(abs(speed) / self%rated, 2)
  end subroutine write_place

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
