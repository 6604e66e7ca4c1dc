!> Relations between the speeds of rigid trains: all rows that are not between two bodies.
!>
!> A train that is in one relation only is a leaf: its relation gives its speed from the others. Leaves are eliminated one after
!> the other. The relations that remain, the core, are solved together by dense linear algebra.
module nocdyn_train_relations
  use nocdyn_constraints, only: constraints_t, new_constraints
  use nocdyn_kinds, only: wp
  use nocdyn_rigid_trains, only: ratio_tolerance, rigid_trains_t
  implicit none (type, external)
  private

  public :: new_relations, scaled_rows, unit_rows, distinct_trains

  !> The relations of a machine, in all lanes.
  type, public :: train_relations_t
    integer, allocatable :: row(:)     !! constraint row of each relation
    type(constraints_t) :: rows        !! these rows
    type(constraints_t) :: equations   !! the relations; its bodies are the trains; coefficients are zero where terms cancel
  contains
    procedure :: eliminate_leaves
    procedure :: coefficient_of
    procedure :: loaded_rows
  end type train_relations_t

  !> Relations in the order of elimination: train(i) is in relation(i) and in no later one.
  type, public :: leaf_elimination_t
    integer, allocatable :: relation(:), train(:)
    integer, allocatable :: core(:)   !! relations that remain, ascending
  end type leaf_elimination_t

  real(wp), parameter :: min_pivot_share = 1.0e-3_wp   ! smallest pivot, as a share of the relation's largest coefficient

