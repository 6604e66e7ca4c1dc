!> The forced response at one speed, and lists of them in the order of the speeds.
module nocdyn_response_points
  use nocdyn_excitation_lines, only: source_t
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: keep_points, merge_points

  !> The response at one speed. Amplitudes are the ones of amplitude exp(i Omega t), where the angle of the reference body is zero
  !> at t = 0 and its orders are sines of its angle.
  type, public :: response_point_t
    logical :: is_of_grid = .true.                 !! whether it is one of the speeds that were asked for
    logical :: is_settled = .true.                 !! whether the conditions of rubber couplings were found
    type(held_state_t), allocatable :: state
    type(source_t), allocatable :: sources(:)
    real(wp), allocatable :: frequency(:)          !! Omega [rad/s], [lines]
    complex(wp), allocatable :: quantity(:, :)     !! [lines, quantities that are computed]
    complex(wp), allocatable :: angle(:, :)        !! [rad], [lines, bodies of `angle_place`]
    real(wp), allocatable :: heat(:)               !! mean power lost by the oscillations [W], of the elements of the
                                                   !! quantities, [elements]
    real(wp), allocatable :: mean(:)               !! [quantities]
    real(wp), allocatable :: lowest(:), highest(:) !! of the oscillations of all lines, without the mean, [quantities]
  contains
    procedure :: half_range, peak
  end type response_point_t

contains

  !> Half the difference of the largest and the smallest value of a quantity.
  elemental real(wp) function half_range(self, quantity)
    class(response_point_t), intent(in) :: self
    integer, intent(in) :: quantity

    half_range = 0.5_wp * (self%highest(quantity) - self%lowest(quantity))
  end function half_range

  !> The largest magnitude of a quantity, its mean included.
  elemental real(wp) function peak(self, quantity)
    class(response_point_t), intent(in) :: self
    integer, intent(in) :: quantity

    peak = max(abs(self%mean(quantity) + self%highest(quantity)), abs(self%mean(quantity) + self%lowest(quantity)))
  end function peak

  !> Merges two lists of points in the order of their speeds.
  subroutine merge_points(points, new)
    type(response_point_t), allocatable, intent(inout) :: points(:)
    type(response_point_t), intent(inout) :: new(:)   !! ascending by the size of the speed; moved
    type(response_point_t), allocatable :: all(:)
    integer :: i, k, n

    allocate (all(size(points) + size(new)))
    i = 1
    k = 1
    do n = 1, size(all)
      if (k > size(new)) then
        call move_point(points(i), all(n))
        i = i + 1
      else if (i > size(points)) then
        call move_point(new(k), all(n))
        k = k + 1
      else if (abs(points(i)%state%speed) <= abs(new(k)%state%speed)) then
        call move_point(points(i), all(n))
        i = i + 1
      else
        call move_point(new(k), all(n))
        k = k + 1
      end if
    end do
    call move_alloc(all, points)
  end subroutine merge_points

  !> Drops points.
  subroutine keep_points(points, is_kept)
    type(response_point_t), allocatable, intent(inout) :: points(:)
    logical, intent(in) :: is_kept(:)   !! [points]
    type(response_point_t), allocatable :: kept(:)
    integer :: i, n

    if (all(is_kept)) return
    allocate (kept(count(is_kept)))
    n = 0
    do i = 1, size(points)
      if (.not. is_kept(i)) cycle
      n = n + 1
      call move_point(points(i), kept(n))
    end do
    call move_alloc(kept, points)
  end subroutine keep_points

  !> Moves the arrays of a point.
  subroutine move_point(from, to)
    type(response_point_t), intent(inout) :: from
    type(response_point_t), intent(out) :: to

    to%is_of_grid = from%is_of_grid
    to%is_settled = from%is_settled
    call move_alloc(from%state, to%state)
    call move_alloc(from%sources, to%sources)
    call move_alloc(from%frequency, to%frequency)
    call move_alloc(from%quantity, to%quantity)
    call move_alloc(from%angle, to%angle)
    call move_alloc(from%heat, to%heat)
    call move_alloc(from%mean, to%mean)
    call move_alloc(from%lowest, to%lowest)
    call move_alloc(from%highest, to%highest)
  end subroutine move_point

end module nocdyn_response_points
