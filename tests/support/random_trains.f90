!> Random machines with all kinds of rigid joints: gears, planetary sets, differentials and general rows, some on the ground, in
!> loops or redundant.
!>
!> The columns of a dense matrix span the motions that the rows allow. Each independent row removes one of them. A row that would
!> leave a body hardly any motion is dropped, so that no machine locks.
module nocdyn_test_random_trains
  use nocdyn_complement, only: complement_natural
  use nocdyn_constraints, only: new_constraints
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_test_machines, only: machine_of_bodies, finish, numbered_names
  use nocdyn_test_random, only: random_stream, random_stream_t
  use nocdyn_test_random_machines, only: add_couplings, add_torques, drawn
  implicit none (type, external)
  private

  public :: draw_train

  real(wp), parameter :: slowest = 0.05_wp, fastest = 20.0_wp   !! limits of the motion of each body
  real(wp), parameter :: rounding = 1.0e-10_wp                  !! a row that changes the motions by less is redundant

  !> Dense rows and the motions that they allow.
  type :: growth_t
    integer :: rows = 0
    real(wp), allocatable :: row(:, :)       !! [bodies, rows]
    real(wp), allocatable :: motion(:, :)    !! [bodies, freedoms]
    logical, allocatable :: is_independent(:)
  end type growth_t

