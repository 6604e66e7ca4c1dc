!> Statistics of any columns, from their values at places of the solution inside the steps.
!>
!> In every step, or what of it lies after `from`, a column is taken for the polynomial through its values at the
!> Chebyshev-Lobatto places, as many as the solution has coefficients there. Integrals are taken by as many Gauss nodes: a
!> linear function of the state and its square are integrated exactly.
module nocdyn_sampled_statistics
  use nocdyn_chebyshev, only: lobatto_nodes
  use nocdyn_extremes, only: allocate_ranges, start_ranges, before_jump, widen_ranges
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_recorded_columns, only: new_recorded_columns, recorded_columns_t
  use nocdyn_settling_time, only: settling_history_t
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_mean, statistic_min, statistic_rms, &
    statistic_settling_time, statistic_t, statistic_time_of_max
  use nocdyn_observer, only: ranges_t, step_block_t
  use nocdyn_trajectory_columns, only: column_t
  implicit none (type, external)
  private

  public :: new_sampled_statistics

  !> What is kept from a time on. A column is of no use here unless a statistic asks for it.
  type :: window_t
    real(wp) :: from = 0.0_wp                              !! [s]
    integer, allocatable :: ranged(:)                      !! columns whose extremes are wanted
    integer, allocatable :: summed(:)                      !! whose integrals are
    integer, allocatable :: settled(:)                     !! whose last exit from a band is
    logical, allocatable :: has_started(:)                       !! whether a lane has passed `from`, [lanes]
    type(ranges_t), allocatable :: ranges(:)               !! of `ranged`, [lanes]
    real(wp), allocatable :: integral(:, :), square(:, :)  !! over time, [summed, lanes]
    real(wp), allocatable :: first(:, :)                   !! values at `from`, [settled, lanes]
    type(settling_history_t), allocatable :: kept(:)               !! [lanes]
    real(wp), allocatable :: sample(:, :)                  !! of `ranged`, [ranged, places]
  end type window_t

  type, public :: sampled_statistics_t
    type(recorded_columns_t) :: recorded
    real(wp), private :: t_end = 0.0_wp
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)      !! of each statistic among the recorded
    integer, allocatable, private :: window(:)        !! of each statistic
    integer, allocatable, private :: position(:)       !! of its column in the list of the span
    type(window_t), allocatable, private :: windows(:)
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
    procedure :: start_lane
    procedure :: add_steps
    procedure :: finish_lane
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
    self%column = positions_in(wanted, column_numbers)
    self%recorded = new_recorded_columns(formulation, columns(wanted))
    call make_windows(self, formulation%lanes)
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
  pure function positions_in(list, numbers) result(places)
    integer, intent(in) :: list(:), numbers(:)
    integer :: places(size(numbers))
    integer :: i

    places = [(findloc(list, numbers(i), dim=1), i=1, size(numbers))]
  end function positions_in

  !> One span for each `from`.
  subroutine make_windows(self, lanes)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lanes
    integer :: i, k, windows

    allocate (self%window(size(self%statistics)), self%position(size(self%statistics)), source=0)
    windows = 0
    do i = 1, size(self%statistics)
      if (self%statistics(i)%kind == statistic_final) cycle
      do k = 1, i - 1
        if (abs(self%statistics(k)%from - self%statistics(i)%from) <= 0) self%window(i) = max(self%window(i), self%window(k))
      end do
      if (self%window(i) == 0) windows = windows + 1
      if (self%window(i) == 0) self%window(i) = windows
    end do
    allocate (self%windows(windows))
    do i = 1, size(self%statistics)
      if (self%window(i) > 0) self%windows(self%window(i))%from = self%statistics(i)%from
    end do
    do i = 1, windows
      call fill_window(self, i, lanes)
    end do
    self%has_places = any([(size(self%windows(i)%ranged) + size(self%windows(i)%settled) > 0, i=1, windows)])
    self%has_nodes = any([(size(self%windows(i)%summed) > 0, i=1, windows)])
  end subroutine make_windows

  subroutine fill_window(self, number, lanes)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: number, lanes
    logical, dimension(size(self%statistics)) :: here, is_settled, is_summed
    integer :: lane

    here = self%window == number
    is_settled = self%statistics%kind == statistic_settling_time
    is_summed = self%statistics%kind == statistic_mean .or. self%statistics%kind == statistic_rms
    associate (window => self%windows(number))
      window%settled = distinct(pack(self%column, here .and. is_settled))
      window%summed = distinct(pack(self%column, here .and. is_summed))
      window%ranged = distinct(pack(self%column, here .and. .not. (is_settled .or. is_summed)))
      where (here) self%position = positions_in(window%ranged, self%column)
      where (here .and. is_summed) self%position = positions_in(window%summed, self%column)
      where (here .and. is_settled) self%position = positions_in(window%settled, self%column)
      allocate (window%has_started(lanes), source=.false.)
      allocate (window%integral(size(window%summed), lanes), window%square(size(window%summed), lanes), &
                window%first(size(window%settled), lanes), source=0.0_wp)
      allocate (window%kept(lanes), window%ranges(lanes))
      do lane = 1, lanes
        call allocate_ranges(window%ranges(lane), size(window%ranged))
      end do
    end associate
  end subroutine fill_window

  !> A lane starts anew; the numbers of its machine are in `recorded` already.
  subroutine start_lane(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    integer :: i

    call observe_lane(self, lane, t, y)
    call self%recorded%start_lane(lane)
    do i = 1, size(self%windows)
      associate (window => self%windows(i))
        window%has_started(lane) = .false.
        window%integral(:, lane) = 0.0_wp
        window%square(:, lane) = 0.0_wp
        call window%kept(lane)%clear()
      end associate
    end do
  end subroutine start_lane

  !> Brings one lane to a time and state, and leaves the others where they are.
  subroutine observe_lane(self, lane, t, y)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%t(lane) = t
    self%y(lane, :) = y
    call self%recorded%observe(self%t, self%y)
  end subroutine observe_lane

  !> The end of a lane.
  subroutine finish_lane(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    call observe_lane(self, lane, t, y)
    call self%recorded%fill_row(lane, self%t, self%y, self%row)
    self%final(:, lane) = self%row
  end subroutine finish_lane

  !> The steps of a block.
  subroutine add_steps(self, steps, chosen, y, c)
    class(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    logical, intent(in) :: chosen(:)                 !! lanes that are wanted
    real(wp), contiguous, intent(in) :: y(:, :)      !! [lanes, padded columns]
    real(wp), contiguous, intent(in) :: c(:, :, :)   !! [lanes, padded columns, degree]
    integer :: i, lane

    if (size(self%windows) == 0) return
    call allocate_work(self, size(c, 3))
    self%sampled_start(:) = huge(0.0_wp)
    do i = 1, size(self%windows)
      associate (window => self%windows(i))
        self%active(:) = steps%taken .and. chosen .and. steps%t_new > window%from
        if (.not. any(self%active)) cycle
        self%start(:) = merge(max(steps%t, window%from), huge(0.0_wp), self%active)
        if (any(abs(self%start - self%sampled_start) > 0)) call sample_parts(self, steps, y, c)
        do lane = 1, size(self%active)
          if (self%active(lane)) call accumulate(self, window, lane, steps%t_new(lane))
        end do
      end associate
    end do
  end subroutine add_steps

  !> Places and nodes for a degree of the solution inside the steps.
  subroutine allocate_work(self, degree)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: degree
    integer :: i

    if (allocated(self%places)) then
      if (size(self%places) /= degree + 1) error stop 'nocdyn_sampled_statistics: the method must remain the same'
      return
    end if
    allocate (self%places(degree + 1), self%to_series(degree + 1, degree + 1), self%nodes(degree + 1), self%weights(degree + 1))
    call lobatto_nodes(degree, self%places, self%to_series)
    call gauss_legendre_rule(degree + 1, self%nodes, self%weights)
    associate (columns => size(self%row), lanes => size(self%active))
      allocate (self%values(degree + 1, columns, lanes), self%at_nodes(columns, degree + 1, lanes), source=0.0_wp)
    end associate
    do i = 1, size(self%windows)
      allocate (self%windows(i)%sample(size(self%windows(i)%ranged), degree + 1), source=0.0_wp)
    end do
  end subroutine allocate_work

  !> The columns at the places and nodes of the parts of the steps of the active lanes. A column that jumps at a crossing where
  !> the step ends is taken right before: a jump is no part of the step.
  subroutine sample_parts(self, steps, y, c)
    type(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
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
          self%t(lane) = max(self%start(lane), steps%t_new(lane) - before_jump * spacing(steps%t_new(lane)))
        end if
      end do
      call sample_states(self, steps, y, c)
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        call self%recorded%fill_row(lane, self%t, self%y, self%row)
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
        call self%recorded%fill_row(lane, self%t, self%y, self%row)
        self%at_nodes(:, i, lane) = self%row
      end do
    end do
  end subroutine sample_parts

  !> Observes the active lanes at the times t, and the others where their steps start.
  subroutine sample_states(self, steps, y, c)
    type(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
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
  subroutine accumulate(self, window, lane, t_end)
    type(sampled_statistics_t), intent(in) :: self
    type(window_t), intent(inout) :: window
    integer, intent(in) :: lane
    real(wp), intent(in) :: t_end   !! of the step
    integer :: i, k

    associate (duration => t_end - self%start(lane))
      do i = 1, size(window%ranged)
        window%sample(i, :) = self%values(:, window%ranged(i), lane)
      end do
      if (.not. window%has_started(lane)) then
        call start_ranges(window%ranges(lane), window%sample(:, 1), self%start(lane))
        do i = 1, size(window%settled)
          window%first(i, lane) = self%values(1, window%settled(i), lane)
        end do
      end if
      window%has_started(lane) = .true.
      if (size(window%ranged) > 0) then
        call widen_ranges(size(self%places), self%places, self%to_series, window%sample, window%ranges(lane), self%start(lane), &
                          t_end)
      end if
      if (size(window%settled) > 0) call window%kept(lane)%add(self%start(lane), t_end, window%settled, self%values(:, :, lane))
      do i = 1, size(window%summed)
        do k = 1, size(self%nodes)
          associate (x => self%at_nodes(window%summed(i), k, lane))
            window%integral(i, lane) = window%integral(i, lane) + duration * self%weights(k) * x
            window%square(i, lane) = window%square(i, lane) + duration * self%weights(k) * x**2
          end associate
        end do
      end do
    end associate
  end subroutine accumulate

  !> A statistic of a lane that has reached its end.
  real(wp) function value(self, number, lane)
    class(sampled_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    associate (statistic => self%statistics(number), i => self%position(number))
      if (statistic%kind == statistic_final) then
        value = self%final(self%column(number), lane)
        return
      end if
      associate (window => self%windows(self%window(number)))
        select case (statistic%kind)
        case (statistic_max)
          value = window%ranges(lane)%highest(i)
        case (statistic_min)
          value = window%ranges(lane)%lowest(i)
        case (statistic_max_abs)
          value = max(abs(window%ranges(lane)%lowest(i)), abs(window%ranges(lane)%highest(i)))
        case (statistic_time_of_max)
          value = window%ranges(lane)%highest_time(i)
        case (statistic_mean)
          value = window%integral(i, lane) / (self%t_end - window%from)
        case (statistic_rms)
          value = sqrt(window%square(i, lane) / (self%t_end - window%from))
        case (statistic_settling_time)
          associate (end_value => self%final(self%column(number), lane))
            value = window%kept(lane)%last_exit(self%to_series, i, end_value, &
                                              statistic%band * abs(window%first(i, lane) - end_value)) &
                    - window%from
          end associate
        case default
          error stop 'nocdyn_sampled_statistics: there is no such statistic'
        end select
      end associate
    end associate
  end function value

end module nocdyn_sampled_statistics
