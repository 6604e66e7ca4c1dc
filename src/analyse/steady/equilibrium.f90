!> Steady states of a machine: constant speeds, mean torques, constant twists.
module nocdyn_equilibrium
  use nocdyn_balance_search, only: search_balance
  use nocdyn_balance_starts, only: solve_by_newton
  use nocdyn_steady_texts, only: describe_joints, describe_overload, describe_speeds, describe_state_speeds, &
    explain_no_balance, list_moving_bodies
  use nocdyn_block_solutions, only: block_solutions_t
  use nocdyn_element_sets, only: element_names
  use nocdyn_eigenpairs, only: eigenpairs_t, find_eigenpairs
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_floating_motions, only: hold_floating
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_resting_joints, only: list_resting_sets, new_resting_joints, resting_joints_t, slips_where_it_cannot
  use nocdyn_static_twists, only: find_twists, twist_problem_t, undetermined_elements
  use nocdyn_text, only: append, append_new, joined, string_t, to_text
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  implicit none (type, external)
  private

  public :: distances, find_equilibria, find_stability, mean_formulation, mean_machine, nearest_equilibrium

  real(wp), parameter, public :: t_infinity = 1.0e30_wp   !! a time after all transients of the excitations [s]

  integer, parameter :: most_combinations = 64   ! of the solutions of independent parts of a machine
  integer, parameter :: most_states = 1000       ! up to which eigenvalues are computed, which takes some seconds
  integer, parameter :: most_names = 5           ! of bodies in a message
  integer, parameter :: most_trials = 50         ! of the torques of teeth

  !> A steady state and its stability.
  type, public :: equilibrium_t
    real(wp), allocatable :: y(:, :)   !! state of the reduced formulation without work integrals, [1, states]
    character(len=14) :: stability = 'not determined'   !! stable, unstable, neutral, not determined
    real(wp) :: growth = 0.0_wp   !! largest real part of the eigenvalues without the ones of free rigid motions [1/s]
    integer :: free_modes = 0   !! number of rigid motions without torques, or in a range of steady speeds
    logical :: is_at_rest = .false.   !! whether nothing turns, as joints hold
    logical :: is_fixed = .false.     !! whether they hold all that could move
  end type equilibrium_t

