!> Motions of a linear machine that stay as they are while its numbers change: what the machine makes of them is differentiated,
!> with the first-order change of an eigenvalue or of a response as the result.
module nocdyn_frozen_motions
  use nocdyn_element_coordinates, only: element_coordinates_t, new_element_coordinates
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_slopes, only: slopes_t
  implicit none (type, external)
  private

  public :: eigenvalue_change, new_frame, new_view

  !> The structure of the machine in which the motions are.
  type, public :: frame_t
    type(element_coordinates_t) :: incidence        !! twists of the elements by the coordinates
    integer, allocatable :: first(:), coordinate(:) !! angles of the bodies by the coordinates, as in `coordinates_t` ...
    real(wp), allocatable :: ratio(:)               !! ... and their ratios, [entries]
  end type frame_t

  !> A changed machine as the motions see it.
  type, public :: view_t
    logical :: is_alike = .true.            !! whether it has the same coordinates and elements
    logical :: has_same_ratios = .true.     !! whether a motion has the same twists and angles in it
    real(wp), allocatable :: twist_ratio(:) !! ratios of the incidence beyond those of the frame, [entries]
    real(wp), allocatable :: angle_ratio(:) !! the same of the bodies, [entries]
  contains
    procedure :: more_twist, more_angle
  end type view_t

  !> A motion: of coordinates, of the twists of elements, of bodies.
  type, public :: frozen_motion_t
    complex(wp), allocatable :: x(:), twist(:), angle(:)
  contains
    procedure :: form, form_of_slope, form_of_frequency
  end type frozen_motion_t

