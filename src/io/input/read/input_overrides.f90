!> Overrides of the command line, PATH=VALUE.
module nocdyn_input_overrides
  use nocdyn_key_path, only: key_path_t, read_path
  use nocdyn_diagnostics, only: diagnostics_t, no_line
  use nocdyn_namelist, only: item_t, namelist_t
  use nocdyn_namelist_scanner, only: blank_control_characters, scan_value
  use nocdyn_namelist_values, only: longest_list
  use nocdyn_schema, only: holds_texts, key_rules
  use nocdyn_schema_rules, only: a_name, a_number, any_number, key_rule_t
  use nocdyn_text, only: string_t, to_text
  use nocdyn_unit_expressions, only: number_last
  implicit none (type, external)
  private

  public :: read_overrides

  !> One override: its path, of which `target` has the indices of the items too, and as value the items of `namelist`.
  type, extends(key_path_t), public :: override_t
    logical :: is_valid = .false.   !! path and value can be read
    logical :: is_used = .false.    !! its group was found
    type(namelist_t) :: namelist
  end type override_t

contains

  !> Reads all overrides; errors are added for those that cannot be read.
  subroutine read_overrides(texts, overrides, diagnostics)
    type(string_t), intent(in) :: texts(:)
    type(override_t), allocatable, intent(out) :: overrides(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: message
    integer :: equals, i

    allocate (overrides(size(texts)))
    do i = 1, size(texts)
      equals = index(texts(i)%text, '=')
      if (equals == 0) then
        message = 'there is no = in it; write PATH=VALUE'
      else
        call find_key(trim(adjustl(texts(i)%text(:equals - 1))), overrides(i), message)
        if (message == '') call read_value(texts(i)%text(equals + 1:), overrides(i), message)
      end if
      overrides(i)%is_valid = message == ''
      if (message /= '') call diagnostics%add(no_line, 0, message, i)
    end do
  end subroutine read_overrides

  !> Finds the key of a path.
  subroutine find_key(text, override, message)
    character(len=*), intent(in) :: text   !! the path, before the equals sign
    type(override_t), intent(inout) :: override
    character(len=:), allocatable, intent(out) :: message
    type(key_rule_t) :: rule

    if (text == '') then
      message = 'there is no path before the =; write GROUP.KEY=VALUE or GROUP.NAME.KEY=VALUE'
      return
    end if
    call read_path(text, '=VALUE', override%key_path_t, message)
    message = message // override%hint
    if (message /= '') return
    rule = key_rules(override%key_rule)
    if (rule%value_type == a_name) then
      message = 'a name cannot be overridden: other groups refer to it'
    else if (override%is_out_of_range .and. rule%count == 1) then
      message = override%target%key // ' is a single value and takes no subscript'
    else if (override%is_out_of_range) then
      message = 'the subscript of ' // override%target%key // ' is out of range; allowed: 1 to ' // &
                  to_text(merge(rule%count, longest_list, rule%count /= any_number))
    end if
  end subroutine find_key

  !> Scans the value. A single text without quotes, or number with a unit, is taken unchanged: the shell has removed the quotes.
  subroutine read_value(text, override, message)
    character(len=*), intent(in) :: text
    type(override_t), intent(inout) :: override
    character(len=:), allocatable, intent(out) :: message
    type(diagnostics_t) :: diagnostics
    type(key_rule_t) :: rule
    logical :: is_single

    rule = key_rules(override%key_rule)
    is_single = holds_texts(rule%value_type)
    if (rule%value_type == a_number) is_single = verify(adjustl(text(number_last(text) + 1:)), '*,/;!''"') == 1
    if (is_single .and. rule%count == 1 .and. scan(adjustl(text), '''"') /= 1) then
      override%namelist%source = text
      call blank_control_characters(override%namelist%source, diagnostics)
      if (index(text, new_line('a')) > 0) call diagnostics%add(no_line, 0, 'a line end does not belong in a value')
      call override%namelist%append_item(item_t(first=1, last=len(text)))
    else
      call scan_value(text, override%namelist, diagnostics)
    end if
    override%target%last_item = override%namelist%item_count
    message = ''
    if (diagnostics%count > 0) then
      message = diagnostics%list(1)%text
    else if (override%namelist%item_count == 0) then
      message = 'there is no value after the ='
    end if
  end subroutine read_value

end module nocdyn_input_overrides
