!> Motion of the rigid trains of one group, and multipliers of the relations between them: eqs. (73)-(82) for trains.
!>
!> L_lambda^ext of the trains is block triangular: relations with a leaf give one train each, by a division; the core is
!> inverted by LAPACK. Speeds are computed from the core outwards, multipliers by the transposed equations towards the core.
module nocdyn_train_motion
  use nocdyn_complement, only: natural_complement
  use nocdyn_kinds, only: wp
  use nocdyn_train_relations, only: train_relations_t
  implicit none (type, external)
  private

  public :: find_motion, find_loads

  !> The order in which the relations of a group are solved. Redundant relations are not in it.
  type, public :: elimination_t
    integer, allocatable :: free(:)          !! trains whose roots are the coordinates, in their order
    integer, allocatable :: relation(:)      !! relations that give one train each, which is in no later one
    integer, allocatable :: train(:)         !! the train that each gives
    integer, allocatable :: core(:)          !! relations that are solved together
    integer, allocatable :: core_trains(:)   !! all trains in the core
  end type elimination_t

  !> The motion of the trains of a group in one lane.
  type, public :: train_motion_t
    real(wp), allocatable :: motion(:, :)   !! L_tau of the roots, [trains of the group, free]
    real(wp), allocatable :: dual(:, :)     !! D of the core, [core_trains, core]
    real(wp) :: log_determinant = 0.0_wp    !! logarithm of |det L_lambda^ext| of the trains
  end type train_motion_t

contains

  !> L_tau of the trains, eq. (81).
  subroutine find_motion(relations, elimination, local, trains, lane, found)
    type(train_relations_t), intent(in) :: relations
    type(elimination_t), intent(in) :: elimination
    integer, intent(in) :: local(:)   !! number of every train within its group
    integer, intent(in) :: trains     !! number of trains in this group
    integer, intent(in) :: lane
    type(train_motion_t), intent(out) :: found
    real(wp), allocatable :: complement(:, :)
    integer :: column(size(elimination%free)), entry, i, k   ! column of each free train in the core, 0 for none
    real(wp) :: own
    logical :: is_singular

    allocate (found%motion(trains, size(elimination%free)), source=0.0_wp)
    do k = 1, size(elimination%free)
      found%motion(local(elimination%free(k)), k) = 1.0_wp
    end do
    if (size(elimination%core) == 0) then
      allocate (found%dual(0, 0))
    else
      column = [(findloc(elimination%core_trains, elimination%free(k), dim=1), k=1, size(column))]
      call natural_complement(relations%equations%block(lane, elimination%core, elimination%core_trains), &
                              pack(column, column > 0), complement, found%dual, found%log_determinant, is_singular)
      if (is_singular) error stop 'nocdyn_train_motion: the constraints must have been analysed'
      found%motion(local(elimination%core_trains), pack([(k, k=1, size(column))], column > 0)) = complement
    end if
    do i = size(elimination%relation), 1, -1
      associate (relation => elimination%relation(i), train => elimination%train(i), equations => relations%equations)
        own = relations%coefficient_of(lane, relation, train)
        found%log_determinant = found%log_determinant + log(abs(own))
        do entry = equations%first(relation), equations%first(relation + 1) - 1
          if (equations%body(entry) == train) cycle
          associate (other => local(equations%body(entry)))
            found%motion(local(train), :) = found%motion(local(train), :) &
                                            - equations%coefficient(lane, entry) / own * found%motion(other, :)
          end associate
        end do
      end associate
    end do
  end subroutine find_motion

  !> Multipliers of the relations that balance moments on the trains. Moments on the free trains remain.
  pure subroutine find_loads(relations, elimination, dual, lane, moment, lambda)
    type(train_relations_t), intent(in) :: relations
    type(elimination_t), intent(in) :: elimination
    real(wp), intent(in) :: dual(:, :)   !! D of the core, [core_trains, core]
    integer, intent(in) :: lane
    real(wp), intent(inout) :: moment(:)   !! [N m], [trains]; on return without the moments of the eliminated relations
    real(wp), intent(inout) :: lambda(:)   !! [relations]; set for the relations of the elimination
    integer :: entry, i, k

    associate (equations => relations%equations)
      do i = 1, size(elimination%relation)
        associate (relation => elimination%relation(i))
          lambda(relation) = moment(elimination%train(i)) / relations%coefficient_of(lane, relation, elimination%train(i))
          do entry = equations%first(relation), equations%first(relation + 1) - 1
            moment(equations%body(entry)) = moment(equations%body(entry)) - equations%coefficient(lane, entry) * lambda(relation)
          end do
        end associate
      end do
    end associate
    do i = 1, size(elimination%core)
      lambda(elimination%core(i)) = 0.0_wp
      do k = 1, size(elimination%core_trains)
        lambda(elimination%core(i)) = lambda(elimination%core(i)) + dual(k, i) * moment(elimination%core_trains(k))
      end do
    end do
  end subroutine find_loads

end module nocdyn_train_motion
