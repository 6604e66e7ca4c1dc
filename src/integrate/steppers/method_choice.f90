!> Which kind of step a lane takes: by a Taylor series, explicit or implicit.
!>
!> The measure is the cost of a second of the motion: the cost of a step (`nocdyn_step_costs`) over the step size. Another kind
!> is tried where it may cost less: with the step at which it would, from the state that the lane has reached. If its error
!> estimate allows longer steps, the lane keeps it; if not, the lane goes on as before, and the next trial is made after twice as
!> many steps. The step by a series is known without a trial, from the series alone.
!>
!> Implicit steps are tried where |h lambda| of the other kinds comes near the limit of their stability, and seldom where it does
!> not, for estimates can be too low. They are given up where that limit would allow steps that cost less. All depends on the lane
!> alone.
module nocdyn_method_choice
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: restart_choice, count_steps, count_attempt, wants_trial, begin_trial, break_even, &
    needed_step, note_stiffness, rate, settle

  integer, parameter, public :: by_series = 1, by_stages = 2, by_systems = 3   !! Taylor, explicit, Rosenbrock steps
  integer, parameter, public :: kinds = 3

  integer, parameter :: first_period(kinds) = [2, 2, 4]   !! steps before the first trial of a kind
  integer, parameter, public :: shared_period(kinds) = [2, 128, 64]   !! `first_period` of variants: all wait for the trial of one
  integer, parameter :: longest_period(kinds) = [256, 256, 64]   ! implicit steps are tried near the limit of stability only
  integer, parameter, public :: longest_shared_period(kinds) = [256, 256, 1024]   !! `longest_period` of variants
  integer, parameter :: first_doubt = 64, last_doubt = 256  !! steps after which a weak sign is enough
  integer, parameter :: forgiven = 2                        !! attempts that may fail then: implicit steps damp what is fast first
  integer, parameter :: successes = 2                       !! successive attempts that win a trial: an error estimate scatters
  integer, parameter, public :: stiff_signs = 4   !! signs of stiffness before implicit steps are tried
  integer, parameter :: nonstiff_signs = 6                  !! of the opposite, before they are given up
  real(wp), parameter :: margin = 0.95_wp                   !! a kind must cost less than this share to be worth a change
  real(wp), parameter, public :: weak_sign = 0.4_wp     !! share of the limit of stability: the estimate may be too low
  real(wp), parameter, public :: near_limit = 0.75_wp   !! share of the limit of stability where implicit steps may cost less
  real(wp), parameter :: safe_share = 0.8_wp                !! share of that limit where the other kinds are stable

  !> The limits of a problem, the same for all lanes.
  type, public :: kind_data_t
    logical :: has(kinds) = .false.       !! whether there are steps of a kind
    logical :: tries(kinds) = .true.      !! whether a kind is tried, and not only taken where no other can be
    real(wp) :: cost(kinds) = 1.0_wp      !! of a step
    integer :: first_period(kinds) = first_period       !! steps before the first trial of a kind
    integer :: longest_period(kinds) = longest_period   !! steps before a trial after many lost trials
    real(wp) :: limit(kinds) = 1.0_wp     !! of |h lambda| on the negative real axis; no limit of the implicit kind
  end type kind_data_t

  type, public :: choice_t
    integer :: kind = by_stages           !! of the next step
    integer :: before = 0                 !! during a trial: the kind that it is compared with; else 0
    integer :: failed = 0, succeeded = 0  !! attempts of a trial
    integer :: may_fail = 0               !! attempts that do not yet lose it
    logical :: is_in_doubt = .false.      !! whether there has been a weak sign since the last trial of implicit steps
    integer :: doubt = first_doubt        !! steps until implicit ones are tried because of that
    integer :: next_doubt = first_doubt   !! `doubt` after the next trial
    real(wp) :: rate = 0.0_wp             !! cost of a second by the kind `before` [1/s]
    real(wp) :: h = 0.0_wp                !! its step size [s]
    real(wp) :: lambda = 0.0_wp           !! the last estimate of the dominant eigenvalue [1/s]
    integer :: wait(kinds) = 0            !! accepted steps until a kind may be tried
    integer :: period(kinds) = 0          !! `wait` after a trial that is lost
    integer :: signs(kinds) = 0           !! successive signs that a kind may cost less
    integer :: crossings = 0              !! steps that were cut
    real(wp) :: t_start = 0.0_wp          !! where the lane started [s]
    integer :: steps = 0                  !! accepted steps
  end type choice_t

