!> The independent coordinates of a machine: L_tau and the operators derived from it, sparse, on a block of lanes.
!>
!> The speed of a body depends on the coordinates of its own group only: omega(b) is the sum of
!> ratio * q'(coordinate) over the entries first(b) to first(b + 1) - 1. With the same entries,
!> q'' = (L_tau^T J L_tau)^-1 L_tau^T T is the sum of response * T(b).
module nocdyn_coordinates
  use nocdyn_complement, only: complement_factor
  use nocdyn_constraints, only: constraints_t
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_geared_groups, only: geared_group_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_lapack, only: solve_positive_definite
  use nocdyn_reaction_solver, only: new_reaction_solver, reaction_solver_t
  use nocdyn_rigid_trains, only: most_names, rigid_trains_t
  use nocdyn_text, only: joined, selected, string_t
  use nocdyn_train_motion, only: find_motion, train_motion_t
  use nocdyn_train_relations, only: new_relations, train_relations_t
  implicit none (type, external)
  private

  public :: build_coordinates

  !> The coordinates of all groups, with L_tau and the responses by body.
  type, public :: coordinates_t
    integer :: freedoms = 0                             !! number of coordinates
    integer, allocatable :: body(:)                     !! independent body of each coordinate, [freedoms]
    integer, allocatable :: first(:)                    !! first entry of each body, [bodies + 1]
    integer, allocatable :: coordinate(:)               !! [entries]
    real(wp), allocatable :: ratio(:, :)                !! nonzero blocks of L_tau, [lanes, entries]
    real(wp), allocatable :: response(:, :)             !! these blocks of ((L_tau^T J L_tau)^-1 L_tau^T)^T, [lanes, entries]
    type(reaction_solver_t) :: reactions                !! gives the reactions from J omega' - T
    integer, allocatable, private :: geared(:)          !! bodies in groups with rows, ascending
    real(wp), allocatable, private :: inertia(:, :)     !! J [kg m2], [lanes, bodies]
    real(wp), allocatable, private :: imbalance(:)      !! J omega' - T [N m], [bodies], work space
    real(wp), allocatable, private :: acceleration(:)   !! q'' [rad/s2], [freedoms], work space
  contains
    procedure :: update_inertia
    procedure :: complement
    procedure :: body_speeds
    procedure :: mobility
    procedure :: project
    procedure :: reactions_of_torques
    procedure :: pass_parameters
  end type coordinates_t

