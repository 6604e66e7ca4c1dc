!> Key results of a forced response: critical speeds with their peaks, the largest synthesis of every coupling, ranges of
!> speeds that its limits bar.
module nocdyn_response_summary
  use nocdyn_critical_speeds, only: crossing_t, undamped
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_margins, only: operating_distance
  use nocdyn_response_analysis, only: response_analysis_t
  use nocdyn_response_limits, only: no_limit, response_limit_t
  use nocdyn_response_points, only: response_point_t
  use nocdyn_moment_forms, only: kind_reaction, kind_stress
  implicit none (type, external)
  private

  public :: summarise_response, worst_ratio

  !> A critical speed with the peak of the coupling that has most of the mode's potential energy.
  type, public :: critical_t
    type(crossing_t) :: crossing
    integer :: quantity = 0            !! the coupling, 0 if there is none
    real(wp) :: speed = 0.0_wp         !! of its peak; the critical speed itself if there is no peak near it [rad/s]
    real(wp) :: amplitude = 0.0_wp     !! at this speed, of the line alone [N m]
    real(wp) :: stress = 0.0_wp        !! amplitude of its stress at this speed, of the line alone; 0 if it is unknown [Pa]
    real(wp) :: half_range = 0.0_wp    !! at this speed, of all lines [N m]
    real(wp) :: ratio = 0.0_wp         !! of the response of this quantity to its limits there, 0 without limits
    logical :: is_unbounded = .false.  !! without damping there is no finite response
    real(wp) :: margin = 0.0_wp        !! distance to the speeds in operation as a share of the nearest of them; 0 inside
  end type critical_t

  !> Where a quantity has its largest half range and its largest peak.
  type, public :: largest_t
    integer :: half_point = 0, peak_point = 0   !! points of the response
    real(wp) :: half_range = 0.0_wp             !! [unit of the quantity]
    real(wp) :: peak = 0.0_wp                   !! largest magnitude, with the mean
    real(wp) :: ratio = 0.0_wp                  !! largest ratio to the limits, 0 without limits
    integer :: ratio_point = 0
    real(wp) :: peak_ratio = 0.0_wp             !! ratio of `peak` to its limit, 0 without one
  end type largest_t

  !> Speeds at which a limit for continuous operation is exceeded.
  type, public :: barred_range_t
    integer :: limit = 0
    real(wp) :: from = 0.0_wp, to = 0.0_wp      !! [rad/s]
    logical :: can_be_passed = .true.           !! whether the limit for passing them quickly is kept
    logical :: is_allowed = .true.              !! whether the rule of the limit accepts a barred range there
    integer :: worst = 0                        !! point with the largest ratio to the limit
    logical :: has_tolerance = .false.          !! whether the rule widens the range
    real(wp) :: barred(2) = 0.0_wp              !! the widened range [rad/s]
  end type barred_range_t

  type, public :: response_summary_t
    type(critical_t), allocatable :: criticals(:)
    type(largest_t), allocatable :: largest(:)          !! [quantities]
    type(barred_range_t), allocatable :: barred(:)
  end type response_summary_t

