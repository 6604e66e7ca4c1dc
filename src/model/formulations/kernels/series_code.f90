!> Code of the Taylor recurrence of a machine: what `nocdyn_reduced_series` carries out, as a program in C for blocks of lanes.
!>
!> The code depends on the structure of the machine alone: which elements, laws and maps there are. All numbers are arguments.
!> Consecutive elements with equal terms are loops, so that it stays short however large the machine is.
module nocdyn_series_code
  use nocdyn_code_layout, only: find_laws, first_of, is_forcing, lay_out, layout_t, number_of
  use nocdyn_code_text, only: code_text_t, filled, list_of
  use nocdyn_compiled_code, only: code_part, series_part, steps_part, turns_part
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_element_laws, only: element_law_t
  use nocdyn_law_code, only: law_code_t
  use nocdyn_laws, only: narrow
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_reduced_series, only: reduced_series_t
  use nocdyn_series_terms, only: has_forcing
  use nocdyn_switch_code, only: followed_switches, write_passes, write_switch_code
  implicit none (type, external)
  private

  public :: write_series_code, write_recurrence, code_obstacle

  integer, parameter :: most_elements = 6, most_across = 2   ! numbers side by side: of elements, of lanes
  integer, parameter :: few_elements = 12                    ! of a machine whose lanes are computed side by side
  integer, parameter :: most_unrolled = 1000   ! elements times the square of the order: code of up to about 20 kB without loops

