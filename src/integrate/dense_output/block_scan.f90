!> The indicator functions of a system at the ends of the parts of a step, for all lanes of a block at once.
!>
!> Few lanes come near a boundary in a step. The others are left out of the search for crossings, which goes lane by lane.
module nocdyn_block_scan
  use nocdyn_dense_output, only: batch, sample_lanes, strip
  use nocdyn_kinds, only: wp
  use nocdyn_root_functions, only: parts_of
  use nocdyn_step_attempt, only: step_attempt_t
  use nocdyn_system, only: system_t
  implicit none (type, external)
  private

  public :: allocate_block_scan, scan_block, has_minimum

  type, public :: block_scan_t
    logical :: is_used = .false.               !! whether the system evaluates its indicators for blocks
    logical, allocatable :: is_near(:)         !! whether a lane may cross a boundary in the step, [lanes]
    integer, allocatable :: parts(:)           !! of the step of each lane
    real(wp), allocatable :: g(:, :, :)        !! [lanes, functions, 0:parts]; part 0 stays from step to step
    real(wp), allocatable, private :: t(:)     !! [s], [lanes]
    real(wp), allocatable, private :: theta(:, :)   !! [lanes, batch]
    real(wp), allocatable, private :: y(:, :, :)    !! [lanes, padded columns, batch]
  end type block_scan_t

contains

  !> Allocates the data of a scan, if the system evaluates its indicators for blocks.
  subroutine allocate_block_scan(scan, system, degree, attempt)
    type(block_scan_t), intent(out) :: scan
    class(system_t), intent(in) :: system
    integer, intent(in) :: degree   !! the largest of the dense output
    type(step_attempt_t), intent(in) :: attempt

    scan%is_used = system%has_block_indicators .and. system%lanes >= strip
    if (.not. scan%is_used) return
    associate (lanes => system%lanes)
      allocate (scan%is_near(lanes), source=.true.)
      allocate (scan%parts(lanes), source=1)
      allocate (scan%g(lanes, system%switches, 0:parts_of(degree)), scan%t(lanes), scan%theta(lanes, batch), &
                scan%y(lanes, size(attempt%y, 2), batch), source=0.0_wp)
    end associate
  end subroutine allocate_block_scan

  !> Evaluates the indicators in the last steps of the lanes that have taken one.
  subroutine scan_block(scan, system, attempt, coefficients, taken, side)
    type(block_scan_t), intent(inout) :: scan
    class(system_t), intent(inout) :: system
    type(step_attempt_t), intent(in) :: attempt
    real(wp), contiguous, intent(in) :: coefficients(:, :, :)   !! of the dense output, [lanes, padded columns, degree]
    logical, intent(in) :: taken(:)                             !! [lanes]
    integer, intent(in) :: side(:, :)                           !! signs at the starts of the steps, [lanes, functions]
    integer :: columns, function, i, l, part, parts

    columns = size(scan%y, 2)
    scan%parts(:) = parts_of(attempt%degree)
    parts = maxval(scan%parts, mask=taken)
    do part = 0, parts - 1, batch
      do i = 1, batch
        scan%theta(:, i) = 1.0_wp * min(part + i, scan%parts) / scan%parts
      end do
      call sample_lanes(attempt%lanes, columns, maxval(attempt%degree, mask=taken), attempt%y, coefficients, taken, scan%theta, &
                        scan%y)
      do i = 1, min(batch, parts - part)
        scan%t(:) = attempt%t + scan%theta(:, i) * attempt%h
        call system%block_indicators(columns, scan%t, scan%y(:, :, i), scan%g(:, :, part + i))
      end do
    end do
    call find_near(attempt%lanes, size(side, 2), parts, taken, side, scan%g, scan%is_near)
    ! the ends of the steps of lanes that cross nothing are the starts of their next ones
    do function = 1, size(scan%g, 2)
      do l = 1, size(taken)
        if (taken(l) .and. .not. scan%is_near(l)) scan%g(l, function, 0) = scan%g(l, function, parts)
      end do
    end do
  end subroutine scan_block

  !> Finds the lanes that may cross a boundary: all others have positive indicators, none of which is at the lowest point of a
  !> parabola between two parts.
  pure subroutine find_near(lanes, functions, parts, taken, side, g, is_near)
    integer, intent(in) :: lanes, functions, parts
    logical, intent(in) :: taken(lanes)
    integer, intent(in) :: side(lanes, functions)
    real(wp), intent(in) :: g(lanes, functions, 0:parts)
    logical, intent(inout) :: is_near(lanes)
    integer :: function, l, part

    is_near = .false.
    do function = 1, functions
      do l = 1, lanes
        is_near(l) = is_near(l) .or. side(l, function) < 1
      end do
      do part = 1, parts
        do l = 1, lanes
          is_near(l) = is_near(l) .or. .not. g(l, function, part) > 0
        end do
      end do
      do part = 1, parts - 1
        do l = 1, lanes
          associate (before => g(l, function, part - 1), middle => g(l, function, part), after => g(l, function, part + 1))
            if (taken(l)) is_near(l) = is_near(l) .or. has_minimum(before, middle, after)
          end associate
        end do
      end do
    end do
  end subroutine find_near

  !> Whether the parabola through three equidistant values has its minimum between them.
  pure logical function has_minimum(before, middle, after)
    real(wp), intent(in) :: before, middle, after

    has_minimum = abs(after - before) < 2 * ((after - middle) - (middle - before))
  end function has_minimum

end module nocdyn_block_scan
