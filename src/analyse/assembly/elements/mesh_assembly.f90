!> The banks of elastic meshes of an input: springs along R1 phi_1 + R2 phi_2, with and without backlash.
module nocdyn_mesh_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_couplings, only: coupling_common_t, couplings_t, new_couplings, transmission_error_t
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_element_rows, only: new_element_rows
  use nocdyn_gap_couplings, only: new_gap_couplings
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_phases, only: new_phases, phases_t
  use nocdyn_polynomial_couplings, only: new_polynomial_couplings
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: mesh_form, add_mesh_form, check_mesh, radii_of

  integer, parameter :: tight = 1, with_backlash = 2
  integer, parameter :: forms_without_error = 2   ! as many follow with one

contains

  !> Refuses transmission errors without orders, and lists of other lengths.
  subroutine check_mesh(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=*), parameter :: keys(*) = [character(len=12) :: 'error_orders', 'error_phases']
    integer :: k

    associate (mesh => input%groups(index), errors => size(input%groups(index)%numbers('transmission_error')))
      if (errors == 0) return
      do k = 1, size(keys)
        if (any(size(mesh%numbers(keys(k))) == [0, errors])) cycle
        call input%report(index, keys(k), keys(k) // ' has ' // to_text(size(mesh%numbers(keys(k)))) // &
                   ' and transmission_error ' // to_text(errors) // ' values; needed: as many of each', diagnostics)
      end do
      if (mesh%has_value('teeth') .or. mesh%has_value('error_orders')) return
      call input%report(index, 'transmission_error', 'error_orders is missing; needed ' // &
                 'where radii stand for the teeth, whose number is the order', diagnostics)
    end associate
  end subroutine check_mesh

  !> Form of the law of a group &mesh.
  pure integer function mesh_form(group)
    type(group_t), intent(in) :: group

    mesh_form = merge(with_backlash, tight, group%number('backlash') > 0)
    if (size(group%numbers('transmission_error')) > 0) mesh_form = mesh_form + forms_without_error
  end function mesh_form

  !> Adds the bank of the meshes of one form. With a transmission error each has a bank of its own, and its phase another.
  subroutine add_mesh_form(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    type(phases_t) :: phase
    type(element_groups_t) :: one
    integer :: e, i

    if (form <= forms_without_error) then
      call add_meshes(groups, form, banks)
      return
    end if
    do i = 1, size(groups%indices)
      one = groups%some([(e == i, e=1, size(groups%indices))])
      call add_meshes(one, form - forms_without_error, banks)
      select type (mesh => banks(size(banks))%bank)
      class is (couplings_t)
        if (mesh%error_orders == 0) cycle
        phase = new_phases(mesh%lanes, mesh%names, mesh%rows%body(:1))
        phase%with_work = mesh%with_work
      end select
      call append_bank(banks, phase)
    end do
  end subroutine add_mesh_form

  subroutine add_meshes(groups, form, banks)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: form   !! without the one of the error
    type(bank_slot_t), allocatable, intent(inout) :: banks(:)
    integer :: bodies(2, size(groups%indices)), i
    real(wp) :: radii(2, size(groups%indices))
    type(coupling_common_t) :: shared

    if (size(groups%indices) == 0) return
    bodies(1, :) = groups%bodies('bodies', 1)
    bodies(2, :) = groups%bodies('bodies', 2)
    do i = 1, size(groups%indices)
      radii(:, i) = radii_of(groups%input%groups(groups%indices(i)))
    end do
    shared%names = groups%names
    shared%rows = new_element_rows([(2 * i - 1, i=1, size(bodies, 2) + 1)], [bodies], [radii])
    shared%damping = groups%values('damping')
    shared%rest_twist = 0.0_wp * shared%damping
    shared%is_mesh = .true.
    call read_error(groups%input%groups(groups%indices(1)), bodies(1, 1), shared%error)
    if (form == with_backlash) then
      call append_bank(banks, new_gap_couplings(groups, shared))
    else if (allocated(shared%error)) then
      call append_bank(banks, new_polynomial_couplings(groups, shared))
    else
      call append_bank(banks, new_couplings(groups, shared))
    end if
  end subroutine add_meshes

  !> The transmission error of a mesh, by the angle of its first body; not allocated: none. One that stands still has none.
  subroutine read_error(group, first_body, error)
    type(group_t), intent(in) :: group
    integer, intent(in) :: first_body
    type(transmission_error_t), allocatable, intent(out) :: error
    integer :: k, teeth(2)

    if (size(group%numbers('transmission_error')) == 0 .or. first_body == 0) return
    allocate (error)
    error%amplitude = group%numbers('transmission_error')
    error%order = group%numbers('error_orders')
    if (size(error%order) == 0) then   ! the frequency of the teeth and its multiples
      teeth = group%whole_numbers('teeth')
      error%order = [(real(k * teeth(1), wp), k=1, size(error%amplitude))]
    end if
    error%phase = group%numbers('error_phases')
    if (size(error%phase) == 0) error%phase = 0.0_wp * error%amplitude
  end subroutine read_error

  !> R1 and R2 [m], the latter negative in an internal gear. Deformations are along the line of action, which touches both base
  !> circles.
  pure function radii_of(group) result(radii)
    type(group_t), intent(in) :: group
    real(wp) :: radii(2)

    if (group%has_value('radii')) then
      radii = group%numbers('radii')
    else
      radii = 0.5_wp * group%number('module') * group%whole_numbers('teeth') * cos(group%number('pressure_angle'))
    end if
    if (group%flag('internal')) radii(2) = -radii(2)
  end function radii_of

end module nocdyn_mesh_assembly
