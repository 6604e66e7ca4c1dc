!> Analysis of the constraint rows: rank, redundant rows, locked bodies and independent coordinates, group by group.
!>
!> Rows of two bodies come first: they join the bodies to rigid trains, in time linear in their number. The other rows are a
!> small problem between trains, of which only the core without leaves is dense.
module nocdyn_constraint_analysis
  use nocdyn_constraint_conflicts, only: locked_trains, raise_lock, raise_loop_conflict
  use nocdyn_constraints, only: constraints_t
  use nocdyn_coordinate_choice, only: choose_coordinates, eliminate
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_geared_groups, only: find_groups, geared_group_t, redundancy_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank
  use nocdyn_rigid_trains, only: find_trains, ratio_tolerance, rigid_trains_t
  use nocdyn_sparse_map, only: transposed_order
  use nocdyn_train_motion, only: find_loads, find_motion, train_motion_t
  use nocdyn_text, only: string_t, to_text
  use nocdyn_train_relations, only: distinct_trains, new_relations, scaled_rows, leaf_elimination_t, train_relations_t
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: analyse_constraints

  ! The time grows with the cube of these numbers; they take some seconds.
  integer, parameter :: most_redundant = 1000   ! other rows that a redundant one shares loads with
  integer, parameter :: most_in_core = 2000     ! relations of the core of a group

