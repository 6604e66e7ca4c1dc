!> Takes the statistics of a sweep from the variants that pass through the lanes of a block.
module nocdyn_statistics_observer
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_linear_columns, only: has_law, is_linear, linear_columns_t, new_linear_columns
  use nocdyn_linear_statistics, only: linear_statistics_t, new_linear_statistics
  use nocdyn_reduced, only: reduced_t
  use nocdyn_sampled_statistics, only: new_sampled_statistics, sampled_statistics_t
  use nocdyn_statistics, only: find_columns, is_torque, statistic_final, statistic_max, statistic_max_abs, statistic_min, &
    statistic_settling_time, statistic_t, statistic_time_of_max, value_of_zero_column
  use nocdyn_observer, only: observer_t, step_block_t
  use nocdyn_text, only: string_t
  use nocdyn_trajectory_columns, only: column_t, column_work_in, list_columns
  implicit none (type, external)
  private

  public :: new_statistics_observer, needs_work_integrals

  !> The times that are requested must be, or contain, the start and the end of the variants. After the first `start_lane` it must
  !> stay where it is.
  !>
  !> A statistic is taken by `linear` if its column allows, else by `sampled`. That of an extremum of an elastic moment is taken
  !> by `spare` in the lanes where the moment does not rise with the twist. That of a torque of which the block has no column is
  !> that of 0.
  type, extends(observer_t), public :: statistics_observer_t
    character(len=:), allocatable :: missing                  !! a quantity that the block lacks and that is no torque; '': none
    class(formulation_t), pointer, private :: block => null()
    real(wp), private :: t_start = 0.0_wp, t_end = 0.0_wp     !! [s]
    type(lane_parameters_t), private :: parameters                  !! of the block; none if its lanes keep the numbers that they
                                                                    !! have
    type(linear_statistics_t), private :: linear
    type(sampled_statistics_t), private :: sampled, spare
    integer, allocatable, private :: in_linear(:), in_sampled(:), in_spare(:)   !! places of the statistics there, or 0
    real(wp), allocatable, private :: otherwise(:)            !! values of the statistics that are neither there nor there
    logical, private :: has_sampled = .false., has_spared = .false.   !! whether `sampled` is used, whether `spare` is now
    integer, private :: first_component = 1, last_component = huge(1)   !! of the state, that `linear` follows inside steps
    logical, allocatable, private :: all_lanes(:)             !! true
    logical, allocatable, private :: is_spared(:)             !! lanes in which `spare` is used
    logical, allocatable, private :: is_complete(:)           !! lanes that have reached the end
  contains
    procedure :: start_lane
    procedure :: results
    procedure :: on_output
    procedure :: on_steps
  end type statistics_observer_t

