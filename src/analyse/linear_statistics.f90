!> Statistics of columns that are functions of a linear function x of the state, straight from the polynomials of the steps.
!>
!> The elastic moment of a coupling that stiffens rises with its twist: its extremes are where those of the twist are. Bounds
!> from the coefficients of x, in vector loops over the lanes, say in which steps an extremum may pass those before.
module nocdyn_linear_statistics
  use nocdyn_bernstein, only: most_degrees, raise_to_maximum, shift_origin
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: linear_columns_t, new_linear_columns, width
  use nocdyn_quadrature, only: lay_gauss_rule
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_mean, statistic_min, statistic_rms, &
    statistic_t, statistic_time_of_max
  use nocdyn_system, only: steps_t
  use nocdyn_trajectory_columns, only: column_t
  implicit none (type, external)
  private

  public :: new_linear_statistics

  !> What is kept of one x from a time on.
  type :: track_t
    integer :: column = 0                    !! among the linear ones
    real(wp) :: from = 0.0_wp                !! [s]
    logical :: has_max = .false., has_min = .false., has_size = .false.   !! largest, smallest, largest absolute value
    logical :: has_sums = .false.
    real(wp), allocatable :: highest(:), lowest(:), highest_time(:)       !! of x, [lanes]
    real(wp), allocatable :: integral(:), square(:)                       !! of the column over time
  end type track_t

  !> The lanes that are looked at together: x in their steps, or in what of them lies after `from`.
  type :: part_t
    integer :: lanes = 0
    logical :: active(width) = .false.                !! whether anything lies there
    real(wp) :: t_start(width) = 0.0_wp, t_end(width) = 0.0_wp
    real(wp) :: x_start(width) = 0.0_wp, x_end(width) = 0.0_wp
    real(wp) :: c(width, most_degrees) = 0.0_wp       !! of the powers of the place, 0 to 1
  end type part_t

  type, public :: linear_statistics_t
    type(linear_columns_t) :: columns
    real(wp), private :: t_end = 0.0_wp
    type(statistic_t), allocatable, private :: statistics(:)
    integer, allocatable, private :: column(:)                !! of each statistic among the linear ones
    integer, allocatable, private :: track(:)                 !! of each statistic, 0 for those of the end
    type(track_t), allocatable, private :: tracks(:)          !! in the order of their columns
    real(wp), allocatable, private :: nodes(:), weights(:)    !! of Gauss, 0 to 1
    real(wp), allocatable, private :: x_end(:, :)             !! [lanes, columns]
    real(wp), allocatable, private :: y_strip(:, :), y_new_strip(:, :), c_strip(:, :, :)   !! the last lanes, with padding
    type(part_t), private :: whole, part
  contains
    procedure :: begin
    procedure :: is_rising
    procedure :: follow
    procedure :: conclude
    procedure :: value
  end type linear_statistics_t

