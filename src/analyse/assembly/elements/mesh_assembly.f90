!> The banks of elastic meshes of an input: springs along R1 phi_1 + R2 phi_2, with and without backlash.
module nocdyn_mesh_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_couplings, only: coupling_common_t, new_couplings, transmission_error_t
  use nocdyn_element_groups, only: element_groups_t
  use nocdyn_element_rows, only: new_element_rows
  use nocdyn_gap_couplings, only: new_gap_couplings
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: mesh_form, add_mesh_form, check_meshes

  integer, parameter :: tight = 1, with_backlash = 2

contains

  !> Refuses transmission errors without orders, and lists of other lengths.
  subroutine check_meshes(input, error)
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: keys(*) = [character(len=12) :: 'error_orders', 'error_phases']
    integer, allocatable :: meshes(:)
    integer :: i, k

    allocate (meshes, source=input%groups_named('mesh'))
    do i = 1, size(meshes)
      associate (mesh => input%groups(meshes(i)), errors => size(input%groups(meshes(i))%numbers('transmission_error')))
        if (errors == 0) cycle
        do k = 1, size(keys)
          if (any(size(mesh%numbers(keys(k))) == [0, errors])) cycle
          call raise(error, exit_input, input%location(meshes(i), keys(k)) // ': ' // keys(k) // ' has ' // &
                     to_text(size(mesh%numbers(keys(k)))) // ' and transmission_error ' // to_text(errors) // &
                     ' values; needed: as many of each')
          return
        end do
        if (mesh%has_value('teeth') .or. mesh%has_value('error_orders')) cycle
        call raise(error, exit_input, input%location(meshes(i), 'transmission_error') // ': error_orders is missing; needed ' // &
                   'where radii stand for the teeth, whose number is the order')
        return
      end associate
    end do
  end subroutine check_meshes

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
    allocate (shared%error)
    call collect_errors(groups, bodies(1, :), shared%error)
    stiffness = groups%values('stiffness')
    select case (form)
    case (tight)
      call append_bank(banks, new_couplings(shared, stiffness, zero))
    case default
      call append_bank(banks, new_gap_couplings(shared, spread(stiffness, 1, 1), groups%values('backlash'), stiffness))
    end select
  end subroutine add_mesh_form

  !> The transmission errors of meshes, each of the angle of its first body. One that stands still has none.
  subroutine collect_errors(groups, first_body, error)
    type(element_groups_t), intent(in) :: groups
    integer, intent(in) :: first_body(:)
    type(transmission_error_t), intent(out) :: error
    real(wp), allocatable :: amplitude(:), order(:), phase(:)
    integer :: i, k, teeth(2)

    allocate (error%coupling(0), error%order(0), error%amplitude(0), error%phase(0))
    do i = 1, size(groups%indices)
      associate (group => groups%input%groups(groups%indices(i)))
        amplitude = group%numbers('transmission_error')
        if (size(amplitude) == 0 .or. first_body(i) == 0) cycle
        order = group%numbers('error_orders')
        if (size(order) == 0) then   ! the frequency of the teeth and its multiples
          teeth = group%whole_numbers('teeth')
          order = [(real(k * teeth(1), wp), k=1, size(amplitude))]
        end if
        phase = group%numbers('error_phases')
        if (size(phase) == 0) phase = 0.0_wp * amplitude
        error%coupling = [error%coupling, spread(i, 1, size(amplitude))]
        error%order = [error%order, order]
        error%amplitude = [error%amplitude, amplitude]
        error%phase = [error%phase, phase]
      end associate
    end do
  end subroutine collect_errors

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
