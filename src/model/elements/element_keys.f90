!> What an input says about the elements of one bank: their names, their bodies, and the values of their keys. Constructors of
!> banks ask for them by the name of the key; the schema gives its unit.
module nocdyn_element_keys
  use nocdyn_curves, only: curve_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, abstract, public :: element_keys_t
    integer :: lanes = 1
    type(string_t), allocatable :: names(:)   !! [elements]
    real(wp) :: t_start = 0.0_wp              !! of the run [s]
  contains
    procedure(has_interface), deferred :: has
    procedure(values_interface), deferred :: values
    procedure(numbers_interface), deferred :: numbers
    procedure(curves_interface), deferred :: curves
    procedure(bodies_interface), deferred :: bodies
    procedure :: longest, lists, joined, owners
  end type element_keys_t

  abstract interface
    !> Whether some elements have a value of a key.
    pure logical function has_interface(self, key)
      import :: element_keys_t
      class(element_keys_t), intent(in) :: self
      character(len=*), intent(in) :: key
    end function has_interface

    !> The number of each element, 1 for a flag that is set, [lanes, elements].
    pure function values_interface(self, key, absent) result(values)
      import :: element_keys_t, wp
      class(element_keys_t), intent(in) :: self
      character(len=*), intent(in) :: key
      real(wp), intent(in), optional :: absent   !! where an element has none; absent: 0
      real(wp) :: values(self%lanes, size(self%names))
    end function values_interface

    !> The list of numbers of one element, empty where it has none.
    pure function numbers_interface(self, key, lane, element) result(numbers)
      import :: element_keys_t, wp
      class(element_keys_t), intent(in) :: self
      character(len=*), intent(in) :: key
      integer, intent(in) :: lane, element
      real(wp), allocatable :: numbers(:)
    end function numbers_interface

    !> The table of each element, [lanes, elements].
    function curves_interface(self, x, y, extrapolation) result(curves)
      import :: curve_t, element_keys_t
      class(element_keys_t), intent(in) :: self
      character(len=*), intent(in) :: x, y                      !! keys of its lists
      character(len=*), intent(in), optional :: extrapolation   !! of all; absent: the one of each element
      type(curve_t), allocatable :: curves(:, :)
    end function curves_interface

    !> Body number `which` of each element, 0 for the ground.
    function bodies_interface(self, key, which) result(bodies)
      import :: element_keys_t
      class(element_keys_t), intent(in) :: self
      character(len=*), intent(in) :: key
      integer, intent(in) :: which   !! 1 or more
      integer :: bodies(size(self%names))
    end function bodies_interface
  end interface

contains

  !> The most numbers that an element has in the list of a key.
  pure integer function longest(self, key)
    class(element_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer :: e

    longest = maxval([0, (size(self%numbers(key, 1, e)), e=1, size(self%names))])
  end function longest

  !> The lists of all elements, [lanes, elements, parts].
  pure function lists(self, key, parts, absent)
    class(element_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, intent(in) :: parts              !! as many as the longest list has, or more
    real(wp), intent(in), optional :: absent  !! after the end of a list; absent: 0
    real(wp) :: lists(self%lanes, size(self%names), parts)
    integer :: e, lane

    lists = 0.0_wp
    if (present(absent)) lists = absent
    do e = 1, size(self%names)
      do lane = 1, self%lanes
        associate (one => self%numbers(key, lane, e))
          lists(lane, e, :size(one)) = one
        end associate
      end do
    end do
  end function lists

  !> The lists of all elements one after the other, [lanes, numbers].
  pure function joined(self, key) result(numbers)
    class(element_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    real(wp), allocatable :: numbers(:, :)
    integer :: e, lane

    allocate (numbers(self%lanes, size(self%owners(key))))
    do lane = 1, self%lanes
      numbers(lane, :) = [(self%numbers(key, lane, e), e=1, size(self%names))]
    end do
  end function joined

  !> The element of each of these numbers.
  pure function owners(self, key)
    class(element_keys_t), intent(in) :: self
    character(len=*), intent(in) :: key
    integer, allocatable :: owners(:)
    integer :: e

    allocate (owners, source=[(spread(e, 1, size(self%numbers(key, 1, e))), e=1, size(self%names))])
  end function owners

end module nocdyn_element_keys
