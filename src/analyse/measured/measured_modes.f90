!> Measured natural frequencies and dampings beside the modes.
module nocdyn_measured_modes
  use nocdyn_comparisons, only: comparison_t, new_comparison
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_measurements, only: measured_frequency, measurement_t, read_measurements
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: compare_modes, paired_modes

contains

  !> Compares the frequencies of an input with those of its oscillating modes.
  subroutine compare_modes(input, numbers, frequencies, dampings, comparisons, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: numbers(:)        !! of the modes
    real(wp), intent(in) :: frequencies(:)   !! damped [rad/s], [modes]
    real(wp), intent(in) :: dampings(:)      !! damping ratios, [modes]
    type(comparison_t), allocatable, intent(out) :: comparisons(:)
    type(error_t), allocatable, intent(out) :: error
    type(measurement_t), allocatable :: list(:)
    type(diagnostics_t) :: diagnostics
    type(signal_t) :: signals(0)
    integer, allocatable :: mode(:)
    logical, allocatable :: has_mode(:)
    integer :: i, k

    call read_measurements(input, [measured_frequency], signals, list, error)
    if (allocated(error)) return
    allocate (comparisons(size(list)))
    do i = 1, size(list)
      associate (m => list(i))
        mode = paired_modes(m, numbers, frequencies)
        has_mode = mode > 0
        if (size(m%modes) > 0) then
          do k = 1, size(mode)
            if (mode(k) == 0) call input%report(m%group, 'modes', 'modes: there is no oscillating mode ' // &
                                                to_text(m%modes(k)) // '; allowed: 1 to ' // to_text(maxval([0, numbers])), &
                                                diagnostics)
          end do
        end if
        comparisons(i) = new_comparison(m, real(numbers(pack(mode, has_mode)), wp), pack(m%values, has_mode), &
                                        frequencies(pack(mode, has_mode)))
        comparisons(i)%outside = count(.not. has_mode)
        if (size(m%damping) == 0) cycle
        comparisons(i)%measured_damping = pack(m%damping, has_mode)
        allocate (comparisons(i)%computed_damping(count(has_mode)))
        comparisons(i)%computed_damping(:) = dampings(pack(mode, has_mode))
      end associate
    end do
    call input%refuse(diagnostics, error)
  end subroutine compare_modes

  !> The mode of each frequency: by its number, or the nearest one in the ratio of frequencies, each at most once, the nearest
  !> pair first. 0: none is left.
  pure function paired_modes(m, numbers, frequencies) result(mode)
    type(measurement_t), intent(in) :: m     !! frequencies
    integer, intent(in) :: numbers(:)        !! of the modes
    real(wp), intent(in) :: frequencies(:)   !! [rad/s], [modes]
    integer :: mode(size(m%values))          !! index in `numbers`
    logical :: is_free(size(numbers), size(m%values))
    real(wp) :: distance(size(numbers), size(m%values))
    integer :: k, nearest(2)

    mode = 0
    if (size(m%modes) > 0) then
      do k = 1, size(mode)
        mode(k) = findloc(numbers, m%modes(k), dim=1)
      end do
      return
    end if
    do k = 1, size(mode)
      distance(:, k) = abs(log(frequencies / m%values(k)))
    end do
    is_free = .true.
    do while (any(is_free))
      nearest = minloc(distance, mask=is_free)
      mode(nearest(2)) = nearest(1)
      is_free(nearest(1), :) = .false.
      is_free(:, nearest(2)) = .false.
    end do
  end function paired_modes

end module nocdyn_measured_modes