contains

  !> Whether a statistic is of a column that is, or comes from, an integrated work.
  logical function needs_work_integrals(formulation, statistics)
    class(formulation_t), intent(in) :: formulation
    type(statistic_t), intent(in) :: statistics(:)
    type(statistic_t), allocatable :: found(:)
    type(column_t), allocatable :: columns(:)
    type(string_t), allocatable :: labels(:)
    integer :: i

    call list_columns(formulation%machine, columns, labels)
    allocate (found, source=statistics)
    call find_columns(labels, found)
    needs_work_integrals = .false.
    do i = 1, size(found)
      if (found(i)%column > 0) needs_work_integrals = needs_work_integrals .or. columns(found(i)%column)%kind >= column_work_in
    end do
  end function needs_work_integrals

  !> An observer of a block, which stays where it is. Only the reduced formulation may change the numbers of its lanes.
  function new_statistics_observer(block, statistics, t_start, t_end) result(self)
    class(formulation_t), target, intent(inout) :: block   !! audited if `needs_work_integrals`
    type(statistic_t), intent(in) :: statistics(:)         !! each with t_start <= from < t_end
    real(wp), intent(in) :: t_start, t_end                 !! of every variant [s]
    type(statistics_observer_t) :: self
    logical, dimension(size(statistics)) :: has_extremum, linear, sampled
    type(statistic_t), allocatable :: found(:)
    type(column_t), allocatable :: columns(:)
    type(string_t), allocatable :: labels(:)
    integer :: i

    self%block => block
    self%t_start = t_start
    self%t_end = t_end
    self%wants_steps = .true.
    call list_columns(block%machine, columns, labels)
    allocate (found, source=statistics)
    call find_columns(labels, found)
    self%missing = missing_quantity(found)
    allocate (self%otherwise, source=value_of_zero_column(found))
    has_extremum = .false.
    linear = .false.
    sampled = .false.
    do i = 1, size(found)
      if (found(i)%column == 0) cycle
      associate (column => columns(found(i)%column), kind => found(i)%kind)
        linear(i) = is_linear(block, column) .and. kind /= statistic_settling_time
        sampled(i) = .not. linear(i)
        if (sampled(i)) cycle
        if (any(kind == [statistic_max, statistic_min, statistic_max_abs, statistic_time_of_max])) then
          has_extremum(i) = has_law(block%machine, column)
        end if
      end associate
    end do
    allocate (self%in_linear, source=indices_among(linear))
    allocate (self%in_sampled, source=indices_among(sampled))
    allocate (self%in_spare, source=indices_among(has_extremum))
    self%has_sampled = any(sampled)
    call find_components(self, block, columns(pack([(found(i)%column, i=1, size(found))], &
                                                   linear .and. [(found(i)%kind /= statistic_final, i=1, size(found))])))
    self%linear = new_linear_statistics(block, columns, pack(found, linear), t_start, t_end)
    self%sampled = new_sampled_statistics(block, columns, pack(found, sampled), t_end)
    self%spare = new_sampled_statistics(block, columns, pack(found, has_extremum), t_end)
    allocate (self%all_lanes(block%lanes), source=.true.)
    allocate (self%is_spared(block%lanes), self%is_complete(block%lanes), source=.false.)
    select type (block)
    class is (reduced_t)
      call block%list_parameters(self%parameters)
    end select
  end function new_statistics_observer

  !> The components of the state whose course inside the steps matters to linear columns.
  subroutine find_components(self, block, columns)
    type(statistics_observer_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    type(column_t), intent(in) :: columns(:)
    type(linear_columns_t) :: followed

    followed = new_linear_columns(block, columns)
    if (size(followed%component) == 0) return
    self%first_component = minval(followed%component)
    self%last_component = maxval(followed%component)
  end subroutine find_components

  !> The first quantity without a column that is not 0 for want of it; '' if there is none.
  pure function missing_quantity(found) result(quantity)
    type(statistic_t), intent(in) :: found(:)
    character(len=:), allocatable :: quantity
    integer :: i

    quantity = ''
    do i = 1, size(found)
      if (found(i)%column == 0 .and. .not. is_torque(found(i)) .and. quantity == '') quantity = found(i)%quantity
    end do
  end function missing_quantity

  !> The numbers of the true ones among themselves, 0 for the others.
  pure function indices_among(mask) result(places)
    logical, intent(in) :: mask(:)
    integer :: places(size(mask))
    integer :: i

    places = [(merge(count(mask(:i)), 0, mask(i)), i=1, size(mask))]
  end function indices_among

  !> A lane of the block has been given a variant that starts at y.
  subroutine start_lane(self, lane, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    integer :: i

    self%is_complete(lane) = .false.
    self%is_spared(lane) = .false.
    call self%linear%start_lane(self%block, lane, y)
    do i = 1, size(self%in_spare)
      if (self%in_spare(i) == 0) cycle
      if (.not. self%linear%is_increasing(self%in_linear(i), lane)) self%is_spared(lane) = .true.
    end do
    self%has_spared = any(self%is_spared)
    self%first_read = 1
    self%last_read = huge(1)
    if (.not. (self%has_sampled .or. self%has_spared)) then
      self%first_read = self%first_component
      self%last_read = self%last_component
    end if
    if (self%has_sampled) call start_sampled(self, self%sampled, lane, y)
    if (self%is_spared(lane)) call start_sampled(self, self%spare, lane, y)
  end subroutine start_lane

  subroutine start_sampled(self, sampled, lane, y)
    type(statistics_observer_t), intent(in) :: self
    type(sampled_statistics_t), target, intent(inout) :: sampled
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)

    if (self%parameters%arrays > 0) call sampled%recorded%copy_lane(lane, self%parameters)
    call sampled%start_lane(lane, self%t_start, y)
  end subroutine start_sampled

  !> The statistics of the last variant in a lane; NaN if it has not reached its end.
  subroutine results(self, lane, values)
    class(statistics_observer_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [statistics]
    integer :: i

    values(:) = ieee_value(1.0_wp, ieee_quiet_nan)
    if (.not. self%is_complete(lane)) return
    do i = 1, size(values)
      if (self%in_sampled(i) > 0) then
        values(i) = self%sampled%value(self%in_sampled(i), lane)
        cycle
      end if
      values(i) = self%otherwise(i)
      if (self%in_linear(i) == 0) cycle
      values(i) = self%linear%value(self%in_linear(i), lane)
      if (self%in_spare(i) == 0) cycle
      if (.not. self%linear%is_increasing(self%in_linear(i), lane)) values(i) = self%spare%value(self%in_spare(i), lane)
    end do
  end subroutine results

  !> Only the end is of interest.
  subroutine on_output(self, lane, t, y)
    class(statistics_observer_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)

    if (t < self%t_end) return
    self%is_complete(lane) = .true.
    call self%linear%finish_lane(lane, y)
    if (self%has_sampled) call self%sampled%finish_lane(lane, t, y)
  end subroutine on_output

  subroutine on_steps(self, steps, y, y_new, c)
    class(statistics_observer_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), y_new(:, :), c(:, :, :)

    call self%linear%add_steps(steps, y, y_new, c)
    if (self%has_sampled) call self%sampled%add_steps(steps, self%all_lanes, y, c)
    if (self%has_spared) call self%spare%add_steps(steps, self%is_spared, y, c)
  end subroutine on_steps

end module nocdyn_statistics_observer
