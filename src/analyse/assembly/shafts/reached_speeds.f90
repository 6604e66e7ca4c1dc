!> The highest speeds of bodies that the numbers of an input let expect, before anything is computed.
module nocdyn_reached_speeds
  use nocdyn_constraints, only: constraints_t
  use nocdyn_element_groups, only: bodies_of, body_index_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: reached_speeds

  !> Pairs of bodies that turn together: |omega(second)| = ratio |omega(first)|.
  type :: links_t
    integer, allocatable :: first(:), second(:)
    real(wp), allocatable :: ratio(:)
  end type links_t

contains

  !> Magnitudes of the speeds [rad/s], [bodies]: those at the start, of drives, of motors without load and of &response, and what
  !> follows from them through couplings and gears. Of the bodies of a planetary set one turns while another stands still.
  function reached_speeds(input, body_index, constraints) result(speeds)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    type(constraints_t), intent(in) :: constraints
    real(wp), allocatable :: speeds(:)
    real(wp) :: given(size(body_index%names)), from_one(size(body_index%names)), speed
    type(links_t) :: links
    integer :: i, source
    integer, allocatable :: bodies(:)

    allocate (speeds(size(given)), source=0.0_wp)
    ! the largest speed that groups give to each body
    given = 0.0_wp
    allocate (bodies, source=input%groups_named('body'))
    do i = 1, size(bodies)
      given(i) = abs(input%groups(bodies(i))%number('speed', absent=0.0_wp))
    end do
    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        select case (group%kind)
        case ('motor')
          speed = top_speed(group)
        case ('drive')
          speed = abs(group%number('speed', absent=0.0_wp)) + abs(group%number('speed_amplitude', absent=0.0_wp))
          speed = max(speed, maxval([0.0_wp, abs(group%numbers('table_speed'))]))
        case ('response')
          if (group%has_value('frequency')) cycle
          speed = maxval(abs([group%numbers('speed'), group%numbers('operating')]))
        case default
          cycle
        end select
        bodies = bodies_of(group, 'body', body_index)
        if (bodies(1) > 0) given(bodies(1)) = max(given(bodies(1)), speed)
      end associate
    end do
    if (.not. any(given > 0)) return
    links = all_links(input, body_index, constraints)
    do
      source = maxloc(given, dim=1, mask=given > speeds)   ! the fastest one that does not follow from faster ones
      if (source == 0) return
      from_one = 0.0_wp
      from_one(source) = given(source)
      call spread_speed(links, from_one)
      speeds = max(speeds, from_one)
    end do
  end function reached_speeds

  !> Follows the links from the body that has a speed.
  pure subroutine spread_speed(links, speed)
    type(links_t), intent(in) :: links
    real(wp), intent(inout) :: speed(:)   !! [bodies]
    integer :: l
    logical :: has_changed

    has_changed = .true.
    do while (has_changed)
      has_changed = .false.
      do l = 1, size(links%first)
        associate (first => speed(links%first(l)), second => speed(links%second(l)))
          if (first > 0 .eqv. second > 0) cycle
          has_changed = .true.
          if (first > 0) then
            second = links%ratio(l) * first
          else
            first = second / links%ratio(l)
          end if
        end associate
      end do
    end do
  end subroutine spread_speed

  !> The speed of a motor without load or by its governor [rad/s]; 0 if it has none.
  pure real(wp) function top_speed(group) result(speed)
    type(group_t), intent(in) :: group   !! &motor

    speed = maxval([0.0_wp, abs(group%numbers('set_speeds')), abs(group%number('governor_speed', absent=0.0_wp)), &
                    abs(group%number('rated_speed', absent=0.0_wp)), abs(group%number('synchronous_speed', absent=0.0_wp))])
    select case (group%text('kind'))
    case ('quadratic')
      associate (a => abs(group%number('a')), b => abs(group%number('b')), c => abs(group%number('c')))
        if (a > 0 .and. (b > 0 .or. c > 0)) speed = max(speed, 2.0_wp * a / (b + sqrt(b**2 + 4.0_wp * a * c)))
      end associate
    case ('table')
      speed = maxval([speed, abs(group%numbers('table_speed'))])
    case ('induction_dq', 'synchronous')
      speed = max(speed, 2.0_wp * group%number('frequency') / group%whole_number('poles'))
    case ('dc')
      speed = max(speed, abs(group%number('voltage') / group%number('flux_constant')))
    case default   ! these have no other keys
    end select
  end function top_speed

  !> The links of all elements and rows.
  function all_links(input, body_index, constraints) result(links)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    type(constraints_t), intent(in) :: constraints
    type(links_t) :: links
    integer, allocatable :: bodies(:)
    integer :: i, k, l, r

    allocate (links%first(0), links%second(0), links%ratio(0))
    do i = 1, size(input%groups)
      select case (input%groups(i)%kind)
      case ('coupling', 'shaft', 'clutch', 'freewheel', 'cardan', 'mesh')
        bodies = bodies_of(input%groups(i), 'bodies', body_index)
        if (all(bodies > 0)) call add_link(links, bodies(1), bodies(2), ratio_of(input%groups(i)))
      case default
        cycle
      end select
    end do
    do r = 1, constraints%rows()
      associate (first => constraints%first(r), last => constraints%first(r + 1) - 1, row => constraints%coefficient(1, :))
        do k = first, last
          do l = k + 1, last
            call add_link(links, constraints%body(k), constraints%body(l), abs(row(k) / row(l)))
          end do
        end do
      end associate
    end do
  end function all_links

  pure subroutine add_link(links, first, second, ratio)
    type(links_t), intent(inout) :: links
    integer, intent(in) :: first, second
    real(wp), intent(in) :: ratio

    links%first = [links%first, first]
    links%second = [links%second, second]
    links%ratio = [links%ratio, ratio]
  end subroutine add_link

  !> |speed of the second body| over the one of the first one.
  pure real(wp) function ratio_of(group) result(ratio)
    type(group_t), intent(in) :: group

    ratio = 1.0_wp
    if (group%kind /= 'mesh') return
    if (group%has_value('radii')) then
      associate (radii => group%numbers('radii'))
        ratio = radii(1) / radii(2)
      end associate
    else
      associate (teeth => group%whole_numbers('teeth'))
        ratio = real(teeth(1), wp) / teeth(2)
      end associate
    end if
  end function ratio_of

end module nocdyn_reached_speeds