contains

  !> Builds the operators, group by group; a body has an entry for each coordinate of its group. It is an error if rounding makes
  !> a mass matrix indefinite.
  subroutine build_coordinates(constraints, body_names, trains, groups, inertia, wanted, choice, self, error)
    type(constraints_t), intent(in) :: constraints
    type(string_t), intent(in) :: body_names(:)
    type(rigid_trains_t), intent(in) :: trains
    type(geared_group_t), intent(in) :: groups(:)   !! after `analyse_constraints`
    real(wp), intent(in) :: inertia(:, :)           !! J [kg m2], [lanes, bodies]
    integer, intent(in) :: wanted(:)                !! bodies in the order of the coordinates; empty: ascending
    integer, intent(in) :: choice                   !! complement_...
    type(coordinates_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(train_relations_t) :: relations
    integer, dimension(size(inertia, 2)) :: coordinate_of, group_of   ! of each body; coordinate 0: it is dependent
    integer :: b, g, k, lane, offending_group
    logical :: is_geared(size(inertia, 2))

    coordinate_of = 0
    do g = 1, size(groups)
      coordinate_of(groups(g)%independent) = 1
      group_of(groups(g)%bodies) = g
    end do
    if (size(wanted) > 0) then
      self%body = wanted
    else
      self%body = pack([(b, b=1, size(coordinate_of))], coordinate_of == 1)
    end if
    self%freedoms = size(self%body)
    coordinate_of(self%body) = [(k, k=1, self%freedoms)]
    allocate (self%first(size(group_of) + 1))
    allocate (self%coordinate(sum([(size(groups(group_of(b))%independent), b=1, size(group_of))])))
    self%first(1) = 1
    do b = 1, size(group_of)
      associate (independent => groups(group_of(b))%independent, first => self%first(b))
        self%first(b + 1) = first + size(independent)
        self%coordinate(first:first + size(independent) - 1) = coordinate_of(independent)
      end associate
    end do
    allocate (self%ratio(size(inertia, 1), size(self%coordinate)), source=0.0_wp)
    allocate (self%response, source=self%ratio)
    relations = new_relations(constraints, trains)
    self%reactions = new_reaction_solver(constraints, trains, relations, groups)
    allocate (self%inertia, source=inertia)
    do lane = 1, size(inertia, 1)
      call fill_lane(constraints, trains, relations, groups, choice, lane, self, offending_group)
      if (offending_group > 0) then
        call raise(error, exit_input, joined(selected(body_names, groups(offending_group)%independent), ', ', most_names) // &
                   ' cannot be independent: rounding hides what differs between their speeds; name faster bodies')
        return
      end if
    end do
    call self%reactions%find_null_vectors(constraints, groups)
    is_geared = .false.
    is_geared(constraints%body) = .true.
    self%geared = pack([(b, b=1, size(is_geared))], is_geared)
    allocate (self%imbalance(size(inertia, 2)), self%acceleration(self%freedoms))
  end subroutine build_coordinates

  !> Computes L_tau, the responses and the values of the reaction solver in one lane.
  subroutine fill_lane(constraints, trains, relations, groups, choice, lane, self, offending_group)
    type(constraints_t), intent(in) :: constraints
    type(rigid_trains_t), intent(in) :: trains
    type(train_relations_t), intent(in) :: relations
    type(geared_group_t), intent(in) :: groups(:)
    integer, intent(in) :: choice   !! complement_...
    integer, intent(in) :: lane
    type(coordinates_t), intent(inout) :: self
    integer, intent(out) :: offending_group   !! group whose mass matrix is not positive definite, 0 if there is none
    type(train_motion_t) :: found
    real(wp) :: factor, log_determinant, other, own
    real(wp), dimension(size(self%inertia, 2)) :: inertia, ratio
    integer :: g, k, local(size(trains%root))   ! number of every train in its group
    logical :: is_indefinite

    offending_group = 0
    inertia = self%inertia(lane, :)
    ratio = trains%ratios(constraints, lane)
    self%reactions%ratio(lane, :) = ratio
    do g = 1, size(groups)
      local(groups(g)%trains) = [(k, k=1, size(groups(g)%trains))]
      call find_motion(relations, groups(g)%elimination, local, size(groups(g)%trains), lane, found)
      log_determinant = 0.0_wp   ! of L_lambda^ext, the part of the tree rows; each gives its body by a division
      do k = 1, size(groups(g)%bodies)
        associate (b => groups(g)%bodies(k))
          if (trains%parent(b) == 0) cycle
          call constraints%pair_coefficients(lane, trains%parent_row(b), b, own, other)
          log_determinant = log_determinant + log(abs(own))
        end associate
      end do
      factor = complement_factor(choice, found%log_determinant + log_determinant, size(groups(g)%kept))
      do k = 1, size(groups(g)%bodies)
        associate (b => groups(g)%bodies(k))
          self%ratio(lane, self%first(b):self%first(b + 1) - 1) = ratio(b) * (factor * found%motion(local(trains%train(b)), :))
        end associate
      end do
      call self%update_inertia(trains, groups(g), inertia, lane, is_indefinite)
      if (is_indefinite) then
        offending_group = g
        return
      end if
      associate (index => self%reactions%group_index(g))
        if (index > 0) self%reactions%groups(index)%dual(:, :, lane) = found%dual
      end associate
    end do
  end subroutine fill_lane

  !> Computes the responses of a group from its ratios and new inertias, by its mass matrix L_tau^T J L_tau.
  subroutine update_inertia(self, trains, group, inertia, lane, is_indefinite)
    class(coordinates_t), intent(inout) :: self
    type(rigid_trains_t), intent(in) :: trains
    type(geared_group_t), intent(in) :: group
    real(wp), intent(in) :: inertia(:)   !! of all bodies [kg m2]
    integer, intent(in) :: lane
    logical, intent(out) :: is_indefinite   !! whether the mass matrix is not positive definite; nothing is set then
    real(wp), allocatable :: response(:, :)
    real(wp), dimension(size(group%trains), size(group%independent)) :: momentum, motion
    real(wp) :: mass(size(group%trains))
    integer :: i, k, local(size(trains%root))

    mass = 0.0_wp
    do i = 1, size(group%trains)
      local(group%trains(i)) = i
      k = self%first(trains%root(group%trains(i)))
      motion(i, :) = self%ratio(lane, k:k + size(motion, 2) - 1)   ! a root has the motion of its train
    end do
    do i = 1, size(group%bodies)
      associate (b => group%bodies(i))
        associate (of_train => mass(local(trains%train(b))))
          of_train = of_train + inertia(b) * self%reactions%ratio(lane, b)**2
        end associate
      end associate
    end do
    do k = 1, size(motion, 2)
      momentum(:, k) = mass * motion(:, k)
    end do
    call solve_positive_definite(matmul(transpose(motion), momentum), transpose(motion), response, is_indefinite)
    if (is_indefinite) return
    do i = 1, size(group%bodies)
      associate (b => group%bodies(i))
        k = self%first(b)
        self%response(lane, k:k + size(motion, 2) - 1) = self%reactions%ratio(lane, b) * response(:, local(trains%train(b)))
        self%inertia(lane, b) = inertia(b)
      end associate
    end do
  end subroutine update_inertia

  !> L_tau as a dense matrix, [bodies, freedoms], for the matrices of the paper and for tests.
  pure function complement(self, lane) result(dense)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp) :: dense(size(self%first) - 1, self%freedoms)
    integer :: b, k

    dense = 0.0_wp
    do b = 1, size(dense, 1)
      do k = self%first(b), self%first(b + 1) - 1
        dense(b, self%coordinate(k)) = self%ratio(lane, k)
      end do
    end do
  end function complement

  !> L_tau q': the speeds of the bodies [rad/s], [bodies].
  pure function body_speeds(self, lane, speed) result(omega)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: speed(:)   !! q' [rad/s], [freedoms]
    real(wp) :: omega(size(self%first) - 1)
    integer :: b, k

    omega = 0.0_wp
    do b = 1, size(omega)
      do k = self%first(b), self%first(b + 1) - 1
        omega(b) = omega(b) + self%ratio(lane, k) * speed(self%coordinate(k))
      end do
    end do
  end function body_speeds

  !> L_tau (L_tau^T J L_tau)^-1 L_tau^T: the matrix from torques T to accelerations omega' [1/(kg m2)], [bodies, bodies].
  pure function mobility(self, lane) result(matrix)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp) :: matrix(size(self%first) - 1, size(self%first) - 1)
    real(wp) :: complement(size(self%first) - 1, self%freedoms), response(self%freedoms)
    integer :: b

    complement = self%complement(lane)
    do b = 1, size(matrix, 2)
      response = 0.0_wp
      response(self%coordinate(self%first(b):self%first(b + 1) - 1)) = self%response(lane, self%first(b):self%first(b + 1) - 1)
      matrix(:, b) = matmul(complement, response)
    end do
  end function mobility

  !> Projects body speeds on the coordinates, weighted by the inertias; exact if the speeds obey the constraints.
  pure subroutine project(self, lane, inertia, omega, speed)
    class(coordinates_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: inertia(:), omega(:)   !! J [kg m2], speeds [rad/s], [bodies]
    real(wp), intent(out) :: speed(:)              !! q' [rad/s], [freedoms]
    integer :: b, k

    speed = 0.0_wp
    do b = 1, size(omega)
      do k = self%first(b), self%first(b + 1) - 1
        speed(self%coordinate(k)) = speed(self%coordinate(k)) + self%response(lane, k) * inertia(b) * omega(b)
      end do
    end do
  end subroutine project

  !> Reactions of all rows when the elements exert these torques and the bodies accelerate accordingly.
  pure subroutine reactions_of_torques(self, lane, torque, lambda)
    class(coordinates_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: torque(:)      !! T [N m], [bodies]
    real(wp), intent(inout) :: lambda(:)   !! [rows]
    integer :: b, i, k
    real(wp) :: acceleration

    self%acceleration(:) = 0.0_wp
    do i = 1, size(self%geared)
      b = self%geared(i)
      do k = self%first(b), self%first(b + 1) - 1
        self%acceleration(self%coordinate(k)) = self%acceleration(self%coordinate(k)) + self%response(lane, k) * torque(b)
      end do
    end do
    do i = 1, size(self%geared)
      b = self%geared(i)
      acceleration = 0.0_wp
      do k = self%first(b), self%first(b + 1) - 1
        acceleration = acceleration + self%ratio(lane, k) * self%acceleration(self%coordinate(k))
      end do
      self%imbalance(b) = self%inertia(lane, b) * acceleration - torque(b)
    end do
    call self%reactions%find_reactions(lane, self%imbalance, lambda)
  end subroutine reactions_of_torques

  !> Passes the arrays whose values may differ from variant to variant.
  subroutine pass_parameters(self, parameters)
    class(coordinates_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%body, self%first, self%coordinate, self%geared)
    call parameters%add('coordinates: ratio', self%ratio)
    call parameters%add('coordinates: response', self%response)
    call parameters%add('coordinates: inertia', self%inertia)
    call self%reactions%pass_parameters(parameters)
  end subroutine pass_parameters

end module nocdyn_coordinates
