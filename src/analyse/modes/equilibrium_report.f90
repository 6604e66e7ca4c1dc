!> The reports on the steady states of a machine: printed and equilibrium.json.
module nocdyn_equilibrium_report
  use nocdyn_bank, only: role_coupling
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_element_sets, only: whole_names, whole_sums
  use nocdyn_energy_balance, only: work_element_names
  use nocdyn_equilibrium, only: equilibrium_t, t_infinity
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine_report, only: named_coordinates
  use nocdyn_machine, only: machine_t
  use nocdyn_power_notes, only: note_power_signs
  use nocdyn_quantities, only: form_angle
  use nocdyn_reduced, only: new_reduced, reduced_t
  use nocdyn_report_openings, only: append_notes, open_analysis_report
  use nocdyn_signals, only: signal_angle, signal_element, signal_residual, signal_t, signal_time, signal_work_in, &
    signal_work_out
  use nocdyn_table_text, only: append_table, cell, cell_digits, clear_rounding, padded, rounding
  use nocdyn_text, only: rounded_text, selected, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_trajectory_table, only: new_trajectory_table, trajectory_table_t
  implicit none (type, external)
  private

  public :: put_equilibrium, equilibrium_text, new_equilibrium_report

  !> The contents of the printed report and of equilibrium.json.
  type, public :: equilibrium_report_t
    type(equilibrium_t), allocatable :: equilibria(:)
    type(string_t), allocatable :: notes(:)
    type(column_list_t) :: columns                 !! what the values are
    type(string_t), allocatable :: labels(:)       !! as in trajectory.csv: speeds, twists, moments, torques, reactions, energies
    real(wp), allocatable :: values(:, :)          !! [labels, equilibria]
    type(string_t), allocatable :: work_elements(:)      !! names of the elements with power, with their role
    real(wp), allocatable :: power(:, :)           !! into the machine [W], [work_elements, equilibria]
    type(string_t), allocatable :: coordinates(:)
  end type equilibrium_report_t