contains

  !> A machine with elements of all kinds. The rows of each lane are those of the first, with other units of the speeds of
  !> the bodies and other factors of the rows, so that the same rows are redundant.
  subroutine draw_train(seed, bodies, lanes, machine, is_independent)
    integer, intent(in) :: seed, bodies, lanes
    class(machine_t), allocatable, intent(out) :: machine
    logical, allocatable, intent(out) :: is_independent(:)   !! whether a row is independent of those before it
    type(random_stream_t) :: layout, numbers(lanes)
    type(growth_t) :: growth
    integer :: i, l

    layout = random_stream(seed)
    do l = 1, lanes
      numbers(l) = random_stream(1000 * seed + l)
    end do
    call start_growth(bodies, growth)
    do i = 2, bodies
      call add_joint(layout, i, growth)
    end do
    do i = 1, bodies / 4
      call close_loop(layout, growth)
      call repeat_rows(layout, growth)
    end do
    machine = machine_of_bodies(drawn(numbers, 0.5_wp, 10.0_wp, bodies))
    call take_rows(growth, drawn(numbers, 0.5_wp, 2.0_wp, bodies), drawn(numbers, 0.5_wp, 2.0_wp, growth%rows), machine)
    is_independent = growth%is_independent(:growth%rows)
    call add_couplings(layout, numbers, machine)
    call add_torques(layout, numbers, machine)
    call finish(machine, [integer ::], complement_natural)
  end subroutine draw_train

  subroutine start_growth(bodies, growth)
    integer, intent(in) :: bodies
    type(growth_t), intent(inout) :: growth
    integer :: b

    allocate (growth%row(bodies, 3 * bodies), growth%is_independent(3 * bodies))
    allocate (growth%motion(bodies, bodies), source=0.0_wp)
    do b = 1, bodies
      growth%motion(b, b) = 1.0_wp
    end do
  end subroutine start_growth

  !> Joins a body to earlier ones, or leaves it free.
  subroutine add_joint(layout, body, growth)
    type(random_stream_t), intent(inout) :: layout
    integer, intent(in) :: body
    type(growth_t), intent(inout) :: growth
    real(wp) :: row(size(growth%row, 1)), teeth
    integer :: a, b, i
    logical :: case_first

    row = 0.0_wp
    a = layout%whole(1, body - 1)
    b = layout%whole(1, body - 1)
    teeth = layout%number(1.5_wp, 5.0_wp)
    select case (layout%whole(1, 10))
    case (1:3)   ! a gear
      row(a) = layout%number(0.5_wp, 2.0_wp)
      row(body) = layout%number(-1.0_wp, 1.0_wp)
      row(body) = row(body) + sign(0.5_wp, row(body))
    case (4)     ! a planetary set with its ring on the ground
      row(a) = 1.0_wp
      row(body) = -(1.0_wp + teeth)
    case (5:6)   ! a planetary set, its members in any order
      row([body, a]) = [1.0_wp, teeth]
      if (layout%whole(1, 2) == 1) row([a, body]) = [1.0_wp, teeth]
      row(b) = -(1.0_wp + teeth)   ! a and b may be equal
    case (7)     ! a differential, the case first or last
      case_first = layout%whole(1, 2) == 1
      row(a) = 1.0_wp
      row(b) = merge(1.0_wp, -2.0_wp, case_first)
      row(body) = merge(-2.0_wp, 1.0_wp, case_first)
    case (8)     ! a general row
      row(body) = layout%number(0.5_wp, 1.5_wp)
      do i = 1, layout%whole(1, 4)
        a = layout%whole(1, body - 1)   ! on a line of its own: the order of calls within a statement is the compiler's
        row(a) = layout%number(-1.0_wp, 1.0_wp)
      end do
    case default
      return
    end select
    call take_row(row, .true., growth)
  end subroutine add_joint

  !> Adds a row between any bodies, unless it locks one.
  subroutine close_loop(layout, growth)
    type(random_stream_t), intent(inout) :: layout
    type(growth_t), intent(inout) :: growth
    real(wp) :: row(size(growth%row, 1))
    integer :: body, i

    row = 0.0_wp
    do i = 1, layout%whole(2, 4)
      body = layout%whole(1, size(row))
      row(body) = layout%number(0.5_wp, 2.0_wp)
    end do
    call take_row(row, .true., growth)
  end subroutine close_loop

  !> Adds a row that is a combination of one or two others.
  subroutine repeat_rows(layout, growth)
    type(random_stream_t), intent(inout) :: layout
    type(growth_t), intent(inout) :: growth
    real(wp) :: row(size(growth%row, 1)), factor

    if (growth%rows == 0) return
    factor = layout%number(0.5_wp, 2.0_wp)
    row = factor * growth%row(:, layout%whole(1, growth%rows))
    if (layout%whole(1, 2) == 1) row = row - growth%row(:, layout%whole(1, growth%rows))
    where (abs(row) <= rounding) row = 0.0_wp
    call take_row(row, .false., growth)
  end subroutine repeat_rows

  !> Adds a row that relates at least two bodies, unless it leaves a body too little motion.
  subroutine take_row(row, must_bind, growth)
    real(wp), intent(in) :: row(:)
    logical, intent(in) :: must_bind   !! whether the row must be independent; otherwise it must be redundant
    type(growth_t), intent(inout) :: growth
    real(wp) :: left(size(row), size(growth%motion, 2)), lost(size(growth%motion, 2))
    integer :: j, pivot
    logical :: binds

    if (count(abs(row) > 0.0_wp) < 2 .or. growth%rows == size(growth%row, 2)) return
    lost = matmul(row, growth%motion)
    pivot = maxloc(abs(lost), dim=1)
    binds = abs(lost(pivot)) > rounding
    if (binds .neqv. must_bind) return
    if (binds) then
      do j = 1, size(lost)
        left(:, j) = growth%motion(:, j) - lost(j) / lost(pivot) * growth%motion(:, pivot)
      end do
      left(:, pivot:size(lost) - 1) = left(:, pivot + 1:)
      if (minval(maxval(abs(left(:, :size(lost) - 1)), dim=2)) < slowest .or. maxval(abs(left)) > fastest) return
      growth%motion = left(:, :size(lost) - 1)
    end if
    growth%rows = growth%rows + 1
    growth%row(:, growth%rows) = row
    growth%is_independent(growth%rows) = binds
  end subroutine take_row

  subroutine take_rows(growth, unit, factor, machine)
    type(growth_t), intent(in) :: growth
    real(wp), intent(in) :: unit(:, :)     !! of the speed of each body, [lanes, bodies]
    real(wp), intent(in) :: factor(:, :)   !! of each row, [lanes, rows]
    type(machine_t), intent(inout) :: machine
    integer :: body(count(abs(growth%row(:, :growth%rows)) > 0.0_wp)), first(growth%rows + 1)
    integer :: b, next, r
    real(wp) :: coefficient(size(unit, 1), size(body))

    next = 1
    do r = 1, growth%rows
      first(r) = next
      do b = 1, size(growth%row, 1)
        if (abs(growth%row(b, r)) <= 0.0_wp) cycle
        body(next) = b
        coefficient(:, next) = factor(:, r) * growth%row(b, r) * unit(:, b)
        next = next + 1
      end do
    end do
    first(size(first)) = next
    machine%constraints = new_constraints(machine%bodies, numbered_names('row', growth%rows), &
                                          numbered_names('N m', growth%rows), first, body, coefficient)
  end subroutine take_rows

end module nocdyn_test_random_trains
