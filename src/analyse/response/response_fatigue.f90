!> The damage that the oscillations of a forced response do per hour, by &fatigue, and the one of a profile of speeds and hours.
!>
!> At each speed the cycles of the synthesis of all lines with the mean are counted. Lines with whole ratios repeat after a
!> period, which has whole cycles only. Others are counted over many periods of the slowest one.
module nocdyn_response_fatigue
  use nocdyn_critical_speeds, only: keep_new
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_errors, only: error_t
  use nocdyn_fatigue_groups, only: element_kind, fatigue_symbol, read_curve
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_response_points, only: response_point_t
  use nocdyn_moment_forms, only: kind_moment, kind_reaction, kind_stress, moment_form_t
  use nocdyn_sn_curves, only: sn_curve_t
  use nocdyn_turning_points, only: list_turning_points
  implicit none (type, external)
  private

  public :: find_response_fatigue

  real(wp), parameter, public :: hour = 3600.0_wp   !! [s]
  real(wp), parameter :: periods = 1000.0_wp        ! that are counted where there is no common one

  !> The damage by one group &fatigue.
  type, public :: response_fatigue_t
    character(len=:), allocatable :: name, kind, element   !! of the group; 'coupling', 'shaft'; its name
    character(len=:), allocatable :: quantity          !! label and unit; a shaft's moment is the one of its first end
    real(wp), allocatable :: rate(:)                   !! damage per hour [1/h], [points]
    logical :: exceeds_strength = .false.              !! whether a mean leaves no strength at some speed
    integer :: largest = 1                             !! point with the largest rate
    real(wp), allocatable :: speeds(:), hours(:)       !! of the profile [rad/s], [h]; empty: there is none
    real(wp), allocatable :: profile_rate(:)           !! at these speeds [1/h]
    integer, allocatable, private :: quantities(:)     !! of the response; the largest rate counts
    type(sn_curve_t), private :: curve
  contains
    procedure :: damage
  end type response_fatigue_t

contains

  !> The damage of one profile.
  pure real(wp) function damage(self)
    class(response_fatigue_t), intent(in) :: self

    damage = dot_product(self%hours, self%profile_rate)
  end function damage

  !> Computes the damage by all groups &fatigue; adds the speeds of their profiles to the response.
  subroutine find_response_fatigue(input, response, fatigue, error, failed_speed)
    type(input_t), intent(in) :: input
    type(forced_response_t), intent(inout) :: response
    type(response_fatigue_t), allocatable, intent(out) :: fatigue(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), intent(out) :: failed_speed   !! as in `add_points`
    integer, allocatable :: groups(:)
    real(wp), allocatable :: speeds(:)
    integer :: i, kind, q

    failed_speed = 0.0_wp
    allocate (groups, source=input%groups_named('fatigue'))
    allocate (fatigue(size(groups)), speeds(0))
    do i = 1, size(groups)
      ! what a group asks for
      kind = kind_moment
      associate (group => input%groups(groups(i)))
        fatigue(i)%name = group%name
        fatigue(i)%kind = trim(element_kind(group))
        fatigue(i)%element = group%text(fatigue(i)%kind)
        fatigue(i)%curve = read_curve(group)
        fatigue(i)%speeds = group%numbers('profile_speeds')
        fatigue(i)%hours = group%numbers('profile_hours')
        if (fatigue_symbol(group) == 'stress') kind = kind_stress
        if (fatigue_symbol(group) == 'reaction') kind = kind_reaction
      end associate
      allocate (fatigue(i)%quantities(0))
      do q = 1, size(response%quantities)
        if (response%quantities(q)%kind == kind .and. response%quantities(q)%element == fatigue(i)%element .and. &
            response%quantities(q)%element_kind == trim(element_kind(input%groups(groups(i))))) fatigue(i)%quantities = &
            [fatigue(i)%quantities, q]
      end do
      if (size(fatigue(i)%quantities) == 0) error stop 'nocdyn_response_fatigue: a checked group has a quantity'
      associate (first => response%quantities(fatigue(i)%quantities(1)))
        fatigue(i)%quantity = first%name // ' [' // first%unit // ']'   ! threads come here: no function
      end associate
      speeds = [speeds, fatigue(i)%speeds]
    end do
    call keep_new(response, speeds)
    call response%add_points(speeds, .false., error, failed_speed)
    if (allocated(error)) return
    do i = 1, size(fatigue)
      call find_rates(response, fatigue(i))
    end do
  end subroutine find_response_fatigue

  !> The damage per hour at all speeds.
  subroutine find_rates(response, item)
    type(forced_response_t), intent(in) :: response
    type(response_fatigue_t), intent(inout) :: item
    type(damage_counter_t) :: counter
    real(wp) :: speed(size(response%points))
    integer :: i, k

    counter%curve = item%curve
    allocate (item%rate(size(response%points)), source=0.0_wp)
    do i = 1, size(item%rate)
      do k = 1, size(item%quantities)
        item%rate(i) = max(item%rate(i), damage_rate(response, response%points(i), item%quantities(k), counter))
        item%exceeds_strength = item%exceeds_strength .or. counter%has_failed
      end do
    end do
    item%largest = maxloc(item%rate, dim=1)
    speed = response%speeds()
    item%profile_rate = [(item%rate(minloc(abs(speed - item%speeds(i)), dim=1)), i=1, size(item%speeds))]
  end subroutine find_rates

  !> The damage of one quantity per hour at one speed.
  real(wp) function damage_rate(response, point, quantity, counter) result(rate)
    type(forced_response_t), intent(in) :: response
    type(response_point_t), intent(in) :: point
    integer, intent(in) :: quantity
    type(damage_counter_t), intent(inout) :: counter
    real(wp), allocatable :: turns(:)
    real(wp) :: duration
    logical :: is_period
    integer :: i

    call response%synthesis%find_period(point%frequency, is_period, duration)
    if (.not. is_period) duration = periods * duration
    call list_turning_points(point%frequency, point%quantity(:, quantity), is_period, duration, turns)
    call counter%start()
    do i = 1, size(turns)
      call counter%add(point%mean(quantity) + turns(i))
    end do
    call counter%finish()
    rate = counter%damage * (hour / duration)
  end function damage_rate

end module nocdyn_response_fatigue
