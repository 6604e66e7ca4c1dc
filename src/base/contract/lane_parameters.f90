!> The parameters of the lanes of one formulation: all numbers that may differ between the variants of a machine.
!>
!> A formulation lists its parameter arrays in a fixed order, the ones of the machine and those derived from them. It also adds
!> the integers that describe its structure: which elements are in which bank, which entries the sparse maps have. Two lists
!> with the same structure differ in numbers only, so copying the numbers of a lane makes it the same variant.
module nocdyn_lane_parameters
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  integer, parameter :: longest = 24   ! of a name

  !> One array; its lanes are the second dimension.
  type, public :: parameter_array_t
    character(len=longest) :: name
    integer, allocatable :: element(:)   !! of the machine, in each column of a key's values; not allocated: no key's
    real(wp), pointer, contiguous :: value(:, :, :) => null()   !! [rows, lanes, columns]
  end type parameter_array_t

  !> Position of a parameter in a list.
  type, public :: parameter_index_t
    integer :: array         !! in the order of listing
    integer :: row, column   !! in that array
  end type parameter_index_t

  !> The curves of some elements.
  type :: curve_array_t
    type(curve_t), pointer :: curve(:, :) => null()   !! [lanes, elements]
  end type curve_array_t

  !> A list points to the arrays in it: they must be targets, and must not be reallocated or moved while it is in use.
  type, public :: lane_parameters_t
    integer :: arrays = 0
    integer :: first_element = 1                                  !! in the machine, of the bank that lists its arrays
    type(parameter_array_t), allocatable :: array(:)              !! the first `arrays` are in use
    integer, private :: curve_arrays = 0
    type(curve_array_t), allocatable, private :: curve_array(:)   !! the first `curve_arrays` are in use
    integer, private :: structure_size = 0
    integer, allocatable, private :: structure(:)                 !! the first `structure_size` are in use
  contains
    procedure :: clear
    generic :: add => add_matrix, add_stack
    procedure :: add_key, add_blocks, add_curves
    generic :: add_structure => add_integers, add_flag, add_names
    procedure :: has_same_structure, copy_lane, differences, has_same_curves, index_of_key, value, set_value
    procedure, private :: add_matrix, add_stack, add_integers, add_flag, add_names, next_array
  end type lane_parameters_t

