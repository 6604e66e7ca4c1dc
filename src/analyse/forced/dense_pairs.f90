!> All oscillating modes of a machine at a steady state, by dense matrices. Of a large machine the highest undamped modes are left
!> out; the damped ones are made exact by the matrix of the whole machine.
module nocdyn_dense_pairs
  use nocdyn_band_pencil, only: band_pencil_t, new_band_pencil
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, new_band_work
  use nocdyn_eigenpairs, only: eigenpairs_t, find_eigenpairs
  use nocdyn_errors, only: error_t
  use nocdyn_internal_modes, only: most_internal, refine_internal
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_linearisation, only: fill_matrix, linearisation_t, undamped_modes
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_pairs, only: masses_times, mode_pairs_t, refine, set_sizes
  use nocdyn_slopes, only: slopes_t
  use nocdyn_undamped_bands, only: band_modes
  implicit none (type, external)
  private

  public :: find_pairs, move_pairs

  integer, parameter, public :: most_modes = 100   !! undamped ones that a large machine has, if the lines reach no further

contains

  !> Finds all from nothing.
  subroutine find_pairs(machine, matrix, slopes, highest, self, error, known)
    type(machine_t), intent(in) :: machine              !! one lane
    type(dynamic_stiffness_t), intent(in) :: matrix     !! of it
    type(slopes_t), intent(in) :: slopes
    real(wp), intent(in) :: highest                     !! frequency of excitation [rad/s]
    type(mode_pairs_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    type(mode_pairs_t), intent(in), optional :: known   !! whose undamped modes serve again if the stiffnesses are the same
    real(wp), parameter :: least = 0.05_wp   ! of the kinetic energy
    type(eigenpairs_t) :: pairs
    integer, allocatable :: kept(:)
    type(band_work_t) :: work
    integer :: m
    logical :: is_exact, is_truncated
    real(wp) :: divergence, elastic

    self%slopes = slopes
    self%highest = highest
    call prepare(machine, matrix, self, error, known)
    if (allocated(error)) return
    call fill_matrix(machine%elements%internal, slopes, self%linear)
    call find_eigenpairs(self%linear, pairs, error)
    if (allocated(error)) return
    kept = pack([(m, m=1, size(pairs%value))], aimag(pairs%value) > 0)
    kept = kept(ascending_order(aimag(pairs%value(kept))))
    call set_sizes(machine, matrix, size(kept), self)
    self%internal = pairs%internal(kept)
    ! The growth of what does not oscillate, by a negative stiffness or a strong negative damping: of positive real eigenvalues
    ! whose motion has elastic energy. A motion of the whole machine is held.
    divergence = min(0.0_wp, minval(self%linear%natural))
    do m = 1, size(pairs%value)
      if (aimag(pairs%value(m)) > 0 .or. .not. real(pairs%value(m), wp) > 0 .or. pairs%internal(m) > 0) cycle
      associate (n => size(self%linear%natural))
        elastic = sum(abs(pairs%vector(n + 1:n + size(self%linear%flexible), m))**2)
        if (elastic > least * sum(abs(pairs%vector(:n, m))**2)) divergence = min(divergence, -real(pairs%value(m), wp))
      end associate
    end do
    self%divergence = divergence
    work = new_band_work(matrix)
    ! those of the first-order system are exact only if it has all undamped modes
    is_truncated = size(self%linear%natural) < matrix%coordinates .and. machine%elements%internal%count <= most_internal
    do m = 1, size(kept)
      self%value(m) = pairs%value(kept(m))
      self%x(:, m) = pairs%speeds(:, kept(m))
      if (is_truncated .and. self%internal(m) > 0) call refine_internal(machine, matrix, work, self, m, is_exact)
      call refine(machine, matrix, work, self, m)
      self%undamped(m) = undamped_of(machine, self, m)
    end do
  end subroutine find_pairs

  !> Finds those that go on from two other states, between which this one is.
  subroutine move_pairs(machine, matrix, before, after, other, share, self, has_failed)
    type(machine_t), intent(in) :: machine              !! one lane
    type(dynamic_stiffness_t), intent(in) :: matrix     !! of it
    type(mode_pairs_t), intent(in) :: before, after
    integer, intent(in) :: other(:)      !! mode of `after` that goes on from each of `before`
    real(wp), intent(in) :: share        !! of `after` in the start, 0 to 1
    type(mode_pairs_t), intent(inout) :: self   !! with the slopes at its state
    logical, intent(out) :: has_failed   !! whether a mode was not found
    type(error_t), allocatable :: error
    type(band_work_t) :: work
    integer :: m
    real(wp) :: turn

    self%highest = before%highest
    call prepare(machine, matrix, self, error, before)
    has_failed = allocated(error)
    if (has_failed) return
    call set_sizes(machine, matrix, size(before%value), self)
    self%internal = before%internal
    self%divergence = min(0.0_wp, minval(self%linear%natural))
    work = new_band_work(matrix)
    do m = 1, size(before%value)
      turn = sign(1.0_wp, sum(real(before%x(:, m) * conjg(after%x(:, other(m))), wp)))
      self%value(m) = (1.0_wp - share) * before%value(m) + share * after%value(other(m))
      self%x(:, m) = (1.0_wp - share) * before%x(:, m) + share * turn * after%x(:, other(m))
      call refine(machine, matrix, work, self, m, has_failed)
      if (has_failed) return
      self%undamped(m) = undamped_of(machine, self, m)
    end do
  end subroutine move_pairs

  !> The undamped modes at a state.
  subroutine prepare(machine, matrix, self, error, known)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(mode_pairs_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    type(mode_pairs_t), intent(in), optional :: known
    type(band_pencil_t) :: pencil
    integer :: none(0)
    logical :: is_known

    is_known = present(known)
    if (is_known) is_known = all(abs(known%slopes%stiffness - self%slopes%stiffness) <= 0)
    if (present(known)) self%numbers = known%numbers
    if (is_known) then
      self%linear = known%linear
    else if (self%numbers(2) > 0) then
      call new_band_pencil(machine, matrix%incidence, self%slopes%stiffness, none, pencil, error)
      if (.not. allocated(error)) call band_modes(pencil, self%numbers(1), self%numbers(2), none, self%linear, error)
    else
      call undamped_modes(machine, matrix%incidence, self%slopes%stiffness, self%linear, error)
      if (.not. allocated(error)) call leave_out_highest(self%highest, self%linear)
    end if
  end subroutine prepare

  !> Leaves out the highest modes of a large machine.
  subroutine leave_out_highest(highest, linear)
    real(wp), intent(in) :: highest   !! frequency of excitation [rad/s]
    type(linearisation_t), intent(inout) :: linear
    real(wp), parameter :: beyond = 1.5_wp   ! of the highest frequency
    integer :: n

    n = max(most_modes, count(linear%natural <= beyond * highest))
    if (n >= size(linear%natural)) return
    linear%shapes = linear%shapes(:, :n)
    linear%twists = linear%twists(:, :n)
    linear%natural = linear%natural(:n)
    linear%flexible = pack(linear%flexible, linear%flexible <= n)
  end subroutine leave_out_highest

  !> The natural frequency of the undamped mode with most of the kinetic energy.
  real(wp) function undamped_of(machine, self, m) result(natural)
    type(machine_t), intent(in) :: machine
    type(mode_pairs_t), intent(in) :: self
    integer, intent(in) :: m
    complex(wp) :: momentum(size(self%x, 1))
    real(wp), parameter :: most = 0.6_wp   ! of the kinetic energy, of which no other mode can have so much
    integer :: k
    real(wp) :: largest, part

    momentum = masses_times(machine, self%x(:, m))
    k = minloc(abs(self%linear%natural - abs(self%value(m))), dim=1)
    natural = self%linear%natural(k)
    if (abs(sum(self%linear%shapes(:, k) * momentum))**2 > most * abs(sum(conjg(self%x(:, m)) * momentum))) return
    natural = 0.0_wp
    largest = -1.0_wp
    do k = 1, size(self%linear%natural)
      part = abs(sum(self%linear%shapes(:, k) * momentum))
      if (part <= largest) cycle
      largest = part
      natural = self%linear%natural(k)
    end do
  end function undamped_of

end module nocdyn_dense_pairs
