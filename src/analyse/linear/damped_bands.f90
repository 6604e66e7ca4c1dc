!> The damped modes of a large machine, from some of its undamped ones.
!>
!> The first-order matrix of a window of neighbouring undamped modes, with the internal states, gives the eigenvalues of the modes
!> in the middle of the window to start with; the modes beside them are there for what damping couples. Inverse iteration on the
!> band matrix of the whole machine makes them exact. As many must be found as there are states; else the windows are widened.
module nocdyn_damped_bands
  use nocdyn_band_pencil, only: band_pencil_t
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, new_band_work
  use nocdyn_eigenpairs, only: eigenpairs_t, find_eigenpairs
  use nocdyn_elements, only: internal_states_t
  use nocdyn_errors, only: error_t
  use nocdyn_internal_modes, only: most_internal, refine_internal
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: fill_matrix, linearisation_t
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_clusters, only: refine_cluster
  use nocdyn_mode_pairs, only: mode_pairs_t, refine, set_sizes
  use nocdyn_slopes, only: slopes_t
  implicit none (type, external)
  private

  public :: find_damped

  !> The modes, oscillating or not.
  type, public :: damped_modes_t
    type(mode_pairs_t) :: pairs                     !! but `speed`, `highest`, `linear` and `divergence`
    real(wp), allocatable :: rigid_part(:)          !! of the kinetic energy, [modes]
    integer, allocatable :: undamped(:)             !! number of the most similar undamped mode, [modes]
    logical, allocatable :: is_exact(:)             !! whether the iteration on the band matrix has converged, [modes]
    logical :: is_complete = .false.                !! whether as many have been found as there are states
  end type damped_modes_t

  !> The start values of one window.
  type :: window_t
    complex(wp), allocatable :: value(:)       ! eigenvalues [1/s], [modes]
    complex(wp), allocatable :: speeds(:, :)   ! [coordinates, modes]
    integer, allocatable :: internal(:)        ! the internal state that a mode mostly is, or 0, [modes]
    integer, allocatable :: undamped(:)        ! [modes]
    real(wp), allocatable :: rigid_part(:)     ! [modes]
  end type window_t