contains

  !> The relations of a machine, for all lanes, with each train once in a relation. A coefficient is 0 where the
  !> coefficients of the bodies cancel.
  function new_relations(constraints, trains) result(self)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    type(train_relations_t) :: self
    integer, allocatable :: first(:), train(:), entry_of(:)   ! entry of the relation of each entry of the rows
    integer :: at(size(trains%root)), entry, lane, next, r
    real(wp), allocatable :: bound(:), coefficient(:, :)
    real(wp) :: ratio(constraints%bodies), term

    allocate (self%row, source=pack([(r, r=1, constraints%rows())], [(constraints%entries(r) /= 2, r=1, constraints%rows())]))
    self%rows = constraints%subset(self%row)
    associate (rows => self%rows)
      allocate (first(size(rows%first)), train(size(rows%body)), entry_of(size(rows%body)))
      at = 0
      next = 1
      do r = 1, rows%rows()
        first(r) = next
        do entry = rows%first(r), rows%first(r + 1) - 1
          associate (t => trains%train(rows%body(entry)))
            if (at(t) < first(r)) then
              at(t) = next
              train(next) = t
              next = next + 1
            end if
            entry_of(entry) = at(t)
          end associate
        end do
      end do
      first(size(first)) = next
      allocate (coefficient(size(constraints%coefficient, 1), next - 1), source=0.0_wp)
      do lane = 1, size(coefficient, 1)
        ratio = trains%ratios(constraints, lane)
        bound = 0.0_wp * coefficient(lane, :)
        do entry = 1, size(entry_of)
          term = rows%coefficient(lane, entry) * ratio(rows%body(entry))
          coefficient(lane, entry_of(entry)) = coefficient(lane, entry_of(entry)) + term
          bound(entry_of(entry)) = bound(entry_of(entry)) + abs(term)
        end do
        where (abs(coefficient(lane, :)) <= ratio_tolerance * bound) coefficient(lane, :) = 0.0_wp
      end do
      self%equations = new_constraints(size(trains%root), rows%names, rows%units, first, train(:next - 1), coefficient)
    end associate
  end function new_relations

  !> Coefficient of one train in a relation.
  pure real(wp) function coefficient_of(self, lane, relation, train) result(coefficient)
    class(train_relations_t), intent(in) :: self
    integer, intent(in) :: lane, relation, train
    integer :: entry

    do entry = self%equations%first(relation), self%equations%first(relation + 1) - 1
      if (self%equations%body(entry) == train) coefficient = self%equations%coefficient(lane, entry)
    end do
  end function coefficient_of

  !> Eliminates leaves as long as there are any, by the coefficients of the first lane: of a relation, the leaf with the largest
  !> one, if it is a good pivot. A relation that gets a leaf by this is put into the queue.
  function eliminate_leaves(self, takes_part, must_be_free) result(leaves)
    class(train_relations_t), intent(in) :: self
    logical, intent(in) :: takes_part(:)     !! whether a relation is considered, [relations]
    logical, intent(in) :: must_be_free(:)   !! whether the speed of a train must not be eliminated, [trains]
    type(leaf_elimination_t) :: leaves
    integer, allocatable :: first(:), of_train(:)
    integer :: uses(size(must_be_free)), queue(size(takes_part) + size(self%equations%body))
    integer :: entry, i, k, last, place, train
    logical :: is_left(size(takes_part))
    real(wp) :: largest

    call self%equations%list_body_rows(takes_part, first, of_train)
    uses = first(2:) - first(:size(uses))
    is_left = takes_part
    allocate (leaves%relation(count(takes_part)), leaves%train(count(takes_part)))
    last = count(takes_part)
    queue(:last) = pack([(i, i=1, size(takes_part))], takes_part)
    leaves%core = queue(:last)
    i = 0
    do place = 1, size(queue)
      if (place > last) exit
      if (.not. is_left(queue(place))) cycle
      associate (relation => queue(place), begin => self%equations%first(queue(place)), &
                 end => self%equations%first(queue(place) + 1) - 1, body => self%equations%body)
        associate (sizes => abs(self%equations%coefficient(1, begin:end)))
          train = 0
          largest = min_pivot_share * maxval(sizes)
          do entry = begin, end
            if (uses(body(entry)) /= 1 .or. must_be_free(body(entry)) .or. sizes(entry - begin + 1) <= largest) cycle
            largest = sizes(entry - begin + 1)
            train = body(entry)
          end do
        end associate
        if (train == 0) cycle
        i = i + 1
        leaves%relation(i) = relation
        leaves%train(i) = train
        is_left(relation) = .false.
        do entry = begin, end
          uses(body(entry)) = uses(body(entry)) - 1
          if (uses(body(entry)) /= 1) cycle
          do k = first(body(entry)), first(body(entry) + 1) - 1
            if (.not. is_left(of_train(k))) cycle
            last = last + 1
            queue(last) = of_train(k)
          end do
        end do
      end associate
    end do
    leaves%relation = leaves%relation(:i)
    leaves%train = leaves%train(:i)
    leaves%core = pack(leaves%core, is_left(leaves%core))
  end function eliminate_leaves

  !> The constraint rows that carry load when the relations have these multipliers, ascending: relations whose multiplier is
  !> more than rounding, and the tree rows that they load. In the first lane.
  function loaded_rows(self, constraints, trains, lambda, root) result(rows)
    class(train_relations_t), intent(in) :: self
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    real(wp), intent(in) :: lambda(:)   !! multipliers, [relations]
    integer, intent(in) :: root         !! root of a train that carries a unit torque, 0: none
    integer, allocatable :: rows(:)
    integer, allocatable :: active(:), members(:)
    real(wp), allocatable :: sizes(:)   ! largest term of each active relation at the effective speeds
    real(wp) :: moment(constraints%bodies), speed(self%equations%bodies)
    logical :: is_loaded(constraints%rows())
    integer :: i, r

    active = pack([(i, i=1, size(lambda))], abs(lambda) > 0.0_wp)
    allocate (members, source=distinct_trains(self%equations, active))
    speed(members) = effective_speeds(self%equations, active, members)
    allocate (sizes(size(active)))
    do i = 1, size(active)
      associate (first => self%equations%first(active(i)), last => self%equations%first(active(i) + 1) - 1)
        sizes(i) = maxval(abs(self%equations%coefficient(1, first:last)) * speed(self%equations%body(first:last)))
      end associate
    end do
    associate (weight => abs(lambda(active)) * sizes)   ! a relation of size 0 has entries in one train only
      active = pack(active, sizes <= 0.0_wp .or. weight > ratio_tolerance * maxval(weight))
    end associate
    moment = 0.0_wp
    if (root > 0) moment(root) = -1.0_wp
    do i = 1, size(active)
      associate (first => self%rows%first(active(i)), last => self%rows%first(active(i) + 1) - 1, body => self%rows%body)
        moment(body(first:last)) = moment(body(first:last)) + lambda(active(i)) * self%rows%coefficient(1, first:last)
      end associate
    end do
    is_loaded = trains%is_loaded(constraints, moment)
    is_loaded(self%row(active)) = .true.
    rows = pack([(r, r=1, size(is_loaded))], is_loaded)
  end function loaded_rows

  !> The trains of some relations, ascending.
  function distinct_trains(equations, relations) result(trains)
    type(constraints_t), intent(in) :: equations
    integer, intent(in) :: relations(:)
    integer, allocatable :: trains(:)
    logical :: is_there(equations%bodies)
    integer :: i, t

    is_there = .false.
    do i = 1, size(relations)
      is_there(equations%body(equations%first(relations(i)):equations%first(relations(i) + 1) - 1)) = .true.
    end do
    trains = pack([(t, t=1, size(is_there))], is_there)
  end function distinct_trains

  !> Coefficients of relations in the first lane, scaled by the effective speed of each train, as rows of unit length. With this
  !> scaling metres and teeth are comparable, and a large ratio does not look like a lock.
  function scaled_rows(equations, relations, trains) result(matrix)
    type(constraints_t), intent(in) :: equations
    integer, intent(in) :: relations(:), trains(:)
    real(wp) :: matrix(size(relations), size(trains))

    matrix = unit_rows(equations%block(1, relations, trains) &
                       * spread(effective_speeds(equations, relations, trains), 1, size(relations)))
  end function scaled_rows

  !> The rows of a matrix, scaled to unit length; zero rows stay.
  pure function unit_rows(matrix) result(scaled)
    real(wp), intent(in) :: matrix(:, :)   !! [relations, trains]
    real(wp) :: scaled(size(matrix, 1), size(matrix, 2))
    integer :: i

    scaled = matrix
    do i = 1, size(matrix, 1)
      if (norm2(matrix(i, :)) > 0.0_wp) scaled(i, :) = matrix(i, :) / norm2(matrix(i, :))
    end do
  end function unit_rows

  !> Effective speeds of the trains: with them the largest terms of the relations are about equal. They are computed from train
  !> to train and serve as the scale for rounding.
  pure function effective_speeds(equations, relations, trains) result(speeds)
    type(constraints_t), intent(in) :: equations
    integer, intent(in) :: relations(:), trains(:)
    real(wp) :: speeds(size(trains))
    real(wp) :: known(equations%bodies), largest   ! 0: not computed yet
    integer :: entry, i, k, unknown

    known = 0.0_wp
    do
      unknown = count(known(trains) <= 0.0_wp)
      if (unknown == 0) exit
      k = findloc(known(trains) <= 0.0_wp, .true., dim=1)
      known(trains(k)) = 1.0_wp
      do while (count(known(trains) <= 0.0_wp) < unknown)
        unknown = count(known(trains) <= 0.0_wp)
        do i = 1, size(relations)
          associate (first => equations%first(relations(i)), last => equations%first(relations(i) + 1) - 1)
            largest = maxval(abs(equations%coefficient(1, first:last)) * known(equations%body(first:last)))
            if (largest <= 0.0_wp) cycle
            do entry = first, last
              associate (speed => known(equations%body(entry)), c => abs(equations%coefficient(1, entry)))
                if (speed <= 0.0_wp .and. c > 0.0_wp) speed = largest / c
              end associate
            end do
          end associate
        end do
      end do
    end do
    speeds = known(trains)
  end function effective_speeds

end module nocdyn_train_relations
