!> How the twists of the elements depend on the coordinates, and the accelerations of the coordinates on the elements' moments.
module nocdyn_element_coordinates
  use nocdyn_coordinates, only: coordinates_t
  use nocdyn_elements, only: elements_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_sparse_map, only: new_sparse_map, sparse_map_t
  implicit none (type, external)
  private

  public :: new_element_coordinates, twist_map

  !> Element e has the entries first(e) to first(e + 1) - 1, one for each coordinate of its bodies, in ascending order.
  !> Its speed is the sum of ratio * q'(coordinate), and its moment M adds response * M to q''(coordinate).
  type, public :: element_coordinates_t
    integer, allocatable :: first(:)          !! first entry of each element, [elements + 1]
    integer, allocatable :: coordinate(:)     !! [entries]
    real(wp), allocatable :: ratio(:, :)      !! sum of coefficient * row of L_tau over its bodies, [lanes, entries]
    real(wp), allocatable :: response(:, :)   !! as `ratio`, with rows of ((L_tau^T J L_tau)^-1 L_tau^T)^T, [lanes, entries]
    integer, allocatable, private :: source(:)   !! by `selected`: number that each entry has among all, [entries]
  contains
    procedure :: selected
    procedure :: refresh_responses
    procedure :: refresh_selected
    procedure :: has_ratio
    procedure :: entry_elements
    procedure :: pass_parameters
  end type element_coordinates_t

contains

  !> The entries of all elements. A coordinate that several bodies of an element have is one entry.
  function new_element_coordinates(elements, coordinates) result(self)
    type(elements_t), intent(in) :: elements
    type(coordinates_t), intent(in) :: coordinates
    type(element_coordinates_t) :: self
    integer :: entry_of(coordinates%freedoms)   ! entry of each coordinate in the present element, if not below its first one
    integer :: e, entries, i, k, least

    associate (rows => elements%rows)
      entries = sum(coordinates%first(rows%body + 1) - coordinates%first(max(1, rows%body)), mask=rows%body > 0)
      allocate (self%first(elements%count + 1), self%coordinate(entries))
      allocate (self%ratio(size(coordinates%ratio, 1), entries), source=0.0_wp)
      allocate (self%response, source=self%ratio)
      entry_of = 0
      self%first(1) = 1
      do e = 1, elements%count
        associate (begin => self%first(e), next => self%first(e + 1))
          next = begin
          do k = rows%first(e), rows%first(e + 1) - 1
            if (rows%body(k) == 0) cycle
            do i = coordinates%first(rows%body(k)), coordinates%first(rows%body(k) + 1) - 1
              associate (entry => entry_of(coordinates%coordinate(i)))
                if (entry < begin) then
                  entry = next
                  self%coordinate(next) = coordinates%coordinate(i)
                  next = next + 1
                end if
                self%ratio(:, entry) = self%ratio(:, entry) + rows%coefficient(k) * coordinates%ratio(:, i)
                self%response(:, entry) = self%response(:, entry) + rows%coefficient(k) * coordinates%response(:, i)
              end associate
            end do
          end do
          do k = begin, next - 2
            least = k - 1 + minloc(self%coordinate(k:next - 1), dim=1)
            self%coordinate([k, least]) = self%coordinate([least, k])
            self%ratio(:, [k, least]) = self%ratio(:, [least, k])
            self%response(:, [k, least]) = self%response(:, [least, k])
          end do
        end associate
      end do
    end associate
    entries = self%first(size(self%first)) - 1
    self%coordinate = self%coordinate(:entries)
    self%ratio = self%ratio(:, :entries)
    self%response = self%response(:, :entries)
  end function new_element_coordinates

  !> The entries of some elements, in the given order.
  function selected(self, elements, with_ratio_only) result(some)
    class(element_coordinates_t), intent(in) :: self
    integer, intent(in) :: elements(:)       !! numbers of the elements
    logical, intent(in) :: with_ratio_only   !! whether entries without ratio are left out
    type(element_coordinates_t) :: some
    integer, allocatable :: entry(:)
    integer :: i, k, next

    allocate (entry(sum(self%first(elements + 1) - self%first(elements))), some%first(size(elements) + 1))
    next = 1
    do i = 1, size(elements)
      some%first(i) = next
      do k = self%first(elements(i)), self%first(elements(i) + 1) - 1
        if (with_ratio_only .and. .not. self%has_ratio(k)) cycle
        entry(next) = k
        next = next + 1
      end do
    end do
    some%first(size(some%first)) = next
    some%source = entry(:next - 1)
    some%coordinate = self%coordinate(some%source)
    some%ratio = self%ratio(:, some%source)
    some%response = self%response(:, some%source)
  end function selected

  !> Updates the responses of one lane from the coordinates.
  pure subroutine refresh_responses(self, lane, elements, coordinates)
    class(element_coordinates_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(elements_t), intent(in) :: elements
    type(coordinates_t), intent(in) :: coordinates
    integer :: e, entry, i, k

    associate (rows => elements%rows)
      self%response(lane, :) = 0.0_wp
      do e = 1, elements%count
        do k = rows%first(e), rows%first(e + 1) - 1
          if (rows%body(k) == 0) cycle
          do i = coordinates%first(rows%body(k)), coordinates%first(rows%body(k) + 1) - 1
            entry = self%first(e)
            do while (self%coordinate(entry) /= coordinates%coordinate(i))
              entry = entry + 1
            end do
            self%response(lane, entry) = self%response(lane, entry) + rows%coefficient(k) * coordinates%response(lane, i)
          end do
        end do
      end do
    end associate
  end subroutine refresh_responses

  !> Updates the responses of one lane in entries made by `selected`.
  pure subroutine refresh_selected(self, lane, all)
    class(element_coordinates_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(element_coordinates_t), intent(in) :: all   !! of which they were selected

    self%response(lane, :) = all%response(lane, self%source)
  end subroutine refresh_selected

  !> Whether an element turns with the coordinate of an entry. In a group of several freedoms an element may change the
  !> acceleration of a coordinate with which it does not turn.
  pure logical function has_ratio(self, entry)
    class(element_coordinates_t), intent(in) :: self
    integer, intent(in) :: entry

    has_ratio = any(abs(self%ratio(:, entry)) > 0.0_wp)
  end function has_ratio

  !> Element of each entry, [entries].
  pure function entry_elements(self) result(element)
    class(element_coordinates_t), intent(in) :: self
    integer :: element(size(self%coordinate))
    integer :: e

    do e = 1, size(self%first) - 1
      element(self%first(e):self%first(e + 1) - 1) = e
    end do
  end function entry_elements

  !> Passes the arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(element_coordinates_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%first, self%coordinate)
    call parameters%add('elements: ratio', self%ratio)
    call parameters%add('elements: response', self%response)
  end subroutine pass_parameters

  !> The map U from coordinates to twists: the speeds of the elements are U q'.
  function twist_map(incidence, has_offset, without_bands) result(map)
    type(element_coordinates_t), intent(in) :: incidence
    logical, intent(in) :: has_offset(:)    !! elements whose angles may not be zero where the coordinates are, [elements]
    logical, intent(in) :: without_bands    !! whether the map is stored by rows only
    type(sparse_map_t) :: map
    type(element_coordinates_t) :: turning   ! entries with a ratio
    integer :: e

    turning = incidence%selected([(e, e=1, size(incidence%first) - 1)], with_ratio_only=.true.)
    map = new_sparse_map(turning%first, turning%coordinate, turning%ratio, has_offset, without_bands)
  end function twist_map

end module nocdyn_element_coordinates
