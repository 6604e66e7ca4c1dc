!> Takes the statistics of a sweep from the variants that pass through the lanes of a block.
module nocdyn_statistics_observer
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_sampled_statistics, only: new_sampled_statistics, sampled_statistics_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_system, only: observer_t, steps_t
  use nocdyn_text, only: string_t
  use nocdyn_trajectory_columns, only: column_t, column_work_in, list_columns
  implicit none (type, external)
  private

  public :: new_statistics_observer, needs_works

  !> The times that are requested must be, or contain, the start and the end of the variants. After the first `begin` it must
  !> stay where it is.
  type, extends(observer_t), public :: statistics_observer_t
    real(wp), private :: t_start = 0.0_wp, t_end = 0.0_wp   !! [s]
    integer, private :: statistics = 0
    type(lane_numbers_t), private :: numbers                !! of the block; none if its lanes keep the numbers that they have
    type(sampled_statistics_t), private :: sampled
    logical, allocatable, private :: is_complete(:)         !! whether a lane has reached the end, [lanes]
  contains
    procedure :: begin
    procedure :: results
    procedure :: record
    procedure :: follow_steps
  end type statistics_observer_t

contains

  !> Whether a statistic is of a column that is, or comes from, an integrated work.
  logical function needs_works(formulation, statistics)
    class(formulation_t), intent(in) :: formulation
    type(statistic_t), intent(in) :: statistics(:)
    type(column_t), allocatable :: columns(:)
    type(string_t), allocatable :: labels(:)

    call list_columns(formulation%machine, columns, labels)
    needs_works = any(columns(statistics%column)%kind >= column_work_in)
  end function needs_works

  !> An observer of a block, which stays where it is. Only the reduced formulation may change the numbers of its lanes.
  function new_statistics_observer(block, statistics, t_start, t_end) result(self)
    class(formulation_t), target, intent(inout) :: block   !! audited if `needs_works`
    type(statistic_t), intent(in) :: statistics(:)         !! each with t_start <= from < t_end
    real(wp), intent(in) :: t_start, t_end                 !! of every variant [s]
    type(statistics_observer_t) :: self
    type(column_t), allocatable :: columns(:)
    type(string_t), allocatable :: labels(:)

    self%t_start = t_start
    self%t_end = t_end
    self%statistics = size(statistics)
    self%follows_steps = .true.
    call list_columns(block%machine, columns, labels)
    self%sampled = new_sampled_statistics(block, columns, statistics, t_end)
    allocate (self%is_complete(block%lanes), source=.false.)
    select type (block)
    class is (reduced_t)
      call block%list_numbers(self%numbers)
    end select
  end function new_statistics_observer

  !> A lane of the block has been given a variant that starts at y.
  subroutine begin(self, lane, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]

    self%is_complete(lane) = .false.
    if (self%numbers%slabs > 0) call self%sampled%recorded%copy_lane(lane, self%numbers)
    call self%sampled%begin(lane, self%t_start, y)
  end subroutine begin

  !> The statistics of the last variant in a lane; NaN if it has not reached its end.
  subroutine results(self, lane, values)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [statistics]
    integer :: i

    values(:) = ieee_value(1.0_wp, ieee_quiet_nan)
    if (.not. self%is_complete(lane)) return
    do i = 1, self%statistics
      values(i) = self%sampled%value(i, lane)
    end do
  end subroutine results

  subroutine record(self, lane, t, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (t < self%t_end) return
    self%is_complete(lane) = .true.
    call self%sampled%conclude(lane, t, y)
  end subroutine record

  subroutine follow_steps(self, steps, y, y_new, c)
    class(statistics_observer_t), intent(inout) :: self
    type(steps_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)

    call self%sampled%follow(steps, y, c)
  end subroutine follow_steps

end module nocdyn_statistics_observer
