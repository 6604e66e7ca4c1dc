!> The numbers of periodic motions that the groups &record ask for.
module nocdyn_recorded_orbits
  use nocdyn_analysis_results, only: analysis_result_t, branch_words, new_orbit_result, of_branch, signal_words
  use nocdyn_column_names, only: choose_signals, explain_no_signal
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_orbit_settings, only: orbit_settings_t, read_orbit_settings
  use nocdyn_orbit_signals, only: list_orbit_signals
  use nocdyn_output_units, only: match_signal, output_units
  use nocdyn_signals, only: signal_t
  use nocdyn_text, only: quoted, string_t
  use nocdyn_units, only: units
  implicit none (type, external)
  private

  public :: new_orbit_reader

  !> What the groups &record can name of the periodic motions of the base machine.
  type, public :: orbit_reader_t
    character(len=:), allocatable :: unit         !! of what changes along the branch
    logical :: holds_speed = .false.              !! whether it is a mean speed that is held
    type(signal_t), allocatable :: signals(:)     !! of orbit.csv
    integer, allocatable :: wanted_units(:)
  contains
    procedure :: read_result
  end type orbit_reader_t

contains

  !> Reads &orbit of the base machine.
  subroutine new_orbit_reader(input, machine, self, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! of the input
    type(orbit_reader_t), intent(out) :: self
    type(error_t), allocatable, intent(out) :: error
    type(orbit_settings_t) :: settings
    type(signal_t), allocatable :: signals(:)
    type(string_t), allocatable :: notes(:)
    integer, allocatable :: chosen(:)

    call read_orbit_settings(input, machine, settings, error)
    if (allocated(error)) return
    self%holds_speed = settings%body > 0
    self%unit = 'rad/s'
    if (settings%mode > 0) self%unit = 'rad'
    if (size(settings%targets) > 0) self%unit = settings%targets(1)%unit
    allocate (notes(0))
    allocate (self%wanted_units, source=output_units(input))
    call list_orbit_signals(machine, signals)
    call choose_signals(input, 'orbit', signals, chosen, notes, error)
    if (.not. allocated(error)) self%signals = signals(chosen)
  end subroutine new_orbit_reader

  !> A result that a &record names by a word, or a mistake.
  subroutine read_result(self, input, record, word, one, diagnostics)
    class(orbit_reader_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: record          !! index of the group
    character(len=*), intent(in) :: word   !! one of its statistics
    type(analysis_result_t), intent(out) :: one
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: allowed, name, reason
    integer :: i, number, unit
    logical :: is_former, matches

    name = trim(adjustl(input%groups(record)%text('orbit')))
    number = 1
    if (input%groups(record)%has_value('number')) number = input%groups(record)%whole_number('number')
    if (name == of_branch) then
      allowed = listed_words(branch_words)
      if (any(branch_words == word)) call new_orbit_result(name, word, number, self%unit, one)
      if (self%holds_speed .and. index(word, 'jump_') == 1) then
        call input%report(record, 'statistic', 'statistic = ' // quoted(word) // ': &orbit holds the mean speed of a body, ' // &
                          "which does not jump; allowed: 'fold'", diagnostics)
        return
      end if
    else
      allowed = listed_words(signal_words)
      matches = .false.
      do i = 1, size(self%signals)
        call match_signal(self%signals(i), name, self%wanted_units, matches, unit, is_former)
        if (matches) exit
      end do
      if (.not. matches) then
        call explain_no_signal(name, self%signals, reason)
        call input%report(record, 'orbit', 'orbit = ' // quoted(name) // " is no signal of orbit.csv, nor 'branch'" // reason, &
                          diagnostics)
        return
      end if
      if (word == 'peak') then
        call new_orbit_result(self%signals(i)%name, word, number, self%signals(i)%unit, one)
        one%in_unit = unit
        if (unit > 0) one%unit = trim(units(unit)%name)
      else if (any(signal_words == word)) then
        call new_orbit_result(self%signals(i)%name, word, number, self%unit, one)
      end if
      one%signal = self%signals(i)
    end if
    if (allocated(one%label)) return
    call input%report(record, 'statistic', 'statistic = ' // quoted(word) // ' does not belong to orbit = ' // quoted(name) // &
                      '; allowed: ' // allowed, diagnostics)
  end subroutine read_result

  !> "'peak', 'peak_value'".
  pure function listed_words(words) result(text)
    character(len=*), intent(in) :: words(:)
    character(len=:), allocatable :: text
    integer :: i

    text = quoted(trim(words(1)))
    do i = 2, size(words)
      text = text // ', ' // quoted(trim(words(i)))
    end do
  end function listed_words

end module nocdyn_recorded_orbits
