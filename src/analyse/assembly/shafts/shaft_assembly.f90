!> The shafts of an input: their nodes, which become bodies after the ones of the input, and the bank of their slices.
!>
!> The orders of the spectral elements are such that frequencies up to a highest one are the ones of the continuous shaft.
module nocdyn_shaft_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_constraints, only: constraints_t
  use nocdyn_couplings, only: coupling_common_t
  use nocdyn_element_groups, only: bodies_of, body_index_t
  use nocdyn_element_rows, only: new_element_rows
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shaft_frequencies, only: excited_frequency, highest_frequency
  use nocdyn_shaft_segments, only: are_resolved, choose_elements, most_nodes, segments_of, segments_t
  use nocdyn_shafts, only: new_shafts, shaft_element_t, shaft_t
  use nocdyn_spectral_elements, only: new_spectral_element, spectral_element_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  use nocdyn_units, only: from_si, unit_hz
  implicit none (type, external)
  private

  public :: add_shafts, new_shaft_set

  real(wp), parameter :: pi = acos(-1.0_wp)
  real(wp), parameter :: tolerance = 1.0e-9_wp   ! of the states at the ends of a shaft that is as soft as all shafts together

  !> All shafts of an input.
  type, public :: shaft_set_t
    type(shaft_t), allocatable :: shafts(:)
    ! the nodes, numbered from the first body after the ones of the input:
    type(string_t), allocatable :: notes(:)    !! on nodes that do not suffice
    type(string_t), allocatable :: names(:)
    integer, allocatable :: ends(:, :)         !! bodies at the ends of its shaft, [2, nodes]
    real(wp), allocatable :: share(:)          !! of the shaft's flexibility before the node, [nodes]
    integer, allocatable :: bodies(:)          !! with inertia of shafts, each of them any number of times
    real(wp), allocatable :: inertia(:)        !! of these [kg m2]
    ! the slices:
    type(string_t), allocatable :: slice_names(:)
    integer, allocatable :: first(:), body(:)  !! of their rows
    real(wp), allocatable :: coefficient(:)
    real(wp), allocatable :: stiffness(:)      !! [N m/rad]
    real(wp), allocatable :: loss_factor(:), loss_damping(:)
    real(wp), allocatable :: position(:), section_modulus(:)   !! of the points [m], [m3]
  contains
    procedure :: place_nodes
  end type shaft_set_t

