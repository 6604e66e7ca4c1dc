!> The numbers of the lanes of one formulation: all that may differ between variants of a machine, wherever it is held.
!>
!> A formulation lists its arrays in a fixed order, its own and those that it has derived from them, and notes beside them
!> what its layout depends on: which elements are in which bank, which entries the maps have. Where two lists have the same
!> layout, a lane of one is made that of the other by copying numbers.
module nocdyn_lane_numbers
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  integer, parameter :: longest = 24   ! of a name

  !> One array; its lanes are the second dimension.
  type, public :: slab_t
    character(len=longest) :: name
    real(wp), pointer, contiguous :: value(:, :, :) => null()   !! [numbers, lanes, numbers]
  end type slab_t

  !> Where a number is in a list.
  type, public :: place_t
    integer :: slab, row, column
  end type place_t

  !> The curves of some elements.
  type :: curve_slab_t
    type(curve_t), pointer :: curve(:, :) => null()   !! [lanes, elements]
  end type curve_slab_t

  !> What is listed must have the attribute `target` and stay where it is as long as the list is used.
  type, public :: lane_numbers_t
    integer :: slabs = 0
    type(slab_t), allocatable :: slab(:)                        !! [slabs], and room
    integer, private :: curve_slabs = 0
    type(curve_slab_t), allocatable, private :: curve_slab(:)   !! [curve_slabs], and room
    integer, private :: notes = 0
    integer, allocatable, private :: note(:)                    !! [notes], and room: of the layout
  contains
    procedure :: clear
    generic :: add => add_numbers, add_stacks
    procedure :: add_blocks
    procedure :: add_curves
    generic :: remark => remark_integer, remark_integers, remark_flag, remark_names
    procedure :: is_congruent
    procedure :: copy_lane
    procedure :: differences
    procedure :: has_curves_of
    procedure :: number
    procedure :: set_number
    procedure :: name_at
    procedure, private :: add_numbers, add_stacks
    procedure, private :: remark_integer, remark_integers, remark_flag, remark_names
    procedure, private :: next_slab
  end type lane_numbers_t

