!> The schema of inputs as a JSON Schema (draft 2020-12), for editors and programs: of an input as f90nml and others read it, an
!> object with a member for each group, which is an object where the group occurs once, else a list of objects; either where it
!> occurs once for each load case.
module nocdyn_input_schema
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: first_key, group_rules, key_rules, last_key, words_of
  use nocdyn_schema_rules, only: a_flag, a_number, a_selector, a_word, an_integer, any_number, any_times, at_least_once, &
    exactly_once, key_rule_t, occurrence_texts, required, topics, unset
  use nocdyn_schema_sentences, only: default_text
  use nocdyn_schema_units, only: name_in_unit, other_unit, takes_units, unit_name
  use nocdyn_text, only: append, string_t
  use nocdyn_units, only: from_si
  use nocdyn_version, only: version
  implicit none (type, external)
  private

  public :: input_schema

  !> Texts of numbers with a unit.
  character(len=*), parameter :: quantity_pattern = '^ *[-+]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eEdDqQ][-+]?[0-9]+)? *[^-+0-9. ].*$'

contains

  !> The text of the schema.
  function input_schema() result(text)
    character(len=:), allocatable :: text
    type(json_t) :: json
    integer :: rule

    call json%open()
    call json%put('$schema', 'https://json-schema.org/draft/2020-12/schema')
    call json%put('title', 'Input of nocdyn')
    call json%put('version', version)
    call json%put('type', 'object')
    call json%put('additionalProperties', .false.)
    call json%open('properties')
    do rule = 1, size(group_rules)
      call put_group(json, rule)
    end do
    call json%close()
    call json%put('required', required_groups())
    call json%close()
    text = json%text()
  end function input_schema

  !> The groups that every input has.
  function required_groups() result(names)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(group_rules)
      if (any(group_rules(i)%occurrence == [exactly_once, at_least_once])) call append(names, trim(group_rules(i)%name))
    end do
  end function required_groups

  subroutine put_group(json, rule)
    type(json_t), intent(inout) :: json
    integer, intent(in) :: rule   !! row of `group_rules`
    integer :: key
    logical :: is_list
    type(string_t), allocatable :: needed(:)

    associate (group => group_rules(rule))
      is_list = group%occurrence == any_times .or. group%occurrence == at_least_once
      call json%open(trim(group%name))
      call json%put('description', trim(group%help))
      call json%put('x-topic', trim(topics(group%topic)%name))
      call json%put('x-occurrence', trim(occurrence_texts(group%occurrence)))
      if (is_list) then
        call json%put('type', 'array')
        call json%open('items')
      end if
      if (any(key_rules(first_key(rule):last_key(rule))%name == 'load_case')) then   ! one more for each load case
        call json%put('type', [string_t('object'), string_t('array')])
        call json%open('items')
        call json%put('$ref', '#/properties/'//trim(group%name))
        call json%put('type', 'object')
        call json%close()
      else
        call json%put('type', 'object')
      end if
      call json%put('additionalProperties', .false.)
      call json%open('properties')
      allocate (needed(0))
      do key = first_key(rule), last_key(rule)
        call put_key(json, key_rules(key), 0)
        if (other_unit(key_rules(key)) > 0) call put_key(json, key_rules(key), other_unit(key_rules(key)))
        ! a key in two units is one of two names, and so no required one
        if (key_rules(key)%default /= required .or. key_rules(key)%only_if /= '' .or. other_unit(key_rules(key)) > 0) cycle
        if (index(default_text(key_rules(key)), 'required') /= 1) cycle
        call append(needed, trim(key_rules(key)%name))
      end do
      call json%close()
      if (size(needed) > 0) call json%put('required', needed)
      if (is_list) call json%close()
      call json%close()
    end associate
  end subroutine put_group

  subroutine put_key(json, rule, unit)
    type(json_t), intent(inout) :: json
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! as in `name_in_unit`

    call json%open(name_in_unit(rule, unit))
    if (unit_name(rule, unit) == '') then
      call json%put('description', trim(rule%help))
    else   ! in the description too, for editors show nothing else
      call json%put('description', trim(rule%help)//' ['//trim(unit_name(rule, unit))//']')
      call json%put('x-unit', unit_name(rule, unit))
    end if
    if (rule%only_if /= '') call json%put('x-only-if', trim(rule%only_if))
    if (rule%default /= required .and. rule%default /= unset .and. unit == 0) call json%put('x-default', trim(rule%default))
    if (rule%count == any_number) then   ! one value may stand without brackets
      call json%open_list('anyOf')
      call json%open()
      call put_type(json, rule, unit)
      call json%close()
      call json%open()
      call put_list(json, rule, unit)
      call json%close()
      call json%close_list()
    else if (rule%count > 1) then
      call put_list(json, rule, unit)
    else
      call put_type(json, rule, unit)
    end if
    call json%close()
  end subroutine put_key

  subroutine put_list(json, rule, unit)
    type(json_t), intent(inout) :: json
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! as in `name_in_unit`

    call json%put('type', 'array')
    if (rule%count /= any_number) call json%put('minItems', rule%count)
    if (rule%count /= any_number) call json%put('maxItems', rule%count)
    if (rule%count == any_number .and. rule%fewest > 0) call json%put('minItems', rule%fewest)
    call json%open('items')
    call put_type(json, rule, unit)
    call json%close()
  end subroutine put_list

  subroutine put_type(json, rule, unit)
    type(json_t), intent(inout) :: json
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! as in `name_in_unit`

    select case (rule%value_type)
    case (a_number)
      if (takes_units(rule, unit)) then
        call json%put('type', [string_t('number'), string_t('string')])
        call json%put('pattern', quantity_pattern)
      else
        call json%put('type', 'number')
      end if
      call put_range(json, rule, unit)
    case (an_integer)
      call json%put('type', 'integer')
      call put_range(json, rule, unit)
    case (a_flag)
      call json%put('type', 'boolean')
    case (a_word, a_selector)
      call json%put('type', 'string')
      call json%put('enum', words_of(rule))
    case default
      call json%put('type', 'string')
    end select
  end subroutine put_type

  subroutine put_range(json, rule, unit)
    type(json_t), intent(inout) :: json
    type(key_rule_t), intent(in) :: rule
    integer, intent(in) :: unit   !! as in `name_in_unit`
    real(wp) :: factor

    factor = 1.0_wp
    if (unit > 0) factor = from_si(1.0_wp, unit)
    associate (allowed => rule%allowed)
      if (allowed%low > -huge(1.0_wp)) then
        if (allowed%excludes_low) then
          call json%put('exclusiveMinimum', factor * allowed%low)
        else
          call json%put('minimum', factor * allowed%low)
        end if
      end if
      if (allowed%high < huge(1.0_wp)) call json%put('maximum', factor * allowed%high)
      if (.not. allowed%excludes_zero) return
      call json%open('not')
      call json%put('const', 0.0_wp)
      call json%close()
    end associate
  end subroutine put_range

end module nocdyn_input_schema
