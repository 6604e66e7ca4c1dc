!> Motions without kinetic energy, by which the reduced mass matrix L_tau^T J L_tau is not positive definite.
!>
!> A body may have no inertia of its own where those that it is geared to have one. It may not where a group of geared bodies
!> can move while all of its bodies with inertia stand still.
module nocdyn_massless_motion
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pivoted_rank
  use nocdyn_machine, only: machine_t
  use nocdyn_rigid_trains, only: ratio_tolerance
  use nocdyn_train_motion, only: find_motion, train_motion_t
  use nocdyn_train_relations, only: new_relations, train_relations_t, unit_rows
  implicit none (type, external)
  private

  public :: massless_bodies

contains

  !> The bodies that move without kinetic energy in the first group where some do; none if there is no such motion.
  function massless_bodies(machine) result(bodies)
    type(machine_t), intent(in) :: machine   !! its constraints are analysed; lane 1 is examined
    integer, allocatable :: bodies(:)
    type(train_motion_t) :: found
    type(train_relations_t) :: relations
    logical, allocatable :: has_mass(:), is_massless(:)   ! [trains of the group]
    integer :: local(size(machine%trains%root))   ! of every train in its group
    integer :: g, k, rank

    allocate (bodies(0))
    if (all(machine%inertia(1, :) > 0)) return
    relations = new_relations(machine%constraints, machine%trains)
    do g = 1, size(machine%groups)
      associate (group => machine%groups(g))
        local(group%trains) = [(k, k=1, size(group%trains))]
        has_mass = spread(.false., 1, size(group%trains))
        has_mass(local(machine%trains%train(pack(group%bodies, machine%inertia(1, group%bodies) > 0)))) = .true.
        if (all(has_mass)) cycle
        call find_motion(relations, group%elimination, local, size(group%trains), 1, found)
        rank = rank_of(found%motion, has_mass)
        if (rank == size(found%motion, 2)) cycle
        is_massless = spread(.false., 1, size(has_mass))   ! whether a train moves where all with mass stand still
        do k = 1, size(has_mass)
          if (has_mass(k)) cycle
          has_mass(k) = .true.
          is_massless(k) = rank_of(found%motion, has_mass) > rank
          has_mass(k) = .false.
        end do
        if (.not. any(is_massless)) cycle
        bodies = pack(group%bodies, is_massless(local(machine%trains%train(group%bodies))))
        return
      end associate
    end do
  end function massless_bodies

  !> Rank of the selected rows, each scaled to the length 1.
  integer function rank_of(motion, selected)
    real(wp), intent(in) :: motion(:, :)
    logical, intent(in) :: selected(:)   !! [rows]
    integer :: pivots(count(selected)), i

    call pivoted_rank(transpose(unit_rows(motion(pack([(i, i=1, size(selected))], selected), :))), ratio_tolerance, rank_of, &
                      pivots)
  end function rank_of

end module nocdyn_massless_motion
