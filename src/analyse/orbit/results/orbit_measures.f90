!> What is measured on the motions of an orbit analysis: the ranges of signals, damage per hour, limits; chosen motions.
module nocdyn_orbit_measures
  use nocdyn_column_names, only: choose_signals
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_moment_forms, only: moment_form_t
  use nocdyn_orbit_analysis, only: analyse_orbits, orbit_analysis_t
  use nocdyn_orbit_couplings, only: describe_point, list_couplings
  use nocdyn_orbit_damages, only: orbit_damage_t, read_damages
  use nocdyn_orbit_log, only: orbit_log_t
  use nocdyn_orbit_motions, only: find_motions, motion_t
  use nocdyn_orbit_parts, only: find_parts, part_t
  use nocdyn_orbit_problem, only: fold, orbit_point_t, signal_range_t
  use nocdyn_orbit_signals, only: list_orbit_signals
  use nocdyn_response_limits, only: no_limit, read_limits, response_limit_t
  use nocdyn_signal_columns, only: new_signal_columns, signal_columns_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: append, rounded_text, string_t
  implicit none (type, external)
  private

  public :: measure_orbits

  !> What a limit compares.
  integer, parameter, public :: of_half_range = 1, of_largest = 2, of_harmonic = 3
  integer, parameter, public :: comparisons = 3

  !> What is measured on one motion.
  type, public :: orbit_measure_t
    type(signal_range_t), allocatable :: ranges(:)           !! [signals]
    real(wp), allocatable :: damage(:)                       !! per hour [1/h], [damages]
    logical, allocatable :: exceeds_strength(:)              !! whether a mean leaves no strength, [damages]
    real(wp), allocatable :: value(:, :), allowed(:, :)      !! [comparisons, limits]; `no_limit`: nothing is compared
    real(wp), allocatable :: amplitude(:, :)                 !! [harmonics, signals], if the spectrum is wanted
  end type orbit_measure_t

  !> A motion that the input asks for, or on which a jump ends.
  type, extends(motion_t), public :: measured_motion_t
    type(orbit_measure_t) :: measure
    type(signal_samples_t) :: samples        !! of a chosen motion
  end type measured_motion_t

  type, extends(orbit_analysis_t), public :: measured_orbits_t
    type(signal_t), allocatable :: signals(:)                !! of the tables, in SI units; first ones of those that are measured
    type(signal_columns_t) :: columns                        !! of all that are measured
    type(response_limit_t), allocatable :: limits(:)
    type(orbit_damage_t), allocatable :: damages(:)
    logical :: needs_samples = .false.                       !! whether ranges alone do not suffice
    integer :: reference = 0                                 !! body to whose mean speed rules of limits refer, 0: none
    type(orbit_measure_t), allocatable :: measures(:)        !! of the points
    type(measured_motion_t), allocatable :: motions(:)       !! at the values that the input asks for
    type(measured_motion_t), allocatable :: landings(:)      !! stable motions at folds where a stable one ends
    integer, allocatable :: jump(:)                          !! of each landing: the point from which the motion jumps
  contains
    procedure :: peak, worst_damage, reference_speed, measure, are_possible
  end type measured_orbits_t

