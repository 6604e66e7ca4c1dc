!> Reactions lambda = D^T (J omega' - T) of all rows, D the right inverse of L_lambda, without forming it.
!>
!> The transposed equations of L_lambda^ext are swept from the outside inwards: the relations between trains first, then in
!> each train every body hands what is left over on it to its parent through the row between them. What redundant rows
!> carry is then shared out so that the norm of the reactions is smallest. All work is linear in the entries of the rows
!> but for the dense cores of relations and the loops that redundant rows close. To set it up takes a sweep for each
!> redundant row.
module nocdyn_reaction_sweep
  use nocdyn_constraints, only: constraints_t
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_numbers, only: lane_numbers_t
  use nocdyn_rigid_trains, only: rigid_trains_t
  use nocdyn_shared_loads, only: new_shared_loads, shared_loads_t
  use nocdyn_train_motion, only: elimination_t, find_loads
  use nocdyn_train_relations, only: train_relations_t
  implicit none (type, external)
  private

  public :: new_reaction_sweep

  !> The relations of one group.
  type :: relation_group_t
    integer, allocatable :: bodies(:)
    type(elimination_t) :: elimination
    real(wp), allocatable :: dual(:, :, :)   !! D of the core, [core_trains, core, lanes]
  end type relation_group_t

  type, public :: reaction_sweep_t
    private
    integer, allocatable :: train(:)           !! of each body
    real(wp), allocatable :: ratio(:, :)       !! of each body to the lead of its train, [lanes, bodies]
    type(train_relations_t) :: relations
    integer, allocatable :: first(:)           !! entries of the relations between bodies, [relations + 1]
    integer, allocatable :: body(:)            !! [entries]
    real(wp), allocatable :: coefficient(:, :) !! [lanes, entries]
    type(relation_group_t), allocatable :: groups(:)   !! those with relations
    integer, allocatable :: place(:)           !! of each group among them, 0 without relations
    integer, allocatable :: child(:), parent(:), row(:)   !! the pairs of all trains, from the outside inwards
    real(wp), allocatable :: own(:, :), other(:, :)       !! coefficients of child and parent, [lanes, pairs]
    type(shared_loads_t) :: shares
    real(wp), allocatable :: of_trains(:)      !! moments on trains, work space
    real(wp), allocatable :: of_relations(:)   !! multipliers, work space
  contains
    procedure :: take_core
    procedure :: take_ratios
    procedure :: lead_ratio
    procedure :: share_out
    procedure :: share
    procedure :: find_reactions
    procedure :: list_numbers
    procedure, private :: sweep
    procedure, private :: sweep_relations
  end type reaction_sweep_t

contains

  !> The order of the sweep; the numbers of each lane are to be taken by `take_core` and `take_ratios`.
  function new_reaction_sweep(constraints, trains, relations, groups) result(self)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    type(train_relations_t), intent(in) :: relations
    type(geared_group_t), intent(in) :: groups(:)
    type(reaction_sweep_t) :: self
    integer :: entry, i, lanes, next

    lanes = size(constraints%coefficient, 1)
    allocate (self%train, source=trains%train)
    self%relations = relations
    allocate (self%ratio(lanes, constraints%bodies))
    allocate (self%of_trains(size(trains%lead)), self%of_relations(size(relations%row)))
    next = sum([(constraints%entries(relations%row(i)), i=1, size(relations%row))])
    allocate (self%first(size(relations%row) + 1), self%body(next), self%coefficient(lanes, next))
    next = 1
    do i = 1, size(relations%row)
      self%first(i) = next
      do entry = constraints%first(relations%row(i)), constraints%first(relations%row(i) + 1) - 1
        self%body(next) = constraints%body(entry)
        self%coefficient(:, next) = constraints%coefficient(:, entry)
        next = next + 1
      end do
    end do
    self%first(size(self%first)) = next
    call list_groups(groups, lanes, self)
    call list_pairs(constraints, trains, self)
  end function new_reaction_sweep

  subroutine list_groups(groups, lanes, self)
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: lanes
    type(reaction_sweep_t), intent(inout) :: self
    integer :: g, k

    allocate (self%place(size(groups)), source=0)
    k = 0
    do g = 1, size(groups)
      if (size(groups(g)%elimination%relation) + size(groups(g)%elimination%core) == 0) cycle
      k = k + 1
      self%place(g) = k
    end do
    allocate (self%groups(k))
    do g = 1, size(groups)
      if (self%place(g) == 0) cycle
      associate (group => self%groups(self%place(g)), elimination => groups(g)%elimination)
        group%bodies = groups(g)%bodies
        group%elimination = elimination
        allocate (group%dual(size(elimination%core_trains), size(elimination%core), lanes))
      end associate
    end do
  end subroutine list_groups

  subroutine list_pairs(constraints, trains, self)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    type(reaction_sweep_t), intent(inout) :: self
    integer :: b, i, k, lane, pairs

    pairs = count(trains%parent > 0)
    allocate (self%child(pairs), self%parent(pairs), self%row(pairs))
    allocate (self%own(size(constraints%coefficient, 1), pairs), self%other(size(constraints%coefficient, 1), pairs))
    k = 0
    do i = size(trains%order), 1, -1
      b = trains%order(i)
      if (trains%parent(b) == 0) cycle
      k = k + 1
      self%child(k) = b
      self%parent(k) = trains%parent(b)
      self%row(k) = trains%parent_row(b)
      do lane = 1, size(self%own, 1)
        call constraints%split_pair(lane, self%row(k), b, self%own(lane, k), self%other(lane, k))
      end do
    end do
  end subroutine list_pairs

  !> The inverse of the core of group number `group`.
  pure subroutine take_core(self, group, lane, dual)
    class(reaction_sweep_t), intent(inout) :: self
    integer, intent(in) :: group, lane
    real(wp), intent(in) :: dual(:, :)

    if (self%place(group) > 0) self%groups(self%place(group))%dual(:, :, lane) = dual
  end subroutine take_core

  pure subroutine take_ratios(self, lane, ratio)
    class(reaction_sweep_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: ratio(:)   !! [bodies]

    self%ratio(lane, :) = ratio
  end subroutine take_ratios

  !> How fast a body is, measured by the lead of its train.
  pure real(wp) function lead_ratio(self, lane, body) result(ratio)
    class(reaction_sweep_t), intent(in) :: self
    integer, intent(in) :: lane, body

    ratio = self%ratio(lane, body)
  end function lead_ratio

  !> Finds the idle combinations of redundant rows, once the numbers of all lanes are there: a reaction 1 of such a row and
  !> the negative of what the rows that it repeats carry in its place.
  subroutine share_out(self, constraints, groups)
    class(reaction_sweep_t), intent(inout) :: self
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: groups(:)
    real(wp) :: idle(constraints%rows()), moment(constraints%bodies)
    integer :: b, i, lane, row

    self%shares = new_shared_loads(groups, constraints%rows(), size(self%own, 1))
    do b = 1, size(self%shares%blocks)
      associate (block => self%shares%blocks(b))
        do lane = 1, size(self%own, 1)
          do i = 1, size(block%redundancies)
            row = block%redundancies(i)%row
            moment = 0.0_wp
            associate (first => constraints%first(row), last => constraints%first(row + 1) - 1)
              moment(constraints%body(first:last)) = -constraints%coefficient(lane, first:last)
            end associate
            call self%sweep(lane, moment, idle)
            idle(row) = 1.0_wp
            where (block%rows == row .or. is_among(block%rows, block%redundancies(i)%repeats)) &
              block%idle(:, i, lane) = idle(block%rows)
          end do
          call block%orthonormalise(lane)
        end do
      end associate
    end do
  end subroutine share_out

  !> Which of some ascending rows are in a second ascending list.
  pure function is_among(rows, list) result(answer)
    integer, intent(in) :: rows(:), list(:)
    logical :: answer(size(rows))
    integer :: i, k

    k = 1
    do i = 1, size(rows)
      do while (k < size(list))
        if (list(k) >= rows(i)) exit
        k = k + 1
      end do
      answer(i) = list(k) == rows(i)
    end do
  end function is_among

  !> Reactions that balance moments on the bodies.
  pure subroutine find_reactions(self, lane, moment, lambda)
    class(reaction_sweep_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moment(:)   !! J omega' - T [N m], [bodies]; what is left over on return is rounding
    real(wp), intent(inout) :: lambda(:)   !! [rows]

    call self%sweep(lane, moment, lambda)
    call self%shares%relieve(lane, lambda)
  end subroutine find_reactions

  !> Shares reactions of the kept rows out over all rows.
  pure subroutine share(self, lane, lambda)
    class(reaction_sweep_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: lambda(:)   !! [rows], 0 for redundant ones

    call self%shares%relieve(lane, lambda)
  end subroutine share

  !> Reactions of the kept rows alone.
  pure subroutine sweep(self, lane, moment, lambda)
    class(reaction_sweep_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moment(:), lambda(:)
    integer :: k

    lambda = 0.0_wp
    if (size(self%groups) > 0) call self%sweep_relations(lane, moment, lambda)
    do k = 1, size(self%child)
      lambda(self%row(k)) = moment(self%child(k)) / self%own(lane, k)
      moment(self%parent(k)) = moment(self%parent(k)) - self%other(lane, k) * lambda(self%row(k))
    end do
  end subroutine sweep

  !> Reactions of the relations; they are taken off the moments on the bodies.
  pure subroutine sweep_relations(self, lane, moment, lambda)
    class(reaction_sweep_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moment(:), lambda(:)
    integer :: b, entry, g, i

    self%of_trains(:) = 0.0_wp
    self%of_relations(:) = 0.0_wp
    do g = 1, size(self%groups)
      associate (group => self%groups(g))
        do i = 1, size(group%bodies)
          b = group%bodies(i)
          self%of_trains(self%train(b)) = self%of_trains(self%train(b)) + self%ratio(lane, b) * moment(b)
        end do
        call find_loads(self%relations, group%elimination, group%dual(:, :, lane), lane, self%of_trains, self%of_relations)
      end associate
    end do
    do i = 1, size(self%of_relations)
      lambda(self%relations%row(i)) = self%of_relations(i)
      do entry = self%first(i), self%first(i + 1) - 1
        moment(self%body(entry)) = moment(self%body(entry)) - self%coefficient(lane, entry) * self%of_relations(i)
      end do
    end do
  end subroutine sweep_relations

  subroutine list_numbers(self, numbers)
    class(reaction_sweep_t), target, intent(inout) :: self
    type(lane_numbers_t), intent(inout) :: numbers
    integer :: g

    call numbers%remark(self%train)
    call numbers%remark(self%relations%row)
    call numbers%remark(self%first)
    call numbers%remark(self%body)
    call numbers%remark(self%place)
    call numbers%remark(self%child)
    call numbers%remark(self%parent)
    call numbers%remark(self%row)
    call self%relations%between%list_numbers(numbers)
    call numbers%add('sweep: ratio', self%ratio)
    call numbers%add('sweep: coefficient', self%coefficient)
    call numbers%add('sweep: own', self%own)
    call numbers%add('sweep: other', self%other)
    do g = 1, size(self%groups)
      call numbers%remark(self%groups(g)%bodies)
      call self%groups(g)%elimination%list_layout(numbers)
      call numbers%add_blocks('sweep: dual', self%groups(g)%dual)
    end do
    call self%shares%list_numbers(numbers)
  end subroutine list_numbers

end module nocdyn_reaction_sweep
