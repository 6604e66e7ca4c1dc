!> Statistics of any columns of the trajectory table, from samples of the solution inside the steps.
!>
!> In every step, or in the part of it after `from`, a column is replaced by the polynomial through its values at the nodes of the
!> interpolation; there are as many as the solution has coefficients in a step. Integrals use as many Gauss nodes: they are exact
!> for a linear function of the state and for its square. Columns that bend more than the solution are replaced piece by piece
!> (`nocdyn_step_pieces`).
module nocdyn_sampled_statistics
  use nocdyn_column_statistics, only: accumulator_t, column_statistics_t, start_range, widen_range
  use nocdyn_damage_sums, only: damage_sum_t
  use nocdyn_extremes, only: before_jump
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: step_block_t
  use nocdyn_signal_values, only: may_bend, new_signal_values, signal_values_t
  use nocdyn_statistics, only: statistic_t
  use nocdyn_step_pieces, only: new_step_pieces, step_pieces_t
  use nocdyn_signals, only: signal_source_t
  implicit none (type, external)
  private

  public :: new_sampled_statistics

  type, extends(column_statistics_t), public :: sampled_statistics_t
    type(signal_values_t) :: recorded                    !! the columns with statistics
    real(wp), allocatable, private :: from(:)               !! the different ones of the accumulators [s]
    logical, private :: interpolates = .false., integrates = .false.   !! whether there are polynomials, integrals
    logical, allocatable, private :: active(:)              !! lanes whose step is sampled
    real(wp), allocatable, private :: start(:)              !! of the part of the step [s], [lanes]
    type(step_pieces_t), allocatable, private :: pieces(:)  !! of that part, [lanes]
    logical, allocatable, private :: bends(:), replaced(:)  !! columns that may; whose polynomials count in a piece
    logical, allocatable, private :: is_begun(:)            !! lanes whose pieces are known
    real(wp), allocatable, private :: scale(:)              !! of their columns [N m], [lanes]
    real(wp), allocatable, private :: nodes(:)              !! those of the interpolation, those of Gauss; -1 to 1
    real(wp), allocatable, private :: values(:, :, :)       !! there, [nodes, columns, lanes]
    real(wp), allocatable, private :: row(:)                !! of one lane, [columns]
    real(wp), allocatable, private :: t(:), theta(:), y(:, :)   !! of the sample, [lanes], [lanes, states + quadratures]
  contains
    procedure :: start_lane, add_steps, finish_lane
  end type sampled_statistics_t