contains

  function new_linear_statistics(block, columns, statistics, t_end) result(self)
    class(formulation_t), intent(in) :: block
    type(column_t), intent(in) :: columns(:)         !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)   !! of columns that are linear
    real(wp), intent(in) :: t_end                    !! [s]
    type(linear_statistics_t) :: self
    integer, allocatable :: wanted(:)
    integer :: i

    self%t_end = t_end
    allocate (self%statistics, source=statistics)
    allocate (wanted, source=pack([(i, i=1, size(columns))], [(any(statistics%column == i), i=1, size(columns))]))
    allocate (self%column, source=[(findloc(wanted, statistics(i)%column, dim=1), i=1, size(statistics))])
    self%columns = new_linear_columns(block, columns(wanted))
    allocate (self%x_end(block%lanes, size(wanted)), source=0.0_wp)
    call lay_tracks(self, block%lanes)
  end function new_linear_statistics

  !> One track for each column and `from`.
  subroutine lay_tracks(self, lanes)
    type(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: lanes
    integer :: column, i, k

    allocate (self%tracks(0))
    allocate (self%track(size(self%statistics)), source=0)
    do column = 1, self%columns%count
      do i = 1, size(self%statistics)
        associate (statistic => self%statistics(i))
          if (self%column(i) /= column .or. statistic%kind == statistic_final) cycle
          do k = 1, size(self%tracks)
            if (self%tracks(k)%column == column .and. abs(self%tracks(k)%from - statistic%from) <= 0) exit
          end do
          if (k > size(self%tracks)) self%tracks = [self%tracks, track_t(column=column, from=statistic%from)]
          self%track(i) = k
          associate (track => self%tracks(k))
            select case (statistic%kind)
            case (statistic_max, statistic_time_of_max)
              track%has_max = .true.
            case (statistic_min)
              track%has_min = .true.
            case (statistic_max_abs)
              track%has_size = .true.
            case default
              track%has_sums = .true.
            end select
          end associate
        end associate
      end do
    end do
    do k = 1, size(self%tracks)
      associate (track => self%tracks(k))
        allocate (track%highest(lanes), track%lowest(lanes), track%highest_time(lanes), track%integral(lanes), &
                  track%square(lanes), source=0.0_wp)
      end associate
    end do
  end subroutine lay_tracks

  !> A lane of the block starts anew, at a time that no `from` is before.
  subroutine begin(self, block, lane)
    class(linear_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    integer, intent(in) :: lane
    integer :: i

    call self%columns%take_lane(block, lane)
    do i = 1, size(self%tracks)
      associate (track => self%tracks(i))
        track%highest(lane) = -huge(0.0_wp)
        track%lowest(lane) = huge(0.0_wp)
        track%integral(lane) = 0.0_wp
        track%square(lane) = 0.0_wp
      end associate
    end do
  end subroutine begin

  !> Whether the column of a statistic rises with x in a lane.
  pure logical function is_rising(self, number, lane)
    class(linear_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    is_rising = self%columns%is_rising(self%column(number), lane)
  end function is_rising

  !> The end of a lane.
  subroutine conclude(self, lane, y)
    class(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    do i = 1, self%columns%count
      self%x_end(lane, i) = self%columns%argument(i, lane, y)
    end do
  end subroutine conclude

  !> The steps of a block.
  subroutine follow(self, steps, y, y_new, c)
    class(linear_statistics_t), intent(inout) :: self
    type(steps_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :)   !! [lanes, padded columns]
    real(wp), contiguous, intent(in) :: c(:, :, :)             !! [lanes, padded columns, degree]
    integer :: column, first, i, lanes

    if (size(self%tracks) == 0) return
    if (.not. allocated(self%nodes)) call lay_out(self, size(c, 2), size(c, 3))
    lanes = size(c, 1)
    do first = 1, lanes, width
      self%whole%lanes = min(width, lanes - first + 1)
      if (self%whole%lanes < width) then
        self%y_strip(:self%whole%lanes, :) = y(first:, :)
        self%y_new_strip(:self%whole%lanes, :) = y_new(first:, :)
        self%c_strip(:self%whole%lanes, :, :) = c(first:, :, :)
      end if
      column = 0
      do i = 1, size(self%tracks)
        associate (track => self%tracks(i))
          if (track%column /= column) then
            column = track%column
            if (self%whole%lanes < width) then
              call expand(self%columns, column, first, width, 1, size(c, 2), size(c, 3), self%y_strip, self%y_new_strip, &
                          self%c_strip, self%whole)
            else
              call expand(self%columns, column, first, lanes, first, size(c, 2), size(c, 3), y, y_new, c, self%whole)
            end if
          end if
          call follow_track(self, track, steps, first, size(c, 3))
        end associate
      end do
    end do
  end subroutine follow

  !> Room and nodes for a degree of the solution inside the steps.
  subroutine lay_out(self, columns, degree)
    type(linear_statistics_t), intent(inout) :: self
    integer, intent(in) :: columns   !! of the states
    integer, intent(in) :: degree

    if (degree > most_degrees) error stop 'nocdyn_linear_statistics: the solution inside the step has too many coefficients'
    allocate (self%nodes(degree + 1), self%weights(degree + 1))
    call lay_gauss_rule(degree + 1, self%nodes, self%weights)
    allocate (self%y_strip(width, columns), self%y_new_strip(width, columns), self%c_strip(width, columns, degree), source=0.0_wp)
  end subroutine lay_out

  !> x of a column at the ends of the steps, and its coefficients, in the lanes from `at` on.
  pure subroutine expand(columns, number, first, lanes, at, states, degree, y, y_new, c, whole)
    type(linear_columns_t), intent(in) :: columns
    integer, intent(in) :: number
    integer, intent(in) :: first   !! the lane whose factors are used at `at`
    integer, intent(in) :: lanes, at, states, degree
    real(wp), intent(in) :: y(lanes, states), y_new(lanes, states), c(lanes, states, degree)
    type(part_t), intent(inout) :: whole
    integer :: j, k, p

    whole%x_start = columns%offset(first:first + width - 1, number)
    whole%x_end = whole%x_start
    do p = 1, degree
      whole%c(:, p) = 0.0_wp
    end do
    do k = columns%first(number), columns%first(number + 1) - 1
      j = columns%component(k)
      associate (factor => columns%factor(first:first + width - 1, k))
        whole%x_start = whole%x_start + factor * y(at:at + width - 1, j)
        whole%x_end = whole%x_end + factor * y_new(at:at + width - 1, j)
        do p = 1, degree
          whole%c(:, p) = whole%c(:, p) + factor * c(at:at + width - 1, j, p)
        end do
      end associate
    end do
  end subroutine expand

  subroutine follow_track(self, track, steps, first, degree)
    type(linear_statistics_t), intent(inout) :: self
    type(track_t), intent(inout) :: track
    type(steps_t), intent(in) :: steps
    integer, intent(in) :: first, degree
    logical :: is_cut
    integer :: i

    is_cut = .false.
    do i = 1, self%whole%lanes
      associate (whole => self%whole, lane => first + i - 1)
        whole%active(i) = steps%taken(lane) .and. steps%t_new(lane) > track%from
        whole%t_start(i) = steps%t(lane)
        whole%t_end(i) = steps%t_new(lane)
        if (whole%active(i)) is_cut = is_cut .or. steps%t(lane) < track%from .or. steps%until(lane) < 1
      end associate
    end do
    if (is_cut) then
      self%part = self%whole
      call cut_part(self%part, steps, first, track%from, degree)
      call take_part(self, track, self%part, first, degree)
    else
      call take_part(self, track, self%whole, first, degree)
    end if
  end subroutine follow_track

  !> Leaves of each step what lies after `from` and before its cut.
  pure subroutine cut_part(part, steps, first, from, degree)
    type(part_t), intent(inout) :: part
    type(steps_t), intent(in) :: steps
    integer, intent(in) :: first
    real(wp), intent(in) :: from
    integer, intent(in) :: degree
    real(wp) :: c(0:most_degrees), place
    integer :: i

    do i = 1, part%lanes
      associate (lane => first + i - 1)
        if (.not. part%active(i)) cycle
        if (steps%t(lane) >= from .and. steps%until(lane) >= 1) cycle
        place = max(0.0_wp, (from - steps%t(lane)) / steps%h(lane))
        part%t_start(i) = max(from, steps%t(lane))
        c(0) = part%x_start(i)
        c(1:degree) = part%c(i, :degree)
        call shift_origin(degree, c(:degree), place, steps%until(lane))
        part%x_start(i) = c(0)
        part%c(i, :degree) = c(1:degree)
      end associate
    end do
  end subroutine cut_part

  subroutine take_part(self, track, part, first, degree)
    type(linear_statistics_t), intent(in) :: self
    type(track_t), intent(inout) :: track
    type(part_t), intent(in) :: part
    integer, intent(in) :: first, degree
    real(wp), dimension(width) :: above, below, integral, square
    integer :: i

    if (track%has_max .or. track%has_min .or. track%has_size) then
      call bound_part(part, degree, above, below)
      do i = 1, part%lanes
        if (part%active(i)) call widen(track, part, i, first + i - 1, above(i), below(i), degree)
      end do
    end if
    if (.not. track%has_sums) return
    call integrate_part(self, track%column, part, first, degree, integral, square)
    do i = 1, part%lanes
      if (.not. part%active(i)) cycle
      associate (lane => first + i - 1, duration => part%t_end(i) - part%t_start(i))
        track%integral(lane) = track%integral(lane) + duration * integral(i)
        track%square(lane) = track%square(lane) + duration * square(i)
      end associate
    end do
  end subroutine take_part

  !> What x can rise and fall from its start at most.
  pure subroutine bound_part(part, degree, above, below)
    type(part_t), intent(in) :: part
    integer, intent(in) :: degree
    real(wp), intent(out) :: above(width), below(width)
    integer :: p

    above = 0.0_wp
    below = 0.0_wp
    do p = 1, degree
      above = above + max(part%c(:, p), 0.0_wp)
      below = below + min(part%c(:, p), 0.0_wp)
    end do
  end subroutine bound_part

  !> Widens the range of x in a lane by its step.
  pure subroutine widen(track, part, i, lane, above, below, degree)
    type(track_t), intent(inout) :: track
    type(part_t), intent(in) :: part
    integer, intent(in) :: i, lane
    real(wp), intent(in) :: above, below
    integer, intent(in) :: degree
    real(wp) :: high_bar, low_bar   ! what x and -x must pass to be of interest

    associate (highest => track%highest(lane), lowest => track%lowest(lane))
      if (highest < lowest) then
        highest = part%x_start(i)
        lowest = highest
        track%highest_time(lane) = part%t_start(i)
      end if
      if (part%x_end(i) > highest) then
        highest = part%x_end(i)
        track%highest_time(lane) = part%t_end(i)
      end if
      lowest = min(lowest, part%x_end(i))
      high_bar = highest
      low_bar = -lowest
      if (.not. track%has_max) high_bar = merge(max(high_bar, low_bar), huge(0.0_wp), track%has_size)
      if (.not. track%has_min) low_bar = merge(max(highest, low_bar), huge(0.0_wp), track%has_size)
      if (part%x_start(i) + above > high_bar) call look_above(track, part, i, lane, degree, high_bar)
      if (-(part%x_start(i) + below) > low_bar) call look_below(track, part, i, lane, degree, low_bar)
    end associate
  end subroutine widen

  pure subroutine look_above(track, part, i, lane, degree, bar)
    type(track_t), intent(inout) :: track
    type(part_t), intent(in) :: part
    integer, intent(in) :: i, lane, degree
    real(wp), intent(inout) :: bar
    real(wp) :: c(0:most_degrees), place
    logical :: found

    c(0) = part%x_start(i)
    c(1:degree) = part%c(i, :degree)
    call raise_to_maximum(degree, c(:degree), bar, place, found)
    if (.not. found) return
    track%highest(lane) = bar
    track%highest_time(lane) = part%t_start(i) + place * (part%t_end(i) - part%t_start(i))
  end subroutine look_above

  pure subroutine look_below(track, part, i, lane, degree, bar)
    type(track_t), intent(inout) :: track
    type(part_t), intent(in) :: part
    integer, intent(in) :: i, lane, degree
    real(wp), intent(inout) :: bar
    real(wp) :: c(0:most_degrees), place
    logical :: found

    c(0) = -part%x_start(i)
    c(1:degree) = -part%c(i, :degree)
    call raise_to_maximum(degree, c(:degree), bar, place, found)
    if (found) track%lowest(lane) = -bar
  end subroutine look_below

  !> Means over the parts of the column and of its square.
  pure subroutine integrate_part(self, column, part, first, degree, integral, square)
    type(linear_statistics_t), intent(in) :: self
    integer, intent(in) :: column
    type(part_t), intent(in) :: part
    integer, intent(in) :: first, degree
    real(wp), intent(out) :: integral(width), square(width)
    real(wp) :: x(width)
    integer :: node, p

    integral = 0.0_wp
    square = 0.0_wp
    associate (linear => self%columns%linear(first:first + width - 1, column), &
               cubic => self%columns%cubic(first:first + width - 1, column))
      do node = 1, degree + 1
        x = part%c(:, degree)
        do p = degree - 1, 1, -1
          x = part%c(:, p) + self%nodes(node) * x
        end do
        x = part%x_start + self%nodes(node) * x
        x = (linear + cubic * x * x) * x
        integral = integral + self%weights(node) * x
        square = square + self%weights(node) * (x * x)
      end do
    end associate
  end subroutine integrate_part

  !> A statistic of a lane that has reached its end. Those of extremes are good where the column rises with x.
  real(wp) function value(self, number, lane)
    class(linear_statistics_t), intent(in) :: self
    integer, intent(in) :: number   !! of the statistic
    integer, intent(in) :: lane

    associate (columns => self%columns, column => self%column(number))
      if (self%statistics(number)%kind == statistic_final) then
        value = columns%law(column, lane, self%x_end(lane, column))
        return
      end if
      associate (track => self%tracks(self%track(number)))
        select case (self%statistics(number)%kind)
        case (statistic_max)
          value = columns%law(column, lane, track%highest(lane))
        case (statistic_min)
          value = columns%law(column, lane, track%lowest(lane))
        case (statistic_max_abs)
          value = columns%law(column, lane, max(track%highest(lane), -track%lowest(lane)))
        case (statistic_time_of_max)
          value = track%highest_time(lane)
        case (statistic_mean)
          value = track%integral(lane) / (self%t_end - track%from)
        case (statistic_rms)
          value = sqrt(track%square(lane) / (self%t_end - track%from))
        case default
          error stop 'nocdyn_linear_statistics: there is no such statistic'
        end select
      end associate
    end associate
  end function value

end module nocdyn_linear_statistics
