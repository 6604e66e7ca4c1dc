!> Code of the switches of a machine: the guards of their branches at a state of eight lanes, for plain steps that end where a
!> branch ends (`nocdyn_plain_steps`).
module nocdyn_switch_code
  use nocdyn_code_layout, only: number_of
  use nocdyn_code_text, only: code_text_t, filled, list_of
  use nocdyn_compiled_code, only: code_part, crossings_part
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_law_code, only: law_code_t, new_law_code
  use nocdyn_law_tape, only: at_phase, op_add, op_fixed, op_larger, op_multiply, op_reciprocal, op_scale, op_shift, &
    op_square_root, op_subtract
  use nocdyn_law_work, only: new_law_work
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_reduced_series, only: reduced_series_t
  implicit none (type, external)
  private

  public :: followed_switches, switching_banks, write_switch_code, write_passes

  integer, parameter :: most_switches = 64   ! more would end nearly every step of some lane
  integer, parameter :: known(9) = [op_fixed, op_add, op_subtract, op_multiply, op_shift, op_scale, op_reciprocal, &
                                    op_square_root, op_larger]   ! operations of guards that have code

  !> The switches of a bank.
  type :: switch_bank_t
    integer :: number = 0                !! of the bank in the machine
    integer :: in_code = 0               !! its number in the code, from 1; 0 if it has none
    integer :: elements = 0              !! of the bank
    integer :: switches = 0              !! of each of them
    integer :: first = 0                 !! its first switch, from 0
    integer :: place = 0                 !! of its first element among all that switches look at, from 0
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
    integer, allocatable :: elements(:)
    integer :: c, e, i
    logical :: is_watched(2 * series%freedoms + series%internal)

    allocate (banks, source=list_banks(series, state))
    allocate (elements(0))
    is_watched = .false.
    is_watched(switching%coordinate) = .true.
    is_watched(series%freedoms + switching%coordinate) = .true.
    do i = 1, size(banks)
      associate (law => state%banks(banks(i)%number)%law)
        elements = [elements, (series%banks%first(banks(i)%number) - 1 + e, e=0, law%ports * banks(i)%elements - 1)]
        associate (first => 2 * series%freedoms + series%banks%first_internal(banks(i)%number))
          is_watched(first:first + law%states * banks(i)%elements - 1) = .true.
        end associate
      end associate
    end do
    call code%line('/* Elements that switches look at, their coordinates, and all components of the state that these are */')
    call code%line('static const int switching_element[] = {@};', a=list_of(elements))
    call code%line('static const int switching_first[] = {@};', a=list_of(switching%first - 1))
    call code%line('static const int switching_coordinate[] = {@};', a=list_of(switching%coordinate - 1))
    call code%line('enum { WATCHED = $ };', [count(is_watched)])
    call code%line('static const int watched[] = {@};', a=list_of(pack([(c - 1, c=1, size(is_watched))], is_watched)))
  end subroutine write_switch_tables

  !> Writes the procedures that find crossings, and the guards of all banks.
  subroutine write_switch_code(series, state, switching, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(element_coordinates_t), intent(in) :: switching   !! of the elements that the switches look at
    type(code_text_t), intent(inout) :: code
    type(switch_bank_t), allocatable :: banks(:)
    integer :: i

    allocate (banks, source=list_banks(series, state))
    call write_switch_tables(series, state, switching, code)
    call code%line(code_part(crossings_part))
    do i = 1, size(banks)
      call write_guards(series, state, banks(i), code)
    end do
    call code%line('static void indicators(const pass *p, const vd *y, vd t, vd *g) {')
    do i = 1, size(banks)
      call code%line('  for (int i = 0; i < $; i++) guards$(p, i, y, t, g + $ + i, $);', &
                     [banks(i)%elements, banks(i)%in_code, banks(i)%first, banks(i)%elements])
    end do
    call code%line('}')
    call code%line('static vd indicator(const pass *p, int which, const vd *y, vd t) {')
    call code%line('  vd g[SWITCHES];')
    do i = 1, size(banks)
      associate (bank => banks(i))
        call code%line('  if (which < $) {', [bank%first + bank%elements * bank%switches])
        call code%line('    guards$(p, (which - $) % $, y, t, g, 1);', [bank%in_code, bank%first, bank%elements])
        call code%line('    return g[(which - $) / $];', [bank%first, bank%elements])
        call code%line('  }')
      end associate
    end do
    call code%line('  return t;')
    call code%line('}')
  end subroutine write_switch_code

  !> Writes the procedure of a bank: the lowest guards of the present branches of element i, one for each of its switches.
  subroutine write_guards(series, state, bank, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(switch_bank_t), intent(in) :: bank
    type(code_text_t), intent(inout) :: code
    type(law_code_t) :: guards
    integer :: i

    associate (law => state%banks(bank%number)%law, tape => state%banks(bank%number)%law%law%tape)
      guards = new_law_code(bank%in_code - 1, law%law, &
                            new_law_work(tape, tape%needed(tape%guard, .false.), 0, law%law%w, law%law%groups), law)
      guards%is_local = .true.
      call code%line('INLINE void guards$(const pass *p, const int i, const vd *y, const vd t, vd *lowest, const long step) {', &
                     [bank%in_code])
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
      call code%line('  for (int q = 0; q < $; q++) lowest[step * q] = 1.7976931348623157e308 + (vd){};', [bank%switches])
      do i = 1, size(tape%guard)
        associate (q => tape%guarded_switch(i) - 1)
          call code%line('  EACH lowest[step * $] = keep_lower(p, $ + i, $, @ + @, lowest[step * $]);', &
                         [q, bank%first + bank%elements * q, tape%guarded_branch(i), q], &
                         guards%operand(tape%guard(i)), guards%constant(tape%guard_shift(i)))
        end associate
      end do
      call code%line('}')
    end associate

  contains

    subroutine declare_input(node, value)
      integer, intent(in) :: node
      character(len=*), intent(in) :: value

      if (node == 0) return
      if (guards%work%first(node) > 0) call code%line('  vd n$[] = {@}; enum { d$ = 0 };', [node, node], value)
    end subroutine declare_input

  end subroutine write_guards

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
      call code%line('    p->branch[$ + i] = load_integers((const int *)numbers[$] + p->numbers->lanes * i + p->first, ' // &
                     'p->numbers->left);', [banks(i)%first, at + i])
    end do
    call code%line('}')
  end subroutine write_passes

end module nocdyn_switch_code
