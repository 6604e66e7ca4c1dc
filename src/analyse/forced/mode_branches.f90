!> The damped modes of a machine over its speed, each followed from speed to speed as one branch.
!>
!> Where the modes of two speeds are clearly each other's continuation, those between follow from them; else the range is halved,
!> and where neighbouring speeds of the grid leave a doubt, speeds between them are computed too, so that the branches do not
!> depend on the grid. A branch pauses where the oscillation is overdamped.
module nocdyn_mode_branches
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_mode_links, only: find_links
  use nocdyn_dense_pairs, only: move_pairs
  use nocdyn_mode_pairs, only: mode_pairs_t
  use nocdyn_state_modes, only: find_pairs_at
  implicit none (type, external)
  private

  public :: new_speed_modes

  !> The oscillating modes, in the order of their frequencies at one speed; then those that begin at other speeds.
  type, public :: speed_modes_t
    integer :: modes = 0
    integer :: below = 0                           !! modes of lower frequencies, which are left out
    real(wp) :: numbered_at = 0.0_wp               !! the speed at whose frequencies they are numbered [rad/s]
    logical :: change_places = .false.             !! whether their order is not the same at all points, or some begin or end
    logical, allocatable :: exists(:, :)           !! whether a mode oscillates, [modes, points]
    real(wp), allocatable :: frequency(:, :)       !! of the damped oscillations, 0 where there is none [rad/s], [modes, points]
    real(wp), allocatable :: damping_ratio(:, :)   !! negative where they grow, [modes, points]
    real(wp), allocatable :: undamped(:, :)        !! frequency of the most similar undamped mode [rad/s], [modes, points];
                                                   !! 0 of a mode that is mostly an internal state
    real(wp), allocatable :: divergence(:)         !! negative where a negative stiffness drives a motion apart [rad/s], [points]
    integer, allocatable :: internal(:)            !! the internal state that a mode mostly is, or 0, [modes]
    logical, allocatable :: is_electrical(:)       !! whether that is a current or a flux, [modes]
    real(wp), allocatable :: shape(:, :)           !! angles of the bodies where a mode begins, the largest 1, [bodies, modes]
    complex(wp), allocatable :: twists(:, :)       !! of all elements there, in any scale, [elements, modes]
    logical :: is_constant = .true.                !! whether all points have the same frequencies
  contains
    procedure :: number
  end type speed_modes_t

  integer, parameter :: most_halvings = 12, most_speeds_between = 400   ! of all intervals together

  !> A speed and the branches of its modes.
  type :: stop_t
    integer :: point = 0                    ! 0: between the points
    type(mode_pairs_t) :: pairs
    integer, allocatable :: branch(:)       ! [modes]
  end type stop_t

  !> What is found so far.
  type :: branches_t
    type(held_speeds_t), allocatable :: held              ! for speeds between the ones of the grid
    integer :: left = most_speeds_between                 ! speeds that may still be computed
    integer :: branches = 0
    complex(wp), allocatable :: value(:, :)               ! 0 where a branch is none, [branches, points]
    real(wp), allocatable :: undamped(:, :)               ! [branches, points]
    real(wp), allocatable :: divergence(:)                ! [points]
    complex(wp), allocatable :: shape(:, :), twists(:, :) ! where a branch begins
    integer, allocatable :: internal(:)
    integer, allocatable :: ended(:)                      ! branches that are overdamped at present
    real(wp), allocatable :: ended_undamped(:)            ! their undamped frequencies before [rad/s]
  end type branches_t

