!> Holzer's table of a mode: inertia torques J omega^2 theta are added up along the train, and each sum divided by the stiffness
!> of the next shaft gives the next amplitude.
!>
!> H. Holzer, Die Berechnung der Drehschwingungen, 1921. The train is a tree of couplings and gears. From the ends towards one
!> body, the last one of the table, the torque of everything behind passes through a coupling unchanged, and through a gear or a
!> locked joint with the inverse ratio of the angles. What is left at the last body vanishes for a natural frequency, unless a
!> locked joint holds it: then its angle does, and the sum is the moment of the joint.
module nocdyn_holzer
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: quoted
  use nocdyn_union_find, only: find_root, join_components
  implicit none (type, external)
  private

  public :: new_holzer

  integer, parameter, public :: edge_none = 0, edge_coupling = 1, edge_gear = 2, edge_joint = 3

  !> A line of the table: a body and what joins it to the next one towards the end of the table.
  type, public :: holzer_line_t
    integer :: body = 0
    integer :: next = 0                 !! body, 0 at the end of a train and for the ground
    integer :: edge = edge_none         !! what joins it to `next`
    integer :: number = 0               !! of the element or of the constraint row
    real(wp) :: stiffness = 0.0_wp      !! of a coupling [N m/rad]
    real(wp) :: to_ground = 0.0_wp      !! stiffness of couplings between the body and the ground [N m/rad]
    real(wp) :: ratio = 1.0_wp          !! angle of `next` by the one of the body, of a gear or joint
  contains
    procedure :: name => edge_name
  end type holzer_line_t

  !> Shaft lines in leaf-to-root order.
  type, public :: holzer_t
    type(holzer_line_t), allocatable :: lines(:)
  contains
    procedure :: fill
  end type holzer_t

