!> Errors for rows that lock bodies: which bodies, by which rows, and the message.
module nocdyn_constraint_conflicts
  use nocdyn_complement, only: natural_complement
  use nocdyn_constraints, only: constraints_t
  use nocdyn_coordinate_choice, only: pivoted_elimination
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank
  use nocdyn_rigid_trains, only: most_names, ratio_tolerance, rigid_trains_t
  use nocdyn_text, only: joined, quoted, rounded_text, selected, string_t
  use nocdyn_train_motion, only: elimination_t, find_loads, find_motion, train_motion_t
  use nocdyn_train_relations, only: distinct_trains, scaled_rows, leaf_elimination_t, train_relations_t
  implicit none (type, external)
  private

  public :: locked_trains, raise_lock, raise_loop_conflict

  integer, parameter :: ratio_digits = 12   ! enough to tell two ratios apart, without digits that are rounding

contains

  !> Raises the error for a row of two bodies that closes a loop with another ratio.
  subroutine raise_loop_conflict(constraints, body_names, trains, row, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    type(rigid_trains_t), intent(in) :: trains
    integer, intent(in) :: row
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: bodies(:), rows(:), bodies_of_tree(:), bodies_of_row(:), tree_rows(:), other_rows(:)
    integer :: first_body, last, t

    associate (first => constraints%first(row))
      call trains%find_path(constraints%body(first), constraints%body(first + 1), bodies, rows)
    end associate
    last = size(bodies)
    first_body = minloc(bodies, dim=1)
    if (first_body < last) then
      bodies_of_tree = bodies(first_body:)
      tree_rows = rows(first_body:)
      bodies_of_row = [bodies(first_body:1:-1), bodies(last)]
      other_rows = [rows(first_body - 1:1:-1), row]
    else
      bodies_of_tree = bodies(last:1:-1)
      tree_rows = rows(last - 1:1:-1)
      bodies_of_row = [bodies(last), bodies(1)]
      other_rows = [row]
    end if
    call raise(error, exit_input, 'locks ' // &
               joined(selected(body_names, bodies_of(trains, [(t == trains%train(bodies(1)), t=1, size(trains%root))])), &
                      ', ', most_names) // ': ' // &
               joined(selected(constraints%names, tree_rows), ', ', most_names) // ' and ' // &
               joined(selected(constraints%names, other_rows), ', ', most_names) // ' drive ' // &
               quoted(body_names(bodies_of_tree(size(bodies_of_tree)))%text) // ' at ' // &
               rounded_text(ratio_along(constraints, bodies_of_tree, tree_rows), ratio_digits) // ' and ' // &
               rounded_text(ratio_along(constraints, bodies_of_row, other_rows), ratio_digits) // ' times ' // &
               quoted(body_names(bodies_of_tree(1))%text))
  end subroutine raise_loop_conflict

  !> omega(last body) / omega(first body) along rows of two bodies.
  pure real(wp) function ratio_along(constraints, bodies, rows) result(ratio)
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: bodies(:)
    integer, intent(in) :: rows(:)   !! rows(i) is between bodies(i) and bodies(i + 1)
    integer :: i
    real(wp) :: own, other

    ratio = 1.0_wp
    do i = 1, size(rows)
      call constraints%pair_coefficients(1, rows(i), bodies(i), own, other)
      ratio = -ratio * own / other
    end do
  end function ratio_along

  !> The bodies of some trains.
  pure function bodies_of(trains, is_locked) result(bodies)
    type(rigid_trains_t), intent(in) :: trains
    logical, intent(in) :: is_locked(:)   !! [trains]
    integer, allocatable :: bodies(:)
    integer :: b

    bodies = pack([(b, b=1, size(trains%train))], is_locked(trains%train))
  end function bodies_of

  !> Trains that the relations lock: trains of the core whose row of the complement is zero, and trains whose relation has only
  !> locked trains or speeds that cancel.
  function locked_trains(relations, elimination) result(is_locked)
    type(train_relations_t), intent(in) :: relations
    type(elimination_t), intent(in) :: elimination
    logical :: is_locked(relations%equations%bodies)
    type(train_motion_t) :: found
    real(wp) :: bound(size(elimination%free)), speed(size(elimination%free)), log_determinant
    real(wp), allocatable :: dual(:, :), motion(:, :), rows(:, :)
    integer, allocatable :: trains(:)
    integer :: entry, i, local(relations%equations%bodies), pivots(size(elimination%core_trains)), rank
    logical :: is_singular

    is_locked = .false.
    allocate (trains, source=[elimination%core_trains, distinct_trains(relations%equations, elimination%relation)])
    local(trains) = [(i, i=1, size(trains))]
    local(elimination%free) = [(size(trains) + i, i=1, size(elimination%free))]
    call find_motion(relations, elimination, local, size(trains) + size(elimination%free), 1, found)
    if (size(elimination%core) > 0) then   ! by the complement with effective speeds
      allocate (rows, source=scaled_rows(relations%equations, elimination%core, elimination%core_trains))
      call pivoted_rank(rows, ratio_tolerance, rank, pivots)
      call natural_complement(rows, pivots(rank + 1:), motion, dual, log_determinant, is_singular)
      if (is_singular) error stop 'nocdyn_constraint_conflicts: relations must be independent here'
      is_locked(elimination%core_trains) = .true.
      if (size(motion, 2) > 0) is_locked(elimination%core_trains) = maxval(abs(motion), dim=2) <= ratio_tolerance
    end if
    associate (equations => relations%equations)
      do i = size(elimination%relation), 1, -1
        bound = 0.0_wp
        speed = 0.0_wp
        do entry = equations%first(elimination%relation(i)), equations%first(elimination%relation(i) + 1) - 1
          associate (train => equations%body(entry))
            if (train == elimination%train(i) .or. is_locked(train)) cycle
            speed = speed + equations%coefficient(1, entry) * found%motion(local(train), :)
            bound = bound + abs(equations%coefficient(1, entry) * found%motion(local(train), :))
          end associate
        end do
        is_locked(elimination%train(i)) = all(abs(speed) <= ratio_tolerance * bound)
      end do
    end associate
  end function locked_trains

  !> Raises the error for the first relation, in the order of the input, with which the group is locked.
  subroutine raise_lock(constraints, body_names, trains, relations, members, offending_row, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    type(rigid_trains_t), intent(in) :: trains
    type(train_relations_t), intent(in) :: relations
    integer, intent(in) :: members(:)       !! independent relations of the group
    integer, intent(out) :: offending_row   !! constraint row
    type(error_t), allocatable, intent(out) :: error
    type(elimination_t) :: elimination
    type(train_motion_t) :: found
    logical :: is_member(size(relations%row)), is_locked(size(trains%root))
    real(wp) :: lambda(size(relations%row)), moment(size(trains%root))
    integer, allocatable :: ascending(:), rows(:)
    character(len=:), allocatable :: reason
    integer :: free, i, local(size(trains%root)), lock, middle, train

    is_member = .false.
    is_member(members) = .true.
    ascending = pack([(i, i=1, size(is_member))], is_member)
    free = 0
    lock = size(ascending)
    do while (lock - free > 1)
      middle = (free + lock) / 2
      if (any(locked_trains(relations, partial_elimination(relations, ascending(:middle))))) then
        lock = middle
      else
        free = middle
      end if
    end do
    offending_row = relations%row(ascending(lock))
    elimination = partial_elimination(relations, ascending(:lock))
    is_locked = locked_trains(relations, elimination)
    train = findloc(is_locked, .true., dim=1)
    local = [(i, i=1, size(local))]
    call find_motion(relations, elimination, local, size(local), 1, found)
    moment = 0.0_wp
    moment(train) = 1.0_wp
    lambda = 0.0_wp
    call find_loads(relations, elimination, found%dual, 1, moment, lambda)
    rows = relations%loaded_rows(constraints, trains, lambda, trains%root(train))   ! the rows that lock it together
    rows = pack(rows, rows /= offending_row)
    reason = ', as no other body in it turns'
    if (size(rows) > 0) reason = ': together with ' // joined(selected(constraints%names, rows), ', ', most_names) // &
                                 ' it leaves no speed but 0'
    call raise(error, exit_input, 'locks ' // joined(selected(body_names, bodies_of(trains, is_locked)), ', ', most_names) // &
               reason)
  end subroutine raise_lock

  !> The elimination of some relations only.
  function partial_elimination(relations, chosen) result(elimination)
    type(train_relations_t), intent(in) :: relations
    integer, intent(in) :: chosen(:)
    type(elimination_t) :: elimination
    type(leaf_elimination_t) :: leaves
    logical :: takes_part(size(relations%row))

    takes_part = .false.
    takes_part(chosen) = .true.
    leaves = relations%eliminate_leaves(takes_part, spread(.false., 1, relations%equations%bodies))
    elimination = pivoted_elimination(relations, distinct_trains(relations%equations, chosen), leaves%relation, &
                                      leaves%train, leaves%core)
  end function partial_elimination

end module nocdyn_constraint_conflicts
