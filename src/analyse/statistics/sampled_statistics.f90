!> Statistics of any columns of the trajectory table, from the polynomials that replace them in the steps (`nocdyn_extremes`).
!>
!> Integrals over a piece of a step are by as many Gauss nodes as the polynomial has coefficients: they are exact for it and for
!> its square.
module nocdyn_sampled_statistics
  use nocdyn_chebyshev, only: interpolation_t, max_degree
  use nocdyn_column_statistics, only: accumulator_t, column_statistics_t, start_range, widen_range
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_observer, only: observer_t, piece_t
  use nocdyn_quadrature, only: gauss_legendre_rule
  use nocdyn_signal_values, only: may_bend
  use nocdyn_statistics, only: statistic_t
  use nocdyn_signals, only: signal_source_t
  implicit none (type, external)
  private

  public :: new_sampled_statistics

  !> Integration of polynomials of a degree.
  type :: integration_t
    real(wp), allocatable :: weights(:)      !! of the Gauss nodes for a length of 1
    real(wp), allocatable :: shares(:, :)    !! of the values at the nodes of the polynomial in those there, [nodes, Gauss nodes]
  end type integration_t

  type, extends(column_statistics_t), public :: sampled_statistics_t
    integer, allocatable :: columns(:)                      !! that are sampled, of those given
    type(integration_t), private :: integration(max_degree) !! of the degrees that there have been
  contains
    procedure :: track, has_only_extremes, add_piece
  end type sampled_statistics_t

contains

  !> Statistics of the variants that pass through the lanes of a block.
  type(sampled_statistics_t) function new_sampled_statistics(lanes, statistics, t_start, t_end) result(self)
    integer, intent(in) :: lanes
    type(statistic_t), intent(in) :: statistics(:)   !! each of a column
    real(wp), intent(in) :: t_start, t_end           !! of every variant [s]
    integer, allocatable :: wanted(:)

    call self%set_statistics(statistics, lanes, t_start, t_end, wanted)
    call move_alloc(wanted, self%columns)
  end function new_sampled_statistics

  !> Lets an observer track the columns, if there is anything to follow in the steps.
  subroutine track(self, machine, columns, bends, observer)
    class(sampled_statistics_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    type(signal_source_t), intent(in) :: columns(:)      !! of which `columns` are sampled
    logical, intent(in) :: bends                  !! whether variants differ in cubic stiffnesses
    class(observer_t), intent(inout) :: observer
    real(wp), allocatable :: from(:)
    integer :: i

    observer%takes_pieces = .true.
    if (size(self%accumulators) + size(self%damages) == 0) return
    observer%tracked = size(self%columns)
    allocate (observer%bends(size(self%columns)))
    do i = 1, size(self%columns)
      observer%bends(i) = may_bend(machine, columns(self%columns(i)), bends)
    end do
    from = [self%accumulators%from, self%damages%from]
    allocate (observer%tracked_from(0))
    do while (size(from) > 0)
      observer%tracked_from = [observer%tracked_from, minval(from)]
      from = pack(from, from > minval(from))
    end do
  end subroutine track

  !> Whether there are only extremes, all from one time on.
  pure logical function has_only_extremes(self)
    class(sampled_statistics_t), intent(in) :: self

    has_only_extremes = size(self%accumulators) > 0 .and. size(self%damages) == 0
    if (has_only_extremes) has_only_extremes = .not. any(self%accumulators%has_sums .or. self%accumulators%has_history) .and. &
                                               all(abs(self%accumulators%from - self%accumulators(1)%from) <= 0)
  end function has_only_extremes

  !> Adds a piece of a lane's step to the accumulators and damages that begin where its part of the step does.
  subroutine add_piece(self, lane, piece, rule, values_of, replaced)
    class(sampled_statistics_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(piece_t), intent(in) :: piece
    type(interpolation_t), intent(in) :: rule
    real(wp), contiguous, intent(in) :: values_of(:, :)   !! [columns, nodes]
    logical, intent(in) :: replaced(:)                    !! columns that the polynomials replace here
    real(wp) :: values(max_degree + 1)
    integer :: k

    if (self%rules(rule%degree)%degree == 0) call prepare(self, rule)
    do k = 1, size(self%accumulators)
      associate (acc => self%accumulators(k))
        if (.not. (replaced(acc%column) .and. counts(acc%from, piece))) cycle
        values(:rule%degree + 1) = values_of(acc%column, :)
        if (acc%bound(lane) > 0) call start_range(acc, lane, values(1), piece%begin)
        if (acc%has_range()) call widen_range(acc, rule, lane, values, piece%begin, piece%end, .true., .true.)
        if (acc%has_history) call acc%history(lane)%add(piece%begin, piece%end, values(:rule%degree + 1))
        if (acc%has_sums) call add_integrals(self%integration(rule%degree), piece%end - piece%begin, values, &
                                             acc%integral(lane), acc%square(lane))
      end associate
    end do
    do k = 1, size(self%damages)
      associate (damage => self%damages(k))
        if (.not. (replaced(damage%column) .and. counts(damage%from, piece))) cycle
        values(:rule%degree + 1) = values_of(damage%column, :)
        call damage%add_polynomial(rule, lane, values)
      end associate
    end do
  end subroutine add_piece

  !> Whether what counts from a time on begins where the part of the step does to which a piece belongs.
  pure logical function counts(from, piece)
    real(wp), intent(in) :: from   !! [s]
    type(piece_t), intent(in) :: piece

    counts = from < piece%step_end .and. abs(max(piece%step_start, from) - piece%from) <= 0
  end function counts

  !> Prepares the integrals of polynomials of another degree.
  subroutine prepare(self, rule)
    class(sampled_statistics_t), intent(inout) :: self
    type(interpolation_t), intent(in) :: rule
    real(wp) :: gauss(rule%degree + 1)
    integer :: i, j, k

    self%rules(rule%degree) = rule
    associate (integration => self%integration(rule%degree), n => rule%degree)
      allocate (integration%weights(n + 1))
      allocate (integration%shares(n + 1, n + 1), source=1.0_wp)
      call gauss_legendre_rule(n + 1, gauss, integration%weights)
      do k = 1, n + 1
        do i = 0, n
          do j = 0, n
            if (j /= i) integration%shares(i + 1, k) = integration%shares(i + 1, k) * (2 * gauss(k) - 1 - rule%nodes(j)) &
                                                       / (rule%nodes(i) - rule%nodes(j))
          end do
        end do
      end do
    end associate
  end subroutine prepare

  !> Adds the integrals of a polynomial and of its square.
  pure subroutine add_integrals(integration, duration, values, integral, square)
    type(integration_t), intent(in) :: integration
    real(wp), intent(in) :: duration    !! [s]
    real(wp), intent(in) :: values(:)   !! at the nodes
    real(wp), intent(inout) :: integral, square
    real(wp) :: x
    integer :: k

    do k = 1, size(integration%weights)
      x = dot_product(integration%shares(:, k), values(:size(integration%weights)))
      integral = integral + duration * integration%weights(k) * x
      square = square + duration * integration%weights(k) * x**2
    end do
  end subroutine add_integrals

end module nocdyn_sampled_statistics
