!> The printed report on the modes of a machine.
module nocdyn_modes_report
  use nocdyn_element_sets, only: element_names, whole_names, whole_sums, wholes
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_modes, only: find_machine_modes
  use nocdyn_modes, only: kind_names, mode_diverging, mode_internal, mode_oscillating, mode_overdamped, mode_rigid, &
    mode_t
  use nocdyn_report_openings, only: append_notes
  use nocdyn_shaft_errors, only: describe_error, has_shaft_nodes, noted_error, shaft_error
  use nocdyn_operating_point, only: operating_point_t
  use nocdyn_damping_notes, only: note_mean_slopes, note_stand_ins
  use nocdyn_power_notes, only: note_power_signs
  use nocdyn_table_text, only: cell, cell_width, padded, right, text_width
  use nocdyn_text, only: append, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, in_si, unit_hz, unit_rpm
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  public :: new_modes_report, modes_text

  integer, parameter :: max_modes = 40          ! of each kind that are printed; all are in modes.csv
  integer, parameter :: max_shapes = 12         ! a machine with more bodies or modes has its shapes in the files only
  integer, parameter :: shapes_per_row = 6
  integer, parameter :: max_shares = 3          ! of bodies or couplings that are printed for a mode
  integer, parameter :: max_values = 1000000    ! shapes and shares in a file
  real(wp), parameter :: min_share = 0.02_wp   ! of an energy that is printed

  type, public :: modes_report_t
    type(machine_t) :: machine
    type(linearisation_t) :: linear               !! at the operating point
    type(mode_t), allocatable :: modes(:)
    real(wp), allocatable :: shaft_errors(:)      !! relative, by the nodes of shafts, [modes]; not allocated without
    integer :: shapes = 0                         !! number of modes, from the first, whose shapes and shares are in the files
    type(string_t), allocatable :: body_names(:)      !! of the bodies of the input
    type(string_t), allocatable :: kinetic_names(:)   !! of the parts of the kinetic energy: these, and shafts with nodes
    integer, allocatable :: elastic(:)            !! elements with potential energies
    integer, allocatable :: whole(:)              !! number, from 1, of the coupling or shaft of which each is a part
    type(string_t), allocatable :: elastic_names(:)   !! of couplings and shafts
    real(wp), allocatable :: stiffness(:)         !! tangent stiffness of these [N m/rad]
    real(wp), allocatable :: omega(:)             !! speeds of the bodies at the operating point [rad/s]
    real(wp) :: t = 0.0_wp
    character(len=:), allocatable :: point        !! about which the machine is linearised
    type(string_t), allocatable :: notes(:)
  end type modes_report_t

