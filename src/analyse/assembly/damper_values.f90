!> Torsional vibration dampers by their data sheets: a ring on a body, joined by a coupling.
module nocdyn_damper_values
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: group_rules
  use nocdyn_text, only: quoted, to_text
  implicit none (type, external)
  private

  public :: check_damper, derive_damper, gap_damping

  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> Refuses dampers without damping, and names that couplings have.
  subroutine check_damper(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: g

    associate (damper => input%groups(index))
      select case (damper%text('kind'))
      case ('viscous')
        if (.not. (damper%has_value('damping') .or. damper%has_value('viscosity'))) then
          call input%report(index, 'kind', "kind = 'viscous' needs damping [N m s/rad], or viscosity [Pa s] with the radii, " // &
                            'the width and the gaps of the ring', diagnostics)
        end if
      case ('viscous_spring')
        if (.not. (damper%has_value('damping') .or. damper%has_value('damping_ratio') .or. damper%has_value('loss_factor'))) then
          call input%report(index, 'kind', "kind = 'viscous_spring' needs damping [N m s/rad], damping_ratio or loss_factor", &
                            diagnostics)
        end if
      case default   ! the schema asks for all numbers of rubber
      end select
      do g = 1, size(input%groups)
        associate (other => input%groups(g))
          if (other%made_from > 0 .or. other%name /= damper%name .or. group_rules(other%rule)%name_space /= 'coupling') cycle
          call input%report(index, 'name', 'the name ' // quoted(damper%name) // ' is taken by &' // other%kind // &
                            ' on line ' // to_text(other%line), diagnostics)
        end associate
      end do
    end associate
  end subroutine check_damper

  !> Sets the numbers of a body or a coupling that is part of a damper.
  subroutine derive_damper(damper, part)
    type(group_t), intent(in) :: damper
    type(group_t), intent(inout) :: part
    real(wp) :: stiffness, tuned   ! [N m/rad], [rad/s]

    if (part%kind == 'body') then
      call part%set_number('inertia', damper%number('ring_inertia'))
      return
    end if
    if (damper%text('kind') == 'viscous') then
      call part%set_number('damping', viscous_damping(damper))
      return
    end if
    associate (inertia => damper%number('ring_inertia'))
      if (damper%has_value('stiffness')) then
        stiffness = damper%number('stiffness')
        tuned = sqrt(stiffness / inertia)
      else
        tuned = damper%number('tuning_frequency')
        stiffness = inertia * tuned**2
      end if
    end associate
    call part%set_number('stiffness', stiffness)
    if (damper%text('kind') == 'rubber') then
      call part%set_number('relative_damping', damper%number('relative_damping', &
                                                       absent=2.0_wp * pi * damper%number('loss_factor', absent=0.0_wp)))
      call part%set_number('damping_frequency', damper%number('damping_frequency', absent=tuned))
    else if (damper%has_value('damping')) then
      call part%set_number('damping', damper%number('damping'))
    else if (damper%has_value('loss_factor')) then
      call part%set_number('damping', damper%number('loss_factor') * stiffness / tuned)
    else
      call part%set_number('damping', 2.0_wp * damper%number('damping_ratio') * stiffness / tuned)
    end if
  end subroutine derive_damper

  !> The damping of a ring in oil [N m s/rad].
  pure real(wp) function viscous_damping(damper) result(damping)
    type(group_t), intent(in) :: damper

    if (damper%has_value('damping')) then
      damping = damper%number('damping')
    else
      damping = gap_damping(damper%number('viscosity'), [damper%number('inner_radius'), damper%number('outer_radius')], &
                            damper%number('width'), &
                            [damper%number('inner_gap', absent=damper%number('radial_gap')), damper%number('radial_gap')], &
                            damper%number('lateral_gap'))
    end if
  end function viscous_damping

  !> The moment per rate of twist of a ring in the oil of a housing: Newton's shear stress eta r omega / h times the radius,
  !> integrated over both cylinders and both sides, 2 pi eta (R^3 b / h_R + r^3 b / h_r + (R^4 - r^4) / (2 h_s)). The oil is
  !> Newtonian and the ring is centred, as in the usual theory of Houdaille's damper; with silicone oil, whose complex viscosity
  !> depends on the frequency, it is an approximation (J. Sound Vib. 82 (1982) 465-472).
  pure real(wp) function gap_damping(viscosity, radius, width, gap, side_gap) result(damping)
    real(wp), intent(in) :: viscosity    !! dynamic, eta [Pa s]
    real(wp), intent(in) :: radius(2)    !! inner one r, outer one R [m]
    real(wp), intent(in) :: width        !! b [m]
    real(wp), intent(in) :: gap(2)       !! at the inner and at the outer cylinder, h_r, h_R [m]
    real(wp), intent(in) :: side_gap     !! on each side, h_s [m]

    damping = 2.0_wp * pi * viscosity * (width * sum(radius**3 / gap) + (radius(2)**4 - radius(1)**4) / (2.0_wp * side_gap))
  end function gap_damping

end module nocdyn_damper_values
