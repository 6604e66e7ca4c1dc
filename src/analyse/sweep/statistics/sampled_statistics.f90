!> Statistics of any columns, from their values at places of the solution inside the steps.
!>
!> In every step, or what of it lies after `from`, a column is taken for the polynomial through its values at the
!> Chebyshev-Lobatto places, as many as the solution has coefficients there. Integrals are taken by as many Gauss nodes: a
!> linear function of the state and its square are integrated exactly.
module nocdyn_sampled_statistics
  use nocdyn_chebyshev, only: lay_places
  use nocdyn_extremes, only: allocate_ranges, begin_ranges, right_before, widen
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_quadrature, only: lay_gauss_rule
  use nocdyn_recorded_columns, only: new_recorded_columns, recorded_columns_t
  use nocdyn_settling, only: settling_t
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_mean, statistic_min, statistic_rms, &
    statistic_settling_time, statistic_t, statistic_time_of_max
  use nocdyn_system, only: ranges_t, steps_t
  use nocdyn_trajectory_columns, only: column_t
  implicit none (type, external)
  private

  public :: new_sampled_statistics

  !> What is kept from a time on. A column is of no use here unless a statistic asks for it.
  type :: span_t
    real(wp) :: from = 0.0_wp                              !! [s]
    integer, allocatable :: ranged(:)                      !! columns whose extremes are wanted
    integer, allocatable :: summed(:)                      !! whose integrals are
    integer, allocatable :: settled(:)                     !! whose last exit from a band is
    logical, allocatable :: begun(:)                       !! whether a lane has passed `from`, [lanes]
    type(ranges_t), allocatable :: ranges(:)               !! of `ranged`, [lanes]
    real(wp), allocatable :: integral(:, :), square(:, :)  !! over time, [summed, lanes]
    real(wp), allocatable :: first(:, :)                   !! values at `from`, [settled, lanes]
    type(settling_t), allocatable :: kept(:)               !! [lanes]
    real(wp), allocatable :: sample(:, :)                  !! of `ranged`, [ranged, places]
  end type span_t

  type, public :: sampled_statistics_t
    type(recorded_columns_t) :: recorded
    real(wp), private :: t_end = 0.0_wp
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)      !! of each statistic among the recorded
    integer, allocatable, private :: span(:)        !! of each statistic
    integer, allocatable, private :: place(:)       !! of its column in the list of the span
    type(span_t), allocatable, private :: spans(:)
    logical, private :: has_places = .false., has_nodes = .false.
    real(wp), allocatable, private :: places(:)     !! of Chebyshev and Lobatto, -1 to 1
    real(wp), allocatable, private :: to_series(:, :)
    real(wp), allocatable, private :: nodes(:), weights(:)        !! of Gauss, 0 to 1
    logical, allocatable, private :: active(:)                    !! lanes whose step is looked at
    real(wp), allocatable, private :: start(:), sampled_start(:)  !! of the part of the step [s]
    real(wp), allocatable, private :: values(:, :, :)             !! [places, columns, lanes]
    real(wp), allocatable, private :: at_nodes(:, :, :)           !! [columns, nodes, lanes]
    real(wp), allocatable, private :: final(:, :)                 !! [columns, lanes]
    real(wp), allocatable, private :: row(:)                      !! [columns]
    real(wp), allocatable, private :: t(:), theta(:), y(:, :)     !! where the lanes are looked at
  contains
    procedure :: begin
    procedure :: follow
    procedure :: conclude
    procedure :: value
  end type sampled_statistics_t

