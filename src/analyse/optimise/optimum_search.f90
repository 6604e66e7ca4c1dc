!> Searches for the best choice: every combination of sizes and of values that can be had, and for each the best values of the
!> numbers between bounds, from their start and from the best of many points of Sobol.
module nocdyn_optimum_search
  use nocdyn_design_choices, only: design_number_t, design_size_t
  use nocdyn_design_problem, only: add_bound, design_limit_t, design_problem_t, new_design_problem, objective_t
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_free_numbers, only: set_free_numbers
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input_text
  use nocdyn_input_text, only: input_text
  use nocdyn_kinds, only: wp
  use nocdyn_minimax, only: is_better, minimise_worst, worst_point_t
  use nocdyn_sobol_points, only: max_dimensions, sobol_points, sobol_points_t
  use nocdyn_text, only: quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: search_optimum

  !> One choice with what it gives.
  type, public :: candidate_t
    type(string_t), allocatable :: sizes(:)     !! [sizes]
    real(wp), allocatable :: values(:)          !! [numbers]
    type(worst_point_t) :: point                !! its goals are those of `objectives`
    integer, allocatable :: limit(:)            !! of the point, for each of `bounds`, 0: its sizes have no such limit
  contains
    procedure :: excess_of, has_limit
  end type candidate_t

  !> What has been found.
  type, public :: optimum_t
    type(design_number_t), allocatable :: numbers(:)
    type(design_size_t), allocatable :: sizes(:)
    type(objective_t), allocatable :: objectives(:)
    type(design_limit_t), allocatable :: bounds(:)    !! of all candidates
    type(candidate_t) :: before                       !! the input as it is
    type(candidate_t), allocatable :: candidates(:)   !! the best of each combination, or all if there are no free numbers
    integer :: best = 0                               !! of these
    integer :: evaluations = 0, starts = 0
    type(input_t) :: input                            !! with the best choice
    type(string_t), allocatable :: notes(:)
  end type optimum_t

  real(wp), parameter :: at_end = 1.0e-8_wp   ! so near to a bound is at it
  integer, parameter :: usual_starts = 4, points_of_start = 16       ! points of Sobol for each start
  integer, parameter :: most_combinations = 100000, most_searches = 1000

