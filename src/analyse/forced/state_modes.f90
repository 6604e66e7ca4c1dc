!> The oscillating modes of a machine at one steady state of a response: all of a small machine, by dense matrices; those that are
!> chosen of a large one, by band matrices.
!>
!> Chosen are modes at the first state. At others these are found again by their shapes, among more neighbours than there were.
module nocdyn_state_modes
  use nocdyn_band_pencil, only: band_pencil_t, new_band_pencil
  use nocdyn_damped_bands, only: damped_modes_t, find_damped
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_mode_links, only: find_links
  use nocdyn_dense_pairs, only: find_pairs
  use nocdyn_mode_pairs, only: keep_pairs, mode_pairs_t
  use nocdyn_text, only: to_text
  use nocdyn_undamped_bands, only: band_modes
  use nocdyn_units, only: from_si, in_si, unit_hz
  use nocdyn_wanted_modes, only: choose_numbers, find_covering, find_obstacle, modes_choice_t, wanted_modes_t
  implicit none (type, external)
  private

  public :: find_pairs_at, has_choice

  integer, parameter, public :: most_coordinates = 600   !! of a machine all of whose modes are computed at every speed
  integer, parameter :: most_dense = 200                 ! of a machine whose chosen modes are taken from all
  integer, parameter :: no_elements(0) = [integer ::]

