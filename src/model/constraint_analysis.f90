!> What the constraint rows allow: rank, redundant rows, locked bodies, independent coordinates, group by group.
module nocdyn_constraint_analysis
  use nocdyn_complement, only: natural_complement
  use nocdyn_constraints, only: constraints_t
  use nocdyn_geared_groups, only: find_groups, geared_group_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank, pseudo_inverse
  use nocdyn_text, only: joined, quoted, rounded_text, selected, string_t, to_text
  implicit none (type, external)
  private

  public :: analyse_constraints

  !> Rows of unit length count as dependent below this: decimals such as 0.1 * 3 against 0.3 agree, ratios that
  !> differ in the ninth digit do not.
  real(wp), parameter :: rank_tolerance = 1.0e-10_wp

  integer, parameter :: ratio_digits = 12   ! enough to tell two ratios apart, without the noise of rounding

contains

  !> Finds the groups and analyses each; locked bodies and unusable coordinates are errors.
  subroutine analyse_constraints(constraints, body_names, wanted, groups, culprit, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    integer, intent(in) :: wanted(:)       !! bodies that are to be the coordinates; empty: found by pivoting
    type(geared_group_t), allocatable, intent(out) :: groups(:)
    integer, intent(out) :: culprit        !! row that the error is about, 0 if it is about `wanted`
    type(error_t), allocatable, intent(out) :: error
    integer :: g

    call find_groups(constraints, groups)
    culprit = 0
    do g = 1, size(groups)
      call sift_rows(constraints, groups(g))
      call refuse_locks(constraints, body_names, groups(g), culprit, error)
      if (allocated(error)) return
      call choose_coordinates(constraints, body_names, wanted, groups(g), error)
      if (allocated(error)) return
    end do
  end subroutine analyse_constraints

  !> Keeps, in the order of the input, the rows that are independent of those before them.
  subroutine sift_rows(constraints, group)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(inout) :: group
    integer, allocatable :: redundant(:)
    integer :: pivots(size(group%bodies))
    integer :: i, rank

    call pivoted_rank(paced_rows(constraints, group, group%rows), rank_tolerance, rank, pivots)
    if (rank == size(group%rows)) then
      group%kept = group%rows
      allocate (group%redundancies(0))
      return
    end if
    allocate (group%kept(0), redundant(0))
    do i = 1, size(group%rows)
      associate (row => group%rows(i))
        call pivoted_rank(paced_rows(constraints, group, [group%kept, row]), rank_tolerance, rank, pivots)
        if (rank > size(group%kept)) then
          group%kept = [group%kept, row]
        else
          redundant = [redundant, row]
        end if
      end associate
    end do
    allocate (group%redundancies(size(redundant)))
    do i = 1, size(redundant)
      group%redundancies(i)%row = redundant(i)
      allocate (group%redundancies(i)%repeats, source=combination(constraints, group, redundant(i)))
    end do
  end subroutine sift_rows

  !> L_lambda of the group with every row scaled to unit length, so that metres and teeth compare.
  pure function unit_rows(matrix) result(scaled)
    real(wp), intent(in) :: matrix(:, :)
    real(wp) :: scaled(size(matrix, 1), size(matrix, 2))
    integer :: i

    do i = 1, size(matrix, 1)
      scaled(i, :) = matrix(i, :) / norm2(matrix(i, :))
    end do
  end function unit_rows

  !> The same for speeds measured by the pace of each body, so that a long reduction is not taken for a lock.
  pure function paced_rows(constraints, group, rows) result(matrix)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: rows(:)
    real(wp) :: matrix(size(rows), size(group%bodies))

    matrix = unit_rows(constraints%block(1, rows, group%bodies) * spread(group%pace, 1, size(rows)))
  end function paced_rows

  !> The kept rows before `row` that together say what it says.
  function combination(constraints, group, row) result(rows)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: row
    integer, allocatable :: rows(:)
    real(wp) :: wanted(1, size(group%bodies))

    wanted = paced_rows(constraints, group, [row])
    rows = contributing_rows(constraints, group, pack(group%kept, group%kept < row), wanted(1, :))
  end function combination

  !> The rows with a share in the least-squares representation of the relation `wanted` by `rows`.
  function contributing_rows(constraints, group, rows, wanted) result(contributing)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: rows(:)
    real(wp), intent(in) :: wanted(:)   !! between paced speeds
    integer, allocatable :: contributing(:)
    real(wp) :: inverse(size(rows), size(group%bodies)), share(size(rows))

    inverse = pseudo_inverse(transpose(paced_rows(constraints, group, rows)), rank_tolerance)
    share = matmul(inverse, wanted)
    contributing = pack(rows, abs(share) > sqrt(rank_tolerance) * maxval(abs(share)))
  end function contributing_rows

  !> Error if the kept rows leave a body no motion: the row with which the lock begins is the culprit.
  subroutine refuse_locks(constraints, body_names, group, culprit, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    type(geared_group_t), intent(in) :: group
    integer, intent(inout) :: culprit
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    if (size(locked_bodies(constraints, group, group%kept)) == 0) return
    do k = 1, size(group%kept)
      associate (locked => locked_bodies(constraints, group, group%kept(:k)))
        if (size(locked) == 0) cycle
        culprit = group%kept(k)
        call raise(error, exit_input, 'locks ' // joined(selected(body_names, locked), ', ') // &
                   contradiction(constraints, body_names, group, group%kept(:k - 1), culprit))
        return
      end associate
    end do
  end subroutine refuse_locks

  !> Bodies whose row of the complement of `rows` is zero.
  function locked_bodies(constraints, group, rows) result(locked)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: rows(:)
    integer, allocatable :: locked(:)
    real(wp), allocatable :: motion(:, :)

    allocate (motion, source=allowed_motion(constraints, group, rows))
    locked = pack(group%bodies, maxval(abs(motion), dim=2) <= rank_tolerance)
  end function locked_bodies

  !> The natural complement of `rows` for paced speeds with coordinates found by pivoting, shape [bodies, freedoms].
  function allowed_motion(constraints, group, rows) result(motion)
    type(constraints_t), intent(in) :: constraints
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: rows(:)
    real(wp), allocatable :: motion(:, :)
    real(wp), allocatable :: dual(:, :)
    real(wp) :: matrix(size(rows), size(group%bodies)), log_determinant
    integer :: pivots(size(group%bodies)), rank
    logical :: is_singular

    matrix = paced_rows(constraints, group, rows)
    call pivoted_rank(matrix, rank_tolerance, rank, pivots)
    call natural_complement(matrix, pivots(rank + 1:), motion, dual, log_determinant, is_singular)
    if (is_singular) error stop 'nocdyn_constraint_analysis: rows must be independent here'
  end function allowed_motion

  !> For a row between two bodies whose ratio `earlier` rows fix already: who drives what at which ratio.
  function contradiction(constraints, body_names, group, earlier, row) result(text)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    type(geared_group_t), intent(in) :: group
    integer, intent(in) :: earlier(:), row
    character(len=:), allocatable :: text
    real(wp), allocatable :: motion(:, :)
    real(wp) :: relation(size(group%bodies)), fixed, asked
    integer :: a, b, first

    text = ''
    first = constraints%first(row)
    if (constraints%first(row + 1) - first /= 2) return
    a = findloc(group%bodies, constraints%body(first), dim=1)
    b = findloc(group%bodies, constraints%body(first + 1), dim=1)
    allocate (motion, source=allowed_motion(constraints, group, earlier))
    fixed = dot_product(motion(a, :), motion(b, :)) / dot_product(motion(a, :), motion(a, :))
    if (maxval(abs(motion(b, :) - fixed * motion(a, :))) > rank_tolerance) return
    asked = -constraints%coefficient(1, first) / constraints%coefficient(1, first + 1)
    relation = 0.0_wp
    relation(b) = 1.0_wp
    relation(a) = -fixed
    associate (rows => contributing_rows(constraints, group, earlier, relation))
      text = ': it drives ' // quoted(body_names(group%bodies(b))%text) // ' at ' // rounded_text(asked, ratio_digits) // &
             ' times ' // quoted(body_names(group%bodies(a))%text) // ', but ' // &
             joined(selected(constraints%names, rows), ', ') // ' already ' // &
             trim(merge('drives', 'drive ', size(rows) == 1)) // ' it at ' // &
             rounded_text(fixed * group%pace(b) / group%pace(a), ratio_digits) // ' times'
    end associate
  end function contradiction

  !> The independent bodies of the group: the wanted ones, or those that pivoting leaves over.
  subroutine choose_coordinates(constraints, body_names, wanted, group, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    integer, intent(in) :: wanted(:)
    type(geared_group_t), intent(inout) :: group
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: others(:)
    integer :: pivots(size(group%bodies)), freedoms, i, rank

    freedoms = size(group%bodies) - size(group%kept)
    if (size(wanted) == 0) then
      call pivoted_rank(unit_rows(constraints%block(1, group%kept, group%bodies)), rank_tolerance, rank, pivots)
      group%independent = pack(group%bodies, [(all(pivots(:size(group%kept)) /= i), i=1, size(group%bodies))])
      return
    end if
    group%independent = pack(wanted, [(any(group%bodies == wanted(i)), i=1, size(wanted))])
    if (size(group%independent) /= freedoms) then
      call raise(error, exit_input, count_message(selected(body_names, group%bodies), &
                                           selected(body_names, group%independent), freedoms))
      return
    end if
    others = pack(group%bodies, [(all(group%independent /= group%bodies(i)), i=1, size(group%bodies))])
    rank = 0
    if (size(others) == size(group%kept)) call pivoted_rank(dependent_columns(), rank_tolerance, rank, pivots(:size(others)))
    if (rank < size(group%kept)) call raise(error, exit_input, joined(selected(body_names, group%independent), ', ') // &
                                            ' cannot be independent: the constraints relate their speeds')

  contains

    function dependent_columns() result(matrix)
      real(wp) :: matrix(size(group%kept), size(others))
      real(wp) :: all_columns(size(group%kept), size(group%bodies))
      integer :: k

      all_columns = paced_rows(constraints, group, group%kept)
      matrix = all_columns(:, [(findloc(group%bodies, others(k), dim=1), k=1, size(others))])
    end function dependent_columns

  end subroutine choose_coordinates

  function count_message(bodies, named, freedoms) result(text)
    type(string_t), intent(in) :: bodies(:), named(:)
    integer, intent(in) :: freedoms
    character(len=:), allocatable :: text

    if (size(bodies) == 1) then
      text = 'must name ' // joined(bodies, ', ') // ' once: no gear joins it to another body'
    else
      text = 'must name exactly ' // to_text(freedoms) // ' of the bodies ' // joined(bodies, ', ') // &
             ', which are geared together'
    end if
    if (size(named) == 0) then
      text = text // '; it names none of them'
    else
      text = text // '; it names ' // joined(named, ', ')
    end if
  end function count_message

end module nocdyn_constraint_analysis
