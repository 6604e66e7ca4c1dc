!> A machine with numbers that may be chosen: what its objectives and limits are at any values of these. Many points are computed
!> at once, in lanes and threads, as the variants of a sweep are.
module nocdyn_design_problem
  use nocdyn_analyses, only: analysis_t
  use nocdyn_analysis_results, only: analysis_peak, analysis_result_t, new_verdict_result
  use nocdyn_design_choices, only: design_number_t
  use nocdyn_designs, only: list_design
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_limit_groups, only: derating, limited_signal
  use nocdyn_minimax, only: worst_point_t, worst_problem_t
  use nocdyn_named_analyses, only: solve_named
  use nocdyn_point_scheduler, only: new_point_scheduler, point_scheduler_t
  use nocdyn_run_verdict, only: peak_keys
  use nocdyn_signals, only: list_signals, signal_t
  use nocdyn_statistics, only: new_statistic, statistic_max_abs, statistic_t
  use nocdyn_sweep, only: compute_variants, prepare_sweep, sweep_setup_t
  use nocdyn_sweep_code, only: new_sweep_code, sweep_code_t
  use nocdyn_sweep_plan, only: make_point_plan, sweep_plan_t
  use nocdyn_targets, only: set_targets
  use nocdyn_text, only: string_t
  use nocdyn_variant_analysis, only: find_valleys
  use omp_lib, only: omp_get_max_threads
  implicit none (type, external)
  private

  public :: add_bound, new_design_problem

  !> One objective.
  type, public :: objective_t
    character(len=:), allocatable :: label, unit
    logical :: is_minimised = .true.
    real(wp) :: scale = 1.0_wp
  contains
    procedure :: value
  end type objective_t

  !> One limit.
  type, public :: design_limit_t
    character(len=:), allocatable :: label
    real(wp) :: largest = 1.0_wp   !! of the result
  end type design_limit_t

  type, extends(worst_problem_t), public :: design_problem_t
    type(design_number_t), allocatable :: numbers(:)
    type(objective_t), allocatable :: objectives(:)
    type(design_limit_t), allocatable :: bounds(:)      !! whose results come after those of the objectives
    logical, allocatable :: is_free(:)                  !! whether a number is a variable of the search, [numbers]
    real(wp), allocatable :: fixed(:)                   !! values of the others, [numbers]
    character(len=:), allocatable :: reason             !! why a point had no functions, ''
    type(sweep_plan_t), private :: plan
    type(sweep_setup_t), private :: setup
    integer, allocatable, private :: objective(:)       ! of each goal
    integer, allocatable, private :: result(:)          ! of each goal
  contains
    procedure :: compute, evaluate, renew, reset, values_at
  end type design_problem_t