contains

  !> Whether not all modes are wanted.
  pure logical function has_choice(choice)
    type(modes_choice_t), intent(in) :: choice

    has_choice = choice%count > 0 .or. choice%has_range
  end function has_choice

  !> Finds the modes at a steady state.
  subroutine find_pairs_at(response, state, pairs, error, known)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(mode_pairs_t), intent(out) :: pairs
    type(error_t), allocatable, intent(out) :: error    !! if LAPACK does not converge, or a large machine needs dense matrices
    type(mode_pairs_t), intent(in), optional :: known   !! the modes at another state: of those that are chosen, these
    character(len=:), allocatable :: obstacle

    obstacle = 'it is small'
    if (has_choice(response%choice) .and. response%matrix%coordinates > most_dense) then
      if (present(known)) then
        if (known%numbers(2) > 0) call find_again(response, state, known, pairs, obstacle, error)
      else
        call find_first(response, state, pairs, obstacle, error)
      end if
      if (allocated(error)) return
      if (obstacle /= '' .and. response%matrix%coordinates > most_coordinates) then
        call raise(error, exit_input, 'the modes of this machine need dense matrices, because ' // obstacle // &
                   ', and are found so for at most ' // to_text(most_coordinates) // ' degrees of freedom; it has ' // &
                   to_text(response%matrix%coordinates))
        return
      end if
    end if
    if (obstacle /= '') then
      associate (points => response%points)
        call find_pairs(response%machine, response%matrix, state%slopes, maxval([0.0_wp, points(size(points))%frequency]), &
                        pairs, error, known)
      end associate
      if (allocated(error)) return
      if (has_choice(response%choice)) call keep_chosen(response, pairs, known)
    end if
    pairs%speed = state%speed
  end subroutine find_pairs_at

  !> Keeps the chosen ones of all modes: at the first state the lowest or the ones in the range, at others the known ones.
  subroutine keep_chosen(response, pairs, known)
    type(forced_response_t), intent(in) :: response
    type(mode_pairs_t), intent(inout) :: pairs          !! ascending by frequency
    type(mode_pairs_t), intent(in), optional :: known
    integer, allocatable :: kept(:)
    integer :: m
    logical :: are_clear
    real(wp) :: ends(2)

    if (present(known)) then
      call find_links(response%machine, known, pairs, kept, are_clear)
      kept = pack(kept, kept > 0)
    else if (response%choice%has_range) then
      ends = in_si(response%choice%range_hz, unit_hz)
      kept = pack([(m, m=1, size(pairs%value))], aimag(pairs%value) >= ends(1) .and. aimag(pairs%value) <= ends(2))
      pairs%below = count(aimag(pairs%value) < ends(1))
    else
      kept = [(m, m=1, min(response%choice%count, size(pairs%value)))]
    end if
    call keep_pairs(kept, pairs)
  end subroutine keep_chosen

  !> Finds the chosen modes at the first state by band matrices.
  subroutine find_first(response, state, pairs, obstacle, error)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(mode_pairs_t), intent(inout) :: pairs
    character(len=:), allocatable, intent(out) :: obstacle   !! why these are not certain, '' if they are
    type(error_t), allocatable, intent(out) :: error
    type(band_pencil_t) :: pencil
    type(wanted_modes_t) :: found
    integer :: wanted(2)

    obstacle = ''
    associate (machine => response%machine, choice => response%choice)
      call new_band_pencil(machine, response%matrix%incidence, state%slopes%stiffness, no_elements, pencil, error)
      if (allocated(error)) return
      if (pencil%rigid == pencil%modes) obstacle = 'nothing of it is elastic'
      if (obstacle /= '') return
      call choose_numbers(pencil, choice, wanted, error)
      if (pencil%negative > 0) wanted(1) = 1   ! they tell whether the state stays
      if (.not. allocated(error)) call find_covering(machine, pencil, state%slopes, no_elements, choice, wanted, found, error)
      if (allocated(error)) return
      call find_obstacle(machine, found%damped, found%chosen, .false., obstacle)
      if (obstacle /= '') return
      call set_pairs(response, found%damped, found%linear, found%first, pairs)
      pairs%below = max(0, wanted(1) - 1 - pencil%rigid)
    end associate
    call keep_pairs(pack(found%chosen, aimag(pairs%value(found%chosen)) > 0), pairs)
  end subroutine find_first

  !> Finds known modes at another state by band matrices, and the ones between and beside them.
  subroutine find_again(response, state, known, pairs, obstacle, error)
    type(forced_response_t), intent(in) :: response
    type(held_state_t), intent(in) :: state
    type(mode_pairs_t), intent(in) :: known
    type(mode_pairs_t), intent(inout) :: pairs
    character(len=:), allocatable, intent(out) :: obstacle   !! why these are not certain, '' if they are
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: most_rounds = 3
    integer :: first, last, m, margin, round
    integer, allocatable :: link(:)
    logical :: are_clear
    type(band_pencil_t) :: pencil
    type(damped_modes_t) :: damped
    type(linearisation_t) :: linear

    obstacle = ''
    associate (machine => response%machine)
      call new_band_pencil(machine, response%matrix%incidence, state%slopes%stiffness, no_elements, pencil, error)
      if (allocated(error)) return
      margin = 0
      do round = 1, most_rounds
        first = max(1, known%numbers(1) - margin)
        last = min(pencil%modes, known%numbers(2) + margin)
        if (margin == 0 .and. all(abs(known%slopes%stiffness - state%slopes%stiffness) <= 0)) then
          linear = known%linear
        else
          call band_modes(pencil, first, last, no_elements, linear, error)
        end if
        if (.not. allocated(error)) call find_damped(machine, pencil, state%slopes, linear, damped, error)
        if (allocated(error)) return
        call set_pairs(response, damped, linear, first, pairs)
        call keep_pairs(pack([(m, m=1, size(pairs%value))], aimag(pairs%value) > 0 .and. damped%is_exact), pairs)
        call find_links(machine, known, pairs, link, are_clear)
        if (all(link > 0) .or. (first == 1 .and. last == pencil%modes)) exit
        margin = 2 * margin + size(known%linear%natural)
      end do
    end associate
    call keep_pairs(pack(link, link > 0), pairs)
  end subroutine find_again

  !> All modes that are found.
  subroutine set_pairs(response, damped, linear, first, pairs)
    type(forced_response_t), intent(in) :: response
    type(damped_modes_t), intent(in) :: damped
    type(linearisation_t), intent(in) :: linear   !! the undamped modes
    integer, intent(in) :: first                  !! number of the first of these
    type(mode_pairs_t), intent(out) :: pairs
    real(wp), parameter :: least = 0.05_wp        ! of the kinetic energy
    integer :: m

    pairs = damped%pairs
    pairs%linear = linear
    pairs%numbers = [first, first + size(linear%natural) - 1]
    pairs%undamped = linear%natural(damped%undamped)
    ! the growth of what does not oscillate, unless it is a motion of the whole machine, which is held
    pairs%divergence = min(0.0_wp, minval(linear%natural))
    do m = 1, size(pairs%value)
      associate (value => pairs%value(m), twist => pairs%twist(:, m), angle => pairs%angle(:, m))
        if (aimag(value) > 0 .or. .not. real(value, wp) > 0 .or. pairs%internal(m) > 0) cycle
        if (sum(abs(pairs%slopes%stiffness) * abs(twist)**2) <= least * real(value, wp)**2 * &
            sum(response%machine%inertia(1, :) * abs(angle)**2)) cycle
        pairs%divergence = min(pairs%divergence, -real(value, wp))
      end associate
    end do
  end subroutine set_pairs

end module nocdyn_state_modes
