!> The modes of a machine as a person and as a program read them.
module nocdyn_modes_report
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_machine, only: machine_t
  use nocdyn_modes, only: find_modes, kind_names, mode_diverging, mode_oscillating, mode_overdamped, mode_rigid, mode_t
  use nocdyn_operating_point, only: operating_point_t
  use nocdyn_table_text, only: cell, cell_width, padded, right, text_width
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  public :: new_modes_report, modes_text, modes_csv, modes_json

  real(wp), parameter :: degree = acos(-1.0_wp) / 180.0_wp

  integer, parameter :: most_modes = 40          ! of each kind that are printed; all are in modes.json
  integer, parameter :: most_shapes = 12         ! bodies and modes of which the shapes are printed
  integer, parameter :: shapes_per_row = 6
  integer, parameter :: most_shares = 3          ! bodies or couplings that are named for a mode
  real(wp), parameter :: least_share = 0.02_wp   ! of an energy that is named

  type, public :: modes_report_t
    type(machine_t) :: machine
    type(mode_t), allocatable :: modes(:)
    integer, allocatable :: elastic(:)            !! elements whose potential energies are told
    real(wp), allocatable :: stiffness(:)         !! tangent stiffness of `elastic` [N m/rad]
    real(wp), allocatable :: omega(:)             !! speeds of the bodies at the operating point [rad/s]
    real(wp) :: t = 0.0_wp
    character(len=:), allocatable :: point        !! about which the machine is linearised
    type(string_t), allocatable :: notes(:)
  end type modes_report_t