contains

  !> Empties the list; the room stays.
  subroutine clear(self)
    class(lane_numbers_t), intent(inout) :: self

    if (.not. allocated(self%slab)) allocate (self%slab(64), self%curve_slab(4), self%note(256))
    self%slabs = 0
    self%curve_slabs = 0
    self%notes = 0
  end subroutine clear

  !> Lists an array [lanes, numbers].
  subroutine add_numbers(self, name, value)
    class(lane_numbers_t), intent(inout) :: self
    character(len=*), intent(in) :: name   !! of a bank's parameter: the key of the input whose values stand there as they are
    real(wp), contiguous, target, intent(inout) :: value(:, :)

    call self%next_slab(name)
    self%slab(self%slabs)%value(1:1, 1:size(value, 1), 1:size(value, 2)) => value
  end subroutine add_numbers

  !> Lists an array [numbers, lanes, numbers].
  subroutine add_stacks(self, name, value)
    class(lane_numbers_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), contiguous, target, intent(inout) :: value(:, :, :)

    call self%next_slab(name)
    self%slab(self%slabs)%value => value
  end subroutine add_stacks

  !> Lists an array [numbers, numbers, lanes].
  subroutine add_blocks(self, name, value)
    class(lane_numbers_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), contiguous, target, intent(inout) :: value(:, :, :)

    call self%next_slab(name)
    self%slab(self%slabs)%value(1:size(value, 1) * size(value, 2), 1:size(value, 3), 1:1) => value
    call self%remark(shape(value))
  end subroutine add_blocks

  !> Makes room for one more array.
  subroutine next_slab(self, name)
    class(lane_numbers_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(slab_t), allocatable :: longer(:)

    if (self%slabs == size(self%slab)) then
      allocate (longer(2 * self%slabs))
      longer(:self%slabs) = self%slab
      call move_alloc(longer, self%slab)
    end if
    self%slabs = self%slabs + 1
    self%slab(self%slabs)%name = name
  end subroutine next_slab

  !> Lists curves [lanes, elements].
  subroutine add_curves(self, curve)
    class(lane_numbers_t), intent(inout) :: self
    type(curve_t), target, intent(inout) :: curve(:, :)
    type(curve_slab_t), allocatable :: longer(:)
    integer :: e

    if (self%curve_slabs == size(self%curve_slab)) then
      allocate (longer(2 * self%curve_slabs))
      longer(:self%curve_slabs) = self%curve_slab
      call move_alloc(longer, self%curve_slab)
    end if
    self%curve_slabs = self%curve_slabs + 1
    self%curve_slab(self%curve_slabs)%curve => curve
    call self%remark([(curve(1, e)%points(), e=1, size(curve, 2))])
  end subroutine add_curves

  subroutine remark_integer(self, note)
    class(lane_numbers_t), intent(inout) :: self
    integer, intent(in) :: note

    call self%remark([note])
  end subroutine remark_integer

  !> Notes what the layout depends on; how many notes there are is one of them.
  subroutine remark_integers(self, notes)
    class(lane_numbers_t), intent(inout) :: self
    integer, intent(in) :: notes(:)
    integer, allocatable :: longer(:)

    if (self%notes + size(notes) + 1 > size(self%note)) then
      allocate (longer(2 * (self%notes + size(notes) + 1)))
      longer(:self%notes) = self%note(:self%notes)
      call move_alloc(longer, self%note)
    end if
    self%note(self%notes + 1) = size(notes)
    self%note(self%notes + 2:self%notes + 1 + size(notes)) = notes
    self%notes = self%notes + 1 + size(notes)
  end subroutine remark_integers

  subroutine remark_flag(self, note)
    class(lane_numbers_t), intent(inout) :: self
    logical, intent(in) :: note

    call self%remark([merge(1, 0, note)])
  end subroutine remark_flag

  subroutine remark_names(self, names)
    class(lane_numbers_t), intent(inout) :: self
    type(string_t), intent(in) :: names(:)
    integer :: i, k

    do i = 1, size(names)
      call self%remark([(iachar(names(i)%text(k:k)), k=1, len(names(i)%text))])
    end do
  end subroutine remark_names

  !> Whether two lists have the same layout, but for the number of lanes.
  pure logical function is_congruent(self, other)
    class(lane_numbers_t), intent(in) :: self
    type(lane_numbers_t), intent(in) :: other
    integer :: i

    is_congruent = .false.
    if (self%slabs /= other%slabs .or. self%curve_slabs /= other%curve_slabs .or. self%notes /= other%notes) return
    do i = 1, self%notes
      if (self%note(i) /= other%note(i)) return
    end do
    do i = 1, self%slabs
      associate (here => self%slab(i), there => other%slab(i))
        if (size(here%value, 1) /= size(there%value, 1) .or. size(here%value, 3) /= size(there%value, 3)) return
        if (here%name /= there%name) return
      end associate
    end do
    is_congruent = .true.
  end function is_congruent

  !> Makes a lane that of another list, which is congruent.
  subroutine copy_lane(self, lane, from, from_lane)
    class(lane_numbers_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(lane_numbers_t), intent(in) :: from
    integer, intent(in) :: from_lane
    integer :: e, i, k, s

    do s = 1, self%slabs
      associate (into => self%slab(s)%value, value => from%slab(s)%value)
        do k = 1, size(into, 3)
          do i = 1, size(into, 1)
            into(i, lane, k) = value(i, from_lane, k)
          end do
        end do
      end associate
    end do
    do s = 1, self%curve_slabs
      associate (into => self%curve_slab(s)%curve, curve => from%curve_slab(s)%curve)
        do e = 1, size(into, 2)
          into(lane, e) = curve(from_lane, e)
        end do
      end associate
    end do
  end subroutine copy_lane

  !> Where a lane differs from that of another list, which is congruent, in a single bit; curves are left out.
  pure function differences(self, lane, other, other_lane) result(places)
    class(lane_numbers_t), intent(in) :: self
    integer, intent(in) :: lane
    type(lane_numbers_t), intent(in) :: other
    integer, intent(in) :: other_lane
    type(place_t), allocatable :: places(:)
    type(place_t) :: place
    integer :: found, i, k, pass, s

    do pass = 1, 2   ! to count, and to write down
      found = 0
      do s = 1, self%slabs
        do k = 1, size(self%slab(s)%value, 3)
          do i = 1, size(self%slab(s)%value, 1)
            place = place_t(s, i, k)
            if (have_same_bits(self%number(place, lane), other%number(place, other_lane))) cycle
            found = found + 1
            if (pass == 2) places(found) = place
          end do
        end do
      end do
      if (pass == 1) allocate (places(found))
    end do
  end function differences

  pure logical function have_same_bits(a, b)
    real(wp), intent(in) :: a, b

    have_same_bits = transfer(a, 0_int64) == transfer(b, 0_int64)
  end function have_same_bits

  !> Whether a lane has the curves of another list, which is congruent.
  pure logical function has_curves_of(self, lane, other, other_lane)
    class(lane_numbers_t), intent(in) :: self
    integer, intent(in) :: lane
    type(lane_numbers_t), intent(in) :: other
    integer, intent(in) :: other_lane
    integer :: e, s

    has_curves_of = .false.
    do s = 1, self%curve_slabs
      do e = 1, size(self%curve_slab(s)%curve, 2)
        if (.not. self%curve_slab(s)%curve(lane, e)%is_same(other%curve_slab(s)%curve(other_lane, e))) return
      end do
    end do
    has_curves_of = .true.
  end function has_curves_of

  pure real(wp) function number(self, place, lane)
    class(lane_numbers_t), intent(in) :: self
    type(place_t), intent(in) :: place
    integer, intent(in) :: lane

    number = self%slab(place%slab)%value(place%row, lane, place%column)
  end function number

  subroutine set_number(self, place, lane, number)
    class(lane_numbers_t), intent(inout) :: self
    type(place_t), intent(in) :: place
    integer, intent(in) :: lane
    real(wp), intent(in) :: number

    self%slab(place%slab)%value(place%row, lane, place%column) = number
  end subroutine set_number

  !> Under which name the array of a number is listed.
  pure function name_at(self, place) result(name)
    class(lane_numbers_t), intent(in) :: self
    type(place_t), intent(in) :: place
    character(len=longest) :: name

    name = self%slab(place%slab)%name
  end function name_at

end module nocdyn_lane_numbers