contains

  !> Statistics of the variants that pass through the lanes of a formulation.
  type(sampled_statistics_t) function new_sampled_statistics(formulation, columns, statistics, t_start, t_end) result(self)
    class(formulation_t), intent(in) :: formulation
    type(signal_source_t), intent(in) :: columns(:)         !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)   !! each of a column
    real(wp), intent(in) :: t_start, t_end           !! of every variant [s]
    integer, allocatable :: wanted(:)
    integer :: i, lane

    if (size(statistics) == 0) return   ! without a copy of the formulation
    call self%set_statistics(statistics, formulation%lanes, t_start, t_end, wanted)
    self%recorded = new_signal_values(formulation, columns(wanted))
    allocate (self%from(0))
    do i = 1, size(self%accumulators)
      associate (acc => self%accumulators(i))
        self%interpolates = self%interpolates .or. acc%has_range() .or. acc%has_history
        self%integrates = self%integrates .or. acc%has_sums
        if (.not. any(abs(self%from - acc%from) <= 0)) self%from = [self%from, acc%from]
      end associate
    end do
    do i = 1, size(self%damages)
      self%interpolates = .true.
      if (.not. any(abs(self%from - self%damages(i)%from) <= 0)) self%from = [self%from, self%damages(i)%from]
    end do
    allocate (self%bends, source=[(may_bend(formulation%machine, columns(wanted(i))), i=1, size(wanted))])
    associate (lanes => formulation%lanes)
      allocate (self%active(lanes), self%is_begun(lanes), self%replaced(size(wanted)), source=.false.)
      allocate (self%start(lanes), self%t(lanes), self%theta(lanes), self%scale(lanes), self%row(size(wanted)), source=0.0_wp)
      allocate (self%y(lanes, formulation%states + formulation%quadratures), source=0.0_wp)
      allocate (self%pieces(lanes))
      do lane = 1, lanes
        self%pieces(lane) = new_step_pieces(size(wanted))
      end do
    end associate
  end function new_sampled_statistics

  !> Starts a variant in a lane of which `recorded` has the parameters.
  subroutine start_lane(self, lane, t, y)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! the start, before a jump there, [states + quadratures]

    call observe_lane(self, lane, t, y)
    call self%pieces(lane)%restart()
    call self%recorded%start_lane(lane)
    call self%start_accumulators(lane)
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
    call self%recorded%fill_row(lane, self%t, self%y, self%row)
    self%x_end(lane, :) = self%row
  end subroutine finish_lane

  !> Adds the last steps of the lanes.
  subroutine add_steps(self, steps, y, c)
    class(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :)      !! starts of the steps, [lanes, padded components]
    real(wp), contiguous, intent(in) :: c(:, :, :)   !! coefficients of the steps, [lanes, padded components, degree]
    integer :: i

    if (size(self%accumulators) + size(self%damages) == 0) return
    if (.not. allocated(self%nodes)) call set_nodes(self, size(c, 3))
    do i = 1, size(self%from)
      self%active(:) = steps%taken .and. steps%t_new > self%from(i)
      if (i > 1) self%active(:) = self%active .and. steps%t < self%from(i)   ! else it is the part of the first
      if (.not. any(self%active)) cycle
      self%start(:) = merge(max(steps%t, self%from(i)), huge(0.0_wp), self%active)
      call sample_pieces(self, steps, y, c)
    end do
  end subroutine add_steps

  !> Samples the parts of the steps of the active lanes piece by piece, and adds the pieces to what counts them.
  subroutine sample_pieces(self, steps, y, c)
    class(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    integer :: lane
    logical :: has_moved

    self%is_begun(:) = .false.
    do while (any(self%active))
      call sample_parts(self, steps, y, c)
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        call find_replaced(self, lane)
        call add_piece(self, lane, steps%t(lane), steps%t_new(lane))
        call self%pieces(lane)%advance(has_moved)
        self%active(lane) = .not. self%pieces(lane)%is_done
      end do
    end do
  end subroutine sample_pieces

  !> Finds the columns of a lane whose polynomials count in the present piece.
  subroutine find_replaced(self, lane)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    integer :: column

    self%replaced(:) = self%pieces(lane)%is_open(:, self%pieces(lane)%depth)
    if (.not. self%interpolates) return
    do column = 1, size(self%replaced)
      if (.not. (self%replaced(column) .and. self%bends(column))) cycle
      call self%pieces(lane)%replaces(column, self%rule, self%values(:self%rule%degree + 1, column, lane), self%scale(lane), &
                                      self%replaced(column))
    end do
  end subroutine find_replaced

  !> Adds a piece of a lane's step to the accumulators and damages that begin where its part of the step does.
  subroutine add_piece(self, lane, t, t_new)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t, t_new   !! of the step [s]
    integer :: k

    do k = 1, size(self%accumulators)
      associate (acc => self%accumulators(k))
        if (.not. (self%replaced(acc%column) .and. counts(acc%from))) cycle
        call add_part(self, acc, lane, self%pieces(lane)%begin, self%pieces(lane)%end)
      end associate
    end do
    do k = 1, size(self%damages)
      associate (damage => self%damages(k))
        if (self%replaced(damage%column) .and. counts(damage%from)) call count_part(self, damage, lane)
      end associate
    end do

  contains

    !> Whether what counts from a time on begins here in this step.
    pure logical function counts(from)
      real(wp), intent(in) :: from   !! [s]

      counts = from < t_new .and. abs(max(t, from) - self%start(lane)) <= 0
    end function counts

  end subroutine add_piece

  !> The nodes that are needed for a degree of the solution inside the steps.
  subroutine set_nodes(self, degree)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: degree

    call self%prepare(degree)
    allocate (self%nodes(0))
    if (self%interpolates) self%nodes = [self%nodes, self%rule%nodes]
    if (self%integrates) self%nodes = [self%nodes, self%gauss]
    allocate (self%values(size(self%nodes), size(self%row), size(self%active)), source=0.0_wp)
  end subroutine set_nodes

  !> Samples the columns in the pieces of the steps of the active lanes. A column that jumps at a crossing where the step ends is
  !> sampled right before it: the jump is no part of the step. How long the first piece is shows at its start.
  subroutine sample_parts(self, steps, y, c)
    type(sampled_statistics_t), intent(inout) :: self
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    integer :: i, lane

    do i = 1, size(self%nodes)
      self%t(:) = steps%t
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        if (.not. self%is_begun(lane)) call self%pieces(lane)%start_step(self%start(lane), steps%t_new(lane), 0.0_wp, &
                                                                         self%rule%degree)
        self%t(lane) = time_of_node(self%pieces(lane), self%nodes(i), steps%crosses(lane), steps%t_new(lane))
      end do
      call observe_parts(self, steps, y, c)
      do lane = 1, size(self%active)
        if (.not. self%active(lane)) cycle
        call self%recorded%fill_row(lane, self%t, self%y, self%row)
        self%values(i, :, lane) = self%row
        if (.not. self%is_begun(lane)) call begin_pieces(self, lane, steps%t_new(lane))
      end do
    end do
  end subroutine sample_parts

  !> The time of a node in a piece [s].
  pure real(wp) function time_of_node(piece, node, crosses, t_new) result(t)
    type(step_pieces_t), intent(in) :: piece
    real(wp), intent(in) :: node      !! -1 to 1
    logical, intent(in) :: crosses    !! whether the step ends at a crossing
    real(wp), intent(in) :: t_new     !! end of the step [s]
    real(wp) :: half

    half = 0.5_wp * (piece%end - piece%begin)
    t = piece%begin + half + node * half
    if (crosses .and. piece%end >= t_new) t = max(piece%begin, min(t, t_new - before_jump * spacing(t_new)))
  end function time_of_node

  !> Chooses the pieces of a lane that has been observed at the first node.
  subroutine begin_pieces(self, lane, t_new)
    type(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t_new   !! end of the step [s]
    real(wp) :: fastest

    self%is_begun(lane) = .true.
    if (.not. any(self%bends)) return
    call self%recorded%find_pace(lane, fastest, self%scale(lane))
    call self%pieces(lane)%start_step(self%start(lane), t_new, fastest, self%rule%degree)
  end subroutine begin_pieces

  !> Brings the active lanes to the times `t`, the other lanes to where their steps start.
  subroutine observe_parts(self, steps, y, c)
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
  end subroutine observe_parts

  !> Counts the cycles of a column in a part of a lane's step.
  subroutine count_part(self, sum, lane)
    class(sampled_statistics_t), intent(in) :: self
    type(damage_sum_t), intent(inout) :: sum
    integer, intent(in) :: lane

    call sum%add_polynomial(self%rule, lane, self%values(:self%rule%degree + 1, sum%column, lane))
  end subroutine count_part

  !> Adds a part of a lane's step to an accumulator.
  subroutine add_part(self, acc, lane, t_start, t_end)
    class(sampled_statistics_t), intent(in) :: self
    type(accumulator_t), intent(inout) :: acc
    integer, intent(in) :: lane
    real(wp), intent(in) :: t_start, t_end   !! of the part [s]
    integer :: k

    associate (values => self%values(:, acc%column, lane))
      if (acc%bound(lane) > 0) call start_range(acc, lane, values(1), t_start)
      if (acc%has_range()) call widen_range(acc, self%rule, lane, values, t_start, t_end, .true., .true.)
      if (acc%has_history) call acc%history(lane)%add(t_start, t_end, values(:self%rule%degree + 1))
      if (.not. acc%has_sums) return
      do k = 1, size(self%gauss)
        associate (x => values(size(values) - size(self%gauss) + k), weight => (t_end - t_start) * self%weights(k))
          acc%integral(lane) = acc%integral(lane) + weight * x
          acc%square(lane) = acc%square(lane) + weight * x**2
        end associate
      end do
    end associate
  end subroutine add_part

end module nocdyn_sampled_statistics