contains

  !> Reads objectives and limits of an input.
  subroutine new_design_problem(input, numbers, self, error)
    type(input_t), intent(in) :: input
    type(design_number_t), intent(in) :: numbers(:)
    type(design_problem_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: paths(size(numbers))
    integer :: i

    do i = 1, size(numbers)
      paths(i)%text = numbers(i)%path
    end do
    allocate (self%numbers, source=numbers)
    allocate (self%is_free(size(numbers)), self%fixed(size(numbers)))
    self%is_free = numbers%is_continuous
    self%fixed = numbers%start
    self%reason = ''
    call make_point_plan(input, paths, 'objective', self%plan, error)
    if (allocated(error)) return
    if (self%plan%results() == 0) then
      call raise(error, exit_input, input%shown_file() // ': there is no group &objective; required: for instance ' // &
                 "&objective goal = 'minimise' response = 'shaft' statistic = 'peak' /")
      return
    end if
    call list_objectives(input, self%plan, self%objectives)
    allocate (self%bounds(0))
    if (size(self%plan%statistics) > 0) call add_run_limits(input, self%plan, self%bounds)
    call add_verdict_limits(input, self%plan, self%bounds, error)
    if (.not. allocated(error)) call prepare_sweep(self%plan, self%setup, error)
    if (allocated(error)) return
    self%goals = size(self%objectives)
    self%limits = size(self%bounds)
    allocate (self%objective, source=[(i, i=1, self%goals)])
    allocate (self%result, source=self%objective)
  end subroutine new_design_problem

  !> The objectives, in the order of their results.
  subroutine list_objectives(input, plan, objectives)
    type(input_t), intent(in) :: input
    type(sweep_plan_t), intent(in) :: plan
    type(objective_t), allocatable, intent(out) :: objectives(:)
    integer, allocatable :: groups(:)
    integer :: g, i, n

    allocate (objectives(plan%results()))
    do i = 1, size(plan%statistics)
      objectives(plan%statistics(i)%result)%label = plan%statistics(i)%label
      objectives(plan%statistics(i)%result)%unit = plan%statistics(i)%unit
    end do
    do i = 1, size(plan%analyses)
      objectives(plan%analyses(i)%result)%label = plan%analyses(i)%label
      objectives(plan%analyses(i)%result)%unit = plan%analyses(i)%unit
    end do
    allocate (groups, source=input%groups_named('objective'))
    n = 0
    do g = 1, size(groups)
      associate (group => input%groups(groups(g)))
        do i = 1, max(size(group%texts('statistic')), size(group%texts('path')))   ! each has one result
          n = n + 1
          objectives(n)%is_minimised = group%text('goal') == 'minimise'
          objectives(n)%scale = group%number('scale')
        end do
      end associate
    end do
  end subroutine list_objectives

  !> Adds what `nocdyn run` compares with &limit: largest magnitudes.
  subroutine add_run_limits(input, plan, bounds)
    type(input_t), intent(in) :: input
    type(sweep_plan_t), intent(inout) :: plan
    type(design_limit_t), allocatable, intent(inout) :: bounds(:)
    type(signal_t), allocatable :: signals(:)
    type(statistic_t), allocatable :: statistics(:)
    type(statistic_t) :: one
    integer, allocatable :: groups(:)
    integer :: column, g, k
    real(wp) :: from

    call list_signals(plan%machine, signals)
    allocate (groups, source=input%groups_named('limit'))
    associate (run => input%groups(input%position('run')), output => input%groups(input%position('output')))
      from = output%number('extremes_from', absent=run%number('t_start'))
    end associate
    do g = 1, size(groups)
      do k = 1, size(peak_keys)
        associate (group => input%groups(groups(g)))
          if (.not. group%has_value(trim(peak_keys(k)))) cycle
          column = limited_signal(group, signals)
          if (column == 0) cycle
          one = new_statistic(signals, column, statistic_max_abs, from)
          one%result = plan%results() + 1
          call add_bound(bounds, signals(column)%name // ', largest magnitude', &
                         derating(group) * group%number(trim(peak_keys(k))))
        end associate
        allocate (statistics(size(plan%statistics) + 1))
        statistics(:size(plan%statistics)) = plan%statistics
        statistics(size(statistics)) = one
        call move_alloc(statistics, plan%statistics)
      end do
    end do
  end subroutine add_run_limits

  !> Adds what `nocdyn response` says of limits in its verdict.
  subroutine add_verdict_limits(input, plan, bounds, error)
    type(input_t), intent(in) :: input
    type(sweep_plan_t), intent(inout) :: plan
    type(design_limit_t), allocatable, intent(inout) :: bounds(:)
    type(error_t), allocatable, intent(out) :: error
    class(analysis_t), allocatable :: analysis
    type(analysis_result_t), allocatable :: analyses(:)
    type(analysis_result_t) :: one
    integer :: i, k

    if (size(input%groups_named('response')) == 0) return
    if (size(input%groups_named('limit')) + size(input%groups_named('fatigue')) == 0) return
    call solve_named('response', input, analysis, error)
    if (allocated(error)) return
    call analysis%judge(input)
    if (.not. allocated(analysis%verdict%lines)) return
    do i = 1, size(analysis%verdict%lines)
      associate (line => analysis%verdict%lines(i))
        if (.not. line%has_ratio) cycle
        call new_verdict_result('response', line%element, line%criterion, one)
      end associate
      if (any([(bounds(k)%label == one%label, k=1, size(bounds))])) cycle
      one%result = plan%results() + 1
      call add_bound(bounds, one%label, 1.0_wp)
      allocate (analyses(size(plan%analyses) + 1))
      analyses(:size(plan%analyses)) = plan%analyses
      analyses(size(analyses)) = one
      call move_alloc(analyses, plan%analyses)
    end do
  end subroutine add_verdict_limits

  !> Adds a limit.
  subroutine add_bound(bounds, label, largest)
    type(design_limit_t), allocatable, intent(inout) :: bounds(:)
    character(len=*), intent(in) :: label
    real(wp), intent(in) :: largest
    type(design_limit_t), allocatable :: more(:)

    allocate (more(size(bounds) + 1))
    more(:size(bounds)) = bounds
    more(size(more))%label = label
    more(size(more))%largest = largest
    call move_alloc(more, bounds)
  end subroutine add_bound

  !> The values of all numbers at a point of the search.
  pure function values_at(self, x) result(values)
    class(design_problem_t), intent(in) :: self
    real(wp), intent(in) :: x(:)   !! of the free numbers, 0 to 1
    real(wp) :: values(size(self%numbers))
    integer :: i, k

    values = self%fixed
    k = 0
    do i = 1, size(values)
      if (.not. self%is_free(i)) cycle
      k = k + 1
      values(i) = self%numbers(i)%at(x(k))
    end do
  end function values_at

  !> Goals and limits at some points.
  subroutine evaluate(self, x, points)
    class(design_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:, :)   !! of the free numbers, 0 to 1, [free numbers, points]
    type(worst_point_t), allocatable, intent(out) :: points(:)
    real(wp) :: values(size(self%numbers), size(x, 2))
    integer :: p

    do p = 1, size(x, 2)
      values(:, p) = self%values_at(x(:, p))
    end do
    call self%compute(values, points)
    do p = 1, size(points)
      points(p)%x = x(:, p)
    end do
  end subroutine evaluate

  !> Does so at values of all numbers.
  subroutine compute(self, values, points)
    class(design_problem_t), intent(inout) :: self
    real(wp), intent(in) :: values(:, :)   !! [numbers, points]
    type(worst_point_t), allocatable, intent(out) :: points(:)
    type(point_scheduler_t) :: scheduler
    type(sweep_code_t) :: code
    real(wp) :: results(self%plan%results())
    integer :: g, p, threads

    if (allocated(self%plan%design)) deallocate (self%plan%design)
    allocate (self%plan%design, source=list_design(values))
    threads = min(omp_get_max_threads(), size(values, 2))
    call new_point_scheduler(size(values, 2), size(results), threads, self%setup%lanes, scheduler)
    code = new_sweep_code('never', size(values, 2))
    call compute_variants(self%plan, self%setup, threads, scheduler, code)
    allocate (points(size(values, 2)))
    do p = 1, size(points)
      points(p)%is_valid = scheduler%is_done(p)
      if (allocated(scheduler%reasons(p)%text) .and. self%reason == '') self%reason = scheduler%reasons(p)%text
      results = scheduler%results(:, p)
      allocate (points(p)%goal(self%goals), points(p)%limit(self%limits))
      do g = 1, self%goals
        associate (one => self%objectives(self%objective(g)))
          points(p)%goal(g) = results(self%result(g)) / one%scale
          if (.not. one%is_minimised) points(p)%goal(g) = -points(p)%goal(g)
        end associate
      end do
      points(p)%limit = results(size(self%objectives) + 1:size(self%objectives) + self%limits) / self%bounds%largest - 1.0_wp
    end do
  end subroutine compute

  !> Divides the speeds of the peaks of responses at the valleys between high peaks: each peak is a function of its own.
  subroutine renew(self, x, has_changed)
    class(design_problem_t), intent(inout) :: self
    real(wp), intent(in) :: x(:)
    logical, intent(out) :: has_changed
    type(analysis_result_t), allocatable :: analyses(:)
    type(error_t), allocatable :: error
    type(input_t) :: input
    character(len=:), allocatable :: message
    integer, allocatable :: objective(:), result(:)
    integer :: i, k, most
    real(wp) :: targets(size(self%plan%numbers%targets))
    real(wp), allocatable :: valleys(:)

    has_changed = .false.
    input = self%plan%input
    call self%plan%numbers%target_values(self%values_at(x), targets)
    call set_targets(input, self%plan%numbers%targets, targets, message)
    if (message /= '') return
    most = size(self%objectives) + self%limits   ! results but the peaks that follow
    analyses = pack_results(self%plan%analyses, most)
    objective = [(i, i=1, size(self%objectives))]
    result = objective
    do i = 1, size(analyses)
      if (analyses(i)%result > size(self%objectives) .or. analyses(i)%mode /= 0) cycle
      if (analyses(i)%statistic /= analysis_peak) cycle
      if (.not. self%objectives(analyses(i)%result)%is_minimised) cycle
      call find_valleys(input, analyses(i), valleys, error)
      if (allocated(error)) return
      do k = 1, size(valleys)
        most = most + 1
        call add_window(analyses, i, k, valleys, most)
        objective = [objective, analyses(i)%result]
        result = [result, most]
      end do
      if (size(valleys) > 0) analyses(i)%window(2) = valleys(1)
    end do
    has_changed = size(objective) /= size(self%objective)
    if (.not. has_changed) return
    call move_alloc(analyses, self%plan%analyses)
    call move_alloc(objective, self%objective)
    call move_alloc(result, self%result)
    self%goals = size(self%objective)
  end subroutine renew

  !> Lets each objective be one function again.
  subroutine reset(self)
    class(design_problem_t), intent(inout) :: self
    integer :: i

    self%plan%analyses = pack_results(self%plan%analyses, size(self%objectives) + self%limits)
    self%goals = size(self%objectives)
    self%objective = [(i, i=1, self%goals)]
    self%result = self%objective
  end subroutine reset

  !> The results up to a number, of all speeds.
  pure function pack_results(all, most) result(some)
    type(analysis_result_t), intent(in) :: all(:)
    integer, intent(in) :: most
    type(analysis_result_t), allocatable :: some(:)
    integer :: i, n

    allocate (some(count([(all(i)%result <= most, i=1, size(all))])))
    n = 0
    do i = 1, size(all)
      if (all(i)%result > most) cycle
      n = n + 1
      some(n) = all(i)
      some(n)%window = [-huge(1.0_wp), huge(1.0_wp)]
    end do
  end function pack_results

  !> Adds a result like another one, of the speeds from a valley to the next one.
  pure subroutine add_window(analyses, like, k, valleys, number)
    type(analysis_result_t), allocatable, intent(inout) :: analyses(:)
    integer, intent(in) :: like, k, number
    real(wp), intent(in) :: valleys(:)
    type(analysis_result_t), allocatable :: more(:)

    allocate (more(size(analyses) + 1))
    more(:size(analyses)) = analyses
    more(size(more)) = analyses(like)
    more(size(more))%result = number
    more(size(more))%window = [valleys(k), huge(1.0_wp)]
    if (k < size(valleys)) more(size(more))%window(2) = valleys(k + 1)
    call move_alloc(more, analyses)
  end subroutine add_window

  !> The number that an objective had at a point, in its unit.
  pure real(wp) function value(self, goal)
    class(objective_t), intent(in) :: self
    real(wp), intent(in) :: goal   !! of a point

    value = goal * self%scale
    if (.not. self%is_minimised) value = -value
  end function value

end module nocdyn_design_problem
