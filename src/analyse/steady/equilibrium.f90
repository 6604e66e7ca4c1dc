!> Steady states of a machine: constant speeds, mean torques, constant twists.
module nocdyn_equilibrium
  use nocdyn_balance_search, only: search_balance
  use nocdyn_block_solutions, only: block_solutions_t
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvectors
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_static_twists, only: find_twists, undetermined_elements
  use nocdyn_text, only: append, joined, quoted, rounded_text, selected, string_t
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  implicit none (type, external)
  private

  public :: find_equilibria, find_stability, mean_formulation, nearest_equilibrium

  real(wp), parameter, public :: t_infinity = 1.0e30_wp   !! a time after all transients of the excitations [s]

  integer, parameter :: most_combinations = 64   ! of the solutions of independent parts of a machine
  integer, parameter :: most_states = 1000       ! up to which eigenvalues are computed, which takes some seconds
  integer, parameter :: most_names = 5           ! of bodies in a message
  integer, parameter :: digits = 6

  !> A steady state and its stability.
  type, public :: equilibrium_t
    real(wp), allocatable :: y(:, :)   !! state of the reduced formulation without work integrals, [1, states]
    character(len=14) :: stability = 'not determined'   !! stable, unstable, neutral, not determined
    real(wp) :: growth = 0.0_wp   !! largest real part of the eigenvalues without those of free rigid motions [1/s]
    integer :: free_modes = 0   !! number of rigid motions without torques, or in a range of steady speeds
  end type equilibrium_t

