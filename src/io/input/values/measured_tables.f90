!> Torques and motions that were measured: the table of an &excitation or a &drive from a &measurement.
module nocdyn_measured_tables
  use nocdyn_data_table, only: split_unit
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_input, only: group_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_near_words, only: near_match
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_text, only: append, quoted, shortened, string_t
  use nocdyn_unit_expressions, only: find_conversion, unit_conversion_t
  implicit none (type, external)
  private

  public :: take_measured_tables

contains

  !> Gives each group that names a measurement its times and values as a table, in SI.
  subroutine take_measured_tables(groups, diagnostics)
    type(group_t), intent(inout) :: groups(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: g, m

    do g = 1, size(groups)
      if (groups(g)%rule == 0 .or. .not. allocated(groups(g)%values)) cycle
      if (all(groups(g)%kind /= ['excitation', 'drive     '])) cycle
      if (.not. groups(g)%has_value('measurement')) cycle
      call find_series(groups, g, m, diagnostics)
      if (groups(g)%kind == 'drive' .and. .not. groups(g)%has_value('kind')) m = 0   ! which is reported
      if (m > 0) call take_table(groups(m), g, groups(g), diagnostics)
      groups(g)%values(groups(g)%key_position('measurement')) = value_t()
    end do
  end subroutine take_measured_tables

  !> The measurement that a group names; 0: there is none, which is reported.
  subroutine find_series(groups, g, m, diagnostics)
    type(group_t), intent(in) :: groups(:)
    integer, intent(in) :: g
    integer, intent(out) :: m
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=*), parameter :: needed(*) = [character(len=9) :: 'alignment', 'delay', 'scale', 'offset']
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: wanted
    integer :: k

    allocate (names(0))
    wanted = groups(g)%text('measurement')
    do m = 1, size(groups)
      if (groups(m)%kind /= 'measurement' .or. .not. allocated(groups(m)%values)) cycle
      if (groups(m)%name == wanted) exit
      call append(names, groups(m)%name)
    end do
    if (m > size(groups)) then
      m = 0
      call report(groups(g), g, 'there is no &measurement ' // quoted(shortened(wanted)) // near_match(wanted, names), &
                  diagnostics)
      return
    end if
    if (.not. groups(m)%has_value('kind')) then
      m = 0   ! which is reported, as what follows is
    else if (groups(m)%text('kind') /= 'series') then
      call report(groups(g), g, quoted(wanted) // " is of kind '" // groups(m)%text('kind') // "'; needed: 'series'", diagnostics)
      m = 0
    else if (.not. all([(groups(m)%has_value(trim(needed(k))), k=1, size(needed))])) then
      m = 0
    else if (groups(m)%text('alignment') /= 'given') then
      call report(groups(g), g, 'the delay of ' // quoted(wanted) // ' is found by a run, which it cannot drive; needed: ' // &
                  "alignment = 'given'", diagnostics)
      m = 0
    end if
    if (m == 0) return
    if (.not. (groups(m)%has_value('times') .and. groups(m)%has_value('values'))) m = 0   ! which is reported
  end subroutine find_series

  !> Sets the lists of a table.
  subroutine take_table(measurement, g, group, diagnostics)
    type(group_t), intent(in) :: measurement
    integer, intent(in) :: g   !! index of the group
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(unit_conversion_t) :: conversion
    type(value_t) :: source
    character(len=:), allocatable :: key, message, name, unit
    real(wp), allocatable :: times(:), values(:)

    source = group%values(group%key_position('measurement'))
    key = 'table_torque'
    if (group%kind == 'drive') key = 'table_' // group%text('kind')
    unit = ''
    if (measurement%has_value('signal')) call split_unit(measurement%text('signal'), name, unit)
    if (measurement%has_value('unit')) unit = measurement%text('unit')
    if (unit /= '') then
      call find_conversion(unit, trim(key_rules(first_key(group%rule) + group%key_position(key) - 1)%unit), conversion, message)
      if (message /= '') then
        call report(group, g, 'unit of ' // quoted(measurement%name) // ': ' // message, diagnostics)
        return
      end if
    end if
    times = measurement%numbers('times') + measurement%number('delay')
    values = conversion%convert(measurement%number('scale') * measurement%numbers('values') + measurement%number('offset'))
    call set_list(group%key_position('table_time'), times)
    call set_list(group%key_position(key), values)

  contains

    subroutine set_list(position, numbers)
      integer, intent(in) :: position   !! of the key
      real(wp), intent(in) :: numbers(:)

      group%values(position) = value_t(source%is_given, source%line, source%override)
      allocate (group%values(position)%numbers, source=numbers)
    end subroutine set_list

  end subroutine take_table

  !> Adds a message on the key `measurement` of a group.
  subroutine report(group, g, message, diagnostics)
    type(group_t), intent(in) :: group
    integer, intent(in) :: g   !! its index
    character(len=*), intent(in) :: message
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (place => group%values(group%key_position('measurement')))
      call diagnostics%add(place%line, g, 'measurement: ' // message, place%override)
    end associate
  end subroutine report

end module nocdyn_measured_tables