contains

  !> Finds the modes at every point.
  subroutine new_speed_modes(response, numbered_at, self, error)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: numbered_at   !! point
    type(speed_modes_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    type(branches_t) :: tracks
    type(stop_t) :: first, last
    integer :: m, points

    points = size(response%points)
    allocate (tracks%value(0, points), tracks%undamped(0, points), tracks%shape(response%machine%bodies, 0), &
              tracks%twists(response%machine%elements%count, 0), tracks%internal(0), tracks%ended(0), &
              tracks%ended_undamped(0))
    allocate (tracks%divergence(points), source=0.0_wp)
    first%point = 1
    call find_pairs_at(response, response%points(1)%state, first%pairs, error)
    if (allocated(error)) return
    allocate (first%branch(size(first%pairs%value)))
    do m = 1, size(first%branch)
      call add_branch(tracks, first%pairs, m, first%branch(m))
    end do
    call record(tracks, first)
    if (points > 1) then
      last%point = points
      call find_pairs_at(response, response%points(points)%state, last%pairs, error, first%pairs)
      if (.not. allocated(error)) call connect(response, tracks, first, last, error)
      if (allocated(error)) return
    end if
    call set_modes(tracks, numbered_at, self)
    self%numbered_at = response%points(numbered_at)%state%speed
    self%below = first%pairs%below
    self%is_electrical = [(response%machine%is_electrical(self%internal(m)), m=1, self%modes)]
  end subroutine new_speed_modes

  !> The number of a mode among all modes of the machine, 1 at the lowest frequency.
  pure integer function number(self, mode)
    class(speed_modes_t), intent(in) :: self
    integer, intent(in) :: mode   !! index

    number = self%below + mode
  end function number

  !> Connects the modes of two points, and finds the ones of all points between.
  recursive subroutine connect(response, tracks, a, b, error)
    type(forced_response_t), intent(in) :: response
    type(branches_t), intent(inout) :: tracks
    type(stop_t), intent(in) :: a
    type(stop_t), intent(inout) :: b   !! gets its branches
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: link(:)
    type(stop_t) :: between
    logical :: are_clear

    if (b%point - a%point <= 1) then
      call pass_between(response, tracks, a, b, most_halvings)
      call record(tracks, b)
      return
    end if
    if (response%machine%elements%internal%count == 0 .and. min(a%pairs%divergence, b%pairs%divergence) >= 0) then
      call find_links(response%machine, a%pairs, b%pairs, link, are_clear)
      if (are_clear) call fill_between(response, tracks, a, b, link, are_clear)
      if (are_clear) then
        call take_over(tracks, a, link, b)
        call record(tracks, b)
        return
      end if
    end if
    between%point = (a%point + b%point) / 2
    call find_pairs_at(response, response%points(between%point)%state, between%pairs, error, a%pairs)
    if (.not. allocated(error)) call connect(response, tracks, a, between, error)
    if (.not. allocated(error)) call connect(response, tracks, between, b, error)
  end subroutine connect

  !> The modes of all points between two points whose modes are clearly the same.
  subroutine fill_between(response, tracks, a, b, link, is_done)
    type(forced_response_t), intent(in) :: response
    type(branches_t), intent(inout) :: tracks
    type(stop_t), intent(in) :: a, b
    integer, intent(in) :: link(:)   !! mode of `b` of each of `a`
    logical, intent(out) :: is_done
    integer, allocatable :: same(:)
    type(stop_t) :: between
    integer :: k, m

    between%branch = a%branch
    do k = a%point + 1, b%point - 1
      between%point = k
      between%pairs = mode_pairs_t(slopes=response%points(k)%state%slopes)
      call move_pairs(response%machine, response%matrix, a%pairs, b%pairs, link, &
                      real(k - a%point, wp) / (b%point - a%point), between%pairs, is_done)
      is_done = .not. is_done
      if (is_done) call find_links(response%machine, a%pairs, between%pairs, same, is_done)
      if (is_done) is_done = all(same == [(m, m=1, size(same))])
      if (.not. is_done) return
      call record(tracks, between)
    end do
    is_done = .true.
  end subroutine fill_between

  !> Goes from one speed to the next one of the grid, over speeds between them where these leave a doubt.
  recursive subroutine pass_between(response, tracks, a, b, halvings)
    type(forced_response_t), intent(in) :: response
    type(branches_t), intent(inout) :: tracks
    type(stop_t), intent(in) :: a
    type(stop_t), intent(inout) :: b
    integer, intent(in) :: halvings   !! that are still allowed
    integer, allocatable :: link(:)
    type(error_t), allocatable :: error
    type(stop_t) :: between
    type(held_state_t) :: state
    logical :: are_clear

    call find_links(response%machine, a%pairs, b%pairs, link, are_clear)
    if (.not. are_clear .and. halvings > 0 .and. tracks%left > 0) then
      tracks%left = tracks%left - 1
      if (.not. allocated(tracks%held)) tracks%held = response%held
      call tracks%held%hold(0.5_wp * (a%pairs%speed + b%pairs%speed), state, error)
      if (.not. allocated(error)) call find_pairs_at(response, state, between%pairs, error, a%pairs)
      if (.not. allocated(error)) then
        call pass_between(response, tracks, a, between, halvings - 1)
        call pass_between(response, tracks, between, b, halvings - 1)
        return
      end if
    end if
    call take_over(tracks, a, link, b)
  end subroutine pass_between

  !> Gives linked modes their branches. A mode that begins goes on from the branch that ended with the most similar undamped
  !> frequency, if any has ended; else it begins a new one.
  subroutine take_over(tracks, a, link, b)
    type(branches_t), intent(inout) :: tracks
    type(stop_t), intent(in) :: a
    integer, intent(in) :: link(:)   !! mode of `b` of each of `a`, or 0
    type(stop_t), intent(inout) :: b
    integer, allocatable :: others(:)
    integer :: k, m, nearest

    if (allocated(b%branch)) deallocate (b%branch)
    allocate (b%branch(size(b%pairs%value)), source=0)
    do m = 1, size(link)
      if (link(m) > 0) then
        b%branch(link(m)) = a%branch(m)
      else
        tracks%ended = [tracks%ended, a%branch(m)]
        tracks%ended_undamped = [tracks%ended_undamped, a%pairs%undamped(m)]
      end if
    end do
    do m = 1, size(b%branch)
      if (b%branch(m) > 0) cycle
      if (size(tracks%ended) == 0) then
        call add_branch(tracks, b%pairs, m, b%branch(m))
        cycle
      end if
      nearest = minloc(abs(tracks%ended_undamped - b%pairs%undamped(m)), dim=1)
      b%branch(m) = tracks%ended(nearest)
      others = [(k, k=1, nearest - 1), (k, k=nearest + 1, size(tracks%ended))]
      tracks%ended = tracks%ended(others)
      tracks%ended_undamped = tracks%ended_undamped(others)
    end do
  end subroutine take_over

  !> Begins a branch.
  subroutine add_branch(tracks, pairs, mode, branch)
    type(branches_t), intent(inout) :: tracks
    type(mode_pairs_t), intent(in) :: pairs
    integer, intent(in) :: mode
    integer, intent(out) :: branch
    complex(wp), allocatable :: value(:, :), shape(:, :), twists(:, :)
    real(wp), allocatable :: undamped(:, :)
    integer :: n

    n = tracks%branches
    branch = n + 1
    tracks%branches = branch
    tracks%internal = [tracks%internal, pairs%internal(mode)]
    if (branch <= size(tracks%value, 1)) then
      tracks%shape(:, branch) = pairs%angle(:, mode)
      tracks%twists(:, branch) = pairs%twist(:, mode)
      return
    end if
    allocate (value(2 * n + 8, size(tracks%value, 2)), source=(0.0_wp, 0.0_wp))
    allocate (undamped(2 * n + 8, size(tracks%value, 2)), source=0.0_wp)
    allocate (shape(size(tracks%shape, 1), 2 * n + 8), twists(size(tracks%twists, 1), 2 * n + 8), source=(0.0_wp, 0.0_wp))
    value(:n, :) = tracks%value(:n, :)
    undamped(:n, :) = tracks%undamped(:n, :)
    shape(:, :n) = tracks%shape(:, :n)
    twists(:, :n) = tracks%twists(:, :n)
    shape(:, branch) = pairs%angle(:, mode)
    twists(:, branch) = pairs%twist(:, mode)
    call move_alloc(value, tracks%value)
    call move_alloc(undamped, tracks%undamped)
    call move_alloc(shape, tracks%shape)
    call move_alloc(twists, tracks%twists)
  end subroutine add_branch

  !> Notes the modes of a point.
  subroutine record(tracks, stop)
    type(branches_t), intent(inout) :: tracks
    type(stop_t), intent(in) :: stop

    tracks%value(:, stop%point) = (0.0_wp, 0.0_wp)
    tracks%value(stop%branch, stop%point) = stop%pairs%value
    tracks%undamped(stop%branch, stop%point) = stop%pairs%undamped
    tracks%divergence(stop%point) = stop%pairs%divergence
  end subroutine record

  !> The result, with the branches in the order of their frequencies where they are numbered; then those that are not there,
  !> in the order of their begin and of their frequencies there. Branches that are only between the points are left out.
  subroutine set_modes(tracks, numbered_at, self)
    type(branches_t), intent(in) :: tracks
    integer, intent(in) :: numbered_at   !! point
    type(speed_modes_t), intent(inout) :: self
    integer, parameter :: before_all = -1
    integer :: begin(tracks%branches), m, rank   ! begin 0: at no point
    integer, allocatable :: order(:)
    real(wp) :: first(tracks%branches)

    do m = 1, tracks%branches
      begin(m) = findloc(aimag(tracks%value(m, :)) > 0, .true., dim=1)
      if (begin(m) == 0) cycle
      first(m) = aimag(tracks%value(m, begin(m)))
      if (.not. aimag(tracks%value(m, numbered_at)) > 0) cycle
      begin(m) = before_all
      first(m) = aimag(tracks%value(m, numbered_at))
    end do
    self%modes = count(begin /= 0)
    allocate (order(self%modes))
    do m = 1, tracks%branches
      if (begin(m) == 0) cycle
      rank = 1 + count(begin /= 0 .and. begin < begin(m)) + count(begin == begin(m) .and. first < first(m)) &
             + count(begin(:m - 1) == begin(m) .and. abs(first(:m - 1) - first(m)) <= 0)
      order(rank) = m
    end do
    self%frequency = aimag(tracks%value(order, :))
    self%exists = self%frequency > 0
    self%damping_ratio = -real(tracks%value(order, :), wp) / max(abs(tracks%value(order, :)), tiny(1.0_wp))
    self%undamped = tracks%undamped(order, :)
    self%internal = tracks%internal(order)
    where (spread(self%internal, 2, size(self%undamped, 2)) > 0) self%undamped = 0.0_wp
    self%twists = tracks%twists(:, order)
    self%divergence = tracks%divergence
    allocate (self%shape(size(tracks%shape, 1), self%modes))
    do m = 1, self%modes
      call set_shape(tracks%shape(:, order(m)), self%shape(:, m))
    end do
    self%is_constant = is_constant(self)
    self%change_places = change_places(self)
  end subroutine set_modes

  !> The motion in phase with the largest one.
  pure subroutine set_shape(angle, shape)
    complex(wp), intent(in) :: angle(:)
    real(wp), intent(out) :: shape(:)

    associate (largest => angle(maxloc(abs(angle), dim=1)))
      shape = real(angle, wp)
      if (abs(largest) > 0) shape = real(angle / largest, wp)
    end associate
  end subroutine set_shape

  !> Whether the order of the frequencies is not the same at all points, or modes begin or end.
  pure logical function change_places(self)
    type(speed_modes_t), intent(in) :: self
    real(wp), parameter :: same = 1.0e-9_wp   ! relative
    integer :: m

    change_places = .not. all(self%exists)
    do m = 2, self%modes
      change_places = change_places .or. any(self%frequency(m, :) < (1.0_wp - same) * self%frequency(m - 1, :))
    end do
  end function change_places

  !> Whether straight lines between the points are good enough.
  pure logical function is_constant(self)
    type(speed_modes_t), intent(in) :: self
    real(wp), parameter :: same = 1.0e-6_wp   ! relative
    integer :: i

    is_constant = all(self%exists)
    do i = 2, size(self%frequency, 2)
      is_constant = is_constant .and. &
                    all(abs(self%frequency(:, i) - self%frequency(:, i - 1)) <= same * self%frequency(:, i))
    end do
  end function is_constant

end module nocdyn_mode_branches