contains

  !> Evaluates the columns of trajectory.csv at the steady states.
  subroutine new_equilibrium_report(formulation, equilibria, notes, wanted, self, error)
    class(formulation_t), intent(in) :: formulation
    type(equilibrium_t), intent(in) :: equilibria(:)
    type(string_t), intent(in) :: notes(:)
    integer, intent(in) :: wanted(:)   !! units of the columns: indices of `units`; others are the ones of SI
    type(equilibrium_report_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! a number of a steady state is not finite
    type(reduced_t), target :: with_works
    type(trajectory_table_t) :: table
    real(wp), allocatable :: row(:), watts(:, :), y(:)
    integer, allocatable :: reported(:)                 !! columns
    type(string_t), allocatable :: parts(:)             !! of the elements with power
    real(wp), allocatable :: power(:, :)                !! of these [W], [parts, equilibria]
    integer, allocatable :: drives(:)                   !! rows that turn bodies
    real(wp) :: lambda(formulation%machine%constraints%rows())
    integer :: i, k

    allocate (self%equilibria, source=equilibria)
    allocate (self%notes, source=notes)
    associate (machine => formulation%machine)
      allocate (self%coordinates, source=selected(machine%names, named_coordinates(machine)))
    end associate
    with_works = new_reduced(formulation%machine, .true.)
    table = new_trajectory_table(with_works, t_infinity, wanted)
    reported = pack([(i, i=1, size(table%signals))], &
                    [(is_steady(table%signals(i), formulation%machine), i=1, size(table%signals))])
    call self%columns%start('', [integer ::])
    do i = 1, size(reported)
      call self%columns%add(table%signals(reported(i)))
    end do
    allocate (self%labels, source=selected(table%labels, reported))
    allocate (parts, source=work_element_names(formulation%machine))
    associate (rows => formulation%machine%constraints)
      drives = pack([(i, i=1, size(lambda))], abs(rows%demand) > 0)
      allocate (self%work_elements, source=[whole_names(parts), (string_t(rows%kinds(drives(i))%text // ' ' // &
                                                                          rows%names(drives(i))%text), i=1, size(drives))])
    end associate
    allocate (self%values(size(self%labels), size(equilibria)), self%power(size(self%work_elements), size(equilibria)))
    allocate (row(size(table%labels)), watts(1, size(parts)), power(size(parts), size(equilibria)))
    do k = 1, size(equilibria)
      y = [equilibria(k)%y(1, :), (0.0_wp, i=1, size(parts))]
      call table%fill(t_infinity, y, row)
      call with_works%state%power(with_works%machine, watts)
      self%values(:, k) = row(reported)
      power(:, k) = watts(1, :)
      call with_works%reactions(1, lambda)
      self%power(:, k) = [whole_sums(parts, watts(1, :)), lambda(drives) * formulation%machine%constraints%demand(drives)]
      i = findloc(is_finite([self%values(:, k), self%power(:, k)]), .false., dim=1)
      if (i == 0) cycle
      call raise(error, exit_failed, 'in steady state ' // to_text(k) // ' of ' // to_text(size(equilibria)) // ', ' // &
                 label_of(self, i) // ' is not a finite number')
      return
    end do
    call note_power_signs(formulation%machine, power, 'W', 'steady states', self%notes)
  end subroutine new_equilibrium_report

  !> What the number `i` of the values and then the powers is.
  function label_of(self, i) result(label)
    type(equilibrium_report_t), intent(in) :: self
    integer, intent(in) :: i
    character(len=:), allocatable :: label

    if (i <= size(self%labels)) then
      label = self%labels(i)%text
    else
      label = 'the power of ' // self%work_elements(i - size(self%labels))%text
    end if
  end function label_of

  !> Whether a signal is constant in a steady state: no angles and works, and no twists of couplings that slip; inner nodes of
  !> shafts are left out.
  logical function is_steady(signal, machine)
    type(signal_t), intent(in) :: signal
    type(machine_t), intent(in) :: machine

    associate (source => signal%source)
      is_steady = .not. (signal%is_inner() .or. any(source%kind == [signal_time, signal_angle, signal_work_in, signal_work_out, &
                                                                    signal_residual]))
      if (.not. is_steady .or. source%kind /= signal_element .or. source%form /= form_angle) return
      associate (bank => machine%banks(source%bank)%bank)
        if (bank%role == role_coupling) is_steady = any(bank%elastic == source%index)
      end associate
    end associate
  end function is_steady

  !> The printed report: a table for every steady state.
  function equilibrium_text(file, self) result(text)
    character(len=*), intent(in) :: file
    type(equilibrium_report_t), intent(in) :: self
    character(len=:), allocatable :: text
    character(len=:), allocatable :: heading
    type(text_buffer_t) :: report
    real(wp), allocatable :: values(:, :)   ! of one steady state
    integer :: k

    call append_notes(report, file, self%notes)
    do k = 1, size(self%equilibria)
      heading = file // ': steady state'
      if (size(self%equilibria) > 1) heading = heading // ' ' // to_text(k) // ' of ' // to_text(size(self%equilibria))
      call report%append_line(heading // ', ' // stability_text(self%equilibria(k)))
      values = self%values(:, k:k)
      call clear_rounding(self%labels, values)
      call append_table(report, self%labels, values, [''], 2, 'more values in equilibrium.json')
      call put_power(self%work_elements, self%power(:, k), report)
    end do
    text = report%text()
  end function equilibrium_text

  !> "stable: disturbances decay at 0.5 1/s or faster".
  function stability_text(equilibrium) result(text)
    type(equilibrium_t), intent(in) :: equilibrium
    character(len=:), allocatable :: text

    if (equilibrium%is_fixed) then
      text = 'at rest, stable: joints hold all that could move'
      return
    end if
    select case (equilibrium%stability)
    case ('stable')
      text = 'stable: disturbances decay at '
      if (equilibrium%free_modes > 0) text = 'stable but for the speeds of the notes, which disturbances change for good: ' // &
                                             'others decay at '
      text = text // rounded_text(-equilibrium%growth, 4) // ' 1/s or faster'
    case ('unstable')
      text = 'unstable: a disturbance grows with ' // rounded_text(equilibrium%growth, 4) // ' 1/s'
    case ('neutral')
      text = 'neutral: some disturbances neither grow nor decay'
    case default
      text = 'of which the stability is not determined'
    end select
    if (equilibrium%is_at_rest) text = 'at rest, ' // text
  end function stability_text

  !> The power of every element and their sum, which is zero but for rounding.
  subroutine put_power(work_elements, power, report)
    type(string_t), intent(in) :: work_elements(:)   !! names
    real(wp), intent(in) :: power(:)                 !! into the machine [W]
    type(text_buffer_t), intent(inout) :: report
    real(wp) :: rounded(size(power), 1), total
    integer :: width

    if (size(work_elements) == 0) return
    rounded(:, 1) = power
    call clear_rounding(work_elements, rounded)
    call append_table(report, work_elements, rounded, ['power into the machine [W]'], 2, 'more in equilibrium.json', width)
    total = sum(power)
    if (abs(total) <= rounding * sum(abs(power))) total = 0.0_wp
    call report%append_line('  ' // padded('in all', width) // cell(total) // ', of ' // &
                            rounded_text(sum(max(power, 0.0_wp)), cell_digits) // ' put in')
  end subroutine put_power

  !> The members of equilibrium.json.
  subroutine put_equilibrium(json, input, self)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(equilibrium_report_t), intent(in) :: self
    integer :: k

    call open_analysis_report(json, input)
    call json%put('independent', self%coordinates)
    call json%put('notes', self%notes)
    call json%open_list('columns')
    call self%columns%put(json)
    call json%close_list()
    call json%open_list('steady_states')
    do k = 1, size(self%equilibria)
      call json%open()
      call json%put('stability', trim(self%equilibria(k)%stability))
      call json%put('is_at_rest', self%equilibria(k)%is_at_rest)
      if (self%equilibria(k)%stability /= 'not determined' .and. .not. self%equilibria(k)%is_fixed) then
        call json%put('growth_rate_1_s', self%equilibria(k)%growth)
      end if
      call json%put('values', self%labels, self%values(:, k))
      call json%put('power_W', self%work_elements, self%power(:, k))
      call json%put('power_put_in_W', sum(max(self%power(:, k), 0.0_wp)))
      call json%put('power_residual_W', sum(self%power(:, k)))
      call json%close()
    end do
    call json%close_list()
    call json%close()
  end subroutine put_equilibrium

end module nocdyn_equilibrium_report
