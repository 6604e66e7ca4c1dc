!> Extremes of the time, of energies, works and the energy balance error of a run, directly from the polynomials of the steps.
!>
!> As sums of squares of speeds and twists the energies need no moment of an element. They are computed at the Chebyshev-Lobatto
!> nodes of a step, several nodes at once, in the bits in which `nocdyn_extremes` samples them.
module nocdyn_energy_statistics
  use nocdyn_chebyshev, only: max_degree, new_interpolation
  use nocdyn_column_statistics, only: column_statistics_t, start_range, widen_range, width
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_observer, only: step_block_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_signals, only: signal_kinetic, signal_residual, signal_source_t, signal_time
  use nocdyn_statistics, only: statistic_t
  use nocdyn_step_pieces, only: before_jump, count_pieces
  implicit none (type, external)
  private

  public :: has_energies, is_energy, new_energy_statistics

  integer, parameter :: kinetic = 1, elastic = 2, work_in = 3, work_out = 4, residual = 5   ! values at the nodes

  type, extends(column_statistics_t), public :: energy_statistics_t
    integer, allocatable, private :: kind(:)             !! signal_... of the columns that have statistics
    real(wp), private :: from = 0.0_wp                   !! of all statistics [s]
    integer, allocatable, private :: springs(:)          !! elements with a stiffness
    integer, allocatable, private :: waves(:)            !! banks whose laws have sines of variables
    real(wp), allocatable, private :: speed(:)           !! of their elements [rad/s]
    logical, allocatable, private :: is_source(:)        !! whether a work counts as put in, [works]
    real(wp), private :: start_energy = 0.0_wp           !! [J]
    logical, private :: is_known = .false.               !! whether `last` has the values where the next step begins
    real(wp), private :: last(residual) = 0.0_wp         !! at the end of the last step [J]
    real(wp), private :: fastest = 0.0_wp                !! waves there [rad/s]
    real(wp), allocatable, private :: y(:, :)            !! states at nodes, [width, states + quadratures]
  contains
    procedure :: start_run, add_step, add_state
  end type energy_statistics_t

