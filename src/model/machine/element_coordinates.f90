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
    real(wp), allocatable :: response(:, :)   !! the same sum of ((L_tau^T J L_tau)^-1 L_tau^T)^T, [lanes, entries]
    integer, allocatable, private :: source(:)   !! by `selected`: number that each entry has among all, [entries]
  contains
    procedure :: selected
    procedure :: refresh_responses
    procedure :: refresh_selected
    procedure :: has_ratio
    procedure :: entry_elements
    procedure :: list_parameters
  end type element_coordinates_t

contains

  !> The entries of all elements. A coordinate that several bodies of an element have is one entry.
  function new_element_coordinates(elements, coordinates) result(self)
    type(elements_t), intent(in) :: elements
    type(coordinates_t), intent(in) :: coordinates
    type(element_coordinates_t) :: self
    integer :: entry_of(coordinates%freedoms)   ! entry of each coordinate in the present element, if not below its first one
    integer :: e, entries, k

    entries = 0
    do k = 1, size(elements%rows%body)
      entries = entries + body_entries(coordinates, elements%rows%body(k))
    end do
    allocate (self%first(elements%count + 1), self%coordinate(entries))
    allocate (self%ratio(size(elements%time), entries), source=0.0_wp)
    allocate (self%response, source=self%ratio)
    entry_of = 0
    self%first(1) = 1
    do e = 1, elements%count
      self%first(e + 1) = self%first(e)
      do k = elements%rows%first(e), elements%rows%first(e + 1) - 1
        call add_body(coordinates, elements%rows%body(k), elements%rows%coefficient(k), self%first(e), self%first(e + 1), &
                      entry_of, self)
      end do
      call sort_entries(self, self%first(e), self%first(e + 1) - 1)
    end do
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
    integer :: e, k

    do e = 1, elements%count
      self%response(lane, self%first(e):self%first(e + 1) - 1) = 0.0_wp
      do k = elements%rows%first(e), elements%rows%first(e + 1) - 1
        call add_response(coordinates, elements%rows%body(k), elements%rows%coefficient(k), lane, self%first(e), self)
      end do
    end do
  end subroutine refresh_responses

  !> Adds the response of one body to those of an element in one lane.
  pure subroutine add_response(coordinates, body, coefficient, lane, begin, self)
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: body    !! 0 = ground, which has none
    real(wp), intent(in) :: coefficient   !! of the body in the row of the element
    integer, intent(in) :: lane
    integer, intent(in) :: begin   !! first entry of the element
    type(element_coordinates_t), intent(inout) :: self
    integer :: k, of_body

    if (body == 0) return
    do of_body = coordinates%first(body), coordinates%first(body + 1) - 1
      k = begin
      do while (self%coordinate(k) /= coordinates%coordinate(of_body))
        k = k + 1
      end do
      self%response(lane, k) = self%response(lane, k) + coefficient * coordinates%response(lane, of_body)
    end do
  end subroutine add_response

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

  pure integer function body_entries(coordinates, body)
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: body   !! 0 = ground, which has none

    body_entries = 0
    if (body > 0) body_entries = coordinates%first(body + 1) - coordinates%first(body)
  end function body_entries

  !> Adds the coordinates of a body to the entries of an element.
  pure subroutine add_body(coordinates, body, coefficient, begin, next, entry_of, self)
    type(coordinates_t), intent(in) :: coordinates
    integer, intent(in) :: body             !! 0 = ground, which has none
    real(wp), intent(in) :: coefficient     !! of the body in the row of the element
    integer, intent(in) :: begin            !! first entry of the element
    integer, intent(inout) :: next          !! next free entry
    integer, intent(inout) :: entry_of(:)   !! entry of each coordinate, [freedoms]; below `begin`: not in this element yet
    type(element_coordinates_t), intent(inout) :: self
    integer :: c, k

    do k = 1, body_entries(coordinates, body)
      associate (of_body => coordinates%first(body) + k - 1)
        c = coordinates%coordinate(of_body)
        if (entry_of(c) < begin) then
          entry_of(c) = next
          self%coordinate(next) = c
          next = next + 1
        end if
        self%ratio(:, entry_of(c)) = self%ratio(:, entry_of(c)) + coefficient * coordinates%ratio(:, of_body)
        self%response(:, entry_of(c)) = self%response(:, entry_of(c)) + coefficient * coordinates%response(:, of_body)
      end associate
    end do
  end subroutine add_body

  pure subroutine sort_entries(self, begin, end)
    type(element_coordinates_t), intent(inout) :: self
    integer, intent(in) :: begin, end   !! first and last entry of the element
    integer :: least, k

    do k = begin, end - 1
      least = k - 1 + minloc(self%coordinate(k:end), dim=1)
      self%coordinate([k, least]) = self%coordinate([least, k])
      self%ratio(:, [k, least]) = self%ratio(:, [least, k])
      self%response(:, [k, least]) = self%response(:, [least, k])
    end do
  end subroutine sort_entries

  !> Registers the arrays whose values may differ from variant to variant.
  subroutine list_parameters(self, parameters)
    class(element_coordinates_t), target, intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%first, self%coordinate)
    call parameters%add('elements: ratio', self%ratio)
    call parameters%add('elements: response', self%response)
  end subroutine list_parameters

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
