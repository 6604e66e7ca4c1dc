!> Start speeds that are not given, by those of neighbours: couplings, meshes and shafts are not being twisted at the start.
!>
!> Elements without a restoring moment (dampers, clutches, freewheels) do not count. Bodies whose speeds are not known and that
!> gears and elastic elements join to one another are a component. Its equations say that its gears fit and that the rates of
!> twist of its elastic elements are 0, beside bodies whose speeds are known. The speeds that they determine are taken; if they
!> contradict each other, none is.
module nocdyn_neighbour_speeds
  use nocdyn_bank, only: role_coupling
  use nocdyn_element_groups, only: bodies_of, body_index_t
  use nocdyn_element_rows, only: element_rows_t, joined_rows, new_element_rows, rows_between
  use nocdyn_followed_speeds, only: collect, known_t, rounding_of
  use nocdyn_grouping, only: grouped, groups_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, quoted, string_t, to_text
  use nocdyn_union_find, only: find_root, join_components
  use nocdyn_written_values, only: speed_text
  implicit none (type, external)
  private

  public :: new_neighbours

  real(wp), parameter :: tolerance = 1.0e-9_wp   ! relative, of ratios and speeds
  integer, parameter :: digits = 7               ! of speeds in notes
  integer, parameter :: most_names = 6           ! in a note

  !> Rows sum c omega = 0 of gears and of elastic elements.
  type, public :: neighbours_t
    type(element_rows_t), private :: rows
    integer, private :: gears = 0   !! rows of gears; those of elastic elements follow
  contains
    procedure :: take
  end type neighbours_t

  !> What joins the bodies of a component. Arrays over the bodies of the machine serve all components, one after the other.
  type :: component_t
    integer, allocatable :: rows(:)      !! that touch it
    integer, allocatable :: bodies(:)
    integer, allocatable :: beside(:)    !! bodies with known speeds, 0 = ground
    integer :: unknowns = 0
    integer, allocatable :: unknown(:)   !! each body turns in proportion to an unknown, [bodies of the machine]
    integer, allocatable :: to(:)        !! a body in proportion to whose speed each body turns, [bodies of the machine]
    real(wp), allocatable :: ratio(:)    !! speed of a body by that one [bodies of the machine]
  end type component_t

