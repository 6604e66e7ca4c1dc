!> Steady states of a machine: constant speeds, mean torques, constant twists.
module nocdyn_equilibrium
  use nocdyn_balance_search, only: search_balance
  use nocdyn_balance_texts, only: describe_speeds, describe_state_speeds, explain_no_balance, list_moving_bodies
  use nocdyn_block_solutions, only: block_solutions_t
  use nocdyn_element_sets, only: element_names
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvectors
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_machine, only: machine_t
  use nocdyn_overloads, only: describe_overload
  use nocdyn_reduced, only: reduced_t
  use nocdyn_static_twists, only: find_twists, undetermined_elements
  use nocdyn_steady_losses, only: describe_losses, new_steady_losses, steady_losses_t, tell_losses
  use nocdyn_text, only: append, joined, string_t
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  implicit none (type, external)
  private

  public :: distances, find_equilibria, find_stability, mean_formulation, nearest_equilibrium

  real(wp), parameter, public :: t_infinity = 1.0e30_wp   !! a time after all transients of the excitations [s]

  integer, parameter :: most_combinations = 64   ! of the solutions of independent parts of a machine
  integer, parameter :: most_states = 1000       ! up to which eigenvalues are computed, which takes some seconds
  integer, parameter :: most_names = 5           ! of bodies in a message
  integer, parameter :: most_trials = 50         ! of moments of losses

  !> A steady state and its stability.
  type, public :: equilibrium_t
    real(wp), allocatable :: y(:, :)   !! state of the reduced formulation without work integrals, [1, states]
    real(wp), allocatable :: losses(:) !! moments of the teeth with losses, for `tell_losses` [N m]
    character(len=14) :: stability = 'not determined'   !! stable, unstable, neutral, not determined
    real(wp) :: growth = 0.0_wp   !! largest real part of the eigenvalues without those of free rigid motions [1/s]
    integer :: free_modes = 0   !! number of rigid motions without torques, or in a range of steady speeds
  end type equilibrium_t

