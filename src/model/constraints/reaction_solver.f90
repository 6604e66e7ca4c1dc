!> Reactions lambda = D^T (J omega' - T) of all rows, with the right inverse D of L_lambda, which is not formed.
!>
!> The transposed equations of L_lambda^ext are solved from the outside inwards: first the relations between trains, then in each
!> train every body transmits its remaining moment to its parent through the row between them. Last, redundant rows share the
!> loads so that the norm of the reactions is minimal. All work is linear in the entries of the rows, except for the dense
!> cores of relations and the loops that redundant rows close. The set-up takes one solution per redundant row.
module nocdyn_reaction_solver
  use nocdyn_constraints, only: constraints_t
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_rigid_trains, only: rigid_trains_t
  use nocdyn_load_sharing, only: new_load_sharing, load_sharing_t
  use nocdyn_train_motion, only: elimination_t, find_loads
  use nocdyn_train_relations, only: train_relations_t
  implicit none (type, external)
  private

  public :: new_reaction_solver

  !> The relations of one group.
  type :: relation_group_t
    integer, allocatable :: bodies(:)   !! of the group
    type(elimination_t) :: elimination
    real(wp), allocatable :: dual(:, :, :)   !! D of the core, [core_trains, core, lanes]
  end type relation_group_t

  !> The order of the solution, the coefficients of all lanes, and work space.
  type, public :: reaction_solver_t
    private
    integer, allocatable :: train(:)               !! train of each body
    real(wp), allocatable, public :: ratio(:, :)   !! of each body to the root of its train, [lanes, bodies]
    type(train_relations_t) :: relations
    type(relation_group_t), allocatable, public :: groups(:)   !! groups with relations
    integer, allocatable, public :: group_index(:)             !! index of each group in `groups`, 0 without relations
    integer, allocatable :: child(:), parent(:), row(:)   !! bodies, parents, rows between them; outer ones first
    real(wp), allocatable :: own(:, :), other(:, :)       !! coefficients of child and parent, [lanes, pairs]
    type(load_sharing_t), public :: load_sharing          !! distributes reactions of the kept rows over all rows
    real(wp), allocatable :: of_trains(:)      !! moments on trains, [trains], work space
    real(wp), allocatable :: of_relations(:)   !! multipliers, [relations], work space
  contains
    procedure :: find_null_vectors
    procedure :: find_reactions
    procedure :: pass_parameters
    procedure, private :: back_substitute
  end type reaction_solver_t

contains

  !> The order of the solution. The values of each lane are set in `ratio` and in `dual` of the groups.
  function new_reaction_solver(constraints, trains, relations, groups) result(self)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    type(train_relations_t), intent(in) :: relations
    type(geared_group_t), intent(in) :: groups(:)
    type(reaction_solver_t) :: self
    integer, allocatable :: with_relations(:)
    integer :: g, k, lane, lanes

    lanes = size(constraints%coefficient, 1)
    allocate (self%train, source=trains%train)
    self%relations = relations
    allocate (self%ratio(lanes, constraints%bodies))
    allocate (self%of_trains(size(trains%root)), self%of_relations(size(relations%row)))
    with_relations = pack([(g, g=1, size(groups))], [(size(groups(g)%elimination%relation) &
                                                      + size(groups(g)%elimination%core) > 0, g=1, size(groups))])
    allocate (self%group_index(size(groups)), source=0)
    self%group_index(with_relations) = [(k, k=1, size(with_relations))]
    allocate (self%groups(size(with_relations)))
    do k = 1, size(with_relations)
      associate (group => self%groups(k), elimination => groups(with_relations(k))%elimination)
        group%bodies = groups(with_relations(k))%bodies
        group%elimination = elimination
        allocate (group%dual(size(elimination%core_trains), size(elimination%core), lanes))
      end associate
    end do
    self%child = pack(trains%order(size(trains%order):1:-1), trains%parent(trains%order(size(trains%order):1:-1)) > 0)
    self%parent = trains%parent(self%child)
    self%row = trains%parent_row(self%child)
    allocate (self%own(lanes, size(self%child)), self%other(lanes, size(self%child)))
    do k = 1, size(self%child)
      do lane = 1, lanes
        call constraints%pair_coefficients(lane, self%row(k), self%child(k), self%own(lane, k), self%other(lane, k))
      end do
    end do
  end function new_reaction_solver

  !> Finds the null vectors of the redundant rows, after the values of all lanes have been set: a reaction 1 of such a row and the
  !> negative reactions that the rows which it repeats have instead.
  subroutine find_null_vectors(self, constraints, groups)
    class(reaction_solver_t), intent(inout) :: self
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: groups(:)
    real(wp) :: null_vector(constraints%rows()), moment(constraints%bodies)
    logical :: is_member(constraints%rows())   ! whether a row is the redundant row or one of those that it repeats
    integer :: b, i, lane, row

    is_member = .false.
    self%load_sharing = new_load_sharing(groups, constraints%rows(), size(self%own, 1))
    do b = 1, size(self%load_sharing%blocks)
      associate (block => self%load_sharing%blocks(b))
        do lane = 1, size(self%own, 1)
          do i = 1, size(block%redundancies)
            row = block%redundancies(i)%row
            moment = 0.0_wp
            associate (first => constraints%first(row), last => constraints%first(row + 1) - 1)
              moment(constraints%body(first:last)) = -constraints%coefficient(lane, first:last)
            end associate
            call self%back_substitute(lane, moment, null_vector)
            null_vector(row) = 1.0_wp
            is_member([row, block%redundancies(i)%repeats]) = .true.
            where (is_member(block%rows)) block%null_vectors(:, i, lane) = null_vector(block%rows)
            is_member(block%rows) = .false.
          end do
          call block%orthonormalise(lane)
        end do
      end associate
    end do
  end subroutine find_null_vectors

  !> Reactions of all rows that balance moments on the bodies, eq. (12): L_lambda^T lambda = J omega' - T.
  pure subroutine find_reactions(self, lane, moment, lambda)
    class(reaction_solver_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moment(:)   !! J omega' - T [N m], [bodies]; rounding on return
    real(wp), intent(inout) :: lambda(:)   !! [rows]

    call self%back_substitute(lane, moment, lambda)
    call self%load_sharing%minimise_norm(lane, lambda)
  end subroutine find_reactions

  !> Reactions of the kept rows only: first of the relations, then of the rows between two bodies.
  pure subroutine back_substitute(self, lane, moment, lambda)
    class(reaction_solver_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moment(:), lambda(:)   !! as in `find_reactions`
    integer :: b, entry, g, i, k

    lambda = 0.0_wp
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
      associate (rows => self%relations%rows)
        do entry = rows%first(i), rows%first(i + 1) - 1
          moment(rows%body(entry)) = moment(rows%body(entry)) - rows%coefficient(lane, entry) * self%of_relations(i)
        end do
      end associate
    end do
    do k = 1, size(self%child)
      lambda(self%row(k)) = moment(self%child(k)) / self%own(lane, k)
      moment(self%parent(k)) = moment(self%parent(k)) - self%other(lane, k) * lambda(self%row(k))
    end do
  end subroutine back_substitute

  !> Passes the arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(reaction_solver_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters
    integer :: g

    call parameters%add_structure(self%train, self%relations%row, self%group_index)
    call parameters%add_structure(self%child, self%parent, self%row)
    call self%relations%rows%pass_parameters(parameters)
    call self%relations%equations%pass_parameters(parameters)
    call parameters%add('reactions: ratio', self%ratio)
    call parameters%add('reactions: own', self%own)
    call parameters%add('reactions: other', self%other)
    do g = 1, size(self%groups)
      call parameters%add_structure(self%groups(g)%bodies)
      associate (order => self%groups(g)%elimination)
        call parameters%add_structure(order%free, order%relation, order%train, order%core, order%core_trains)
      end associate
      call parameters%add_blocks('reactions: dual', self%groups(g)%dual)
    end do
    call self%load_sharing%pass_parameters(parameters)
  end subroutine pass_parameters

end module nocdyn_reaction_solver
