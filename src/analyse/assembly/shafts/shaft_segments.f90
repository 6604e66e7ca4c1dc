!> The uniform segments of a shaft, and the spectral elements that they are divided into.
module nocdyn_shaft_segments
  use nocdyn_input, only: diagnostics_t, group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_spectral_elements, only: highest_order, least_order, new_spectral_element, spectral_element_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: are_resolved, check_shaft, choose_elements, has_inertia, has_own_nodes, segments_of
  public :: segment_inertia, segment_parts, segment_stiffness

  real(wp), parameter :: pi = acos(-1.0_wp)
  integer, parameter, public :: most_nodes = 1000   !! inside of a shaft
  real(wp), parameter :: most_phase = 0.8_wp * most_nodes   ! of a wave along the whole shaft, for which so many nodes do [rad]

  !> Uniform segments, from the first end on.
  type, public :: segments_t
    real(wp), allocatable :: length(:)          !! [m]
    real(wp), allocatable :: second_moment(:)   !! of area against torsion [m4]
    real(wp), allocatable :: section_modulus(:) !! second moment over the radius [m3]
    real(wp), allocatable :: shear_modulus(:)   !! G [Pa]
    real(wp), allocatable :: density(:)         !! [kg/m3]; of all of them positive, or 0
    real(wp), allocatable :: flexibility(:)     !! [rad/(N m)]
    real(wp), allocatable :: wave_time(:)       !! in which a wave passes [s]
  end type segments_t

