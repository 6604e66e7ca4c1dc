!> The start of rows that move (cardan joints, cranks, relations, drives): their rank there, and start speeds that fulfil them.
!>
!> Speeds that are not given follow from the others. Speeds that contradict a row are refused, or replaced by the nearest that
!> satisfy all rows, as after an impact; the ones of `nocdyn_start_speeds` come before.
module nocdyn_moving_start
  use nocdyn_bank, only: role_drive, role_names
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank, pseudo_inverse
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_row_motions, only: new_row_motions, row_motions_t
  use nocdyn_text, only: append, rounded_text
  use nocdyn_written_values, only: speed_text, unit_of
  implicit none (type, external)
  private

  public :: fit_moving_rows

  real(wp), parameter :: tolerance = 1.0e-9_wp     ! of speeds, relative to the terms of a row
  real(wp), parameter :: rank_tolerance = 1.0e-11_wp

  !> A speed' = demand, with the speeds of the coordinates.
  type :: moving_start_t
    type(row_motions_t) :: motions
    real(wp), allocatable :: a(:, :)          !! [rows, coordinates]
    real(wp), allocatable :: demand(:)        !! [rad/s] or [m/s], [rows]
    real(wp), allocatable :: speed(:)         !! of the coordinates [rad/s]
    real(wp), allocatable :: complement(:, :) !! L_tau, [bodies, coordinates]
  end type moving_start_t

