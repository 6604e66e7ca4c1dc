!> Modes of a linearised machine: eigenvalues, shapes and shares in the energies.
module nocdyn_modes
  use nocdyn_eigenpairs, only: clear_rounding, eigenpairs_t, find_eigenpairs
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  implicit none (type, external)
  private

  public :: fill_bodies, fill_mode, find_modes, list_oscillations, sort_modes

  real(wp), parameter :: pi = acos(-1.0_wp)

  integer, parameter, public :: mode_rigid = 1         !! the machine turns as a whole, without elastic energy
  integer, parameter, public :: mode_oscillating = 2   !! a pair of complex eigenvalues
  integer, parameter, public :: mode_overdamped = 3    !! a real eigenvalue, not positive
  integer, parameter, public :: mode_diverging = 4     !! a positive real eigenvalue

  integer, parameter, public :: mode_internal = 5      !! a real eigenvalue of a governor or of a current, not of the motion

  character(len=*), parameter, public :: kind_names(5) = [character(len=14) :: 'rigid body', 'oscillating', 'overdamped', &
    'diverging', 'internal state']

  !> A mode, or a pair of conjugate complex ones.
  type, public :: mode_t
    integer :: kind = mode_oscillating
    integer :: number = 0                !! of an oscillating mode, 1 at the lowest frequency of all
    integer :: internal = 0              !! the internal state that takes part most, if they do more than the motion
    complex(wp) :: eigenvalue = 0.0_wp   !! imaginary part >= 0 [1/s]
    real(wp) :: undamped = 0.0_wp        !! frequency of the most similar undamped mode, negative if that diverges; of
                                         !! no meaning for an internal state [Hz]
    complex(wp), allocatable :: shape(:)    !! motion of the bodies, scaled to 1 at the largest, [bodies]
    real(wp), allocatable :: kinetic(:)     !! share of each body in the kinetic energy, [bodies]
    real(wp), allocatable :: potential(:)   !! share of each elastic element in the potential energy, negative if its
                                                  !! stiffness is; the absolute shares add up to 1
  contains
    procedure :: frequency, damping_ratio, time_constant, is_unstable
  end type mode_t

