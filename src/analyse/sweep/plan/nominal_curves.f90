!> The curves of the machine of the input itself, their limits, and the lines that a diagram of Campbell has.
module nocdyn_nominal_curves
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_analysis_results, only: analysis_mode_curve, analysis_result_t
  use nocdyn_assembly, only: assemble_machine
  use nocdyn_campbell, only: campbell_t
  use nocdyn_campbell_results, only: line_name
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_moment_forms, only: kind_moment, kind_stress, moment_form_t
  use nocdyn_recorded_analyses, only: analysis_reader_t, new_analysis_reader
  use nocdyn_response_limits, only: no_limit
  use nocdyn_text, only: string_t
  use nocdyn_units, only: from_si, unit_hz
  use nocdyn_variant_analysis, only: analyse_variant, find_campbell, matching_quantities, place_of, recorded_kinds
  implicit none (type, external)
  private

  public :: find_nominal_curves

  !> All in the units of the results; NaN where there is none. The points of all curves one after the other, as in the results.
  type, public :: nominal_curves_t
    real(wp), allocatable :: values(:)             !! of the machine of the input, [points of all curves]
    real(wp), allocatable :: limits(:)             !! for continuous operation, [points of all curves]
    type(string_t), allocatable :: lines(:)        !! 'order_2'; none without curves of modes
    real(wp), allocatable :: frequencies(:, :)     !! [Hz], [speeds, lines]
  end type nominal_curves_t

contains

  !> Computes them. A machine that cannot be computed has no values; its variants may have some.
  subroutine find_nominal_curves(input, self, error)
    type(input_t), intent(in) :: input   !! with the groups of the sweep, which has been planned
    type(nominal_curves_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(analysis_reader_t) :: reader
    type(analysis_result_t), allocatable :: all_results(:), curves(:)
    type(diagnostics_t) :: diagnostics
    type(error_t), allocatable :: failure
    type(machine_t) :: machine
    integer :: i, n

    call assemble_machine(input, machine, error)
    if (.not. allocated(error)) call new_analysis_reader(input, machine, 'record', reader, error)
    if (allocated(error)) return
    allocate (all_results(0))
    associate (records => input%groups_named('record'))
      do i = 1, size(records)
        if (input%groups(records(i))%has_value('mode') .or. input%groups(records(i))%has_value('response')) then
          call reader%add_results(input, records(i), 0, all_results, diagnostics)
        end if
      end do
    end associate
    allocate (curves(count(all_results%is_curve())))
    n = 0
    do i = 1, size(all_results)
      if (.not. all_results(i)%is_curve()) cycle
      n = n + 1
      curves(n) = all_results(i)
    end do
    allocate (self%values(size(curves)))
    call analyse_variant(input, curves, self%values, failure)
    if (allocated(failure)) self%values = ieee_value(0.0_wp, ieee_quiet_nan)
    self%limits = [(limit_at(reader, curves(i)), i=1, size(curves))]
    allocate (self%lines(0))
    if (any(curves%statistic == analysis_mode_curve)) call set_lines(input, self)
  end subroutine find_nominal_curves

  !> The lowest limit of a curve at its point; of its stress, which is a multiple of the moment, in terms of the moment. Limits of
  !> the half range are of all orders together and say nothing of one of them, which has limits of single lines alone.
  real(wp) function limit_at(reader, one) result(lowest)
    type(analysis_reader_t), intent(in) :: reader
    type(analysis_result_t), intent(in) :: one
    integer, allocatable :: quantities(:)
    integer :: k, q
    real(wp) :: factor, frequency, limit

    lowest = no_limit
    if (one%mode == 0) then
      allocate (quantities, source=matching_quantities(reader%quantities, one%quantity, recorded_kinds))
      associate (speed => reader%settings%speeds(one%point))
        frequency = abs(speed)
        if (.not. reader%settings%axis%is_frequency) frequency = one%order * abs(speed)
        do k = 1, size(reader%limits)
          limit = no_limit
          if (.not. one%order > 0) limit = reader%limits(k)%continuous_limit(speed)
          if (reader%limits(k)%has_curve() .and. frequency > 0) limit = min(limit, reader%limits(k)%amplitude_limit(frequency))
          if (limit >= no_limit) cycle
          do q = 1, size(quantities)
            factor = per_unit(reader%quantities(reader%limits(k)%quantity), reader%quantities(quantities(q)))
            if (factor > 0) lowest = min(lowest, limit / factor)
          end do
        end do
      end associate
    end if
    if (lowest >= no_limit) lowest = ieee_value(0.0_wp, ieee_quiet_nan)
  end function limit_at

  !> How many times a quantity another one is: 1 if they are the same, the stress per moment of a coupling, else 0.
  pure real(wp) function per_unit(limited, quantity) result(factor)
    type(moment_form_t), intent(in) :: limited, quantity

    factor = 0.0_wp
    if (limited%name == quantity%name) then
      factor = 1.0_wp
    else if (limited%kind == kind_stress .and. quantity%kind == kind_moment .and. limited%element == quantity%element .and. &
             limited%element_kind == quantity%element_kind .and. size(limited%weight) == 1 .and. size(quantity%weight) == 1) then
      factor = abs(limited%weight(1, 1) / quantity%weight(1, 1))
    end if
  end function per_unit

  !> The orders and fixed frequencies of the diagram of Campbell, if the machine of the input has one.
  subroutine set_lines(input, self)
    type(input_t), intent(in) :: input
    type(nominal_curves_t), intent(inout) :: self
    type(campbell_t) :: campbell
    type(error_t), allocatable :: failure
    integer :: at, l, p

    call find_campbell(input, campbell, failure)
    if (allocated(failure)) return
    deallocate (self%lines)
    allocate (self%lines(size(campbell%order)))
    allocate (self%frequencies(size(campbell%settings%speeds), size(campbell%order)))
    self%frequencies = ieee_value(0.0_wp, ieee_quiet_nan)
    do l = 1, size(self%lines)
      self%lines(l)%text = line_name(campbell, l)
      do p = 1, size(self%frequencies, 1)
        at = place_of(campbell%settings%speeds(p), campbell%speed)
        if (at > 0) self%frequencies(p, l) = from_si(campbell%frequency(l, at), unit_hz)
      end do
    end do
  end subroutine set_lines

end module nocdyn_nominal_curves