contains

  !> Follows the branches of an input and measures their points.
  subroutine measure_orbits(input, machine, self, error, log)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! one lane
    type(measured_orbits_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(orbit_log_t), target, intent(inout), optional :: log   !! journal, which must live as long as `self`
    type(string_t), allocatable :: notes(:)
    integer :: i
    logical :: is_mode

    allocate (notes(0))
    is_mode = .false.
    if (size(input%groups_named('orbit')) > 0) then
      is_mode = input%groups(input%position('orbit'))%has_value('mode')
      if (.not. is_mode) call choose_measured(input, machine, self, notes, error)
    end if
    if (.not. allocated(error)) call analyse_orbits(input, machine, self%orbit_analysis_t, error, log)
    if (.not. allocated(error) .and. is_mode) then   ! whose machine has fewer elements
      call choose_measured(input, self%problem%periodic%machine%formulation%machine, self, notes, error)
    end if
    if (allocated(error)) return
    self%notes = [notes, self%notes]
    call find_reference(input, machine, self)
    call leave_out_samples(self)
    allocate (self%measures(self%branch%count))
    call list_couplings(self%problem%periodic%machine%formulation%machine, self%branch%count, self%couplings)
    do i = 1, size(self%measures)
      call self%measure(self%branch%points(i), self%measures(i), error)
      if (.not. allocated(error)) call describe_point(self%problem, self%branch%points(i), i, self%couplings, error)
      if (allocated(error)) return
    end do
    call find_chosen(self, error)
    if (.not. allocated(error)) call find_landings(self, error)
  end subroutine measure_orbits

  !> Leaves out what needs samples of a period where there is none, as of steady states.
  subroutine leave_out_samples(self)
    type(measured_orbits_t), intent(inout) :: self
    type(signal_samples_t) :: samples
    type(error_t), allocatable :: error

    if (self%branch%count == 0 .or. .not. self%needs_samples .and. size(self%settings%motions) == 0) return
    call self%problem%sample(self%branch%points(1), self%columns%columns, 0, samples, error)
    if (allocated(error) .or. allocated(samples%series)) return
    call append(self%notes, 'motions, spectrum, damage and limits over the frequency are left out: those found are steady states')
    deallocate (self%damages, self%settings%motions)
    allocate (self%damages(0), self%settings%motions(0))
    self%settings%has_spectrum = .false.
    self%needs_samples = .false.
  end subroutine leave_out_samples

  !> The motions that the input asks for.
  subroutine find_chosen(self, error)
    type(measured_orbits_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: samples = 256   ! of a period at least
    type(motion_t), allocatable :: found(:)
    integer :: i, k

    allocate (self%motions(0))
    do i = 1, size(self%settings%motions)
      call find_motions(self, self%settings%motions(i), found)
      if (size(found) == 0) call append(self%notes, 'no motion was found at ' // rounded_text(self%settings%motions(i), 8))
      do k = 1, size(found)
        call add_motion(self, found(k), samples, self%motions, error)
        if (allocated(error)) return
      end do
    end do
  end subroutine find_chosen

  !> The stable motions that there are beside a fold: a motion that jumps there ends on one of them.
  subroutine find_landings(self, error)
    type(measured_orbits_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(motion_t), allocatable :: found(:)
    integer :: i, k

    allocate (self%landings(0), self%jump(0))
    if (.not. self%settings%has_stability .or. self%settings%body > 0) return
    do i = 2, self%branch%count - 1
      if (self%branch%points(i)%kind /= fold) cycle
      if (.not. (self%branch%points(i - 1)%is_stable() .or. self%branch%points(i + 1)%is_stable())) cycle
      call find_motions(self, self%branch%points(i)%orbit%value, found)
      do k = 1, size(found)
        if (found(k)%after == i .or. .not. found(k)%point%is_stable()) cycle
        call add_motion(self, found(k), 0, self%landings, error)
        if (allocated(error)) return
        self%jump = [self%jump, i]
      end do
    end do
  end subroutine find_landings

  !> Measures a motion and adds it to a list.
  subroutine add_motion(self, motion, samples, list, error)
    class(measured_orbits_t), intent(inout) :: self
    type(motion_t), intent(in) :: motion
    integer, intent(in) :: samples   !! over a period at least, 0: none are kept
    type(measured_motion_t), allocatable, intent(inout) :: list(:)
    type(error_t), allocatable, intent(out) :: error
    type(measured_motion_t) :: one

    one%motion_t = motion
    call self%measure(one%point, one%measure, error)
    if (.not. allocated(error) .and. samples > 0) then
      call self%problem%sample(one%point, self%columns%columns, samples, one%samples, error)
    end if
    if (.not. allocated(error)) list = [list, one]
  end subroutine add_motion

  !> Whether the points are motions on which the machine can stay: stable ones, or all if the stability is not known.
  pure function are_possible(self) result(possible)
    class(measured_orbits_t), intent(in) :: self
    logical :: possible(self%branch%count)
    type(part_t), allocatable :: parts(:)
    integer :: i

    possible = .false.
    call find_parts(self%branch%points(:self%branch%count), parts)
    do i = 1, size(parts)
      if (parts(i)%is_stable) possible(parts(i)%first:parts(i)%last) = .true.
    end do
  end function are_possible

  !> The signals of the tables, and others that limits and damages need.
  subroutine choose_measured(input, machine, self, notes, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(measured_orbits_t), intent(inout) :: self
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(signal_t), allocatable :: all(:)
    type(moment_form_t), allocatable :: forms(:)
    integer, allocatable :: chosen(:), measured(:)
    integer :: i

    call list_orbit_signals(machine, all)
    call choose_signals(input, 'orbit', all, chosen, notes, error)
    if (allocated(error)) return
    allocate (forms(size(all)))
    do i = 1, size(all)
      forms(i)%signal_t = all(i)
    end do
    if (input%groups(input%position('orbit'))%has_value('mode')) then   ! no motion of operation
      allocate (self%limits(0), self%damages(0))
    else
      call read_limits(input, forms, self%limits, error)
      if (allocated(error)) return
      call read_damages(input, all, self%damages)
    end if
    self%signals = all(chosen)
    measured = chosen
    do i = 1, size(self%limits)
      call put_first(self%limits(i)%quantity, measured)
    end do
    do i = 1, size(self%damages)
      call put_first(self%damages(i)%signal, measured)
    end do
    call new_signal_columns(machine, all(measured), self%columns)
    self%needs_samples = size(self%damages) > 0 .or. any(self%limits%has_curve()) .or. &
                         input%groups(input%position('orbit'))%flag('spectrum')
  end subroutine choose_measured

  !> Gives a signal its place among the measured ones, at the end if it is none of them.
  subroutine put_first(signal, measured)
    integer, intent(inout) :: signal   !! of all, on return of the measured ones
    integer, allocatable, intent(inout) :: measured(:)

    if (.not. any(measured == signal)) measured = [measured, signal]
    signal = findloc(measured, signal, dim=1)
  end subroutine put_first

  !> The body to whose speed rules refer: the one whose speed is held, else the one of &response.
  subroutine find_reference(input, machine, self)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(measured_orbits_t), intent(inout) :: self
    integer :: i

    self%reference = self%settings%body
    if (self%reference > 0 .or. size(input%groups_named('response')) == 0) return
    associate (group => input%groups(input%position('response')))
      if (.not. group%has_value('body')) return
      self%reference = findloc([(machine%names(i)%text == group%text('body'), i=1, machine%bodies)], .true., dim=1)
    end associate
  end subroutine find_reference

  !> The mean speed to which rules refer [rad/s].
  pure real(wp) function reference_speed(self, point) result(speed)
    class(measured_orbits_t), intent(in) :: self
    type(orbit_point_t), intent(in) :: point

    speed = 0.0_wp
    if (self%reference > 0) speed = dot_product(self%problem%periodic%turning(self%reference, :), point%orbit%speed)
  end function reference_speed

  !> Measures one motion.
  subroutine measure(self, point, found, error)
    class(measured_orbits_t), intent(inout) :: self
    type(orbit_point_t), intent(inout) :: point
    type(orbit_measure_t), intent(out) :: found
    type(error_t), allocatable, intent(out) :: error
    type(signal_range_t) :: ranges(size(self%columns%columns))
    type(signal_samples_t) :: samples
    integer :: h, i, k

    call self%problem%measure(point, self%columns%columns, ranges, error)
    if (.not. allocated(error) .and. self%needs_samples) then
      call self%problem%sample(point, self%columns%columns, 0, samples, error)
    end if
    if (allocated(error)) return
    found%ranges = [(self%columns%range_of(i, ranges), i=1, size(self%columns%signals))]
    call find_damage(self, point, samples, found)
    call compare(self, point, samples, found)
    allocate (found%amplitude(0, size(self%signals)))
    if (.not. (self%settings%has_spectrum .and. allocated(samples%series))) return
    deallocate (found%amplitude)
    allocate (found%amplitude(samples%harmonics, size(self%signals)))
    do i = 1, size(self%signals)
      k = self%columns%widest(i, samples)
      found%amplitude(:, i) = [(samples%amplitude(k, h), h=1, size(found%amplitude, 1))]
    end do
  end subroutine measure

  !> The damage per hour by each &fatigue; none where the method has no samples.
  subroutine find_damage(self, point, samples, found)
    class(measured_orbits_t), intent(in) :: self
    type(orbit_point_t), intent(in) :: point
    type(signal_samples_t), intent(in) :: samples
    type(orbit_measure_t), intent(inout) :: found
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    integer :: i

    allocate (found%damage(size(self%damages)), source=0.0_wp)
    allocate (found%exceeds_strength(size(self%damages)), source=.false.)
    if (.not. allocated(samples%series)) return
    do i = 1, size(self%damages)
      call self%damages(i)%rate(self%columns, samples, turn / point%orbit%rate, found%damage(i), found%exceeds_strength(i))
    end do
  end subroutine find_damage

  !> What limits compare: the half range, the largest magnitude, and the harmonic that is nearest to a curve over the frequency.
  subroutine compare(self, point, samples, found)
    class(measured_orbits_t), intent(in) :: self
    type(orbit_point_t), intent(in) :: point
    type(signal_samples_t), intent(in) :: samples
    type(orbit_measure_t), intent(inout) :: found
    real(wp) :: amplitude, largest, ratio
    integer :: h, i, k

    allocate (found%value(comparisons, size(self%limits)), source=0.0_wp)
    allocate (found%allowed(comparisons, size(self%limits)), source=no_limit)
    do i = 1, size(self%limits)
      associate (limit => self%limits(i), range => found%ranges(self%limits(i)%quantity))
        found%value(of_half_range, i) = range%half_range
        if (limit%has_continuous()) found%allowed(of_half_range, i) = limit%continuous_limit(self%reference_speed(point))
        found%value(of_largest, i) = range%largest
        found%allowed(of_largest, i) = limit%peak_limit()
        if (.not. (limit%has_curve() .and. allocated(samples%series))) cycle
        largest = -1.0_wp
        k = self%columns%widest(limit%quantity, samples)
        do h = 1, samples%harmonics
          amplitude = samples%amplitude(k, h)
          ratio = limit%curve_ratio(h * point%orbit%rate, amplitude)
          if (ratio <= largest) cycle
          largest = ratio
          found%value(of_harmonic, i) = amplitude
          found%allowed(of_harmonic, i) = limit%amplitude_limit(h * point%orbit%rate)
        end do
      end associate
    end do
  end subroutine compare

  !> The point with the largest half range of a signal.
  pure integer function peak(self, signal)
    class(measured_orbits_t), intent(in) :: self
    integer, intent(in) :: signal
    integer :: i

    peak = maxloc([(self%measures(i)%ranges(signal)%half_range, i=1, size(self%measures))], dim=1)
  end function peak

  !> The possible point with the largest damage by a &fatigue, 0 if no motion is possible.
  pure integer function worst_damage(self, number)
    class(measured_orbits_t), intent(in) :: self
    integer, intent(in) :: number
    integer :: i

    worst_damage = maxloc([(self%measures(i)%damage(number), i=1, size(self%measures))], dim=1, mask=self%are_possible())
  end function worst_damage

end module nocdyn_orbit_measures
