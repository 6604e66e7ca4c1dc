!> Consistent start speeds: those that are not given follow from the others; those that violate constraints are refused, or
!> replaced by the nearest that satisfy them.
!>
!> omega* = L_tau (L_tau^T J L_tau)^-1 L_tau^T J omega minimises the kinetic energy of the difference. These are the speeds
!> after an impact, in which impulses of the constraints act.
module nocdyn_start_speeds
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_followed_speeds, only: follow_speeds
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: quoted, rounded_text, to_text
  use nocdyn_units, only: from_si
  use nocdyn_written_values, only: speed_text
  implicit none (type, external)
  private

  public :: fit_start_speeds

  !> Start speeds violate a row if the sum of its terms exceeds this times the sum of their absolute values.
  real(wp), parameter :: speed_tolerance = 1.0e-9_wp

  real(wp), parameter :: least_impulse = 1.0e-12_wp   ! relative to the largest one; smaller ones are rounding errors
  integer, parameter :: most_bodies = 12   ! that a message names
  integer, parameter :: digits = 15        ! of the nearest speeds, enough to satisfy the constraints as input

contains

  !> Completes and checks the start speeds of a machine. If they may be projected, projects the ones of the groups with violated
  !> rows; speeds that are not given count as 0 then.
  subroutine fit_start_speeds(machine, is_given, may_project, unit, offending_row, error)
    type(machine_t), intent(inout) :: machine
    logical, intent(in) :: is_given(:)      !! whether the start speed of a body is given, [bodies]
    logical, intent(in) :: may_project      !! whether violations are repaired; they are errors otherwise
    integer, intent(in) :: unit             !! of speeds in messages: index of `units`, 0: rad/s
    integer, intent(out) :: offending_row   !! first violated row, 0 if there is no error
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: nearest(machine%bodies), residual, scale
    integer, allocatable :: groups(:), violated(:)
    character(len=:), allocatable :: message, row
    integer :: b, entry, g, i, last
    logical :: is_consistent
    integer, allocatable :: others(:)   ! bodies with another speed

    offending_row = 0
    allocate (violated, source=violated_rows(machine))
    if (size(violated) == 0) return
    if (.not. may_project) then
      allocate (groups, source=violated_groups(machine, violated))
      do g = 1, size(groups)
        call follow_speeds(machine, groups(g), is_given, is_consistent)
      end do
      violated = violated_rows(machine)
      if (size(violated) == 0) return
    end if
    nearest = nearest_speeds(machine, violated)
    if (may_project) then
      call project_start(nearest, machine)
    else
      offending_row = violated(1)
      ! "the start speeds violate this gear: 2 * 1 rad/s ('pinion') + ... = 2, which must be 0; nearest speeds that ...".
      call machine%constraints%residual(1, violated(1), machine%start_speed(1, :), residual, scale)
      ! The left-hand side of a row with the start speeds in it, e.g. "2 * 1 rad/s ('pinion') + 3 * 0 rad/s ('machine')".
      row = ''
      associate (rows => machine%constraints)
        last = min(rows%first(violated(1) + 1) - 1, rows%first(violated(1)) + most_bodies - 1)
        do entry = rows%first(violated(1)), last
          if (entry > rows%first(violated(1))) row = row // ' + '
          row = row // to_text(rows%coefficient(1, entry)) // ' * ' // &
                 speed_text(machine%start_speed(1, rows%body(entry)), unit, digits) // ' (' // &
                 quoted(machine%names(rows%body(entry))%text) // ')'
        end do
        if (last < rows%first(violated(1) + 1) - 1) row = row // ' + ' // to_text(rows%first(violated(1) + 1) - 1 - last) // &
            ' more terms'
      end associate
      message = 'the start speeds violate it: ' // row // ' = ' // rounded_text(from_si(residual, unit), 6) // &
             ', which must be 0'
      if (size(violated) > 1) message = message // ' (and ' // to_text(size(violated) - 1) // ' more)'
      message = message // '; nearest speeds that fit:'
      others = pack([(b, b=1, machine%bodies)], abs(nearest - machine%start_speed(1, :)) > speed_tolerance * abs(nearest))
      do i = 1, min(size(others), most_bodies)
        if (i > 1) message = message // ','
        message = message // ' ' // speed_text(nearest(others(i)), unit, digits) // ' (' // &
                  quoted(machine%names(others(i))%text) // ')'
      end do
      if (size(others) > most_bodies) message = message // ' and ' // to_text(size(others) - most_bodies) // ' more'
      message = message // '; &run start = ' // quoted('projected') // ' takes them'
      call raise(error, exit_input, message)
    end if
  end subroutine fit_start_speeds

  function violated_rows(machine) result(rows)
    type(machine_t), intent(in) :: machine
    integer, allocatable :: rows(:)
    real(wp) :: residual, scale
    logical :: is_violated(machine%constraints%rows())
    integer :: row

    do row = 1, size(is_violated)
      call machine%constraints%residual(1, row, machine%start_speed(1, :), residual, scale)
      is_violated(row) = abs(residual) > speed_tolerance * scale
    end do
    rows = pack([(row, row=1, size(is_violated))], is_violated)
  end function violated_rows

  !> The groups with violated rows.
  function violated_groups(machine, violated) result(groups)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: violated(:)   !! rows
    integer, allocatable :: groups(:)
    logical :: is_row_violated(machine%constraints%rows())
    integer :: g

    is_row_violated = .false.
    is_row_violated(violated) = .true.
    groups = pack([(g, g=1, size(machine%groups))], &
                  [(any(is_row_violated(machine%groups(g)%rows)), g=1, size(machine%groups))])
  end function violated_groups

  !> The start speeds, projected in the groups of the violated rows [rad/s].
  function nearest_speeds(machine, violated) result(omega)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: violated(:)   !! rows
    real(wp) :: omega(machine%bodies)
    real(wp) :: speed(machine%coordinates%freedoms), projected(machine%bodies)
    integer, allocatable :: groups(:)
    integer :: g

    omega = machine%start_speed(1, :)
    call machine%coordinates%project(1, machine%inertia(1, :), omega, speed)
    projected = machine%coordinates%body_speeds(1, speed)
    allocate (groups, source=violated_groups(machine, violated))
    do g = 1, size(groups)
      associate (bodies => machine%groups(groups(g))%bodies)
        omega(bodies) = projected(bodies)
      end associate
    end do
  end function nearest_speeds

  !> Sets the start speeds to the nearest ones; stores the impulses, L_lambda^T Lambda = J (omega* - omega), and the energy lost.
  subroutine project_start(nearest, machine)
    real(wp), intent(in) :: nearest(:)   !! [bodies] [rad/s]
    type(machine_t), intent(inout) :: machine
    real(wp) :: lambda(machine%constraints%rows()), change(machine%bodies), imbalance(machine%bodies)
    integer :: row

    change = nearest - machine%start_speed(1, :)
    imbalance = machine%inertia(1, :) * change
    call machine%coordinates%reactions%find_reactions(1, imbalance, lambda)
    allocate (machine%start_impulse)
    machine%start_impulse%row = pack([(row, row=1, size(lambda))], abs(lambda) > least_impulse * maxval(abs(lambda)))
    machine%start_impulse%impulse = lambda(machine%start_impulse%row)
    machine%start_impulse%energy_lost = 0.5_wp * sum(machine%inertia(1, :) * change**2)
    machine%start_speed(:, :) = spread(nearest, 1, machine%lanes)
  end subroutine project_start

end module nocdyn_start_speeds