contains

  function new_sampled_statistics(formulation, columns, statistics, t_end) result(self)
    class(formulation_t), intent(in) :: formulation
    type(column_t), intent(in) :: columns(:)         !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)
    real(wp), intent(in) :: t_end                    !! [s]
    type(sampled_statistics_t) :: self
    integer, allocatable :: column_numbers(:), wanted(:)

    self%t_end = t_end
    allocate (self%statistics, source=statistics)
    allocate (column_numbers(size(statistics)), source=statistics%column)
    wanted = distinct(column_numbers)
    self%column = places_in(wanted, column_numbers)
    self%recorded = new_recorded_columns(formulation, columns(wanted))
    call divide_spans(self, formulation%lanes)
    associate (lanes => formulation%lanes)
      allocate (self%active(lanes), source=.false.)
      allocate (self%start(lanes), self%sampled_start(lanes), self%t(lanes), self%theta(lanes), source=0.0_wp)
      allocate (self%y(lanes, formulation%states + formulation%quadratures), self%final(size(wanted), lanes), &
                self%row(size(wanted)), source=0.0_wp)
    end associate
  end function new_sampled_statistics

  !> The different numbers of a list, ascending.
  pure function distinct(list)
    integer, intent(in) :: list(:)
    integer, allocatable :: distinct(:)
    integer :: i

    distinct = pack([(i, i=1, maxval([0, list]))], [(any(list == i), i=1, maxval([0, list]))])
  end function distinct

  !> Where the numbers of a list stand in another, 0 if they do not.
  pure function places_in(list, numbers) result(places)
    integer, intent(in) :: list(:), numbers(:)
    integer :: places(size(numbers))
    integer :: i

    places = [(findloc(list, numbers(i), dim=1), i=1, size(numbers))]
  end function places_in

  !> One span for each `from`.
  subroutine divide_spans(self, lanes)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lanes
    integer :: i, k, spans

    allocate (self%span(size(self%statistics)), self%place(size(self%statistics)), source=0)
    spans = 0
    do i = 1, size(self%statistics)
      if (self%statistics(i)%kind == statistic_final) cycle
      do k = 1, i - 1
        if (abs(self%statistics(k)%from - self%statistics(i)%from) <= 0) self%span(i) = max(self%span(i), self%span(k))
      end do
      if (self%span(i) == 0) spans = spans + 1
      if (self%span(i) == 0) self%span(i) = spans
    end do
    allocate (self%spans(spans))
    do i = 1, size(self%statistics)
      if (self%span(i) > 0) self%spans(self%span(i))%from = self%statistics(i)%from
    end do
    do i = 1, spans
      call fill_span(self, i, lanes)
    end do
    self%has_places = any([(size(self%spans(i)%ranged) + size(self%spans(i)%settled) > 0, i=1, spans)])
    self%has_nodes = any([(size(self%spans(i)%summed) > 0, i=1, spans)])
  end subroutine divide_spans

  subroutine fill_span(self, number, lanes)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: number, lanes
    logical, dimension(size(self%statistics)) :: here, is_settled, is_summed
    integer :: lane

    here = self%span == number
    is_settled = self%statistics%kind == statistic_settling_time
    is_summed = self%statistics%kind == statistic_mean .or. self%statistics%kind == statistic_rms
    associate (span => self%spans(number))
      span%settled = distinct(pack(self%column, here .and. is_settled))
      span%summed = distinct(pack(self%column, here .and. is_summed))
      span%ranged = distinct(pack(self%column, here .and. .not. (is_settled .or. is_summed)))
      where (here) self%place = places_in(span%ranged, self%column)
      where (here .and. is_summed) self%place = places_in(span%summed, self%column)
      where (here .and. is_settled) self%place = places_in(span%settled, self%column)
      allocate (span%begun(lanes), source=.false.)
      allocate (span%integral(size(span%summed), lanes), span%square(size(span%summed), lanes), &
                span%first(size(span%settled), lanes), source=0.0_wp)
      allocate (span%kept(lanes), span%ranges(lanes))
      do lane = 1, lanes
        call allocate_ranges(span%ranges(lane), size(span%ranged))
      end do
    end associate
  end subroutine fill_span

  !> A lane starts anew; the numbers of its machine are in `recorded` already.
  subroutine begin(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    integer :: i

    call look_at(self, lane, t, y)
    call self%recorded%begin(lane)
    do i = 1, size(self%spans)
      associate (span => self%spans(i))
        span%begun(lane) = .false.
        span%integral(:, lane) = 0.0_wp
        span%square(:, lane) = 0.0_wp
        call span%kept(lane)%clear()
      end associate
    end do
  end subroutine begin

  !> Brings one lane to a time and state, and leaves the others where they are.
  subroutine look_at(self, lane, t, y)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%t(lane) = t
    self%y(lane, :) = y
    call self%recorded%observe(self%t, self%y)
  end subroutine look_at

  !> The end of a lane.
  subroutine conclude(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    call look_at(self, lane, t, y)
    call self%recorded%take_values(lane, self%t, self%y, self%row)
    self%final(:, lane) = self%row
  end subroutine conclude

  !> The steps of a block.
  subroutine follow(self, steps, chosen, y, c)
    class(sampled_statistics_t), intent(inout) :: self
    type(steps_t), intent(in) :: steps
    logical, intent(in) :: chosen(:)                 !! lanes that are wanted
    real(wp), contiguous, intent(in) :: y(:, :)      !! [lanes, padded columns]
    real(wp), contiguous, intent(in) :: c(:, :, :)   !! [lanes, padded columns, degree]
    integer :: i, lane

    if (size(self%spans) == 0) return
    call lay_out(self, size(c, 3))
    self%sampled_start(:) = huge(0.0_wp)
    do i = 1, size(self%spans)
      associate (span => self%spans(i))
        self%active(:) = steps%taken .and. chosen .and. steps%t_new > span%from
        if (.not. any(self%active)) cycle
        self%start(:) = merge(max(steps%t, span%from), huge(0.0_wp), self%active)
        if (any(abs(self%start - self%sampled_start) > 0)) call sample_parts(self, steps, y, c)
        do lane = 1, size(self%active)
          if (self%active(lane)) call take_part(self, span, lane, steps%t_new(lane))
        end do
      end associate
    end do
  end subroutine follow

  !> Places and nodes for a degree of the solution inside the steps.
  subroutine lay_out(self, degree)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: degree
    integer :: i

    if (allocated(self%places)) then
      if (size(self%places) /= degree + 1) error stop 'nocdyn_sampled_statistics: the method must remain the same'
      return
    end if
    allocate (self%places(degree + 1), self%to_series(degree + 1, degree + 1), self%nodes(degree + 1), self%weights(degree + 1))
    call lay_places(degree, self%places, self%to_series)
    call lay_gauss_rule(degree + 1, self%nodes, self%weights)
    associate (columns => size(self%row), lanes => size(self%active))
      allocate (self%values(degree + 1, columns, lanes), self%at_nodes(columns, degree + 1, lanes), source=0.0_wp)
    end associate
    do i = 1, size(self%spans)
      allocate (self%spans(i)%sample(size(self%spans(i)%ranged), degree + 1), source=0.0_wp)
    end do
  end subroutine lay_out

  !> The columns at the places and nodes of the parts of the steps of the active lanes. A column that jumps at a crossing where
  !> the step ends is taken right before: a jump is no part of the step.
  subroutine sample_parts(self, steps, y, c)
    type(sampled_statistics_t), intent(inout) :: self
    type(steps_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    real(wp) :: half
    integer :: i, lane, last

    self%sampled_start(:) = self%start
    last = merge(size(self%places), 0, self%has_places)
    do i = 1, last
      self%t(:) = steps%t
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        half = 0.5_wp * (steps%t_new(lane) - self%start(lane))
        self%t(lane) = self%start(lane) + half + self%places(i) * half
        if (i == last .and. steps%crosses(lane)) then
          self%t(lane) = max(self%start(lane), steps%t_new(lane) - right_before * spacing(steps%t_new(lane)))
        end if
      end do
      call sample_states(self, steps, y, c)
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        call self%recorded%take_values(lane, self%t, self%y, self%row)
        self%values(i, :, lane) = self%row
      end do
    end do
    do i = 1, merge(size(self%nodes), 0, self%has_nodes)
      self%t(:) = steps%t
      do lane = 1, size(self%active)
        if (self%active(lane)) self%t(lane) = self%start(lane) + self%nodes(i) * (steps%t_new(lane) - self%start(lane))
      end do
      call sample_states(self, steps, y, c)
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        call self%recorded%take_values(lane, self%t, self%y, self%row)
        self%at_nodes(:, i, lane) = self%row
      end do
    end do
  end subroutine sample_parts

  !> Observes the active lanes at the times t, and the others where their steps start.
  subroutine sample_states(self, steps, y, c)
    type(sampled_statistics_t), intent(inout) :: self
    type(steps_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    integer :: component, lane, p

    do lane = 1, size(self%active)
      self%theta(lane) = 0.0_wp
      if (.not. self%active(lane)) cycle
      self%theta(lane) = steps%scale(lane) * min(1.0_wp, (self%t(lane) - steps%t(lane)) / steps%h(lane))
    end do
    do component = 1, size(self%y, 2)
      associate (state => self%y(:, component))
        state = c(:, component, size(c, 3))
        do p = size(c, 3) - 1, 1, -1
          state = c(:, component, p) + self%theta * state
        end do
        state = merge(y(:, component) + self%theta * state, y(:, component), self%active)
      end associate
    end do
    call self%recorded%observe(self%t, self%y)
  end subroutine sample_states

  !> Takes part of a lane's step into what is kept of a span.
  subroutine take_part(self, span, lane, t_end)
    type(sampled_statistics_t), intent(in) :: self
    type(span_t), intent(inout) :: span
    integer, intent(in) :: lane
    real(wp), intent(in) :: t_end   !! of the step
    integer :: i, k

    associate (duration => t_end - self%start(lane))
      do i = 1, size(span%ranged)
        span%sample(i, :) = self%values(:, span%ranged(i), lane)
      end do
      if (.not. span%begun(lane)) then
        call begin_ranges(span%ranges(lane), span%sample(:, 1), self%start(lane))
        do i = 1, size(span%settled)
          span%first(i, lane) = self%values(1, span%settled(i), lane)
        end do
      end if
      span%begun(lane) = .true.
      if (size(span%ranged) > 0) then
        call widen(size(self%places), self%places, self%to_series, span%sample, span%ranges(lane), self%start(lane), t_end)
      end if
      if (size(span%settled) > 0) call span%kept(lane)%keep(self%start(lane), t_end, span%settled, self%values(:, :, lane))
      do i = 1, size(span%summed)
        do k = 1, size(self%nodes)
          associate (x => self%at_nodes(span%summed(i), k, lane))
            span%integral(i, lane) = span%integral(i, lane) + duration * self%weights(k) * x
            span%square(i, lane) = span%square(i, lane) + duration * self%weights(k) * x**2
          end associate
        end do
      end do
    end associate
  end subroutine take_part

  !> A statistic of a lane that has reached its end.
  real(wp) function value(self, number, lane)
    class(sampled_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    associate (statistic => self%statistics(number), i => self%place(number))
      if (statistic%kind == statistic_final) then
        value = self%final(self%column(number), lane)
        return
      end if
      associate (span => self%spans(self%span(number)))
        select case (statistic%kind)
        case (statistic_max)
          value = span%ranges(lane)%highest(i)
        case (statistic_min)
          value = span%ranges(lane)%lowest(i)
        case (statistic_max_abs)
          value = max(abs(span%ranges(lane)%lowest(i)), abs(span%ranges(lane)%highest(i)))
        case (statistic_time_of_max)
          value = span%ranges(lane)%highest_time(i)
        case (statistic_mean)
          value = span%integral(i, lane) / (self%t_end - span%from)
        case (statistic_rms)
          value = sqrt(span%square(i, lane) / (self%t_end - span%from))
        case (statistic_settling_time)
          associate (end_value => self%final(self%column(number), lane))
            value = span%kept(lane)%last_exit(self%to_series, i, end_value, &
                                              statistic%band * abs(span%first(i, lane) - end_value)) &
                    - span%from
          end associate
        case default
          error stop 'nocdyn_sampled_statistics: there is no such statistic'
        end select
      end associate
    end associate
  end function value

end module nocdyn_sampled_statistics