contains

  !> Finds the steady states of a machine with mean torques: for each set of joints that can be at rest those in which they are.
  subroutine find_equilibria(machine, t, formulation, equilibria, notes, error)
    type(machine_t), intent(in) :: machine                          !! one lane
    real(wp), intent(in) :: t   !! time at which torques over the time have their values [s]; `t_infinity` after all changes
    class(formulation_t), allocatable, intent(out) :: formulation   !! reduced formulation of the machine with mean torques
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(out) :: notes(:)   !! remarks for the report
    type(error_t), allocatable, intent(out) :: error       !! if no steady state was found
    type(torque_balance_t), target :: balance
    type(error_t), allocatable :: first_error
    type(equilibrium_t), allocatable :: found(:)
    type(string_t), allocatable :: refusals(:)
    logical, allocatable :: sets(:, :)   ! joints at rest, [joints, sets]
    integer :: i
    logical :: is_complete

    call mean_formulation(machine, formulation)
    allocate (notes(0), equilibria(0), refusals(0))
    if (allocated(machine%simplifications)) notes = machine%simplifications
    if (formulation%joints%motions%count /= 0) then
      call raise(error, exit_failed, 'joints move in this machine, which has no steady state but that of means over a turn')
    end if
    if (allocated(error)) return
    call set_up_balance(formulation, t, balance)
    call list_resting_sets(balance, sets, is_complete)
    call move_alloc(balance%formulation, formulation)
    do i = 1, size(sets, 2)
      call find_balances(formulation, t, sets(:, i), found, notes, refusals, error)
      if (allocated(error)) then
        if (error%code /= exit_failed) return
        if (.not. allocated(first_error)) call move_alloc(error, first_error)
        if (allocated(error)) deallocate (error)
      end if
      if (allocated(found)) call add_others(formulation, found, equilibria)
    end do
    if (.not. is_complete) call append(notes, 'more combinations of joints at rest are possible than the ' // &
                                              to_text(size(sets, 2)) // ' that were tried')
    if (size(equilibria) > 0) then
      call complete_states(formulation, t, equilibria, notes)
    else if (size(refusals) > 0) then
      call raise(error, exit_failed, 'no steady state was found: ' // refusals(size(refusals))%text)
      if (allocated(first_error)) error%message = error%message // '; slipping, ' // first_error%message
    else
      call move_alloc(first_error, error)
    end if
  end subroutine find_equilibria

  !> Orders the states by their speeds, and says which joints hold in each.
  subroutine complete_states(formulation, t, equilibria, notes)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), intent(inout) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(equilibrium_t) :: moved
    real(wp) :: speed(size(equilibria))
    type(string_t), allocatable :: listed(:)
    character(len=:), allocatable :: state
    integer :: i, k

    if (formulation%joints%locking == 0) return
    do i = 1, size(equilibria)
      call formulation%observe([t], equilibria(i)%y)
      equilibria(i)%is_at_rest = all(abs(formulation%omega(1, 1:)) <= 0.0_wp)
      speed(i) = formulation%omega(1, maxloc(abs(formulation%omega(1, 1:)), dim=1))
    end do
    do i = 2, size(equilibria)
      do k = i, 2, -1
        if (speed(k - 1) <= speed(k)) exit
        moved = equilibria(k)
        equilibria(k) = equilibria(k - 1)
        equilibria(k - 1) = moved
        speed(k - 1:k) = speed(k:k - 1:-1)
      end do
    end do
    allocate (listed(0))
    state = 'this state'
    do i = 1, size(equilibria)
      if (size(equilibria) > 1) state = 'steady state ' // to_text(i) // ' of ' // to_text(size(equilibria))
      call formulation%observe([t], equilibria(i)%y)
      call describe_joints(formulation, state, listed)
    end do
    notes = [listed, notes]
  end subroutine complete_states

  !> Adds the states of a set of joints at rest, but those that are known from another one.
  subroutine add_others(formulation, found, equilibria)
    class(formulation_t), intent(inout) :: formulation
    type(equilibrium_t), intent(in) :: found(:)
    type(equilibrium_t), allocatable, intent(inout) :: equilibria(:)
    real(wp), parameter :: same = 1.0e-9_wp   ! relative
    real(wp) :: omega(formulation%machine%bodies), other(formulation%machine%bodies)
    integer :: i, k
    logical :: is_known

    do i = 1, size(found)
      call formulation%set_state(found(i)%y)
      omega = formulation%omega(1, 1:)
      is_known = .false.
      do k = 1, size(equilibria)
        call formulation%set_state(equilibria(k)%y)
        other = formulation%omega(1, 1:)
        is_known = is_known .or. (formulation%joints%locking > 0 .and. &
                                  all(abs(other - omega) <= same * maxval(abs([other, omega]))))
      end do
      if (.not. is_known) equilibria = [equilibria, found(i)]
    end do
  end subroutine add_others

  !> Finds the states in which all torques balance, with some joints at rest.
  subroutine find_balances(formulation, t, is_at_rest, equilibria, notes, refusals, error)
    class(formulation_t), allocatable, intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    logical, intent(in) :: is_at_rest(:)   !! [joints]
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(string_t), allocatable, intent(inout) :: refusals(:)   !! what joints at rest cannot hold
    type(error_t), allocatable, intent(out) :: error
    type(torque_balance_t), target :: balance
    type(block_solutions_t), allocatable :: blocks(:)
    type(resting_joints_t) :: resting
    character(len=:), allocatable :: text
    integer :: i

    call set_up_balance(formulation, t, balance, is_at_rest)
    if (balance%motions%contradiction > 0) then
      call raise(error, exit_failed, 'joints cannot be at rest where drives turn them')
      call move_alloc(balance%formulation, formulation)
      return
    end if
    call hold_floating(balance)
    if (balance%joints%count > 0) then   ! dense matrices
      resting = new_resting_joints(balance)
    else
      call balance%differentiate_at_start()
    end if
    call search_balance(balance, blocks)
    do i = 1, size(blocks)
      if (size(blocks(i)%values, 2) > 0) cycle
      call explain_no_balance(balance, blocks(i), text)
      call raise(error, exit_failed, text)
      call move_alloc(balance%formulation, formulation)
      return
    end do
    call combine(balance, resting, blocks, equilibria, notes, refusals, error)
    do i = 1, merge(size(blocks), 0, size(equilibria) > 0)
      if (.not. blocks(i)%is_unloaded .and. balance%floating(blocks(i)%members(1)) == 0) cycle
      call list_moving_bodies(balance, blocks(i)%members, text)
      call append_new(notes, 'nothing drives or brakes ' // text // ': any speed is steady, and the one of the start is kept')
    end do
    call move_alloc(balance%formulation, formulation)
  end subroutine find_balances

  !> The kinetic energies of steady states relative to given speeds [J], [equilibria].
  function distances(formulation, equilibria, omega, counts)
    class(formulation_t), intent(inout) :: formulation
    type(equilibrium_t), intent(in) :: equilibria(:)
    real(wp), intent(in) :: omega(:)             !! [rad/s], [bodies]
    logical, intent(in), optional :: counts(:)   !! bodies whose speeds count, [bodies]; absent: all
    real(wp) :: distances(size(equilibria)), difference(size(omega))
    integer :: i

    do i = 1, size(equilibria)
      call formulation%set_state(equilibria(i)%y)
      difference = formulation%omega(1, 1:) - omega
      if (present(counts)) difference = merge(difference, 0.0_wp, counts)
      distances(i) = formulation%machine%kinetic_energy(1, difference)
    end do
  end function distances

  !> The reduced formulation of a machine with mean torques, without work integrals.
  subroutine mean_formulation(machine, formulation, holds_speed)
    type(machine_t), intent(in) :: machine
    class(formulation_t), allocatable, intent(out) :: formulation
    logical, intent(in), optional :: holds_speed   !! whether governors and supplies leave the speed to who holds it; absent: no
    type(reduced_t), allocatable :: reduced
    logical :: is_held

    is_held = .false.
    if (present(holds_speed)) is_held = holds_speed
    allocate (reduced)
    reduced%machine = machine
    call mean_machine(reduced%machine, is_held)
    call reduced%formulate(.false.)
    call move_alloc(reduced, formulation)
  end subroutine mean_formulation

  !> Replaces the torques of a machine by their means.
  subroutine mean_machine(machine, holds_speed)
    type(machine_t), intent(inout) :: machine
    logical, intent(in) :: holds_speed   !! as in `mean_formulation`
    integer :: b

    call machine%to_mean_torque()
    do b = 1, merge(size(machine%banks), 0, holds_speed)
      call machine%banks(b)%bank%hold_speed()
    end do
  end subroutine mean_machine

  !> Determines the stability of every steady state.
  subroutine find_stability(formulation, t, equilibria)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), intent(inout) :: equilibria(:)
    integer :: i

    do i = 1, size(equilibria)
      call classify(formulation, t, equilibria(i))
    end do
  end subroutine find_stability

  !> Combines the solutions of the blocks in all ways and finds the twists of each combination.
  subroutine combine(balance, resting, blocks, equilibria, notes, refusals, error)
    type(torque_balance_t), intent(inout) :: balance
    type(resting_joints_t), intent(inout) :: resting
    type(block_solutions_t), intent(in) :: blocks(:)
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:), refusals(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: choice(size(blocks)), i, number
    real(wp) :: z(balance%unknowns())
    type(equilibrium_t) :: found
    character(len=:), allocatable :: refusal, speeds
    logical :: is_found

    allocate (equilibria(0))
    choice = 1
    z = 0.0_wp
    do number = 1, most_combinations
      do i = 1, size(blocks)
        z(blocks(i)%members) = blocks(i)%values(:, choice(i))
      end do
      call complete(balance, resting, z, found, refusal, is_found, error)
      if (allocated(error)) return
      if (refusal /= '') then
        if (refusal /= 'none') call append(refusals, refusal)
      else if (is_found) then
        found%free_modes = count(blocks%is_unloaded .or. [(blocks(i)%is_range(choice(i)), i=1, size(blocks))]) &
                           + sum(balance%floating)
        equilibria = [equilibria, found]
        call add_range_notes(balance, blocks, choice, z, notes)
      else
        call describe_speeds(balance, z, [(i, i=1, size(z))], speeds)
        refusal = 'the torques balance at ' // speeds // ', but no twists of the couplings were found that carry them'
        call append(refusals, refusal)
        call append_new(notes, refusal)
      end if
      if (.not. advance(blocks, choice)) exit
    end do
  end subroutine combine

  !> Adds notes about other steady speeds and twists beside a solution.
  subroutine add_range_notes(balance, blocks, choice, z, notes)
    type(torque_balance_t), intent(in) :: balance   !! evaluated at the solution, with its twists
    type(block_solutions_t), intent(in) :: blocks(:)
    integer, intent(in) :: choice(:)   !! number of the solution of each block
    real(wp), intent(in) :: z(:)       !! the solution, [unknowns]
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, allocatable :: undetermined(:)
    character(len=:), allocatable :: bodies, speeds
    integer :: i

    do i = 1, size(blocks)
      if (.not. blocks(i)%is_range(choice(i))) cycle
      call list_moving_bodies(balance, blocks(i)%members, bodies)
      call describe_speeds(balance, z, blocks(i)%members, speeds)
      call append_new(notes, 'the torques on ' // bodies // ' balance over a range of speeds: any of them is steady, and of ' // &
                             'those that were found the one nearest to the start is kept, ' // speeds)
    end do
    allocate (undetermined, source=undetermined_elements(balance))
    if (size(undetermined) == 0) return
    call append_new(notes, 'inside an open gap, or where a law is level, any twist is steady: of ' // &
                           joined(element_names(balance%formulation%machine, undetermined), ', ', most_names) // &
                           ' one near the start is kept')
  end subroutine add_range_notes

  !> Advances to the next combination; false after the last one.
  logical function advance(blocks, choice)
    type(block_solutions_t), intent(in) :: blocks(:)
    integer, intent(inout) :: choice(:)   !! number of the solution of each block
    integer :: i

    advance = .true.
    do i = 1, size(blocks)
      choice(i) = choice(i) + 1
      if (choice(i) <= size(blocks(i)%values, 2)) return
      choice(i) = 1
    end do
    advance = .false.
  end function advance

  !> The state with these speeds and internal states, the moments of joints at rest, and the twists that balance the torques.
  subroutine complete(balance, resting, z, equilibrium, refusal, is_found, error)
    type(torque_balance_t), intent(inout) :: balance
    type(resting_joints_t), intent(inout) :: resting
    real(wp), intent(inout) :: z(:)   !! [unknowns]
    type(equilibrium_t), intent(out) :: equilibrium
    character(len=:), allocatable, intent(out) :: refusal   !! why joints do not allow it, 'none' if that is no news; ''
    logical, intent(out) :: is_found   !! whether such twists exist
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: difference(balance%joints%teeth%count), q(balance%coordinates)
    type(twist_problem_t) :: twists
    real(wp), parameter :: tolerance = 1.0e-11_wp   ! of torques of teeth, relative
    integer :: trial

    refusal = ''
    is_found = .false.
    balance%joints%offset = 0.0_wp
    do trial = 1, most_trials
      q = 0.0_wp
      call balance%evaluate(z)
      if (slips_where_it_cannot(balance)) then
        refusal = 'none'
        return
      end if
      if (balance%joints%count > 0) call resting%hold(balance)
      if (resting%overloaded > 0) then
        call describe_overload(balance, resting, refusal)
        return
      end if
      call find_twists(twists, balance, q, is_found, error)
      call balance%set_state(z)
      balance%y(1, balance%coordinates + 1:2 * balance%coordinates) = q
      if (.not. is_found .or. allocated(error) .or. size(difference) == 0) exit
      difference = loads_in(balance, balance%y) - balance%joints%load
      where (balance%joints%is_at_rest(balance%joints%teeth%joint)) difference = 0.0_wp
      if (all(abs(difference) <= tolerance * maxval(abs(balance%joints%load)))) exit
      balance%joints%offset = balance%joints%offset + difference
      call balance%evaluate(z)
      call improve(balance, z)
    end do
    equilibrium%y = balance%y
  end subroutine complete

  !> The torques of teeth in a state [N m], [losses].
  function loads_in(balance, y) result(load)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: y(:, :)   !! [1, states]
    real(wp) :: load(balance%joints%teeth%count)
    real(wp), allocatable :: state(:, :)

    allocate (state, source=y)
    call balance%formulation%observe(balance%t, state)
    load = balance%formulation%joints%teeth%load
  end function loads_in

  !> Solves for the unknowns again, from those before a correction.
  subroutine improve(balance, z)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(inout) :: z(:)   !! [unknowns]
    type(block_solutions_t) :: block
    integer :: i

    if (size(z) == 0) return
    block%members = [(i, i=1, size(z))]
    allocate (block%values(size(z), 0), block%is_range(0))
    call solve_by_newton(balance, z, block)
  end subroutine improve

  !> Determines the stability by the eigenvalues of the linearised machine, unless it has too many states.
  subroutine classify(formulation, t, equilibrium)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), intent(inout) :: equilibrium
    real(wp), parameter :: rounding = 1.0e-10_wp   ! as a share of the largest eigenvalue
    type(linearisation_t) :: linear
    type(error_t), allocatable :: error
    type(eigenpairs_t) :: pairs
    complex(wp), allocatable :: values(:)

    equilibrium%stability = 'not determined'
    if (formulation%states > most_states) return
    call linearise(formulation, t, equilibrium%y, linear, error)
    if (allocated(error)) return
    equilibrium%is_fixed = size(linear%matrix) == 0
    if (equilibrium%is_fixed) then
      equilibrium%stability = 'stable'
      return
    end if
    call find_eigenpairs(linear, pairs, error)
    if (allocated(error)) return
    values = [pairs%value, conjg(pack(pairs%value, aimag(pairs%value) > 0))]
    equilibrium%growth = growth_rate(values, equilibrium%free_modes)
    if (equilibrium%growth < -rounding * maxval(abs(values))) then
      equilibrium%stability = 'stable'
    else if (equilibrium%growth > rounding * maxval(abs(values))) then
      equilibrium%stability = 'unstable'
    else
      equilibrium%stability = 'neutral'
    end if
  end subroutine classify

  !> The largest real part of the eigenvalues, without the smallest ones, which belong to free rigid motions.
  pure real(wp) function growth_rate(values, free_modes)
    complex(wp), intent(in) :: values(:)   !! eigenvalues [1/s]
    integer, intent(in) :: free_modes      !! number of eigenvalues that are left out
    logical :: counts(size(values))
    integer :: i

    counts = .true.
    do i = 1, free_modes
      counts(minloc(abs(values), dim=1, mask=counts)) = .false.
    end do
    growth_rate = 0.0_wp
    if (any(counts)) growth_rate = maxval(real(values, wp), mask=counts)
  end function growth_rate

  !> The steady state with the least kinetic energy relative to the start: among the stable ones; if there are none, among those
  !> that are not unstable. If the start says nothing, the one with the most kinetic energy.
  integer function nearest_equilibrium(formulation, equilibria, counts) result(nearest)
    class(formulation_t), intent(inout) :: formulation
    type(equilibrium_t), intent(in) :: equilibria(:)
    logical, intent(in), optional :: counts(:)   !! bodies whose start speeds count, [bodies]; absent: all
    real(wp) :: distance(size(equilibria)), start(formulation%machine%bodies)
    logical :: is_candidate(size(equilibria)), is_start(formulation%machine%bodies)

    call formulation%set_state(formulation%start())
    start = formulation%omega(1, 1:)
    is_start = .true.
    if (present(counts)) is_start = counts
    distance = distances(formulation, equilibria, start, is_start)
    if (.not. any(is_start)) distance = -distances(formulation, equilibria, 0.0_wp * start)
    is_candidate = equilibria%stability == 'stable'
    if (.not. any(is_candidate)) is_candidate = equilibria%stability /= 'unstable'
    nearest = minloc(distance, dim=1, mask=is_candidate .or. .not. any(is_candidate))
  end function nearest_equilibrium

end module nocdyn_equilibrium
