!> What is kept of linear functions x of the state along the variants in the lanes of a block.
module nocdyn_linear_tracks
  use nocdyn_kinds, only: wp
  use nocdyn_linear_columns, only: strip_of, width
  use nocdyn_statistics, only: statistic_final, statistic_max, statistic_max_abs, statistic_min, statistic_t, &
    statistic_time_of_max
  implicit none (type, external)
  private

  public :: lay_tracks, open_gate

  !> What is kept of one x from a time on; [width, strips] of the lanes.
  type, public :: track_t
    integer :: column = 0                    !! among the linear ones
    real(wp) :: from = 0.0_wp                !! [s]
    logical :: has_range = .false.           !! whether extremes are wanted:
    logical :: has_max = .false., has_min = .false., has_size = .false.   !! largest, smallest, largest absolute value
    logical :: has_time = .false.            !! of the largest
    logical :: has_sums = .false.
    real(wp), allocatable :: highest(:, :), lowest(:, :), highest_time(:, :)   !! of x
    real(wp), allocatable :: gate(:, :)                                        !! huge before `from`, -huge after it
    real(wp), allocatable :: integral(:, :), square(:, :)                      !! of the column over time
  end type track_t

contains

  !> One track for each column and `from`, in the order of the columns.
  pure subroutine lay_tracks(statistics, column, lanes, tracks, track)
    type(statistic_t), intent(in) :: statistics(:)
    integer, intent(in) :: column(:)                         !! of each statistic
    integer, intent(in) :: lanes
    type(track_t), allocatable, intent(out) :: tracks(:)
    integer, allocatable, intent(out) :: track(:)            !! of each statistic, 0 for those of the end
    integer :: c, i, k

    allocate (tracks(0))
    allocate (track(size(statistics)), source=0)
    do c = 1, maxval(column)
      do i = 1, size(statistics)
        if (column(i) /= c .or. statistics(i)%kind == statistic_final) cycle
        do k = 1, size(tracks)
          if (tracks(k)%column == c .and. abs(tracks(k)%from - statistics(i)%from) <= 0) exit
        end do
        if (k > size(tracks)) tracks = [tracks, track_t(column=c, from=statistics(i)%from)]
        track(i) = k
        call take_kind(tracks(k), statistics(i)%kind)
      end do
    end do
    do k = 1, size(tracks)
      tracks(k)%has_range = tracks(k)%has_max .or. tracks(k)%has_min .or. tracks(k)%has_size
      call make_room(tracks(k), strip_of(lanes))
    end do
  end subroutine lay_tracks

  pure subroutine take_kind(track, kind)
    type(track_t), intent(inout) :: track
    integer, intent(in) :: kind   !! of a statistic

    select case (kind)
    case (statistic_max, statistic_time_of_max)
      track%has_max = .true.
      track%has_time = track%has_time .or. kind == statistic_time_of_max
    case (statistic_min)
      track%has_min = .true.
    case (statistic_max_abs)
      track%has_size = .true.
    case default
      track%has_sums = .true.
    end select
  end subroutine take_kind

  pure subroutine make_room(track, strips)
    type(track_t), intent(inout) :: track
    integer, intent(in) :: strips

    allocate (track%highest(width, strips), source=0.0_wp)
    allocate (track%lowest, track%highest_time, track%integral, track%square, source=track%highest)
    allocate (track%gate, source=track%highest - huge(0.0_wp))
  end subroutine make_room

  !> The range of a lane begins with a value.
  pure subroutine open_gate(track, at, strip, x, t)
    type(track_t), intent(inout) :: track
    integer, intent(in) :: at, strip
    real(wp), intent(in) :: x, t

    track%gate(at, strip) = -huge(0.0_wp)
    track%highest(at, strip) = x
    track%lowest(at, strip) = x
    track%highest_time(at, strip) = t
  end subroutine open_gate

end module nocdyn_linear_tracks
