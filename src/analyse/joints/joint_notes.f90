!> Notes on joints and drives that do nothing in a run, perhaps by mistake.
module nocdyn_joint_notes
  use nocdyn_input, only: group_t, input_t
  use nocdyn_joint_assembly, only: engagement_at
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: append, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: note_idle_joints

contains

  !> Notes clutches whose engagement is 0 during the whole run, and drives that prescribe no motion.
  subroutine note_idle_joints(input, notes)
    type(input_t), intent(in) :: input
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: i

    associate (run => input%groups(input%position('run')))
      do i = 1, size(input%groups)
        associate (group => input%groups(i))
          select case (group%kind)
          case ('clutch')
            if (.not. engages(group, run%number('t_start'), run%number('t_end'))) call append(notes, 'clutch ' // &
              quoted(group%name) // ' does not engage in the run: its engagement is 0 from t = ' // &
              to_text(run%number('t_start')) // ' to ' // to_text(run%number('t_end')) // ' s')
          case ('drive')
            if (.not. has_motion(group)) call append(notes, 'drive ' // quoted(group%name) // ' has neither a speed, a ' // &
              'table nor an amplitude: it holds its body still, as speed = 0 does')
          case default   ! these have no such mistakes
          end select
        end associate
      end do
    end associate
  end subroutine note_idle_joints

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

  !> Whether a drive has keys of a motion.
  pure logical function has_motion(group)
    type(group_t), intent(in) :: group   !! &drive

    has_motion = group%is_given('speed') .or. group%has_value('table_time') .or. group%has_value('speed_amplitude') .or. &
                 group%has_value('angle_amplitude')
  end function has_motion

end module nocdyn_joint_notes