contains

  !> Lays out the table of a machine. A machine that is no tree is refused with the name of what closes a loop.
  subroutine new_holzer(machine, linear, self, error)
    type(machine_t), intent(in) :: machine
    type(linearisation_t), intent(in) :: linear
    type(holzer_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(holzer_line_t) :: edges(machine%elements%count + machine%constraints%rows())
    real(wp) :: to_ground(machine%bodies)
    integer :: n

    n = 0
    to_ground = 0.0_wp
    call list_couplings(machine, linear, edges, n, to_ground, error)
    if (.not. allocated(error)) call list_joints(machine, linear%held, edges, n, error)
    if (.not. allocated(error)) call list_gears(machine, edges, n, error)
    if (.not. allocated(error)) call refuse_loops(machine, edges(:n), error)
    if (.not. allocated(error)) call order_lines(machine%bodies, edges(:n), to_ground, self)
  end subroutine new_holzer

  !> Couplings with a stiffness, between two bodies or to the ground.
  subroutine list_couplings(machine, linear, edges, n, to_ground, error)
    type(machine_t), intent(in) :: machine
    type(linearisation_t), intent(in) :: linear
    type(holzer_line_t), intent(inout) :: edges(:)
    integer, intent(inout) :: n
    real(wp), intent(inout) :: to_ground(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: e, i
    integer, allocatable :: elastic(:)

    allocate (elastic, source=machine%elastic())
    do i = 1, size(elastic)
      e = elastic(i)
      associate (rows => machine%elements%rows, first => machine%elements%rows%first(e), k => linear%stiffness(elastic(i)))
        if (.not. abs(k) > 0) cycle
        associate (body => rows%body(first:rows%first(e + 1) - 1), c => rows%coefficient(first:rows%first(e + 1) - 1))
          if (size(body) /= 2 .or. any(abs(abs(c) - 1.0_wp) > 0) .or. abs(sum(c)) > 0) then
            call raise(error, exit_input, 'there is no table of Holzer: ' // quoted(machine%element_name(e)) // &
                       ' acts by radii, not between two angles; needed: &gear and &coupling')
            return
          end if
          if (minval(body) == 0) then
            to_ground(maxval(body)) = to_ground(maxval(body)) + k
          else
            n = n + 1
            edges(n) = holzer_line_t(body(1), body(2), edge_coupling, e, stiffness=k)
          end if
        end associate
      end associate
    end do
  end subroutine list_couplings

  !> Joints that hold, between two bodies or to the ground.
  subroutine list_joints(machine, held, edges, n, error)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: held(:)   !! elements
    type(holzer_line_t), intent(inout) :: edges(:)
    integer, intent(inout) :: n
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: turning(:)   ! without the ground
    integer :: i, k

    do i = 1, size(held)
      associate (rows => machine%elements%rows, first => machine%elements%rows%first(held(i)))
        associate (body => rows%body(first:rows%first(held(i) + 1) - 1), c => rows%coefficient(first:rows%first(held(i) + 1) - 1))
          turning = pack([(k, k=1, size(body))], body > 0)
          if (size(turning) > 2) then
            call raise(error, exit_input, 'there is no table of Holzer: ' // quoted(machine%element_name(held(i))) // &
                       ' does not join two bodies')
            return
          end if
          n = n + 1
          edges(n) = holzer_line_t(body(turning(1)), 0, edge_joint, held(i))
          if (size(turning) == 1) cycle
          edges(n)%next = body(turning(2))
          edges(n)%ratio = -c(turning(1)) / c(turning(2))
        end associate
      end associate
    end do
  end subroutine list_joints

  !> Gears between two bodies.
  subroutine list_gears(machine, edges, n, error)
    type(machine_t), intent(in) :: machine
    type(holzer_line_t), intent(inout) :: edges(:)
    integer, intent(inout) :: n
    type(error_t), allocatable, intent(out) :: error
    integer :: r

    associate (rows => machine%constraints)
      do r = 1, rows%rows()
        associate (first => rows%first(r))
          if (rows%first(r + 1) - first /= 2) then
            call raise(error, exit_input, 'there is no table of Holzer: ' // quoted(rows%names(r)%text) // &
                       ' does not join two bodies')
            return
          end if
          n = n + 1
          edges(n) = holzer_line_t(rows%body(first), rows%body(first + 1), edge_gear, r, &
                                   ratio=-rows%coefficient(1, first) / rows%coefficient(1, first + 1))
        end associate
      end do
    end associate
  end subroutine list_gears

  !> Refuses what joins bodies, or a body and the ground, that others join already.
  subroutine refuse_loops(machine, edges, error)
    type(machine_t), intent(in) :: machine
    type(holzer_line_t), intent(in) :: edges(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: component(machine%bodies + 1), i, next, one, other   ! the last one is the ground

    component = [(i, i=1, size(component))]
    do i = 1, size(edges)
      next = merge(edges(i)%next, size(component), edges(i)%next > 0)
      call find_root(component, edges(i)%body, one)
      call find_root(component, next, other)
      if (one == other) then
        call raise(error, exit_input, 'there is no table of Holzer: ' // quoted(edges(i)%name(machine)) // ' closes a loop')
        return
      end if
      call join_components(edges(i)%body, next, component)
    end do
  end subroutine refuse_loops

  !> The name of the coupling, gear or joint of a line.
  function edge_name(self, machine) result(name)
    class(holzer_line_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: name

    if (self%edge == edge_gear) then
      name = machine%constraints%names(self%number)%text
    else
      name = machine%element_name(self%number)
    end if
  end function edge_name

  !> Turns the edges towards the last body of each train and orders the bodies. It is the one that a joint holds; if there is
  !> none, the end farthest from the first one in the input.
  subroutine order_lines(bodies, edges, to_ground, self)
    integer, intent(in) :: bodies
    type(holzer_line_t), intent(in) :: edges(:)
    real(wp), intent(in) :: to_ground(:)
    type(holzer_t), intent(inout) :: self
    type(holzer_line_t) :: line_of(bodies)
    integer :: b, held(bodies), i, n, order(bodies), root
    logical :: is_known(bodies)

    allocate (self%lines(0))
    held = 0   ! edge to the ground
    do i = 1, size(edges)
      if (edges(i)%next == 0) held(edges(i)%body) = i
    end do
    is_known = .false.
    do b = 1, bodies
      if (is_known(b)) cycle
      call walk(edges, b, is_known, line_of, order, n)          ! to find the end farthest from the first body
      is_known(order(:n)) = .false.
      root = order(n)
      if (any(held(order(:n)) > 0)) root = order(maxloc(held(order(:n)), dim=1))
      call walk(edges, root, is_known, line_of, order, n)
      if (held(root) > 0) line_of(root) = edges(held(root))
      line_of(order(:n))%to_ground = to_ground(order(:n))
      self%lines = [self%lines, line_of(order(n:1:-1))]
    end do
  end subroutine order_lines

  !> All bodies of a train, by their distance from one, and of each the edge towards that one.
  subroutine walk(edges, root, is_known, line_of, order, n)
    type(holzer_line_t), intent(in) :: edges(:)
    integer, intent(in) :: root
    logical, intent(inout) :: is_known(:)
    type(holzer_line_t), intent(inout) :: line_of(:)
    integer, intent(inout) :: order(:)
    integer, intent(out) :: n   !! bodies of the train
    integer :: e, i

    n = 1
    order(1) = root
    is_known(root) = .true.
    line_of(root) = holzer_line_t(root)
    i = 0
    do while (i < n)
      i = i + 1
      do e = 1, size(edges)
        if (edges(e)%next == 0) cycle
        if (edges(e)%body == order(i)) then
          call reach(edges(e)%next, turned=.true.)
        else if (edges(e)%next == order(i)) then
          call reach(edges(e)%body, turned=.false.)
        end if
      end do
    end do

  contains

    subroutine reach(body, turned)
      integer, intent(in) :: body
      logical, intent(in) :: turned   !! whether the edge leads away from the body

      if (is_known(body)) return
      is_known(body) = .true.
      n = n + 1
      order(n) = body
      line_of(body) = edges(e)
      line_of(body)%body = body
      line_of(body)%next = order(i)
      if (turned) line_of(body)%ratio = 1.0_wp / edges(e)%ratio
    end subroutine reach

  end subroutine walk

  !> The numbers of a mode: amplitudes, 1 at the first body of each train that moves; inertia torques; sums behind each body.
  pure subroutine fill(self, machine, shape, omega, theta, torque, total)
    class(holzer_t), intent(in) :: self
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: shape(:)     !! of the mode, in any scale, [bodies]
    real(wp), intent(in) :: omega        !! its natural frequency [rad/s]
    real(wp), intent(out) :: theta(:)    !! [lines]
    real(wp), intent(out) :: torque(:)   !! J omega^2 theta, less the moments of couplings to the ground [N m], [lines]
    real(wp), intent(out) :: total(:)    !! moment in the coupling, gear or joint to the next body [N m], [lines]
    real(wp) :: behind(machine%bodies), scale
    integer :: i

    scale = shape(maxloc(abs(shape), dim=1))
    if (abs(shape(self%lines(1)%body)) > 1.0e-6_wp * abs(scale)) scale = shape(self%lines(1)%body)
    behind = 0.0_wp
    do i = 1, size(self%lines)
      associate (line => self%lines(i))
        theta(i) = shape(line%body) / scale
        torque(i) = (machine%inertia(1, line%body) * omega**2 - line%to_ground) * theta(i)
        total(i) = behind(line%body) + torque(i)
        if (line%next == 0) cycle
        if (line%edge == edge_coupling) behind(line%next) = behind(line%next) + total(i)
        if (line%edge /= edge_coupling) behind(line%next) = behind(line%next) + total(i) / line%ratio
      end associate
    end do
  end subroutine fill

end module nocdyn_holzer
