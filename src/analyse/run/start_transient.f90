!> The first fast transient of a start out of balance, and the extremes that lie in it.
!>
!> The machine is linearised at its start. The moments there, their rates and the speeds of twist make each mode swing about
!> its position of balance; the modes with the largest moments in a coupling are the excited ones. The transient lasts until these
!> have decayed, but for some periods at least; where they decay too slowly, for these periods. A start in balance, such as a
!> steady state, has none.
module nocdyn_start_transient
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: new_reduced, reduced_t
  use nocdyn_signals, only: signal_t
  implicit none (type, external)
  private

  public :: find_start_transient

  real(wp), parameter :: periods = 3.0_wp           ! of an excited mode
  real(wp), parameter :: decays = 3.0_wp            ! times of decay by the factor e: 5 % are left
  real(wp), parameter :: excited_share = 0.05_wp    ! of the largest moment: smaller ones do not count
  real(wp), parameter :: balance_share = 1.0e-3_wp  ! of the moments of the run: a smaller swing is none
  real(wp), parameter :: fast_share = 0.5_wp        ! of the run: what lasts longer is no fast transient
  integer, parameter :: most_freedoms = 100         ! the matrices are dense

  type, public :: start_transient_t
    real(wp) :: until = 0.0_wp                                     !! its end [s]; the start if there is none
    logical, allocatable :: has_lowest(:), has_highest(:)          !! whether these extremes lie in it, after the start, [columns]
  end type start_transient_t

contains

  !> Finds the transient of a run and the extremes in it, of the columns that swing with the couplings.
  subroutine find_start_transient(machine, span, signals, sizes, lowest_time, highest_time, transient)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: span(2)                                !! start and end of the run [s]
    type(signal_t), intent(in) :: signals(:)                       !! of the columns
    real(wp), intent(in) :: sizes(:)                               !! largest magnitudes of the columns
    real(wp), intent(in) :: lowest_time(:), highest_time(:)        !! of their extremes [s]
    type(start_transient_t), intent(out) :: transient
    character(len=*), parameter :: swinging(5) = [character(len=12) :: 'twist', 'moment', 'damping', 'total_moment', 'reaction']
    logical :: is_moment(size(signals)), swings(size(signals))
    integer :: i

    is_moment = [(signals(i)%symbol == 'moment' .or. signals(i)%element_kind == 'shaft' .and. signals(i)%unit == 'N m', &
                  i=1, size(signals))]
    swings = [(any(swinging == signals(i)%symbol), i=1, size(signals))]
    transient%until = transient_end(machine, span(1), span(2), maxval(sizes, mask=is_moment))
    allocate (transient%has_lowest, source=swings .and. lowest_time > span(1) .and. lowest_time <= transient%until)
    allocate (transient%has_highest, source=swings .and. highest_time > span(1) .and. highest_time <= transient%until)
  end subroutine find_start_transient

  !> The end of the first fast transient [s]; t_start if there is none, of a start in balance, or if it cannot be told: of a
  !> machine of many degrees of freedom, or one whose couplings have no stiffness at the start.
  real(wp) function transient_end(machine, t_start, t_end, largest_moment) result(until)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: t_start, t_end    !! of the run [s]
    real(wp), intent(in) :: largest_moment    !! of any coupling in the run [N m]
    type(reduced_t) :: formulation
    type(linearisation_t) :: linear
    type(error_t), allocatable :: error
    real(wp), allocatable :: y(:, :), moments(:)
    real(wp), parameter :: two_pi = 2.0_wp * acos(-1.0_wp)
    real(wp) :: damping, duration, longest   ! of a mode: 2 zeta omega [1/s]; [s]
    integer :: i

    until = t_start
    if (machine%coordinates%freedoms > most_freedoms .or. allocated(machine%steady_internal)) return   ! a start in balance
    if (machine%freedoms() < machine%coordinates%freedoms) return   ! rows that move are not among the linear equations
    formulation = new_reduced(machine, .false.)
    allocate (y, source=formulation%start())
    call linearise(formulation, t_start, y, linear, error)
    if (allocated(error)) return
    call formulation%observe([t_start], y)
    allocate (moments, source=moments_of_modes(formulation, linear))
    if (size(moments) == 0) return
    if (maxval(moments) <= max(balance_share * largest_moment, 0.0_wp)) return
    longest = fast_share * (t_end - t_start)
    duration = 0.0_wp
    do i = 1, size(moments)
      if (moments(i) < excited_share * maxval(moments)) cycle
      duration = max(duration, periods * two_pi / linear%natural(i))
      damping = -dot_product(formulation%state%elements%applied_speed(1, :), linear%twists(:, i)**2)
      if (decays * 2.0_wp <= longest * damping) duration = max(duration, decays * 2.0_wp / damping)
    end do
    if (duration <= longest) until = t_start + duration
  end function transient_end

  !> The largest amplitude of an elastic moment when each mode of the couplings swings freely from the state of the machine [N m],
  !> [modes].
  pure function moments_of_modes(formulation, linear) result(moments)
    type(reduced_t), intent(in) :: formulation       !! evaluated at that state
    type(linearisation_t), intent(in) :: linear      !! there
    real(wp), allocatable :: moments(:)
    real(wp) :: force_rate, offset, rate   ! of the modal coordinate from balance
    integer, allocatable :: elastic(:)
    integer :: i

    allocate (moments(size(linear%natural)), source=0.0_wp)
    allocate (elastic, source=formulation%machine%elastic())
    associate (elements => formulation%state%elements)
      do i = 1, size(moments)
        associate (natural => linear%natural(i), twists => linear%twists(:, i))
          if (natural <= 0) cycle
          if (sum(linear%stiffness(elastic) * twists(elastic)**2) < 0.5_wp * natural**2) cycle   ! by torques over the angle
          offset = dot_product(elements%restoring(1, :) + elements%applied(1, :), twists) / natural**2
          rate = dot_product(linear%stiffness * twists, elements%speed(1, :)) / natural**2
          force_rate = dot_product(elements%applied_time(1, :) + elements%applied_angle(1, :) * elements%speed(1, :), twists)
          moments(i) = norm2([offset, rate / natural, force_rate / natural**3]) * &
                       maxval(abs(linear%stiffness(elastic) * twists(elastic)))
        end associate
      end do
    end associate
  end function moments_of_modes

end module nocdyn_start_transient
