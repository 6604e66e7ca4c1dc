!> The parameters of one lane of a formulation: all numbers that may differ between the variants of a machine.
!>
!> A formulation passes its arrays in a fixed order, the ones of the machine and those derived from them (`pass_parameters`).
!> The numbers of a lane are taken from them, or given to a lane. On the way the integers are collected that describe the
!> structure: which elements are in which bank, which entries the sparse maps have. Two lanes with the same structure differ in
!> numbers only, so that giving one the numbers of the other makes it the same variant.
module nocdyn_lane_parameters
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, public :: lane_parameters_t
    logical :: describes = .false.                          !! whether the structure is collected
    logical, private :: gives = .false.                     !! whether numbers go to the arrays, else they come from them
    integer, private :: lane = 0
    integer, private :: numbers = 0, curves = 0             !! passed so far
    integer, private :: structure_size = 0
    real(wp), allocatable, private :: number(:)             !! the first `numbers` are in use, as for the others
    type(curve_t), allocatable, private :: curve(:)
    integer, allocatable, private :: structure(:)
  contains
    procedure :: take, give
    generic :: add => add_matrix, add_stack
    procedure :: add_blocks, add_curves
    generic :: add_structure => add_integers, add_flag, add_names
    procedure :: has_same_structure, is_same
    procedure, private :: add_matrix, add_stack, add_integers, add_flag, add_names, move
  end type lane_parameters_t

