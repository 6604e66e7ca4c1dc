!> The torques of electrical faults on the rotor of a synchronous or an induction machine, as sums of decaying sines.
!>
!> The rotor's flux linkage E = 1 turns with the mains, that of the stator winding at the fault stays and decays with the time
!> constant T_a of the armature; both act on each other over the subtransient reactance x'', the same in both axes. In units of
!> the rated apparent power over the synchronous speed, and with x = f t, the torque that brakes the rotor is, after no load,
!>
!>   three phases at the terminals   D / x'' e^(-t/T_a) sin x
!>   two phases at the terminals     D / x'' (e^(-t/T_a) sin x - 1/2 sin 2x), where it is largest: at the zero of their voltage
!>   closing with a phase angle d    D / x'' (sin d (1 - e^(-t/T_a) cos x) + (1 - cos d) e^(-t/T_a) sin x)
!>
!> D is the decay of the rotor's flux, e^(-t/T''). With a transient reactance x', D / x'' is (1/x'' - 1/x') e^(-t/T'') +
!> 1/x' e^(-t/T'), the decay of the current of a short circuit. Resistances add small mean torques that are left out. The page on
!> the theory derives the torques.
module nocdyn_electrical_faults
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_fault_excitations, only: fault_terms_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: counted, to_text
  implicit none (type, external)
  private

  public :: check_faults, find_fault_terms

  real(wp), parameter :: quarter = 0.5_wp * acos(-1.0_wp)   ! turn

contains

  !> Refuses faults before the start of the run, lists of different lengths, and reactances in the wrong order.
  subroutine check_faults(input, error)
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: indices(:)
    integer :: i

    allocate (indices, source=input%groups_named('excitation', 'fault'))
    do i = 1, size(indices)
      call check_fault(input, indices(i), error)
      if (allocated(error)) return
    end do
  end subroutine check_faults

  subroutine check_fault(input, index, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: t_start

    t_start = input%groups(input%position('run'))%number('t_start')
    associate (group => input%groups(index))
      if (group%number('time') < t_start) then
        call raise(error, exit_input, input%location(index, 'time') // ': time = ' // to_text(group%number('time')) // &
                   ' is before the run; allowed: >= t_start = ' // to_text(t_start) // ' [s]')
      else if (group%number('frequency', absent=1.0_wp) <= 0) then
        call raise(error, exit_input, input%location(index, 'frequency') // ': frequency = ' // &
                   to_text(group%number('frequency')) // "; allowed with kind = 'fault': > 0 [rad/s]")
      else if (group%has_value('transient_reactance')) then
        if (group%number('transient_reactance') >= group%number('subtransient_reactance')) return
        call raise(error, exit_input, input%location(index, 'transient_reactance') // ': transient_reactance = ' // &
                   to_text(group%number('transient_reactance')) // '; allowed: >= subtransient_reactance = ' // &
                   to_text(group%number('subtransient_reactance')))
      else
        call check_length('term_times')
        if (.not. allocated(error)) call check_length('term_phases')
      end if
    end associate

  contains

    !> A list that is given has a value for each term.
    subroutine check_length(key)
      character(len=*), intent(in) :: key

      associate (group => input%groups(index))
        associate (terms => size(group%numbers('term_amplitudes')), values => size(group%numbers(key)))
          if (values == 0 .or. values == terms) return
          call raise(error, exit_input, input%location(index, key) // ': ' // key // ' has ' // &
                     counted(values, 'value', 'values') // ' and term_amplitudes has ' // counted(terms, 'value', 'values') // &
                     '; needed: as many of each')
        end associate
      end associate
    end subroutine check_length

  end subroutine check_fault

  pure logical function is_resynchronisation(group)
    type(group_t), intent(in) :: group

    is_resynchronisation = group%has_value('fault')
    if (is_resynchronisation) is_resynchronisation = group%text('fault') == 'resynchronisation'
  end function is_resynchronisation

  !> The terms of a checked group. The torque of a fault brakes a rotor that turns forwards; that of given terms is as they are.
  subroutine find_fault_terms(group, terms)
    type(group_t), intent(in) :: group
    type(fault_terms_t), intent(out) :: terms
    real(wp), allocatable, dimension(:) :: rate, share   ! of the parts of the rotor's decay D: D = sum of share e^(-rate t)
    integer :: i

    terms%frequency = group%number('frequency')
    if (group%has_value('term_amplitudes')) then
      call copy_terms(group, terms)
      return
    end if
    share = [1 / group%number('subtransient_reactance')]
    rate = [rate_of(group, 'subtransient_time')]
    if (group%has_value('transient_reactance')) then
      associate (transient => 1 / group%number('transient_reactance'))
        share = [share - transient, transient]
        rate = [rate, rate_of(group, 'transient_time')]
      end associate
    end if
    call find_shape(group, terms)
    terms%amplitude = -group%number('rated_torque') * [(share(i) * terms%amplitude, i=1, size(share))]
    terms%rate = [(rate(i) + terms%rate, i=1, size(rate))]
    terms%multiple = [(terms%multiple, i=1, size(share))]
    terms%phase = [(terms%phase, i=1, size(share))]
  end subroutine find_fault_terms

  !> The terms of a fault beside D. Their rates are those of the stator's flux where it takes part.
  subroutine find_shape(group, terms)
    type(group_t), intent(in) :: group
    type(fault_terms_t), intent(inout) :: terms
    real(wp) :: angle, stator

    stator = rate_of(group, 'armature_time')
    select case (group%text('fault'))
    case ('three_phase')
      terms%amplitude = [1.0_wp]
      terms%multiple = [1.0_wp]
      terms%rate = [stator]
      terms%phase = [0.0_wp]
    case ('two_phase')
      terms%amplitude = [1.0_wp, -0.5_wp]
      terms%multiple = [1.0_wp, 2.0_wp]
      terms%rate = [stator, 0.0_wp]
      terms%phase = [0.0_wp, 0.0_wp]
    case default
      angle = group%number('angle')
      terms%amplitude = [sin(angle), -sin(angle), 1 - cos(angle)]
      terms%multiple = [0.0_wp, 1.0_wp, 1.0_wp]
      terms%rate = [0.0_wp, stator, stator]
      terms%phase = [quarter, quarter, 0.0_wp]
    end select
  end subroutine find_shape

  !> The given terms.
  subroutine copy_terms(group, terms)
    type(group_t), intent(in) :: group
    type(fault_terms_t), intent(inout) :: terms

    terms%amplitude = group%numbers('term_amplitudes')
    terms%multiple = group%numbers('term_multiples')
    terms%rate = 0 * terms%amplitude
    terms%phase = 0 * terms%amplitude
    if (group%has_value('term_times')) terms%rate = 1 / group%numbers('term_times')
    if (group%has_value('term_phases')) terms%phase = group%numbers('term_phases')
  end subroutine copy_terms

  !> 1 / a time constant, 0 if that is not given [1/s].
  pure real(wp) function rate_of(group, key) result(rate)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key

    rate = 0.0_wp
    if (group%has_value(key)) rate = 1 / group%number(key)
  end function rate_of

end module nocdyn_electrical_faults
