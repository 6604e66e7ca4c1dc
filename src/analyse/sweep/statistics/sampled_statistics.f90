!> Statistics of any columns of the trajectory table, from samples of the solution inside the steps.
!>
!> In every step, or in the part of it after `from`, a column is replaced by the polynomial through its values at the
!> Chebyshev-Lobatto nodes; there are as many as the solution has coefficients in a step. Integrals use as many Gauss nodes: they
!> are exact for a linear function of the state and for its square.
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

  !> What is accumulated from a time on, for the columns with statistics that need it.
  type :: window_t
    real(wp) :: from = 0.0_wp                              !! [s]
    integer, allocatable :: ranged(:)                      !! columns with extremes
    integer, allocatable :: summed(:)                      !! columns with integrals
    integer, allocatable :: settled(:)                     !! columns with a settling time
    logical, allocatable :: has_started(:)                 !! whether a lane has passed `from`, [lanes]
    type(ranges_t), allocatable :: ranges(:)               !! of `ranged`, [lanes]
    real(wp), allocatable :: integral(:, :), square(:, :)  !! of the columns and of their squares over time, [summed, lanes]
    real(wp), allocatable :: first(:, :)                   !! values at `from`, [settled, lanes]
    type(settling_history_t), allocatable :: history(:)    !! of `settled`, [lanes]
    real(wp), allocatable :: sample(:, :)                  !! of one lane, work space, [ranged, nodes]
  end type window_t

  type, public :: sampled_statistics_t
    type(recorded_columns_t) :: recorded                          !! the columns with statistics
    real(wp), private :: t_end = 0.0_wp                           !! of every variant [s]
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)                    !! among the recorded ones, [statistics]
    integer, allocatable, private :: window(:)                    !! number in `windows`, 0 for values at the end; [statistics]
    integer, allocatable, private :: position(:)                  !! of the column in the list of the window, [statistics]
    type(window_t), allocatable, private :: windows(:)
    logical, private :: has_ranges = .false., has_sums = .false.  !! of any window
    real(wp), allocatable, private :: lobatto(:)                  !! nodes, -1 to 1
    real(wp), allocatable, private :: to_series(:, :)             !! from values at them to Chebyshev coefficients
    real(wp), allocatable, private :: gauss(:), weights(:)        !! nodes, 0 to 1
    logical, allocatable, private :: active(:)                    !! lanes whose step is sampled
    real(wp), allocatable, private :: start(:), sampled_start(:)  !! of the part of the step [s], [lanes]
    real(wp), allocatable, private :: at_lobatto(:, :, :)         !! [columns, nodes, lanes]
    real(wp), allocatable, private :: at_gauss(:, :, :)           !! [columns, nodes, lanes]
    real(wp), allocatable, private :: final(:, :)                 !! values at the end, [columns, lanes]
    real(wp), allocatable, private :: rows(:, :)                  !! values at the times `t`, [columns, lanes]
    real(wp), allocatable, private :: t(:), theta(:), y(:, :)     !! of the sample, [lanes], [lanes, states + quadratures]
  contains
    procedure :: start_lane, add_steps, finish_lane, value
  end type sampled_statistics_t