contains

  !> Linearises at an operating point and finds the modes.
  subroutine new_modes_report(point, choice, self, error)
    type(operating_point_t), intent(inout) :: point
    type(modes_choice_t), intent(in) :: choice
    type(modes_report_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    allocate (self%elastic, source=point%formulation%machine%elastic())
    call find_machine_modes(point, choice, self%elastic, self%linear, self%modes, error)
    if (allocated(error)) return
    self%machine = point%formulation%machine
    call note_mean_slopes(self%machine, point%formulation%state%elements%applied_speed(1, :), point%notes)
    associate (elements => point%formulation%state%elements, e => self%machine%with_work)
      call note_power_signs(self%machine, spread((elements%restoring(1, e) + elements%applied(1, e)) * elements%speed(1, e), &
                                                 2, 1), 'W', '', point%notes)
    end associate
    do i = 1, size(self%modes)
      associate (mode => self%modes(i))
        if (all(is_finite([real(mode%eigenvalue, wp), aimag(mode%eigenvalue), mode%undamped, mode%kinetic, mode%potential, &
                           real(mode%shape, wp), aimag(mode%shape)]))) cycle
      end associate
      call raise(error, exit_failed, 'mode ' // to_text(i) // ' of ' // to_text(size(self%modes)) // &
                 ' has a frequency, shape or share of an energy that is not a finite number')
      return
    end do
    call find_shaft_errors(self)
    call point%formulation%set_state(point%y)
    allocate (self%omega, source=point%formulation%omega(1, 1:))
    call join_parts(self%linear%stiffness(self%elastic), self)
    self%t = point%t
    self%point = point%text
    allocate (self%notes, source=point%notes)
    call note_stand_ins(self%machine, self%linear, self%notes)
    self%shapes = min(size(self%modes), max_values / (3 * size(self%kinetic_names) + size(self%elastic_names)))
    if (allocated(self%shaft_errors)) then
      ! notes how many modes the nodes of the shafts do not resolve
      associate (poor => count(self%shaft_errors > noted_error), all => count(self%modes%kind == mode_oscillating))
        if (poor > 0) call append(self%notes, 'the nodes of shafts resolve ' // to_text(all - poor) // ' of the ' // &
                                  to_text(all) // ' oscillating modes; the others are marked with their error; ' // &
                                  'more nodes of &shaft resolve more')
      end associate
    end if
    if (self%shapes < size(self%modes)) then
      call append(self%notes, 'of the ' // to_text(size(self%modes)) // ' modes, modes.csv and modes.json have the ' // &
                              'shapes and energies of the first ' // to_text(self%shapes))
    end if
  end subroutine new_modes_report

  !> The errors of the undamped modes that are most similar to the modes.
  subroutine find_shaft_errors(self)
    type(modes_report_t), intent(inout) :: self
    real(wp) :: errors(size(self%linear%natural))
    integer :: i

    if (.not. has_shaft_nodes(self%machine)) return
    associate (linear => self%linear)
      do i = 1, size(errors)
        errors(i) = shaft_error(self%machine, self%machine%coordinates%body_speeds(1, linear%shapes(:, i)), linear%natural(i))
      end do
      allocate (self%shaft_errors(size(self%modes)), source=0.0_wp)
      do i = 1, size(self%modes)
        if (self%modes(i)%kind /= mode_oscillating .or. self%modes(i)%internal > 0) cycle
        self%shaft_errors(i) = errors(minloc(abs(from_si(linear%natural, unit_hz) - self%modes(i)%undamped), dim=1))
      end do
    end associate
  end subroutine find_shaft_errors

  !> Adds up the energies of the nodes and of the slices of each shaft.
  subroutine join_parts(stiffness, self)
    real(wp), intent(in) :: stiffness(:)   !! of the elastic elements [N m/rad]
    type(modes_report_t), intent(inout) :: self
    type(string_t), allocatable :: elements(:), nodes(:)
    integer :: i, named

    allocate (elements, source=element_names(self%machine, self%elastic))
    self%whole = wholes(elements)
    allocate (self%elastic_names, source=whole_names(elements))
    self%stiffness = stiffness   ! slices are in series
    if (size(self%elastic_names) < size(elements)) self%stiffness = 1.0_wp / whole_sums(elements, 1.0_wp / stiffness)
    named = self%machine%bodies - self%machine%nodes
    allocate (nodes, source=self%machine%names(named + 1:))
    do i = 1, size(nodes)
      nodes(i)%text = nodes(i)%text(:index(nodes(i)%text, '[', back=.true.) - 1)
    end do
    allocate (self%body_names, source=self%machine%names(:named))
    allocate (self%kinetic_names, source=[self%body_names, whole_names(nodes)])
    do i = 1, size(self%modes)
      associate (mode => self%modes(i))
        mode%shape = mode%shape(:named)
        mode%kinetic = [mode%kinetic(:named), whole_sums(nodes, mode%kinetic(named + 1:))]
        mode%potential = whole_sums(elements, mode%potential)
      end associate
    end do
  end subroutine join_parts

  !> Tables of the modes, and of the shapes of small machines.
  function modes_text(file, self, wanted) result(text)
    character(len=*), intent(in) :: file
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: wanted(:)   !! indices of `units`: with the one of rpm, frequencies are printed in it too
    character(len=:), allocatable :: line, text
    type(text_buffer_t) :: report
    integer :: b, first, i, last, width
    integer, allocatable :: chosen(:)

    call append_notes(report, file, self%notes)
    call report%append_line(file // ': modes about ' // self%point)
    call put_oscillations(self, any(wanted == unit_rpm), report)
    call put_real(self, mode_rigid, report)
    call put_real(self, mode_overdamped, report)
    call put_real(self, mode_diverging, report)
    call put_real(self, mode_internal, report)
    if (count(self%modes%kind == mode_oscillating) <= max_shapes .and. size(self%body_names) <= max_shapes) then
      ! appends the shapes as columns: the part in phase with the largest motion
      allocate (chosen, source=modes_of(self, mode_oscillating))
      width = max(len('shape of mode'), maxval([(text_width(self%body_names(b)%text), b=1, size(self%body_names))]))
      do first = 1, size(chosen), shapes_per_row
        last = min(first + shapes_per_row - 1, size(chosen))
        line = '  ' // padded('shape of mode', width)
        do i = first, last
          line = line // cell(to_text(self%modes(chosen(i))%number))
        end do
        call report%append_line(line)
        do b = 1, size(self%body_names)
          line = '  ' // padded(self%body_names(b)%text, width)
          do i = first, last
            line = line // cell(rounded_text(real(self%modes(chosen(i))%shape(b), wp), 5))
          end do
          call report%append_line(line)
        end do
      end do
    end if
    text = report%text()
  end function modes_text

  subroutine put_oscillations(self, has_rpm, report)
    type(modes_report_t), intent(in) :: self
    logical, intent(in) :: has_rpm
    type(text_buffer_t), intent(inout) :: report
    integer, parameter :: number_width = 6
    integer, allocatable :: chosen(:)
    character(len=:), allocatable :: rpm
    integer :: i, shown, width

    allocate (chosen, source=modes_of(self, mode_oscillating))
    if (size(chosen) == 0) return
    shown = min(size(chosen), max_modes)
    width = maxval([len('kinetic energy in'), &
                    (text_width(shares_text(self%modes(chosen(i))%kinetic, self%kinetic_names)), i=1, shown)])
    rpm = ''
    if (has_rpm) rpm = cell('[rpm]')
    call report%append_line('  mode' // cell('frequency [Hz]') // rpm // cell('undamped [Hz]') // cell('damping ratio') // &
                            cell('decay time [s]') // '  ' // padded('kinetic energy in', width) // '  potential energy in')
    do i = 1, shown
      associate (mode => self%modes(chosen(i)))
        if (has_rpm) rpm = cell(from_si(in_si(mode%frequency(), unit_hz), unit_rpm))
        call report%append_line(right(to_text(mode%number), number_width) // cell(mode%frequency()) // rpm // &
                                undamped_cell(mode) // cell(mode%damping_ratio()) // time_cell(mode) // '  ' // &
                                padded(shares_text(mode%kinetic, self%kinetic_names), width) // '  ' // &
                                shares_text(mode%potential, self%elastic_names) // internal_text(self, mode) // &
                                shaft_text(self, chosen(i)) // &
                                trim(merge(', unstable', '          ', mode%is_unstable())))
      end associate
    end do
    if (shown < size(chosen)) call report%append_line('  (' // to_text(size(chosen) - shown) // ' more in modes.csv)')
  end subroutine put_oscillations

  !> "; nodes too few: error about 6 %".
  function shaft_text(self, i) result(text)
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: i   !! mode
    character(len=:), allocatable :: text

    text = ''
    if (.not. allocated(self%shaft_errors)) return
    if (self%shaft_errors(i) <= noted_error) return
    call describe_error(self%shaft_errors(i), text)
    text = '; nodes too few: error ' // text
  end function shaft_text

  !> "; mostly stator flux d of motor 'mains'".
  function internal_text(self, mode) result(text)
    type(modes_report_t), intent(in) :: self
    type(mode_t), intent(in) :: mode
    character(len=:), allocatable :: text

    text = ''
    if (mode%internal > 0) text = '; mostly ' // self%machine%internal_name(mode%internal)
  end function internal_text

  function undamped_cell(mode) result(text)
    type(mode_t), intent(in) :: mode
    character(len=cell_width) :: text

    text = cell('')
    if (mode%internal == 0) text = cell(mode%undamped)
  end function undamped_cell

  function time_cell(mode) result(text)
    type(mode_t), intent(in) :: mode
    character(len=cell_width) :: text

    text = cell('none')
    if (mode%time_constant() < huge(1.0_wp)) text = cell(mode%time_constant())
  end function time_cell

  !> Appends a line for every mode of a kind that does not oscillate.
  subroutine put_real(self, kind, report)
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: kind
    type(text_buffer_t), intent(inout) :: report
    integer, allocatable :: chosen(:)
    integer :: i, shown

    allocate (chosen, source=modes_of(self, kind))
    shown = min(size(chosen), max_modes)
    do i = 1, shown
      associate (mode => self%modes(chosen(i)))
        if (kind == mode_internal) then
          call report%append_line('  ' // self%machine%internal_name(mode%internal) // ': ' // rate_text(mode))
        else
          call report%append_line('  ' // trim(kind_names(kind)) // ': ' // rate_text(mode) // '; kinetic energy in ' // &
                                  shares_text(mode%kinetic, self%kinetic_names))
        end if
      end associate
    end do
    if (shown < size(chosen)) call report%append_line('  (' // to_text(size(chosen) - shown) // ' more in modes.csv)')
  end subroutine put_real

  pure function modes_of(self, kind) result(chosen)
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: kind
    integer, allocatable :: chosen(:)
    integer :: i

    allocate (chosen, source=pack([(i, i=1, size(self%modes))], self%modes%kind == kind))
  end function modes_of

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

  !> The largest shares with their names, e.g. "motor 62 %, wheel 30 %": at least one, if any is not zero.
  function shares_text(share, names) result(text)
    real(wp), intent(in) :: share(:)         !! of an energy, 0 to 1
    type(string_t), intent(in) :: names(:)   !! of bodies or couplings
    character(len=:), allocatable :: text
    real(wp) :: left(size(share))
    integer :: k, largest

    text = ''
    left = abs(share)
    do k = 1, min(max_shares, size(share))
      largest = maxloc(left, dim=1)
      if (left(largest) < merge(min_share, tiny(1.0_wp), k > 1)) return
      if (k > 1) text = text // ', '
      text = text // names(largest)%text // ' ' // percent(share(largest))
      left(largest) = 0.0_wp
    end do
  end function shares_text

  function percent(share) result(text)
    real(wp), intent(in) :: share
    character(len=:), allocatable :: text

    text = rounded_text(100.0_wp * share, merge(2, 1, abs(share) >= 0.01_wp)) // ' %'
    if (abs(share) > 0.995_wp) text = to_text(nint(100.0_wp * share)) // ' %'
  end function percent

end module nocdyn_modes_report
