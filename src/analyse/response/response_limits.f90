!> Limits of moments and stresses, by &limit and its rules: curves over the speed, and the ratio of a response to them.
module nocdyn_response_limits
  use nocdyn_errors, only: add_error, error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: derating, limited_kind, limited_signal
  use nocdyn_limit_rules, only: bind_rule, limit_rule_t, load_rule
  use nocdyn_moment_forms, only: moment_form_t
  use nocdyn_signals, only: find_signal, signal_t
  use nocdyn_text, only: quoted, string_t
  implicit none (type, external)
  private

  public :: read_limits

  real(wp), parameter, public :: no_limit = huge(1.0_wp)

  !> The limits of one quantity, in its unit.
  type, public :: response_limit_t
    integer :: quantity = 0
    integer :: group = 0                              !! &limit in the input
    real(wp), private :: vibratory = no_limit         !! of the half range
    real(wp), private :: peak = no_limit              !! of the largest magnitude, with the mean
    real(wp), private :: transient = no_limit         !! of the half range while a speed is passed
    real(wp) :: heat = no_limit                       !! of the element [W]
    real(wp) :: temperature = no_limit                !! of a coupling that heats up [degC]
    real(wp), allocatable :: frequency(:)             !! of a curve of amplitudes, ascending [rad/s]
    real(wp), allocatable :: amplitude(:)             !! that each line may have there
    logical, private :: has_rule = .false.
    type(limit_rule_t), private :: rule
  contains
    procedure :: continuous_limit, transient_limit, peak_limit, ratio, allows_passing, has_continuous, has_transient
    procedure :: amplitude_limit, curve_ratio, has_curve, has_tolerance
    procedure :: find_barred, list_notes, write_rule, write_place, write_unbarred
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
                   needed_keys(trim(kind)))
      end if
      call add_error(error, own)
    end do
  end subroutine read_limits

  !> The keys of which &limit needs one.
  pure function needed_keys(kind) result(keys)
    character(len=*), intent(in) :: kind   !! of the element
    character(len=:), allocatable :: keys

    keys = 'vibratory_moment, moment, stress, stress_transient, rule, rule_file, heat, largest_temperature or ' // &
           'vibratory_frequency'
    if (kind == 'mesh') keys = 'vibratory_force or force'
  end function needed_keys

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
    real(wp) :: factor

    limit%group = index
    do k = 1, size(peak)
      limit%vibratory = min(limit%vibratory, group%number(trim(vibratory(k)), absent=no_limit))
      limit%peak = min(limit%peak, group%number(trim(peak(k)), absent=no_limit))
    end do
    factor = derating(group)
    if (limit%vibratory < no_limit) limit%vibratory = factor * limit%vibratory
    if (limit%peak < no_limit) limit%peak = factor * limit%peak
    limit%heat = group%number('heat', absent=no_limit)
    limit%temperature = group%number('largest_temperature', absent=no_limit)
    limit%frequency = group%numbers('vibratory_frequency')
    limit%amplitude = factor * group%numbers('vibratory_moments')
    if (min(limit%vibratory, limit%peak, limit%heat, limit%temperature) >= no_limit .and. .not. limit%has_curve()) return
    limit%quantity = limited_signal(group, signals)
    if (limit%quantity > 0) call add_one(limit, limits)
  end subroutine add_limit

  !> Limits of its stress, or of what its rule limits.
  subroutine add_stress_limits(input, index, kind, signals, limits, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: kind
    type(signal_t), intent(in) :: signals(:)   !! of the quantities
    type(response_limit_t), allocatable, intent(inout) :: limits(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: keys(*) = [character(len=16) :: 'rule', 'rule_file', 'stress', 'stress_transient']
    type(response_limit_t) :: limit
    character(len=:), allocatable :: quantity
    integer :: k

    associate (group => input%groups(index))
      do k = 1, size(keys)
        if (group%has_value(trim(keys(k)))) exit
      end do
      if (k > size(keys)) return
      quantity = 'stress'
      limit%has_rule = k <= 2
      if (limit%has_rule) then
        call load_rule(input, index, '', limit%rule%rule, error)
        if (allocated(error)) return
        quantity = limit%rule%rule%quantity
      end if
      limit%quantity = find_signal(signals, kind, group%text(kind), quantity)
      if (limit%quantity == 0) limit%quantity = find_signal(signals, kind, group%text(kind), quantity, 'max')
      if (limit%quantity == 0) then
        call refuse_quantity(input, index, trim(keys(k)), kind, quantity, error)
        return
      end if
      limit%group = index
      limit%vibratory = group%number('stress', absent=no_limit)
      limit%transient = group%number('stress_transient', absent=no_limit)
      if (limit%has_rule) call bind_rule(input, index, diameter_of(input, index, kind), limit%rule, error)
    end associate
    if (.not. allocated(error)) call add_one(limit, limits)
  end subroutine add_stress_limits

  !> A limit of a quantity that the element does not have.
  subroutine refuse_quantity(input, index, key, kind, quantity, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    character(len=*), intent(in) :: key, kind, quantity
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: name

    name = quoted(input%groups(index)%text(kind))
    if (quantity == 'stress') then
      call raise(error, exit_input, input%location(index, key) // ': ' // key // ' limits a stress, but ' // name // &
                 ' has none; required: section_modulus [m3] or diameter [m] of &coupling')
    else
      call raise(error, exit_input, input%location(index, key) // ': the rule limits ' // quoted(quantity) // ', but ' // &
                 kind // ' ' // name // ' has no such quantity in a response; allowed: a kind in columns.json')
    end if
  end subroutine refuse_quantity

  !> The diameter of a coupling, or the smallest one of a shaft [m]; 0 if it is not given.
  real(wp) function diameter_of(input, index, kind) result(diameter)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group &limit
    character(len=*), intent(in) :: kind
    integer, allocatable :: groups(:)
    integer :: i

    diameter = 0.0_wp
    allocate (groups, source=input%groups_named(kind))
    do i = 1, size(groups)
      if (input%groups(groups(i))%name /= input%groups(index)%text(kind)) cycle
      if (kind == 'coupling') diameter = input%groups(groups(i))%number('diameter', absent=0.0_wp)
      if (kind == 'shaft') diameter = minval(input%groups(groups(i))%numbers('diameters'))
    end do
  end function diameter_of

  subroutine add_one(limit, limits)
    type(response_limit_t), intent(in) :: limit
    type(response_limit_t), allocatable, intent(inout) :: limits(:)
    type(response_limit_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(limits) + 1))
    do i = 1, size(limits)
      longer(i) = limits(i)
    end do
    longer(size(longer)) = limit
    call move_alloc(longer, limits)
  end subroutine add_one

  !> The limit of the half range in continuous operation at a speed, in the unit of the quantity.
  elemental real(wp) function continuous_limit(self, speed) result(limit)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! of the reference body [rad/s]

    limit = self%vibratory
    if (self%has_rule) limit = min(limit, self%rule%continuous_at(speed))
  end function continuous_limit

  !> The limit of the half range while a speed is passed; without one, `no_limit`.
  elemental real(wp) function transient_limit(self, speed) result(limit)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    limit = self%transient
    if (.not. self%has_rule) return
    if (.not. self%rule%bars_at(speed)) then
      limit = min(limit, self%rule%continuous_at(speed))
    else if (self%rule%rule%transient%is_given()) then
      limit = min(limit, self%rule%transient_at(speed))
    end if
  end function transient_limit

  !> Whether a range of speeds may be barred there, and be passed.
  elemental logical function allows_passing(self, speed)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]

    allows_passing = .true.
    if (self%has_rule) allows_passing = self%rule%bars_at(speed)
  end function allows_passing

  !> The amplitude that one line may have at a frequency; beyond the ends of the curve it is that of the end.
  elemental real(wp) function amplitude_limit(self, frequency) result(limit)
    class(response_limit_t), intent(in) :: self   !! with a curve
    real(wp), intent(in) :: frequency             !! [rad/s]
    integer :: i

    associate (x => self%frequency, y => self%amplitude)
      i = min(max(count(x <= frequency), 1), size(x) - 1)
      limit = y(i) + (y(i + 1) - y(i)) * min(max((frequency - x(i)) / (x(i + 1) - x(i)), 0.0_wp), 1.0_wp)
    end associate
  end function amplitude_limit

  !> The ratio of the amplitude of one line to the limit at its frequency; 0 without a curve.
  elemental real(wp) function curve_ratio(self, frequency, amplitude) result(ratio)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: frequency   !! [rad/s]
    real(wp), intent(in) :: amplitude   !! in the unit of the quantity

    ratio = 0.0_wp
    if (self%has_curve()) ratio = amplitude / self%amplitude_limit(frequency)
  end function curve_ratio

  !> Whether there is a curve of amplitudes over the frequency.
  elemental logical function has_curve(self)
    class(response_limit_t), intent(in) :: self

    has_curve = .false.
    if (allocated(self%frequency)) has_curve = size(self%frequency) > 0
  end function has_curve

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

    has_transient = self%transient < no_limit
    if (self%has_rule) has_transient = has_transient .or. self%rule%rule%transient%is_given()
  end function has_transient

  !> The rule that the limit for continuous operation comes from, '' if it is the user's own.
  pure subroutine write_rule(self, text)
    class(response_limit_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text

    text = ''
    if (self%has_rule) text = self%rule%rule%label
  end subroutine write_rule

  !> A speed in the terms of the rule, "lambda 0.84"; '' without a rule.
  pure subroutine write_place(self, speed, text)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed   !! [rad/s]
    character(len=:), allocatable, intent(out) :: text

    text = ''
    if (self%has_rule) call self%rule%write_place(speed, text)
  end subroutine write_place

  !> Whether a rule says which speeds about a critical one are to be barred.
  elemental logical function has_tolerance(self)
    class(response_limit_t), intent(in) :: self

    has_tolerance = .false.
    if (self%has_rule) has_tolerance = self%rule%has_tolerance()
  end function has_tolerance

  !> Widens a range of speeds that exceeds the limit to the one that the rule bars.
  pure subroutine find_barred(self, critical, from, to)
    class(response_limit_t), intent(in) :: self   !! which has a tolerance
    real(wp), intent(in) :: critical              !! speed of the largest ratio in the range [rad/s]
    real(wp), intent(inout) :: from, to           !! [rad/s]

    call self%rule%find_barred(critical, from, to)
  end subroutine find_barred

  !> "0.8", the speed ratio from which the rule accepts no barred range.
  pure subroutine write_unbarred(self, text)
    class(response_limit_t), intent(in) :: self
    character(len=:), allocatable, intent(out) :: text

    call self%rule%write_unbarred(text)
  end subroutine write_unbarred

  !> What is said of numbers outside of the ranges of the rule.
  pure subroutine list_notes(self, notes)
    class(response_limit_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: notes(:)

    allocate (notes(0))
    if (self%has_rule) notes = self%rule%notes
  end subroutine list_notes

  !> The largest ratio of a response to its limits for continuous operation.
  elemental real(wp) function ratio(self, speed, half_range, peak)
    class(response_limit_t), intent(in) :: self
    real(wp), intent(in) :: speed               !! [rad/s]
    real(wp), intent(in) :: half_range, peak    !! in the unit of the quantity

    ratio = 0.0_wp
    if (self%continuous_limit(speed) < no_limit) ratio = half_range / self%continuous_limit(speed)
    if (self%peak < no_limit) ratio = max(ratio, peak / self%peak)
  end function ratio

end module nocdyn_response_limits