contains

  !> Statistics of the variants that pass through the lanes of a formulation.
  type(sampled_statistics_t) function new_sampled_statistics(formulation, columns, statistics, t_end) result(self)
    class(formulation_t), intent(in) :: formulation
    type(column_t), intent(in) :: columns(:)         !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)   !! each of a column
    real(wp), intent(in) :: t_end                    !! of every variant [s]
    integer, allocatable :: column_numbers(:), wanted(:)

    if (size(statistics) == 0) return   ! without a copy of the formulation
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
      allocate (self%y(lanes, formulation%states + formulation%quadratures), source=0.0_wp)
      allocate (self%final(size(wanted), lanes), self%rows(size(wanted), lanes), source=0.0_wp)
    end associate
  end function new_sampled_statistics

  !> The different numbers of a list, ascending.
  pure function distinct(list)
    integer, intent(in) :: list(:)
    integer, allocatable :: distinct(:)
    integer :: i

    distinct = pack([(i, i=1, maxval([0, list]))], [(any(list == i), i=1, maxval([0, list]))])
  end function distinct

  !> The positions of numbers in a list, 0 for those that it does not have.
  pure function positions_in(list, numbers) result(positions)
    integer, intent(in) :: list(:), numbers(:)
    integer :: positions(size(numbers))
    integer :: i

    positions = [(findloc(list, numbers(i), dim=1), i=1, size(numbers))]
  end function positions_in

  !> One window for each `from`.
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
    self%has_ranges = any([(size(self%windows(i)%ranged) + size(self%windows(i)%settled) > 0, i=1, windows)])
    self%has_sums = any([(size(self%windows(i)%summed) > 0, i=1, windows)])
  end subroutine make_windows

  !> Sorts the columns of a window by what their statistics need, and allocates that.
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
      allocate (window%history(lanes), window%ranges(lanes))
      do lane = 1, lanes
        call allocate_ranges(window%ranges(lane), size(window%ranged))
      end do
    end associate
  end subroutine fill_window

  !> Starts a variant in a lane of which `recorded` has the parameters.
  subroutine start_lane(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! the start, [states + quadratures]
    integer :: i

    call observe_lane(self, lane, t, y)
    call self%recorded%start_lane(lane)
    do i = 1, size(self%windows)
      associate (window => self%windows(i))
        window%has_started(lane) = .false.
        window%integral(:, lane) = 0.0_wp
        window%square(:, lane) = 0.0_wp
        call window%history(lane)%clear()
      end associate
    end do
  end subroutine start_lane

  !> Brings one lane to a time and state; the others stay where they are.
  subroutine observe_lane(self, lane, t, y)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    self%t(lane) = t
    self%y(lane, :) = y
    call self%recorded%observe(self%t, self%y)
  end subroutine observe_lane

  !> Takes the end of a variant.
  subroutine finish_lane(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! the state there, [states + quadratures]

    call observe_lane(self, lane, t, y)
    call self%recorded%fill_row(lane, self%t, self%y, self%final(:, lane))
  end subroutine finish_lane

  !> Adds the last steps of the lanes.
  subroutine add_steps(self, steps, chosen, y, c)
    class(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    logical, intent(in) :: chosen(:)                 !! lanes that are to be sampled, [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)      !! starts of the steps, [lanes, padded components]
    real(wp), contiguous, intent(in) :: c(:, :, :)   !! coefficients of the steps, [lanes, padded components, degree]
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

  !> Nodes and work space for a degree of the solution inside the steps.
  subroutine allocate_work(self, degree)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: degree
    integer :: i

    associate (nodes => degree + 1, columns => size(self%rows, 1), lanes => size(self%active))
      if (allocated(self%lobatto)) then
        if (size(self%lobatto) /= nodes) error stop 'nocdyn_sampled_statistics: the method must remain the same'
        return
      end if
      allocate (self%lobatto(nodes), self%to_series(nodes, nodes), self%gauss(nodes), self%weights(nodes))
      call lobatto_nodes(degree, self%lobatto, self%to_series)
      call gauss_legendre_rule(nodes, self%gauss, self%weights)
      allocate (self%at_lobatto(columns, nodes, lanes), self%at_gauss(columns, nodes, lanes), source=0.0_wp)
      do i = 1, size(self%windows)
        allocate (self%windows(i)%sample(size(self%windows(i)%ranged), nodes), source=0.0_wp)
      end do
    end associate
  end subroutine allocate_work

  !> Samples the columns in the parts of the steps of the active lanes. A column that jumps at a crossing where the step ends is
  !> sampled right before it: the jump is no part of the step.
  subroutine sample_parts(self, steps, y, c)
    type(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    real(wp) :: half
    integer :: i, lane, last

    self%sampled_start(:) = self%start
    last = merge(size(self%lobatto), 0, self%has_ranges)
    do i = 1, last
      self%t(:) = steps%t
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        half = 0.5_wp * (steps%t_new(lane) - self%start(lane))
        self%t(lane) = self%start(lane) + half + self%lobatto(i) * half
        if (i == last .and. steps%crosses(lane)) then
          self%t(lane) = max(self%start(lane), steps%t_new(lane) - before_jump * spacing(steps%t_new(lane)))
        end if
      end do
      call sample_rows(self, steps, y, c)
      self%at_lobatto(:, i, :) = self%rows
    end do
    do i = 1, merge(size(self%gauss), 0, self%has_sums)
      self%t(:) = steps%t
      do lane = 1, size(self%active)
        if (self%active(lane)) self%t(lane) = self%start(lane) + self%gauss(i) * (steps%t_new(lane) - self%start(lane))
      end do
      call sample_rows(self, steps, y, c)
      self%at_gauss(:, i, :) = self%rows
    end do
  end subroutine sample_parts

  !> Takes the rows of the active lanes at the times `t`; the other lanes are observed where their steps start.
  subroutine sample_rows(self, steps, y, c)
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
    do lane = 1, size(self%active)
      if (self%active(lane)) call self%recorded%fill_row(lane, self%t, self%y, self%rows(:, lane))
    end do
  end subroutine sample_rows

  !> Adds the part of a lane's step to what a window accumulates.
  subroutine accumulate(self, window, lane, t_end)
    type(sampled_statistics_t), intent(in) :: self
    type(window_t), intent(inout) :: window
    integer, intent(in) :: lane
    real(wp), intent(in) :: t_end   !! of the step
    integer :: i, k

    associate (duration => t_end - self%start(lane))
      do i = 1, size(window%ranged)
        window%sample(i, :) = self%at_lobatto(window%ranged(i), :, lane)
      end do
      if (.not. window%has_started(lane)) then
        call start_ranges(window%ranges(lane), window%sample(:, 1), self%start(lane))
        do i = 1, size(window%settled)
          window%first(i, lane) = self%at_lobatto(window%settled(i), 1, lane)
        end do
      end if
      window%has_started(lane) = .true.
      if (size(window%ranged) > 0) then
        call widen_ranges(size(self%lobatto), self%lobatto, self%to_series, window%sample, window%ranges(lane), &
                          self%start(lane), t_end)
      end if
      if (size(window%settled) > 0) then
        call window%history(lane)%add(self%start(lane), t_end, window%settled, self%at_lobatto(:, :, lane))
      end if
      do i = 1, size(window%summed)
        do k = 1, size(self%gauss)
          associate (x => self%at_gauss(window%summed(i), k, lane))
            window%integral(i, lane) = window%integral(i, lane) + duration * self%weights(k) * x
            window%square(i, lane) = window%square(i, lane) + duration * self%weights(k) * x**2
          end associate
        end do
      end do
    end associate
  end subroutine accumulate

  !> The value of a statistic in a lane that has reached its end.
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
            value = window%history(lane)%last_exit(self%to_series, i, end_value, &
                                                   statistic%band * abs(window%first(i, lane) - end_value)) - window%from
          end associate
        case default
          error stop 'nocdyn_sampled_statistics: there is no such statistic'
        end select
      end associate
    end associate
  end function value

end module nocdyn_sampled_statistics