contains

  !> The structure of a machine.
  type(frame_t) function new_frame(machine) result(self)
    type(machine_t), intent(in) :: machine   !! one lane

    self%incidence = new_element_coordinates(machine%elements, machine%coordinates)
    associate (map => machine%coordinates)
      allocate (self%first, source=map%first)
      allocate (self%coordinate, source=map%coordinate)
      allocate (self%ratio, source=map%ratio(1, :))
    end associate
  end function new_frame

  !> What differs in a changed machine.
  type(view_t) function new_view(frame, machine) result(self)
    type(frame_t), intent(in) :: frame
    type(machine_t), intent(in) :: machine   !! one lane
    type(element_coordinates_t) :: incidence

    incidence = new_element_coordinates(machine%elements, machine%coordinates)
    associate (map => machine%coordinates)
      self%is_alike = size(incidence%first) == size(frame%incidence%first) .and. &
                      size(incidence%coordinate) == size(frame%incidence%coordinate) .and. &
                      size(map%first) == size(frame%first) .and. size(map%coordinate) == size(frame%coordinate)
      if (self%is_alike) self%is_alike = all(incidence%coordinate == frame%incidence%coordinate) .and. &
                                         all(map%coordinate == frame%coordinate)
      if (.not. self%is_alike) return
      allocate (self%twist_ratio, source=incidence%ratio(1, :) - frame%incidence%ratio(1, :))
      allocate (self%angle_ratio, source=map%ratio(1, :) - frame%ratio)
    end associate
    self%has_same_ratios = .not. (any(abs(self%twist_ratio) > 0) .or. any(abs(self%angle_ratio) > 0))
  end function new_view

  !> The twists of a motion of coordinates beyond those in the frame.
  pure function more_twist(self, frame, x) result(twist)
    class(view_t), intent(in) :: self
    type(frame_t), intent(in) :: frame
    complex(wp), intent(in) :: x(:)
    complex(wp) :: twist(size(frame%incidence%first) - 1)
    integer :: e, k

    twist = (0.0_wp, 0.0_wp)
    if (self%has_same_ratios) return
    do e = 1, size(twist)
      do k = frame%incidence%first(e), frame%incidence%first(e + 1) - 1
        twist(e) = twist(e) + self%twist_ratio(k) * x(frame%incidence%coordinate(k))
      end do
    end do
  end function more_twist

  !> The angles of a motion of coordinates beyond those in the frame.
  pure function more_angle(self, frame, x) result(angle)
    class(view_t), intent(in) :: self
    type(frame_t), intent(in) :: frame
    complex(wp), intent(in) :: x(:)
    complex(wp) :: angle(size(frame%first) - 1)
    integer :: b, k

    angle = (0.0_wp, 0.0_wp)
    if (self%has_same_ratios) return
    do b = 1, size(angle)
      do k = frame%first(b), frame%first(b + 1) - 1
        angle(b) = angle(b) + self%angle_ratio(k) * x(frame%coordinate(k))
      end do
    end do
  end function more_angle

  !> The bilinear form y^T T(lambda) x of two motions in a changed machine, T the matrix of its modes (`nocdyn_mode_pairs`).
  complex(wp) function form(self, other, frame, view, machine, slopes, value)
    class(frozen_motion_t), intent(in) :: self
    type(frozen_motion_t), intent(in) :: other
    type(frame_t), intent(in) :: frame
    type(view_t), intent(in) :: view
    type(machine_t), intent(in) :: machine
    type(slopes_t), intent(in) :: slopes     !! of the changed machine
    complex(wp), intent(in) :: value         !! lambda [1/s]
    complex(wp) :: stiffness(machine%elements%count)

    call slopes%find_stiffness(machine%elements%internal, value, stiffness)
    form = sum(stiffness * (self%twist + view%more_twist(frame, self%x)) * (other%twist + view%more_twist(frame, other%x))) &
           + value**2 * sum(machine%inertia(1, :) * (self%angle + view%more_angle(frame, self%x)) &
                                                  * (other%angle + view%more_angle(frame, other%x)))
  end function form

  !> The bilinear form y^T T'(lambda) x of two motions in their own machine, in which the relative damping stays as it is.
  complex(wp) function form_of_slope(self, other, machine, slopes, value) result(form)
    class(frozen_motion_t), intent(in) :: self
    type(frozen_motion_t), intent(in) :: other
    type(machine_t), intent(in) :: machine
    type(slopes_t), intent(in) :: slopes
    complex(wp), intent(in) :: value         !! lambda [1/s]
    complex(wp), dimension(machine%elements%count) :: slope, stiffness

    call slopes%find_stiffness(machine%elements%internal, value, stiffness, slope)
    form = sum(slope * self%twist * other%twist) + 2.0_wp * value * sum(machine%inertia(1, :) * self%angle * other%angle)
  end function form_of_slope

  !> The form with the derivative of T by the frequency at which the relative damping is taken, Im(lambda).
  pure complex(wp) function form_of_frequency(self, other, slopes, value) result(form)
    class(frozen_motion_t), intent(in) :: self
    type(frozen_motion_t), intent(in) :: other
    type(slopes_t), intent(in) :: slopes
    complex(wp), intent(in) :: value         !! lambda, imaginary part > 0 [1/s]

    form = -value / aimag(value)**2 * sum(slopes%loss * self%twist * other%twist)
  end function form_of_frequency

  !> The change of an eigenvalue by norm d lambda + turn Im(d lambda) = -form, the forms of its motion with T_lambda, T_omega, dT.
  elemental complex(wp) function eigenvalue_change(norm, turn, form) result(change)
    complex(wp), intent(in) :: norm, turn, form
    real(wp) :: determinant, imaginary, real_part

    associate (a => real(norm, wp), b => real(turn, wp) - aimag(norm), c => aimag(norm), d => real(norm, wp) + aimag(turn))
      determinant = a * d - b * c
      real_part = (b * aimag(form) - d * real(form, wp)) / determinant
      imaginary = (c * real(form, wp) - a * aimag(form)) / determinant
    end associate
    change = cmplx(real_part, imaginary, wp)
  end function eigenvalue_change

end module nocdyn_frozen_motions
