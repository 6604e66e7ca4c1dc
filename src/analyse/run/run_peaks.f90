!> Measured peaks beside a run: half ranges, extremes and means of its signals in continuous time.
module nocdyn_run_peaks
  use nocdyn_comparisons, only: comparison_t, new_comparison
  use nocdyn_kinds, only: wp
  use nocdyn_measurements, only: measurement_t, peak_half_range, peak_largest, peak_smallest
  use nocdyn_statistics, only: statistic_max, statistic_mean, statistic_min, statistic_t
  use nocdyn_statistics_observer, only: statistics_observer_t
  implicit none (type, external)
  private

  public :: compare_peaks, list_peak_statistics

  integer, parameter :: kinds(3) = [statistic_min, statistic_max, statistic_mean]   ! of each peak

contains

  !> Appends the statistics that peaks need.
  subroutine list_peak_statistics(peaks, t_start, statistics)
    type(measurement_t), intent(in) :: peaks(:)
    real(wp), intent(in) :: t_start   !! [s]
    type(statistic_t), allocatable, intent(inout) :: statistics(:)
    type(statistic_t), allocatable :: longer(:)
    integer :: i, k, n

    n = size(statistics)
    allocate (longer(n + size(kinds) * size(peaks)))
    do i = 1, n
      longer(i) = statistics(i)
    end do
    do i = 1, size(peaks)
      do k = 1, size(kinds)
        n = n + 1
        longer(n)%column = peaks(i)%signal
        longer(n)%kind = kinds(k)
        longer(n)%from = max(t_start, peaks(i)%from)
      end do
    end do
    call move_alloc(longer, statistics)
  end subroutine list_peak_statistics

  !> Appends the peaks beside the run. Those that were measured at a speed are compared with a response.
  subroutine compare_peaks(observer, before, peaks, comparisons)
    class(statistics_observer_t), intent(in) :: observer
    integer, intent(in) :: before   !! number of its statistics before the ones of the peaks
    type(measurement_t), intent(in) :: peaks(:)
    type(comparison_t), allocatable, intent(inout) :: comparisons(:)
    type(comparison_t), allocatable :: longer(:)
    real(wp) :: computed, of_motion(size(kinds))
    integer :: i, k, n

    n = size(comparisons)
    allocate (longer(n + count(.not. abs(peaks%speed) > 0.0_wp)))
    do i = 1, n
      longer(i) = comparisons(i)
    end do
    do i = 1, size(peaks)
      if (abs(peaks(i)%speed) > 0.0_wp) cycle
      do k = 1, size(kinds)
        of_motion(k) = observer%value_of(before + size(kinds) * (i - 1) + k, 1)
      end do
      select case (peaks(i)%statistic)
      case (peak_half_range)
        computed = 0.5_wp * (of_motion(2) - of_motion(1))
      case (peak_largest)
        computed = of_motion(2)
      case (peak_smallest)
        computed = of_motion(1)
      case default
        computed = of_motion(3)
      end select
      n = n + 1
      longer(n) = new_comparison(peaks(i), [1.0_wp], peaks(i)%values, [computed])
    end do
    call move_alloc(longer, comparisons)
  end subroutine compare_peaks

end module nocdyn_run_peaks
