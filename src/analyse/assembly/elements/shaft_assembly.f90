!> The shafts of an input: their nodes, which become bodies after those of the input, and the bank of their slices.
!>
!> The orders of the spectral elements are such that frequencies up to a highest one are those of the continuous shaft.
module nocdyn_shaft_assembly
  use nocdyn_bank, only: append_bank, bank_slot_t
  use nocdyn_couplings, only: coupling_common_t
  use nocdyn_element_groups, only: bodies_of, body_index_t
  use nocdyn_element_rows, only: new_element_rows
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shaft_frequencies, only: highest_frequency
  use nocdyn_shafts, only: new_shafts, shaft_t
  use nocdyn_spectral_elements, only: least_order, new_spectral_element, spectral_element_t
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: check_shaft, add_shafts, new_shaft_set, segment_inertia, segment_stiffness

  real(wp), parameter :: pi = acos(-1.0_wp)
  real(wp), parameter :: tolerance = 1.0e-9_wp   ! of the states at the ends of a shaft that is as soft as all shafts together

  !> All shafts of an input.
  type, public :: shaft_set_t
    type(shaft_t), allocatable :: shafts(:)
    ! the nodes, numbered from the first body after those of the input:
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

  !> Refuses bores that are no smaller than the diameter, and numbers of nodes that do not fit the segments.
  subroutine check_shaft(input, index, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    associate (group => input%groups(index))
      associate (bores => group%numbers('bores'), diameters => group%numbers('diameters'))
        do k = 1, size(bores)
          if (bores(k) < diameters(k)) cycle
          call raise(error, exit_input, input%location(index, 'bores') // ': bores(' // to_text(k) // ') = ' // &
                     to_text(bores(k)) // ' m is not less than diameters(' // to_text(k) // ') = ' // to_text(diameters(k)) // &
                     ' m; allowed: 0 to below the diameter')
          return
        end do
        if (.not. group%has_value('nodes') .or. .not. group%number('density') > 0) return
        if (group%whole_number('nodes') >= size(bores) - 1) return
        call raise(error, exit_input, input%location(index, 'nodes') // ': nodes = ' // &
                   to_text(group%whole_number('nodes')) // ' is out of range; allowed: from ' // to_text(size(bores) - 1) // &
                   ', one between two segments, to 1000')
      end associate
    end associate
  end subroutine check_shaft

  !> The nodes and slices of all shafts.
  subroutine new_shaft_set(input, body_index, set)
    type(input_t), intent(in) :: input
    type(body_index_t), intent(in) :: body_index   !! of the bodies of the input
    type(shaft_set_t), intent(out) :: set
    integer, allocatable :: indices(:)
    real(wp) :: compliance, frequency
    integer :: i

    allocate (indices, source=input%groups_named('shaft'))
    allocate (set%shafts(0), set%names(0), set%ends(2, 0), set%share(0), set%bodies(0), set%inertia(0), set%slice_names(0))
    allocate (set%first(1), source=1)
    allocate (set%body(0), set%coefficient(0), set%stiffness(0), set%loss_factor(0), set%loss_damping(0))
    allocate (set%position(0), set%section_modulus(0))
    frequency = highest_frequency(input)
    compliance = sum([(compliance_of(input%groups(indices(i))), i=1, size(indices))])
    do i = 1, size(indices)
      associate (group => input%groups(indices(i)))
        call add_shaft(group, bodies_of(group, 'bodies', body_index), size(body_index%names), &
                       orders_of(group, frequency, tolerance * compliance), set)
      end associate
    end do
  end subroutine new_shaft_set

  !> Second moments of area of the segments against torsion [m4].
  pure function second_moments(group) result(moments)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: moments(:)

    allocate (moments, source=pi / 32.0_wp * (group%numbers('diameters')**4 - group%numbers('bores')**4))
  end function second_moments

  !> Of each segment [N m/rad].
  pure function segment_stiffness(group) result(stiffness)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: stiffness(:)

    allocate (stiffness, source=group%number('shear_modulus') * second_moments(group) / group%numbers('lengths'))
  end function segment_stiffness

  !> Of each segment [kg m2].
  pure function segment_inertia(group) result(inertia)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: inertia(:)

    allocate (inertia, source=group%number('density') * second_moments(group) * group%numbers('lengths'))
  end function segment_inertia

  pure real(wp) function compliance_of(group) result(compliance)
    type(group_t), intent(in) :: group

    compliance = sum(group%numbers('lengths') / second_moments(group)) / group%number('shear_modulus')
  end function compliance_of

  !> The order of the spectral element of each segment. Without inertia the whole shaft is one element: the list is empty.
  function orders_of(group, frequency, compliance) result(orders)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: frequency    !! highest one [rad/s]
    real(wp), intent(in) :: compliance   !! error that is allowed [rad/(N m)]
    integer, allocatable :: orders(:)
    real(wp), allocatable :: own(:)
    integer :: i, longest

    allocate (orders(0))
    if (.not. group%number('density') > 0) return
    associate (lengths => group%numbers('lengths'))
      if (group%has_value('nodes')) then
        orders = spread(1, 1, size(lengths))
        do i = 1, group%whole_number('nodes') - (size(lengths) - 1)
          longest = maxloc(lengths / orders, dim=1)
          orders(longest) = orders(longest) + 1
        end do
      else
        allocate (own, source=lengths / (group%number('shear_modulus') * second_moments(group)))
        orders = [(least_order(frequency * lengths(i) * sqrt(group%number('density') / group%number('shear_modulus')), &
                               compliance / own(i)), i=1, size(lengths))]
      end if
    end associate
  end function orders_of

  !> Adds the nodes, slices and points of one shaft.
  subroutine add_shaft(group, ends, bodies, orders, set)
    type(group_t), intent(in) :: group
    integer, intent(in) :: ends(2)      !! bodies at its ends, 0 = ground
    integer, intent(in) :: bodies       !! of the input
    integer, intent(in) :: orders(:)    !! of its segments; empty: one slice
    type(shaft_set_t), intent(inout) :: set
    integer :: chain(0:max(1, sum(orders))), k, nodes, old_nodes
    type(shaft_t) :: shaft

    nodes = max(0, sum(orders) - 1)
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
    if (size(orders) > 0) then
      call add_segments(group, orders, chain, shaft, set)
    else
      call add_massless(group, chain, shaft, set)
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
  subroutine add_massless(group, chain, shaft, set)
    type(group_t), intent(in) :: group
    integer, intent(in) :: chain(0:)   !! its ends
    type(shaft_t), intent(inout) :: shaft
    type(shaft_set_t), intent(inout) :: set
    real(wp) :: x
    integer :: i

    call add_slice(chain, [-1.0_wp, 1.0_wp], 1.0_wp / compliance_of(group), set)
    x = 0.0_wp
    associate (lengths => group%numbers('lengths'), moduli => moduli_of(group))
      do i = 1, size(lengths)
        set%position = [set%position, x, x + lengths(i)]
        set%section_modulus = [set%section_modulus, moduli(i), moduli(i)]
        x = x + lengths(i)
      end do
      allocate (shaft%moments(2 * size(lengths), 1), source=1.0_wp)
    end associate
  end subroutine add_massless

  !> The spectral elements of a shaft. The slices are numbered from its second end, so that rigid motions are found without
  !> cancellation, which eliminates the last nodes first.
  subroutine add_segments(group, orders, chain, shaft, set)
    type(group_t), intent(in) :: group
    integer, intent(in) :: orders(:)
    integer, intent(in) :: chain(0:)   !! bodies and nodes from end to end
    type(shaft_t), intent(inout) :: shaft
    type(shaft_set_t), intent(inout) :: set
    type(spectral_element_t) :: elements(size(orders))
    real(wp), allocatable :: areas(:), lengths(:), flexibility(:), share(:)
    integer :: begin, i, j, q

    allocate (lengths, source=group%numbers('lengths'))
    allocate (areas, source=second_moments(group))
    allocate (flexibility, source=lengths / (group%number('shear_modulus') * areas))
    allocate (share(0))
    do i = 1, size(orders)
      elements(i) = new_spectral_element(orders(i))
      begin = sum(orders(:i - 1))
      set%bodies = [set%bodies, chain(begin:begin + orders(i))]
      set%inertia = [set%inertia, group%number('density') * areas(i) * lengths(i) * elements(i)%mass]
      share = [share, (sum(flexibility(:i - 1)) + flexibility(i) * elements(i)%node(j), j=1, orders(i))]
    end do
    set%share = [set%share, share(:size(share) - 1) / sum(flexibility)]
    do i = size(orders), 1, -1
      begin = sum(orders(:i - 1))
      do q = orders(i), 1, -1
        call add_slice(chain(begin:begin + orders(i)), elements(i)%row(q, :), 1.0_wp / (flexibility(i) * elements(i)%weight(q)), &
                       set)
      end do
    end do
    call add_points(lengths, moduli_of(group), elements, shaft, set)
  end subroutine add_segments

  !> Section moduli of the segments against torsion [m3].
  pure function moduli_of(group) result(moduli)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: moduli(:)

    allocate (moduli, source=2.0_wp * second_moments(group) / group%numbers('diameters'))
  end function moduli_of

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

  !> The points at which the moments of a shaft are evaluated: the ends of each segment, and dense between them.
  subroutine add_points(lengths, moduli, elements, shaft, set)
    real(wp), intent(in) :: lengths(:), moduli(:)   !! of the segments [m], [m3]
    type(spectral_element_t), intent(in) :: elements(:)
    type(shaft_t), intent(inout) :: shaft
    type(shaft_set_t), intent(inout) :: set
    real(wp), allocatable :: one(:, :), points(:)
    integer :: first, i, k, n, slices, total

    slices = sum(elements%order)
    allocate (shaft%moments(sum(merge(2, 4 * elements%order + 1, elements%order == 1)), slices), source=0.0_wp)
    total = 0
    do i = 1, size(elements)
      n = merge(1, 4 * elements(i)%order, elements(i)%order == 1)
      points = [(0.5_wp - 0.5_wp * cos(pi * k / n), k=0, n)]
      points(n + 1) = 1.0_wp
      one = elements(i)%interpolation(points)
      first = slices - sum(elements(:i)%order)
      shaft%moments(total + 1:total + n + 1, first + 1:first + elements(i)%order) = one(:, elements(i)%order:1:-1)
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
    real(wp), allocatable :: zero(:, :)
    integer :: b, k

    if (size(set%shafts) == 0) return
    call machine%add_nodes(set%names, 0.0_wp * set%share)
    do k = 1, size(set%bodies)
      b = set%bodies(k)
      if (b > 0) machine%inertia(:, b) = machine%inertia(:, b) + set%inertia(k)
    end do
    associate (n => machine%lanes)
      allocate (zero, source=spread(0.0_wp * set%stiffness, 1, n))
      shared = coupling_common_t(set%slice_names, new_element_rows(set%first, set%body, set%coefficient), &
                                 spread(set%loss_damping, 1, n), zero)
      call append_bank(machine%banks, new_shafts(shared, spread(set%stiffness, 1, n), set%shafts, spread(set%position, 1, n), &
                                                 spread(set%section_modulus, 1, n)))
    end associate
    if (.not. any(set%loss_factor > 0)) return
    machine%banks(size(machine%banks))%bank%loss_factor = set%loss_factor
    machine%banks(size(machine%banks))%bank%loss_damping = set%loss_damping
  end subroutine add_shafts

  !> Sets the start of the nodes, as that of a massless shaft between its ends.
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

  !> A value between those of the two ends, of which the ground has 0, [lanes].
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
