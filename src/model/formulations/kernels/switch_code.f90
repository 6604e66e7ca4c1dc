!> Code of the switches of a machine: the guards of their branches at a state of eight lanes, for plain steps that end where a
!> branch ends (`nocdyn_plain_steps`).
module nocdyn_switch_code
  use nocdyn_code_layout, only: number_of
  use nocdyn_code_text, only: code_text_t, filled, list_of
  use nocdyn_compiled_code, only: code_part, crossings_part
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_element_laws, only: element_law_t
  use nocdyn_law_code, only: law_code_t, new_law_code
  use nocdyn_law_tape, only: law_tape_t, op_add, op_fixed, op_larger, op_multiply, op_pick, op_reciprocal, op_scale, &
    op_segment, op_shift, op_size, op_square_root, op_subtract
  use nocdyn_law_work, only: new_law_work
  use nocdyn_laws, only: law_t
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_reduced_series, only: reduced_series_t
  implicit none (type, external)
  private

  public :: followed_switches, switching_banks, write_switch_code, write_passes

  integer, parameter :: most_switches = 64   ! more would end nearly every step of some lane
  integer, parameter :: known(9) = [op_fixed, op_add, op_subtract, op_multiply, op_shift, op_scale, op_reciprocal, &
                                    op_square_root, op_larger]   ! operations of guards that have code
  integer, parameter :: arithmetic(8) = [op_pick, op_segment, op_add, op_subtract, op_multiply, op_shift, op_scale, &
                                         op_size]   ! of constants
  character(len=*), parameter :: far = '1.7976931348623157e308'   ! huge

  !> The switches of a bank.
  type :: switch_bank_t
    integer :: number = 0                !! of the bank in the machine
    integer :: in_code = 0               !! its number in the code, from 1; 0 if it has none
    integer :: elements = 0              !! of the bank
    integer :: switches = 0              !! of each of them
    integer :: first = 0                 !! its first switch, from 0
    integer :: place = 0                 !! of its first element among all that switches look at, from 0
    logical :: changes = .false.         !! whether there is code that changes its branches
  end type switch_bank_t

