!> Notes on joints and drives that do nothing in a run, perhaps by mistake.
module nocdyn_joint_notes
  use nocdyn_input, only: group_t, input_t
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
  pure logical function engages(group, t_start, t_end)
    type(group_t), intent(in) :: group   !! &clutch
    real(wp), intent(in) :: t_start, t_end   !! [s]
    real(wp), allocatable :: level(:), time(:)
    integer :: i
    logical :: is_table

    engages = .true.
    is_table = group%has_value('table_time')
    if (.not. (is_table .or. group%has_value('times'))) return
    if (is_table) then   ! with the first level before the first time
      time = [-huge(t_start), group%numbers('table_time'), huge(t_start)]
      level = group%numbers('table_level')
      level = [level(1), level, level(size(level))]
    else
      time = [-huge(t_start), group%numbers('times'), huge(t_start)]
      level = [0.0_wp, group%numbers('levels')]
    end if
    do i = 1, size(time) - 1
      if (time(i) >= t_end .or. time(i + 1) <= t_start) cycle
      if (level(i) > 0) return
      if (is_table .and. level(min(i + 1, size(level))) > 0) return
    end do
    engages = .false.
  end function engages

  !> Whether a drive has keys of a motion.
  pure logical function has_motion(group)
    type(group_t), intent(in) :: group   !! &drive

    has_motion = group%is_given('speed') .or. group%has_value('table_time') .or. group%has_value('speed_amplitude') .or. &
                 group%has_value('angle_amplitude')
  end function has_motion

end module nocdyn_joint_notes
