!> Holzer's tables of the undamped modes, printed and as holzer.csv.
module nocdyn_holzer_report
  use nocdyn_csv, only: text_cell
  use nocdyn_errors, only: error_t
  use nocdyn_holzer, only: edge_coupling, edge_none, holzer_line_t, holzer_t, new_holzer
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_modes_report, only: modes_report_t
  use nocdyn_table_text, only: cell, cell_width, padded, text_width
  use nocdyn_text, only: joined, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: holzer_tables

  integer, parameter :: most_modes = 12   ! that are printed
  integer, parameter :: most_names = 6    ! of shafts in a line
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)

  !> The table of a mode, as `fill` gives it.
  type :: table_t
    integer :: number = 0              !! of the mode
    real(wp) :: omega = 0.0_wp         !! its natural frequency [rad/s]
    real(wp) :: unlumped = 0.0_wp      !! the same where no inertia is lumped, 0: not known [rad/s]
    real(wp), allocatable :: theta(:), torque(:), total(:)   !! [lines]
  end type table_t

contains

  !> The tables of all modes with elastic energy, as printed and as CSV. A machine that is no tree of couplings and gears is
  !> refused. The frequencies of modes that are not lumped stand beside the others.
  subroutine holzer_tables(report, natural, lumped, printed, csv, error)
    type(modes_report_t), intent(in) :: report         !! with lumped shafts
    real(wp), intent(in) :: natural(:)                 !! of the modes with shafts as they are, ascending [rad/s]
    type(string_t), intent(in) :: lumped(:)            !! names of the shafts that were no chains of springs and masses
    character(len=:), allocatable, intent(out) :: printed, csv
    type(error_t), allocatable, intent(out) :: error
    type(holzer_t) :: holzer
    type(table_t) :: table
    type(text_buffer_t) :: lines, rows
    real(wp), allocatable :: unlumped(:)
    integer :: m

    call new_holzer(report%machine, report%linear, holzer, error)
    if (allocated(error)) return
    allocate (table%theta(size(holzer%lines)), table%torque(size(holzer%lines)), table%total(size(holzer%lines)))
    call rows%append_line('mode,frequency [Hz],body,inertia [kg m2],J omega^2 [N m/rad],theta [1],J omega^2 theta [N m],' // &
                          'sum [N m],to,by,stiffness [N m/rad],ratio [1],twist [rad],frequency in modes.csv [Hz]')
    if (size(lumped) > 0) then
      call lines%append_line('  the inertia of ' // joined(lumped, ', ', most_names) // ' is lumped in these tables, at as ' // &
                             'many nodes as the modes have')
    end if
    allocate (unlumped, source=pack(natural, natural > 0))
    associate (linear => report%linear, machine => report%machine)
      do m = 1, size(linear%natural)
        if (.not. linear%natural(m) > 0) cycle
        table%number = linear%below + m - count(.not. linear%natural(:m) > 0)
        table%omega = linear%natural(m)
        table%unlumped = 0.0_wp
        if (table%number - linear%below <= size(unlumped)) table%unlumped = unlumped(table%number - linear%below)
        call holzer%fill(machine, machine%coordinates%body_speeds(1, linear%shapes(:, m)), table%omega, table%theta, &
                         table%torque, table%total)
        call put_rows(machine, holzer, table, rows)
        if (table%number > most_modes) cycle
        call put_heading(table, size(lumped) > 0, lines)
        call put_table(machine, holzer, table, lines)
      end do
    end associate
    if (table%number > most_modes) then
      call lines%append_line('  (' // to_text(table%number - most_modes) // ' more with --out, in holzer.csv)')
    end if
    printed = lines%text()
    csv = rows%text()
  end subroutine holzer_tables

  subroutine put_heading(table, is_lumped, lines)
    type(table_t), intent(in) :: table
    logical, intent(in) :: is_lumped
    type(text_buffer_t), intent(inout) :: lines

    call lines%append('  Holzer table of undamped mode ' // to_text(table%number) // ', ' // &
                      rounded_text(table%omega / turn, 8) // ' Hz, omega^2 = ' // rounded_text(table%omega**2, 8) // ' 1/s2')
    if (is_lumped .and. table%unlumped > 0) then
      call lines%append('; ' // rounded_text(table%unlumped / turn, 8) // ' Hz where the shafts are not lumped, ' // &
                        rounded_text(100.0_wp * (table%omega / table%unlumped - 1.0_wp), 2) // ' % off')
    end if
    call lines%append_line('')
  end subroutine put_heading

  subroutine put_table(machine, holzer, table, lines)
    type(machine_t), intent(in) :: machine
    type(holzer_t), intent(in) :: holzer
    type(table_t), intent(in) :: table
    type(text_buffer_t), intent(inout) :: lines
    character(len=:), allocatable :: edge
    integer :: i, width

    width = maxval([4, (text_width(machine%names(i)%text), i=1, machine%bodies)])
    call lines%append_line('  ' // padded('body', width) // cell('J [kg m2]') // cell('J omega^2') // cell('theta') // &
                           cell('torque [N m]') // cell('sum [N m]') // cell('k [N m/rad]') // cell('sum / k') // '  by')
    do i = 1, size(holzer%lines)
      associate (line => holzer%lines(i), inertia => machine%inertia(1, holzer%lines(i)%body))
        edge = '  ' // padded(machine%names(line%body)%text, width) // cell(inertia) // cell(inertia * table%omega**2) // &
               cell(table%theta(i)) // cell(table%torque(i)) // cell(table%total(i))
        select case (line%edge)
        case (edge_coupling)
          edge = edge // cell(line%stiffness) // cell(table%total(i) / line%stiffness)
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

  subroutine put_rows(machine, holzer, table, rows)
    type(machine_t), intent(in) :: machine
    type(holzer_t), intent(in) :: holzer
    type(table_t), intent(in) :: table
    type(text_buffer_t), intent(inout) :: rows
    integer :: i

    do i = 1, size(holzer%lines)
      associate (line => holzer%lines(i), inertia => machine%inertia(1, holzer%lines(i)%body))
        call rows%append(to_text(table%number) // ',' // to_text(table%omega / turn) // ',')
        call rows%append(text_cell(machine%names(line%body)%text) // ',' // to_text(inertia) // ',')
        call rows%append(to_text(inertia * table%omega**2) // ',' // to_text(table%theta(i)) // ',' // &
                         to_text(table%torque(i)) // ',' // to_text(table%total(i)) // ',')
        if (line%edge /= edge_none) call rows%append(text_cell(next_name(machine, line)) // ',' // &
                                                     text_cell(line%name(machine)))
        if (line%edge == edge_none) call rows%append(',')
        call rows%append(',')
        if (line%edge == edge_coupling) call rows%append(to_text(line%stiffness))
        call rows%append(',')
        if (line%edge /= edge_coupling .and. line%next > 0) call rows%append(to_text(line%ratio))
        call rows%append(',')
        if (line%edge == edge_coupling) call rows%append(to_text(table%total(i) / line%stiffness))
        call rows%append(',')
        if (table%unlumped > 0) call rows%append(to_text(table%unlumped / turn))
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
