!> hand_out_costs RANKS VARIANTS VARIANT_TIME JOURNAL ANSWER SPREAD
!>
!> Simulates how rank 0 hands out VARIANTS of VARIANT_TIME seconds to RANKS of one thread: a variant takes JOURNAL seconds in the
!> journal of its rank, a request ANSWER seconds of rank 0; the time of variants differs by SPREAD from share to share. Prints
!> one JSON object: the share of the time in which the ranks integrate, the time of the sweep [s], the number of requests, and the
!> share of the time in which rank 0 answers them.
program hand_out_costs
  use nocdyn_kinds, only: wp
  use simulated_ranks, only: simulate, simulation_t, sweep_costs_t
  implicit none (type, external)

  type(simulation_t) :: simulation

  call simulate(sweep_costs_t(variants=number(2), variant_time=number(3), journal_time=number(4), answer_time=number(5), &
                              spread=number(6)), nint(number(1)), simulation)
  print '(a, es13.6, a, es13.6, a, i0, a, es13.6, a)', '{"efficiency": ', simulation%efficiency, ', "seconds": ', &
    simulation%seconds, ', "requests": ', simulation%requests, ', "busy": ', simulation%busy, '}'

contains

  !> A number of the command line.
  real(wp) function number(position)
    integer, intent(in) :: position
    character(len=32) :: text

    call get_command_argument(position, text)
    read (text, *) number
  end function number

end program hand_out_costs
