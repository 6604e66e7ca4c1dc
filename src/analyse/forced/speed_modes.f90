!> The undamped modes of a machine over its speed, followed by their shapes.
!>
!> The tangent stiffnesses depend on the speed with the load. From one speed to the next a mode goes on as the one whose shape is
!> most like it: the squares of phi_i^T M phi_j, with shapes of unit modal mass, are compared (modal assurance criterion).
module nocdyn_speed_modes
  use nocdyn_errors, only: error_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t, mass_matrix, undamped_modes
  use nocdyn_response_points, only: response_point_t
  implicit none (type, external)
  private

  public :: new_speed_modes

  integer, parameter, public :: most_coordinates = 600   !! of a machine whose modes are computed at every speed

  !> The modes with elastic energy, in the order of their frequencies at the first speed.
  type, public :: speed_modes_t
    integer :: modes = 0
    real(wp), allocatable :: natural(:, :)         !! natural frequencies, negative of diverging modes [rad/s], [modes, points]
    real(wp), allocatable :: damping_ratio(:, :)   !! of light damping at these frequencies, [modes, points]
    real(wp), allocatable :: shape(:, :)           !! angles of the bodies at the first point, the largest 1, [bodies, modes]
    real(wp), allocatable :: twists(:, :)          !! of all elements with unit modal mass at the first point, [elements, modes]
    logical :: is_constant = .true.                !! whether all points have the same modes
  end type speed_modes_t

contains

  !> Finds the modes at every point.
  subroutine new_speed_modes(response, self, error)
    type(forced_response_t), intent(in) :: response
    type(speed_modes_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error   !! if LAPACK does not converge
    type(linearisation_t) :: linear, before
    real(wp), allocatable :: mass(:, :)
    integer, allocatable :: branch(:)   ! mode of `linear` of each followed mode
    integer :: i

    associate (points => response%points)
      do i = 1, size(points)
        if (i > 1) then
          if (any(abs(points(i)%state%stiffness - points(i - 1)%state%stiffness) > 0)) self%is_constant = .false.
        end if
        if (i == 1 .or. .not. self%is_constant) then
          call undamped_modes(response%machine, response%matrix%incidence, points(i)%state%stiffness, linear, error)
          if (allocated(error)) return
        end if
        if (i == 1) then
          branch = linear%flexible
          self%modes = size(branch)
          allocate (self%natural(self%modes, size(points)), self%damping_ratio(self%modes, size(points)))
          self%twists = linear%twists(:, branch)
          call set_shapes(response, linear, branch, self%shape)
          mass = mass_matrix(response%machine)
        else if (.not. self%is_constant) then
          call follow(mass, before, linear, branch)
        end if
        self%natural(:, i) = linear%natural(branch)
        call find_damping(response, points(i), linear, branch, self%damping_ratio(:, i))
        if (i == 1 .or. .not. self%is_constant) before = linear
      end do
    end associate
  end subroutine new_speed_modes

  !> The motion of the bodies in each mode.
  subroutine set_shapes(response, linear, branch, shape)
    type(forced_response_t), intent(in) :: response
    type(linearisation_t), intent(in) :: linear
    integer, intent(in) :: branch(:)
    real(wp), allocatable, intent(out) :: shape(:, :)   !! [bodies, modes]
    integer :: m

    allocate (shape(response%machine%bodies, size(branch)))
    do m = 1, size(branch)
      shape(:, m) = response%machine%coordinates%body_speeds(1, linear%shapes(:, branch(m)))
      associate (largest => shape(maxloc(abs(shape(:, m)), dim=1), m))
        if (abs(largest) > 0) shape(:, m) = shape(:, m) / largest
      end associate
    end do
  end subroutine set_shapes

  !> Goes on from the modes at one speed to those at the next one.
  subroutine follow(mass, before, linear, branch)
    real(wp), intent(in) :: mass(:, :)
    type(linearisation_t), intent(in) :: before, linear
    integer, intent(inout) :: branch(:)
    real(wp) :: likeness(size(linear%natural), size(branch)), shapes(size(linear%natural), size(branch))
    integer :: best(2), k

    shapes = before%shapes(:, branch)
    likeness = matmul(transpose(linear%shapes), matmul(mass, shapes))**2
    do k = 1, size(branch)
      best = maxloc(likeness)
      branch(best(2)) = best(1)
      likeness(best(1), :) = -1.0_wp
      likeness(:, best(2)) = -1.0_wp
    end do
  end subroutine follow

  !> Damping ratios from the energy that the elements lose in an undamped oscillation; right if the damping is light.
  subroutine find_damping(response, point, linear, branch, ratio)
    type(forced_response_t), intent(in) :: response
    type(response_point_t), intent(in) :: point
    type(linearisation_t), intent(in) :: linear
    integer, intent(in) :: branch(:)
    real(wp), intent(out) :: ratio(:)   !! [modes]
    real(wp) :: loss
    integer :: e, m

    do m = 1, size(branch)
      associate (natural => abs(linear%natural(branch(m))))
        loss = 0.0_wp
        do e = 1, size(point%state%stiffness)
          loss = loss + aimag(response%complex_stiffness(point%state, e, natural)) * linear%twists(e, branch(m))**2
        end do
        ratio(m) = loss / (2.0_wp * natural**2)
      end associate
    end do
  end subroutine find_damping

end module nocdyn_speed_modes