contains

  !> The rows of a machine and of the shafts of its input.
  function new_neighbours(input, body_index, machine) result(self)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index
    type(machine_t), intent(in) :: machine   !! its elements are numbered
    type(neighbours_t) :: self
    integer, allocatable :: ends(:, :), shafts(:)
    integer :: i

    allocate (shafts, source=input%groups_named('shaft'))
    allocate (ends(2, size(shafts)))
    do i = 1, size(shafts)
      ends(:, i) = bodies_of(input%groups(shafts(i)), 'bodies', body_index)
    end do
    associate (constraints => machine%constraints)
      self%gears = constraints%rows()
      self%rows = joined_rows(new_element_rows(constraints%first, constraints%body, constraints%coefficient(1, :)), &
                              joined_rows(elastic_rows(machine), rows_between(ends(1, :), ends(2, :))))
    end associate
  end function new_neighbours

  !> The rows of the couplings and meshes of a machine.
  function elastic_rows(machine) result(rows)
    type(machine_t), intent(in) :: machine
    type(element_rows_t) :: rows
    integer, allocatable :: elements(:), first(:)
    integer :: b, i, k

    allocate (elements(0))
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role == role_coupling .and. .not. bank%has_parts) elements = [elements, bank%first - 1 + bank%elastic]
      end associate
    end do
    allocate (first(size(elements) + 1))
    associate (all => machine%elements%rows)
      first(1) = 1
      do i = 1, size(elements)
        first(i + 1) = first(i) + all%first(elements(i) + 1) - all%first(elements(i))
      end do
      rows = new_element_rows(first, &
        [((all%body(k), k=all%first(elements(i)), all%first(elements(i) + 1) - 1), i=1, size(elements))], &
        [((all%coefficient(k), k=all%first(elements(i)), all%first(elements(i) + 1) - 1), i=1, size(elements))])
    end associate
  end function elastic_rows

  !> Sets the start speeds that follow from those that are known, marks them as known, and tells them.
  subroutine take(self, unit, machine, is_known, notes)
    class(neighbours_t), intent(in) :: self
    integer, intent(in) :: unit   !! of speeds in notes: index of `units`, 0: rad/s
    type(machine_t), intent(inout) :: machine
    logical, intent(inout) :: is_known(:)   !! [bodies]
    type(string_t), allocatable, intent(out) :: notes(:)
    logical :: concerns(size(is_known))   ! whether a component has elastic elements, and something beside it turns
    type(groups_t) :: bodies, rows        ! of the components
    type(component_t) :: component
    logical, allocatable :: is_found(:)   ! of the bodies of a component
    integer, allocatable :: beside(:), taken(:)
    integer :: root

    allocate (notes(0), beside(0), taken(0))
    if (.not. any(is_known .and. abs(machine%start_speed(1, :)) > 0)) return
    call find_components(self, machine%start_speed(1, :), is_known, bodies, rows, concerns)
    allocate (component%unknown(size(is_known)), component%to(size(is_known)), component%ratio(size(is_known)))
    do root = 1, size(is_known)
      if (.not. concerns(root)) cycle
      component%bodies = bodies%member(bodies%start(root):bodies%start(root + 1) - 1)
      component%rows = rows%member(rows%start(root):rows%start(root + 1) - 1)
      call list_beside(self, is_known, component)
      call solve(self, component, is_known, machine%start_speed, is_found)
      if (.not. allocated(is_found)) then
        if (size(notes) < most_names) call note_contradiction(component, unit, machine, notes)
        cycle
      end if
      taken = [taken, pack(component%bodies, is_found)]
      beside = [beside, component%beside]
    end do
    is_known(taken) = .true.
    call note_speeds(taken, beside, unit, machine, notes)
  end subroutine take

  !> Joins the bodies whose speeds are not known.
  pure subroutine find_components(self, speed, is_known, bodies, rows, concerns)
    type(neighbours_t), intent(in) :: self
    real(wp), intent(in) :: speed(:)        !! [rad/s], [bodies]
    logical, intent(in) :: is_known(:)
    type(groups_t), intent(out) :: bodies, rows   !! by the component, which has the number of one of its bodies
    logical, intent(out) :: concerns(:)
    logical, dimension(size(speed)) :: is_elastic, is_moving
    integer :: i, parent(size(speed)), r, root, root_of_row(self%rows%count()), roots(size(speed))

    parent = [(i, i=1, size(parent))]
    is_elastic = .false.
    is_moving = .false.
    do r = 1, self%rows%count()
      associate (body => self%rows%body(self%rows%first(r):self%rows%first(r + 1) - 1))
        root = 0
        do i = 1, size(body)
          if (is_open(body(i), is_known)) then
            if (root > 0) call join_components(root, body(i), parent)
            root = body(i)
          end if
        end do
      end associate
    end do
    do r = 1, self%rows%count()
      associate (body => self%rows%body(self%rows%first(r):self%rows%first(r + 1) - 1))
        root = 0
        do i = 1, size(body)
          if (is_open(body(i), is_known)) call find_root(parent, body(i), root)
        end do
        root_of_row(r) = root
        if (root == 0) cycle
        is_elastic(root) = is_elastic(root) .or. r > self%gears
        do i = 1, size(body)
          if (body(i) == 0) cycle
          is_moving(root) = is_moving(root) .or. (is_known(body(i)) .and. abs(speed(body(i))) > 0)
        end do
      end associate
    end do
    concerns = is_elastic .and. is_moving
    do i = 1, size(roots)
      call find_root(parent, i, roots(i))
    end do
    bodies = grouped(size(roots), pack(roots, .not. is_known), pack([(i, i=1, size(roots))], .not. is_known))
    rows = grouped(size(roots), pack(root_of_row, root_of_row > 0), pack([(r, r=1, size(root_of_row))], root_of_row > 0))
  end subroutine find_components

  !> Whether a body, not the ground, has no known speed.
  pure logical function is_open(body, is_known)
    integer, intent(in) :: body
    logical, intent(in) :: is_known(:)

    is_open = body > 0
    if (is_open) is_open = .not. is_known(body)
  end function is_open

  !> The bodies with known speeds in the rows of a component.
  pure subroutine list_beside(self, is_known, component)
    type(neighbours_t), intent(in) :: self
    logical, intent(in) :: is_known(:)
    type(component_t), intent(inout) :: component
    integer :: entry, i

    component%beside = [integer ::]
    do i = 1, size(component%rows)
      do entry = self%rows%first(component%rows(i)), self%rows%first(component%rows(i) + 1) - 1
        associate (b => self%rows%body(entry))
          if (is_open(b, is_known) .or. any(component%beside == b)) cycle
          component%beside = [component%beside, b]
        end associate
      end do
    end do
  end subroutine list_beside

  !> Finds the speeds that the rows of a component determine; `is_found` is not allocated if the rows contradict each other.
  subroutine solve(self, component, is_known, speed, is_found)
    type(neighbours_t), intent(in) :: self
    type(component_t), intent(inout) :: component
    logical, intent(in) :: is_known(:)
    real(wp), intent(inout) :: speed(:, :)   !! [lanes, bodies]
    logical, allocatable, intent(out) :: is_found(:)   !! [bodies of the component]
    real(wp), allocatable :: equations(:, :), slack(:), unknown(:), value(:)
    integer, allocatable :: left(:)   ! rows that do not join two bodies of the component
    real(wp), allocatable :: rest(:)
    type(known_t) :: known
    logical :: is_consistent
    integer :: b, i, k

    call join_pairs(self, is_known, component, left)
    allocate (equations(size(left), component%unknowns), value(size(left)), slack(size(left)))
    do i = 1, size(left)
      call form_equation(self, left(i), component, is_known, speed(1, :), equations(i, :), value(i), slack(i))
    end do
    call collect(equations, value, slack, [(i, i=1, size(left))], known, is_consistent)
    if (.not. is_consistent) return
    allocate (is_found(size(component%bodies)))
    allocate (unknown(component%unknowns))
    unknown = matmul(known%orthonormal(:, :known%count), known%value(:known%count))
    do i = 1, size(component%bodies)
      b = component%bodies(i)
      k = component%unknown(b)
      rest = -matmul(known%orthonormal(:, :known%count), known%orthonormal(k, :known%count))
      rest(k) = rest(k) + 1.0_wp
      is_found(i) = norm2(rest) <= tolerance
      if (is_found(i)) speed(:, b) = component%ratio(b) * unknown(k)
    end do
  end subroutine solve

  !> Joins bodies of a component in whose rows are no others, so that one unknown serves all of them.
  subroutine join_pairs(self, is_known, component, left)
    type(neighbours_t), intent(in) :: self
    logical, intent(in) :: is_known(:)
    type(component_t), intent(inout) :: component
    integer, allocatable, intent(out) :: left(:)   !! the other rows
    integer :: body(2), i, k, root(2)
    real(wp) :: c(2), factor(2)

    allocate (left(0))
    component%to(component%bodies) = component%bodies
    component%ratio(component%bodies) = 1.0_wp
    do i = 1, size(component%rows)
      associate (first => self%rows%first(component%rows(i)), last => self%rows%first(component%rows(i) + 1) - 1)
        body = 0
        if (last == first + 1) body = self%rows%body(first:last)
        if (.not. (is_open(body(1), is_known) .and. is_open(body(2), is_known))) then
          left = [left, component%rows(i)]
          cycle
        end if
        c = self%rows%coefficient(first:last)
      end associate
      do k = 1, 2
        call trace(body(k), component%to, component%ratio, root(k), factor(k))
      end do
      if (root(1) /= root(2)) then
        component%to(maxval(root)) = minval(root)
        if (root(2) > root(1)) component%ratio(root(2)) = -c(1) * factor(1) / (c(2) * factor(2))
        if (root(1) > root(2)) component%ratio(root(1)) = -c(2) * factor(2) / (c(1) * factor(1))
      else if (abs(c(1) * factor(1) + c(2) * factor(2)) > tolerance * abs(c(1) * factor(1))) then
        left = [left, component%rows(i)]   ! a loop whose ratios let it stand still only
      end if
    end do
    call number_unknowns(component)
  end subroutine join_pairs

  !> The body at the end of a chain of ratios, to which the body then points itself.
  pure subroutine trace(body, to, ratio, root, factor)
    integer, intent(in) :: body
    integer, intent(inout) :: to(:)
    real(wp), intent(inout) :: ratio(:)
    integer, intent(out) :: root
    real(wp), intent(out) :: factor   !! speed of the body by that of the root

    root = body
    factor = 1.0_wp
    do while (to(root) /= root)
      factor = factor * ratio(root)
      root = to(root)
    end do
    to(body) = root
    ratio(body) = factor
  end subroutine trace

  !> Numbers the unknowns of a component: the bodies to which others point.
  pure subroutine number_unknowns(component)
    type(component_t), intent(inout) :: component
    real(wp) :: factor
    integer :: b, i, root

    component%unknowns = 0
    do i = 1, size(component%bodies)
      b = component%bodies(i)
      if (component%to(b) /= b) cycle
      component%unknowns = component%unknowns + 1
      component%unknown(b) = component%unknowns
    end do
    do i = 1, size(component%bodies)
      b = component%bodies(i)
      call trace(b, component%to, component%ratio, root, factor)
      component%unknown(b) = component%unknown(root)
    end do
  end subroutine number_unknowns

  !> A row as an equation of the unknowns. A row of elastic elements may have the rounding of the given speeds.
  pure subroutine form_equation(self, row, component, is_known, speed, equation, value, slack)
    type(neighbours_t), intent(in) :: self
    integer, intent(in) :: row
    type(component_t), intent(in) :: component
    logical, intent(in) :: is_known(:)
    real(wp), intent(in) :: speed(:)       !! [rad/s], [bodies]
    real(wp), intent(out) :: equation(:)   !! [unknowns]
    real(wp), intent(out) :: value, slack  !! [rad/s] times a coefficient
    integer :: entry, k

    equation = 0.0_wp
    value = 0.0_wp
    slack = 0.0_wp
    do entry = self%rows%first(row), self%rows%first(row + 1) - 1
      associate (b => self%rows%body(entry), c => self%rows%coefficient(entry))
        if (is_open(b, is_known)) then
          k = component%unknown(b)
          equation(k) = equation(k) + c * component%ratio(b)
        else if (b > 0) then
          value = value - c * speed(b)
          slack = slack + tolerance * abs(c * speed(b))
          if (row > self%gears) slack = slack + abs(c) * rounding_of(speed(b))
        end if
      end associate
    end do
  end subroutine form_equation

  !> "'a', 'b' start at 10 rad/s as 'motor' does, 'c' at 3.333333 rad/s".
  subroutine note_speeds(taken, beside, unit, machine, notes)
    integer, intent(in) :: taken(:)    !! bodies
    integer, intent(in) :: beside(:)   !! bodies whose speeds are known, 0 = ground
    integer, intent(in) :: unit
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: text
    logical, dimension(size(taken)) :: is_alike, is_told
    integer :: i, sorts, source

    text = ''
    is_told = abs(machine%start_speed(1, taken)) <= 0
    if (all(is_told)) return
    sorts = 0
    do i = 1, size(is_told)
      if (is_told(i)) cycle
      associate (speed => machine%start_speed(1, taken(i)))
        is_alike = .not. is_told .and. abs(machine%start_speed(1, taken) - speed) <= tolerance * abs(speed)
        is_told = is_told .or. is_alike
        sorts = sorts + 1
        if (sorts > most_names) cycle
        if (sorts > 1) text = text // ', '
        call append_names(pack(taken, is_alike), machine, text)
        if (sorts == 1) text = text // trim(merge(' starts', ' start ', count(is_alike) == 1))
        text = text // ' at ' // speed_text(speed, unit, digits)
        source = source_of(beside, speed, machine)
        if (source > 0) text = text // ' as ' // quoted(machine%names(source)%text) // ' does'
      end associate
    end do
    if (sorts > most_names) text = text // ' and others at other speeds'
    call append(notes, 'speeds at the start that are not given follow through couplings: ' // text)
  end subroutine note_speeds

  !> The first body beside components that has a speed; 0 if there is none.
  pure integer function source_of(beside, speed, machine) result(source)
    integer, intent(in) :: beside(:)   !! bodies, 0 = ground
    real(wp), intent(in) :: speed   !! [rad/s]
    type(machine_t), intent(in) :: machine
    integer :: i

    do i = 1, size(beside)
      source = beside(i)
      if (source == 0) cycle
      if (abs(machine%start_speed(1, source) - speed) <= tolerance * abs(speed)) return
    end do
    source = 0
  end function source_of

  !> That the speeds beside a component do not fit together.
  subroutine note_contradiction(component, unit, machine, notes)
    type(component_t), intent(in) :: component
    integer, intent(in) :: unit
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: text
    integer :: i

    text = 'start speeds of '
    call append_names(component%bodies, machine, text)
    text = text // ' do not follow through couplings, for the bodies beside them differ:'
    do i = 1, min(size(component%beside), most_names)
      if (i > 1) text = text // ','
      associate (b => component%beside(i))
        if (b == 0) text = text // " 'ground' stands still"
        if (b == 0) cycle
        text = text // ' ' // quoted(machine%names(b)%text) // ' starts at '
        text = text // speed_text(machine%start_speed(1, b), unit, digits)
      end associate
    end do
    if (size(component%beside) > most_names) text = text // ' and ' // to_text(size(component%beside) - most_names) // ' more'
    call append(notes, text)
  end subroutine note_contradiction

  !> Appends the names of bodies.
  subroutine append_names(bodies, machine, text)
    integer, intent(in) :: bodies(:)
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable, intent(inout) :: text
    integer :: i

    do i = 1, min(size(bodies), most_names)
      if (i > 1) text = text // ', '
      text = text // quoted(machine%names(bodies(i))%text)
    end do
    if (size(bodies) > most_names) text = text // ' and ' // to_text(size(bodies) - most_names) // ' more'
  end subroutine append_names

end module nocdyn_neighbour_speeds
