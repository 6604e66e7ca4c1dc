!> Notes on elements that do nothing in a run, perhaps by mistake.
module nocdyn_idle_notes
  use nocdyn_input, only: group_t, input_t
  use nocdyn_joint_assembly, only: engagement_at
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: append, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: note_idle_elements

contains

  !> Notes clutches whose engagement is 0 during the whole run, couplings without a law, drives that prescribe no motion, and
  !> torques that begin after its end.
  subroutine note_idle_elements(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: i
    logical :: is_connected

    associate (run => input%groups(input%position('run')))
      do i = 1, size(input%groups)
        associate (group => input%groups(i))
          select case (group%kind)
          case ('clutch')
            if (.not. engages(group, run%number('t_start'), run%number('t_end'))) call append(notes, 'clutch ' // &
              quoted(group%name) // ' does not engage in the run: its engagement is 0 from t = ' // &
              to_text(run%number('t_start')) // ' to ' // to_text(run%number('t_end')) // ' s')
          case ('coupling')
            if (group%made_from == 0 .and. .not. transmits(group)) call append(notes, 'coupling ' // quoted(group%name) // &
              ' transmits nothing: it has no stiffness, table, damping or friction')
          case ('drive')
            if (.not. (group%is_given('speed') .or. group%has_value('table_time') .or. group%has_value('speed_amplitude') .or. &
                group%has_value('angle_amplitude'))) call append(notes, 'drive ' // quoted(group%name) // &
                ' has neither a speed, a ' // 'table nor an amplitude: it holds its body still, as speed = 0 does')
          case ('excitation')
            associate (begin => group%number('start', absent=group%number('time', absent=run%number('t_start'))))
              if (begin >= run%number('t_end')) call append(notes, 'excitation ' // quoted(group%name) // &
                ' has no torque in the run: it begins at t = ' // to_text(begin) // ' s')
            end associate
          case ('motor')
            is_connected = .not. group%has_value('supply_times')
            if (.not. is_connected) is_connected = first_time(group) < run%number('t_end')
            if (.not. is_connected) call append(notes, 'motor ' // quoted(group%name) // &
                ' is not connected in the run: its supply begins at t = ' // to_text(first_time(group)) // ' s')
          case default   ! these have no such mistakes
          end select
        end associate
      end do
    end associate
  end subroutine note_idle_elements

  !> Whether a number of the law of a coupling is not 0.
  logical function transmits(group)
    type(group_t), intent(in) :: group   !! &coupling
    character(len=*), parameter :: keys(*) = [character(len=15) :: 'stiffness', 'cubic_stiffness', 'polynomial', &
                                              'table_moment', 'damping', 'friction']
    integer :: k

    transmits = any([(any(abs(group%numbers(trim(keys(k)))) > 0), k=1, size(keys))])
  end function transmits

  !> Whether the engagement of a clutch is above 0 for some time of a run.
  logical function engages(group, t_start, t_end)
    type(group_t), intent(in) :: group   !! &clutch
    real(wp), intent(in) :: t_start, t_end   !! [s]
    real(wp), allocatable :: looked_at(:), times(:)
    integer :: i

    allocate (times, source=[group%numbers('times'), group%numbers('table_time')])
    looked_at = [t_start, pack(times, times > t_start .and. times < t_end)]
    if (group%has_value('table_time')) looked_at = [looked_at, t_end]   ! a table rises to it
    engages = any([(engagement_at(group, looked_at(i)) > 0, i=1, size(looked_at))])
  end function engages

  !> When the supply of a motor changes first [s].
  real(wp) function first_time(group)
    type(group_t), intent(in) :: group   !! &motor with supply_times
    real(wp), allocatable :: times(:)

    allocate (times, source=group%numbers('supply_times'))
    first_time = times(1)
  end function first_time

end module nocdyn_idle_notes
