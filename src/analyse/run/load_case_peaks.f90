!> What the runs of several load cases say together: the largest values with their cases, and the damage of all of them.
module nocdyn_load_case_peaks
  use nocdyn_case_results, only: case_result_t
  use nocdyn_kinds, only: wp
  use nocdyn_run_fatigue, only: run_fatigue_t
  use nocdyn_run_summary, only: run_summary_t
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: find_peaks, sum_damage

  !> The run of one load case.
  type, extends(case_result_t), public :: case_run_t
    type(run_summary_t) :: summary
  end type case_run_t

  !> The value of largest magnitude of one column, of all load cases that have it.
  type, public :: peak_t
    type(signal_t) :: signal                 !! of the column
    real(wp) :: largest = 0.0_wp             !! with its sign
    real(wp) :: time = 0.0_wp                !! [s]
    integer :: load_case = 0                 !! index of the run
  end type peak_t

  !> The damage of one &fatigue in all load cases, each as often as it occurs.
  type, public :: life_t
    character(len=:), allocatable :: name, kind, element, unit   !! of the group; of the element; of the quantity
    real(wp) :: position = 0.0_wp             !! along a shaft [m]
    logical :: is_shaft = .false.             !! whether there are several points of it
    real(wp) :: damage = 0.0_wp               !! where it is largest
    real(wp), allocatable :: of_case(:)       !! its parts, [runs]
    logical :: exceeds_strength = .false.     !! the mean of a cycle, in some case
  end type life_t

