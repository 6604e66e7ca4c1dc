!> Notes on damping that a run has otherwise: the viscous one that stands for relative damping over the time, where its frequency
!> is not the one of the vibration, and torques that follow the mean speed of a cycle and do not damp oscillations.
module nocdyn_damping_notes
  use nocdyn_element_sets, only: element_names
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, joined, quoted, rounded_text, string_t, to_text
  use nocdyn_units, only: from_si, unit_hz
  implicit none (type, external)
  private

  public :: has_stand_ins, note_mean_slopes, note_stand_ins

contains

  !> Adds a note if a torque that follows the mean speed has a slope over it.
  subroutine note_mean_slopes(machine, slope, notes)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: slope(:)   !! derivatives of the torques by the speeds, others have no part [N m s/rad], [elements]
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: most_names = 4
    integer :: e
    integer, allocatable :: changing(:)

    changing = pack([(e, e=1, size(slope))], machine%follows_mean_speed() .and. abs(slope) > 0)
    if (size(changing) == 0) return
    associate (steepest => slope(changing(maxloc(abs(slope(changing)), dim=1))))
      call append(notes, 'the mean torque of ' // joined(element_names(machine, changing), ', ', most_names) // &
                         ' changes over the speed by up to ' // rounded_text(steepest, 3) // ' N m s/rad: it follows the ' // &
                         'mean speed and does not damp oscillations here; nocdyn run takes it at the speed of the moment, ' // &
                         'where it does')
    end associate
  end subroutine note_mean_slopes

  !> Whether elements of a machine have a viscous damping in place of a relative one.
  pure logical function has_stand_ins(machine)
    type(machine_t), intent(in) :: machine   !! one lane
    integer :: b

    has_stand_ins = .false.
    do b = 1, size(machine%banks)
      if (allocated(machine%banks(b)%bank%loss_damping)) has_stand_ins = has_stand_ins .or. &
                                                                         any(machine%banks(b)%bank%loss_damping > 0)
    end do
  end function has_stand_ins

  !> Adds a note on the couplings and shafts whose damping has another frequency than the lowest mode that twists them most.
  subroutine note_stand_ins(machine, linear, notes)
    type(machine_t), intent(in) :: machine         !! one lane
    type(linearisation_t), intent(in) :: linear    !! all but `matrix` and `held`
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: most_names = 4
    integer :: b, e, last
    character(len=:), allocatable :: list
    type(string_t), allocatable :: cases(:)   ! "coupling 'rubber' at 5 Hz, the mode at 12 Hz: 0.02 in place of 0.008"

    allocate (cases(0))
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (.not. allocated(bank%loss_damping)) cycle
        e = 1
        do while (e <= bank%count)
          last = e
          do while (bank%has_parts .and. last < bank%count)
            if (bank%names(last + 1)%text /= bank%names(e)%text) exit
            last = last + 1
          end do
          call add_case(trim(bank%kind_name()) // ' ' // quoted(bank%names(e)%text), bank%first - 1 + e, bank%first - 1 + last, &
                        bank%loss_factor(e), bank%loss_damping(e), linear, cases)
          e = last + 1
        end do
      end associate
    end do
    if (size(cases) == 0) return
    list = cases(1)%text
    do e = 2, min(size(cases), most_names)
      list = list // '; ' // cases(e)%text
    end do
    if (size(cases) > most_names) list = list // '; and ' // to_text(size(cases) - most_names) // ' more'
    call append(notes, 'over the time (run, sweep) the viscous damping that stands for the relative one has another ' // &
                       'frequency than the mode, and another damping ratio than in response and campbell: ' // list // &
                       '; equal with damping_frequency_hz of the mode')
  end subroutine note_stand_ins

  !> Adds one of them, if the frequencies differ and the damping counts.
  subroutine add_case(name, first, last, loss_factor, damping, linear, cases)
    character(len=*), intent(in) :: name
    integer, intent(in) :: first, last          !! its elements
    real(wp), intent(in) :: loss_factor, damping   !! of the first one; viscous, in place of it [N m s/rad]
    type(linearisation_t), intent(in) :: linear
    type(string_t), allocatable, intent(inout) :: cases(:)
    real(wp), parameter :: far = 1.5_wp         ! ratio of the frequencies
    real(wp), parameter :: twisted = 0.5_wp     ! of the largest share of the energy
    real(wp), parameter :: counts = 0.005_wp    ! damping ratio
    real(wp), dimension(size(linear%natural)) :: share
    real(wp) :: chosen, lossy, viscous
    integer :: m

    if (.not. (damping > 0 .and. linear%stiffness(first) > 0) .or. size(share) == 0) return
    share = 0.0_wp
    do m = 1, size(share)
      if (linear%natural(m) > 0) share(m) = sum(linear%stiffness(first:last) * linear%twists(first:last, m)**2) &
                                            / sum(linear%stiffness * linear%twists(:, m)**2)
    end do
    if (.not. maxval(share) > 0) return
    m = minloc(linear%natural, dim=1, mask=share >= twisted * maxval(share))
    chosen = loss_factor * linear%stiffness(first) / damping   ! [rad/s]
    lossy = 0.5_wp * loss_factor * share(m)
    viscous = lossy * linear%natural(m) / chosen
    if (max(chosen / linear%natural(m), linear%natural(m) / chosen) <= far .or. max(lossy, viscous) < counts) return
    call append(cases, name // ' at ' // hertz(chosen) // ' Hz, the mode at ' // hertz(linear%natural(m)) // ' Hz: ' // &
                       rounded_text(viscous, 2) // ' in place of ' // rounded_text(lossy, 2))
  end subroutine add_case

  pure function hertz(omega) result(text)
    real(wp), intent(in) :: omega   !! [rad/s]
    character(len=len(rounded_text(from_si(omega, unit_hz), 3))) :: text

    text = rounded_text(from_si(omega, unit_hz), 3)
  end function hertz

end module nocdyn_damping_notes
