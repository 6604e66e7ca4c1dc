!> The files on the modes of a machine: modes.csv and modes.json.
module nocdyn_modes_files
  use nocdyn_bank, only: bank_of
  use nocdyn_comparisons, only: comparison_t, put_comparisons
  use nocdyn_equilibrium, only: t_infinity
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_modes, only: kind_names, mode_oscillating, mode_t
  use nocdyn_modes_report, only: modes_report_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_printable, only: as_utf_8
  use nocdyn_report_openings, only: open_analysis_report
  use nocdyn_shaft_errors, only: noted_error
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: put_modes, write_modes

  real(wp), parameter :: degree = acos(-1.0_wp) / 180.0_wp

contains

  !> Writes modes.csv: a row for every mode.
  subroutine write_modes(file, self)
    type(output_file_t), intent(inout) :: file
    type(modes_report_t), intent(in) :: self
    integer :: i

    call file%put('mode,kind,frequency [Hz],undamped_frequency [Hz],damping_ratio,time_constant [s],' // &
                  'real [1/s],imaginary [rad/s]')
    call put_names('shape_', self%body_names, ' [1]')
    call put_names('phase_', self%body_names, ' [deg]')
    call put_names('kinetic_', self%kinetic_names, ' [1]')
    call put_names('potential_', self%elastic_names, ' [1]')
    call file%put(new_line('a'))
    do i = 1, size(self%modes)
      call put_row(file, self%modes(i), i <= self%shapes)
    end do

  contains

    subroutine put_names(prefix, names, unit)
      character(len=*), intent(in) :: prefix, unit
      type(string_t), intent(in) :: names(:)
      integer :: b

      do b = 1, size(names)
        call file%put(',' // prefix // as_utf_8(names(b)%text) // unit)
      end do
    end subroutine put_names

  end subroutine write_modes

  !> Modes that do not oscillate have no number, and those that neither decay nor grow no time constant.
  subroutine put_row(file, mode, has_shape)
    type(output_file_t), intent(inout) :: file
    type(mode_t), intent(in) :: mode
    logical, intent(in) :: has_shape   !! whether there are a shape and shares; else their cells are empty

    if (mode%number > 0) call file%put(to_text(mode%number))
    call file%put(',' // trim(kind_names(mode%kind)) // ',' // to_text(mode%frequency()) // ',')
    if (mode%internal == 0) call file%put(to_text(mode%undamped))
    call file%put(',' // to_text(mode%damping_ratio()) // ',')
    if (mode%time_constant() < huge(1.0_wp)) call file%put(to_text(mode%time_constant()))
    call file%put_numbers([real(mode%eigenvalue, wp), aimag(mode%eigenvalue)], ',')
    if (has_shape) then
      call file%put_numbers(abs(mode%shape), ',')
      call file%put_numbers(phases(mode%shape), ',')
      call file%put_numbers(mode%kinetic, ',')
      call file%put_numbers(mode%potential, ',')
    else
      call file%put(repeat(',', 2 * size(mode%shape) + size(mode%kinetic) + size(mode%potential)))
    end if
    call file%put(new_line('a'))
  end subroutine put_row

  !> The phase lead to the largest motion [deg], -180 to 180; 0 for a body that does not move.
  pure elemental real(wp) function phases(motion)
    complex(wp), intent(in) :: motion

    phases = 0.0_wp
    if (abs(motion) > 0.0_wp) phases = atan2(aimag(motion), real(motion, wp)) / degree
  end function phases

  !> The members of modes.json: drivetrain, operating point and modes; lists are in the order of the bodies or of the couplings.
  subroutine put_modes(json, input, self, comparisons)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(modes_report_t), intent(in) :: self
    type(comparison_t), intent(in) :: comparisons(:)   !! with measured frequencies
    integer :: i

    call open_analysis_report(json, input)
    call json%put('about', self%point)
    if (self%t < t_infinity) call json%put('time_s', self%t)
    call json%put('notes', self%notes)
    call put_comparisons(json, comparisons)
    ! the topology: bodies, elastic couplings, and gears with the ratio of the second body's speed to the first one's
    call json%put('bodies', self%body_names)
    call json%put('inertia_kg_m2', self%machine%inertia(1, :size(self%body_names)))
    call json%put('speed_rad_s', self%omega(:size(self%body_names)))
    call json%open_list('couplings')
    do i = 1, size(self%elastic_names)
      call json%open()
      call json%put('name', self%elastic_names(i)%text)
      call json%put('bodies', bodies_of(self, i))
      call json%put(stiffness_key(self, i), self%stiffness(i))
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
    call json%open_list('modes')
    do i = 1, size(self%modes)
      call put_mode(json, self, i)
    end do
    call json%close_list()
    call json%close()
  end subroutine put_modes

  !> The unit of the stiffness of a coupling, shaft or mesh.
  function stiffness_key(self, number) result(key)
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: number   !! of the coupling, shaft or mesh
    character(len=:), allocatable :: key

    key = 'stiffness_N_m_rad'
    associate (banks => self%machine%banks, element => self%elastic(findloc(self%whole, number, dim=1)))
      if (banks(bank_of(banks, element))%bank%is_mesh) key = 'stiffness_N_m'
    end associate
  end function stiffness_key

  !> The bodies of the input that a coupling or shaft joins. The slices of a shaft are numbered from its second end.
  function bodies_of(self, number) result(bodies)
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: number   !! of the coupling or shaft
    integer, allocatable :: bodies(:)
    integer :: e, i, k

    allocate (bodies(0))
    associate (rows => self%machine%elements%rows)
      do i = size(self%elastic), 1, -1
        if (self%whole(i) /= number) cycle
        e = self%elastic(i)
        do k = rows%first(e), rows%first(e + 1) - 1
          if (rows%body(k) > size(self%body_names) .or. any(bodies == rows%body(k))) cycle
          bodies = [bodies, rows%body(k)]
        end do
      end do
    end associate
  end function bodies_of

  subroutine put_mode(json, self, i)
    type(json_t), intent(inout) :: json
    type(modes_report_t), intent(in) :: self
    integer, intent(in) :: i   !! index of the mode

    associate (mode => self%modes(i))
      call json%open()
      if (mode%number > 0) call json%put('mode', mode%number)
      call json%put('kind', trim(kind_names(mode%kind)))
      if (mode%internal > 0) call json%put('state', self%machine%internal_name(mode%internal))
      call json%put('frequency_Hz', mode%frequency())
      if (mode%internal == 0) call json%put('undamped_frequency_Hz', mode%undamped)
      if (allocated(self%shaft_errors) .and. mode%kind == mode_oscillating) then
        call json%put('error_by_shaft_nodes', self%shaft_errors(i))
        call json%put('has_too_few_nodes', self%shaft_errors(i) > noted_error)
      end if
      call json%put('damping_ratio', mode%damping_ratio())
      if (mode%time_constant() < huge(1.0_wp)) call json%put('time_constant_s', mode%time_constant())
      call json%put('eigenvalue_1_s', [real(mode%eigenvalue, wp), aimag(mode%eigenvalue)])
      if (i <= self%shapes) then
        call json%put('shape', abs(mode%shape))
        call json%put('phase_deg', phases(mode%shape))
        call json%put('kinetic_share', mode%kinetic)
        call json%put('potential_share', mode%potential)
      end if
      call json%close()
    end associate
  end subroutine put_mode

end module nocdyn_modes_files