contains

  !> What is compared with measured frequencies: those modes that oscillate.
  pure subroutine list_oscillations(modes, numbers, frequencies, dampings)
    type(mode_t), intent(in) :: modes(:)
    integer, allocatable, intent(out) :: numbers(:)        !! [oscillating modes]
    real(wp), allocatable, intent(out) :: frequencies(:)   !! damped [rad/s]
    real(wp), allocatable, intent(out) :: dampings(:)      !! damping ratios
    integer :: i, k, n

    n = count(modes%kind == mode_oscillating)
    allocate (numbers(n), frequencies(n), dampings(n))
    k = 0
    do i = 1, size(modes)
      if (modes(i)%kind /= mode_oscillating) cycle
      k = k + 1
      numbers(k) = modes(i)%number
      frequencies(k) = aimag(modes(i)%eigenvalue)
      dampings(k) = modes(i)%damping_ratio()
    end do
  end subroutine list_oscillations

  !> Computes the modes, in this order: rigid motions, oscillations by frequency, real eigenvalues by absolute value.
  subroutine find_modes(formulation, linear, elastic, modes, error)
    class(formulation_t), intent(in) :: formulation
    type(linearisation_t), intent(in) :: linear
    integer, intent(in) :: elastic(:)   !! elements whose shares in the potential energy are wanted
    type(mode_t), allocatable, intent(out) :: modes(:)
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    complex(wp), allocatable :: twists(:, :)
    type(eigenpairs_t) :: pairs
    integer :: i, n
    real(wp) :: rigid_part
    real(wp), allocatable :: angles(:, :)

    call find_eigenpairs(linear, pairs, error)
    if (allocated(error)) return
    ! twists of the elastic elements, from the eigenvectors (p, e, internal states)
    n = size(linear%natural)
    allocate (angles(size(elastic), size(linear%flexible)))
    do i = 1, size(linear%flexible)
      angles(:, i) = linear%twists(elastic, linear%flexible(i)) / abs(linear%natural(linear%flexible(i)))
    end do
    twists = matmul(cmplx(angles, kind=wp), pairs%vector(n + 1:n + size(linear%flexible), :))
    allocate (modes(size(pairs%value)))
    do i = 1, size(modes)
      associate (rates => pairs%vector(:n, i))
        modes(i)%undamped = linear%natural(maxloc(abs(rates), dim=1)) / (2.0_wp * pi)
        rigid_part = 1.0_wp - sum(abs(rates(linear%flexible))**2) / max(sum(abs(rates)**2), tiny(1.0_wp))
      end associate
      modes(i)%internal = pairs%internal(i)
      call fill_mode(linear%stiffness(elastic), pairs%value(i), rigid_part, twists(:, i), modes(i))
      call fill_bodies(formulation, pairs%speeds(:, i), modes(i))
    end do
    call sort_modes(modes)
  end subroutine find_modes

  !> Sets the eigenvalue, the kind and the potential energies of a mode.
  subroutine fill_mode(stiffness, eigenvalue, rigid_part, twist, mode)
    real(wp), intent(in) :: stiffness(:)    !! k of the elastic elements [N m/rad], [elastic]
    complex(wp), intent(in) :: eigenvalue   !! [1/s]
    real(wp), intent(in) :: rigid_part      !! of the kinetic energy, 0 to 1
    complex(wp), intent(in) :: twist(:)     !! of the elastic elements, of any size, [elastic]
    type(mode_t), intent(inout) :: mode     !! with `internal`

    mode%eigenvalue = eigenvalue
    mode%potential = stiffness * abs(twist)**2
    if (sum(abs(mode%potential)) > 0.0_wp) mode%potential = mode%potential / sum(abs(mode%potential))
    if (aimag(eigenvalue) > 0.0_wp) then
      mode%kind = mode_oscillating
    else if (mode%internal > 0) then
      mode%kind = mode_internal
    else if (rigid_part > 0.5_wp) then
      mode%kind = mode_rigid
    else if (real(eigenvalue, wp) > 0.0_wp) then
      mode%kind = mode_diverging
    else
      mode%kind = mode_overdamped
    end if
  end subroutine fill_mode

  !> Sets shape and kinetic energies of the bodies.
  subroutine fill_bodies(formulation, speeds, mode)
    class(formulation_t), intent(in) :: formulation
    complex(wp), intent(in) :: speeds(:)   !! of the coordinates, of any size
    type(mode_t), intent(inout) :: mode
    real(wp) :: size_of(formulation%machine%bodies)

    associate (map => formulation%machine%coordinates)
      mode%shape = cmplx(map%body_speeds(1, real(speeds, wp)), map%body_speeds(1, aimag(speeds)), wp)
    end associate
    call clear_rounding(mode%shape)
    size_of = abs(mode%shape)
    mode%kinetic = formulation%machine%inertia(1, :) * size_of**2
    associate (total => sum(mode%kinetic), largest => mode%shape(maxloc(size_of, dim=1)))
      if (total <= 0.0_wp) return
      mode%kinetic = mode%kinetic / total
      mode%shape = mode%shape / largest
    end associate
    call clear_rounding(mode%shape)
  end subroutine fill_bodies

  !> Brings the modes into the order in which they are reported.
  subroutine sort_modes(modes)
    type(mode_t), allocatable, intent(inout) :: modes(:)
    real(wp) :: value(size(modes))
    integer :: i, rank
    type(mode_t), allocatable :: sorted(:)

    value = merge(aimag(modes%eigenvalue), abs(modes%eigenvalue), modes%kind == mode_oscillating)
    allocate (sorted(size(modes)))
    do i = 1, size(modes)
      rank = 1 + count(modes%kind < modes(i)%kind) + count(modes%kind == modes(i)%kind .and. value < value(i)) &
             + count(modes(:i - 1)%kind == modes(i)%kind .and. abs(value(:i - 1) - value(i)) <= 0.0_wp)
      associate (mode => modes(i), place => sorted(rank))
        place%kind = mode%kind
        if (mode%kind == mode_oscillating) place%number = rank - count(modes%kind < mode_oscillating)
        place%internal = mode%internal
        place%eigenvalue = mode%eigenvalue
        place%undamped = mode%undamped
        call move_alloc(mode%shape, place%shape)
        call move_alloc(mode%kinetic, place%kinetic)
        call move_alloc(mode%potential, place%potential)
      end associate
    end do
    call move_alloc(sorted, modes)
  end subroutine sort_modes

  !> Frequency of the damped oscillation [Hz].
  pure real(wp) function frequency(self)
    class(mode_t), intent(in) :: self

    frequency = aimag(self%eigenvalue) / (2.0_wp * pi)
  end function frequency

  !> -Re/|.| of the eigenvalue: 1 if the mode decays without oscillation, negative if it grows, 0 if the eigenvalue is 0.
  pure real(wp) function damping_ratio(self)
    class(mode_t), intent(in) :: self

    damping_ratio = 0.0_wp
    if (abs(self%eigenvalue) > 0.0_wp) damping_ratio = (0.0_wp - real(self%eigenvalue, wp)) / abs(self%eigenvalue)   ! not -0
  end function damping_ratio

  !> Time in which the mode decays by the factor e [s], negative if it grows; huge if it does neither.
  pure real(wp) function time_constant(self)
    class(mode_t), intent(in) :: self

    time_constant = huge(1.0_wp)
    if (abs(real(self%eigenvalue, wp)) > 0.0_wp) time_constant = -1.0_wp / real(self%eigenvalue, wp)
  end function time_constant

  !> Whether the mode grows.
  pure logical function is_unstable(self)
    class(mode_t), intent(in) :: self

    is_unstable = real(self%eigenvalue, wp) > 0.0_wp
  end function is_unstable

end module nocdyn_modes