contains

  !> Why the series of a machine have no code, '' if they have.
  function code_obstacle(series) result(text)
    type(reduced_series_t), intent(in) :: series
    character(len=:), allocatable :: text

    text = ''
    if (series%lanes == 1) text = 'blocks of one lane have none'
    if (size(series%with_work) > 0) text = 'work is integrated'
  end function code_obstacle

  !> Writes the program for blocks of lanes. Its procedures are described in `nocdyn_compiled_series`.
  subroutine write_series_code(series, state, machine, switching, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(machine_t), intent(in) :: machine
    type(element_coordinates_t), intent(in) :: switching   !! of the elements that switches look at
    type(code_text_t), intent(inout) :: code
    type(law_code_t), allocatable :: laws(:)
    type(layout_t) :: layout
    integer :: switches

    call code%line('#if defined __AVX512F__ && defined __znver3__   /* so GCC 12 calls a Zen 4; a Zen 3 has no such vectors */')
    call code%line('#pragma GCC target("tune=skylake-avx512")')
    call code%line('#endif')
    call find_laws(series, state, laws)
    call lay_out(series, state, laws, layout)
    layout%is_across = series%elements <= few_elements .and. series%strip >= most_across * narrow
    switches = followed_switches(series, state)
    call code%line('#define SWITCHES $   /* whose crossings are found */', [switches])
    call write_recurrence(series, state, laws, layout, narrow, series%w, code)
    if (switches > 0) then
      call write_switch_code(series, state, machine, switching, code)
      call write_passes(series, state, 4 + 2 * size(laws), code)
    end if
    call write_entries(series, laws, code)
    call code%line(code_part(turns_part))
  end subroutine write_series_code

  !> Writes what computes the series, `expand`.
  subroutine write_recurrence(series, state, laws, layout, lanes, w, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: lanes, w   !! that are computed together; lanes of a strip of the numbers
    type(code_text_t), intent(inout) :: code
    integer :: b

    call code%line('#define P $', [series%order])
    call code%line('#define LANES $', [lanes])
    call code%line('#define W $', [w])
    call code%line('#define ELEMENTS $', [series%elements])
    call code%line('#define FREEDOMS $', [series%freedoms])
    call code%line('#define COMPONENTS $   /* of the state */', [2 * series%freedoms + series%internal])
    call code%line('#define ACROSS $   /* whether numbers side by side are of lanes, not of elements */', &
                   [merge(1, 0, layout%is_across)])
    call code%line('#define MOST $   /* of them */', [merge(most_across, most_elements, layout%is_across)])
    if (layout%is_across .and. series%elements * series%order**2 <= most_unrolled) then
      call code%line('#define UNROLL _Pragma("GCC unroll 64")   /* of loops over coefficients */')
    else
      call code%line('#define UNROLL')
    end if
    call code%line(code_part(series_part))
    call write_data(series, state, laws, layout, code)
    if (lanes > 1) call code%line(code_part(steps_part))
    do b = 1, size(laws)
      call write_bank(series, state%banks(number_of(series, b))%law, laws(b), code)
    end do
    call write_runs(series, layout, code)
    call write_strip(series, state, laws, layout, code)
  end subroutine write_recurrence

  !> Writes the tables and the work space.
  subroutine write_data(series, state, laws, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    integer :: b

    call code%line('static const int twist_column[] = {@};', a=list_of(series%twists%column - 1))
    call code%line('static const int response_column[] = {@};', a=list_of(series%accelerations%column - 1))
    do b = 1, size(laws)
      call laws(b)%declare_tables(code)
    end do
    call code%line('enum {   /* where numbers begin in the work space of eight lanes */')
    call code%line('  at_c, last_c = at_c + (P + 1) * COMPONENTS - 1,')
    call code%line('  at_ratio, last_ratio = at_ratio + $ - 1,', [size(series%twists%column)])
    call code%line('  at_response, last_response = at_response + $ - 1,', [size(series%accelerations%column)])
    call code%line('  at_law, last_law = at_law + $ * ELEMENTS - 1,', [size(series%law, 3)])
    call code%line('  at_moment, last_moment = at_moment + ELEMENTS - 1,')
    call code%line('  at_time, last_time = at_time + P,')
    associate (motions => layout%motion(series%elements + 1), squares => layout%square(series%elements + 1) + 1)
      call code%line('  at_angle, last_angle = at_angle + $ - 1,', [motions])
      call code%line('  at_speed, last_speed = at_speed + $ - 1,', [motions])
      call code%line('  at_square, last_square = at_square + $ - 1,', [squares])
    end associate
    do b = 1, size(laws)
      associate (law => state%banks(number_of(series, b))%law)
        call laws(b)%declare_work(law%state, code)
        if (is_forcing(series, b - 1)) call code%line('  at_forcing$, last_forcing$ = at_forcing$ + $ * P - 1,', &
                                                        [b - 1, b - 1, b - 1, law%law%elements])
      end associate
    end do
    call code%line('  WORK')
    call code%line('};')
    call code%line('typedef struct {')
    call code%line('  long lanes, left, strip;   /* left: lanes from the first one on */')
    call code%line('  const double *law, *ratio, *response, *origin, *t, *y;')
    call code%line('  const double *constant[$], *stacked[$];', [max(size(laws), 1), max(size(laws), 1)])
    call code%line('  long slots[$];', [max(size(laws), 1)])
    call code%line('} strip;')
  end subroutine write_data

  !> Writes the procedure of a bank: it adds the moments of g elements from element i on, and computes coefficients k + 1 of their
  !> internal states; or it sets coefficient k of moments that follow from the time alone.
  subroutine write_bank(series, inputs, law, code)
    type(reduced_series_t), intent(in) :: series
    type(element_law_t), intent(in) :: inputs
    type(law_code_t), intent(in) :: law
    type(code_text_t), intent(inout) :: code
    integer :: i, state

    call code%line('INLINE void bank$(const int g, const int k, const int i, const functions *f, const strip *s, vd *z,', &
                   [law%bank])
    call code%line('                  const elements *u, const elements *phase, vd *r, vd *a, vd *phase_r, vd *phase_a) {')
    call declare_input(inputs%angle, 'u->angle', 'u->dmotion')
    call declare_input(inputs%speed, 'u->speed', 'u->dmotion')
    call declare_input(inputs%phase, 'phase->angle', 'phase->dmotion')
    call declare_input(inputs%phase_speed, 'phase->speed', 'phase->dmotion')
    call declare_input(inputs%time, 'z + at_time', 'ACROSS ? WORK : 0')
    do i = 1, inputs%states
      if (inputs%state(i) > 0) then
        call declare_input(inputs%state(i), filled('z + at_b$n$ + (P + 1) * i', [law%bank, inputs%state(i)]), &
                           'ACROSS ? WORK : P + 1')
      end if
    end do
    call law%write_nodes(code)
    if (is_forcing(series, law%bank)) then
      call code%line('  EACH z[at_forcing$ + P * i + k + (ACROSS ? WORK : P) * e] = @;', [law%bank], &
                     law%operand(inputs%law%tape%applied))
    else
      call add_result('r', inputs%law%tape%restoring)
      call add_result('a', inputs%law%tape%applied)
      call add_result('phase_r', inputs%law%tape%phase_restoring)
      call add_result('phase_a', inputs%law%tape%phase_applied)
    end if
    do i = 1, inputs%states
      state = inputs%state(i)
      call code%line('  EACH {')
      call code%line('    const vd next = (1.0 / (k + 1)) * @;', a=law%operand(inputs%law%tape%rate(i)))
      if (state > 0) call code%line('    n$[k + 1 + d$ * e] = next;', [state, state])
      call code%line('    z[at_c + COMPONENTS * (k + 1) + 2 * FREEDOMS + $ + $ * i + (ACROSS ? WORK : $) * e] = next;', &
                     [first_state(series, law) + i - 1, inputs%states, inputs%states])
      call code%line('  }')
    end do
    call code%line('}')

  contains

    subroutine declare_input(node, address, step)
      integer, intent(in) :: node
      character(len=*), intent(in) :: address, step

      if (node > 0) call code%line('  vd *n$ = @; const long d$ = @;', [node, node], address, step)
    end subroutine declare_input

    subroutine add_result(name, node)
      character(len=*), intent(in) :: name
      integer, intent(in) :: node

      if (node > 0) call code%line('  EACH @[e] = @[e] + @;', a=name, b=name, c=law%operand(node))
    end subroutine add_result

  end subroutine write_bank

  !> The internal states before those of a bank.
  pure integer function first_state(series, law)
    type(reduced_series_t), intent(in) :: series
    type(law_code_t), intent(in) :: law

    first_state = series%banks%first_internal(series%banks%moved(law%bank + 1)) - 1
  end function first_state

  !> The elements from element i of a run on that begins with e.
  function elements_of(series, layout, e) result(text)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: e
    character(len=:), allocatable :: text

    associate (n => layout%entries(e), first => series%twists%first(e) - 1, at => e - 1, motion => layout%motion(e), &
               step => layout%motion(e + 1) - layout%motion(e), square => layout%square(e), &
               square_step => layout%square(e + 1) - layout%square(e))
      text = filled('{$, s->origin + s->lanes * ($ + i), twist_column + $ + $ * i, z + at_ratio + $ + $ * i,', &
                    [n, at, first, n, first, n])
      text = text // filled(' z + at_law + $ + i, z + at_c, z + at_angle + $ + $ * i, z + at_speed + $ + $ * i,', &
                            [at, motion, step, motion, step])
      text = text // filled(' z + at_square + $ + $ * i, ACROSS ? LANES : s->lanes, ACROSS ? 0 : $, ACROSS ? WORK : $,', &
                            [square, square_step, n, n])
      text = text // filled(' ACROSS ? WORK : 1, ACROSS ? WORK : 0, ACROSS ? WORK : $, ACROSS ? WORK : $}', [step, square_step])
    end associate
  end function elements_of

  !> Whether the moment of an element follows from its motion.
  pure logical function has_motion(series, e)
    type(reduced_series_t), intent(in) :: series
    integer, intent(in) :: e

    has_motion = series%terms(e) /= has_forcing
  end function has_motion

  !> Writes the procedures of runs of elements: g of them from element i of the run on. Phases are moved with their elements.
  subroutine write_runs(series, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable :: forcing
    integer :: e, phase, run

    do run = 1, size(layout%first) - 1
      e = layout%first(run)
      associate (bank => layout%bank(e))
        if (has_motion(series, e)) then
          call code%line('INLINE void begin_run$(const int g, const int i, const strip *s, vd *z) {', [run])
          call code%line('  const elements u = @;', a=elements_of(series, layout, e))
          call code%line('  begin_elements(g, $, &u, s->left, ACROSS ? -LANES : 0);', [series%terms(e)])
          call code%line('}')
        end if
        if (layout%is_phase(e)) cycle
        forcing = '0, 0'
        if (is_forcing(series, bank)) forcing = filled('z + at_forcing$ + P * ($ + i), ACROSS ? WORK : P', &
                                                       [bank, e - first_of(series, bank)])
        call code%line('INLINE void run$(const int g, const int k, const int i, const functions *f, const strip *s, vd *z) {', &
                       [run])
        call code%line('  const elements u = @;', a=elements_of(series, layout, e))
        call code%line('  vd r[MOST], a[MOST];')
        call code%line('  move_elements(g, k, $, &u, @, r, a);', [series%terms(e)], forcing)
        phase = 0
        if (bank >= 0 .and. .not. is_forcing(series, bank)) then
          phase = phase_of(e)
          if (phase > 0) then
            call code%line('  const elements phase = @;', a=elements_of(series, layout, phase))
            call code%line('  vd phase_r[MOST], phase_a[MOST];')
            call code%line('  move_elements(g, k, $, &phase, 0, 0, phase_r, phase_a);', [series%terms(phase)])
            call code%line('  bank$(g, k, $ + i, f, s, z, &u, &phase, r, a, phase_r, phase_a);', &
                           [bank, e - first_of(series, bank)])
            call code%line('  EACH z[at_moment + $ + i + (ACROSS ? WORK : 1) * e] = phase_r[e] + phase_a[e];', [phase - 1])
          else
            call code%line('  bank$(g, k, $ + i, f, s, z, &u, 0, r, a, 0, 0);', [bank, e - first_of(series, bank)])
          end if
        end if
        call code%line('  EACH z[at_moment + $ + i + (ACROSS ? WORK : 1) * e] = r[e] + a[e];', [e - 1])
        call code%line('}')
      end associate
    end do

  contains

    !> The phase of an element, 0 if it has none.
    pure integer function phase_of(element)
      integer, intent(in) :: element
      integer :: last

      phase_of = 0
      do last = element, series%elements
        if (layout%bank(last) /= layout%bank(element)) return
        if (layout%is_phase(last)) exit
      end do
      if (last > series%elements) return
      phase_of = last + element - first_of(series, layout%bank(element))
    end function phase_of

  end subroutine write_runs

  !> Writes calls of a procedure for all of n elements.
  subroutine write_calls(layout, n, procedure, arguments, code)
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: n
    character(len=*), intent(in) :: procedure, arguments   !! its name, and arguments without the elements
    type(code_text_t), intent(inout) :: code
    integer :: calls, large, most

    if (layout%is_across) then
      call code%line('  for (int i = 0; i < $; i++) @(g, @);', [n], procedure, arguments)
      return
    end if
    calls = (n + most_elements - 1) / most_elements   ! of `most` or of `most` - 1 elements
    most = (n + calls - 1) / calls
    large = n - calls * (most - 1)
    call code%line('  for (int i = 0; i < $; i += $) @($, @);', [large * most, most, most], procedure, arguments)
    if (large == calls) return
    call code%line('  for (int i = $; i < $; i += $) @($, @);', [large * most, n, most - 1, most - 1], procedure, arguments)
  end subroutine write_calls

  !> Writes what computes coefficients k + 1 of the state.
  subroutine write_coefficient(series, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    integer :: c, last, n, run

    call code%line('INLINE void coefficient(const int g, const int k, const functions *f, const strip *s, vd *z) {')
    do run = 1, size(layout%first) - 1
      if (layout%is_phase(layout%first(run))) cycle
      call write_calls(layout, layout%first(run + 1) - layout%first(run), filled('run$', [run]), 'k, i, f, s, z', code)
    end do
    associate (first => series%accelerations%first)
      c = 1
      do while (c <= series%freedoms)
        last = c
        n = first(c + 1) - first(c)
        do while (last < series%freedoms)
          if (first(last + 2) - first(last + 1) /= n) exit
          last = last + 1
        end do
        call code%line('  for (int i = 0; i < $; i++)', [last - c + 1])
        call code%line('    accelerate(g, k, $ + i, $, z + at_response + $ + $ * i, response_column + $ + $ * i, ' // &
                       'z + at_moment, z + at_c, WORK);', [c - 1, n, first(c) - 1, n, first(c) - 1, n])
        c = last + 1
      end do
    end associate
    call code%line('}')
  end subroutine write_coefficient

  !> Writes the series of a strip.
  subroutine write_strip(series, state, laws, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    integer :: b, i, run

    call write_coefficient(series, layout, code)
    call code%line('/* The numbers of a strip that its steps do not change, in z */')
    call code%line('INLINE void load_numbers(const int g, const strip *s, vd *z) {')
    call code%line('  EACH {')
    call code%line('    vd *w = z + WORK * e;')
    call code%line('    for (int i = 0; i < $; i++) w[at_ratio + i] = load(s->ratio + W * i + LANES * e);', &
                   [size(series%twists%column)])
    call code%line('    for (int i = 0; i < $; i++) w[at_response + i] = load(s->response + W * i + LANES * e);', &
                   [size(series%accelerations%column)])
    call code%line('    for (int i = 0; i < $ * ELEMENTS; i++) w[at_law + i] = load(s->law + W * i + LANES * e);', &
                   [size(series%law, 3)])
    call code%line('    w[at_time + 1] = 1.0 + (vd){};')
    call code%line('  }')
    call code%line('}')
    call code%line('/* The series of a strip, in z */')
    call code%line('INLINE void expand(const int g, const functions *f, const strip *s, vd *z) {')
    call code%line('  EACH {')
    call code%line('    const long left = s->left - LANES * e;')
    call code%line('    vd *w = z + WORK * e;')
    call code%line('    w[at_time] = load_lanes(s->t + LANES * e, left);')
    call code%line('    for (int i = 0; i < COMPONENTS; i++) w[at_c + i] = load_lanes(s->y + s->lanes * i + LANES * e, left);')
    do b = 1, size(series%banks%moved)
      associate (inputs => state%banks(series%banks%moved(b))%law)
        do i = 1, inputs%states
          if (inputs%state(i) == 0) cycle
          call code%line('    for (int i = 0; i < $; i++) w[at_b$n$ + (P + 1) * i] = w[at_c + 2 * FREEDOMS + $ + $ * i];', &
                         [inputs%law%elements, b - 1, inputs%state(i), first_state(series, laws(b)) + i - 1, inputs%states])
        end do
      end associate
    end do
    call code%line('  }')
    do run = 1, size(layout%first) - 1
      if (.not. has_motion(series, layout%first(run))) cycle
      call write_calls(layout, layout%first(run + 1) - layout%first(run), filled('begin_run$', [run]), 'i, s, z', code)
    end do
    do b = size(series%banks%moved) + 1, size(laws)
      associate (n => laws(b)%law%elements)
        call write_calls(layout, n, filled('bank$', [b - 1]), '0, i, f, s, z, 0, 0, 0, 0, 0, 0', code)
        call code%line('  for (int k = 1; k < P; k++) {')
        call write_calls(layout, n, filled('bank$', [b - 1]), 'k, i, f, s, z, 0, 0, 0, 0, 0, 0', code)
        call code%line('  }')
      end associate
    end do
    call code%line('  coefficient(g, 0, f, s, z);')
    call code%line('  UNROLL for (int k = 1; k < P; k++) coefficient(g, k, f, s, z);')
    call code%line('}')
  end subroutine write_strip

  !> Writes the procedures that are called.
  subroutine write_entries(series, laws, code)
    type(reduced_series_t), intent(in) :: series
    type(law_code_t), intent(in) :: laws(:)
    type(code_text_t), intent(inout) :: code
    integer :: b

    call code%line('/* The strip that begins with lane `first` */')
    call code%line('static strip strip_from(const long first, const long lanes, const double *const *numbers, const double *t,')
    call code%line('                        const double *y) {')
    call code%line('  const long strips = (lanes + W - 1) / W, number = first / W, within = first % W;')
    call code%line('  return (strip){lanes, lanes - first, number,')
    call code%line('    numbers[0] + W * ELEMENTS * $ * number + within, numbers[1] + W * $ * number + within,', &
                   [size(series%law, 3), size(series%twists%column)])
    call code%line('    numbers[2] + W * $ * number + within, numbers[3] + first, t + first, y + first, {', &
                   [size(series%accelerations%column)])
    do b = 1, size(laws)
      call code%line('      numbers[$] + W * $ * number + within,', [2 + 2 * b, laws(b)%law%elements])
    end do
    call code%line('    }, {')
    do b = 1, size(laws)
      call code%line('      numbers[$] + within,', [3 + 2 * b])
    end do
    call code%line('    }, {')
    do b = 1, size(laws)
      call code%line('      W * $ * strips,', [laws(b)%law%elements])
    end do
    call code%line('    }};')
    call code%line('}')
    call code%line('/* How many times eight lanes of a strip are computed at once */')
    call code%line('static long groups_of(const strip *s) { return ACROSS && s->left > LANES ? MOST : 1; }')
    call code%line('static void load_strip(const long g, const strip *s, vd *z) {')
    call code%line('  if (ACROSS && g > 1)')
    call code%line('    load_numbers(MOST, s, z);')
    call code%line('  else')
    call code%line('    load_numbers(1, s, z);')
    call code%line('}')
    call code%line('static void expand_strip(const long g, const functions *f, const strip *s, vd *z) {')
    call code%line('  if (ACROSS && g > 1)')
    call code%line('    expand(MOST, f, s, z);')
    call code%line('  else')
    call code%line('    expand(1, f, s, z);')
    call code%line('}')
    call code%line('long nocdyn_work(void) { return sizeof(vd) * (WORK * (ACROSS ? MOST : 1) + 1); }')
    call code%line('static vd *aligned(char *space) { ' // &
                   'return (vd *)(((unsigned long)space + sizeof(vd) - 1) / sizeof(vd) * sizeof(vd)); }')
    call code%line('void nocdyn_series(long lanes, long columns, const double *const *numbers, char *space, const functions *f,')
    call code%line('                   const double *t, double *y) {')
    call code%line('  vd *z = aligned(space);')
    call code%line('  for (long first = 0, g; first < lanes; first += LANES * g) {')
    call code%line('    const strip part = strip_from(first, lanes, numbers, t, y);')
    call code%line('    g = groups_of(&part);')
    call code%line('    load_strip(g, &part, z);')
    call code%line('    expand_strip(g, f, &part, z);')
    call code%line('    for (int e = 0; e < g; e++)')
    call code%line('      for (int k = 1; k <= P; k++)')
    call code%line('        for (int i = 0; i < COMPONENTS; i++)')
    call code%line('          store_lanes(z[at_c + COMPONENTS * k + i + WORK * e], ' // &
                   'y + lanes * (columns * k + i) + first + LANES * e,')
    call code%line('                      lanes - first - LANES * e);')
    call code%line('  }')
    call code%line('}')
  end subroutine write_entries

end module nocdyn_series_code
