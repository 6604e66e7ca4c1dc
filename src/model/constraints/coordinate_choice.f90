!> Choice of the independent bodies, and of the order in which the relations between trains give the others.
module nocdyn_coordinate_choice
  use nocdyn_constraints, only: constraints_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank
  use nocdyn_rigid_trains, only: max_exponent, most_names, ratio_tolerance, rigid_trains_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_text, only: joined, quoted, selected, string_t, to_text
  use nocdyn_train_motion, only: elimination_t
  use nocdyn_train_relations, only: distinct_trains, leaf_elimination_t, new_relations, scaled_rows, train_relations_t, unit_rows
  implicit none (type, external)
  private

  public :: eliminate, choose_coordinates, pivoted_elimination

contains

  !> Chooses coordinates by eliminating leaves and by pivoting: the roots of the trains that no relation gives.
  subroutine eliminate(relations, takes_part, group_of, trains, groups)
    type(train_relations_t), intent(in) :: relations
    logical, intent(in) :: takes_part(:)   !! relations that are not redundant
    integer, intent(in) :: group_of(:)     !! group of each body
    type(rigid_trains_t), intent(in) :: trains
    type(geared_group_t), intent(inout) :: groups(:)
    logical :: is_free_root(size(group_of))
    integer :: g

    call distribute(relations, relations%eliminate_leaves(takes_part, spread(.false., 1, size(trains%root))), &
                    group_of(trains%root), groups)
    is_free_root = .false.
    do g = 1, size(groups)
      associate (group => groups(g))
        group%elimination = pivoted_elimination(relations, group%trains, group%elimination%relation, &
                                                group%elimination%train, group%elimination%core)
        is_free_root(trains%root(group%elimination%free)) = .true.
        group%independent = pack(group%bodies, is_free_root(group%bodies))
        group%elimination%free = trains%train(group%independent)
      end associate
    end do
  end subroutine eliminate

  !> Assigns eliminated and remaining relations to the groups.
  subroutine distribute(relations, leaves, group_of, groups)
    type(train_relations_t), intent(in) :: relations
    type(leaf_elimination_t), intent(in) :: leaves
    integer, intent(in) :: group_of(:)   !! group of each train
    type(geared_group_t), intent(inout) :: groups(:)
    integer :: first(size(groups) + 1), first_core(size(groups) + 1), g, i
    integer :: core(size(leaves%core)), order(size(leaves%train))

    call transposed_order(group_of(leaves%train), size(groups), order, first)
    call transposed_order([(group_of(relations%equations%body(relations%equations%first(leaves%core(i)))), &
                            i=1, size(leaves%core))], size(groups), core, first_core)
    do g = 1, size(groups)
      associate (elimination => groups(g)%elimination)
        elimination%relation = leaves%relation(order(first(g):first(g + 1) - 1))
        elimination%train = leaves%train(order(first(g):first(g + 1) - 1))
        elimination%core = leaves%core(core(first_core(g):first_core(g + 1) - 1))
        if (size(elimination%core) > 0) then
          elimination%core_trains = distinct_trains(relations%equations, elimination%core)
        else
          elimination%core_trains = elimination%core
        end if
      end associate
    end do
  end subroutine distribute

  !> The elimination whose core gives the trains that column pivoting takes first, so that fast trains are the free ones.
  function pivoted_elimination(relations, trains, relation, train, core) result(elimination)
    type(train_relations_t), intent(in) :: relations
    integer, intent(in) :: trains(:)               !! trains that may be free
    integer, intent(in) :: relation(:), train(:)   !! eliminated as leaves
    integer, intent(in) :: core(:)
    type(elimination_t) :: elimination
    integer, allocatable :: pivots(:)
    integer :: rank
    logical :: is_given(relations%equations%bodies)

    allocate (elimination%relation, source=relation)
    allocate (elimination%train, source=train)
    allocate (elimination%core, source=core)
    if (size(relation) + size(core) == 0) then
      allocate (elimination%core_trains(0))
      allocate (elimination%free, source=trains)
      return
    end if
    allocate (elimination%core_trains, source=distinct_trains(relations%equations, core))
    is_given = .false.
    is_given(train) = .true.
    allocate (pivots(size(elimination%core_trains)))
    call pivoted_rank(unit_rows(relations%equations%block(1, core, elimination%core_trains)), ratio_tolerance, rank, pivots)
    is_given(elimination%core_trains(pivots(:size(core)))) = .true.
    allocate (elimination%free, source=pack(trains, .not. is_given(trains)))
  end function pivoted_elimination

  !> Makes the wanted bodies the coordinates, if there are any. It is an error if they cannot be.
  subroutine choose_coordinates(constraints, body_names, wanted, group_of, is_kept, trains, groups, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    integer, intent(in) :: wanted(:), group_of(:)   !! bodies; group of each body
    logical, intent(in) :: is_kept(:)               !! [rows]
    type(rigid_trains_t), intent(inout) :: trains
    type(geared_group_t), intent(inout) :: groups(:)   !! with coordinates chosen by `eliminate`
    type(error_t), allocatable, intent(out) :: error
    type(train_relations_t) :: relations
    logical :: must_be_free(size(trains%root))
    integer :: first(size(groups) + 1), freedoms, g, order(size(wanted)), roots(size(trains%root)), t
    integer :: body(size(trains%root)), largest(size(trains%root))

    if (size(wanted) == 0) return
    must_be_free = .false.
    must_be_free(trains%train(wanted)) = .true.
    call transposed_order(group_of(wanted), size(groups), order, first)
    do g = 1, size(groups)
      freedoms = size(groups(g)%independent)
      groups(g)%independent = wanted(order(first(g):first(g + 1) - 1))
      if (size(groups(g)%independent) /= freedoms) then
        call raise_count(selected(body_names, groups(g)%bodies), selected(body_names, groups(g)%independent), freedoms, error)
        return
      end if
      if (count(must_be_free(groups(g)%trains)) < freedoms) then
        call raise_related(body_names, groups(g)%independent, error)
        return
      end if
    end do
    roots = trains%root
    roots(trains%train(wanted)) = wanted
    call trains%choose_roots(constraints, roots)
    call trains%largest_exponents(constraints, largest, body)
    t = maxloc(largest, dim=1)   ! there is one, as something is wanted
    if (largest(t) > max_exponent) then
      call raise(error, exit_input, quoted(body_names(trains%root(t))%text) // ' cannot be independent: ' // &
                 quoted(body_names(body(t))%text) // ' turns more than 1e100 times as fast')
      return
    end if
    relations = new_relations(constraints, trains)
    call distribute(relations, relations%eliminate_leaves(is_kept(relations%row), must_be_free), group_of(trains%root), groups)
    do g = 1, size(groups)
      groups(g)%elimination%free = trains%train(groups(g)%independent)
      if (is_solvable(relations, groups(g)%elimination, must_be_free)) cycle
      call raise_related(body_names, groups(g)%independent, error)
      return
    end do
  end subroutine choose_coordinates

  !> Whether the core can be solved for the trains that need not be free.
  logical function is_solvable(relations, elimination, must_be_free)
    type(train_relations_t), intent(in) :: relations
    type(elimination_t), intent(in) :: elimination
    logical, intent(in) :: must_be_free(:)
    real(wp), allocatable :: rows(:, :)
    integer, allocatable :: dependent(:)
    integer :: i, pivots(size(elimination%core)), rank

    is_solvable = .true.
    if (size(elimination%core) == 0) return
    dependent = pack([(i, i=1, size(elimination%core_trains))], .not. must_be_free(elimination%core_trains))
    is_solvable = .false.
    if (size(dependent) /= size(elimination%core)) return
    allocate (rows, source=scaled_rows(relations%equations, elimination%core, elimination%core_trains))
    call pivoted_rank(rows(:, dependent), ratio_tolerance, rank, pivots)
    is_solvable = rank == size(dependent)
  end function is_solvable

  !> Raises the error for a wrong number of independent bodies in a group.
  subroutine raise_count(bodies, named, freedoms, error)
    type(string_t), intent(in) :: bodies(:), named(:)   !! of the group; those that the input names
    integer, intent(in) :: freedoms                     !! number that must be named
    type(error_t), allocatable, intent(inout) :: error
    character(len=:), allocatable :: text

    if (size(bodies) == 1) then
      text = 'must name ' // joined(bodies, ', ') // ' once: no gear joins it to another body'
    else
      text = 'must name exactly ' // to_text(freedoms) // ' of the bodies ' // joined(bodies, ', ', most_names) // &
             ', which are geared together'
    end if
    if (size(named) == 0) then
      text = text // '; it names none of them'
    else
      text = text // '; it names ' // joined(named, ', ', most_names)
    end if
    call raise(error, exit_input, text)
  end subroutine raise_count

  !> Raises the error for independent bodies whose speeds the constraints relate.
  subroutine raise_related(body_names, independent, error)
    type(string_t), intent(in) :: body_names(:)
    integer, intent(in) :: independent(:)
    type(error_t), allocatable, intent(inout) :: error

    call raise(error, exit_input, joined(selected(body_names, independent), ', ', most_names) // &
               ' cannot be independent: the constraints relate their speeds')
  end subroutine raise_related

end module nocdyn_coordinate_choice
