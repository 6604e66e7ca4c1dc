!> The banks of elastic meshes of an input: springs along R1 phi_1 + R2 phi_2, with and without backlash.
module nocdyn_mesh_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_couplings, only: coupling_common_t, new_couplings
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_element_rows, only: new_element_rows
  use nocdyn_gap_couplings, only: new_gap_couplings
  use nocdyn_input, only: group_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: mesh_form, add_mesh_form

  integer, parameter :: tight = 1, with_backlash = 2

contains

  !> Form of the law of a group &mesh.
  pure integer function mesh_form(group)
    type(group_t), intent(in) :: group

    mesh_form = merge(with_backlash, tight, group%number('backlash') > 0)
  end function mesh_form

  !> Adds the bank of the meshes of one form.
  subroutine add_mesh_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    real(wp), dimension(groups%lanes, size(groups%indices)) :: stiffness, zero
    integer :: bodies(2, size(groups%indices)), i
    real(wp) :: radii(2, size(groups%indices))
    type(coupling_common_t) :: shared

    if (size(groups%indices) == 0) return
    bodies(1, :) = groups%bodies('bodies', 1)
    bodies(2, :) = groups%bodies('bodies', 2)
    do i = 1, size(groups%indices)
      radii(:, i) = radii_of(groups%input%groups(groups%indices(i)))
    end do
    zero = 0.0_wp
    shared = coupling_common_t(groups%names, new_element_rows([(2 * i - 1, i=1, size(bodies, 2) + 1)], [bodies], [radii]), &
                               groups%values('damping'), zero)
    shared%is_mesh = .true.
    stiffness = groups%values('stiffness')
    select case (form)
    case (tight)
      call append_bank(banks, new_couplings(shared, stiffness, zero))
    case default
      call append_bank(banks, new_gap_couplings(shared, spread(stiffness, 1, 1), groups%values('backlash'), stiffness))
    end select
  end subroutine add_mesh_form

  !> R1 and R2 [m], the latter negative in an internal gear.
  pure function radii_of(group) result(radii)
    type(group_t), intent(in) :: group
    real(wp) :: radii(2)

    if (group%has_value('radii')) then
      radii = group%numbers('radii')
    else
      radii = 0.5_wp * group%number('module') * group%whole_numbers('teeth')
    end if
    if (group%flag('internal')) radii(2) = -radii(2)
  end function radii_of

end module nocdyn_mesh_assembly