contains

  !> The peaks of all columns that are written, in the order in which the cases have them.
  subroutine find_peaks(runs, peaks)
    type(case_run_t), intent(in) :: runs(:)
    type(peak_t), allocatable, intent(out) :: peaks(:)
    type(string_t), allocatable :: labels(:), longer(:)
    integer :: c, i, k
    logical :: is_known
    integer, allocatable :: new(:)

    ! the labels of the columns of all runs that have rows
    allocate (labels(0))
    do c = 1, size(runs)
      if (.not. runs(c)%summary%extremes%have_begun) cycle
      call find_new(runs(c)%summary, labels, new)
      allocate (longer(size(labels) + size(new)))
      longer(:size(labels)) = labels
      do k = 1, size(new)
        longer(size(labels) + k)%text = runs(c)%summary%labels(new(k))%text
      end do
      call move_alloc(longer, labels)
    end do
    allocate (peaks(size(labels)))
    do c = 1, size(runs)
      associate (summary => runs(c)%summary)
        if (.not. summary%extremes%have_begun) cycle
        i = 0
        do k = 2, size(summary%chosen)
          call find_next(labels, summary%labels(summary%chosen(k))%text, i, is_known)
          associate (column => summary%chosen(k), extremes => summary%extremes)
            peaks(i)%signal = summary%signals(column)
            call raise_peak(peaks(i), c, extremes%lowest(column), extremes%lowest_time(column))
            call raise_peak(peaks(i), c, extremes%highest(column), extremes%highest_time(column))
          end associate
        end do
      end associate
    end do
  end subroutine find_peaks

  subroutine raise_peak(peak, load_case, value, time)
    type(peak_t), intent(inout) :: peak
    integer, intent(in) :: load_case
    real(wp), intent(in) :: value, time

    if (peak%load_case > 0 .and. abs(value) <= abs(peak%largest)) return
    peak%largest = value
    peak%time = time
    peak%load_case = load_case
  end subroutine raise_peak

  !> The columns of a run that are not yet known.
  subroutine find_new(summary, labels, new)
    type(run_summary_t), intent(in) :: summary
    type(string_t), intent(in) :: labels(:)
    integer, allocatable, intent(out) :: new(:)   !! columns
    logical :: is_new(size(summary%chosen))
    integer :: k, last

    last = 0
    is_new(1) = .false.   ! the time
    do k = 2, size(summary%chosen)
      call find_next(labels, summary%labels(summary%chosen(k))%text, last, is_known=is_new(k))
      is_new(k) = .not. is_new(k)
    end do
    new = pack(summary%chosen, is_new)
  end subroutine find_new

  !> Looks for a label from the one after the last found on: runs have most of their columns in the same order.
  pure subroutine find_next(labels, label, last, is_known)
    type(string_t), intent(in) :: labels(:)
    character(len=*), intent(in) :: label
    integer, intent(inout) :: last   !! position of the label if it is there
    logical, intent(out) :: is_known
    integer :: i, position

    do i = 1, size(labels)
      position = 1 + modulo(last + i - 1, size(labels))
      is_known = labels(position)%text == label
      if (.not. is_known) cycle
      last = position
      return
    end do
    is_known = .false.
  end subroutine find_next

  !> The position of a name, 0 if it is not there.
  pure integer function position_of(names, name)
    type(string_t), intent(in) :: names(:)
    character(len=*), intent(in) :: name

    do position_of = size(names), 1, -1
      if (names(position_of)%text == name) return
    end do
  end function position_of

  !> Adds up the damage of every &fatigue; of a shaft at every point, of which the worst one counts.
  subroutine sum_damage(runs, lives)
    type(case_run_t), intent(in) :: runs(:)
    type(life_t), allocatable, intent(out) :: lives(:)
    type(string_t), allocatable :: names(:)
    integer :: c, i

    allocate (names(0))
    do c = 1, size(runs)
      if (.not. allocated(runs(c)%summary%fatigue%items)) cycle
      do i = 1, size(runs(c)%summary%fatigue%items)
        associate (name => runs(c)%summary%fatigue%items(i)%name)
          if (position_of(names, name) == 0) call append(names, name)
        end associate
      end do
    end do
    allocate (lives(size(names)))
    do i = 1, size(names)
      lives(i)%name = names(i)%text
      allocate (lives(i)%of_case(size(runs)), source=0.0_wp)
      call sum_one(runs, lives(i))
    end do
  end subroutine sum_damage

  !> Adds up the damage of one &fatigue. A case whose machine gives a shaft other points adds its worst one everywhere.
  subroutine sum_one(runs, life)
    type(case_run_t), intent(in) :: runs(:)
    type(life_t), intent(inout) :: life
    real(wp), allocatable :: damage(:), positions(:), sums(:)   ! [points]
    real(wp), allocatable :: parts(:, :)                        ! [points, runs]
    integer :: c, points, worst

    points = 0
    do c = 1, size(runs)
      call find_damage(runs(c), life, damage, positions)
      if (size(damage) == 0) cycle
      if (points == 0) then
        points = size(damage)
        allocate (parts(points, size(runs)), source=0.0_wp)
      end if
      parts(:, c) = maxval(damage)
      if (size(damage) == points) parts(:, c) = damage
    end do
    if (points == 0) return
    sums = sum(parts, dim=2)
    worst = maxloc(sums, dim=1)
    life%damage = sums(worst)
    life%of_case(:) = parts(worst, :)
    do c = size(runs), 1, -1
      call find_damage(runs(c), life, damage, positions)
      if (size(positions) == points) life%position = positions(worst)
    end do
    life%is_shaft = points > 1
  end subroutine sum_one

  !> The damage that a load case does in the life of the machine at all points of an item, none if the case does not have it.
  subroutine find_damage(run, life, damage, positions)
    type(case_run_t), intent(in) :: run
    type(life_t), intent(inout) :: life   !! with its name; takes what the item says
    real(wp), allocatable, intent(out) :: damage(:), positions(:)   !! positions along a shaft [m]
    integer :: i

    if (allocated(run%summary%fatigue%items)) then
      do i = 1, size(run%summary%fatigue%items)
        associate (item => run%summary%fatigue%items(i), fatigue => run%summary%fatigue)
          if (item%name /= life%name) cycle
          damage = run%load_case%repeats * item%repeats * fatigue%counters(item%first:item%last)%damage
          positions = fatigue%position(item%first:item%last)
          life%kind = item%kind
          life%element = item%element
          life%unit = item%unit
          life%exceeds_strength = life%exceeds_strength .or. any(fatigue%counters(item%first:item%last)%has_failed)
        end associate
        return
      end do
    end if
    allocate (damage(0), positions(0))
  end subroutine find_damage

end module nocdyn_load_case_peaks