contains

  !> Finds the trains and groups and analyses them. Locked bodies and impossible coordinates are errors.
  subroutine analyse_constraints(constraints, body_names, wanted, trains, groups, offending_row, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    integer, intent(in) :: wanted(:)              !! bodies chosen as coordinates; empty: they are chosen here
    type(rigid_trains_t), intent(out) :: trains   !! their roots are the coordinates, or their fastest bodies
    type(geared_group_t), allocatable, intent(out) :: groups(:)
    integer, intent(out) :: offending_row   !! row that the error is about, 0 if it is about `wanted`
    type(error_t), allocatable, intent(out) :: error
    type(train_relations_t) :: relations
    integer, allocatable :: group_of(:), first(:), order(:)
    logical, allocatable :: is_kept(:)
    integer :: r

    call find_groups(constraints, groups, group_of)
    call find_trains(constraints, trains, is_kept)
    offending_row = trains%first_contradiction(constraints, is_kept)
    if (offending_row > 0) then
      call raise_loop_conflict(constraints, body_names, trains, offending_row, error)
      return
    end if
    call trains%choose_roots(constraints, trains%fastest_bodies(constraints))
    relations = new_relations(constraints, trains)
    allocate (first(size(groups) + 1), order(size(trains%root)))
    call transposed_order(group_of(trains%root), size(groups), order, first)
    call find_independent_relations(relations, group_of(trains%root), size(groups), is_kept, offending_row, error)
    if (allocated(error)) return
    do r = 1, size(groups)
      groups(r)%trains = order(first(r):first(r + 1) - 1)
      groups(r)%kept = pack(groups(r)%rows, is_kept(groups(r)%rows))
    end do
    call eliminate(relations, is_kept(relations%row), group_of, trains, groups)
    do r = 1, size(groups)
      associate (elimination => groups(r)%elimination)
        if (size(elimination%relation) + size(elimination%core) == 0 .or. any(constraints%may_stop(groups(r)%rows))) cycle
        if (.not. any(locked_trains(relations, elimination))) cycle
        call raise_lock(constraints, body_names, trains, relations, [elimination%relation, elimination%core], &
                        offending_row, error)
        return
      end associate
    end do
    call explain_redundancies(constraints, trains, relations, is_kept, groups, offending_row, error)
    if (allocated(error)) return
    call choose_coordinates(constraints, body_names, wanted, group_of, is_kept, trains, groups, error)
  end subroutine analyse_constraints

  !> Finds the relations that are independent of those before them in the input. Relations with leaves always are.
  subroutine find_independent_relations(relations, group_of, groups, is_kept, offending_row, error)
    type(train_relations_t), intent(in) :: relations
    integer, intent(in) :: group_of(:)     !! group of each train
    integer, intent(in) :: groups          !! number of groups
    logical, intent(inout) :: is_kept(:)   !! [rows]
    integer, intent(out) :: offending_row  !! one of too many for a dense matrix, else 0
    type(error_t), allocatable, intent(out) :: error
    type(leaf_elimination_t) :: leaves
    integer, allocatable :: order(:)
    integer :: first(groups + 1), g, i

    offending_row = 0
    is_kept(relations%row) = .true.
    leaves = relations%eliminate_leaves(spread(.true., 1, size(relations%row)), spread(.false., 1, size(group_of)))
    if (size(leaves%core) == 0) return
    allocate (order(size(leaves%core)))
    call transposed_order([(group_of(relations%equations%body(relations%equations%first(leaves%core(i)))), &
                            i=1, size(leaves%core))], groups, order, first)
    do g = 1, groups
      if (first(g + 1) - first(g) > most_in_core) then
        offending_row = relations%row(leaves%core(order(first(g))))
        call raise(error, exit_input, 'the row is one of more than ' // to_text(most_in_core) // ' of three or more bodies ' // &
                   'that can only be solved together; allowed: ' // to_text(most_in_core))
        return
      end if
      if (first(g + 1) > first(g)) call find_independent_core(relations, leaves%core(order(first(g):first(g + 1) - 1)), is_kept)
    end do
  end subroutine find_independent_relations

  !> Removes relations that are combinations of those before them (Gram-Schmidt, twice per relation). Where rounding hides one,
  !> it then removes the first relation that does not raise the rank (column-pivoted QR), until the rank is full.
  subroutine find_independent_core(relations, core, is_kept)
    type(train_relations_t), intent(in) :: relations
    integer, intent(in) :: core(:)         !! relations, ascending
    logical, intent(inout) :: is_kept(:)   !! [rows]
    integer, allocatable :: remaining(:)
    real(wp), allocatable :: basis(:, :), part(:), rows(:, :)   ! the columns of the basis are orthonormal
    integer :: dependent, independent, i, middle   ! bisection: the first `independent` rows are, the first `dependent` are not
    integer :: k, n, pass
    logical :: is_new(size(core))

    allocate (rows, source=scaled_rows(relations%equations, core, distinct_trains(relations%equations, core)))
    allocate (basis(size(rows, 2), size(core)))
    n = 0
    do i = 1, size(core)
      part = rows(i, :)
      do pass = 1, 2
        do k = 1, n
          part = part - dot_product(basis(:, k), part) * basis(:, k)
        end do
      end do
      is_new(i) = norm2(part) > ratio_tolerance
      if (.not. is_new(i)) cycle
      n = n + 1
      basis(:, n) = part / norm2(part)
    end do
    is_kept(relations%row(pack(core, .not. is_new))) = .false.
    remaining = pack(core, is_new)
    rows(:size(remaining), :) = rows(pack([(i, i=1, size(core))], is_new), :)
    independent = 0
    do
      dependent = size(remaining) + 1
      if (rank_of(rows(:size(remaining), :)) == size(remaining)) exit
      do while (dependent - independent > 1)
        middle = (independent + dependent) / 2
        if (rank_of(rows(:middle, :)) == middle) then
          independent = middle
        else
          dependent = middle
        end if
      end do
      is_kept(relations%row(remaining(dependent))) = .false.
      rows(dependent:size(remaining) - 1, :) = rows(dependent + 1:size(remaining), :)
      remaining = [remaining(:dependent - 1), remaining(dependent + 1:)]
    end do
  end subroutine find_independent_core

  !> Rank by column-pivoted QR.
  integer function rank_of(rows)
    real(wp), intent(in) :: rows(:, :)   !! [rows, trains]
    integer :: pivots(size(rows, 2))

    rank_of = 0
    if (all(abs(rows) <= 0.0_wp)) return
    call pivoted_rank(rows, ratio_tolerance, rank_of, pivots)
  end function rank_of

  !> Finds the kept rows that each redundant row repeats. Ends at the first row that has more than `most_redundant` others to
  !> share loads with.
  subroutine explain_redundancies(constraints, trains, relations, is_kept, groups, offending_row, error)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    type(train_relations_t), intent(in) :: relations
    logical, intent(in) :: is_kept(:)   !! [rows]
    type(geared_group_t), intent(inout) :: groups(:)
    integer, intent(out) :: offending_row   !! that row, else 0
    type(error_t), allocatable, intent(out) :: error
    type(train_motion_t) :: found
    integer, allocatable :: bodies(:), redundant(:), rows(:)
    integer :: g, i, k, local(size(trains%root)), relation
    integer :: parent(size(is_kept)), sharing(size(is_kept))   ! union-find over the rows; redundant ones of each component
    logical :: is_repeated(size(is_kept))
    real(wp) :: lambda(size(relations%row)), moment(size(trains%root))

    parent = [(i, i=1, size(parent))]
    sharing = 0
    is_repeated = .false.
    do g = 1, size(groups)
      associate (group => groups(g))
        allocate (group%redundancies(size(group%rows) - size(group%kept)))
        if (size(group%redundancies) == 0) cycle
        redundant = pack(group%rows, .not. is_kept(group%rows))
        local(group%trains) = [(k, k=1, size(group%trains))]
        call find_motion(relations, group%elimination, local, size(group%trains), 1, found)
        do i = 1, size(redundant)
          offending_row = redundant(i)
          group%redundancies(i)%row = redundant(i)
          if (constraints%entries(redundant(i)) == 2) then
            associate (next => constraints%first(redundant(i)))
              call trains%find_path(constraints%body(next), constraints%body(next + 1), bodies, rows)
            end associate
          else   ! rows whose reactions together have the effect of its own
            relation = findloc(relations%row, redundant(i), dim=1)
            moment = 0.0_wp
            associate (first => relations%equations%first(relation), last => relations%equations%first(relation + 1) - 1)
              moment(relations%equations%body(first:last)) = relations%equations%coefficient(1, first:last)
            end associate
            lambda = 0.0_wp
            call find_loads(relations, group%elimination, found%dual, 1, moment, lambda)
            lambda = -lambda
            lambda(relation) = 1.0_wp
            rows = relations%loaded_rows(constraints, trains, lambda, 0)
          end if
          is_repeated(rows) = .true.
          is_repeated(redundant(i)) = .false.
          associate (least => minval(rows), most => maxval(rows))
            group%redundancies(i)%repeats = pack([(k, k=least, most)], is_repeated(least:most))
          end associate
          is_repeated(rows) = .false.
          call join_rows(group%redundancies(i), parent, sharing, error)
          if (allocated(error)) return
        end do
      end associate
    end do
    offending_row = 0
  end subroutine explain_redundancies

  !> Joins a redundant row with those that it repeats; refuses more than `most_redundant` others with common rows.
  subroutine join_rows(redundancy, parent, sharing, error)
    type(redundancy_t), intent(in) :: redundancy
    integer, intent(inout) :: parent(:)    !! union-find, [rows]
    integer, intent(inout) :: sharing(:)   !! redundant rows in the component of each root, [rows]
    type(error_t), allocatable, intent(out) :: error
    integer :: i, joined, other, root

    call find_root(parent, redundancy%row, root)
    joined = sharing(root) + 1
    do i = 1, size(redundancy%repeats)
      call find_root(parent, redundancy%repeats(i), other)
      call find_root(parent, redundancy%row, root)
      if (other == root) cycle
      joined = joined + sharing(other)
      call join_components(redundancy%row, redundancy%repeats(i), parent)
    end do
    call find_root(parent, redundancy%row, root)
    sharing(root) = joined
    if (joined > most_redundant) call raise(error, exit_input, 'the row is redundant, as are ' // to_text(most_redundant) // &
                                            ' others that share its loads by common rows; allowed: ' // to_text(most_redundant))
  end subroutine join_rows

end module nocdyn_constraint_analysis