contains

  !> The nodes and slices of all shafts.
  subroutine new_shaft_set(input, body_index, constraints, set)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index      !! of the bodies of the input
    type(constraints_t), intent(in) :: constraints    !! between these
    type(shaft_set_t), intent(out) :: set
    integer, allocatable :: indices(:), order(:), segment(:)
    real(wp) :: compliance, excited, frequency
    integer :: i

    allocate (set%notes(0))
    allocate (indices, source=input%groups_named('shaft'))
    allocate (set%shafts(0), set%names(0), set%ends(2, 0), set%share(0), set%bodies(0), set%inertia(0), set%slice_names(0))
    allocate (set%first(1), source=1)
    allocate (set%body(0), set%coefficient(0), set%stiffness(0), set%loss_factor(0), set%loss_damping(0))
    allocate (set%position(0), set%section_modulus(0))
    if (size(indices) == 0) return
    excited = excited_frequency(input, body_index, constraints)
    frequency = highest_frequency(input, excited)
    compliance = sum([(compliance_of(input%groups(indices(i))), i=1, size(indices))])
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        call choose_elements(group, frequency, tolerance * compliance, segment, order)
        if (.not. are_resolved(group, segment, order, excited)) call note_nodes(group, sum(order) - 1, excited, set%notes)
        call add_shaft(group, bodies_of(group, 'bodies', body_index), size(body_index%names), segment, order, set)
      end associate
    end do
  end subroutine new_shaft_set

  !> That the nodes of a shaft do not resolve what is excited.
  subroutine note_nodes(group, nodes, excited, notes)
    type(group_t), intent(in) :: group
    integer, intent(in) :: nodes
    real(wp), intent(in) :: excited   !! highest frequency [rad/s]
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: text

    text = 'the ' // to_text(nodes) // ' nodes of shaft ' // quoted(group%name) // ' do not resolve the highest frequency ' // &
           'that is excited, ' // rounded_text(from_si(excited, unit_hz), 4) // ' Hz'
    if (.not. group%has_value('nodes')) text = text // ', which needs more than ' // to_text(most_nodes)
    call append(notes, text)
  end subroutine note_nodes

  !> [rad/(N m)].
  pure real(wp) function compliance_of(group) result(compliance)
    type(group_t), intent(in) :: group
    type(segments_t) :: segments

    segments = segments_of(group)
    compliance = sum(segments%flexibility)
  end function compliance_of

  !> Adds the nodes, slices and points of one shaft.
  subroutine add_shaft(group, ends, bodies, segment, order, set)
    type(group_t), intent(in) :: group
    integer, intent(in) :: ends(2)      !! bodies at its ends, 0 = ground
    integer, intent(in) :: bodies       !! of the input
    integer, intent(in) :: segment(:)   !! of each spectral element
    integer, intent(in) :: order(:)     !! of each spectral element; empty: one slice
    type(shaft_set_t), intent(inout) :: set
    integer :: chain(0:max(1, sum(order))), k, nodes, old_nodes
    type(shaft_t) :: shaft

    nodes = max(0, sum(order) - 1)
    old_nodes = size(set%names)
    chain(0) = ends(1)
    chain(1:nodes) = [(bodies + old_nodes + k, k=1, nodes)]
    chain(nodes + 1) = ends(2)
    do k = 1, nodes
      call append(set%names, group%name // '[' // to_text(k) // ']')
    end do
    set%ends = reshape([set%ends, spread(ends, 2, nodes)], [2, old_nodes + nodes])
    shaft%ends = ends
    shaft%first = size(set%stiffness) + 1
    shaft%first_point = size(set%position) + 1
    if (size(order) > 0) then
      call add_elements(segments_of(group), segment, order, chain, shaft, set)
    else
      call add_massless(segments_of(group), chain, shaft, set)
    end if
    shaft%last = size(set%stiffness)
    shaft%last_point = size(set%position)
    do k = shaft%first, shaft%last
      call append(set%slice_names, group%name)
    end do
    associate (loss => loss_factor_of(group))
      set%loss_factor = [set%loss_factor, spread(loss, 1, shaft%last - shaft%first + 1)]
      set%loss_damping = [set%loss_damping, spread(0.0_wp, 1, shaft%last - shaft%first + 1)]
      if (group%has_value('damping_frequency')) set%loss_damping(shaft%first:) = loss / group%number('damping_frequency') &
                                                                                   * set%stiffness(shaft%first:)
    end associate
    set%shafts = [set%shafts, shaft]
  end subroutine add_shaft

  !> The loss factor psi / (2 pi) = 2 D.
  pure real(wp) function loss_factor_of(group) result(factor)
    type(group_t), intent(in) :: group

    factor = group%number('relative_damping', absent=0.0_wp) / (2.0_wp * pi)
    if (group%has_value('damping_ratio')) factor = 2.0_wp * group%number('damping_ratio')
  end function loss_factor_of

  !> One slice for a whole shaft without inertia.
  subroutine add_massless(segments, chain, shaft, set)
    type(segments_t), intent(in) :: segments
    integer, intent(in) :: chain(0:)   !! its ends
    type(shaft_t), intent(inout) :: shaft
    type(shaft_set_t), intent(inout) :: set
    real(wp) :: x
    integer :: i

    call add_slice(chain, [-1.0_wp, 1.0_wp], 1.0_wp / sum(segments%flexibility), set)
    x = 0.0_wp
    associate (lengths => segments%length, moduli => segments%section_modulus)
      do i = 1, size(lengths)
        set%position = [set%position, x, x + lengths(i)]
        set%section_modulus = [set%section_modulus, moduli(i), moduli(i)]
        x = x + lengths(i)
      end do
      allocate (shaft%moments(1, 2 * size(lengths)), source=1.0_wp)
      allocate (shaft%before(2 * size(lengths)), source=0)
      allocate (shaft%slices(2 * size(lengths)), source=1)
    end associate
    allocate (shaft%elements(0))
  end subroutine add_massless

  !> The spectral elements of a shaft. The slices are numbered from its second end, so that rigid motions are found without
  !> cancellation, which eliminates the last nodes first.
  subroutine add_elements(segments, segment, order, chain, shaft, set)
    type(segments_t), intent(in) :: segments
    integer, intent(in) :: segment(:), order(:)   !! of each element
    integer, intent(in) :: chain(0:)   !! bodies and nodes from end to end
    type(shaft_t), intent(inout) :: shaft
    type(shaft_set_t), intent(inout) :: set
    type(spectral_element_t) :: elements(size(order))
    real(wp) :: flexibility(size(order)), inertia(size(order))
    real(wp), allocatable :: share(:)
    integer :: begin, i, j, parts, q

    allocate (share(0), shaft%elements(size(order)))
    do i = 1, size(order)
      elements(i) = new_spectral_element(order(i))
      parts = count(segment == segment(i))
      flexibility(i) = segments%flexibility(segment(i)) / parts
      inertia(i) = segments%density(segment(i)) * segments%second_moment(segment(i)) * segments%length(segment(i)) / parts
      begin = sum(order(:i - 1))
      shaft%elements(i) = shaft_element_t(chain(begin:begin + order(i)), 1.0_wp / flexibility(i), inertia(i))
      set%bodies = [set%bodies, chain(begin:begin + order(i))]
      set%inertia = [set%inertia, inertia(i) * elements(i)%mass]
      share = [share, (sum(flexibility(:i - 1)) + flexibility(i) * elements(i)%node(j), j=1, order(i))]
    end do
    set%share = [set%share, share(:size(share) - 1) / sum(flexibility)]
    do i = size(order), 1, -1
      begin = sum(order(:i - 1))
      do q = order(i), 1, -1
        call add_slice(chain(begin:begin + order(i)), elements(i)%row(q, :), 1.0_wp / (flexibility(i) * elements(i)%weight(q)), &
                       set)
      end do
    end do
    call add_points([(segments%length(segment(i)) / count(segment == segment(i)), i=1, size(segment))], &
                    segments%section_modulus(segment), elements, shaft, set)
  end subroutine add_elements

  subroutine add_slice(bodies, coefficients, stiffness, set)
    integer, intent(in) :: bodies(:)
    real(wp), intent(in) :: coefficients(:)
    real(wp), intent(in) :: stiffness   !! [N m/rad]
    type(shaft_set_t), intent(inout) :: set

    set%body = [set%body, bodies]
    set%coefficient = [set%coefficient, coefficients]
    set%first = [set%first, size(set%body) + 1]
    set%stiffness = [set%stiffness, stiffness]
  end subroutine add_slice

  !> The points at which the moments of a shaft are evaluated: the ends of each element, and dense between them.
  subroutine add_points(lengths, moduli, elements, shaft, set)
    real(wp), intent(in) :: lengths(:), moduli(:)   !! of the elements [m], [m3]
    type(spectral_element_t), intent(in) :: elements(:)
    type(shaft_t), intent(inout) :: shaft
    type(shaft_set_t), intent(inout) :: set
    real(wp), allocatable :: one(:, :), points(:)
    integer :: i, k, n, total

    total = sum(merge(2, 4 * elements%order + 1, elements%order == 1))
    allocate (shaft%moments(maxval(elements%order), total), source=0.0_wp)
    allocate (shaft%before(total), shaft%slices(total))
    total = 0
    do i = 1, size(elements)
      n = merge(1, 4 * elements(i)%order, elements(i)%order == 1)
      points = [(0.5_wp - 0.5_wp * cos(pi * k / n), k=0, n)]
      points(n + 1) = 1.0_wp
      one = elements(i)%interpolation(points)
      shaft%moments(:elements(i)%order, total + 1:total + n + 1) = transpose(one(:, elements(i)%order:1:-1))
      shaft%before(total + 1:total + n + 1) = sum(elements(i + 1:)%order)
      shaft%slices(total + 1:total + n + 1) = elements(i)%order
      set%position = [set%position, sum(lengths(:i - 1)) + lengths(i) * points]
      set%section_modulus = [set%section_modulus, spread(moduli(i), 1, n + 1)]
      total = total + n + 1
    end do
  end subroutine add_points

  !> Adds the nodes to the bodies of a machine and the inertia of the shafts to them, and the bank of the slices.
  subroutine add_shafts(set, machine)
    type(shaft_set_t), intent(in) :: set
    type(machine_t), intent(inout) :: machine
    type(coupling_common_t) :: shared
    integer :: b, k

    if (size(set%shafts) == 0) return
    call machine%add_nodes(set%names, 0.0_wp * set%share)
    do k = 1, size(set%bodies)
      b = set%bodies(k)
      if (b > 0) machine%inertia(:, b) = machine%inertia(:, b) + set%inertia(k)
    end do
    associate (n => machine%lanes)
      shared%names = set%slice_names
      shared%rows = new_element_rows(set%first, set%body, set%coefficient)
      shared%damping = spread(set%loss_damping, 1, n)
      shared%rest_twist = 0.0_wp * shared%damping
      if (any(set%loss_factor > 0)) then
        shared%loss_factor = set%loss_factor
        shared%loss_damping = set%loss_damping
      end if
      call append_bank(machine%banks, new_shafts(shared, spread(set%stiffness, 1, n), set%shafts, spread(set%position, 1, n), &
                                                 spread(set%section_modulus, 1, n)))
    end associate
  end subroutine add_shafts

  !> Sets the start of the nodes, as the one of a massless shaft between its ends.
  subroutine place_nodes(self, machine)
    class(shaft_set_t), intent(in) :: self
    type(machine_t), intent(inout) :: machine
    integer :: k, node

    do k = 1, size(self%share)
      node = machine%bodies - machine%nodes + k
      machine%start_angle(:, node) = between(machine%start_angle, self%ends(:, k), self%share(k))
      machine%start_speed(:, node) = between(machine%start_speed, self%ends(:, k), self%share(k))
    end do
  end subroutine place_nodes

  !> A value between the ones of the two ends, of which the ground has 0, [lanes].
  pure function between(values, ends, share) result(value)
    real(wp), intent(in) :: values(:, :)   !! [lanes, bodies]
    integer, intent(in) :: ends(2)
    real(wp), intent(in) :: share          !! 0 at the first end, 1 at the second one
    real(wp) :: value(size(values, 1))

    value = 0.0_wp
    if (ends(1) > 0) value = (1.0_wp - share) * values(:, ends(1))
    if (ends(2) > 0) value = value + share * values(:, ends(2))
  end function between

end module nocdyn_shaft_assembly
