!> Tables in files whose first line names their columns: each column becomes the list of a key of the group.
module nocdyn_table_columns
  use nocdyn_diagnostics, only: diagnostics_t
  use nocdyn_errors, only: error_t, exit_file, exit_input
  use nocdyn_input, only: group_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_raw_group, only: raw_group_t
  use nocdyn_schema, only: first_key, key_rules
  use nocdyn_schema_relations, only: relation_t
  use nocdyn_schema_rules, only: key_rule_t
  use nocdyn_schema_units, only: name_in_unit, other_unit
  use nocdyn_table_file, only: read_list_text
  use nocdyn_text, only: append, listed, lower_case, quoted, shortened, shown_path, string_t, to_text
  use nocdyn_text_file, only: path_in, read_text_file
  use nocdyn_value_conversion, only: convert_number
  implicit none (type, external)
  private

  public :: convert_column, read_table_columns

  integer, parameter :: most_messages = 5   ! on numbers of a file

contains

  !> Replaces the file of a relation `columns` by its columns.
  subroutine read_table_columns(folder, relation, raw, group, diagnostics)
    character(len=*), intent(in) :: folder     !! of the input file, with a slash at its end, or ''
    type(relation_t), intent(in) :: relation
    type(raw_group_t), intent(in) :: raw
    type(group_t), intent(inout) :: group
    type(diagnostics_t), intent(inout) :: diagnostics
    type(error_t), allocatable :: error
    type(string_t), allocatable :: messages(:), names(:)
    type(value_t) :: source
    character(len=:), allocatable :: path, text
    real(wp), allocatable :: values(:, :)   ! [columns, rows]
    integer :: code, i, line

    source = group%values(relation%second(1))
    if (.not. allocated(source%texts)) return
    group%values(relation%second(1)) = value_t()
    path = path_in(folder, source%texts(1)%text)
    code = exit_input
    call read_text_file(path, text, error)
    if (allocated(error)) then
      code = exit_file
      allocate (messages(0))
      call append(messages, error%message)
    else
      call read_list_text(text, path, names, line, values, messages)
      if (size(messages) == 0) call take_columns(shown_path(path), line, names, values, relation, group, messages)
    end if
    do i = 1, size(messages)
      call diagnostics%add(source%line, raw%index, raw%keys(relation%second(1))%name() // ': ' // messages(i)%text, &
                           source%override, code)
    end do
    associate (lists => [relation%first, relation%second(2:)])
      do i = 1, size(lists)
        associate (value => group%values(lists(i)))
          if (.not. value%has_any()) cycle
          if (size(messages) > 0) value = value_t()
          value%is_given = source%is_given
          value%line = source%line
          value%override = source%override
        end associate
      end do
    end associate
  end subroutine read_table_columns

  !> Sets the lists of a group to the columns of a file.
  subroutine take_columns(file, line, names, values, relation, group, messages)
    character(len=*), intent(in) :: file               !! its name in messages
    integer, intent(in) :: line                        !! of the names of the columns
    type(string_t), intent(in) :: names(:)             !! of the columns
    real(wp), intent(in) :: values(:, :)               !! [columns, rows]
    type(relation_t), intent(in) :: relation
    type(group_t), intent(inout) :: group
    type(string_t), allocatable, intent(inout) :: messages(:)
    integer, allocatable :: keys(:), lists(:)   ! lists: positions of the keys that may have a column; keys: rows of `key_rules`
    integer :: c, i, unit
    logical :: is_set(size(relation%first) + size(relation%second) - 1)

    allocate (lists, source=[relation%first, relation%second(2:)])
    allocate (keys, source=lists + first_key(group%rule) - 1)
    is_set = .false.
    do c = 1, size(names)
      call find_column(names(c)%text, key_rules(keys), i, unit)
      if (i == 0) then
        call append(messages, file // ':' // to_text(line) // ': ' // quoted(shortened(names(c)%text)) // &
                    ' is no column; allowed: ' // listed(column_names(key_rules(keys)), ', '))
      else if (is_set(i)) then
        call append(messages, file // ':' // to_text(line) // ': the column ' // quoted(names(c)%text) // ' is given twice')
      else
        is_set(i) = .true.
        group%values(lists(i))%numbers = values(c, :)
        group%values(lists(i))%unit = unit
        call convert_column(file // ': ' // names(c)%text, key_rules(keys(i)), unit, group%values(lists(i))%numbers, messages)
      end if
    end do
    associate (n => size(relation%first))
      if (all(is_set(:n))) return
      call append(messages, file // ':' // to_text(line) // ': there is no column ' // &
                  listed(column_names(pack(key_rules(keys(:n)), .not. is_set(:n))), ', ') // '; needed: ' // &
                  listed(column_names(key_rules(keys(:n))), ', '))
    end associate
  end subroutine take_columns

  !> The list, and its unit, whose column has a name.
  pure subroutine find_column(name, rules, list, unit)
    character(len=*), intent(in) :: name
    type(key_rule_t), intent(in) :: rules(:)   !! of the lists
    integer, intent(out) :: list               !! 0 if there is none
    integer, intent(out) :: unit               !! index of `units`, 0: the one of the schema

    do list = 1, size(rules)
      unit = 0
      if (lower_case(name) == name_in_unit(column(rules(list)), unit)) return
      unit = other_unit(rules(list))
      if (lower_case(name) == name_in_unit(column(rules(list)), unit)) return
    end do
    list = 0
    unit = 0
  end subroutine find_column

  !> The rule of a list with the name of its column: one order, not orders.
  elemental type(key_rule_t) function column(rule)
    type(key_rule_t), intent(in) :: rule

    column = rule
    column%name = rule%name(:len_trim(rule%name) - 1)
  end function column

  !> The names of columns, the ones of angles and speeds in degrees and in rpm.
  pure function column_names(rules) result(names)
    type(key_rule_t), intent(in) :: rules(:)   !! of their lists
    type(string_t) :: names(size(rules))
    integer :: i

    do i = 1, size(rules)
      names(i)%text = name_in_unit(column(rules(i)), other_unit(rules(i)))
    end do
  end function column_names

  !> Converts the numbers of a column to the unit of the schema and checks them.
  subroutine convert_column(label, rule, unit, numbers, messages)
    character(len=*), intent(in) :: label       !! file and name, for messages
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit                 !! index of `units`, 0: the one of the schema
    real(wp), intent(inout) :: numbers(:)
    type(string_t), allocatable, intent(inout) :: messages(:)
    character(len=:), allocatable :: message
    real(wp) :: given
    integer :: r

    do r = 1, size(numbers)
      if (size(messages) >= most_messages) return
      given = numbers(r)
      call convert_number(rule, unit, numbers(r), message)
      if (message == '' .and. rule%ascends .and. r > 1) then
        if (numbers(r) <= numbers(max(1, r - 1))) message = ' is not greater than that in the row before'
      end if
      if (message /= '') call append(messages, label // ' = ' // to_text(given) // ' in row ' // to_text(r) // message)
    end do
    if (size(numbers) < rule%fewest) call append(messages, label // ' has ' // to_text(size(numbers)) // &
                                                 ' rows; needed: at least ' // to_text(rule%fewest))
  end subroutine convert_column

end module nocdyn_table_columns