contains

  !> Refuses bores that are no smaller than the diameter, numbers of nodes that do not fit the segments, and materials that are
  !> neither one nor as many as the segments.
  subroutine check_shaft(input, index, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: k

    call check_material(input, index, 'shear_modulus', diagnostics)
    call check_material(input, index, 'density', diagnostics)
    associate (group => input%groups(index))
      associate (bores => group%numbers('bores'), diameters => group%numbers('diameters'))
        do k = 1, size(bores)
          if (bores(k) < diameters(k)) cycle
          call input%report(index, 'bores', 'bores(' // to_text(k) // ') = ' // to_text(bores(k)) // &
                     ' m is not less than diameters(' // to_text(k) // ') = ' // to_text(diameters(k)) // &
                     ' m; allowed: 0 to below the diameter', diagnostics)
          return
        end do
        if (.not. group%has_value('nodes') .or. .not. has_inertia(group)) return
        if (group%whole_number('nodes') >= size(bores) - 1) return
        call input%report(index, 'nodes', 'nodes = ' // to_text(group%whole_number('nodes')) // &
                   ' is out of range; allowed: from ' // to_text(size(bores) - 1) // ', one between two segments, to ' // &
                   to_text(most_nodes), diagnostics)
      end associate
    end associate
  end subroutine check_shaft

  subroutine check_material(input, index, key, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index
    character(len=*), intent(in) :: key
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (values => input%groups(index)%numbers(key), segments => size(input%groups(index)%numbers('lengths')))
      if (size(values) > 0 .and. all(size(values) /= [1, segments])) then
        call input%report(index, key, key // ' has ' // to_text(size(values)) // ' values, lengths has ' // &
                   to_text(segments) // '; allowed: one for the whole shaft, or one for each segment', diagnostics)
      else if (any(values > 0) .and. .not. all(values > 0)) then
        call input%report(index, key, key // '(' // to_text(findloc(values > 0, .false., dim=1)) // &
                   ') = 0, others are not; allowed: all are 0, or none', diagnostics)
      end if
    end associate
  end subroutine check_material

  !> The segments of a group &shaft.
  pure function segments_of(group) result(segments)
    type(group_t), intent(in) :: group
    type(segments_t) :: segments

    allocate (segments%length, source=group%numbers('lengths'))
    associate (diameters => group%numbers('diameters'), n => size(segments%length))
      allocate (segments%second_moment, source=pi / 32.0_wp * (diameters**4 - group%numbers('bores')**4))
      allocate (segments%section_modulus, source=2.0_wp * segments%second_moment / diameters)
      allocate (segments%shear_modulus, source=one_for_each(group%numbers('shear_modulus'), n))
      allocate (segments%density, source=one_for_each(group%numbers('density'), n))
    end associate
    allocate (segments%flexibility, source=segments%length / (segments%shear_modulus * segments%second_moment))
    allocate (segments%wave_time, source=segments%length * sqrt(segments%density / segments%shear_modulus))
  end function segments_of

  !> A value for each segment, from one for all of them or as many; 0 from none.
  pure function one_for_each(values, segments) result(list)
    real(wp), intent(in) :: values(:)
    integer, intent(in) :: segments
    real(wp), allocatable :: list(:)

    allocate (list(segments), source=0.0_wp)
    if (size(values) == 1) list(:) = values(1)
    if (size(values) > 1) list(:) = values
  end function one_for_each

  !> Of each segment [N m/rad].
  pure function segment_stiffness(group) result(stiffness)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: stiffness(:)
    type(segments_t) :: segments

    segments = segments_of(group)
    allocate (stiffness, source=segments%shear_modulus * segments%second_moment / segments%length)
  end function segment_stiffness

  !> Of each segment [kg m2].
  pure function segment_inertia(group) result(inertia)
    type(group_t), intent(in) :: group
    real(wp), allocatable :: inertia(:)
    type(segments_t) :: segments

    segments = segments_of(group)
    allocate (inertia, source=segments%density * segments%second_moment * segments%length)
  end function segment_inertia

  !> Whether a shaft has inertia.
  pure logical function has_inertia(group)
    type(group_t), intent(in) :: group

    has_inertia = group%number('density', absent=0.0_wp) > 0
  end function has_inertia

  !> Whether a shaft has inertia and chooses its nodes by itself.
  pure logical function has_own_nodes(group)
    type(group_t), intent(in) :: group

    has_own_nodes = has_inertia(group) .and. .not. group%has_value('nodes')
  end function has_own_nodes

  !> The spectral elements of a shaft, from its first end on. Without inertia it is one slice: there are none.
  subroutine choose_elements(group, frequency, tolerance, segment, order)
    type(group_t), intent(in) :: group
    real(wp), intent(in) :: frequency   !! up to which they are as the continuous shaft, unless that needs too many nodes [rad/s]
    real(wp), intent(in) :: tolerance   !! error that is allowed [rad/(N m)]
    integer, allocatable, intent(out) :: segment(:)   !! of each element, equal elements of a segment one after the other
    integer, allocatable, intent(out) :: order(:)     !! of each element
    type(segments_t) :: segments
    integer, allocatable :: sums(:)   ! of the orders in each segment
    integer :: i, parts, one

    allocate (segment(0), order(0))
    if (.not. has_inertia(group)) return
    segments = segments_of(group)
    if (group%has_value('nodes')) then
      sums = segment_parts(segments%length, group%whole_number('nodes') + 1)
      do i = 1, size(sums)
        parts = (sums(i) + highest_order - 1) / highest_order
        segment = [segment, spread(i, 1, parts)]
        order = [order, spread_evenly(sums(i), parts)]
      end do
      return
    end if
    do i = 1, size(segments%length)
      associate (b => min(frequency, most_phase / sum(segments%wave_time)) * segments%wave_time(i))
        do parts = max(1, int(b / highest_order)), most_nodes
          one = least_order(b / parts, tolerance / segments%flexibility(i))
          if (one <= highest_order) exit
        end do
        one = min(one, highest_order)
        segment = [segment, spread(i, 1, parts)]
        order = [order, spread(one, 1, parts)]
      end associate
    end do
  end subroutine choose_elements

  !> Whether the elements of a shaft are about as the continuous shaft at a frequency.
  pure logical function are_resolved(group, segment, order, frequency)
    type(group_t), intent(in) :: group
    integer, intent(in) :: segment(:), order(:)   !! as from `choose_elements`
    real(wp), intent(in) :: frequency             !! [rad/s]
    real(wp), parameter :: about = 1.0e-2_wp      ! of the states at the ends of the shaft
    type(segments_t) :: segments
    type(spectral_element_t) :: element
    integer :: i

    are_resolved = .true.
    if (.not. frequency > 0) return
    segments = segments_of(group)
    do i = 1, size(order)
      associate (parts => count(segment == segment(i)), share => segments%flexibility(segment(i)) / sum(segments%flexibility))
        element = new_spectral_element(order(i))
        are_resolved = are_resolved .and. element%error(frequency * segments%wave_time(segment(i)) / parts) * share <= about
      end associate
    end do
  end function are_resolved

  !> The orders or parts of the segments whose sum is given, the more the longer they are.
  pure function segment_parts(lengths, total) result(orders)
    real(wp), intent(in) :: lengths(:)   !! of the segments [m]
    integer, intent(in) :: total         !! at least as many as the segments
    integer :: orders(size(lengths))
    integer :: i, longest

    orders = 1
    do i = 1, total - size(lengths)
      longest = maxloc(lengths / orders, dim=1)
      orders(longest) = orders(longest) + 1
    end do
  end function segment_parts

  !> A whole number as the sum of some that differ by at most one.
  pure function spread_evenly(total, parts) result(list)
    integer, intent(in) :: total, parts
    integer :: list(parts)
    integer :: i

    list = [(total / parts + merge(1, 0, i <= modulo(total, parts)), i=1, parts)]
  end function spread_evenly

end module nocdyn_shaft_segments