contains

  !> Searches.
  subroutine search_optimum(input, numbers, sizes, starts, self, error)
    type(input_t), intent(in) :: input
    type(design_number_t), intent(in) :: numbers(:)
    type(design_size_t), intent(in) :: sizes(:)
    integer, intent(in) :: starts                      !! as many as usual if 0
    type(optimum_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(design_problem_t) :: problem
    type(input_t) :: changed
    character(len=:), allocatable :: message, reason
    integer :: chosen(size(sizes)), counts(size(sizes)), first, i

    allocate (self%numbers, source=numbers)
    allocate (self%sizes, source=sizes)
    allocate (self%candidates(0), self%notes(0))
    self%starts = starts
    if (starts == 0) self%starts = usual_starts
    call refuse_too_many(input, numbers, sizes, error)
    if (.not. allocated(error)) call find_before(input, self, error)
    if (allocated(error)) return
    counts = [(size(sizes(i)%sizes), i=1, size(sizes))]
    chosen = 1
    reason = ''
    do
      call choose_sizes(input, sizes, chosen, changed, error)
      if (.not. allocated(error)) call new_design_problem(changed, numbers, problem, error)
      if (allocated(error)) return
      first = size(self%candidates) + 1
      call add_bounds(problem%bounds, self%bounds)
      call search_values(problem, self)
      do i = first, size(self%candidates)
        allocate (self%candidates(i)%sizes(size(sizes)))
        call name_sizes(sizes, chosen, self%candidates(i)%sizes)
        call find_limits(self%bounds, problem%bounds, self%candidates(i)%limit)
      end do
      if (reason == '') reason = problem%reason
      if (.not. has_next(chosen, counts)) exit
    end do
    do i = 1, size(self%candidates)
      if (.not. self%candidates(i)%point%is_valid) cycle
      if (self%best == 0) then
        self%best = i
      else if (is_better(self%candidates(i)%point, self%candidates(self%best)%point)) then
        self%best = i
      end if
    end do
    if (self%best == 0) then
      call raise(error, exit_failed, input%shown_case() // ': no choice gives the objectives: ' // reason)
      return
    end if
    call take_best(input, self, message)
    if (message /= '') call raise(error, exit_failed, input%shown_case() // ': ' // message)
  end subroutine search_optimum

  !> Refuses searches that would not end.
  subroutine refuse_too_many(input, numbers, sizes, error)
    type(input_t), intent(in) :: input
    type(design_number_t), intent(in) :: numbers(:)
    type(design_size_t), intent(in) :: sizes(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: combinations
    integer :: i, most

    combinations = 1.0_wp
    do i = 1, size(numbers)
      if (.not. numbers(i)%is_continuous) combinations = combinations * size(numbers(i)%values)
    end do
    do i = 1, size(sizes)
      combinations = combinations * size(sizes(i)%sizes)
    end do
    most = merge(most_searches, most_combinations, any(numbers%is_continuous))
    if (combinations > most) then
      call raise(error, exit_input, input%shown_case() // ': &design has ' // to_text(nint(min(combinations, 2.0e9_wp))) // &
                 ' combinations of values and sizes; allowed: at most ' // to_text(most))
    else if (count(numbers%is_continuous) > max_dimensions) then
      call raise(error, exit_input, input%shown_case() // ': &design has ' // to_text(count(numbers%is_continuous)) // &
                 ' numbers between bounds; allowed: at most ' // to_text(max_dimensions))
    end if
  end subroutine refuse_too_many

  !> What the input itself gives.
  subroutine find_before(input, self, error)
    type(input_t), intent(in) :: input
    type(optimum_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(design_problem_t) :: problem
    type(worst_point_t), allocatable :: points(:)
    integer :: i
    real(wp) :: none(0, 1)

    call new_design_problem(input, self%numbers, problem, error)
    if (allocated(error)) return
    self%objectives = problem%objectives
    self%bounds = problem%bounds
    self%before%values = self%numbers%before
    allocate (self%before%sizes(size(self%sizes)))
    do i = 1, size(self%sizes)
      self%before%sizes(i)%text = input%groups(self%sizes(i)%group)%text('size')
    end do
    problem%is_free = .false.
    problem%fixed = self%before%values
    call problem%evaluate(none, points)
    self%before%point = points(1)
    call find_limits(self%bounds, problem%bounds, self%before%limit)
  end subroutine find_before

  !> Adds limits that are not there.
  subroutine add_bounds(own, bounds)
    type(design_limit_t), intent(in) :: own(:)
    type(design_limit_t), allocatable, intent(inout) :: bounds(:)
    integer :: i, k

    do i = 1, size(own)
      if (.not. any([(bounds(k)%label == own(i)%label, k=1, size(bounds))])) call add_bound(bounds, own(i)%label, own(i)%largest)
    end do
  end subroutine add_bounds

  !> Which of its own limits each limit is, 0: none.
  subroutine find_limits(bounds, own, limit)
    type(design_limit_t), intent(in) :: bounds(:), own(:)
    integer, allocatable, intent(out) :: limit(:)   !! [bounds]
    integer :: i, k

    allocate (limit(size(bounds)))
    do i = 1, size(bounds)
      limit(i) = findloc([(own(k)%label == bounds(i)%label, k=1, size(own))], .true., dim=1)
    end do
  end subroutine find_limits

  !> By how much a candidate exceeds a limit, as a share of it; negative if it keeps it, -1 without such a limit.
  pure real(wp) function excess_of(self, bound) result(excess)
    class(candidate_t), intent(in) :: self
    integer, intent(in) :: bound   !! of all candidates

    excess = -1.0_wp
    if (self%has_limit(bound)) excess = self%point%limit(self%limit(bound))
  end function excess_of

  !> Whether a candidate is compared with a limit.
  pure logical function has_limit(self, bound)
    class(candidate_t), intent(in) :: self
    integer, intent(in) :: bound   !! of all candidates

    has_limit = self%point%is_valid .and. bound <= size(self%limit)
    if (has_limit) has_limit = self%limit(bound) > 0
  end function has_limit

  !> The best values for the sizes of a problem: a candidate for each combination of values of lists.
  subroutine search_values(problem, self)
    type(design_problem_t), intent(inout) :: problem
    type(optimum_t), intent(inout) :: self
    integer, allocatable :: chosen(:), counts(:), listed(:)
    real(wp), allocatable :: values(:, :)
    type(worst_point_t), allocatable :: points(:)
    integer :: combinations, i, k, n

    n = size(problem%numbers)
    allocate (listed, source=pack([(i, i=1, n)], .not. problem%numbers%is_continuous))
    allocate (counts, source=[(size(problem%numbers(listed(k))%values), k=1, size(listed))])
    allocate (chosen(size(listed)), source=1)
    combinations = product(counts)
    allocate (values(n, combinations))
    do i = 1, combinations
      values(:, i) = problem%numbers%start
      do k = 1, size(listed)
        values(listed(k), i) = problem%numbers(listed(k))%values(chosen(k))
      end do
      if (.not. has_next(chosen, counts)) exit
    end do
    if (size(listed) == n) then
      call problem%compute(values, points)
      self%evaluations = self%evaluations + combinations
      do i = 1, combinations
        call add_candidate(self, points(i), values(:, i))
      end do
      return
    end if
    do i = 1, combinations
      problem%fixed = values(:, i)
      call search_between(problem, self)
    end do
  end subroutine search_values

  !> The best values of the numbers between bounds.
  subroutine search_between(problem, self)
    type(design_problem_t), intent(inout) :: problem
    type(optimum_t), intent(inout) :: self
    type(sobol_points_t) :: sobol
    type(worst_point_t), allocatable :: points(:)
    type(worst_point_t) :: best, found
    real(wp), allocatable :: x(:, :)
    logical, allocatable :: is_used(:)
    integer :: i, k, n, p, start
    logical :: has_changed

    n = count(problem%is_free)
    allocate (x(n, 1 + merge(points_of_start * self%starts, 0, self%starts > 1)))
    k = 0
    do i = 1, size(problem%numbers)
      if (.not. problem%is_free(i)) cycle
      k = k + 1
      x(k, 1) = min(1.0_wp, max(0.0_wp, problem%numbers(i)%share_of(problem%numbers(i)%start)))
    end do
    sobol = sobol_points(n, 0)
    do p = 2, size(x, 2)
      x(:, p) = [(sobol%coordinate(p - 1, k), k=1, n)]
    end do
    call problem%reset()
    call problem%evaluate(x, points)
    self%evaluations = self%evaluations + size(points)
    allocate (is_used(size(points)), source=.false.)
    do start = 1, self%starts
      p = 1   ! the start of the input, then the best points
      if (start > 1) then
        p = 0
        do i = 1, size(points)
          if (is_used(i)) cycle
          if (p == 0) then
            p = i
          else if (is_better(points(i), points(p))) then
            p = i
          end if
        end do
      end if
      if (p == 0) exit
      is_used(p) = .true.
      if (.not. points(p)%is_valid) cycle
      call problem%reset()
      call problem%renew(x(:, p), has_changed)
      call minimise_worst(problem, x(:, p), found, self%evaluations)
      if (is_better(found, best)) best = found
    end do
    call problem%reset()
    if (best%is_valid) then   ! with a goal for each objective
      where (best%x < at_end) best%x = 0.0_wp
      where (best%x > 1.0_wp - at_end) best%x = 1.0_wp
      call problem%evaluate(reshape(best%x, [n, 1]), points)
      best = points(1)
      call add_candidate(self, best, problem%values_at(best%x))
    else
      call add_candidate(self, points(1), problem%values_at(x(:, 1)))
    end if
  end subroutine search_between

  subroutine add_candidate(self, point, values)
    type(optimum_t), intent(inout) :: self
    type(worst_point_t), intent(in) :: point
    real(wp), intent(in) :: values(:)
    type(candidate_t), allocatable :: more(:)
    integer :: i

    allocate (more(size(self%candidates) + 1))
    do i = 1, size(self%candidates)
      more(i) = self%candidates(i)
    end do
    more(size(more))%point = point
    more(size(more))%values = values
    call move_alloc(more, self%candidates)
  end subroutine add_candidate

  !> The next combination; false after the last one.
  logical function has_next(chosen, counts)
    integer, intent(inout) :: chosen(:)
    integer, intent(in) :: counts(:)
    integer :: i

    do i = size(chosen), 1, -1
      has_next = chosen(i) < counts(i)
      if (has_next) chosen(i) = chosen(i) + 1
      if (has_next) return
      chosen(i) = 1
    end do
    has_next = .false.
  end function has_next

  subroutine name_sizes(sizes, chosen, names)
    type(design_size_t), intent(in) :: sizes(:)
    integer, intent(in) :: chosen(:)
    type(string_t), intent(inout) :: names(:)
    integer :: i

    do i = 1, size(sizes)
      names(i)%text = sizes(i)%sizes(chosen(i))%text
    end do
  end subroutine name_sizes

  !> The input with sizes of catalogues, whose other numbers follow from these when it is read.
  subroutine choose_sizes(input, sizes, chosen, changed, error)
    type(input_t), intent(in) :: input
    type(design_size_t), intent(in) :: sizes(:)
    integer, intent(in) :: chosen(:)
    type(input_t), intent(out) :: changed
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: settings(size(sizes))
    integer :: i

    if (size(sizes) == 0) then
      changed = input
      return
    end if
    do i = 1, size(sizes)
      settings(i)%text = sizes(i)%path // '=' // quoted(sizes(i)%sizes(chosen(i))%text)
    end do
    call read_input_text(input_text(input), input%file, settings, changed, error)
    if (allocated(error)) return
    if (allocated(input%load_case)) changed%load_case = input%load_case
  end subroutine choose_sizes

  !> The input with the best choice.
  subroutine take_best(input, self, message)
    type(input_t), intent(in) :: input
    type(optimum_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: message
    type(error_t), allocatable :: error
    integer :: chosen(size(self%sizes)), i, k

    associate (best => self%candidates(self%best))
      do i = 1, size(self%sizes)
        chosen(i) = findloc([(self%sizes(i)%sizes(k)%text == best%sizes(i)%text, k=1, size(self%sizes(i)%sizes))], .true., dim=1)
      end do
      call choose_sizes(input, self%sizes, chosen, self%input, error)
      if (allocated(error)) then
        message = error%message
      else
        call set_free_numbers(self%input, self%numbers, best%values, message)
      end if
    end associate
  end subroutine take_best

end module nocdyn_optimum_search
