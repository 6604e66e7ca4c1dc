!> Signals of a motion, and the columns of which each consists: one, or all points of the shaft whose largest value it is.
module nocdyn_signal_columns
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_problem, only: signal_range_t
  use nocdyn_signal_samples, only: signal_samples_t
  use nocdyn_signals, only: is_largest_along, list_points, signal_point_moment, signal_point_stress, signal_source_t, signal_t
  implicit none (type, external)
  private

  public :: new_signal_columns

  type, public :: signal_columns_t
    type(signal_t), allocatable :: signals(:)
    integer, allocatable :: first(:)           !! column of each signal, and one beyond all, [signals + 1]
    type(signal_t), allocatable :: columns(:)  !! signals with the sources of the columns
  contains
    procedure :: range_of, widest
  end type signal_columns_t

contains

  !> The columns of signals.
  subroutine new_signal_columns(machine, signals, self)
    type(machine_t), intent(in) :: machine
    type(signal_t), intent(in) :: signals(:)
    type(signal_columns_t), intent(out) :: self
    type(signal_source_t), allocatable :: points(:), sources(:)
    integer, allocatable :: owner(:)
    integer :: i
    logical :: is_stress

    self%signals = signals
    allocate (self%first(size(signals) + 1), sources(0), owner(0))
    do i = 1, size(signals)
      self%first(i) = size(sources) + 1
      points = [signals(i)%source]
      if (is_largest_along(machine, signals(i)%source, is_stress)) then
        call list_points(machine, signals(i)%element, merge(signal_point_stress, signal_point_moment, is_stress), points)
      end if
      sources = [sources, points]
      owner = [owner, spread(i, 1, size(points))]
    end do
    self%first(size(signals) + 1) = size(sources) + 1
    self%columns = signals(owner)
    self%columns%source = sources
  end subroutine new_signal_columns

  !> The range of a signal by those of the columns; of the largest value along a shaft, at the points where each is largest.
  pure type(signal_range_t) function range_of(self, number, ranges) result(range)
    class(signal_columns_t), intent(in) :: self
    integer, intent(in) :: number                !! of the signal
    type(signal_range_t), intent(in) :: ranges(:)

    associate (own => ranges(self%first(number):self%first(number + 1) - 1))
      range%half_range = maxval(own%half_range)
      range%largest = maxval(own%largest)
      range%mean = own(maxloc(abs(own%mean), dim=1))%mean
    end associate
  end function range_of

  !> The column of a signal with the largest half range.
  pure integer function widest(self, number, samples)
    class(signal_columns_t), intent(in) :: self
    integer, intent(in) :: number   !! of the signal
    type(signal_samples_t), intent(in) :: samples

    associate (values => samples%values(:, self%first(number):self%first(number + 1) - 1))
      widest = self%first(number) - 1 + maxloc(maxval(values, dim=1) - minval(values, dim=1), dim=1)
    end associate
  end function widest

end module nocdyn_signal_columns