contains

  !> Finds the modes that go on from the given undamped ones.
  subroutine find_damped(machine, pencil, slopes, linear, self, error)
    type(machine_t), intent(in) :: machine              !! one lane
    type(band_pencil_t), intent(in) :: pencil           !! of it
    type(slopes_t), intent(in) :: slopes
    type(linearisation_t), intent(in) :: linear         !! all but `matrix`
    type(damped_modes_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    integer, parameter :: widths(3) = [12, 48, 200]
    type(window_t), allocatable :: windows(:)
    integer :: modes, w, width
    logical :: is_complete

    modes = size(linear%natural)
    do w = 1, size(widths)
      width = merge(modes, widths(w), 2 * widths(w) >= modes)
      call find_starts(machine%elements%internal, slopes, linear, width, windows, is_complete, error)
      if (allocated(error)) return
      if (.not. is_complete .and. width < modes .and. w < size(widths)) cycle
      self = damped_modes_t(is_complete=is_complete)
      self%pairs%slopes = slopes
      self%pairs%locked = pencil%locked
      call refine_all(machine, pencil%matrix, windows, self)
      ! internal states need the flexibility of many modes
      if (width == modes .or. all(self%is_exact .or. self%pairs%internal == 0)) return
    end do
  end subroutine find_damped

  !> The eigenvalues of all windows, and whether they are as many as there are states.
  subroutine find_starts(internal, slopes, linear, width, windows, is_complete, error)
    type(internal_states_t), intent(in) :: internal    !! of the machine
    type(slopes_t), intent(in) :: slopes
    type(linearisation_t), intent(in) :: linear
    integer, intent(in) :: width                       !! undamped modes in the middle of a window
    type(window_t), allocatable, intent(out) :: windows(:)
    logical, intent(out) :: is_complete
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    type(internal_states_t) :: none
    integer :: found, k, modes, states
    integer, allocatable :: ends(:)

    modes = size(linear%natural)
    call divide(linear%natural, width, ends)
    allocate (windows(size(ends) - 1))
    found = 0
    do k = 1, size(windows)
      associate (first => ends(k) + 1, last => ends(k + 1))
        if (internal%count <= most_internal) then
          call solve_window(internal, slopes, linear, [first, last], windows(k), error)
        else
          call solve_window(none, slopes, linear, [first, last], windows(k), error)
        end if
      end associate
      if (allocated(error)) return
      found = found + size(windows(k)%value) + count(aimag(windows(k)%value) > 0)
    end do
    states = modes + size(linear%flexible)
    if (internal%count <= most_internal) states = states + internal%count
    is_complete = found == states
  end subroutine find_starts

  !> Divides the undamped modes into the middles of windows, where neighbours are far from each other.
  pure subroutine divide(natural, width, ends)
    real(wp), intent(in) :: natural(:)            !! ascending [rad/s]
    integer, intent(in) :: width                  !! about as many in one of them
    integer, allocatable, intent(out) :: ends(:)  !! 0, and the last mode of each
    integer :: first, last, k

    ends = [0]
    do while (ends(size(ends)) + width < size(natural))
      first = ends(size(ends)) + max(1, width / 2)
      last = min(ends(size(ends)) + width, size(natural) - 1)
      k = first - 1 + maxloc(natural(first + 1:last + 1) - natural(first:last), dim=1)
      ends = [ends, k]
    end do
    ends = [ends, size(natural)]
  end subroutine divide

  !> The eigenvalues that belong to some undamped modes, from these and half as many on both sides. One that is mostly an internal
  !> state belongs to the window of its frequency.
  subroutine solve_window(internal, slopes, linear, middle, self, error)
    type(internal_states_t), intent(in) :: internal
    type(slopes_t), intent(in) :: slopes
    type(linearisation_t), intent(in) :: linear
    integer, intent(in) :: middle(2)                   !! the first and the last of these modes
    type(window_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    type(eigenpairs_t) :: pairs
    type(linearisation_t) :: part
    integer :: first, i, last, main, modes
    integer, allocatable :: kept(:), mode(:)
    real(wp) :: ends(2)
    real(wp), allocatable :: rigid_part(:)

    modes = size(linear%natural)
    first = max(1, middle(1) - (middle(2) - middle(1) + 1) / 2)
    last = min(modes, middle(2) + (middle(2) - middle(1) + 1) / 2)
    part%shapes = linear%shapes(:, first:last)
    part%twists = linear%twists(:, first:last)
    part%natural = linear%natural(first:last)
    part%flexible = pack(linear%flexible, linear%flexible >= first .and. linear%flexible <= last) - first + 1
    part%stiffness = linear%stiffness
    call fill_matrix(internal, slopes, part)
    call find_eigenpairs(part, pairs, error)
    if (allocated(error)) return
    ends = [0.0_wp, huge(1.0_wp)]
    if (middle(1) > 1) ends(1) = linear%natural(middle(1))
    if (middle(2) < modes) ends(2) = linear%natural(middle(2) + 1)
    allocate (kept(0), mode(size(pairs%value)), rigid_part(size(pairs%value)))
    do i = 1, size(pairs%value)
      associate (rates => pairs%vector(:size(part%natural), i), flexible => part%flexible)
        main = first - 1 + maxloc(abs(rates), dim=1)
        mode(i) = main
        rigid_part(i) = 1.0_wp - sum(abs(rates(flexible))**2) / max(sum(abs(rates)**2), tiny(1.0_wp))
      end associate
      if (pairs%internal(i) == 0 .and. (main < middle(1) .or. main > middle(2))) cycle
      if (pairs%internal(i) > 0 .and. (aimag(pairs%value(i)) < ends(1) .or. aimag(pairs%value(i)) >= ends(2))) cycle
      kept = [kept, i]
    end do
    self = window_t(pairs%value(kept), pairs%speeds(:, kept), pairs%internal(kept), mode(kept), rigid_part(kept))
  end subroutine solve_window

  !> Makes the modes exact.
  subroutine refine_all(machine, matrix, windows, self)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(window_t), intent(in) :: windows(:)
    type(damped_modes_t), intent(inout) :: self    !! with the slopes and what is locked
    type(band_work_t) :: work
    integer :: i, k, m, modes
    logical :: has_failed

    modes = 0
    do k = 1, size(windows)
      modes = modes + size(windows(k)%value)
    end do
    call set_sizes(machine, matrix, modes, self%pairs)
    allocate (self%pairs%internal(modes), self%undamped(modes), self%is_exact(modes), self%rigid_part(modes))
    work = new_band_work(matrix)
    m = 0
    do k = 1, size(windows)
      do i = 1, size(windows(k)%value)
        m = m + 1
        self%pairs%value(m) = windows(k)%value(i)
        self%pairs%x(:, m) = windows(k)%speeds(:, i)
        self%pairs%internal(m) = windows(k)%internal(i)
        self%undamped(m) = windows(k)%undamped(i)
        self%rigid_part(m) = windows(k)%rigid_part(i)
        call refine(machine, matrix, work, self%pairs, m, has_failed)
        self%is_exact(m) = .not. has_failed
      end do
    end do
    do m = 1, modes
      if (self%is_exact(m)) cycle
      if (self%pairs%internal(m) > 0) then
        call refine_internal(machine, matrix, work, self%pairs, m, self%is_exact(m))
      else
        call refine_cluster(machine, matrix, work, self%pairs, m, self%is_exact)
      end if
    end do
  end subroutine refine_all

end module nocdyn_damped_bands