contains

  !> Completes, checks or projects the start speeds of a machine.
  subroutine fit_moving_rows(input, machine, is_given, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(inout) :: machine   !! its coordinates are built
    logical, intent(in) :: is_given(:)          !! whether the start speed of a body is given, [bodies]
    type(error_t), allocatable, intent(out) :: error
    type(moving_start_t) :: start

    start%motions = new_row_motions(machine%banks)
    if (start%motions%count == 0) return
    associate (run => input%groups(input%position('run')))
      call form_rows(machine, run%number('t_start'), start)
      call refuse_dependent_drives(input, machine, start, error)
      if (allocated(error)) return
      if (all(residuals(start) <= tolerance)) return
      if (run%text('start') == 'projected') then
        call project_start(machine, start)
      else
        call follow_rows(input, machine, is_given, start, error)
      end if
    end associate
  end subroutine fit_moving_rows

  !> The rows at the start.
  subroutine form_rows(machine, t, start)
    type(machine_t), intent(inout) :: machine
    real(wp), intent(in) :: t   !! [s]
    type(moving_start_t), intent(inout) :: start
    type(machine_state_t) :: state
    real(wp) :: row(machine%bodies), twist(machine%lanes, machine%elements%count)
    integer :: i

    state = new_machine_state(machine)
    call state%choose_branches(machine, spread(t, 1, machine%lanes))   ! the ones of tables over the time
    twist = machine%start_twist()
    associate (motions => start%motions, rows => machine%elements%rows)
      call motions%set_start(machine%banks, state%banks, twist(1, :))
      call motions%move(machine%banks, state%banks, t, twist(1, :), 0.0_wp * twist(1, :))
      allocate (start%complement, source=machine%coordinates%complement(1))
      allocate (start%a(motions%count, machine%coordinates%freedoms), start%speed(machine%coordinates%freedoms))
      do i = 1, motions%count
        row = 0.0_wp
        call rows%add_moment(motions%element(i), 1.0_wp, row)
        if (motions%driver(i) > 0) call rows%add_moment(motions%driver(i), -motions%g(1, i), row)
        start%a(i, :) = matmul(row, start%complement)
      end do
      start%demand = motions%speed
    end associate
    call machine%coordinates%project(1, machine%inertia(1, :), machine%start_speed(1, :), start%speed)
  end subroutine form_rows

  !> How far the speeds are from fulfilling each row, relative to the largest speeds.
  pure function residuals(start) result(residual)
    type(moving_start_t), intent(in) :: start
    real(wp) :: residual(size(start%demand))

    residual = abs(matmul(start%a, start%speed) - start%demand)
    residual = residual / max(maxval(abs(start%a), dim=2) * maxval(abs(start%speed)) + abs(start%demand), tiny(1.0_wp))
  end function residuals

  !> Two drives that move the same bodies have no torques of their own.
  subroutine refuse_dependent_drives(input, machine, start, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(moving_start_t), intent(in) :: start
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: columns(size(start%a, 2), size(start%a, 1))
    integer :: i, pivots(size(start%a, 1)), rank

    do i = 1, size(columns, 2)
      columns(:, i) = start%a(i, :) / max(maxval(abs(start%a(i, :))), tiny(1.0_wp))
    end do
    call pivoted_rank(columns, rank_tolerance, rank, pivots)
    do i = rank + 1, size(pivots)
      if (machine%banks(start%motions%bank(pivots(i)))%bank%role /= role_drive) cycle
      call raise(error, exit_input, input%location(group_of(input, machine, start, pivots(i))) // ': other drives and ' // &
                 'joints already prescribe this motion; allowed: one drive of each motion')
      return
    end do
  end subroutine refuse_dependent_drives

  !> Changes the speeds that are not given as little as possible.
  subroutine follow_rows(input, machine, is_given, start, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(inout) :: machine
    logical, intent(in) :: is_given(:)
    type(moving_start_t), intent(inout) :: start
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: change(:), equations(:, :), missing(:)
    integer, allocatable :: given(:)
    integer :: b, row

    given = pack([(b, b=1, size(is_given))], is_given)
    allocate (equations(size(start%demand) + size(given), size(start%speed)), missing(size(start%demand) + size(given)))
    equations(:size(start%demand), :) = start%a
    equations(size(start%demand) + 1:, :) = start%complement(given, :)
    missing = 0.0_wp
    missing(:size(start%demand)) = start%demand - matmul(start%a, start%speed)
    change = matmul(pseudo_inverse(equations, rank_tolerance), missing)
    start%speed = start%speed + change
    missing(size(start%demand) + 1:) = matmul(start%complement(given, :), change)   ! of the given speeds
    if (all(residuals(start) <= tolerance) .and. &
        all(abs(missing(size(start%demand) + 1:)) <= tolerance * maxval(abs(start%speed)))) then
      call set_speeds(machine, start)
      return
    end if
    start%speed = start%speed - change
    row = maxloc(residuals(start), dim=1)
    call refuse_speeds(input, group_of(input, machine, start, row), row, start, error)
  end subroutine follow_rows

  !> The message on the row that the start speeds violate most; speeds of a drive are in the unit in which it is written.
  subroutine refuse_speeds(input, group, row, start, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group, row   !! group of the row
    type(moving_start_t), intent(in) :: start
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text
    real(wp) :: difference
    integer :: unit

    difference = dot_product(start%a(row, :), start%speed) - start%demand(row)
    if (start%motions%driver(row) == 0) then
      unit = max(unit_of(input%groups(group), 'speed'), unit_of(input%groups(group), 'table_speed'), &
                 unit_of(input%groups(group), 'speed_amplitude'))
      text = speed_text(difference, unit, 6) // ' from those of the drive, ' // speed_text(start%demand(row), unit, 15) // &
             '; allowed: these, or a drive that begins with a ramp'
    else
      text = rounded_text(difference, 6) // ' rad/s (m/s of a slider) at this position, where the ratio is ' // &
             rounded_text(start%motions%g(1, row), 12)
    end if
    call raise(error, exit_input, input%location(group) // ': the start speeds violate it: they differ by ' // text // &
               "; &run start = 'projected' takes the nearest speeds that fit")
  end subroutine refuse_speeds

  !> The nearest speeds, weighted by the inertias.
  subroutine project_start(machine, start)
    type(machine_t), intent(inout) :: machine
    type(moving_start_t), intent(inout) :: start
    real(wp) :: mass(size(start%speed), size(start%speed)), change(size(start%speed))
    real(wp) :: energy, response(size(start%speed), size(start%demand))
    integer :: k

    do k = 1, size(start%speed)
      mass(:, k) = matmul(machine%inertia(1, :) * start%complement(:, k), start%complement)
    end do
    response = matmul(pseudo_inverse(mass, rank_tolerance), transpose(start%a))
    change = matmul(response, matmul(pseudo_inverse(matmul(start%a, response), rank_tolerance), &
                                     start%demand - matmul(start%a, start%speed)))
    start%speed = start%speed + change
    call set_speeds(machine, start)
    energy = 0.5_wp * dot_product(change, matmul(mass, change))
    call append(machine%start_notes, 'the start speeds were projected on joints and drives; the energy of the changes is ' // &
                rounded_text(energy, 6) // ' J')
  end subroutine project_start

  !> L_tau speed.
  subroutine set_speeds(machine, start)
    type(machine_t), intent(inout) :: machine
    type(moving_start_t), intent(in) :: start

    machine%start_speed(:, :) = spread(matmul(start%complement, start%speed), 1, machine%lanes)
  end subroutine set_speeds

  !> The group of a row.
  integer function group_of(input, machine, start, row) result(group)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(moving_start_t), intent(in) :: start
    integer, intent(in) :: row
    integer, allocatable :: groups(:)
    integer :: i

    associate (bank => machine%banks(start%motions%bank(row))%bank, number => start%motions%number(row))
      allocate (groups, source=input%groups_named(trim(role_names(bank%role))))
      do i = 1, size(groups)
        if (input%groups(groups(i))%name == bank%names(number)%text) group = groups(i)
      end do
    end associate
  end function group_of

end module nocdyn_moving_start