contains

  !> Lets the next pass take the numbers of a lane.
  subroutine take(self, lane, with_structure)
    class(lane_parameters_t), intent(inout) :: self
    integer, intent(in) :: lane
    logical, intent(in), optional :: with_structure   !! whether the structure is collected too; absent: it is

    if (.not. allocated(self%number)) allocate (self%number(256), self%curve(0), self%structure(256))
    self%gives = .false.
    self%lane = lane
    self%numbers = 0
    self%curves = 0
    self%describes = .true.
    if (present(with_structure)) self%describes = with_structure
    if (self%describes) self%structure_size = 0
  end subroutine take

  !> Lets the next pass give the numbers to a lane, of a formulation with the same structure.
  subroutine give(self, lane)
    class(lane_parameters_t), intent(inout) :: self
    integer, intent(in) :: lane

    self%gives = .true.
    self%lane = lane
    self%numbers = 0
    self%curves = 0
    self%describes = .false.
  end subroutine give

  !> Passes an array [lanes, columns].
  subroutine add_matrix(self, name, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name   !! for comparisons of structures
    real(wp), contiguous, intent(inout) :: value(:, :)

    call self%move(name, 1, size(value, 1), size(value, 2), value)
  end subroutine add_matrix

  !> Passes an array [rows, lanes, columns].
  subroutine add_stack(self, name, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), contiguous, intent(inout) :: value(:, :, :)

    call self%move(name, size(value, 1), size(value, 2), size(value, 3), value)
  end subroutine add_stack

  !> Passes an array [rows, columns, lanes].
  subroutine add_blocks(self, name, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), contiguous, intent(inout) :: value(:, :, :)   !! [rows, columns, lanes]

    call self%add_structure([size(value, 1), size(value, 2)])
    call self%move(name, size(value, 1) * size(value, 2), size(value, 3), 1, value)
  end subroutine add_blocks

  !> Moves the numbers of the lane.
  subroutine move(self, name, rows, lanes, columns, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    integer, intent(in) :: rows, lanes, columns
    real(wp), intent(inout) :: value(rows, lanes, columns)
    real(wp), allocatable :: longer(:)
    integer :: c, i, next

    if (self%describes) then
      call self%add_structure([rows, columns, (iachar(name(i:i)), i=1, len(name))])
    end if
    next = self%numbers
    self%numbers = next + rows * columns
    if (self%gives) then
      do c = 1, columns
        value(:, self%lane, c) = self%number(next + 1:next + rows)
        next = next + rows
      end do
      return
    end if
    if (self%numbers > size(self%number)) then
      allocate (longer(2 * self%numbers))
      longer(:next) = self%number(:next)
      call move_alloc(longer, self%number)
    end if
    do c = 1, columns
      self%number(next + 1:next + rows) = value(:, self%lane, c)
      next = next + rows
    end do
  end subroutine move

  !> Passes curves [lanes, elements].
  subroutine add_curves(self, curve)
    class(lane_parameters_t), intent(inout) :: self
    type(curve_t), intent(inout) :: curve(:, :)
    type(curve_t), allocatable :: longer(:)
    integer :: e, i

    if (self%describes) call self%add_structure([(curve(self%lane, e)%points(), e=1, size(curve, 2))])
    associate (before => self%curves, elements => size(curve, 2))
      if (self%gives) then
        do e = 1, elements
          curve(self%lane, e) = self%curve(before + e)
        end do
      else
        if (before + elements > size(self%curve)) then
          allocate (longer(2 * (before + elements)))
          do i = 1, before
            longer(i) = self%curve(i)
          end do
          call move_alloc(longer, self%curve)
        end if
        do e = 1, elements
          self%curve(before + e) = curve(self%lane, e)
        end do
      end if
    end associate
    self%curves = self%curves + size(curve, 2)
  end subroutine add_curves

  !> Adds lists of integers that describe the structure, each preceded by its length.
  recursive subroutine add_integers(self, parts, second, third, fourth, fifth)
    class(lane_parameters_t), intent(inout) :: self
    integer, intent(in) :: parts(:)
    integer, intent(in), optional :: second(:), third(:), fourth(:), fifth(:)
    integer, allocatable :: longer(:)

    if (.not. self%describes) return
    associate (used => self%structure_size, added => size(parts) + 1)
      if (used + added > size(self%structure)) then
        allocate (longer(2 * (used + added)))
        longer(:used) = self%structure(:used)
        call move_alloc(longer, self%structure)
      end if
      self%structure(used + 1) = size(parts)
      self%structure(used + 2:used + added) = parts
      used = used + added
    end associate
    if (present(second)) call self%add_structure(second, third, fourth, fifth)
  end subroutine add_integers

  subroutine add_flag(self, flag)
    class(lane_parameters_t), intent(inout) :: self
    logical, intent(in) :: flag

    call self%add_structure([merge(1, 0, flag)])
  end subroutine add_flag

  subroutine add_names(self, names)
    class(lane_parameters_t), intent(inout) :: self
    type(string_t), intent(in) :: names(:)
    integer :: i, k

    do i = 1, merge(size(names), 0, self%describes)
      call self%add_structure([(iachar(names(i)%text(k:k)), k=1, len(names(i)%text))])
    end do
  end subroutine add_names

  !> Whether two lanes, taken with their structures, have the same one.
  pure logical function has_same_structure(self, other)
    class(lane_parameters_t), intent(in) :: self
    type(lane_parameters_t), intent(in) :: other

    has_same_structure = self%structure_size == other%structure_size .and. self%numbers == other%numbers .and. &
                         self%curves == other%curves
    if (has_same_structure) has_same_structure = all(self%structure(:self%structure_size) == &
                                                     other%structure(:other%structure_size))
  end function has_same_structure

  !> Whether two lanes with the same structure are the same variant, to the last bit.
  pure logical function is_same(self, other)
    class(lane_parameters_t), intent(in) :: self
    type(lane_parameters_t), intent(in) :: other   !! with the same structure
    integer :: i

    is_same = all(transfer(self%number(:self%numbers), [0_int64]) == transfer(other%number(:other%numbers), [0_int64]))
    do i = 1, self%curves
      is_same = is_same .and. self%curve(i)%is_same(other%curve(i))
    end do
  end function is_same

end module nocdyn_lane_parameters
