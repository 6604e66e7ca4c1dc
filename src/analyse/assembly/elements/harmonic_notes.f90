!> Notes on what the harmonics of pressures and forces leave out of their tables.
module nocdyn_harmonic_notes
  use nocdyn_crank_assembly, only: force_of, sampled_force
  use nocdyn_cylinder_torques, only: gas_torque, sampled_torque
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_order_excitations, only: order_torque_t
  use nocdyn_piston_forces, only: periodic_force_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: note_left_out_harmonics

  real(wp), parameter :: worth_noting = 0.005_wp   ! of the largest value

contains

  !> Notes where the orders above `harmonics_up_to` have more than 0.5 % of the largest gas torque or force.
  subroutine note_left_out_harmonics(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(order_torque_t) :: torque
    type(periodic_force_t) :: force
    integer :: i

    do i = 1, size(input%groups)
      associate (group => input%groups(i))
        if (group%kind == 'engine') then
          if (.not. group%has_value('crank_angles')) cycle
          torque = gas_torque(group, trim(merge('torques  ', 'pressures', group%has_value('torques'))))
          call add_note(group, 'N m of the gas torque of a cylinder', sampled_torque(group), torque%mean(1), &
                        torque%sine(:, 1), torque%cosine(:, 1), notes)
        else if (group%kind == 'crank') then
          if (.not. group%has_value('crank_angles')) cycle
          force = force_of(group)
          call add_note(group, 'N of the force on the piston', sampled_force(group), force%mean, force%sine, force%cosine, notes)
        end if
      end associate
    end do
  end subroutine note_left_out_harmonics

  subroutine add_note(group, what, sample, mean, sine, cosine, notes)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: what                   !! unit and name of the quantity
    real(wp), intent(in) :: sample(0:)                     !! over a cycle
    real(wp), intent(in) :: mean, sine(:), cosine(:)       !! of its sum of harmonics 1, 2, ...
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp) :: left_out

    left_out = largest_difference(sample, mean, sine, cosine)
    associate (share => left_out / max(maxval(abs(sample)), tiny(1.0_wp)))
      if (share <= worth_noting) return
      call append(notes, group%kind // ' ' // quoted(group%name) // ': harmonics_up_to = ' // &
                  to_text(group%number('harmonics_up_to')) // ' leaves out up to ' // rounded_text(left_out, 3) // ' ' // &
                  what // ', ' // rounded_text(100 * share, 2) // ' % of its largest value')
    end associate
  end subroutine add_note

  !> Between samples and the sum of harmonics.
  pure real(wp) function largest_difference(sample, mean, sine, cosine) result(largest)
    real(wp), intent(in) :: sample(0:), mean, sine(:), cosine(:)
    integer, parameter :: step = 4   ! a highest order of 64 has 16 samples left in a period
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    complex(wp) :: total, unit, wave
    integer :: i, k

    largest = 0.0_wp
    do i = 0, size(sample) - 1, step
      unit = exp(cmplx(0.0_wp, turn * i / size(sample), wp))
      wave = 1.0_wp
      total = mean
      do k = 1, size(sine)
        wave = wave * unit
        total = total + cmplx(cosine(k), -sine(k), wp) * wave
      end do
      largest = max(largest, abs(sample(i) - real(total)))
    end do
  end function largest_difference

end module nocdyn_harmonic_notes
