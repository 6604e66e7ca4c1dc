!> Values of an input that follow from others of it: those of the parts of dampers, and of rubber couplings over the time.
module nocdyn_derived_values
  use nocdyn_bank, only: role_coupling
  use nocdyn_coupling_assembly, only: is_rubber, new_rubber_law
  use nocdyn_damper_values, only: derive_damper
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_rubber_laws, only: rubber_law_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: add_rubber_laws, derive_values, has_derived_values

contains

  !> Whether some values of an input follow from others.
  pure logical function has_derived_values(input)
    type(input_t), intent(in) :: input
    integer :: g

    has_derived_values = .false.
    do g = 1, size(input%groups)
      if (is_rubber(input%groups(g)) .or. input%groups(g)%made_from > 0) has_derived_values = .true.
    end do
  end function has_derived_values

  !> Sets the values that follow from others.
  subroutine derive_values(input)
    type(input_t), intent(inout) :: input
    integer :: g

    do g = 1, size(input%groups)
      if (is_rubber(input%groups(g))) call derive_rubber(input%groups(g))
      if (input%groups(g)%made_from == 0) cycle
      associate (source => input%groups(input%groups(g)%made_from))
        if (source%kind == 'damper') call derive_damper(source, input%groups(g))
      end associate
    end do
    do g = 1, size(input%groups)
      if (input%groups(g)%kind == 'damper' .or. is_rubber(input%groups(g))) call add_inertias(input, g)
    end do
  end subroutine derive_values

  !> Adds the inertia of the housing of a damper to its body, or those of both sides of a coupling to its bodies.
  subroutine add_inertias(input, index)
    type(input_t), intent(inout) :: input
    integer, intent(in) :: index   !! of the group
    type(string_t), allocatable :: bodies(:)
    real(wp) :: inertias(2)
    integer :: i

    associate (group => input%groups(index))
      if (group%kind == 'damper') then
        inertias = group%number('housing_inertia')
        allocate (bodies, source=group%texts('body'))
      else
        if (.not. group%flag('inertias')) return
        inertias = [group%number('first_inertia', absent=0.0_wp), group%number('second_inertia', absent=0.0_wp)]
        allocate (bodies, source=group%texts('bodies'))
      end if
    end associate
    do i = 1, size(bodies)
      call add_inertia(input, bodies(i)%text, inertias(i))
    end do
  end subroutine add_inertias

  !> Adds an inertia to a body, which may be the ground.
  subroutine add_inertia(input, name, inertia)
    type(input_t), intent(inout) :: input
    character(len=*), intent(in) :: name   !! of the body
    real(wp), intent(in) :: inertia        !! [kg m2]
    integer :: g

    do g = 1, size(input%groups)
      if (input%groups(g)%kind /= 'body' .or. input%groups(g)%name /= name) cycle
      associate (body => input%groups(g))
        call body%set_number('inertia', body%number('inertia') + inertia / (1.0_wp + body%number('entrained', absent=0.0_wp)))
      end associate
    end do
  end subroutine add_inertia

  !> Sets stiffness and relative damping of a rubber coupling in its condition over the time.
  subroutine derive_rubber(group)
    type(group_t), intent(inout) :: group
    type(rubber_law_t) :: law

    law = new_rubber_law(group)
    if (group%has_value('condition')) then
      if (group%text('condition') == 'warm') then
        if (group%has_value('warm_stiffness')) call group%set_number('stiffness', group%number('warm_stiffness'))
        if (group%has_value('warm_damping')) then
          call group%set_number('relative_damping', group%number('warm_damping'))
          if (group%has_value('magnifier')) deallocate (group%values(group%key_position('magnifier'))%numbers)
        end if
      end if
    end if
    call group%set_number('stiffness', law%base(1) * group%number('stiffness', absent=0.0_wp))
    if (group%has_value('relative_damping')) then
      call group%set_number('relative_damping', law%base(2) * group%number('relative_damping'))
    end if
    if (group%has_value('magnifier')) call group%set_number('magnifier', group%number('magnifier') / law%base(2))
  end subroutine derive_rubber

  !> Lists the laws of the rubber couplings of a machine.
  subroutine add_rubber_laws(input, machine)
    type(input_t), intent(in) :: input           !! with the values of its file
    type(machine_t), intent(inout) :: machine    !! its elements are numbered
    type(rubber_law_t) :: law
    integer :: b, e, g

    allocate (machine%rubber(0))
    do g = 1, size(input%groups)
      if (.not. is_rubber(input%groups(g))) cycle
      law = new_rubber_law(input%groups(g))
      do b = 1, size(machine%banks)
        associate (bank => machine%banks(b)%bank)
          if (bank%role /= role_coupling .or. bank%is_mesh) cycle
          do e = 1, bank%count
            if (bank%names(e)%text == input%groups(g)%name) law%element = bank%first + e - 1
          end do
        end associate
      end do
      machine%rubber = [machine%rubber, law]
    end do
  end subroutine add_rubber_laws

end module nocdyn_derived_values
