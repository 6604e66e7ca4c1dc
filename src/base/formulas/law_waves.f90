!> How fast the sines of a law oscillate while the time and the angles advance.
module nocdyn_law_waves
  use nocdyn_kinds, only: wp
  use nocdyn_law_tape, only: law_tape_t, op_add, op_angle, op_cosine, op_harmonics, op_scale, op_shift, op_sine, op_subtract, &
    op_time, op_wave
  use nocdyn_laws, only: law_t
  implicit none (type, external)
  private

  public :: has_waves, fastest_wave

contains

  !> Whether a law has sines of variables.
  pure logical function has_waves(tape)
    type(law_tape_t), intent(in) :: tape
    integer :: i

    has_waves = any([(any(tape%node(i)%operation == [op_wave, op_sine, op_cosine, op_harmonics]) .and. &
                .not. tape%node(i)%is_constant, i=1, tape%count)])
  end function has_waves

  !> The largest rate of the arguments of its sines [rad/s], in which harmonics count with their largest multiple. Arguments are
  !> sums of multiples of the time and of angles; other forms do not count.
  pure real(wp) function fastest_wave(law, slot, speed) result(fastest)
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot            !! of the element, counted through all strips
    real(wp), intent(in) :: speed(:)       !! u' of the element, and of its phase if it has one [rad/s]
    integer :: i

    fastest = 0.0_wp
    do i = 1, law%tape%count
      associate (node => law%tape%node(i))
        if (node%is_constant) cycle
        select case (node%operation)
        case (op_wave, op_sine, op_cosine)
          fastest = max(fastest, abs(rate_of(law, slot, speed, node%a)))
        case (op_harmonics)
          associate (last => node%first + (node%last - node%first + 1) / 3 - 1)   ! of the multiples
            fastest = max(fastest, maxval(law%tape%list(node%first:last)) * abs(rate_of(law, slot, speed, node%a)))
          end associate
        case default
          cycle
        end select
      end associate
    end do
  end function fastest_wave

  !> The rate of a node that is a sum of multiples of the time and of angles [1/s], 0 of others. A list of all nodes would be
  !> allocated in every step.
  pure recursive real(wp) function rate_of(law, slot, speed, i) result(rate)
    type(law_t), intent(in) :: law
    integer, intent(in) :: slot, i         !! the element; the node, of which 0 has no rate
    real(wp), intent(in) :: speed(:)

    rate = 0.0_wp
    if (i == 0) return
    associate (node => law%tape%node(i))
      if (node%is_constant) return
      select case (node%operation)
      case (op_time)
        rate = 1.0_wp
      case (op_angle)
        rate = speed(node%a)
      case (op_add)
        rate = rate_of(law, slot, speed, node%a) + rate_of(law, slot, speed, node%b)
      case (op_subtract)
        rate = rate_of(law, slot, speed, node%a) - rate_of(law, slot, speed, node%b)
      case (op_shift)
        rate = rate_of(law, slot, speed, node%a)
      case (op_scale)
        rate = rate_of(law, slot, speed, node%a) * law%constant(slot, law%column(node%b))
      case default
        rate = 0.0_wp
      end select
    end associate
  end function rate_of

end module nocdyn_law_waves
