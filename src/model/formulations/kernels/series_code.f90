!> Code of the Taylor recurrence of a machine: what `nocdyn_reduced_series` carries out, as a program in C for blocks of lanes.
!>
!> The code depends on the structure of the machine alone: which elements, laws and maps there are. All numbers are arguments.
!> Consecutive elements with equal terms are loops, so that it stays short however large the machine is.
module nocdyn_series_code
  use nocdyn_code_text, only: code_text_t, filled, list_of
  use nocdyn_compiled_code, only: series_source
  use nocdyn_element_laws, only: element_law_t
  use nocdyn_law_code, only: law_code_t, new_law_code
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_reduced_series, only: reduced_series_t
  use nocdyn_series_terms, only: has_cubic, has_forcing, has_history
  implicit none (type, external)
  private

  public :: write_series_code, code_obstacle

  !> Where the numbers of the elements stand in the work space.
  type :: layout_t
    integer, allocatable :: entries(:)   !! of U, [elements]
    integer, allocatable :: motion(:)    !! angle and speed, from 0, [elements + 1]
    integer, allocatable :: square(:)    !! square of the angle, [elements + 1]
    integer, allocatable :: bank(:)      !! number of the general bank of the element in the code, -1: none, [elements]
  end type layout_t

contains

  !> Why the series of a machine have no code, '' if they have.
  function code_obstacle(series) result(text)
    type(reduced_series_t), intent(in) :: series
    character(len=:), allocatable :: text

    text = ''
    if (series%lanes == 1) text = 'blocks of one lane have none'
    if (size(series%with_work) > 0) text = 'work is integrated'
  end function code_obstacle

  !> Writes the program. Its procedure `nocdyn_series` is described in `nocdyn_compiled_series`.
  subroutine write_series_code(series, state, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(code_text_t), intent(inout) :: code
    type(law_code_t), allocatable :: laws(:)
    type(layout_t) :: layout
    integer :: b, moved

    moved = size(series%banks%moved)
    allocate (laws(moved + size(series%banks%timed)))
    do b = 1, size(laws)
      associate (bank_law => state%banks(number_of(series, b))%law)
        laws(b) = new_law_code(b - 1, bank_law%law, bank_law%series, bank_law)
      end associate
    end do
    call lay_out(series, state, layout)
    call code%line('#define P $', [series%order])
    call code%line('#define W $', [series%w])
    call code%line('#define ELEMENTS $', [series%elements])
    call code%line('#define FREEDOMS $', [series%freedoms])
    call code%line('#define INTERNAL $', [series%internal])
    call code%line(series_source())
    call write_data(series, state, laws, layout, code)
    do b = moved + 1, size(laws)
      call write_forcing(state%banks(number_of(series, b))%law, laws(b), code)
    end do
    do b = 1, moved
      call write_bank(series, state%banks(number_of(series, b))%law, laws(b), code)
    end do
    call write_start(series, layout, code)
    call write_coefficient(series, state, laws, layout, code)
    call write_entry(series, state, laws, code)
  end subroutine write_series_code

  !> The number in the machine of a bank in the code.
  pure integer function number_of(series, b) result(number)
    type(reduced_series_t), intent(in) :: series
    integer, intent(in) :: b

    if (b <= size(series%banks%moved)) then
      number = series%banks%moved(b)
    else
      number = series%banks%timed(b - size(series%banks%moved))
    end if
  end function number_of

  subroutine lay_out(series, state, layout)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(layout_t), intent(out) :: layout
    integer :: b, e, first

    allocate (layout%motion(series%elements + 1), layout%square(series%elements + 1), source=0)
    allocate (layout%bank(series%elements), source=-1)
    layout%entries = series%twists%first(2:) - series%twists%first(:series%elements)
    do e = 1, series%elements
      layout%motion(e + 1) = layout%motion(e) + merge(series%order + 1, 1, iand(series%terms(e), has_history) > 0)
      layout%square(e + 1) = layout%square(e) + merge(series%order + 1, 0, iand(series%terms(e), has_cubic) > 0)
    end do
    do b = 1, size(series%banks%moved)
      first = series%banks%first(series%banks%moved(b))
      associate (law => state%banks(series%banks%moved(b))%law)
        layout%bank(first:first + law%ports * law%law%elements - 1) = b - 1
      end associate
    end do
  end subroutine lay_out

  !> Writes the tables and the work space.
  subroutine write_data(series, state, laws, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    integer :: b, no_states(0)

    call code%line('static const int twist_column[] = {@};', a=list_of(series%twists%column - 1))
    call code%line('static const int response_column[] = {@};', a=list_of(series%accelerations%column - 1))
    do b = 1, size(laws)
      call laws(b)%declare_tables(code)
    end do
    call code%line('typedef struct {')
    call code%line('  vd q[FREEDOMS], rate[FREEDOMS], moment[ELEMENTS], time[P + 1];')
    associate (motions => layout%motion(series%elements + 1), squares => layout%square(series%elements + 1) + 1)
      call code%line('  vd angle[$], speed[$], square[$];', [motions, motions, squares])
    end associate
    do b = 1, size(laws)
      associate (law => state%banks(number_of(series, b))%law)
        if (b <= size(series%banks%moved)) then
          call laws(b)%declare_work(law%state, code)
        else
          call laws(b)%declare_work(no_states, code)
          call code%line('  vd forcing$[$][P];', [b - 1, law%law%elements])
        end if
      end associate
    end do
    call code%line('} work;')
    call code%line('typedef struct {')
    call code%line('  long lanes, columns, left, strip;   /* left: lanes from the first one of the eight on */')
    call code%line('  const double *law, *ratio, *response, *origin;')
    call code%line('  double *y;')
    call code%line('  const double *constant[$], *stacked[$];', [max(size(laws), 1), max(size(laws), 1)])
    call code%line('  long slots[$];', [max(size(laws), 1)])
    call code%line('} strip;')
  end subroutine write_data

  !> Writes the series of the moments of a bank that follow from the time alone.
  subroutine write_forcing(inputs, law, code)
    type(element_law_t), intent(in) :: inputs
    type(law_code_t), intent(in) :: law
    type(code_text_t), intent(inout) :: code

    call code%line('INLINE void forcing_coefficient$(const int k, const int i, const functions *f, const strip *s, work *z) {', &
                   [law%bank])
    if (inputs%time > 0) call code%line('    const vd *n$ = z->time;', [inputs%time])
    call law%write_nodes(code)
    call code%line('    z->forcing$[i][k] = @;', [law%bank], law%operand(inputs%law%tape%applied))
    call code%line('}')
    call code%line('static void find_forcing$(const functions *f, const strip *s, work *z) {', [law%bank])
    call code%line('  for (int i = 0; i < $; i++) {', [inputs%law%elements])
    call code%line('    forcing_coefficient$(0, i, f, s, z);', [law%bank])
    call code%line('    forcing_coefficient$(1, i, f, s, z);', [law%bank])
    call code%line('    for (int k = 2; k < P; k++) forcing_coefficient$(k, i, f, s, z);', [law%bank])
    call code%line('  }')
    call code%line('}')
  end subroutine write_forcing

  !> The last element of the run of consecutive elements that a loop can treat alike.
  pure integer function end_of_run(series, layout, e) result(last)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: e

    last = e
    do while (last < series%elements)
      if (layout%bank(last + 1) /= layout%bank(e) .or. series%terms(last + 1) /= series%terms(e) .or. &
          layout%entries(last + 1) /= layout%entries(e)) exit
      last = last + 1
    end do
  end function end_of_run

  !> Writes the motion at the start of a step.
  subroutine write_start(series, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    integer :: e, last

    call code%line('static void start(const strip *s, work *z) {')
    e = 1
    do while (e <= series%elements)
      last = end_of_run(series, layout, e)
      if (series%terms(e) /= has_forcing) then
        call code%line('  for (int i = 0; i < $; i++)', [last - e + 1])
        call code%line('    begin_element($, @, s->origin + s->lanes * ($ + i), s->left, z->q, z->rate, @);', &
                       [series%terms(e), e - 1], element_arguments(series, layout, e), motion_arguments(layout, e, 'i'))
      end if
      e = last + 1
    end do
    call code%line('}')
  end subroutine write_start

  !> Number of entries of U, ratios, columns, law of element i of a run that begins with e.
  function element_arguments(series, layout, e) result(text)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: e
    character(len=:), allocatable :: text

    associate (n => layout%entries(e), first => series%twists%first(e) - 1)
      text = filled('$, s->ratio + W * ($ + $ * i), twist_column + $ + $ * i, s->law + W * ($ + i)', [n, first, n, first, n, e - 1])
    end associate
  end function element_arguments

  !> Addresses of angle and speed of element i of a run that begins with e.
  function motion_arguments(layout, e, i) result(text)
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: e
    character(len=*), intent(in) :: i
    character(len=:), allocatable :: text

    associate (first => layout%motion(e), step => layout%motion(e + 1) - layout%motion(e))
      text = filled('z->angle + $ + $ * @, z->speed + $ + $ * @', [first, step, first, step], i, i)
    end associate
  end function motion_arguments

  !> Writes what computes coefficients k + 1 of the state.
  subroutine write_coefficient(series, state, laws, layout, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(in) :: layout
    type(code_text_t), intent(inout) :: code
    integer :: c, e, last, n

    call code%line('INLINE void coefficient(const int k, const functions *f, const strip *s, work *z) {')
    call code%line('  double *y = s->y + s->lanes * s->columns * (k + 1);')
    e = 1
    do while (e <= series%elements)
      last = end_of_run(series, layout, e)
      if (layout%bank(e) < 0) then
        call write_polynomial_run(series, state, laws, layout, e, last, code)
      else
        call write_bank_run(series, layout, e, last, state%banks(series%banks%moved(layout%bank(e) + 1))%law, &
                            laws(layout%bank(e) + 1), code)
      end if
      e = last + 1
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
        call code%line('    accelerate(k, $, s->response + W * ($ + $ * i), response_column + $ + $ * i, z->moment,', &
                       [n, first(c) - 1, n, first(c) - 1, n])
        call code%line('               z->rate + $ + i, y + s->lanes * ($ + i), y + s->lanes * (FREEDOMS + $ + i), s->left);', &
                       [c - 1, c - 1, c - 1])
        c = last + 1
      end do
    end associate
    call code%line('}')
  end subroutine write_coefficient

  !> Writes the call that moves element i of a run that begins with e.
  subroutine write_move(series, layout, e, forcing, moments, code)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: e
    character(len=*), intent(in) :: forcing   !! address of the moments that follow from the time
    character(len=*), intent(in) :: moments   !! addresses of the results
    type(code_text_t), intent(inout) :: code

    call code%line('    move_element(k, $, @, @, z->rate,', [series%terms(e)], element_arguments(series, layout, e), forcing)
    call code%line('                 @, z->square + $ + $ * i, @);', [layout%square(e), layout%square(e + 1) - layout%square(e)], &
                   motion_arguments(layout, e, 'i'), moments)
  end subroutine write_move

  !> Writes the moments of elements with polynomial laws, and of those that follow from the time.
  subroutine write_polynomial_run(series, state, laws, layout, first, last, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: first, last
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable :: forcing
    integer :: b, begin, from, to

    from = first
    do while (from <= last)   ! a run may have elements of several banks
      to = last
      forcing = '0'
      do b = size(series%banks%moved) + 1, size(laws)
        begin = series%banks%first(number_of(series, b))
        associate (end => begin + state%banks(number_of(series, b))%law%law%elements - 1)
          if (from < begin .or. from > end) cycle
          to = min(last, end)
          forcing = filled('z->forcing$[$ + i]', [b - 1, from - begin])
        end associate
      end do
      call code%line('  for (int i = 0; i < $; i++) {', [to - from + 1])
      call code%line('    vd r, a;')
      call write_move(series, layout, from, forcing, '&r, &a', code)
      call code%line('    z->moment[$ + i] = r + a;', [from - 1])
      call code%line('  }')
      from = to + 1
    end do
  end subroutine write_polynomial_run

  !> Writes the moments of elements of a bank with a general law, and the coefficients of its internal states. Phases are written
  !> with their elements.
  subroutine write_bank_run(series, layout, first, last, inputs, law, code)
    type(reduced_series_t), intent(in) :: series
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: first, last
    type(element_law_t), intent(in) :: inputs
    type(law_code_t), intent(in) :: law
    type(code_text_t), intent(inout) :: code
    integer :: begin, count, from, to

    begin = series%banks%first(series%banks%moved(law%bank + 1))
    count = inputs%law%elements
    from = first
    do while (from <= min(last, begin + count - 1))
      to = min(last, begin + count - 1)
      if (inputs%ports > 1) to = min(to, end_of_run(series, layout, from + count) - count)
      call code%line('  for (int i = 0; i < $; i++) {', [to - from + 1])
      call code%line('    vd r, a;')
      call write_move(series, layout, from, '0', '&r, &a', code)
      if (inputs%ports > 1) then
        call code%line('    vd r2, a2;')
        call write_move(series, layout, from + count, '0', '&r2, &a2', code)
      end if
      call code%line('    bank$(k, $ + i, f, s, z, y, @,', [law%bank, from - begin], motion_arguments(layout, from, 'i'))
      if (inputs%ports > 1) then
        call code%line('         @, &r, &a, &r2, &a2);', a=motion_arguments(layout, from + count, 'i'))
        call code%line('    z->moment[$ + i] = r2 + a2;', [from + count - 1])
      else
        call code%line('         0, 0, &r, &a, 0, 0);')
      end if
      call code%line('    z->moment[$ + i] = r + a;', [from - 1])
      call code%line('  }')
      from = to + 1
    end do
  end subroutine write_bank_run

  !> Writes what adds the moments of element i of a bank, and computes coefficients k + 1 of its internal states.
  subroutine write_bank(series, inputs, law, code)
    type(reduced_series_t), intent(in) :: series
    type(element_law_t), intent(in) :: inputs
    type(law_code_t), intent(in) :: law
    type(code_text_t), intent(inout) :: code
    character(len=:), allocatable :: value
    integer :: i, state

    call code%line('INLINE void bank$(const int k, const int i, const functions *f, const strip *s, work *z, double *y,', &
                   [law%bank])
    call code%line('                  const vd *angle, const vd *speed, const vd *angle2, const vd *speed2,')
    call code%line('                  vd *r, vd *a, vd *r2, vd *a2) {')
    if (inputs%angle > 0) call code%line('    const vd *n$ = angle;', [inputs%angle])
    if (inputs%speed > 0) call code%line('    const vd *n$ = speed;', [inputs%speed])
    if (inputs%phase > 0) call code%line('    const vd *n$ = angle2;', [inputs%phase])
    if (inputs%phase_speed > 0) call code%line('    const vd *n$ = speed2;', [inputs%phase_speed])
    if (inputs%time > 0) call code%line('    const vd *n$ = z->time;', [inputs%time])
    do i = 1, inputs%states
      if (inputs%state(i) > 0) call code%line('    vd *n$ = z->b$n$[i];', [inputs%state(i), law%bank, inputs%state(i)])
    end do
    call law%write_nodes(code)
    call add_result('r', inputs%law%tape%restoring)
    call add_result('a', inputs%law%tape%applied)
    call add_result('r2', inputs%law%tape%phase_restoring)
    call add_result('a2', inputs%law%tape%phase_applied)
    do i = 1, inputs%states
      state = inputs%state(i)
      value = filled('(1.0 / (k + 1)) * @', [integer ::], law%operand(inputs%law%tape%rate(i)))
      if (state > 0) then
        call code%line('    n$[k + 1] = @;', [state], value)
        value = filled('n$[k + 1]', [state])
      end if
      call code%line('    store_lanes(@, y + s->lanes * (2 * FREEDOMS + $ + $ * i), s->left);', &
                     [first_state(series, law) + i - 1, inputs%states], value)
    end do
    call code%line('}')

  contains

    subroutine add_result(name, node)
      character(len=*), intent(in) :: name
      integer, intent(in) :: node

      if (node > 0) call code%line('    *@ = *@ + @;', a=name, b=name, c=law%operand(node))
    end subroutine add_result

  end subroutine write_bank

  !> The internal states before those of a bank.
  pure integer function first_state(series, law)
    type(reduced_series_t), intent(in) :: series
    type(law_code_t), intent(in) :: law

    first_state = series%banks%first_internal(series%banks%moved(law%bank + 1)) - 1
  end function first_state

  !> Writes the procedure that is called.
  subroutine write_entry(series, state, laws, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(law_code_t), intent(in) :: laws(:)
    type(code_text_t), intent(inout) :: code
    integer :: b, i

    call code%line('long nocdyn_series_work(void) { return sizeof(work) + sizeof(vd); }')
    call code%line('void nocdyn_series(long lanes, long columns, const double *const *numbers, char *space, const functions *f,')
    call code%line('                   const double *t, double *y) {')
    call code%line('  work *z = (work *)(((unsigned long)space + sizeof(vd) - 1) / sizeof(vd) * sizeof(vd));')
    call code%line('  const long strips = (lanes + W - 1) / W;')
    call code%line('  strip of, *s = &of;')
    call code%line('  s->lanes = lanes;')
    call code%line('  s->columns = columns;')
    do b = 1, size(laws)
      call code%line('  s->slots[$] = W * $ * strips;', [b - 1, laws(b)%law%elements])
    end do
    call code%line('  z->time[1] = 1.0 + (vd){};')
    call code%line('  for (long first = 0; first < lanes; first += LANES) {')
    call code%line('    const long strip = first / W, within = first % W;')
    call code%line('    s->left = lanes - first;')
    call code%line('    s->strip = strip;')
    call code%line('    s->law = numbers[0] + W * ELEMENTS * $ * strip + within;', [size(series%law, 3)])
    call code%line('    s->ratio = numbers[1] + W * $ * strip + within;', [size(series%twists%column)])
    call code%line('    s->response = numbers[2] + W * $ * strip + within;', [size(series%accelerations%column)])
    call code%line('    s->origin = numbers[3] + first;')
    call code%line('    s->y = y + first;')
    do b = 1, size(laws)
      call code%line('    s->constant[$] = numbers[$] + W * $ * strip + within;', [b - 1, 2 + 2 * b, laws(b)%law%elements])
      call code%line('    s->stacked[$] = numbers[$] + within;', [b - 1, 3 + 2 * b])
    end do
    call code%line('    z->time[0] = load_lanes(t + first, s->left);')
    call code%line('    for (int i = 0; i < FREEDOMS; i++) {')
    call code%line('      z->rate[i] = load_lanes(s->y + lanes * i, s->left);')
    call code%line('      z->q[i] = load_lanes(s->y + lanes * (FREEDOMS + i), s->left);')
    call code%line('    }')
    do b = 1, size(series%banks%moved)
      associate (inputs => state%banks(series%banks%moved(b))%law)
        do i = 1, inputs%states
          if (inputs%state(i) == 0) cycle
          call code%line('    for (int i = 0; i < $; i++)', [inputs%law%elements])
          call code%line('      z->b$n$[i][0] = load_lanes(s->y + lanes * (2 * FREEDOMS + $ + $ * i), s->left);', &
                         [b - 1, inputs%state(i), first_state(series, laws(b)) + i - 1, inputs%states])
        end do
      end associate
    end do
    call code%line('    start(s, z);')
    do b = size(series%banks%moved) + 1, size(laws)
      call code%line('    find_forcing$(f, s, z);', [b - 1])
    end do
    call code%line('    coefficient(0, f, s, z);')
    call code%line('    coefficient(1, f, s, z);')
    call code%line('    for (int k = 2; k < P; k++) coefficient(k, f, s, z);')
    call code%line('  }')
    call code%line('}')
  end subroutine write_entry

end module nocdyn_series_code
