!> Branches in the journal of an analysis: an entry for each step, with the new points and the place of the walk, and one for the
!> end. Fields that are added to a point or to an orbit must be packed here too.
module nocdyn_orbit_checkpoints
  use nocdyn_bytes, only: byte_reader_t, put_integers, put_reals, put_text
  use nocdyn_errors, only: error_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_log, only: orbit_log_t
  use nocdyn_orbit_points, only: branch_t, walk_t
  use nocdyn_orbit_problem, only: orbit_point_t, orbit_problem_t
  use nocdyn_orbit_settings, only: orbit_settings_t
  implicit none (type, external)
  private

  public :: keep_end, keep_step, recall_branch

contains

  !> Keeps the points of a branch that are new, and where the walk stands. Nothing without a journal.
  subroutine keep_step(problem, branch, walk, step, kept, error)
    class(orbit_problem_t), intent(in) :: problem
    type(branch_t), intent(in) :: branch
    type(walk_t), intent(in) :: walk
    real(wp), intent(in) :: step
    integer, intent(inout) :: kept          !! points of the branch in the journal
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: bytes
    integer :: used

    if (.not. associated(walk%settings%log)) return
    allocate (character(len=4096) :: bytes)
    used = 0
    call pack_points(walk%settings%log, branch, kept, bytes, used)
    call put_integers(bytes, used, [0, size(walk%x)])
    call pack_point(walk%point, bytes, used)
    call put_reals(bytes, used, reshape([walk%x, walk%tangent, walk%weights, step, problem%least_size()], &
                                       [3 * size(walk%x) + 2, 1]))
    call walk%settings%log%put(bytes(:used), error)
    kept = branch%count
  end subroutine keep_step

  !> Keeps the end of a branch.
  subroutine keep_end(settings, branch, kept, error)
    type(orbit_settings_t), intent(in) :: settings
    type(branch_t), intent(in) :: branch
    integer, intent(in) :: kept
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: bytes
    integer :: used

    if (.not. associated(settings%log)) return
    allocate (character(len=4096) :: bytes)
    used = 0
    call pack_points(settings%log, branch, kept, bytes, used)
    call put_integers(bytes, used, [1, merge(1, 0, branch%is_closed) + merge(2, 0, branch%is_back)])
    call put_text(bytes, used, branch%ending)
    call settings%log%put(bytes(:used), error)
  end subroutine keep_end

  !> Recalls the branch that begins now: as far as the journal has it.
  subroutine recall_branch(problem, branch, walk, step, is_whole, error)
    class(orbit_problem_t), intent(inout) :: problem
    type(branch_t), intent(inout) :: branch    !! has points if the journal has some
    type(walk_t), intent(inout) :: walk        !! the first motion; where it stands if the journal has points
    real(wp), intent(inout) :: step
    logical, intent(out) :: is_whole           !! whether it has ended
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: bytes
    type(byte_reader_t) :: reader
    real(wp), allocatable :: numbers(:, :)
    integer :: head(2)

    is_whole = .false.
    if (.not. associated(walk%settings%log)) return
    walk%settings%log%walks = walk%settings%log%walks + 1
    do while (.not. is_whole)
      call walk%settings%log%read_next(bytes, goes_on=.false.)
      if (bytes == '') exit
      reader = byte_reader_t()
      call reader%take_integers(bytes, head)
      if (head(1) /= walk%settings%log%walks) exit
      call walk%settings%log%read_next(bytes, goes_on=.true.)
      call unpack_points(head(2), bytes, reader, branch)
      call reader%take_integers(bytes, head)
      is_whole = head(1) == 1
      if (is_whole) then
        branch%is_closed = modulo(head(2), 2) == 1
        branch%is_back = head(2) >= 2
        call reader%take_text(bytes, branch%ending)
      else
        call unpack_point(bytes, reader, walk%point)
        if (allocated(numbers)) deallocate (numbers)
        allocate (numbers(3 * head(2) + 2, 1))
        call reader%take_reals(bytes, numbers)
      end if
    end do
    if (is_whole .or. branch%count == 0) return
    associate (n => size(numbers, 1) / 3)
      walk%x = numbers(:n, 1)
      walk%tangent = numbers(n + 1:2 * n, 1)
      walk%weights = numbers(2 * n + 1:3 * n, 1)
      step = numbers(3 * n + 1, 1)
      call problem%restore(walk%point, numbers(3 * n + 2, 1), error)
    end associate
  end subroutine recall_branch

  !> Packs the number of the branch, and its points after some.
  subroutine pack_points(log, branch, kept, bytes, used)
    type(orbit_log_t), intent(in) :: log
    type(branch_t), intent(in) :: branch
    integer, intent(in) :: kept
    character(len=:), allocatable, intent(inout) :: bytes
    integer, intent(inout) :: used
    integer :: i

    call put_integers(bytes, used, [log%walks, branch%count - kept])
    do i = kept + 1, branch%count
      call pack_point(branch%points(i), bytes, used)
    end do
  end subroutine pack_points

  subroutine unpack_points(count, bytes, reader, branch)
    integer, intent(in) :: count
    character(len=*), intent(in) :: bytes
    type(byte_reader_t), intent(inout) :: reader
    type(branch_t), intent(inout) :: branch
    type(orbit_point_t) :: point
    integer :: i

    do i = 1, count
      call unpack_point(bytes, reader, point)
      call branch%add(point)
    end do
  end subroutine unpack_points

  subroutine pack_point(point, bytes, used)
    type(orbit_point_t), intent(in) :: point
    character(len=:), allocatable, intent(inout) :: bytes
    integer, intent(inout) :: used
    real(wp) :: parts(2, size(point%multipliers))
    integer :: states

    associate (orbit => point%orbit)
      states = 0
      if (allocated(orbit%state)) states = size(orbit%state)
      parts(1, :) = real(point%multipliers, wp)
      parts(2, :) = aimag(point%multipliers)
      call put_integers(bytes, used, [shape(orbit%series), size(orbit%speed), size(point%multipliers), point%harmonics, &
                                      point%branch, point%crossed, orbit%subharmonic, point%leads_to, &
                                      merge(1, 0, point%is_supercritical), states])
      call put_reals(bytes, used, reshape([orbit%value, orbit%rate, orbit%torque, orbit%damping, point%direction, &
                                                point%error], [6, 1]))
      call put_reals(bytes, used, orbit%series)
      call put_reals(bytes, used, reshape(orbit%speed, [size(orbit%speed), 1]))
      call put_reals(bytes, used, parts)
      if (states > 0) call put_reals(bytes, used, reshape(orbit%state, [states, 1]))
      call put_text(bytes, used, point%kind)
    end associate
  end subroutine pack_point

  subroutine unpack_point(bytes, reader, point)
    character(len=*), intent(in) :: bytes
    type(byte_reader_t), intent(inout) :: reader
    type(orbit_point_t), intent(inout) :: point
    real(wp), allocatable :: parts(:, :), speed(:, :), state(:, :)
    real(wp) :: numbers(6, 1)
    integer :: sizes(11)

    call reader%take_integers(bytes, sizes)
    call reader%take_reals(bytes, numbers)
    associate (orbit => point%orbit)
      if (allocated(orbit%series)) deallocate (orbit%series)
      allocate (orbit%series(sizes(1), sizes(2)), speed(sizes(3), 1), parts(2, sizes(4)))
      orbit%value = numbers(1, 1)
      orbit%rate = numbers(2, 1)
      orbit%torque = numbers(3, 1)
      orbit%damping = numbers(4, 1)
      point%direction = numbers(5, 1)
      point%error = numbers(6, 1)
      call reader%take_reals(bytes, orbit%series)
      call reader%take_reals(bytes, speed)
      call reader%take_reals(bytes, parts)
      if (allocated(orbit%state)) deallocate (orbit%state)
      if (sizes(11) > 0) then
        allocate (state(sizes(11), 1))
        call reader%take_reals(bytes, state)
        orbit%state = state(:, 1)
      end if
      call reader%take_text(bytes, point%kind)
      orbit%speed = speed(:, 1)
    end associate
    point%multipliers = cmplx(parts(1, :), parts(2, :), wp)
    point%harmonics = sizes(5)
    point%branch = sizes(6)
    point%crossed = sizes(7)
    point%orbit%subharmonic = sizes(8)
    point%leads_to = sizes(9)
    point%is_supercritical = sizes(10) == 1
  end subroutine unpack_point

end module nocdyn_orbit_checkpoints
