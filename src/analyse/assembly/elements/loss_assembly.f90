!> The banks of the losses of teeth of an input: the ones of gears and planetary sets, and of elastic meshes.
module nocdyn_loss_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_curves, only: curve_t, extrapolation_constant, interpolation_linear, new_curve
  use nocdyn_element_groups, only: check_from_standstill, element_groups_t
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_mesh_assembly, only: radii_of
  use nocdyn_text, only: to_text
  use nocdyn_tooth_losses, only: new_tooth_losses, teeth_t
  implicit none (type, external)
  private

  public :: add_losses, check_loss, has_losses

contains

  !> Whether teeth lose something.
  pure logical function has_losses(group)
    type(group_t), intent(in) :: group

    has_losses = .false.
    if (all(group%kind /= [character(len=9) :: 'gear', 'planetary', 'mesh'])) return
    has_losses = group%has_value('table_efficiency')
    if (group%has_value('efficiency')) has_losses = group%number('efficiency') < 1 .or. &
                                                    group%number('reverse_efficiency', absent=1.0_wp) < 1
  end function has_losses

  !> Refuses losses of gears whose first wheel does not turn, and tables that do not begin at standstill.
  subroutine check_loss(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (group => input%groups(index))
      if (.not. has_losses(group)) return
      call check_from_standstill(input, index, 'table_speed', 'speeds', diagnostics)
      if (group%has_value('table_reverse') .and. &
          size(group%numbers('table_reverse')) /= size(group%numbers('table_speed'))) then
        call input%report(index, 'table_reverse', 'table_reverse has ' // to_text(size(group%numbers('table_reverse'))) // &
                   ' values; needed: ' // to_text(size(group%numbers('table_speed'))) // ', as table_speed', diagnostics)
      end if
      if (first_is_ground(group)) then
        call diagnostics%add(input%groups(index)%line, index, "'ground' is the first wheel, which does not turn; " // &
                   'allowed: a body, as a gear with losses turns')
      end if
    end associate
  end subroutine check_loss

  !> Whether the first wheel of a gear or a mesh stands still.
  logical function first_is_ground(group)
    type(group_t), intent(in) :: group

    first_is_ground = .false.
    if (group%kind == 'planetary') return
    associate (names => group%texts('bodies'))
      first_is_ground = names(1)%text == 'ground'
    end associate
  end function first_is_ground

  !> Adds the banks of the losses of all groups of one kind; those with a table have a bank each.
  subroutine add_losses(groups, rows, banks)
    type(element_groups_t), intent(in) :: groups   !! gears, planetary sets or meshes
    integer, intent(in) :: rows(:)                 !! groups of the constraint rows
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    logical :: has_table(size(groups%indices)), is_lossy(size(groups%indices))
    integer :: e, i

    do i = 1, size(groups%indices)
      is_lossy(i) = has_losses(groups%input%groups(groups%indices(i)))
      has_table(i) = groups%input%groups(groups%indices(i))%has_value('table_efficiency')
    end do
    call add_bank(groups%some(is_lossy .and. .not. has_table), rows, banks)
    do i = 1, size(groups%indices)
      if (has_table(i)) call add_bank(groups%some([(e == i, e=1, size(groups%indices))]), rows, banks)
    end do
  end subroutine add_losses

  !> Adds a bank of losses.
  subroutine add_bank(groups, rows, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: rows(:)   !! groups of the constraint rows
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(teeth_t) :: teeth
    integer :: from(size(groups%indices)), i, to(size(groups%indices))

    if (size(groups%indices) == 0) return
    from = 0
    if (groups%input%groups(groups%indices(1))%kind == 'planetary') then
      from = groups%bodies('carrier', 1)
      to = groups%bodies('sun', 1)
    else
      to = groups%bodies('bodies', 1)
    end if
    allocate (teeth%row(size(groups%indices)), teeth%factor(size(groups%indices)))
    do i = 1, size(groups%indices)
      teeth%row(i) = findloc(rows, groups%indices(i), dim=1)
      teeth%factor(i) = torque_factor(groups%input%groups(groups%indices(i)))
    end do
    teeth%forward = groups%values('efficiency', absent=1.0_wp)
    teeth%backward = groups%values('reverse_efficiency', absent=huge(1.0_wp))
    where (teeth%backward > 1) teeth%backward = teeth%forward
    call read_tables(groups%input%groups(groups%indices(1)), teeth)
    call append_bank(banks, new_tooth_losses(groups%names, from, to, teeth))
  end subroutine add_bank

  !> The torque on the first wheel by the multiplier of a gear or the force of a mesh.
  pure real(wp) function torque_factor(group)
    type(group_t), intent(in) :: group
    real(wp) :: radii(2)

    torque_factor = 1.0_wp
    if (group%kind == 'planetary') return   ! its row is the one of the torque on the sun
    if (group%kind == 'gear') then
      if (.not. group%has_value('radii')) return
    end if
    radii = radii_of(group)
    torque_factor = radii(1)
  end function torque_factor

  !> The tables of a group that has some.
  subroutine read_tables(group, teeth)
    type(group_t), intent(in) :: group
    type(teeth_t), intent(inout) :: teeth

    if (.not. group%has_value('table_efficiency')) return
    allocate (teeth%forward_over_speed, source=table('table_efficiency'))
    if (group%has_value('table_reverse')) then
      allocate (teeth%backward_over_speed, source=table('table_reverse'))
    else
      allocate (teeth%backward_over_speed, source=teeth%forward_over_speed)
    end if

  contains

    type(curve_t) function table(key)
      character(len=*), intent(in) :: key

      table = new_curve(group%numbers('table_speed'), group%numbers(key), interpolation_linear, extrapolation_constant)
    end function table

  end subroutine read_tables

end module nocdyn_loss_assembly
