!> Changes of a machine that need no new one: an inertia, on which no steady state depends, and numbers of couplings and loads
!> that stand in their elements as they are.
module nocdyn_quick_changes
  use nocdyn_direct_parameters, only: direct_parameters_t, new_direct_parameters
  use nocdyn_held_speeds, only: held_speeds_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_varied_keys, only: varied_key_t
  implicit none (type, external)
  private

  public :: new_quick_change

  type, public :: quick_change_t
    integer :: body = 0                      !! whose inertia the number is; 0: none
    logical :: is_of_elements = .false.      !! whether it is a number of elements
    type(direct_parameters_t), private :: place
  contains
    procedure :: change_held
  end type quick_change_t

contains

  !> What a number is in the machine of an input.
  type(quick_change_t) function new_quick_change(input, key, machine, held) result(self)
    type(input_t), intent(in) :: input
    type(varied_key_t), intent(in) :: key
    type(machine_t), intent(in) :: machine
    type(held_speeds_t), intent(in), optional :: held   !! its steady states; absent: numbers of elements are not sought
    character(len=:), allocatable :: name
    logical :: is_used
    integer :: b

    associate (group => input%groups(key%target%group))
      name = trim(key_rules(first_key(group%rule) + key%target%key - 1)%name)
      select case (group%kind)
      case ('body')
        if (name /= 'inertia' .or. group%number('entrained', absent=0.0_wp) > 0) return
        is_used = .false.
        do b = 1, size(machine%banks)
          associate (bank => machine%banks(b)%bank)
            is_used = is_used .or. bank%has_parts .or. bank%moving_rows > 0 .or. bank%follows_inertias
          end associate
        end do
        if (.not. is_used) self%body = findloc(input%groups_named('body'), key%target%group, dim=1)
      case ('coupling', 'load')
        if (.not. present(held)) return
        if (all(name /= [character(len=15) :: 'stiffness', 'cubic_stiffness', 'damping', 'viscous', 'quadratic'])) return
        self%place = new_direct_parameters(input, [key%target], held%balance%formulation%machine, has_started=.true.)
        self%is_of_elements = self%place%are_direct
      case default   ! what follows from it is not known here
      end select
    end associate
  end function new_quick_change

  !> Gives steady states a number of their elements.
  subroutine change_held(self, value, held)
    class(quick_change_t), intent(in) :: self
    real(wp), intent(in) :: value
    type(held_speeds_t), intent(inout) :: held

    call self%place%write_elements([value], 1, held%balance%formulation%machine)
    call held%balance%formulation%refresh_laws(1)
    call held%forget()
  end subroutine change_held

end module nocdyn_quick_changes