contains

  !> Sums up a response.
  type(response_summary_t) function summarise_response(analysis) result(self)
    type(response_analysis_t), intent(in) :: analysis
    integer :: i, q
    real(wp) :: half_range, peak, ratio

    allocate (self%criticals(size(analysis%crossings)), self%largest(size(analysis%response%quantities)), self%barred(0))
    do i = 1, size(self%criticals)
      self%criticals(i)%crossing = analysis%crossings(i)
      call find_peak(analysis, self%criticals(i))
      self%criticals(i)%margin = operating_distance(analysis%settings, analysis%crossings(i)%speed)
    end do
    ! the largest half range, peak and ratio of every quantity
    do i = 1, size(analysis%response%points)
      associate (point => analysis%response%points(i))
        do q = 1, size(self%largest)
          half_range = point%half_range(q)
          peak = point%peak(q)
          if (half_range > self%largest(q)%half_range .or. i == 1) then
            self%largest(q)%half_range = half_range
            self%largest(q)%half_point = i
          end if
          if (peak > self%largest(q)%peak .or. i == 1) then
            self%largest(q)%peak = peak
            self%largest(q)%peak_point = i
          end if
          ratio = worst_ratio(analysis%limits, point, q)
          if (ratio > self%largest(q)%ratio) then
            self%largest(q)%ratio = ratio
            self%largest(q)%ratio_point = i
          end if
        end do
      end associate
    end do
    do q = 1, size(self%largest)
      do i = 1, size(analysis%limits)
        associate (limit => analysis%limits(i))
          if (limit%quantity /= q .or. limit%peak_limit() >= no_limit) cycle
          self%largest(q)%peak_ratio = max(self%largest(q)%peak_ratio, self%largest(q)%peak / limit%peak_limit())
        end associate
      end do
    end do
    do i = 1, size(analysis%limits)
      call find_barred(analysis%response%points, analysis%limits(i), i, self%barred)
    end do
  end function summarise_response

  !> Follows the amplitude of a line uphill from its crossing with a mode.
  subroutine find_peak(analysis, critical)
    type(response_analysis_t), intent(in) :: analysis
    type(critical_t), intent(inout) :: critical
    real(wp), parameter :: near = 0.02_wp   ! of the critical speed, without damping
    integer :: i, k, start
    real(wp) :: speed(size(analysis%response%points))

    critical%quantity = critical%crossing%quantity
    critical%speed = critical%crossing%speed
    critical%is_unbounded = critical%crossing%damping_ratio <= undamped
    if (critical%quantity == 0 .or. critical%is_unbounded) return
    associate (points => analysis%response%points, line => critical%crossing%line, q => critical%quantity)
      speed = [(points(i)%state%speed, i=1, size(points))]
      start = minloc(abs(speed - critical%speed), dim=1)
      i = start
      do
        if (i > 1) then
          if (abs(points(i - 1)%quantity(line, q)) > abs(points(i)%quantity(line, q))) then
            i = i - 1
            cycle
          end if
        end if
        if (i == size(points)) exit
        if (abs(points(i + 1)%quantity(line, q)) <= abs(points(i)%quantity(line, q))) exit
        i = i + 1
      end do
      if (i == 1 .or. i == size(points) .or. abs(speed(i) - critical%speed) > &
          (near + 3.0_wp * critical%crossing%damping_ratio) * abs(critical%speed)) i = start
      critical%speed = speed(i)
      critical%amplitude = abs(points(i)%quantity(line, q))
      critical%half_range = points(i)%half_range(q)
      do k = 1, size(analysis%response%quantities)
        associate (one => analysis%response%quantities(k))
          if (one%element /= analysis%response%quantities(q)%element .or. one%kind == kind_reaction) cycle
          critical%ratio = max(critical%ratio, worst_ratio(analysis%limits, points(i), k))
          if (one%kind == kind_stress) critical%stress = abs(points(i)%quantity(line, k))
        end associate
      end do
    end associate
  end subroutine find_peak

  !> The largest ratio of a quantity to its limits for continuous operation at a speed, 0 without limits.
  pure real(wp) function worst_ratio(limits, point, quantity) result(ratio)
    type(response_limit_t), intent(in) :: limits(:)
    type(response_point_t), intent(in) :: point
    integer, intent(in) :: quantity
    integer :: k

    ratio = 0.0_wp
    do k = 1, size(limits)
      if (limits(k)%quantity /= quantity) cycle
      ratio = max(ratio, limits(k)%ratio(point%state%speed, point%half_range(quantity), point%peak(quantity)))
      if (limits(k)%has_curve()) ratio = max(ratio, maxval(limits(k)%curve_ratio(point%frequency, &
                                                                                 abs(point%quantity(:, quantity)))))
    end do
  end function worst_ratio

  !> The ranges of speeds in which the half range exceeds the limit for continuous operation; their ends are interpolated.
  subroutine find_barred(points, limit, number, barred)
    type(response_point_t), intent(in) :: points(:)
    type(response_limit_t), intent(in) :: limit
    integer, intent(in) :: number
    type(barred_range_t), allocatable, intent(inout) :: barred(:)
    real(wp) :: excess(size(points)), half_range(size(points)), speed(size(points))
    type(barred_range_t) :: range
    integer :: i

    do i = 1, size(points)
      speed(i) = points(i)%state%speed
      half_range(i) = points(i)%half_range(limit%quantity)
    end do
    excess = half_range / limit%continuous_limit(speed) - 1.0_wp
    range%limit = number
    i = 1
    do while (i <= size(points))
      if (excess(i) > 0) then
        range%from = edge(speed, excess, i, i - 1)
        range%worst = i
        range%can_be_passed = limit%has_transient()
        range%is_allowed = .true.
        do
          if (excess(i) > excess(range%worst)) range%worst = i
          range%is_allowed = range%is_allowed .and. limit%allows_passing(speed(i))
          range%can_be_passed = range%can_be_passed .and. half_range(i) <= limit%transient_limit(speed(i))
          range%to = edge(speed, excess, i, i + 1)
          i = i + 1
          if (i > size(points)) exit
          if (excess(i) <= 0) exit
        end do
        range%barred = [range%from, range%to]
        range%has_tolerance = limit%has_tolerance()
        if (range%has_tolerance) call limit%find_barred(speed(range%worst), range%barred(1), range%barred(2))
        barred = [barred, range]
      end if
      i = i + 1
    end do
  end subroutine find_barred

  !> The speed between two points at which a limit is reached; the one of the first one if there is no other point [rad/s].
  pure real(wp) function edge(speed, excess, inside, outside)
    real(wp), intent(in) :: speed(:), excess(:)   !! [points]
    integer, intent(in) :: inside, outside        !! the point outside may be none

    edge = speed(inside)
    if (outside < 1 .or. outside > size(speed)) return
    edge = edge + (speed(outside) - speed(inside)) * excess(inside) / (excess(inside) - excess(outside))
  end function edge

end module nocdyn_response_summary
