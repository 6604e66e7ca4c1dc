!> Machines of inputs, as analyses get them.
module nocdyn_test_input_machines
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input_text
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: read_steady_machine

  !> Two masses on a damped spring, for closed forms.
  type, public :: two_masses_t
    real(wp) :: inertia(2) = [2.0_wp, 3.0_wp]   !! J [kg m2]
    real(wp) :: stiffness = 1200.0_wp           !! k [N m/rad]
    real(wp) :: damping = 6.0_wp                !! d [N m s/rad]
    real(wp) :: amplitude = 50.0_wp             !! M of a torque of order 1 on the first mass [N m]
  contains
    procedure :: natural, damping_ratio, moment
  end type two_masses_t

  !> These in an input; responses are over the speed of the first mass.
  character(len=*), parameter, public :: two_masses = &
    "&body name='a' inertia=2 / &body name='b' inertia=3 / &coupling name='k' bodies='a','b' stiffness=1200 damping=6 / " // &
    "&excitation name='x' body='a' kind='orders' orders=1 amplitudes=50 / &run t_end=1 / "

contains

  subroutine read_steady_machine(text, input, machine)
    character(len=*), intent(in) :: text
    type(input_t), intent(out) :: input
    class(machine_t), allocatable, intent(out) :: machine
    type(error_t), allocatable :: error

    allocate (machine)
    call read_input_text(text, 'm.nml', [string_t ::], input, error)
    if (.not. allocated(error)) call assemble_steady_machine(input, .true., machine, error)
    if (allocated(error)) error stop error%message
  end subroutine read_steady_machine

  !> Frequency of the undamped mode [rad/s].
  pure real(wp) function natural(self)
    class(two_masses_t), intent(in) :: self

    natural = sqrt(self%stiffness * sum(self%inertia) / product(self%inertia))
  end function natural

  pure real(wp) function damping_ratio(self)
    class(two_masses_t), intent(in) :: self

    damping_ratio = 0.5_wp * self%damping * self%natural() / self%stiffness
  end function damping_ratio

  !> Amplitude of the moment of spring and damper at a frequency [N m].
  elemental real(wp) function moment(self, frequency)
    class(two_masses_t), intent(in) :: self
    real(wp), intent(in) :: frequency   !! [rad/s]
    complex(wp) :: stiffness

    stiffness = cmplx(self%stiffness, frequency * self%damping, wp)
    associate (reduced => product(self%inertia) / sum(self%inertia))
      moment = self%amplitude * reduced / self%inertia(1) * abs(stiffness / (stiffness - reduced * frequency**2))
    end associate
  end function moment

end module nocdyn_test_input_machines
