!> A machine with one number changed, for all answers: what changes in it, its laws at two points beside the number.
!>
!> An inertia changes no steady state. A number of couplings and loads that stands in their elements as it is needs no new
!> machine. For all others the machine is assembled.
module nocdyn_number_changes
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_direct_parameters, only: direct_parameters_t, new_direct_parameters
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_frozen_motions, only: frame_t, new_view, view_t
  use nocdyn_frozen_states, only: displacement_t, frozen_state_t, mean_laws_t, new_mean_laws
  use nocdyn_held_speeds, only: held_speeds_t
  use nocdyn_input, only: input_t
  use nocdyn_joint_simplifications, only: has_joint_that_locks
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_varied_keys, only: near_points, set_key, varied_key_t
  implicit none (type, external)
  private

  public :: displacement_of

  !> A changed machine.
  type, public :: changed_machine_t
    logical :: is_assembled = .false.   !! whether `machine` is it; else only laws differ
    type(machine_t) :: machine          !! with its periodic torques
    type(mean_laws_t) :: laws
    type(view_t) :: view
  end type changed_machine_t

  !> One number after the other of an input.
  type, public :: number_change_t
    type(input_t) :: input              !! with the number and its change
    type(varied_key_t) :: key
    real(wp) :: change = 0.0_wp         !! of the number at present
    integer :: body = 0                 !! whose inertia the number is; 0: none
    logical :: moves_start = .false.    !! whether it is an angle at the start
    logical :: is_of_elements = .false.   !! whether it is one of couplings and loads that may stand in them as it is
    logical :: keeps_harmonics = .false.  !! whether no excitation depends on it, but by the steady state
    logical, private :: locks = .true.    !! whether machines with locked joints are others
    logical, private :: is_known(2) = .false.   !! whether machines without, and with locked joints are assembled
    type(machine_t), private :: machines(near_points, 2)
  contains
    procedure :: take, set, change_held, list_machines
    procedure, private :: assemble
  end type number_change_t