contains

  !> Whether the energies of a machine follow from the angles and speeds of the reduced formulation by polynomials.
  logical function has_energies(block)
    class(formulation_t), intent(in) :: block
    integer :: i

    has_energies = .false.
    select type (block)
    class is (reduced_t)
      associate (banks => block%machine%banks)
        has_energies = block%lanes == 1 .and. .not. block%projects .and. &
                       all([(banks(i)%bank%has_polynomial_potential .and. banks(i)%bank%states == 0, i=1, size(banks))])
      end associate
    end select
  end function has_energies

  !> Whether a column is one of these.
  elemental logical function is_energy(column)
    type(signal_source_t), intent(in) :: column

    is_energy = column%kind == signal_time .or. column%kind >= signal_kinetic .and. column%kind <= signal_residual
  end function is_energy

  !> Statistics of a run, whose machine `has_energies`.
  type(energy_statistics_t) function new_energy_statistics(block, columns, statistics, t_start, t_end) result(self)
    class(formulation_t), intent(in) :: block
    type(signal_source_t), intent(in) :: columns(:)   !! of the trajectory table
    type(statistic_t), intent(in) :: statistics(:)    !! extremes and their times, all from one time on; each of such a column
    real(wp), intent(in) :: t_start, t_end            !! of the run [s]
    integer, allocatable :: wanted(:)
    integer :: e, i

    call self%set_statistics(statistics, 1, t_start, t_end, wanted)
    allocate (self%kind(size(wanted)))
    self%kind(:) = columns(wanted)%kind
    if (size(statistics) == 0) return
    self%from = statistics(1)%from
    associate (machine => block%machine)
      allocate (self%springs, source=pack([(e, e=1, machine%elements%count)], &
                                          abs(machine%laws%linear(1, :)) + abs(machine%laws%cubic(1, :)) > 0))
      allocate (self%waves(0))
      do i = 1, size(machine%general_banks)
        if (block%state%banks(machine%general_banks(i))%law%has_waves) self%waves = [self%waves, machine%general_banks(i)]
      end do
      allocate (self%speed(machine%elements%count), source=0.0_wp)
      allocate (self%is_source, source=[(spread(machine%banks(i)%bank%is_source(), 1, size(machine%banks(i)%bank%with_work)), &
                                         i=1, size(machine%banks))])
    end associate
    allocate (self%y(width, block%states + block%quadratures), source=0.0_wp)
  end function new_energy_statistics

  !> Starts a run.
  subroutine start_run(self, block, y)
    class(energy_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp) :: values(width, residual)

    if (size(self%kind) == 0) return
    call self%start_accumulators(1)
    self%is_known = .false.
    self%start_energy = 0.0_wp
    self%y(:, :) = spread(y, 1, width)
    call evaluate(self, block, values)
    self%start_energy = values(1, kinetic) + values(1, elastic)
  end subroutine start_run

  !> Adds the last step, or the part of it after `from`.
  subroutine add_step(self, block, steps, y, c)
    class(energy_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)   !! as in `on_steps` of an observer
    real(wp) :: begin, end, start, t(width), values(max_degree + width, residual)
    integer :: degree, piece, pieces

    if (size(self%kind) == 0 .or. steps%t_new(1) <= self%from) return
    degree = steps%degree(1)
    if (self%rules(degree)%degree == 0) self%rules(degree) = new_interpolation(degree)
    start = max(steps%t(1), self%from)
    if (start > steps%t(1)) self%is_known = .false.
    if (.not. self%is_known) then
      t = start
      call add_nodes(self, block, steps, y, c, t, values)
      self%last = values(1, :)
      call find_fastest(self, block, self%y(1, :))
    end if
    pieces = count_pieces(start, steps%t_new(1), self%fastest, degree)
    begin = start
    do piece = 1, pieces
      end = steps%t_new(1)
      if (piece < pieces) end = start + (steps%t_new(1) - start) * piece / pieces
      call sample_piece(self, block, steps, y, c, begin, end, values)
      call widen_ranges(self, degree, begin, end, values)
      self%last = values(degree + 1, :)
      begin = end
    end do
    self%is_known = .not. steps%crosses(1)
    call find_fastest(self, block, self%y(modulo(degree - 1, width) + 1, :))
  end subroutine add_step

  !> The values at the nodes of a piece of a step; at the first one they are known.
  subroutine sample_piece(self, block, steps, y, c, begin, end, values)
    class(energy_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    real(wp), intent(in) :: begin, end   !! [s]
    real(wp), intent(inout) :: values(:, :)
    real(wp) :: half, t(width)
    integer :: first, i

    half = 0.5_wp * (end - begin)
    values(1, :) = self%last
    do first = 1, steps%degree(1), width
      do i = 1, width
        t(i) = begin + half + self%rules(steps%degree(1))%nodes(min(first + i - 1, steps%degree(1))) * half
      end do
      if (steps%crosses(1) .and. end >= steps%t_new(1)) then
        t = max(begin, min(t, steps%t_new(1) - before_jump * spacing(steps%t_new(1))))
      end if
      call add_nodes(self, block, steps, y, c, t, values(first + 1:first + width, :))
    end do
  end subroutine sample_piece

  !> The values at some times in a step.
  subroutine add_nodes(self, block, steps, y, c, t, values)
    class(energy_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    type(step_block_t), intent(in) :: steps
    real(wp), contiguous, intent(in) :: y(:, :), c(:, :, :)
    real(wp), intent(in) :: t(width)            !! [s]
    real(wp), intent(inout) :: values(:, :)     !! [width at least, kinds]
    real(wp) :: at_nodes(width, residual)

    call find_states(size(self%y, 2), size(c, 2), steps%degree(1), min(1.0_wp, (t - steps%t(1)) / steps%h(1)), steps%scale(1), &
                     y, c, self%y)
    call evaluate(self, block, at_nodes)
    values(:width, :) = at_nodes
  end subroutine add_nodes

  !> The states at shares theta of a step.
  pure subroutine find_states(components, padded, degree, theta, scale, start, c, y)
    integer, intent(in) :: components, padded, degree
    real(wp), intent(in) :: theta(width), scale
    real(wp), intent(in) :: start(padded), c(padded, degree)
    real(wp), intent(inout) :: y(width, components)
    real(wp) :: power(max_degree), sum(width)
    integer :: i, p

    power(1) = scale
    do p = 2, degree
      power(p) = power(p - 1) * scale
    end do
    do i = 1, components
      sum = power(degree) * c(i, degree)
      do p = degree - 1, 1, -1
        sum = power(p) * c(i, p) + theta * sum
      end do
      y(:, i) = start(i) + theta * sum
    end do
  end subroutine find_states

  !> Finds the largest rate of waves in a state, in the bits of `machine_state_t`.
  subroutine find_fastest(self, block, y)
    type(energy_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    real(wp), intent(in) :: y(:)
    integer :: e, i, k

    self%fastest = 0.0_wp
    select type (block)
    class is (reduced_t)
      do i = 1, size(self%waves)
        associate (bank => block%machine%banks(self%waves(i))%bank, twists => block%incidence)
          associate (last => bank%first - 1 + bank%ports * bank%count)   ! of its phases
            do e = bank%first, last
              self%speed(e) = 0.0_wp
              do k = twists%first(e), twists%first(e + 1) - 1
                self%speed(e) = self%speed(e) + twists%ratio(1, k) * y(twists%coordinate(k))
              end do
            end do
            self%fastest = max(self%fastest, block%state%banks(self%waves(i))%law%fastest(1, self%speed(bank%first:last)))
          end associate
        end associate
      end do
    class default
      return
    end select
  end subroutine find_fastest

  !> Widens the ranges by the polynomials through values at the nodes.
  subroutine widen_ranges(self, degree, begin, end, values)
    class(energy_statistics_t), intent(inout) :: self
    integer, intent(in) :: degree
    real(wp), intent(in) :: begin, end   !! [s]
    real(wp), intent(in) :: values(:, :)
    integer :: i, place

    do i = 1, size(self%accumulators)
      associate (acc => self%accumulators(i), kind => self%kind(self%accumulators(i)%column))
        if (kind == signal_time) then
          if (acc%bound(1) > 0) call start_range(acc, 1, begin, begin)
          acc%highest(1) = end
          acc%highest_time(1) = end
          cycle
        end if
        place = kind - signal_kinetic + kinetic
        if (acc%bound(1) > 0) call start_range(acc, 1, values(1, place), begin)
        call widen_range(acc, self%rules(degree), 1, values(:degree + 1, place), begin, end, .true., .true.)
      end associate
    end do
  end subroutine widen_ranges

  !> Widens the ranges by a state to which the solution has jumped.
  subroutine add_state(self, block, t, y)
    class(energy_statistics_t), intent(inout) :: self
    class(formulation_t), intent(in) :: block
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp) :: values(width, residual)

    if (size(self%kind) == 0) return
    self%is_known = .false.
    if (self%accumulators(1)%bound(1) > 0) return   ! they have not begun
    self%y(:, :) = spread(y, 1, width)
    call evaluate(self, block, values)
    if (self%rules(1)%degree == 0) self%rules(1) = new_interpolation(1)
    call widen_ranges(self, 1, t, t, values)
  end subroutine add_state

  !> The energies, the works and the energy balance error at the states `y`.
  subroutine evaluate(self, block, values)
    class(energy_statistics_t), intent(in) :: self
    class(formulation_t), intent(in) :: block
    real(wp), intent(out) :: values(width, residual)   !! [J]

    select type (block)
    class is (reduced_t)
      call find_kinetic(block, self%y, values(:, kinetic))
      call find_elastic(block, self%springs, self%y, values(:, elastic))
      call find_works(block%states, self%is_source, self%y, values(:, work_in), values(:, work_out))
      values(:, residual) = (values(:, kinetic) + values(:, elastic) - self%start_energy) &
                            - (values(:, work_in) + values(:, work_out))
      values(:, work_out) = 0.0_wp - values(:, work_out)   ! not -0
    class default
      error stop 'nocdyn_energy_statistics: the formulation is the reduced one'
    end select
  end subroutine evaluate

  !> omega^T J omega / 2 with omega = L_tau q'.
  pure subroutine find_kinetic(block, y, energy)
    class(reduced_t), intent(in) :: block
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), intent(out) :: energy(width)
    real(wp) :: omega(width)
    integer :: b, k

    energy = 0.0_wp
    associate (coordinates => block%machine%coordinates, inertia => block%machine%inertia)
      do b = 1, block%machine%bodies
        omega = 0.0_wp
        do k = coordinates%first(b), coordinates%first(b + 1) - 1
          omega = omega + coordinates%ratio(1, k) * y(:width, coordinates%coordinate(k))
        end do
        energy = energy + inertia(1, b) * omega**2
      end do
    end associate
    energy = 0.5_wp * energy
  end subroutine find_kinetic

  !> The sum of linear w^2 / 2 + cubic w^4 / 4 with w = u_0 + U q - rest.
  pure subroutine find_elastic(block, springs, y, energy)
    class(reduced_t), intent(in) :: block
    integer, intent(in) :: springs(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), intent(out) :: energy(width)
    real(wp) :: w(width)
    integer :: i, k

    energy = 0.0_wp
    associate (twists => block%incidence, laws => block%machine%laws, f => block%machine%coordinates%freedoms)
      do i = 1, size(springs)
        associate (e => springs(i))
          w = block%twist_at_origin(1, e)
          do k = twists%first(e), twists%first(e + 1) - 1
            w = w + twists%ratio(1, k) * y(:width, f + twists%coordinate(k))
          end do
          w = (w - laws%rest(1, e))**2
          energy = energy + (0.5_wp * laws%linear(1, e) + 0.25_wp * laws%cubic(1, e) * w) * w
        end associate
      end do
    end associate
  end subroutine find_elastic

  !> The sums of the works that count as put in, and of the others, which are negative in the state.
  pure subroutine find_works(states, is_source, y, of_sources, of_others)
    integer, intent(in) :: states   !! number, before the works
    logical, intent(in) :: is_source(:)
    real(wp), contiguous, intent(in) :: y(:, :)
    real(wp), intent(out), dimension(width) :: of_sources, of_others
    integer :: i

    of_sources = 0.0_wp
    of_others = 0.0_wp
    do i = 1, size(is_source)
      if (is_source(i)) then
        of_sources = of_sources + y(:width, states + i)
      else
        of_others = of_others + y(:width, states + i)
      end if
    end do
  end subroutine find_works

end module nocdyn_energy_statistics