contains

  !> Empties the list and keeps its memory.
  subroutine clear(self)
    class(lane_parameters_t), intent(inout) :: self

    if (.not. allocated(self%array)) allocate (self%array(64), self%curve_array(4), self%structure(256))
    self%arrays = 0
    self%curve_arrays = 0
    self%structure_size = 0
  end subroutine clear

  !> Lists an array [lanes, columns].
  subroutine add_matrix(self, name, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(wp), contiguous, target, intent(inout) :: value(:, :)

    call self%next_array(name)
    self%array(self%arrays)%value(1:1, 1:size(value, 1), 1:size(value, 2)) => value
  end subroutine add_matrix

  !> Lists an array [lanes, columns] of a bank that holds the values of a key of the input as they are. A variant is set by
  !> writing such a value: the laws of the bank follow by `polynomials`, and assembly asks nothing but its sign.
  subroutine add_key(self, key, value, element)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: key
    real(wp), contiguous, target, intent(inout) :: value(:, :)   !! in the unit of the key
    integer, intent(in), optional :: element(:)   !! of the bank in each column; absent: column k is the one of element k
    integer :: k

    call self%add_matrix(key, value)
    if (present(element)) then
      self%array(self%arrays)%element = self%first_element - 1 + element
    else
      self%array(self%arrays)%element = [(self%first_element - 1 + k, k=1, size(value, 2))]
    end if
  end subroutine add_key

  !> Lists an array [rows, lanes, columns].
  subroutine add_stack(self, name, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name   !! for comparisons of structures
    real(wp), contiguous, target, intent(inout) :: value(:, :, :)

    call self%next_array(name)
    self%array(self%arrays)%value => value
  end subroutine add_stack

  !> Lists an array [rows, columns, lanes].
  subroutine add_blocks(self, name, value)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name   !! for comparisons of structures
    real(wp), contiguous, target, intent(inout) :: value(:, :, :)   !! [rows, columns, lanes]

    call self%next_array(name)
    self%array(self%arrays)%value(1:size(value, 1) * size(value, 2), 1:size(value, 3), 1:1) => value
    call self%add_structure([size(value, 1), size(value, 2)])
  end subroutine add_blocks

  !> Adds an array that is not yet associated.
  subroutine next_array(self, name)
    class(lane_parameters_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    type(parameter_array_t), allocatable :: longer(:)

    if (self%arrays == size(self%array)) then
      allocate (longer(2 * self%arrays))
      longer(:self%arrays) = self%array
      call move_alloc(longer, self%array)
    end if
    self%arrays = self%arrays + 1
    self%array(self%arrays)%name = name
    if (allocated(self%array(self%arrays)%element)) deallocate (self%array(self%arrays)%element)
  end subroutine next_array

  !> Lists curves [lanes, elements].
  subroutine add_curves(self, curve)
    class(lane_parameters_t), intent(inout) :: self
    type(curve_t), target, intent(inout) :: curve(:, :)
    integer :: e

    if (self%curve_arrays == size(self%curve_array)) self%curve_array = [self%curve_array, self%curve_array]
    self%curve_arrays = self%curve_arrays + 1
    self%curve_array(self%curve_arrays)%curve => curve
    call self%add_structure([(curve(1, e)%points(), e=1, size(curve, 2))])
  end subroutine add_curves

  !> Adds lists of integers that describe the structure, each preceded by its length.
  recursive subroutine add_integers(self, parts, second, third, fourth, fifth)
    class(lane_parameters_t), intent(inout) :: self
    integer, intent(in) :: parts(:)
    integer, intent(in), optional :: second(:), third(:), fourth(:), fifth(:)
    integer, allocatable :: longer(:)

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

    do i = 1, size(names)
      call self%add_structure([(iachar(names(i)%text(k:k)), k=1, len(names(i)%text))])
    end do
  end subroutine add_names

  !> Whether two lists have the same structure, names and shapes; the number of lanes may differ.
  pure logical function has_same_structure(self, other)
    class(lane_parameters_t), intent(in) :: self
    type(lane_parameters_t), intent(in) :: other
    integer :: i

    has_same_structure = .false.
    if (self%arrays /= other%arrays .or. self%curve_arrays /= other%curve_arrays) return
    if (self%structure_size /= other%structure_size) return
    if (any(self%structure(:self%structure_size) /= other%structure(:self%structure_size))) return
    do i = 1, self%arrays
      associate (here => self%array(i), there => other%array(i))
        if (size(here%value, 1) /= size(there%value, 1) .or. size(here%value, 3) /= size(there%value, 3)) return
        if (here%name /= there%name) return
      end associate
    end do
    has_same_structure = .true.
  end function has_same_structure

  !> Copies the parameters and curves of a lane of another list, which has the same structure.
  subroutine copy_lane(self, lane, from, from_lane)
    class(lane_parameters_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(lane_parameters_t), intent(in) :: from   !! with the same structure
    integer, intent(in) :: from_lane              !! lane of `from`
    integer :: e, i, k, s

    do s = 1, self%arrays
      associate (into => self%array(s)%value, value => from%array(s)%value)
        do k = 1, size(into, 3)
          do i = 1, size(into, 1)
            into(i, lane, k) = value(i, from_lane, k)
          end do
        end do
      end associate
    end do
    do s = 1, self%curve_arrays
      associate (into => self%curve_array(s)%curve, curve => from%curve_array(s)%curve)
        do e = 1, size(into, 2)
          into(lane, e) = curve(from_lane, e)
        end do
      end associate
    end do
  end subroutine copy_lane

  !> Positions of the parameters in which a lane differs, in any bit, from a lane of another list with the same structure.
  !> Curves are not compared.
  pure function differences(self, lane, other, other_lane) result(indices)
    class(lane_parameters_t), intent(in) :: self
    integer, intent(in) :: lane
    type(lane_parameters_t), intent(in) :: other   !! with the same structure
    integer, intent(in) :: other_lane              !! lane of `other`
    type(parameter_index_t), allocatable :: indices(:)
    type(parameter_index_t) :: index
    integer :: found, i, k, pass, s

    do pass = 1, 2   ! the first pass counts, the second one stores
      found = 0
      do s = 1, self%arrays
        do k = 1, size(self%array(s)%value, 3)
          do i = 1, size(self%array(s)%value, 1)
            index = parameter_index_t(s, i, k)
            if (transfer(self%value(index, lane), 0_int64) == transfer(other%value(index, other_lane), 0_int64)) cycle
            found = found + 1
            if (pass == 2) indices(found) = index
          end do
        end do
      end do
      if (pass == 1) allocate (indices(found))
    end do
  end function differences

  !> Whether a lane has the same curves as a lane of another list, which has the same structure.
  pure logical function has_same_curves(self, lane, other, other_lane)
    class(lane_parameters_t), intent(in) :: self
    integer, intent(in) :: lane
    type(lane_parameters_t), intent(in) :: other   !! with the same structure
    integer, intent(in) :: other_lane              !! lane of `other`
    integer :: e, s

    has_same_curves = .false.
    do s = 1, self%curve_arrays
      do e = 1, size(self%curve_array(s)%curve, 2)
        if (.not. self%curve_array(s)%curve(lane, e)%is_same(other%curve_array(s)%curve(other_lane, e))) return
      end do
    end do
    has_same_curves = .true.
  end function has_same_curves

  !> Where the value of a key of an element is; `array` is 0 if no array holds the values of that key as they are.
  pure function index_of_key(self, key, element) result(index)
    class(lane_parameters_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: element   !! number in the machine
    type(parameter_index_t) :: index
    integer :: column, i

    index = parameter_index_t(0, 1, 0)
    do i = 1, self%arrays
      if (.not. allocated(self%array(i)%element) .or. self%array(i)%name /= key) cycle
      column = findloc(self%array(i)%element, element, dim=1)
      if (column > 0) index = parameter_index_t(i, 1, column)
    end do
  end function index_of_key

  !> The parameter at a position in one lane.
  pure real(wp) function value(self, index, lane)
    class(lane_parameters_t), intent(in) :: self
    type(parameter_index_t), intent(in) :: index
    integer, intent(in) :: lane

    value = self%array(index%array)%value(index%row, lane, index%column)
  end function value

  !> Sets the parameter at a position in one lane.
  subroutine set_value(self, index, lane, value)
    class(lane_parameters_t), intent(inout) :: self
    type(parameter_index_t), intent(in) :: index
    integer, intent(in) :: lane
    real(wp), intent(in) :: value   !! in the unit of the array

    self%array(index%array)%value(index%row, lane, index%column) = value
  end subroutine set_value

end module nocdyn_lane_parameters