contains

  !> Finds the steady states of a machine with mean torques.
  subroutine find_equilibria(machine, formulation, equilibria, notes, error)
    type(machine_t), intent(in) :: machine                          !! one lane
    class(formulation_t), allocatable, intent(out) :: formulation   !! reduced formulation of the machine with mean torques
    type(equilibrium_t), allocatable, intent(out) :: equilibria(:)
    type(string_t), allocatable, intent(out) :: notes(:)   !! remarks for the report
    type(error_t), allocatable, intent(out) :: error       !! if no steady state was found
    type(torque_balance_t) :: balance
    type(block_solutions_t), allocatable :: blocks(:)
    integer :: i

    call mean_formulation(machine, formulation)
    call set_up_balance(formulation, t_infinity, balance)
    call search_balance(balance, blocks)
    allocate (notes(0))
    do i = 1, size(blocks)
      if (size(blocks(i)%values, 2) > 0) cycle
      call raise(error, exit_failed, no_balance_message(balance, blocks(i)))
      return
    end do
    do i = 1, size(blocks)
      if (blocks(i)%is_unloaded) call append(notes, 'nothing drives or brakes ' // moving_bodies(balance, blocks(i)%members) // &
                                                ': any speed is steady, and the one of the start is kept')
    end do
    call combine(balance, blocks, equilibria, notes, error)
    call move_alloc(balance%formulation, formulation)
  end subroutine find_equilibria

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
  subroutine find_stability(formulation, equilibria)
    class(formulation_t), intent(inout) :: formulation
    type(equilibrium_t), intent(inout) :: equilibria(:)
    integer :: i

    do i = 1, size(equilibria)
      call classify(formulation, equilibria(i))
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
        call append(notes, 'the torques balance at ' // speed_text(balance, z, [(i, i=1, size(z))]) // &
                           ', but no twists of the couplings carry them')
      end if
      if (.not. advance(blocks, choice)) exit
    end do
    if (size(equilibria) > 0) return
    call raise(error, exit_failed, 'there is no steady state: ' // notes(size(notes))%text)
  end subroutine combine

  !> Adds notes about other steady speeds and twists beside a solution.
  subroutine add_range_notes(balance, blocks, choice, z, notes)
    type(torque_balance_t), intent(in) :: balance   !! evaluated at the solution, with its twists
    type(block_solutions_t), intent(in) :: blocks(:)
    integer, intent(in) :: choice(:)   !! number of the solution of each block
    real(wp), intent(in) :: z(:)       !! the solution, [unknowns]
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, allocatable :: undetermined(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    do i = 1, size(blocks)
      if (.not. blocks(i)%is_range(choice(i))) cycle
      call append_new(notes, 'the torques on ' // moving_bodies(balance, blocks(i)%members) // ' balance over a range of ' // &
                             'speeds: any of them is steady, and of those that were found the one nearest to the start is ' // &
                             'kept, ' // speed_text(balance, z, blocks(i)%members))
    end do
    allocate (undetermined, source=undetermined_elements(balance))
    if (size(undetermined) == 0) return
    allocate (names(size(undetermined)))
    do i = 1, size(undetermined)
      names(i)%text = balance%formulation%machine%element_name(undetermined(i))
    end do
    call append_new(notes, 'inside an open gap, or where a law is level, any twist is steady: of ' // &
                           joined(names, ', ', most_names) // &
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
  subroutine classify(formulation, equilibrium)
    class(formulation_t), intent(inout) :: formulation
    type(equilibrium_t), intent(inout) :: equilibrium
    real(wp), parameter :: rounding = 1.0e-10_wp   ! as a share of the largest eigenvalue
    type(linearisation_t) :: linear
    type(error_t), allocatable :: error
    complex(wp), allocatable :: values(:), vectors(:, :)
    logical :: has_failed

    equilibrium%stability = 'not determined'
    if (formulation%states > most_states) return
    call linearise(formulation, t_infinity, equilibrium%y, linear, error)
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

  !> The steady state with the least kinetic energy relative to the start; among the stable ones, if there are any.
  integer function nearest_equilibrium(formulation, equilibria) result(nearest)
    class(formulation_t), intent(inout) :: formulation
    type(equilibrium_t), intent(in) :: equilibria(:)
    real(wp) :: distances(size(equilibria)), start(formulation%machine%bodies)
    logical :: is_stable(size(equilibria))
    integer :: i

    call formulation%set_state(formulation%start())
    start = formulation%omega(1, 1:)
    do i = 1, size(equilibria)
      call formulation%set_state(equilibria(i)%y)
      distances(i) = formulation%machine%kinetic_energy(1, formulation%omega(1, 1:) - start)
    end do
    is_stable = equilibria%stability == 'stable'
    nearest = minloc(distances, dim=1, mask=is_stable .or. .not. any(is_stable))
  end function nearest_equilibrium

  !> Message about a block without solution.
  function no_balance_message(balance, block) result(sentence)
    type(torque_balance_t), intent(inout) :: balance
    type(block_solutions_t), intent(in) :: block
    character(len=:), allocatable :: sentence
    real(wp) :: z(balance%unknowns()), slopes(balance%unknowns(), balance%unknowns())

    sentence = 'there is no steady state: nothing balances '
    if (any(block%members > balance%motions%freedoms()) .or. size(block%members) > 1) then
      sentence = sentence // 'the torques on ' // moving_bodies(balance, block%members) // &
                 '; Newton''s method found no solution from any start'
      return
    end if
    z = balance%start()
    call balance%evaluate(z)
    call balance%differentiate(slopes)
    associate (member => block%members(1))
      if (abs(slopes(member, member)) <= 0.0_wp) then
        sentence = sentence // rounded_text(block%least_torque, digits) // ' N m on ' // &
                   moving_bodies(balance, block%members) // ' at any speed; a load is missing, or a motor whose torque falls'
      else
        sentence = sentence // 'the torques on ' // moving_bodies(balance, block%members) // ' at any speed; at least ' // &
                   rounded_text(block%least_torque, digits) // ' N m are left over, at ' // &
                   rounded_text(block%least_speed, digits) // ' rad/s of ' // quoted(body_of(balance, member))
      end if
    end associate
  end function no_balance_message

  !> Name of the independent body of a rigid motion.
  function body_of(balance, freedom) result(name)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: freedom
    character(len=:), allocatable :: name

    associate (machine => balance%formulation%machine)
      name = machine%names(machine%coordinates%body(balance%motions%free(freedom)))%text
    end associate
  end function body_of

  !> Names of the bodies that turn in some rigid motions.
  function moving_bodies(balance, members) result(text)
    type(torque_balance_t), intent(in) :: balance
    integer, intent(in) :: members(:)   !! unknowns; those that are internal states are ignored
    character(len=:), allocatable :: text
    real(wp) :: unit(balance%motions%freedoms())
    logical :: moves(balance%formulation%machine%bodies)
    integer, allocatable :: bodies(:)
    integer :: b, i

    moves = .false.
    do i = 1, size(members)
      if (members(i) > size(unit)) cycle
      unit = 0.0_wp
      unit(members(i)) = 1.0_wp
      moves = moves .or. abs(balance%body_speeds(unit)) > 0.0_wp
    end do
    bodies = pack([(b, b=1, size(moves))], moves)
    associate (names => balance%formulation%machine%names)
      text = joined(selected(names, bodies), ', ', most_names)
    end associate
  end function moving_bodies

  !> Speeds of rigid motions as text, such as "12.5 rad/s of 'motor'".
  function speed_text(balance, z, members) result(text)
    type(torque_balance_t), intent(in) :: balance
    real(wp), intent(in) :: z(:)        !! [unknowns]
    integer, intent(in) :: members(:)   !! unknowns; those that are internal states are ignored
    character(len=:), allocatable :: text
    integer, allocatable :: freedoms(:)
    integer :: i

    text = ''
    freedoms = pack(members, members <= balance%motions%freedoms())
    do i = 1, min(size(freedoms), most_names)
      if (i > 1) text = text // ', '
      text = text // rounded_text(z(freedoms(i)), digits) // ' rad/s of ' // quoted(body_of(balance, freedoms(i)))
    end do
    if (text == '') text = 'rest'
  end function speed_text

end module nocdyn_equilibrium