contains

  !> The numbers of the banks of a machine that have switches.
  pure function switching_banks(state) result(banks)
    type(machine_state_t), intent(in) :: state
    integer, allocatable :: banks(:)
    integer :: i

    banks = pack([(i, i=1, size(state%banks))], [(size(state%banks(i)%branch, 2) > 0, i=1, size(state%banks))])
  end function switching_banks

  !> Banks with switches, in the order of `nocdyn_switches`. A bank without a law has no number in the code.
  pure function list_banks(series, state) result(banks)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(switch_bank_t), allocatable :: banks(:)
    integer, allocatable :: numbers(:)
    integer :: i, first, place

    allocate (numbers, source=switching_banks(state))
    allocate (banks(size(numbers)))
    first = 0
    place = 0
    do i = 1, size(banks)
      associate (bank => banks(i), own => state%banks(numbers(i)))
        bank%number = numbers(i)
        bank%first = first
        bank%place = place
        first = first + size(own%branch, 2)
        if (.not. allocated(own%law)) cycle
        bank%in_code = number_in_code(series, numbers(i))
        bank%elements = own%law%law%elements
        bank%switches = size(own%branch, 2) / bank%elements
        place = place + own%law%ports * bank%elements
      end associate
    end do
  end function list_banks

  !> The number in the code, from 1, of a bank of the machine; 0 if it has none.
  pure integer function number_in_code(series, bank) result(number)
    type(reduced_series_t), intent(in) :: series
    integer, intent(in) :: bank

    do number = size(series%banks%moved) + size(series%banks%timed), 1, -1
      if (number_of(series, number) == bank) return
    end do
  end function number_in_code

  !> The switches of a machine, if there is code for all of them; else 0.
  pure integer function followed_switches(series, state) result(number)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(switch_bank_t), allocatable :: banks(:)
    integer :: i, k

    allocate (banks, source=list_banks(series, state))
    number = 0
    if (any(banks%in_code == 0)) return
    do i = 1, size(banks)
      associate (tape => state%banks(banks(i)%number)%law%law%tape)
        associate (nodes => tape%needed(tape%guard, .false.))
          if (.not. all([(tape%node(nodes(k))%operation < op_fixed .or. any(tape%node(nodes(k))%operation == known), &
                          k=1, size(nodes))])) return
        end associate
      end associate
    end do
    number = sum(banks%elements * banks%switches)
    if (number > most_switches) number = 0
  end function followed_switches

  !> Writes which motion the switches look at.
  subroutine write_switch_tables(series, state, switching, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(element_coordinates_t), intent(in) :: switching   !! of the elements that the switches look at
    type(code_text_t), intent(inout) :: code
    type(switch_bank_t), allocatable :: banks(:)
    integer, allocatable :: components(:), elements(:), first(:)
    integer :: e, i, q

    allocate (banks, source=list_banks(series, state))
    allocate (elements(0), components(0), first(1), source=0)
    do i = 1, size(banks)
      associate (law => state%banks(banks(i)%number)%law)
        elements = [elements, (series%banks%first(banks(i)%number) - 1 + e, e=0, law%ports * banks(i)%elements - 1)]
        do q = 1, banks(i)%switches
          do e = 1, banks(i)%elements
            components = [components, components_of(banks(i), e)]
            first = [first, size(components)]
          end do
        end do
      end associate
    end do
    call code%line('/* Elements that switches look at, their coordinates, and the components of the state that these are */')
    call code%line('static const int switching_element[] = {@};', a=list_of(elements))
    call code%line('static const int switching_first[] = {@};', a=list_of(switching%first - 1))
    call code%line('static const int switching_coordinate[] = {@};', a=list_of(switching%coordinate - 1))
    call code%line('static const int watched_first[] = {@};', a=list_of(first))
    call code%line('static const int watched[] = {@};', a=list_of(components))
    associate (all_of_them => pack([(e, e=0, 2 * series%freedoms + series%internal - 1)], &
                                   [(any(components == e), e=0, 2 * series%freedoms + series%internal - 1)]))
      call code%line('enum { WATCHED = $ };', [size(all_of_them)])
      call code%line('static const int all_watched[] = {@};', a=list_of(all_of_them))
    end associate

  contains

    !> Components, from 0, that the guards of element e of a bank are functions of.
    function components_of(bank, e) result(found)
      type(switch_bank_t), intent(in) :: bank
      integer, intent(in) :: e
      integer, allocatable :: found(:)
      integer :: port

      allocate (found(0))
      associate (law => state%banks(bank%number)%law, tape => state%banks(bank%number)%law%law%tape)
        do port = 1, law%ports
          associate (place => bank%place + (port - 1) * bank%elements + e)
            associate (own => switching%coordinate(switching%first(place):switching%first(place + 1) - 1))
              if (reads(tape, tape%guard, merge(law%speed, law%phase_speed, port == 1))) found = [found, own - 1]
              if (reads(tape, tape%guard, merge(law%angle, law%phase, port == 1))) found = [found, series%freedoms + own - 1]
            end associate
          end associate
        end do
        associate (before => 2 * series%freedoms + series%banks%first_internal(bank%number) - 1 + (e - 1) * law%states)
          found = [found, (before + port, port=0, law%states - 1)]
        end associate
      end associate
    end function components_of

  end subroutine write_switch_tables

  !> Whether nodes read an input of the law.
  pure logical function reads(tape, results, input)
    type(law_tape_t), intent(in) :: tape
    integer, intent(in) :: results(:)   !! nodes
    integer, intent(in) :: input        !! node, 0 if the law has none

    reads = input > 0
    if (reads) reads = any(tape%needed(results, .false.) == input)
  end function reads

  !> Writes the procedures that find crossings and change branches.
  subroutine write_switch_code(series, state, machine, switching, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: switching   !! of the elements that the switches look at
    type(code_text_t), intent(inout) :: code
    type(switch_bank_t), allocatable :: banks(:)
    integer :: i

    allocate (banks, source=list_banks(series, state))
    call write_switch_tables(series, state, switching, code)
    call code%line(code_part(crossings_part))
    do i = 1, size(banks)
      associate (law => state%banks(banks(i)%number)%law, choices => machine%banks(banks(i)%number)%bank%choices)
        call write_guards(series, law, banks(i), code)
        banks(i)%changes = can_change(law%law) .and. all(choices >= 0)
        if (.not. banks(i)%changes) cycle
        call write_choice(series, law, banks(i), choices, code)
        call write_constants(law, banks(i), code)
      end associate
    end do
    call code%line('static void indicators(const pass *p, const vd *y, vd t, vd *g) {')
    do i = 1, size(banks)
      call code%line('  for (int i = 0; i < $; i++) guards$(p, i, y, t, g + $ + i, $);', &
                     [banks(i)%elements, banks(i)%in_code, banks(i)%first, banks(i)%elements])
    end do
    call code%line('}')
    call code%line('static vd indicator(const pass *p, int which, const vd *y, vd t) {')
    call code%line('  vd g[SWITCHES];')
    call write_cases('{ guards$(p, (which - $) % $, y, t, g, 1); return g[(which - $) / $]; }', .true.)
    call code%line('  return t;')
    call code%line('}')
    call code%line('static vl next_branch(const pass *p, int which, const vl lanes, const vd *y, vd t) {')
    call write_cases('return choice$(p, (which - $) % $, (which - $) / $, lanes, y, t);', .false.)
    call code%line('  return (vl){} - 1;')
    call code%line('}')
    call code%line('static void refresh_constants(const pass *p, int which, const vl lanes) {')
    call write_cases('constants$(p, (which - $) % $, lanes);', .false.)
    call code%line('}')

  contains

    !> A statement for the switches of each bank, or of each bank whose branches are changed here.
    subroutine write_cases(statement, is_for_all)
      character(len=*), intent(in) :: statement
      logical, intent(in) :: is_for_all
      integer :: k

      do k = 1, size(banks)
        if (.not. (banks(k)%changes .or. is_for_all)) cycle
        call code%line('  if (which >= $ && which < $)', [banks(k)%first, banks(k)%first + banks(k)%elements * banks(k)%switches])
        call code%line('    ' // statement, [banks(k)%in_code, banks(k)%first, banks(k)%elements, banks(k)%first, &
                                             banks(k)%elements])
      end do
    end subroutine write_cases

  end subroutine write_switch_code

  !> Whether the constants of a law that depend on a branch have code.
  pure logical function can_change(law)
    type(law_t), intent(in) :: law
    integer :: i

    associate (node => law%tape%node)
      can_change = size(law%stacked) == 0 .and. &
                   all([(any(node(law%constants(law%of_branch(i)))%operation == arithmetic), i=1, size(law%of_branch))])
    end associate
  end function can_change

  !> Writes the values of some nodes of the law of element i of a bank.
  subroutine write_values(series, law, bank, results, guards, code)
    type(reduced_series_t), intent(in) :: series
    type(element_law_t), intent(in) :: law
    type(switch_bank_t), intent(in) :: bank
    integer, intent(in) :: results(:)   !! nodes
    type(law_code_t), intent(out) :: guards
    type(code_text_t), intent(inout) :: code
    integer :: i

    associate (tape => law%law%tape)
      guards = new_law_code(bank%in_code - 1, law%law, &
                            new_law_work(tape, tape%needed(results, .false.), 0, law%law%w, law%law%groups), law)
    end associate
    guards%is_local = .true.
    call code%line('  enum { k = 0, g = 1 };')
    call code%line('  const strip *s = p->numbers;')
    call declare_input(law%angle, filled('angle_of(p, y, $ + i)', [bank%place]))
    call declare_input(law%speed, filled('rate_of(p, y, $ + i)', [bank%place]))
    call declare_input(law%phase, filled('angle_of(p, y, $ + i)', [bank%place + bank%elements]))
    call declare_input(law%phase_speed, filled('rate_of(p, y, $ + i)', [bank%place + bank%elements]))
    call declare_input(law%time, 't')
    do i = 1, law%states
      call declare_input(law%state(i), filled('y[2 * FREEDOMS + $ + $ * i]', &
                                              [series%banks%first_internal(bank%number) + i - 2, law%states]))
    end do
    call guards%write_nodes(code)

  contains

    subroutine declare_input(node, value)
      integer, intent(in) :: node
      character(len=*), intent(in) :: value

      if (reads(law%law%tape, results, node)) call code%line('  vd n$[] = {@}; enum { d$ = 0 };', [node, node], value)
    end subroutine declare_input

  end subroutine write_values

  !> Writes the procedure of the lowest guards of the present branches of element i, one for each of its switches.
  subroutine write_guards(series, law, bank, code)
    type(reduced_series_t), intent(in) :: series
    type(element_law_t), intent(in) :: law
    type(switch_bank_t), intent(in) :: bank
    type(code_text_t), intent(inout) :: code
    type(law_code_t) :: guards
    integer :: branch, q

    call code%line('INLINE void guards$(const pass *p, const int i, const vd *y, const vd t, vd *lowest, const long step) {', &
                   [bank%in_code])
    call write_values(series, law, bank, law%law%tape%guard, guards, code)
    call code%line('  vd inside, all;')
    associate (tape => law%law%tape)
      do q = 1, bank%switches
        call code%line('  all = @ + (vd){};', a=far)
        call write_lowest('all', 0)
        call code%line('  lowest[step * $] = all;', [q - 1])
        do branch = 1, maxval([0, tape%guarded_branch])
          if (.not. any(tape%guarded_switch == q .and. tape%guarded_branch == branch)) cycle
          call code%line('  inside = all;')
          call write_lowest('inside', branch)
          call code%line('  lowest[step * $] = choose(p->branch[$ + i] == $, inside, lowest[step * $]);', &
                         [q - 1, bank%first + bank%elements * (q - 1), branch, q - 1])
        end do
      end do
    end associate
    call code%line('}')

  contains

    !> Lowers a number to the guards of a branch, whose boundaries are shifted outwards.
    subroutine write_lowest(name, of_branch)
      character(len=*), intent(in) :: name
      integer, intent(in) :: of_branch
      integer :: k

      associate (tape => law%law%tape)
        do k = 1, size(tape%guard)
          if (tape%guarded_switch(k) /= q .or. tape%guarded_branch(k) /= of_branch) cycle
          call code%line('  EACH @ = smaller(@, @);', a=name, b=name, &
                         c=guards%operand(tape%guard(k)) // ' + ' // guards%constant(tape%guard_shift(k)))
        end do
      end associate
    end subroutine write_lowest

  end subroutine write_guards

  !> Writes the procedure of the branch of switch q of element i that contains a state: the first one whose guards are positive.
  subroutine write_choice(series, law, bank, choices, code)
    type(reduced_series_t), intent(in) :: series
    type(element_law_t), intent(in) :: law
    type(switch_bank_t), intent(in) :: bank
    integer, intent(in) :: choices(:)   !! branches of each switch
    type(code_text_t), intent(inout) :: code
    type(law_code_t) :: guards
    integer :: branch, i, q

    call code%line('static vl choice$(const pass *p, const int i, const int which, const vl lanes, const vd *y, const vd t) {', &
                   [bank%in_code])
    call write_values(series, law, bank, [law%law%tape%guard, law%law%tape%argument], guards, code)
    call code%line('  vd best = -@ + (vd){}, inside;', a=far)
    call code%line('  vl chosen = (vl){} - 1, is_better;')
    associate (tape => law%law%tape)
      do q = 1, bank%switches
        call code%line('  if (which == $) {', [q - 1])
        if (choices(1 + (q - 1) * bank%elements) == 0) then
          call code%line('    const int e = 0;')
          call code%line('    return segments_at(p, $ + i, lanes, @);', [bank%first], guards%operand(tape%argument))
        end if
        do branch = 1, choices(1 + (q - 1) * bank%elements)
          call code%line('    inside = @ + (vd){};', a=far)
          do i = 1, size(tape%guard)
            if (tape%guarded_switch(i) /= q .or. .not. any(tape%guarded_branch(i) == [0, branch])) cycle
            call code%line('    EACH inside = smaller(inside, @);', a=guards%operand(tape%guard(i)))
          end do
          call code%line('    is_better = (inside > best) & ~(best > 0);')
          call code%line('    chosen = choose_integers(is_better, (vl){} + $, chosen);', [branch])
          call code%line('    best = choose(is_better, inside, best);')
        end do
        call code%line('  }')
      end do
    end associate
    call code%line('  return chosen;')
    call code%line('}')
  end subroutine write_choice

  !> Writes the procedure that computes the constants of element i in some lanes that depend on its branches.
  subroutine write_constants(law, bank, code)
    type(element_law_t), intent(in) :: law
    type(switch_bank_t), intent(in) :: bank
    type(code_text_t), intent(inout) :: code
    integer :: c, k

    call code%line('static void constants$(const pass *p, const int i, const vl lanes) {', [bank%in_code])
    call code%line('  const strip *s = p->numbers;')
    call code%line('  double *const constant = (double *)s->constant[$] + W * i;', [bank%in_code - 1])
    call code%line('  vd x;')
    do k = 1, size(law%law%of_branch)
      associate (column => law%law%of_branch(k), tape => law%law%tape)
        associate (node => tape%node(law%law%constants(column)))
          if (node%operation == op_pick) then
            call code%line('  x = (vd){};')
            do c = node%first, node%last
              call code%line('  x = choose(p->branch[$ + i] == $, @, x);', &
                             [bank%first + bank%elements * (node%a - 1), c - node%first + 1], value(tape%list(c)))
            end do
          else if (node%operation == op_segment) then
            call code%line('  x = segment_numbers(p, $ + i, lanes, $);', [bank%first, node%a])
          else if (node%b > 0) then
            call code%line('  x = @ @ @;', a=value(node%a), b=sign_of(node%operation), c=value(node%b))
          else
            call code%line('  x = size(@);', a=value(node%a))
          end if
          call code%line('  replace_constants(p, constant + $ * s->slots[$], lanes, x);', [column - 1, bank%in_code - 1])
        end associate
      end associate
    end do
    call code%line('}')

  contains

    function value(node) result(text)
      integer, intent(in) :: node
      character(len=:), allocatable :: text

      text = filled('load(constant + $ * s->slots[$])', [law%law%column(node) - 1, bank%in_code - 1])
    end function value

    pure character function sign_of(operation)
      integer, intent(in) :: operation

      select case (operation)
      case (op_add, op_shift)
        sign_of = '+'
      case (op_subtract)
        sign_of = '-'
      case default
        sign_of = '*'
      end select
    end function sign_of

  end subroutine write_constants

  !> Writes what begins a step of eight lanes: where the numbers of the switches stand, from one of all numbers on.
  subroutine write_passes(series, state, at, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    integer, intent(in) :: at   !! number of the first array of switches
    type(code_text_t), intent(inout) :: code
    type(switch_bank_t), allocatable :: banks(:)
    integer :: i

    allocate (banks, source=list_banks(series, state))
    call code%line('static void begin_pass(pass *p, const double *const *numbers) {')
    call code%line('  p->ratio = numbers[$] + p->first;', [at])
    do i = 1, size(banks)
      call code%line('  for (int i = 0; i < $; i++)', [banks(i)%elements * banks(i)%switches])
      call code%line('    p->present[$ + i] = (int *)numbers[$] + p->numbers->lanes * i;', [banks(i)%first, at + i])
      call code%line('  for (int i = 0; numbers[$] && i < $; i++)', [at + size(banks) + i, banks(i)%elements])
      call code%line('    p->curve[$ + i] = (const curve *)numbers[$] + p->numbers->lanes * i + p->first;', &
                     [banks(i)%first, at + size(banks) + i])
    end do
    call code%line('  for (int i = 0; i < SWITCHES; i++)')
    call code%line('    p->branch[i] = load_integers(p->present[i] + p->first, p->numbers->left);')
    call code%line('}')
  end subroutine write_passes

end module nocdyn_switch_code