contains

  !> Finds the steady states of a machine with mean torques.
  subroutine find_equilibria(machine, t, formulation, equilibria, notes, error)
    type(machine_t), intent(in) :: machine                          !! one lane
    real(wp), intent(in) :: t   !! time at which torques over the time have their values [s]; `t_infinity` after all changes
    class(formulation_t), allocatable, intent(out) :: formulation   !! reduced formulation of the machine with mean torques
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(out) :: notes(:)   !! remarks for the report
    type(error_t), allocatable, intent(out) :: error       !! if no steady state was found
    character(len=:), allocatable :: lossy

    call mean_formulation(machine, formulation)
    allocate (notes(0))
    if (allocated(machine%simplifications)) notes = machine%simplifications
    call find_balances(formulation, t, equilibria, notes, error)
    if (allocated(error)) return
    call describe_losses(machine, lossy)
    if (lossy /= '') call append(notes, 'the moments of the losses of ' // lossy // ' are taken as constant in vibrations')
    call add_losses(formulation, t, equilibria, notes, error)
    if (.not. allocated(error)) call drop_overloaded(formulation, t, equilibria, notes, error)
  end subroutine find_equilibria

  !> Finds the states in which all torques balance, with given moments of losses.
  subroutine find_balances(formulation, t, equilibria, notes, error)
    class(formulation_t), allocatable, intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(torque_balance_t), target :: balance
    type(block_solutions_t), allocatable :: blocks(:)
    character(len=:), allocatable :: text
    integer :: i

    call set_up_balance(formulation, t, balance)
    call search_balance(balance, blocks)
    do i = 1, size(blocks)
      if (size(blocks(i)%values, 2) > 0) cycle
      call explain_no_balance(balance, blocks(i), text)
      call raise(error, exit_failed, text)
      return
    end do
    do i = 1, size(blocks)
      if (.not. blocks(i)%is_unloaded) cycle
      call list_moving_bodies(balance, blocks(i)%members, text)
      call append(notes, 'nothing drives or brakes ' // text // ': any speed is steady, and the one of the start is kept')
    end do
    call combine(balance, blocks, equilibria, notes, error)
    call move_alloc(balance%formulation, formulation)
  end subroutine find_balances

  !> Adds the losses of teeth to steady states without them. States in which they do not let the machine turn are dropped.
  subroutine add_losses(formulation, t, equilibria, notes, error)
    class(formulation_t), allocatable, intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), allocatable, intent(inout) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: lossy, speeds
    logical :: turns(size(equilibria))
    integer :: i

    do i = 1, size(equilibria)
      call balance_losses(formulation, t, equilibria(i), turns(i))
      if (turns(i)) cycle
      call formulation%set_state(equilibria(i)%y)
      call describe_state_speeds(formulation, speeds)
      call append(notes, 'of the steady state without losses at ' // speeds // ' there is none with them')
    end do
    equilibria = pack(equilibria, turns)
    if (size(equilibria) > 0) return
    call describe_losses(formulation%machine, lossy)
    call raise(error, exit_failed, 'no steady state was found with the losses of ' // lossy // &
               '; teeth that lock themselves may stand still')
  end subroutine add_losses

  !> Finds the moments of the losses in a steady state, and the state with them.
  subroutine balance_losses(formulation, t, equilibrium, is_solved)
    class(formulation_t), allocatable, intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), intent(inout) :: equilibrium   !! without losses at first
    logical, intent(out) :: is_solved
    type(equilibrium_t), allocatable :: found(:)
    type(error_t), allocatable :: error
    type(steady_losses_t) :: losses
    type(string_t), allocatable :: notes(:)   ! those of the state without losses stand
    real(wp) :: omega(formulation%machine%bodies)
    integer :: i

    is_solved = .true.
    losses = new_steady_losses(formulation%machine)
    allocate (equilibrium%losses, source=losses%moment)
    if (losses%count == 0) return
    do i = 1, most_trials
      call tell_losses(formulation%machine, equilibrium%losses)
      call losses%improve(formulation, t, equilibrium%y, is_solved)
      if (is_solved) return
      call tell_losses(formulation%machine, losses%moment)
      allocate (notes(0))
      call find_balances(formulation, t, found, notes, error)
      if (allocated(error)) exit
      call formulation%set_state(equilibrium%y)
      omega = formulation%omega(1, 1:)
      equilibrium%y = found(minloc(distances(formulation, found, omega), dim=1))%y
      equilibrium%losses = losses%moment
      deallocate (notes)
    end do
    is_solved = .false.
  end subroutine balance_losses

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

  !> Drops states in which joints that are taken as locked would slip.
  subroutine drop_overloaded(formulation, t, equilibria, notes, error)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), allocatable, intent(inout) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text
    logical :: holds(size(equilibria))
    integer :: i

    do i = 1, size(equilibria)
      call tell_losses(formulation%machine, equilibria(i)%losses)
      call describe_overload(formulation, t, equilibria(i)%y, text)
      holds(i) = text == ''
      if (.not. holds(i)) call append(notes, text)
    end do
    equilibria = pack(equilibria, holds)
    if (size(equilibria) == 0) call raise(error, exit_failed, 'no steady state was found: ' // text)
  end subroutine drop_overloaded

  !> The reduced formulation of a machine with mean torques, without work integrals.
  subroutine mean_formulation(machine, formulation)
    type(machine_t), intent(in) :: machine
    class(formulation_t), allocatable, intent(out) :: formulation
    type(reduced_t), allocatable :: reduced

    allocate (reduced)
    reduced%machine = machine
    call reduced%machine%to_mean_torque()
    call reduced%formulate(.false., .false.)
    call move_alloc(reduced, formulation)
  end subroutine mean_formulation

  !> Determines the stability of every steady state.
  subroutine find_stability(formulation, t, equilibria)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), intent(inout) :: equilibria(:)
    integer :: i

    do i = 1, size(equilibria)
      call tell_losses(formulation%machine, equilibria(i)%losses)
      call classify(formulation, t, equilibria(i))
    end do
  end subroutine find_stability

  !> Combines the solutions of the blocks in all ways and finds the twists of each combination.
  subroutine combine(balance, blocks, equilibria, notes, error)
    type(torque_balance_t), intent(inout) :: balance
    type(block_solutions_t), intent(in) :: blocks(:)
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: choice(size(blocks)), i, number
    real(wp) :: z(balance%unknowns())
    type(equilibrium_t) :: found
    character(len=:), allocatable :: speeds
    logical :: is_found

    allocate (equilibria(0))
    choice = 1
    z = 0.0_wp
    do number = 1, most_combinations
      do i = 1, size(blocks)
        z(blocks(i)%members) = blocks(i)%values(:, choice(i))
      end do
      call complete(balance, z, found, is_found, error)
      if (allocated(error)) return
      if (is_found) then
        found%free_modes = count(blocks%is_unloaded .or. [(blocks(i)%is_range(choice(i)), i=1, size(blocks))])
        equilibria = [equilibria, found]
        call add_range_notes(balance, blocks, choice, z, notes)
      else
        call describe_speeds(balance, z, [(i, i=1, size(z))], speeds)
        call append(notes, 'the torques balance at ' // speeds // ', but no twists of the couplings were found that carry them')
      end if
      if (.not. advance(blocks, choice)) exit
    end do
    if (size(equilibria) > 0) return
    call raise(error, exit_failed, 'no steady state was found: ' // notes(size(notes))%text)
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

  !> Appends a note, unless the list has it.
  subroutine append_new(notes, text)
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=*), intent(in) :: text
    integer :: i

    if (.not. any([(notes(i)%text == text, i=1, size(notes))])) call append(notes, text)
  end subroutine append_new

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

  !> The state with these speeds and internal states, and with the twists that balance the torques.
  subroutine complete(balance, z, equilibrium, is_found, error)
    type(torque_balance_t), intent(inout) :: balance
    real(wp), intent(in) :: z(:)   !! [unknowns]
    type(equilibrium_t), intent(out) :: equilibrium
    logical, intent(out) :: is_found   !! whether such twists exist
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: q(balance%coordinates)

    q = 0.0_wp
    call balance%evaluate(z)
    call find_twists(balance, q, is_found, error)
    call balance%set_state(z)
    balance%y(1, size(q) + 1:2 * size(q)) = q
    equilibrium%y = balance%y
  end subroutine complete

  !> Determines the stability by the eigenvalues of the linearised machine, unless it has too many states.
  subroutine classify(formulation, t, equilibrium)
    class(formulation_t), intent(inout) :: formulation
    real(wp), intent(in) :: t   !! [s]
    type(equilibrium_t), intent(inout) :: equilibrium
    real(wp), parameter :: rounding = 1.0e-10_wp   ! as a share of the largest eigenvalue
    type(linearisation_t) :: linear
    type(error_t), allocatable :: error
    complex(wp), allocatable :: values(:), vectors(:, :)
    logical :: has_failed

    equilibrium%stability = 'not determined'
    if (formulation%states > most_states) return
    call linearise(formulation, t, equilibrium%y, linear, error)
    if (allocated(error)) return
    allocate (values(size(linear%matrix, 1)), vectors(size(linear%matrix, 1), size(linear%matrix, 1)))
    call eigenvectors(linear%matrix, values, vectors, has_failed)
    if (has_failed) return
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
