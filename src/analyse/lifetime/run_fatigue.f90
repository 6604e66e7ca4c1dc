!> The fatigue of a run, by &fatigue: the cycles of moments, stresses and forces.
module nocdyn_run_fatigue
  use nocdyn_damage_counters, only: damage_counter_t
  use nocdyn_fatigue_groups, only: element_kind, quantity_of, quantity_units
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shafts, only: shafts_t
  implicit none (type, external)
  private

  public :: new_run_fatigue

  !> One group &fatigue. A shaft has a signal for each of its points, else there is one.
  type, public :: fatigue_item_t
    character(len=:), allocatable :: name, element, unit
    character(len=:), allocatable :: kind       !! 'coupling', 'shaft'
    real(wp) :: repeats = 1.0_wp
    integer :: first = 1, last = 0          !! signals
    integer, private :: bank = 0, shaft = 0 !! of a shaft
  end type fatigue_item_t

  type, public :: run_fatigue_t
    type(fatigue_item_t), allocatable :: items(:)
    type(damage_counter_t), allocatable :: counters(:)   !! of the signals
    real(wp), allocatable :: position(:)                 !! of a point along its shaft [m], [signals]
  contains
    procedure :: worst
  end type run_fatigue_t

contains

  !> Finds the signals of all groups &fatigue.
  subroutine new_run_fatigue(input, machine, fatigue)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(run_fatigue_t), intent(out) :: fatigue
    integer, allocatable :: groups(:)
    integer :: count, i

    allocate (groups, source=input%groups_named('fatigue'))
    allocate (fatigue%items(size(groups)))
    count = 0
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)), item => fatigue%items(i))
        item%name = group%name
        item%kind = trim(element_kind(group))
        item%element = group%text(item%kind)
        item%unit = trim(quantity_units(quantity_of(group)))
        item%repeats = group%number('repeats')
        item%first = count + 1
        item%last = item%first
        if (element_kind(group) == 'shaft') call find_shaft(machine, item)
        count = item%last
      end associate
    end do
    allocate (fatigue%counters(count))
    allocate (fatigue%position(count), source=0.0_wp)
    do i = 1, size(groups)
      associate (item => fatigue%items(i))
        if (item%bank == 0) cycle
        select type (bank => machine%banks(item%bank)%bank)
        type is (shafts_t)
          fatigue%position(item%first:item%last) = bank%positions(item%shaft, 1)
        class default
          error stop 'nocdyn_run_fatigue: the bank of a shaft is one of shafts'
        end select
      end associate
    end do
  end subroutine new_run_fatigue

  !> The points of a shaft.
  pure subroutine find_shaft(machine, item)
    type(machine_t), intent(in) :: machine
    type(fatigue_item_t), intent(inout) :: item
    integer :: b, s

    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      type is (shafts_t)
        do s = 1, size(bank%shafts)
          if (bank%names(bank%shafts(s)%first)%text /= item%element) cycle
          item%bank = b
          item%shaft = s
          item%last = item%first + bank%shafts(s)%last_point - bank%shafts(s)%first_point
        end do
      class default
        cycle
      end select
    end do
    if (item%bank == 0) error stop 'nocdyn_run_fatigue: a checked group has a shaft'
  end subroutine find_shaft

  !> The signal of an item with the largest damage; without any damage, with the largest range.
  pure integer function worst(self, i)
    class(run_fatigue_t), intent(in) :: self
    integer, intent(in) :: i   !! item

    associate (item => self%items(i))
      associate (counters => self%counters(item%first:item%last))
        if (any(counters%damage > 0)) then
          worst = item%first - 1 + maxloc(counters%damage, dim=1)
        else
          worst = item%first - 1 + maxloc(counters%largest_range, dim=1)
        end if
      end associate
    end associate
  end function worst

end module nocdyn_run_fatigue