contains

  !> The choice of a lane that starts.
  pure subroutine restart_choice(choice, data, t)
    type(choice_t), intent(out) :: choice
    type(kind_data_t), intent(in) :: data
    real(wp), intent(in) :: t   !! [s]

    choice%kind = merge(by_series, by_stages, data%has(by_series))
    choice%wait(:) = data%first_period
    choice%period(:) = data%first_period
    choice%t_start = t
  end subroutine restart_choice

  !> The cost of a second with steps of size h. A step that is cut where the system changes its branch is half wasted.
  pure real(wp) function rate(choice, data, kind, t, h)
    type(choice_t), intent(in) :: choice
    type(kind_data_t), intent(in) :: data
    integer, intent(in) :: kind
    real(wp), intent(in) :: t, h   !! present time, step size [s]

    rate = data%cost(kind) * (1 / max(h, tiny(h)) + cuts(choice, t))
  end function rate

  !> Half the number of crossings in a second.
  pure real(wp) function cuts(choice, t)
    type(choice_t), intent(in) :: choice
    real(wp), intent(in) :: t

    cuts = 0.0_wp
    if (choice%crossings > 0 .and. t > choice%t_start) cuts = 0.5_wp * choice%crossings / (t - choice%t_start)
  end function cuts

  !> The step size with which a kind would be worth a change, infinite if there is none.
  pure real(wp) function break_even(choice, data, kind, t, rate)
    type(choice_t), intent(in) :: choice
    type(kind_data_t), intent(in) :: data
    integer, intent(in) :: kind
    real(wp), intent(in) :: t      !! [s]
    real(wp), intent(in) :: rate   !! cost of a second by the present kind [1/s]
    real(wp) :: frequency

    break_even = huge(1.0_wp)
    frequency = margin * rate / data%cost(kind) - cuts(choice, t)
    if (frequency > 1 / break_even) break_even = 1 / frequency
  end function break_even

  !> Step size from which another kind costs less, instead of steps of size h by the present kind.
  pure real(wp) function needed_step(choice, data, kind, t, h)
    type(choice_t), intent(in) :: choice
    type(kind_data_t), intent(in) :: data
    integer, intent(in) :: kind
    real(wp), intent(in) :: t, h   !! time reached, present step size [s]

    needed_step = break_even(choice, data, kind, t, rate(choice, data, choice%kind, t, h))
  end function needed_step

  !> Counts accepted steps.
  elemental subroutine count_steps(choice, steps)
    type(choice_t), intent(inout) :: choice
    integer, intent(in) :: steps

    choice%steps = choice%steps + steps
    choice%wait(:) = max(choice%wait - steps, 0)
    choice%doubt = max(choice%doubt - steps, 0)
  end subroutine count_steps

  !> Counts an attempt of the present kind, and decides about a trial.
  pure subroutine count_attempt(choice, data, has_moved, t, h, is_over)
    type(choice_t), intent(inout) :: choice
    type(kind_data_t), intent(in) :: data
    logical, intent(in) :: has_moved   !! whether it was accepted
    real(wp), intent(in) :: t          !! time reached [s]
    real(wp), intent(in) :: h          !! next step size of the present kind [s]
    logical, intent(out) :: is_over    !! the trial is lost: the lane goes on with the kind before it

    is_over = .false.
    if (has_moved) call count_steps(choice, 1)
    if (choice%before == 0) return
    if (has_moved .and. h >= break_even(choice, data, choice%kind, t, choice%rate)) then
      choice%succeeded = choice%succeeded + 1
      if (choice%succeeded >= successes) call settle(choice, data, choice%kind, choice%before)
    else
      choice%succeeded = 0
      choice%failed = choice%failed + 1
      is_over = choice%failed > choice%may_fail
      if (.not. is_over) return
      call settle(choice, data, choice%before, choice%kind)
    end if
  end subroutine count_attempt

  !> Ends the comparison of two kinds.
  pure subroutine settle(choice, data, winner, loser)
    type(choice_t), intent(inout) :: choice
    type(kind_data_t), intent(in) :: data
    integer, value :: winner, loser   ! may be components of `choice`

    choice%kind = winner
    choice%before = 0
    choice%period(loser) = min(2 * choice%period(loser), data%longest_period(loser))
    choice%wait(loser) = choice%period(loser)
    choice%signs(:) = 0
  end subroutine settle

  !> Counts the signs that implicit steps may cost less than the present ones, or one of the other kinds less than implicit ones.
  pure subroutine note_stiffness(choice, data, t, h)
    type(choice_t), intent(inout) :: choice
    type(kind_data_t), intent(in) :: data
    real(wp), intent(in) :: t, h   !! time reached, step size [s]
    real(wp) :: needed
    integer :: kind

    if (choice%kind /= by_systems) then
      associate (limit => data%limit(choice%kind), signs => choice%signs(by_systems))
        signs = merge(signs + 1, 0, h * choice%lambda > near_limit * limit)
        choice%is_in_doubt = choice%is_in_doubt .or. h * choice%lambda > weak_sign * limit
      end associate
      return
    end if
    do kind = by_series, by_stages
      if (.not. data%has(kind)) cycle
      needed = needed_step(choice, data, kind, t, h)
      choice%signs(kind) = merge(choice%signs(kind) + 1, 0, min(needed, 1.0e100_wp) * choice%lambda &
                                 < safe_share * data%limit(kind))
    end do
  end subroutine note_stiffness

  !> Whether a kind should be tried now.
  pure logical function wants_trial(choice, data, kind)
    type(choice_t), intent(in) :: choice
    type(kind_data_t), intent(in) :: data
    integer, intent(in) :: kind

    wants_trial = data%has(kind) .and. data%tries(kind) .and. kind /= choice%kind .and. choice%before == 0 &
                  .and. choice%wait(kind) == 0
    if (kind == by_systems) then
      wants_trial = wants_trial .and. (choice%signs(kind) >= stiff_signs .or. (choice%is_in_doubt .and. choice%doubt == 0))
    else if (choice%kind == by_systems) then
      wants_trial = wants_trial .and. choice%signs(kind) >= nonstiff_signs
    end if
  end function wants_trial

  !> Begins the trial of a kind, instead of steps of size h by the present one.
  pure subroutine begin_trial(choice, data, kind, t, h)
    type(choice_t), intent(inout) :: choice
    type(kind_data_t), intent(in) :: data
    integer, intent(in) :: kind
    real(wp), intent(in) :: t        !! time reached [s]
    real(wp), intent(inout) :: h     !! step size of the present kind, then of the trial [s]

    choice%rate = rate(choice, data, choice%kind, t, h)
    choice%h = h
    choice%before = choice%kind
    choice%kind = kind
    choice%failed = 0
    choice%succeeded = 0
    choice%may_fail = 0
    if (kind == by_systems) then
      if (choice%signs(kind) >= stiff_signs) choice%may_fail = forgiven
      choice%next_doubt = min(2 * choice%next_doubt, last_doubt)
      choice%doubt = choice%next_doubt
      choice%is_in_doubt = .false.
    end if
    h = break_even(choice, data, kind, t, choice%rate)
  end subroutine begin_trial

end module nocdyn_method_choice
