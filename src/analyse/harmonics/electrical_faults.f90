!> The torques of electrical faults on the rotor of a synchronous or an induction machine, as sums of decaying sines: of the
!> fluxes of the machine, or as they are given. They brake a rotor that turns with the mains, at rated voltage and after no load.
module nocdyn_electrical_faults
  use nocdyn_fault_excitations, only: fault_terms_t
  use nocdyn_fault_fluxes, only: fault_machine_t, find_flux_terms
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: counted, to_text
  implicit none (type, external)
  private

  public :: check_fault, find_fault_terms

contains

  !> Refuses faults before the start of the run, lists of different lengths, and reactances in the wrong order.
  subroutine check_fault(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(fault_terms_t) :: terms
    real(wp) :: t_start
    integer :: before   ! mistakes of the groups before
    logical :: has_failed

    before = diagnostics%count
    t_start = input%groups(input%position('run'))%number('t_start')
    associate (group => input%groups(index))
      if (group%number('time') < t_start) then
        call input%report(index, 'time', 'time = ' // to_text(group%number('time')) // &
                   ' is before the run; allowed: >= t_start = ' // to_text(t_start) // ' [s]', diagnostics)
      end if
      if (group%number('frequency', absent=1.0_wp) <= 0) then
        call input%report(index, 'frequency', 'frequency = ' // to_text(group%number('frequency')) // &
                   "; allowed with kind = 'fault': > 0 [rad/s]", diagnostics)
      end if
      if (group%has_value('fault')) then
        call check_order('transient_reactance', 'subtransient_reactance')
        call check_order('synchronous_reactance', &
                         trim(merge('transient_reactance   ', 'subtransient_reactance', group%has_value('transient_reactance'))))
        if (diagnostics%count > before) return
        call find_fault_terms(group, terms, has_failed)
        if (has_failed) call input%report(index, 'subtransient_reactance', &
                   'the reactances and time constants are so far apart that no torque can be computed', diagnostics)
      else
        call check_length('term_times')
        call check_length('term_phases')
      end if
    end associate

  contains

    !> A reactance is not below one that acts earlier.
    subroutine check_order(key, earlier)
      character(len=*), intent(in) :: key, earlier

      associate (group => input%groups(index))
        if (.not. group%has_value(key) .or. .not. group%has_value(earlier)) return
        if (group%number(key) >= group%number(earlier)) return
        call input%report(index, key, key // ' = ' // to_text(group%number(key)) // '; allowed: >= ' // earlier // ' = ' // &
                   to_text(group%number(earlier)), diagnostics)
      end associate
    end subroutine check_order

    !> A list that is given has a value for each term.
    subroutine check_length(key)
      character(len=*), intent(in) :: key

      associate (group => input%groups(index))
        associate (terms => size(group%numbers('term_amplitudes')), values => size(group%numbers(key)))
          if (values == 0 .or. values == terms) return
          call input%report(index, key, key // ' has ' // counted(values, 'value', 'values') // ' and term_amplitudes has ' // &
                     counted(terms, 'value', 'values') // '; needed: as many of each', diagnostics)
        end associate
      end associate
    end subroutine check_length

  end subroutine check_fault

  pure logical function is_resynchronisation(group)
    type(group_t), intent(in) :: group

    is_resynchronisation = group%has_value('fault')
    if (is_resynchronisation) is_resynchronisation = group%text('fault') == 'resynchronisation'
  end function is_resynchronisation

  !> The terms of a checked group. The torque of a fault brakes a rotor that turns forwards; the one of given terms is as they
  !> are.
  subroutine find_fault_terms(group, terms, has_failed)
    type(group_t), intent(in) :: group
    type(fault_terms_t), intent(out) :: terms
    logical, intent(out) :: has_failed   !! no terms can be computed; not of a checked group
    type(fault_machine_t) :: machine

    terms%frequency = group%number('frequency')
    has_failed = .false.
    if (group%has_value('term_amplitudes')) then
      ! the given terms
      terms%amplitude = group%numbers('term_amplitudes')
      terms%multiple = group%numbers('term_multiples')
      terms%rate = 0 * terms%amplitude
      terms%phase = 0 * terms%amplitude
      if (group%has_value('term_times')) terms%rate = 1 / group%numbers('term_times')
      if (group%has_value('term_phases')) terms%phase = group%numbers('term_phases')
      return
    end if
    machine%frequency = terms%frequency
    machine%reactance = group%number('subtransient_reactance')
    machine%stator_rate = rate_of(group, 'armature_time')
    machine%share = [admittance_of(group, 'subtransient_reactance'), 0.0_wp]
    machine%rate = [rate_of(group, 'subtransient_time'), rate_of(group, 'transient_time')]
    if (group%has_value('transient_reactance')) machine%share(2) = admittance_of(group, 'transient_reactance')
    machine%share(1) = machine%share(1) - machine%share(2)
    associate (last => merge(2, 1, group%has_value('transient_reactance')))
      machine%share(last) = machine%share(last) - admittance_of(group, 'synchronous_reactance')
    end associate
    machine%share = pack(machine%share, machine%rate > 0)   ! others do not change
    machine%rate = pack(machine%rate, machine%rate > 0)
    call find_flux_terms(machine, group%text('fault'), group%number('angle', absent=0.0_wp), terms, has_failed)
    if (.not. has_failed) terms%amplitude = -group%number('rated_torque') * terms%amplitude
  end subroutine find_fault_terms

  !> 1 / a reactance, 0 if that is not given.
  pure real(wp) function admittance_of(group, key) result(admittance)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    admittance = 0.0_wp
    if (group%has_value(key)) admittance = 1 / group%number(key)
  end function admittance_of

  !> 1 / a time constant, 0 if that is not given [1/s].
  pure real(wp) function rate_of(group, key) result(rate)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    rate = 0.0_wp
    if (group%has_value(key)) rate = 1 / group%number(key)
  end function rate_of

end module nocdyn_electrical_faults