contains

  !> Linearises at an operating point and finds the modes.
  subroutine new_modes_report(point, self, error)
    type(operating_point_t), intent(inout) :: point
    type(modes_report_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(linearisation_t) :: linear

    call linearise(point%formulation, point%t, point%y, linear, error)
    if (allocated(error)) return
    self%machine = point%formulation%machine
    allocate (self%elastic, source=self%machine%elastic())
    call find_modes(point%formulation, linear, self%elastic, self%modes, error)
    if (allocated(error)) return
    call point%formulation%place(point%y)
    allocate (self%omega, source=point%formulation%omega(1, 1:))
    self%stiffness = linear%stiffness(self%elastic)
    self%t = point%t
    self%point = point%text
    allocate (self%notes, source=point%notes)
  end subroutine new_modes_report

  !> Tables of the modes, and of the shapes of small machines.
  function modes_text(file, self) result(text)
    character(len=*), intent(in) :: file
    type(modes_report_t), intent(in) :: self
    character(len=:), allocatable :: text
    type(text_buffer_t) :: report
    integer :: i

    do i = 1, size(self%notes)
      call report%append_line(file // ': note: ' // self%notes(i)%text)
    end do
    call report%append_line(file // ': modes about ' // self%point)
    call put_oscillations(self, report)
    call put_real(self, mode_rigid, report)
    call put_real(self, mode_overdamped, report)
    call put_real(self, mode_diverging, report)
    if (count(self%modes%kind == mode_oscillating) <= most_shapes .and. self%machine%bodies <= most_shapes) then
      call put_shapes(self, report)
    end if
    text = report%text()
  end function modes_text

  !> A line for every oscillating mode.
  subroutine put_oscillations(self, report)
    type(modes_report_t), intent(in) :: self
    type(text_buffer_t), intent(inout) :: report
    integer, parameter :: number_width = 6
    integer :: i, number, total, width

    total = count(self%modes%kind == mode_oscillating)
    if (total == 0) return
    number = 0
    width = len('kinetic energy in')
    do i = 1, size(self%modes)
      if (self%modes(i)%kind /= mode_oscillating .or. number == most_modes) cycle
      number = number + 1
      width = max(width, text_width(kinetic_text(self, self%modes(i))))
    end do
    call report%append_line('  mode' // right('frequency [Hz]') // right('undamped [Hz]') // right('damping ratio') // &
                            right('decay time [s]') // '  ' // padded('kinetic energy in', width) // '  potential energy in')
    number = 0
    do i = 1, size(self%modes)
      if (self%modes(i)%kind /= mode_oscillating) cycle
      number = number + 1
      if (number > most_modes) cycle
      associate (mode => self%modes(i))
        call report%append_line(repeat(' ', number_width - len(to_text(number))) // to_text(number) // cell(mode%frequency()) // &
                                cell(mode%undamped) // cell(mode%damping_ratio()) // time_cell(mode) // '  ' // &
                                padded(kinetic_text(self, mode), width) // '  ' // potential_text(self, mode) // &
                                trim(merge(', unstable', '          ', mode%is_unstable())))
      end associate
    end do
    if (total > most_modes) call report%append_line('  (' // to_text(total - most_modes) // ' more in modes.csv and modes.json)')
  end subroutine put_oscillations

  function time_cell(mode) result(text)
    type(mode_t), intent(in) :: mode
    character(len=cell_width) :: text

    text = right('none')
    if (mode%time_constant() < huge(1.0_wp)) text = cell(mode%time_constant())
  end function time_cell

  !> A line for every mode of a kind that does not oscillate.
  subroutine put_real(self, kind, report)
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: kind
    type(text_buffer_t), intent(inout) :: report
    integer :: i, number

    number = 0
    do i = 1, size(self%modes)
      if (self%modes(i)%kind /= kind) cycle
      number = number + 1
      if (number > most_modes) cycle
      call report%append_line('  ' // trim(kind_names(kind)) // ': ' // rate_text(self%modes(i)) // &
                              '; kinetic energy in ' // kinetic_text(self, self%modes(i)))
    end do
    if (number > most_modes) call report%append_line('  (' // to_text(number - most_modes) // ' more in modes.csv and modes.json)')
  end subroutine put_real

  function rate_text(mode) result(text)
    type(mode_t), intent(in) :: mode
    character(len=:), allocatable :: text

    if (mode%time_constant() >= huge(1.0_wp)) then
      text = 'neither decays nor grows'
    else if (mode%is_unstable()) then
      text = 'unstable, grows e-fold in ' // rounded_text(-mode%time_constant(), 6) // ' s'
    else
      text = 'decays with time constant ' // rounded_text(mode%time_constant(), 6) // ' s'
    end if
  end function rate_text

  !> "motor 62 %, wheel 30 %".
  function kinetic_text(self, mode) result(text)
    type(modes_report_t), intent(in) :: self
    type(mode_t), intent(in) :: mode
    character(len=:), allocatable :: text
    integer :: k, places(most_shares), shares

    text = ''
    call find_largest(mode%kinetic, places, shares)
    do k = 1, shares
      if (k > 1) text = text // ', '
      text = text // self%machine%names(places(k))%text // ' ' // percent(mode%kinetic(places(k)))
    end do
  end function kinetic_text

  function potential_text(self, mode) result(text)
    type(modes_report_t), intent(in) :: self
    type(mode_t), intent(in) :: mode
    character(len=:), allocatable :: text
    integer :: k, places(most_shares), shares

    text = ''
    call find_largest(mode%potential, places, shares)
    do k = 1, shares
      if (k > 1) text = text // ', '
      text = text // self%machine%element_name(self%elastic(places(k))) // ' ' // percent(mode%potential(places(k)))
    end do
  end function potential_text

  !> Places of the shares that are named, the largest first: one at least, if any is not zero.
  pure subroutine find_largest(share, places, shares)
    real(wp), intent(in) :: share(:)
    integer, intent(out) :: places(most_shares), shares
    real(wp) :: left(size(share))
    integer :: k

    left = abs(share)
    shares = 0
    places = 0
    do k = 1, min(most_shares, size(share))
      associate (place => maxloc(left, dim=1))
        if (left(place) < merge(least_share, tiny(1.0_wp), k > 1)) return
        places(k) = place
        shares = k
        left(place) = 0.0_wp
      end associate
    end do
  end subroutine find_largest

  function percent(share) result(text)
    real(wp), intent(in) :: share
    character(len=:), allocatable :: text

    text = rounded_text(100.0_wp * share, merge(2, 1, abs(share) >= 0.01_wp)) // ' %'
    if (abs(share) > 0.995_wp) text = to_text(nint(100.0_wp * share)) // ' %'
  end function percent

  !> The shapes as columns: the part in phase with the largest motion.
  subroutine put_shapes(self, report)
    type(modes_report_t), intent(in) :: self
    type(text_buffer_t), intent(inout) :: report
    integer, allocatable :: chosen(:)
    character(len=:), allocatable :: line
    integer :: b, first, i, last, width

    chosen = pack([(i, i=1, size(self%modes))], self%modes%kind == mode_oscillating)
    width = max(len('shape of mode'), maxval([(text_width(self%machine%names(b)%text), b=1, self%machine%bodies)]))
    do first = 1, size(chosen), shapes_per_row
      last = min(first + shapes_per_row - 1, size(chosen))
      line = '  ' // padded('shape of mode', width)
      do i = first, last
        line = line // right(to_text(i))
      end do
      call report%append_line(line)
      do b = 1, self%machine%bodies
        line = '  ' // padded(self%machine%names(b)%text, width)
        do i = first, last
          line = line // right(rounded_text(real(self%modes(chosen(i))%shape(b), wp), 5))
        end do
        call report%append_line(line)
      end do
    end do
  end subroutine put_shapes

  !> The text of modes.csv: a row for every mode.
  function modes_csv(self) result(text)
    type(modes_report_t), intent(in) :: self
    character(len=:), allocatable :: text
    type(text_buffer_t) :: table
    integer :: i, number

    call table%append('mode,kind,frequency [Hz],undamped_frequency [Hz],damping_ratio,time_constant [s],' // &
                      'real [1/s],imaginary [rad/s]')
    call put_names('shape_', ' [1]')
    call put_names('phase_', ' [deg]')
    call put_names('kinetic_', ' [1]')
    do i = 1, size(self%elastic)
      call table%append(',potential_' // self%machine%element_name(self%elastic(i)) // ' [1]')
    end do
    call table%append(new_line('a'))
    number = 0
    do i = 1, size(self%modes)
      if (self%modes(i)%kind == mode_oscillating) number = number + 1
      call put_row(self%modes(i), number, table)
    end do
    text = table%text()

  contains

    subroutine put_names(prefix, unit)
      character(len=*), intent(in) :: prefix, unit
      integer :: b

      do b = 1, self%machine%bodies
        call table%append(',' // prefix // self%machine%names(b)%text // unit)
      end do
    end subroutine put_names

  end function modes_csv

  !> Modes that do not oscillate have no number, and those that neither decay nor grow no time constant.
  subroutine put_row(mode, number, table)
    type(mode_t), intent(in) :: mode
    integer, intent(in) :: number
    type(text_buffer_t), intent(inout) :: table

    if (mode%kind == mode_oscillating) call table%append(to_text(number))
    call table%append(',' // trim(kind_names(mode%kind)) // ',' // to_text(mode%frequency()) // ',' // &
                      to_text(mode%undamped) // ',' // to_text(mode%damping_ratio()) // ',')
    if (mode%time_constant() < huge(1.0_wp)) call table%append(to_text(mode%time_constant()))
    call put_values([real(mode%eigenvalue, wp), aimag(mode%eigenvalue)], table)
    call put_values(abs(mode%shape), table)
    call put_values(phases(mode%shape), table)
    call put_values(mode%kinetic, table)
    call put_values(mode%potential, table)
    call table%append(new_line('a'))
  end subroutine put_row

  subroutine put_values(values, table)
    real(wp), intent(in) :: values(:)
    type(text_buffer_t), intent(inout) :: table
    integer :: i

    do i = 1, size(values)
      call table%append(',' // to_text(values(i)))
    end do
  end subroutine put_values

  !> Before the largest motion [deg], -180 to 180; 0 of a body that does not move.
  pure elemental real(wp) function phases(motion)
    complex(wp), intent(in) :: motion

    phases = 0.0_wp
    if (abs(motion) > 0.0_wp) phases = atan2(aimag(motion), real(motion, wp)) / degree
  end function phases

  !> The text of modes.json: the train, the operating point and the modes; lists are in the order of the bodies, of the couplings.
  function modes_json(input, self) result(text)
    type(input_t), intent(in) :: input
    type(modes_report_t), intent(in) :: self
    character(len=:), allocatable :: text
    type(json_t) :: json
    type(group_t) :: about
    integer :: i, number

    call json%open()
    call json%put('program', 'nocdyn')
    call json%put('version', version)
    call json%put('compiler', compiler_text())
    call json%put('input', input%file)
    about = input%single('case')
    call json%put('title', about%text('title'))
    call json%put('about', self%point)
    call json%put('time_s', self%t)
    call json%put('notes', self%notes)
    call put_train(json, self)
    call json%open_list('modes')
    number = 0
    do i = 1, size(self%modes)
      if (self%modes(i)%kind == mode_oscillating) number = number + 1
      call put_mode(json, self%modes(i), number)
    end do
    call json%close_list()
    call json%close()
    text = json%text()
  end function modes_json

  !> What is joined to what: bodies, elastic couplings, and gears with the speed of the second body at 1 of the first.
  subroutine put_train(json, self)
    type(json_t), intent(inout) :: json
    type(modes_report_t), intent(in) :: self
    integer :: e, i

    call json%put('bodies', self%machine%names)
    call json%put('inertia_kg_m2', self%machine%inertia(1, :))
    call json%put('speed_rad_s', self%omega)
    call json%open_list('couplings')
    do i = 1, size(self%elastic)
      e = self%elastic(i)
      call json%open()
      call json%put('name', self%machine%element_name(e))
      call json%put('bodies', [self%machine%elements%from(e), self%machine%elements%to(e)])
      call json%put('stiffness_N_m_rad', self%stiffness(i))
      call json%close()
    end do
    call json%close_list()
    call json%open_list('gears')
    associate (rows => self%machine%constraints)
      do i = 1, rows%rows()
        associate (first => rows%first(i))
          if (rows%first(i + 1) - first /= 2) cycle
          call json%open()
          call json%put('name', rows%names(i)%text)
          call json%put('bodies', rows%body(first:first + 1))
          call json%put('ratio', -rows%coefficient(1, first) / rows%coefficient(1, first + 1))
          call json%close()
        end associate
      end do
    end associate
    call json%close_list()
  end subroutine put_train

  subroutine put_mode(json, mode, number)
    type(json_t), intent(inout) :: json
    type(mode_t), intent(in) :: mode
    integer, intent(in) :: number

    call json%open()
    if (mode%kind == mode_oscillating) call json%put('mode', number)
    call json%put('kind', trim(kind_names(mode%kind)))
    call json%put('frequency_Hz', mode%frequency())
    call json%put('undamped_frequency_Hz', mode%undamped)
    call json%put('damping_ratio', mode%damping_ratio())
    if (mode%time_constant() < huge(1.0_wp)) call json%put('time_constant_s', mode%time_constant())
    call json%put('eigenvalue_1_s', [real(mode%eigenvalue, wp), aimag(mode%eigenvalue)])
    call json%put('shape', abs(mode%shape))
    call json%put('phase_deg', phases(mode%shape))
    call json%put('kinetic_share', mode%kinetic)
    call json%put('potential_share', mode%potential)
    call json%close()
  end subroutine put_mode

end module nocdyn_modes_report
