!> Which quantities and angles of a forced response are computed: the ones that are written, and what limits, damage, records,
!> notes and critical speeds need.
module nocdyn_response_choice
  use nocdyn_bank, only: bank_of
  use nocdyn_column_names, only: choose_signals
  use nocdyn_critical_speeds, only: crossing_t
  use nocdyn_errors, only: error_t
  use nocdyn_fatigue_groups, only: element_kind
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_gap_couplings, only: gap_couplings_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_linear_ranges, only: curved_elements, is_compared
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_branches, only: speed_modes_t
  use nocdyn_moment_forms, only: kind_moment, kind_reaction, moment_form_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: string_t
  use nocdyn_tooth_losses, only: tooth_losses_t
  implicit none (type, external)
  private

  public :: choose_quantities, choose_shown, find_couplings, has_gap, lose_of

contains

  !> Chooses what is written.
  subroutine choose_shown(input, response, shown, shown_angles, notes, error)
    type(input_t), intent(in) :: input
    type(forced_response_t), intent(in) :: response
    integer, allocatable, intent(out) :: shown(:)          !! quantities
    integer, allocatable, intent(out) :: shown_angles(:)   !! of `response%angles`
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(signal_t), allocatable :: signals(:)
    integer, allocatable :: chosen(:)
    integer :: q

    associate (quantities => response%quantities, angles => response%angles)
      allocate (signals(size(quantities) + size(angles)))
      do q = 1, size(quantities)
        signals(q) = quantities(q)%signal_t
      end do
      signals(size(quantities) + 1:) = angles
      call choose_signals(input, 'response', signals, chosen, notes, error)
      if (allocated(error)) return
      shown = pack(chosen, chosen <= size(quantities))
      shown_angles = pack(chosen, chosen > size(quantities)) - size(quantities)
    end associate
  end subroutine choose_shown

  !> Leaves only the quantities and angles that something needs; numbers those that are written and limited anew. Variants may
  !> record any. The moments of curved laws are compared with the largest of all.
  subroutine choose_quantities(input, response, shown, shown_angles, limited)
    type(input_t), intent(in) :: input
    type(forced_response_t), intent(inout) :: response
    integer, intent(inout) :: shown(:)
    integer, intent(in) :: shown_angles(:)
    integer, intent(inout) :: limited(:)   !! quantities
    logical :: bodies(response%machine%bodies), kept(size(response%quantities))
    integer :: place(size(kept)), q

    bodies = .false.
    bodies(response%angles(shown_angles)%source%index) = .true.
    kept = .false.
    kept(shown) = .true.
    kept(limited) = .true.
    if (all(kept) .or. size(input%groups_named('record')) + size(input%groups_named('objective')) > 0) return
    call keep_damaged(input, response%quantities, kept)
    call keep_noted(response%machine, response%quantities, kept)
    call compare_curved(response, kept, bodies)
    place = unpack([(q, q=1, count(kept))], kept, 0)
    shown = place(shown)
    limited = place(limited)
    call response%keep(kept, bodies)
  end subroutine choose_quantities

  !> Keeps the angles of curved laws, and what is compared with their moments.
  subroutine compare_curved(response, kept, bodies)
    type(forced_response_t), intent(inout) :: response
    logical, intent(in) :: kept(:)        !! [quantities]
    logical, intent(inout) :: bodies(:)   !! whose angles are kept, [bodies]
    integer, allocatable :: curved(:)
    integer :: i, k, q

    allocate (curved, source=curved_elements(response%machine))
    if (size(curved) == 0) return
    response%left_out = response%quantities(pack([(q, q=1, size(kept))], .not. kept .and. is_compared(response%quantities)))
    associate (rows => response%machine%elements%rows)
      do i = 1, size(curved)
        do k = rows%first(curved(i)), rows%first(curved(i) + 1) - 1
          if (rows%body(k) > 0) bodies(rows%body(k)) = .true.
        end do
      end do
    end associate
  end subroutine compare_curved

  !> Keeps what groups &fatigue ask for.
  subroutine keep_damaged(input, quantities, kept)
    type(input_t), intent(in) :: input
    type(moment_form_t), intent(in) :: quantities(:)
    logical, intent(inout) :: kept(:)   !! [quantities]
    integer, allocatable :: groups(:)
    integer :: i, q

    allocate (groups, source=input%groups_named('fatigue'))
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        do q = 1, size(kept)
          kept(q) = kept(q) .or. (quantities(q)%element_kind == trim(element_kind(group)) .and. &
                                  quantities(q)%element == group%text(trim(element_kind(group))))
        end do
      end associate
    end do
  end subroutine keep_damaged

  !> Keeps what notes need: the moments of couplings with a gap, the reactions of rows that slip or open, what teeth lose a share
  !> of.
  subroutine keep_noted(machine, quantities, kept)
    type(machine_t), intent(in) :: machine
    type(moment_form_t), intent(in) :: quantities(:)
    logical, intent(inout) :: kept(:)   !! [quantities]
    integer :: b, e, q

    do q = 1, size(kept)
      associate (one => quantities(q))
        if (one%kind == kind_reaction) then
          kept(q) = kept(q) .or. machine%constraints%most(one%source%index) < huge(1.0_wp) .or. &
                    machine%constraints%least(one%source%index) > -huge(1.0_wp)
        else
          kept(q) = kept(q) .or. has_gap(machine, one)
        end if
      end associate
    end do
    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      class is (tooth_losses_t)
        do e = 1, bank%count
          kept = kept .or. lose_of(bank, e, quantities)
        end do
      end select
    end do
  end subroutine keep_noted

  !> Finds the coupling with most of the potential energy of each mode that a line crosses; computes its quantities too.
  subroutine find_couplings(forms, modes, response, crossings)
    type(moment_form_t), intent(in) :: forms(:)      !! all quantities of the machine
    type(speed_modes_t), intent(in) :: modes
    type(forced_response_t), intent(inout) :: response
    type(crossing_t), intent(inout) :: crossings(:)
    integer :: i, k, q, strongest

    do i = 1, size(crossings)
      strongest = strongest_moment(forms, abs(response%points(1)%state%slopes%stiffness), modes%twists(:, crossings(i)%mode))
      if (strongest == 0) cycle
      do k = 1, size(forms)
        if (forms(k)%element /= forms(strongest)%element .or. forms(k)%kind == kind_reaction) cycle
        do q = 1, size(response%quantities)
          if (response%quantities(q)%name == forms(k)%name) exit
        end do
        if (q > size(response%quantities)) call response%add_quantity(forms(k))
        if (k == strongest) crossings(i)%quantity = q
      end do
    end do
  end subroutine find_couplings

  !> The moment of the elements with most of the potential energy of a mode, 0 if none have any.
  pure integer function strongest_moment(forms, stiffness, twist) result(strongest)
    type(moment_form_t), intent(in) :: forms(:)
    real(wp), intent(in) :: stiffness(:)   !! magnitudes [N m/rad], [elements]
    complex(wp), intent(in) :: twist(:)    !! [elements]
    real(wp) :: energy, most
    integer :: e, k, q

    strongest = 0
    most = 0.0_wp
    do q = 1, size(forms)
      if (forms(q)%kind /= kind_moment) cycle
      energy = 0.0_wp
      do k = 1, size(forms(q)%elements)
        e = forms(q)%elements(k)
        energy = energy + stiffness(e) * abs(twist(e))**2
      end do
      if (energy <= most) cycle
      strongest = q
      most = energy
    end do
  end function strongest_moment

  !> Whether a quantity is the moment of one element with a gap.
  pure logical function has_gap(machine, quantity)
    type(machine_t), intent(in) :: machine
    type(moment_form_t), intent(in) :: quantity

    has_gap = .false.
    if (quantity%kind /= kind_moment .or. size(quantity%elements) /= 1) return
    select type (bank => machine%banks(bank_of(machine%banks, quantity%elements(1)))%bank)
    class is (gap_couplings_t)
      has_gap = .true.
    end select
  end function has_gap

  !> Whether a quantity is the one that teeth lose a share of: the reaction of their row, or the moment of their mesh.
  elemental logical function lose_of(losses, element, quantity)
    type(tooth_losses_t), intent(in) :: losses
    integer, intent(in) :: element              !! numbered within the bank
    type(moment_form_t), intent(in) :: quantity

    if (losses%row(element) > 0) then
      lose_of = quantity%kind == kind_reaction .and. quantity%source%index == losses%row(element)
    else
      lose_of = quantity%kind == kind_moment .and. quantity%element == losses%names(element)%text
    end if
  end function lose_of

end module nocdyn_response_choice