contains

  !> Looks at another number.
  subroutine take(self, key, machine)
    class(number_change_t), intent(inout) :: self
    type(varied_key_t), intent(in) :: key
    type(machine_t), intent(in) :: machine   !! of the input
    character(len=:), allocatable :: name
    integer :: b
    logical :: is_inertia

    self%key = key
    self%is_known = .false.
    self%locks = has_joint_that_locks(self%input)
    self%body = 0
    associate (group => self%input%groups(key%target%group))
      name = trim(key_rules(first_key(group%rule) + key%target%key - 1)%name)
      self%is_of_elements = (group%kind == 'coupling' .or. group%kind == 'load') .and. &
                            any(name == [character(len=15) :: 'stiffness', 'cubic_stiffness', 'damping', 'viscous', 'quadratic'])
      self%keeps_harmonics = any(group%kind == [character(len=8) :: 'coupling', 'shaft', 'damper'])
      is_inertia = group%kind == 'body' .and. name == 'inertia'
      if (is_inertia) is_inertia = .not. group%number('entrained', absent=0.0_wp) > 0
      if (is_inertia) then
        self%body = findloc(self%input%groups_named('body'), key%target%group, dim=1)
        do b = 1, size(machine%banks)
          associate (bank => machine%banks(b)%bank)
            if (bank%has_parts .or. bank%moving_rows > 0 .or. bank%follows_inertias) self%body = 0
          end associate
        end do
      end if
      self%moves_start = group%kind == 'body' .and. name == 'angle'
    end associate
  end subroutine take

  !> Changes the number in the input.
  subroutine set(self, change)
    class(number_change_t), intent(inout) :: self
    real(wp), intent(in) :: change

    call set_key(self%input, self%key, change)
    self%change = change
  end subroutine set

  !> Gives steady states the number of their elements, if it stands in these as it is.
  subroutine change_held(self, held, is_changed)
    class(number_change_t), intent(in) :: self
    type(held_speeds_t), intent(inout) :: held
    logical, intent(out) :: is_changed
    type(direct_parameters_t) :: place

    is_changed = self%is_of_elements
    if (.not. is_changed) return
    place = new_direct_parameters(self%input, [self%key%target], held%balance%formulation%machine, has_started=.true.)
    is_changed = place%are_direct
    if (.not. is_changed) return
    call place%write_elements([self%key%value + self%change], 1, held%balance%formulation%machine)
    call held%balance%formulation%refresh_laws(1)
    call held%forget()
  end subroutine change_held

  !> The machines at the near points, as motions of the frame see them.
  subroutine list_machines(self, laws, holds_speed, frame, near, is_near, error)
    class(number_change_t), intent(inout) :: self
    type(mean_laws_t), intent(in) :: laws          !! of the machine itself
    logical, intent(in) :: holds_speed             !! as of `new_mean_laws`; locked joints are rows then
    type(frame_t), intent(in) :: frame
    type(changed_machine_t), intent(out) :: near(near_points)
    logical, intent(out) :: is_near                !! whether states of the machine itself are states of these, but for moments
    type(error_t), allocatable, intent(out) :: error
    type(direct_parameters_t) :: place
    integer :: p, set

    is_near = .not. self%moves_start
    if (.not. is_near) return
    if (self%is_of_elements) then
      place = new_direct_parameters(self%input, [self%key%target], laws%machine, has_started=.true.)
      if (place%are_direct) then
        do p = 1, near_points
          near(p)%laws = laws
          call place%write_elements([self%key%value + self%key%near(p)], 1, near(p)%laws%machine)
          call near(p)%laws%refresh()
        end do
        return
      end if
    end if
    set = merge(2, 1, holds_speed .and. self%locks)
    if (.not. self%is_known(set)) call self%assemble(set, error)
    if (allocated(error)) return
    do p = 1, near_points
      near(p)%is_assembled = .true.
      near(p)%machine = self%machines(p, set)
      near(p)%view = new_view(frame, near(p)%machine)
      if (.not. near(p)%view%is_alike) then
        call raise(error, exit_failed, 'it changes the coordinates or the nodes of shafts')
        return
      end if
      is_near = is_near .and. near(p)%view%has_same_ratios
      if (allocated(laws%machine%driven_speed)) then
        is_near = is_near .and. .not. any(abs(near(p)%machine%driven_speed - laws%machine%driven_speed) > 0)
      end if
      if (.not. is_near) return
      call new_mean_laws(near(p)%machine, holds_speed, near(p)%laws)
    end do
  end subroutine list_machines

  subroutine assemble(self, set, error)
    class(number_change_t), intent(inout) :: self
    integer, intent(in) :: set   !! without (1) or with (2) locked joints as rows
    type(error_t), allocatable, intent(out) :: error
    integer :: p

    do p = 1, near_points
      call self%set(self%key%near(p))
      call assemble_steady_machine(self%input, set == 2, self%machines(p, set), error, starts=.false.)
      if (allocated(error)) exit
    end do
    call self%set(0.0_wp)
    self%is_known(set) = .not. allocated(error)
  end subroutine assemble

  !> How a steady state moves by a number.
  subroutine displacement_of(frozen, key, laws, near, displacement)
    type(frozen_state_t), intent(in) :: frozen
    type(varied_key_t), intent(in) :: key
    type(mean_laws_t), intent(inout) :: laws                     !! of the machine itself
    type(changed_machine_t), intent(inout) :: near(near_points)
    type(displacement_t), intent(out) :: displacement
    real(wp) :: moment(laws%machine%elements%count), rate(laws%machine%elements%internal%count)
    integer :: p

    moment = 0.0_wp
    rate = 0.0_wp
    do p = 1, near_points
      call near(p)%laws%evaluate_at(frozen)
      call add(near(p)%laws, key%near_weight(p))
    end do
    if (abs(key%near_weight_here) > 0) then
      call laws%evaluate_at(frozen)
      call add(laws, key%near_weight_here)
    end if
    displacement = frozen%move(laws%machine, moment, rate)

  contains

    subroutine add(evaluated, weight)
      type(mean_laws_t), intent(in) :: evaluated
      real(wp), intent(in) :: weight

      associate (elements => evaluated%state%elements)
        moment = moment + weight * (elements%restoring(1, :) + elements%applied(1, :))
        rate = rate + weight * elements%internal%rate(1, :)
      end associate
    end subroutine add

  end subroutine displacement_of

end module nocdyn_number_changes
