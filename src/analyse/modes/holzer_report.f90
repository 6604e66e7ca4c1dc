!> Holzer's tables of the undamped modes, printed and as holzer.csv.
module nocdyn_holzer_report
  use nocdyn_csv, only: text_cell
  use nocdyn_errors, only: error_t
  use nocdyn_holzer, only: edge_coupling, edge_none, holzer_line_t, holzer_t, new_holzer
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_modes_report, only: modes_report_t
  use nocdyn_table_text, only: cell, cell_width, padded, text_width
  use nocdyn_text, only: rounded_text, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: holzer_tables

  integer, parameter :: most_modes = 12   ! that are printed
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)

contains

  !> The tables of all modes with elastic energy, as printed and as CSV. A machine that is no tree of couplings and gears is
  !> refused.
  subroutine holzer_tables(report, printed, csv, error)
    type(modes_report_t), intent(in) :: report
    character(len=:), allocatable, intent(out) :: printed, csv
    type(error_t), allocatable, intent(out) :: error
    type(holzer_t) :: holzer
    type(text_buffer_t) :: lines, rows
    real(wp), allocatable :: shape(:), theta(:), torque(:), total(:)
    integer :: m, number

    call new_holzer(report%machine, report%linear, holzer, error)
    if (allocated(error)) return
    allocate (theta(size(holzer%lines)), torque(size(holzer%lines)), total(size(holzer%lines)), shape(report%machine%bodies))
    call rows%append_line('mode,frequency [Hz],body,inertia [kg m2],J omega^2 [N m/rad],theta [1],J omega^2 theta [N m],' // &
                          'sum [N m],to,by,stiffness [N m/rad],ratio [1],twist [rad]')
    number = 0
    associate (linear => report%linear, machine => report%machine)
      do m = 1, size(linear%natural)
        if (.not. linear%natural(m) > 0) cycle
        number = number + 1
        shape = machine%coordinates%body_speeds(1, linear%shapes(:, m))
        call holzer%fill(machine, shape, linear%natural(m), theta, torque, total)
        call put_rows(machine, holzer, number, linear%natural(m), theta, torque, total, rows)
        if (number > most_modes) cycle
        call lines%append_line('  Holzer table of undamped mode ' // to_text(number) // ', ' // &
                               rounded_text(linear%natural(m) / turn, 8) // ' Hz, omega^2 = ' // &
                               rounded_text(linear%natural(m)**2, 8) // ' 1/s2')
        call put_table(machine, holzer, linear%natural(m), theta, torque, total, lines)
      end do
    end associate
    if (number > most_modes) call lines%append_line('  (' // to_text(number - most_modes) // ' more with --out, in holzer.csv)')
    printed = lines%text()
    csv = rows%text()
  end subroutine holzer_tables

  subroutine put_table(machine, holzer, omega, theta, torque, total, lines)
    type(machine_t), intent(in) :: machine
    type(holzer_t), intent(in) :: holzer
    real(wp), intent(in) :: omega                         !! natural frequency [rad/s]
    real(wp), intent(in) :: theta(:), torque(:), total(:) !! as `fill` gives them
    type(text_buffer_t), intent(inout) :: lines
    character(len=:), allocatable :: edge
    integer :: i, width

    width = maxval([4, (text_width(machine%names(i)%text), i=1, machine%bodies)])
    call lines%append_line('  ' // padded('body', width) // cell('J [kg m2]') // cell('J omega^2') // cell('theta') // &
                           cell('torque [N m]') // cell('sum [N m]') // cell('k [N m/rad]') // cell('sum / k') // '  by')
    do i = 1, size(holzer%lines)
      associate (line => holzer%lines(i), inertia => machine%inertia(1, holzer%lines(i)%body))
        edge = '  ' // padded(machine%names(line%body)%text, width) // cell(inertia) // cell(inertia * omega**2) // &
               cell(theta(i)) // cell(torque(i)) // cell(total(i))
        select case (line%edge)
        case (edge_coupling)
          edge = edge // cell(line%stiffness) // cell(total(i) / line%stiffness)
        case default
          if (line%next > 0) edge = edge // cell('ratio') // cell(line%ratio)
          if (line%next == 0) edge = edge // repeat(' ', 2 * cell_width)
        end select
        if (line%edge /= edge_none) edge = edge // '  ' // line%name(machine) // ' to ' // next_name(machine, line)
        if (line%edge == edge_none) edge = edge // '  remainder'
        call lines%append_line(edge)
      end associate
    end do
  end subroutine put_table

  subroutine put_rows(machine, holzer, number, omega, theta, torque, total, rows)
    type(machine_t), intent(in) :: machine
    type(holzer_t), intent(in) :: holzer
    integer, intent(in) :: number   !! of the mode
    real(wp), intent(in) :: omega                         !! natural frequency [rad/s]
    real(wp), intent(in) :: theta(:), torque(:), total(:) !! as `fill` gives them
    type(text_buffer_t), intent(inout) :: rows
    integer :: i

    do i = 1, size(holzer%lines)
      associate (line => holzer%lines(i), inertia => machine%inertia(1, holzer%lines(i)%body))
        call rows%append(to_text(number) // ',' // to_text(omega / turn) // ',')
        call rows%append(text_cell(machine%names(line%body)%text) // ',' // to_text(inertia) // ',')
        call rows%append(to_text(inertia * omega**2) // ',' // to_text(theta(i)) // ',' // &
                         to_text(torque(i)) // ',' // to_text(total(i)) // ',')
        if (line%edge /= edge_none) call rows%append(text_cell(next_name(machine, line)) // ',' // &
                                                     text_cell(line%name(machine)))
        if (line%edge == edge_none) call rows%append(',')
        call rows%append(',')
        if (line%edge == edge_coupling) call rows%append(to_text(line%stiffness))
        call rows%append(',')
        if (line%edge /= edge_coupling .and. line%next > 0) call rows%append(to_text(line%ratio))
        call rows%append(',')
        if (line%edge == edge_coupling) call rows%append(to_text(total(i) / line%stiffness))
        call rows%append_line('')
      end associate
    end do
  end subroutine put_rows

  !> The name of what a line leads to: the next body or the ground.
  function next_name(machine, line) result(name)
    type(machine_t), intent(in) :: machine
    type(holzer_line_t), intent(in) :: line
    character(len=:), allocatable :: name

    name = 'ground'
    if (line%next > 0) name = machine%names(line%next)%text
  end function next_name

end module nocdyn_holzer_report
